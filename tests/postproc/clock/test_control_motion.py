"""The reference control: its motion differentiated, its path against its tolerance, its time against a measured one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.clock.control import execute
from postproc.clock.path import blended
from postproc.cycle_time.estimate import timed, total
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.rest_to_rest import rest_seconds
from tests.benchmarks.published import LIMITS, MEASURED, commanded, points
from tests.postproc.time_kit import blocks, machine, model

OPTIMUM = 2.11
"""s of the planner on the measured curve"""


@pytest.mark.parametrize("chord", [0.1, 0.3, 1.0])
def test_the_measured_curve_is_met_whatever_the_chord(chord: float) -> None:
    seconds = float(execute(commanded(points(chord)), LIMITS).t[-1])
    assert seconds > OPTIMUM
    assert seconds == pytest.approx(MEASURED, rel=0.05)


@pytest.mark.parametrize("corners", [0.4, 1.2])
def test_the_sampled_motion_keeps_the_limits_of_each_axis(corners: float) -> None:
    rng = np.random.default_rng(3)
    turns = np.cumsum(rng.uniform(-corners, corners, 12))
    steps = rng.uniform(0.5, 6.0, (12, 1)) * np.stack([np.cos(turns), np.sin(turns)], 1)
    q = np.concatenate([[[0.0, 0.0]], np.cumsum(steps, axis=0)])
    moved = execute(commanded(q), LIMITS)
    joints, cycle = moved.joints(), moved.t[2] - moved.t[1]
    assert joints[-1] == pytest.approx(q[-1], abs=1e-6)
    for order, limit in enumerate((LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk), start=1):
        used = np.abs(np.diff(joints, order, axis=0)) / cycle**order / limit
        assert used.max() < 1.15, order
        assert np.quantile(used.max(axis=1), 0.95) < 1.02, order


def test_corners_stay_within_the_tolerance() -> None:
    q = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 15.0], [30.0, 25.0]])
    path = blended(commanded(q, tolerance=0.02))
    off = np.linalg.norm(path.q[:, None] - q[None, 1:3], axis=2).min(axis=0)
    assert (off <= 0.02).all() and (off > 0.005).all()


def test_one_line_is_rest_to_rest() -> None:
    q = np.array([[0.0, 0.0], [40.0, 0.0]])
    limits = JointLimits(np.minimum(LIMITS.velocity, 50.0), LIMITS.acceleration, LIMITS.jerk)
    least = float(rest_seconds(q[:1], q[1:], limits, "straight")[0])
    assert least * 0.999 <= execute(commanded(q), LIMITS).t[-1] <= least * 1.04


def test_an_exact_stop_costs_time_and_few_blocks_read_ahead_too() -> None:
    path = commanded(np.stack([np.linspace(0.0, 40.0, 41), np.zeros(41)], 1))
    free = execute(path, LIMITS).t[-1]
    stop = path.stop.copy()
    stop[20] = True
    assert execute(replace(path, stop=stop), LIMITS).t[-1] > free + 0.05
    assert execute(path, replace(LIMITS, buffer=3)).t[-1] > free + 0.05


def test_exact_stops_of_a_program_and_starts_of_the_spindle() -> None:
    at, m = machine("mikron-ucp710"), model("siemens")
    text = "G17 G90 G71 G94\n{} F3000\nG1 X20\nG1 X40\n{}\nG1 X60"
    plain, exact, start = (total(b, timed(b, m)) for b in (
        blocks(text.format(*words), at, "siemens-840d") for words in (("G64", ""), ("G60", ""), ("G64", "S5000 M3"))))
    assert exact > plain + 0.1
    assert plain + 0.067 < start < plain + 0.5
