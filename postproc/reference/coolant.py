"""Coolant by its kind: what COOLNT asks for, what a controller has codes for, and the M numbers that switch it."""

from __future__ import annotations

from typing import Literal

import numpy as np

from postproc.controllers.spelling import Codes
from postproc.reference.events import state_at, words
from toolpaths.arrays import Ints
from toolpaths.toolpath import Toolpath

CoolantCommand = Literal["COOLANT_OFF", "FLOOD_ON", "MIST_ON", "THROUGH_ON", "AIR_ON"]
OFF, FLOOD, MIST, THROUGH, AIR, ANY = 0, 1, 2, 4, 8, -1
"""bits of what flows; ANY: COOLNT/ON, whatever the kind"""
ALL = FLOOD | MIST | THROUGH | AIR
LABELS = {FLOOD: "flood", MIST: "mist", THROUGH: "through the tool", AIR: "air"}
COMMANDS: dict[CoolantCommand, int] = {"FLOOD_ON": FLOOD, "MIST_ON": MIST, "THROUGH_ON": THROUGH, "AIR_ON": AIR}
_LESS: dict[CoolantCommand, CoolantCommand] = {"THROUGH_ON": "FLOOD_ON", "AIR_ON": "MIST_ON", "MIST_ON": "FLOOD_ON"}
"""what is written where the controller has no code for a kind"""


def asked(said: list[str]) -> CoolantCommand:
    """The command that a COOLNT of these words asks for."""
    if "OFF" in said:
        return "COOLANT_OFF"
    return "THROUGH_ON" if "THRU" in said else "AIR_ON" if "AIR" in said else "MIST_ON" if "MIST" in said else "FLOOD_ON"


def written(said: list[str], codes: Codes) -> CoolantCommand:
    """The command that can be written for it: the kind itself, or the nearest that the controller has a code for."""
    command = asked(said)
    while command in _LESS and not switching(codes)[command][0]:
        command = _LESS[command]
    return command


def switching(codes: Codes) -> dict[CoolantCommand, tuple[str, str]]:
    """(code that switches on, code that switches off; empty: `coolant_off` does) by command."""
    return {"FLOOD_ON": (codes.flood, ""), "MIST_ON": (codes.mist, ""), "THROUGH_ON": (codes.through, codes.through_off),
            "AIR_ON": (codes.air, codes.air_off)}


def switched_by(codes: Codes | None) -> dict[float, tuple[int, int]]:
    """(bits switched on, bits switched off) by M number: M7, M8, M9 of NIST RS274/NGC 3.6.4, and the controller's own."""
    result = {7.0: (MIST, 0), 8.0: (FLOOD, 0)}
    own = 0
    for name, (on, off) in (switching(codes) if codes is not None else {}).items():
        if _number(on) >= 0.0:
            result[_number(on)] = COMMANDS[name], 0
        if _number(off) >= 0.0:
            result[_number(off)] = 0, COMMANDS[name]
            own |= COMMANDS[name]
    result[9.0 if codes is None else _number(codes.coolant_off)] = 0, ALL & ~own
    return result


def coolant_words(codes: Codes) -> dict[tuple[str, float], tuple[str, tuple[str, ...]]]:
    """The COOLNT records that a controller's own codes stand for."""
    kinds = {FLOOD: "FLOOD", MIST: "MIST", THROUGH: "THRU", AIR: "AIR"}
    return {("M", number): ("COOLNT", (kinds.get(on, "OFF"),)) for number, (on, _) in switched_by(codes).items()}


def _number(code: str) -> float:
    """N of MN, -1 of another text."""
    return float(code[1:]) if code[:1] == "M" and code[1:].isdigit() else -1.0


def label(flowing: int) -> str:
    """What flows, in words."""
    names = [name for bit, name in LABELS.items() if flowing > 0 and flowing & bit]
    return "on" if flowing == ANY else " and ".join(names) or "off"


def coolant_states(toolpath: Toolpath, codes: Codes) -> Ints:
    """(N,) bits that should flow, as far as the controller has codes for them; ANY where the CL file says only ON."""
    states, starts = [OFF], [0]
    for event in toolpath.events:
        if event.word == "COOLNT":
            said = words(event)
            states.append(ANY if said == ["ON"] else COMMANDS.get(written(said, codes), OFF))
            starts.append(event.index)
    return np.array(states, dtype=np.int64)[state_at(starts, len(toolpath))]
