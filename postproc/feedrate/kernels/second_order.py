"""The loop of `second_order.py`, compiled for long grids, with the same bits on any processor (`toolpaths/compiled.py`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpaths.compiled import loop

STEPS = 100
"""Most steps of Newton's method."""


@loop
def sweep(h: Any, dq: Any, d2q: Any, middle: Any, x: Any, flat: Any) -> None:
    """Both passes. h (N-1,), dq and d2q (N, J) over the acceleration limits, middle (N, J) added to them, or (1, J) of
    zeros; x (N,) holds the bound, then the result.

    `flat`: part of a limit below which x1 does not count in its row.
    """
    intervals, joints = len(h), dq.shape[1]
    a, b, over, reaches = np.empty(2 * joints), np.empty(2 * joints), np.empty(2 * joints), np.empty(intervals)
    up, down, moved = np.empty(2 * joints), np.empty(2 * joints), middle.shape[0] > 1
    for step in range(2 * intervals):
        backward = step < intervals
        i = intervals - 1 - step if backward else step - intervals
        half, x0, cap = 0.5 / h[i], x[i], x[i + 1]
        for j in range(joints):
            k, here, there = j + joints, dq[i, j] * half, dq[i + 1, j] * half
            a[j], b[j], a[k], b[k] = d2q[i, j] - here, here, -there, d2q[i + 1, j] + there
            up[j], up[k] = 1.0 - middle[i if moved else 0, j], 1.0 - middle[i + 1 if moved else 0, j]
        for j in range(2 * joints):
            down[j] = 2.0 - up[j]
            if b[j] < 0.0:
                a[j] = -a[j]
                up[j], down[j] = down[j], up[j]
            b[j] = abs(b[j])
            over[j] = 1.0 / b[j]
        if backward:  # what x0 may be for any x1 in [0, cap], and how far x1 can go
            for j in range(2 * joints):
                x0 = min(x0, (max(up[j], down[j]) + b[j] * cap) / abs(a[j]))
            reach = cap
            for j in range(2 * joints):
                reach = min(reach, (max(up[j], down[j]) + abs(a[j]) * x0) / b[j])
            reaches[i] = reach
            for j in range(2 * joints):
                if not b[j] * reach > flat:
                    x0 = min(x0, ((up[j] if a[j] > 0.0 else down[j]) - b[j] * reach) / abs(a[j]))
        for _ in range(STEPS):  # Newton's method on upper less lower bound of x1, concave in x0, from the right
            low, high, lowest, highest = 0.0, cap, -1, -1
            for j in range(2 * joints):
                if b[j] * reaches[i] > flat:
                    used = a[j] * x0
                    if (-down[j] - used) * over[j] > low:
                        low, lowest = (-down[j] - used) * over[j], j
                    if (up[j] - used) * over[j] < high:
                        high, highest = (up[j] - used) * over[j], j
            if high >= low or not backward:
                break
            fall = -a[highest] * over[highest] if highest >= 0 else 0.0
            rise = -a[lowest] * over[lowest] if lowest >= 0 else 0.0
            nearer = max(x0 - (high - low) / (fall - rise), 0.0)
            if not nearer < x0:
                break
            x0 = nearer
        if backward:
            x[i] = x0
            continue
        if high < low and highest >= 0:  # by rounding alone: x1 that exceeds both limits by the same
            high = low + (high - low) * (b[highest] / (b[lowest] + b[highest])) if lowest >= 0 else low
        x[i + 1] = min(max(high, 0.0), cap)
