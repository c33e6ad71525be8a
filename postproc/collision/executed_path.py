"""The path of a tool through the blocks of a program, as the control runs them, in pieces with a bound
between their ends."""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from machines.kinematics.columns import blocks as in_blocks
from postproc.collision.swept import OFF, Swept
from postproc.control.word_arcs import PLANE_COLUMNS
from postproc.readback.execution.assembly import ends, steps
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import SAMPLES, BlockPoses, arc_sweeps, coordinates
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.units import DEG

_FEW, _MOST = 4.0, 500
"""pieces of a part: where more seem to be needed, shorter parts are bounded first; where there are too many,
there is no bound"""
Parts = tuple[Ints, Floats, Floats]
"""(block, from, to) of parts of blocks, (N,) each, in order"""


def path_of(motion: Motion, executed: BlockPoses, kin: Kinematics, rows: Ints,
            reach: float) -> tuple[Swept, Ints]:
    """The path of one tool through its blocks, and those of them for which the pieces are no proof.

    Args:
        kin: with the tool
        rows: the tool's blocks
        reach: mm from the tip to the tool's farthest point
    """
    parts = _straight(motion, executed, rows)
    need = _needed(motion, executed, kin, parts, reach)
    long = need > _FEW
    if long.any():
        parts = _shorter(motion, executed, kin, parts, long)
        need = _needed(motion, executed, kin, parts, reach)
    row, t0, t1 = _cut(parts, np.clip(np.nan_to_num(need, nan=1.0), 1.0, _MOST).astype(np.int64))
    travel = Swept(*_poses(motion, executed, kin, (row, t0, t1)), row)
    reached = np.isfinite(travel.tip).all(axis=(1, 2)) & np.isfinite(travel.axis).all(axis=(1, 2))
    return travel.take(np.flatnonzero(reached)), np.unique(np.append(parts[0][~(need <= _MOST)], row[~reached]))


def _poses(motion: Motion, executed: BlockPoses, kin: Kinematics, parts: Parts) -> tuple[Floats, Floats]:
    """(tips, axes) (N, 2, 3) at both ends; where joints have several poses they are followed from part to part."""
    row, *times = parts
    if executed.before is None:
        poses = [executed.poses(motion, row, t) for t in times]
        return np.stack([tip for tip, _ in poses], axis=1), np.stack([axis for _, axis in poses], axis=1)
    q = np.stack([executed.joints(motion, row, t) for t in times], axis=1)
    found = ends(kin, q.reshape(-1, q.shape[2]), motion.start / executed.control.unit).reshape(-1, 2, 6)
    return found[:, :, :3], found[:, :, 3:]


def _cut(parts: Parts, count: Ints) -> Parts:
    """Each part in `count` (N,) equal ones."""
    row, t0, t1 = parts
    k = np.repeat(np.arange(len(row)), count)
    at = np.arange(len(k)) - np.repeat(np.cumsum(count) - count, count)
    step = ((t1 - t0) / count)[k]
    return row[k], t0[k] + at * step, np.where(at + 1 == count[k], t1[k], t0[k] + (at + 1) * step)


def _straight(motion: Motion, executed: BlockPoses, rows: Ints) -> Parts:
    """Whole blocks, or what is between the corners of a dog-leg, where each axis arrives: straight in the joints."""
    bent = executed.bent(motion, rows)
    plain, legs = rows[~bent], rows[bent]
    parts = [(plain, np.zeros(len(plain)), np.ones(len(plain)))]
    if len(legs):
        corners = executed.times(motion, legs)[len(SAMPLES):]
        edges = np.sort(np.column_stack((np.zeros(len(legs)), *corners, np.ones(len(legs)))), axis=1)
        for a, b in zip(edges.T[:-1], edges.T[1:], strict=True):
            parts.append((legs[b > a], a[b > a], b[b > a]))
    row, t0, t1 = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    order = np.lexsort((t0, row))
    return row[order], t0[order], t1[order]


def _shorter(motion: Motion, executed: BlockPoses, kin: Kinematics, parts: Parts, long: Bools) -> Parts:
    """The long ones in steps of a few degrees, over which derivatives change little."""
    row, t0, t1 = parts
    count = np.ones(len(row), dtype=np.int64)
    count[long] = steps(kin, executed.joints(motion, row[long], t0[long]),
                        executed.joints(motion, row[long], t1[long]))
    return _cut(parts, count)


def _needed(motion: Motion, executed: BlockPoses, kin: Kinematics, parts: Parts, reach: float) -> Floats:
    """(N,) pieces of a part, so that no point of the tool is off its place by more than OFF."""
    row, t0, t1 = parts
    bend = _circles(motion, executed, parts)
    for part in in_blocks(len(row)):
        bend[part] += _bends(motion, executed, kin, (row[part], t0[part], t1[part]), reach)
    return np.ceil(np.sqrt(bend / (8.0 * OFF)))


def _bends(motion: Motion, executed: BlockPoses, kin: Kinematics, parts: Parts, reach: float) -> Floats:
    """(N,) mm: bound of the second derivative of any point of the tool within `reach` of its tip, over each part.

    The tip's is that of the joints, 0 where the control keeps it straight; the pieces' great circles bend
    too, by the square of the turn.
    """
    row = parts[0]
    q0, q1 = executed.joints(motion, row, parts[1]), executed.joints(motion, row, parts[2])
    jets = kin.jets(q0, q1)
    tip, axis = (np.broadcast_to(jet.bend(), len(row)) for jet in jets)
    tips_straight = np.array([frame.law == "tcp" for frame in motion.frames])[motion.frame[row]]
    tip = np.where(tips_straight | (executed.control.base == "tcp"), 0.0, tip)
    turn = np.abs(q1 - q0)[:, executed.control.rotary].sum(axis=1)
    if kin.slides_turn_tool:
        turn = np.maximum(turn, jets[1].speed())
    return np.asarray(tip + reach * (axis + turn**2))


def _circles(motion: Motion, executed: BlockPoses, parts: Parts) -> Floats:
    """(N,) mm: what arcs add to that bound: r sweep^2, and 2 r sweep turn where the part turns under them."""
    row, share = parts[0], parts[2] - parts[1]
    sweep = np.nan_to_num(arc_sweeps(motion, executed.control))[row]
    begin, end = coordinates(motion, row)
    turn = np.abs(end - begin)[:, executed.control.rotary].sum(axis=1) * DEG
    xyz, radius = executed.control.xyz, np.zeros(len(row))
    for plane, columns in PLANE_COLUMNS.items():
        k = np.flatnonzero((motion.plane[row] == plane) & (sweep > 0.0))
        if len(k):
            radius[k] = np.linalg.norm(begin[k][:, xyz[list(columns)]] - motion.center[row[k]][:, list(columns)], axis=1)
    return np.asarray(radius * sweep * (sweep + 2.0 * turn) * share**2)
