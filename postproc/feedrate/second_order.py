"""Least time under velocity and acceleration on a grid, in two passes: the greedy solution of reachability analysis.

x = sigma_dot^2 is linear between grid points, so sigma_ddot = (x1 - x0)/(2 h). Each acceleration limit, taken at
both ends of an interval, is |a x0 + b x1| <= A. For given x0 the next x1 lies in [l(x0), u(x0)], u concave and l
convex. Backwards: the largest x0 that leaves room for x1 below its own bound is the largest root of the concave u -
l, by Newton's method from the right, which ends after few steps. Forwards: always the largest x1; where
a joint reverses on a coarse grid a linear program finds about 0.1 % less time. (Pham and Pham,
IEEE T-RO 34 (2018), reachability analysis.)
"""

from __future__ import annotations

import numpy as np

from postproc.feedrate.compiled import compiled, wanted
from postproc.feedrate.second_order_kernel import sweep
from toolpaths.arrays import Floats

KERNEL_FROM = 4000
"""Grid points from which compiling pays."""
PARALLEL = 1e-12
"""Relative size below which a row does not depend on x1."""


def second_order(sigma: Floats, dq: Floats, d2q: Floats, acceleration: Floats, cap: Floats,
                 kernel: bool | None = None) -> Floats:
    """Squared speed x (N,) of least time between rest at both ends of the grid.

    Args:
        sigma: (N,) increasing; dq, d2q: (N, J) by sigma
        acceleration: (J,) limits
        cap: (N,) largest x, from velocity and feed; may be inf where nothing moves
        kernel: compiled loops or numpy; by size if None
    """
    bound = np.array(cap, dtype=np.float64)
    bound[0] = bound[-1] = 0.0
    bound[np.isinf(bound)] = 1e300
    if kernel is None:
        kernel = wanted(len(sigma), KERNEL_FROM)
    if kernel:
        rows = (np.ascontiguousarray(order / acceleration) for order in (dq, d2q))
        compiled(sweep)(np.diff(sigma), *rows, bound)
    else:
        _sweep(np.diff(sigma), dq / acceleration, d2q / acceleration, bound)
    return bound


def least_time(sigma: Floats, x: Floats) -> float:
    """Time of a profile that is linear in x between grid points: sum 2 h/(sqrt x0 + sqrt x1)."""
    root = np.sqrt(x)
    return float(np.sum(2.0 * np.diff(sigma) / (root[:-1] + root[1:])))


def _rows(h: float, dq: Floats, d2q: Floats) -> Floats:
    """Rows (2J, 2) of |a x0 + b x1| <= 1 for one interval; dq, d2q (2, J) at its ends, over the limits."""
    p = dq / (2.0 * h)
    return np.stack((np.concatenate((d2q[0] - p[0], -p[1])), np.concatenate((p[0], d2q[1] + p[1]))), axis=1)


def _sweep(h: Floats, dq: Floats, d2q: Floats, x: Floats) -> None:
    """Both passes with numpy, one interval at a time; `x` holds the bound, then the result."""
    rows = [_rows(h[i], dq[i:i + 2], d2q[i:i + 2]) for i in range(len(h))]
    for i in range(len(h) - 1, -1, -1):
        x[i] = _largest_start(rows[i], x[i], x[i + 1])
    for i in range(len(h)):
        low, high, _ = _interval(rows[i], x[i], x[i + 1])
        x[i + 1] = max(low, high)


def _interval(rows: Floats, x0: float, cap: float) -> tuple[float, float, float]:
    """l(x0), u(x0) and the slope of u - l there."""
    a, b = rows[np.abs(rows[:, 1]) > PARALLEL * np.abs(rows[:, 0])].T
    middle, half = -a / b * x0, 1.0 / np.abs(b)
    low, high = np.append(middle - half, 0.0), np.append(middle + half, cap)
    slopes = np.append(-a / b, 0.0)
    i, j = int(np.argmax(low)), int(np.argmin(high))
    return float(low[i]), float(high[j]), float(slopes[j] - slopes[i])


def _largest_start(rows: Floats, x0: float, cap: float) -> float:
    """Largest x0 from which some x1 in [0, cap] can be reached."""
    alone = rows[np.abs(rows[:, 1]) <= PARALLEL * np.abs(rows[:, 0])]
    for a in np.abs(alone[:, 0]):
        x0 = min(x0, 1.0 / a) if a > 0.0 else x0
    for _ in range(100):
        low, high, slope = _interval(rows, x0, cap)
        if high - low >= -1e-13 * max(low, 1e-300):
            break
        x0 = max(x0 - (high - low) / slope, 0.0)
    return x0
