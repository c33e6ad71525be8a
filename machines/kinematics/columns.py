"""3-vectors as three columns x, y, z, each an array over points or a number: what a long batch is computed with fast.

A row-wise (N, 3) layout makes numpy walk in steps of three and copy for every product; columns of a few
thousand points stay in the processor's cache. Only the kinematics use this inside; their interfaces are points first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from toolpaths.arrays import Bools, Floats

Columns = Sequence[Floats | float] | Floats
"""x, y, z; arrays whose last axis is the points, or plain numbers"""
Number = Floats | float
BLOCK = 8192
"""points at a time"""


def turn(direction: Floats, cos: Number, sin: Number, v: Columns) -> list[Number]:
    """v turned about the unit `direction` (3,) (Rodrigues)."""
    return turned(direction.tolist(), cos, sin, v)


def turned(d: Sequence[float], cos: Number, sin: Number, v: Columns) -> list[Number]:
    """v turned about the unit d, plain numbers; about an axis of coordinates two columns change."""
    i = axis_of(d)
    if i >= 0:
        j, k = (i + 1) % 3, (i + 2) % 3
        signed = sin if d[i] > 0.0 else -sin
        result = list(v)
        result[j], result[k] = cos * v[j] - signed * v[k], signed * v[j] + cos * v[k]
        return result
    along = dot(d, v)
    return [along * d[i] + cos * (v[i] - along * d[i]) + sin * (d[j] * v[k] - d[k] * v[j])
            for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))]


def axis_of(d: Sequence[float]) -> int:
    """Which axis of coordinates the unit d is, in either direction; -1 for none."""
    return 0 if abs(d[0]) == 1.0 else 1 if abs(d[1]) == 1.0 else 2 if abs(d[2]) == 1.0 else -1


def across(d: Sequence[float], v: Columns) -> list[Number]:
    """d x v, d plain numbers; of an axis of coordinates two columns are left."""
    i = axis_of(d)
    if i < 0:
        return cross(d, v)
    j, k = (i + 1) % 3, (i + 2) % 3
    result: list[Number] = [0.0, 0.0, 0.0]
    result[j], result[k] = (-v[k], v[j]) if d[i] > 0.0 else (v[k], -v[j])
    return result


def dot(a: Columns, b: Columns) -> Floats:
    """a.b; products with a plain 0 are left out."""
    terms = [x * y for x, y in zip(a, b, strict=True)
             if not ((x.__class__ is float and x == 0.0) or (y.__class__ is float and y == 0.0))]
    total: Floats = np.asarray(sum(terms), dtype=np.float64)
    return total


def cross(a: Columns, b: Columns) -> list[Floats | float]:
    """a x b"""
    return [a[j] * b[k] - a[k] * b[j] for j, k in ((1, 2), (2, 0), (0, 1))]


def plus(a: Columns, b: Columns) -> list[Floats | float]:
    """a + b; adding a plain 0 makes no copy."""
    return [y if x.__class__ is float and x == 0.0 else x if y.__class__ is float and y == 0.0 else x + y
            for x, y in zip(a, b, strict=True)]


def minus(a: Columns, b: Columns) -> list[Floats | float]:
    """a - b"""
    return [x if y.__class__ is float and y == 0.0 else x - y for x, y in zip(a, b, strict=True)]


def times(value: Floats | float, v: Columns) -> list[Floats | float]:
    """value v; a plain 0 stays one."""
    return [0.0 if x.__class__ is float and x == 0.0 else value * x for x in v]


def norm(v: Columns) -> Floats:
    """|v|"""
    return np.asarray(np.sqrt(dot(v, v)), dtype=np.float64)


def unit(v: Columns) -> list[Floats | float]:
    """v / |v|, NaN where it is 0."""
    length = norm(v)
    return times(1.0 / np.where(length > 0.0, length, np.nan), v)


def angle(a: Columns, b: Columns) -> Floats:
    """Angle between unit vectors, accurate near 0 and pi (Kahan)."""
    return np.asarray(2.0 * np.arctan2(norm(minus(a, b)), norm(plus(a, b))), dtype=np.float64)


def along(direction: Columns, v: Columns, tolerance: float) -> Bools:
    """True where v lies along +-direction within `tolerance` rad."""
    result: Bools = np.asarray(norm(cross(v, direction)) < tolerance)
    return result


def blocks(n: int) -> Iterator[slice]:
    """Slices of BLOCK points that cover n."""
    for first in range(0, n, BLOCK):
        yield slice(first, first + BLOCK)


def of_rows(rows: Floats) -> list[Floats | float]:
    """Columns of points (N, 3)."""
    return list(np.ascontiguousarray(rows.T))


def of_one(vector: Floats) -> list[Floats | float]:
    """Columns of one vector (3,): plain numbers."""
    result: list[Floats | float] = vector.tolist()
    return result


def to_rows(v: Columns, n: int) -> Floats:
    """Points (N, 3)."""
    result = np.empty((n, 3))
    for i, x in enumerate(v):
        result[:, i] = x
    return result
