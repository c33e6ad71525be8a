"""Numbers of tools: one for each, where a CAM system leaves all at 0 by the names that the set-up numbers."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count

import numpy as np

from postproc.reference.events import TOOL_WORDS, cutting, loaded_tools, numbers
from postproc.reference.same_tool import differ
from postproc.reference.unnumbered_tools import measured, named_by, with_loads, with_tools, without_number
from postproc.setup.model import SetupFile
from toolpaths.arrays import Ints
from toolpaths.diagnostics import Diagnostic, Severity, error, info
from toolpaths.toolpath import Event, Kind, Tool, Toolpath

Word = str | float
Report = Callable[[Severity, str, str, int, str], None]


def numbered(toolpath: Toolpath, setup: SetupFile, file: str = "") -> tuple[Toolpath, list[Diagnostic]]:
    """The path with the set-up's `[tool_numbers]` in its tools and in the records that load them; `file` is the set-up's.

    A record loads the tool that the rows behind it are cut with; SELECT prepares the one that is loaded next.
    """
    toolpath = with_tools(toolpath)
    asked = {name.upper(): number for name, number in setup.tool_numbers.items()}
    tools = tuple(replace(t, number=asked.get(named_by(t), t.number)) for t in toolpath.tools)
    known = {named_by(t) for t in toolpath.tools}
    unknown = [name for name in setup.tool_numbers if name.upper() not in known]
    found = [info("setup.tool_name_unused", f"[tool_numbers]: the CL file has no tool {', '.join(unknown)}", file=file,
                  hint="its tools: " + (", ".join(sorted(t.name for t in tools if t.name)) or "none has a name"))
             ] if unknown else []
    given = toolpath
    if asked:
        toolpath = replace(toolpath, tools=tools, events=_events(toolpath, tools, asked))
    if not setup.output.tool_call:
        toolpath, more = measured(toolpath, setup)
        return toolpath, found + more
    missing, proposed = without_number(toolpath, setup)
    found += missing
    toolpath, more = with_loads(toolpath, asked)
    if proposed:  # what is wrong with the loads shows where all tools have numbers
        whole = setup.model_copy(update={"tool_numbers": {**setup.tool_numbers, **proposed}})
        more = [*more, *(d for d in numbered(given, whole)[1] if d.code == "tool.not_loaded")]
        return toolpath, found + more
    return toolpath, found + more + _not_loaded(toolpath)


def _events(toolpath: Toolpath, tools: tuple[Tool, ...], asked: dict[str, int]) -> tuple[Event, ...]:
    """The records in order, tools in their new numbers."""
    result: list[Event] = []
    next_one: tuple[Word, Word] = "", ""
    for event in reversed(toolpath.events):
        if event.word in TOOL_WORDS and event.values:
            index = int(toolpath.tool[event.index]) if event.index < len(toolpath) else -1
            own = index >= 0 and named_by(toolpath.tools[index]) in asked
            next_one = event.values[0], float(tools[index].number) if own else event.values[0]
            event = replace(event, values=(next_one[1], *event.values[1:]))
        elif event.word == "SELECT" and event.values[:1] == next_one[:1]:
            event = replace(event, values=next_one[1:])
        result.append(event)
    return tuple(reversed(result))


def _not_loaded(toolpath: Toolpath) -> list[Diagnostic]:
    """Cuts with a tool that has a number while the file has loaded another."""
    own = np.array([t.number for t in toolpath.tools] + [-1])[toolpath.tool]
    rows: Ints = np.flatnonzero(cutting(toolpath) & (own > 0) & (own != loaded_tools(toolpath)))
    if not len(rows):
        return []
    tool = toolpath.tools[int(toolpath.tool[rows[0]])]
    return [error("tool.not_loaded", f"the file cuts with {tool.name} (T{tool.number}) without a record that loads it",
                  file=toolpath.file, lines=toolpath.line[rows[:6]].tolist(), count=len(rows),
                  hint="put LOAD/TOOL or LOADTL before it in the CAM system")]


def check_numbers(toolpath: Toolpath, report: Report) -> None:
    """Different tools under one number that both cut; those without a number are refused as such."""
    cutting = toolpath.tool[(toolpath.kind != Kind.RAPID) | (toolpath.cycle >= 0)]
    lines = toolpath.line[(toolpath.kind != Kind.RAPID) | (toolpath.cycle >= 0)]
    used, first = np.unique(cutting, return_index=True)
    known: dict[int, list[tuple[Tool, int]]] = {}
    own = _own_numbers(toolpath, [toolpath.tools[k] for k in used.tolist() if k >= 0])
    for index, at in sorted(zip(used.tolist(), first.tolist(), strict=True), key=lambda pair: pair[1]):
        if index < 0 or toolpath.tools[index].number <= 0:
            continue
        tool, line = toolpath.tools[index], int(lines[at])
        others = known.setdefault(tool.number, [])
        other = next((o for o in others if differ(o[0], tool)), None)
        if other:
            hint = f"cutting begins at lines {other[1]} and {line}; {_remedy(other[0], tool, own)}"
            named = other[0].name or tool.name or other[0].shape or tool.shape
            report(Severity.ERROR if named else Severity.WARNING, "tool.same_number", "different tools have the number "
                   f"{tool.number}: {_called(other[0])} and {_called(tool)}", other[1], hint)
        elif renamed := next((o for o in others if o[0].name and tool.name and o[0].name.upper() != tool.name.upper()),
                             None):
            hint = (f"cutting begins at lines {renamed[1]} and {line}; where they are two tools, "
                    f"{_remedy(renamed[0], tool, _apart(renamed[0], tool, toolpath))}")
            report(Severity.WARNING, "tool.same_number", f"T{tool.number} has two names and one size: {_called(renamed[0])} "
                   f"and {_called(tool)}; both cut as one tool", renamed[1], hint)
        others.append((tool, line))


def _unused(toolpath: Toolpath) -> Iterator[int]:
    """Numbers that no tool has and no record loads."""
    taken = {t.number for t in toolpath.tools} | {int(numbers(e)[0]) for e in toolpath.events
                                                  if e.word in TOOL_WORDS and numbers(e)}
    return (n for n in count(1) if n not in taken)


def _apart(kept: Tool, tool: Tool, toolpath: Toolpath) -> dict[str, int]:
    """By name, numbers that keep two tools of one number apart."""
    return {kept.name: kept.number, tool.name: next(_unused(toolpath))}


def _own_numbers(toolpath: Toolpath, tools: list[Tool]) -> dict[str, int]:
    """By name, numbers that keep all different tools of one number apart: the first keeps it, the others get free ones."""
    unused = _unused(toolpath)
    first: dict[int, Tool] = {}
    found: dict[str, int] = {}
    for tool in tools:
        kept = first.setdefault(tool.number, tool)
        if tool.number > 0 and kept is not tool and kept.name and tool.name and differ(kept, tool) and (
                tool.name.upper() != kept.name.upper()):
            found.setdefault(kept.name, kept.number)
            if tool.name not in found:
                found[tool.name] = next(unused)
    return found


def _remedy(a: Tool, b: Tool, own: dict[str, int]) -> str:
    """How the set-up keeps all tools of one number apart: by name, where these differ."""
    if not a.name or not b.name or a.name.upper() == b.name.upper():
        return "number them in the CAM system"
    lines = "\n".join(f"{json.dumps(name, ensure_ascii=False)} = {number}" for name, number in own.items())
    return f"number them in the CAM system, or by name in the set-up:\n[tool_numbers]\n{lines}"


def _called(tool: Tool) -> str:
    size = "" if tool.diameter is None else f" diameter {tool.diameter:g}"
    return f"{tool.name or tool.shape or 'a tool'}{size}"
