"""Records about the program itself: operations, part name, events, subprograms, and the lists of our own writer."""

from __future__ import annotations

import json
import re
from collections.abc import Callable

from toolpaths.cl import frames
from toolpaths.cl.build import Declared, ToolpathBuilder
from toolpaths.cl.text.statements import Statement
from toolpaths.cl.text.words import EVENTS, LENGTH_EVENTS
from toolpaths.cl.tools import describe, is_rotating
from toolpaths.toolpath import Frame, Operation, Role, Tool

_TOOL_PATH = re.compile(r"(.*?),\s*TOOL\s*(?:,(.*))?$", re.IGNORECASE | re.DOTALL)
DIGITS = "0123456789"
_CATIA_OPERATION = re.compile(r"OPERATION NAME\s*:\s*(.*)", re.IGNORECASE)


def begin_operation(b: ToolpathBuilder, name: str, tool_name: str = "") -> None:
    """A new operation from here on; a cycle that is still armed ends."""
    end_cycle(b)
    b.operations.append(Operation(name, tool_name, 0, False, b.line))
    b.operation.set(b.row, len(b.operations) - 1)
    if b.dialect.axis_reset:
        b.axis_marks.append((b.row, (0.0, 0.0, 1.0)))


def end_cycle(b: ToolpathBuilder) -> None:
    """Disarm a cycle that the file has not ended."""
    if b.cycle.now >= 0:
        b.log.warning("cl.cycle-open", "the operation ends with a cycle still active; it is cancelled here", b.line)
        b.cycle.set(b.row, -1)


def tool_path(b: ToolpathBuilder, s: Statement) -> None:
    """TOOL PATH/name, TOOL, tool name."""
    found = _TOOL_PATH.match(s.body)
    name, tool_name = (found[1].strip(), (found[2] or "").strip()) if found else (s.body, "")
    begin_operation(b, name, tool_name)
    b.open_paths.append((b.line, name))
    if tool_name:
        describe(b, {"name": tool_name})


def open_paths(b: ToolpathBuilder) -> None:
    """A warning where a TOOL PATH stands without END-OF-PATH, in a file that has that record."""
    if not b.paths_ended:
        return
    for line, name in b.open_paths:
        b.log.warning("cl.no-end-of-path", f"operation {name} has no END-OF-PATH: its end may be missing", line,
                      "write the file again in the CAM system", key=name)


def end_of_path(b: ToolpathBuilder, s: Statement) -> None:
    """END-OF-PATH."""
    b.paths_ended = True
    del b.open_paths[-1:]
    end_cycle(b)


def feature(b: ToolpathBuilder, s: Statement) -> None:
    """Creo: $$-> FEATNO / n begins the sequence of feature n."""
    begin_operation(b, f"FEATNO {s.body}")


def named_operation(b: ToolpathBuilder, s: Statement) -> None:
    """CSI_TOOL_PATH/name (CAMplete, MANUSnc) and OPNAME/'name' (MfgSuite) begin an operation."""
    begin_operation(b, s.body.strip("' "))


def solidworks_feature(b: ToolpathBuilder, s: Statement) -> None:
    """`.clt`: OPFEATSTART/operation-feature begins an operation."""
    begin_operation(b, s.body.strip())


def turn_type(b: ToolpathBuilder, s: Statement) -> None:
    """SolidWorks CAM's `.apt` has TRNTYP where each operation begins, before its CSYS, and names none of them."""
    if b.dialect.trntyp_begins:
        begin_operation(b, f"OP {len(b.operations) + 1}")


def apply(b: ToolpathBuilder, s: Statement) -> None:
    """APPLY/MILL or TURN (MfgSuite)."""
    if s.has("TURN"):
        b.turns()


def machin(b: ToolpathBuilder, s: Statement) -> None:
    """MACHIN names the post-processor; LATHE or TURN, with a number or without, says that the file is turning.

    Other names that begin so do not: they may be those of a mill with a turntable or of a mill-turn centre that mills.
    """
    if any(isinstance(word, str) and word.rstrip(DIGITS) in ("LATHE", "TURN") for word in s.words):
        b.turns()


def partno(b: ToolpathBuilder, s: Statement) -> None:
    """The name of the part; the first one counts."""
    b.name = b.name or s.body.strip("'")


def comment(b: ToolpathBuilder, s: Statement) -> None:
    """CATIA names its axis system and its operations in comments."""
    frames.comment(b, s)
    found = _CATIA_OPERATION.match(s.body) if b.dialect.operations_in_comments else None
    if found:
        begin_operation(b, found[1].strip())


def text_event(b: ToolpathBuilder, s: Statement) -> None:
    """PPRINT and INSERT, one text each; INSERT of SolidWorks is for people: a PPRINT."""
    word = "PPRINT" if b.dialect.insert_is_comment else s.major
    b.event(word, (s.body,) if s.body else ())


def plain_event(b: ToolpathBuilder, s: Statement) -> None:
    """Words that only the machine needs; lengths to mm."""
    words = tuple(w for w in s.words if w != "")
    if s.major in LENGTH_EVENTS:
        words = tuple(w * b.scale if isinstance(w, float) else w for w in words)
    b.event(s.major, words)


def stop(b: ToolpathBuilder, s: Statement) -> None:
    """STOP or OPSTOP, with the text for the operator (NX: stop_text and opstop_text of its events) printed before it."""
    if s.body:
        b.event("PPRINT", (s.body,))
    b.event(s.major)


def opskip(b: ToolpathBuilder, s: Statement) -> None:
    """DELETE/ON or OFF: another word for OPSKIP (the vocabulary of APT CL files gives both one code)."""
    b.event("OPSKIP", tuple(w for w in s.words if w != ""))


def selctl(b: ToolpathBuilder, s: Statement) -> None:
    """SELECTL/number: another spelling of SELCTL (CATIA V5)."""
    b.event("SELCTL", s.words)


def dwell(b: ToolpathBuilder, s: Statement) -> None:
    """DWELL/seconds, or revolutions with REV: another word for DELAY."""
    b.event("DELAY", tuple(w for w in s.words if w != ""))


def spindl(b: ToolpathBuilder, s: Statement) -> None:
    """An event; a surface speed belongs to turning, but where TLDATA describes a mill or a drill, the tool axis leans,
    or the points lie in no plane."""
    if s.has("SFM", "SMM") and not is_rotating(b):
        b.has_surface_speed()
    plain_event(b, s)


def nothing(b: ToolpathBuilder, s: Statement) -> None:
    """Read elsewhere (UNITS), or of no meaning here."""


def multax(b: ToolpathBuilder, s: Statement) -> None:
    """MULTAX/ON, OFF: the points say by themselves; after OFF those of three numbers keep the last axis
    (CATIA: APT formats, MULTAX influence on output), which others may not mean."""
    if s.has("OFF") and not b.dialect.multax_off_keeps:
        b.multax_off.append((b.row, b.line))


def fini(b: ToolpathBuilder, s: Statement) -> None:
    """The end of the program."""
    if b.finished < 0:
        b.finished = b.row


def mode(b: ToolpathBuilder, s: Statement) -> None:
    """MODE and SET: incremental coordinates are refused, the rest is an event (MODE) or nothing (SET)."""
    if s.has("INCR", "INCRE", "INCREM") and not s.has("OFF"):
        b.log.error("cl.motion-word", f"{s.major}/{s.body}: incremental coordinates are not supported", b.line,
                    "have the CAM system write absolute coordinates")
    elif s.major == "MODE":
        if s.words[:1] == ("TURN",):
            b.turns()
        elif s.words[:1] == ("MILL",):
            b.mills()
        plain_event(b, s)


def own_header(b: ToolpathBuilder, s: Statement) -> None:
    """$$-> TOOLPATH / {...}: text of our own writer; lists of frames, tools, operations follow."""
    found = _json(b, s)
    if found is not None:
        slack = found.get("spline_slack", 0.0)
        b.declared = Declared("inch" if found.get("units") == "inch" else "mm", slack if isinstance(slack, float) else 0.0)


def _json(b: ToolpathBuilder, s: Statement) -> dict[str, object] | None:
    try:
        found = json.loads(s.body)
    except (ValueError, RecursionError):
        found = None
    if isinstance(found, dict):
        return found
    b.log.error("cl.data-comment", f"{s.major} takes a JSON object", b.line,
                "correct the object, or take the line out")
    return None


def own_item(b: ToolpathBuilder, s: Statement) -> None:
    """$$-> FRAME | TOOL | OPERATION / {...}: one more of the list."""
    found = _json(b, s) if b.declared is not None else None
    if found is None or b.declared is None:
        return
    try:
        if s.major == "$$->FRAME":
            b.declared.frames.append(_frame(found))
        elif s.major == "$$->TOOL":
            b.declared.tools.append(_tool(found))
        else:
            b.declared.operations.append(Operation(str(found.get("name", "")), str(found.get("tool_name", "")),
                                                   _index(found, "frame"), bool(found.get("turning")), b.line))
    except (TypeError, ValueError, KeyError) as fault:
        b.log.error("cl.data-comment", f"{s.major}: {fault}", b.line,
                    "correct the object, or take the line out")


def _index(found: dict[str, object], key: str) -> int:
    value = found.get(key, 0)
    if not isinstance(value, int):
        raise ValueError(f"{key} is not a whole number")
    return value


def _numbers(value: object, count: int | None) -> tuple[float, ...]:
    if not isinstance(value, list) or (count is not None and len(value) != count):
        raise ValueError(f"expected a list of {count} numbers")
    return tuple(float(v) for v in value)


def _frame(found: dict[str, object]) -> Frame:
    r = _numbers(found["rotation"], 9)
    o = _numbers(found["origin"], 3)
    return Frame(str(found.get("name", "")), (o[0], o[1], o[2]),
                 ((r[0], r[1], r[2]), (r[3], r[4], r[5]), (r[6], r[7], r[8])))


_TOOL_FLOATS = ("diameter", "corner_radius", "length", "taper", "tip_angle", "flute_length")


def _tool(found: dict[str, object]) -> Tool:
    sizes = {key: _numbers([found[key]], 1)[0] for key in _TOOL_FLOATS if found.get(key) is not None}
    register = None if found.get("length_register") is None else _index(found, "length_register")
    return Tool(_index(found, "number"), str(found.get("name", "")), str(found.get("shape", "")),
                **sizes, length_register=register, cutter=_numbers(found.get("cutter", []), None))


def own_spline(b: ToolpathBuilder, s: Statement) -> None:
    """$$-> SPLINE / n: the next n points lie on a spline between its ends; $$-> CUBIC / n: inside one piece of it."""
    word = s.major.removeprefix("$$->")
    count = s.numbers[0] if s.numbers else -1.0
    if b.declared is None:
        return
    if not 0 <= count <= len(b.points) + len(b.program.lines):
        b.log.error("cl.data-comment", f"$$-> {word} / {s.body}: it takes a count of points", b.line,
                    f"write for example $$-> {word} / 12")
        return
    b.roles.update(dict.fromkeys(range(b.row, b.row + int(count)), Role[word]))


def own_use(b: ToolpathBuilder, s: Statement) -> None:
    """$$-> USE / operation, tool: indices into the lists from here on."""
    if b.declared is None:
        return
    values = [int(n) for n in s.numbers]
    if len(values) != 2 or not 0 <= values[0] < len(b.declared.operations) \
            or not -1 <= values[1] < len(b.declared.tools):
        b.log.error("cl.data-comment", f"$$-> USE / {s.body}: no such operation or tool was declared", b.line,
                    "declare it before its use, or take the line out")
        return
    b.operation.set(b.row, values[0])
    b.declared.tool.set(b.row, values[1])


HANDLERS: dict[str, Callable[[ToolpathBuilder, Statement], None]] = {
    "TOOL PATH": tool_path, "END-OF-PATH": end_of_path, "$$->FEATNO": feature, "PARTNO": partno, "$$": comment,
    "PPRINT": text_event, "INSERT": text_event, "REMARK": nothing, "LPRINT": nothing, "PPLABEL": nothing,
    "LETTER": nothing, "UNITS": nothing, "UNIT": nothing, "MULTAX": multax, "FINI": fini, "SET": mode,
    "$$->TOOLPATH": own_header, "$$->FRAME": own_item, "$$->TOOL": own_item, "$$->OPERATION": own_item,
    "$$->USE": own_use, "$$->SPLINE": own_spline, "$$->CUBIC": own_spline, **dict.fromkeys(EVENTS, plain_event),
    "SPINDL": spindl, "DWELL": dwell,
    "STOP": stop, "OPSTOP": stop, "DELETE": opskip, "SELECTL": selctl, "OP_NAME": named_operation,
    "MODE": mode, "CSI_TOOL_PATH": named_operation, "OPNAME": named_operation, "APPLY": apply,
    "OPFEATSTART": solidworks_feature, "TRNTYP": turn_type, "MACHIN": machin,
}
