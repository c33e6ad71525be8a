"""Which moves one spline follows, which stay lines and arcs of their own, and where the corners are."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

FEWEST = 4
"""Chords that make a spline; fewer stay lines."""
LONG = 12.0
"""A chord so many times longer than those around it is a line of its own."""
HIGH = 1.6
"""Height of a curve over its chord, over the tolerance, that no smooth curve can share between points and chord."""
ALONE = 3.0
"""Times the turns next to it that a turn must be to be a corner for that."""
ROUND = 0.15
"""Part of the knot's distance, times the turn, by which a spline rounds a corner."""
TURN_SPAN = 2.0
"""Chords over which a spline can turn."""


@dataclass(frozen=True)
@arrays(first="G+1", spline="G")
class ChainSegments:
    """G segments of a chain of moves.

    Attributes:
        first (G + 1,): first move of each segment
        spline (G,): True where one spline follows its moves, else it is a single move
    """

    first: Ints
    spline: Bools

    def __len__(self) -> int:
        return len(self.spline)


def corners(length: Floats, turn: Floats, is_arc: Bools, apart: Bools, tolerance: float) -> Bools:
    """(M - 1,) joints between M moves that no spline may cross.

    Next to arcs and long chords; where the polyline turns by more than a curve within the tolerance of its
    chords could, and where it turns much more than next to the joint; and at those that are `apart`.
    """
    long = _long(length, np.concatenate(([0], np.cumsum(apart)))) | is_arc
    shorter = np.minimum(length[1:], length[:-1])
    sharp = shorter * turn / 8.0 > HIGH * tolerance
    adjacent = np.concatenate(([0.0], turn, [0.0]))
    alone = turn > ALONE * np.maximum(adjacent[:-2], adjacent[2:])
    alone &= turn * TURN_SPAN * np.maximum(length[1:], length[:-1]) * ROUND > tolerance
    return np.asarray(apart | long[1:] | long[:-1] | sharp | alone)


def _long(length: Floats, chain: Ints) -> Bools:
    """(M,) chords much longer than the second shortest of the two before and the two behind in the same chain (M,)."""
    around = np.full((4, len(length)), np.inf)
    for row, shift in enumerate((-2, -1, 1, 2)):
        if abs(shift) < len(length):
            here, there = slice(max(-shift, 0), min(-shift, 0) or None), slice(max(shift, 0), min(shift, 0) or None)
            around[row, here] = np.where(chain[here] == chain[there], length[there], np.inf)
    return np.asarray(length > LONG * np.sort(around, axis=0)[1])


def segments(corner: Bools, is_arc: Bools) -> ChainSegments:
    """Moves between corners as splines where they are enough of them, else one by one."""
    moves = len(corner) + 1
    begin = np.concatenate(([0], np.flatnonzero(corner) + 1, [moves]))
    size = np.diff(begin)
    spline = (size >= FEWEST) & ~is_arc[begin[:-1]]
    pieces = np.where(spline, 1, size)
    which = np.repeat(np.arange(len(size)), pieces)
    local = np.arange(len(which)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    return ChainSegments(np.append(begin[:-1][which] + local, moves), spline[which])
