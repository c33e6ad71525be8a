"""Rapids that may be split: along the tool axis, across, along it; which they are, and the moves with corners."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Kind

ACROSS = 0.01
"""mm across the tool axis below which a rapid goes along it"""
CORNER = 0.01
"""mm along the tool axis below which a split rapid has no corner: more than the last decimal of any control"""
SAME = 1e-9
"""rad between axes that are one"""


def splittable(moves: Moves) -> Ints:
    """Rapids of the CL file (none of links and holes) across the tool axis, which stands still."""
    rows = np.flatnonzero((moves.kind == Kind.RAPID) & ~moves.link & (moves.hole < 0))
    rows = rows[rows > 0]
    axis, step = moves.axis[rows], moves.tip[rows] - moves.tip[rows - 1]
    across = np.linalg.norm(step - along(step, axis)[:, None] * axis, axis=1) > ACROSS
    return np.asarray(rows[across & (angle_between(moves.axis[rows - 1], axis) <= SAME)])


def along(step: Floats, axis: Floats) -> Floats:
    """(K,) mm of steps (K, 3) along axes (K, 3)."""
    return np.asarray(np.einsum("ni,ni->n", step, axis))


def with_corners(moves: Moves, rows: Ints, level: Floats, rises: Bools, falls: Bools) -> Moves:
    """The moves with rapids `rows` (K,) going across at their level (K,), mm along their axis: from their begin up to it
    where they rise (K,), and down to their end where they fall (K,); across, only the height is kept and compared."""
    axis, begin, end = moves.axis[rows], moves.tip[rows - 1], moves.tip[rows]
    rise, fall = (level - along(p, axis) for p in (begin, end))
    counts = np.ones(len(moves), dtype=np.int64)
    counts[rows] += rises.astype(np.int64) + falls
    wide = moves.take(np.repeat(np.arange(len(moves)), counts))
    first = np.cumsum(counts)[rows] - counts[rows]
    tip, phase = np.array(wide.tip), np.array(wide.phase)
    tip[first[rises]] = (begin + rise[:, None] * axis)[rises]
    across = first + rises
    tip[across[falls]] = (end + fall[:, None] * axis)[falls]
    phase[across] = Phase.POSITION
    return replace(wide, tip=tip, phase=phase)
