"""Lengths in the header of a program, in the units of the program."""

from __future__ import annotations

import math

from toolpaths.dataclass import dataclass
from toolpaths.units import MM_PER_INCH

SAID = 6
"""digits of a length in mm that is read again"""
_MARGIN = 1e-6
"""of the last decimal: what stands on it goes to the next, on every processor"""


@dataclass(frozen=True)
class LengthText:
    """How lengths in mm are said: in which unit, how many mm that is, how many decimals more than in mm."""

    name: str = "mm"
    unit: float = 1.0
    more: int = 0

    def plain(self, mm: float, places: int = 4) -> str:
        """The number alone, with decimals as in mm."""
        return f"{mm / self.unit:.{places + self.more}f}"

    def text(self, mm: float, places: int = 4) -> str:
        """The number with its unit."""
        return f"{self.plain(mm, places)} {self.name}"

    def exactly(self, mm: float) -> str:
        """The number with its unit and as many digits as it has, SAID in mm: in inches one more, so that they come back."""
        return f"{mm / self.unit:.{SAID + (self.unit != 1.0)}g} {self.name}"

    def up(self, mm: float, places: int = 4) -> str:
        """The number rounded up; "unknown" where it is none."""
        places += self.more
        if not math.isfinite(mm):
            return "unknown"
        return f"{math.ceil(mm / self.unit * 10.0**places + _MARGIN) / 10.0**places:.{places}f}"

    def down(self, mm: float, places: int) -> str:
        """The number rounded down, 0 at least."""
        places += self.more
        return f"{max(math.floor(mm / self.unit * 10.0**places - _MARGIN), 0.0) / 10.0**places:.{places}f}"


MM = LengthText()
INCH = LengthText("inch", MM_PER_INCH, 1)
