"""CYCLE records: words of every system to one `Cycle`, with the depth positive downwards."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace

from toolpaths.cl.build import Builder, Heights
from toolpaths.cl.dialects import Planes
from toolpaths.cl.feeds import UNITS, feed_in
from toolpaths.cl.statements import Statement, Word
from toolpaths.toolpath import Cycle, FeedMode
from toolpaths.units import MM_PER_INCH

KINDS = {"DRILL": "DRILL", "DEEP": "DEEP", "DEEP2": "DEEP", "PECK": "DEEP", "BRKCHP": "BRKCHP", "BREAKCHP": "BRKCHP",
         "TAP": "TAP", "RIGID": "TAP", "BORE": "BORE", "BORE7": "BORE7", "BORE8": "BORE8", "BORE9": "BORE9", "REAM": "REAM",
         "FACE": "FACE", "CSINK": "CSINK", "THRU": "THRU", "MILL": "MILL", "REVERS": "REVERS", "SHIFT": "SHIFT",
         "CIRCUL": "CIRCUL", "THREAD": "THREAD", "SPOT": "DRILL"}
_OFF = frozenset({"OFF", "NOMORE"})
_DEPTH = frozenset({"FEDTO", "DEPTH"})
_RETRACT = frozenset({"RTRCTO", "RETURN"})
_PECKS = frozenset({"STEP", "INCR", "PECKING", "1STPECK", "SUBPECK"})
_OTHER = frozenset({"DIAMET", "TLANGL", "TIMES", "BACK", "OFFSET", "REPEAT", "PARAMS", "ORIENT", "CSKDIA", "PLUNGE"})
_PLAIN = frozenset({"G98", "G99", "AUTO", "MANUAL", "ON", "REV", "", "SEC", "NEXT"})
_APPROACH = 1e-4
"""file units between the second number of a cycle of CATIA and the way from the point before the cycle to its hole"""
_WORDS = "words"
_LAST = "cycle"


@dataclass(frozen=True)
class Values:
    """What a CYCLE record states, file units; NaN or None where it does not."""

    kind: str
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


def cycle(b: Builder, s: Statement) -> None:
    """Arm, end or re-arm a cycle."""
    first = s.words[0] if s.words else ""
    if first in _OFF:
        b.cycle.set(b.row, -1)
    elif first in ("INIT", "CLEAR") and len(s.words) == 1:
        return
    elif first == "ON":
        _again(b, s)
    elif isinstance(first, str) and first in KINDS:
        b.cycle_records += 1
        kind, rest = _kind(s.words)
        _arm(b, _values(Values(kind, s.words), rest, b))
    else:
        b.cycle_records += 1
        b.log.error("cl.cycle", f"CYCLE/{s.body[:60]}: {first or 'nothing'} is no kind of cycle", b.line,
                    "known kinds: " + ", ".join(sorted(KINDS)))


def _again(b: Builder, s: Statement) -> None:
    """CYCLE/ON arms the last cycle again; right before another cycle (`.clt`) it arms nothing."""
    last = b.memory.get(_LAST)
    if len(s.words) == 1 and b.next_statement_is("CYCLE"):
        return
    if not isinstance(last, Values):
        b.log.error("cl.cycle", "CYCLE/ON before any cycle", b.line)
        return
    _arm(b, _values(replace(last, empty=()), s.words[1:], b))


def _kind(words: tuple[Word, ...]) -> tuple[str, tuple[Word, ...]]:
    """(kind, the words after it): of several the one that says more than DRILL."""
    n = 0
    while n < len(words) and isinstance(words[n], str) and words[n] in KINDS:
        n += 1
    kinds = [KINDS[str(w)] for w in words[:n]]
    return next((k for k in kinds if k != "DRILL"), "DRILL"), words[n:]


def _values(v: Values, words: tuple[Word, ...], b: Builder) -> Values:
    """`v` with the parameters `words`; numbers without a word go to `free` in their order."""
    found: dict[str, object] = {}
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
        taken = _label(word, [float(x) for x in numbers], words[i] if i < len(words) else "", found, free, steps, empty,
                       strange)
        free.extend(float(x) for x in numbers[taken:])
    if "clear" in found:
        found.setdefault("rapto", math.nan)
    if steps:
        found["steps"] = tuple(steps)
    return replace(v, **found, free=tuple(free), empty=tuple(empty), strange=tuple(strange))  # type: ignore[arg-type]


def _label(word: str, n: list[float], following: Word, found: dict[str, object], free: list[float],
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
    elif word in ("REV", "ON") and n:
        found["revolutions" if word == "REV" else "dwell"] = n[0]
    elif word in _SIMPLE and n:
        found[_SIMPLE[word]] = n[0]
    elif word in _OTHER:
        return len(n)
    elif word not in _PLAIN and word not in KINDS and word not in _SIMPLE:
        strange.append(word)
    if not n and (word in _SIMPLE or word in _PECKS):
        empty.append(word)
    if word in _PECKS:
        return len(n)
    return min(1, len(n)) if word in _SIMPLE or word in ("DWELL", "REV") else 0


_SIMPLE = {"FEDTO": "depth", "DEPTH": "depth", "RAPTO": "rapto", "CLEAR": "clear", "TPI": "threads",
           "PITCH": "pitch", "DIAMET": "diameter", "TLANGL": "angle"}


def _feed(word: str, n: list[float], found: dict[str, object], free: list[float], empty: list[str]) -> int:
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


def _retract(word: str, n: list[float], following: Word, found: dict[str, object], empty: list[str]) -> int:
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


def _arm(b: Builder, v: Values) -> None:
    """Check what was stated and make the cycle current. `.clt` names pecking in a word of its own."""
    v = _with_planes(b, _placed(_approached(b, v), b.dialect.planes))
    if v.kind == "DRILL" and "PECKING" in v.words and any(v.steps):
        v = replace(v, kind="DEEP")
    b.memory[_LAST] = v
    for word in v.empty:
        b.log.error("cl.cycle-value", f"CYCLE/{v.kind}: {word} has no number", b.line, "write the number behind it")
    for word in v.strange:
        b.log.warning("cl.cycle-option", f"CYCLE/{v.kind}: {word} is not used", b.line, key=word)
    if v.placed and b.dialect.name == "catia":
        b.log.warning("cl.cycle-place", f"CYCLE/{v.kind}: numbers without words, read as depth {v.depth:g}"
                      + ("" if v.feed is None else f", feed {v.feed[0]:g} {v.feed[1] or 'per minute'}")
                      + ("" if math.isnan(v.clearance) else f", start plane {v.clearance:g}"), b.line,
                      "their order is that of the user's table in CATIA")
    b.cycle.set(b.row, len(b.cycles))
    b.cycles.append(_made(b, v))


def _approached(b: Builder, v: Values) -> Values:
    """CATIA's cycle of two numbers, depth and another: the start plane where the tool stands so far above the hole."""
    last, hole = b.last_point(), b.next_point()
    if b.dialect.name != "catia" or len(v.free) != 2 or last is None or hole is None:
        return v
    if abs(math.dist(last, hole) - v.free[1]) > _APPROACH:
        return v
    return replace(v, clear=v.free[1], depth=v.free[0], free=(), placed=True)


def _placed(v: Values, planes: Planes) -> Values:
    """Numbers without a word by their place: depth, then feed where no unit stands, then clearance and retract; in the
    posts that tell RAPTO from the clearance, this stands beside it, and goes without a retract plane."""
    free = list(v.free)
    found: dict[str, object] = {}
    if math.isnan(v.depth) and free:
        found["depth"], found["placed"] = free.pop(0), True
        if v.feed is None and free:
            found["feed"] = (free.pop(0), "")
    if math.isnan(v.clear) and free and (math.isnan(v.rapto) or planes in _COUNTED_DOWN):
        found["clear"] = free.pop(0)
    if planes not in _COUNTED_DOWN and v.retract is not None and math.isnan(v.retract) and free:
        found["retract"] = free.pop(0)
    return replace(v, **found, free=())  # type: ignore[arg-type]


_COUNTED_DOWN = (Planes.BOTTOM, Planes.DOWN, Planes.OVER_BOTTOM)


def _with_planes(b: Builder, v: Values) -> Values:
    """Start and retract plane above the hole's top (`Planes`); those that hang on the hole's height, `heights` finds."""
    planes = b.dialect.planes
    down = 0.0 if math.isnan(v.rapto) else v.rapto
    if planes is Planes.RELATIVE or math.isnan(v.clear):
        return replace(v, clearance=v.clear if math.isnan(v.rapto) else v.rapto)
    if planes is Planes.DOWN:
        return replace(v, clearance=v.clear - down)
    if planes is Planes.OVER_BOTTOM:
        return replace(v, clearance=v.clear - v.depth - down, retract=v.clear - v.depth)
    start = v.clear - down if planes is Planes.BOTTOM else v.clear if math.isnan(v.rapto) else math.nan
    bottom = planes is Planes.BOTTOM
    b.heights[len(b.cycles)] = Heights(start * b.scale, v.clear * b.scale, bottom)
    return replace(v, clearance=0.0 if math.isnan(v.rapto) or bottom else v.rapto, retract=0.0)


def _depth(b: Builder, v: Values) -> float:
    depth = v.depth * b.dialect.depth_sign
    if math.isnan(depth) and v.kind == "CSINK" and v.diameter > 0.0 and 0.0 < v.angle < 180.0:
        return 0.5 * v.diameter / math.tan(math.radians(0.5 * v.angle))
    if math.isnan(depth) and _DEPTH.isdisjoint(v.empty):
        b.log.error("cl.cycle-value", f"CYCLE/{v.kind} states no depth", b.line, "write it with DEPTH or FEDTO")
    elif depth < 0.0:
        b.log.error("cl.cycle-depth", f"CYCLE/{v.kind}: the depth {v.depth:g} points away from the part", b.line,
                    f"{b.dialect.title} writes depths {'negative' if b.dialect.depth_sign < 0 else 'positive'}")
    return depth


def _cycle_feed(b: Builder, v: Values) -> tuple[float, FeedMode, float | None]:
    """(feed, mode, pitch)"""
    pitch = None if math.isnan(v.pitch) else v.pitch * b.scale
    if not math.isnan(v.threads) and v.threads > 0.0:
        pitch = MM_PER_INCH / v.threads
        return pitch, FeedMode.PER_REVOLUTION, pitch
    if v.feed is not None:
        feed, mode = feed_in(*v.feed, b.scale)
        return feed, mode, feed if v.kind == "TAP" and mode is FeedMode.PER_REVOLUTION and pitch is None else pitch
    if v.kind == "TAP" and pitch is not None:
        return pitch, FeedMode.PER_REVOLUTION, pitch
    feed, mode = b.feed.now
    if math.isnan(feed) and v.kind == "TAP":
        b.log.error("cl.cycle-value", "CYCLE/TAP states neither pitch nor feed, and no feed holds", b.line,
                    "write it with PITCH, or a feed per revolution")
    elif math.isnan(feed):
        b.log.warning("cl.no-feed", f"CYCLE/{v.kind} states no feed and none holds", b.line)
    else:
        b.log.info("cl.cycle-feed", f"CYCLE/{v.kind} states no feed, the one in force is taken", b.line)
    return feed, mode, pitch


def _made(b: Builder, v: Values) -> Cycle:
    if math.isnan(v.clearance) and v.placed:
        b.log.warning("cl.cycle-start", f"CYCLE/{v.kind} states no start plane, the point of the GOTO is taken", b.line,
                      "state one in the table of the CAM system if the point touches the part")
        v = replace(v, clearance=0.0)
    elif math.isnan(v.clearance):
        b.log.error("cl.cycle-value", f"CYCLE/{v.kind} states no start plane above the hole", b.line,
                    "write it with CLEAR or RAPTO")
    retract = v.retract
    if retract is not None and math.isnan(retract):
        b.log.info("cl.cycle-retract", f"CYCLE/{v.kind} states no retract plane, the start plane is taken", b.line)
        retract = v.clearance
    feed, mode, pitch = _cycle_feed(b, v)
    words = b.memory.pop(_WORDS, v.words)
    return Cycle(v.kind, _depth(b, v) * b.scale, v.clearance * b.scale, None if retract is None else retract * b.scale,
                 feed, mode, tuple(x * b.scale for x in v.steps), 0.0 if math.isnan(v.dwell) else v.dwell,
                 0.0 if math.isnan(v.revolutions) else v.revolutions, pitch,
                 words if isinstance(words, tuple) else v.words, b.line)


def words_as_written(b: Builder, s: Statement) -> None:
    """`$$-> WORDS / [...]` of our writer: how the next CYCLE was written in the file it came from."""
    try:
        found = json.loads(s.body)
    except ValueError:
        found = None
    if isinstance(found, list) and all(isinstance(w, (str, float, int)) for w in found):
        b.memory[_WORDS] = tuple(w if isinstance(w, str) else float(w) for w in found)
    else:
        b.log.error("cl.data-comment", "$$-> WORDS takes a JSON list of words and numbers", b.line)


HANDLERS = {"CYCLE": cycle, "$$->WORDS": words_as_written}
