"""Strict mode: where limits are exceeded between knots, the rows of the two knots beside are made as much tighter."""

from __future__ import annotations

import numpy as np

from postproc.feedrate.problem import Knots
from postproc.feedrate.profile import Profile
from toolpaths.arrays import Floats

ENOUGH = 1.002
"""Ratio between knots that is left to the final slowing down."""
MORE = 1.6
"""Power of the excess by which rows are tightened: a peak between knots falls by some 60 % of what its knots do."""
BETWEEN = (0.25, 0.5, 0.75)
CHUNK = 16384


def tightened(grid: Knots, profile: Profile) -> Floats | None:
    """New factors (3, K) on velocity, acceleration and jerk; None where nothing is exceeded by more than ENOUGH."""
    excess = np.ones((3, len(grid.sigma) - 1))
    for first in range(0, excess.shape[1], CHUNK):
        here = np.arange(first, min(first + CHUNK, excess.shape[1]))
        excess[:, here] = np.max([_ratios(grid, profile, here, share) for share in BETWEEN], axis=0)
    if excess.max() <= ENOUGH:
        return None
    excess = np.maximum(excess, 1.0) ** MORE
    at_knots = np.maximum(np.pad(excess, ((0, 0), (1, 0)), mode="edge"), np.pad(excess, ((0, 0), (0, 1)), mode="edge"))
    return at_knots if grid.tight is None else grid.tight * at_knots


def _ratios(grid: Knots, profile: Profile, k: np.ndarray[tuple[int], np.dtype[np.int64]], share: float) -> Floats:
    """Velocity (feed included), acceleration and jerk over their limits, (3, N), at `share` of intervals k."""
    way = share * (grid.sigma[k + 1] - grid.sigma[k])
    sigma = grid.sigma[k] + way
    at = grid.eased.derivatives(sigma)
    x, x1, x2 = (value[:, None] for value in profile.squared(k, way))
    limits, speed = grid.limits, np.sqrt(x)
    velocity = np.maximum((np.abs(at.dq) * speed / limits.velocity).max(axis=1), speed[:, 0] / grid.speed_limit(sigma))
    acceleration = (np.abs(at.d2q * x + 0.5 * at.dq * x1) / limits.acceleration).max(axis=1)
    jerk = (np.abs(at.d3q * x + 1.5 * at.d2q * x1 + 0.5 * at.dq * x2) * speed / limits.jerk).max(axis=1)
    return np.array([velocity, acceleration, jerk])
