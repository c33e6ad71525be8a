"""Names of geometric errors after ISO 230-1 (2012), annex A: E, the direction, then the axis.

EXY: straightness of Y along X; EYY: positioning; EAY: turn about x while Y moves. With a 0 before the axis, location:
EC0Y: squareness of Y (turned about z), EX0C: place of the line of C; EX0X, EC0C: zero position of X and of C, along or
about the axis itself. S is the spindle.
"""

from __future__ import annotations

import re
from functools import cache
from typing import NamedTuple

DIRECTIONS = "XYZABC"
"""displacements along x, y, z, then turns about them: the order of a torsor"""
SPINDLE = "S"
OWN = dict(zip("XYZUVWABC", "XYZXYZABC", strict=True))
"""direction along or about which an axis of this letter moves (ISO 841): its positioning error is E, this, the letter"""
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

    @property
    def zero_position(self) -> bool:
        """True for EX0X, EC0C ...: where the axis counts from."""
        return self.location and DIRECTIONS[self.part] == OWN.get(self.axis)

    @property
    def positioning(self) -> bool:
        """True for EXX, ECC ...: how far along or about itself an axis is off."""
        return not self.location and DIRECTIONS[self.part] == OWN.get(self.axis)

    def __str__(self) -> str:
        return f"E{DIRECTIONS[self.part]}{'0' if self.location else ''}{self.axis}"


@cache
def parse(name: str) -> ErrorName | None:
    """The parts of a name, None where it is none."""
    found = _NAME.match(name)
    return ErrorName(DIRECTIONS.index(found[1]), found[2] == "0", found[3]) if found else None
