"""A holder's mesh spun about its axis: the frusta that it stays inside of at any angle of the spindle."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from toolpaths.arrays import Array, Bools, Floats

_MOST = 60
"""frusta; more levels are thinned out"""
_SAME = 1e-3
"""mm between two levels"""


def spun(vertices: Floats, edges: Array) -> Floats:
    """Pieces (P, 5) round the body that vertices (V, 3) mm with edges (E, 2) sweep when turned about z.

    Along an edge the distance from the axis is convex in height, so that its largest value within a slab is
    at one of the slab's sides, and a cone through both sides' largest values holds all edges that pass
    through the whole slab. Where an edge ends within a slab the slab becomes a cylinder.
    """
    levels = _levels(vertices[:, 2])
    start, end = vertices[edges[:, 0]], vertices[edges[:, 1]]
    swap = start[:, 2] > end[:, 2]
    start, end = np.where(swap[:, None], end, start), np.where(swap[:, None], start, end)
    rows = [_slab(start, end, low, high) for low, high in pairwise(levels.tolist())]
    return np.array(rows).reshape(-1, 5)


def _levels(z: Floats) -> Floats:
    """Heights where the outline may bend, at most _MOST + 1."""
    values = np.unique(z)
    kept = values[np.append(True, np.diff(values) > _SAME)]
    kept[-1] = values[-1]
    return np.asarray(kept if len(kept) <= _MOST + 1 else np.quantile(kept, np.linspace(0.0, 1.0, _MOST + 1)))


def _slab(start: Floats, end: Floats, low: float, high: float) -> tuple[float, float, float, float, float]:
    """The frustum round all edges between two heights."""
    inside = (start[:, 2] < high) & (end[:, 2] > low)
    bottom, top = _radius(start, end, low, inside), _radius(start, end, high, inside)
    whole = (start[:, 2] <= low + _SAME) & (end[:, 2] >= high - _SAME)
    if not bool(whole[inside].all()):
        bottom = top = np.maximum(bottom, top)
    return (float(bottom.max(initial=0.0)), low, float(top.max(initial=0.0)), high, 0.0)


def _radius(start: Floats, end: Floats, at: float, inside: Bools) -> Floats:
    """Distances of edges from the axis at a height, or at their end nearest to it."""
    first, last = start[inside], end[inside]
    rise = last[:, 2] - first[:, 2]
    share = np.clip((at - first[:, 2]) / np.where(rise > 0.0, rise, 1.0), 0.0, 1.0)
    point = first + share[:, None] * (last - first)
    return np.asarray(np.hypot(point[:, 0], point[:, 1]))
