"""Least time under velocity and acceleration on a grid, in two passes: the greedy solution of reachability analysis.

x = sigma_dot^2 is linear between grid points, so sigma_ddot = (x1 - x0)/(2 h). Each acceleration limit, taken at
both ends of an interval, is |a x0 + b x1| <= 1. For given x0 the next x1 lies in [l(x0), u(x0)], u concave and l
convex. Backwards: the largest x0 that leaves room for x1 below its own bound is the largest root of the concave u -
l, by Newton's method from the right, which ends after few steps. Forwards: always the largest x1; where
a joint reverses on a coarse grid a linear program finds about 0.1 % less time. (Pham and Pham,
IEEE T-RO 34 (2018), reachability analysis.)

Where a joint reverses b may be as small as one likes, and (1 - a x0)/b has no digits left although the limit is
respected to the last one. So a row counts by what x1 can change in it: where that is less than FLAT of the limit
over all of [0, reach], `reach` the largest x1 that any row allows, the row bounds x0 alone, for every such x1. That
gives away at most 2 FLAT of x0, and what is left determines x1 to FLAT of `reach`. Where rounding leaves l above u, x1
is the value that exceeds both limits by the same, which the row of larger b decides.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.base.compiled import compiled, wanted
from postproc.feedrate.kernels.second_order import STEPS, sweep
from toolpaths.arrays import Bools, Floats

KERNEL_FROM = 4000
"""Grid points from which compiling pays."""
FLAT = 1e-8
"""Part of a limit below which what x1 changes in its row does not count: half of the digits of a number."""


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
    first, second = (np.ascontiguousarray(order / acceleration) for order in (dq, d2q))
    if kernel:
        compiled(sweep)(np.diff(sigma), first, second, bound, FLAT)
    else:
        _sweep(np.diff(sigma), first, second, bound, FLAT)
    return bound


def least_time(sigma: Floats, x: Floats) -> float:
    """Time of a profile that is linear in x between grid points: sum 2 h/(sqrt x0 + sqrt x1)."""
    root = np.sqrt(x)
    return float(np.sum(2.0 * np.diff(sigma) / (root[:-1] + root[1:])))


class _Rows(NamedTuple):
    """|a x0 + b x1| <= 1 with b >= 0, (R,) each: one interval, R = 2J; or (N - 1, R)."""

    a: Floats
    b: Floats


def _rows(h: Floats, dq: Floats, d2q: Floats) -> _Rows:
    """Rows of all intervals (N - 1, 2J); dq, d2q (N, J) over the limits."""
    half = (0.5 / h)[:, None]
    here, there = dq[:-1] * half, dq[1:] * half
    a, b = np.concatenate((d2q[:-1] - here, -there), axis=1), np.concatenate((here, d2q[1:] + there), axis=1)
    return _Rows(np.where(b < 0.0, -a, a), np.abs(b))


def _sweep(h: Floats, dq: Floats, d2q: Floats, x: Floats, flat: float) -> None:
    """Both passes with numpy, one interval at a time; `x` holds the bound, then the result."""
    rows, counts = _rows(h, dq, d2q), np.empty((len(h), 2 * dq.shape[1]), dtype=bool)
    with np.errstate(over="ignore", divide="ignore"):
        for i in range(len(h) - 1, -1, -1):
            counts[i], x0 = _alone(rows.a[i], rows.b[i], x[i], x[i + 1], flat)
            x[i] = _largest_start(_Rows(rows.a[i, counts[i]], rows.b[i, counts[i]]), x0, x[i + 1])
    for i in range(len(h)):
        x[i + 1] = _largest_next(_Rows(rows.a[i, counts[i]], rows.b[i, counts[i]]), x[i], x[i + 1])


def _alone(a: Floats, b: Floats, x0: float, cap: float, flat: float) -> tuple[Bools, float]:
    """(R,) the rows in which x1 counts, and x0 with what the others leave of it."""
    size = np.abs(a)
    x0 = min(x0, float(((1.0 + b * cap) / size).min()))
    reach = min(cap, float(((1.0 + size * x0) / b).min()))
    counts = b * reach > flat
    return counts, min(x0, float(((1.0 - b * reach) / size)[~counts].min(initial=np.inf)))


def _interval(rows: _Rows, x0: float, cap: float) -> tuple[float, float, int, int]:
    """l(x0), u(x0) and the rows they are of, -1 for 0 and for the cap."""
    over, used = 1.0 / rows.b, rows.a * x0
    low, high = np.append(0.0, (-1.0 - used) * over), np.append(cap, (1.0 - used) * over)
    i, j = int(np.argmax(low)), int(np.argmin(high))
    return float(low[i]), float(high[j]), i - 1, j - 1


def _largest_start(rows: _Rows, x0: float, cap: float) -> float:
    """Largest x0 from which some x1 in [0, cap] can be reached."""
    slopes = np.append(-rows.a * (1.0 / rows.b), 0.0)
    for _ in range(STEPS):
        low, high, i, j = _interval(rows, x0, cap)
        if high >= low:
            break
        nearer = max(x0 - (high - low) / (slopes[j] - slopes[i]), 0.0)
        if not nearer < x0:
            break
        x0 = nearer
    return x0


def _largest_next(rows: _Rows, x0: float, cap: float) -> float:
    """u(x0); where it lies below l(x0) by rounding, what exceeds both limits by the same."""
    low, high, i, j = _interval(rows, x0, cap)
    if high < low:
        lowest, highest = (float(rows.b[k]) if k >= 0 else 0.0 for k in (i, j))
        high = low + (high - low) * (highest / (lowest + highest)) if i >= 0 and j >= 0 else low if j >= 0 else high
    return min(max(high, 0.0), cap)
