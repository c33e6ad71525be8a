"""Tool axes that a pass may take: tilt, and what the tool would touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from postproc.orientation.passes import Pass
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

SAME = 1e-4
"""rad: axes nearer than this are one candidate"""


class Bodies(Protocol):
    """Part, fixtures and table beside cutter, shank and holder."""

    def touching(self, one: Pass, axis: Floats) -> str:
        """Which pair touches where a pass is run with its tool along `axis` (3,), and by how much; "" where none does."""


@dataclass(frozen=True)
class Allowed:
    """What holds for every candidate.

    Attributes:
        tilt: largest, rad: from each surface normal where the file gives them, else from the CL's own axis
        bodies: None where the set-up names none
    """

    tilt: float
    bodies: Bodies | None = None

    def refused(self, one: Pass, axis: Floats) -> str:
        """Why an axis (3,) is not allowed in a pass, "" where it is; its own always is."""
        if angle_between(axis, one.axis) < SAME:
            return ""
        if len(one.normal):
            tilt, what = float(angle_between(one.normal, axis[None]).max()), "the surface normal"
        else:
            tilt, what = float(angle_between(one.axis, axis)), "the axis of the CL file"
        if tilt <= self.tilt + 1e-9:
            return ""
        return f"tilt {tilt / DEG:.3f} degrees from {what}, allowed {self.tilt / DEG:.3f}"

    def touching(self, one: Pass, axis: Floats) -> str:
        """As `Bodies.touching`; the own axis of a pass can touch as well."""
        return "" if self.bodies is None else self.bodies.touching(one, axis)
