"""A platform on legs in series with rotary axes: tables under the part, axes between platform and spindle, or both.

With C and R the platform's place and turn, t the tables from the part to the bed and h the axes from the platform to the
spindle, a point x of the tool stands at t1 (t2 (C + R (h1 (h2 (x))))). A platform that does not turn is to the rotary axes
what three slides X, Y, Z are: they are solved as those of a serial machine (`serial.py`), the legs for the place that is
left. Where a platform turns as it goes aside (a passive leg), its axes meet in a point M on the tool's line: M has its place
whatever they do, which gives C and R, and the axes take the tool from R to where it is to point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Self

import numpy as np

from machines.kinematics.base import Kinematics, as_points
from machines.kinematics.chain import Joint
from machines.kinematics.clearance_geometry import ClearanceSizes
from machines.kinematics.frames import spin_about
from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.over_workspace import OverWorkspace
from machines.kinematics.serial import Serial
from machines.kinematics.singular_distance import NAMES
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import rotation, unit

UP = np.array([0.0, 0.0, 1.0])
PLACE = tuple(Joint(name, False, along) for name, along in zip("XYZ", np.eye(3), strict=True))
"""the platform's place as three slides"""
PlatformFrame = tuple[Floats, Floats]
"""origin (N, 3) and turn (N, 3, 3)"""


@dataclass(frozen=True, eq=False)
class PosesInSeries(Kinematics):
    """Joints: those of the legs, then the rotary axes in the order of tables and head.

    Attributes:
        on_legs: the legs and their platform, which moves in x, y and z
        tables: from the part to the bed, points in the machine frame
        head: from the platform to the spindle, points from the reference point of the level platform
        axis_names, rotary, branches: of the legs, then of the rotary axes; branches of these, times the choices of roots
        workspace, transmits: of the legs; C in the machine frame
    """

    on_legs: OnLegs
    tables: tuple[Joint, ...]
    head: tuple[Joint, ...]
    tool_length: float = 0.0
    all_roots: bool = False
    axis_names: tuple[str, ...] = field(init=False)
    rotary: tuple[bool, ...] = field(init=False)
    branches: int = field(init=False)
    workspace: Workspace = field(init=False)
    transmits: OverWorkspace = field(init=False)
    jets_proved = True
    singular_names = NAMES

    def __post_init__(self) -> None:
        own, turning = self.on_legs, self.turning
        made = {"axis_names": (*own.axis_names, *(joint.name for joint in turning)),
                "rotary": (*own.rotary, *(True for _ in turning)), "workspace": own.workspace, "transmits": own.transmits,
                "branches": self.axes.branches * (len(self.legs.root_choices()) if self.all_roots else 1)}
        for name, value in made.items():
            object.__setattr__(self, name, value)

    @cached_property
    def turning(self) -> tuple[Joint, ...]:
        """All rotary axes, from the part to the spindle."""
        return (*self.tables, *self.head)

    @property
    def legs_joints(self) -> int:
        """How many joints are those of the legs."""
        return self.on_legs.joints

    @property
    def follows(self) -> bool:
        """True where the platform turns as it goes aside."""
        return self.on_legs.loops.holds is not None

    @property
    def drives_tip(self) -> tuple[bool, ...]:
        """The legs, arms too, and a wrist that holds the tool axis as the platform turns."""
        return (*self.on_legs.drives_tip, *(self.follows for _ in self.turning))

    @property
    def in_loops(self) -> tuple[bool, ...]:
        """Those of the legs."""
        return (*self.on_legs.in_loops, *(False for _ in self.turning))

    @property
    def turns_tool(self) -> tuple[bool, ...]:
        """The rotary axes, and legs whose platform turns."""
        return (*self.on_legs.turns_tool, *(True for _ in self.turning))

    @cached_property
    def axes(self) -> Serial:
        """The rotary axes on three slides that are the place of the gauge point with the head at 0."""
        gauge = self.on_legs.gauge
        head = tuple(replace(joint, point=joint.point - gauge) for joint in self.head)
        names = (*(joint.name for joint in PLACE), *(joint.name for joint in self.turning))
        return Serial((*self.tables, *PLACE, *head), names, tool_length=self.tool_length)

    @property
    def legs(self) -> Drives:
        """See `ClearanceParts`."""
        return self.on_legs.legs

    @property
    def leg_names(self) -> tuple[str, ...]:
        """See `ClearanceParts`."""
        return self.on_legs.leg_names

    @property
    def clearance(self) -> ClearanceSizes | None:
        """See `ClearanceParts`."""
        return self.on_legs.clearance

    @property
    def leg_geometry(self) -> LegGeometry | None:
        """See the base class: that of the legs."""
        found = self.on_legs.leg_geometry
        return None if found is None else replace(found, head=bool(self.head))

    def made_with_tool(self, length: float) -> Self:
        """The same machine at the tip of a tool of that length (mm)."""
        return replace(self, tool_length=float(length))

    def with_all_roots(self) -> Self:
        """See the base class."""
        return replace(self, all_roots=True, on_legs=self.on_legs.with_all_roots())

    # ---- inverse -------------------------------------------------------------------------------------------

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0,
                near: Floats | None = None) -> Floats:
        """Joints (B, N, J), for each pair of the rotary axes; NaN where a leg does not reach or they do not."""
        tip, axis = as_points(tip, 3, "tip"), unit(as_points(axis, 3, "axis"))
        k, n = self.legs_joints, len(tip)
        free = np.zeros((n, 3 + len(self.turning)))
        if near is not None:
            free[:, 3:] = np.broadcast_to(near, (n, self.joints))[:, k:]
        if self.follows:
            solved = self._solved_apart(tip, axis, free)
        else:
            solved = [(self.on_legs.inverse(s[:, :3], np.where(np.isnan(s[:, :1]), np.nan, UP)), s[:, 3:])
                      for s in self.axes.inverse(tip, axis, near=free)]
        return np.stack([np.column_stack([q, np.where(np.isnan(q[:, :1]), np.nan, turns)])
                         for legs, turns in solved for q in legs])

    def _solved_apart(self, tip: Floats, axis: Floats, free: Floats) -> list[tuple[Floats, Floats]]:
        """(joints of the legs (B, N, K), of the head (N, H)) for each branch of the head."""
        place, turn = self._about_pivot(tip, axis)
        q = self.legs_with(place, turn)
        own = np.einsum("nji,nj->ni", turn, axis)
        good = np.isfinite(own).all(axis=1)
        turns = self.axes.inverse(np.zeros_like(tip), np.where(good[:, None], own, UP), near=free)
        return [(q, np.where(good[:, None], s[:, 3:], np.nan)) for s in turns]

    def legs_with(self, place: Floats, turn: Floats) -> Floats:
        """Joints (B, N, K) of the legs with the platform at (N, 3), (N, 3, 3); no carriers."""
        roots = self.legs.root_choices() if self.all_roots else self.legs.roots[None]
        ends = self.on_legs.loops.ends(place, turn)
        found = np.full((len(roots), len(place), self.legs_joints), np.nan)
        for one, choice in zip(found, roots, strict=True):
            one[:, self.on_legs.legs_at] = self.legs.solve(ends, choice)
        return found

    def legs_at_place(self, place: Floats) -> tuple[Floats, Floats, Floats]:
        """(joints (N, K) of legs and carriers, R (N, 3, 3), travel of the carriers (N, 3) mm) with C at `place` (N, 3)."""
        own, up = self.on_legs, np.broadcast_to(UP, place.shape)
        if self.follows:
            at, turn = own.standing(place, up, np.zeros(3), np.zeros(len(place)))[:2]
            return replace(self, all_roots=False).legs_with(at, turn)[0], turn, 0.0 * place
        q = own.inverse(place + own.gauge, up)[0]
        return q, np.tile(np.eye(3), (len(place), 1, 1)), q[:, own.carriers_at] @ own.carriers

    @cached_property
    def pivot(self) -> Floats:
        """(3,) mm, M: where the axes of the head meet, in directions of the platform from its reference point."""
        return meeting_point(self.head)

    def _about_pivot(self, tip: Floats, axis: Floats) -> PlatformFrame:
        """(C, R) of a platform that turns as it goes aside, with the tool at a tip and axis (N, 3)."""
        over = float((self.pivot - self.on_legs.gauge) @ UP)
        at = tip + (self.tool_length + over) * axis
        none = np.zeros(len(tip))
        return self.on_legs.standing(at, np.broadcast_to(UP, at.shape), self.pivot, none)[:2]

    # ---- forward -------------------------------------------------------------------------------------------

    def platform_pose(self, q: Floats, near: Floats | None = None) -> PlatformFrame:
        """(C (N, 3), R (N, 3, 3)) with the travel of carriers in C, of joints q (N, J); see `pose` for `near`."""
        q = as_points(q, self.joints, "q")
        own, turns = q[:, : self.legs_joints], q[:, self.legs_joints:]
        hint = None
        if near is not None:
            place, turn = self.platform_at(np.broadcast_to(near, (len(q), 6)), turns)
            hint = np.column_stack([place + turn @ self.on_legs.gauge, turn[:, :, 2]])
        place, turn = self.on_legs.platform_pose(own, hint)
        bad = ~np.isfinite(turns).all(axis=1)
        place[bad] = np.nan
        return place, turn

    def platform_at(self, pose: Floats, turns: Floats) -> PlatformFrame:
        """(C, R) that give the tool a pose (N, 6) with the rotary axes at `turns` (N, H)."""
        tip, axis = self.to_machine(pose[:, :3], turns, True), self.to_machine(pose[:, 3:], turns, False)
        if self.follows:
            return self._about_pivot(tip, axis)
        reach = self.tool(turns)[0]
        return tip - reach, np.tile(np.eye(3), (len(tip), 1, 1))

    def tool(self, turns: Floats) -> tuple[Floats, Floats, Floats]:
        """(tip from C, axis, x of the tool), each (N, 3), in directions of the platform."""
        n = len(turns)
        point = np.tile(self.on_legs.gauge - self.tool_length * UP, (n, 1))
        axis, side = np.tile(UP, (n, 1)), np.tile(np.eye(3)[0], (n, 1))
        found = self._through(self.head, turns[:, len(self.tables):], point, axis, side)
        return found[0], found[1], found[2]

    def to_part(self, turns: Floats, point: Floats, *vectors: Floats) -> tuple[Floats, ...]:
        """A point and vectors (N, 3) of the machine frame in the table frame."""
        return self._through(self.tables, turns, point, *vectors)

    def _through(self, joints: Sequence[Joint], turns: Floats, point: Floats, *vectors: Floats) -> tuple[Floats, ...]:
        for k in range(len(joints) - 1, -1, -1):
            turn, joint = rotation(joints[k].direction, turns[:, k]), joints[k]
            point = np.einsum("nij,nj->ni", turn, point - joint.point) + joint.point
            vectors = tuple(np.einsum("nij,nj->ni", turn, v) for v in vectors)
        return (point, *vectors)

    def to_machine(self, v: Floats, turns: Floats, point: bool) -> Floats:
        """Points or vectors (N, 3) of the table frame in the machine frame."""
        for k, joint in enumerate(self.tables):
            back, centre = rotation(joint.direction, -turns[:, k]), joint.point if point else np.zeros(3)
            v = np.einsum("nij,nj->ni", back, v - centre) + centre
        return np.asarray(v, dtype=np.float64)

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip (N, 3), axis (N, 3), spin (N,)) of joints q (N, J), see the base class."""
        tip, axis, side = self.placed(*self.platform_pose(q, near), q[:, self.legs_joints:])
        return tip, axis, spin_about(axis, side)

    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip (N, 3), axis (N, 3)) of joints q (N, J)."""
        return self.placed(*self.platform_pose(q, near), q[:, self.legs_joints:])[:2]

    def placed(self, place: Floats, turn: Floats, turns: Floats) -> tuple[Floats, Floats, Floats]:
        """(tip, axis, x of the tool), each (N, 3) in the table frame, of platforms and rotary axes (N, H)."""
        reach, *directions = self.tool(turns)
        tip, axis, side = (np.einsum("nij,nj->ni", turn, v) for v in (reach, *directions))
        found = self.to_part(turns, place + tip, axis, side)
        return found[0], found[1], found[2]

    def carried(self, pose: Floats, q0: Floats, q1: Floats) -> Floats:
        """The pose (N, 6) at joints q0 (N, J), carriers and rotary axes as at q1 (N, J), the legs as they are."""
        k, own = self.legs_joints, self.on_legs
        shift = (q1 - q0)[:, own.carriers_at] @ own.carriers
        if bool((q0[:, k:] == q1[:, k:]).all()) and not shift.any():
            return pose
        place, turn = self.platform_at(pose, q0[:, k:])
        return np.hstack(self.placed(place + shift, turn, q1[:, k:])[:2])

    def assembly_modes(self, q: Floats) -> tuple[Floats, Floats]:
        """See the base class: those of the legs."""
        k = self.legs_joints
        own = self.on_legs
        tips, axes = own.assembly_modes(as_points(q, self.joints, "q")[:, :k])
        found = []
        for tip, axis in zip(tips, axes, strict=True):
            place, turn = own.platform_pose(q[:, :k], np.hstack([tip, axis]))
            found.append(self.placed(place, turn, q[:, k:])[:2])
        return np.stack([tip for tip, _ in found]), np.stack([axis for _, axis in found])

    def stands_at(self, q: Floats) -> bool:
        """See `OnLegs`."""
        return self.on_legs.stands_at(q[: self.legs_joints])


def meeting_point(head: Sequence[Joint]) -> Floats:
    """(3,) the point nearest to the lines of two axes."""
    rows = np.concatenate([np.eye(3) - np.outer(joint.direction, joint.direction) for joint in head])
    right = np.concatenate([(np.eye(3) - np.outer(joint.direction, joint.direction)) @ joint.point for joint in head])
    return np.asarray(np.linalg.lstsq(rows, right, rcond=None)[0], dtype=np.float64)
