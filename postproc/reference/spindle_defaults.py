"""Spindle and coolant of tools for which the CL file states none: those of the set-up, as records of the path."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from dataclasses import replace
from itertools import pairwise

import numpy as np

from postproc.reference.events import (
    RANGES,
    TOOL_WORDS,
    Spindle,
    cutting,
    cutting_speed_said,
    largest_said,
    numbers,
    speed_said,
    spindle_after,
    spindle_changes,
    spindle_states,
    words,
)
from postproc.setup.model import SetupFile, ToolSetup
from postproc.setup.spindle import CoolantKind, Direction, SpindleSetup
from toolpaths.arrays import Bools, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, info
from toolpaths.toolpath import Event, Toolpath

_COOLANT = {"off": "OFF", "flood": "FLOOD", "mist": "MIST", "through": "THRU", "air": "AIR"}
_ALONG = 1e-9
"""by which the cosine between a straight retract and the tool axis may be less than 1"""
_OFF = frozenset({"OFF", "NEUTRL", "NEUTRAL"})
_OF_SPEED = RANGES | {"RPM", "SFM", "SMM", "CLW", "CCLW", "ON", "MAXRPM"}
FASTEST = 400_000.0
"""rev/min: beyond the air-bearing spindles that drill circuit boards, the fastest that cut"""
_DRY: tuple[str | float, ...] = ("OFF",)


@dataclass(frozen=True)
class Use:
    """A tool from where it is loaded to the next change: rows `first` to `last`, events `begin` to `end`
    (both one past); `at` is the event behind which its records belong, `line` that of its load."""

    number: int
    first: int
    last: int
    begin: int
    end: int
    at: int
    line: int


Stated = dict[tuple[int, str], list[int]]
"""lines by tool number and what the set-up states for it, in words"""


def with_defaults(toolpath: Toolpath, setup: SetupFile) -> tuple[Toolpath, Stated]:
    """The path with SPINDL and COOLNT of the set-up where a tool has none of its own, behind the record that
    loads it; and what the set-up states so.

    A record states it for a tool where it stands between the tool's load and the next one; a start that
    stands right before the load, without a motion between, is the tool's too. `[tools.N]` comes before what
    the records of the tool before have left in force, `[output]` behind it; what the set-up states for one
    tool is never in force for the next.
    """
    new: list[tuple[int, Event]] = []
    toolpath, stated = _with_speeds(toolpath, setup)
    filed = actual = Spindle()
    cooling = running = _DRY
    cuts = np.flatnonzero(cutting(toolpath))
    for use in uses(toolpath):
        here = toolpath.events[use.begin:use.end]
        own = setup.tools.get(str(use.number), ToolSetup())
        first = int(cuts[np.searchsorted(cuts, use.first)]) if np.searchsorted(cuts, use.first) < len(cuts) else use.last
        if first < use.last:
            wanted = _spindle_of(here, first, filed, own, setup)
            if wanted is not None:
                record = _record(wanted, use)
                new.append((use.at, record))
                actual = spindle_after(record, actual)
                stated.setdefault((use.number, str(wanted)), []).append(use.line)
            elif not _same(actual, filed) and not _said("SPINDL", here, first):
                record = _again(filed, use)
                new.append((use.at, record))
                actual = spindle_after(record, actual)
            cooled = _coolant_of(here, first, not _stops(cooling), own, setup)
            flow = cooling if cooled is None else (_COOLANT[cooled],)
            if cooled is not None or (flow != running and not _said("COOLNT", here, first)):
                new.append((use.at, Event(use.first, "COOLNT", flow, use.line)))
                running = flow
            if cooled is not None:
                stated.setdefault((use.number, f"coolant {cooled}"), []).append(use.line)
        for event in here:
            if event.word == "SPINDL":
                filed, actual = spindle_after(event, filed), spindle_after(event, actual)
            elif event.word == "COOLNT":
                cooling = running = event.values
    return (replace(toolpath, events=_placed(toolpath.events, new)) if new else toolpath), stated


def _record(wanted: SpindleSetup, use: Use) -> Event:
    return Event(use.first, "SPINDL", ("RPM", wanted.rpm, "CLW" if wanted.direction == "clockwise" else "CCLW"), use.line)


def _again(filed: Spindle, use: Use) -> Event:
    """The spindle as the file's own records have left it; off, of line 0, where they state none."""
    if filed.direction == 0 or not filed.rpm > 0.0:
        return Event(use.first, "SPINDL", ("OFF",), 0)
    return Event(use.first, "SPINDL", ("RPM", filed.rpm, "CLW" if filed.direction > 0 else "CCLW"), use.line)


def _same(a: Spindle, b: Spindle) -> bool:
    return a.direction == b.direction and (a.direction == 0 or a.rpm == b.rpm or (a.rpm != a.rpm and b.rpm != b.rpm))


def _stops(values: tuple[str | float, ...]) -> bool:
    return any(str(v).upper() == "OFF" for v in values)


def _said(word: str, here: tuple[Event, ...], first: int) -> bool:
    """Whether a record of the tool states it up to its first cut."""
    return any(e.word == word and e.index <= first for e in here)


def _with_speeds(toolpath: Toolpath, setup: SetupFile) -> tuple[Toolpath, Stated]:
    """The path with the set-up's speed in records that state 0 rev/min, as CAM systems write where nobody has
    entered one, or a cutting speed; the direction is the record's, where it says one."""
    if not any(e.word == "SPINDL" and speed_said(e) == 0.0 for e in toolpath.events):
        return toolpath, {}
    result, stated = list(toolpath.events), Stated()
    for use in uses(toolpath):
        wanted = setup.tools.get(str(use.number), ToolSetup()).spindle or setup.output.spindle
        for k in range(use.begin, use.end):
            event = result[k]
            said = set(words(event))
            speed = cutting_speed_said(event)
            if (wanted is None or event.word != "SPINDL" or speed_said(event) != 0.0 or said - _OF_SPEED
                    or (speed is not None and not speed > 0.0)):
                continue
            own = "CLW" if "CLW" in said else "CCLW" if "CCLW" in said else ""
            side = own or ("CLW" if wanted.direction == "clockwise" else "CCLW")
            kept = [word for word in words(event) if word in RANGES]
            most = largest_said(event)
            result[k] = replace(event, values=("RPM", wanted.rpm, side, *kept, *(() if most is None else ("MAXRPM", most))))
            stated.setdefault((use.number, f"{wanted.rpm:g} rev/min" if own else str(wanted)), []).append(event.line)
    return replace(toolpath, events=tuple(result)), stated


def stated_by_setup(toolpath: Toolpath, stated: Stated) -> list[Diagnostic]:
    """Notes of what the set-up states where the CL file states none."""
    return [info("spindle.of_setup", f"T{number}: no record states it, {what} of the set-up is taken", file=toolpath.file,
                 lines=lines[:6], count=len(lines)) for (number, what), lines in stated.items()]


def _spindle_of(here: tuple[Event, ...], first: int, before: Spindle, own: ToolSetup,
                setup: SetupFile) -> SpindleSetup | None:
    """What the set-up gives a tool with the records `here`, the first cut of which is row `first`; None where
    the file says enough. The direction is the file's, where it says one."""
    said = [e for e in here if e.word == "SPINDL" and e.index <= first]
    turns, speed = before.direction != 0, before.rpm
    side: Direction | None = None
    for event in said:
        side = "anti-clockwise" if "CCLW" in words(event) else "clockwise" if "CLW" in words(event) else side
        turns = not _OFF & set(words(event))
        speed = speed if speed_said(event) is None else float(speed_said(event) or 0.0)
    if said and (not turns or speed == speed):
        return None
    wanted = own.spindle or (setup.output.spindle if not turns or speed != speed else None)
    return wanted if wanted is None or side is None else wanted.model_copy(update={"direction": side})


def _coolant_of(here: tuple[Event, ...], first: int, flowing: bool, own: ToolSetup,
                setup: SetupFile) -> CoolantKind | None:
    """The same of the coolant."""
    if any(e.word == "COOLNT" and (e.index <= first or "OFF" not in words(e)) for e in here):
        return None
    return own.coolant if own.coolant is not None else None if flowing else setup.output.coolant


def uses(toolpath: Toolpath) -> list[Use]:
    """The tools in order, each with its records; the file's beginning is one too, where it cuts without a load."""
    events = toolpath.events
    loads = [k for k, e in enumerate(events) if e.word in TOOL_WORDS and numbers(e)]
    changes = [k for j, k in enumerate(loads) if j == 0 or numbers(events[loads[j - 1]])[0] != numbers(events[k])[0]]
    begins = [_from(events, k) for k in changes]
    edges = [*zip(begins, changes, strict=True), (len(events), len(events))]
    result = []
    if not changes or events[changes[0]].index > 0:
        number = -1 if changes or not len(toolpath) or toolpath.tool[0] < 0 else toolpath.tools[int(toolpath.tool[0])].number
        last = events[changes[0]].index if changes else len(toolpath)
        line = int(toolpath.line[0]) if len(toolpath) else 0
        result.append(Use(max(number, 0), 0, last, 0, edges[0][0], -1, line))
    for (begin, at), (end, after) in pairwise(edges):
        last = events[after].index if after < len(events) else len(toolpath)
        result.append(Use(int(numbers(events[at])[0]), events[at].index, last, begin, end, at, events[at].line))
    return result


def _from(events: tuple[Event, ...], change: int) -> int:
    """The first of the records right before a load, without a motion between, that start spindle or coolant for it."""
    low = bisect_left(events, events[change].index, key=lambda e: e.index)
    for k in range(low, change):
        if events[k].word in ("SPINDL", "COOLNT") and not _OFF & set(words(events[k])):
            return k
    return change


def _placed(events: tuple[Event, ...], new: list[tuple[int, Event]]) -> tuple[Event, ...]:
    """The events with others behind those of a number each, -1: before all."""
    result, done = list[Event](), 0
    for at, event in new:
        result += events[done:at + 1]
        result.append(event)
        done = at + 1
    return (*result, *events[done:])


def standing_cuts(toolpath: Toolpath) -> list[Diagnostic]:
    """Errors where the path cuts while the spindle stands, or turns at a speed that nobody states."""
    direction, rpm = spindle_states(toolpath)
    cuts = cutting(toolpath)
    if (cuts & ((direction == 0) | ~(rpm > 0.0))).any():
        cuts &= ~_drawn_out(toolpath)
    started = [e.index for e in toolpath.events if e.word == "SPINDL" and not _OFF & set(words(e))]
    rows = np.flatnonzero(cuts & (direction == 0))
    before = rows[rows < (min(started) if started else len(toolpath))]
    stopped = rows[len(before):]
    unknown = np.flatnonzero(cuts & (direction != 0) & ~(rpm > 0.0))
    result = []
    if len(before):
        result.append(_refused(toolpath, before, "spindle.not_started", "cutting before any record starts the spindle",
                               f"state SPINDL/RPM,n,CLW in the CAM system, or {_remedy(toolpath, before)}"))
    if len(stopped):
        line = _stopped_by(toolpath, int(stopped[0]))
        again = _remedy(toolpath, stopped) if _of_another(toolpath, int(stopped[0])) else ""
        result.append(_refused(toolpath, stopped, "spindle.stopped", "cutting while the spindle stands"
                               + (f": SPINDL/OFF in line {line}" if line else ""),
                               "state SPINDL/RPM,n,CLW before the cut in the CAM system"
                               + (f", or {again}" if again else "")))
    if len(unknown):
        result.append(_refused(toolpath, unknown, "spindle.no_speed", "cutting while no record has stated the spindle speed",
                               f"state SPINDL/RPM,n,CLW in the CAM system, or {_remedy(toolpath, unknown)}"))
    return result


def too_fast(toolpath: Toolpath, largest: float) -> list[Diagnostic]:
    """An error where the file, or the set-up for it, asks for more than the spindle's largest speed, rev/min: a control
    runs the largest, and feeds per turn and taps with it. Where the machine states none, what no spindle that mills does."""
    source, largest = ("the machine has at most {} ([control] largest_spindle_speed)", largest) if largest < math.inf else (
        "no milling spindle turns faster than {}, and [control] largest_spindle_speed of the machine states none", FASTEST)
    asked = [(state.rpm, line) for state, line in spindle_changes(toolpath) if state.rpm > largest]
    if not asked:
        return []
    says = source.format(f"{largest:g}")
    return [error("spindle.too_fast", f"the spindle would turn at {max(asked)[0]:g} rev/min, {says}", file=toolpath.file,
                  lines=sorted({line for _, line in asked if line > 0})[:6], count=len(asked),
                  hint=f"state at most {largest:g} in SPINDL, or in the set-up's spindle, and feeds that go with it")]


def _drawn_out(toolpath: Toolpath) -> Bools:
    """(N,) rows to which the tool is drawn back straight along its axis, as out of a bore: that cuts nothing."""
    step = np.diff(toolpath.tip, axis=0, prepend=toolpath.tip[:1])
    length = np.linalg.norm(step, axis=1)
    along = np.einsum("ni,ni->n", step, toolpath.axis) >= length * (1.0 - _ALONG)
    stays = np.append(True, (toolpath.axis[1:] == toolpath.axis[:-1]).all(axis=1))
    return np.asarray(along & stays & (length > 0.0) & (toolpath.arc < 0) & (toolpath.cycle < 0))


def _refused(toolpath: Toolpath, rows: Ints, code: str, message: str, hint: str) -> Diagnostic:
    return error(code, message, file=toolpath.file, lines=np.unique(toolpath.line[rows])[:6].tolist(), count=len(rows),
                 hint=hint)


def _remedy(toolpath: Toolpath, rows: Ints) -> str:
    """The lines of a set-up that give the tools of those cuts a spindle."""
    found = uses(toolpath)
    starts = [use.first for use in found]
    tools = sorted({found[max(bisect_right(starts, int(row)) - 1, 0)].number for row in rows[:1000]})
    what = "spindle = { rpm = ..., direction = \"clockwise\" }"
    own = "".join(f"[tools.{n}] {what}, " for n in tools[:6] if n > 0)
    return f"add to the set-up {own}{'or for all tools ' if own else ''}[output] {what}"


def _stopped_by(toolpath: Toolpath, row: int) -> int:
    """Line of the record that has stopped the spindle before a row."""
    found = [e.line for e in toolpath.events if e.word == "SPINDL" and e.index <= row and _OFF & set(words(e))]
    return found[-1] if found else 0


def _of_another(toolpath: Toolpath, row: int) -> bool:
    """True where no record states the spindle of the tool that cuts row: the set-up's default counts there."""
    found = uses(toolpath)
    use = found[max(bisect_right([u.first for u in found], row) - 1, 0)]
    return not any(e.word == "SPINDL" and e.line > 0 for e in toolpath.events[use.begin:use.end])

