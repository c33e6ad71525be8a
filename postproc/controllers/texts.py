"""Texts of a controller file: which values they may name in braces, and their blocks."""

from __future__ import annotations

import re
from string import Formatter
from typing import Annotated

from pydantic import AfterValidator

WORK_OFFSETS = ("G54", "G55", "G56", "G57", "G58", "G59")
"""the codes that a set-up may name on every control"""
EMC_OFFSETS = ("G59.1", "G59.2", "G59.3")
"""further ones of controls whose file names none: their own codes"""
CYCLE_LENGTHS = ("retract", "surface", "clearance", "bottom", "depth", "level", "step", "less", "least", "relief", "pitch",
                 "second")
"""those of `CYCLE_VALUES` that are lengths, in the units of the program"""
CYCLE_VALUES = (*CYCLE_LENGTHS, "breaks", "factor", "dwell", "feed", "speed")
"""what a cycle's text may name: retract level, surface and bottom (on the tool's axis), clearance above
the surface, depth below it, level of the bottom seen from it (negative), peck, by what each next one is less,
the least of them, relief (`cycles.peck_relief`), number of pecks, share of the last peck that the next one
is, rounded down to a thousandth, with a minus, dwell in s, feed as F states it, pitch
(negative: left-hand), speed in 1/min, second: the retract level above the surface"""


def placeholders(*allowed: str) -> AfterValidator:
    """Only the names `allowed` may stand in braces."""
    def check(text: str) -> str:
        found = {name for _, name, _, _ in Formatter().parse(text) if name is not None}
        if found - set(allowed):
            wrong = ", ".join("{" + str(name) + "}" for name in sorted(found - set(allowed)))
            raise ValueError(f"unknown placeholder {wrong}; allowed is {', '.join('{' + a + '}' for a in allowed)}")
        return text
    return AfterValidator(check)


def _all_offsets(offsets: dict[str, str]) -> dict[str, str]:
    missing = [code for code in WORK_OFFSETS if code not in offsets]
    strange = sorted(code for code in offsets if not re.fullmatch(r"G\d+(\.\d)?", code))
    if offsets and (missing or strange):
        raise ValueError(f"needs one entry for each of {', '.join(WORK_OFFSETS)}; missing: {', '.join(missing) or 'none'}, "
                         f"unknown: {', '.join(strange) or 'none'}")
    return offsets


WorkOffsets = Annotated[dict[str, str], AfterValidator(_all_offsets)]
Named = Annotated[str, placeholders("name", "number", "units")]
Numbered = Annotated[str, placeholders("number")]
Registered = Annotated[str, placeholders("register")]
AlignmentText = Annotated[str, placeholders("x", "y", "z", "dx", "dy", "dz", "a", "b", "c", "offset", "number")]
DwellText = Annotated[str, placeholders("seconds", "milliseconds")]


def blocks_of(text: str) -> list[str]:
    """The blocks of a text of several lines; a line that ends with ~ goes on in the next (Klartext)."""
    return re.split(r"(?<!~)\n", text)
