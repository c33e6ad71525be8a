"""Rapids that a program splits where the control would not keep them on their line: the reference with the corners that the
program has, however high it goes across. It knows nothing of how the conversion split them, nor of its output modes."""

from __future__ import annotations

import numpy as np

from postproc.job.job import Job
from postproc.path.model import TRAVERSE
from postproc.readback.alignment.align import EndPoses, aligned
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from postproc.reference.split_rapids import CORNER, along, splittable, with_corners
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.rotations import lengths

NEAR = 0.02
"""mm off the tool axis within which a block goes along it, off a height within which it goes across"""


def split_as_written(motion: Motion, executed: BlockPoses, job: Job, ends: EndPoses,
                     grain: tuple[float, float]) -> Moves:
    """The moves of the CL file, with rapids split where the program goes along the tool axis, across and along it again."""
    moves = job.commanded.without_pecks()
    if job.control.rapids != "dog-leg" or job.control.law == "tcp" or not len(rows := splittable(moves)):
        return job.commanded
    loose = np.array(moves.link)
    loose[rows] = True
    _, owner, _ = aligned(ends, moves, loose, job.options.tolerance, job.axis_tolerance, grain)
    place = np.full(len(moves) + 2, -1)
    place[rows] = np.arange(len(rows))
    blocks = np.flatnonzero((place[owner] >= 0) & (np.arange(len(owner)) > 0))
    split, level, rises, falls = _splits(motion, executed, moves, blocks, owner[blocks], ends.tip, job.options.tolerance)
    whole = np.flatnonzero(job.commanded.phase != Phase.PECK)
    return with_corners(job.commanded, whole[split], level, rises, falls) if len(split) else job.commanded


def _splits(motion: Motion, executed: BlockPoses, moves: Moves, blocks: Ints, owner: Ints, tip: Floats,
            tolerance: float) -> tuple[Ints, Floats, Bools, Bools]:
    """(moves (K,) that are split, level (K,) mm along their axis, rises (K,), falls (K,)); `blocks` (B,) by their move."""
    begins = np.diff(owner, prepend=-1) != 0
    first, group = np.flatnonzero(begins), np.cumsum(begins) - 1
    if not len(first):
        return owner, np.zeros(0), np.zeros(0, bool), np.zeros(0, bool)
    move, count = owner[first], np.diff(np.append(first, len(blocks)))
    axis, begin, end = moves.axis[move], moves.tip[move - 1], moves.tip[move]
    number = np.arange(len(blocks)) - first[group]
    here = tip[blocks]
    above_begin, above_end = _aside(here - begin[group], axis[group]), _aside(here - end[group], axis[group])
    to_begin = above_begin <= above_end  # of two lines that are near each other, the nearer one
    rising = np.maximum.reduceat(np.where(to_begin & (above_begin <= NEAR), number, -1), first)
    across = np.minimum.reduceat(np.where(~to_begin & (above_end <= NEAR), number, len(blocks)), first)
    rises, falls = rising >= 0, across < count - 1
    up, over = blocks[first + np.maximum(rising, 0)], blocks[first + np.minimum(across, count - 1)]
    low, high = along(begin, axis), along(end, axis)
    start = np.where(rises, along(tip[up], axis), low)
    level = np.where(falls, along(tip[over], axis), high)
    rises, falls = rises & (start - low > 0.5 * CORNER), falls & (level - high > 0.5 * CORNER)
    rapid = np.minimum.reduceat((motion.code[blocks] == TRAVERSE).astype(np.int8), first) > 0
    fits = rapid & (rising < across) & (np.abs(start - level) <= NEAR) & (level >= np.maximum(low, high) - CORNER)
    fits &= rises | falls | _leaves(motion, executed, blocks, first, begin[group], end[group], tolerance)
    height = np.where(rises & falls, level, np.where(falls, low, high))
    return move[fits], height[fits], rises[fits], falls[fits]


def _leaves(motion: Motion, executed: BlockPoses, blocks: Ints, first: Ints, begin: Floats, end: Floats,
            tolerance: float) -> Bools:
    """(K,) True for moves whose blocks (B,), from `first` (K,) on, leave the line from `begin` to `end` (B, 3), as each axis
    runs at its own speed."""
    line, away = end - begin, np.zeros(len(blocks))
    corners = list(executed.corners(motion, blocks).T)
    executed.look_ahead(motion, blocks, corners)
    for t in corners:
        offset = executed.poses(motion, blocks, t)[0] - begin
        share = np.clip((offset * line).sum(axis=1) / (line * line).sum(axis=1), 0.0, 1.0)
        away = np.maximum(away, lengths(offset - share[:, None] * line))
    return np.asarray((np.maximum.reduceat(away, first) > tolerance) & executed.bent(motion, blocks[first]))


def _aside(offset: Floats, axis: Floats) -> Floats:
    """(K,) mm from lines along axes (K, 3)."""
    return lengths(offset - along(offset, axis)[:, None] * axis)
