"""CL points as a curve that is three times continuously differentiable, within a tolerance of tip and axis.

The parameter s is the way of the reference motion: tip in mm and axis times (tip tolerance over axis tolerance),
together as root of squares, so that one tolerance holds for both and an axis that turns on the spot has a way, too.
Rounded points on dense chords become splines, arcs and long lines stay what they are; where these meet, one turns into
the other within a short distance, or the motion stops.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.smoothing.blend import SHARPEST, Blends, chosen
from toolpaths.smoothing.fit import Fit, fit
from toolpaths.smoothing.members import Members
from toolpaths.smoothing.stretches import Segments, corners, segments
from toolpaths.smoothing.tangents import lengths, rates, turns

STILL = 1e-7
"""mm: moves of less way are none"""
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
        """mm of way per rad of the axis"""
        return self.tip / self.axis


@dataclass(frozen=True)
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
    blends: Blends
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


def smooth(curves: Curves, tolerance: Tolerance, sharpest: float = SHARPEST) -> Smooth | None:
    """The smoothed motion along a chain of curves, each beginning where the one before ends; None where nothing moves.

    Args:
        sharpest: rad; the motion stops where tip and axis together turn by more in one joint
    """
    way = lengths(curves, tolerance.scale)
    moving = way > STILL
    s = np.concatenate(([0.0], np.cumsum(np.where(moving, way, 0.0))))
    if not moving.any():
        return None
    kept = curves.take(np.flatnonzero(moving))
    ends = np.append(s[:-1][moving], s[-1])
    before, after = rates(kept, tolerance.scale)
    turn = turns(after[:-1], before[1:])
    parts, found = _fitted(kept, ends, way[moving], turn, tolerance)
    members = Members(kept, ends, parts.first, parts.spline, tolerance.scale, found)
    joint_turn = turn[parts.first[1:-1] - 1]
    blends = chosen(members, joint_turn, tolerance.tip, (1.0 - SHARE) * tolerance.tip, min(sharpest, SHARPEST))
    worst = SHARE * float(found.ratio.max(initial=0.0)) if found is not None else 0.0
    return Smooth(s, members, blends, worst, tolerance)


def _fitted(curves: Curves, s: Floats, way: Floats, turn: Floats, tolerance: Tolerance) -> tuple[Segments, Fit | None]:
    """Segments and the splines of those that are splines.

    Chords that no spline keeps to end up between corners; after some tries all chords of such a spline do, so that
    this ends.
    """
    p = points(curves, tolerance.scale)
    corner = corners(way, turn, curves.is_arc, SHARE * tolerance.tip)
    for retry in count():
        parts = segments(corner, curves.is_arc)
        rows, first = _rows(parts)
        if not len(rows):
            break
        found = fit(s[rows], p[rows], first, SHARE * tolerance.tip)
        bad = np.flatnonzero(found.ratio > 1.0)
        if not len(bad):
            return parts, found
        corner = _more_corners(corner, parts, rows[bad], retry >= RETRIES)
    return parts, None


def points(curves: Curves, scale: float) -> Floats:
    """(M + 1, 6) tip and scaled axis at the ends of M curves in a chain."""
    tip = np.concatenate((curves.start[:1], curves.end))
    return np.hstack((tip, scale * np.concatenate((curves.axis0[:1], curves.axis1))))


def _rows(parts: Segments) -> tuple[Ints, Ints]:
    """Points of all splines, one behind the other, and where each begins among them."""
    begin, end = parts.first[:-1][parts.spline], parts.first[1:][parts.spline]
    size = end - begin + 1
    first = np.concatenate(([0], np.cumsum(size)))
    return np.arange(first[-1]) - np.repeat(first[:-1] - begin, size), first


def _more_corners(corner: Bools, parts: Segments, chord: Ints, all_of_it: bool) -> Bools:
    """Corners at both ends of these moves; or at every joint of the splines that hold them."""
    more = corner.copy()
    if all_of_it:
        for segment in np.unique(np.searchsorted(parts.first, chord, side="right") - 1):
            more[parts.first[segment]:parts.first[segment + 1] - 1] = True
    more[np.maximum(chord - 1, 0)] = True
    more[np.minimum(chord, len(corner) - 1)] = True
    return more


def deviation(found: Smooth, curves: Curves, parts: int = 4) -> tuple[float, float]:
    """Largest distance (tip mm, axis rad) from the curves at the same parameter, at `parts` places on each move."""
    way = np.diff(found.s)
    rows = np.flatnonzero(way > 0.0)
    worst = np.zeros(2)
    for part in np.linspace(0.0, 1.0, parts + 1):
        tip, axis = found.at(found.s[rows] + part * way[rows])
        wanted, wanted_axis = curves.take(rows).at(np.full(len(rows), part))
        worst = np.maximum(worst, [np.linalg.norm(tip - wanted, axis=1).max(), angle_between(axis, wanted_axis).max()])
    return float(worst[0]), float(worst[1])
