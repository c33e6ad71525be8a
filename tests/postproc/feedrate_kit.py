"""Paths and limits for the tests and benchmarks of the planned motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.polynomial import Polynomial
from scipy.interpolate import make_interp_spline

from postproc.feedrate.limits import JointLimits
from postproc.feedrate.paths import Derivatives, Eased, SplinePath
from postproc.feedrate.problem import MotionKnots
from toolpaths.arrays import Floats

TURN = 2.0 * np.pi
MIKRON = JointLimits(np.array([500.0, 500.0, 500.0, 0.25 * TURN, TURN / 3.0]),
                     np.array([2500.0, 3000.0, 2100.0, 0.83 * TURN, 0.83 * TURN]),
                     np.array([5000.0, 5000.0, 5000.0, 5.0 * TURN, 50.0 * TURN]))
"""Mikron UCP 710: jerks as printed in table 1 of the orientation paper, the others assumed; mm, rad, s."""


class PolynomialPath:
    """One polynomial in s per joint on [0, end]."""

    def __init__(self, joints: Sequence[Sequence[float]], end: float) -> None:
        self._orders = [[Polynomial(joint)] for joint in joints]
        for orders in self._orders:
            orders.extend(orders[0].deriv(k) for k in (1, 2, 3))
        self.start, self.end, self.breaks = 0.0, end, np.zeros(0)

    def derivatives(self, s: Floats) -> Derivatives:
        return Derivatives(*(np.stack([orders[k](s) for orders in self._orders], axis=1) for k in range(4)))


def only_jerk(jerk: Sequence[float]) -> JointLimits:
    """Limits that leave only jerk."""
    free = np.full(len(jerk), 1e9)
    return JointLimits(free, free, np.asarray(jerk, dtype=np.float64))


def random_path(seed: int, points: int = 20, length: float = 100.0, bend: float = 1.0) -> SplinePath:
    """Five joints through a random walk, quintic; wilder with larger `bend`."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(points, 5)) * np.array([1.0, 1.0, 1.0, 0.005, 0.005]) * bend * length / points
    spline = make_interp_spline(np.linspace(0.0, length, points), np.cumsum(steps, axis=0), k=5)
    return SplinePath(spline.t, spline.c)


def zigzag(length: float) -> SplinePath:
    """Passes of 48 mm to and fro with tight turns over a wavy surface, orientation following; a period takes 100."""
    at = np.arange(0.0, length + 2.0, 2.0)
    phase = TURN * at / 100.0
    q = np.stack((48.0 / np.pi * np.arcsin(0.98 * np.sin(phase)), 0.02 * at + np.cos(2.0 * phase),
                  2.0 * np.sin(2.0 * phase + 0.5), 0.02 * np.sin(phase + 0.3), 0.03 * np.sin(2.0 * phase + 0.4)), axis=1)
    spline = make_interp_spline(at, q, k=5)
    return SplinePath(spline.t, spline.c)


def bezier(seed: int = 2) -> SplinePath:
    """About 80 mm, one smooth bend, five joints."""
    rng = np.random.default_rng(seed)
    control = np.cumsum(np.abs(rng.normal(size=(6, 5))) * np.array([9.0, 9.0, 5.0, 0.05, 0.08]), axis=0)
    return SplinePath(np.repeat([0.0, 80.0], 6), control)


def unlimited(s: Floats) -> Floats:
    """No feed."""
    return np.full(len(s), np.inf)


def uniform(path: SplinePath, intervals: int, limits: JointLimits = MIKRON, ease: float = 25.0,
            feed: Callable[[Floats], Floats] = unlimited) -> MotionKnots:
    """The whole path on equal intervals."""
    eased = Eased.between(path, path.start, path.end, ease)
    return MotionKnots(eased, np.linspace(0.0, eased.end, intervals + 1), limits, feed)
