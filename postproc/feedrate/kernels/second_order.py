"""The loop of `second_order.py`, compiled for long grids, with the same bits on any processor (`toolpaths/compiled.py`)."""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpaths.compiled import loop

STEPS = 100
"""Most steps of Newton's method."""


@loop
def sweep(h: Any, dq: Any, d2q: Any, x: Any, flat: Any) -> None:
    """Both passes. h (N-1,), dq and d2q (N, J) over the acceleration limits; x (N,) holds the bound, then the result.

    `flat`: part of a limit below which x1 does not count in its row.
    """
    intervals, joints = len(h), dq.shape[1]
    a, b, over, reaches = np.empty(2 * joints), np.empty(2 * joints), np.empty(2 * joints), np.empty(intervals)
    for step in range(2 * intervals):
        backward = step < intervals
        i = intervals - 1 - step if backward else step - intervals
        half, x0, cap = 0.5 / h[i], x[i], x[i + 1]
        for j in range(joints):
            k, here, there = j + joints, dq[i, j] * half, dq[i + 1, j] * half
            a[j], b[j], a[k], b[k] = d2q[i, j] - here, here, -there, d2q[i + 1, j] + there
        for j in range(2 * joints):
            if b[j] < 0.0:
                a[j] = -a[j]
            b[j] = abs(b[j])
            over[j] = 1.0 / b[j]
        if backward:  # what x0 may be for any x1 in [0, cap], and how far x1 can go
            for j in range(2 * joints):
                x0 = min(x0, (1.0 + b[j] * cap) / abs(a[j]))
            reach = cap
            for j in range(2 * joints):
                reach = min(reach, (1.0 + abs(a[j]) * x0) / b[j])
            reaches[i] = reach
            for j in range(2 * joints):
                if not b[j] * reach > flat:
                    x0 = min(x0, (1.0 - b[j] * reach) / abs(a[j]))
        for _ in range(STEPS):  # Newton's method on upper less lower bound of x1, concave in x0, from the right
            low, high, lowest, highest = 0.0, cap, -1, -1
            for j in range(2 * joints):
                if b[j] * reaches[i] > flat:
                    used = a[j] * x0
                    if (-1.0 - used) * over[j] > low:
                        low, lowest = (-1.0 - used) * over[j], j
                    if (1.0 - used) * over[j] < high:
                        high, highest = (1.0 - used) * over[j], j
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
