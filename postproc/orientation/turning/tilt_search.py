"""The field of a run that takes the least time: axis and feed chosen together, inside all limits.

Coefficients c = cone v/sqrt(1 + |v|^2) are inside the cone whatever v is; the other limits are penalties. The slope of the
time by the joints goes back to v by the chain rule, the joints' own slopes by differences. A quasi-Newton method with
limited memory (Liu and Nocedal, Mathematical Programming 45 (1989)) takes it from there. What it finds is drawn back towards
the own axes until nothing is outside.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.feedrate.limits import JointLimits
from postproc.joints.joint_path import nearest_solution
from postproc.orientation.turning.block_time import block_time
from postproc.orientation.turning.cutting_runs import CuttingRun
from postproc.orientation.turning.planned_time import PlannedTime
from postproc.orientation.turning.tilt_limits import TiltLimits
from postproc.orientation.turning.tilted_axes import TiltBasis, turned_axes
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

TimeMeasure = Literal["planned", "blocks"]
"""what is made small: the planned time, or that of blocks that each begin and end nearly at rest"""
STEPS = 40
"""of the quasi-Newton method at most"""
PARTS, FINEST, COARSEST = 12, 2.0, 8.0
"""knots of the field: so many parts of a run, of so many mm"""
NUDGE = 1e-5
"""rad, by which joints are differenced"""
LEAST = 1e-4
"""weight of the mean square of the field over the cone: what gains nothing turns nothing"""
DRAWN = 12
"""halvings of the interval in which a field is drawn back into its limits"""
_OUT = 10.0


class CutPoses(NamedTuple):
    """Tips and own axes (N, 3), their joints (N, J), the basis of the field there (N, C), normals of the surface (N, 3)."""

    tip: Floats
    axis: Floats
    q: Floats
    basis: csr_matrix
    normal: Floats


class TurnedPoses(NamedTuple):
    """Turned axes (N, 3) and their joints (N, J)."""

    axis: Floats
    q: Floats


@dataclass(frozen=True)
@arrays(field="C 3")
class TiltField:
    """Coefficients (C, 3) of the field of a run, rad, in the table frame; all 0 for the own axes."""

    run: CuttingRun
    basis: TiltBasis
    field: Floats

    def at(self, s: Floats) -> Floats:
        """(N, 3) the field at s (N,)."""
        return np.asarray(self.basis.at(s) @ self.field)

    @property
    def axes(self) -> Floats:
        """(N, 3) axes at the poses of the run, as its machine can take them."""
        return self.turned(self.run.axis, self.at(self.run.s))

    def turned(self, axis: Floats, field: Floats) -> Floats:
        """(N, 3) axes turned by the field (N, 3), where it turns any."""
        if not self.field.any():
            return axis
        return self.run.whole.kin.nearest_axis(turned_axes(axis, field))


class TiltSearch:
    """Of one run."""

    def __init__(self, run: CuttingRun, limits: TiltLimits, most: JointLimits) -> None:
        self.run, self.limits, self.most = run, limits, most
        self.basis = TiltBasis.over(run.length, float(np.clip(run.length / PARTS, FINEST, COARSEST)))
        self._kin: Kinematics = run.whole.kin
        at = [self.basis.at(one.s) for one in run.stretches]
        self._sites = [CutPoses(one.tip, one.axis, one.q, b, run.normal_at(one.s))
                       for one, b in zip(run.stretches, at, strict=True)]

    @cached_property
    def _rows(self) -> CutPoses:
        """The poses of the run."""
        run = self.run
        s, q = (np.concatenate([getattr(one, name) for one in run.stretches]) for name in ("s", "q"))
        near = np.stack([np.interp(run.s, s, column) for column in q.T], axis=1)
        axis = self._kin.nearest_axis(run.axis)
        return CutPoses(run.tip, axis, nearest_solution(self._kin, run.tip, axis, near), self.basis.at(run.s),
                        run.normal_at(run.s))

    @cached_property
    def _fed(self) -> Floats:
        """(N - 1,) s of the cuts at the programmed feed."""
        middle = 0.5 * (self.run.s[1:] + self.run.s[:-1])
        feed = np.empty(len(middle))
        for one in self.run.stretches:
            inside = (middle >= one.s[0]) & (middle <= one.s[-1])
            feed[inside] = one.feed(middle[inside])
        return np.asarray(np.diff(self.run.s) / feed)

    @cached_property
    def _plans(self) -> list[PlannedTime]:
        return [PlannedTime(one, self.most) for one in self.run.stretches]

    def kept(self) -> TiltField:
        """The own axes."""
        return TiltField(self.run, self.basis, np.zeros((self.basis.count, 3)))

    def seconds(self, measure: TimeMeasure, made: TiltField) -> float:
        """The time of a field; inf where the machine has no joints for it."""
        posed = [self._posed(at, made.field) for at in self._measured(measure)]
        if not all(np.isfinite(one.q).all() for one in posed):
            return np.inf
        return self._timed(measure, posed)[0]

    def joints(self, made: TiltField) -> Floats:
        """(M, J) joints at all sites."""
        return np.concatenate([self._posed(at, made.field).q for at in self._sites])

    def found(self, measure: TimeMeasure, steps: int = STEPS) -> TiltField:
        """The field of least time that the search comes to, inside all limits; the own axes where none is faster."""
        from scipy.optimize import minimize

        before = self.seconds(measure, self.kept())
        if not np.isfinite(before) or before <= 0.0:
            return self.kept()
        answer = minimize(self._merit(measure, before), np.zeros(self.basis.count * 3), jac=True, method="L-BFGS-B",
                          options={"maxiter": steps, "maxfun": 2 * steps, "ftol": 1e-6, "gtol": 1e-7, "maxcor": 12})
        made = self._inside(self._field(answer.x)[0])
        return made if self.seconds(measure, made) < before else self.kept()

    def _merit(self, measure: TimeMeasure, before: float) -> Callable[[Floats], tuple[float, Floats]]:
        """The time over `before` with all penalties, and its slope, by v (3 C,)."""
        def merit(v: Floats) -> tuple[float, Floats]:
            field, back = self._field(v)
            posed = [self._posed(at, field) for at in self._measured(measure)]
            if not all(np.isfinite(one.q).all() for one in posed):
                return _OUT, np.zeros_like(v)
            seconds, slopes = self._timed(measure, posed)
            total, slope = seconds / before, np.zeros_like(field)
            for at, one, by_q in zip(self._measured(measure), posed, slopes, strict=True):
                penalty, more = self.limits.penalty_of_joints(one.q)
                total += penalty
                slope += self._by_field(at, field, one, by_q / before + more)
            penalty, more = self._axes_penalty(field)
            total, slope = total + penalty, slope + more
            share = LEAST / (self.run.cone**2 * len(field))
            total, slope = total + share * float((field**2).sum()), slope + 2.0 * share * field
            return total, back(slope)
        return merit

    def _axes_penalty(self, field: Floats) -> tuple[float, Floats]:
        """The penalty of the axes at the poses, and its slope by the coefficients (C, 3)."""
        axis = self._posed_axes(self._rows, field)
        penalty, by_axis = self.limits.penalty_of_axes(axis)
        slope = np.zeros_like(field)
        for k, nudge in enumerate(NUDGE * np.eye(3) if penalty > 0.0 else ()):
            moved = self._posed_axes(self._rows, field + nudge) - axis
            slope[:, k] = self._rows.basis.T @ (np.einsum("ni,ni->n", by_axis, moved) / NUDGE)
        return penalty, slope

    def _measured(self, measure: TimeMeasure) -> list[CutPoses]:
        return self._sites if measure == "planned" else [self._rows]

    def _timed(self, measure: TimeMeasure, posed: list[TurnedPoses]) -> tuple[float, list[Floats]]:
        """Seconds, and their slopes by the joints."""
        if measure == "blocks":
            seconds, slope = block_time(posed[0].q, self.most, self._fed)
            return seconds, [slope]
        found = [plan.seconds(one.q) for plan, one in zip(self._plans, posed, strict=True)]
        return float(sum(seconds for seconds, _ in found)), [slope for _, slope in found]

    def _field(self, v: Floats) -> tuple[Floats, Callable[[Floats], Floats]]:
        """Coefficients (C, 3) of v (3 C,), and how a slope by them (C, 3) becomes one by v."""
        rows = v.reshape(-1, 3)
        size = np.sqrt(1.0 + (rows**2).sum(axis=1, keepdims=True))

        def back(slope: Floats) -> Floats:
            inward = (slope * rows).sum(axis=1, keepdims=True) * rows / size**3
            return np.asarray(self.run.cone * (slope / size - inward)).ravel()
        return np.asarray(self.run.cone * rows / size), back

    def _posed_axes(self, at: CutPoses, field: Floats) -> Floats:
        return self._kin.nearest_axis(turned_axes(at.axis, np.asarray(at.basis @ field)))

    def _posed(self, at: CutPoses, field: Floats) -> TurnedPoses:
        axis = self._posed_axes(at, field)
        tip = self.run.kept(at.tip, at.axis, axis, at.normal)
        return TurnedPoses(axis, nearest_solution(self._kin, tip, axis, at.q))

    def _by_field(self, at: CutPoses, field: Floats, here: TurnedPoses, slope: Floats) -> Floats:
        """(C, 3) slope by the coefficients of what has the slope (N, J) by the joints."""
        result = np.empty_like(field)
        for k, nudge in enumerate(NUDGE * np.eye(3)):
            moved = (self._posed(at, field + nudge).q - here.q) / NUDGE
            result[:, k] = at.basis.T @ np.einsum("nj,nj->n", slope, np.nan_to_num(moved))
        return result

    def _inside(self, field: Floats) -> TiltField:
        """The field drawn back towards the own axes until no limit is broken."""
        low, high = 0.0, 1.0
        for turn in range(DRAWN):
            share = high if turn == 0 else 0.5 * (low + high)
            if self._broken(share * field):
                high = share
            else:
                low = share
            if low == 1.0:
                break
        return TiltField(self.run, self.basis, low * field)

    def _broken(self, field: Floats) -> bool:
        q = np.concatenate([self._posed(at, field).q for at in self._sites])
        return self.limits.broken(self._posed_axes(self._rows, field), q)
