"""How fast the errors of a platform between axes change: slides or tables under it, rotary axes on the tool's side.

The bounds of `error_rates.py`, axis by axis, with the platform as one more body of the chain: what its rods do is bounded by
`rod_rates.py` (`ToolRates`), the axes before it turn that by no more than they turn, and it turns the axes behind it by no
more than it is off.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from machines.geometric_error.actual.axis_motion import Line
from machines.geometric_error.actual.error_rates import LARGEST_TURN, AxisSizes, ErrorRates, sizes_of
from machines.geometric_error.actual.rod_rates import ToolRates
from machines.geometric_error.actual.serial_errors import SerialErrors
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import lengths, rotation
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(arm="N", at="N", go="N")
class AxisThere:
    """One axis at N poses: its sizes, mm from its point and reference point to the nominal tip at most (N,), where it
    stands (N,) and by how much it moves at most (N,), mm or rad."""

    line: Line
    size: AxisSizes
    arm: Floats
    at: Floats
    go: Floats

    @property
    def turn(self) -> float:
        """rad that it turns what it carries by, at most."""
        return self.size.turn + (2.0 * self.size.line_turn + self.size.zero if self.line.joint.rotary else 0.0)

    @property
    def shift(self) -> Floats:
        """(N,) mm that it displaces the nominal tip by, at most."""
        s = self.size
        own = 2.0 * s.line_shift if self.line.joint.rotary else s.line_turn * (np.abs(self.at) + self.go) + s.zero
        return np.asarray(s.shift + self.turn * self.arm + own)

    def rates(self, before: Floats, moved: Floats, whole: Floats) -> tuple[Floats, Floats]:
        """(mm, rad) (N,) per mm or rad: axes before turn it by `before`, the tip is `moved` mm, all turn by `whole` (N,)."""
        s, arm = self.size, self.arm + moved
        own = s.shift_slope + s.turn_slope * arm
        if not self.line.joint.rotary:
            return before + s.line_turn + own, np.full(len(arm), s.turn_slope)
        tip = (before + s.turn) * (arm + s.line_shift) + s.line_turn * self.arm + moved + s.line_shift + own
        return tip, before + s.turn + s.line_turn + whole + s.turn_slope


def arms_along(lines: Sequence[Line], at: Sequence[Floats], go: Sequence[Floats], tip: Floats,
               slid: Floats) -> list[Floats]:
    """(N,) of each of `lines`, from the part to the tool: mm from its points to the nominal tip (N, 3), given behind the
    last one, while they move from `at` (N,) by up to `go` (N,) each and the tip by `slid` (N,) besides."""
    arms, turning = list[Floats](), np.zeros(len(tip))
    for line, x, far in reversed(list(zip(lines, at, go, strict=True))):
        joint, reference = line.joint, line.reference
        if joint.rotary:
            there = joint.point + np.einsum("nij,nj->ni", rotation(joint.direction, x), tip - joint.point)
            arms.append(np.max([lengths(tip - joint.point), lengths(tip - reference), lengths(there - reference)], axis=0))
            turning = turning + far
        else:
            there = tip + x[:, None] * joint.direction
            arms.append(lengths(tip - reference))
            slid = slid + far
        tip = there
    if not arms:
        return arms
    farthest = np.max(arms, axis=0)
    growth = (farthest + slid) * np.exp(turning) - farthest
    return [arm + growth for arm in reversed(arms)]


def axes_there(lines: Sequence[Line], errors: SerialErrors, joints: tuple[Floats, Floats], tip: Floats,
               slid: Floats) -> list[AxisThere]:
    """Axes from the part to the tool at joints q that move by up to `reach`, both (N, J); the rest as of `arms_along`."""
    at, go = ([v[:, line.index] for line in lines] for v in joints)
    arms = arms_along(lines, at, go, tip, slid)
    sizes = [sizes_of(errors, line.joint.name) for line in lines]
    return [AxisThere(*each) for each in zip(lines, sizes, arms, at, go, strict=True)]


@dataclass(frozen=True, eq=False)
class ToolSide:
    """The axes behind the platform and the spindle, seen from the platform."""

    axes: Sequence[AxisThere]
    spindle: AxisSizes
    length: float
    """mm of the tool"""

    @property
    def turn(self) -> float:
        """rad that they turn the tool by, at most."""
        return sum(axis.turn for axis in self.axes) + self.spindle.line_turn

    @property
    def moved(self) -> Floats | float:
        """(N,) mm that they displace the tip by, at most."""
        own = self.spindle.line_shift + self.spindle.line_turn * abs(self.length)
        return (own + sum(axis.shift for axis in self.axes)) / (1.0 - self.turn)

    def goes(self) -> tuple[Floats | float, Floats | float]:
        """(mm that the tip, rad that the tool axis) (N,) moves on the platform, with errors or without, at most."""
        tip: Floats | float = 0.0
        axis: Floats | float = 0.0
        for one in self.axes:
            s, lean = one.size, 1.0 + 2.0 * LARGEST_TURN + one.size.turn_slope
            tip = tip + (lean * (one.arm + self.moved) + s.shift_slope) * one.go + s.shift_apart + s.turn_apart * one.arm
            axis = axis + lean * one.go + s.turn_apart
        return tip, axis


def series_rates(tool: ToolRates, legs: Ints, under: Sequence[AxisThere], head: ToolSide, q: Floats,
                 reach: Floats) -> ErrorRates | None:
    """Rates of all joints near q (N, J) that move by up to `reach` (N, J); None where errors are too large for it.

    Args:
        tool: of the tool on the platform, with errors and without, seen from what carries the legs
        legs: their joints
        under: axes before the platform, from the part on
    """
    turned = sum(axis.turn for axis in under)
    if turned + head.turn > LARGEST_TURN:
        return None
    whole = turned + head.turn + tool.turned
    found, before, apart = [np.zeros(q.shape) for _ in range(4)], turned + tool.turned, tool.apart
    for axis in head.axes:
        moved = np.broadcast_to(head.moved, len(q))
        _put(found, axis, axis.rates(before, moved, whole), moved)
        apart, before = apart + found[0][:, axis.line.index] * axis.go, before + axis.turn
    moved = (apart + sum(axis.shift for axis in under)) / (1.0 - np.minimum(whole, 0.5))
    before = np.zeros(len(q))
    for axis in under:
        _put(found, axis, axis.rates(before, moved, whole), moved)
        before = before + axis.turn
    found[0][:, legs], found[1][:, legs] = tool.tip + turned * tool.nominal_tip, tool.axis + turned * tool.nominal_axis
    return ErrorRates(*found)


def _put(found: list[Floats], axis: AxisThere, rates: tuple[Floats, Floats], moved: Floats) -> None:
    j, s = axis.line.index, axis.size
    found[0][:, j], found[1][:, j] = rates
    found[2][:, j], found[3][:, j] = 0.5 * (s.shift_apart + s.turn_apart * (axis.arm + moved)), 0.5 * s.turn_apart
