"""A platform on legs in series with rotary axes, with errors: the exact closure of its rods, then axis by axis of a chain.

w are the nominal place C of the platform and the rotary axes, from the part to the spindle. Where the platform turns as it
goes aside, C turns the tool a little: the correction takes some steps more.
"""

from __future__ import annotations

from collections.abc import Iterator
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
from machines.kinematics.legs.in_series import LegsInSeries
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import rotation

UP = np.array([0.0, 0.0, 1.0])
Placed = tuple[Line, Floats, Floats, Floats, Floats]
"""an axis, its frame in the table frame without and with its own turn (N, 3, 3), a point and the reference point (N, 3)"""


@dataclass(frozen=True, eq=False)
class ActualSeries(Actual):
    """Errors of rods, of rotary axes and of the spindle; its turns are the rotary axes."""

    kinematics: LegsInSeries
    rods: RodErrors
    chain: SerialErrors = field(default_factory=SerialErrors)
    turns: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "turns", len(self.kinematics.turning))

    @cached_property
    def frame(self) -> LegFrame:
        """Nominal rods."""
        return leg_frame(self.kinematics.on_legs)

    @cached_property
    def lines(self) -> list[Line]:
        """The rotary axes as their errors leave them, from the part to the spindle."""
        first = self.kinematics.legs_joints
        return [actual_line(joint, k, self.chain) for k, joint in enumerate(self.kinematics.turning, first)]

    @property
    def any(self) -> bool:
        """False where every parameter is 0: the machine is the nominal one, to the last digit."""
        return bool(self.rods.values.any() or self.chain.values.any())

    def coordinates(self, q: Floats, near: Floats | None = None) -> Floats:
        """See the base class."""
        return np.column_stack([self.kinematics.platform_pose(q, near)[0], q[:, self.kinematics.legs_joints:]])

    def joints(self, w: Floats) -> Floats:
        """See the base class."""
        return np.column_stack([self.kinematics.legs_at_place(w[:, :3])[0], w[:, 3:]])

    def rates(self, w: Floats) -> Floats:
        """See the base class."""
        place, turns = w[:, :3], w[:, 3:]
        kin, turn = self.kinematics, self.kinematics.legs_at_place(place)[1]
        tip, axis, _ = kin.placed(place, turn, turns)
        result = np.zeros((len(w), 6, 3 + self.turns))
        table, holds = self._to_table(turns), kin.on_legs.loops.holds
        result[:, :3, :3] = table
        if holds is not None:
            omega = table @ holds.turn_rates(place, turn)
            arm = tip - np.einsum("nij,nj->ni", table, place)
            result[:, :3, :3] += np.cross(omega, arm[:, :, None], axis=1)
            result[:, 3:, :3] = np.cross(omega, axis[:, :, None], axis=1)
        for k, (line, before, _, point, _) in enumerate(self._frames(w, turn), 3):
            direction = before @ line.joint.direction
            result[:, :3, k], result[:, 3:, k] = np.cross(direction, tip - point), np.cross(direction, axis)
        return result

    def outside(self, w: Floats, margin: float = EDGE) -> Bools:
        """See the base class; only the rotary axes have a range."""
        none = np.zeros((len(w), self.kinematics.legs_joints))
        return self.chain.outside(self.kinematics.axis_names, np.column_stack([none, w[:, 3:]]), margin)

    def place(self, w: Floats, direction: Floats | None = None) -> ToolPlace:
        """See the base class."""
        kin, turns = self.kinematics, w[:, 3:]
        q, turn, shift = kin.legs_at_place(w[:, :3])
        if not self.any:
            return kin.placed(w[:, :3] + 0.0 * q[:, :1], turn, turns)
        place, turn = self.frame.solve(q[:, kin.on_legs.legs_at], w[:, :3] - shift, turn, self.rods)
        tool: list[Columns] = [columns.of_one(v) for v in actual_tool(UP, kin.tool_length, self.chain)]
        tool[0] = columns.plus(tool[0], columns.of_one(kin.on_legs.gauge))
        count = len(kin.tables)
        tool = self._driven(range(self.turns - 1, count - 1, -1), turns, direction, tool)
        rows = np.moveaxis(turn, 0, 2)
        tool = [[columns.dot(row, v) for row in rows] for v in tool]
        tool[0] = columns.plus(tool[0], columns.of_rows(place + shift))
        tool = self._driven(range(count - 1, -1, -1), turns, direction, tool)
        tip, axis, side = (columns.to_rows(v, len(w)) for v in tool)
        return tip, axis, side

    def _driven(self, order: range, turns: Floats, direction: Floats | None, tool: list[Columns]) -> list[Columns]:
        for k in order:
            line = self.lines[k]
            tool = driven(line, turns[:, k], 0.0 if direction is None else direction[:, line.index], self.chain, tool)
        return tool

    def _to_table(self, turns: Floats) -> Floats:
        """Machine frame to table frame (N, 3, 3)."""
        found = np.tile(np.eye(3), (len(turns), 1, 1))
        for k, joint in enumerate(self.kinematics.tables):
            found = found @ rotation(joint.direction, turns[:, k])
        return np.asarray(found)

    def _frames(self, w: Floats, turn: Floats) -> Iterator[Placed]:
        """The rotary axes where they stand, from the part to the spindle, the platform's turns `turn` (N, 3, 3)."""
        at, origin = np.tile(np.eye(3), (len(w), 1, 1)), np.zeros((len(w), 3))
        for k, line in enumerate(self.lines):
            if k == len(self.kinematics.tables):
                origin, at = origin + np.einsum("nij,nj->ni", at, w[:, :3]), at @ turn
            after = at @ rotation(line.joint.direction, w[:, 3 + k])
            point = origin + at @ line.joint.point
            centre = point + (after if line.moving else at) @ (line.reference - line.joint.point)
            yield line, at, after, point, centre
            origin, at = point - after @ line.joint.point, after

    def error_rates(self, q: Floats, reach: Floats) -> ErrorRates | None:
        """See the base class; None of joints on rings, and of rods that share and change their lengths."""
        frame, kin, w = self.frame, self.kinematics, self.coordinates(q)
        legs, count = kin.on_legs, len(kin.tables)
        if not bounded(frame) or not gap_slopes_fit(self.chain):
            return None
        turn, shift = kin.legs_at_place(w[:, :3])[1:]
        go, pose = reach[:, legs.legs_at], (w[:, :3] - shift, turn)
        motions = errors_in_motion(frame, self.rods, q[:, legs.legs_at], pose, go, not kin.follows)
        tip = np.tile(legs.gauge - kin.tool_length * UP, (len(w), 1))
        head = axes_there(self.lines[count:], self.chain, (q, reach), tip, np.zeros(len(w)))
        side = ToolSide(head, sizes_of(self.chain, SPINDLE), kin.tool_length)
        tips, axes = ([np.einsum("nij,nj->ni", motion.turned, v) for motion, v in zip(motions, each, strict=True)]
                      for each in zip(self._in_platform(w), kin.tool(w[:, 3:])[:2], strict=True))
        goes = [np.broadcast_to(far, len(w)) for far in side.goes()]
        tool = tool_rates(*motions, (tips[0], tips[1]), (axes[0], axes[1]), go, goes[0], goes[1])
        slid = (tool.nominal_tip * go).sum(axis=1) + goes[0]
        before = [*self.lines[:count], *self._carriers]
        under = axes_there(before, self.chain, (q, reach), pose[0] + tips[1], slid)
        return series_rates(tool, legs.legs_at, under, side, q, reach)

    @property
    def _carriers(self) -> list[Line]:
        """Slides between the tables and the legs; they have no errors here."""
        own = self.kinematics.on_legs
        return [actual_line(Joint(own.axis_names[j], False, u, np.zeros(3)), int(j), SerialErrors())
                for j, u in zip(own.carriers_at, own.carriers, strict=True)]

    def _in_platform(self, w: Floats) -> tuple[Floats, Floats]:
        """(tip, axis) (N, 3) of the tool, with the errors of spindle and axes of the head, in directions of the platform."""
        kin, count = self.kinematics, len(self.kinematics.tables)
        tool: list[Columns] = [columns.of_one(v) for v in actual_tool(UP, kin.tool_length, self.chain)]
        tool[0] = columns.plus(tool[0], columns.of_one(kin.on_legs.gauge))
        tool = self._driven(range(self.turns - 1, count - 1, -1), w[:, 3:], None, tool)
        return columns.to_rows(tool[0], len(w)), columns.to_rows(tool[1], len(w))

    def sensitivity(self, w: Floats, direction: Floats | None = None) -> Floats:
        """See the base class: the platform's, the rotary axes', the spindle's, all at the tip in the table frame."""
        kin, part = self.kinematics, self._to_table(w[:, 3:])
        q, turn, shift = kin.legs_at_place(w[:, :3])
        tip, axis, _ = kin.placed(w[:, :3], turn, w[:, 3:])
        own = kin.to_machine(tip, w[:, 3:], True) - w[:, :3]
        table = np.zeros((len(w), 6, 6))
        table[:, :3, :3] = table[:, 3:, 3:] = part
        rods = table @ carried(np.tile(np.eye(3), (len(w), 1, 1)), own) @ self.frame.platform_sensitivity(
            q[:, kin.on_legs.legs_at], w[:, :3] - shift, turn)
        frames = {placed[0].joint.name: placed for placed in self._frames(w, turn)}
        return np.concatenate([rods, self._chain_columns(frames, (part @ turn, tip, axis), w, direction)], axis=2)

    def _chain_columns(self, frames: dict[str, Placed], tool: tuple[Floats, Floats, Floats], w: Floats,
                       direction: Floats | None) -> Floats:
        """(N, 6, P) of the errors in `chain`; `tool`: platform in the table frame (N, 3, 3), tip and axis (N, 3)."""
        spindle, tip, axis = tool
        last = frames[self.lines[-1].joint.name]
        spindle = last[2] if self.kinematics.head else last[2] @ np.swapaxes(self._to_table(w[:, 3:]), 1, 2) @ spindle
        found = [np.zeros((len(w), 6, 0))]
        for component in self.chain.components:
            line, before, after, _, centre = frames[component.name.axis]
            approach = np.zeros(len(w)) if direction is None else direction[:, line.index]
            column = carried(after if line.moving else before, tip - centre)[:, :, component.name.part]
            basis = component.curve.basis(w[:, 3 + line.index - self.kinematics.legs_joints], approach)
            found.append(column[:, :, None] * basis[:, None, :])
        for text in self.chain.constants:
            torsor, name = SerialErrors(constants={text: 1.0}).location(text[-1]), parse(text)
            if text[-1] == SPINDLE:
                effect = carried(spindle, -self.kinematics.tool_length * axis) @ torsor
            else:
                line, before, after, point, _ = frames[text[-1]]
                at_line = carried(before, tip - point)
                effect = at_line @ along(line.joint) if name is not None and name.zero_position else \
                    (at_line - carried(after, tip - point)) @ torsor
            found.append(effect[:, :, None])
        return np.concatenate(found, axis=2)
