"""Modal codes of a SINUMERIK program by group, and what PROC ... SAVE keeps for the caller.

Programming Manual Job Planning, subprograms: with SAVE the modal G functions and the programmable frame of the caller are in
force again behind the subprogram.
"""

from __future__ import annotations

from collections.abc import Mapping

from postproc.readback.macros.expressions import MacroFault
from postproc.readback.macros.frame import CoordinateFrame
from toolpaths.dataclass import dataclass

_GROUPS = {"code of motion": (0, 1, 2, 3), "plane": (17, 18, 19), "side of the tool radius": (40, 41, 42),
           "G90 or G91": (90, 91), "kind of feed": (93, 94, 95), "work offset": (54, 55, 56, 57, 500, *range(505, 600)),
           "unit": (70, 71, 700, 710), "path mode": (60, 64, *range(641, 646))}
_GROUP = {code: group for group, codes in _GROUPS.items() for code in codes}


@dataclass(frozen=True)
class SavedModes:
    """Codes by group, frame, and shifts in mm and degrees by axis, as they were where the subprogram was called."""

    codes: Mapping[str, int]
    frame: CoordinateFrame
    local: Mapping[str, float]


def take_code(codes: dict[str, int], code: int) -> None:
    """A G code of the program in its group; others change nothing."""
    code = {20: 70, 21: 71}.get(code, code)
    if code in _GROUP:
        codes[_GROUP[code]] = code


def codes_back(saved: SavedModes, now: Mapping[str, int]) -> str:
    """Words that put the caller's codes in force again.

    Raises:
        MacroFault: the subprogram has changed a group of which the caller has stated nothing
    """
    unstated = [group for group in now if group not in saved.codes]
    if unstated:
        raise MacroFault("gcode.mode", f"SAVE gives the caller its {unstated[0]} back, and the program states none before "
                         "the call", "state it before the call: what the control starts with is machine data")
    return " ".join(f"G{code}" for group, code in saved.codes.items() if now.get(group) != code)
