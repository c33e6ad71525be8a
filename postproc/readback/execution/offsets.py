"""What the control holds besides the program: work offset, tool lengths, how it drills."""

from __future__ import annotations

import math
from dataclasses import dataclass

from postproc.control.control import Control
from toolpaths.arrays import Floats, Ints
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(work="J", xyz="3", home="J")
class Offsets:
    """What the control holds: work offset (J,) in machine coordinates, column of Z, tool lengths by register.

    `control` is needed where a program uses laws of its own; `rises_first`: a canned cycle brings a tool that
    is below its plane, or below the level where the cycle ends, up before it is over the hole (RS274/NGC, see
    `cycles.legs`);
    `arc_slack`: mm by which the radius may differ between the ends of an arc.
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

    def length(self, register: int) -> float:
        """Tool length of a register, 0 for none."""
        return self.lengths.get(register, 0.0) if register >= 0 else 0.0
