"""Tools without a number, or that no record loads: numbered by the set-up and loaded where they begin, else refused."""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from postproc.reference.events import TOOL_WORDS, cutting, numbers
from postproc.reference.same_tool import differ, differ_in_length
from postproc.setup.model import SetupFile
from toolpaths.arrays import Bools, Ints
from toolpaths.diagnostics import Diagnostic, error, info
from toolpaths.toolpath import Event, Role, Tool, Toolpath

UNNAMED = "unnamed"
"""key of [tool_numbers] for a tool that has neither name nor number"""
_PREPARES = frozenset({*TOOL_WORDS, "SELECT"})


def named_by(tool: Tool) -> str:
    """The key of [tool_numbers] that is a tool's, capitals."""
    return (tool.name or (UNNAMED if tool.number <= 0 else "")).upper()


def with_tools(toolpath: Toolpath) -> Toolpath:
    """The path with a tool in every row: rapids before the first load are made with the tool that it loads;
    what cuts without any gets an unnamed one, which the set-up can number."""
    if not len(toolpath):
        return toolpath
    number = _numbers(toolpath)
    if (number > 0).all():
        return toolpath
    starts = [e.index for e in toolpath.events if e.word in TOOL_WORDS and numbers(e)]
    known = starts[0] if starts else int(np.append(np.flatnonzero(toolpath.tool >= 0), len(toolpath))[0])
    tool = np.array(toolpath.tool)
    if 0 < known < len(toolpath) and tool[known] >= 0 and not cutting(toolpath)[:known].any():
        tool[:known] = np.where(number[:known] > 0, tool[:known], tool[known])
    if not (tool < 0).any():
        return replace(toolpath, tool=tool)
    return replace(toolpath, tool=np.where(tool < 0, len(toolpath.tools), tool),
                   tools=(*toolpath.tools, Tool(0)))


def with_loads(toolpath: Toolpath, asked: Collection[str] = ()) -> tuple[Toolpath, list[Diagnostic]]:
    """The path with LOADTL where its rows begin with a tool that has a number and that no record has loaded
    by then: at the beginning of the file, in files without any such record at every change, and behind one for
    tools that the set-up numbers (`asked`: their names in capitals)."""
    events, number = toolpath.events, _numbers(toolpath)
    loads = [e for e in events if e.word in TOOL_WORDS and numbers(e)]
    if not len(toolpath):
        return toolpath, []
    stop = loads[0].index if loads else len(toolpath)
    if stop and loads and not cutting(toolpath)[:stop].any() and int(numbers(loads[0])[0]) == number[0]:
        return replace(toolpath, events=_loaded_first(events, loads[0])), []
    begins = np.flatnonzero(np.diff(number[:stop], prepend=-1) != 0)
    begins = np.concatenate([begins[number[begins] > 0], _numbered_behind(toolpath, number, loads, asked)])
    result = list(events)
    for row in begins[::-1].tolist():
        at = next((k for k, e in enumerate(result) if e.index >= row), len(result))
        result.insert(at, Event(row, "LOADTL", (float(number[row]),), int(toolpath.line[row])))
    if not len(begins):
        return toolpath, []
    names = ", ".join(dict.fromkeys(f"T{n}" for n in number[begins].tolist()))
    return replace(toolpath, events=tuple(result)), [
        info("tool.loaded", f"no record of the CL file loads {names}: called where it begins to be used", file=toolpath.file,
             lines=toolpath.line[begins][:6].tolist(), count=len(begins))]


def _numbered_behind(toolpath: Toolpath, number: Ints, loads: list[Event], asked: Collection[str]) -> Ints:
    """Rows behind the first load at which a tool must be called: where it begins to be used and cuts while another is
    loaded, if the set-up numbers it, or another one was called so before it."""
    found: list[int] = []
    if not loads or not asked:
        return np.array(found, dtype=np.int64)
    begins = np.flatnonzero(np.diff(number, prepend=-1) != 0)
    cuts = np.append(np.flatnonzero(cutting(toolpath)), len(toolpath))
    first = cuts[np.searchsorted(cuts, begins)]
    at = np.array([e.index for e in loads])
    by_then, by_end = (np.searchsorted(at, rows, "right") for rows in (first, np.append(begins[1:], len(toolpath)) - 1))
    loaded, before = 0, 0
    for row, cut, end, then, ends in zip(begins, first, np.append(begins[1:], len(toolpath)), by_then, by_end, strict=True):
        loaded = int(numbers(loads[then - 1])[0]) if then > before else loaded
        named = bool(found) or named_by(toolpath.tools[toolpath.tool[row]]) in asked
        if cut < end and 0 < loaded != number[row] > 0 and named:
            found.append(int(row))
            loaded = int(number[row])
        loaded, before = int(numbers(loads[ends - 1])[0]) if ends > max(then, before) else loaded, int(ends)
    return np.array(found, dtype=np.int64)


def _loaded_first(events: tuple[Event, ...], load: Event) -> tuple[Event, ...]:
    """The events with the first load before all motion: the rapids before it are made with its tool."""
    rest = [e for e in events if e is not load]
    return (replace(load, index=0), *rest)


def _numbers(toolpath: Toolpath) -> Ints:
    return np.array([t.number for t in toolpath.tools] + [-1])[toolpath.tool]


def without_number(toolpath: Toolpath, setup: SetupFile) -> tuple[list[Diagnostic], dict[str, int]]:
    """An error where tools that move have no number (T0 is an empty spindle), with the lines of a set-up that give one;
    these numbers by name."""
    if not setup.output.tool_call:
        return [], {}
    moving = toolpath.tool[toolpath.role != Role.START]
    used, at = np.unique(moving, return_index=True)
    bad = [int(k) for k in used[np.argsort(at)] if k >= 0 and toolpath.tools[int(k)].number <= 0]
    if not bad:
        return [], {}
    keys = list(dict.fromkeys(toolpath.tools[k].name or UNNAMED for k in bad))
    proposed = dict(zip(keys, _free(toolpath, setup), strict=False))
    lines = [int(toolpath.line[np.flatnonzero(toolpath.tool == k)[0]]) for k in bad]
    head = "add under [tool_numbers] of the set-up:" if setup.tool_numbers else "add to the set-up:\n[tool_numbers]"
    hint = [head, *(f"{json.dumps(key, ensure_ascii=False)} = {n}" for key, n in proposed.items())]
    if len(keys) == 1 and not any(t.number > 0 for t in toolpath.tools):
        hint.append("or, where it stands in the spindle and is measured into the work offset, [output] tool_call = false")
    said = ", ".join("a tool without a name" if key == UNNAMED else key for key in keys[:6])
    more = "" if len(keys) <= 6 else f" and {len(keys) - 6} more"
    return [error("tool.number", f"the CL file gives no number to {said}{more}: T0 is an empty spindle, and without a tool "
                  "call no length is in force", file=toolpath.file, lines=lines[:6], count=len(bad),
                  hint="\n".join(hint))], proposed


def _free(toolpath: Toolpath, setup: SetupFile) -> list[int]:
    """Numbers that are proposed, in order: those of [tools.N] that nothing uses yet, then the next free ones."""
    taken = {t.number for t in toolpath.tools} | set(setup.tool_numbers.values())
    own = sorted(int(n) for n in setup.tools if int(n) > 0 and int(n) not in taken)
    rest = [n for n in range(1, len(toolpath.tools) + len(taken) + 2) if n not in taken and n not in own]
    return own + rest


def measured(toolpath: Toolpath, setup: SetupFile) -> tuple[Toolpath, list[Diagnostic]]:
    """The path without tool calls, where the set-up says that its one tool is measured into the work offset."""
    if setup.output.tool_call or not len(toolpath):
        return toolpath, []
    moving = toolpath.role != Role.START
    used = np.unique(toolpath.tool[moving])
    names = list(dict.fromkeys(_called(toolpath.tools[int(k)]) for k in used if k >= 0))
    loads = {int(numbers(e)[0]) for e in toolpath.events if e.word in TOOL_WORDS and numbers(e)}
    if len({toolpath.tools[int(k)].number for k in used if k >= 0}) > 1 or len(loads) > 1 or len(names) > 1:
        return toolpath, [error("tool.measured", f"[output] tool_call = false, but the CL file uses {', '.join(names)}: one "
                                "work offset cannot hold the lengths of several tools", file=toolpath.file,
                                hint="take tool_call out of the set-up and number the tools under [tool_numbers], or "
                                "convert the operations of each tool by themselves")]
    if found := _of_other_form(toolpath, moving):
        return toolpath, [found]
    events = tuple(e for e in toolpath.events if e.word not in _PREPARES)
    return replace(toolpath, events=events), []


def _of_other_form(toolpath: Toolpath, moving: Bools) -> Diagnostic | None:
    """An error where tools of one name that move have different forms or heights, with the first line of each."""
    rows = np.flatnonzero(moving & (toolpath.tool >= 0))
    used, at = np.unique(toolpath.tool[rows], return_index=True)
    first = [(int(rows[at[k]]), toolpath.tools[int(used[k])]) for k in np.argsort(at)]
    for j, (row, tool) in enumerate(first):
        for before, other in first[:j]:
            if differ(other, tool) or differ_in_length(other, tool):
                lines = [int(toolpath.line[before]), int(toolpath.line[row])]
                return error("tool.measured", f"[output] tool_call = false, but the CL file uses two tools: {_form(other)} "
                             f"from line {lines[0]}, {_form(tool)} from line {lines[1]}: one work offset cannot hold the "
                             "lengths of several tools", file=toolpath.file, lines=lines,
                             hint="convert the operations of each tool by themselves, or take tool_call out of the set-up "
                             "and number the tools in the CAM system")
    return None


def measured_length(toolpath: Toolpath, setup: SetupFile) -> float:
    """Gauge length of the one tool of a path that calls none, mm; 0 where the set-up does not say."""
    number = max((t.number for t in toolpath.tools), default=0)
    tool = setup.tools.get(str(max(number, 0)))
    return tool.length if tool else 0.0


def _called(tool: Tool) -> str:
    name = f" {tool.name}" if tool.name else ""
    return (f"T{tool.number}{name}" if tool.number > 0 else name.strip() or "a tool without a name")


def _form(tool: Tool) -> str:
    sizes = ((" diameter", tool.diameter), (" height", tool.length), (" flutes", tool.flute_length))
    return _called(tool) + "".join(f"{what} {size:g} mm" for what, size in sizes if size is not None)
