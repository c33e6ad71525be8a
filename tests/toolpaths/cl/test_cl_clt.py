"""SolidWorks CAM .clt: ROTABL turns the frame of the points, TLAXIS says where to, CYCLE/ON stands before each cycle."""

from __future__ import annotations

import math

import numpy as np
import pytest

import toolpaths
from postproc.witness.clfile import commanded
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.diagnostics import Severity

HEAD = "UNITS/ MM \nCUTTER/ 6.0,0.0,3.0,0.0,0.0,0.0,80.0,\nFEDRAT/ MMPM,100.0\n"
TURNS = ("ROTABL/ {},AAXIS,TABLE,CCLW \nROTABL/ {},BAXIS,TABLE,CCLW \nROTABL/ {},CAXIS,TABLE,CCLW \n")


def feature(axis: str, turns: tuple[float, float, float], points: str) -> str:
    back = "".join(f"ROTABL/ {-a:.6f},{w}AXIS,TABLE,CCLW \n" for w, a in zip("CBA", reversed(turns), strict=True))
    return (f"TLAXIS/ {axis} \nOPFEATSTART/Mill1-Pocket1\n" + TURNS.format(*(f"{a:.6f}" for a in turns)) + points + back
            + "OPFEATEND/Mill1-Pocket1\n")


def read(text: str, *codes: str) -> ReadResult:
    found = read_bytes(HEAD + text + "FINI \n")
    assert found.dialect == "solidworks-clt"
    assert [d.code for d in found.diagnostics if d.severity is not Severity.INFO] == list(codes)
    return found


def test_the_axis_by_rotabl_is_that_of_tlaxis() -> None:
    """A by 90 degrees: local z is -y of the part, local y its z; the file has six decimals of a radian."""
    p = read(feature("0.0,-1.0,0.0", (math.pi / 2, 0.0, 0.0), "GOTO/ 67.5,120.5,25.0 \nGOTO/ 67.5,120.5,-20.0 \n")
             + feature("0.0,0.0,1.0", (0.0, 0.0, 0.0), "GOTO/ 1.0,2.0,3.0 \n")).toolpath
    assert p.tip == pytest.approx(np.array([[67.5, -25, 120.5], [67.5, 20, 120.5], [1, 2, 3]]), abs=1e-9)
    assert p.axis == pytest.approx(np.array([[0, -1, 0], [0, -1, 0], [0, 0, 1]]), abs=1e-12)


def test_angles_that_are_no_thousandth_of_a_degree_stay_as_written() -> None:
    p = read(feature("0.0,-0.479426,0.877583", (0.5, 0.0, 0.0), "GOTO/ 0.0,0.0,100.0 \n")).toolpath
    assert p.tip[0] == pytest.approx([0, -100 * math.sin(0.5), 100 * math.cos(0.5)], abs=1e-9)


def test_turns_about_two_axes_follow_each_other() -> None:
    """B by 90 degrees and then C by 90: local z is the part's x."""
    p = read(feature("1.0,0.0,0.0", (0.0, math.pi / 2, math.pi / 2), "GOTO/ 1.0,2.0,3.0 \n")).toolpath
    assert p.tip[0] == pytest.approx([3, 1, 2], abs=1e-9)


@pytest.mark.parametrize("axis", ["0.0,1.0,0.0", "0.0,0.0,1.0"])
def test_an_axis_that_contradicts_rotabl_is_refused(axis: str) -> None:
    found = read(feature(axis, (math.pi / 2, 0.0, 0.0), "GOTO/ 1.0,2.0,3.0 \n"), "cl.tlaxis").diagnostics
    assert [d.severity for d in found if d.code == "cl.tlaxis"] == [Severity.ERROR]


def unclosed(text: str) -> str:
    """The text without the second three of its ROTABL in each operation, which turn the frame back."""
    lines, count = [], 0
    for line in text.splitlines(keepends=True):
        count = 0 if line.startswith("TLAXIS") else count + line.startswith("ROTABL")
        lines += [line] if count <= 3 or not line.startswith("ROTABL") else []
    return "".join(lines)


def test_a_frame_that_is_not_turned_back_is_refused_and_read_by_tlaxis() -> None:
    """Turned by 90 and by -90 degrees: without the closing records the second frame would be upright, unseen."""
    whole = (feature("0.0,-1.0,0.0", (math.pi / 2, 0.0, 0.0), "GOTO/ 67.5,120.5,25.0 \n")
             + feature("0.0,1.0,0.0", (-math.pi / 2, 0.0, 0.0), "GOTO/ 1.0,2.0,3.0 \n"))
    right = read(whole).toolpath
    text = HEAD + unclosed(whole) + "FINI \n"
    assert text.count("ROTABL") == 6
    refused = [d for d in read_bytes(text).diagnostics if d.severity is Severity.ERROR]
    assert [d.code for d in refused] == ["cl.rotabl-open"] and "--axis-from tlaxis" in refused[0].hint
    upright = unclosed(feature("0.6,0.0,0.8", (0.0, math.asin(0.6), 0.0), "GOTO/ 7.0,2.0,3.0 \n")
                       + feature("0.0,0.0,1.0", (0.0, 0.0, 0.0), "GOTO/ 1.0,2.0,3.0 \n"))
    errors = [d.code for d in read_bytes(HEAD + upright + "FINI \n").diagnostics if d.severity is Severity.ERROR]
    assert errors == ["cl.rotabl-open"], (
        "operations behind it are not at fault")
    asked = read_bytes(text, dialect="tlaxis")
    assert not [d for d in asked.diagnostics if d.severity is not Severity.INFO]
    assert asked.toolpath.tip.tolist() == right.tip.tolist() and asked.toolpath.axis == pytest.approx(right.axis, abs=1e-12)
    again = read_bytes(HEAD + whole + "FINI \n", dialect="tlaxis").toolpath
    assert again.tip.tolist() == right.tip.tolist()
    seen = commanded(text.encode(), None, "tlaxis")
    assert seen.tip == pytest.approx(right.tip, abs=1e-4) and seen.known.all() and not seen.unread


def test_by_tlaxis_an_operation_that_turns_without_tlaxis_is_refused() -> None:
    """Its ROTABL would be added to those of the operation before, which nothing has turned back."""
    turned, points = (math.pi / 2, 0.0, 0.0), "GOTO/ 1.0,2.0,30.0 \n"
    for angle, axis in ((-math.pi / 2, "0.0,1.0,0.0"), (0.5, "0.0,-0.479426,0.877583")):
        text = HEAD + unclosed(feature("0.0,-1.0,0.0", turned, points) + feature(axis, (angle, 0.0, 0.0), points)) + "FINI\n"
        assert not [d for d in read_bytes(text, dialect="tlaxis").diagnostics if d.severity is Severity.ERROR]
        found = read_bytes(text.replace(f"TLAXIS/ {axis} \n", ""), dialect="tlaxis").diagnostics
        assert [(d.code, d.lines) for d in found if d.severity is Severity.ERROR] == [("cl.tlaxis", (12,))]


def test_a_tool_axis_without_a_turned_table_holds_as_it_stands() -> None:
    p = read(feature("0.0,-1.0,0.0", (0.0, 0.0, 0.0), "GOTO/ 1.0,2.0,3.0 \n")).toolpath
    assert (p.tip[0].tolist(), p.axis[0].tolist()) == ([1, 2, 3], [0, -1, 0])


DRILL = "CYCLE/ DRILL,G98,12.0,PECKING,5.0,2.0,MMPM,187.0,3.0,46.0 46.0 DWELL,0.0 \n"


def test_cycle_on_before_a_cycle_arms_nothing() -> None:
    points = f"RAPID/ \nGOTO/ 0.0,0.0,25.0 \nCYCLE/ ON \n{DRILL}GOTO/ 0.0,0.0,0.0 \nCYCLE/ OFF \n"
    found = read(feature("0.0,0.0,1.0", (0.0, 0.0, 0.0), points + points))
    assert [(c.kind, c.depth, c.clearance, c.retract, c.steps) for c in found.toolpath.cycles] == [
        ("DEEP", 12, 3, 46, (5.0, 2.0))] * 2
    assert "cl.cycle-empty" not in [d.code for d in found.diagnostics]


def test_cycle_on_before_a_point_needs_a_cycle() -> None:
    found = read(feature("0.0,0.0,1.0", (0.0, 0.0, 0.0), f"CYCLE/ ON \nGOTO/ 0.0,0.0,0.0 \n{DRILL}GOTO/ 1.0,0.0,0.0 \n"
                         "CYCLE/ OFF \n"), "cl.cycle").diagnostics
    assert [d.severity for d in found if d.code == "cl.cycle"] == [Severity.ERROR]


def test_features_are_operations_and_tools_without_numbers_are_named_and_loaded() -> None:
    mill = "CUTTER/ 14.0,7.0,0.0,7.0,0.0,0.0,73.0,\n"
    level = feature("0.0,0.0,1.0", (0.0, 0.0, 0.0), "GOTO/ 0.0,0.0,0.0 \n")
    found = read("CUTTER/ 6.0,0.0,3.0,1.8,31.0,0.0,102.0,\n" + level + mill + level.replace("Mill1", "Mill2") + mill + level)
    p = found.toolpath
    assert [op.name for op in p.operations] == ["Mill1-Pocket1", "Mill2-Pocket1", "Mill1-Pocket1"]
    assert [(t.number, t.name) for t in p.tools] == [(0, "D6 TIP118"), (0, "D14 R7")]
    assert [(e.index, e.values) for e in p.events if e.word == "LOADTL"] == [(0, (0.0,)), (1, (0.0,))]
    assert toolpaths.read_bytes(toolpaths.write(p))[0].equals(p)


def test_one_tool_or_numbered_tools_are_left_as_they_are() -> None:
    level = feature("0.0,0.0,1.0", (0.0, 0.0, 0.0), "GOTO/ 0.0,0.0,0.0 \n")
    one = read(level).toolpath
    two = read("LOAD/TOOL,1\n" + level + "CUTTER/ 14.0,7.0\nLOAD/TOOL,2\n" + level).toolpath
    assert ([t.name for t in one.tools], [e for e in one.events if e.word == "LOADTL"]) == ([""], [])
    assert [t.name for t in two.tools] == ["", ""]
    assert [e.values for e in two.events if e.word == "LOADTL"] == [(1.0,), (2.0,)]
