"""FEDRAT: all units, both orders, to mm/s, mm per revolution or 1/s."""

from __future__ import annotations

import math

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.cl.build import ToolpathBuilder
from toolpaths.cl.text.statements import Statement, Word
from toolpaths.toolpath import FeedMode
from toolpaths.units import MM_PER_FOOT, MM_PER_INCH

FeedValue = tuple[float, FeedMode]
MINUTE = 60.0
PER_MINUTE = {"MMPM": 1.0, "IPM": MM_PER_INCH, "FPM": MM_PER_FOOT, "MPM": 1000.0, "PERMIN": math.nan}
PER_SECOND = {"MMPS": 1.0, "IPS": MM_PER_INCH}
PER_REVOLUTION = {"MMPR": 1.0, "IPR": MM_PER_INCH, "FPR": MM_PER_FOOT, "PERREV": math.nan}
UNITS = frozenset(PER_MINUTE) | frozenset(PER_SECOND) | frozenset(PER_REVOLUTION)
"""NaN: the unit of the part."""
_ALIKE = (("MMPM", "MPM", "MMPS"), ("IPM", "FPM", "IPS"))
"""Units that are one letter apart: a file keeps to one of them, and a byte that is lost or changed makes another."""
FASTEST = 1000.0
"""mm/s (60 m/min): beyond it nobody cuts, and a feed in a unit one letter apart from the usual one is that one damaged"""
_CHANGING = ("SCALE", "LENGTH", "LOCK", "MAXIPM")
"""Words of FEDRAT (NCL) that change the feed of the moves behind them."""
_MODIFIERS = (*_CHANGING, "MAXRPM", "OVPLOT")
"""Words of FEDRAT (NCL) whose number is no feed."""


def feed_in(value: float, unit: str, scale: float) -> FeedValue:
    """`value` in the named unit as (mm/s or mm/rev, mode); `scale` is mm per unit of the part, "" per minute in it."""
    if unit in PER_REVOLUTION:
        factor = PER_REVOLUTION[unit]
        return value * (scale if math.isnan(factor) else factor), FeedMode.PER_REVOLUTION
    if unit in PER_SECOND:
        return value * PER_SECOND[unit], FeedMode.PER_TIME
    factor = PER_MINUTE.get(unit, math.nan)
    return value * (scale if math.isnan(factor) else factor) / MINUTE, FeedMode.PER_TIME


def unit_of(words: tuple[Word, ...]) -> str:
    """The first feed unit among the words, "" where there is none."""
    return next((w for w in words if isinstance(w, str) and w in UNITS), "")


def checked_speed(b: ToolpathBuilder, record: str, unit: str, value: float) -> None:
    """Refuse a feed in a unit of seconds or a long one in which it is faster than anybody cuts: a letter of the usual unit
    is lost. Text of our own writer takes for each feed the unit in which it reads back to the bit."""
    usual = next((units[0] for units in _ALIKE if unit in units[1:]), "")
    if usual and not b.declared and (speed := feed_in(value, unit, 1.0)[0]) > FASTEST:
        b.log.error("cl.feed", f"{record}: {value:g} {unit} are {speed * MINUTE:g} mm/min, faster than anybody cuts", b.line,
                    f"write the feed in {usual}, which is one letter apart, or below {FASTEST * MINUTE:g} mm/min", key=unit)


def stated_in(b: ToolpathBuilder, record: str, unit: str) -> None:
    """Refuse a unit that is one letter apart from that of other feeds of the file, once; text of our own writer as above."""
    if unit in b.feed_units or b.declared:
        return
    for alike in _ALIKE:
        others = [(line, one) for one, line in b.feed_units.items() if unit in alike and one in alike and one != unit]
        if others:
            line, other = min(others)
            b.log.error("cl.feed", f"{record}: a feed in {unit}, that of line {line} is in {other}", b.line,
                        f"write all feeds of the file in one unit: {unit} and {other} are one letter apart", key=unit)
    b.feed_units[unit] = b.line


def fedrat(b: ToolpathBuilder, s: Statement) -> None:
    """Set the modal feed."""
    if s.has("INVERS"):
        _inverse(b, s)
        return
    changing = next((w for w in _CHANGING if s.has(w) and w not in b.allow_unknown), "")
    if changing:
        b.log.error("cl.feed-option", f"FEDRAT/{s.body}: {changing} changes the feed, and is not supported", b.line,
                    f"have the CAM system write the feed itself; --allow-unknown {changing} takes the feed as it stands",
                    key=changing)
        return
    numbers = _feeds(s.words)
    if not numbers and s.has(*_MODIFIERS):
        b.log.warning("cl.feed-option", f"FEDRAT/{s.body}: it states no feed and is not used", b.line)
        return
    if not numbers:
        b.log.error("cl.feed", f"FEDRAT/{s.body} holds no number", b.line,
                    "write for example FEDRAT/MMPM,250.0")
        return
    if len(numbers) > 1 or any(isinstance(w, str) and w not in UNITS for w in s.words):
        b.log.warning("cl.feed-option", f"FEDRAT/{s.body}: only the feed itself is used", b.line)
    unit = unit_of(s.words)
    value = s.after(unit)
    value = numbers[0] if value is None else value
    stated_in(b, f"FEDRAT/{s.body}", unit)
    checked_speed(b, "FEDRAT", unit, value)
    b.feed.set(b.row, feed_in(value, unit, b.scale))


def many(b: ToolpathBuilder, s: Statement, numbers: Floats) -> None:
    """Set the modal feed by neighbouring statements (`feed_lines`) from the current one on, `s` but for their numbers."""
    unit, at = unit_of(s.words), b.index
    feeds = [feed_in(number, unit, b.scale) for number in numbers.tolist()]
    stated_in(b, f"FEDRAT/{s.body}", unit)
    for k in np.flatnonzero([feed > FASTEST for feed, _ in feeds]).tolist():
        b.line = b.program.lines[at + k]
        checked_speed(b, "FEDRAT", unit, float(numbers[k]))
    b.line = b.program.lines[at]
    for before, feed in zip(b.program.before[at:at + len(numbers)], feeds, strict=True):
        b.row += before - b.fast
        b.fast = before
        b.feed.set(b.row, feed)
    b.index += len(numbers) - 1


def _feeds(words: tuple[Word, ...]) -> list[float]:
    """The numbers that may be a feed: not those of a modifier."""
    return [w for before, w in zip(("", *words), words, strict=False)
            if isinstance(w, float) and not (isinstance(before, str) and before in _MODIFIERS)]


def _inverse(b: ToolpathBuilder, s: Statement) -> None:
    value = s.after("INVERS")
    if s.has("PERSEC"):
        value = s.after("PERSEC")
        b.feed.set(b.row, (math.nan if value is None else value, FeedMode.INVERSE_TIME))
    elif value is not None:
        b.feed.set(b.row, (value / MINUTE, FeedMode.INVERSE_TIME))
    elif s.has("AUTO", "ON", "OFF"):
        b.event("FEDRAT", tuple(w for w in s.words if w != ""))
    else:
        b.log.error("cl.feed", f"FEDRAT/{s.body}: INVERS needs a number, AUTO or OFF", b.line,
                    "write FEDRAT/INVERS,2.5, FEDRAT/INVERS,AUTO or FEDRAT/INVERS,OFF")


HANDLERS = {"FEDRAT": fedrat}
