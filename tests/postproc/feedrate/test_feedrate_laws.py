"""Laws of the plan that need no other planner: time scales with the limits, more is never slower, pieces join."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.feedrate.limits import JointLimits
from postproc.feedrate.plan import PlannerOptions, plan
from tests.postproc.feedrate_kit import MIKRON, bezier, random_path


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_a_motion_k_times_slower_has_limits_by_powers_of_k(factor: float) -> None:
    """V/k, A/k^2, J/k^3: the same motion in k times the time, within 0.1 %."""
    path = bezier(1)
    slow = JointLimits(MIKRON.velocity / factor, MIKRON.acceleration / factor**2, MIKRON.jerk / factor**3)
    assert plan(path, slow).seconds == pytest.approx(factor * plan(path, MIKRON).seconds, rel=1e-3)


@pytest.mark.parametrize("seed", [1, 4])
@pytest.mark.parametrize("name", ["velocity", "acceleration", "jerk"])
def test_no_limit_that_is_raised_makes_a_plan_slower(seed: int, name: str) -> None:
    path, before = random_path(seed), np.inf
    for factor in (0.5, 1.0, 2.0):
        now = plan(path, replace(MIKRON, **{name: factor * getattr(MIKRON, name)})).seconds
        assert now <= before * (1.0 + 1e-4)
        before = now


def test_nothing_is_exceeded_where_pieces_join() -> None:
    """A stop inside: the samples on both sides of it keep every limit, and the motion rests there."""
    path = bezier(2)
    middle = 0.5 * (path.start + path.end)
    made = plan(path, MIKRON, stops=[middle], options=PlannerOptions(strict=True))
    assert made.usage().worst <= 1.0 + 1e-9
    joint = float(made.ends[0])
    run = made.trajectory()
    near = np.abs(run.t - joint) <= 5e-3
    assert near.sum() >= 9 and np.abs(run.qd[near] / MIKRON.velocity).max() < 0.01
    alone = sum(plan(path, MIKRON, stops=[middle], options=PlannerOptions(strict=True)).pieces[k].seconds for k in (0, 1))
    assert made.seconds == pytest.approx(alone, rel=1e-12)
