"""CYCLE records as written: which kind, and which number belongs to which word."""

from __future__ import annotations

import math
from dataclasses import field, replace
from typing import Literal, TypedDict

from toolpaths.choices import CycleKind
from toolpaths.cl.feeds import UNITS
from toolpaths.cl.text.statements import Word
from toolpaths.dataclass import dataclass

KINDS: dict[str, CycleKind] = {
    "DRILL": "DRILL", "DEEP": "DEEP", "DEEP2": "DEEP", "PECK": "DEEP", "BRKCHP": "BRKCHP", "BREAKCHP": "BRKCHP",
    "TAP": "TAP", "RIGID": "TAP", "BORE": "BORE", "BORE7": "BORE7", "BORE8": "BORE8", "BORE9": "BORE9", "REAM": "REAM",
    "FACE": "FACE", "CSINK": "CSINK", "THRU": "THRU", "MILL": "MILL", "REVERS": "REVERS", "SHIFT": "SHIFT",
    "CIRCUL": "CIRCUL", "THREAD": "THREAD", "SPOT": "DRILL", "SPDRL": "DRILL", "CBORE": "DRILL", "DEEPHL": "DEEP",
    "CNSINK": "CSINK"}
_RETRACT = frozenset({"RTRCTO", "RETURN"})
_PECKS = frozenset({"STEP", "INCR", "PECKING", "1STPECK", "SUBPECK"})
_OTHER = frozenset({"DIAMET", "TLANGL", "TIMES", "BACK", "CSKDIA"})
_UNUSED = frozenset({"OFFSET", "REPEAT", "PARAMS", "ORIENT", "PLUNGE"})
"""What the hole would be drilled otherwise for: reported, with their numbers."""
_PLAIN = frozenset({"G98", "G99", "AUTO", "MANUAL", "ON", "REV", "", "SEC", "NEXT"})
_SIMPLE: dict[str, Literal["depth", "rapto", "clear", "threads", "pitch", "diameter", "angle"]] = {
    "FEDTO": "depth", "DEPTH": "depth", "RAPTO": "rapto", "CLEAR": "clear", "TPI": "threads", "PITCH": "pitch",
    "DIAMET": "diameter", "TLANGL": "angle"}


CYCLE_WORDS = frozenset({*KINDS, *_RETRACT, *_PECKS, *_OTHER, *_UNUSED, *_PLAIN, *_SIMPLE, *UNITS, "INIT", "OFF", "DWELL",
                         "DRAG", "NODRAG", "CAM"}) - {""}
"""All that a CYCLE record may hold."""


@dataclass(frozen=True)
class CycleValues:
    """What a CYCLE record states, file units; NaN or None where it does not."""

    kind: CycleKind
    words: tuple[Word, ...]
    depth: float = math.nan
    rapto: float = math.nan
    clear: float = math.nan
    clearance: float = math.nan
    """start plane above the GOTO, of the two above it"""
    retract: float | None = math.nan
    feed: tuple[float, str] | None = None
    threads: float = math.nan
    pitch: float = math.nan
    steps: tuple[float, ...] = ()
    dwell: float = math.nan
    revolutions: float = math.nan
    diameter: float = math.nan
    angle: float = math.nan
    free: tuple[float, ...] = ()
    placed: bool = False
    """the depth has no word of its own: numbers by their place"""
    empty: tuple[str, ...] = field(default=(), compare=False)
    strange: tuple[str, ...] = field(default=(), compare=False)


class StatedValues(TypedDict, total=False):
    """Fields of `CycleValues` that words of a record, or the places of its numbers, state."""

    depth: float
    rapto: float
    clear: float
    retract: float | None
    feed: tuple[float, str] | None
    threads: float
    pitch: float
    steps: tuple[float, ...]
    dwell: float
    revolutions: float
    diameter: float
    angle: float
    placed: bool


def kind_of(words: tuple[Word, ...]) -> tuple[CycleKind, tuple[Word, ...]]:
    """(kind, the words after it): of several the one that says more than DRILL."""
    n = 0
    while n < len(words) and isinstance(words[n], str) and words[n] in KINDS:
        n += 1
    kinds = [KINDS[str(w)] for w in words[:n]]
    return next((k for k in kinds if k != "DRILL"), "DRILL"), words[n:]


def values(v: CycleValues, words: tuple[Word, ...]) -> CycleValues:
    """`v` with the parameters `words`; numbers without a word go to `free` in their order."""
    found: StatedValues = {}
    free: list[float] = []
    steps: list[float] = []
    empty: list[str] = []
    strange: list[str] = []
    i = 0
    while i < len(words):
        word, i = words[i], i + 1
        if isinstance(word, float):
            free.append(word)
            continue
        numbers = []
        while i < len(words) and isinstance(words[i], float):
            numbers.append(words[i])
            i += 1
        if word in _PECKS and len(numbers) > 1 and _unit_alone(words[i:i + 2]):
            i, numbers = i - 1, numbers[:-1]
            words = (*words[:i], words[i + 1], words[i], *words[i + 2:])
        taken = _label(word, [float(x) for x in numbers], words[i] if i < len(words) else "", found, free, steps, empty,
                       strange)
        free.extend(float(x) for x in numbers[taken:])
    if "clear" in found:
        found.setdefault("rapto", math.nan)
    if steps:
        found["steps"] = tuple(steps)
    return replace(v, **found, free=tuple(free), empty=tuple(empty), strange=tuple(strange))


def _unit_alone(words: tuple[Word, ...]) -> bool:
    """True where a feed unit follows without a number behind it: the last number before it is the feed."""
    return bool(words) and words[0] in UNITS and not (len(words) > 1 and isinstance(words[1], float))


def _label(word: str, n: list[float], following: Word, found: StatedValues, free: list[float],
           steps: list[float], empty: list[str], strange: list[str]) -> int:
    """Take the numbers `n` that belong to `word`; how many were taken."""
    if word in _PECKS:
        steps.extend(n)
    elif word in UNITS:
        return _feed(word, n, found, free, empty)
    elif word in _RETRACT or word in ("AUTO", "MANUAL"):
        return _retract(word, n, following, found, empty)
    elif word == "DWELL":
        found["revolutions" if following == "REV" else "dwell"] = n[0] if n else math.nan
        strange += [] if n or following == "REV" else ["DWELL without a time"]
    elif word in ("REV", "ON") and n:
        found["revolutions" if word == "REV" else "dwell"] = n[0]
    elif word in _SIMPLE and n:
        found[_SIMPLE[word]] = n[0]
    elif word in _OTHER or word in _UNUSED:
        strange += [] if word in _OTHER else [word]
        return len(n)
    elif word not in _PLAIN and word not in KINDS and word not in _SIMPLE:
        strange.append(word)
    if not n and (word in _SIMPLE or word in _PECKS):
        empty.append(word)
    if word in _PECKS:
        return len(n)
    return min(1, len(n)) if word in _SIMPLE or word in ("DWELL", "REV") else 0


def _feed(word: str, n: list[float], found: StatedValues, free: list[float], empty: list[str]) -> int:
    """f, unit where two or more free numbers stand before the unit (depth, feed), else unit, f."""
    if "depth" not in found and len(free) >= 2:
        found["feed"] = (free.pop(), word)
        return 0
    if "depth" in found and free and not n:
        found["feed"] = (free.pop(), word)
        return 0
    if not n:
        empty.append(word)
        return 0
    found["feed"] = (n[0], word)
    return 1


def _retract(word: str, n: list[float], following: Word, found: StatedValues, empty: list[str]) -> int:
    if word == "AUTO":
        found["retract"] = None
        return 0
    if word == "MANUAL":
        return 0
    if n:
        found["retract"] = n[0]
        return 1
    if following not in ("AUTO", "MANUAL"):
        empty.append(word)
    return 0
