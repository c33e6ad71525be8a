"""Serial machines: three linear and up to two rotary axes in any order, on the part's or the tool's side.

The machine is one chain from the workpiece to the tool in the order of its ISO 10791-6 code. Every axis moves what is
on its tool side relative to what is on its workpiece side in the positive sense of ISO 841, so that primed axes (which
carry the part) and unprimed ones obey one formula. With the motion M_i of axis i (a shift along its direction, or a
turn about the line through its point, both as they stand at q = 0)

    tip = M_1(q_1) M_2(q_2) ... M_J(q_J) tip_0,      axis = R_1 R_2 a_0 (turns only),

the product of exponentials (Brockett 1984; Murray, Li, Sastry, A Mathematical Introduction to Robotic Manipulation,
1994, equation 3.4), seen from the part. The gauge point is at the machine origin at q = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from machines.kinematics.base import Kinematics, as_points
from machines.kinematics.frames import reference_x, spin_about
from toolpaths.arrays import Bools, Floats, frozen
from toolpaths.rotations import angle_between

ROUND_OFF = 1e-12
"""rad: directions nearer than this are the same (reach, singular direction)"""
DEPENDENT = 1e-9
"""least determinant of the three linear directions; below it they do not span space"""


@dataclass(frozen=True, eq=False)
class Joint:
    """One axis: letter, kind, unit direction (3,), for a rotary one a point (3,) of its line in mm; all at q = 0."""

    name: str
    rotary: bool
    direction: Floats
    point: Floats = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _unit_vector(self.direction, "direction"))
        object.__setattr__(self, "point", frozen(self.point, np.float64, (3,), "point"))


@dataclass(frozen=True, eq=False)
class Serial(Kinematics):
    """Three linear axes and up to two rotary ones.

    Attributes:
        chain: joints from the workpiece to the tool
        axis_names: order of q: linear axes by letter from X, then rotary axes by letter from A
        tool_axis: (3,) from the tip to the spindle at q = 0

    Branches: two for two rotary axes, first the one whose rotary axis nearest the tool stands at the greater angle from
    where it brings the tool nearest to the other rotary axis (a trunnion A or B: first positive, then negative). One
    for fewer: a single angle takes the tool to a given direction, and the slides follow by a linear system.
    """

    chain: tuple[Joint, ...]
    axis_names: tuple[str, ...]
    tool_axis: Floats = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    tool_length: float = 0.0
    rotary: tuple[bool, ...] = field(init=False)
    branches: int = field(init=False)
    slides_affine = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "tool_axis", _unit_vector(self.tool_axis, "tool_axis"))
        kind = {joint.name: joint.rotary for joint in self.chain}
        object.__setattr__(self, "rotary", tuple(kind[name] for name in self.axis_names))
        object.__setattr__(self, "branches", 2 if len(self._turns) == 2 else 1)

    @property
    def _turns(self) -> list[Joint]:
        return [joint for joint in self.chain if joint.rotary]

    def with_tool(self, length: float) -> Self:
        """The same machine at the tip: tip = gauge point - length * axis."""
        return replace(self, tool_length=float(length))

    # ---- forward -------------------------------------------------------------------------------------------------

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip (N, 3), axis (N, 3), spin (N,)) of joints q (N, J); there is one assembly, so `near` is not used."""
        tip, vectors = self._sweep(as_points(q, self.joints, "q"), self._tool_frame())
        return tip, vectors[0], spin_about(vectors[0], vectors[1])

    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip (N, 3), axis (N, 3)) of joints q (N, J)."""
        tip, vectors = self._sweep(as_points(q, self.joints, "q"), [self.tool_axis])
        return tip, vectors[0]

    def _tool_frame(self) -> list[Floats]:
        return [self.tool_axis, reference_x(self.tool_axis[None])[0]]

    def _sweep(self, q: Floats, carried: Sequence[Floats]) -> tuple[Floats, list[Floats]]:
        """The tip (N, 3) and the vectors (N, 3) `carried` (each (3,)) by the tool, moved by every axis in turn."""
        tip = np.tile(-self.tool_length * self.tool_axis, (len(q), 1))
        vectors = [np.tile(v, (len(q), 1)) for v in carried]
        for joint in reversed(self.chain):
            value = q[:, self.axis_names.index(joint.name)]
            if joint.rotary:
                cos, sin = np.cos(value)[:, None], np.sin(value)[:, None]
                tip = joint.point + _turn(joint.direction, cos, sin, tip - joint.point)
                vectors = [_turn(joint.direction, cos, sin, v) for v in vectors]
            else:
                tip = tip + value[:, None] * joint.direction
        return tip, vectors

    # ---- rates ---------------------------------------------------------------------------------------------------

    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """d(tip, axis)/dq as (N, 6, J): a rotary axis w moves the tip by w x (tip - point), the axis by w x axis."""
        return self._rates(as_points(q, self.joints, "q"), twist=False)

    def twist_jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """(v at the tip, omega) of the tool relative to the part per joint rate, (N, 6, J), in the table frame."""
        return self._rates(as_points(q, self.joints, "q"), twist=True)

    def _rates(self, q: Floats, twist: bool) -> Floats:
        n = len(q)
        tip = np.tile(-self.tool_length * self.tool_axis, (n, 1))
        axis = np.tile(self.tool_axis, (n, 1))
        columns = np.zeros((self.joints, 2, n, 3))
        done: list[int] = []
        for joint in reversed(self.chain):
            index = self.axis_names.index(joint.name)
            if not joint.rotary:
                tip = tip + q[:, index, None] * joint.direction
                columns[index, 0] = joint.direction
            else:
                cos, sin = np.cos(q[:, index, None]), np.sin(q[:, index, None])
                tip = _turn(joint.direction, cos, sin, tip - joint.point)
                axis = _turn(joint.direction, cos, sin, axis)
                columns[done] = _turn(joint.direction, cos, sin, columns[done])
                columns[index, 0] = np.cross(joint.direction, tip)
                columns[index, 1] = joint.direction if twist else np.cross(joint.direction, axis)
                tip = tip + joint.point
            done.append(index)
        return np.ascontiguousarray(columns.transpose(2, 1, 3, 0)).reshape(n, 6, self.joints)

    # ---- inverse -------------------------------------------------------------------------------------------------

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0, near: Floats | None = None) -> Floats:
        """Joints (B, N, J) for the tip (N, 3) and the direction of `axis` (N, 3), NaN where it cannot be taken.

        A free rotary joint (tool along it) takes its value from `near` as it is, windings included. `spin` is not
        used: no serial machine of five axes can choose it.
        """
        tip, axis = as_points(tip, 3, "tip"), _unit(as_points(axis, 3, "axis"))
        q = np.zeros((self.branches, len(tip), self.joints))
        out = ~self._reachable(axis)
        for branch in range(self.branches):
            for joint, value in zip(self._turns, self._angles(axis, branch, near), strict=True):
                q[branch, :, self.axis_names.index(joint.name)] = value
            self._set_slides(q[branch], tip)
        q[:, out] = np.nan
        return q

    def _angles(self, axis: Floats, branch: int, near: Floats | None) -> list[Floats]:
        """Angles (N,) of the rotary axes in chain order that take the tool to the unit `axis` (N, 3)."""
        turns = self._turns
        if not turns:
            return []
        first = turns[0]
        carried = np.broadcast_to(self.tool_axis, axis.shape)
        angles = []
        if len(turns) == 2:
            value = _meet(first.direction, turns[1].direction, self.tool_axis, axis, branch)
            carried = _turn(turns[1].direction, np.cos(value)[:, None], np.sin(value)[:, None], carried)
            angles.append(value)
        value = _wrap(_azimuth(first.direction, axis) - _azimuth(first.direction, carried))
        free = _along(first.direction, axis)
        if np.any(free):
            value = np.where(free, self._wanted(first, near, len(axis)), value)
        angles.insert(0, value)
        return angles

    def _wanted(self, joint: Joint, near: Floats | None, n: int) -> Floats:
        if near is None:
            return np.zeros(n)
        wanted = np.broadcast_to(np.asarray(near, dtype=np.float64), (n, self.joints))
        return wanted[:, self.axis_names.index(joint.name)]

    def _set_slides(self, q: Floats, tip: Floats) -> None:
        """Fill the linear joints of q (N, J), whose rotary ones are set, so that the tip is at `tip` (N, 3).

        The tip is linear in the slides: tip = tip(slides at 0) + their directions (as turned) times q; Cramer's rule.
        """
        slides = [joint for joint in self.chain if not joint.rotary]
        at_zero, _ = self._sweep(q, [])
        a, b, c = (self._turned(joint, q) for joint in slides)
        gap = tip - at_zero
        volume = _dot(a, np.cross(b, c))
        volume = np.where(np.abs(volume) < DEPENDENT, np.nan, volume)
        for joint, other in zip(slides, (np.cross(b, c), np.cross(c, a), np.cross(a, b)), strict=True):
            q[:, self.axis_names.index(joint.name)] = _dot(gap, other) / volume
        q[np.isnan(volume)] = np.nan

    def _turned(self, slide: Joint, q: Floats) -> Floats:
        """Direction (N, 3) of a linear axis in the table frame: turned by the rotary axes between it and the part."""
        vector = np.broadcast_to(slide.direction, (len(q), 3))
        for joint in reversed(self.chain[: self.chain.index(slide)]):
            if joint.rotary:
                value = q[:, self.axis_names.index(joint.name), None]
                vector = _turn(joint.direction, np.cos(value), np.sin(value), vector)
        return vector

    # ---- what directions there are ---------------------------------------------------------------------------------

    def reach(self) -> tuple[float, float]:
        """Least and greatest angle (rad) of the tool from the rotary axis nearest the part; (0, 0) without one.

        With two rotary axes at the angle a1 to each other and the tool at a2 to the second: |a1 - a2| to a1 + a2
        (or 2 pi less that).
        """
        turns = self._turns
        if len(turns) < 2:
            angle = _angle(turns[0].direction, self.tool_axis) if turns else 0.0
            return angle, angle
        a1 = _angle(turns[0].direction, turns[1].direction)
        a2 = _angle(turns[1].direction, self.tool_axis)
        return abs(a1 - a2), min(a1 + a2, 2.0 * np.pi - a1 - a2)

    def _pole(self) -> Floats:
        """The direction that `reach` is measured from: of the first rotary axis, without one of the tool."""
        turns = self._turns
        return turns[0].direction if turns else self.tool_axis

    def _reachable(self, axis: Floats) -> Bools:
        low, high = self.reach()
        angle = angle_between(axis, self._pole())
        result: Bools = (angle >= low - ROUND_OFF) & (angle <= high + ROUND_OFF)
        return result

    def nearest_axis(self, axis: Floats) -> Floats:
        """Tool directions (N, 3) nearest to `axis` (N, 3), unchanged where the machine can take them.

        The directions in reach are a zone about the first rotary axis, so the nearest one lies on the great circle
        through that axis. Where `axis` lies along it, the direction at its zero angle is taken.
        """
        unit, pole = _unit(as_points(axis, 3, "axis")), self._pole()
        low, high = self.reach()
        angle = np.clip(angle_between(unit, pole), low, high)[:, None]
        across = unit - _dot(unit, pole)[:, None] * pole
        side = np.where(_along(pole, unit)[:, None], _perpendicular(pole, self.tool_axis), across)
        side = _unit(np.where(np.linalg.norm(side, axis=1, keepdims=True) > 0.0, side, _basis(pole)[0]))
        projected = np.cos(angle) * pole + np.sin(angle) * side
        result: Floats = np.where(self._reachable(unit)[:, None], axis, projected)
        return result

    def singular(self, q: Floats) -> Bools:
        """True (N,) where the tool lies along the rotary axis nearest the part, whose value is then free."""
        q = as_points(q, self.joints, "q")
        turns = self._turns
        if not turns:
            return np.zeros(len(q), dtype=np.bool_)
        carried = np.tile(self.tool_axis, (len(q), 1))
        for joint in turns[1:]:
            value = q[:, self.axis_names.index(joint.name), None]
            carried = _turn(joint.direction, np.cos(value), np.sin(value), carried)
        return _along(turns[0].direction, carried)


# ---- rotation algebra ------------------------------------------------------------------------------------------------

def _meet(first: Floats, second: Floats, tool: Floats, axis: Floats, branch: int) -> Floats:
    """Angle (N,) about `second` that brings `tool` to the angle from `first` that `axis` (N, 3) has.

    Second subproblem of Paden (1986) and Kahan as a spherical triangle with the sides a1 = first-second, a2 = second-
    tool and phi = first-axis; its angle psi at `second` by the half-angle formula, which keeps its digits near the
    singular direction (phi = |a1 - a2|) and near the edge of reach (phi = a1 + a2):
    tan^2(psi/2) = sin((phi+d)/2) sin((phi-d)/2) / (sin((s+phi)/2) sin((s-phi)/2)), d = a1 - a2, s = a1 + a2.
    """
    a1, a2 = _angle(first, second), _angle(second, tool)
    phi = angle_between(axis, first)
    over = np.sin((phi + a1 - a2) / 2.0) * np.sin((phi - a1 + a2) / 2.0)
    under = np.sin((a1 + a2 + phi) / 2.0) * np.sin((a1 + a2 - phi) / 2.0)
    psi = 2.0 * np.arctan2(np.sqrt(np.maximum(over, 0.0)), np.sqrt(np.maximum(under, 0.0)))
    nearest = float(_azimuth(second, first[None])[0] - _azimuth(second, tool[None])[0])
    return _wrap(nearest + (psi if branch == 0 else -psi))


def _turn(direction: Floats, cos: Floats, sin: Floats, v: Floats) -> Floats:
    """Vectors (..., N, 3) turned about the unit `direction` (3,) (Rodrigues); cos and sin (N, 1)."""
    along = (v @ direction)[..., None] * direction
    result: Floats = along + cos * (v - along) + sin * np.cross(direction, v)
    return result


def _azimuth(pole: Floats, v: Floats) -> Floats:
    """Angle (N,) of v (N, 3) about the unit `pole` (3,), from a fixed direction across it."""
    e1, e2 = _basis(pole)
    result: Floats = np.arctan2(v @ e2, v @ e1)
    return result


def _basis(pole: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (3,) that make a right-handed frame with the unit `pole` (3,) as third."""
    helper = np.eye(3)[(int(np.argmax(np.abs(pole))) + 1) % 3]
    e1 = _perpendicular(pole, helper)
    e1 = e1 / np.linalg.norm(e1)
    return e1, np.cross(pole, e1)


def _perpendicular(pole: Floats, v: Floats) -> Floats:
    result: Floats = v - (v @ pole) * pole
    return result


def _along(direction: Floats, v: Floats) -> Bools:
    """True (N,) where v (N, 3) lies along +-direction."""
    result: Bools = np.linalg.norm(np.cross(v, direction), axis=1) < ROUND_OFF
    return result


def _angle(a: Floats, b: Floats) -> float:
    return float(angle_between(a, b))


def _unit_vector(v: Floats, name: str) -> Floats:
    vector = np.asarray(v, dtype=np.float64)
    return frozen(vector / np.linalg.norm(vector), np.float64, (3,), name)


def _unit(v: Floats) -> Floats:
    norm = np.linalg.norm(v, axis=1, keepdims=True)
    result: Floats = v / np.where(norm > 0.0, norm, np.nan)
    return result


def _dot(a: Floats, b: Floats) -> Floats:
    result: Floats = np.sum(a * b, axis=-1)
    return result


def _wrap(angle: Floats) -> Floats:
    """The same angles in (-pi, pi]."""
    result: Floats = angle - 2.0 * np.pi * np.ceil((angle - np.pi) / (2.0 * np.pi))
    return result
