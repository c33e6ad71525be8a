"""G-code of FreeCAD: what its posts export, and its own form, by numbers worked out by hand."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from postproc.witness.clfile import commanded
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Kind

PLATE = (Path(__file__).parents[3] / "samples/other_forms/plate.nc").read_text("utf-8")
OWN = "G0 X0 Y0 Z5\nG1 F2.5 Z-1\nG91\nG1 X3\nG90\nG3 I-3 J0 X0\n"


@cache
def plate() -> ReadResult:
    return read_bytes(PLATE)


def errors(text: str, **options: str) -> list[tuple[str, tuple[int, ...]]]:
    return [(d.code, d.lines) for d in read_bytes(text, **options).diagnostics if d.severity is Severity.ERROR]


def test_the_path_is_that_of_the_commands() -> None:
    p = plate().toolpath
    assert plate().dialect == "freecad" and not plate().diagnostics and p.units == "mm"
    assert p.tip.tolist() == [[10, 0, 5], [10, 0, 2], [10, 0, -1], [0, 10, -1], [0, 10, -2], [-5, 10, -2], [-5, 10, 5],
                              [-20, 0, 3], [-30, 0, 3], [-40, 0, 3], [-40, 0, 5]]
    assert p.line.tolist() == [15, 16, 17, 18, 19, 20, 21, 25, 26, 29, 31]
    assert (p.feed[p.kind != Kind.RAPID] * 60).round(6).tolist() == [120, 300, 300, 300]
    assert p.arcs.sweep == pytest.approx([np.pi / 2, 2 * np.pi]) and p.arcs.normal[:, 2].tolist() == [1, -1]
    assert [op.name for op in p.operations] == ["TC: 8 mm mill", "Profile", "Drilling"]


def test_holes_begin_at_r_and_end_at_z() -> None:
    """Depth from R to Z; G98 goes back to where the tool came from, G99 to R."""
    deep, dwelt = plate().toolpath.cycles
    assert (deep.kind, deep.depth, deep.clearance, deep.retract, deep.steps) == ("DEEP", 15, 0, 2, (4,))
    assert (dwelt.kind, dwelt.depth, dwelt.retract, dwelt.dwell) == ("DRILL", 6, 0, 0.5)
    assert [(e.index, e.word, e.values) for e in plate().toolpath.events] == [
        (0, "LOADTL", (2.0,)), (0, "SPINDL", (3000.0, "RPM", "CLW")), (0, "COOLNT", ("FLOOD",)),
        (11, "COOLNT", ("OFF",)), (11, "SPINDL", ("OFF",))]


def test_comments_behind_a_semicolon_name_operations_too() -> None:
    p = read_bytes("\n".join(f";{line}" if line.startswith("(") else line for line in PLATE.split("\n"))).toolpath
    assert [op.name for op in p.operations] == [op.name for op in plate().toolpath.operations]


def test_inches_of_a_post_are_inches() -> None:
    p = read_bytes(PLATE.replace("G21", "G20")).toolpath
    assert p.units == "inch" and p.tip[0, 0] == 254 and p.feed[2] * 60 == pytest.approx(120 * 25.4)


def test_its_own_form_has_feeds_per_second_and_is_asked_for() -> None:
    p = read_bytes(OWN, dialect="freecad").toolpath
    assert p.tip.tolist() == [[0, 0, 5], [0, 0, -1], [3, 0, -1], [0, 0, -1]] and p.feed[1:].tolist() == [2.5] * 3
    assert errors(OWN) == [("cl.empty", ())]


@pytest.mark.parametrize(("old", "new", "found"), [
    ("M8\n", "M8\nG64\n", ("cl.unknown-word", (14,))), ("M8\n", "M97\n", ("cl.unknown-word", (13,))),
    ("M8\n", "G18\n", ("cl.unknown-word", (13,))), ("M8\n", "hello\n", ("cl.text", (13,))),
    ("G1 X-5.000", "G1 X-5.000 A30.", ("cl.axis", (20,))), (" F120.000", "", ("cl.feed", (17,))),
    ("G0 Z5.000\nG0 X10.000 Y0.000\n", "G1 X10. F100.\n", ("cl.goto", (14,))), ("I-10.000 J0.000", "", ("cl.circle", (18,))),
    ("M9\n", "G55\n", ("cl.work-offset", (33,))), ("G43 H2", "G43 H5", ("cl.length-register", (9,))),
    ("G21\n", "G21\nG20\n", ("cl.units", (7,))), ("J-5.000 K0.000", "J-5.000 K1", ("cl.circle", (19,))),
    ("G1 X-5.000", "G1 X-5.000 M9", ("cl.text", (20,))), ("G1 X-5.000", "G1 X-5.000 L2", ("cl.text", (20,))),
    ("linuxcnc_post", "grbl_post", ("cl.cycle-value", (29,))),
    (" R3.000\nG80\nG99", "\nG80\nG99", None), ("G1 X-5.000", "G1 X-5.000 I2", ("cl.text", (20,))),
    ("G1 X-5.000", "G1 X-5.000 R2 Q1 P1", ("cl.text", (20,))), ("P0.500 R3.000", "P0.500 R3.000 K3", ("cl.text", (29,))),
    ("J-5.000 K0.000", "J-5.000 P3", ("cl.circle", (19,))), ("J-5.000 K0.000", "J-5.000 P1", None),
    ("G17 G54 G40 G49 G80 G90\n", "G91\n", ("cl.goto", (14, 15))), ("G98\n", "/G98\n", ("cl.text", (24,))),
    ("P0.500 R3.000", "P0.500", ("cl.cycle-value", (29,))), ("M9\n", "M2\n", ("cl.text", (35, 36, 37))),
    (" Q4.000 R3.000\nG83 X-30", " R3.000\nG83 X-30", ("cl.cycle-value", (25,)))])
def test_what_is_not_carried_out_is_refused(old: str, new: str, found: tuple[str, tuple[int, ...]] | None) -> None:
    """The last: R stays from hole to hole."""
    assert PLATE.count(old) == 1
    got = errors(PLATE.replace(old, new))
    assert got == [] if found is None else found in got


def test_a_feed_of_a_rapid_is_none_of_a_cut_and_inches_are_none_of_its_own_form() -> None:
    assert ("cl.feed", (3,)) in errors("G0 X0 Y0 Z5\nG0 F100 Z2\nG1 Z0\n", dialect="freecad")
    for one in ("G20", "G21", "M30", "%"):
        assert ("cl.units", (1,)) in errors(f"{one}\n" + OWN, dialect="freecad")
    assert [d.code for d in read_bytes(PLATE.replace("G21\n", "\n")).diagnostics] == ["cl.no-units"]


def test_a_speed_alone_holds_where_the_spindle_turns() -> None:
    p = read_bytes(PLATE.replace("G98\n", "G98\nS900\n").replace("M3 S3000", "M4")).toolpath
    assert [(e.index, e.values) for e in p.events if e.word == "SPINDL"][:2] == [(0, ("CCLW",)), (7, (900.0, "RPM", "CCLW"))]


def test_words_that_stand_without_a_move_hold_and_i_and_j_alone_are_a_whole_turn() -> None:
    """F alone and with G1 alone, S beside M8; S beside M3 is said once."""
    text = PLATE.replace("G1 X-5.000\n", "F100\nG1 X-5.000\nG1 F50\nX-6\nS500 M8\nG2 I10\n")
    p = read_bytes(text).toolpath
    assert (p.feed[5:8] * 60).round(6).tolist() == [100, 50, 50] and p.arcs.sweep[-1] == pytest.approx(2 * np.pi)
    assert p.tip[6:8].tolist() == [[-6, 10, -2]] * 2
    assert [(e.index, e.values) for e in p.events if e.word == "SPINDL"] == [
        (0, (3000.0, "RPM", "CLW")), (7, (500.0, "RPM", "CLW")), (13, ("OFF",))]
    seen = commanded(text.encode(), None, "freecad")
    assert seen.tip == pytest.approx(p.tip) and seen.feed[5:8].tolist() == [100, 50, 50]
