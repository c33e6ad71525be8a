"""Programs changed in any block: `time` and `verify` say what they find and raise nothing (`make hard` changes them all)."""

from __future__ import annotations

import re

import pytest

from postproc.controllers.model import load_controller
from postproc.cycle_time.source import from_gcode
from postproc.pipeline.result import PostResult
from tests.hard.edits import deletions, edits, timed, verified
from tests.postproc.kit import codes, convert, good, machine, sample, tool_setup, toolpath

CONTROLLERS = ("fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc", "linuxcnc", "generic-iso")
PART = ["RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,2", "FEDRAT/MMPM,200", "GOTO/0,0,-2", "GOTO/20,0,-2",
        "MOVARC/20,10,-2,0,0,1,10,ANGLE,90", "GOTO/30,10,-2", "GOTO/30,20,-2", "RAPID", "GOTO/30,20,30",
        "CYCLE/DEEP,DEPTH,9,MMPM,100,CLEAR,3,STEP,4", "GOTO/5,5,0", "GOTO/15,5,0", "CYCLE/OFF",
        "CYCLE/TAP,DEPTH,8,MMPR,1,CLEAR,3", "GOTO/25,5,0", "CYCLE/OFF", "RAPID", "GOTO/0,0,50"]
MOST_TIMED, MOST_VERIFIED = 1, 1
"""blocks of each program that are changed here, each in eight paths"""


@pytest.fixture(scope="module")
def programs() -> dict[str, PostResult]:
    path = toolpath(*PART)
    return {name: good(convert(path, "mill-3axis", name)) for name in CONTROLLERS}


@pytest.mark.parametrize("name", CONTROLLERS)
def test_nothing_is_raised(name: str, programs: dict[str, PostResult]) -> None:
    """Warnings of numpy are errors here too: no figure may come from a division by nothing."""
    result = programs[name]
    assert timed(result.text, result, result.machine, result.controller, name) and verified(result.text, result)
    refused = 0
    for _, program in edits(result.text, MOST_TIMED):
        refused += not timed(program, result, result.machine, result.controller, name)
    for _, program in edits(result.text, MOST_VERIFIED):
        refused += not verified(program, result)
    assert refused > 0


def test_each_block_is_deleted_and_of_blocks_alike_as_many_as_asked() -> None:
    text = "G21 G90\nG0 X1.\n" + "".join(f"G1 X{i}. F100.\n" for i in range(2, 50)) + "G0 Z5.\nM30\n"
    lines = text.splitlines()
    assert sorted(p for _, p in deletions(text)) == sorted("\n".join(lines[:i] + lines[i + 1:]) + "\n" for i in range(52))
    some = [what for what, _ in deletions(text, 3)]
    assert len(some) < 12 and {f"line {i}, deleted" for i in (1, 2, 3, 50, 51, 52)} <= set(some)


def refused(name: str, text: str) -> set[str]:
    """Codes of what `time` finds in a program for a 3-axis mill."""
    controller, _ = load_controller(name)
    assert controller is not None
    blocks, found = from_gcode(text.encode(), machine("mill-3axis"), controller, tool_setup(), "part.nc")
    assert blocks is None
    return codes(found)


def test_the_pocket_without_the_line_that_ends_an_arc() -> None:
    """Then X alone stands under G3: an arc without a centre, once a figure that is not a number."""
    text = sample("pocket.cls", "mill-3axis", "fanuc-30i").text
    lines = text.splitlines()
    assert "gcode.arc" in refused("fanuc-30i", "\n".join(n for n in lines if n != "G1 Y-4. F900.") + "\n")


def program(block: str) -> str:
    """A whole program around a block; lengths and feeds bear the decimal point that some controls ask for."""
    text = f"G21 G90 G17 G94 G54\nT1 M6\nG43 H1\nS1000 M3\nG0 X0 Y0 Z50\n{block}\nM30\n"
    return re.sub(r"([XYZRQIJF]-?\d+)(?![\d.])", r"\1.", text)


@pytest.mark.covering
@pytest.mark.parametrize(("block", "code"), [
    (f"G1 X{'9' * 400} F100", "gcode.number"), (f"G4 P{'9' * 11}", "gcode.number"), ("G2 X5 Y0 F100", "gcode.arc"),
    ("G2 X5 Y0 I0 J0 F100", "gcode.arc"), ("G2 X5 Y0 I5 J0 F100", "gcode.arc"),
    ("G83 Z-5 R2 Q0.00000001 F100", "gcode.cycle"), ("G81 X1 Z-5 R2 F100 L1000000000", "gcode.cycle"),
    ("G81 Z2 R2 F100", "gcode.cycle"), ("G81 Z5 R2 F100", "gcode.cycle")])
@pytest.mark.parametrize("name", ["linuxcnc", "haas-ngc"])
def test_what_no_control_runs_is_refused_before_it_costs_time_or_memory(name: str, block: str,
                                                                        code: str) -> None:
    assert code in refused(name, program(block))


def test_corners_cannot_be_rounded_by_less_than_nothing() -> None:
    assert "gcode.smoothing" in refused("haas-ngc", program("G187 E-1.\nG1 X5 F100"))
