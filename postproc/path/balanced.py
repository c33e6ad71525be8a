"""Fewer blocks inside the same tolerance: their ends beside the curve, on the side away from which the blocks bend.

While rotary axes turn, a block between two points of a curve bends away from it, all to one side, by e in its middle. With
its ends moved by -e/2 it is off by e/2 at most, so that each may be longer by a root of two: fewer blocks, where the
control takes its time at each. The ends of runs, arcs, and points at which the tool only turns stay where they are.
"""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control.control import Control
from postproc.joints.joint_path import nearest_solution
from postproc.path.bound import CurveBlocks, bounds
from postproc.path.linearise import CurvePieces
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.shape import Curves

ROUNDS = 6
"""times that curves outside the tolerance are divided into more blocks"""
AIM = 1.75
"""of the tolerance, by which a block may bend at first: twice, less what its bound adds"""
SHORT = 1e-6
"""mm: where the tip goes no further the tool turns on the spot"""


def balanced(control: Control, kin: Kinematics, curves: Curves, q0: Floats, q1: Floats, movable: Bools,
             tolerance: float, axis_tolerance: float, plain: CurvePieces) -> CurvePieces:
    """Blocks q0 -> q1 (N, J) along `curves` (N), ends moved beside them where `movable` (N,); else those of `plain`.

    The deviation from the curves is bounded as of other blocks, at both ends and all between. `plain` where it does not do.
    """
    which = np.flatnonzero(movable & ~curves.is_arc & (curves.length() > SHORT))
    if control.tip_law or not len(which) or len(plain.broken):
        return plain
    own = _balanced(control, kin, curves.take(which), (q0[which], q1[which]), which[1:] == which[:-1] + 1, tolerance,
                    axis_tolerance)
    if own is None:
        return plain
    rest = ~np.isin(plain.curve, which)
    curve = np.concatenate((which[own.curve], plain.curve[rest]))
    u, q = np.concatenate((own.u, plain.u[rest])), np.concatenate((own.q, plain.q[rest]))
    order = np.lexsort((u, curve))
    worst = (max(own.worst_tip, plain.worst_tip), max(own.worst_axis, plain.worst_axis)) if rest.any() else (
        own.worst_tip, own.worst_axis)
    return CurvePieces(curve[order], u[order], q[order], own.broken, *worst) if len(curve) < len(plain.curve) else plain


def _balanced(control: Control, kin: Kinematics, curves: Curves, joints: tuple[Floats, Floats], next_to: Bools,
              tolerance: float, axis_tolerance: float) -> CurvePieces | None:
    """The same of curves that may all be moved; `next_to` (N - 1,): the next one begins where a curve ends."""
    q0, q1 = joints
    bent = _bend(control, kin, curves, q0, q1)
    if not np.isfinite(bent).all():
        return None
    joined = next_to & (q0[1:] == q1[:-1]).all(axis=1)
    parts = np.maximum(np.ceil(np.sqrt(np.linalg.norm(bent, axis=1) / (AIM * tolerance))), 1.0).astype(np.int64)
    for _ in range(ROUNDS):
        made = _pieces(kin, curves, q0, q1, bent / parts[:, None] ** 2, parts, joined)
        tip, axis = bounds(control, kin, made, tolerance, axis_tolerance)
        curve = np.repeat(np.arange(len(curves)), parts)
        bad = np.unique(curve[~((tip <= tolerance) & (axis <= axis_tolerance))])
        if not len(bad):
            return CurvePieces(curve, made.u1, made.q1, np.zeros(0, dtype=np.int64), float(tip.max()), float(axis.max()))
        parts[bad] += 1
    return None


def _bend(control: Control, kin: Kinematics, curves: Curves, q0: Floats, q1: Floats) -> Floats:
    """(N, 3) how far the middle of a block over all of each curve is beside it."""
    middle = np.full(len(curves), 0.5)
    tip, _, _ = control.between(q0, q1, middle, kin, np.zeros(len(curves), dtype=bool))
    off = tip - curves.tip_at(middle)
    along = curves.end - curves.start
    square = np.maximum((along**2).sum(axis=1), 1e-300)
    return np.asarray(off - ((off * along).sum(axis=1) / square)[:, None] * along)


def _pieces(kin: Kinematics, curves: Curves, q0: Floats, q1: Floats, bent: Floats, parts: Ints,
            joined: Bools) -> CurveBlocks:
    """The blocks of all curves in `parts` (N,), each of which bends by `bent` (N, 3)."""
    curve = np.repeat(np.arange(len(curves)), parts)
    k = np.arange(len(curve)) - np.repeat(np.cumsum(parts) - parts, parts)
    u1 = (k + 1) / parts[curve]
    ends = np.zeros_like(bent)
    size = np.linalg.norm(bent, axis=1)
    larger = np.where((size[1:] > size[:-1])[:, None], bent[1:], bent[:-1])
    ends[:-1][joined] = -0.5 * larger[joined]
    last = k + 1 == parts[curve]
    shift = np.where(last[:, None], ends[curve], -0.5 * bent[curve])
    on = curves.take(curve)
    tip, axis = on.at(u1)
    near = q0[curve] + u1[:, None] * (q1 - q0)[curve]
    q = near.copy()
    moved = np.flatnonzero((shift != 0.0).any(axis=1) | ~last)
    q[moved] = nearest_solution(kin, (tip + shift)[moved], axis[moved], near[moved])
    begin = np.concatenate([q0[:1], q[:-1]])
    fresh = k == 0
    fresh[1:] &= ~np.concatenate([[False], joined])[curve][1:]
    begin[fresh] = q0[curve[fresh]]
    return CurveBlocks(on, k / parts[curve], u1, begin, q, kin.forward(begin), kin.forward(q))
