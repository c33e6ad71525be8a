"""The command line under hostile use: outputs that would replace something, odd numbers, set-up files."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest
import typer

import postproc
from postproc.base.json_values import rounded
from postproc.cli.app import app
from tests.postproc.cli.test_cli import MILL, POCKET, cl, run
from tests.postproc.kit import SAMPLES, TOOLS

GOOD = ["RAPID", "GOTO/0,0,5", "GOTO/1,0,5"]


def test_outputs_that_would_replace_something_are_wrong_use(tmp_path: Path) -> None:
    path, out = cl(tmp_path, *GOOD), tmp_path / "p.ngc"
    setup = tmp_path / "s.toml"
    setup.write_bytes(TOOLS.read_bytes())
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    before = path.read_bytes()
    for arguments in (["convert", path, *MILL, "-o", out, "--json", path],
                      ["convert", path, *MILL, "-o", out, "--json", out],
                      ["convert", path, *MILL, "-o", setup, "--setup", setup], ["convert", path, *MILL, "-o", "-"],
                      ["convert", path, *MILL, "-o", out, "--json", setup, "--setup", setup],
                      ["convert", path, *MILL, "-o", fifo], ["convert", path, *MILL, "-o", "/dev/null"],
                      ["inspect", path, "--json", path], ["trace", path, *MILL, "--line", "6", "--json", path],
                      ["verify", POCKET, path, *MILL, "--json", POCKET]):
        got = run(*arguments)
        assert got.exit_code == 2 and "Traceback" not in got.stderr, arguments
    assert path.read_bytes() == before and not out.exists() and setup.read_bytes() == TOOLS.read_bytes()


@pytest.mark.parametrize(("arguments", "says"), [
    (["time", POCKET, *MILL, "--what-if", "X.velocity=abc"], "stands behind ="),
    (["time", POCKET, *MILL, "--what-if", "X.velocity=1.1,tool_change"], "stands behind ="),
    (["time", POCKET, *MILL, "--what-if", "X.velocity=0"], "stands behind ="),
    (["machine", "analyse", "uranesx", "--along", "x"], "for --along: this is of a map"),
    (["machine", "analyse", "uranesx", "--at", "z=-100"], "for --at: this is of a map"),
    (["machine", "analyse", "uranesx", "--along", "Q"], "for --along: Q")])
def test_wrong_use_names_the_option_that_is_wrong(arguments: list[str | Path], says: str) -> None:
    got = run(*arguments)
    assert got.exit_code == 2 and says in " ".join(got.stderr.split())


def test_texts_of_files_command_no_terminal(tmp_path: Path) -> None:
    """Escape sequences and signs that turn writing, in a name that is shown and in a record that is refused."""
    hostile = "\x1b[2J\x07\x9b31m\u202eX"
    path = cl(tmp_path, f"TPRINT/{hostile}", "RAPID", "GOTO/0,0,5", "GOTO/1,0,5")
    wrong = tmp_path / "wrong.cls"
    wrong.write_text(path.read_text() + f"\nGOTO/{hostile},1,2\n")
    for arguments, code, said in ((["inspect", path], 0, "points"), (["inspect", wrong], 1, "GOTO/"),
                                  (["convert", wrong, *MILL, "-o", tmp_path / "p.ngc"], 1, "GOTO/")):
        got = run(*arguments)
        assert got.exit_code == code and said in got.output, got.output
        assert not [c for c in got.output if c != "\n" and not c.isprintable()], repr(got.output)


def test_a_link_is_kept(tmp_path: Path) -> None:
    target, link = tmp_path / "real.ngc", tmp_path / "link.ngc"
    target.write_text("old")
    link.symlink_to(target)
    assert run("convert", cl(tmp_path, *GOOD), *MILL, "-o", link).exit_code == 0
    assert link.is_symlink() and target.read_text().startswith("%")
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    got = run("convert", cl(tmp_path, *GOOD), *MILL, "-o", loop)
    assert got.exit_code in (1, 2) and isinstance(got.exception, SystemExit)


@pytest.mark.parametrize("value", ["inf", "nan", "1e9", "0", "11"])
@pytest.mark.parametrize("option", ["--tolerance", "--axis-tolerance"])
def test_tolerances_have_bounds(option: str, value: str, tmp_path: Path) -> None:
    assert run("convert", POCKET, *MILL, "-o", tmp_path / "p.ngc", option, value).exit_code == 2


def test_version() -> None:
    got = run("--version")
    assert got.exit_code == 0 and got.stdout == f"postproc {postproc.VERSION}\n"


def test_json_numbers_are_short(tmp_path: Path) -> None:
    assert str(rounded({"a": [1 / 3, -1e-15, 2], "b": -0.0})) == "{'a': [0.333333333, 0.0, 2], 'b': 0.0}"
    got = run("convert", SAMPLES / "five_faces.cls", "-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", TOOLS, "-o",
              tmp_path / "p.ngc", "--json", "-")
    assert got.exit_code == 0 and not re.search(r"\d\.\d{10}|e-1\d", got.stdout)
    got = run("convert", SAMPLES / "five_faces.cls", "-m", "mikron-ucp710", "-c", "linuxcnc", "--setup", TOOLS, "-o",
              tmp_path / "p.ngc")
    assert "-0.000 " not in got.stdout


def test_json_to_a_place_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for arguments in (["convert", POCKET, *MILL, "-o", tmp_path / "p.ngc"], ["machine", "list"],
                      ["inspect", POCKET]):
        got = run(*arguments, "--json", tmp_path / "file" / "s.json")
        assert got.exit_code == 1 and "file.write" in got.stderr and isinstance(got.exception, SystemExit)


def test_a_failed_conversion_says_that_the_output_stays(tmp_path: Path) -> None:
    out = tmp_path / "p.ngc"
    out.write_text("old")
    got = run("convert", cl(tmp_path, "RAPID", "GOTO/0,0,9000", "GOTO/1,0,5"), *MILL, "-o", out)
    assert got.exit_code == 1 and f"{out} is left as it was" in got.stdout and out.read_text() == "old"


# ---- set-up files ------------------------------------------------------------------------------------------


def with_setup(folder: Path, text: str, *lines: str) -> tuple[int, str]:
    setup = folder / "s.toml"
    setup.write_text(text)
    got = run("convert", cl(folder, *(lines or GOOD)), *MILL, "-o", folder / "p.ngc", "--setup", setup)
    return got.exit_code, got.stderr


def test_setup_faults_name_their_place(tmp_path: Path) -> None:
    code, said = with_setup(tmp_path, 'description = "x"\nwork_offset = "NONE"\n')
    assert code == 1 and "s.toml:2: error [setup.work_offset]" in said
    code, said = with_setup(tmp_path, "[part]\nx_axis = [0.0, 1.0, 0.0]\n")
    assert code == 1 and "part.y_axis stands at its default (0.0, 1.0, 0.0)" in said
    code, said = with_setup(tmp_path, "[tools.01]\ngauge_length = 10.0\n")
    assert code == 1 and "s.toml:1" in said


def test_tools_that_nothing_uses_are_reported(tmp_path: Path) -> None:
    code, said = with_setup(tmp_path, "[tools.1]\ngauge_length = 10.0\n[tools.7]\ngauge_length = 10.0\n")
    assert code == 0 and "info [setup.tool_unused] the CL file does not use T7 of the set-up" in said


def test_setup_commands(tmp_path: Path) -> None:
    assert "gauge_length" in str(json.loads(run("setup", "schema").stdout))
    assert run("setup", "check", TOOLS).exit_code == 0
    (tmp_path / "s.toml").write_text("[part]\nx_axis = [0.0, 1.0, 0.0]\n")
    got = run("setup", "check", tmp_path / "s.toml")
    assert got.exit_code == 1 and "setup.axes" in got.stderr and not got.stdout.strip()


def test_names_and_paths_instead_of_loaded_files() -> None:
    import toolpaths

    path, _ = toolpaths.read(SAMPLES / "pocket.cls")
    result = postproc.convert(path, "mill-3axis", setup=TOOLS)
    assert result.ok and result.setup.tools["1"].gauge_length == 120.0 and "(setup " in result.text


def _numbers(command: object, path: tuple[str, ...] = ()) -> list[tuple[tuple[str, ...], str, float | None, float | None]]:
    """(command, option, least, greatest) of all options that are numbers with a fraction."""
    own = [(path, p.name, p.min, p.max) for p in command.params
           if "float" in str(getattr(getattr(p, "type_descriptor", None), "annotation", ""))]
    return own + [row for name, inner in getattr(command, "commands", {}).items() for row in _numbers(inner, (*path, name))]


def test_every_number_of_an_option_has_both_bounds() -> None:
    """So that none is infinite: a stiffness or a tool without end ended in a traceback, or in figures of nothing."""
    found = _numbers(typer.main.get_command(app))
    assert len(found) > 20
    assert [row for row in found if row[2] is None or row[3] is None] == []


@pytest.mark.parametrize("words", ["stiffness uranesx --rod inf", "stiffness uranesx --rod 100 --tool inf",
                                   "stiffness planar-delta --rod inf", "tolerance uranesx --tool inf",
                                   "certify uranesx --box=5x5x5 --tool inf", "analyse uranesx --singular-above inf"])
def test_what_is_infinite_is_wrong_use(words: str) -> None:
    got = run("machine", *words.split())
    assert got.exit_code == 2 and "less than or equal" in got.stderr, got.stderr
