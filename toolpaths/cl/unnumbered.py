"""Files that number no tool: several CUTTERs, each a tool of its own, named by its form and loaded where it begins."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import replace

import numpy as np

from toolpaths.arrays import Array, Ints
from toolpaths.toolpath import Event, Tool

_CUTTER_TIP = 4
"""place of the angle between tip and radius among the parameters of CUTTER, degrees"""
_LOADS = frozenset({"LOADTL", "LOAD", "TURRET"})


def named(tools: tuple[Tool, ...]) -> tuple[Tool, ...]:
    """Tools without number and name, of which the file has several, by their form: a set-up can number them by name."""
    bare = [t.number == 0 and not t.name and t.diameter is not None for t in tools]
    if sum(bare) < 2:
        return tools
    return tuple(replace(t, name=form_of(t)) if b else t for t, b in zip(tools, bare, strict=True))


def form_of(tool: Tool) -> str:
    """Diameter, corner radius and angle of the tip, as D14 R7 or D6.8 TIP118; mm and degrees."""
    corner = f" R{tool.corner_radius:.6g}" if tool.corner_radius else ""
    tip = tool.cutter[_CUTTER_TIP] if len(tool.cutter) > _CUTTER_TIP else 0.0
    return f"D{tool.diameter:.6g}{corner}" + (f" TIP{180.0 - 2.0 * tip:.6g}" if tip else "")


def loaded(events: list[Event], tools: tuple[Tool, ...], tool: Array, line: Ints) -> list[Event]:
    """The events, with LOADTL (number 0) where one of several tools begins, in a file that loads none.

    Args:
        tool (N,): index into `tools` per row, -1 without
        line (N,): line per row
    """
    if len(tools) < 2 or any(t.number for t in tools) or any(e.word in _LOADS for e in events):
        return events
    result = list(events)
    begins = np.flatnonzero((np.diff(tool, prepend=-1) != 0) & (tool >= 0))
    for row in begins[::-1].tolist():
        at = bisect_left([e.index for e in events], row)
        result.insert(at, Event(row, "LOADTL", (0.0,), int(line[row])))
    return result
