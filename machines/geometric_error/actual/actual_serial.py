"""A serial machine with its errors, exactly (homogeneous transforms) and to first order (transport matrices).

The exact chain is that of `serial_errors`, carried out from the tool to the workpiece on the tip and the
tool's own directions by columns, which is the product of the 4 x 4 matrices without their constant row (C 1.1, 1.11).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from machines.geometric_error.actual.actual import EDGE, Actual, ToolPlace
from machines.geometric_error.actual.actual_chain_loop import ActualChainLoop
from machines.geometric_error.actual.axis_motion import Line, actual_line, actual_tool, along, driven
from machines.geometric_error.actual.error_rates import ErrorRates, serial_rates
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.actual.transforms import carried
from machines.geometric_error.tables.names import SPINDLE, parse
from machines.kinematics import columns
from machines.kinematics.chain import Joint
from machines.kinematics.chain_loop import pays
from machines.kinematics.columns import Columns
from machines.kinematics.serial import Serial
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import rotation


@dataclass(frozen=True, eq=False)
class ActualSerial(Actual):
    """w = q: linear joints first."""

    kinematics: Serial
    errors: SerialErrors

    @property
    def turns(self) -> int:  # type: ignore[override]  # nothing assigns it
        """Rotary axes."""
        return sum(self.kinematics.rotary)

    @cached_property
    def lines(self) -> list[Line]:
        """From the workpiece to the tool."""
        names = self.kinematics.axis_names
        return [actual_line(joint, names.index(joint.name), self.errors) for joint in self.kinematics.chain]

    def coordinates(self, q: Floats, near: Floats | None = None) -> Floats:
        """q itself."""
        return q

    def joints(self, w: Floats) -> Floats:
        """w itself."""
        return w

    def rates(self, w: Floats) -> Floats:
        """See the base class."""
        return self.kinematics.jacobian(w)

    def outside(self, w: Floats, margin: float = EDGE) -> Bools:
        """See the base class."""
        return self.errors.outside(self.kinematics.axis_names, w, margin)

    def error_rates(self, q: Floats, reach: Floats) -> ErrorRates | None:
        """See the base class."""
        return serial_rates(self.kinematics, self.errors, q, reach)

    # ---- exact ---------------------------------------------------------------------------------------------

    def place(self, w: Floats, direction: Floats | None = None) -> ToolPlace:
        """See the base class."""
        tip, axis, side = self._sweep(w, direction, self.tool)
        return tip, axis, side

    def aim(self, w: Floats, direction: Floats | None = None) -> tuple[Floats, Floats]:
        """See the base class."""
        tip, axis = self._sweep(w, direction, self.tool[:2])
        return tip, axis

    def _sweep(self, q: Floats, direction: Floats | None, tool: Sequence[Floats]) -> Floats:
        """Point and directions (V, N, 3) of the tool."""
        if pays(len(q)):
            found = self._loop.poses(q, direction, self.errors, np.array(tool))
            if found is not None:
                return found
        result = np.empty((len(tool), len(q), 3))
        for part in columns.blocks(len(q)):
            carried_along: list[Columns] = [columns.of_one(v) for v in tool]
            for line in reversed(self.lines):
                approach = 0.0 if direction is None else direction[part, line.index]
                carried_along = driven(line, q[part, line.index], approach, self.errors, carried_along)
            for rows, vector in zip(result, carried_along, strict=True):
                rows[part] = columns.to_rows(vector, len(q[part]))
        return result

    @cached_property
    def _loop(self) -> ActualChainLoop:
        return ActualChainLoop.of(self.lines)

    @cached_property
    def tool(self) -> tuple[Floats, Floats, Floats]:
        """(tip, axis, x), each (3,), at q = 0, as the spindle's errors leave them."""
        return actual_tool(self.kinematics.tool_axis, self.kinematics.tool_length, self.errors)

    # ---- first order ---------------------------------------------------------------------------------------

    def sensitivity(self, w: Floats, direction: Floats | None = None) -> Floats:
        """See the base class: transport matrices (C 1.20, 1.25) times the basis of each curve."""
        approach = np.zeros(w.shape) if direction is None else direction
        before, after, centres, tip = self._frames(w)
        result, at = np.zeros((len(w), 6, len(self.errors.names))), 0
        index = {line.joint.name: k for k, line in enumerate(self.lines)}
        for component in self.errors.components:
            k = index[component.name.axis]
            line = self.lines[k]
            column = carried((after if line.moving else before)[k], tip - centres[k])[:, :, component.name.part]
            basis = component.curve.basis(w[:, line.index], approach[:, line.index])
            result[:, :, at:at + basis.shape[1]] = column[:, :, None] * basis[:, None, :]
            at += basis.shape[1]
        for text in self.errors.constants:
            result[:, :, at] = self._location_column(text, w, before, after, tip)
            at += 1
        return result

    def _location_column(self, text: str, w: Floats, before: list[Floats], after: list[Floats],
                         tip: Floats) -> Floats:
        """Effect (N, 6) of one location error: what L does before the axis less what it undoes after it; of a zero
        position: the axis's own motion."""
        axis, torsor, name = text[-1], SerialErrors(constants={text: 1.0}).location(text[-1]), parse(text)
        assert name is not None
        if axis == SPINDLE:
            gauge = -self.kinematics.tool_length * self.kinematics.tool_axis
            arm = np.einsum("nij,j->ni", after[-1], gauge)
            spun: Floats = carried(after[-1], arm) @ torsor
            return spun
        k = next(k for k, line in enumerate(self.lines) if line.joint.name == axis)
        line = self.lines[k]
        if name.zero_position:
            on_line: Floats = carried(before[k], tip - self._origin(k, w, line.joint.point)) @ along(line.joint)
            return on_line
        pivot = line.joint.point if line.joint.rotary else line.reference
        fixed = self._origin(k, w, pivot)
        at_rest = fixed if line.joint.rotary else fixed + np.einsum(
            "nij,j->ni", before[k], line.joint.direction) * w[:, line.index, None]
        result: Floats = carried(before[k], tip - fixed) @ torsor - carried(after[k], tip - at_rest) @ torsor
        return result

    def _frames(self, w: Floats) -> tuple[list[Floats], list[Floats], list[Floats], Floats]:
        """Turns (N, 3, 3) before and after each axis, reference points (N, 3), tip, without errors."""
        before, after, centres = [], [], []
        turned, shift = np.broadcast_to(np.eye(3), (len(w), 3, 3)), np.zeros((len(w), 3))
        for line in self.lines:
            before.append(turned)
            centre = shift + turned @ line.reference
            turned, shift = _step(line.joint, w[:, line.index], turned, shift)
            after.append(turned)
            centres.append(shift + turned @ line.reference if line.moving else centre)
        tip = shift + turned @ (-self.kinematics.tool_length * self.kinematics.tool_axis)
        return before, after, centres, tip

    def _origin(self, k: int, w: Floats, point: Floats) -> Floats:
        """Where a point (3,) fixed before axis k is, (N, 3)."""
        turned, shift = np.broadcast_to(np.eye(3), (len(w), 3, 3)), np.zeros((len(w), 3))
        for line in self.lines[:k]:
            turned, shift = _step(line.joint, w[:, line.index], turned, shift)
        result: Floats = shift + turned @ point
        return result


def _step(joint: Joint, x: Floats, turned: Floats, shift: Floats) -> tuple[Floats, Floats]:
    """The frame (turn (N, 3, 3), origin (N, 3)) carried on by one nominal motion."""
    if not joint.rotary:
        return turned, shift + np.einsum("nij,j->ni", turned, joint.direction) * x[:, None]
    own = rotation(joint.direction, x)
    origin = joint.point - own @ joint.point
    return turned @ own, shift + np.einsum("nij,nj->ni", turned, origin)
