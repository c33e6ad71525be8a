"""A platform on legs that tilts about one direction, and a rotary axis under the part or at the spindle: five axes.

The platform tilts by theta, which no axis shows: it follows from the legs. The machine frame is that of the legs. Source:
Company 2000, V.5.2 (both machines of the asymmetric H4), V.7 (model).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Self

import numpy as np

from machines.kinematics.base import ErrorForm, ErrorForms, Kinematics, as_points
from machines.kinematics.clearance_geometry import ClearanceGeometry, ClearanceSizes
from machines.kinematics.columns import blocks
from machines.kinematics.frames import spin_about
from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.leg_motion import LegMotion, LegParts, RotaryNext
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.one_turn import OneTurn
from machines.kinematics.legs.over_workspace import OverWorkspace
from machines.kinematics.legs.rods_on_slides import RodsOnSlides
from machines.kinematics.legs.rotary_axis import ROUND_OFF, RotaryAxis
from machines.kinematics.rod_loops import RodLoop, by_parts
from machines.kinematics.singular_distance import NAMES
from machines.kinematics.taylor import TaylorAngle, TaylorVector
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import unit


@dataclass(frozen=True, eq=False)
class LegsWithAxis(Kinematics):
    """Joints: those of the legs, then the rotary axis.

    `inverse` gives the machine's own leg roots for each pair of tilt and rotary axis (`RotaryAxis.pairs`). With
    `all_roots` it gives every choice of the leg roots for each pair: the own ones first, then in the order of
    `Drives.root_choices`. A leg cannot change its root without passing the position where the rod is square to its drive.

    Attributes:
        on_legs: the legs and their platform, free in x, y, z and a turn about x or y
        axis: the rotary axis
        letter: its name
    """

    on_legs: OnLegs
    axis: RotaryAxis
    letter: str
    tool_length: float = 0.0
    all_roots: bool = False
    jets_proved = True
    singular_names = NAMES

    @cached_property
    def platform(self) -> OneTurn:
        """Of the legs."""
        found = self.on_legs.one_turn
        assert found is not None
        return found

    @property
    def leg_geometry(self) -> LegGeometry | None:
        """See the base class: that of the legs."""
        found = self.on_legs.leg_geometry
        return None if found is None else replace(found, head=self.axis.at_spindle)

    @property
    def axis_names(self) -> tuple[str, ...]:  # type: ignore[override]  # nothing assigns it
        """Of the legs, then of the axis"""
        return (*self.on_legs.axis_names, self.letter)

    @property
    def rotary(self) -> tuple[bool, ...]:  # type: ignore[override]  # nothing assigns it
        """True for joints in rad"""
        return (*self.on_legs.rotary, True)

    @property
    def drives_tip(self) -> tuple[bool, ...]:
        """The legs, arms too."""
        return (*self.on_legs.drives_tip, False)

    @property
    def branches(self) -> int:  # type: ignore[override]  # nothing assigns it
        """`RotaryAxis.pairs`, times the choices of roots with `all_roots`"""
        return self.axis.pairs * (len(self.legs.root_choices()) if self.all_roots else 1)

    @property
    def workspace(self) -> Workspace:  # type: ignore[override]  # nothing assigns it
        """of C and the tilt, in the machine frame"""
        return self.on_legs.workspace

    @property
    def legs(self) -> Drives:
        """See `ClearanceParts`."""
        return self.on_legs.legs

    @property
    def leg_names(self) -> tuple[str, ...]:
        """See `ClearanceParts`."""
        return self.on_legs.axis_names

    @property
    def clearance(self) -> ClearanceSizes | None:
        """See `ClearanceParts`."""
        return self.on_legs.clearance

    @property
    def clearance_parts(self) -> LegsWithAxis:  # type: ignore[override]  # nothing assigns it
        """Itself."""
        return self

    @property
    def over_workspace(self) -> LegsWithAxis:
        """Itself."""
        return self

    @property
    def transmits(self) -> OverWorkspace:  # type: ignore[override]  # nothing assigns it
        """Of the legs."""
        return self.on_legs.transmits

    @cached_property
    def on_rods(self) -> RodsOnSlides | None:  # type: ignore[override]  # nothing assigns it
        """Its rods, of legs on slides whose platform tilts about x."""
        plain = self.legs.on_slides is not None and self.axis.tilt == "a" and self.platform.loops.kept is None
        return RodsOnSlides(self, self.platform.loops.joints, True, -float(self.axis.gauge[2])) if plain else None

    # ---- inverse and forward -------------------------------------------------------------------------------

    def made_with_tool(self, length: float) -> Self:
        """The same machine at the tip of a tool of that length (mm)."""
        return replace(self, tool_length=float(length))

    def with_all_roots(self) -> Self:
        """See the base class."""
        return replace(self, all_roots=True)

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0,
                near: Floats | None = None) -> Floats:
        """Joints (B, N, J), V-22; NaN where a rod does not reach or the tilt leaves the workspace's range."""
        tip, axis = as_points(tip, 3, "tip"), unit(as_points(axis, 3, "axis"))
        free = np.zeros(len(tip)) if near is None else np.broadcast_to(near, (len(tip), self.joints))[:, -1]
        q = np.empty((self.branches, len(tip), self.joints))
        for part in blocks(len(tip)):
            solved = [self._legs_at(tip[part], *pair) for pair in self.axis.take(axis[part], free[part])]
            q[:, part] = [branch for roots in zip(*solved, strict=True) for branch in roots]
        return q

    def _legs_at(self, tip: Floats, tilt: Floats, turn: Floats) -> list[Floats]:
        """Joints (N, J) of one pair for each choice of roots asked for."""
        low, high = self.workspace.tilt
        p = self._platform_at(tip, np.where((tilt >= low - ROUND_OFF) & (tilt <= high + ROUND_OFF), tilt, np.nan), turn)
        ends, roots = self.platform.ends(p), self.legs.root_choices() if self.all_roots else self.legs.roots[None]
        return [np.column_stack([q, np.where(np.isnan(q[:, 0]), np.nan, turn)])
                for q in (self.legs.solve(ends, choice) for choice in roots)]

    def _platform_at(self, tip: Floats, tilt: Floats, turn: Floats) -> Floats:
        """Platform (N, 4) that puts the tip (N, 3) there at that tilt and rotary axis."""
        reach, _, _ = self.axis.tool(turn, self.tool_length)
        return np.column_stack([self.axis.to_part(tip, -turn) - self._tilted(reach, tilt), tilt])

    def _tilted(self, v: Floats, tilt: Floats) -> Floats:
        """v (N, 3) turned by the tilt (N,)."""
        i, j, k = self.platform.order
        c, s = np.cos(tilt), np.sin(tilt)
        turned = np.empty((len(tilt), 3))
        turned[:, i], turned[:, j], turned[:, k] = v[:, i] + 0.0 * c, c * v[:, j] - s * v[:, k], s * v[:, j] + c * v[:, k]
        return turned

    def solve_platform(self, q: Floats, near: Floats | None = None) -> Floats:
        """Platform (N, 4) of joints (N, J) in the mode nearest the pose `near` (6,) or (N, 6), else the home mode."""
        q = as_points(q, self.joints, "q")
        start = None if near is None else self._platform_of(np.broadcast_to(near, (len(q), 6)), q[:, -1])
        p = self.platform.forward(q[:, :-1], start)
        return np.where(np.isfinite(q[:, -1:]), p, np.nan)

    def _platform_of(self, pose: Floats, turn: Floats) -> Floats:
        _, tool, _ = self.axis.tool(turn, self.tool_length)
        axis, (_, j, k) = self.axis.to_part(pose[:, 3:], -turn), self.platform.order
        tilt = np.arctan2(tool[:, j] * axis[:, k] - tool[:, k] * axis[:, j],
                          tool[:, j] * axis[:, j] + tool[:, k] * axis[:, k])
        return self._platform_at(pose[:, :3], tilt, turn)

    def place(self, p: Floats, turn: Floats) -> tuple[Floats, Floats, Floats]:
        """(tip, axis, x of the tool), each (N, 3) in the table frame, of platform (N, 4) and rotary axis (N,)."""
        reach, axis, side = (self._tilted(v, p[:, 3]) for v in self.axis.tool(turn, self.tool_length))
        to_part = self.axis.to_part
        return to_part(p[:, :3] + reach, turn), to_part(axis, turn), to_part(side, turn)

    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip (N, 3), axis (N, 3)) of joints q (N, J): `pose` without the spin, which few ask for."""
        q = as_points(q, self.joints, "q")
        p = self.solve_platform(q, near)
        reach, axis = (self._tilted(v, p[:, 3]) for v in self.axis.tool(q[:, -1], self.tool_length)[:2])
        return self.axis.to_part(p[:, :3] + reach, q[:, -1]), self.axis.to_part(axis, q[:, -1])

    def carried(self, pose: Floats, q0: Floats, q1: Floats) -> Floats:
        """The pose (N, 6) at joints q0 (N, J) with the rotary axis where it is at q1 (N, J), the platform as it is."""
        if bool((q0[:, -1] == q1[:, -1]).all()):
            return pose
        tip, axis, _ = self.place(self._platform_of(pose, q0[:, -1]), q1[:, -1])
        return np.hstack([tip, axis])

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip (N, 3), axis (N, 3), spin (N,)) of joints q (N, J), see the base class."""
        tip, axis, side = self.place(self.solve_platform(q, near), q[:, -1])
        return tip, axis, spin_about(axis, side)

    def assembly_modes(self, q: Floats) -> tuple[Floats, Floats]:
        """All poses (tip, axis), each (8, N, 3), of joints q (N, J): home mode first, NaN where there are fewer."""
        q = as_points(q, self.joints, "q")
        placed = [self.place(p, q[:, -1]) for p in self.platform.modes(q[:, :-1])]
        return np.stack([tip for tip, _, _ in placed]), np.stack([axis for _, axis, _ in placed])

    def stands_at(self, q: Floats) -> bool:
        """See `OnLegs`."""
        return self.on_legs.stands_at(q[:-1])

    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """Where the parts are at joints q (N, J), for the clearances."""
        p = self.solve_platform(q, near)
        reach, axis, _ = (self._tilted(v, p[:, 3]) for v in self.axis.tool(q[:, -1], self.tool_length))
        gauge = p[:, :3] + reach + self.tool_length * axis
        turn = None if self.axis.tilt == "a" else self.platform.turn(p[:, 3])
        return ClearanceGeometry(p[:, :3], p[:, 3], self.legs.feet(q[:, :-1]), self.platform.ends(p), gauge, axis, turn)

    def middle_rig(self) -> ClearanceGeometry:
        """The same in the middle of the workspace, rotary axis at 0."""
        return self.rig(np.column_stack([self.platform.inverse(self.platform.home[None]), [0.0]]))

    def joints_at(self, platform: Floats, turn: Floats) -> Floats:
        """Joints (N, J) of places and tilts of the platform (N, 4) and rotary axes (N, 1)."""
        return np.column_stack([self.platform.inverse(platform), turn])

    def places_apart(self) -> Floats:
        """See the base class: in the middle of the workspace."""
        legs = self.platform.inverse(self.platform.home[None])
        return np.column_stack([np.repeat(legs, 2, axis=0), [0.0, 0.7]])

    def singular(self, q: Floats) -> Bools:
        """True (N,) where the rotary axis or the tilt turns the tool about itself (`RotaryAxis.free`)."""
        q = as_points(q, self.joints, "q")
        return self.axis.free(self.solve_platform(q)[:, 3] if not self.axis.at_spindle else 0.0 * q[:, -1], q[:, -1])

    def nearest_axis(self, axis: Floats) -> Floats:
        """Tool directions (N, 3) nearest to `axis`, those in reach as they are."""
        edge, inside = self.axis.nearest(unit(as_points(axis, 3, "axis")), self.workspace.tilt)
        return np.where(inside[:, None], axis, edge)

    @property
    def leg_parts(self) -> LegParts:
        """See the base class."""
        parts = self.on_legs.leg_parts
        assert parts is not None
        axis = RotaryNext(self.letter, self.joints - 1, *self.axis.line(), self.axis.at_spindle)
        return replace(parts, axes=(axis,), gauge=self.axis.gauge)

    def leg_motion(self, q: Floats, rate: Floats, acceleration: Floats) -> LegMotion:
        """See the base class: of the legs."""
        return self.on_legs.leg_motion(q[:, :-1], rate[:, :-1], acceleration[:, :-1])

    # ---- singular positions, bounds ------------------------------------------------------------------------

    def singular_distance(self, q: Floats) -> Floats:
        """See the base class, and `singular_distance.py`."""
        return self.on_legs.singular_distance(q[:, :-1])

    def singular_distance_between(self, q: Floats) -> Floats:
        """See the base class."""
        return self.on_legs.singular_distance_between(q[:, :-1])

    def jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        """See the base class."""
        return by_parts(self._jets, q0, q1)

    def _jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        middle, step = 0.5 * (q0 + q1), q1 - q0
        p = self.solve_platform(middle)
        if self.on_rods is not None:  # the same bounds of a turn about x alone
            ends = self.platform.ends(p)
            rods, arms = ends - self.legs.feet(middle[:, :-1]), ends - p[:, None, :3]
            place, tilt = RodLoop(rods, arms, self.on_rods.legs, step[:, :-1], True).jets(p[:, :3], p[:, 3])
        else:
            place, tilt = self.on_legs.moving(p[:, :3], self.platform.turn(p[:, 3]), middle[:, :-1], step[:, :-1]).tilting(
                p[:, 3], self.platform.order[0])
        return self.axis.tool_jets(place, tilt, TaylorAngle(middle[:, -1], step[:, -1]), self.tool_length)

    # ---- errors --------------------------------------------------------------------------------------------

    @property
    def axes_with_errors(self) -> tuple[str, ...]:
        """The rotary axis."""
        return (self.letter,)

    def with_errors(self, forms: ErrorForms[ErrorForm]) -> ErrorForm:
        """See the base class."""
        return forms.tilting_rods(self)

    def carries_part(self, letter: str) -> bool:
        """See the base class."""
        return letter == self.letter and not self.axis.at_spindle

    def axis_line(self, letter: str) -> tuple[Floats, Floats]:
        """See the base class: of the table, or of the axis in the level platform.

        Raises:
            ValueError: of a leg.
        """
        return self.axis.line() if letter == self.letter else self.on_legs.axis_line(letter)

    # ---- rates ---------------------------------------------------------------------------------------------

    def twist_jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """(v at the tip, omega) of the tool relative to the part per joint rate, (N, 6, J), in the table frame."""
        v, omega, _ = self._rates(as_points(q, self.joints, "q"), near)
        return np.concatenate([v, omega], axis=1)

    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """d(tip, axis)/dq (N, 6, J): the axis turns with omega."""
        v, omega, axis = self._rates(as_points(q, self.joints, "q"), near)
        return np.concatenate([v, np.cross(omega, axis[:, :, None], axis=1)], axis=1)

    def _rates(self, q: Floats, near: Floats | None) -> tuple[Floats, Floats, Floats]:
        """(v (N, 3, J), omega (N, 3, J), tool axis (N, 3)) in the table frame."""
        p, turn = self.solve_platform(q, near), q[:, -1]
        tip, axis, _ = self.place(p, turn)
        arm = self._tilted(self.axis.tool(turn, self.tool_length)[0], p[:, 3])
        dp, to_part = self.platform.rates(p, q[:, :-1]), self.axis.to_part
        v, omega = np.zeros((len(q), 3, self.joints)), np.zeros((len(q), 3, self.joints))
        omega[:, self.platform.order[0], :-1] = dp[:, 3]
        v[:, :, :-1] = to_part(dp[:, :3] + np.cross(omega[:, :, :-1], arm[:, :, None], axis=1), turn)
        omega[:, :, :-1] = to_part(omega[:, :, :-1], turn)
        direction, point = self._line(p)
        v[:, :, -1], omega[:, :, -1] = np.cross(direction, tip - point), direction
        return v, omega, axis

    def _line(self, p: Floats) -> tuple[Floats, Floats]:
        """(direction, point), each (N, 3), of the axis that the tool turns about, seen from the part."""
        direction, point = (np.tile(v, (len(p), 1)) for v in self.axis.line())
        if not self.axis.at_spindle:
            return direction, point
        return self._tilted(direction, p[:, 3]), p[:, :3] + self._tilted(point, p[:, 3])
