"""Any machine whose platform is carried by legs: place and turn from closed loops, drives as data, slides that carry it all.

The machine frame is the one in which the legs are given. With C the platform's reference point and R its turn, the gauge
point is C + R gauge + the travel of the carriers, the tool axis R z. A platform that turns in every direction can turn the
tool about itself too: `inverse` takes that spin, 0 unless asked for. Source of the loops: `drives.py`, `loops.py`,
`bounds.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from machines.kinematics.base import ErrorForm, ErrorForms, Kinematics, as_points
from machines.kinematics.clearance_geometry import ClearanceGeometry, ClearanceSizes
from machines.kinematics.columns import blocks
from machines.kinematics.frames import spin_about, tool_x
from machines.kinematics.legs.bounds import MovingLoops
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import Loops
from machines.kinematics.rod_loops import by_parts
from machines.kinematics.singular_distance import NAMES, distance, distance_between
from machines.kinematics.taylor import TaylorVector
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.rotations import angle_between, cross, unit
from toolpaths.shapes import arrays

UP = np.array([0.0, 0.0, 1.0])
ROUND_OFF = 1e-12
"""rad: directions nearer than this are the same"""
ASIDE = 1e-9
"""mm that a point may lie off what the slides and the platform can reach"""
GOLDEN = 2.399963
"""rad, so that no few directions repeat"""
PARTS = 16
"""of the path from the home joints, where one Newton does not find the home mode"""
PlatformPose = tuple[Floats, Floats]
"""C (N, 3) mm and R (N, 3, 3)"""


@dataclass(frozen=True, eq=False)
@arrays(legs_at="K", carriers_at="M", carriers="M 3", gauge="3")
class OnLegs(Kinematics):
    """A platform on legs.

    Home mode: the legs' own roots and the sign of det Jx as in the middle of the workspace, and of such poses the one that
    Newton finds from there. `all_roots` gives every choice of roots, the own ones first, as `Drives.root_choices` has them.

    Attributes:
        legs_at, carriers_at: joints of the legs and of the slides that carry legs and platform, or the part
        carriers: (M, 3) unit vectors, how each carrier moves the tool seen from the part
        workspace: of C with the travel of the carriers; tilt of the tool axis, about one axis or from z
    """

    loops: Loops
    workspace: Workspace = field()
    gauge: Floats
    axis_names: tuple[str, ...]
    rotary: tuple[bool, ...]
    legs_at: Ints
    carriers_at: Ints
    carriers: Floats
    clearance: ClearanceSizes | None = None
    tool_length: float = 0.0
    all_roots: bool = False
    jets_proved = True
    singular_names = NAMES

    @property
    def legs(self) -> Drives:
        """See `ClearanceParts`."""
        return self.loops.drives

    @property
    def leg_names(self) -> tuple[str, ...]:
        """See `ClearanceParts`."""
        return tuple(self.axis_names[j] for j in self.legs_at)

    @property
    def over_workspace(self) -> OnLegs:
        """Itself."""
        return self

    @property
    def clearance_parts(self) -> OnLegs:  # type: ignore[override]  # nothing assigns it
        """Itself."""
        return self

    @cached_property
    def branches(self) -> int:  # type: ignore[override]  # nothing assigns it
        """1, or every choice of roots"""
        return len(self.loops.drives.root_choices()) if self.all_roots else 1

    @property
    def turns_tool(self) -> tuple[bool, ...]:
        """Of a platform that tilts every leg."""
        return tuple(j in self.legs_at and self.tilts for j in range(self.joints))

    @property
    def drives_tip(self) -> tuple[bool, ...]:
        """All, arms too."""
        return (True,) * self.joints

    @property
    def tilts(self) -> bool:
        """True where the platform turns the tool axis."""
        return self.loops.turns not in ("", "c")

    # ---- inverse -------------------------------------------------------------------------------------------

    def inverse(self, tip: Floats, axis: Floats, spin: float | Floats = 0.0,
                near: Floats | None = None) -> Floats:
        """Joints (B, N, J); NaN where a leg does not reach or the platform cannot take the direction."""
        tip, axis = as_points(tip, 3, "tip"), unit(as_points(axis, 3, "axis"))
        spin = np.broadcast_to(np.asarray(spin, dtype=np.float64), len(tip))
        roots = self.legs.root_choices() if self.all_roots else self.legs.roots[None]
        q = np.empty((len(roots), len(tip), self.joints))
        for part in blocks(len(tip)):
            turn = self.turn_of(axis[part], spin[part])
            place, carried = self._split(tip[part] + self.tool_length * axis[part] - turn @ self.gauge)
            ends = self.loops.ends(place, turn)
            for k, choice in enumerate(roots):
                q[k, part][:, self.legs_at] = self.legs.solve(ends, choice)
            q[:, part][:, :, self.carriers_at] = np.where(np.isnan(q[:, part][:, :, self.legs_at[:1]]), np.nan, carried)
        return q

    def turn_of(self, axis: Floats, spin: Floats) -> Floats:
        """R (N, 3, 3) that gives the tool the axis (N, 3) and spin (N,); NaN where the platform has none."""
        near = self._within(axis)
        good = (angle_between(near, axis) <= ROUND_OFF) & ((spin == 0.0) | ("c" in self.loops.turns))
        x = tool_x(near, spin)
        turn = np.stack([x, cross(near, x), near], axis=2)
        return np.where(good[:, None, None], turn, np.nan)

    def _within(self, axis: Floats) -> Floats:
        """The nearest directions (N, 3) that the platform can take; those that it can take to the last bit."""
        if not self.tilts:
            return np.broadcast_to(UP, axis.shape)
        if len(self.loops.turns) == 1:
            return self._about_one(axis, 0 if self.loops.turns == "a" else 1)
        most, angle = self.workspace.tilt[1], angle_between(axis, np.broadcast_to(UP, axis.shape))
        flat = np.hypot(axis[:, 0], axis[:, 1])
        heading = np.where((flat > 0.0)[:, None], axis[:, :2] / np.where(flat > 0.0, flat, 1.0)[:, None], [1.0, 0.0])
        edge = np.column_stack([np.sin(most) * heading, np.full(len(axis), np.cos(most))])
        return np.where((angle > most + ROUND_OFF)[:, None], edge, axis)

    def _about_one(self, axis: Floats, about: int) -> Floats:
        side, sign = (1, -1.0) if about == 0 else (0, 1.0)
        tilt = np.arctan2(sign * axis[:, side], axis[:, 2])
        low, high = self.workspace.tilt
        held = np.clip(tilt, low, high)
        nearest = np.zeros(axis.shape)
        nearest[:, side], nearest[:, 2] = sign * np.sin(held), np.cos(held)
        keep = (np.abs(axis[:, about]) <= ROUND_OFF) & (tilt >= low - ROUND_OFF) & (tilt <= high + ROUND_OFF)
        return np.where(keep[:, None], axis, nearest)

    def _split(self, point: Floats) -> tuple[Floats, Floats]:
        """(C (N, 3), travel of the carriers (N, M)) that add up to a point (N, 3); NaN where none do."""
        moves = self._moves
        if moves.shape == (3, 3) and not len(self.carriers):
            return point, np.empty((len(point), 0))
        parts = point @ np.linalg.pinv(moves).T
        off = np.abs(parts @ moves.T - point).max(axis=1, initial=0.0)
        free = moves.shape[1] - len(self.carriers)
        place = np.where((off <= ASIDE)[:, None], parts[:, :free] @ moves[:, :free].T, np.nan)
        return place, parts[:, free:]

    @cached_property
    def _moves(self) -> Floats:
        """(3, F): translations of the platform, then the carriers."""
        linear = self.loops.basis[:3]
        return np.column_stack([linear[:, linear.any(axis=0)], self.carriers.T])

    # ---- forward -------------------------------------------------------------------------------------------

    @cached_property
    def home(self) -> tuple[Floats, Floats, Floats]:
        """(C (3,), R (3, 3), joints of the legs (K,)) in the middle of the workspace, level or nearest to it."""
        place, _ = self._split(self.workspace.middle[None])
        if np.isnan(place).any():
            place = (self.workspace.middle * (self.loops.basis[:3].any(axis=1)))[None]
        turn = self._level
        q = self.legs.solve(self.loops.ends(place, turn), self.legs.roots)
        return place[0], turn[0], q[0]

    @property
    def _level(self) -> Floats:
        """(1, 3, 3): the turn nearest to none."""
        axis = self._within(UP[None])
        return self.turn_of(axis, np.zeros(1))

    @cached_property
    def _side(self) -> float:
        place, turn, q = self.home
        return float(np.sign(self.loops.side(place[None], turn[None], q[None])[0]))

    def _platform(self, q: Floats, near: Floats | None = None) -> PlatformPose:
        """(C, R) of joints q (N, J) in the mode nearest the pose `near` (6,) or (N, 6), else the home mode; NaN without
        one."""
        q = as_points(q, self.joints, "q")
        place, turn = np.empty((len(q), 3)), np.empty((len(q), 3, 3))
        for part in blocks(len(q)):
            hint = near[part] if near is not None and near.ndim == 2 else near
            place[part], turn[part] = self._solved(q[part], hint)
        return place, turn

    def _solved(self, q: Floats, near: Floats | None) -> PlatformPose:
        own = q[:, self.legs_at]
        n = len(q)
        if near is None:
            start = np.broadcast_to(self.home[0], (n, 3)), np.broadcast_to(self.home[1], (n, 3, 3))
        else:
            start = self._near(np.broadcast_to(near, (n, 6)), q)
        place, turn, closed = self.loops.newton(own, *start)
        good = closed & (self._at_home(place, turn, own) if near is None else True)
        rest = np.flatnonzero(~good & np.isfinite(own).all(axis=1))
        if len(rest):
            place[rest], turn[rest], good[rest] = self._from_home(own[rest])
        good &= np.isfinite(q).all(axis=1)
        return np.where(good[:, None], place, np.nan), np.where(good[:, None, None], turn, np.nan)

    def _near(self, pose: Floats, q: Floats) -> PlatformPose:
        axis = self._within(unit(pose[:, 3:]))
        turn = self.turn_of(axis, np.zeros(len(axis)))
        place = pose[:, :3] + self.tool_length * axis - turn @ self.gauge - q[:, self.carriers_at] @ self.carriers
        return place * self.loops.basis[:3].any(axis=1), turn

    def _from_home(self, own: Floats) -> tuple[Floats, Floats, Bools]:
        """The same by small steps from the home joints, where no larger one leads to the home mode."""
        n, (place, turn, q0) = len(own), self.home
        place, turn, good = np.tile(place, (n, 1)), np.tile(turn, (n, 1, 1)), np.ones(n, dtype=np.bool_)
        for share in np.linspace(0.0, 1.0, PARTS + 1)[1:]:
            place, turn, closed = self.loops.newton(q0 + share * (own - q0), place, turn)
            good &= closed
        return place, turn, good & self._at_home(place, turn, own)

    def _at_home(self, place: Floats, turn: Floats, own: Floats) -> Bools:
        """True (N,) where a pose is of the home mode: roots, sign of det Jx, tool above the platform."""
        jx, rods = self.loops.matrix_at(place, turn, own)
        side = np.linalg.det(np.nan_to_num(jx)) * self._side > 0.0
        return np.asarray(side & self.legs.own(rods, own) & (turn[:, 2, 2] > 0.0))

    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip, axis) (N, 3) of joints q (N, J), see the base class."""
        place, turn = self._platform(q, near)
        return self._tip(place, turn, q), turn[:, :, 2]

    def _tip(self, place: Floats, turn: Floats, q: Floats) -> Floats:
        shift = np.asarray(q)[:, self.carriers_at] @ self.carriers
        return np.asarray(place + shift + turn @ (self.gauge - self.tool_length * UP), dtype=np.float64)

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip, axis, spin) of joints q (N, J), see the base class."""
        place, turn = self._platform(q, near)
        return self._tip(place, turn, q), turn[:, :, 2], spin_about(turn[:, :, 2], turn[:, :, 0])

    def at_tip(self, tip: Floats, q: Floats, solved: Ints) -> Floats:
        """See the base class: the inverse, where no joint turns the tool."""
        if self.tilts:
            return super().at_tip(tip, q, solved)
        return np.asarray(self.inverse(tip, np.broadcast_to(UP, tip.shape))[0])

    def with_tool(self, length: float) -> Self:
        """The same machine at the tip of a tool of that length (mm)."""
        return replace(self, tool_length=float(length))

    def nearest_axis(self, axis: Floats) -> Floats:
        """See the base class."""
        return np.array(self._within(as_points(axis, 3, "axis")))

    def singular(self, q: Floats) -> Bools:
        """False (N,): the spin is asked for, not free."""
        return np.zeros(len(q), dtype=np.bool_)

    # ---- geometric errors ----------------------------------------------------------------------------------

    @property
    def axes_with_errors(self) -> tuple[str, ...]:
        """The carriers."""
        return tuple(self.axis_names[j] for j in self.carriers_at)

    def with_errors(self, forms: ErrorForms[ErrorForm]) -> ErrorForm:
        """See the base class."""
        return forms.legs(self)

    def axis_line(self, letter: str) -> tuple[Floats, Floats]:
        """See the base class: of carriers.

        Raises:
            ValueError: of any other axis.
        """
        if letter not in self.axes_with_errors:
            raise ValueError(f"{letter} drives a leg, it has no line of its own")
        return np.array(self.carriers[self.axes_with_errors.index(letter)]), np.zeros(3)

    def joints_at(self, platform: Floats, turn: Floats) -> Floats:
        """Joints (N, J) of places and tilts of the platform (N, 4), as `RodPlatform` has them; `turn` (N, 0).

        A platform that turns in every direction tilts in another one at every place, GOLDEN rad farther each.
        """
        tilt, heading = platform[:, 3], np.full(len(platform), 0.0 if self.loops.turns == "b" else -0.5 * np.pi)
        if self.loops.turns == "abc":
            heading = GOLDEN * np.arange(len(platform))
        s = np.sin(tilt)
        axis = np.column_stack([s * np.cos(heading), s * np.sin(heading), np.cos(tilt)])
        axis = self._within(axis)
        gauge = self.turn_of(axis, np.zeros(len(axis))) @ self.gauge
        return np.asarray(self.inverse(platform[:, :3] + gauge - self.tool_length * axis, axis)[0])

    # ---- rates, bounds -------------------------------------------------------------------------------------

    def twist_jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """(v at the tip, omega) per joint rate (N, 6, J)."""
        return self._twist(q, near)[0]

    def _twist(self, q: Floats, near: Floats | None) -> tuple[Floats, Floats]:
        """The same, and R (N, 3, 3)."""
        q = as_points(q, self.joints, "q")
        place, turn = self._platform(q, near)
        result = np.zeros((len(q), 6, self.joints))
        result[:, :, self.legs_at] = self.loops.rates(place, turn, q[:, self.legs_at])
        arm = turn @ (self.gauge - self.tool_length * UP)
        result[:, :3] += np.cross(result[:, 3:], arm[:, :, None], axis=1)
        result[:, :3, self.carriers_at] = self.carriers.T
        return result, turn

    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """d(tip, axis)/dq (N, 6, J): the axis turns with omega."""
        twist, turn = self._twist(q, near)
        return np.concatenate([twist[:, :3], np.cross(twist[:, 3:], turn[:, :, 2:], axis=1)], axis=1)

    def jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        """See the base class."""
        return by_parts(self._jets, q0, q1)

    def _jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        middle, step = 0.5 * (q0 + q1), q1 - q0
        place, turn = self._platform(middle)
        jets = MovingLoops(self.loops, place, turn, middle[:, self.legs_at], step[:, self.legs_at]).jets()
        shift, moved = (list((v[:, self.carriers_at] @ self.carriers).T) for v in (middle, step))
        return (jets.point(self.gauge - self.tool_length * UP) + TaylorVector(shift, moved),
                jets.direction(UP) if self.tilts else TaylorVector(UP.tolist()))

    # ---- singular positions, clearances --------------------------------------------------------------------

    def singular_distance(self, q: Floats) -> Floats:
        """See the base class, and `singular_distance.py`."""
        return distance(self._unit_free, q)

    def singular_distance_between(self, q: Floats) -> Floats:
        """See the base class."""
        return distance_between(self._unit_free, q)

    def _unit_free(self, q: Floats) -> tuple[Floats, Floats]:
        own = q[:, self.legs_at]
        jx, rods = self.loops.matrix_at(*self._platform(q), own)
        return jx / self.legs.spans(own)[:, :, None], self.legs.transmission(rods, own)

    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """Where the parts are at joints q (N, J): seen from the carriers, but for the place that the workspace is about."""
        place, turn = self._platform(q, near)
        shift = np.asarray(q)[:, self.carriers_at] @ self.carriers
        axis = turn[:, :, 2]
        tilt = np.arctan2(-axis[:, 1], axis[:, 2]) if self.loops.turns == "a" else (
            np.arctan2(axis[:, 0], axis[:, 2]) if self.loops.turns == "b" else angle_between(
                axis, np.broadcast_to(UP, axis.shape)))
        return ClearanceGeometry(place + shift, tilt, self.legs.feet(q[:, self.legs_at]), self.loops.ends(place, turn),
                                 place + turn @ self.gauge, axis, turn)

    def middle_rig(self) -> ClearanceGeometry:
        """The same in the middle of the workspace, carriers at 0."""
        q = np.zeros((1, self.joints))
        q[:, self.legs_at] = self.home[2]
        return self.rig(q)
