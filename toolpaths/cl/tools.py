"""Tools: their numbers (LOADTL, LOAD/TOOL, TURRET, TOOLNO) and what the file says of their shape.

Systems give the shape before or after the number. Records without a point between them describe one tool;
after a point, a description begins again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import takewhile
from typing import Literal, TypedDict

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.cl.build import ToolpathBuilder
from toolpaths.cl.text.statements import Statement
from toolpaths.toolpath import Tool

TURNING = frozenset({"TURN", "GROOVE", "THREAD", "TURNING"})
AXIS_AGREES = 2e-3
_IN_PLANE = 1e-3
"""of their spread, by which points may be off a plane"""
_MAX_NUMBER = 10 ** 9
_NOT_SHAPE = {"name", "length_register"}
_CUTTER_ANGLES = (4, 5)
_SIZES: tuple[Literal["diameter", "corner_radius", "length"], ...] = ("diameter", "corner_radius", "length")
_MILL_ANGLES: tuple[Literal["taper", "tip_angle"], ...] = ("taper", "tip_angle")
_DRILL_ANGLES: tuple[Literal["taper", "tip_angle"], ...] = ("tip_angle",)
_ISO_REGISTER = 3
_SELECTED = "number selected"
_SHORT_TOOLNO = 5
"""number, kind and three sizes; longer forms follow the user's table, and CUTTER has the sizes"""


class ToolFields(TypedDict, total=False):
    """What records state of a tool: the fields of `Tool` but its number."""

    name: str
    shape: str
    diameter: float
    corner_radius: float
    length: float
    taper: float
    tip_angle: float
    flute_length: float
    length_register: int
    cutter: tuple[float, ...]


@dataclass
class _State:
    number: int = 0
    row: int = -1
    fields: ToolFields = field(default_factory=ToolFields)
    by_number: dict[int, ToolFields] = field(default_factory=dict)


def _state(b: ToolpathBuilder) -> _State:
    state = b.memory.setdefault("tools", _State())
    assert isinstance(state, _State)
    if state.row != b.row:
        state.row, state.fields = b.row, _register_field(state.fields.get("length_register"))
    return state


def describe(b: ToolpathBuilder, fields: ToolFields) -> None:
    """Add what is known of the tool in use from here on."""
    state = _state(b)
    state.fields.update(fields)
    _use(b, state)


def _use(b: ToolpathBuilder, state: _State) -> None:
    state.by_number[state.number] = state.fields
    b.tool.set(b.row, Tool(state.number, **state.fields))


def is_rotating(b: ToolpathBuilder) -> bool:
    """Whether the tool in use is described as one that turns: a mill, a drill, a tap, no insert of a lathe."""
    shape = _state(b).fields.get("shape", "")
    return bool(shape) and shape not in TURNING


def is_of_milling(axis: Floats, tip: Floats) -> bool:
    """True where the axes (N, 3) of points (N, 3) lean, or the points lie in no plane."""
    if len(tip) == 0 or np.abs(axis[:, :2]).max() > AXIS_AGREES:
        return len(tip) > 0
    away = tip - tip.mean(axis=0)
    least, _, most = np.sqrt(np.maximum(np.linalg.eigvalsh(away.T @ away), 0.0)).tolist()
    return bool(least > _IN_PLANE * most)


def _renumber(state: _State, number: int) -> None:
    """Another tool has another length register."""
    if number != state.number:
        state.fields.pop("length_register", None)
    state.number = number


def _register(b: ToolpathBuilder, register: float | None) -> float | None:
    """The length register that a record names; 0 is the one without a length on every control, so none is named."""
    if register is None or (register == math.floor(register) and 0 < register < _MAX_NUMBER):
        return register
    if register == 0:
        b.log.warning("cl.length-register", "length register 0 holds no length: that of the tool's number is taken", b.line,
                      "state ADJUST with the register of the tool, or none")
    else:
        b.log.error("cl.length-register", f"{register:g} is not a length register", b.line,
                    "registers are whole numbers from 1 on")
    return None


def change(b: ToolpathBuilder, number: float, register: float | None) -> None:
    """Load tool `number`; the event LOADTL and the tool index follow."""
    if number != math.floor(number) or not 0 <= number < _MAX_NUMBER:
        b.log.error("cl.tool-number", f"{number:g} is not a tool number", b.line,
                    "tool numbers are whole numbers from 1 on")
        return
    register = _register(b, register)
    state = _state(b)
    _renumber(state, int(number))
    known = state.by_number.get(int(number), {})
    state.fields = {**known, **state.fields} if set(state.fields) <= _NOT_SHAPE else state.fields
    if register is not None:
        state.fields["length_register"] = int(register)
    _drop_plain_load(b, number)
    b.event("LOADTL", (number,) + (() if register is None else (register,)))
    if b.declared is None:
        _use(b, state)


def _drop_plain_load(b: ToolpathBuilder, number: float) -> None:
    """Drop LOADTL/number right before another of the same tool: CATIA writes one at the change, and one with
    the register at each operation (NC_COMPENSATION in its tables of post-processor words)."""
    for k in range(len(b.events) - 1, -1, -1):
        if b.events[k].index != b.row:
            return
        if b.events[k].word == "LOADTL":
            if b.events[k].values == (number,):
                del b.events[k]
            return


def loadtl(b: ToolpathBuilder, s: Statement) -> None:
    """LOADTL/number[, register][, LENGTH, length][, ADJUST | OSETNO | OFFSET, register][, MILL | TURN], or number, pocket,
    length, register (ISO): numbers behind a word belong to it."""
    numbers = s.numbers
    if not numbers:
        b.log.error("cl.tool-number", f"LOADTL/{s.body}: it takes a tool number", b.line,
                    "write for example LOADTL/3")
        return
    register = s.after("ADJUST", "OSETNO", "OFFSET")
    placed = [w for w in takewhile(lambda w: isinstance(w, float) or not w, s.words) if isinstance(w, float)]
    if register is None and len(placed) > 1:
        register = placed[_ISO_REGISTER] if len(placed) > _ISO_REGISTER else placed[1]
    length = s.after("LENGTH")
    if length is not None:
        b.log.info("cl.tool-length", f"LOADTL/{s.body}: the length is not used, it may be that of the cutter or of the "
                   f"whole tool; [tools.{numbers[0]:g}] gauge_length of the set-up is", b.line)
    if s.has("TURN"):
        b.turns()
    change(b, numbers[0], register)


def load(b: ToolpathBuilder, s: Statement) -> None:
    """LOAD/TOOL | TURRET, number[, ADJUST, register]."""
    number = s.after("TOOL", "TURRET")
    if number is None and s.has("WIRE"):
        b.log.warning("cl.wire", "LOAD/WIRE: this operation cuts with a wire, not with a tool", b.line)
        return
    if number is None:
        b.log.error("cl.tool-number", f"LOAD/{s.body}: it takes TOOL and a number", b.line,
                    "write for example LOAD/TOOL,3")
        return
    change(b, number, s.after("ADJUST", "OSETNO"))


def turret(b: ToolpathBuilder, s: Statement) -> None:
    """TURRET/number[, OSETNO, register, ...]."""
    if not s.numbers:
        b.log.error("cl.tool-number", f"TURRET/{s.body}: it takes a station number", b.line,
                    "write for example TURRET/3")
        return
    change(b, s.numbers[0], s.after("OSETNO"))


def toolno(b: ToolpathBuilder, s: Statement) -> None:
    """CATIA: TOOLNO/number, kind[, diameter[, corner radius[, length]]] describes, LOADTL loads.

    The longer forms follow a table of the user: their numbers are left alone, CUTTER has the sizes. MfgSuite:
    TOOLNO/number, kind, OSETNO, length register, radius register.
    """
    if s.has(*TURNING):
        b.turns()
    kind = next((w for w in s.words if isinstance(w, str) and w), "")
    size = [w for w in s.words[1:] if isinstance(w, float)]
    fields: ToolFields = {"shape": kind} if kind else {}
    register = s.after("OSETNO")
    if kind not in TURNING and size and register is None and len(s.words) <= _SHORT_TOOLNO:
        fields["diameter"] = size[0] * b.scale
        if len(size) > 1:
            fields["corner_radius"] = size[1] * b.scale
    if s.numbers and 0 <= s.numbers[0] < _MAX_NUMBER:
        _renumber(_state(b), int(s.numbers[0]))
    describe(b, fields | _register_field(_register(b, register)))


def _register_field(register: float | None) -> ToolFields:
    return {} if register is None else {"length_register": int(register)}


def cutcom(b: ToolpathBuilder, s: Statement) -> None:
    """An event, but for CUTCOM/ON, LENGTH, register, which names the length register of the tool (MfgSuite),
    and CUTCOM/ON right before the CUTCOM that says the side."""
    register = s.after("LENGTH")
    if register is not None and s.words[0] == "ON":
        describe(b, _register_field(_register(b, register)))
    elif s.words != ("ON",) or not b.next_statement_is("CUTCOM"):
        b.event("CUTCOM", tuple(w for w in s.words if w != ""))


def tldata(b: ToolpathBuilder, s: Statement) -> None:
    """TLDATA/MILL, d, r, length, taper, tip, ... or DRILL[, MILL], d, r, length, point angle, flute length;
    with MILL behind it THREAD is a thread mill, without a tool of a lathe."""
    kinds = [w for w in s.words if isinstance(w, str) and w]
    n = [w for w in s.words if isinstance(w, float)]
    shape = kinds[0] if kinds else ""
    if shape in TURNING and kinds[1:2] != ["MILL"]:
        b.turns()
        describe(b, {"shape": shape})
        return
    fields: ToolFields = {"shape": shape}
    for key, value in zip(_SIZES, n, strict=False):
        fields[key] = value * b.scale
    for angle, value in zip(_DRILL_ANGLES if shape == "DRILL" else _MILL_ANGLES, n[3:], strict=False):
        fields[angle] = math.radians(value)
    if shape == "DRILL" and len(n) > 4:
        fields["flute_length"] = n[4] * b.scale
    describe(b, fields)


def cutter(b: ToolpathBuilder, s: Statement) -> None:
    """CUTTER/d[, r, e, f, a, b, h], the seven parameters of APT."""
    n = s.numbers
    if not n:
        if not s.has("DISPLY"):
            b.log.warning("cl.cutter", f"CUTTER/{s.body} names no diameter", b.line)
        return
    params = tuple(v if i in _CUTTER_ANGLES else v * b.scale for i, v in enumerate(n[:7]))
    corner: ToolFields = {"corner_radius": params[1]} if len(params) > 1 else {}
    describe(b, {"diameter": params[0], "cutter": params, **corner})


def flute_length(b: ToolpathBuilder, s: Statement) -> None:
    """CSI_SET_FLUTE_LENGTH/length."""
    if s.numbers:
        describe(b, {"flute_length": s.numbers[0] * b.scale})


def tprint(b: ToolpathBuilder, s: Statement) -> None:
    """TPRINT/name, ...: the name of the tool."""
    name = s.body.split(",")[0].strip()
    if name:
        describe(b, {"name": name})


def select(b: ToolpathBuilder, s: Statement) -> None:
    """SELECT/TOOL, number: the tool to prepare. SELECT/number alone is a work offset in SURFCAM (INC2APT) and a tool to
    prepare elsewhere: one number says nothing under either reading, two are refused."""
    number = next((w for w in s.words if isinstance(w, float)), None)
    if number is None or s.has("TOOL"):
        b.event("SELECT", () if number is None else (number,))
    elif b.memory.setdefault(_SELECTED, number) != number and s.major not in b.allow_unknown:
        b.log.error("cl.select", f"SELECT/{s.body}: a tool to prepare or a work offset, the file does not say", b.line,
                    "write SELECT/TOOL and the number for a tool; --allow-unknown SELECT leaves such records out",
                    key=_SELECTED)


HANDLERS = {"LOADTL": loadtl, "LOAD": load, "TURRET": turret, "TOOLNO": toolno, "TLDATA": tldata, "CUTTER": cutter,
            "$$->CUTTER": cutter, "CSI_SET_FLUTE_LENGTH": flute_length, "TPRINT": tprint, "SELECT": select,
            "CUTCOM": cutcom}
