"""One path at several places: its rows, records and operations once for each, ordered by tool or by part.

Chunks are what one tool does between two changes; the order "part" has one, the whole path. Every copy begins in the
states in which the path itself has come there, whatever the copy before has left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from postproc.reference.events import (
    TOOL_WORDS,
    Spindle,
    numbers,
    speed_said,
    spindle_after,
    tool_changes,
    tool_loads,
    words,
)
from postproc.setup.model import Placement
from postproc.setup.places import PlaceOrder
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays, rows_of
from toolpaths.toolpath import Arcs, Event, Toolpath

_KEPT = ("COOLNT", "CUTCOM", "OPSKIP")
"""records whose last one holds until the next; without one it is off"""
_END = frozenset({"END", "GOHOME"})


@dataclass(frozen=True)
@arrays(place="N", previous="N", begins="B")
class Repeated:
    """The rows of a path that stands at several places.

    Attributes:
        place (N,): number of the place of each row
        previous (N,): the row before it at the same place, -1 for the first
        begins (B,): rows at which another place than that of the row before is come to
    """

    place: Ints
    previous: Ints
    begins: Ints


@dataclass(frozen=True)
class _Chunk:
    """Rows `first` to before `last` of the path, with its records `begin` to before `end`."""

    first: int
    last: int
    begin: int
    end: int


def repeated(toolpath: Toolpath, places: Sequence[Placement], order: PlaceOrder) -> tuple[Toolpath, Repeated]:
    """The path at every place; `places` take its frame to itself as it stands there, the first one to where it is."""
    chunks = _chunks(toolpath) if order == "tool" else [_Chunk(0, len(toolpath), 0, len(toolpath.events))]
    steps = [(chunk, k) for chunk in chunks for k in range(len(places))]
    rows = np.concatenate([np.arange(c.first, c.last) for c, _ in steps])
    place = np.concatenate([np.full(c.last - c.first, k) for c, k in steps])
    starts = np.cumsum([0, *(c.last - c.first for c, _ in steps)])
    begins = np.array([s for s, n, (_, k), (_, before) in zip(
        starts[1:].tolist(), starts[2:].tolist(), steps[1:], steps, strict=False) if k != before and n > s], dtype=np.int64)
    count = len(toolpath.operations)
    moved = _moved(toolpath, rows, place, places)
    made = replace(
        moved, events=_events(toolpath, steps, starts.tolist()), operations=toolpath.operations * len(places),
        operation=(toolpath.operation[rows] + count * place).astype(np.int32),
        pass_=(toolpath.pass_[rows] + (int(toolpath.pass_.max(initial=0)) + 1) * place).astype(np.int32))
    return made, Repeated(place, _previous(place, len(places)), begins)


def _chunks(toolpath: Toolpath) -> list[_Chunk]:
    """What each tool does, its records from the load on; what precedes a load at the same row ends the chunk before."""
    changes = tool_changes(toolpath)[1:]
    at = [next(k for k, e in enumerate(toolpath.events) if e.word in TOOL_WORDS and numbers(e)
               and (e.index, e.line) == (c.index, c.line)) for c in changes]
    edges = [(0, 0), *zip((c.index for c in changes), at, strict=True), (len(toolpath), len(toolpath.events))]
    return [_Chunk(a, b, i, j) for (a, i), (b, j) in pairwise(edges)]


def _previous(place: Ints, count: int) -> Ints:
    result = np.full(len(place), -1)
    for k in range(count):
        own = np.flatnonzero(place == k)
        result[own[1:]] = own[:-1]
    return result


def _moved(toolpath: Toolpath, rows: Ints, place: Ints, places: Sequence[Placement]) -> Toolpath:
    """The path in the rows, those of each place as they are there; each place has arcs of its own."""
    points, directions = [p.points for p in places], [p.directions for p in places]
    given, arc = toolpath.arcs, toolpath.arc[rows]
    arcs = Arcs(np.concatenate([move(given.center) for move in points]),
                np.concatenate([move(given.normal) for move in directions]),
                np.tile(given.radius, len(places)), np.tile(given.sweep, len(places)))
    taken = rows_of(toolpath, "N", rows)
    return replace(taken, tip=_each(taken.tip, place, points), axis=_each(taken.axis, place, directions), arcs=arcs,
                   arc=np.where(arc >= 0, arc + len(given) * place, -1).astype(np.int32),
                   normal=None if taken.normal is None else _each(taken.normal, place, directions),
                   contact=None if taken.contact is None else _each(taken.contact, place, points))


def _each(column: Floats, place: Ints, moved: Sequence[Callable[[Floats], Floats]]) -> Floats:
    """A column (N, 3), the rows of each place moved there."""
    result = np.array(column)
    for k, move in enumerate(moved):
        own = np.flatnonzero(place == k)
        result[own] = move(result[own])
    return result


def _events(toolpath: Toolpath, steps: Sequence[tuple[_Chunk, int]], starts: list[int]) -> tuple[Event, ...]:
    """The records of every step, behind those that bring back the states in which the path comes to its chunk.

    A tool that is in the spindle already is named with the register that it had then; ends between places fall away.
    """
    loads = [e for e in toolpath.events if e.word in TOOL_WORDS and numbers(e)]
    registers = {id(e): float(r) for e, (_, r, _) in zip(loads, tool_loads(toolpath), strict=True)}
    result = list[Event]()
    for n, ((chunk, _), start) in enumerate(zip(steps, starts, strict=False)):
        own, again = toolpath.events[chunk.begin:chunk.end], n > 0 and steps[n - 1][0].end != chunk.begin
        if again:
            result += _brought_back(toolpath, chunk, steps[n - 1][0].end, start)
        for event in own:
            if event.word in _END and event.index >= chunk.last and n + 1 < len(steps):
                continue
            named = (numbers(event)[0], registers[id(event)]) if again and id(event) in registers else event.values
            result.append(replace(event, index=start + event.index - chunk.first, values=named))
    return tuple(result)


def _brought_back(toolpath: Toolpath, chunk: _Chunk, left: int, start: int) -> list[Event]:
    """Records for what was in force where the path itself comes to a chunk, and its first `left` records have changed."""
    line = int(toolpath.line[min(chunk.first, len(toolpath) - 1)])
    (was, held), (now, others) = _states(toolpath.events[:chunk.begin]), _states(toolpath.events[:left])
    own = [e for e in toolpath.events[chunk.begin:chunk.end] if e.index <= chunk.first]
    result = [Event(start, word, held.get(word, ("OFF",)), line) for word in _KEPT
              if held.get(word, ("OFF",)) != others.get(word, ("OFF",)) and all(e.word != word for e in own)]
    if (was.direction, was.rpm) != (now.direction, now.rpm) and not any(_whole(e) for e in own):
        side = "CLW" if was.direction > 0 else "CCLW"
        result.append(Event(start, "SPINDL", ("RPM", was.rpm, side) if was.direction and was.rpm > 0.0 else ("OFF",), line))
    return result


def _states(events: Sequence[Event]) -> tuple[Spindle, dict[str, tuple[str | float, ...]]]:
    """(spindle, values of the last record of each other kind) behind records."""
    spindle, held = Spindle(), dict[str, tuple[str | float, ...]]()
    for event in events:
        if event.word == "SPINDL":
            spindle = spindle_after(event, spindle)
        elif event.word in _KEPT:
            held[event.word] = event.values
    return spindle, held


def _whole(event: Event) -> bool:
    """True for a record that states speed and direction of the spindle."""
    said = words(event)
    return event.word == "SPINDL" and speed_said(event) is not None and ("CLW" in said or "CCLW" in said)
