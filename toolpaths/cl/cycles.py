"""CYCLE records: words of every system to one `Cycle`, with the depth positive downwards."""

from __future__ import annotations

import json
import math
from dataclasses import replace

from toolpaths.choices import CycleKind
from toolpaths.cl.build import Heights, ToolpathBuilder
from toolpaths.cl.cycle_words import KINDS, CycleValues, StatedValues, kind_of, values
from toolpaths.cl.feeds import checked_speed, feed_in, stated_in
from toolpaths.cl.text.dialects import Planes
from toolpaths.cl.text.statements import Statement, Word
from toolpaths.toolpath import Cycle, FeedMode
from toolpaths.units import MM_PER_INCH

_OFF = frozenset({"OFF", "NOMORE"})
_DEPTH = frozenset({"FEDTO", "DEPTH"})
_IN_STEPS = frozenset({"DEEP", "DEEP2", "PECK", "BRKCHP", "BREAKCHP"})
_PECKED = frozenset({"DEEP", "BRKCHP"})
_STEP_WORDS = ("STEP", "INCR", "PECKING", "1STPECK", "SUBPECK")
_BORES = frozenset({"DRAG", "NODRAG", "MANUAL"})
_LEAST_STEP = 1e-3
"""file units: no control pecks by less"""
_APPROACH = 1e-4
"""file units between the second number of a cycle of CATIA and the path from the point before the cycle to its hole"""
_WORDS = "words"
_LAST = "cycle"


def cycle(b: ToolpathBuilder, s: Statement) -> None:
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
        kind, rest = kind_of(s.words)
        rest = _variant(b, kind, s.words, rest)
        _arm(b, values(CycleValues(kind, s.words), rest))
    else:
        b.cycle_records += 1
        b.log.error("cl.cycle", f"CYCLE/{s.body[:60]}: {first or 'nothing'} is not a known cycle", b.line,
                    "known kinds: " + ", ".join(sorted(KINDS)))


def _again(b: ToolpathBuilder, s: Statement) -> None:
    """CYCLE/ON arms the last cycle again; right before another cycle (`.clt`) it arms nothing."""
    last = b.memory.get(_LAST)
    if len(s.words) == 1 and b.next_statement_is("CYCLE"):
        return
    if not isinstance(last, CycleValues):
        b.log.error("cl.cycle", "CYCLE/ON before any cycle", b.line,
                    "state the cycle first (CYCLE/DRILL,DEPTH,...), or take CYCLE/ON out")
        return
    _arm(b, values(replace(last, empty=()), s.words[1:]))


def _variant(b: ToolpathBuilder, kind: CycleKind, words: tuple[Word, ...],
             rest: tuple[Word, ...]) -> tuple[Word, ...]:
    """`rest` without the word that makes another cycle of a bore (NX: DRAG, NODRAG, MANUAL); what cannot be
    carried out as the cycle of its kind, a bore from below and a tap in steps, is refused."""
    steps = [str(w) for w in words[:len(words) - len(rest)] if w in _IN_STEPS]
    if kind == "TAP" and steps:
        b.log.error("cl.cycle", f"CYCLE/TAP,{steps[0]}: peck tapping is not supported", b.line,
                    "tap in one go, or have the CAM system write out the moves")
    if kind != "BORE" or not rest:
        return rest
    if rest[0] == "BACK":
        b.log.error("cl.cycle", "CYCLE/BORE,BACK: back boring is not supported", b.line,
                    "have the CAM system write out the moves")
    elif rest[0] in _BORES:
        b.log.warning("cl.cycle-option", f"CYCLE/BORE,{rest[0]}: bored in and out at the feed instead", b.line,
                      key=str(rest[0]))
    return rest[1:] if rest[0] in _BORES or rest[0] == "BACK" else rest


def _arm(b: ToolpathBuilder, v: CycleValues) -> None:
    """Check what was stated and make the cycle current. `.clt` names pecking in a word of its own."""
    v = _with_planes(b, _placed(_approached(b, v), b.dialect.planes))
    if v.kind == "DRILL" and "PECKING" in v.words and any(v.steps):
        v = replace(v, kind="DEEP")
    b.memory[_LAST] = v
    for word in v.empty:
        b.log.error("cl.cycle-value", f"CYCLE/{v.kind}: {word} has no number", b.line,
                    "write the number behind it")
    for word in v.strange:
        b.log.warning("cl.cycle-option", f"CYCLE/{v.kind}: {word} is not used", b.line, key=word)
    if v.placed and b.dialect.cycles_by_table:
        b.log.warning("cl.cycle-place", f"CYCLE/{v.kind}: numbers without words, read as depth {v.depth:g}"
                      + ("" if v.feed is None else f", feed {v.feed[0]:g} {v.feed[1] or 'per minute'}")
                      + ("" if math.isnan(v.clearance) else f", start plane {v.clearance:g}"), b.line,
                      "nothing is to be done where the numbers are right: "
                      f"their order is that of the user's table in {b.dialect.title}")
    b.cycle.set(b.row, len(b.cycles))
    b.cycles.append(_made(b, v))


def _approached(b: ToolpathBuilder, v: CycleValues) -> CycleValues:
    """CATIA's cycle of two numbers, depth and another: the start plane where the tool stands so far above the hole."""
    last, hole = b.last_point(), b.next_point()
    if not b.dialect.cycles_by_table or len(v.free) != 2 or last is None or hole is None:
        return v
    if abs(math.dist(last, hole) - v.free[1]) > _APPROACH:
        return v
    return replace(v, clear=v.free[1], depth=v.free[0], free=(), placed=True)


def _placed(v: CycleValues, planes: Planes) -> CycleValues:
    """Numbers without a word by their place: depth, then feed where no unit stands, then clearance and
    retract; in the posts that say RAPTO from the clearance, this stands next to it, and goes without a retract plane."""
    free = list(v.free)
    found: StatedValues = {}
    if math.isnan(v.depth) and free:
        found["depth"], found["placed"] = free.pop(0), True
        if v.feed is None and free:
            found["feed"] = (free.pop(0), "")
    if math.isnan(v.clear) and free and (math.isnan(v.rapto) or planes in _COUNTED_DOWN):
        found["clear"] = free.pop(0)
    if planes not in _COUNTED_DOWN and v.retract is not None and math.isnan(v.retract) and free:
        found["retract"] = free.pop(0)
    strange = tuple(f"{x:g}" for x in free if x not in (0.0, found.get("retract", v.retract)))
    return replace(v, **found, free=(), strange=(*v.strange, *strange))


_COUNTED_DOWN = (Planes.BOTTOM, Planes.DOWN, Planes.OVER_BOTTOM)


def _with_planes(b: ToolpathBuilder, v: CycleValues) -> CycleValues:
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


def _depth(b: ToolpathBuilder, v: CycleValues) -> float:
    depth = v.depth * b.dialect.depth_sign
    if math.isnan(depth) and v.kind == "CSINK" and v.diameter > 0.0 and 0.0 < v.angle < 180.0:
        return 0.5 * v.diameter / math.tan(math.radians(0.5 * v.angle))
    if math.isnan(depth) and _DEPTH.isdisjoint(v.empty):
        b.log.error("cl.cycle-value", f"CYCLE/{v.kind} states no depth", b.line,
                    "write it with DEPTH or FEDTO")
    elif depth < 0.0:
        b.log.error("cl.cycle-depth", f"CYCLE/{v.kind}: the depth {v.depth:g} points away from the part", b.line,
                    f"{b.dialect.title} writes depths {'negative' if b.dialect.depth_sign < 0 else 'positive'}; where the "
                    "file is of another system, name it (--dialect)")
    elif depth == 0.0:
        b.log.error("cl.cycle-depth", f"CYCLE/{v.kind}: a hole of depth 0", b.line, "state the depth of the hole in the CAM "
                    "system (FEDTO or DEPTH of the CYCLE record), or take the hole out of the operation")
    return depth


def _cycle_feed(b: ToolpathBuilder, v: CycleValues) -> tuple[float, FeedMode, float | None]:
    """(feed, mode, pitch)"""
    pitch = None if math.isnan(v.pitch) else v.pitch * b.scale
    if not math.isnan(v.threads) and v.threads > 0.0:
        pitch = MM_PER_INCH / v.threads
        return pitch, FeedMode.PER_REVOLUTION, pitch
    if v.feed is not None:
        stated_in(b, f"CYCLE/{v.kind}", v.feed[1])
        checked_speed(b, f"CYCLE/{v.kind}", v.feed[1], v.feed[0])
        feed, mode = feed_in(*v.feed, b.scale)
        return feed, mode, feed if v.kind == "TAP" and mode is FeedMode.PER_REVOLUTION and pitch is None else pitch
    if v.kind == "TAP" and pitch is not None:
        return pitch, FeedMode.PER_REVOLUTION, pitch
    feed, mode = b.feed.now
    if math.isnan(feed) and v.kind == "TAP":
        b.log.error("cl.cycle-value", "CYCLE/TAP states neither pitch nor feed, and no feed is in force", b.line,
                    "write it with PITCH, or a feed per revolution")
    elif math.isnan(feed):
        b.log.warning("cl.no-feed", f"CYCLE/{v.kind} states no feed and none is in force", b.line)
    else:
        b.log.info("cl.cycle-feed", f"CYCLE/{v.kind} states no feed, the one in force is taken", b.line)
    return feed, mode, pitch


def _steps(b: ToolpathBuilder, v: CycleValues) -> tuple[float, ...]:
    """Pecks in mm. A step of 0 behind another changes nothing; alone it is none, which pecking cannot have."""
    if v.kind in _PECKED and not any(v.steps):
        if v.steps:
            b.log.error("cl.cycle-peck", f"CYCLE/{v.kind}: a peck of 0", b.line, "state the depth of a peck with STEP, or "
                        "write CYCLE/DRILL where the hole is drilled in one go")
        elif not {*_STEP_WORDS}.intersection(v.empty):
            b.log.warning("cl.cycle-peck", f"CYCLE/{v.kind} states no peck: drilled in one go", b.line,
                          "state the depth of a peck with STEP")
    for step in v.steps:
        if step < _LEAST_STEP and step != 0.0:
            b.log.error("cl.cycle-value", f"CYCLE/{v.kind}: a peck of {step:g}", b.line,
                        f"0 for none, or at least {_LEAST_STEP:g}")
    return tuple(step * b.scale for step in v.steps if step != 0.0)


def _rest(b: ToolpathBuilder, v: CycleValues, value: float) -> float:
    """A dwell in seconds or revolutions, 0 where none is stated."""
    if value < 0.0:
        b.log.error("cl.cycle-value", f"CYCLE/{v.kind}: the dwell is {value:g}", b.line, "write 0 or more")
    return 0.0 if math.isnan(value) else value


def _made(b: ToolpathBuilder, v: CycleValues) -> Cycle:
    if math.isnan(v.clearance) and v.placed and b.dialect.cycles_by_table:
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
                 feed, mode, _steps(b, v), _rest(b, v, v.dwell), _rest(b, v, v.revolutions), pitch,
                 words if isinstance(words, tuple) else v.words, b.line)


def words_as_written(b: ToolpathBuilder, s: Statement) -> None:
    """`$$-> WORDS / [...]` of our writer: how the next CYCLE was written in the file it came from."""
    try:
        found = json.loads(s.body)
    except ValueError:
        found = None
    if isinstance(found, list) and all(isinstance(w, (str, float, int)) for w in found):
        b.memory[_WORDS] = tuple(w if isinstance(w, str) else float(w) for w in found)
    else:
        b.log.error("cl.data-comment", "$$-> WORDS takes a JSON list of words and numbers", b.line,
                    "correct the list, for example $$-> WORDS / [\"DEPTH\", 5.0], or take the line out")


HANDLERS = {"CYCLE": cycle, "$$->WORDS": words_as_written}
