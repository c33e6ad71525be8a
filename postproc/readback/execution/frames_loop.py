"""Points from the frames of blocks into that of the table and back: by columns, and in compiled loops with the same bits."""

from __future__ import annotations

import numpy as np

from machines.kinematics.chain_loop import pays
from toolpaths.arrays import Floats, Ints
from toolpaths.compiled import compiled, loop

_ROWS, _INDEX = ("float64", 2), ("int64", 1)
_TAKES = (_INDEX, ("float64", 3), _ROWS, _ROWS)


def on_table(number: Ints, rotation: Floats, origin: Floats, point: Floats) -> Floats:
    """(N, 3) points as the table sees them, of `point` (N, 3) in the frames `number` (N,) of F: rotation (F, 3, 3), origin
    (F, 3) mm."""
    if pays(len(number)):
        return compiled(points_on_table)(number, rotation, origin, point)
    turned = rotation[number] * point[:, None, :]
    return np.asarray(turned[:, :, 0] + turned[:, :, 1] + turned[:, :, 2] + origin[number])


def in_frames(number: Ints, rotation: Floats, origin: Floats, point: Floats) -> Floats:
    """(N, 3) points in the frames `number` (N,), of `point` (N, 3) as the table sees them; the rest as `on_table`."""
    if pays(len(number)):
        return compiled(points_in_frames)(number, rotation, origin, point)
    turned = rotation[number] * (point - origin[number])[:, :, None]
    return np.asarray(turned[:, 0] + turned[:, 1] + turned[:, 2])


@loop(takes=_TAKES)
def points_on_table(number: Ints, rotation: Floats, origin: Floats, point: Floats) -> Floats:
    """See `on_table`."""
    result = np.empty((len(number), 3))
    for n in range(len(number)):
        f = number[n]
        for i in range(3):
            value = rotation[f, i, 0] * point[n, 0]
            for j in range(1, 3):
                value = value + rotation[f, i, j] * point[n, j]
            result[n, i] = value + origin[f, i]
    return result


@loop(takes=_TAKES)
def points_in_frames(number: Ints, rotation: Floats, origin: Floats, point: Floats) -> Floats:
    """See `in_frames`."""
    result = np.empty((len(number), 3))
    for n in range(len(number)):
        f = number[n]
        for i in range(3):
            value = rotation[f, 0, i] * (point[n, 0] - origin[f, 0])
            for j in range(1, 3):
                value = value + rotation[f, j, i] * (point[n, j] - origin[f, j])
            result[n, i] = value
    return result
