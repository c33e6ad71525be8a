"""Poses of a platform on legs: joints of places and turns, places and turns of joints, in the home mode or in all."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from machines.kinematics.base import Kinematics, as_points
from machines.kinematics.clearance_geometry import ClearanceSizes
from machines.kinematics.columns import blocks
from machines.kinematics.frames import spin_about, tool_x
from machines.kinematics.legs.attitudes import ROUND_OFF, nearest_directions
from machines.kinematics.legs.coupled import PosesAsked, across_of, standing
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import Loops, PlatformPose
from machines.kinematics.legs.one_turn import OneTurn
from machines.kinematics.singular_distance import NAMES
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.rotations import angle_between, cross, lengths, unit, wrap
from toolpaths.shapes import arrays

UP = np.array([0.0, 0.0, 1.0])
ASIDE = 1e-9
"""mm that a point may lie off what the slides and the platform can reach"""
PARTS = 16
"""of the path from the home joints, where one Newton does not find the home mode"""
SPINS = np.deg2rad([0.0, -20.0, 20.0, -40.0, 40.0, -60.0, 60.0, -80.0, 80.0])
FOLLOWS = 1e-9
"""rad that a spin may differ by from the one that follows"""
FAR = 40.0
"""mm that a rod misses its length by: the platform may have another spin than was thought"""

@dataclass(frozen=True, eq=False)
@arrays(legs_at="K", carriers_at="M", carriers="M 3", gauge="3")
class PosesOfLegs(Kinematics):
    """Where a platform on legs stands: inverse and forward, without rates.

    Home mode: the legs' own roots and the sign of det Jx as in the middle of the workspace, and of such poses the one that
    Newton finds from there; of a platform that does not turn, which stands in one of two places, the sign alone. `all_roots`
    gives every choice of roots, the own ones first, as `Drives.root_choices` has them.

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
    spins: tuple[float, ...] = ()
    singular_names = NAMES

    @property
    def legs(self) -> Drives:
        """See `ClearanceParts`."""
        return self.loops.drives

    @cached_property
    def branches(self) -> int:  # type: ignore[override]  # nothing assigns it
        """1, or every choice of roots, for each of `spins` (rad; () 0 alone)"""
        return (len(self.loops.drives.root_choices()) if self.all_roots else 1) * max(len(self.spins), 1)

    @cached_property
    def one_turn(self) -> OneTurn | None:
        """The platform where it has one turn and all translations: such have closed forms."""
        whole = self.loops.freedoms[:3] == ("x", "y", "z") and len(self.loops.turns) == 1
        return OneTurn(self.loops, self.workspace) if whole else None

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
        return self.joints_with(tip, axis, spin, None)

    def joints_with(self, tip: Floats, axis: Floats, spin: float | Floats, given: Floats | None) -> Floats:
        """The same with the carriers at `given` (N, M) where they are redundant; None: with the platform at rest."""
        tip, axis = as_points(tip, 3, "tip"), as_points(axis, 3, "axis")
        spin = np.broadcast_to(np.asarray(spin, dtype=np.float64), len(tip))
        roots = self.legs.root_choices() if self.all_roots else self.legs.roots[None]
        q = np.empty((len(roots), len(tip), self.joints))
        for part in blocks(len(tip)):
            ends, carried = self._ends(tip[part], axis[part], spin[part], None if given is None else given[part])
            for k, choice in enumerate(roots):
                q[k, part][:, self.legs_at] = self.legs.solve(ends, choice)
            q[:, part][:, :, self.carriers_at] = np.where(np.isnan(q[:, part][:, :, self.legs_at[:1]]), np.nan, carried)
        return q

    def _ends(self, tip: Floats, axis: Floats, spin: Floats, given: Floats | None) -> tuple[Floats, Floats]:
        """(platform joints (N, K, 3), travel of the carriers (N, M)) of a tip, axis and spin; NaN where there are none."""
        if self.loops.holds is not None:
            place, turn, carried = self.standing(tip, axis, self.gauge - self.tool_length * UP, spin, given)
            if not self.axis_asked:
                place = np.where((angle_between(turn[:, :, 2], unit(axis)) <= FOLLOWS)[:, None], place, np.nan)
            return self.loops.ends(place, turn), carried
        if self.loops.closed_form:
            up = (np.hypot(axis[:, 0], axis[:, 1]) <= ROUND_OFF * axis[:, 2]) & (axis[:, 2] > 0.0) & (spin == 0.0)
            tip = np.where(up[:, None], tip, np.nan)
            place, carried = self._split(tip + (self.tool_length * UP - self.gauge), given)
            return place[:, None, :] + self.loops.joints, carried
        axis = unit(axis)
        turn = self.turn_of(axis, spin)
        place, carried = self._split(tip + self.tool_length * axis - turn @ self.gauge, given)
        return self.loops.ends(place, turn), carried

    def standing(self, target: Floats, axis: Floats, arm: Floats, spin: Floats,
                 given: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(C (N, 3), R (N, 3, 3), travel of the carriers (N, M)) that put the point `arm` (3,) of a platform with holds at
        `target` (N, 3) and its z along `axis` (N, 3); NaN where nothing does, or with another spin (N,) than follows.

        Redundant carriers as of `_split`: they come with legs on rings, whose turn does not ask where they stand."""
        axis = unit(axis)
        near = self._within(axis)
        asked = PosesAsked(target, arm, near if self.axis_asked else None, self._across)
        start = np.tile(self.home[1], (len(axis), 1, 1))
        if self.axis_asked:
            x = tool_x(near, np.zeros(len(axis)))
            start = np.stack([x, cross(near, x), near], axis=2)
        middle = self.home[0][None], self.home[1][None]
        place, turn, closed = standing(self.loops, asked, (target - start @ arm, start), middle)
        off = wrap(spin - spin_about(near, turn[:, :, 0]))
        good = closed & (turn[:, 2, 2] > 0.0) & ((spin == 0.0) | (np.abs(off) <= FOLLOWS))
        if self.axis_asked:
            good &= angle_between(near, axis) <= ROUND_OFF
        place = np.where(good[:, None], place, np.nan)
        if self.carried_twice:
            place, carried = self._split(place, given)
        else:
            carried = (target - place - turn @ arm) @ np.linalg.pinv(self.carriers) if len(self.carriers) else place[:, :0]
        return place, np.where(good[:, None, None], turn, np.nan), carried

    @property
    def axis_asked(self) -> bool:
        """False of a platform whose turns all follow from its place."""
        return not self.loops.free or bool(set(self.loops.free) & set("abc"))

    def posed(self, place: Floats, axis: Floats, spin: Floats) -> PlatformPose:
        """(C (N, 3), R (N, 3, 3)) with the reference point, carried, at `place` (N, 3) and z along `axis` (N, 3)."""
        if self.loops.holds is not None:
            return self.standing(place, axis, np.zeros(3), spin, self._at_rest(place))[:2]
        return place * self.loops.basis[:3].any(axis=1), self.turn_of(axis, spin)

    def turn_of(self, axis: Floats, spin: Floats) -> Floats:
        """R (N, 3, 3) that gives the tool the axis (N, 3) and spin (N,); NaN where the platform has none."""
        if self.loops.holds is not None:
            return self.posed(self.workspace.middle + 0.0 * axis, axis, spin)[1]
        near = self._within(axis)
        good = (angle_between(near, axis) <= ROUND_OFF) & ((spin == 0.0) | ("c" in self.loops.turns))
        x = tool_x(near, spin)
        turn = np.stack([x, cross(near, x), near], axis=2)
        return np.where(good[:, None, None], turn, np.nan)

    def _within(self, axis: Floats) -> Floats:
        """The nearest directions (N, 3) that the platform can take; those that it can take to the last bit."""
        return nearest_directions(self.loops.turns, self.workspace.tilt, axis)

    def _split(self, point: Floats, given: Floats | None = None) -> tuple[Floats, Floats]:
        """(C (N, 3), travel of the carriers (N, M)) that add up to a point (N, 3); NaN where none do.

        Redundant carriers stand where they are `given`, else where they bring the platform to rest in the middle of its
        workspace."""
        moves = self._moves
        if moves.shape == (3, 3) and not len(self.carriers):
            return point, np.empty((len(point), 0))
        if self.carried_twice:
            carried = (point - self.workspace.middle) @ np.linalg.pinv(self.carriers) if given is None else given
            return point - carried @ self.carriers, carried
        parts = point @ np.linalg.pinv(moves).T
        off = np.abs(parts @ moves.T - point).max(axis=1, initial=0.0)
        free = moves.shape[1] - len(self.carriers)
        place = np.where((off <= ASIDE)[:, None], parts[:, :free] @ moves[:, :free].T, np.nan)
        return place, parts[:, free:]

    @cached_property
    def carried_twice(self) -> bool:
        """True where carriers move the tool where the platform moves it too: how a path is split between them is free."""
        return bool(len(self.carriers)) and self.loops.translations.shape[1] == 3

    @cached_property
    def _across(self) -> Floats:
        """(E, 3): directions in which a platform with holds goes by itself; all with redundant carriers."""
        return np.eye(3) if self.carried_twice else across_of(self.carriers)

    def _at_rest(self, points: Floats) -> Floats | None:
        """Redundant carriers at 0 (N, M) of N points; None without any."""
        return np.zeros((len(points), len(self.carriers))) if self.carried_twice else None

    @cached_property
    def _moves(self) -> Floats:
        """(3, F): translations of the platform, then the carriers."""
        return np.column_stack([self.loops.translations, self.carriers.T])

    @cached_property
    def plane(self) -> Floats | None:
        """See the base class: where platform and carriers move along two directions."""
        moves = self._moves
        return None if moves.shape[1] > 2 else unit(cross(moves[None, :, 0], moves[None, :, 1]))[0]

    # ---- forward -------------------------------------------------------------------------------------------

    @cached_property
    def home(self) -> tuple[Floats, Floats, Floats]:
        """(C (3,), R (3, 3), joints of the legs (K,)) in the middle of the workspace, level or nearest to it."""
        if self.loops.holds is not None:
            middle = self.workspace.middle[None]
            level = self._within(UP[None]) if self.axis_asked else None
            asked = PosesAsked(middle, np.zeros(3), level, self._across)
            place, turn, closed = standing(self.loops, asked, (middle, np.eye(3)[None]), (middle, np.eye(3)[None]))
            q = self.legs.solve(self.loops.ends(place, turn), self.legs.roots)
            return place[0] if closed[0] else place[0] * np.nan, turn[0], q[0]
        place, _ = self._split(self.workspace.middle[None])
        if np.isnan(place).any():
            place = (self.workspace.middle * (self.loops.basis[:3].any(axis=1)))[None]
        turn = self._level
        q = self.legs.solve(self.loops.ends(place, turn), self.legs.roots)
        return place[0], turn[0], q[0]

    @property
    def _level(self) -> Floats:
        """(1, 3, 3): the turn nearest to none."""
        return self.turn_of(self._within(UP[None]), np.zeros(1))

    @cached_property
    def _side(self) -> float:
        place, turn, q = self.home
        return float(np.sign(self.loops.side(place[None], turn[None], q[None])[0]))

    def _platform(self, q: Floats, near: Floats | None = None) -> PlatformPose:
        """(C, R) of joints q (N, J) in the mode nearest the pose `near` (6,) or (N, 6), else the home mode, or NaN."""
        q = as_points(q, self.joints, "q")
        if self.loops.closed_form:
            place = self._modes(q, near)[0]
            return place, np.where(np.isnan(place[:, :1, None]), np.nan, np.eye(3))
        if (one := self.one_turn) is not None:
            start = None
            if near is not None:
                place, turn = self._near(np.broadcast_to(near, (len(q), 6)), q)
                start = np.column_stack([place, one.turn_of(turn)])
            p = one.forward(q[:, self.legs_at], start)
            p = np.where(np.isfinite(q).all(axis=1, keepdims=True), p, np.nan)
            return p[:, :3], one.turn(p[:, 3])
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

    def _modes(self, q: Floats, near: Floats | None = None) -> Floats:
        """Both places (2, N, 3) of a platform that does not turn, the home mode first or the one nearest the pose `near`."""
        places = np.empty((2, len(q), 3))
        for part in blocks(len(q)):
            foot, out = self.loops.places(q[part][:, self.legs_at])
            places[:, part] = foot + self._side * out, foot - self._side * out
        places[:, ~np.isfinite(q).all(axis=1)] = np.nan
        if near is not None:
            wanted = np.broadcast_to(near, (len(q), 6))[:, :3] + self.tool_length * UP - self.gauge
            wanted = (wanted - q[:, self.carriers_at] @ self.carriers) * self.loops.basis[:3].any(axis=1)
            far = np.linalg.norm(places - wanted, axis=2)
            swap = far[1] < far[0]
            places[:, swap] = places[::-1, swap]
        return places

    def _near(self, pose: Floats, q: Floats) -> PlatformPose:
        """C and R from which Newton starts: of a platform that turns in every direction with the spin of SPINS whose rods
        come nearest to their lengths, where those of none are far off."""
        axis = self._within(unit(pose[:, 3:]))
        tip = pose[:, :3] - q[:, self.carriers_at] @ self.carriers
        place, turn = self._spun(tip, axis, np.zeros(len(axis)))
        if self.loops.turns == "abc" and self.loops.holds is None:
            own = q[:, self.legs_at]
            far = np.flatnonzero(self._misfit(own, place, turn) > FAR)
            if len(far):
                tried = [self._spun(tip[far], axis[far], np.full(len(far), spin)) for spin in SPINS]
                best = np.argmin([self._misfit(own[far], *one) for one in tried], axis=0)
                place[far], turn[far] = (np.stack(each)[best, np.arange(len(far))] for each in zip(*tried, strict=True))
        return place * self.loops.basis[:3].any(axis=1), turn

    def _spun(self, tip: Floats, axis: Floats, spin: Floats) -> PlatformPose:
        """(C, R) of a tip (N, 3) seen from the carriers, an axis (N, 3) that the platform can take, and a spin (N,)."""
        if self.loops.holds is not None:
            return self.standing(tip, axis, self.gauge - self.tool_length * UP, spin, self._at_rest(tip))[:2]
        turn = self.turn_of(axis, spin)
        return tip + self.tool_length * axis - turn @ self.gauge, turn

    def _misfit(self, own: Floats, place: Floats, turn: Floats) -> Floats:
        """(N,) mm by which the worst rod misses its length at joints (N, K) of the legs."""
        rods = self.loops.ends(place, turn) - self.legs.feet(own)
        return np.asarray(np.abs(lengths(rods) - self.legs.spans(own)).max(axis=1), dtype=np.float64)

    def _from_home(self, own: Floats) -> tuple[Floats, Floats, Bools]:
        """The same by small steps from the home joints, where no larger one leads to the home mode."""
        n, (place, turn, q0) = len(own), self.home
        place, turn, good = np.tile(place, (n, 1)), np.tile(turn, (n, 1, 1)), np.ones(n, dtype=np.bool_)
        for share in np.linspace(0.0, 1.0, PARTS + 1)[1:]:
            place, turn, closed = self.loops.newton(q0 + share * (own - q0), place, turn)
            good &= closed
        return place, turn, good & self._at_home(place, turn, own)

    def stands_at(self, q: Floats) -> bool:
        """Whether the legs meet at joints q (J,) as the machine is assembled: home mode and own roots."""
        place, turn = self._platform(q[None])
        own = q[None, self.legs_at]
        return bool(self.legs.own(self.loops.ends(place, turn) - self.legs.feet(own), own)[0])

    def _at_home(self, place: Floats, turn: Floats, own: Floats) -> Bools:
        """True (N,) where a pose is of the home mode: roots, sign of det Jx, tool above the platform."""
        jx, rods = self.loops.matrix_at(place, turn, own)
        side = np.linalg.det(np.nan_to_num(jx)) * self._side > 0.0
        return np.asarray(side & self.legs.own(rods, own) & (turn[:, 2, 2] > 0.0))

    def forward(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(tip, axis) (N, 3) of joints q (N, J), see the base class."""
        if self.loops.closed_form:
            q = as_points(q, self.joints, "q")
            place = self._modes(q, near)[0]
            return self._tip(place, None, q), np.where(np.isnan(place[:, :1]), np.nan, UP)
        place, turn = self._platform(q, near)
        return self._tip(place, turn, q), turn[:, :, 2]

    def _tip(self, place: Floats, turn: Floats | None, q: Floats) -> Floats:
        """`turn` None: a platform that does not turn."""
        shift = np.asarray(q)[:, self.carriers_at] @ self.carriers
        arm = self.gauge - self.tool_length * UP
        return np.asarray(place + shift + (arm if turn is None else turn @ arm), dtype=np.float64)

    def pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats, Floats]:
        """(tip, axis, spin) of joints q (N, J), see the base class."""
        place, turn = self._platform(q, near)
        return self._tip(place, turn, q), turn[:, :, 2], spin_about(turn[:, :, 2], turn[:, :, 0])

    def at_tip(self, tip: Floats, q: Floats, solved: Ints) -> Floats:
        """See the base class: the inverse, where no joint turns the tool."""
        if self.tilts:
            return super().at_tip(tip, q, solved)
        return np.asarray(self.inverse(tip, np.broadcast_to(UP, tip.shape))[0])

    def with_all_roots(self) -> Self:
        """See the base class."""
        return replace(self, all_roots=True)

    def made_with_tool(self, length: float) -> Self:
        """The same machine at the tip of a tool of that length (mm)."""
        return replace(self, tool_length=float(length))

    def nearest_axis(self, axis: Floats) -> Floats:
        """See the base class."""
        return np.array(self._within(as_points(axis, 3, "axis")))

    def singular(self, q: Floats) -> Bools:
        """False (N,): the spin is asked for, not free."""
        return np.zeros(len(q), dtype=np.bool_)
