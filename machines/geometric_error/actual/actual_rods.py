"""A Delta on slides with its errors, and platforms that tilt next to a rotary axis: through the exact closure of their rods.

The rotary axis (table under the part, or axis at the spindle) and the spindle take the errors of a serial machine's axis;
they stand before and after the platform in the chain.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import field
from functools import cached_property

import numpy as np

from machines.geometric_error.actual.actual import EDGE, Actual, ToolPlace
from machines.geometric_error.actual.axis_motion import Line, actual_line, actual_tool, along, driven
from machines.geometric_error.actual.error_rates import LARGEST_TURN, ErrorRates, gap_slopes_fit, sizes_of
from machines.geometric_error.actual.leg_frame import LegFrame, leg_frame
from machines.geometric_error.actual.leg_rates import legs_motion
from machines.geometric_error.actual.rod_rates import (
    PlatformMotion,
    ToolRates,
    platform_motion,
    tool_rates,
    with_rotary,
)
from machines.geometric_error.actual.rods import RodErrors, RodFrame, rod_frame
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.actual.transforms import carried
from machines.geometric_error.tables.names import SPINDLE, parse
from machines.kinematics import columns
from machines.kinematics.chain import Joint
from machines.kinematics.columns import Columns
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from machines.kinematics.rod_platform import RodPlatform
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import rotation

UP = np.array([0.0, 0.0, 1.0])
RODS = 6
"""that hold a platform"""


def rods_of(kinematics: OnLegs | LegsWithAxis) -> RodPlatform:
    """The rods of a machine that has them."""
    assert kinematics.on_rods is not None
    return kinematics.on_rods


@dataclass(frozen=True, eq=False)
class ActualRods(Actual):
    """What both share: the platform."""

    rods: RodErrors
    chain: SerialErrors = field(default_factory=SerialErrors)
    """errors of the rotary axis and of the spindle"""

    @property
    @abstractmethod
    def frame(self) -> RodFrame | LegFrame:
        """Nominal rods."""

    @property
    def any(self) -> bool:
        """False where every parameter is 0: the machine is the nominal one, to the last digit."""
        return bool(self.rods.values.any() or self.chain.values.any())

    @abstractmethod
    def _platform(self, w: Floats) -> tuple[Floats, Floats, Floats]:
        """Nominal (place (N, 3), turn (N, 3, 3)) of the platform and the slides (N, K) that hold it."""

    def _carried(self, w: Floats, point: list[Columns]) -> list[Columns]:
        """A point and directions of the platform by the platform as it really stands."""
        place, turned, slides = self._platform(w)
        place, turned = self.frame.solve(slides, place, turned, self.rods)
        rows = np.moveaxis(turned, 0, 2)
        result: list[Columns] = [[columns.dot(row, v) for row in rows] for v in point]
        return [columns.plus(result[0], columns.of_rows(place)), *result[1:]]

    def _motions(self, w: Floats, reach: Floats) -> tuple[PlatformMotion, PlatformMotion]:
        """The platform's motion with errors and without, while slides go by up to `reach` (N, K)."""
        (place, turned, slides), frame = self._platform(w), self.frame
        found = frame.solve(slides, place, turned, self.rods)
        if isinstance(frame, LegFrame):
            return (legs_motion(frame.loops(self.rods), frame.leg, slides, found, reach),
                    legs_motion(frame.loops(frame.zero), frame.leg, slides, (place, turned), reach))
        none = RodErrors.none(self.rods.legs, self.rods.rods, self.rods.pairs)
        return (platform_motion(frame, self.rods, slides, found, reach),
                platform_motion(frame, none, slides, (place, turned), reach))

    def _tool_rates(self, w: Floats, reach: Floats, tools: tuple[list[Columns], list[Columns]],
                     arm_reach: Floats, axis_reach: Floats) -> ToolRates:
        """Of points and axes of the platform, with errors and without."""
        actual, nominal = self._motions(w, reach)
        nominal = nominal if self.turns else nominal.translating()
        arms, axes = zip(*([np.einsum("nij,nj->ni", motion.turned, columns.to_rows(v, len(w))) for v in tool[:2]]
                           for motion, tool in ((actual, tools[0]), (nominal, tools[1]))), strict=True)
        return tool_rates(actual, nominal, arms, axes, reach, arm_reach, axis_reach)

    def _twist(self, w: Floats) -> tuple[Floats, Floats]:
        """(platform's place (N, 3), its motion per rod parameter (N, 6, P)), machine frame."""
        place, turned, slides = self._platform(w)
        return place, self.frame.platform_sensitivity(slides, place, turned)


@dataclass(frozen=True, eq=False)
class ActualDelta(ActualRods):
    """w = nominal tip."""

    kinematics: OnLegs = field(kw_only=True)
    turns = 0

    @cached_property
    def frame(self) -> RodFrame:
        """See the base class."""
        return rod_frame(rods_of(self.kinematics), self.rods.pairs)

    def coordinates(self, q: Floats, near: Floats | None = None) -> Floats:
        """See the base class."""
        return self.kinematics.pose(q, near)[0]

    def joints(self, w: Floats) -> Floats:
        """See the base class."""
        return np.asarray(self.kinematics.inverse(w, np.broadcast_to(UP, w.shape))[0])

    def rates(self, w: Floats) -> Floats:
        """See the base class."""
        return np.broadcast_to(np.eye(6, 3), (len(w), 6, 3)).copy()

    def outside(self, w: Floats, margin: float = EDGE) -> Bools:
        """False: dimensions hold everywhere."""
        return np.zeros((len(w), 3), dtype=np.bool_)

    def _platform(self, w: Floats) -> tuple[Floats, Floats, Floats]:
        place = w + self.kinematics.tool_length * UP
        return place, np.tile(np.eye(3), (len(w), 1, 1)), self.joints(w)

    def place(self, w: Floats, direction: Floats | None = None) -> ToolPlace:
        """See the base class."""
        if not self.any:
            return w, np.tile(UP, (len(w), 1)), np.tile(np.eye(3)[0], (len(w), 1))
        tool: list[Columns] = [columns.of_one(v) for v in actual_tool(UP, self.kinematics.tool_length, self.chain)]
        tip, axis, side = (columns.to_rows(v, len(w)) for v in self._carried(w, tool))
        return tip, axis, side

    def error_rates(self, q: Floats, reach: Floats) -> ErrorRates | None:
        """See the base class."""
        length = self.kinematics.tool_length
        tools: list[list[Columns]] = [[columns.of_one(v) for v in actual_tool(UP, length, chain)]
                                      for chain in (self.chain, SerialErrors())]
        tool = self._tool_rates(self.coordinates(q), reach, (tools[0], tools[1]), np.zeros(len(q)),
                                np.zeros(len(q)))
        none = np.zeros(q.shape)
        return ErrorRates(tool.tip, tool.axis, none, none)

    def sensitivity(self, w: Floats, direction: Floats | None = None) -> Floats:
        """See the base class: T^-1 S (E-15), carried to the tip, then the spindle's."""
        place, twist = self._twist(w)
        unit = np.tile(np.eye(3), (len(w), 1, 1))
        return np.concatenate([carried(unit, w - place) @ twist, _spindle_columns(self.chain, unit, w - place)], axis=2)


@dataclass(frozen=True, eq=False)
class ActualTilting(ActualRods):
    """w = nominal platform (x, y, z, tilt) and rotary axis."""

    kinematics: LegsWithAxis = field(kw_only=True)
    turns = 2

    @cached_property
    def frame(self) -> RodFrame | LegFrame:
        """See the base class: of legs on slides, which `rods` closes, or of any."""
        return leg_frame(self.kinematics.on_legs) if self.kinematics.on_rods is None else rod_frame(
            rods_of(self.kinematics), self.rods.pairs)

    @cached_property
    def line(self) -> Line:
        """The rotary axis, as its errors leave it; its reference point is on the nominal line."""
        name = self.kinematics.letter
        return actual_line(Joint(name, True, *self.kinematics.axis_line(name)), 4, self.chain)

    @property
    def pivot(self) -> Floats:
        """(3,) point of the rotary axis: in the platform, or the machine origin."""
        return self.kinematics.axis.line()[1]

    def coordinates(self, q: Floats, near: Floats | None = None) -> Floats:
        """See the base class."""
        return np.column_stack([self.kinematics.solve_platform(q, near), q[:, 4]])

    def joints(self, w: Floats) -> Floats:
        """See the base class."""
        return np.column_stack([self.kinematics.platform.inverse(w[:, :4]), w[:, 4]])

    def rates(self, w: Floats) -> Floats:
        """See the base class: the turns are the tilt about x and the rotary axis."""
        turned, tip, axis = self._part(w), *self.kinematics.place(w[:, :4], w[:, 4])[:2]
        place = np.einsum("nij,nj->ni", turned, w[:, :3])
        tilt = turned[:, :, self.kinematics.platform.order[0]]
        at_spindle = self._at_spindle
        tilted = self.kinematics.platform.turn(w[:, 3])
        line = tilted @ self.line.joint.direction if at_spindle else np.broadcast_to(self.line.joint.direction, tip.shape)
        point = place + tilted @ self.pivot if at_spindle else np.zeros(3)
        result = np.zeros((len(w), 6, 5))
        result[:, :3, :3] = turned
        for k, (direction, through) in enumerate(((tilt, place), (line, point)), 3):
            result[:, :3, k], result[:, 3:, k] = np.cross(direction, tip - through), np.cross(direction, axis)
        return result

    def _part(self, w: Floats) -> Floats:
        """Machine frame to table frame (N, 3, 3)."""
        if self._at_spindle:
            return np.tile(np.eye(3), (len(w), 1, 1))
        return rotation(self.line.joint.direction, w[:, 4])

    def outside(self, w: Floats, margin: float = EDGE) -> Bools:
        """See the base class; only the rotary axis has a range."""
        return self.chain.outside(self.kinematics.axis_names,
                                  np.column_stack([np.zeros((len(w), 4)), w[:, 4]]), margin)

    def _platform(self, w: Floats) -> tuple[Floats, Floats, Floats]:
        return w[:, :3], self.kinematics.platform.turn(w[:, 3]), self.kinematics.platform.inverse(w[:, :4])

    def place(self, w: Floats, direction: Floats | None = None) -> ToolPlace:
        """See the base class."""
        if not self.any:
            return self.kinematics.place(w[:, :4], w[:, 4])
        approach = 0.0 if direction is None else direction[:, 4]
        tool = self._carried(w, self._tool(w, approach, self.line, self.chain))
        if not self._at_spindle:
            tool = driven(self.line, w[:, 4], approach, self.chain, tool)
        tip, axis, side = (columns.to_rows(v, len(w)) for v in tool)
        return tip, axis, side

    @property
    def _at_spindle(self) -> bool:
        return self.kinematics.axis.at_spindle

    def _tool(self, w: Floats, approach: Floats | float, line: Line, chain: SerialErrors) -> list[Columns]:
        """Tip and directions in the platform, turned by the rotary axis where that is there."""
        tool: list[Columns] = [columns.of_one(v) for v in actual_tool(UP, self.kinematics.tool_length, chain)]
        tool[0] = columns.plus(tool[0], columns.of_one(self.kinematics.axis.gauge))
        return driven(line, w[:, 4], approach, chain, tool) if self._at_spindle else tool

    def error_rates(self, q: Floats, reach: Floats) -> ErrorRates | None:
        """See the base class."""
        if not gap_slopes_fit(self.chain) or len(self.frame.leg) != RODS:
            return None
        w, turn, none = self.coordinates(q), reach[:, 4], SerialErrors()
        size, spindle = sizes_of(self.chain, self.line.joint.name), sizes_of(self.chain, SPINDLE)
        line = actual_line(self.line.joint, 4, none)
        tools = self._tool(w, 0.0, self.line, self.chain), self._tool(w, 0.0, line, none)
        arm = self._arm(w, tools[1])
        at_spindle = self._at_spindle
        apart = size.shift_apart + size.turn_apart * arm
        lean = 1.0 + 2.0 * LARGEST_TURN + size.turn_slope
        own = size.line_shift + size.shift + spindle.line_shift + spindle.line_turn * abs(self.kinematics.tool_length)
        wide = lean * (arm + own) + size.shift_slope
        tool = self._tool_rates(w, reach[:, :4], tools, (wide * turn + apart) * at_spindle,
                                (lean * turn + size.turn_apart) * at_spindle)
        arm = arm * (1.0 + turn) + (0.0 if at_spindle else (tool.nominal_tip * reach[:, :4]).sum(axis=1))
        return with_rotary(tool, size, spindle, arm, self.kinematics.tool_length, at_spindle)

    def _arm(self, w: Floats, tool: list[Columns]) -> Floats:
        """(N,) largest distance of the nominal tip from the rotary axis's point and reference point."""
        tip = columns.to_rows(tool[0], len(w))
        if not self._at_spindle:
            tip = w[:, :3] + np.einsum("nij,nj->ni", self.kinematics.platform.turn(w[:, 3]), tip)
        return np.asarray(np.linalg.norm(tip - self.pivot, axis=1) + np.linalg.norm(self.line.reference - self.pivot))

    def sensitivity(self, w: Floats, direction: Floats | None = None) -> Floats:
        """See the base class: the platform's, the rotary axis's, the spindle's, all at the tip in the table frame."""
        tip, axis, _ = self.kinematics.place(w[:, :4], w[:, 4])
        part, (place, twist) = self._part(w), self._twist(w)
        arm = np.einsum("nji,nj->ni", part, tip) - place
        generalised = np.zeros((len(w), 6, 6))
        generalised[:, :3, :3] = generalised[:, 3:, 3:] = part
        rods = generalised @ carried(np.tile(np.eye(3), (len(w), 1, 1)), arm) @ twist
        return np.concatenate([rods, self._chain_columns(w, part, tip, axis, direction)], axis=2)

    def _chain_columns(self, w: Floats, part: Floats, tip: Floats, axis: Floats,
                       direction: Floats | None) -> Floats:
        """(N, 6, P) of the errors in `chain`: the rotary axis stands before the platform or after it."""
        approach = np.zeros(len(w)) if direction is None else direction[:, 4]
        tilted = self.kinematics.platform.turn(w[:, 3])
        before = tilted if self._at_spindle else np.tile(np.eye(3), (len(w), 1, 1))
        after = before @ rotation(self.line.joint.direction, w[:, 4])
        shift = w[:, :3] if self._at_spindle else np.zeros((len(w), 3))
        at_axis = shift + before @ self.pivot
        reference = at_axis + (after if self.line.moving else before) @ (self.line.reference - self.pivot)
        spindle = after if self._at_spindle else after @ tilted
        found = [np.zeros((len(w), 6, 0))]
        for component in self.chain.components:
            column = carried(after if self.line.moving else before, tip - reference)[:, :, component.name.part]
            found.append(column[:, :, None] * component.curve.basis(w[:, 4], approach)[:, None, :])
        for text in self.chain.constants:
            torsor, name = SerialErrors(constants={text: 1.0}).location(text[-1]), parse(text)
            gauge, at_line = -self.kinematics.tool_length * axis, carried(before, tip - at_axis)
            effect = carried(spindle, gauge) @ torsor if text[-1] == SPINDLE else \
                at_line @ along(self.line.joint) if name is not None and name.zero_position else \
                (at_line - carried(after, tip - at_axis)) @ torsor
            found.append(effect[:, :, None])
        return np.concatenate(found, axis=2)


def _spindle_columns(chain: SerialErrors, turned: Floats, arm: Floats) -> Floats:
    """(N, 6, P) of the spindle's constants; the gauge point is at `arm` (N, 3) less the tool."""
    at_tip = carried(turned, arm)
    found = [np.zeros((len(arm), 6, 0))]
    found += [(at_tip @ SerialErrors(constants={text: 1.0}).location(SPINDLE))[:, :, None] for text in chain.constants]
    return np.concatenate(found, axis=2)


