"""Hints of places, missing tables and many faults alike, obeyed; all others: `tests/hints`."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import toolpaths
from machines.loader import builtin
from postproc.cli.shared.causes import ALIKE, lines_of
from postproc.setup.system import with_system
from tests.postproc.cli.test_cli import run
from tests.postproc.kit import convert, toolpath
from toolpaths.diagnostics import Diagnostic, Severity, error, warning

START = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"]


@pytest.mark.parametrize(("name", "lines"), [
    ("mill-3axis", ["RAPID", "GOTO/0,0,390,0,0,1", "GOTO/1,0,390"]),
    ("mikron-ucp710", ["RAPID", "GOTO/0,0,200,0,0,1", "GOTO/100,0,200", "RAPID", "GOTO/0,0,200,1,0,0", "GOTO/0,50,200"]),
    ("mill-3axis", ["RAPID", "GOTO/9,0,0,1,0,0", "GOTO/9,30,0"])])
def test_a_place_that_is_named_is_one(name: str, lines: list[str], tmp_path: Path) -> None:
    file, setup, out = tmp_path / "p.apt", tmp_path / "s.toml", tmp_path / "p.ngc"
    file.write_text("\n".join([*START, *lines, "FINI"]))
    words = ("convert", file, "-m", name, "-c", "linuxcnc", "-o", out)
    got = run(*words)
    found = re.search(r"\[part\] (origin = \[.*?\]), (x_axis = \[.*?\]), (y_axis = \[.*?\]) in the set-up", got.stderr)
    assert got.exit_code == 1 and found, got.stderr
    setup.write_text("[part]\n" + "\n".join(found.groups()) + "\n")
    assert run(*words, "--setup", setup).exit_code == 0


def test_a_missing_table_is_named_with_all_that_it_needs(tmp_path: Path) -> None:
    """[timing] of a machine file: one hint, and the file loads."""
    text = builtin()["mill-3axis"].read_text("utf-8")
    table = re.search(r"^\[timing\]\n(?:[^\[].*\n?|\n)*", text, re.MULTILINE)
    assert table and "tool_change" in table[0]
    file = tmp_path / "m.toml"
    file.write_text(text.replace(table[0], ""))
    got = run("machine", "check", file)
    hint = re.search(r"file\.missing-key\] .*?; add a table (\[timing\]) with (.*)", got.stderr)
    assert got.exit_code == 1 and hint, got.stderr
    file.write_text(file.read_text() + f"\n{hint[1]}\n" + hint[2].replace("...", "1.0").replace(", ", "\n") + "\n")
    assert run("machine", "check", file).exit_code == 0


def test_no_hint_turns_the_part_over() -> None:
    """A system that hangs upside down is not offered where the tool comes from above."""
    lines = ["UNITS/MM", "TOOL PATH/A,TOOL,T", "MSYS/900,0,0,1,0,0,0,-1,0", "LOAD/TOOL,1", *START[2:], "RAPID",
             "GOTO/0,0,-5,0,0,-1", "GOTO/0,0,0", "GOTO/9,0,0", "END-OF-PATH"]
    path = toolpath(*lines, head=[])
    assert path.axis[0, 2] == 1.0
    result = convert(path, "mikron-ucp710")
    assert not result.ok and not any("[part] system" in d.hint for d in result.diagnostics)
    assert result.job is not None
    fault = [error("travel.exceeded", "x")]
    below = with_system(fault, path.frames[0], result.job.placement, -result.job.moves.axis)
    assert "stands it upright" in below[0].hint, "where the tool comes from below it does"


def test_many_faults_of_one_remedy_are_two_lines() -> None:
    many = tuple(Diagnostic(Severity.ERROR, "cl.goto", f"GOTO {k}", "f", (k,), hint="h") for k in range(1, 541))
    other = (error("cl.text", "x"),)
    assert len(lines_of((*many, *other), Severity.INFO)) == 3
    assert "and 539 more [cl.goto], lines 2, 3, 4" in lines_of((*many, *other), Severity.INFO)[1]
    assert len(lines_of(many[:ALIKE], Severity.INFO)) == ALIKE, "few are shown each"


def test_what_may_be_the_cause_stands_before_what_it_causes() -> None:
    """A set-up for another machine was said below the travel that it exceeded; turning files brought their units."""
    travel, other = error("travel.exceeded", "X"), warning("tool.length", "y")
    for code in ("setup.machine", "setup.upside_down", "cl.no-units"):
        said = lines_of((travel, other, warning(code, "z")), Severity.INFO)
        assert [line.split("[")[1].split("]")[0] for line in said] == [code, "travel.exceeded", "tool.length"]
    said = lines_of((error("cl.goto", "X"), warning("setup.machine", "z")), Severity.INFO)
    assert "cl.goto" in said[0], "of another fault it is no cause"
    turning = (warning("cl.no-units", "u"), warning("cl.no-feed", "f"), error("convert.turning", "t"))
    assert len(lines_of(turning, Severity.INFO)) == 1


def test_g_code_in_the_place_of_a_cl_file_is_named(tmp_path: Path) -> None:
    file = tmp_path / "a.ngc"
    file.write_text("%\n(part)\nG21 G90\nG0 X1 Y2\nM2\n%\n")
    for words in (["inspect", file], ["convert", file, "-m", "mill-3axis", "-c", "linuxcnc", "-o", tmp_path / "o.ngc"]):
        got = run(*words)
        assert got.exit_code == 1 and got.stderr.count("error [") == 1 and "this is G-code" in got.stderr, got.stderr
    assert toolpaths.read_bytes(b"UNITS/MM\nGOTO/1,2,3\n", file="x")[0].file == "x"


def test_a_program_and_a_cl_file_in_each_others_place_are_named_by_every_command(tmp_path: Path) -> None:
    cl, nc = tmp_path / "p.apt", tmp_path / "a.ngc"
    cl.write_text("\n".join([*START, "GOTO/0,0,0", "FINI"]))
    nc.write_text("G21 G90\nG0 X1 Y2\nM2\n")
    (tmp_path / "r.csv").write_text("x [mm]\n1\n")
    (tmp_path / "s.toml").write_text("[tools.1]\ngauge_length = 120.0\n")
    on, out = ["-m", "mikron-ucp710"], ["-o", tmp_path / "o.toml"]
    for words in (["place", nc, *on, "--setup", tmp_path / "s.toml", *out], ["orient", nc, *on],
                  ["setup", "new", nc, *on, *out, "--yes"],
                  ["setup", "align", tmp_path / "r.csv", nc, *on, "-c", "linuxcnc", "--setup", tmp_path / "s.toml", *out],
                  ["verify", cl, cl, *on, "-c", "linuxcnc"]):
        got = run(*words)
        said = "this is a CL file" if words[0] == "verify" else "this is G-code"
        assert got.exit_code == 1 and got.stderr.count("error [") == 1 and said in got.stderr, (words, got.stderr)


def test_a_misspelt_value_of_a_hook_names_its_line_and_the_nearest(tmp_path: Path) -> None:
    (tmp_path / "p.apt").write_text("\n".join([*START, "GOTO/0,0,0", "FINI"]))
    (tmp_path / "s.toml").write_text('[tools.1]\ngauge_length = 120.0\n[hooks]\nbefore_tool = ["(T{tool_nmber})"]\n')
    got = run("convert", tmp_path / "p.apt", "-m", "mill-3axis", "-c", "linuxcnc", "-o", tmp_path / "p.ngc", "--setup",
              tmp_path / "s.toml")
    assert got.exit_code == 1 and "s.toml:4:" in got.stderr and "did you mean {tool_number}?" in got.stderr, got.stderr


SQUARE = ["RAPID", "GOTO/0,0,5", "GOTO/0,0,0", "GOTO/40,0,0", "GOTO/40,30,0", "GOTO/0,30,0", "GOTO/0,0,0", "RAPID",
          "GOTO/0,0,5"]
CAUSES = {"4000 for 40": ("GOTO/40,30", "GOTO/4000,30", "path.odd_record"),
          "no feed": ("FEDRAT/MMPM,600", "", "feed.missing"),
          "feed 0": ("MMPM,600", "MMPM,0", "cl.feed"), "no tool": ("LOADTL/1", "", "tool.number"),
          "a turned axis": ("GOTO/40,30,0", "GOTO/40,30,0,0.6,0,-0.8", "path.odd_record"),
          "fast": ("RPM,1000", "RPM,90000", "spindle.too_fast"), "no speed": ("RPM,1000", "RPM", "cl.form"),
          "a unit misspelt": ("MMPM,600", "MMPX,600", "cl.form"),
          "a mark left": ("GOTO/40,30,0", "GOTO/40,$", "cl.continuation")}


@pytest.mark.parametrize("what", CAUSES)
def test_one_wrong_number_is_one_error(what: str, tmp_path: Path) -> None:
    """What follows from it, and what nobody needs then, is in --json alone; the odd record is named with its line."""
    old, new, code = CAUSES[what]
    good = "\n".join([*START, *SQUARE, "FINI"]).replace("GOTO/0,0,0\nRAPID", "GOTO/0,0,0,0,0,1\nRAPID").replace(
        "GOTO/0,30,0", "GOTO/0,30,0,0,0,1")
    (tmp_path / "m.toml").write_text('base = "mikron-ucp710"\n[control]\nlargest_spindle_speed = 12000\n')
    (tmp_path / "s.toml").write_text("[tools.1]\ngauge_length = 120.0\n")
    (tmp_path / "p.apt").write_text(good.replace(old, new))
    got = run("convert", tmp_path / "p.apt", "-m", tmp_path / "m.toml", "-c", "linuxcnc", "-o", tmp_path / "p.ngc",
              "--setup", tmp_path / "s.toml")
    codes = re.findall(r"(?:error|warning|info) \[(\S+)\]", got.stderr)
    assert got.exit_code == 1 and codes[0] == code and set(codes) <= {code, "setup.offered"}, got.stderr
    line = next(k for k, text in enumerate(good.replace(old, new).splitlines(), 1) if new and new in text) if new else 0
    assert code != "path.odd_record" or f"p.apt:{line}:" in got.stderr
    if what == "4000 for 40":  # which fits nowhere; a turned axis may in another attitude
        made = run("setup", "new", tmp_path / "p.apt", "-m", tmp_path / "m.toml", "-o", tmp_path / "new.toml", "--yes")
        assert made.exit_code == 1 and f"p.apt:{line}: error [{code}]" in made.stderr
        assert "travel.exceeded" not in made.stderr and "place.found" not in made.stderr


CUT = "GOTO/0,0,5\nFEDRAT/MMPM,600\nGOTO/0,0,0\nRAPID\nGOTO/0,0,9\nFINI"


@pytest.mark.parametrize(("far", "code"), [
    ("FINI", "travel.exceeded"), (CUT, "path.odd_record"), (f"STOP\nRAPID\n{CUT}", "travel.exceeded"),
    (f"LOADTL/2\nSPINDL/RPM,3000,CLW\nRAPID\n{CUT}", "travel.exceeded")])
def test_a_park_point_is_no_odd_record(far: str, code: str, tmp_path: Path) -> None:
    """Rapids alone behind it, a tool change or a stop: its line is named by travel; with a cut behind it, it is damaged."""
    text = "\n".join([*START, *SQUARE, "RAPID", "GOTO/0,0,5000", far])
    (tmp_path / "p.apt").write_text(text)
    (tmp_path / "s.toml").write_text("[tools.1]\ngauge_length = 120.0\n")
    got = run("convert", tmp_path / "p.apt", "-m", "mill-3axis", "-c", "linuxcnc", "-o", tmp_path / "p.ngc", "--setup",
              tmp_path / "s.toml")
    line = text.splitlines().index("GOTO/0,0,5000") + 1
    assert got.exit_code == 1 and re.findall(r"error \[(\S+)\]", got.stderr)[0] == code, got.stderr
    assert f"p.apt:{line}:" in got.stderr, got.stderr


def test_a_file_that_is_far_larger_than_the_machine_has_no_odd_record(tmp_path: Path) -> None:
    (tmp_path / "p.apt").write_text("\n".join([*START, *SQUARE, "FINI"]).replace("UNITS/MM", "UNITS/INCHES"))
    got = run("convert", tmp_path / "p.apt", "-m", "mill-3axis", "-c", "linuxcnc", "-o", tmp_path / "p.ngc")
    assert "odd_record" not in got.stderr and "travel.exceeded" in got.stderr
    assert got.stderr.count("[part]") + got.stderr.count("more travel") == 1, "one remedy"
    (tmp_path / "p.apt").write_text("\n".join([*START, *SQUARE, "FINI"]).replace("GOTO/40,", "GOTO/3000,"))
    got = run("convert", tmp_path / "p.apt", "-m", "mill-3axis", "-c", "linuxcnc", "-o", tmp_path / "p.ngc")
    assert "wherever the part stands" in got.stderr and "more travel" in got.stderr
    assert "(part.origin)" not in got.stderr, "remedies do not contradict each other"
