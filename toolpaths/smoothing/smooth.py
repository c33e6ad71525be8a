"""CL points as a curve that is three times continuously differentiable, within a tolerance of tip and axis.

The parameter s is the path of the reference motion: tip in mm and axis times (tip tolerance over axis
tolerance), together as root of squares, so that one tolerance holds for both and an axis that turns on the
spot has a path, too. Rounded points on dense chords become splines, arcs and long lines stay what they are;
where these meet, one turns into the other within a short distance, or the motion stops.
"""

from __future__ import annotations

from itertools import count

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shape import Curves
from toolpaths.shapes import arrays
from toolpaths.smoothing.blend import SHARPEST, SegmentBlends, chosen
from toolpaths.smoothing.fit import Spline, assembled, fit
from toolpaths.smoothing.members import Members
from toolpaths.smoothing.stretches import ChainSegments, corners, segments
from toolpaths.smoothing.tangents import lengths, rates, turns

STILL = 1e-7
"""mm: moves of less path are none"""
SHARE = 0.8
"""of the tolerance for splines; what is left is for where they meet others"""
RETRIES = 3


@dataclass(frozen=True)
class Tolerance:
    """Largest deviation of the tip, mm, and of the tool axis, rad."""

    tip: float
    axis: float

    @property
    def scale(self) -> float:
        """mm of path per rad of the axis"""
        return self.tip / self.axis


@dataclass(frozen=True)
@arrays(s="E")
class Smooth:
    """A smoothed chain of M moves.

    Attributes:
        s (M + 1,): parameter at the start and at the end of each move; equal for moves that stand still
        stops: parameters inside the chain where the motion must stop
        worst: bound of the deviation of splines over the tolerance; that of blends is within theirs
        tolerance: that was asked for
    """

    s: Floats
    members: Members
    blends: SegmentBlends
    worst: float
    tolerance: Tolerance

    @property
    def stops(self) -> Floats:
        return self.blends.s[self.blends.stop]

    @property
    def breaks(self) -> Floats:
        """Parameters where derivatives above the third may jump, ends included."""
        return np.unique(np.concatenate((self.members.breaks(), self.blends.zones().ravel())))

    def at(self, s: Floats) -> tuple[Floats, Floats]:
        """(tip (N, 3), axis (N, 3)) at s (N,), any order; at a stop both sides meet."""
        values = self.blends.at(self.members, np.asarray(s, dtype=np.float64))
        axis = values[:, 3:]
        return values[:, :3], axis / np.linalg.norm(axis, axis=1, keepdims=True)


def smooth_all(curves: Curves, first: Ints, tolerance: Tolerance,
               sharpest: float = SHARPEST) -> list[Smooth | None]:
    """The smoothed motion along chains of curves, [first[k], first[k + 1]) of each, each curve beginning
    where the one before ends; None where nothing moves. What comes out of one chain does not depend on the others.

    `sharpest`, rad: the motion stops where tip and axis together turn by more in one joint.
    """
    travel = lengths(curves, tolerance.scale)
    moving = travel > STILL
    begin = np.concatenate(([0], np.cumsum(moving)))[first]
    rows = np.flatnonzero(moving)
    if not len(rows):
        return [None] * (len(first) - 1)
    kept, ends = curves if moving.all() else curves.take(rows), np.concatenate(([0.0], np.cumsum(travel[rows])))
    apart = np.zeros(len(rows) + 1, dtype=bool)
    apart[begin] = True
    before, after = rates(kept, tolerance.scale)
    turn = np.where(apart[1:-1], 0.0, turns(after[:-1], before[1:]))
    parts, splines = _fitted(kept, ends, travel[rows], turn, apart[1:-1], tolerance)
    members = Members(kept, ends, parts.first, parts.spline, tolerance.scale, assembled(splines, 0.0))
    joint = parts.first[1:-1] - 1
    blends = chosen(members, np.where(apart[1:-1], np.inf, turn)[joint], tolerance.tip, (1.0 - SHARE) * tolerance.tip,
                    min(sharpest, SHARPEST))
    result: list[Smooth | None] = []
    for k in range(len(first) - 1):
        own = np.where(moving, travel, 0.0)[first[k]:first[k + 1]]
        s = np.concatenate(([0.0], np.cumsum(own)))
        result.append(_chain(members, blends, splines, begin[k:k + 2], s, tolerance) if begin[k + 1] > begin[k] else None)
    return result


def _chain(members: Members, blends: SegmentBlends, splines: list[Spline], rows: Ints, s: Floats,
           tolerance: Tolerance) -> Smooth:
    """One chain, moves [rows[0], rows[1]), of the members of all; its parameter begins at 0."""
    low, high = np.searchsorted(members.first, rows).tolist()
    start = float(members.ends[rows[0]])
    number = np.concatenate(([0], np.cumsum(members.spline)))
    own = splines[int(number[low]):int(number[high])]
    ends = members.ends[rows[0]:rows[1] + 1] - start
    ends[-1] = s[-1]
    curves = Curves(*(getattr(members.curves, name)[rows[0]:rows[1]] for name in Curves.__dataclass_fields__))
    mine = Members(curves, ends, members.first[low:high + 1] - rows[0],
                   members.spline[low:high], members.scale, assembled(own, start))
    joints = slice(low, high - 1)
    joined = SegmentBlends(blends.s[joints] - start, blends.half[joints], blends.stop[joints],
                           blends.turn[joints])
    worst = SHARE * max((float(one.ratio.max()) for one in own), default=0.0)
    return Smooth(s, mine, joined, worst, tolerance)


def _fitted(curves: Curves, s: Floats, travel: Floats, turn: Floats, apart: Bools,
            tolerance: Tolerance) -> tuple[ChainSegments, list[Spline]]:
    """Segments, and the splines of those that are splines; `apart` are joints of two chains.

    Chords that no spline keeps to end up between corners; after some tries all chords of such a spline do, so
    that this ends.
    """
    corner = corners(travel, turn, curves.is_arc, apart, SHARE * tolerance.tip)
    known: dict[tuple[int, int], Spline] = {}
    for retry in count():
        parts = segments(corner, curves.is_arc)
        wanted = list(zip(parts.first[:-1][parts.spline].tolist(), parts.first[1:][parts.spline].tolist(), strict=True))
        new = [moves for moves in wanted if moves not in known]
        bad = []
        for moves, one in zip(new, _fit(curves, s, new, tolerance), strict=True):
            chords = np.flatnonzero(one.ratio > 1.0)
            bad.append(moves[0] + chords)
            if not len(chords):
                known[moves] = one
        if not any(len(chords) for chords in bad):
            break
        corner = _more_corners(corner, parts, np.concatenate(bad), retry >= RETRIES)
    return parts, [known[moves] for moves in wanted]


def _fit(curves: Curves, s: Floats, moves: list[tuple[int, int]], tolerance: Tolerance) -> list[Spline]:
    """Splines along the points of moves [begin, end)."""
    if not moves:
        return []
    begin, end = np.array(moves).T
    size = end - begin + 1
    first = np.concatenate(([0], np.cumsum(size)))
    row = np.arange(first[-1]) - np.repeat(first[:-1] - begin, size)
    tip, axis = curves.end[row - 1], curves.axis1[row - 1]
    tip[first[:-1]], axis[first[:-1]] = curves.start[begin], curves.axis0[begin]
    return fit(s[row], np.hstack((tip, tolerance.scale * axis)), first, SHARE * tolerance.tip)


def _more_corners(corner: Bools, parts: ChainSegments, chord: Ints, all_of_it: bool) -> Bools:
    """Corners at both ends of these moves; or at every joint of the splines that hold them."""
    more = corner.copy()
    if all_of_it:
        for segment in np.unique(np.searchsorted(parts.first, chord, side="right") - 1):
            more[parts.first[segment]:parts.first[segment + 1] - 1] = True
    more[np.maximum(chord - 1, 0)] = True
    more[np.minimum(chord, len(corner) - 1)] = True
    return more
