"""One pass over the data of a spline fit: deviations, weights raised where they are too large, normal equations.

`sweep` is plain numpy; `compiled_sweep` the same sums as one loop, for long paths.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from toolpaths.arrays import Floats, Ints
from toolpaths.compiled import available, compiled, loop
from toolpaths.smoothing.bspline import ORDER, basis

WIDTH = 6
"""Columns: tip in mm, axis times mm per rad."""
AIM = 0.8
"""Part of the tolerance above which a place gets more weight."""
STRONGEST = 1e6


class Data(NamedTuple):
    """N places: parameter, value (N, 6), knot of the span and first coefficient of its six basis functions, rising."""

    s: Floats
    p: Floats
    k: Ints
    first: Ints


class Normal(NamedTuple):
    """Normal equations: lower bands (6, K), right-hand side (K, 6)."""

    bands: Floats
    right: Floats


def evaluate(t: Floats, c: Floats, data: Data) -> Floats:
    """Values (N, 6) of the splines with coefficients c (K, 6) at the places."""
    values = basis(t, data.k, data.s)
    result = np.zeros((len(data.s), c.shape[1]))
    for j in range(ORDER):
        result += values[j][:, None] * c[data.first + j]
    return result


def sweep(t: Floats, data: Data, c: Floats, weight: Floats, tolerance: float, ratio: Floats,
          normal: Normal) -> None:
    """Set `ratio` (N,) to deviation over tolerance, raise `weight` (N,), add to `normal`; tolerance inf raises none."""
    values = basis(t, data.k, data.s)
    off = -data.p
    for j in range(ORDER):
        off = off + values[j][:, None] * c[data.first + j]
    ratio[:] = np.sqrt(np.maximum((off[:, :3] ** 2).sum(axis=1), (off[:, 3:] ** 2).sum(axis=1))) / tolerance
    weight[:] = np.where(ratio > AIM, np.minimum(weight * (ratio / AIM) ** 2, STRONGEST), weight)
    start = np.flatnonzero(np.diff(data.first, prepend=-1))
    first, part = data.first[start], weight * values
    squares = np.add.reduceat(part[:, None] * values, start, axis=2)
    right = np.add.reduceat(part[:, None] * data.p.T, start, axis=2)
    for i in range(ORDER):
        normal.right[first + i] += right[i].T
        for j in range(i, ORDER):
            normal.bands[j - i, first + i] += squares[i, j]


@loop(alone=True)
def _loop(t: Floats, s: Floats, p: Floats, k: Ints, first: Ints, c: Floats, weight: Floats, tolerance: float,
          ratio: Floats, bands: Floats, right: Floats) -> None:
    """`sweep` place by place."""
    n = np.empty(6)
    left, ahead = np.empty(6), np.empty(6)
    off = np.empty(6)
    for i in range(len(s)):
        f, at = first[i], k[i]
        for j in range(6):
            left[j] = s[i] - t[at + 1 - j]
            ahead[j] = t[at + j] - s[i]
        n[0] = 1.0
        for j in range(1, 6):
            saved = 0.0
            for r in range(j):
                part = n[r] / (ahead[r + 1] + left[j - r])
                n[r] = saved + ahead[r + 1] * part
                saved = left[j - r] * part
            n[j] = saved
        for column in range(6):
            total = -p[i, column]
            for j in range(6):
                total += n[j] * c[f + j, column]
            off[column] = total
        tip = off[0] * off[0] + off[1] * off[1] + off[2] * off[2]
        axis = off[3] * off[3] + off[4] * off[4] + off[5] * off[5]
        ratio[i] = np.sqrt(max(tip, axis)) / tolerance
        if ratio[i] > 0.8:
            weight[i] = min(weight[i] * (ratio[i] / 0.8) ** 2, 1e6)
        for a in range(6):
            part = weight[i] * n[a]
            for b in range(a, 6):
                bands[b - a, f + a] += part * n[b]
            for column in range(6):
                right[f + a, column] += part * p[i, column]


def compiled_sweep(t: Floats, data: Data, c: Floats, weight: Floats, tolerance: float, ratio: Floats,
                   normal: Normal) -> None:
    """See `sweep`."""
    compiled(_loop)(t, data.s, data.p, data.k, data.first, c, weight, tolerance, ratio, normal.bands,
                    normal.right)


def sweep_here() -> Callable[..., None]:
    """Compiled where there is a compiler, whatever is loaded already: the two differ in the last bits, and a program must
    not depend on what the process did before."""
    return compiled_sweep if available() else sweep
