"""Strict mode: what is seen between knots, compiled against numpy, and what tightening and a warm start do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.feedrate.interior import NumpySteps
from postproc.feedrate.limits import JointLimits, ToolLimits
from postproc.feedrate.paths import Eased
from postproc.feedrate.plan import PlannerOptions, plan
from postproc.feedrate.problem import MotionKnots
from postproc.feedrate.profile import knots_profile
from postproc.feedrate.slowdown import needed
from postproc.feedrate.strict import inserted
from postproc.feedrate.tightening import BETWEEN, seen_between, slowdown, tighter, worst_ratios
from postproc.feedrate.windows import solve_problem
from tests.postproc.feedrate.test_feedrate_motion import Circle, Screw
from tests.postproc.feedrate_kit import MIKRON, PolynomialPath, random_path, uniform, unlimited
from tests.postproc.feedrate_reference import relaxed_time


@pytest.mark.numeric
def test_compiled_ratios_equal_numpy() -> None:
    rng = np.random.default_rng(7)
    at = random_path(1).derivatives(rng.uniform(0.0, 100.0, 50))
    x = rng.normal(size=(3, 50)) * 1000.0
    x[0] = np.abs(x[0])
    np.testing.assert_allclose(worst_ratios(at, x, MIKRON, True),
                               worst_ratios(at, x, MIKRON, False), rtol=1e-12)


@pytest.mark.numeric
def test_what_samples_ask_for_compiled_equals_numpy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of each piece between stops, differences across the stops and at rest included; and where the samples are."""
    path = random_path(5)
    made = plan(path, MIKRON, stops=[0.4 * path.end, 0.45 * path.end])
    compiled = needed(made, kernel=True)
    places = [made.pieces[0].profile.at(np.linspace(0.0, made.pieces[0].seconds, 300))]
    monkeypatch.setattr("postproc.feedrate.profile.KERNEL_FROM", 10**9)
    places.append(made.pieces[0].profile.at(np.linspace(0.0, made.pieces[0].seconds, 300)))
    np.testing.assert_allclose(compiled, needed(made, kernel=False), rtol=1e-12)
    np.testing.assert_allclose(*places, rtol=1e-12)
    assert len(compiled) == 3 and compiled.max() > 1.0


def test_tightening_lowers_what_is_seen_between_knots() -> None:
    grid = uniform(random_path(8, bend=3.0), 400)
    found, slower = None, []
    for _ in range(6):
        found = solve_problem(grid.problem(), NumpySteps, found)
        seen, _ = seen_between(grid, found.c)
        slower.append(slowdown(seen))
        better = tighter(grid, seen, 1.02)
        if better is None:
            break
        found, grid = inserted(found.c, better), better.grid
    assert slower[0] > 1.1 and slower[-1] - 1.0 < 0.2 * (slower[0] - 1.0)
    assert 401 < len(grid.sigma) < 600
    assert len(BETWEEN) == 3 and np.all(np.diff(BETWEEN) == 0.25)


def test_a_warm_start_finds_the_same_in_fewer_steps() -> None:
    grid = uniform(random_path(3), 500)
    first = solve_problem(grid.problem(), NumpySteps)
    rng = np.random.default_rng(1)
    tight = 1.0 + 0.1 * rng.random((3, 501)) * (rng.random((3, 501)) < 0.1)
    problem = replace(grid, tight=tight.astype(np.float32)).problem()
    cold, warm = solve_problem(problem, NumpySteps), solve_problem(problem, NumpySteps, first.c)
    assert warm.solved and warm.iterations <= 0.85 * cold.iterations
    times = [float(np.sum(problem.weight * problem.basis.values(one.c)[0] ** -0.5)) for one in (cold, warm)]
    assert times[1] == pytest.approx(times[0], rel=1e-4)
    assert problem.ratios(warm.c).max() < 1.0


def test_limits_at_the_tool_are_tightened_too() -> None:
    """On coarse knots: what is seen between them is the tool's, and strict holds it in the samples at little cost."""
    limits = replace(MIKRON, velocity=np.full(3, 1e4), acceleration=np.full(3, 1e6), jerk=np.full(3, 1e7),
                     tool=ToolLimits(acceleration=800.0, jerk=9000.0))
    fast, strict = (plan(Circle(5.0), limits, options=PlannerOptions(strict=mode)) for mode in (False, True))
    assert strict.usage().worst <= 1.0 and strict.seconds < 1.01 * fast.seconds
    eased = Eased.between(Screw(60.0), 0.0, 60.0, 20.0)
    limits = JointLimits(np.array([1e4]), np.array([1e6]), np.array([1e7]), ToolLimits(jerk=500.0))
    grid = MotionKnots(eased, np.linspace(0.0, eased.end, 400), limits, unlimited)
    found = solve_problem(grid.problem(), NumpySteps)
    seen, seconds = seen_between(grid, found.c)
    assert seconds == pytest.approx(knots_profile(grid.sigma, grid.eased.ease, found.c).times[-1], rel=1e-12)
    assert slowdown(seen) > 1.05 and tighter(grid, seen, 1.02) is not None


@pytest.mark.parametrize("acceleration", [2.0, 20.0, 200.0, 2000.0])
def test_accelerations_that_jerk_reaches_within_an_interval_are_kept_between_knots(acceleration: float) -> None:
    """A line of 200 mm at 20 mm/s: its time is that of a trapezoid, in the fast plan too, and little is exceeded there."""
    limits = JointLimits(np.array([500.0]), np.array([acceleration]), np.array([1e6]))
    trapezoid = 200.0 / 20.0 + 20.0 / acceleration
    for strict in (False, True):
        made = plan(PolynomialPath([[0.0, 1.0]], 200.0), limits, 20.0, options=PlannerOptions(strict=strict))
        assert trapezoid < made.seconds < 1.01 * trapezoid
        assert made.usage().worst < (1.0 + 1e-9 if strict else 1.15)
    tool, joint = made.shares.limits[:, -1], made.shares.limits[:, 0]
    assert not tool.any() and joint[2] < 0.5 * joint[1]


@pytest.mark.parametrize("seed", [3, 8])
def test_no_motion_is_faster_than_the_bound_by_duality_and_ours_little_slower(seed: int) -> None:
    problem = uniform(random_path(seed), 200).problem()
    c = solve_problem(problem, NumpySteps).c
    seconds = float(np.sum(problem.weight * problem.basis.values(c)[0] ** -0.5))
    assert relaxed_time(problem, c) <= seconds <= 1.1 * relaxed_time(problem, c)
