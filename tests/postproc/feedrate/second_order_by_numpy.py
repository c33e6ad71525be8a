"""The sweep of `postproc.feedrate.kernels.second_order` with numpy, an interval at a time: the same operations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.feedrate.kernels.second_order import STEPS
from toolpaths.arrays import Bools, Floats


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


def sweep(h: Floats, dq: Floats, d2q: Floats, x: Floats, flat: float) -> None:
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
