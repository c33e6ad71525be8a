"""STEP-NC of ISO 14649: a workplan with explicit paths, by numbers worked out by hand; all else is refused at its line."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from postproc.witness.clfile import commanded
from toolpaths.cl.read import ReadResult, read_bytes
from toolpaths.cl.systems.part21 import Reference, Typed, instances
from toolpaths.toolpath import Kind

TILTED = (Path(__file__).parents[3] / "samples/other_forms/tilted.stp").read_text("utf-8")


@cache
def tilted() -> ReadResult:
    return read_bytes(TILTED)


def test_the_path_is_that_of_the_working_steps() -> None:
    """Each begins over the security plane (z 40), the second rises from the first with the axis of the first."""
    p = tilted().toolpath
    assert tilted().dialect == "step-nc" and not tilted().diagnostics
    assert p.tip.tolist() == [[0, 0, 40], [0, 0, 2], [0, 0, -1], [30, 0, -1], [35, -5, -1], [35, -5, 20], [35, -5, 40],
                              [0, 20, 40], [0, 20, 5], [10, 20, 5]]
    assert p.kind.tolist() == [Kind.RAPID] * 2 + [Kind.FEED] * 2 + [Kind.ARC] + [Kind.RAPID] * 4 + [Kind.FEED]
    assert p.axis[6].tolist() == [0, 0, 1] and p.axis[8] == pytest.approx([0, 0.6, 0.8])
    assert p.axis[9].tolist() == [0, 0, 1] and p.feed[[2, 3, 4, 9]] == pytest.approx([10, 10, 10, 5])
    assert p.arcs.sweep == pytest.approx([np.pi / 2]) and p.arcs.normal.tolist() == [[0, 0, -1]]


def test_tools_states_and_rests() -> None:
    p = tilted().toolpath
    assert [(t.name, t.cutter) for t in p.tools] == [("EM10", (10.0, 0.0)), ("BALL8", (8.0, 4.0))]
    assert [op.name for op in p.operations] == ["ROUGH", "TILTED"] and p.name == "SLOT"
    assert [(e.index, e.word, e.values) for e in p.events if e.word != "LOADTL"] == [
        (0, "COOLNT", ("FLOOD",)), (0, "SPINDL", (3000.0, "RPM", "CLW")), (5, "DELAY", (0.5,)), (6, "COOLNT", ("MIST",)),
        (6, "SPINDL", (6000.0, "RPM", "CLW"))]


@pytest.mark.parametrize(("old", "new", "said"), [
    ("#22=CARTESIAN_POINT('',(0.,0.,0.))", "#22=CARTESIAN_POINT('',(5.,0.,0.))", "placed away from the origin"),
    ("FREEFORM_OPERATION(#50,", "FREEFORM_OPERATION($,", "no explicit path"),
    ("CUTTER_LOCATION_TRAJECTORY(.T.,.CONNECT.", "CUTTER_CONTACT_TRAJECTORY(.T.,.CONNECT.", "CUTTER_CONTACT_TRAJECTORY"),
    ("(35.,-5.,20.)", "(35.,-5.,20.,1.)", "a point of three numbers"),
    ("#92=POLYLINE", "#92=B_SPLINE_CURVE", "B_SPLINE_CURVE"),
    ("#94=POLYLINE('',(#105,#106))", "#94=POLYLINE('',(#105,#106,#106))", "not as many as its points"),
    ("#92=POLYLINE('',(#102,#108))", "#92=POLYLINE('',(#102,#107))", "begins elsewhere"),
    (".TRAJECTORY_PATH.,$,$,$,.T.,#90", ".CONNECT.,$,$,$,.T.,#90", "an arc as a rapid"),
    ("0.01,.TCP.", "0.01,.CCP.", "feed"),
    ("(#10,#11),$,#8", "(#10,#8),$,#8", "SETUP in a workplan"), ("#1=PROJECT", "#1=PRODUCT", "no PROJECT"),
    ("#80=MILLING_MACHINE_FUNCTIONS(.T.,$,$", "#80=MILLING_MACHINE_FUNCTIONS(.T.,$,.T.", "coolants at a time"),
    ("#70,#80,$,$,$,$)", "#70,#80,$,#9,$,$)", "approach"), ("#80=MILLING_MACHINE_FUNCTIONS(.T.,$,$,.F.,$,()",
    "#80=MILLING_MACHINE_FUNCTIONS(.T.,$,$,.F.,$,(#9)", "clamps"), ("-50.,$,.F.", "-50.,$,.T.", "the spindle drives"),
    ("#107=", "#500=(CONVERSION_BASED_UNIT('INCH',#501)LENGTH_UNIT()NAMED_UNIT(#502));\n#107=", "not mm"),
    ("CIRCLE('',#905,5.)", "CIRCLE('',#905,7.)", "2 mm off its CIRCLE"), ("(30.,-5.,-1.)", "(30.,-5.,1.)", "2 mm off"),
    ("$,$,$,.T.,#93", "$,$,0,.T.,#93", "names nothing"), ("#93,#94,$", "#93,#94,#93", "normals"),
    ("#2=WORK", "#3=PROJECT('OTHER',#2,(#4),$,$,$);\n#2=WORK", "or several"),
    ("SETUP('SETUP',#20", "SETUP('SETUP',#21", "placed away"),
    ("#9,())", "#9,(#27));#27=WORKPIECE_SETUP(#4,#21,$,$,())", "placed away"),
    ("#901=COMPOSITE", "#901=(COMPOSITE", "names nothing")])
def test_what_is_not_carried_out_is_refused(old: str, new: str, said: str) -> None:
    assert old in TILTED
    found = [d for d in read_bytes(TILTED.replace(old, new)).diagnostics if d.code == "cl.step-nc"]
    assert len(found) == 1 and (said in found[0].message or said == "names nothing"), found


def test_numbers_of_instances_may_begin_with_noughts() -> None:
    seen = commanded(TILTED.replace("CIRCLE('',#905", "CIRCLE('',#0905").encode())
    assert seen.tip == pytest.approx(tilted().toolpath.tip)


def test_values_of_part_21() -> None:
    found = instances("#1=A('it''s (a) #2',#2,\n.T.,$,(1.,-2.E-1),S(.R.));\n/* #3=B(); */#2=(X()Y());\n")
    assert found[1].values == ("it's (a) #2", Reference(2), ".T.", None, (1.0, -0.2), Typed("S", (".R.",)))
    assert (found[2].name, found[2].line, 3 in found) == ("", 3, False)
    with pytest.raises(ValueError, match="line 1"):
        instances("#1=A((1,2);")
