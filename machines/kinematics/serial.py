"""Serial machines: three linear and up to two rotary axes in any order, on the part's or the tool's side.

The machine is one chain from the workpiece to the tool in the order of its ISO 10791-6 code. Every axis moves what is on its
tool side relative to what is on its workpiece side in the positive sense of ISO 841, so that primed axes (which carry the
part) and unprimed ones obey one formula. With the motion M_i of axis i (a shift along its direction, or a turn about the
line through its point, both as they stand at q = 0)

    tip = M_1(q_1) M_2(q_2) ... M_J(q_J) tip_0,      axis = R_1 R_2 a_0 (turns only),

the product of exponentials (Brockett 1984; Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation, 1994,
equation 3.4), seen from the part. The gauge point is at the machine origin at q = 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from machines.kinematics import columns
from machines.kinematics.base import ErrorForm, ErrorForms, Kinematics, as_points
from machines.kinematics.chain import Joint, unit_vector
from machines.kinematics.chain_loop import ChainLoop, pays
from machines.kinematics.columns import Columns
from machines.kinematics.frames import reference_x, spin_about
from machines.kinematics.spherical import angle, azimuth, basis, meet, perpendicular
from machines.kinematics.taylor import ZERO, TaylorAngle, TaylorVector
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.rotations import angle_between, cross, dot, lengths, unit, wrap
from toolpaths.shapes import arrays

ROUND_OFF = 1e-12
"""rad: directions nearer than this are the same (reach, singular direction)"""
SQUARE = 1e-12
"""of the cosine between slides"""
DEPENDENT = 1e-9
"""least determinant of the three linear directions; below it they do not span space"""
Turning = dict[str, tuple[Floats, Floats]]
"""cosine and sine (N,) of each rotary joint by its letter"""


@dataclass(frozen=True, eq=False)
@arrays(tool_axis="3")
class Serial(Kinematics):
    """Three linear axes and up to two rotary ones.

    Attributes:
        chain: joints from the workpiece to the tool
        axis_names: order of q: linear axes by letter from X, then rotary axes by letter from A
        tool_axis: (3,) from the tip to the spindle at q = 0

    Branches: two for two rotary axes, first the one whose rotary axis nearest the tool stands at the greater angle from
    where it brings the tool nearest to the other rotary axis (a trunnion A or B: first positive, then negative). One for
    fewer: a single angle takes the tool to a given direction, and the slides follow by a linear system.
    """

    chain: tuple[Joint, ...] = field()
    axis_names: tuple[str, ...]
    tool_axis: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    tool_length: float = 0.0
    rotary: tuple[bool, ...] = field(init=False)
    branches: int = field(init=False)
    straight_slides = True
    jets_proved = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "tool_axis", unit_vector(self.tool_axis))
        kind = {joint.name: joint.rotary for joint in self.chain}
        object.__setattr__(self, "rotary", tuple(kind[name] for name in self.axis_names))
        object.__setattr__(self, "branches", 2 if len(self._turns) == 2 else 1)

    @cached_property
    def _turns(self) -> list[Joint]:
        return [joint for joint in self.chain if joint.rotary]

    @property
    def turns_tool(self) -> tuple[bool, ...]:
        """Rotary joints."""
        return self.rotary

    @property
    def slides_square(self) -> bool:  # type: ignore[override]  # nothing assigns it
        """See the base class."""
        a = np.stack([joint.direction for joint in self._slides])
        return self._loop.slides_together and bool(np.abs(a @ a.T - np.eye(len(a))).max() < SQUARE)

    @cached_property
    def _slides(self) -> list[Joint]:
        return [joint for joint in self.chain if not joint.rotary]

    @cached_property
    def _from_slides(self) -> Floats:
        """(3, 3): slides per displacement of the tip, with no rotary axis between them; NaN where they depend."""
        directions = np.stack([joint.direction for joint in self._slides], axis=1)
        if abs(np.linalg.det(directions)) < DEPENDENT:
            return np.full((3, 3), np.nan)
        return np.asarray(np.linalg.inv(directions)) + 0.0

    def made_with_tool(self, length: float) -> Self:
        """The same machine at the tip: tip = gauge point - length * axis."""
        return replace(self, tool_length=float(length))

    # ---- forward -------------------------------------------------------------------------------------------

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip (N, 3), axis (N, 3), spin (N,)) of joints q (N, J); there is one assembly, so `near` is not used."""
        tip, axis, side = self._placed(as_points(q, self.joints, "q"), self._tool_frame())
        return tip, axis, spin_about(axis, side)

    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip (N, 3), axis (N, 3)) of joints q (N, J)."""
        q = as_points(q, self.joints, "q")
        tip, axis = self._loop.poses(q, self._ends) if pays(len(q)) else self._placed(q, [self.tool_axis])
        return tip, axis

    @cached_property
    def _ends(self) -> Floats:
        return np.array([-self.tool_length * self.tool_axis, self.tool_axis])

    def _tool_frame(self) -> list[Floats]:
        return [self.tool_axis, reference_x(self.tool_axis[None])[0]]

    def _placed(self, q: Floats, carried: Sequence[Floats]) -> list[Floats]:
        """The tip and the vectors `carried` (each (3,)) by the tool, moved by every axis in turn, each (N, 3)."""
        if pays(len(q)):
            return list(self._loop.poses(q, np.array([-self.tool_length * self.tool_axis, *carried])))
        result = [np.empty((len(q), 3)) for _ in range(1 + len(carried))]
        for part in columns.blocks(len(q)):
            starts = [self._tip_at_zero(), *map(columns.of_one, carried)]
            moved = self._sweep(self.chain, q[part], self._turning(q[part]), starts)
            for rows, vector in zip(result, moved, strict=True):
                rows[part] = columns.to_rows(vector, len(q[part]))
        return result

    def _tip_at_zero(self) -> list[Floats | float]:
        return columns.of_one(-self.tool_length * self.tool_axis)

    def _turning(self, q: Floats) -> Turning:
        """Cosine and sine (N,) of each rotary joint of q (N, J)."""
        return {name: (np.cos(q[:, j]), np.sin(q[:, j])) for name, j in self._turning_columns}

    @cached_property
    def _loop(self) -> ChainLoop:
        return ChainLoop.of(self.chain, self.axis_names)

    @cached_property
    def _turning_columns(self) -> list[tuple[str, int]]:
        return [(joint.name, self.axis_names.index(joint.name)) for joint in self._turns]

    def _sweep(self, chain: Sequence[Joint], q: Floats | None, turning: Turning,
               carried: Sequence[Columns]) -> list[list[Floats | float]]:
        """A point and any number of directions `carried` through the joints of `chain`, the last one first.

        Slides stand at 0 without `q`.
        """
        point, *vectors = map(list, carried)
        for joint in reversed(chain):
            if joint.rotary:
                cos, sin = turning[joint.name]
                point = columns.plus(columns.turned(joint.along, cos, sin, columns.minus(point, joint.place)), joint.place)
                vectors = [columns.turned(joint.along, cos, sin, v) for v in vectors]
            elif q is not None:
                value = q[:, self.axis_names.index(joint.name)]
                point = [x if d == 0.0 else x + value * d for x, d in zip(point, joint.along, strict=True)]
        return [point, *vectors]

    # ---- rates ---------------------------------------------------------------------------------------------

    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """d(tip, axis)/dq as (N, 6, J): a rotary axis w moves the tip by w x (tip - point), the axis by w x axis."""
        return self._rates(as_points(q, self.joints, "q"), twist=False)

    def slide_directions(self, q: Floats, slides: Ints) -> Floats:
        """See the base class."""
        chosen = [next(joint for joint in self.chain if joint.name == self.axis_names[j]) for j in slides.tolist()]
        if any(joint.rotary for joint in chosen):
            return super().slide_directions(q, slides)
        turning = self._turning(q)
        return np.stack([columns.to_rows(self._turned(joint, turning), len(q)) for joint in chosen], axis=2)

    def twist_jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """(v at the tip, omega) of the tool relative to the part per joint rate, (N, 6, J), in the table frame."""
        return self._rates(as_points(q, self.joints, "q"), twist=True)

    def _rates(self, q: Floats, twist: bool) -> Floats:
        n, turning = len(q), self._turning(q)
        tip, axis = self._tip_at_zero(), columns.of_one(self.tool_axis)
        rates = np.zeros((3, self.joints, 2, n))
        done: list[int] = []
        for joint in reversed(self.chain):
            index, w = self.axis_names.index(joint.name), joint.along
            if not joint.rotary:
                tip = columns.plus(tip, columns.times(q[:, index], w))
                rates[:, index, 0] = joint.direction[:, None]
            else:
                cos, sin = turning[joint.name]
                place = joint.place
                tip = columns.turned(joint.along, cos, sin, columns.minus(tip, place))
                axis = columns.turned(joint.along, cos, sin, axis)
                for i, column in enumerate(columns.turned(joint.along, cos, sin, rates[:, done])):
                    rates[i, done] = column
                for i, both in enumerate(zip(columns.cross(w, tip), w if twist else columns.cross(w, axis), strict=True)):
                    rates[i, index, 0], rates[i, index, 1] = both
                tip = columns.plus(tip, place)
            done.append(index)
        return np.ascontiguousarray(rates.transpose(3, 2, 0, 1)).reshape(n, 6, self.joints)

    def jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        """(tip, axis) along straight moves: the product of exponentials, axis by axis from the tool to the part."""
        tip, axis = (TaylorVector(columns.of_one(v)) for v in (-self.tool_length * self.tool_axis, self.tool_axis))
        for joint in reversed(self.chain):
            j = self.axis_names.index(joint.name)
            by, direction = TaylorAngle(0.5 * (q0[:, j] + q1[:, j]), q1[:, j] - q0[:, j]), joint.along
            if joint.rotary:
                tip, axis = tip.turned(direction, joint.place, by), axis.turned(direction, ZERO, by)
            else:
                tip = tip.slid(direction, by)
        return tip, axis

    # ---- errors, pivots ------------------------------------------------------------------------------------

    @property
    def axes_with_errors(self) -> tuple[str, ...]:
        """All axes."""
        return self.axis_names

    def with_errors(self, forms: ErrorForms[ErrorForm]) -> ErrorForm:
        """See the base class."""
        return forms.chain(self)

    def axis_line(self, letter: str) -> tuple[Floats, Floats]:
        """See the base class."""
        joint = next(joint for joint in self.chain if joint.name == letter)
        return joint.direction, joint.point

    def with_pivots(self, points: Mapping[str, Floats]) -> Self:
        """See the base class."""
        return replace(self, chain=tuple(replace(j, point=points[j.name]) if j.name in points else j for j in self.chain))

    def places_apart(self) -> Floats | None:
        """See the base class."""
        axis = self.nearest_axis(np.array([[0.1, 0.2, 1.0], [-0.3, 0.15, 1.0]]))
        return np.asarray(self.inverse(np.zeros((2, 3)), axis)[0])

    # ---- inverse -------------------------------------------------------------------------------------------

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0,
                near: Floats | None = None) -> Floats:
        """Joints (B, N, J) for the tip (N, 3) and the direction of `axis` (N, 3), NaN where it cannot be taken.

        A free rotary joint (tool along it) takes its value from `near` as it is, windings included. `spin` is not
        used: no serial machine of five axes can choose it.
        """
        tip, axis = as_points(tip, 3, "tip"), as_points(axis, 3, "axis")
        wanted = np.broadcast_to(0.0 if near is None else np.asarray(near, dtype=np.float64), (len(tip), self.joints))
        q = np.empty((self.branches, len(tip), self.joints))
        for part in columns.blocks(len(tip)):
            self._solve(columns.of_rows(tip[part]), columns.unit(columns.of_rows(axis[part])),
                        wanted[part], q[:, part])
        return q

    def _solve(self, tip: Columns, axis: Columns, wanted: Floats, q: Floats) -> None:
        """Fill q (B, N, J) for tips and unit axes."""
        from_pole = columns.angle(axis, columns.of_one(self._pole()))
        out = ~self._in_reach(from_pole)
        for branch, angles in enumerate(self._angles(axis, from_pole, wanted)):
            turning: Turning = {}
            for joint, value in zip(self._turns, angles, strict=True):
                q[branch, :, self.axis_names.index(joint.name)] = value
                turning[joint.name] = (np.cos(value), np.sin(value))
            slides = self._slides_to(tip, turning)
            for joint, value in zip(self._slides, slides, strict=True):
                q[branch, :, self.axis_names.index(joint.name)] = value
            dependent = np.isnan(slides[0])
            if dependent.any():
                q[branch, dependent] = np.nan
        if out.any():
            q[:, out] = np.nan

    def at_tip(self, tip: Floats, q: Floats, solved: Ints) -> Floats:
        """See the base class: of all slides as the inverse has them."""
        at = [self.axis_names.index(joint.name) for joint in self._slides]
        if sorted(at) != sorted(solved.tolist()):
            return super().at_tip(tip, q, solved)
        to = np.broadcast_to(tip, (len(q), 3))
        if self._loop.slides_together and pays(len(q)):
            return self._loop.at_tip(to, q, self._ends[0], self._from_slides)
        result = np.array(q)
        for j, value in zip(at, self._slides_to(columns.of_rows(to), self._turning(q)), strict=True):
            result[:, j] = value
        return result

    def _angles(self, axis: Columns, from_pole: Floats, wanted: Floats) -> Iterator[tuple[Floats, ...]]:
        """For each branch the angles (N,) of the rotary axes in chain order that take the tool to the unit `axis`."""
        turns = self._turns
        if not turns:
            yield ()
            return
        first = turns[0]
        heading = azimuth(first.direction, axis)
        free = columns.along(first.along, axis, ROUND_OFF)
        value = wanted[:, self.axis_names.index(first.name)]
        if len(turns) == 1:
            adjacent = float(azimuth(first.direction, columns.of_one(self.tool_axis)))
            yield (np.where(free, value, wrap(heading - adjacent)),)
            return
        second = turns[1]
        for tilt in meet(first.direction, second.direction, self.tool_axis, from_pole):
            carried = columns.turned(second.along, np.cos(tilt), np.sin(tilt),
                                   columns.of_one(self.tool_axis))
            turned = wrap(heading - azimuth(first.direction, carried))
            yield np.where(free, value, turned), tilt

    def _slides_to(self, tip: Columns, turning: Turning) -> list[Floats]:
        """Linear joints (N,) in chain order that bring the tip there, the rotary ones standing at `turning`."""
        if not self._loop.slides_together:
            return self._slides_apart(tip, turning)
        first, end = self._loop.sliding
        for joint in self.chain[:first]:
            cos, sin = turning[joint.name]
            place = joint.place
            tip = columns.plus(columns.turned(joint.along, cos, -sin, columns.minus(tip, place)), place)
        at_zero, = self._sweep(self.chain[end:], None, turning, [self._tip_at_zero()])
        gap = columns.minus(tip, at_zero)
        return [columns.dot(columns.of_one(row), gap) for row in self._from_slides]

    def _slides_apart(self, tip: Columns, turning: Turning) -> list[Floats]:
        """The same with rotary axes between the slides, which then are not square to each other in every position.

        The tip is linear in the slides: tip = tip(slides at 0) + their directions (as turned) times q; Cramer's rule.
        """
        at_zero, = self._sweep(self.chain, None, turning, [self._tip_at_zero()])
        gap = columns.minus(tip, at_zero)
        a, b, c = (self._turned(joint, turning) for joint in self._slides)
        sides = (columns.cross(b, c), columns.cross(c, a), columns.cross(a, b))
        volume = columns.dot(a, sides[0])
        volume = np.where(np.abs(volume) < DEPENDENT, np.nan, volume)
        return [columns.dot(gap, side) / volume for side in sides]

    def _turned(self, slide: Joint, turning: Turning) -> list[Floats | float]:
        """Direction of a linear axis in the table frame: turned by the rotary axes between it and the part."""
        vector: list[Floats | float] = [*slide.along]
        for joint in reversed(self.chain[: self.chain.index(slide)]):
            if joint.rotary:
                vector = columns.turned(joint.along, *turning[joint.name], vector)
        return vector

    # ---- what directions there are -------------------------------------------------------------------------

    def reach(self) -> tuple[float, float]:
        """Least and greatest angle (rad) of the tool from the rotary axis nearest the part; (0, 0) without one.

        With two rotary axes at the angle a1 to each other and the tool at a2 to the second: |a1 - a2| to a1 +
        a2 (or 2 pi less that).
        """
        turns = self._turns
        if len(turns) < 2:
            only = angle(turns[0].direction, self.tool_axis) if turns else 0.0
            return only, only
        a1 = angle(turns[0].direction, turns[1].direction)
        a2 = angle(turns[1].direction, self.tool_axis)
        return abs(a1 - a2), min(a1 + a2, 2.0 * np.pi - a1 - a2)

    def _pole(self) -> Floats:
        """The direction that `reach` is measured from: of the first rotary axis, without one of the tool."""
        turns = self._turns
        return turns[0].direction if turns else self.tool_axis

    def _in_reach(self, from_pole: Floats) -> Bools:
        low, high = self.reach()
        return np.asarray((from_pole >= low - ROUND_OFF) & (from_pole <= high + ROUND_OFF))

    def nearest_axis(self, axis: Floats) -> Floats:
        """Tool directions (N, 3) nearest to `axis` (N, 3), unchanged where the machine can take them.

        The directions in reach are a zone about the first rotary axis, so the nearest one lies on the great
        circle through that axis. Where `axis` lies along it, the direction at its zero angle is taken.
        """
        wanted, pole = unit(as_points(axis, 3, "axis")), self._pole()
        low, high = self.reach()
        from_pole = angle_between(wanted, pole)
        kept = np.clip(from_pole, low, high)[:, None]
        across = wanted - dot(wanted, pole)[:, None] * pole
        side = np.where((lengths(cross(wanted, pole)) < ROUND_OFF)[:, None], perpendicular(pole, self.tool_axis), across)
        side = unit(np.where(np.linalg.norm(side, axis=1, keepdims=True) > 0.0, side, basis(pole)[0]))
        projected = np.cos(kept) * pole + np.sin(kept) * side
        return np.asarray(np.where(self._in_reach(from_pole)[:, None], axis, projected))

    def singular(self, q: Floats) -> Bools:
        """True (N,) where the tool lies along the rotary axis nearest the part, whose value is then free."""
        q = as_points(q, self.joints, "q")
        result, turns = np.zeros(len(q), dtype=np.bool_), self._turns
        still = [columns.of_one(np.zeros(3)), columns.of_one(self.tool_axis)]
        for part in columns.blocks(len(q)) if turns else ():
            _, carried = self._sweep(turns[1:], None, self._turning(q[part]), still)
            result[part] = columns.along(turns[0].along, carried, ROUND_OFF)
        return result
