"""Which blocks of a linking move belong to the cut that it leads to: those of the approach to it at feed."""

from __future__ import annotations

import numpy as np

from postproc.readback.execution.execute import Motion
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.toolpath import Kind

_RISES = 1e-6
"""mm along the tool axis that come of reckoning, not of motion"""


def leads_down(motion: Motion, moves: Moves, owner: Ints, tip: Floats) -> Bools:
    """(E,) True for blocks by which the tool comes down to a cut that no RAPID leads to, at the feed of that cut.

    Those are the last blocks of a linking move that is fed (`reference.moves.build_moves`): nothing behind
    them is rapid or rises along the axis of the cut. What is fed before them is a retract whose slides would
    leave its line in rapid: it is made with the tool and in the states of before, and belongs to no cut.

    Args:
        owner (E,): the move that each block serves; tip (E, 3) mm at the end of each
    """
    result = np.zeros(len(motion), dtype=bool)
    led = moves.link & (moves.kind != Kind.RAPID)
    rows = np.flatnonzero((owner < len(moves)) & led[np.minimum(owner, len(moves) - 1)])
    if not len(rows):
        return result
    rise = np.einsum("ni,ni->n", tip[rows] - tip[np.maximum(rows - 1, 0)], moves.axis[owner[rows]])
    other = (motion.code[rows] == 0) | (rise > _RISES) | (rows == 0)
    last = np.full(len(moves), -1)
    np.maximum.at(last, owner[rows[other]], rows[other])
    result[rows] = rows > last[owner[rows]]
    return result
