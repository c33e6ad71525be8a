"""Records without motion as states of the machine: tool, spindle, coolant."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import Literal

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.toolpath import Event, Kind, Role, Toolpath
from toolpaths.units import MM_PER_INCH, PER_MINUTE

TOOL_WORDS = frozenset({"LOADTL", "LOAD/TOOL", "LOAD", "TURRET"})


@dataclass(frozen=True)
class ToolChange:
    """A tool change before row `index`."""

    index: int
    number: int
    register: int | None
    line: int


def numbers(event: Event) -> list[float]:
    """The numbers among an event's values, in order."""
    return [v for v in event.values if isinstance(v, (int, float))]


def words(event: Event) -> list[str]:
    """The words among an event's values, upper case."""
    return [v.upper() for v in event.values if isinstance(v, str)]


def cutting(toolpath: Toolpath) -> Bools:
    """(N,) rows that cut: motion at feed, and holes."""
    moved = (toolpath.kind != Kind.RAPID) & (toolpath.role != Role.START)
    return np.asarray(moved | (toolpath.cycle >= 0))


def tool_loads(toolpath: Toolpath) -> tuple[tuple[ToolChange, int, bool], ...]:
    """Every record that names a tool: (the record, length register then in force, True where it is another tool)."""
    return _loads(_Records(toolpath.events))


class _Records:
    """Records of one path as a key: the very same tuple, not one that is equal, which would be compared value by value."""

    def __init__(self, events: tuple[Event, ...]) -> None:
        self.events = events

    def __hash__(self) -> int:
        return id(self.events)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Records) and other.events is self.events


@lru_cache(maxsize=4)
def _loads(records: _Records) -> tuple[tuple[ToolChange, int, bool], ...]:
    """Kept, as most stages ask for it."""
    result: list[tuple[ToolChange, int, bool]] = []
    for event in records.events:
        if event.word not in TOOL_WORDS or not numbers(event):
            continue
        number, *rest = (int(v) for v in numbers(event))
        said = ToolChange(event.index, number, rest[0] if rest else None, event.line)
        other = not result or result[-1][0].number != number
        register = said.register if said.register is not None else number if other else result[-1][1]
        result.append((said, register, other))
    return tuple(result)


def tool_changes(toolpath: Toolpath) -> list[ToolChange]:
    """Every record that puts another tool into the spindle; naming the loaded tool again is no change."""
    return [said for said, _, other in tool_loads(toolpath) if other]


def stops_between(toolpath: Toolpath) -> list[ToolChange]:
    """The tool changes, but for the first, before which the file itself does not stop since the last cut:
    where `stop_between_tools` does."""
    changes = {id(said) for said in tool_changes(toolpath)[1:]}
    named = iter(said for said, _, _ in tool_loads(toolpath))
    cuts, result, stop = np.flatnonzero(cutting(toolpath)), list[ToolChange](), -1
    for event in toolpath.events:
        if event.word in ("STOP", "OPSTOP"):
            stop = event.index
        elif event.word in TOOL_WORDS and numbers(event) and id(said := next(named)) in changes:
            k = int(np.searchsorted(cuts, said.index))
            if stop < 0 or (k and stop <= cuts[k - 1]):
                result.append(said)
    return result


def register_changes(toolpath: Toolpath) -> list[ToolChange]:
    """Records that name the loaded tool again with another length register."""
    loads = tool_loads(toolpath)
    return [said for (_, before, _), (said, register, other) in pairwise(loads) if not other and register != before]


@dataclass(frozen=True)
class Spindle:
    """State of the spindle: `rpm` NaN where none is known; direction -1 anti-clockwise, 0 off, 1 clockwise;
    `last` of the two that turn."""

    rpm: float = math.nan
    direction: int = 0
    last: int = 1


def speed_said(event: Event) -> float | None:
    """rev/min of a SPINDL record: the number after RPM, else the only one that belongs to no other word; 0 where it is a
    cutting speed."""
    return _rpm_said(event.values)


def largest_said(event: Event) -> float | None:
    """rev/min that a SPINDL record allows at most (MAXRPM); None where it states none."""
    pairs = zip(event.values, event.values[1:], strict=False)
    return next((float(v) for word, v in pairs if str(word).upper() == "MAXRPM" and isinstance(v, (int, float))), None)


def cutting_speed_said(event: Event) -> float | None:
    """m/min of a SPINDL record with SMM, or with SFM in feet; None where it states none."""
    said = _words(event.values)
    if event.word != "SPINDL" or said.isdisjoint(_CUTTING_SPEED):
        return None
    speeds = [float(v) for before, v in zip(("", *event.values), event.values, strict=False)
              if isinstance(v, (int, float)) and str(before).upper() not in RANGES | {"MAXRPM"}]
    return speeds[0] * (MM_PER_INCH * 12e-3 if "SFM" in said else 1.0) if len(speeds) == 1 else math.nan


@lru_cache(maxsize=256)
def _rpm_said(values: tuple[str | float, ...]) -> float | None:
    """Kept, as a file repeats few of them."""
    if not _words(values).isdisjoint(_CUTTING_SPEED):
        return 0.0
    loose: list[float] = []
    for before, value in zip(("", *values), values, strict=False):
        if isinstance(value, (int, float)):
            word = str(before).upper()
            if word == "RPM":
                return float(value)
            if word not in RANGES:
                loose.append(float(value))
    return loose[0] if len(loose) == 1 else None


RANGES = frozenset({"RANGE", "LOW", "MEDIUM", "HIGH"})


_CUTTING_SPEED = frozenset({"SFM", "SMM"})
_STOPPING = frozenset({"OFF", "NEUTRL", "NEUTRAL"})


@lru_cache(maxsize=256)
def _words(values: tuple[str | float, ...]) -> frozenset[str]:
    return frozenset(v.upper() for v in values if isinstance(v, str))


def spindle_after(event: Event, before: Spindle) -> Spindle:
    """The spindle after a SPINDL record; ON takes the last speed and direction up again, NEUTRL stops it."""
    said, speed = _words(event.values), _rpm_said(event.values)
    if not said.isdisjoint(_STOPPING):
        return Spindle(before.rpm, 0, before.last)
    direction = -1 if "CCLW" in said else 1 if "CLW" in said else before.last
    return Spindle(before.rpm if speed is None else speed, direction, direction)


def spindle_changes(toolpath: Toolpath) -> list[tuple[Spindle, int]]:
    """(state behind it, line) of each SPINDL record."""
    result = list[tuple[Spindle, int]]()
    for event in toolpath.events:
        if event.word == "SPINDL":
            result.append((spindle_after(event, result[-1][0] if result else Spindle()), event.line))
    return result


def spindle_states(toolpath: Toolpath) -> tuple[Ints, Floats]:
    """(direction (N,), rev/min (N,) NaN while unknown) of the spindle at every row."""
    changes = spindle_changes(toolpath)
    states = [Spindle(), *(state for state, _ in changes)]
    at = state_at([0, *(e.index for e in toolpath.events if e.word == "SPINDL")], len(toolpath))
    return np.array([s.direction for s in states])[at], np.array([s.rpm for s in states])[at]


def state_at(starts: list[int], count: int) -> Ints:
    """(count,) number of the state in force at each row; `starts` are in order, the last of equal ones counts."""
    return np.searchsorted(np.array(starts), np.arange(count), side="right") - 1


def spindle_speed(toolpath: Toolpath) -> Floats:
    """Revolutions per second (N,) at every row, NaN while unknown."""
    return np.asarray(spindle_states(toolpath)[1] * PER_MINUTE)


def loaded_tools(toolpath: Toolpath) -> Ints:
    """(N,) number of the tool in the spindle at every row, -1 before any tool change."""
    changes = tool_changes(toolpath)
    return np.array([-1, *(c.number for c in changes)])[state_at([0, *(c.index for c in changes)], len(toolpath))]


def compensation_side(event: Event) -> CompensationSide | Literal[""]:
    """LEFT, RIGHT or OFF of a CUTCOM record, "" where it says none of them."""
    return next((side for w in words(event) for side in _SIDES if side == w), "")


def loaded_registers(toolpath: Toolpath) -> Ints:
    """(N,) length register that should be in force at every row, -1 before any tool change."""
    loads = tool_loads(toolpath)
    return np.array([-1, *(r for _, r, _ in loads)])[state_at([0, *(c.index for c, _, _ in loads)], len(toolpath))]


def compensation_states(toolpath: Toolpath) -> Ints:
    """(N,) 40, 41 or 42 as CUTCOM says at every row; holes and tool changes need it off."""
    states, starts = [40], [0]
    for event in toolpath.events:
        if event.word == "CUTCOM":
            side = compensation_side(event)
            states.append(_SIDES[side] if side else states[-1])
            starts.append(event.index)
        elif event.word in TOOL_WORDS:
            states.append(40)
            starts.append(event.index)
    return np.where(toolpath.cycle >= 0, 40, np.array(states)[state_at(starts, len(toolpath))])


CompensationSide = Literal["LEFT", "RIGHT", "OFF"]
_SIDES: dict[CompensationSide, int] = {"LEFT": 41, "RIGHT": 42, "OFF": 40}
