"""How far two curves of the tool are apart, whatever points they are made of."""

from __future__ import annotations

import numpy as np

from postproc.differences.order import in_order
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass

_STEP = 2.0
"""mm, about, between places that are compared"""
_MOST = 20_000
"""places of one curve that are compared: longer curves are looked at less densely"""
_NEAR = 8
"""nearest places whose segments are looked at: the distance is never less than the true one"""


@dataclass(frozen=True)
class CurveGap:
    """What is between two curves: mm of the tips, rad of the axes, the place of each where the tips are farthest apart.

    `reordered`: they are not run in the same order: from the other end, or parts of one again.
    """

    tip: float
    axis: float
    at_a: int
    at_b: int
    reordered: bool


def gap(tip_a: Floats, axis_a: Floats, tip_b: Floats, axis_b: Floats) -> CurveGap:
    """The gap of two curves, tips (N, 3) mm and axes (N, 3): the largest distance of a place of either from the other
    (Hausdorff), with the angle of the axes there."""
    there, back = _one_sided(tip_a, axis_a, tip_b, axis_b), _one_sided(tip_b, axis_b, tip_a, axis_a)
    worse = there if there.tip >= back.tip else CurveGap(back.tip, back.axis, back.at_b, back.at_a, False)
    return CurveGap(worse.tip, max(there.axis, back.axis), worse.at_a, worse.at_b, not in_order(tip_a, tip_b, worse.tip))


def _one_sided(tip_a: Floats, axis_a: Floats, tip_b: Floats, axis_b: Floats) -> CurveGap:
    from scipy.spatial import cKDTree

    dense_a, dir_a, of_a = _densely(tip_a, axis_a)
    dense_b, dir_b, of_b = _densely(tip_b, axis_b)
    size = 1.0 + float(np.ptp(tip_b, axis=0).max(initial=0.0))
    known = cKDTree(np.hstack([dense_b, size * dir_b]))
    found = known.query(np.hstack([dense_a, size * dir_a]), k=min(_NEAR, len(dense_b)))[1]
    near = np.reshape(found, (len(dense_a), -1))
    away, share, at = _to_segments(dense_a, dense_b, near)
    turned = dir_b[at] + share[:, None] * (dir_b[np.minimum(at + 1, len(dir_b) - 1)] - dir_b[at])
    cross = np.linalg.norm(np.cross(dir_a, turned), axis=1)
    angle = np.arctan2(cross, np.einsum("ni,ni->n", dir_a, turned))
    k = int(np.argmax(away))
    return CurveGap(float(away[k]), float(angle.max()), int(of_a[k]), int(of_b[at[k]]), False)


def _densely(tip: Floats, axis: Floats) -> tuple[Floats, Floats, Ints]:
    """Places about _STEP apart, and the place of the curve that each lies behind."""
    if len(tip) == 1:
        return tip, axis, np.zeros(1, dtype=np.int64)
    length = np.linalg.norm(np.diff(tip, axis=0), axis=1)
    step = max(_STEP, float(length.sum()) / _MOST)
    count = np.maximum(np.ceil(length / step), 1).astype(np.int64)
    of = np.repeat(np.arange(len(length)), count)
    share = (np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)) / count[of]
    at = np.append(of, len(tip) - 1)
    last = np.minimum(at + 1, len(tip) - 1)
    weight = np.append(share, 0.0)[:, None]
    between = axis[at] + weight * (axis[last] - axis[at])
    return tip[at] + weight * (tip[last] - tip[at]), between / np.linalg.norm(between, axis=1, keepdims=True), at


def _to_segments(point: Floats, curve: Floats, near: Ints) -> tuple[Floats, Floats, Ints]:
    """(distance, share, segment) of points to the nearest of the segments at the places `near` (N, K) of a curve."""
    away, share, at = np.full(len(point), np.inf), np.zeros(len(point)), near[:, 0]
    for first in (*np.maximum(near.T - 1, 0), *near.T):
        start, end = curve[first], curve[np.minimum(first + 1, len(curve) - 1)]
        along = end - start
        square = np.maximum(np.einsum("ni,ni->n", along, along), 1e-30)
        t = np.clip(np.einsum("ni,ni->n", point - start, along) / square, 0.0, 1.0)
        here = np.linalg.norm(point - start - t[:, None] * along, axis=1)
        better = here < away
        away, share, at = np.where(better, here, away), np.where(better, t, share), np.where(better, first, at)
    return away, share, at

