"""The sweep of `postproc.feedrate.kernels.second_order` with numpy, an interval at a time: the same operations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.feedrate.kernels.second_order import STEPS
from toolpaths.arrays import Bools, Floats


class _Rows(NamedTuple):
    """-down <= a x0 + b x1 <= up with b >= 0, (R,) each: one interval, R = 2J; or (N - 1, R)."""

    a: Floats
    b: Floats
    up: Floats
    down: Floats

    def at(self, i: int, which: Bools | slice = slice(None)) -> _Rows:
        """Of one interval, those that are asked for."""
        return _Rows(*(part[i, which] for part in self))


def _rows(h: Floats, dq: Floats, d2q: Floats, middle: Floats) -> _Rows:
    """Rows of all intervals (N - 1, 2J); dq, d2q (N, J) over the limits, middle (N, J) added to them."""
    half = (0.5 / h)[:, None]
    here, there = dq[:-1] * half, dq[1:] * half
    a, b = np.concatenate((d2q[:-1] - here, -there), axis=1), np.concatenate((here, d2q[1:] + there), axis=1)
    own = np.concatenate((middle[:-1], middle[1:]), axis=1)
    turned = b < 0.0
    return _Rows(np.where(turned, -a, a), np.abs(b), np.where(turned, 1.0 + own, 1.0 - own),
                 np.where(turned, 1.0 - own, 1.0 + own))


def sweep(h: Floats, dq: Floats, d2q: Floats, middle: Floats, x: Floats, flat: float) -> None:
    """Both passes with numpy, one interval at a time; `x` holds the bound, then the result."""
    rows, counts = _rows(h, dq, d2q, np.broadcast_to(middle, dq.shape)), np.empty((len(h), 2 * dq.shape[1]), dtype=bool)
    with np.errstate(over="ignore", divide="ignore"):
        for i in range(len(h) - 1, -1, -1):
            counts[i], x0 = _alone(rows.at(i), x[i], x[i + 1], flat)
            x[i] = _largest_start(rows.at(i, counts[i]), x0, x[i + 1])
    for i in range(len(h)):
        x[i + 1] = _largest_next(rows.at(i, counts[i]), x[i], x[i + 1])


def _alone(rows: _Rows, x0: float, cap: float, flat: float) -> tuple[Bools, float]:
    """(R,) the rows in which x1 counts, and x0 with what the others leave of it."""
    a, b, up, down = rows
    size, wide = np.abs(a), np.maximum(up, down)
    x0 = min(x0, float(((wide + b * cap) / size).min()))
    reach = min(cap, float(((wide + size * x0) / b).min()))
    counts = b * reach > flat
    return counts, min(x0, float(((np.where(a > 0.0, up, down) - b * reach) / size)[~counts].min(initial=np.inf)))


def _interval(rows: _Rows, x0: float, cap: float) -> tuple[float, float, int, int]:
    """l(x0), u(x0) and the rows they are of, -1 for 0 and for the cap."""
    over, used = 1.0 / rows.b, rows.a * x0
    low, high = np.append(0.0, (-rows.down - used) * over), np.append(cap, (rows.up - used) * over)
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
