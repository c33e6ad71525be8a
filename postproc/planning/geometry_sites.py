"""Where a smoothed path must be looked at, so that a quintic spline through the places repeats it."""

from __future__ import annotations

import numpy as np

from postproc.feedrate.mesh import gentle, place
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between
from toolpaths.smoothing.smooth import Smooth

BLEND = 6.0
"""Places to half a blend."""
SPAN = 2.0
"""Places to a span of a spline."""
TURN = 0.1
"""rad that an arc, or the axis on a line, may turn between places"""
LONGEST = 0.125
"""Part of a line or arc between places."""
SLOPE = 0.3
"""Change of the distance of places per path."""
ENDS = 8.0
"""Times denser at both ends: a spline through points is least exact there."""
FEWEST = 12
"""Intervals between two stops."""


def sites(path: Smooth, first: float, last: float) -> Floats:
    """Parameters (N,) from first to last, denser where the path turns quickly, the distance changing gradually."""
    at, wanted = _marks(path)
    low, high = np.searchsorted(at, [first, last])
    at = np.concatenate(([first], at[low:high], [last]))
    coarse = (last - first) / FEWEST
    wanted = np.minimum(np.concatenate(([np.inf], wanted[low:high], [np.inf])), coarse)
    at, keep = np.unique(at, return_index=True)
    most = np.minimum(_coarsest(path, 0.5 * (at[:-1] + at[1:])), coarse)
    wanted = np.minimum.reduceat(wanted, keep)
    wanted = np.minimum(wanted, np.maximum(np.append(most, most[-1]), np.append(most[0], most)))
    wanted[[0, -1]] /= ENDS
    return place(*_between(at, gentle(at, wanted, SLOPE), most))


def _marks(path: Smooth) -> tuple[Floats, Floats]:
    """Places, rising, and the distance of sites that is wanted there: ends and middles of blends, knots, ends of members."""
    at, h = [path.members.s], [np.full(len(path.members.s), np.inf)]
    if path.members.fit is not None:
        t, _ = path.members.fit.knots.simple()
        at.append(t)
        h.append(np.full(len(t), np.inf))
    blends = path.blends
    soft = ~blends.stop
    for shift in (-1.0, 0.0, 1.0):
        at.append((blends.s + shift * blends.half)[soft])
        h.append(blends.half[soft] / BLEND)
    where, wanted = np.concatenate(at), np.concatenate(h)
    order = np.argsort(where, kind="stable")
    return where[order], wanted[order]


def _coarsest(path: Smooth, s: Floats) -> Floats:
    """(N,) largest distance of sites at s (N,), between marks: what the segment asks for."""
    members = path.members
    size = np.diff(members.s)
    curves = members.curves.take(members.first[:-1])
    turn = np.maximum(np.where(curves.is_arc, curves.sweep, 0.0), angle_between(curves.axis0, curves.axis1))
    own = np.minimum(LONGEST * size, TURN * size / np.maximum(turn, 1e-12))
    segment = np.clip(np.searchsorted(members.s, s, side="right") - 1, 0, len(size) - 1)
    result = own[segment]
    if members.fit is not None:
        t, _ = members.fit.knots.simple()
        k = np.clip(np.searchsorted(t, s, side="right"), 1, len(t) - 1)
        result = np.where(members.spline[segment], (t[k] - t[k - 1]) / SPAN, result)
    return np.asarray(result)


def _between(at: Floats, h: Floats, most: Floats) -> tuple[Floats, Floats]:
    """Places and distances with those added where, between places, the distance has grown to `most` or falls again."""
    gap = np.diff(at)
    peak = np.minimum(0.5 * (h[:-1] + h[1:] + SLOPE * gap), np.maximum(most, np.maximum(h[:-1], h[1:])))
    up = np.clip((peak - h[:-1]) / SLOPE, 0.0, gap)
    down = np.clip((peak - h[1:]) / SLOPE, 0.0, gap - up)
    every = np.concatenate((at, at[:-1] + up, at[1:] - down))
    values = np.concatenate((h, peak, peak))
    order = np.argsort(every, kind="stable")
    every, keep = np.unique(every[order], return_index=True)
    return every, np.minimum.reduceat(values[order], keep)
