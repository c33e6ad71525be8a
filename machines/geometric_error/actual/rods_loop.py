"""The closure of six rods point by point, compiled for many points. For few `RodFrame.solve` does all of them at once with
numpy, which needs no compiler: interpreted, this loop takes a hundred times as long."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from toolpaths.compiled import loop

COMPILE_FROM = 20_000
"""points from which compiling pays"""


@loop(alone=True)
def close_all(q: Any, leg: Any, base: Any, along: Any, joint: Any, squares: Any, place: Any, turned: Any, steps: Any,
              closed: Any, least_gain: Any) -> Any:
    """Close the rods of every point: `place` (N, 3) and `turned` (N, 3, 3) change from the nominal to the actual platform.

    Args:
        q: (N, K) slides; leg: (6,); base, along: (6, 3) joint on the carriage = base + q along
        joint: (6, 3) on the platform; squares: (6,) of the lengths
        steps, closed, least_gain: when to stop, as in `rods`

    Returns:
        (N,) largest (|AB|^2 - L^2) / 2 L^2 before the last step
    """
    worst, a, rows, end, gap = np.empty(len(q)), np.empty((6, 3)), np.empty((6, 6)), np.empty(3), np.empty(6)
    order = np.zeros(6, np.int64)
    for n in range(len(q)):
        for r in range(6):
            for k in range(3):
                a[r, k] = base[r, k] + q[n, leg[r]] * along[r, k]
        worst[n] = _close(a, joint, squares, place[n], turned[n], steps, closed, least_gain, rows,
                          end, gap, order)
    return worst


@loop(alone=True)
def _close(a: Any, joint: Any, squares: Any, x: Any, turn: Any, steps: Any, closed: Any, least_gain: Any, rows: Any,
           end: Any, gap: Any, order: Any) -> Any:
    """Chord iteration on one platform (x (3,), turn (3, 3), changed in place); the last four arguments are scratch."""
    for r in range(6):
        for k in range(3):
            end[k] = turn[k, 0] * joint[r, 0] + turn[k, 1] * joint[r, 1] + turn[k, 2] * joint[r, 2]
            rows[r, k] = x[k] + end[k] - a[r, k]
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            rows[r, 3 + k] = end[i] * rows[r, j] - end[j] * rows[r, i]
    _factored(rows, order)
    before = worst = math.inf
    for _ in range(steps):
        worst = 0.0
        for r in range(6):
            square = 0.0
            for k in range(3):
                d = x[k] - a[r, k] + turn[k, 0] * joint[r, 0] + turn[k, 1] * joint[r, 1] + turn[k, 2] * joint[r, 2]
                square += d * d
            gap[r] = 0.5 * (squares[r] - square)
            worst = max(worst, abs(gap[r]) / squares[r])
        _solve(rows, order, gap)
        for k in range(3):
            x[k] += gap[k]
        _turn(turn, gap[3], gap[4], gap[5])
        if not (worst > closed and worst < least_gain * before):
            break
        before = worst
    return worst


@loop(alone=True)
def _factored(m: Any, order: Any) -> None:
    """L U of a square matrix (6, 6) in its place, rows exchanged as `order` says (partial pivots)."""
    for k in range(6):
        best = k
        for i in range(k + 1, 6):
            if abs(m[i, k]) > abs(m[best, k]):
                best = i
        order[k] = best
        if best != k:
            for j in range(6):
                m[k, j], m[best, j] = m[best, j], m[k, j]
        for i in range(k + 1, 6):
            m[i, k] /= m[k, k]
            for j in range(k + 1, 6):
                m[i, j] -= m[i, k] * m[k, j]


@loop(alone=True)
def _solve(m: Any, order: Any, x: Any) -> None:
    """Solution of the factored system, in the place of its right side x (6,)."""
    for k in range(6):
        x[k], x[order[k]] = x[order[k]], x[k]
        for j in range(k):
            x[k] -= m[k, j] * x[j]
    for k in range(5, -1, -1):
        for j in range(k + 1, 6):
            x[k] -= m[k, j] * x[j]
        x[k] /= m[k, k]


@loop(alone=True)
def _turn(turn: Any, a: Any, b: Any, c: Any) -> Any:
    """A rotation matrix turned by a small rotation vector (Rodrigues, series as in `rods.turned_by`), in its place."""
    square = a * a + b * b + c * c
    s, h = 1.0 - square / 6.0 * (1.0 - square / 20.0), 0.5 - square / 24.0 * (1.0 - square / 30.0)
    for k in range(3):
        x, y, z = turn[0, k], turn[1, k], turn[2, k]
        u, v, w = b * z - c * y, c * x - a * z, a * y - b * x
        turn[0, k] = x + s * u + h * (b * w - c * v)
        turn[1, k] = y + s * v + h * (c * u - a * w)
        turn[2, k] = z + s * w + h * (a * v - b * u)
