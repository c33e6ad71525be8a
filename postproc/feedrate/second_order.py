"""Least time under velocity and acceleration on a grid, in two passes: the greedy solution of reachability analysis.

x = sigma_dot^2 is linear between grid points, so sigma_ddot = (x1 - x0)/(2 h). Each acceleration limit, taken
at both ends of an interval, is |a x0 + b x1| <= 1. For given x0 the next x1 lies in [l(x0), u(x0)], u concave and l
convex. Backwards: the largest x0 that leaves room for x1 below its own bound is the largest root of the concave u -
l, by Newton's method from the right, which ends after few steps. Forwards: always the largest x1; where
a joint reverses on a coarse grid a linear program finds about 0.1 % less time. (Pham and Pham,
IEEE T-RO 34 (2018), reachability analysis.)

Where a joint reverses b may be as small as one likes, and (1 - a x0)/b has no digits left although the limit
is respected to the last one. So a row counts by what x1 can change in it: where that is less than FLAT of the
limit over all of [0, reach], `reach` the largest x1 that any row allows, the row bounds x0 alone, for every
such x1. That gives away at most 2 FLAT of x0, and what is left determines x1 to FLAT of `reach`. Where
rounding leaves l above u, x1 is the value that exceeds both limits by the same, which the row of larger b decides.
"""

from __future__ import annotations

import numpy as np

from postproc.feedrate.kernels.second_order import sweep
from toolpaths.arrays import Floats
from toolpaths.compiled import compiled, wanted

KERNEL_FROM = 4000
"""Grid points from which compiling pays."""
FLAT = 1e-8
"""Part of a limit below which what x1 changes in its row does not count: half of the digits of a number."""


def second_order(sigma: Floats, dq: Floats, d2q: Floats, acceleration: Floats, cap: Floats,
                 kernel: bool | None = None, middle: Floats | None = None) -> Floats:
    """Squared speed x (N,) of least time between rest at both ends of the grid.

    Args:
        sigma: (N,) increasing; dq, d2q: (N, J) by sigma
        acceleration: (J,) limits
        cap: (N,) largest x, from velocity and feed; may be inf where nothing moves
        kernel: whether the loop is compiled; by size if None
        middle: (N, J) added to the accelerations over their limits, of magnitude below 1; None: 0
    """
    bound = np.array(cap, dtype=np.float64)
    bound[0] = bound[-1] = 0.0
    bound[np.isinf(bound)] = 1e300
    if kernel is None:
        kernel = wanted(len(sigma), KERNEL_FROM)
    first, second = (np.ascontiguousarray(order / acceleration) for order in (dq, d2q))
    run = compiled(sweep) if kernel else sweep
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        run(np.diff(sigma), first, second, np.zeros((1, dq.shape[1])) if middle is None else middle, bound, FLAT)
    return bound


def least_time(sigma: Floats, x: Floats) -> float:
    """Time of a profile that is linear in x between grid points: sum 2 h/(sqrt x0 + sqrt x1)."""
    root = np.sqrt(x)
    return float(np.sum(2.0 * np.diff(sigma) / (root[:-1] + root[1:])))
