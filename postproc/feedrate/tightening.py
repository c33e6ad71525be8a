"""Strict mode: where limits are exceeded between knots, the rows of the two knots next to are made as much tighter."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from postproc.feedrate.kernels.tightening import worst
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.paths import Derivatives
from postproc.feedrate.problem import MotionKnots
from postproc.feedrate.profile import Profile, profile_parts
from postproc.feedrate.rows import tool
from toolpaths.arrays import Floats, Ints
from toolpaths.compiled import compiled

ENOUGH = 1.002
"""Ratio between knots that is left to the final slowing down: less than a thousandth of the time."""
MORE = 2.0
"""Power of the excess by which rows are tightened: a peak between knots falls by some 60 % of what its knots do."""
BETWEEN = (0.25, 0.5, 0.75)
SPLIT = (1.5, 1.5, 1.02, 1.02)
"""Ratios between knots from which an interval is halved, by the number of tightenings before."""
CHUNK = 4096
"""intervals looked at together"""


Ratios = npt.NDArray[np.float32]


class Tighter(NamedTuple):
    """Knots with tighter rows, and new ones behind the knots `behind` of before where that was in vain."""

    grid: MotionKnots
    behind: Ints


def seen_between(grid: MotionKnots, c: Floats, kernel: bool = False) -> tuple[Ratios, float]:
    """Velocity, acceleration and jerk over their limits, (3, K - 1), the worst between each two knots; seconds of the motion
    with coefficients c (K + 2,)."""
    seen, seconds = np.empty((3, len(grid.sigma) - 1), dtype=np.float32), 0.0
    for first, part in profile_parts(grid.sigma, grid.eased.ease, c, CHUNK):
        seen[:, first:first + part.pieces.shape[1]] = _ratios(grid, part, kernel)
        seconds += float(part.times[-1])
    return seen, seconds


def slowdown(seen: Ratios) -> float:
    """Factor on time that brings what is seen between the knots to 1."""
    velocity, acceleration, jerk = seen.max(axis=1).tolist()
    return max(velocity, acceleration**0.5, jerk ** (1.0 / 3.0))


def tighter(grid: MotionKnots, seen: Ratios, split_from: float) -> Tighter | None:
    """Tighter rows next to what is exceeded; None where nothing is. `seen` is used up.

    There are more knots where the ratio is above `split_from`: where tightening was in vain, as a spline of the path bends
    within one interval.
    """
    over = seen.max(axis=0)
    if over.max() <= ENOUGH:
        return None
    excess = np.power(np.maximum(seen, 1.0, out=seen), MORE, out=seen)
    tight = np.ones((3, len(grid.sigma)), dtype=np.float32)
    tight[:, :-1] = excess
    np.maximum(tight[:, 1:], excess, out=tight[:, 1:])
    if grid.tight is not None:
        tight *= grid.tight
    behind = np.flatnonzero(np.convolve(over > split_from, np.ones(3), mode="same") > 0.0)
    if not len(behind):
        return Tighter(replace(grid, tight=tight), behind)
    middle = 0.5 * (grid.sigma[behind] + grid.sigma[behind + 1])
    return Tighter(replace(grid, sigma=np.insert(grid.sigma, behind + 1, middle),
                           tight=np.insert(tight, behind + 1, 1.0, axis=1)), behind)


def _ratios(grid: MotionKnots, part: Profile, kernel: bool) -> Floats:
    """Velocity (feed included), acceleration and jerk over their limits, (3, N), the worst BETWEEN ends of intervals."""
    travel = (np.diff(part.sigma)[:, None] * BETWEEN).ravel()
    k = np.repeat(np.arange(len(part.sigma) - 1), len(BETWEEN))
    sigma = part.sigma[k] + travel
    s = grid.eased.parameter(sigma)
    at = grid.eased.chained(sigma, s, grid.eased.path.derivatives(grid.eased.inside(s[0])))
    x = np.array(part.squared(k, travel))
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
