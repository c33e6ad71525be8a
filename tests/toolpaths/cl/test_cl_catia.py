"""CATIA: cycles of numbers alone, helices that carry their end."""

from __future__ import annotations

import math

import numpy as np
import pytest

import toolpaths
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.diagnostics import Severity, has_errors
from toolpaths.toolpath import Kind

HEAD = "$$     CATIA APT VERSION 1.0\nPARTNO X\nFEDRAT/  300.0000,MMPM\n"
HELIX = ("HELICAL/CENTER,{},INDIRV,{},AXIS,{},PITCH,{},RADIUS,{},$\n ANGLE,{},HEIGHT,{},ROUND,{},END,{}\n")


def read(text: str, *codes: str) -> ReadResult:
    found = read_bytes(HEAD + text + "END\n", units="mm")
    assert found.dialect == "catia"
    assert [d.code for d in found.diagnostics if d.severity is not Severity.INFO] == list(codes)
    return found


@pytest.mark.parametrize(("axis", "away"),
                         [("", "0,0,25"), (", 0.0, 0.0, 1.0", "0,0,25"), (", 0.0,-0.6, 0.8", "0,-3,24")])
def test_a_second_number_is_the_start_plane_where_the_tool_stands_there(axis: str, away: str) -> None:
    found = read(f"RAPID\nGOTO  /{away}{axis}\nCYCLE/DRILL,    3.000000,    5.000000\nGOTO  /0,0,20{axis}\nCYCLE/OFF\n",
                 "cl.cycle-place")
    c, = found.toolpath.cycles
    assert (c.depth, c.clearance, c.retract, c.feed) == (3, 5, 5, 5.0)


def test_elsewhere_it_is_the_feed() -> None:
    found = read("RAPID\nGOTO  /0,0,26\nCYCLE/DRILL,    3.000000,    120.0\nGOTO  /0,0,20\nCYCLE/OFF\n",
                 "cl.cycle-place", "cl.cycle-start")
    c, = found.toolpath.cycles
    assert (c.depth, c.clearance, c.feed) == (3, 0, 2.0)


def test_a_cycle_with_a_unit_has_its_feed() -> None:
    found = read("RAPID\nGOTO  /0,0,25\nCYCLE/DRILL,    3.000000,    5.000000,MMPM\nGOTO  /0,0,20\nCYCLE/OFF\n",
                 "cl.cycle-place", "cl.cycle-start")
    assert found.toolpath.cycles[0].feed == pytest.approx(5 / 60)


@pytest.mark.parametrize(("toward", "end", "turns", "sense"), [
    ("0,1,0", "10,0,-6", 2.0, 1), ("0,-1,0", "10,0,-6", 2.0, -1), ("0,1,0", "0,10,-6.75", 2.25, 1)])
@pytest.mark.parametrize("axis", ["0,0,1", "0,0,-1"])
def test_a_helix_turns_by_its_height_over_its_pitch(toward: str, end: str, turns: float, sense: int,
                                                    axis: str) -> None:
    record = HELIX.format("0,0,0", toward, axis, 3, 10, 360 * turns, -3 * turns, int(turns), end)
    p = read(f"GOTO  /10,0,0\n{record}GOTO  /20,0,0\n").toolpath
    assert p.kind.tolist() == [Kind.FEED, Kind.ARC, Kind.FEED]
    assert p.arcs.sweep == pytest.approx([2 * math.pi * turns])
    assert p.arcs.normal.tolist() == [[0, 0, sense]]
    np.testing.assert_allclose(p.tip[1], [float(v) for v in end.split(",")])
    assert toolpaths.read_bytes(toolpaths.write(p))[0].equals(p)


def test_a_helix_that_does_not_rise_turns_by_its_angle() -> None:
    p = read("GOTO  /10,0,0\n" + HELIX.format("0,0,0", "0,1,0", "0,0,1", 0, 10, 90, 0, 0, "0,10,0")).toolpath
    assert p.arcs.sweep == pytest.approx([math.pi / 2])


@pytest.mark.parametrize("record", ["HELICAL/CENTER,0,0,0,AXIS,0,0,1\n",
                                    HELIX.format("0,0", "0,1,0", "0,0,1", 3, 10, 720, 6, 2, "10,0,-6")])
def test_what_is_no_helix_is_refused(record: str) -> None:
    assert has_errors(read(f"GOTO  /10,0,0\n{record}", "cl.circle").diagnostics)


def test_a_helix_whose_end_is_elsewhere_is_refused() -> None:
    found = read("GOTO  /10,0,0\n" + HELIX.format("0,0,0", "0,1,0", "0,0,1", 3, 10, 720, 6, 2, "0,10,-6"),
                 "cl.arc-sweep")
    assert has_errors(found.diagnostics)


def test_tools_that_are_numbered_and_not_loaded_stay_so() -> None:
    p = read("TOOLNO/1,MILL,10.0\nGOTO  /0,0,0\nTOOLNO/2,MILL,12.0\nGOTO  /0,0,1\n").toolpath
    assert [(t.number, t.name) for t in p.tools] == [(1, ""), (2, "")]
    assert "LOADTL" not in [e.word for e in p.events]


def test_the_register_of_an_operation_belongs_to_the_change_before_it() -> None:
    p = read("LOADTL/2\nCOOLNT/ON\nLOADTL/2,1\nGOTO  /0,0,0\nLOADTL/2,1\nGOTO  /1,0,0\nLOADTL/3\nLOADTL/4\nLOADTL/4,5\n"
             "GOTO  /2,0,0\nLOADTL/4\nGOTO  /3,0,0\n").toolpath
    assert [(e.index, e.values) for e in p.events if e.word == "LOADTL"] == [
        (0, (2.0, 1.0)), (1, (2.0, 1.0)), (2, (3.0,)), (2, (4.0, 5.0)), (3, (4.0,))]
    assert [(t.number, t.length_register) for t in p.tools] == [(2, 1), (4, 5)]
