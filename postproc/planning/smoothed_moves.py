"""`--smooth`: CL points moved onto smooth curves within a share of the tolerance; corners, arcs and ends stay.

A program is compared with the CL file point by point. Where points are nearer together than smoothing moves
them, a moved point could pass for its neighbour; there they are moved less, or not at all, so that each keeps
its place in the order.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from postproc.planning.pass_geometry import chains
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import unit
from toolpaths.shapes import arrays
from toolpaths.smoothing.smooth import STILL, Smooth, Tolerance, smooth_all

HALVINGS = 3
"""Times that points too near to their neighbours are moved half as far, before they stay"""
SHORTEST = 0.5
"""Least length of a smoothed chord over that of the CL file's"""
LENGTH = 1e-3
"""mm by which a chord may become shorter before its feed is lowered, so that it takes the time that the CL file asks for"""


@dataclass(frozen=True)
@arrays(stay="M", moved="M")
class Smoothed:
    """Moves with smoothed points.

    Attributes:
        moves: that are written
        ranges: [first, last) of each pass that was looked at
        stay: (M,) True where a point was meant to be moved and stays, for being too near to its neighbours
        moved: (M,) True where it was moved
    """

    moves: Moves
    ranges: tuple[tuple[int, int], ...]
    stay: Bools
    moved: Bools


def smoothed_moves(moves: Moves, tolerance: Tolerance, stops: Ints, grain: Tolerance | None = None,
                   left: Collection[tuple[int, int]] = ()) -> Smoothed:
    """The same moves, points of dense straight moves at most `tolerance` off where they were.

    Chords between moved points stay within the same tolerance of the chords they replace. Points between
    other moves (long lines, arcs, corners) and points before which the motion stops (`stops`, rows) are not moved.

    Args:
        grain: mm, rad by which a written point must be nearer to its own CL point than to the one before or behind
        left: passes, as in `Smoothed.ranges`, of which no point is moved
    """
    tip, axis = moves.tip.copy(), moves.axis.copy()
    ranges = [one for one in chains(moves, stops) if one not in left]
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
            axis[begin + inside] = unit(values[:, 3:])
    share = _shares(moves, tip, axis, grain or Tolerance(0.2 * tolerance.tip, 0.2 * tolerance.axis))
    wanted = (tip != moves.tip).any(axis=1) | (axis != moves.axis).any(axis=1)
    tip, axis = _part(moves, tip, axis, share)
    made = replace(moves, tip=tip, axis=axis)
    return Smoothed(_timed(moves, made), tuple(ranges), wanted & (share == 0.0), wanted & (share > 0.0))


def _shares(moves: Moves, tip: Floats, axis: Floats, grain: Tolerance) -> Floats:
    """(M,) part of its path from `moves` to `tip`, `axis` (M, 3) that each point can go and keep its place in the order."""
    share = np.ones(len(moves))
    travel = np.linalg.norm(np.diff(moves.tip, axis=0), axis=1)
    turn = np.linalg.norm(np.diff(moves.axis, axis=0), axis=1)
    repeated = (travel <= STILL) & (turn <= STILL)
    cut = (moves.arc[1:] < 0) & ~moves.link[1:] & ~repeated
    for _ in range(HALVINGS + 1):
        bad = cut & ~_in_order(moves, *_part(moves, tip, axis, share), grain)
        bad = np.append(bad, False) | np.append(False, bad)
        bad &= share > 0.0
        if not bad.any():
            return share
        share[_with_repeated(bad, repeated)] *= 0.5
    return _unmoved(moves, tip, axis, share, cut, repeated, grain)


def _unmoved(moves: Moves, tip: Floats, axis: Floats, share: Floats, cut: Bools, repeated: Bools,
             grain: Tolerance) -> Floats:
    """`share` with 0 for points that are still too near; a point that stays crowds nobody more than one that is moved."""
    while True:
        bad = cut & ~_in_order(moves, *_part(moves, tip, axis, share), grain)
        both = _with_repeated(np.append(bad, False) | np.append(False, bad), repeated) & (share > 0.0)
        both &= (tip != moves.tip).any(axis=1) | (axis != moves.axis).any(axis=1)
        if not both.any():
            return share
        share[both] = 0.0


def _with_repeated(bad: Bools, repeated: Bools) -> Bools:
    """`bad` (M,) for all of the points that stand in one place, which `repeated` (M - 1,) joins."""
    if not repeated.any():
        return bad
    group = np.cumsum(np.append(True, ~repeated)) - 1
    return np.asarray(np.bincount(group, weights=bad)[group] > 0.0)


def _in_order(moves: Moves, tip: Floats, axis: Floats, grain: Tolerance) -> Bools:
    """(M - 1,) True where two neighbouring points (M, 3) are each nearer to their own point of `moves` than
    the other, by tip or by axis, and their chord is not much shorter."""
    apart = np.zeros(len(moves) - 1, dtype=np.bool_)
    for now, given, least in ((tip, moves.tip, grain.tip), (axis, moves.axis, grain.axis)):
        own = np.linalg.norm(now - given, axis=1)
        ahead, behind = np.linalg.norm(now[1:] - given[:-1], axis=1), np.linalg.norm(now[:-1] - given[1:], axis=1)
        apart |= (ahead > own[:-1] + least) & (behind > own[1:] + least)
    length, before = (np.linalg.norm(np.diff(one, axis=0), axis=1) for one in (tip, moves.tip))
    return np.asarray(apart & (length >= np.minimum(SHORTEST * before, before - LENGTH)))


def _part(moves: Moves, tip: Floats, axis: Floats, share: Floats) -> tuple[Floats, Floats]:
    """Tips and axes (M, 3) moved by `share` (M,) of their path."""
    less = np.flatnonzero(share < 1.0)
    if not len(less):
        return tip, axis
    tip, axis, part = tip.copy(), axis.copy(), share[less, None]
    tip[less] = moves.tip[less] + part * (tip[less] - moves.tip[less])
    turned = less[(axis[less] != moves.axis[less]).any(axis=1)]
    between = moves.axis[turned] + share[turned, None] * (axis[turned] - moves.axis[turned])
    axis[turned] = np.where(share[turned, None] > 0.0, unit(between), moves.axis[turned])
    return tip, axis


def _timed(moves: Moves, made: Moves) -> Moves:
    """`made` with feeds lowered where chords became shorter: no move takes less time than the CL file asks for."""
    straight = np.flatnonzero((moves.arc >= 0) == 0)
    straight = straight[(straight > 0) & ~moves.link[straight]]
    old, new = (np.linalg.norm(one.tip[straight] - one.tip[straight - 1], axis=1) for one in (moves, made))
    less = (new < old - LENGTH) & (new > 0.0)
    if not less.any():
        return made
    feed = moves.feed.copy()
    feed[straight[less]] *= new[less] / old[less]
    return replace(made, feed=feed)


def _inside(found: Smooth) -> tuple[Ints, Ints]:
    """Moves (local rows) that end inside a spline, and the segment."""
    members = found.members
    segment = np.clip(np.searchsorted(members.s, found.s[1:], side="right") - 1, 0, len(members.spline) - 1)
    inner = members.spline[segment] & (found.s[1:] > members.s[segment]) & (found.s[1:] < members.s[segment + 1])
    rows = np.flatnonzero(inner)
    return rows, segment[rows]
