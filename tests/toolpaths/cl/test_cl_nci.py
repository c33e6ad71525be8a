"""Mastercam NCI: every code that is carried out, by numbers worked out by hand; what is not, is refused at its line."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from postproc.witness.clfile import commanded
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.cl.systems.recognise import recognised
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Kind

PLATE = (Path(__file__).parents[3] / "samples/other_forms/plate.nci").read_text("utf-8")


@cache
def plate() -> ReadResult:
    return read_bytes(PLATE, units="mm")


def errors(text: str) -> list[tuple[str, tuple[int, ...]]]:
    return [(d.code, d.lines) for d in read_bytes(text, units="mm").diagnostics if d.severity is Severity.ERROR]


def test_the_path_is_that_of_the_codes() -> None:
    p = plate().toolpath
    assert plate().dialect == "nci" and not plate().diagnostics and p.records.dropped == 0
    assert p.tip.tolist() == [[0, 0, 50], [0, 0, 2], [0, 0, -1], [30, 0, -1], [30, 10, -1], [0, 10, -1], [0, 10, 50],
                              [10, 10, 0], [20, 10, 0], [0, 0, 60], [0, 0, 5]]
    assert p.axis[-2:] == pytest.approx(np.array([[0, 0.6, 0.8]] * 2)) and (p.axis[:-2] == (0, 0, 1)).all()
    assert p.line.tolist() == [15, 17, 19, 21, 23, 25, 27, 29, 31, 35, 37]
    cut = p.kind != Kind.RAPID
    assert (p.feed[cut] * 60).round(6).tolist() == [250, 600, 600, 600, 300]
    assert p.arcs.sweep == pytest.approx([np.pi]) and p.arcs.normal.tolist() == [[0, 0, 1]]


def test_tools_states_and_holes() -> None:
    p = plate().toolpath
    (tool,), (cycle,), (operation,) = p.tools, p.cycles, p.operations
    assert (tool.number, tool.name, tool.length_register, tool.cutter) == (3, "EM10 flat", 3, (10.0, 0.5))
    assert (cycle.kind, cycle.depth, cycle.clearance, cycle.retract, cycle.steps) == ("DEEP", 5, 2, 50, (2, 2))
    assert operation.name == "Contour top" and cycle.feed == 2.0
    assert [(e.index, e.word, e.values) for e in p.events if e.word != "PPRINT"] == [
        (0, "LOADTL", (3.0, 3.0)), (0, "SPINDL", (4500.0, "RPM", "CLW")), (0, "COOLNT", ("FLOOD",)),
        (2, "CUTCOM", ("LEFT", 23.0)), (5, "CUTCOM", ("OFF",))]


def test_the_plane_and_the_compensation_of_an_arc_stand_in_either_order() -> None:
    other = PLATE.replace("\n3\n0 0 30.", "\n3\n40 0 30.")
    p = read_bytes(other, units="mm").toolpath
    assert [e.index for e in p.events if e.word == "CUTCOM"] == [2, 4]


def test_coolant_by_the_flags_and_a_whole_turn() -> None:
    text = PLATE.replace("600. 0\n3\n0 0 30. 10. 30. 5. -1. -1 0 0", "600. 300000\n2\n0 0 30. 0. 30. 5. -1. -1 0 1")
    p = read_bytes(text, units="mm").toolpath
    assert p.arcs.sweep == pytest.approx([2 * np.pi]) and p.arcs.normal[0, 2] == -1
    assert [(e.index, e.values) for e in p.events if e.word == "COOLNT"] == [(0, ("FLOOD",)), (3, ("MIST",))]


def test_inches_are_asked_for() -> None:
    said = read_bytes(PLATE)
    assert [d.code for d in said.diagnostics] == ["cl.no-units"]
    assert read_bytes(PLATE, units="inch").toolpath.tip[3, 0] == 30 * 25.4


@pytest.mark.parametrize(("old", "new", "found"), [
    ("3\n0 0 30.", "3\n1 0 30.", ("cl.circle", (23,))), ("3\n0 0 30.", "3\n0 2 30.", ("cl.circle", (23,))),
    ("-1 0 0\n", "-1 0 1\n", ("cl.circle", (23,))), ("-1. -1 0 0\n", "-1. -2 0 0\n", ("cl.arc-rapid", (23,))),
    ("81\n1 10.", "81\n7 10.", ("cl.cycle", (29, 31))), ("50. 0 0\n100", "50. 0 1\n100", ("cl.cycle", (29,))),
    ("80\n0\n", "1018\n0\n", ("cl.unknown-word", (33,))), ("0. 6. 68. -2.", "0. 0. 60. -2.", ("cl.axis", (35,))),
    ("68. -2. 0 0 0", "68. -2. 0 200 0", ("cl.form", (35,))),
    ("1\n41 0. 0. -1. 250. 0", "1\n41 0. x -1. 250. 0", ("cl.form", (19,))), ("80\n0\n", "80\n", ("cl.text", (35,))),
    ("1014\n1. 0. 0. 0. 1.", "1014\n1. 0. 0. 0. .8", ("cl.frame", (13,))),
    ("80\n0\n", "1014\n0. 1. 0. -1. 0. 0. 0. 0. 1.\n", ("cl.frame", (33,))),
    ("0\n0 0. 0. 2. -2. 0", "0\n0 0. 0. 2. 90. 0", ("cl.feed", (17,))),
    ("0 4500. 250. 1", "0 4500. 250. 8", ("cl.form", (11,))),
    ("1\n41 0.", "1\n43 0.", ("cl.form", (19,))), ("1\n41 0.", "1\n-41 0.", ("cl.form", (19,))),
    ("3\n0 0 30.", "3\n0 3 30.", ("cl.form", (23,))), ("1003\n0\n", "1003\n0\n\n1\n0\n", ("cl.text", (42,))),
    ("1014\n1. 0. 0. 0. 1. 0. 0. 0. 1.", "1027\n1 0 0 0 1 0 0 0 1 100 0 0", ("cl.frame", (13,))),
    ("80\n0\n", "\u00b2\n0\n", ("cl.text", (33,))), ("80\n0\n", "9" * 5000 + "\n0\n", ("cl.text", (33,)))])
def test_what_is_not_carried_out_is_refused_at_its_line(old: str, new: str, found: tuple[str, tuple[int, ...]]) -> None:
    assert PLATE.count(old) == 1
    assert found in errors(PLATE.replace(old, new))


def test_a_remark_with_strokes_leaves_the_form_as_it_is() -> None:
    text = PLATE.replace("1012\n", "1005\n/ 6/7 GOTO/1\n1012\n")
    assert (read_bytes(text, units="mm").dialect, recognised(text.encode())) == ("nci", recognised(PLATE.encode()))
    assert commanded(text.encode(), "mm").tip == pytest.approx(plate().toolpath.tip)


def test_turning_is_said_to_be_turning_and_a_missing_end_is_noted() -> None:
    turned = read_bytes(PLATE.replace("80\n0\n", "200\n0\n"), units="mm")
    assert [op.turning for op in turned.toolpath.operations] == [True]
    assert [d.code for d in read_bytes(PLATE.replace("1003\n0\n", ""), units="mm").diagnostics] == ["cl.cut-off"]
