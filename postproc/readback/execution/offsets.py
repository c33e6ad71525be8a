"""What the control holds besides the program: work offset, tool lengths, how it drills."""

from __future__ import annotations

import math

import numpy as np

from postproc.control.control import Control
from postproc.controllers.model import OutsideCorners
from toolpaths.arrays import Floats, Ints, repeated, shared
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(work="J", xyz="3", home="J")
class Offsets:
    """What the control holds: work offset (J,) in machine coordinates, column of Z, tool lengths by register.

    `control` is needed where a program uses laws of its own; `rises_first`: a canned cycle brings a tool that
    is below its plane, or below the level where the cycle ends, up before it is over the hole (RS274/NGC, see
    `cycles.legs`);
    `arc_slack`: mm by which the radius may differ between the ends of an arc; `others`: the control with each work offset
    by the register's number, where a program has several; in any other register stands the first of them.
    """

    work: Floats
    xyz: Ints
    lengths: dict[int, float]
    home: Floats
    on_z: bool
    peck_relief: float
    control: Control | None = None
    rises_first: bool = True
    arc_slack: float = math.inf
    others: tuple[tuple[float, Control], ...] = ()
    radii: tuple[tuple[int, float], ...] = ()
    """(tool, mm that its radius register holds) where the words are a contour offset back from the tool's centre"""
    corners: OutsideCorners = ""
    """how the control goes round outside corners of such a contour"""
    home_in_planes: bool = False
    """machine coordinates are what they say in a block that leaves a tilted plane"""

    @property
    def lengths_at(self) -> Ints:
        """Columns of words that a control takes for lengths, by their letters: in programs in inches it scales them."""
        return self.xyz[self.xyz >= 0] if self.control is None else self.control.length_letters

    def shifts(self, tools: Ints, sides: Ints) -> Floats:
        """(N,) mm by which words are shifted to the left of the move, negative to the right, with tools and sides (N,)."""
        result = np.zeros(len(tools))
        for number, radius in self.radii:
            result[tools == number] = radius
        return shared(np.where(sides == 41, result, np.where(sides == 42, -result, 0.0)))

    def control_at(self, register: float) -> Control | None:
        """The control with the work offset of a register."""
        return next((control for number, control in self.others if number == register), self.control)

    def works(self, registers: Floats, whole: bool) -> Floats:
        """(N, J) work offsets of registers (N,), by their numbers; not `whole`: but X, Y, Z, where these are the tip's."""
        result = np.stack([self.work, *(control.work_offset for _, control in self.others)])
        if not whole:
            result[:, self.xyz[self.xyz >= 0]] = 0.0
        if not self.others:
            return repeated(result[0], len(registers))
        held = np.zeros(len(registers), dtype=np.int64)
        for k, (number, _) in enumerate(self.others, 1):
            held[registers == number] = k
        return shared(result[held])

    def length(self, register: int) -> float:
        """Tool length of a register, 0 for none."""
        return self.lengths.get(register, 0.0) if register >= 0 else 0.0
