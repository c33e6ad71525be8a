"""`--smooth`: CL points moved onto smooth curves within a share of the tolerance; corners, arcs and ends stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.moves import Moves
from postproc.pass_geometry import chains
from toolpaths.arrays import Floats, Ints
from toolpaths.smoothing.smooth import Smooth, Tolerance, smooth_all


def smoothed_moves(moves: Moves, tolerance: Tolerance, stops: Ints) -> Moves:
    """The same moves, points of dense straight moves at most `tolerance` off where they were.

    Chords between moved points stay within the same tolerance of the chords they replace. Points between other moves
    (long lines, arcs, corners) and points before which the motion stops (`stops`, rows) are not moved.
    """
    tip, axis = moves.tip.copy(), moves.axis.copy()
    ranges = chains(moves, stops)
    rows = np.concatenate([np.arange(*one) for one in ranges]) if ranges else np.zeros(0, dtype=np.int64)
    first = np.concatenate(([0], np.cumsum([last - begin for begin, last in ranges]))).astype(np.int64)
    curves = moves.curves().take(rows)
    for (begin, last), found in zip(ranges, smooth_all(curves, first, tolerance), strict=True):
        if found is None:
            continue
        inside, places = _inside(found)
        values = found.members.at(places, found.s[inside + 1])
        tip[begin + inside] = values[:, :3]
        if (moves.axis[begin:last] != moves.axis[begin - 1]).any():
            axis[begin + inside] = _unit(values[:, 3:])
    return replace(moves, tip=tip, axis=axis)


def _inside(found: Smooth) -> tuple[Ints, Ints]:
    """Moves (local rows) that end inside a spline, and the segment."""
    members = found.members
    segment = np.clip(np.searchsorted(members.s, found.s[1:], side="right") - 1, 0, len(members.spline) - 1)
    inner = members.spline[segment] & (found.s[1:] > members.s[segment]) & (found.s[1:] < members.s[segment + 1])
    rows = np.flatnonzero(inner)
    return rows, segment[rows]


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))
