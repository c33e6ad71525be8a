"""The feed of each block that carries the plan: the highest planned speed of the block, and points where it spans too much.

A control that plans its own ramps takes F as the largest speed of a block. Under the highest planned speeds its least time
is the plan's, whatever the blocks' length; under mean speeds it is longer, as every ramp has to stay below the steps (13 %
for blocks of 7 ms, 3 % for 4 ms). So that the words are near the means too, blocks are cut where the planned speed changes
by more than `SPREAD` in them, into parts of `LEAST` seconds or more.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from postproc.feedrate.motion import Plan
from postproc.planning.pass_geometry import PassGeometry
from toolpaths.arrays import Bools, Floats, Ints

SPREAD = 0.1
"""of its speed by which the plan may change in a block before it is cut"""
LEAST = 0.02
"""s that parts of a block take in the plan, about"""
NEAR = 2e-3
"""by which words are above the plan's highest speeds: a plan that is at the programmed feed leaves that word as it is"""
SLOWEST = 1e-9
"""mm/s of the path: less is rest"""
Planned = Sequence[tuple[PassGeometry, Plan]]
"""passes with their plans"""


class AddedPoints(NamedTuple):
    """Points at shares (P,) between 0 and 1 of blocks (P,) of a Path, both ascending."""

    block: Ints
    share: Floats


def word_seconds(planned: Planned, count: int) -> Floats:
    """(count,) s of each block of a Path at the highest speed that the plan has in it; 0 for blocks of no pass."""
    seconds = np.zeros(count)
    for one, made in planned:
        rows = np.flatnonzero(one.ends > one.begin)
        if len(rows):
            cuts = np.append(one.begin[rows], one.ends[rows[-1]])
            fastest = (1.0 + NEAR) * np.maximum(made.blocks(cuts).highest, SLOWEST)
            np.maximum.at(seconds, one.block[rows], np.diff(cuts) / fastest)
    return seconds


def points_between(planned: Planned, fit: Bools, travel: Floats, shortest: float) -> AddedPoints:
    """Where blocks are cut.

    Args:
        fit (K,): blocks of the Path that may be; travel (K,): how far each goes, in the units of `shortest`
        shortest: least travel of a part
    """
    block, share = [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
    for one, made in planned:
        s, level = _levels(made)
        low, high = np.interp(one.begin, s, level), np.interp(one.ends, s, level)
        parts = np.where(fit[one.block] & (one.ends > one.begin), np.ceil(high - low - 1e-6), 1.0).astype(np.int64)
        rows = np.repeat(np.arange(len(parts)), np.maximum(parts - 1, 0))
        number = np.arange(len(rows)) - np.searchsorted(rows, rows) + 1
        place = np.interp(low[rows] + number / parts[rows] * (high - low)[rows], level, s)
        block.append(one.block[rows])
        share.append((place - one.begin[rows]) / (one.ends - one.begin)[rows])
    return _apart(AddedPoints(np.concatenate(block), np.concatenate(share)), travel, shortest)


def _levels(made: Plan) -> tuple[Floats, Floats]:
    """(s, level) that rises by 1 from point to point: by SPREAD of the speed, no faster than once in LEAST."""
    s = np.unique(np.concatenate([np.clip(piece.eased.parameter(piece.profile.sigma)[0], piece.eased.first,
                                          piece.eased.last) for piece in made.pieces]))
    change = np.abs(np.diff(np.log(np.maximum(made.speed(s), SLOWEST)))) / SPREAD
    step = np.minimum(change, np.diff(made.time(s)) / LEAST)
    return s, np.concatenate([[0.0], np.cumsum(step + 1e-9 * np.diff(s) / (s[-1] - s[0]))])


def _apart(points: AddedPoints, travel: Floats, shortest: float) -> AddedPoints:
    """Without points that are too near to the one before or to an end of their block."""
    order = np.lexsort((points.share, points.block))
    block, share = points.block[order], points.share[order]
    first = np.append(True, block[1:] != block[:-1])
    before = np.where(first, 0.0, np.concatenate([[0.0], share[:-1]]))
    keep = np.minimum(share - before, 1.0 - share) * travel[block] >= shortest
    return AddedPoints(block[keep], share[keep])


def with_points(one: PassGeometry, added: AddedPoints, count: int) -> PassGeometry:
    """A pass with its blocks as they are numbered and placed in a path of `count` blocks with these points."""
    number = np.arange(count) + np.cumsum(np.bincount(added.block, minlength=count))
    low, high = np.searchsorted(added.block, [one.block[0], one.block[-1] + 1])
    own, share = added.block[low:high], added.share[low:high]
    at = np.searchsorted(one.block, own)
    place = one.begin[at] + share * (one.ends - one.begin)[at]
    ends = np.insert(one.ends, at, place)
    begin = np.concatenate([one.begin[:1], ends[:-1]])
    inside = number[own] - (np.searchsorted(own, own, side="right") - np.arange(len(own)))
    return _replaced(one, np.insert(number[one.block], at, inside), begin, ends)


def _replaced(one: PassGeometry, block: Ints, begin: Floats, ends: Floats) -> PassGeometry:
    return PassGeometry(one.move, one.share, block, begin, ends, one.smooth, one.paths)
