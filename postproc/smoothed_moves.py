"""`--smooth`: CL points moved onto smooth curves within a share of the tolerance; corners, arcs and ends stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.moves import Moves
from postproc.pass_geometry import chains
from toolpaths.arrays import Floats, Ints
from toolpaths.smoothing.smooth import Smooth, Tolerance, smooth


def smoothed_moves(moves: Moves, tolerance: Tolerance, stops: Ints) -> Moves:
    """The same moves, points of dense straight moves at most `tolerance` off where they were.

    Chords between moved points stay within the same tolerance of the chords they replace. Points between other moves
    (long lines, arcs, corners) and points before which the motion stops (`stops`, rows) are not moved.
    """
    tip, axis, reference = moves.tip.copy(), moves.axis.copy(), moves.curves()
    for first, last in chains(moves, stops):
        curves = reference.take(np.arange(first, last))
        found = smooth(curves, tolerance)
        if found is None:
            continue
        rows, places = _inside(found)
        values = found.members.at(places, found.s[rows + 1])
        tip[first + rows] = values[:, :3]
        if (curves.axis1 != curves.axis0[0]).any():
            axis[first + rows] = _unit(values[:, 3:])
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
