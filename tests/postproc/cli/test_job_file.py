"""postproc.toml: found upwards from the CL file, taken where the command line leaves an option out, named when it is."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import typer

from postproc.cli.app import app
from postproc.cli.shared.job_defaults import given_defaults
from postproc.cycle_time import conversion
from postproc.pipeline.stages import STAGES
from postproc.setup.job_file import JobFile
from tests.postproc.cli.test_cli import run
from tests.postproc.kit import HEAD

LINES = ["RAPID", "GOTO/0,0,5", "GOTO/0,0,0", "GOTO/9,0,0", "RAPID", "GOTO/9,0,5"]
JOB = 'machine = "mill-3axis"\ncontroller = "haas-ngc"\nsetup = "s.toml"\ntolerance = 0.02\n'


@pytest.fixture
def part(tmp_path: Path) -> Path:
    """A CL file below a job file."""
    folder = tmp_path / "job" / "cl" / "side1"
    folder.mkdir(parents=True)
    file = folder / "part.apt"
    file.write_text("\n".join([*HEAD, *LINES, "FINI"]))
    (tmp_path / "job" / "postproc.toml").write_text(JOB)
    (tmp_path / "job" / "s.toml").write_text("[tools.1]\ngauge_length = 100.0\n")
    return file


def test_the_file_of_a_batch_is_none_of_a_job(part: Path, tmp_path: Path) -> None:
    (tmp_path / "job" / "postproc.toml").write_text('[[jobs]]\nmachine = "mill-3axis"\n')
    got = run("convert", part, "-o", tmp_path / "p.nc")
    assert got.exit_code == 1 and "several are the file of postproc batch" in got.stderr


def test_the_command_takes_what_is_left_out_and_names_the_file(part: Path, tmp_path: Path) -> None:
    out = tmp_path / "p.nc"
    got = run("convert", part, "-o", out)
    assert got.exit_code == 0, got.stderr
    assert got.stderr.splitlines()[0] == (
        f"{tmp_path}/job/postproc.toml: machine mill-3axis, controller haas-ngc, "
        f"setup {tmp_path}/job/s.toml, tolerance 0.02")
    text = out.read_text()
    assert "(CONTROLLER HAAS-NGC)" in text and "(TOLERANCE 0.02 MM" in text and "GAUGE LENGTH 100" in text
    assert run("verify", out, part).exit_code == 0
    assert run("trace", part, "--line", "7").exit_code == 0 and run("time", part).exit_code == 0
    got = run("report", part, "-o", tmp_path / "r.html")
    assert got.exit_code == 0 and b"mill-3axis" in (tmp_path / "r.html").read_bytes()
    assert "mill-3axis" in run("setup", "new", part, "-o", tmp_path / "n.toml", "--yes").stderr


def test_the_command_line_goes_before_it(part: Path, tmp_path: Path) -> None:
    out = tmp_path / "p.nc"
    for words in (["-c", "linuxcnc"], ["-clinuxcnc"], ["--controller=linuxcnc"]):
        got = run("convert", part, *words, "--tolerance", "0.01", "-o", out)
        assert got.exit_code == 0 and "controller" not in got.stderr.splitlines()[0], words
        assert "(controller linuxcnc)" in out.read_text() and "(tolerance 0.01 mm" in out.read_text()


def test_the_nearest_counts_and_without_one_nothing_changes(part: Path, tmp_path: Path) -> None:
    (part.parent / "postproc.toml").write_text('controller = "linuxcnc"\n')
    got = run("convert", part, "-o", tmp_path / "p.nc")
    assert got.exit_code == 2 and "--machine" in got.stderr, "the file above is not read besides"
    (part.parent / "postproc.toml").unlink()
    (tmp_path / "job" / "postproc.toml").unlink()
    assert run("convert", part, "-o", tmp_path / "p.nc").exit_code == 2


def test_hooks_of_the_job_hold_under_those_of_the_set_up_and_are_part_of_the_proof(part: Path, tmp_path: Path) -> None:
    job, out = tmp_path / "job" / "postproc.toml", tmp_path / "job" / "p.nc"
    job.write_text(JOB + '[hooks]\nbefore_tool = ["M31"]\nbefore_stop = ["M32"]\npassive = ["M31", "M32", "M33"]\n')
    assert run("convert", part, "-o", out, "--proof").exit_code == 0
    assert "M31\n" in out.read_text() and run("verify", out, part).exit_code == 0 and run("time", out).exit_code == 0
    job.write_text(job.read_text().replace("M31", "M33"))
    got = run("verify", out, part)
    assert got.exit_code == 1 and "[verify.setup]" in got.stderr and "[proof.setup]" in got.stderr
    (tmp_path / "job" / "s.toml").write_text('[tools.1]\ngauge_length = 100.0\n[hooks]\nbefore_tool = ["M32"]\n')
    assert run("convert", part, "-o", out).exit_code == 0 and "M33" not in out.read_text() and "M32" in out.read_text()
    own = tmp_path / "own.toml"
    own.write_text('[hooks]\nafter_tool = ["M34"]\npassive = ["M34", "M32"]\n')
    assert run("convert", part, "-o", out, "--hooks", own).exit_code == 0 and "M34" in out.read_text()
    own.write_text('[hooks]\nafter_tool = ["G91"]\npassive = ["M32"]\n')
    assert f"{own}:2: error [hooks.code]" in run("convert", part, "-o", out, "--hooks", own).stderr
    job.write_text(JOB + "hooks = true\n")
    assert "hooks" in run("convert", part, "-o", out).stderr


def test_faults_of_the_file_have_their_line_and_json(part: Path, tmp_path: Path) -> None:
    (tmp_path / "job" / "postproc.toml").write_text(JOB + "tolerence = 0.01\n")
    got = run("convert", part, "-o", tmp_path / "p.nc", "--json", "-")
    assert got.exit_code == 1 and not (tmp_path / "p.nc").exists()
    (fault,) = json.loads(got.stdout)["diagnostics"]
    assert (fault["code"], fault["lines"]) == ("file.unknown-key", [5]) and "tolerance" in fault["hint"]
    (tmp_path / "job" / "postproc.toml").write_text("tolerance = 0.01\n")  # as the hint says
    assert run("convert", part, "-m", "mill-3axis", "-c", "linuxcnc", "-o", tmp_path / "p.nc").exit_code == 0


def commands(command: object, names: tuple[str, ...] = ()) -> dict[str, set[str]]:
    """Parameters by command."""
    inner = getattr(command, "commands", None)
    if inner is None:
        return {" ".join(names): {p.name for p in command.params}}
    return {name: found for key, one in inner.items() for name, found in commands(one, (*names, key)).items()}


def test_every_key_is_an_option_and_every_command_with_a_machine_and_a_cl_file_takes_it(part: Path) -> None:
    found = commands(typer.main.get_command(app))
    assert set(JobFile.model_fields) <= found["convert"]
    on_cl_files = sorted(name for name, names in found.items() if {"machine", "dialect"} <= names)
    assert on_cl_files == ["convert", "orient", "place", "report", "setup align", "setup new", "time", "trace", "verify"]
    for name in on_cl_files:
        assert {"units", "allow_unknown", "tolerance"} <= found[name], f"{name}: what one command reads, all do"
        got = run(*name.split(), *({"verify": ["x.nc"], "setup align": ["x.csv"]}.get(name, [])), part, "--no-such-option")
        assert re.search(r"postproc\.toml: .*machine mill-3axis", got.stderr), name


def with_job_file(command: Any) -> list[Any]:
    """Commands on CL files, of all groups."""
    inner = list(getattr(command, "commands", {}).values())
    own = [command] if {"machine", "dialect"} <= {p.name for p in command.params} else []
    return own + [one for sub in inner for one in with_job_file(sub)]


def test_every_key_gives_way_to_every_spelling_of_its_option(part: Path, tmp_path: Path) -> None:
    """--tolerance X, --tolerance=X, -m X, -mX; what the command line leaves out is the job file's."""
    stated = {"machine": "mill-3axis", "controller": "haas-ngc", "setup": "s.toml", "hooks": "h.toml",
              "error_model": "e.toml", "tolerance": 0.02, "axis_tolerance": 0.2, "units": "mm", "dialect": "nx",
              "allow_unknown": ["A"]}
    assert set(stated) == set(JobFile.model_fields)
    lines = (f"{key} = {json.dumps(value)}\n" for key, value in stated.items())
    (tmp_path / "job" / "postproc.toml").write_text("".join(lines))

    def taken(command: Any, *words: str) -> set[str]:
        context = typer.Context(command)
        given_defaults(command, [*(["x.nc"] if command.name == "verify" else ["x.csv"] if command.name == "align" else []),
                                 str(part), *words], context)
        return set((context.default_map or {}).get(command.name, {}))

    for command in with_job_file(typer.main.get_command(app)):
        keys = {one.name for one in command.params} & set(stated)
        assert taken(command) == keys, command.name
        for one in (p for p in command.params if p.name in keys):
            for opt in one.opts:
                for words in ([opt, "q"], [f"{opt}=q"] if opt.startswith("--") else [f"{opt}q"]):
                    assert taken(command, *words) == keys - {one.name}, (command.name, words)


def test_strict_makes_warnings_errors(part: Path, tmp_path: Path) -> None:
    (tmp_path / "job" / "s.toml").write_text("")
    out = tmp_path / "p.nc"
    got = run("convert", part, "-o", out, "--strict", "--json", "-")
    values = json.loads(got.stdout)
    assert got.exit_code == 1 and not out.exists() and values["ok"] is False and values["output"] is None
    assert [d["code"] for d in values["diagnostics"] if d["severity"] == "error"] == ["tool.length"]
    (tmp_path / "job" / "s.toml").write_text("[tools.1]\ngauge_length = 100.0\n")  # as the hint says
    assert run("convert", part, "-o", out, "--strict").exit_code == 0 and out.exists()


def test_quiet_and_verbose(part: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "p.nc"
    asked, estimate = list[Any](), conversion.estimate_of
    monkeypatch.setattr(conversion, "estimate_of", lambda *a, **k: asked.append(a) or estimate(*a, **k))
    got = run("convert", part, "-o", out, "-q")
    assert got.exit_code == 0 and got.stdout == "" and got.stderr == "" and out.exists() and not asked, "no time"
    assert json.loads(run("convert", part, "-o", out, "-q", "--json", "-").stdout)["cycle_time_s"] > 0.0 and len(asked) == 1
    got = run("convert", part, "-o", out, "-q", "--model", "no.toml")
    assert got.exit_code == 1 and "no.toml" in got.stderr, "what is asked for is read"
    (tmp_path / "job" / "s.toml").write_text("")
    for words in (("--quiet",), ("-qm", "mill-3axis"), ("-qmmill-3axis",), ("-q",)):
        found = run("convert", part, "-o", out, *words).stderr
        assert "warning [tool.length]" in found and "info [" not in found, words
        assert found.startswith(f"{tmp_path}/job/postproc.toml: "), "where the values come from stands before what is wrong"
        assert ("machine mill-3axis" in found.splitlines()[0]) == (len(words) == 1 and "mmill" not in words[0]), words
    stages = run("convert", part, "-o", out, "-v").stderr.splitlines()
    assert [line for line in stages if ":" not in line] == ["reading", *(stage.name for stage in STAGES)]
    assert "verify" not in run("convert", part, "-o", out).stderr.splitlines(), "the option is for one command"


@pytest.mark.parametrize("stated", ["UNITS/INCHES\n", "FEDRAT/10,IPM\n"])
def test_its_units_never_go_against_those_of_a_file(part: Path, tmp_path: Path, stated: str) -> None:
    """A part was cut 25.4 times too small, with a warning."""
    job, out = part.parents[2] / "postproc.toml", tmp_path / "p.nc"
    job.write_text(JOB + 'units = "mm"\n')
    assert run("convert", part, "-o", out).exit_code == 0
    out.unlink()
    body = part.read_text().replace("UNITS/MM\n", "")
    feed = re.search(r"FEDRAT/.*\n", body)
    assert feed is not None
    part.write_text(body.replace(feed[0], stated) if "FEDRAT" in stated else stated + body)
    got = run("convert", part, "-o", out)
    assert got.exit_code == 1 and not out.exists() and "error [cl.units]" in got.stderr
    assert "for files that state none" in got.stderr
    part.write_text(part.read_text().replace("GOTO/9,0", "GOTO/600,0"))
    assert "travel.exceeded" not in run("convert", part, "-o", out).stderr, "what follows from the wrong unit is not said"
    assert "travel.exceeded" in run("convert", part, "-o", out, "--units", "mm").stderr
    part.write_text(part.read_text().replace("GOTO/600,0", "GOTO/9,0"))
    assert run("convert", part, "-o", out, "--units", "mm").exit_code == 0  # who says so on the command line knows the file
    assert "warning [cl.units]" in run("inspect", part, "--units", "mm").stderr


def test_no_output_takes_its_name(part: Path, tmp_path: Path) -> None:
    """A program in its place stopped every command below the folder."""
    job = part.parents[2] / "postproc.toml"
    for words in (("convert", part, "-o", job), ("setup", "new", part, "-o", job, "--force", "--yes"),
                  ("setup", "new", part, "-o", part.parent / "postproc.toml", "--yes"), ("inspect", part, "--json", job)):
        got = run(*words)
        assert got.exit_code == 2 and "job files" in got.stderr and job.read_text() == JOB
    assert not (part.parent / "postproc.toml").exists()
