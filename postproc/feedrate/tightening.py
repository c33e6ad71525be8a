"""Strict mode: where limits are exceeded between knots, the rows of the two knots next to are made as much tighter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from postproc.feedrate.kernels.tightening import worst
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.paths import Derivatives
from postproc.feedrate.problem import MotionKnots
from postproc.feedrate.profile import Profile
from postproc.feedrate.rows import tool
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.compiled import compiled

ENOUGH = 1.002
"""Ratio between knots that is left to the final slowing down."""
MORE = 1.6
"""Power of the excess by which rows are tightened: a peak between knots falls by some 60 % of what its knots do."""
BETWEEN = (0.25, 0.5, 0.75)
SPLIT = (1.5, 1.5, 1.02, 1.02)
"""Ratios between knots from which an interval is halved, by the number of tightenings before."""
CHUNK = 16384


def tightened(grid: MotionKnots, profile: Profile, split_from: float,
              kernel: bool = False) -> tuple[float, MotionKnots | None]:
    """Factor on time that brings what is seen between the knots to 1; a better grid, None where nothing is exceeded.

    The better grid has tighter rows, and more knots where the ratio is above `split_from`: where tightening
    was in vain, as a spline of the path bends within one interval.
    """
    excess = np.empty((3, len(grid.sigma) - 1), dtype=np.float32)
    for first in range(0, excess.shape[1], CHUNK):
        here = np.arange(first, min(first + CHUNK, excess.shape[1]))
        excess[:, here] = _ratios(grid, profile, here, kernel)
    velocity, acceleration, jerk = excess.max(axis=1).tolist()
    slower = max(velocity, acceleration**0.5, jerk ** (1.0 / 3.0))
    if max(velocity, acceleration, jerk) <= ENOUGH:
        return slower, None
    split = excess.max(axis=0) > split_from
    np.power(np.maximum(excess, 1.0, out=excess), MORE, out=excess)
    tight = np.ones((3, len(grid.sigma)), dtype=np.float32)
    tight[:, :-1] = excess
    np.maximum(tight[:, 1:], excess, out=tight[:, 1:])
    if grid.tight is not None:
        tight *= grid.tight
    return slower, _split(grid, tight, split) if split.any() else replace(grid, tight=tight)


def _split(grid: MotionKnots, tight: npt.NDArray[np.float32], split: Bools) -> MotionKnots:
    """Intervals `split` (K - 1,) and their neighbours halved, tightened by `tight`, and not at the new knots."""
    wide = np.convolve(split, np.ones(3), mode="same") > 0.0
    where = np.flatnonzero(wide)
    middle = 0.5 * (grid.sigma[where] + grid.sigma[where + 1])
    return replace(grid, sigma=np.insert(grid.sigma, where + 1, middle), tight=np.insert(tight, where + 1, 1.0, axis=1))


def _ratios(grid: MotionKnots, profile: Profile, k: Ints, kernel: bool) -> Floats:
    """Velocity (feed included), acceleration and jerk over their limits, (3, N), the worst BETWEEN ends of intervals k."""
    travel = ((grid.sigma[k + 1] - grid.sigma[k])[:, None] * BETWEEN).ravel()
    k = np.repeat(k, len(BETWEEN))
    sigma = grid.sigma[k] + travel
    s = grid.eased.parameter(sigma)
    at = grid.eased.chained(sigma, s, grid.eased.path.derivatives(grid.eased.inside(s[0])))
    x = np.array(profile.squared(k, travel))
    limits, speed = grid.limits, np.sqrt(x[0])
    ratios = worst_ratios(at, x, limits, kernel)
    ratios[0] = np.maximum(ratios[0], s[1] * speed / grid.feed(s[0]))
    if limits.forces is not None:
        ratios[1] = np.maximum(ratios[1], limits.forces.use(at.q, *_in_time(at, x)[:2]).max(axis=1))
    if limits.tool is not None:
        known = tool(grid.eased, sigma, s)
        _, bend, snap = (np.linalg.norm(rate, axis=1) for rate in _in_time(known.tip, x))
        most = limits.tool
        ratios = np.maximum(ratios, (known.tilt * speed / most.tilt_rate, bend / most.acceleration, snap / most.jerk))
    return np.asarray(ratios.reshape(3, -1, len(BETWEEN)).max(axis=2))


def worst_ratios(at: Derivatives, x: Floats, limits: JointLimits, kernel: bool) -> Floats:
    """Velocity, acceleration and jerk of the joints over their limits, the worst joint, (3, N); x (3, N) and derivatives."""
    most = (limits.velocity, limits.acceleration, limits.jerk)
    if not kernel:
        return np.array([(np.abs(rate) / limit).max(axis=1) for rate, limit in zip(_in_time(at, x), most, strict=True)])
    out = np.empty((3, len(at.q)))
    compiled(worst)(at.dq, at.d2q, at.d3q, x, 1.0 / np.array(most), out)
    return out


def _in_time(at: Derivatives, x: Floats) -> tuple[Floats, Floats, Floats]:
    """Velocity, acceleration, jerk (N, J) at squared speed x (3, N) and its derivatives."""
    x0, x1, x2 = x[:, :, None]
    root = np.sqrt(x0)
    return at.dq * root, at.d2q * x0 + 0.5 * at.dq * x1, (at.d3q * x0 + 1.5 * at.d2q * x1 + 0.5 * at.dq * x2) * root
