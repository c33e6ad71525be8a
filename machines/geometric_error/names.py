"""Names of geometric errors after ISO 230-1 (2012), annex A: E, the direction, then the axis.

EXY: straightness of Y along X; EYY: positioning; EAY: turn about x while Y moves. With a 0 before the axis, location:
EC0Y: squareness of Y (turned about z), EX0C: place of the line of C. S is the spindle.
"""

from __future__ import annotations

import re
from typing import NamedTuple

DIRECTIONS = "XYZABC"
"""displacements along x, y, z, then turns about them: the order of a torsor"""
SPINDLE = "S"
_NAME = re.compile(r"E([XYZABC])(0?)([XYZUVWABCS])$")


class ErrorName(NamedTuple):
    """What a name says: part, its place in a torsor, location (constant) or not, axis letter."""

    part: int
    location: bool
    axis: str

    @property
    def angular(self) -> bool:
        """True for turns, in rad."""
        return self.part >= 3

    def __str__(self) -> str:
        return f"E{DIRECTIONS[self.part]}{'0' if self.location else ''}{self.axis}"


def parse(name: str) -> ErrorName | None:
    """The parts of a name, None where it is none."""
    found = _NAME.match(name)
    return ErrorName(DIRECTIONS.index(found[1]), found[2] == "0", found[3]) if found else None
