"""The CL path with the axes of runs turned: contacts where they were, every cut in the time that it had."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from postproc.orientation.passes.passes import PassContext
from postproc.orientation.turning.cutting_runs import TURNS
from postproc.orientation.turning.tilt_search import TiltField
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.rotations import angle_between
from toolpaths.toolpath import FeedMode, Kind, Role, Toolpath

STILL = 1e-6
"""mm that the tip goes at least in a cut whose feed follows its length"""
SAME = 1e-9
"""share of a feed by which it changes at least"""


def turned_toolpath(work: PassContext, fields: Sequence[TiltField]) -> Toolpath:
    """The toolpath of `work` with the axes of some runs; rapids that lead to a run and draw back from it turn with it."""
    path, back, moves = work.toolpath, work.placement.inverse(), work.moves
    fields = [one for one in fields if one.field.any()]
    if not fields:
        return path
    tip, axis = path.tip.copy(), path.axis.copy()
    for one in fields:
        low, high = one.run.rows
        own = moves.row[low - 1:high]
        places = [(own, one.axes, one.run.normal), *_rapids(work, one)]
        for rows, axes, normal in places:
            axis[rows] = back.directions(axes)
            tip[rows] = one.run.kept(path.tip[rows], path.axis[rows], axis[rows], back.directions(normal))
    return replace(path, tip=tip, axis=axis, feed=_in_their_time(path, tip, axis))


def _rapids(work: PassContext, made: TiltField) -> list[tuple[Ints, Floats, Floats]]:
    """Rows of the Toolpath of rapids next to a run that stand along its first axis, or its last; axes, normals (N, 3):
    those that lead to it, but the one that draws back from the cut before, and the one that draws back from it. They are
    of its own operation and tool: others keep their axes, and a ball of another radius is elsewhere."""
    moves, (low, high), run = work.moves, made.run.rows, made.run
    operation = work.toolpath.operation[moves.row]
    own = (operation == operation[low]) & (moves.tool == moves.tool[low])
    free = (moves.kind == Kind.RAPID) & (moves.hole < 0)
    first = low - 1
    while first > 0 and _stands(work, free & own, first - 1, run.axis[0]) and not (first > 1 and not free[first - 2]):
        first -= 1
    ends, axes = high, made.axes
    if high < len(moves) and _stands(work, free & own, high, run.axis[-1]) and (high + 1 == len(moves) or free[high + 1]):
        ends = high + 1
    parts = ((np.arange(first, low - 1), axes[0], run.normal[0]), (np.arange(high, ends), axes[-1], run.normal[-1]))
    return [(moves.row[rows], np.tile(one, (len(rows), 1)), np.tile(normal, (len(rows), 1)))
            for rows, one, normal in parts if len(rows)]


def _stands(work: PassContext, free: Bools, row: int, axis: Floats) -> bool:
    """Whether a row is a rapid with the tool along `axis` (3,)."""
    return bool(free[row]) and float(angle_between(work.moves.axis[row], axis)) < TURNS


def _in_their_time(path: Toolpath, tip: Floats, axis: Floats) -> Floats:
    """Feeds (N,) by which every straight cut takes the time that it had: the path of the tip is another now."""
    cuts = np.zeros(len(path), dtype=np.bool_)
    moved = (np.abs(axis - path.axis).max(axis=1) > 0.0)
    cuts[1:] = moved[1:] | moved[:-1]
    cuts &= (path.kind == Kind.FEED) & (path.role != Role.HOLE) & (path.feed_mode != FeedMode.INVERSE_TIME)
    ratio = np.ones(len(path))
    before, now = (np.linalg.norm(np.diff(each, axis=0), axis=1) for each in (path.tip, tip))
    known = (before > STILL) & (now > STILL)
    ratio[1:][known] = now[known] / before[known]
    return np.asarray(np.where(cuts & (np.abs(ratio - 1.0) > SAME), path.feed * ratio, path.feed))
