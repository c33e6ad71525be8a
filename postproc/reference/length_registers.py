"""Registers of length (ADJUST, OSETNO of LOADTL) and radius (CUTCOM): by a rule of the shop where the file
names none, and on controls whose tools bring their lengths along."""

from __future__ import annotations

from dataclasses import replace

from postproc.controllers.model import ControllerFile
from postproc.reference.events import TOOL_WORDS, ToolChange, compensation_side, numbers, tool_loads
from toolpaths.diagnostics import Diagnostic, error, info, warning
from toolpaths.toolpath import Event, Toolpath

EDGES = range(1, 10)
"""cutting edges D of a tool (SINUMERIK 840D operator's guide HMI Advanced, 5.1.1; MD18105 as delivered)"""


def by_rule(toolpath: Toolpath, controller: ControllerFile, length: int, radius: int | None) -> Toolpath:
    """The path whose records name registers by the rules of the shop, H = T + `length`, D = T + `radius`,
    where the file names none, or the tool's number, as CAM systems do by themselves; where the controller's
    codes have none, nothing is named."""
    codes = controller.codes
    cutcom = radius is not None and "{register}" in codes.compensation_left
    lengths = bool(length) and "{register}" in codes.length_offset
    if not lengths and not cutcom:
        return toolpath
    tool, events = -1, list[Event]()
    for event in toolpath.events:
        said = numbers(event)
        if event.word in TOOL_WORDS and said:
            tool = int(said[0])
            if lengths and (len(said) == 1 or said[1] == said[0]):
                event = replace(event, values=(float(tool), float(tool + length)))
        elif event.word == "CUTCOM" and cutcom and (
                not said or said[0] == tool) and tool > 0 and compensation_side(event) in ("LEFT", "RIGHT"):
            side = tuple(v for v in event.values if isinstance(v, str))
            event = replace(event, values=(*side, float(tool + (radius or 0))))
        events.append(event)
    return replace(toolpath, events=tuple(events))


def own_registers(toolpath: Toolpath, controller: ControllerFile) -> tuple[Toolpath, list[Diagnostic]]:
    """The path without length registers where the controller has none, and what is then written.

    Refused is what may mean another length than the tool's own: two registers of one tool, and 2 to 9 where
    the number may be that of a cutting edge.
    """
    text = controller.codes.length_offset
    if "{register}" in text:
        return toolpath, []
    loads = tool_loads(toolpath)
    named = [said for said, register, _ in loads if register != said.number]
    if not named:
        return toolpath, []
    known: dict[int, set[int]] = {}
    for said, register, _ in loads:
        known.setdefault(said.number, set()).add(register)
    lengths = [said for said in named if len(known[said.number]) > 1]
    several = controller.tools.cutting_edges
    edges = [said for said in named if several and said not in lengths and said.register in EDGES and said.register != 1]
    rest = [said for said in named if said not in lengths and said not in edges]
    found = _refused(toolpath, lengths, "names more than one length register, but this controller has one length of a tool",
                     "give each length a tool number of its own, or state no ADJUST in LOADTL")
    found += _refused(toolpath, edges, "names what may be a length register or a cutting edge (D2 to D9): the lengths of "
                      f"further edges are not known, {text} would be written",
                      f"state ADJUST,1 or none in LOADTL where {text} is meant")
    return replace(toolpath, events=tuple(_bare(e) for e in toolpath.events)), found + _noted(toolpath, rest, text)


def _bare(event: Event) -> Event:
    """A record that loads a tool, without its register."""
    return replace(event, values=event.values[:1]) if event.word in TOOL_WORDS else event


def _names(loads: list[ToolChange]) -> str:
    return ", ".join(dict.fromkeys(f"T{said.number} (register {said.register})" for said in loads))


def _refused(toolpath: Toolpath, loads: list[ToolChange], what: str, hint: str) -> list[Diagnostic]:
    return [error("tool.register", f"{_names(loads)} {what}", file=toolpath.file, lines=[s.line for s in loads][:6],
                  count=len(loads), hint=hint)] if loads else []


def _noted(toolpath: Toolpath, loads: list[ToolChange], text: str) -> list[Diagnostic]:
    """What is written in place of registers; no more than a note where the text says the same number."""
    if not loads:
        return []
    say = info if all(text == f"D{said.register}" for said in loads) else warning
    return [say("tool.register", f"{_names(loads)}: this controller has no length registers, the tool's own length is taken "
                f"from its tool table{f' ({text})' if text else ''}", file=toolpath.file, lines=[s.line for s in loads][:6],
                count=len(loads), hint="the table must hold there what the register would hold")]
