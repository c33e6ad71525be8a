"""Passes and plans that cannot be run: reported once for those alike, with what the other axes lost by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import toolpaths
from postproc.base.options import Options
from postproc.orientation.candidates.candidate_times import turned
from postproc.orientation.candidates.candidates import tried
from postproc.orientation.candidates.infeasible_passes import unfit
from postproc.orientation.candidates.travel import nearest_inside
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.passes import Pass, work_of
from postproc.orientation.passes.reasons import Touching
from postproc.orientation.plans.orient import orient
from postproc.setup.model import PartPlacement, SetupFile, ToolSetup
from tests.postproc.kit import SAMPLES, machine, toolpath
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Severity
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

BALL = ["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,30000"]
LINES = ["MULTAX", *(line for k in range(3) for line in (
    "RAPID", f"GOTO/0,{k},9,0,0,1", "RAPID",
    f"GOTO/0,{k},0,0,0,1", f"GOTO/80,{k},0,0,0,1", "RAPID", f"GOTO/80,{k},9,0,0,1"))]


class Everywhere:
    """Bodies that every axis touches, deeper in later passes and where the tool stands upright."""

    def touching(self, one: Pass, axis: Floats) -> Touching:
        depth = one.number + 1.0 + float(axis[2])
        return Touching(1, 2, "fixture vise", -depth, 0.0, one.line)


def test_passes_that_always_touch_are_one_error() -> None:
    """The deepest stands for all; the others are counted by what they lost by, with the one that touches least."""
    path, m = toolpath(*LINES, head=BALL), machine("mikron-ucp710")
    work, _ = work_of(path, m, SetupFile(), Options())
    assert work is not None
    results = [tried(one, m, AllowedAxes(60.0 * DEG, Everywhere())) for one in work.passes]
    found = unfit(work, results)
    assert [(d.code, d.severity, d.count) for d in found] == [("orient.touches", Severity.ERROR, 3)]
    lost = [each for one in results for each in one.rejected if each.made is not one.own]
    touching = sum(each.kind == "touches" for each in lost)
    least = min(each.made.axis[2] for each in results[0].rejected if each.kind == "touches")
    noted = found[0].message
    assert noted.startswith("pass 2 and 2 more with the axis of the CL file: holder of T1 touches fixture vise by 4.00 mm")
    assert f"none of {len(lost)} other axes tried can be taken" in noted
    assert f"{touching} touches part, fixture or table (the least: holder of T1 touches fixture vise by {1 + least:.2f}" \
        in noted


def test_no_plan_is_an_error_that_counts_a_pass_once() -> None:
    """Z ends 10 mm above the only cut: it can be run, and no path to it nor back from it."""
    m = machine("mikron-ucp710")
    upper = m.limits.upper.copy()
    upper[m.axis_names.index("Z")] = 10.0
    choice, found = orient(toolpath(*LINES[:8], head=BALL), replace(m, limits=replace(m.limits, upper=upper)), SetupFile(),
                           Options())
    assert choice is None
    assert [(d.code, d.severity, d.count, d.lines) for d in found] == [("orient.ways", Severity.ERROR, 1, (11,))]
    assert "so that no plan can be run" in found[0].message


def ball_passes(*ys: float) -> Toolpath:
    lines = ["MULTAX", *(line for y in ys for line in (
        "RAPID", f"GOTO/0,{y},9,0,0,1", "RAPID", f"GOTO/0,{y},0,0,0,1", f"GOTO/80,{y},0,0,0,1", "RAPID",
        f"GOTO/80,{y},9,0,0,1"))]
    return toolpath(*lines, head=BALL)


def at(x: float, y: float = 0.0, z: float = 0.0) -> SetupFile:
    return SetupFile(part=PartPlacement(origin=(x, y, z)))


def test_a_part_out_of_travel_is_reported_before_any_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """X ends at 355 mm and the table leans by 30 degrees one direction and 120 the other: at 700 mm nothing helps."""
    monkeypatch.setattr("postproc.orientation.plans.orient.each_pass", None)
    choice, found = orient(ball_passes(0.0, 1.0, 2.0), machine("mikron-ucp710"), at(700.0))
    assert choice is None and [(d.code, d.count, d.lines) for d in found] == [("orient.travel", 3, (11, 18, 25))]
    noted = found[0].message
    assert noted.startswith("pass 0 with the axis of the CL file: travel: axis X at 780.000 mm, allowed -355.000 to 355.000")
    assert "425.000 too high; no other axis is inside travel, the nearest to it has axis " in noted
    assert noted.endswith("; the CL's axis is outside alike in 2 more passes")


def test_holes_out_of_travel_have_no_other_axis(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("postproc.orientation.plans.orient.each_pass", None)
    lines = ["RAPID", "GOTO/0,0,9", "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/0,0,0", "CYCLE/OFF", "RAPID", "GOTO/0,0,9"]
    _, found = orient(toolpath(*lines, head=BALL), machine("mikron-ucp710"), at(0.0, 300.0))
    assert [d.code for d in found] == ["orient.travel"]
    assert "axis Y at 300.000 mm, allowed -275.000 to 275.000: 25.000 too high; no other axis is allowed (drilling" \
        in found[0].message


def test_an_axis_inside_travel_is_found_and_tried() -> None:
    """Few axes turn the part far enough about C, none of them among those that reach far."""
    m, setup = machine("mikron-ucp710"), at(500.0).model_copy(update={"tools": {"5": ToolSetup(gauge_length=100.0)}})
    work, _ = work_of(toolpaths.read(SAMPLES / "bicubic.cls")[0], m, setup, Options())
    assert work is not None
    one, allowed = work.passes[20], AllowedAxes(60.0 * DEG)
    found = nearest_inside(one, m, allowed)
    assert found.size == 0.0 and not turned(one, found.axis, m).refused and turned(one, one.axis, m).refused
    assert angle_between(found.axis, one.axis) < 60.0 * DEG
    best = tried(one, m, allowed).best
    assert not best.refused and np.isfinite(best.seconds)


def test_a_joint_that_the_tool_leaves_free_may_bring_it_inside() -> None:
    """A flat cutter at X = 360: the C table turned by some 20 to 40 degrees has it inside X and Y."""
    head = ["UNITS/MM", "CUTTER/16,0", *BALL[2:]]
    path = toolpath("RAPID", "GOTO/-5,0,9", "RAPID", "GOTO/-5,0,0", "GOTO/5,0,0", "RAPID",
                    "GOTO/5,0,9", head=head)
    m = machine("mikron-ucp710")
    for x, inside in ((370.0, True), (500.0, False)):
        work, _ = work_of(path, m, at(x), Options())
        assert work is not None and work.passes[0].fixed and turned(work.passes[0], work.passes[0].axis, m).refused
        assert (nearest_inside(work.passes[0], m, AllowedAxes(60.0 * DEG)).size == 0.0) == inside


def test_travel_that_ends_alike_is_reported_once() -> None:
    """Other passes of the same file are out by other amounts: the farthest stands for all."""
    choice, found = orient(ball_passes(0.0, 3.0, 6.0), machine("mikron-ucp710"), at(300.0))
    assert choice is not None
    noted = [d for d in found if d.code == "orient.own_reach"]
    assert [(d.count, d.severity) for d in noted] == [(3, Severity.WARNING)]
    assert "380.000 mm, allowed -355.000 to 355.000: 25.000 too high" in noted[0].message


def test_what_helps_is_said_by_what_is_against_it() -> None:
    """Slides: elsewhere on the table; rotary axes: not that. Another axis only where one may be had."""
    under = toolpath("MULTAX", "RAPID", "GOTO/0,0,-9,0,0,-1", "RAPID", "GOTO/0,0,0,0,0,-1", "GOTO/80,0,0,0,0,-1", "RAPID",
                     "GOTO/80,0,-9,0,0,-1", head=["UNITS/MM", "CUTTER/16,0", *BALL[2:]])
    turned_over = "turn the part in the set-up (part.x_axis, part.y_axis) or use another machine"
    for name, code, said in (("mikron-ucp710", "orient.travel", "axis A at 180.000 degrees"),
                             ("nutating-head", "orient.reach", "bring the tool no nearer to it than 90.000 degrees")):
        _, found = orient(under, machine(name), SetupFile(tools={"1": ToolSetup(gauge_length=100.0)}))
        assert [d.code for d in found if d.severity is Severity.ERROR] == [code]
        assert said in found[-1].message and found[-1].hint.startswith(turned_over)
    _, found = orient(ball_passes(0.0), machine("mikron-ucp710"), at(700.0))
    assert found[0].hint.startswith("move or turn the part")


def test_a_pass_out_of_reach_is_not_reported_to_touch_too() -> None:
    path, m = toolpath(*LINES, head=BALL), machine("mikron-ucp710")
    work, _ = work_of(path, m, at(300.0), Options())
    assert work is not None
    results = [tried(one, m, AllowedAxes(5.0 * DEG, Everywhere())) for one in work.passes]
    assert {d.code for d in unfit(work, results)} == {"orient.reach"}
