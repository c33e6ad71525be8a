"""Jobs become tasks; what no command takes is refused before anything runs."""

from __future__ import annotations

from pathlib import Path

from postproc.batch.fingerprint import keys_of
from tests.postproc.batch.batch_kit import JOBS, batch_folder, planned, with_keys

MANY = """output = "out"
machines = ["mill-3axis", "mine.toml"]
controllers = ["linuxcnc", "siemens-840d"]
[options]
setup = ["s.toml", "t.toml"]
[[jobs]]
name = "programs"
files = ["part1.cls", "*.cls"]
[jobs.options]
feed = "planned"
smooth = [true, false]
[[jobs]]
name = "times"
command = "time"
files = ["part1.cls"]
machines = ["mill-3axis"]
[jobs.options]
override = [50.0, 100]
with_setup = ["s.toml", "t.toml"]
"""


def test_files_machines_controllers_and_options_are_multiplied(tmp_path: Path) -> None:
    tasks, wrong = planned(batch_folder(tmp_path, MANY))
    assert wrong == []
    programs = [t for t in tasks if t.job == "programs"]
    assert len(programs) == 3 * 2 * 2 * 2 * 2
    assert len({t.figures for t in tasks}) == len(tasks) == 48 + 1 * 1 * 2 * 2 * 2
    first = programs[0]
    assert first.arguments() == ("convert", str(tmp_path / "part1.cls"), "--machine=mill-3axis", "--controller=linuxcnc",
                                 "--feed=planned", f"--setup={tmp_path / 's.toml'}", "--smooth",
                                 f"--output={tmp_path / 'out/programs/part1.mill-3axis.linuxcnc.setup-s.smooth.ngc'}",
                                 f"--json={tmp_path / 'out/programs/part1.mill-3axis.linuxcnc.setup-s.smooth.json'}")
    assert {t.output.suffix for t in programs if t.output and t.controller == "siemens-840d"} == {".mpf"}
    assert any(t.machine == str(tmp_path / "mine.toml") for t in programs)
    timed = next(t for t in tasks if t.job == "times")
    assert timed.output is None and "--override=50.0" in timed.arguments()
    assert [w for w in timed.arguments() if w.startswith("--with-setup=")] == ["--with-setup=s.toml", "--with-setup=t.toml"]


def _codes(tmp_path: Path, jobs: str) -> list[tuple[str, tuple[int, ...]]]:
    return [(d.code, d.lines) for d in planned(batch_folder(tmp_path, jobs))[1]]


def test_what_is_wrong_has_its_line(tmp_path: Path) -> None:
    assert _codes(tmp_path, JOBS + "[jobs.options]\nfead = 1\n") == [("batch.option", (9,))]
    assert _codes(tmp_path, JOBS + '[jobs.options]\noutput = "x"\n') == [("batch.option", (9,))]
    assert _codes(tmp_path, JOBS.replace("setup", "setop")) == [("batch.option", (5,))]
    assert _codes(tmp_path, JOBS.replace("*.cls", "*.apt")) == [("batch.no_file", (7,))]
    assert _codes(tmp_path, JOBS.replace('machines = ["mill-3axis"]\n', "")) == [("batch.nothing_stated", (5,))]
    assert _codes(tmp_path, JOBS + 'name = "a"\n[[jobs]]\nname = "a"\nfiles = ["*.cls"]\n')[0][0] == "batch.same_name"
    assert _codes(tmp_path, JOBS + "filez = 1\n")[0][1] == (8,)


def test_two_runs_into_one_file_are_refused(tmp_path: Path) -> None:
    other = tmp_path / "b"
    other.mkdir()
    (other / "Part1.cls").write_text("FINI\n", encoding="utf-8")
    assert _codes(tmp_path, JOBS.replace('"*.cls"', '"*.cls", "b/*.cls"'))[0][0] == "batch.same_output"


def test_a_name_that_holds_a_pattern_is_a_name(tmp_path: Path) -> None:
    jobs = batch_folder(tmp_path, JOBS.replace("*.cls", "p[1].cls"))
    (tmp_path / "p[1].cls").write_text("FINI\n", encoding="utf-8")
    assert [t.file.name for t in planned(jobs)[0]] == ["p[1].cls"]


def test_a_key_changes_with_every_byte_that_a_task_reads(tmp_path: Path) -> None:
    jobs = batch_folder(tmp_path)
    before = [key for _, key in with_keys(jobs)]
    (tmp_path / "part2.cls").write_bytes((tmp_path / "part2.cls").read_bytes() + b"\n")
    changed = [key for _, key in with_keys(jobs)]
    assert [a == b for a, b in zip(before, changed, strict=True)] == [True, False, True]
    (tmp_path / "s.toml").write_bytes((tmp_path / "s.toml").read_bytes() + b"\n")
    assert not {key for _, key in with_keys(jobs)} & set(changed)
    (tmp_path / "postproc.toml").write_text("tolerance = 0.02\n", encoding="utf-8")
    tasks, _ = planned(jobs)
    with_job = keys_of(tasks)
    (tmp_path / "postproc.toml").write_text("tolerance = 0.03\n", encoding="utf-8")
    assert not set(keys_of(tasks)) & set(with_job)
    (tmp_path / "postproc.toml").unlink()
    jobs.write_text(JOBS + "[jobs.options]\ntolerance = 0.02\n", encoding="utf-8")
    assert not {key for _, key in with_keys(jobs)} & {*before, *changed, *with_job}


def test_names_of_folders_and_files_may_hold_what_is_a_pattern_or_no_ascii(tmp_path: Path) -> None:
    folder = tmp_path / "job [7]"
    (folder / "Teile [a]").mkdir(parents=True)
    jobs = batch_folder(folder, JOBS.replace("*.cls", "Teile [a]/*.cls"), parts=0)
    for name in ("\u00fc.cls", "\u00f6.cls", "x[1].cls", "a b.cls"):
        (folder / "Teile [a]" / name).write_text("", encoding="utf-8")
    tasks, wrong = planned(jobs)
    names = ["a_b.json", "x_1_.json", "\u00f6.json", "\u00fc.json"]
    assert wrong == [] and sorted(task.figures.name for task in tasks) == names
    again, wrong = planned(batch_folder(folder, JOBS.replace("*.cls", f"{folder}/Teile [a]/*.cls"), parts=0))
    assert wrong == [] and [task.file for task in again] == [task.file for task in tasks]
    assert planned(batch_folder(folder, JOBS.replace("*.cls", "**/*.cls"), parts=0))[0] != []
