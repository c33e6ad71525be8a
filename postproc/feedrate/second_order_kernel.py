"""Plain loops of `second_order.py`, compiled for long grids. The numpy functions there are the reference."""

from __future__ import annotations

from typing import Any


def sweep(h: Any, dq: Any, d2q: Any, x: Any) -> None:
    """Both passes. h (N-1,), dq and d2q (N, J) over the acceleration limits; x (N,) holds the bound, then the result."""
    intervals, joints = len(h), dq.shape[1]
    for step in range(2 * intervals):
        backward = step < intervals
        i = intervals - 1 - step if backward else step - intervals
        half_h = 0.5 / h[i]
        x0, cap = x[i], x[i + 1]
        low, high = 0.0, cap
        for turn in range(100):
            low, high, low_slope, high_slope, alone = 0.0, cap, 0.0, 0.0, x0
            for j in range(2 * joints):
                if j < joints:
                    b = dq[i, j] * half_h
                    a = d2q[i, j] - b
                else:
                    a = -dq[i + 1, j - joints] * half_h
                    b = d2q[i + 1, j - joints] - a
                if abs(b) > 1e-12 * abs(a):
                    inverse = 1.0 / b
                    slope = -a * inverse
                    width = abs(inverse)
                    if slope * x0 - width > low:
                        low, low_slope = slope * x0 - width, slope
                    if slope * x0 + width < high:
                        high, high_slope = slope * x0 + width, slope
                elif abs(a) * alone > 1.0:
                    alone = 1.0 / abs(a)
            if not backward:
                break
            if turn == 0 and alone < x0:
                x0 = alone
                continue
            if high - low >= -1e-13 * max(low, 1e-300):
                break
            x0 = max(x0 - (high - low) / (high_slope - low_slope), 0.0)
        if backward:
            x[i] = x0
        else:
            x[i + 1] = max(low, high)
