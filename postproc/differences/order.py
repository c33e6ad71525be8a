"""Whether two curves are run in the same order: direction, and what is passed again."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.compiled import chosen, loop

_STEP = 0.5
"""mm, about, between places that are compared"""
_LEAST, _MOST = 16, 2000
"""places of a curve: longer curves are looked at less densely"""
COMPILE_FROM = 20_000
_SAME = 1e-6
"""mm"""


def in_order(tip_a: Floats, tip_b: Floats, apart: float) -> bool:
    """True where two curves, tips (N, 3) mm, that lie within `apart` mm of each other as sets of places are as near to each
    other when both are run from begin to end, never back.

    The distance of Frechet, between places at equal shares of the lengths; at equal shares it is bounded from above, and
    places a step apart make it greater by a step at most (Eiter and Mannila 1994).
    """
    lengths = _lengths(tip_a)[-1], _lengths(tip_b)[-1]
    count = int(np.clip(max(lengths) / _STEP, _LEAST, _MOST))
    shares = np.linspace(0.0, 1.0, count)
    a, b = _at_shares(tip_a, shares), _at_shares(tip_b, shares)
    allowed = 2.0 * apart + 1.5 * max(lengths) / (count - 1) + _SAME
    if float(np.linalg.norm(a - b, axis=1).max()) <= allowed:
        return True
    return bool(chosen(_frechet, count * count, COMPILE_FROM)(a, b) <= allowed)


@loop
def _frechet(a: Floats, b: Floats) -> float:
    """The discrete distance of Frechet of places (N, 3) and (M, 3)."""
    row = np.full(len(b) + 1, np.inf)
    row[0] = 0.0
    for i in range(len(a)):
        before = row[0]
        row[0] = np.inf
        for j in range(len(b)):
            x, y, z = a[i, 0] - b[j, 0], a[i, 1] - b[j, 1], a[i, 2] - b[j, 2]
            here = max(np.sqrt(x * x + y * y + z * z), min(before, row[j], row[j + 1]))
            before = row[j + 1]
            row[j + 1] = here
    return float(row[len(b)])


def _lengths(tip: Floats) -> Floats:
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tip, axis=0), axis=1))])


def _at_shares(tip: Floats, shares: Floats) -> Floats:
    """Places (K, 3) at shares of the length of a curve."""
    length = _lengths(tip)
    return np.column_stack([np.interp(shares * length[-1], length, tip[:, j]) for j in range(3)])
