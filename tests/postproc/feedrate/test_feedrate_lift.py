"""Gains of lifting one limit: against closed forms, and only for limits that cost something."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.feedrate.lift import gains, without
from postproc.feedrate.limits import JointLimits, ToolLimits
from postproc.feedrate.plan import plan
from tests.postproc.feedrate_kit import PolynomialPath, only_jerk


def test_gains_of_a_straight_line() -> None:
    """S/V + V/A + A/J: without V, and without A, by the other closed forms; without F nothing as it never binds."""
    length, v, a, j = 80.0, 100.0, 1000.0, 20000.0
    path, limits = PolynomialPath([[0.0, 1.0]], length), JointLimits(*np.array([[v], [a], [j]]))
    made = plan(path, limits)
    found = {(gain.axis, gain.order): gain.seconds for gain in gains(path, limits, np.inf, (), made)}
    top = 0.5 * (np.sqrt((a * a / j) ** 2 + 4.0 * a * length) - a * a / j)
    rise = np.sqrt(v * j)
    assert set(found) == {(0, 1), (0, 2), (0, 3)}
    assert found[0, 1] == pytest.approx(made.seconds - (length / top + top / a + a / j), rel=0.02)
    assert found[0, 2] == pytest.approx(made.seconds - (length / v + v / rise + rise / j), rel=0.02)
    assert found[0, 3] == pytest.approx(made.seconds - (length / v + v / a), rel=0.03)


def test_only_limits_with_a_share_are_lifted() -> None:
    """Joint 0 stands still and the feed binds: lifting it gains nearly all, listed first."""
    path, limits = PolynomialPath([[0.0], [0.0, 1.0]], 60.0), only_jerk([5000.0, 5000.0])
    made = plan(path, limits, feed=10.0)
    found = gains(path, limits, 10.0, (), made)
    assert [(gain.axis, gain.order) for gain in found] == [(-1, 1), (1, 3)]
    assert found[0].seconds == pytest.approx(made.seconds - plan(path, limits).seconds, rel=1e-9)
    assert 0.0 < found[1].seconds < 0.1


def test_without_lifts_one() -> None:
    limits = JointLimits(np.ones(2), np.ones(2), np.ones(2), ToolLimits(jerk=5.0, acceleration=4.0))
    assert without(limits, 1, 1).velocity.tolist() == [1.0, 1000.0]
    assert without(limits, 0, 3).jerk.tolist() == [1000.0, 1.0]
    assert without(limits, 2, 2).tool == ToolLimits(jerk=5.0)
