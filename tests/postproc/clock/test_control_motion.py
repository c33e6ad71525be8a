"""The reference control: its motion differentiated, its path against its tolerance, its time against a measured one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.clock.control import STEEPEST, ControlMotion, ControlSettings, execute
from postproc.clock.path import CommandedPath, blended
from postproc.cycle_time import control
from postproc.cycle_time.estimate import timed, total
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.rest_to_rest import rest_seconds
from tests.benchmarks.published import LIMITS, MEASURED, commanded, points
from tests.postproc.time_kit import blocks, machine, model
from toolpaths.arrays import Floats

OPTIMUM = 2.17
"""s of the planner on the measured curve itself (`published.py` computes it)"""


@pytest.mark.parametrize("chord", [0.1, 0.5])
def test_the_measured_curve_takes_what_the_planner_needs_but_for_the_tolerance(chord: float) -> None:
    seconds = execute(commanded(points(chord)), LIMITS).seconds
    assert seconds == pytest.approx(OPTIMUM, rel=0.08)
    assert seconds < MEASURED


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


@pytest.mark.parametrize(("seed", "axes"), [(1, 3), (2, 5), (3, 5), (4, 3)])
def test_no_program_makes_the_axes_jump_or_exceed_their_limits(seed: int, axes: int) -> None:
    path, settings = program(seed, axes)
    moved = execute(path, settings)
    q, times = moved.joints(), moved.times()
    assert q[0] == pytest.approx(path.points[0], abs=2e-6) and q[-1] == pytest.approx(path.points[-1], abs=2e-6)
    assert np.isfinite(times).all() and (np.diff(times) >= 0.0).all() and times[-1] == pytest.approx(moved.seconds)
    velocity, acceleration, jerk = used(q, 1e-3, settings)
    assert velocity <= 1.01 and acceleration <= 1.01 and jerk <= 1.05


def test_the_sampled_motion_keeps_the_limits_of_each_axis() -> None:
    rng = np.random.default_rng(3)
    turns = np.cumsum(rng.uniform(-1.2, 1.2, 12))
    steps = rng.uniform(0.5, 6.0, (12, 1)) * np.stack([np.cos(turns), np.sin(turns)], 1)
    moved = execute(commanded(np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])), LIMITS)
    velocity, acceleration, jerk = used(moved.joints(), 1e-3, LIMITS)
    assert velocity <= 1.01 and acceleration <= 1.01 and 0.95 < jerk <= 1.05


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
    assert moved.seconds == 0.0 and moved.solved and (moved.times() == 0.0).all() and (moved.joints() == 7.0).all()


def test_corners_stay_within_the_tolerance() -> None:
    q = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 15.0], [30.0, 25.0]])
    path = blended(commanded(q, tolerance=0.02))
    off = np.linalg.norm(path.q[:, None] - q[None, 1:3], axis=2).min(axis=0)
    assert (off <= 0.02).all() and (off > 0.005).all()


def test_one_line_is_rest_to_rest() -> None:
    q = np.array([[0.0, 0.0], [40.0, 0.0]])
    limits = JointLimits(np.minimum(LIMITS.velocity, 50.0), LIMITS.acceleration, LIMITS.jerk)
    least = float(rest_seconds(q[:1], q[1:], limits, "straight")[0])
    assert least * 0.999 <= execute(commanded(q), LIMITS).seconds <= least * 1.04


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


def test_a_motion_that_is_not_the_fastest_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    b = blocks("G17 G90 G71 G94\nG1 X20 F3000\nG1 X40 Y3", machine(), "siemens-840d")
    monkeypatch.setattr(ControlMotion, "solved", False)
    found, = timed(b, model("control")).found
    assert found.code == "time.unsolved" and found.lines
