"""What a CL file states for a set-up, and what it leaves open: numbers, speeds and lengths of tools, coolant, feeds."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import count

import numpy as np

from machines.machine import Machine
from postproc.base.options import Options
from postproc.control.modes import table_axes
from postproc.controllers.model import ControllerFile
from postproc.job.job import OF_SETUP, prepare
from postproc.reference.events import cutting, cutting_speed_said, largest_said, spindle_states
from postproc.reference.records import plain_records
from postproc.reference.same_tool import differ
from postproc.reference.spindle_defaults import FASTEST, Use, uses
from postproc.reference.stated_feeds import without_feed
from postproc.reference.tool_numbers import numbered
from postproc.reference.unnumbered_tools import UNNAMED, with_tools
from postproc.setup.model import SetupFile
from postproc.setup.spindle import Direction
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, Severity
from toolpaths.toolpath import Event, Kind, Role, Tool, Toolpath

TRIAL_FEED, TRIAL_SPEED = 100.0, 1000.0
"""what stands in for open values while the rest is looked at; never written"""


@dataclass(frozen=True)
class NumberedTool:
    """A tool by its name in the file, the number that it gets, and why; `assumed` where that is not the file's."""

    name: str
    number: int
    why: str
    assumed: bool = True


@dataclass(frozen=True)
class CuttingSpeed:
    """The first cutting speed that the CL file states for a tool, as it states it, and the rev/min that it is at the
    tool's diameter."""

    said: str
    rpm: float


@dataclass(frozen=True)
class ToolFacts:
    """A tool that cuts, by its number.

    Attributes:
        called: name and size for people
        speed: of the CL file in words, "" where it states none for some cut
        direction: of the spindle in the cuts without a speed, where the CL file states it for all of them, else clockwise
        coolant: of the CL file, "" where it states none
        cutting_speed: where the CL file states one in the place of rev/min
        cutter: length of the cutter as CAM draws it, mm, or None
    """

    number: int
    called: str
    speed: str
    coolant: str
    cutter: float | None
    line: int
    direction: Direction = "clockwise"
    cutting_speed: CuttingSpeed | None = None


@dataclass(frozen=True)
class SheetFacts:
    """What is known before anything is asked.

    Attributes:
        named: numbers that [tool_numbers] must give
        tools: that cut, in order of use
        lengths: the axis words depend on gauge lengths
        without_feed: number of moves that cut before any feed is stated, and the first lines
        refused: errors that no set-up answers
    """

    named: tuple[NumberedTool, ...]
    tools: tuple[ToolFacts, ...]
    lengths: bool
    without_feed: int
    feed_lines: tuple[int, ...]
    refused: tuple[Diagnostic, ...]
    largest_speed: float = math.inf
    """rev/min, of the machine's spindle"""
    reach: bool = False
    """no place was found without gauge lengths: the spindle would have to come down to the part itself"""
    turning: bool = False
    """rotary axes carry the part, so that travel, and the place that it leaves, go by how long the tools are"""

    @property
    def numbers(self) -> dict[str, int]:
        """[tool_numbers]"""
        return {one.name: one.number for one in self.named}


def named_tools(toolpath: Toolpath) -> tuple[NumberedTool, ...]:
    """Tools to which [tool_numbers] must give numbers, with numbers that are free."""
    return (*_without_number(toolpath), *_of_one_number(toolpath))


def facts_of(toolpath: Toolpath, machine: Machine, controller: ControllerFile, options: Options,
             named: tuple[NumberedTool, ...] | None = None) -> SheetFacts:
    """What a path states and leaves open on a machine and a control; `named` as of `named_tools`, with its answers."""
    named = named_tools(toolpath) if named is None else named
    numbers = {one.name: one.number for one in named}
    path, _ = numbered(toolpath, SetupFile(tool_numbers=numbers))
    path, _ = plain_records(path, controller)
    largest = machine.largest_spindle_speed
    output = {"feed": TRIAL_FEED, "spindle": {"rpm": min(TRIAL_SPEED, largest)}}
    trial = SetupFile.model_validate({"output": output, "tool_numbers": numbers})
    job, found = prepare(toolpath, machine, controller, trial, options)
    errors = [d for d in found if d.severity is Severity.ERROR]
    rows = np.flatnonzero(without_feed(path))
    return SheetFacts(named, tuple(_tools(path)), any(d.code == "tool.length" for d in errors), len(rows),
                      tuple(np.unique(path.line[rows])[:3].tolist()),
                      tuple(d for d in errors if d.code not in OF_SETUP), largest,
                      turning=job is not None and len(table_axes(job.control)) > 0)


def taken_numbers(toolpath: Toolpath) -> set[int]:
    """Numbers that the file itself uses."""
    loads = {int(v) for e in toolpath.events if e.word in ("LOADTL", "LOAD/TOOL", "LOAD", "TURRET")
             for v in e.values[:1] if isinstance(v, float)}
    return loads | {t.number for t in toolpath.tools}


def _free(toolpath: Toolpath) -> Iterator[int]:
    taken = taken_numbers(toolpath)
    return (n for n in count(1) if n not in taken)


def _without_number(toolpath: Toolpath) -> list[NumberedTool]:
    """Free numbers for all tools that move without one."""
    path = with_tools(toolpath)
    moving = path.tool[path.role != Role.START]
    used, at = np.unique(moving, return_index=True)
    bad = [path.tools[int(k)] for k in used[np.argsort(at)] if k >= 0 and path.tools[int(k)].number <= 0]
    keys = dict.fromkeys(t.name or UNNAMED for t in bad)
    free = _free(toolpath)
    return [NumberedTool(key, next(free), "the CL file gives it no number: the next that is free") for key in keys]


def _of_one_number(toolpath: Toolpath) -> list[NumberedTool]:
    """Numbers of their own for different tools, by name, that the file gives one number."""
    rows = np.flatnonzero((toolpath.kind != Kind.RAPID) | (toolpath.cycle >= 0))
    used, at = np.unique(toolpath.tool[rows], return_index=True)
    tools = [toolpath.tools[int(k)] for k in used[np.argsort(at)] if k >= 0]
    free = _free(toolpath)
    for _ in _without_number(toolpath):
        next(free)
    result: dict[str, NumberedTool] = {}
    first: dict[int, Tool] = {}
    for tool in tools:
        if tool.number <= 0:
            continue
        other = first.setdefault(tool.number, tool)
        if other is tool or not tool.name or not other.name or tool.name.upper() == other.name.upper() or not differ(
                other, tool):
            continue
        why = f"the CL file gives T{tool.number} to different tools, {other.name} and {tool.name}"
        result.setdefault(other.name, NumberedTool(other.name, other.number, why, assumed=False))
        if tool.name not in result:
            result[tool.name] = NumberedTool(tool.name, next(free), f"{why}: the next number that is free")
    return list(result.values())


def _tools(path: Toolpath) -> Iterator[ToolFacts]:
    """The tools that cut, each once, in order of use."""
    direction, rpm = spindle_states(path)
    cuts = cutting(path)
    found: dict[int, list[Use]] = {}
    for use in uses(path):
        if cuts[use.first:use.last].any():
            found.setdefault(use.number, []).append(use)
    for number, here in found.items():
        rows = np.concatenate([np.flatnonzero(cuts[u.first:u.last]) + u.first for u in here])
        events = [e for u in here for e in path.events[u.begin:u.end]]
        stands = (direction[rows] == 0) | ~(rpm[rows] > 0.0)
        speeds = sorted({f"{value:g}" for value in rpm[rows[~stands]].tolist()}, key=float)
        tool = path.tools[int(path.tool[rows[0]])] if path.tool[rows[0]] >= 0 else Tool(number)
        yield ToolFacts(number, _called(tool, number), "" if stands.any() else ", ".join(speeds) + " rev/min",
                        _coolant(events), _height(tool), int(path.line[rows[0]]),
                        "anti-clockwise" if stands.any() and (direction[rows[stands]] < 0).all() else "clockwise",
                        _cutting_speed(events, tool))


def _cutting_speed(events: list[Event], tool: Tool) -> CuttingSpeed | None:
    """At the outside of the tool: v = pi d n."""
    if tool.diameter is None or not tool.diameter > 0.0:
        return None
    for event in events:
        turns = 1e3 * (cutting_speed_said(event) or 0.0) / (math.pi * tool.diameter)
        if 1.0 <= turns <= FASTEST:
            said = f"{event.word}/{','.join(f'{v:g}' if isinstance(v, float) else str(v) for v in event.values)}"
            most = largest_said(event) or math.inf
            return CuttingSpeed(f"{said} at diameter {tool.diameter:.4g} mm", min(round(turns), most))
    return None


def _coolant(events: list[Event]) -> str:
    said = [" ".join(map(str, e.values)) or "ON" for e in events if e.word == "COOLNT"]
    return ", ".join(dict.fromkeys(said))


def _height(tool: Tool) -> float | None:
    known = [v for v in (tool.length, tool.flute_length) if v is not None and v > 0.0]
    return max(known, default=None)


def _called(tool: Tool, number: int) -> str:
    size = "" if tool.diameter is None else f" diameter {tool.diameter:.4g} mm"
    name = f" {json.dumps(tool.name, ensure_ascii=False)}" if tool.name else ""
    return f"T{number}{name}{size}"
