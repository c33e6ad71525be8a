"""Variables of SINUMERIK programs: R parameters, those that DEF declares, system variables that the program determines;
modal codes by group, and what PROC ... SAVE keeps for the caller.

Programming Manual Job Planning, subprograms: with SAVE the modal G functions and the programmable frame of the caller are in
force again behind the subprogram.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

from postproc.readback.macros.expressions import Cursor, MacroFault, rounded
from postproc.readback.macros.frame import CoordinateFrame
from postproc.readback.macros.siemens_expressions import (
    NAME,
    Names,
    SiemensValue,
    expression,
    listed,
    number,
    skip,
    take,
    text,
)
from postproc.readback.macros.track import Track

_TYPE = re.compile(r"REAL|INT|BOOL|STRING|CHAR|AXIS|FRAME")
_SCOPE = re.compile(r"(?:NCK|CHAN|SYNW|SYNR|SYNRW|PHU *\d+|LLI *\S+|ULI *\S+)(?![A-Z0-9_])")
_AXIS = re.compile(r"[ \t]*([A-Z])[ \t]*(?=[,\n]|$)")
_FALSE = frozenset({"$P_SEARCH", "$P_SEARCHL", "$P_ISTEST", "$P_SIM", "$P_DRYRUN", "$AN_SETUP_TIME"})
"""states of the control while a program simply runs"""
_POSITIONS = frozenset({"$AA_IW", "$P_EP", "$P_EPM"})


VariableKind = Literal["REAL", "INT", "BOOL", "STRING", "CHAR", "AXIS"]
KINDS: tuple[VariableKind, ...] = get_args(VariableKind)


@dataclass
class DeclaredVariable:
    """A variable by DEF: kind, lengths of its dimensions, values by index."""

    kind: VariableKind
    sizes: tuple[int, ...] = ()
    values: dict[tuple[int, ...], SiemensValue] = field(default_factory=dict)

    def put(self, index: tuple[int, ...], value: SiemensValue) -> None:
        """A value as its kind holds it: INT rounds, BOOL is 0 or 1."""
        if self.kind in ("STRING", "CHAR", "AXIS"):
            self.values[index] = text(value)
            return
        held = number(value)
        self.values[index] = rounded(held) if self.kind == "INT" else float(held != 0.0) if self.kind == "BOOL" else held


class SiemensNames(Names):
    """Names of the program that runs, and those of the whole control."""

    def __init__(self, track: Track, state: dict[str, float]) -> None:
        self.track, self.state = track, state
        self.parameters: dict[int, float] = {}
        self.local: dict[str, DeclaredVariable] = {}
        self.common: dict[str, DeclaredVariable] = {}

    def _declared(self, name: str) -> DeclaredVariable | None:
        return self.local.get(name, self.common.get(name))

    def get(self, name: str, index: tuple[SiemensValue, ...]) -> SiemensValue:
        """A value by name."""
        if name == "R" or (name[0] == "R" and name[1:].isdigit()):
            place = _place(name, index)
            if place not in self.parameters:
                raise MacroFault("gcode.variable", f"R{place} is read before the program sets it: what it holds was "
                                 "left there by another program, or by hand",
                                 f"set it first, in a copy of the program: R{place}=...")
            return self.parameters[place]
        held = self._declared(name)
        if held is not None:
            where = self._within(held, name, index)
            return held.values.get(where, "" if held.kind in ("STRING", "CHAR", "AXIS") else 0.0)
        if name in _FALSE:
            return 0.0
        if name in _POSITIONS and index and text(index[0]) in self.track.at:
            return self.track.position(text(index[0])) / self.track.scale(text(index[0]))
        known = {"$P_TOOLNO": "T", "$P_TOOL": "D", "$P_F": "F"}.get(name, "")
        if known in self.state:
            return self.state[known]
        raise MacroFault("gcode.variable", f"{name} is not read: what it holds is neither in the program nor in the set-up",
                         f"declare it: DEF REAL {name}=..., or put its figure in its place, in a copy of the program")

    def known(self, name: str) -> bool:
        """True for what may stand before =."""
        return name == "R" or bool(re.fullmatch(r"R\d+", name)) or self._declared(name) is not None

    def put(self, name: str, index: tuple[SiemensValue, ...], value: SiemensValue) -> None:
        """A variable set."""
        if name == "R" or (name[0] == "R" and name[1:].isdigit()):
            self.parameters[_place(name, index)] = number(value)
            return
        held = self._declared(name)
        if held is None:
            raise MacroFault("gcode.variable", f"{name} is set, and no DEF declares it", f"declare it: DEF REAL {name}")
        held.put(self._within(held, name, index), value)

    def put_list(self, c: Cursor, name: str, index: tuple[SiemensValue, ...]) -> bool:
        """NAME[i] = SET(...) or REP(...) behind the =: elements from the one that is named; False for other values."""
        skip(c)
        held, repeats = self._declared(name), c.text.startswith("REP(", c.at)
        if held is None or not held.sizes or not (take(c, "SET(") or take(c, "REP(")):
            return False
        values, count = listed(c, self, ")"), math.prod(held.sizes)
        first = _position(self._within(held, name, index), held.sizes)
        if not values or (not repeats and len(values) > count - first):
            raise MacroFault("gcode.variable", f"{len(values)} values from {name}{list(index)} on",
                             f"{name} has {count} elements")
        if repeats:
            values = values[:1] * (min(round(number(values[1])), count - first) if len(values) > 1 else count - first)
        for k, value in enumerate(values, first):
            held.put(_index(k, held.sizes), value)
        return True

    def _within(self, held: DeclaredVariable, name: str, index: tuple[SiemensValue, ...]) -> tuple[int, ...]:
        where = tuple(int(number(i)) for i in index)
        if len(where) != len(held.sizes) or any(not 0 <= i < n for i, n in zip(where, held.sizes, strict=False)):
            raise MacroFault("gcode.variable", f"{name}{list(where)} is outside of its array",
                             f"{name} has {' by '.join(map(str, held.sizes)) or 'no'} elements, counted from 0")
        return where

    def declare(self, c: Cursor, into: dict[str, DeclaredVariable] | None = None) -> None:
        """DEF REAL A, B=1.5, C[3,2] with values, behind the DEF."""
        skip(c)
        while c.match(_SCOPE):
            skip(c)
        word = c.match(_TYPE)
        kind = next((k for k in KINDS if k == word), None)
        if kind is None:
            raise c.fault("DEF of a kind that is not executed")
        if kind == "STRING" and take(c, "["):
            listed(c, self, "]")
        while True:
            skip(c)
            name = c.match(NAME)
            if not name:
                raise c.fault("DEF without a name of two letters at least")
            sizes = tuple(int(number(v)) for v in listed(c, self, "]")) if take(c, "[") else ()
            if math.prod(sizes) > 1_000_000:
                raise c.fault("DEF of an array that is too large")
            made = DeclaredVariable(kind, sizes)
            if take(c, "="):
                self._first_values(c, made)
            (self.local if into is None else into)[name] = made
            if not take(c, ","):
                return

    def _first_values(self, c: Cursor, made: DeclaredVariable) -> None:
        skip(c)
        if made.kind == "AXIS" and (axis := _AXIS.match(c.text, c.at)):
            c.at = axis.end()
            made.put((), axis[1])
            return
        if made.sizes and (take(c, "SET(") or take(c, "(")):
            values = listed(c, self, ")")
        elif made.sizes and take(c, "REP("):
            values = listed(c, self, ")") * math.prod(made.sizes)
        else:
            values = [expression(c, self)] * (math.prod(made.sizes) if made.sizes else 1)
        for k, value in enumerate(values[:math.prod(made.sizes) if made.sizes else 1]):
            made.put(_index(k, made.sizes), value)

    def jump_name(self, c: Cursor) -> str:
        """The label behind GOTO: a name, N and a number, or characters that an expression makes."""
        skip(c)
        if m := re.compile(r"[A-Z_][A-Z0-9_]*").match(c.text, c.at):
            held = self._declared(m[0])
            if held is None:
                c.at = m.end()
                return m[0]
        return text(expression(c, self)).upper()


def _place(name: str, index: tuple[SiemensValue, ...]) -> int:
    """The number of an R parameter: R5 or R[5]."""
    if name != "R":
        return int(name[1:])
    if len(index) != 1:
        raise MacroFault("gcode.variable", "R without one number in brackets", "write R5, or R[5]")
    return int(number(index[0]))


def _index(k: int, sizes: tuple[int, ...]) -> tuple[int, ...]:
    """Indices of the k-th element, counted from 0, the last index first to run."""
    index, rest = list[int](), k
    for size in reversed(sizes):
        rest, i = divmod(rest, size)
        index.insert(0, i)
    return tuple(index)


def _position(index: tuple[int, ...], sizes: tuple[int, ...]) -> int:
    """Which element, counted from 0, has these indices."""
    k = 0
    for i, size in zip(index, sizes, strict=True):
        k = k * size + i
    return k


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
