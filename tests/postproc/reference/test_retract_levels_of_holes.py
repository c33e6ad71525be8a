"""Where a cut begins that no RAPID leads to: at the level to which the last hole was left, whatever cycle and control."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import postproc
import toolpaths
import toolpaths.cl.cycles
from postproc.pipeline.result import PostResult
from postproc.verification.second_witness import second_witness
from tests.postproc.kit import machine, setup_of

CONTROLS = ("fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc", "linuxcnc", "generic-iso")
PLANE, TOP, LEVEL = 3.0, 5.0, 50.0
SETUP = setup_of("[tools.1]\ngauge_length = 120.0\n[tools.2]\ngauge_length = 90.0\n")
START = f"""TOOL PATH/OP1,TOOL,EM10
MSYS/0,0,0,1,0,0,0,1,0
LOAD/TOOL,1
SPINDL/RPM,1000,CLW
RAPID
GOTO/0,0,{LEVEL:g},0,0,1
FEDRAT/MMPM,250
"""
CUT = "GOTO/20,10,5\nGOTO/30,10,5\nEND-OF-PATH\nFINI\n"
CHANGE = "LOAD/TOOL,2\nSPINDL/RPM,1000,CLW\n"
STATES = "SPINDL/RPM,1500,CLW\nCOOLNT/MIST\n"
# kind, what states where the tool leaves the hole to, what stands between CYCLE/OFF and the cut, control:
# every pair of two columns is in it but for those of the tool change and the control.
CASES = [
    ("DRILL", "RTRCTO,10,", "", 0), ("DRILL", "RETURN,10,", "RAPID\n", 1), ("DRILL", "", STATES, 2),
    ("DRILL", "RTRCTO,AUTO,", CHANGE, 3), ("DRILL", "RTRCTO,1,", "", 4), ("DRILL", "RTRCTO,3,", "RAPID\n", 5),
    ("DRILL,DEEP,STEP,5", "RTRCTO,10,", STATES, 4), ("DRILL,DEEP,STEP,5", "RETURN,10,", CHANGE, 5),
    ("DRILL,DEEP,STEP,5", "", "", 3), ("DRILL,DEEP,STEP,5", "RTRCTO,AUTO,", "RAPID\n", 0),
    ("DRILL,DEEP,STEP,5", "RTRCTO,1,", STATES, 1), ("DRILL,DEEP,STEP,5", "RTRCTO,3,", CHANGE, 2),
    ("BRKCHP,STEP,5", "RTRCTO,10,", "RAPID\n", 2), ("BRKCHP,STEP,5", "RETURN,10,", STATES, 0),
    ("BRKCHP,STEP,5", "", CHANGE, 1), ("BRKCHP,STEP,5", "RTRCTO,AUTO,", "", 5), ("BRKCHP,STEP,5", "RTRCTO,1,", "", 3),
    ("BRKCHP,STEP,5", "RTRCTO,3,", STATES, 4), ("BORE", "RTRCTO,10,", CHANGE, 1), ("BORE", "RETURN,10,", "", 2),
    ("BORE", "", "RAPID\n", 4), ("BORE", "RTRCTO,AUTO,", STATES, 3), ("BORE", "RTRCTO,1,", STATES, 5),
    ("BORE", "RTRCTO,3,", "", 0), ("TAP", "RTRCTO,10,", STATES, 5), ("TAP", "RETURN,10,", "RAPID\n", 3),
    ("TAP", "", CHANGE, 0), ("TAP", "RTRCTO,AUTO,", STATES, 2), ("TAP", "RTRCTO,1,", CHANGE, 4), ("TAP", "RTRCTO,3,", "", 1)]


def cl(kind: str, out: str, between: str, cut: str = CUT) -> str:
    feed = "MMPR,1" if kind == "TAP" else "MMPM,120"
    return f"{START}CYCLE/{kind},RAPTO,{PLANE:g},FEDTO,-12,{out}{feed}\nGOTO/0,0,5\nGOTO/20,0,5\nCYCLE/OFF\n{between}{cut}"


def converted(text: str, control: str, name: str = "mill-3axis") -> PostResult:
    path, found = toolpaths.read_bytes(text, file="part.cls")
    return postproc.convert(path, machine(name), control, SETUP, diagnostics=found)


def witnessed(result: PostResult) -> set[str]:
    """What the second witness finds, whether or not the read-back has found something before."""
    assert result.comparison is not None and result.job is not None and result.asked is not None
    return {d.code for d in second_witness(result.source, result.asked, result.options, result.job, result.comparison)[1]}


def level_of(out: str) -> float:
    """Z at which the tool leaves the hole: never below the start plane, AUTO is where it came from."""
    number = out.split(",")[1] if out else "0"
    return LEVEL if number == "AUTO" else TOP + max(float(number), PLANE)


@pytest.mark.covering
@pytest.mark.parametrize(("kind", "out", "between", "control"), CASES)
def test_the_cut_begins_where_the_hole_was_left_to(kind: str, out: str, between: str, control: int) -> None:
    result = converted(cl(kind, out, between), CONTROLS[control])
    assert result.ok, [str(d) for d in result.diagnostics]
    assert result.witness is not None and not result.witness.not_compared
    assert result.comparison is not None
    tip, end = result.comparison.tip, np.array([20.0, 10.0, 5.0])
    came = int(np.flatnonzero(np.abs(tip - end).max(axis=1) < 1e-3)[0])
    if between == "RAPID\n":
        assert [20.0, 0.0, level_of(out)] in np.round(tip[:came], 3).tolist()
    else:
        assert tip[came - 1] == pytest.approx([20.0, 0.0, level_of(out)], abs=1e-3)


@pytest.mark.covering
@pytest.mark.parametrize("cut", ["GOTO/20,0,20\n", "GOTO/20,0,11\n", "GOTO/20,0,70\n", "GOTO/20,0,-5\n"])
@pytest.mark.parametrize(("kind", "out", "control"), [
    ("DRILL", "RTRCTO,10,", "fanuc-30i"), ("BORE", "RTRCTO,10,", "haas-ngc"), ("BORE", "RTRCTO,AUTO,", "linuxcnc")])
def test_a_cut_along_the_axis_of_the_hole_is_no_way_out_of_it(kind: str, out: str, control: str,
                                                              cut: str) -> None:
    """Up, down and back into the hole: the rapid of the retract counts with the hole, the rest is a cut at its own feed."""
    result = converted(cl(kind, out, STATES, cut + CUT), control)
    assert result.ok, [str(d) for d in result.diagnostics]


@pytest.mark.parametrize("between", ["", CHANGE])
def test_a_cut_from_another_level_is_seen_by_the_second_witness(between: str,
                                                                monkeypatch: pytest.MonkeyPatch) -> None:
    """The reader takes 10 mm for 20: the read-back agrees with the program, the second witness has the record's number."""
    old = toolpaths.cl.cycles._made
    monkeypatch.setattr(toolpaths.cl.cycles, "_made", lambda b, v: replace(old(b, v), retract=20.0))
    result = converted(cl("DRILL", "RTRCTO,10,", between), "fanuc-30i")
    assert {d.code for d in result.diagnostics if d.severity.name == "ERROR"} == {"witness.path"}


@pytest.mark.parametrize("state", ["spindle", "coolant"])
def test_the_way_out_at_feed_has_the_states_of_its_hole(state: str) -> None:
    """BORE feeds out with the speed and coolant of the hole; others are a fault there."""
    good = converted(cl("BORE", "RTRCTO,10,", STATES), "fanuc-30i")
    assert good.ok and good.comparison is not None and good.comparison.executed is not None
    motion = good.comparison.executed[1]
    rises = np.diff(good.comparison.tip[:, 2], prepend=0.0) > 1.0
    out = int(np.flatnonzero((motion.code == 1) & motion.hole & rises)[-1])
    values = motion.rpm if state == "spindle" else motion.coolant
    wrong = values.copy()
    wrong[out] = np.nanmax(values) if state == "spindle" else 0 if values[out] else 1
    spoilt = replace(motion, **{"rpm" if state == "spindle" else "coolant": wrong})
    comparison = replace(good.comparison, executed=(good.comparison.executed[0], spoilt))
    assert witnessed(replace(good, comparison=comparison)) == {f"witness.{state}"}


def test_an_arc_straight_behind_a_hole_is_refused_and_the_hint_helps() -> None:
    arc = "CIRCLE/20,5,5,0,0,-1,5,0.03,0.5,10,0\nGOTO/25,5,5\nEND-OF-PATH\nFINI\n"
    result = converted(cl("DRILL", "RTRCTO,10,", "", arc), "fanuc-30i")
    found = [d for d in result.diagnostics if d.code == "arc.behind_hole"]
    assert len(found) == 1 and found[0].lines and not result.text
    assert "put a GOTO to the start of the arc between CYCLE/OFF and the arc" in str(found[0])
    assert converted(cl("DRILL", "RTRCTO,10,", "GOTO/20,0,5\n", arc), "fanuc-30i").ok
