"""Points between the CL points, so that the control's motion stays on the reference within the tolerance, proved.

From the start of each curve the longest block is taken whose bound (`bound.py`) is inside the tolerance, then
the next: where a shorter block is never worse than a longer one, no division that the same bound allows has fewer blocks.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control.control import Control
from postproc.joints.joint_path import branch_of, nearest_solution
from postproc.path.bound import CurveBlocks, settled_bounds
from toolpaths.arrays import Bools, Floats, Ints, distinct, without_nan
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between, wrap
from toolpaths.shape import Curves
from toolpaths.shapes import arrays

_SMALLEST = 1e-9
"""of a curve: a block that short and still outside is a jump"""
_AIM, _ENOUGH = 0.95, 0.85
"""of the tolerance: what a step aims at, and what is near enough to the longest"""
_TURN = 2.0 * np.pi
_HALVINGS, _FOLLOWED = 24, 1e-6
"""of a curve, on the path to its end in a singular direction; rad to which the joints are then known"""
_UNKNOWN = -2
_TOGETHER = 20_000
"""curves that are looked at together: what is known of them meanwhile stays small"""
_NARROW = 1.05
"""a longest step that is known within this factor is known"""


@dataclass(frozen=True)
@arrays(curve="K", u="K", q="K J", broken="B")
class CurvePieces:
    """Blocks that follow curves: piece k ends at `q` (K, J), at `u` (K,) of curve `curve` (K,).

    `broken` names curves that no number of points brings inside the tolerance (a jump of the joints).
    `worst_tip` (mm) and `worst_axis` (rad) bound the deviation of all blocks anywhere between their ends.
    """

    curve: Ints
    u: Floats
    q: Floats
    broken: Ints
    worst_tip: float
    worst_axis: float


def linearise(control: Control, kin: Kinematics, curves: Curves, q0: Floats, q1: Floats, keep: Bools,
              tolerance: float, axis_tolerance: float) -> CurvePieces:
    """Split the blocks q0 -> q1 (N, J) that follow `curves` (N) until the deviation is inside mm and rad tolerances.

    `keep` (N,) marks curves whose block follows them by itself (kept arcs).
    """
    parts, worst = list[CurvePieces](), np.zeros(2)
    for first in range(0, max(len(curves), 1), _TOGETHER):
        part = slice(first, first + _TOGETHER)
        found = _linearised(control, kin, curves.take(part), q0[part], q1[part], keep[part], tolerance, axis_tolerance,
                            worst)
        worst = np.maximum(worst, [found.worst_tip, found.worst_axis])
        parts.append(found if not first else replace(found, curve=found.curve + first, broken=found.broken + first))
    if len(parts) == 1:
        return parts[0]
    curve, u, q, broken = (np.concatenate([getattr(p, name) for p in parts]) for name in ("curve", "u", "q", "broken"))
    return CurvePieces(curve, u, q, broken, max(p.worst_tip for p in parts), max(p.worst_axis for p in parts))


def _linearised(control: Control, kin: Kinematics, curves: Curves, q0: Floats, q1: Floats, keep: Bools,
                tolerance: float, axis_tolerance: float, worst: Floats) -> CurvePieces:
    """The same of curves that are looked at together; `worst` (2,): bounds that are known of others."""
    exact = keep | _straight_already(control, kin, curves, q0, q1)
    if exact.all():
        return CurvePieces(np.arange(len(exact)), np.ones(len(exact)), q1,
                           np.zeros(0, dtype=np.int64), 0.0, 0.0)
    front = _Front(control, kin, curves, q0, q1, np.flatnonzero(~exact), tolerance, axis_tolerance)
    front.worst = worst
    while len(front.index):
        front.advance()
    curve = np.concatenate([np.flatnonzero(exact), *front.curve])
    u, q = np.concatenate([np.ones(int(exact.sum())), *front.u]), np.concatenate([q1[exact], *front.q])
    order = np.lexsort((u, curve))
    broken = distinct(np.concatenate([np.zeros(0, dtype=np.int64), *front.broken]))
    return CurvePieces(curve[order], u[order], q[order], broken, float(front.worst[0]), float(front.worst[1]))


def _straight_already(control: Control, kin: Kinematics, curves: Curves, q0: Floats, q1: Floats) -> Bools:
    """Lines on which the tool axis stands still and the tip follows the slides, or the words."""
    holding = np.array(kin.rotary) | np.array(kin.turns_tool)
    fixed = (q0[:, holding] == q1[:, holding]).all(axis=1) & ~curves.is_arc
    if control.tip_law or kin.straight_slides:
        straight: Bools = fixed & (angle_between(curves.axis0, curves.axis1) < 1e-6)
        return straight
    return np.zeros(len(curves), dtype=bool)


class _Front:
    """Where each unfinished curve stands, and the blocks done so far: one step of all curves at a time.

    Helices of many turns are followed from every turn on, so that their steps are not one after the other.
    `at`, `joints`, `pose`: where the next block begins; `until`, `goal`: where the curve, or this turn of it, ends;
    `step`: its length to be tried; `held`, `failed`: the longest step that is inside the tolerance and the shortest that is
    not, of the block being looked for; `even`: half of what is left.
    """

    def __init__(self, control: Control, kin: Kinematics, curves: Curves, q0: Floats, q1: Floats, index: Ints,
                 tolerance: float, axis_tolerance: float) -> None:
        self.control, self.kin, self.curves = control, kin, curves
        self.tolerance, self.axis_tolerance = tolerance, axis_tolerance
        self.index, self.at, self.until = _turns(kin, curves, q0, q1, index)
        index = self.index
        self.joints, self.goal = self._in_between(self.at, q0, q0), self._in_between(self.until, q1, q0)
        self.pose = kin.forward(self.joints)
        turn = np.where(curves.is_arc, curves.sweep, 0.0)[index]
        self.longest = np.minimum(0.5 * np.pi / np.maximum(turn, 1e-9), 1.0)
        self.step = self.longest.copy()
        self.held, self.failed = np.zeros(len(index)), np.full(len(index), np.inf)
        self.branch = np.full(len(index), _UNKNOWN)
        self.even = np.zeros(len(index), dtype=np.bool_)
        self.curve: list[Ints] = []
        self.u: list[Floats] = []
        self.q: list[Floats] = []
        self.broken: list[Ints] = []
        self.worst = np.zeros(2)

    def advance(self) -> None:
        """Try the steps, take those that are long enough, forget finished and broken curves."""
        u1, q1, pose = self._tried()
        stretch = CurveBlocks(self.curves.take(self.index), self.at, u1, self.joints, q1, self.pose, pose)
        ends = (u1 == self.until) & ~stretch.curves.is_arc
        tip, axis = settled_bounds(self.control, self.kin, stretch, (self.tolerance, self.axis_tolerance), ends, self.worst)
        ratio = np.maximum(tip / self.tolerance, axis / self.axis_tolerance)
        good = ratio <= 1.0
        full = (u1 == self.until) | (self.step >= self.longest)
        taken = good & (full | self.even | (ratio >= _ENOUGH) | (self.failed <= _NARROW * self.step))
        # What is left after this block would be shorter than it: both are made alike, so that no block is very short.
        halves = taken & ~self.even & (u1 < self.until) & (self.until - u1 < self.step)
        taken &= ~halves
        self._record(taken, u1, q1, tip, axis)
        gone = ~good & (self.step <= _SMALLEST)
        self._give_up(gone)
        self._next(taken, good, ratio, u1, q1, pose)
        self.step = np.where(halves, 0.5 * (self.until - self.at), self.step)
        self.even = halves
        self._keep(~(gone | (taken & (u1 == self.until))))

    def _in_between(self, u: Floats, ends: Floats, near: Floats) -> Floats:
        """Joints (K, J) at `u` (K,) of the curves: `ends` at their own ends, nearest to `near` between."""
        q = ends[self.index]
        inner = np.flatnonzero((u > 0.0) & (u < 1.0))
        if len(inner):
            q[inner] = nearest_solution(self.kin, *self.curves.take(self.index[inner]).at(u[inner]),
                                        near[self.index[inner]])
        return q

    def _tried(self) -> tuple[Floats, Floats, tuple[Floats, Floats]]:
        """(u, joints, pose) at the end of the steps."""
        u1 = np.where(self.at + self.step >= self.until - _SMALLEST, self.until, self.at + self.step)
        q1 = self.goal.copy()
        inner = np.flatnonzero(u1 < self.until)
        if len(inner):
            tip, axis = self.curves.take(self.index[inner]).at(u1[inner])
            share = (u1 - self.at)[inner] / (self.until - self.at)[inner]
            near = self.joints[inner] + share[:, None] * (q1[inner] - self.joints[inner])
            q1[inner] = nearest_solution(self.kin, tip, axis, near, self._branches(inner))
        return u1, q1, self.kin.forward(q1)

    def _branches(self, rows: Ints) -> Ints:
        """(N,) the branch that both ends of a curve are on, -1 where they are on different ones or on none.

        Near a singular direction another branch may come within the tolerance: it does not lead to the curve's end.
        """
        new = rows[self.branch[rows] == _UNKNOWN]
        if len(new) and self.kin.branches > 1:
            curves = self.curves.take(self.index[new])
            first = branch_of(self.kin, *curves.at(self.at[new]), self.joints[new])
            last = branch_of(self.kin, *curves.at(self.until[new]), self.goal[new])
            both = np.where(first >= 0, first, last)
            self.branch[new] = np.where((last >= 0) & (both != last), -1, both)
        elif len(new):
            self.branch[new] = 0
        return self.branch[rows]

    def _record(self, taken: Bools, u1: Floats, q1: Floats, tip: Floats, axis: Floats) -> None:
        if taken.any():
            self.curve.append(self.index[taken])
            self.u.append(u1[taken])
            self.q.append(q1[taken])
            self.worst = np.maximum(self.worst, [tip[taken].max(), axis[taken].max()])

    def _give_up(self, gone: Bools) -> None:
        """Curves that jump end where they should, so that every curve has its blocks."""
        self.broken.append(self.index[gone])
        self.curve.append(self.index[gone])
        self.u.append(self.until[gone])
        self.q.append(self.goal[gone])

    def _next(self, taken: Bools, good: Bools, ratio: Floats, u1: Floats, q1: Floats,
              pose: tuple[Floats, Floats]) -> None:
        """Where the next blocks begin, and what they try: deviations go with the square of the length."""
        held = np.where(good, self.step, self.held)
        failed = np.where(good, self.failed, self.step)
        better = self.step * np.clip(np.sqrt(_AIM / np.clip(ratio, 1e-6, 1e6)), 0.1, 4.0)
        between = np.where(held > 0.0, np.sqrt(np.maximum(held, 1e-300) * failed), 0.5 * failed)
        inside = (better > held) & (better < failed)
        narrowed = np.where(held > 0.0, between, np.minimum(better, between))
        step = np.where(inside | ~np.isfinite(failed), better, narrowed)
        self.step = np.clip(step, 0.5 * _SMALLEST, self.longest)
        self.held, self.failed = np.where(taken, 0.0, held), np.where(taken, np.inf, failed)
        self.at = np.where(taken, u1, self.at)
        self.joints = np.where(taken[:, None], q1, self.joints)
        self.pose = (np.where(taken[:, None], pose[0], self.pose[0]),
                     np.where(taken[:, None], pose[1], self.pose[1]))

    def _keep(self, rows: Bools) -> None:
        for name in ("index", "at", "until", "joints", "goal", "longest", "step", "held", "failed",
                     "branch", "even"):
            setattr(self, name, getattr(self, name)[rows])
        self.pose = (self.pose[0][rows], self.pose[1][rows])


def _turns(kin: Kinematics, curves: Curves, q0: Floats, q1: Floats,
           index: Ints) -> tuple[Ints, Floats, Floats]:
    """(curve (K,), from u (K,), to u (K,)): the curves of `index`, those that wind more than once at standing
    rotary joints and tool axis in as many parts as turns."""
    rotary = np.array(kin.rotary)
    stands = (q0[index][:, rotary] == q1[index][:, rotary]).all(axis=1)
    stands &= (curves.axis0[index] == curves.axis1[index]).all(axis=1)
    turns = np.where(curves.is_arc, curves.sweep, 0.0)[index] / _TURN
    parts = np.where(stands & (turns > 1.5), np.ceil(turns), 1.0).astype(np.int64)
    which = np.repeat(np.arange(len(index)), parts)
    part = np.arange(len(which)) - np.repeat(np.cumsum(parts) - parts, parts)
    return index[which], part / parts[which], (part + 1) / parts[which]


def family_turns(kin: Kinematics, curves: Curves, q0: Floats, q1: Floats) -> tuple[Ints, Floats]:
    """Curves that begin where the tool lies along a rotary axis, and the joints they must begin with.

    There the axis may turn freely: it has to take the value that the rest of the curve needs before the tool leaves
    the direction. Returns (indices (K,), joints (K, J)); the tool stays where it is in that turn.
    """
    rotary = np.array(kin.rotary)
    if not rotary.any():
        return np.zeros(0, dtype=np.int64), np.zeros((0, kin.joints))
    turns = np.abs(wrap(q1[:, rotary] - q0[:, rotary])).max(axis=1, initial=0.0) > 1e-9
    rows = np.flatnonzero(turns & kin.singular(np.nan_to_num(q0)))
    if not len(rows):
        return rows, np.zeros((0, kin.joints))
    begun = nearest_solution(kin, curves.start[rows], curves.axis0[rows], q1[rows])
    limit = _limit(kin, curves.take(rows), q1[rows], 0.0)
    begun = np.where(_apart(kin, limit, begun)[:, None], limit, begun)
    needed = np.abs(wrap(begun[:, rotary] - q0[rows][:, rotary])).max(axis=1) > 1e-9
    turned = begun[needed]
    turned[:, rotary] = q1[rows[needed]][:, rotary] + wrap(turned[:, rotary] - q1[rows[needed]][:, rotary])
    return rows[needed], turned


def approached(kin: Kinematics, curves: Curves, q0: Floats, q1: Floats) -> tuple[Ints, Floats]:
    """(curves (K,), joints (K, J)): those of N curves from q0 to q1 (N, J) that end where the tool lies along
    a rotary axis, with that axis as the curve needs it, where it is another one than in q1. With axes at
    right angles it has the value from before, with nutating ones it has not."""
    rows = np.zeros(0, dtype=np.int64)
    if any(kin.rotary):
        rows = np.flatnonzero(kin.singular(without_nan(q1)))
        rows = rows[~kin.singular(without_nan(q0[rows]))]
    if not len(rows):
        return rows, q1[:0]
    limit = _limit(kin, curves.take(rows), q0[rows], 1.0)
    off = _apart(kin, limit, q1[rows])
    return rows[off], limit[off]


def _limit(kin: Kinematics, curves: Curves, q: Floats, end: float) -> Floats:
    """Joints (K, J) at u = `end` (0 or 1) of curves (K), followed there from joints q (K, J) at their other ends."""
    for share in 0.5 ** np.arange(1, _HALVINGS):
        q = nearest_solution(kin, *curves.at(np.full(len(curves), abs(end - share))), q)
    return nearest_solution(kin, *curves.at(np.full(len(curves), end)), q)


def _apart(kin: Kinematics, a: Floats, b: Floats) -> Bools:
    """(K,) rotary joints that differ by more than following them rounds; NaN is no difference."""
    rotary = np.array(kin.rotary)
    apart: Bools = np.abs(wrap(a[:, rotary] - b[:, rotary])).max(axis=1, initial=0.0) > _FOLLOWED
    return apart
