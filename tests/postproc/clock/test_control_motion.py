"""The reference control: its motion differentiated, its path against its tolerance, its time against a measured one and
the planner's optimum of the same path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.clock.allowed import block_speeds
from postproc.clock.control import execute
from postproc.clock.path import CommandedPath, blended, fitted
from postproc.clock.settings import STEEPEST, ControlSettings
from postproc.cycle_time import control
from postproc.cycle_time.estimate import timed, total
from postproc.feedrate.feed import StepFeed
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.plan import PlannerOptions, plan
from postproc.feedrate.rest_to_rest import rest_seconds
from tests.benchmarks.published import LIMITS, MEASURED, commanded, points
from tests.postproc.time_kit import blocks, machine, model
from toolpaths.arrays import Floats

OPTIMUM = 2.17
"""s of the planner on the measured curve itself (`published.py` computes it)"""


@pytest.mark.parametrize("chord", [0.1, 0.2, 0.7])
def test_the_measured_curve_takes_what_was_measured(chord: float) -> None:
    seconds = execute(commanded(points(chord)), LIMITS).seconds
    assert seconds == pytest.approx(MEASURED, rel=0.05)
    assert seconds > OPTIMUM


def used(q: Floats, step: float, settings: ControlSettings) -> list[float]:
    """Largest differences of the samples over velocity, acceleration and jerk, rest before and behind."""
    q = np.concatenate([q[:1]] * 4 + [q] + [q[-1:]] * 4)
    limits = settings.velocity, settings.acceleration, np.minimum(settings.jerk, settings.acceleration / STEEPEST)
    return [float((np.abs(np.diff(q, order, axis=0)) / step**order / limit).max()) for order, limit in enumerate(limits, 1)]


def program(seed: int, axes: int) -> tuple[CommandedPath, ControlSettings]:
    """Long, short and shortest blocks, none at all, reversals, straight on; feeds, tolerances, stops, few blocks ahead."""
    rng = np.random.default_rng(seed)
    n = 12
    weight = np.where(np.arange(axes) < 3, 1.0, 50.0)
    kind = rng.integers(6, size=n)
    scale = np.select([kind == 0, kind == 1, kind == 2], [0.0, 10.0 ** rng.uniform(-8, -3, n), 0.05], 2.0)
    step = rng.normal(size=(n, axes)) / weight * scale[:, None]
    for i in range(1, n):
        step[i] = {4: -step[i - 1], 5: step[i - 1]}.get(int(kind[i]), step[i])
    points = np.concatenate([np.zeros((1, axes)), np.cumsum(step, axis=0)]) + rng.uniform(-100.0, 100.0, axes)
    length = np.maximum(np.linalg.norm(step[:, :3], axis=1), 1e-9)
    path = CommandedPath(points, length, 10.0 ** rng.uniform(1.0, 4.0, n), rng.choice([0.0, 0.01, 0.1], n + 1),
                         rng.random(n + 1) < 0.15, weight)
    jerk = np.where(weight > 1.0, 200.0, 50_000.0) if seed % 2 else np.full(axes, np.inf)
    return path, ControlSettings(np.where(weight > 1.0, 1.0, 500.0), np.where(weight > 1.0, 10.0, 3000.0), jerk,
                                 int(rng.choice([1, 3, 200])), float(rng.choice([0.0, 0.001])))


@pytest.mark.parametrize(("seed", "axes"), [(1, 3), (2, 5), (4, 3), (10, 3)])
def test_no_program_makes_the_axes_jump_or_exceed_their_limits(seed: int, axes: int) -> None:
    """Behind filters of 20 ms; without them, all cycles but a few."""
    path, settings = program(seed, axes)
    moved = execute(path, replace(settings, smoothing=np.full(axes, 0.02)))
    motion, times = moved.axes(), moved.times()
    assert motion.q[[0, -1]] == pytest.approx(path.points[[0, -1]], abs=2e-6)
    assert np.isfinite(times).all() and (np.diff(times) >= 0.0).all() and times[-1] == pytest.approx(moved.seconds)
    velocity, acceleration, jerk = used(motion.q, settings.cycle, settings)
    assert velocity <= 1.01 and acceleration <= 1.02 and jerk <= 1.15
    sharp = execute(path, settings).axes()
    most = np.minimum(settings.jerk, settings.acceleration / STEEPEST)
    assert (np.abs(sharp.qdd) <= 1.06 * settings.acceleration).all()
    assert (np.abs(sharp.qddd) > 1.05 * most).any(axis=1).mean() < 0.06


@pytest.mark.parametrize("seed", [3, 4, 6, 13, 34])
def test_it_is_not_faster_than_the_planner_on_the_same_path_and_little_slower(seed: int) -> None:
    path, settings = program(seed, 3)
    moved = execute(path, settings)
    limits = JointLimits(settings.velocity, settings.acceleration,
                         np.minimum(settings.jerk, settings.acceleration / STEEPEST))
    speed, moving = block_speeds(path, moved.path, settings), np.diff(moved.path.ends) > 0.0
    feed = StepFeed(np.append(moved.path.ends[:-1][moving], moved.path.ends[-1]), speed[moving])
    least = plan(moved.path, limits, feed, moved.path.stops[1:-1].tolist(), PlannerOptions(strict=True)).seconds
    assert 0.998 * least <= moved.seconds <= 1.15 * least


def test_how_far_points_of_a_curve_stand_apart_changes_little() -> None:
    """A curve of small curvature through points 0.25 and 2 mm apart, rounded off by 2 um: the same curve to a control."""
    limits = replace(LIMITS, jerk=np.full(2, 30_000.0))

    def seconds(chord: float) -> float:
        angle = np.linspace(0.0, 1.5, round(90.0 / chord) + 1)
        return execute(commanded(60.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1), 0.002, 300.0), limits).seconds

    assert seconds(2.0) == pytest.approx(seconds(0.25), rel=0.04)


def test_a_corner_costs_what_logs_of_a_sinumerik_show() -> None:
    """35 ms at F720, 15 ms at F350, passed within 0.01 mm; the machine's jerk is not known: 32 m/s3."""
    settings = replace(LIMITS, acceleration=np.full(2, 5000.0), jerk=np.full(2, 32_000.0), cycle=0.001)
    bent, straight = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]]), np.array([[0.0, 0.0], [20.0, 0.0], [40.0, 0.0]])
    lost = [execute(commanded(bent, 0.01, f / 60.0), settings).seconds - execute(
        commanded(straight, 0.01, f / 60.0), settings).seconds for f in (720.0, 350.0)]
    assert lost[0] == pytest.approx(0.035, abs=0.004) and lost[1] == pytest.approx(0.015, abs=0.003)


def test_a_corner_by_its_step_is_passed_at_the_speed_of_the_step_and_filters_round_it_off() -> None:
    q = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]])
    settings = replace(LIMITS, corner_step=np.full(2, 8.0))
    moved = execute(commanded(q), settings)
    at = int(np.argmin(np.abs(moved.s - 20.0)))
    assert moved.v[at] == pytest.approx(8.0, rel=0.1)
    assert execute(commanded(q), replace(settings, corner_step=np.full(2, 16.0))).seconds < moved.seconds
    smooth = execute(commanded(q), replace(settings, smoothing=np.full(2, 0.04)))
    assert smooth.seconds == pytest.approx(moved.seconds + 0.04, abs=0.003)
    assert np.abs(smooth.axes().qdd).max() < np.abs(moved.axes().qdd).max() / 4.0


def test_derivatives_are_those_of_the_path() -> None:
    path = blended(program(2, 5)[0])
    s = np.linspace(path.start, path.end, 4001)[1:-1]
    s = s[np.abs(s[:, None] - path.stops).min(axis=1) > 2e-5]
    step = 1e-5
    low, here, high = (path.derivatives(s + d) for d in (-step, 0.0, step))
    for order in range(3):
        wide = np.abs((high[order] - low[order]) / (2 * step) - here[order + 1])
        assert np.quantile(wide, 0.99) <= 1e-3 * (1.0 + np.abs(here[order + 1]).max())


def test_points_that_stand_in_one_place_are_rest() -> None:
    path = commanded(np.zeros((4, 2)) + 7.0)
    moved = execute(path, LIMITS)
    assert moved.seconds == 0.0 and (moved.times() == 0.0).all() and (moved.axes().q == 7.0).all()


def test_corners_stay_within_the_tolerance() -> None:
    q = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 15.0], [30.0, 25.0]])
    path = blended(commanded(q, tolerance=0.02))
    off = np.linalg.norm(path.q[:, None] - q[None, 1:3], axis=2).min(axis=0)
    assert (off <= 0.02 + 1e-9).all() and (off > 0.01).all()


def test_one_line_is_rest_to_rest() -> None:
    q = np.array([[0.0, 0.0], [40.0, 0.0]])
    limits = JointLimits(np.minimum(LIMITS.velocity, 50.0), LIMITS.acceleration, LIMITS.jerk)
    least = float(rest_seconds(q[:1], q[1:], limits, "straight")[0])
    assert least * 0.999 <= execute(commanded(q), LIMITS).seconds <= least * 1.04


@pytest.mark.parametrize("length", [815.0, 840.0, 865.0])
def test_a_rest_that_is_braked_for_long_keeps_the_limits(length: float) -> None:
    """Tried again under a gentler braking curve from 0.32 s before the rest, the axis jumped onto it: 1.6 of its limit."""
    long = ControlSettings(np.array([500.0]), np.array([400.0]), np.array([5000.0]))
    moved = execute(commanded(np.array([[0.0], [length]]), feed=500.0), long)
    _, acceleration, jerk = used(moved.axes().q, long.cycle, long)
    assert acceleration <= 1.01 and jerk <= 1.5


def test_an_exact_stop_costs_time_and_few_blocks_read_ahead_too() -> None:
    path = commanded(np.stack([np.linspace(0.0, 40.0, 41), np.zeros(41)], 1))
    free = execute(path, LIMITS).seconds
    stop = path.stop.copy()
    stop[20] = True
    assert execute(replace(path, stop=stop), LIMITS).seconds > free + 0.05
    assert execute(path, replace(LIMITS, buffer=3)).seconds > free + 0.05


def test_exact_stops_of_a_program_and_starts_of_the_spindle() -> None:
    at, m = machine("mikron-ucp710"), model("siemens").model_copy(update={"kind": "control"})
    text = "G17 G90 G71 G94\n{} F3000\nG1 X20\nG1 X40\n{}\nG1 X60"
    plain, exact, start = (total(b, timed(b, m)) for b in (
        blocks(text.format(*words), at, "siemens-840d") for words in (("G64", ""), ("G60", ""), ("G64", "S5000 M3"))))
    assert exact > plain + 0.1
    assert plain + 0.067 < start < plain + 0.5


def test_what_cannot_be_executed_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    b, m = blocks("G17 G90 G71 G94\nG1 X20 F3000\nG1 X40 Y3", machine(), "siemens-840d"), model("control")
    quick = timed(b, m.quick()).seconds

    def fails(*_: object) -> None:
        raise ArithmeticError("no motion")

    assert not timed(b, m).found
    monkeypatch.setattr(control, "execute", fails)
    failed = timed(b, m)
    assert [d.code for d in failed.found] == ["time.plan"] and (failed.seconds == quick).all()
    monkeypatch.setattr(control, "MOST_BLOCKS", 1)
    beyond = timed(b, m)
    assert [d.code for d in beyond.found] == ["time.control"] and (beyond.seconds == quick).all()


@pytest.mark.parametrize(("tolerance", "step", "most", "every"), [
    (0.02, None, 1.021, 4), (0.01, None, 1.022, 6), (0.005, None, 1.03, 6), (0.002, None, 1.042, 19),
    (0.01, 8.333, 1.022, 6)])
def test_how_far_points_of_the_measured_curve_stand_apart_changes_its_time_little(
        tolerance: float, step: float | None, most: float, every: int) -> None:
    """0.05 to 1 mm (`published.py` has all 39): bends of 0.04 mm radius, which few points or none show."""
    control = LIMITS if step is None else replace(LIMITS, corner_step=np.full(2, step))
    times = [execute(commanded(points(chord), tolerance), control).seconds for chord in np.linspace(0.05, 1.0, 39)[::every]]
    assert max(times) <= most * min(times)
    assert times == pytest.approx([MEASURED] * len(times), rel=0.05)


def swivelling(chord: float, tolerance: float) -> CommandedPath:
    """Five axes along a wave, points rounded as a program's; the feed is that of the tip."""
    u = np.linspace(0.0, 1.0, round(40.0 / chord) + 1)
    tip = np.stack([40.0 * u, 4.0 * np.sin(8.0 * u), 2.0 * np.cos(6.0 * u)], axis=1)
    a, c = 0.35 + 0.2 * np.sin(10.0 * u), 1.2 * np.sin(5.0 * u + 0.4)
    arm = 60.0 * np.stack([np.sin(a) * np.sin(c), -np.sin(a) * np.cos(c), np.cos(a)], axis=1)
    q = np.column_stack([(tip + arm).round(3), np.radians(np.degrees([a, c]).round(3)).T])
    path = commanded(q, tolerance)
    return replace(path, length=np.linalg.norm(np.diff(tip, axis=0), axis=1), weight=np.array([1.0, 1.0, 1.0, 50.0, 50.0]))


@pytest.mark.parametrize(("tolerance", "most"), [(0.02, 1.02), (0.005, 1.026)])
def test_how_far_points_stand_apart_changes_the_time_of_five_axes_little(tolerance: float, most: float) -> None:
    limits = ControlSettings(np.array([500.0] * 3 + [1.57, 2.09]), np.array([2500.0, 3000.0, 2100.0, 5.2, 5.2]),
                             np.array([5000.0] * 3 + [50.0] * 2))
    times = [execute(swivelling(chord, tolerance), limits).seconds for chord in (0.1, 0.2, 0.45, 1.0)]
    assert max(times) <= most * min(times)


@pytest.mark.parametrize("chord", [0.05, 0.3, 0.95])
def test_a_curve_passes_its_points_within_their_tolerance_and_bends_as_little_as_its_points_do(chord: float) -> None:
    """Points rounded to 0.001 mm; a corner, before it a straight line, which stays one."""
    q = np.concatenate([[[-20.0, 9.0], [-10.0, 9.0], [-10.0, 0.0], [-1.0, 0.0]], points(chord) - points(chord)[0]])
    made, length, _, owner = fitted(commanded(q, 0.004))
    at = np.concatenate([[0], np.flatnonzero(np.diff(owner)) + 1, [len(owner)]])
    off = np.linalg.norm(made[at] - q, axis=1)
    assert off.max() <= 0.004 and off[:4].max() <= 1e-6
    assert (np.count_nonzero(owner[:, None] == np.arange(2), axis=0) == 1).all()
    assert length.sum() == pytest.approx(np.linalg.norm(np.diff(q, axis=0), axis=1).sum(), rel=0.02)


def test_no_motion_creeps_before_it_rests() -> None:
    """Half a cycle too late it slowed down too far: 30 ms for the last 0.02 mm."""
    ends = []
    for chord in (0.05, 0.075, 0.6, 0.9):
        moved = execute(commanded(points(chord, 6)), LIMITS)
        ends.append(moved.t[-1] - np.interp(moved.path.end - 0.5, moved.s, moved.t))
    assert max(ends) < min(ends) + 0.004


def test_a_block_that_is_no_motion_holds_nothing_back() -> None:
    """0.00001 mm between rapids, read ahead: its axis turned by 1e6 rad per mm of path, and 300 mm took 327 s."""
    q = np.array([[0.0, 0.0], [100.0, 0.0], [100.0 + 8e-6, 0.0], [100.0 + 8e-6, 100.0], [0.0, 100.0], [0.0, 0.0]])
    long, short = (execute(commanded(one), replace(LIMITS, buffer=4)).seconds for one in (q, np.delete(q, 2, axis=0)))
    assert long == pytest.approx(short, rel=0.05)


@pytest.mark.parametrize("step", [None, np.full(3, 8.333)])
def test_no_program_takes_longer_than_with_a_rest_at_each_corner(step: Floats | None) -> None:
    """Lines of 5 to 15 mm that turn by up to a radian, as fixtures and plates have them."""
    rng = np.random.default_rng(3)
    q = np.cumsum(rng.normal(size=(30, 3)) * 6.0 + [6.0, 0.0, 0.0], axis=0)
    settings = ControlSettings(np.full(3, 500.0), np.full(3, 3000.0), np.full(3, 30_000.0), corner_step=step)
    free = commanded(q, 0.01)
    rests = execute(replace(free, stop=np.ones(30, dtype=bool)), settings).seconds
    assert 0.6 * rests < execute(free, settings).seconds <= 1.03 * rests


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_no_curve_strays_from_points_that_stand_unevenly_or_scatter(noise: float) -> None:
    """Blocks of 0.001 mm next to some mm had equations that are not solved, scattered points loops of many mm."""
    rng = np.random.default_rng(9)
    for _ in range(60):
        radius = 10.0 ** rng.uniform(0, 2)
        angle = np.cumsum(10.0 ** rng.uniform(rng.choice([-4.0, -2.0]), -0.5, int(rng.integers(8, 60))))
        q = np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius
        q = np.round(q + rng.normal(size=q.shape) * noise, 3)
        q = q[np.concatenate([[True], np.linalg.norm(np.diff(q, axis=0), axis=1) > 5e-4])]
        length = np.linalg.norm(np.diff(q, axis=0), axis=1)
        stop = np.isin(np.arange(len(q)), [0, len(q) - 1])
        speed, tolerance = np.full(len(length), 100.0), np.full(len(q), 0.01)
        made, _, _, owner = fitted(CommandedPath(q, length, speed, tolerance, stop, np.ones(2)))
        ends = np.append(np.flatnonzero(np.diff(owner)), len(owner) - 1) + 1
        assert np.linalg.norm(made[ends] - q[1:], axis=1).max() < 0.0051
        assert np.linalg.norm(np.diff(made, axis=0), axis=1).sum() < 1.15 * length.sum()
