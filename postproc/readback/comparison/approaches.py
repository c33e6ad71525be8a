"""Linking moves: which of their blocks belong to the cut that they lead to, and the safe planes of the set-up."""

from __future__ import annotations

import math

import numpy as np

from postproc.job.job import Job
from postproc.path.links import MARGINS
from postproc.readback.comparison.checks import off_line
from postproc.readback.comparison.clamps import AWAY_BY_THE_TIP
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Kind

LOWEST = 1.0
"""mm above the part: room that a set-up is offered to state; what goes lower rises first"""
_RISES = 1e-6
"""mm along the tool axis that come of reckoning, not of motion"""
_TURNED = 1e-6
"""rad below which a tool axis is that of the cut"""


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


def check_safe_planes(motion: Motion, executed: BlockPoses, job: Job, home: Floats, owner: Ints,
                      faults: Faults) -> list[Diagnostic]:
    """A warning where a linking move goes aside below the safe plane: from the distance of the set-up, else from the least
    share of its margin that is tried where travel is short. Along the tool axis it goes at any height, and where the
    retract axis is at home (J,) it is as high as it can be. Without such an axis planes bound nothing."""
    moves, space, lift = job.moves.without_pecks(), job.space, job.machine.retract_axis
    rows = np.flatnonzero(~moves.run_by(owner) & (owner <= len(moves)))
    rows = rows[rows > 0]
    if lift < 0 or space.in_plane or not len(rows):
        return []
    asked = job.setup.clearance
    about, least = (space.corners, MARGINS[-1] * asked.margin) if asked.distance is None else (space.centres, asked.distance)
    after, before = np.minimum(owner[rows], len(moves) - 1), np.maximum(owner[rows] - 1, 0)
    again = np.linalg.norm(moves.tip[after] - moves.tip[before], axis=1) <= job.options.tolerance  # unwound, taken up again
    rows, after, before = rows[~again], after[~again], before[~again]
    near = job.options.tolerance + executed.corrected_between(motion, rows)
    joints = np.concatenate([motion.start[None], motion.end])
    lines = [(moves.tip[m], moves.axis[m], ends) for m, ends in (
        (before, owner[rows] > 0), (after, owner[rows] < len(moves)))]
    aside = np.logical_or.reduce([_aside(executed.poses(motion, rows, t)[0], lines, near) for t in (0.0, 0.5, 1.0)])
    room = np.full(len(rows), np.inf)
    for t, at in ((0.0, rows), (1.0, rows + 1)):
        tip, axis = executed.poses(motion, rows, t)
        along = np.minimum(*(angle_between(axis, one) for _, one, _ in lines)) < _TURNED
        counts = along & (joints[at, lift] < home[lift] - AWAY_BY_THE_TIP)
        over = np.einsum("ni,ni->n", tip, axis) - (about @ axis.T).max(axis=0)
        room = np.where(counts, np.minimum(room, over), room)
    low = np.flatnonzero(aside & (room < least - near))
    if not len(low):
        return []
    least_room, line = float(room[low].min()), int(motion.line[rows[low[0]]])
    key, share = ("margin", MARGINS[-1]) if asked.distance is None else ("distance", 1.0)
    says = f"{least_room:.3f} mm above" if least_room > 0.0 else f"{-least_room:.3f} mm below the top of"
    lower = f", or write {key} = {math.floor(10.0 * least_room / share) / 10.0:g} under [clearance] of the set-up"
    return [faults.warning("verify.safe_plane", f"a linking move goes aside {says} the part, the safe plane is {least:g} mm "
                           "above it", 0, line, len(low),
                           "let it rise there first" + (lower if least_room >= LOWEST else ""))]


def _aside(tip: Floats, lines: list[tuple[Floats, Floats, Bools]], near: Floats) -> Bools:
    """(N,) tips that are on no line of retract or approach."""
    on = [(off_line(tip, end, axis) <= near) & there for end, axis, there in lines]
    return np.asarray(~(on[0] | on[1]))
