"""A cheap bound of how far blocks stray from straight curves: above the closer one of `bound.py` on every block.

It looks at both ends of a block alone. With B what |second derivative| of the tip nowhere exceeds (`coarse_bends`), the
tip is within B / 8 of the straight line between the tips at its ends, and the line's own parameter runs evenly between the
places nearest to them. The closer bounds add a third derivative, and a parameter that bends by as much as the tip strays
along the line: twice B / 8 is above them too while the axes turn by less than MOST_TURN. So a block that this bound finds
inside a limit is inside it for those, and none of them need be computed.
"""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from machines.kinematics.chain_loop import coarse_bends
from toolpaths.arrays import Floats, Ints
from toolpaths.compiled import compiled, loop
from toolpaths.shape import Curves

MOST_TURN = 0.1
"""rad that all rotary axes together turn by in a block: above it the cheap bound says nothing"""
FIRST = 64
"""blocks of the largest cheap bounds that are looked at first"""
_SHARE = 0.25
"""of B: twice 1/8"""
_GRAIN = 1e-9
"""mm, rad: far above what the ends of blocks are rounded by"""
_ROWS, _COLUMN = ("float64", 2), ("float64", 1)


def coarse_bounds(kin: Kinematics, curves: Curves, q: tuple[Floats, Floats], start: tuple[Floats, Floats],
                  end: tuple[Floats, Floats], short: float) -> Floats | None:
    """(2, N) bounds (mm, rad) of blocks straight in joints q[0] -> q[1] (N, J) from straight curves; infinite on arcs and
    where nothing is said; None of few blocks, and of machines that are no chain.

    Args:
        start, end: tip and axis (N, 3) at both ends of the blocks
        short: mm; on shorter curves tip and axis are compared at one parameter
    """
    bends = coarse_bends(kin.chain, kin.axis_names, -kin.tool_length * kin.tool_axis, *q) if kin.jets_proved else None
    if bends is None:
        return None
    found: Floats = compiled(coarse)(curves.start, curves.end, curves.axis0, curves.axis1, *start, *end, bends, short)
    found[:, curves.is_arc] = np.inf
    return found


def highest(bounds: Floats) -> Ints:
    """Numbers of the FIRST largest of bounds (2, N), of either kind: what is looked at first, so that few others need be."""
    return np.unique(np.argpartition(-bounds, min(FIRST, bounds.shape[1] - 1), axis=1)[:, :FIRST])


@loop(takes=(_ROWS,) * 9 + (("float64", 0),))
def coarse(begin: Floats, goal: Floats, axis0: Floats, axis1: Floats, tip_a: Floats, axis_a: Floats, tip_b: Floats,
           axis_b: Floats, bends: Floats, short: float) -> Floats:
    """(2, N) of lines from `begin` to `goal`, axes from `axis0` to `axis1` (N, 3); tips and axes at the blocks' ends.

    A great circle that turns by w stays within w^2 / 8 of its chord; an angle is at most 1.0108 of a chord up to 0.5.
    """
    result = np.full((2, len(begin)), np.inf)
    for n in range(len(begin)):
        length = turn = 0.0
        for i in range(3):
            length += (goal[n, i] - begin[n, i]) ** 2
            turn += (axis1[n, i] - axis0[n, i]) ** 2
        size, length, turn = length, np.sqrt(length), 1.0108 * np.sqrt(turn)
        if not (turn <= 0.5 and bends[1, n] <= MOST_TURN * MOST_TURN):
            continue
        tip = axis = 0.0
        for tips, axes, other in ((tip_a, axis_a, 0.0), (tip_b, axis_b, 1.0)):
            u = other
            if size > 1e-12:
                u = 0.0
                for i in range(3):
                    u += (tips[n, i] - begin[n, i]) * (goal[n, i] - begin[n, i])
                u = min(max(u / size, 0.0), 1.0)
            off = leaned = 0.0
            for i in range(3):
                off += (tips[n, i] - begin[n, i] - u * (goal[n, i] - begin[n, i])) ** 2
                leaned += (axes[n, i] - axis0[n, i] - u * (axis1[n, i] - axis0[n, i])) ** 2
            tip, axis = max(tip, off), max(axis, leaned)
        tip = _GRAIN + np.sqrt(tip) + _SHARE * bends[0, n]
        axis = _GRAIN + np.sqrt(axis) + _SHARE * bends[1, n] + 0.25 * turn * turn
        if length > short:
            axis += turn * tip / length
        if axis <= 0.5 and tip < np.inf:
            result[0, n], result[1, n] = tip, 1.0108 * axis
    return result
