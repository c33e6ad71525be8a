"""Write a Toolpath as generic APT text that reads back to the same Toolpath, coordinates bit for bit.

All lengths are mm in the part frame (MULTAX/ON); what APT has no record for (lists of frames, tools,
operations) stands in `$$->` comments as JSON. Numbers are the shortest text that reads back to the same double.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict

import numpy as np

from toolpaths.arrays import Array, Bools, Floats
from toolpaths.cl.assemble import NORMAL_ROUNDING
from toolpaths.cl.feeds import MINUTE
from toolpaths.toolpath import Cycle, Event, FeedMode, Kind, Role, Toolpath

WIDTH = 200
"""longest line; longer statements are continued"""
_PER_MINUTE = {FeedMode.PER_TIME: ("MMPM", "MMPS"), FeedMode.INVERSE_TIME: ("INVERS", "INVERS,PERSEC")}
_RECORDS = {Role.START: "FROM/", Role.HOME: "GOHOME/"}
_TEXT_EVENTS = ("PPRINT", "INSERT")
_BREAK = re.compile(r",(?=[-+.\d])")


def text_of(p: Toolpath) -> str:
    """The text of `p`; its passes are not written but counted again when it is read.

    Raises:
        ValueError: where `p` holds what a CL file cannot say (NaN positions, a feed that becomes unknown
            again, a point with both a normal and a contact point, a tool that must not turn about its axis).
    """
    _check(p)
    return "\n".join([*_header(p), *_body(p), "FINI", ""])


def _check(p: Toolpath) -> None:
    if not (np.isfinite(p.tip).all() and np.isfinite(p.axis).all()):
        raise ValueError("the toolpath holds positions that are not finite numbers")
    if p.normal is not None and p.contact is not None and bool((~np.isnan(p.normal + p.contact)).any()):
        raise ValueError("a point has both a normal and a contact point")
    if p.spin is not None and bool(np.isfinite(p.spin).any()):
        raise ValueError("the tool is held about its own axis: no record says so")


def _header(p: Toolpath) -> Iterator[str]:
    slack = {"spline_slack": p.spline_slack} if p.spline_slack else {}
    yield f"$$-> TOOLPATH / {json.dumps({'version': 1, 'units': p.units} | slack)}"
    if p.name:
        yield f"PARTNO/{p.name}"
    yield "UNITS/MM"
    for frame in p.frames:
        rotation = [v for row in frame.rotation for v in row]
        yield _data("FRAME", {"name": frame.name, "origin": frame.origin, "rotation": rotation})
    for tool in p.tools:
        yield _data("TOOL", {k: v for k, v in asdict(tool).items() if v not in (None, "", ())})
    for op in p.operations:
        found = asdict(op)
        del found["line"]
        yield _data("OPERATION", found)
    yield "MULTAX/ON"


def _data(word: str, value: object) -> str:
    return f"$$-> {word} / {json.dumps(value)}"


def _body(p: Toolpath) -> Iterator[str]:
    """Records of the points with what stands before each."""
    before = _before(p)
    words = _points(p)
    start = 0
    for row in sorted(before):
        yield from words[start:row]
        yield from before[row]
        start = row
    yield from words[start:]


def _points(p: Toolpath) -> list[str]:
    """One record per row."""
    columns = [p.tip, p.axis]
    third = _third(p)
    plain = f"GOTO/{','.join(['%r'] * 6)}"
    rows = np.column_stack(columns).tolist()
    lines = [plain % tuple(row) for row in rows]
    if third is not None:
        has = np.flatnonzero(~np.isnan(third[:, 0]))
        for k, extra in zip(has.tolist(), third[has].tolist(), strict=True):
            lines[k] += "".join(f",{v!r}" for v in extra)
    for k in _contacts(p):
        lines[k] += ",CONTACT"
    for role, word in _RECORDS.items():
        for k in np.flatnonzero(p.role == role).tolist():
            lines[k] = word + lines[k][5:]
    for k in [i for i, line in enumerate(lines) if len(line) > WIDTH]:
        lines[k] = _wrapped(lines[k])
    return lines


def _third(p: Toolpath) -> Floats | None:
    if p.normal is None or p.contact is None:
        return p.normal if p.contact is None else p.contact
    return np.where(np.isnan(p.normal), p.contact, p.normal)


def _contacts(p: Toolpath) -> list[int]:
    """Rows whose contact point could be taken for a normal."""
    if p.contact is None:
        return []
    near = np.abs(np.linalg.norm(p.contact, axis=1) - 1.0) <= 2.0 * NORMAL_ROUNDING
    found: list[int] = np.flatnonzero(near).tolist()
    return found


def _before(p: Toolpath) -> dict[int, list[str]]:
    """Records before each row (N: after the last one), in the order they must be read."""
    out: dict[int, list[str]] = {}

    def add(row: int, *lines: str) -> None:
        out.setdefault(row, []).extend(lines)

    for row in np.flatnonzero(_changes(p.operation) | _changes(p.tool)).tolist():
        add(row, f"$$-> USE / {p.operation[row]},{p.tool[row]}")
    for event in p.events:
        add(event.index, *_event(event))
    for row, lines in _feeds(p):
        add(row, *lines)
    _cycles(p, add)
    for role in (Role.SPLINE, Role.CUBIC):
        spline = np.append(p.role == role, False)
        for row in np.flatnonzero(spline & ~np.roll(spline, 1)).tolist():
            add(row, f"$$-> {role.name} / {int(np.argmin(spline[row:]))}")
    for row in np.flatnonzero((p.kind == Kind.RAPID) & (p.role == Role.POINT)).tolist():
        add(row, "RAPID")
    for row in np.flatnonzero(p.arc >= 0).tolist():
        add(row, _arc(p, int(p.arc[row])))
    return out


def _changes(column: Array) -> Bools:
    """True (N,) where a row differs from the one before it, and at the first."""
    result: Bools = np.append(np.ones(min(1, len(column)), bool), column[1:] != column[:-1])
    return result


def _wrapped(line: str) -> str:
    """`line` continued by $ between a comma and a number where it is longer than WIDTH.

    A rest that began with a word could be taken for a new record.
    """
    parts: list[str] = []
    start = last = 0
    for end in [*(m.end() for m in _BREAK.finditer(line)), len(line)]:
        if end - start > WIDTH - 1 and last > start:
            parts.append(line[start:last] + "$")
            start = last
        last = end
    return "\n".join([*parts, line[start:]])


def _event(event: Event) -> list[str]:
    if event.word in _TEXT_EVENTS:
        return [f"{event.word}/{event.values[0]}" if event.values else event.word]
    if not event.values:
        return [event.word]
    of = "TOOL," if event.word == "SELECT" else ""  # a number alone may be a work offset
    return [_wrapped(f"{event.word}/{of}{_joined(event.values)}")]


def _joined(values: tuple[str | float, ...]) -> str:
    return ",".join(v if isinstance(v, str) else repr(float(v)) for v in values)


def _feeds(p: Toolpath) -> Iterator[tuple[int, list[str]]]:
    """FEDRAT where the feed of the cutting rows changes."""
    rows = np.flatnonzero(p.kind != Kind.RAPID)
    feed, mode = p.feed[rows], p.feed_mode[rows]
    unknown = np.isnan(feed)
    if len(rows) and bool((unknown[1:] & ~unknown[:-1]).any()):
        raise ValueError("a feed becomes unknown after it was known: no CL record says that")
    same = np.concatenate([[False], (feed[1:] == feed[:-1]) & (mode[1:] == mode[:-1])])[:len(rows)]
    for k in np.flatnonzero(~same & ~unknown).tolist():
        yield int(rows[k]), ["FEDRAT/" + feed_words(float(feed[k]), FeedMode(int(mode[k])))]


def feed_words(feed: float, mode: FeedMode) -> str:
    """`MMPM,x` with an x that reads back to the same double, else the same per second."""
    if mode is FeedMode.PER_REVOLUTION:
        return f"MMPR,{feed!r}"
    word, exact = _PER_MINUTE[mode]
    guess = feed * MINUTE
    for value in (guess, math.nextafter(guess, math.inf), math.nextafter(guess, -math.inf)):
        if value / MINUTE == feed and math.isfinite(value):
            return f"{word},{value!r}"
    return f"{exact},{feed!r}"


def _cycles(p: Toolpath, add: Callable[..., None]) -> None:
    """CYCLE before the first hole of each, CYCLE/OFF before a plain point after it; other rows do not end a cycle."""
    decides = (p.cycle >= 0) | ((p.role == Role.POINT) & (p.arc < 0))
    rows = np.flatnonzero(decides)
    cycle = p.cycle[rows]
    before = np.append(-1, cycle)[:len(rows)]
    for k in np.flatnonzero(cycle != before).tolist():
        row = int(rows[k])
        add(row, "CYCLE/OFF" if cycle[k] < 0 else "\n".join(_cycle(p.cycles[cycle[k]])))
    if len(rows) and cycle[-1] >= 0:
        add(len(p), "CYCLE/OFF")


def _cycle(c: Cycle) -> list[str]:
    retract: str | float = "AUTO" if c.retract is None else c.retract
    words: list[str | float] = [c.kind, "DEPTH", c.depth, "CLEAR", c.clearance, "RETURN", retract]
    words += [] if math.isnan(c.feed) else [feed_words(c.feed, c.feed_mode)]
    if c.steps:
        words += ["STEP", *c.steps]
    if c.dwell:
        words += ["DWELL", c.dwell]
    if c.dwell_revolutions:
        words += ["REV", c.dwell_revolutions]
    if c.pitch is not None:
        words += ["PITCH", c.pitch]
    return [_data("WORDS", c.words), _wrapped(f"CYCLE/{_joined(tuple(words))}")]


def _arc(p: Toolpath, k: int) -> str:
    a = p.arcs
    numbers = (*a.center[k].tolist(), *a.normal[k].tolist(), float(a.radius[k]))
    return _wrapped(f"CIRCLE/{_joined(numbers)},SWEEP,{float(a.sweep[k])!r}")
