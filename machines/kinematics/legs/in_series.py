"""A platform on legs in series with rotary axes (`series_poses.py`): rates, bounds, clearances, errors."""

from __future__ import annotations

from dataclasses import field, replace

import numpy as np

from machines.kinematics import columns
from machines.kinematics.base import ErrorForm, ErrorForms, as_points
from machines.kinematics.clearance_geometry import ClearanceGeometry
from machines.kinematics.leg_motion import LegMotion, LegParts, RotaryNext
from machines.kinematics.legs.series_poses import PlatformFrame, PosesInSeries
from machines.kinematics.rod_loops import by_parts
from machines.kinematics.taylor import ZERO, TaylorAngle, TaylorVector
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import rotation

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class LegsInSeries(PosesInSeries):
    """Attributes as of `PosesInSeries`; `clearance_parts` is itself."""

    clearance_parts: LegsInSeries = field(init=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "clearance_parts", self)

    @property
    def over_workspace(self) -> LegsInSeries:
        """Itself."""
        return self

    @property
    def leg_parts(self) -> LegParts | None:
        """See the base class; None of legs on rings."""
        if (parts := self.on_legs.leg_parts) is None:
            return None
        first, count = self.legs_joints, len(self.tables)
        axes = [RotaryNext(joint.name, first + k, joint.direction, joint.point, k >= count)
                for k, joint in enumerate(self.turning)]
        return replace(parts, axes=(*axes[:count][::-1], *axes[count:]))

    def leg_motion(self, q: Floats, rate: Floats, acceleration: Floats) -> LegMotion:
        """See the base class: of the legs."""
        k = self.legs_joints
        return self.on_legs.leg_motion(q[:, :k], rate[:, :k], acceleration[:, :k])

    # ---- rates, bounds -------------------------------------------------------------------------------------

    def twist_jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """(v at the tip, omega) of the tool relative to the part per joint rate, (N, 6, J), in the table frame."""
        return self._rates(q, near)[0]

    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """d(tip, axis)/dq (N, 6, J): the axis turns with omega."""
        twist, axis = self._rates(q, near)
        return np.concatenate([twist[:, :3], np.cross(twist[:, 3:], axis[:, :, None], axis=1)], axis=1)

    def _rates(self, q: Floats, near: Floats | None) -> tuple[Floats, Floats]:
        """(twist (N, 6, J), tool axis (N, 3)) in the table frame."""
        q = as_points(q, self.joints, "q")
        (place, turn), k = self.platform_pose(q, near), self.legs_joints
        turns, n = q[:, k:], len(q)
        reach, axis, _ = self.tool(turns)
        tip, axis = place + np.einsum("nij,nj->ni", turn, reach), np.einsum("nij,nj->ni", turn, axis)
        gauge = place + turn @ self.on_legs.gauge
        twist = np.zeros((n, 6, self.joints))
        own = self.on_legs.twist_jacobian(q[:, :k], np.column_stack([gauge, turn[:, :, 2]]))
        twist[:, 3:, :k] = own[:, 3:]
        twist[:, :3, :k] = own[:, :3] + np.cross(own[:, 3:], (tip - gauge)[:, :, None], axis=1)
        for j, (direction, point) in enumerate(self._lines(place, turn, turns), k + len(self.tables)):
            twist[:, :3, j], twist[:, 3:, j] = np.cross(direction, tip - point), direction
        for i in range(len(self.tables) - 1, -1, -1):
            joint, at = self.tables[i], rotation(self.tables[i].direction, turns[:, i])
            twist[:, :3], twist[:, 3:] = at @ twist[:, :3], at @ twist[:, 3:]
            tip = np.einsum("nij,nj->ni", at, tip - joint.point) + joint.point
            axis = np.einsum("nij,nj->ni", at, axis)
            twist[:, :3, k + i] = np.cross(joint.direction, tip - joint.point)
            twist[:, 3:, k + i] = joint.direction
        return twist, axis

    def _lines(self, place: Floats, turn: Floats, turns: Floats) -> list[PlatformFrame]:
        """(direction, point), each (N, 3), of the axes of the head in the machine frame."""
        found, at, origin = [], turn, place
        for k, joint in enumerate(self.head, len(self.tables)):
            point = origin + at @ joint.point
            found.append((at @ joint.direction, point))
            at = at @ rotation(joint.direction, turns[:, k])
            origin = point - at @ joint.point
        return found

    def jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        """See the base class."""
        return by_parts(self._jets, q0, q1)

    def _jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        k, gauge = self.legs_joints, self.on_legs.gauge
        by = [TaylorAngle(0.5 * (q0[:, j] + q1[:, j]), q1[:, j] - q0[:, j]) for j in range(k, self.joints)]
        tip, axis = TaylorVector(columns.of_one(gauge - self.tool_length * UP)), TaylorVector(UP.tolist())
        count = len(self.tables)
        for joint, angle in zip(self.head[::-1], by[count:][::-1], strict=True):
            tip, axis = tip.turned(joint.along, joint.place, angle), axis.turned(joint.along, ZERO, angle)
        tip, axis = self.on_legs.carried_jets(q0[:, :k], q1[:, :k], tip, axis)
        for joint, angle in zip(self.tables[::-1], by[:count][::-1], strict=True):
            tip, axis = tip.turned(joint.along, joint.place, angle), axis.turned(joint.along, ZERO, angle)
        return tip, axis

    # ---- singular positions, clearances, directions --------------------------------------------------------

    def singular_distance(self, q: Floats) -> Floats:
        """See the base class: of the legs."""
        return self.on_legs.singular_distance(q[:, : self.legs_joints])

    def singular_distance_between(self, q: Floats) -> Floats:
        """See the base class."""
        return self.on_legs.singular_distance_between(q[:, : self.legs_joints])

    def singular(self, q: Floats) -> Bools:
        """True (N,) where the tool lies along the rotary axis nearest the part, whose value is then free."""
        q = as_points(q, self.joints, "q")
        return self.axes.singular(np.column_stack([np.zeros((len(q), 3)), q[:, self.legs_joints:]]))

    def nearest_axis(self, axis: Floats) -> Floats:
        """Tool directions (N, 3) nearest to `axis`, those in reach as they are; of a platform that turns all."""
        return as_points(axis, 3, "axis") if self.follows else self.axes.nearest_axis(axis)

    def places_apart(self) -> Floats:
        """See the base class: in the middle of the workspace."""
        legs = np.zeros((2, self.legs_joints))
        legs[:, self.on_legs.legs_at] = self.on_legs.home[2]
        turns = np.zeros((2, len(self.turning)))
        turns[1] = 0.7
        return np.column_stack([legs, turns])

    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """Where the parts are at joints q (N, J), in the machine frame."""
        place, turn = self.platform_pose(q, near)
        k = self.legs_joints
        gauge = place + turn @ self.on_legs.gauge
        found = self.on_legs.rig(q[:, :k], np.column_stack([gauge, turn[:, :, 2]]))
        reach, axis, _ = self.tool(q[:, k:])
        axis = np.einsum("nij,nj->ni", turn, axis)
        at = place + np.einsum("nij,nj->ni", turn, reach) + self.tool_length * axis
        return replace(found, gauge=at, axis=axis)

    def middle_rig(self) -> ClearanceGeometry:
        """The same in the middle of the workspace, rotary axes at 0."""
        return self.rig(self.places_apart()[:1])

    def joints_at(self, platform: Floats, turn: Floats) -> Floats:
        """Joints (N, J) of places and tilts of the platform (N, 4) and rotary axes (N, H)."""
        return np.column_stack([self.on_legs.joints_at(platform, np.empty((len(platform), 0))), turn])

    # ---- errors --------------------------------------------------------------------------------------------

    @property
    def axes_with_errors(self) -> tuple[str, ...]:
        """The rotary axes."""
        return tuple(joint.name for joint in self.turning)

    def with_errors(self, forms: ErrorForms[ErrorForm]) -> ErrorForm:
        """See the base class."""
        return forms.in_series(self)

    def carries_part(self, letter: str) -> bool:
        """See the base class."""
        return letter in {joint.name for joint in self.tables}

    def axis_line(self, letter: str) -> tuple[Floats, Floats]:
        """See the base class: of a table, or of an axis in the level platform.

        Raises:
            ValueError: of a leg.
        """
        for joint in self.turning:
            if joint.name == letter:
                return joint.direction, joint.point
        return self.on_legs.axis_line(letter)
