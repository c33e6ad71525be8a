"""A platform on legs with its errors, of any drives and freedoms: through the exact closure of its rods (`leg_frame.py`).

w are the nominal tip, the turns that the platform gives the tool axis, and, of one that turns about z, the spin, which is
held, as redundant carriers are. Slides that carry legs and platform take the errors of a serial machine's slides, the
spindle those of a spindle.
"""

from __future__ import annotations

from dataclasses import field
from functools import cached_property

import numpy as np

from machines.geometric_error.actual.actual import EDGE, Actual, ToolPlace
from machines.geometric_error.actual.axis_motion import Line, actual_line, actual_tool, along, driven
from machines.geometric_error.actual.error_rates import ErrorRates, gap_slopes_fit, sizes_of
from machines.geometric_error.actual.leg_frame import LegFrame, leg_frame
from machines.geometric_error.actual.leg_rates import bounded, errors_in_motion
from machines.geometric_error.actual.rod_rates import tool_rates
from machines.geometric_error.actual.rods import RodErrors
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.actual.series_rates import ToolSide, axes_there, series_rates
from machines.geometric_error.actual.transforms import carried
from machines.geometric_error.tables.names import SPINDLE, parse
from machines.kinematics import columns
from machines.kinematics.chain import Joint
from machines.kinematics.columns import Columns
from machines.kinematics.frames import tool_x
from machines.kinematics.legs.on_legs import OnLegs
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass

UP = np.array([0.0, 0.0, 1.0])
SERIES = 1e-4
"""rad^2 below which sine and cosine of a turn are taken by their series"""


@dataclass(frozen=True, eq=False)
class ActualLegs(Actual):
    """A machine of kind "legs" with errors."""

    kinematics: OnLegs
    rods: RodErrors
    chain: SerialErrors = field(default_factory=SerialErrors)
    """errors of the carriers and of the spindle"""

    @property
    def turns(self) -> int:  # type: ignore[override]  # nothing assigns it
        """0, 1 of a platform that tilts about one axis, 2 of one that turns in every direction."""
        return min(len(self.kinematics.loops.turns), 2) if self.kinematics.tilts else 0

    @property
    def held(self) -> int:
        """The spin, of a platform that turns about z, and carriers that are redundant."""
        return self._spins + (len(self.kinematics.carriers) if self.kinematics.carried_twice else 0)

    @property
    def _spins(self) -> int:
        """1 of a platform that turns about z by itself."""
        return int("c" in self.kinematics.loops.turns and self.kinematics.loops.holds is None)

    @cached_property
    def frame(self) -> LegFrame:
        """Nominal rods."""
        return leg_frame(self.kinematics)

    @cached_property
    def lines(self) -> list[Line]:
        """The carriers, from the part to the legs, as their errors leave them."""
        kin = self.kinematics
        return [actual_line(Joint(kin.axis_names[j], False, u, np.zeros(3)), int(j), self.chain)
                for j, u in zip(kin.carriers_at, kin.carriers, strict=True)]

    @property
    def any(self) -> bool:
        """False where every parameter is 0: the machine is the nominal one, to the last digit."""
        return bool(self.rods.values.any() or self.chain.values.any())

    # ---- coordinates ---------------------------------------------------------------------------------------

    def coordinates(self, q: Floats, near: Floats | None = None) -> Floats:
        """See the base class."""
        tip, axis, spin = self.kinematics.pose(q, near)
        flat = np.hypot(axis[:, 0], axis[:, 1])
        grow = np.where(flat > 0.0, np.arctan2(flat, axis[:, 2]) / np.where(flat > 0.0, flat, 1.0), 1.0)
        turned = np.column_stack([-axis[:, 1] * grow, axis[:, 0] * grow])
        kin, spins = self.kinematics, spin[:, None][:, : self._spins]
        carried = q[:, kin.carriers_at] if kin.carried_twice else q[:, :0]
        return np.column_stack([tip, turned[:, self._about], spins, carried])

    @property
    def _about(self) -> list[int]:
        """Which of x and y the turns are about."""
        return [i for i, name in enumerate("ab") if name in self.kinematics.loops.turns]

    def _turn(self, w: Floats) -> tuple[Floats, Floats, Floats]:
        """(rotation vector (N, 2) about x and y, sin t / t (N,), cos t (N,)) of the tool axis."""
        vector = np.zeros((len(w), 2))
        vector[:, self._about] = w[:, 3:3 + self.turns]
        size = np.hypot(vector[:, 0], vector[:, 1])
        return vector, np.where(size > 0.0, np.sin(size) / np.where(size > 0.0, size, 1.0), 1.0), np.cos(size)

    def _pose(self, w: Floats) -> tuple[Floats, Floats, Floats]:
        """Nominal (tip (N, 3), axis (N, 3), spin (N,))."""
        vector, share, cos = self._turn(w)
        axis = np.column_stack([share * vector[:, 1], -share * vector[:, 0], cos])
        return w[:, :3], axis, w[:, 3 + self.turns] if self._spins else np.zeros(len(w))

    def joints(self, w: Floats) -> Floats:
        """See the base class."""
        kin = self.kinematics
        carried = w[:, w.shape[1] - len(kin.carriers):] if kin.carried_twice else None
        return np.asarray(kin.joints_with(*self._pose(w), carried)[0])

    def rates(self, w: Floats) -> Floats:
        """See the base class: the turns move the axis about the tip."""
        vector, share, cos = self._turn(w)
        square = (vector * vector).sum(axis=1)
        small = square < SERIES
        bend = np.where(small, -1.0 / 3.0 + square / 30.0, (cos - share) / np.where(small, 1.0, square))
        x, y = vector.T
        turns = np.stack([np.column_stack([bend * x * y, -share - bend * x * x, -share * x]),
                          np.column_stack([share + bend * y * y, -bend * x * y, -share * y])], axis=2)
        result = np.zeros((len(w), 6, 3 + self.turns))
        result[:, :3, :3] = np.eye(3)
        result[:, 3:, 3:] = turns[:, :, self._about][:, :, : self.turns]
        return result

    def outside(self, w: Floats, margin: float = EDGE) -> Bools:
        """See the base class; only carriers have a range."""
        return self.chain.outside(self.kinematics.axis_names, self.joints(w), margin)

    # ---- with errors ---------------------------------------------------------------------------------------

    def _platform(self, w: Floats) -> tuple[Floats, Floats, Floats]:
        """Nominal (place (N, 3), turn (N, 3, 3)) of the platform seen from the carriers, and joints (N, J)."""
        kin, q, (tip, axis, spin) = self.kinematics, self.joints(w), self._pose(w)
        if kin.loops.holds is not None:
            given = q[:, kin.carriers_at] if kin.carried_twice else None
            return *kin.standing(tip, axis, kin.gauge - kin.tool_length * UP, spin, given)[:2], q
        turn = kin.turn_of(axis, spin)
        shift = q[:, kin.carriers_at] @ kin.carriers
        return tip + kin.tool_length * axis - turn @ kin.gauge - shift, turn, q

    def place(self, w: Floats, direction: Floats | None = None) -> ToolPlace:
        """See the base class."""
        if not self.any:
            tip, axis, spin = self._pose(w)
            follows = self.kinematics.loops.holds is not None
            return tip, axis, self._platform(w)[1][:, :, 0] if follows else tool_x(axis, spin)
        kin, (place, turn, q) = self.kinematics, self._platform(w)
        place, turn = self.frame.solve(q[:, kin.legs_at], place, turn, self.rods)
        own: list[Columns] = [columns.of_one(v) for v in actual_tool(UP, kin.tool_length, self.chain)]
        own[0] = columns.plus(own[0], columns.of_one(kin.gauge))
        tool: list[Columns] = [[columns.dot(row, v) for row in np.moveaxis(turn, 0, 2)] for v in own]
        tool[0] = columns.plus(tool[0], columns.of_rows(place))
        for line in self.lines[::-1]:
            approach = 0.0 if direction is None else direction[:, line.index]
            tool = driven(line, q[:, line.index], approach, self.chain, tool)
        tip, axis, side = (columns.to_rows(v, len(w)) for v in tool)
        return tip, axis, side

    def error_rates(self, q: Floats, reach: Floats) -> ErrorRates | None:
        """See the base class; None of joints on rings, and of rods that share and change their lengths."""
        frame, kin = self.frame, self.kinematics
        if not bounded(frame) or not gap_slopes_fit(self.chain):
            return None
        place, turn, _ = self._platform(self.coordinates(q))
        own, go = q[:, kin.legs_at], reach[:, kin.legs_at]
        motions = errors_in_motion(frame, self.rods, own, (place, turn), go, not self.turns)
        tips, axes = [], []
        for motion, chain in zip(motions, (self.chain, SerialErrors()), strict=True):
            tip, axis, _ = actual_tool(UP, kin.tool_length, chain)
            tips.append(motion.turned @ (tip + kin.gauge))
            axes.append(motion.turned @ axis)
        none = np.zeros(len(q))
        tool = tool_rates(*motions, (tips[0], tips[1]), (axes[0], axes[1]), go, none, none)
        under = axes_there(self.lines, self.chain, (q, reach), place + tips[1], (tool.nominal_tip * go).sum(axis=1))
        return series_rates(tool, kin.legs_at, under, ToolSide((), sizes_of(self.chain, SPINDLE), kin.tool_length), q, reach)

    def sensitivity(self, w: Floats, direction: Floats | None = None) -> Floats:
        """See the base class: T^-1 S (E-15), carried to the tip, then the carriers' and the spindle's."""
        place, turn, q = self._platform(w)
        tip, axis, _ = self._pose(w)
        shift = q[:, self.kinematics.carriers_at] @ self.kinematics.carriers
        unit = np.tile(np.eye(3), (len(w), 1, 1))
        rods = carried(unit, tip - place - shift) @ self.frame.platform_sensitivity(
            q[:, self.kinematics.legs_at], place, turn)
        return np.concatenate([rods, self._chain_columns(tip, axis, turn, q, direction)], axis=2)

    def _chain_columns(self, tip: Floats, axis: Floats, turn: Floats, q: Floats, direction: Floats | None) -> Floats:
        """(N, 6, P) of the errors in `chain`; the reference point of a carrier travels with it and those below it."""
        unit, below, at = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3)), {}
        for line in self.lines:
            travel = q[:, line.index, None] * line.joint.direction
            at[line.joint.name] = line, below + line.reference, travel
            below = below + travel
        found = [np.zeros((len(q), 6, 0))]
        for component in self.chain.components:
            line, centre, travel = at[component.name.axis]
            approach = np.zeros(len(q)) if direction is None else direction[:, line.index]
            column = carried(unit, tip - centre - travel)[:, :, component.name.part]
            found.append(column[:, :, None] * component.curve.basis(q[:, line.index], approach)[:, None, :])
        for text in self.chain.constants:
            torsor, name = SerialErrors(constants={text: 1.0}).location(text[-1]), parse(text)
            if text[-1] == SPINDLE:
                found.append((carried(turn, -self.kinematics.tool_length * axis) @ torsor)[:, :, None])
                continue
            line, centre, travel = at[text[-1]]
            before = carried(unit, tip - centre)
            found.append((before @ along(line.joint) if name is not None and name.zero_position else
                          (before - carried(unit, tip - centre - travel)) @ torsor)[:, :, None])
        return np.concatenate(found, axis=2)
