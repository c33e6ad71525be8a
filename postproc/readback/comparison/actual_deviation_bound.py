"""How far the tool may stray from its law between the places looked at, where the machine is not the one of the law.

The law of a block (straight tip, straight joints, arc) is that of the machine without errors, as the control
holds it. What the machine as it is adds to it, E, changes with the joints no faster than `error_rates` says,
and by the approach direction that joints were moved last. Where E is L-Lipschitz in the time of a piece of
length h, it stays within L h / 2 of the straight line between its values at both ends. Pieces are looked at
in their middle too, so h is half of them.
"""

from __future__ import annotations

import numpy as np

from postproc.control.word_arcs import PLANE_COLUMNS
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses, coordinates, signed_sweep
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

LINE, JOINTS, TIP, CIRCLE = range(4)
"""laws of a block: tip straight and axis standing; straight in joints; tip straight and rotary joints even; arc"""


@dataclass(frozen=True)
@arrays(half="N J", back="N J")
class _Travel:
    """Of N pieces and J joints: how far a joint goes in either half, at most (N, J), as speed times time; how
    much of that it may go back (N, J), 0 where it cannot turn back."""

    half: Floats
    back: Floats


def strays(motion: Motion, executed: BlockPoses, rows: Ints, times: tuple[Floats, Floats, Floats],
           kinds: Ints, tips: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
    """Bounds (tip (N,) mm, axis (N,) rad) for parts of blocks `rows` (N,) with begin, middle and end `times`
    (N,), by their laws `kinds` (N,), with the tip at `tips` (N, 3) by that law where they begin and end.

    0 on a machine that is that of the law, infinity where nothing is known.
    """
    tip, axis = np.zeros(len(rows)), np.zeros(len(rows))
    mine = np.flatnonzero(executed.off_law(motion, rows))
    if not len(mine):
        return tip, axis
    if len(mine) < len(rows):
        rows, kinds, times = rows[mine], kinds[mine], (times[0][mine], times[1][mine], times[2][mine])
        tips = tips[0][mine], tips[1][mine]
    q = [executed.joints(motion, rows, t) for t in times]
    away = np.linalg.norm(tips[1] - tips[0], axis=1)
    travel = _travel(motion, executed, rows, times[2] - times[0], kinds, q, away)
    rates = executed.error_rates(motion, rows, q[1], travel.half)
    approach = [executed.approach(motion, rows, t) for t in times]
    turned = np.maximum(np.abs(approach[1] - approach[0]), np.abs(approach[2] - approach[1]))
    # A joint that goes back by no more than that is as far from one that does not (the play operator is a contraction).
    turned = np.minimum(2.0, turned + 4.0 * travel.back / executed.gaps(motion, rows, q[1], travel.half))
    with np.errstate(invalid="ignore"):  # infinity times 0: a joint that has no error, known nowhere
        tip[mine] = 0.5 * (rates.tip * travel.half).sum(axis=1) + (rates.tip_reversal * turned).sum(axis=1)
        axis[mine] = 0.5 * (rates.axis * travel.half).sum(axis=1) + (rates.axis_reversal * turned).sum(axis=1)
    return np.nan_to_num(tip, nan=np.inf, posinf=np.inf), np.nan_to_num(axis, nan=np.inf, posinf=np.inf)


def _travel(motion: Motion, executed: BlockPoses, rows: Ints, length: Floats, kinds: Ints, q: list[Floats],
            away: Floats) -> _Travel:
    half, back = 0.5 * np.abs(q[2] - q[0]), np.zeros(q[0].shape)
    curved = np.flatnonzero((kinds == TIP) | (kinds == CIRCLE))
    if not len(curved):
        return _Travel(half, back)
    slides = np.flatnonzero(~np.array(executed.control.machine.rotary))
    path, bend = np.full(len(rows), np.inf), np.full(len(rows), np.inf)
    arcs, tips = np.flatnonzero(kinds == CIRCLE), np.flatnonzero(kinds == TIP)
    if executed.control.machine.kinematics.slides_square:
        path[arcs], bend[arcs] = _of_arcs(motion, executed, rows[arcs], length[arcs])
        path[tips], bend[tips] = _of_tips(motion, executed, rows[tips], [x[tips] for x in q], away[tips])
    block, bend = np.ix_(curved, slides), bend[curved][:, None]
    steps = np.maximum(np.abs(q[1] - q[0]), np.abs(q[2] - q[1]))[block]
    half[block] = np.minimum(0.5 * path[curved][:, None], steps + 0.25 * bend)
    back[block] = np.where(np.abs(q[2] - q[0])[block] > bend, 0.0, 0.25 * bend)
    return _Travel(half, back)


def _of_arcs(motion: Motion, executed: BlockPoses, rows: Ints, part: Floats) -> tuple[Floats, Floats]:
    """(mm that a slide may go, mm that its second derivative comes to) in a part of blocks that are arcs, seen as 0 to 1."""
    begin, end = (xyz[:, executed.control.xyz] for xyz in coordinates(motion, rows))
    path, bend = np.full(len(rows), np.inf), np.full(len(rows), np.inf)
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero(motion.plane[rows] == plane)
        if not len(k):
            continue
        centre = motion.center[rows[k]][:, (i, j)]
        first, last = begin[k][:, (i, j)] - centre, end[k][:, (i, j)] - centre
        sweep = np.abs(signed_sweep(first, last, motion.ccw[rows[k]]))
        near, far = (np.hypot(*v.T) for v in (first, last))
        radius, grows = np.maximum(near, far), np.abs(far - near)
        other = 3 - i - j
        along = np.abs(end[k][:, other] - begin[k][:, other])
        path[k] = part[k] * np.hypot(radius * sweep + grows, along)
        bend[k] = part[k] ** 2 * sweep * (radius * sweep + 2.0 * grows)
    return path, bend


def _of_tips(motion: Motion, executed: BlockPoses, rows: Ints, q: list[Floats],
             away: Floats) -> tuple[Floats, Floats]:
    """The same where the tip goes straight, `away` (N,) mm, and rotary axes turn evenly: slides make up for
    what those move the tip by."""
    turning = np.array(executed.control.machine.rotary)
    turn = np.abs(q[2] - q[0])[:, turning].sum(axis=1)
    arm = executed.arm(motion, rows, q[1]) + away
    path = away + turn * arm
    return path, 2.0 * turn * path + turn**2 * arm
