"""Hints are obeyed: what a message says is done word by word, and its fault is gone."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import toolpaths
from machines.loader import builtin
from postproc.cli.console import ALIKE, lines_of
from postproc.setup.system import with_system
from tests.postproc.cli.test_cli import run
from tests.postproc.kit import convert, setup_of, toolpath
from toolpaths.diagnostics import Diagnostic, Severity, error

CUT = ["RAPID", "GOTO/0,0,5", "GOTO/0,0,0", "GOTO/9,0,0", "RAPID", "GOTO/9,0,5"]
START = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"]


def nx(name: str, number: int, size: float) -> list[str]:
    return [f"TOOL PATH/OP_{name},TOOL,{name}", f"TLDATA/MILL,{size},0,75,0,0", f"LOAD/TOOL,{number}", *START[2:], *CUT,
            "END-OF-PATH"]


SAME = ["UNITS/MM", *nx("EM12", 2, 12), *nx("EM6", 2, 6), *nx("EM8", 2, 8), *nx("EM5", 1, 5)]
"""three tools of one number, and one that has the next"""
SIDE = ["UNITS/MM", "LOADTL/1", *START[2:], "RAPID", "GOTO/0,0,5,0,0,1", "GOTO/0,0,0", "RAPID", "GOTO/0,0,50,1,0,0",
        "GOTO/0,9,50"]
CASES = [  # code, lines, machine, controller, set-up
    ("tool.number", [*START[:1], *START[2:], "TPRINT/EM12", *CUT], "mill-3axis", "linuxcnc", ""),
    ("tool.same_number", SAME, "mill-3axis", "linuxcnc", ""),
    ("spindle.not_started", [*START[:2], *START[3:], *CUT], "mill-3axis", "linuxcnc", ""),
    ("spindle.no_speed", [*START[:2], "SPINDL/CLW", START[3], *CUT], "mill-3axis", "linuxcnc", ""),
    ("feed.missing", [*START[:3], *CUT], "mill-3axis", "linuxcnc", ""),
    ("tool.length", SIDE, "head-table", "linuxcnc", ""),
    ("tool.length", [*START, *CUT], "mill-3axis", "linuxcnc", ""),
    ("setup.work_offset_code", [*START, *CUT], "mill-3axis", "haas-ngc", 'work_offset_code = "G54.1 P3"\n'),
    ("setup.operation", ["UNITS/MM", *nx("A", 1, 5)], "mill-3axis", "linuxcnc", '[output.operations]\n"B" = "axes"\n'),
    ("setup.axes", [*START, *CUT], "mill-3axis", "linuxcnc", "[part]\nx_axis = [0.0, 1.0, 0.0]\n"),
    ("setup.assumed", [*START[:3], *CUT], "mill-3axis", "linuxcnc", 'assumed = ["output.feed"]\n[output]\nfeed = 9.0\n'),
    ("setup.work_offset", ["UNITS/MM", *nx("A", 1, 5)], "mill-3axis", "linuxcnc", 'work_offset = "MSYS 9"\n'),
]


def followed(code: str, hint: str, setup: str) -> str:
    """The set-up after its owner has done what the hint says."""
    if "\n[tool_numbers]\n" in hint:  # lines to add, as they stand
        table = hint.split("\n[tool_numbers]\n")[1]
        return setup + "[tool_numbers]\n" + "\n".join(x for x in table.splitlines() if " = " in x and x.startswith('"'))
    if code == "feed.missing":
        found = re.search(r"\[output\] feed = MM_PER_MIN", hint)
        assert found
        return setup + "[output]\nfeed = 300.0\n"
    if code.startswith("spindle."):
        found = re.search(r'\[tools\.1\] (spindle = \{ rpm = \.\.\., direction = "clockwise" \})', hint)
        assert found
        return setup + "[tools.1]\n" + found[1].replace("...", "800") + "\n"
    if code == "tool.length":
        assert "[tools.1] gauge_length = ..." in hint
        return setup + "[tools.1]\ngauge_length = 110.0\n"
    if code == "setup.work_offset_code":
        allowed = re.search(r"G54\b", hint)
        assert allowed
        return f'work_offset_code = "{allowed[0]}"\n'
    if code == "setup.operation":
        return setup.replace('"B"', f'"{hint.removeprefix("it has: ")}"')
    if code == "setup.work_offset":
        return f'work_offset = "{hint.removeprefix("it has: ").split(", ")[0]}"\n'
    if code == "setup.axes":
        assert "give two directions square to each other" in hint and "part.y_axis" in hint
        return setup + "y_axis = [-1.0, 0.0, 0.0]\n"
    assert code == "setup.assumed" and "take its name out of `assumed`" in hint
    return setup.replace('assumed = ["output.feed"]\n', "")


@pytest.mark.parametrize(("code", "lines", "name", "controller", "setup"), CASES, ids=[f"{c[0]}-{c[2]}" for c in CASES])
def test_the_fault_is_gone(code: str, lines: list[str], name: str, controller: str, setup: str) -> None:
    path = toolpath(*lines, head=[])
    before = convert(path, name, controller, setup_of(setup))
    (found, *_) = [d for d in before.diagnostics if d.code == code]
    after = convert(path, name, controller, setup_of(followed(code, found.hint, setup)))
    assert code not in {d.code for d in after.diagnostics}, [str(d) for d in after.diagnostics]
    assert after.ok, [str(d) for d in after.diagnostics if d.severity is Severity.ERROR]


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


def test_g_code_in_the_place_of_a_cl_file_is_named(tmp_path: Path) -> None:
    file = tmp_path / "a.ngc"
    file.write_text("%\n(part)\nG21 G90\nG0 X1 Y2\nM2\n%\n")
    for words in (["inspect", file], ["convert", file, "-m", "mill-3axis", "-c", "linuxcnc", "-o", tmp_path / "o.ngc"]):
        got = run(*words)
        assert got.exit_code == 1 and got.stderr.count("error [") == 1 and "this is G-code" in got.stderr, got.stderr
    assert toolpaths.read_bytes(b"UNITS/MM\nGOTO/1,2,3\n", file="x")[0].file == "x"
