"""Paths of the machine along smoothed passes, feeds that keep the limits, and the plan of a program's passes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.interpolate import BSpline

from machines.machine import Machine
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.plan import PlannerOptions
from postproc.pipeline.result import PostResult
from postproc.planning.geometry import MachinePath, PathStretch, machine_paths
from postproc.planning.pass_geometry import PassGeometry, chains, pass_geometry, stops_of
from postproc.planning.planned import PassFeed, PlannedMotion, Source, joint_limits, plan_pass, planned_motion
from postproc.planning.steady_feed import CORNER, steady_speed
from postproc.setup.model import load_setup
from tests.postproc.kit import SAMPLES, convert, few_sides, good, goto, machine, toolpath
from tests.toolpaths.smoothing_kit import smooth
from toolpaths.arrays import Floats
from toolpaths.diagnostics import DiagnosticError
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.smoothing.smooth import Tolerance

TOLERANCE = Tolerance(0.01, np.radians(0.05))


def wave(count: int) -> list[str]:
    """GOTOs along a smooth curve with a swinging axis, rounded as CAM systems do."""
    s = np.linspace(0.0, 1.0, count)
    tip = np.stack((40.0 * s, 4.0 * np.sin(5.0 * s), 2.0 * np.cos(7.0 * s)), axis=1)
    axis = np.stack((0.3 + 0.1 * np.sin(4.0 * s), 0.2 * np.cos(3.0 * s), np.ones(count)), axis=1)
    axis = np.round(axis / np.linalg.norm(axis, axis=1, keepdims=True), 6)
    return goto(np.round(tip, 4), axis / np.linalg.norm(axis, axis=1, keepdims=True))


@cache
def waves(name: str) -> PostResult:
    setup, _ = load_setup(SAMPLES / ("h4a.setup.toml" if name.startswith("h4a") else "tools.setup.toml"))
    lines = wave(160)
    return good(convert(toolpath("RAPID", lines[0], "FEDRAT/MMPM,1500", *lines[1:]), name, setup=setup))


@cache
def dome() -> PostResult:
    setup, _ = load_setup(SAMPLES / "h4a.setup.toml")
    return good(convert(few_sides("h4a_dome.cls"), "h4a-c-table", setup=setup))


def geometry(result: PostResult, sharpest: float = 2.4) -> list[PassGeometry]:
    assert result.job is not None and result.path is not None
    job = result.job
    found, diagnostics = pass_geometry(result.path, job.moves, job.kinematics, TOLERANCE, stops_of(job.toolpath, job.moves),
                                       sharpest)
    assert not diagnostics
    return found


def motion(result: PostResult) -> PlannedMotion:
    assert result.job is not None and result.path is not None
    job = result.job
    made, diagnostics = planned_motion(Source(result.path, job.moves, job.machine, job.kinematics, TOLERANCE,
                                              stops_of(job.toolpath, job.moves)))
    assert made is not None and not diagnostics
    return made


def limits_of(made: Machine) -> JointLimits:
    return joint_limits(made.limits)


CASES: dict[str, Callable[[str], PostResult]] = {
    "mikron-ucp710": waves, "fork-head-ab": waves, "nutating-head": waves, "h4a-c-table": lambda _: dome()}


@pytest.mark.parametrize("name", CASES)
def test_joints_follow_the_smoothed_tool(name: str) -> None:
    result = CASES[name](name)
    assert result.job is not None
    for one in geometry(result):
        kin = result.job.kinematics(int(result.job.moves.tool[one.move[0]]))
        for path in one.paths:
            s = np.linspace(path.start, path.end, 3001)
            tip, axis = one.smooth.at(s)
            found_tip, found_axis = kin.forward(path.derivatives(s).q, near=np.hstack((tip, axis)))
            assert np.linalg.norm(found_tip - tip, axis=1).max() < 0.1 * TOLERANCE.tip
            assert angle_between(found_axis, axis).max() < 0.1 * TOLERANCE.axis
            np.testing.assert_allclose(path.tip(s).q, tip, atol=0.1 * TOLERANCE.tip)


@pytest.mark.parametrize("name", CASES)
def test_joints_stay_near_the_written_blocks(name: str) -> None:
    result = CASES[name](name)
    assert result.path is not None
    for one in geometry(result):
        assert (np.diff(one.ends) >= 0.0).all() and one.ends[-1] == one.smooth.s[-1]
        for path in one.paths:
            own = (one.ends > path.start) & (one.ends <= path.end)
            gap = np.abs(path.derivatives(one.ends[own]).q - result.path.q[one.block[own]])
            assert gap.max() < 0.3


def test_derivatives_are_those_of_the_path() -> None:
    path = geometry(waves("mikron-ucp710"))[0].paths[0]
    s, h = np.linspace(path.start + 1.0, path.end - 1.0, 400), 1e-4
    low, high = path.derivatives(s - h), path.derivatives(s + h)
    at = path.derivatives(s)
    for below, above, wanted in zip(low[:3], high[:3], at[1:], strict=True):
        np.testing.assert_allclose((above - below) / (2.0 * h), wanted, atol=1e-4 * np.abs(wanted).max())


def exceeded(one: PassGeometry, result: PostResult, limits: JointLimits, speed: Floats) -> Floats:
    """(k,) worst ratio to any limit in each block at constant ds/dt, by differences of the exact inverse."""
    assert result.job is not None
    kin = result.job.kinematics(int(result.job.moves.tool[one.move[0]]))
    worst = np.zeros(len(one.block))
    h = 0.02
    for k, (low, high) in enumerate(zip(one.begin, one.ends, strict=True)):
        path = next(p for p in one.paths if p.start <= 0.5 * (low + high) <= p.end)
        s = np.linspace(max(low, path.start + 1.5 * h), min(high, path.end - 1.5 * h), 9)
        places = s[:, None] + h * np.array([-1.5, -0.5, 0.5, 1.5])
        tip, axis = one.smooth.at(places.ravel())
        near = path.derivatives(places.ravel()).q
        branches = kin.inverse(tip, axis, near=near)
        q = branches[np.abs(branches - near).sum(axis=2).argmin(axis=0), np.arange(len(near))].reshape(9, 4, -1)
        steps = [np.abs(q[:, 2] - q[:, 1]) / h, np.abs(q[:, 3] - q[:, 2] - q[:, 1] + q[:, 0]) / (2.0 * h**2),
                 np.abs(q[:, 3] - 3.0 * q[:, 2] + 3.0 * q[:, 1] - q[:, 0]) / h**3]
        worst[k] = max(float((d * speed[k] ** order / limit).max()) for order, (d, limit) in
                       enumerate(zip(steps, (limits.velocity, limits.acceleration, limits.jerk), strict=True), start=1))
    return worst


def test_steady_feed_keeps_every_limit_in_the_block_and_uses_one() -> None:
    result = waves("mikron-ucp710")
    limits = limits_of(machine("mikron-ucp710"))
    one, = geometry(result, CORNER)
    speed = steady_speed(one, limits)
    ratio = exceeded(one, result, limits, speed)
    assert ratio.max() < 1.01
    assert np.median(ratio) > 0.6 and ratio.max() > 0.9


def test_steady_feed_is_that_of_the_slowest_place_of_a_block() -> None:
    result = good(convert(toolpath("RAPID", "GOTO/0,0,50", "FEDRAT/MMPM,6000", "GOTO/50,0,50",
                                   "MOVARC/50,1,50,0,0,1,1,ANGLE,90", "GOTO/51,1,50", "GOTO/51,60,50"), "mill-3axis"))
    made = motion(result)
    assert result.path is not None
    limits = limits_of(machine("mill-3axis"))
    arc = np.flatnonzero(result.path.code == 2)
    radius = 1.0
    bound = min((limits.jerk[:2].min() * radius**2) ** (1.0 / 3.0),
                (limits.acceleration[:2].min() * radius) ** 0.5)
    assert len(arc) == 1 and made.needed[arc[0]] >= 0.99 * 0.5 * np.pi * radius / bound


def test_plan_keeps_limits_and_feed_and_rests_at_both_ends() -> None:
    result = waves("mikron-ucp710")
    assert result.job is not None
    one, = geometry(result)
    made = plan_pass(one, result.job.moves, limits_of(machine("mikron-ucp710")), PlannerOptions(strict=True))
    assert made.usage().worst <= 1.0 + 1e-9
    run = made.trajectory()
    tip = one.smooth.at(run.s)[0]
    assert (np.linalg.norm(np.diff(tip, axis=0), axis=1) / 1e-3).max() <= 25.0 * 1.001
    assert not run.qd[0].any() and not run.qd[-1].any()
    travel = np.linalg.norm(np.diff(tip, axis=0), axis=1).sum()
    assert made.seconds > travel / 25.0


def test_motion_stops_at_a_dwell_and_not_at_a_comment() -> None:
    travels = ["GOTO/20,0,50", "GOTO/40,0,50", "GOTO/60,0,50"]
    for record, stops in (("DELAY/1.0", True), ("PPRINT/half path", False)):
        lines = ["RAPID", "GOTO/0,0,50", "FEDRAT/MMPM,1200", travels[0], record, *travels[1:]]
        result = good(convert(toolpath(*lines), "mill-3axis"))
        made = motion(result)
        assert (len(made.passes) == 2) is stops
        assert len(made.trajectories()) == len(made.passes)
        assert made.seconds > 60.0 / 20.0
        limiting = made.limiting()
        assert set(limiting) == {"X", "Y", "Z"} and limiting["X"]["jerk_s"] > 0.0
        assert made.shares is not None and made.shares.seconds == pytest.approx(made.seconds)


def test_chains_leave_rapids_links_and_holes_out() -> None:
    result = good(convert(toolpath("RAPID", "GOTO/0,0,50", "GOTO/10,0,50", "GOTO/20,0,50", "RAPID", "GOTO/20,0,60",
                                   "CYCLE/DRILL,FEDTO,5,MMPM,200,CLEAR,2", "GOTO/30,0,50", "CYCLE/OFF", "RAPID",
                                   "GOTO/30,0,60", "GOTO/40,0,50"), "mill-3axis"))
    assert result.job is not None
    moves = result.job.moves
    found = chains(moves, np.zeros(0, dtype=np.int64))
    rows = np.concatenate([np.arange(*one) for one in found])
    assert len(found) == 2 and (moves.kind[rows] != 0).all() and (moves.hole[rows] < 0).all()
    tips = moves.tip[rows]
    assert tips[:, 0].tolist() == [10.0, 20.0, 40.0]


def pole(off: float) -> list[str]:
    """Straight cut, the axis passing the direction of C at `off` degrees."""
    x = np.linspace(-30.0, 30.0, 120)
    lean = np.radians(0.3 * x)
    axis = np.stack((np.sin(lean), np.full(120, np.sin(np.radians(off))), np.cos(lean)), axis=1)
    axis = np.round(axis / np.linalg.norm(axis, axis=1, keepdims=True), 7)
    tip = np.round(np.stack((x, 0.1 * x, 0.0 * x), axis=1), 4)
    return goto(tip, axis / np.linalg.norm(axis, axis=1, keepdims=True))


@pytest.mark.parametrize("off", [0.0005, 0.02])
def test_direction_of_a_rotary_axis_is_passed_without_a_swing(off: float) -> None:
    lines = pole(off)
    result = good(convert(toolpath("RAPID", lines[0], "FEDRAT/MMPM,1500", *lines[1:]), "mikron-ucp710"))
    assert result.path is not None and result.job is not None
    made = motion(result)
    cutting = made.needed > 0.0
    assert made.needed[cutting].sum() < 1.05 * result.path.seconds[cutting].sum()  # rest at both ends, no swing
    one, = made.passes
    path, = one.paths
    assert path.led.any() and np.ptp(path.values[:, 4]) < np.radians(5.0)
    kin = result.job.kinematics(int(result.job.moves.tool[one.move[0]]))
    tip, axis = one.smooth.at(path.s)
    found_tip, found_axis = kin.forward(path.values[:, :5])
    assert np.linalg.norm(found_tip - tip, axis=1).max() < 1e-9
    assert angle_between(found_axis, axis).max() <= TOLERANCE.axis
    assert made.seconds < 3.0


def test_a_real_swing_next_to_the_direction_of_a_rotary_axis_stays_a_swing() -> None:
    lines = pole(0.5)
    result = good(convert(toolpath("RAPID", lines[0], "FEDRAT/MMPM,1500", *lines[1:]), "mikron-ucp710"))
    made = motion(result)
    one, = made.passes
    assert not one.paths[0].led.any() and np.ptp(one.paths[0].values[:, 4]) > np.radians(170.0)
    assert result.path is not None
    assert np.fmax(made.needed, result.path.seconds)[one.block].sum() > 1.2 * result.path.seconds[one.block].sum()


def test_feed_changes_are_known_to_the_planner_and_kept() -> None:
    result = good(convert(toolpath("RAPID", "GOTO/0,0,50", "FEDRAT/MMPM,1200", "GOTO/40,0,50", "FEDRAT/MMPM,600",
                                   "GOTO/60,0,50", "GOTO/80,0,50"), "mill-3axis"))
    made = motion(result)
    one, = made.passes
    plan, = made.plans
    feed = PassFeed(one, one.smooth.s, made.source.moves.feed[one.move], made.source.moves.seconds[one.move])
    assert feed.breaks.tolist() == [40.0]
    assert feed(np.array([20.0, 50.0])).tolist() == pytest.approx([20.0, 10.0])
    speed = plan.speed(np.linspace(0.0, 80.0, 500))
    assert speed[:250].max() == pytest.approx(20.0, rel=1e-3) and speed[260:].max() <= 10.0 * (1.0 + 1e-3)


def test_a_stated_time_is_the_least_time_of_a_move() -> None:
    travels = ["RAPID", "GOTO/0,0,50", "FEDRAT/INVERS,30", "GOTO/10,0,50", "GOTO/30,0,50"]
    result = good(convert(toolpath(*travels), "mill-3axis"))
    made = motion(result)
    assert made.seconds > 4.0
    speed = made.plans[0].speed(np.array([5.0, 20.0]))
    assert speed[0] <= 5.0 + 1e-6 and speed[1] <= 10.0 + 1e-6


def test_machine_without_jerk_limits_is_planned_at_second_order() -> None:
    result = waves("mikron-ucp710")
    assert result.job is not None
    own = limits_of(machine("mikron-ucp710"))
    free = JointLimits(own.velocity, own.acceleration, np.full(5, np.inf))
    one, = geometry(result)
    fast, slow = (plan_pass(one, result.job.moves, limits).seconds for limits in (free, own))
    assert 0.5 * slow < fast < slow
    assert (steady_speed(one, free) >= steady_speed(one, own)).all()


def test_what_cannot_be_planned_is_named() -> None:
    made = motion(waves("mikron-ucp710"))
    path = made.passes[0].paths[0]
    broken = replace(path, fitted=BSpline(path.fitted.t, np.nan * path.fitted.c, 5))
    with pytest.raises(DiagnosticError, match=r"plan\.failed"):
        made._plan(replace(made.passes[0], paths=(broken,)))


def test_plan_takes_the_tool_axes_that_are_written() -> None:
    lines = pole(0.02)
    result = good(convert(toolpath("RAPID", lines[0], "FEDRAT/MMPM,1500", *lines[1:]), "mikron-ucp710"))
    assert result.path is not None and result.job is not None
    one, = geometry(result)
    kin = result.job.kinematics(int(result.job.moves.tool[one.move[0]]))
    _, written = kin.forward(result.path.q[one.block])
    _, commanded = result.job.moves.curves().take(result.path.move[one.block]).at(result.path.u[one.block])
    assert angle_between(written, commanded).max() > 0.35 * TOLERANCE.axis
    assert angle_between(one.smooth.at(one.ends)[1], written).max() < 0.3 * TOLERANCE.axis


def straight(*tips: tuple[float, float, float]) -> Curves:
    tip = np.array(tips)
    moves = len(tip) - 1
    up, none = np.tile([0.0, 0.0, 1.0], (moves, 1)), np.zeros((moves, 3))
    return Curves(tip[:-1], tip[1:], up, up, np.zeros(moves, dtype=bool), none, none, np.zeros(moves))


def test_stretches_together_are_those_alone_and_one_out_of_reach_spoils_no_other() -> None:
    kin = machine("uranesx").kinematics
    home = machine("uranesx").home
    paths = [smooth(straight(*tips), TOLERANCE) for tips in (
        ((0.0, 0.0, 0.0), (50.0, 0.0, 0.0), (50.0, 40.0, -20.0)), ((0.0, 0.0, 0.0), (5000.0, 0.0, 0.0)),
        ((-80.0, 10.0, 5.0), (-20.0, 60.0, 5.0)))]
    stretches = [PathStretch(path, 0.0, float(path.s[-1]), lambda s: np.tile(home, (len(s), 1))) for path in paths
                 if path is not None]
    found = machine_paths(stretches, kin)
    assert [isinstance(one, MachinePath) for one in found] == [True, False, True]
    assert "no joints at s = " in str(found[1])
    for one, own in ((stretches[0], found[0]), (stretches[2], found[2])):
        alone, = machine_paths([one], kin)
        assert isinstance(own, MachinePath) and isinstance(alone, MachinePath) and own.s.tolist() == alone.s.tolist()
        np.testing.assert_allclose(own.values, alone.values, rtol=0.0, atol=1e-12)
        assert own.worst == pytest.approx(alone.worst, rel=1e-6) and own.worst <= 0.05
