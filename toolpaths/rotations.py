"""Rotations of 3-space and great circles of tool axes, vectorised over points."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats, slices

TWO_PI = 2.0 * np.pi
"""rad"""


def rotation(direction: Floats, angle: Floats) -> Floats:
    """Matrices (N, 3, 3) of the rotation by `angle` (N,) rad about the unit `direction` (3,) (Rodrigues)."""
    x, y, z = direction
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    outer = np.outer(direction, direction)
    c = np.cos(angle)[:, None, None]
    s = np.sin(angle)[:, None, None]
    result: Floats = c * np.eye(3) + s * cross + (1.0 - c) * outer
    return result


_SQUARE = 1e-8
"""rad by which a turn may be off quarter turns and is one: 1e-5 mm over a metre"""


def squared(turn: Floats) -> Floats:
    """A rotation (3, 3) with entries that are 0, 1 or -1 but for noise as just that."""
    whole = np.round(turn)
    return np.asarray(np.where(np.abs(turn - whole) < _SQUARE, whole, turn) + 0.0)


def wrap(angle: Floats) -> Floats:
    """The same angles in (-pi, pi]."""
    result: Floats = angle - TWO_PI * np.ceil((angle - np.pi) / TWO_PI)
    return result


def whole_turns(angle: Floats, turn: float = TWO_PI) -> Floats:
    """The whole turns nearest to angles, in their unit."""
    return np.asarray(turn * np.round(angle / turn))


def lengths(v: Floats) -> Floats:
    """Lengths (...,) of vectors (..., 3): column by column, several times as fast as a sum over the last axis."""
    x, y, z = v[..., 0], v[..., 1], v[..., 2]
    result: Floats = x * x
    result += y * y
    result += z * z
    result = np.sqrt(result)
    return result


def steps(points: Floats, first: float = 0.0) -> Floats:
    """(N,) mm from the point before to each of points (N, 3), `first` for the first; few at a time."""
    result = np.full(len(points), first)
    for rows in slices(len(points) - 1):
        result[rows.start + 1:rows.stop + 1] = lengths(points[1:][rows] - points[:-1][rows])
    return result


def unit(v: Floats, nowhere: float = np.nan) -> Floats:
    """Unit vectors (..., 3) along v; `nowhere` in all three columns where v is 0."""
    length = lengths(v)[..., None]
    return np.asarray(np.divide(v, length, out=np.full_like(v, nowhere, dtype=np.float64), where=length > 0.0))


def dot(a: Floats, b: Floats) -> Floats:
    """a . b (...,) of vectors (..., 3), column by column as in `lengths`."""
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2])


def cross(a: Floats, b: Floats) -> Floats:
    """a x b (..., 3), column by column."""
    x0, y0, z0, x1, y1, z1 = a[..., 0], a[..., 1], a[..., 2], b[..., 0], b[..., 1], b[..., 2]
    first = y0 * z1 - z0 * y1
    result: Floats = np.empty((*first.shape, 3))
    result[..., 0], result[..., 1], result[..., 2] = first, z0 * x1 - x0 * z1, x0 * y1 - y0 * x1
    return result


def angle_between(a: Floats, b: Floats) -> Floats:
    """Angle (N,) rad between unit vectors `a` and `b` (N, 3), accurate near 0 and pi (Kahan)."""
    if a.shape != b.shape or a.ndim != 2:
        return np.asarray(2.0 * np.arctan2(lengths(a - b), lengths(a + b)))
    result = np.empty(len(a))
    for rows in slices(len(a)):
        result[rows] = 2.0 * np.arctan2(lengths(a[rows] - b[rows]), lengths(a[rows] + b[rows]))
    return result


def slerp(a: Floats, b: Floats, t: Floats) -> Floats:
    """Unit vectors (N, 3) at fraction `t` (N,) of the great circle from `a` to `b` (N, 3).

    Antiparallel ends have no great circle; callers refuse them before.
    """
    angle = angle_between(a, b)
    small = angle < 1e-7
    s = np.where(small, 1.0, np.sin(angle))
    wa = np.where(small, 1.0 - t, np.sin((1.0 - t) * angle) / s)[..., None]
    wb = np.where(small, t, np.sin(t * angle) / s)[..., None]
    v = wa * a + wb * b
    result: Floats = v / lengths(v)[..., None]
    return result
