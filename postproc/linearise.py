"""Points between the CL points, so that the control's motion stays on the reference within the tolerance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control import Control
from postproc.joint_path import nearest_solution, wrap
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves

_SAMPLES = (0.25, 0.5, 0.75)
_ROUNDS = 40
_MOST_PIECES = 16
_SMALLEST = 1e-9


@dataclass(frozen=True)
class Pieces:
    """Blocks that follow curves: piece k ends at `q` (K, J), at `u` (K,) of curve `curve` (K,).

    `broken` names curves that no number of points brings inside the tolerance (a jump of the joints).
    `worst_tip` (mm) and `worst_axis` (rad) are the largest deviations seen at the samples between points.
    """

    curve: Ints
    u: Floats
    q: Floats
    broken: Ints
    worst_tip: float
    worst_axis: float


def linearise(control: Control, kin: Kinematics, curves: Curves, q0: Floats, q1: Floats, keep: Bools,
              tolerance: float, axis_tolerance: float) -> Pieces:
    """Split the blocks q0 -> q1 (N, J) that follow `curves` (N) until the deviation is inside mm and rad tolerances.

    `keep` (N,) marks curves whose block follows them by itself (kept arcs).
    """
    exact = keep | _straight_already(control, kin, curves, q0, q1)
    done_curve, done_u, done_q = [np.flatnonzero(exact)], [np.ones(int(exact.sum()))], [q1[exact]]
    index = np.flatnonzero(~exact)
    index, u0, u1, a, b = _quarters(kin, curves, index, q0[index], q1[index])
    worst, broken = np.zeros(2), [np.zeros(0, dtype=np.int64)]
    for _ in range(_ROUNDS):
        if not len(index):
            break
        tip_off, axis_off = _deviation(control, kin, curves.take(index), a, b, u0, u1)
        ratio = np.maximum(tip_off / tolerance, axis_off / axis_tolerance)
        good = ratio <= 1.0
        if good.any():
            worst = np.maximum(worst, [tip_off[good].max(), axis_off[good].max()])
        small = ~good & (u1 - u0 <= _SMALLEST)
        small[~good] |= _end_off(kin, curves.take(index[~good]), b[~good], u1[~good]) > tolerance
        broken.append(index[small])
        bad = ~good & ~small
        done_curve.append(index[~bad])
        done_u.append(u1[~bad])
        done_q.append(b[~bad])
        index, u0, u1, a, b = _split(kin, curves, index[bad], u0[bad], u1[bad], a[bad], b[bad], ratio[bad])
    curve, u, q = np.concatenate(done_curve), np.concatenate(done_u), np.concatenate(done_q)
    order = np.lexsort((u, curve))
    never = np.unique(np.concatenate([*broken, index]))
    return Pieces(curve[order], u[order], q[order], never, float(worst[0]), float(worst[1]))


def _straight_already(control: Control, kin: Kinematics, curves: Curves, q0: Floats, q1: Floats) -> Bools:
    """Lines at fixed rotary joints on machines where the tip then follows the slides."""
    rotary = np.array(kin.rotary)
    fixed = (q0[:, rotary] == q1[:, rotary]).all(axis=1) & ~curves.is_arc
    if control.tip_law or kin.slides_affine:
        straight: Bools = fixed & (angle_between(curves.axis0, curves.axis1) < 1e-6)
        return straight
    return np.zeros(len(curves), dtype=bool)


def _deviation(control: Control, kin: Kinematics, curves: Curves, a: Floats, b: Floats, u0: Floats,
               u1: Floats) -> tuple[Floats, Floats]:
    """Largest (tip mm, axis rad) deviation (N,) of the blocks a -> b from their stretch u0..u1, at the samples."""
    tip_off, axis_off = np.zeros(len(curves)), np.zeros(len(curves))
    for t in _SAMPLES:
        tip, axis, _ = control.between(a, b, np.full(len(a), t), kin)
        d, e, _ = curves.deviation(tip, axis, u0 + t * (u1 - u0))
        tip_off = np.fmax(tip_off, np.nan_to_num(d, nan=np.inf))
        axis_off = np.fmax(axis_off, np.nan_to_num(e, nan=np.inf))
    return tip_off, axis_off


def _end_off(kin: Kinematics, curves: Curves, q: Floats, u: Floats) -> Floats:
    """How far (N,) mm the machine's pose at joints q (N, J) is from point u of the curves: no cutting mends that."""
    tip, _ = kin.forward(q)
    return np.asarray(np.nan_to_num(np.linalg.norm(tip - curves.at(u)[0], axis=1), nan=np.inf))


Stretches = tuple[Ints, Floats, Floats, Floats, Floats]
"""curve, u at both ends, joints at both ends"""


def _quarters(kin: Kinematics, curves: Curves, index: Ints, a: Floats, b: Floats) -> Stretches:
    """The whole curves, arcs cut into quarter turns: of a longer piece the chord says nothing."""
    parts = np.where(curves.is_arc[index], np.ceil(curves.sweep[index] / (0.5 * np.pi)), 1).astype(np.int64)
    return _cut(kin, curves, index, np.zeros(len(index)), np.ones(len(index)), a, b, np.maximum(parts, 1))


def _split(kin: Kinematics, curves: Curves, index: Ints, u0: Floats, u1: Floats, a: Floats, b: Floats,
           ratio: Floats) -> Stretches:
    """The stretches cut into equal parts, as many as a deviation that falls with the square of the length needs."""
    finite = np.where(np.isfinite(ratio), ratio, _MOST_PIECES**2)
    parts = np.clip(np.ceil(np.sqrt(finite)), 2, _MOST_PIECES).astype(np.int64)
    return _cut(kin, curves, index, u0, u1, a, b, parts)


def _cut(kin: Kinematics, curves: Curves, index: Ints, u0: Floats, u1: Floats, a: Floats, b: Floats,
         parts: Ints) -> Stretches:
    """Each stretch in that many equal parts."""
    piece = np.repeat(np.arange(len(index)), parts)
    k = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
    share = (k + 1) / parts[piece]
    end_u = np.where(k + 1 == parts[piece], u1[piece], u0[piece] + share * (u1 - u0)[piece])
    near = a[piece] + share[:, None] * (b - a)[piece]
    inner = k + 1 < parts[piece]
    q = b[piece].copy()
    if inner.any():
        tip, axis = curves.take(index[piece][inner]).at(end_u[inner])
        q[inner] = nearest_solution(kin, tip, axis, near[inner])
    begin_u = np.where(k == 0, u0[piece], np.roll(end_u, 1))
    begin_q = np.where((k == 0)[:, None], a[piece], np.roll(q, 1, axis=0))
    return index[piece], begin_u, end_u, begin_q, q


def family_turns(kin: Kinematics, curves: Curves, q0: Floats, q1: Floats) -> tuple[Ints, Floats]:
    """Curves that begin where the tool lies along a rotary axis, and the joints they must begin with.

    There the axis may turn freely: it has to take the value that the rest of the curve needs before the tool leaves
    the direction. Returns (indices (K,), joints (K, J)); the tool stays where it is in that turn.
    """
    rotary = np.array(kin.rotary)
    turns = np.abs(wrap(q1[:, rotary] - q0[:, rotary])).max(axis=1, initial=0.0) > 1e-9
    rows = np.flatnonzero(turns & kin.singular(np.nan_to_num(q0)))
    if not len(rows):
        return rows, np.zeros((0, kin.joints))
    begun = nearest_solution(kin, curves.start[rows], curves.axis0[rows], q1[rows])
    needed = np.abs(wrap(begun[:, rotary] - q0[rows][:, rotary])).max(axis=1) > 1e-9
    turned = begun[needed]
    turned[:, rotary] = q1[rows[needed]][:, rotary] + wrap(turned[:, rotary] - q1[rows[needed]][:, rotary])
    return rows[needed], turned
