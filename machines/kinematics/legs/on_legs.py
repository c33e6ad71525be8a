"""Any machine whose platform is carried by legs: place and turn from closed loops, drives as data, slides that carry it all.

The machine frame is the one in which the legs are given. With C the platform's reference point and R its turn, the gauge
point is C + R gauge + the travel of the carriers, the tool axis R z. A platform that turns in every direction can turn the
tool about itself too: `inverse` takes that spin, 0 unless asked for. Source of the loops: `drives.py`, `loops.py`,
`bounds.py`.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from machines.kinematics.base import ErrorForm, ErrorForms, as_points
from machines.kinematics.clearance_geometry import ClearanceGeometry
from machines.kinematics.leg_geometry import LegGeometry, pairs_of
from machines.kinematics.leg_motion import LegMotion, LegParts
from machines.kinematics.legs.attitudes import attitude, tilt_of
from machines.kinematics.legs.bounds import MovingLoops, PlatformJets
from machines.kinematics.legs.modes import found_modes, in_order
from machines.kinematics.legs.motion import leg_motion
from machines.kinematics.legs.over_workspace import OverWorkspace
from machines.kinematics.legs.poses import UP
from machines.kinematics.legs.redundancy import RedundantLegs
from machines.kinematics.legs.rods_on_slides import RodsOnSlides
from machines.kinematics.rod_loops import RodLoop, by_parts
from machines.kinematics.singular_distance import distance, distance_between
from machines.kinematics.taylor import TaylorVector
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass

GOLDEN = 2.399963
"""rad, so that no few directions repeat"""


@dataclass(frozen=True, eq=False)
class OnLegs(RedundantLegs):
    """A platform on legs with its rates, bounds, errors and clearances; attributes as of `RedundantLegs`."""

    @property
    def transmits(self) -> OverWorkspace:  # type: ignore[override]  # nothing assigns it
        """See the base class."""
        return OverWorkspace(self.loops, self.workspace, self.posed)

    @cached_property
    def on_rods(self) -> RodsOnSlides | None:  # type: ignore[override]  # nothing assigns it
        """Its rods, of a platform that only translates on three slides and whose gauge point is its reference point."""
        whole = self.legs.on_slides is not None and self.loops.freedoms == ("x", "y", "z") and not self.gauge.any() \
            and self.loops.kept is None
        return RodsOnSlides(self, self.loops.joints) if whole and not len(self.carriers) else None

    jets_proved = True

    @property
    def leg_geometry(self) -> LegGeometry:
        """See the base class."""
        of, names = self.legs, np.array(self.axis_names)
        pairs = np.zeros((len(of.lengths), 3)) if self.clearance is None else pairs_of(
            len(of.lengths), self.clearance.leg, self.clearance.shift)
        return LegGeometry(self.leg_names, of.points, of.directions, of.arms, of.lengths, of.roots, of.slide, of.arm,
                           self.loops.joints, pairs, self.loops.freedoms, self.gauge,
                           tuple(names[self.carriers_at].tolist()), self.carriers, self.workspace,
                           kept=self.loops.kept, bars=self.loops.bars, holds=self.loops.holds, free=self.loops.free,
                           rings=self.loops.rings)

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

    # ---- assembly modes ------------------------------------------------------------------------------------

    def assembly_modes(self, q: Floats) -> tuple[Floats, Floats]:
        """See the base class: both of a platform that does not turn, up to 8 of one turn; of others those that are found
        (`modes.py`)."""
        q = as_points(q, self.joints, "q")
        if (one := self.one_turn) is not None:
            poses = [(p, one.turn(p[:, 3])) for p in one.modes(q[:, self.legs_at])]
            return (np.stack([self._tip(p[:, :3], turn, q) for p, turn in poses]),
                    np.stack([np.where(np.isnan(p[:, :1]), np.nan, turn[:, :, 2]) for p, turn in poses]))
        if not self.loops.closed_form:
            return self._found_modes(q)
        tip = np.stack([self._tip(place, None, q) for place in self._modes(q)])
        return tip, np.where(np.isnan(tip), np.nan, UP)

    def _found_modes(self, q: Floats) -> tuple[Floats, Floats]:
        found = []
        for row in q:
            place, turn = found_modes(self.loops, row[self.legs_at], self.home[0])
            found.append(np.hstack([self._tip(place, turn, np.tile(row, (len(place), 1))), turn[:, :, 2]]))
        return in_order(np.hstack(self.forward(q)), found)

    @property
    def in_loops(self) -> tuple[bool, ...]:
        """All but the carriers, which take legs and platform along as they are."""
        return tuple(j not in set(self.carriers_at) for j in range(self.joints))

    def carried(self, pose: Floats, q0: Floats, q1: Floats) -> Floats:
        """See the base class: by the carriers."""
        if not len(self.carriers_at):
            return pose
        shift = (q1 - q0)[:, self.carriers_at] @ self.carriers
        return np.hstack([pose[:, :3] + shift, pose[:, 3:]])

    # ---- geometric errors ----------------------------------------------------------------------------------

    @property
    def axes_with_errors(self) -> tuple[str, ...]:
        """The carriers."""
        return tuple(self.axis_names[j] for j in self.carriers_at)

    def with_errors(self, forms: ErrorForms[ErrorForm]) -> ErrorForm:
        """See the base class: those that are `on_rods` take the errors of translating rods."""
        return forms.legs(self) if self.on_rods is None else forms.translating_rods(self)

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
        heading = GOLDEN * np.arange(len(platform), dtype=np.float64)
        axis, spin = attitude(self.loops.turns, platform[:, 3], heading)
        axis = self._within(axis)
        if self.loops.holds is not None:
            return self._joints_posed(platform[:, :3], axis, spin)
        gauge = self.turn_of(axis, spin) @ self.gauge
        at_rest = self._at_rest(axis)
        return np.asarray(self.joints_with(platform[:, :3] + gauge - self.tool_length * axis, axis, spin, at_rest)[0])

    def _joints_posed(self, place: Floats, axis: Floats, spin: Floats) -> Floats:
        """Joints (N, J) with the reference point of a platform with holds, and its carriers, at `place` (N, 3)."""
        own, turn, carried = self.standing(place, axis, np.zeros(3), spin, self._at_rest(place))
        q = np.empty((len(place), self.joints))
        q[:, self.legs_at], q[:, self.carriers_at] = self.legs.solve(self.loops.ends(own, turn), self.legs.roots), carried
        return np.where(np.isnan(q).any(axis=1, keepdims=True), np.nan, q)

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
        if not self.loops.closed_form:
            arm = turn @ (self.gauge - self.tool_length * UP)
            result[:, :3] += np.cross(result[:, 3:], arm[:, :, None], axis=1)
        result[:, :3, self.carriers_at] = self.carriers.T
        return result, turn

    def jacobian(self, q: Floats, near: Floats | None = None) -> Floats:
        """d(tip, axis)/dq (N, 6, J): the axis turns with omega."""
        twist, turn = self._twist(q, near)
        if self.loops.closed_form:
            return twist
        return np.concatenate([twist[:, :3], np.cross(twist[:, 3:], turn[:, :, 2:], axis=1)], axis=1)

    def jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        """See the base class."""
        return by_parts(self._jets, q0, q1)

    def _jets(self, q0: Floats, q1: Floats) -> tuple[TaylorVector, TaylorVector]:
        middle, step = 0.5 * (q0 + q1), q1 - q0
        place, turn = self._platform(middle)
        if self.on_rods is not None:  # the same bounds without turns
            ends = place[:, None, :] + self.loops.joints
            rods = ends - self.legs.feet(middle)
            jet, _ = RodLoop(rods, np.zeros_like(rods), self.on_rods.legs, step, False).jets(place, np.zeros(len(place)))
            return jet + TaylorVector((-self.tool_length * UP).tolist()), TaylorVector(UP.tolist())
        jets = self.moving(place, turn, middle, step)
        shift, moved = (list((v[:, self.carriers_at] @ self.carriers).T) for v in (middle, step))
        return (jets.point(self.gauge - self.tool_length * UP) + TaylorVector(shift, moved),
                jets.direction(UP) if self.tilts else TaylorVector(UP.tolist()))

    def carried_jets(self, q0: Floats, q1: Floats, tip: TaylorVector,
                     axis: TaylorVector) -> tuple[TaylorVector, TaylorVector]:
        """(point, direction) in the machine frame of ones that move in directions of the platform, the point from its
        reference point, along straight moves q0 -> q1 (N, J)."""
        if self.loops.closed_form:
            return self.with_tool(0.0)._jets(q0, q1)[0] + (tip - TaylorVector(self.gauge.tolist())), axis
        middle, step = 0.5 * (q0 + q1), q1 - q0
        jets = self.moving(*self._platform(middle), middle, step)
        shift, moved = (list((v[:, self.carriers_at] @ self.carriers).T) for v in (middle, step))
        return jets.carried(tip, 1.0) + TaylorVector(shift, moved), jets.carried(axis, 0.0)

    def platform_pose(self, q: Floats, near: Floats | None = None) -> tuple[Floats, Floats]:
        """(place (N, 3) with the travel of the carriers, turn (N, 3, 3)) of joints q (N, J); see `pose` for `near`."""
        place, turn = self._platform(q, near)
        return place + q[:, self.carriers_at] @ self.carriers, turn

    def moving(self, place: Floats, turn: Floats, middle: Floats, step: Floats) -> PlatformJets:
        """The platform along straight moves by `step` (N, J); `place`, `turn` and joints `middle` (N, J) in their middle."""
        return MovingLoops(self.loops, place, turn, middle[:, self.legs_at], step[:, self.legs_at]).jets()

    @property
    def leg_parts(self) -> LegParts | None:
        """See the base class; None of legs on rings."""
        if self.loops.rings is not None:
            return None
        of = self.legs
        return LegParts(self.legs_at, of.points, of.directions, of.lengths, of.arm, of.stretch > 0.0, self.carriers_at,
                        self.carriers, self.gauge)

    def leg_motion(self, q: Floats, rate: Floats, acceleration: Floats) -> LegMotion:
        """See the base class."""
        own = self.legs_at
        return leg_motion(self.loops, self._platform(q), (q[:, own], rate[:, own], acceleration[:, own]))

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
        return jx / self.loops.sizes(own)[:, :, None], self.legs.transmission(rods, own)

    def rig(self, q: Floats, near: Floats | None = None) -> ClearanceGeometry:
        """Where the parts are at joints q (N, J): seen from the carriers, but for the place that the workspace is about,
        which redundant carriers leave as it is."""
        place, turn = self._platform(q, near)
        shift = np.asarray(q)[:, self.carriers_at] @ self.carriers * (not self.carried_twice)
        axis, turned = turn[:, :, 2], None if self.loops.closed_form else turn
        tilt = self.one_turn.turn_of(turn) if self.loops.turns == "c" and self.one_turn else tilt_of(self.loops.turns, axis)
        return ClearanceGeometry(place + shift, tilt, self.legs.feet(q[:, self.legs_at]),
                                 self.loops.ends(place, turn), place + turn @ self.gauge, axis, turned)

    def middle_rig(self) -> ClearanceGeometry:
        """The same in the middle of the workspace, carriers at 0."""
        q = np.zeros((1, self.joints))
        q[:, self.legs_at] = self.home[2]
        return self.rig(q)
