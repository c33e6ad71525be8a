"""Logs as programs of the shop floor export them: one observation a line, of which those of the line number are taken.

MTConnect: observations have `timestamp` (ISO 8601, UTC), `dataItemId` and a value, UNAVAILABLE where there is none
(ANSI/MTC1.4, part 2
and 3); the type of the line is LINE_NUMBER (LINE up to version 1.3). OPC UA: values have a SourceTimestamp and a StatusCode
(OPC
10000-4, 7.11); the line of a CNC channel is ActProgramLine or ActMainProgramLine (OPC 40502). The names of columns are
those of
such exports; no standard fixes a form as CSV.
"""

from __future__ import annotations

import re
from datetime import UTC, datetime

import numpy as np

from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error

TIMES = ("timestamp", "sourcetimestamp", "time")
NAMES = ("dataitemid", "nodeid", "displayname", "browsename", "name")
TYPES = ("type", "dataitemtype")
VALUES = ("value", "result")
STATES = ("statuscode", "status", "quality")
LINES = frozenset(
    {
        "line",
        "linenumber",
        "lineno",
        "programline",
        "actprogramline",
        "actmainprogramline",
        "currentline",
        "actlinenumber",
        "nclinenumber",
    }
)
"""names of the line number, lower case, letters alone"""
NOTHING = ("", "unavailable", "null", "none")
SAMPLES = "one sample a line, decimal points, no units"
SHOWN = 8
"""names that a message lists"""


def is_export(names: list[str]) -> bool:
    """True for a header of a time, a name and a value."""
    known = [_plain(name) for name in names]
    return (
        all(any(name in known for name in wanted) for wanted in (TIMES, (*NAMES, *TYPES), VALUES)) and "ncline" not in known
    )


def lines_of_export(names: list[str], rows: list[list[str]], file: str) -> tuple[Floats, Floats, Ints, list[Diagnostic]]:
    """(line, s from the first, row of the file) of the observations of the line number, in the order of the file; lines
    are as they are stated, and checked as those of any log."""
    known = [_plain(name) for name in names]
    time, name, kind, value, state = (next((known.index(one) for one in wanted if one in known), -1)
                                      for wanted in (TIMES, NAMES, TYPES, VALUES, STATES))
    short = [k for k, row in enumerate(rows, 2) if row and len(row) != len(names)]
    if short:
        return _none(error("log.numbers", f"not {len(names)} values", file=file, lines=short[:6], count=len(short),
                           hint=SAMPLES))
    column = name if name >= 0 else kind
    items = {row[column] for row in rows if row and (_is_line(row, name) or _is_line(row, kind))}
    if len(items) != 1:
        return _none(_no_item(sorted(items), sorted({row[column] for row in rows if row}), file))
    values, bad = [], []
    for k, row in enumerate(rows, 2):
        if not row or row[column] not in items or row[value].strip().lower() in NOTHING or _is_bad(row, state):
            continue
        try:
            values.append((number_of(row[value]), _seconds(row[time].strip()), k))
        except ValueError:
            bad.append(k)
    if bad:
        return _none(error("log.numbers", "no line number, or no time (s, or ISO 8601 as 2026-05-04T10:23:45.001Z)",
                           file=file, lines=bad[:6], count=len(bad), hint=SAMPLES))
    line, at, number = (np.array([one[k] for one in values], dtype=np.float64) for k in range(3))
    return line, at - (at[0] if len(at) else 0.0), number.astype(np.int64), []


def _no_item(items: list[str], every: list[str], file: str) -> Diagnostic:
    """Where not one item is the line number."""
    what = f"several items are a line number: {', '.join(items[:SHOWN])}" if items else \
        f"no item is a line number; there are {', '.join(every[:SHOWN]) or 'none'}"
    return error("log.columns", what, file=file, lines=[1],
                 hint="the first line names the columns, a comma between them; export one line number (MTConnect "
                      "LINE_NUMBER, OPC UA ActProgramLine), or write nc_line,time_s")


def _is_bad(row: list[str], state: int) -> bool:
    return state >= 0 and row[state].strip().lower().startswith("bad")


def _none(fault: Diagnostic) -> tuple[Floats, Floats, Ints, list[Diagnostic]]:
    nothing = np.zeros(0)
    return nothing, nothing, nothing.astype(np.int64), [fault]


def _is_line(row: list[str], column: int) -> bool:
    return column >= 0 and _plain(re.split(r"[./:;=]", row[column])[-1]) in LINES


def _plain(name: str) -> str:
    """Letters of a name, lower case."""
    return re.sub(r"[^a-z]", "", name.lower())


def number_of(text: str) -> float:
    """A number as files spell it.

    Raises:
        ValueError: also for the digits of other scripts and for 1_000, which Python alone would read.
    """
    if "_" in text or not text.isascii():
        raise ValueError(f"no number: {text}")
    return float(text)


def _seconds(text: str) -> float:
    """s of a number, or of a date and time; UTC where the date names no zone, so that no change of the clock is met."""
    try:
        return number_of(text)
    except ValueError:
        at = datetime.fromisoformat(text)
        return (at if at.tzinfo else at.replace(tzinfo=UTC)).timestamp()
