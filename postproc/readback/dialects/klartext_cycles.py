"""Drilling cycles of TNC 640 (Cycle Programming 34059x): Q parameters to levels.

Q200 set-up clearance above Q203 the surface, Q201 depth (negative), Q204 second set-up clearance. Rapidly to
Q203 + Q200, feed Q206 to Q203 + Q201, out to the second set-up clearance where it is the higher one. Pecks of
Q202 count from the surface.
"""

from __future__ import annotations

import math
from dataclasses import replace

from postproc.readback.text.canonical import Drill, DrillStyle
from postproc.readback.text.cycles import pecks
from toolpaths.units import MM_PER_INCH

RAPID = 99999.0
"""F and more: FMAX"""
FEED_PARTS = 10.0
"""in programs in inches F counts tenths of an inch per minute (34059x, Entering tool-related data, feed rate F)"""
APPROACH = 0.2
"""mm before the last depth to which cycles 200 and 203 come back rapidly"""
NEEDED = {number: tuple(f"Q{n}" for n in names) for number, names in {
    200: (200, 201, 206, 202, 210, 203, 204, 211), 201: (200, 201, 206, 211, 208, 203, 204),
    203: (200, 201, 206, 202, 210, 203, 204, 212, 213, 205, 211, 208, 256),
    205: (200, 201, 206, 202, 203, 204, 212, 205, 258, 259, 257, 256, 211, 379, 253),
    206: (200, 201, 206, 211, 203, 204), 207: (200, 201, 239, 203, 204),
    240: (200, 343, 201, 344, 206, 211, 203, 204)}.items()}
"""parameters that a cycle must state (Cycle Programming 34059x); those that later software added (Q395, Q208
of cycle 205) have their old meaning where they are not stated"""
MAY = {203: ("Q395",), 205: ("Q208", "Q395"), 200: ("Q395",)}
"""those that a cycle may state besides; others are none of its own there"""
Q = dict[str, float]
Made = tuple[Drill | None, str]


_LENGTHS = tuple(f"Q{n}" for n in (200, 201, 202, 203, 204, 205, 212, 239, 256, 257, 258, 259, 343, 379))
"""those that are lengths; feeds are in units of F"""


def drill_of(number: int, q: Q, speed: float, inch: bool = False) -> Made:
    """(cycle, "") or (None, what is missing or not modelled); `speed` of the spindle, 1/min; `inch`: lengths are inches."""
    if not inch:
        return _drill_of(number, q, speed)
    drill, why = _drill_of(number, {k: v * MM_PER_INCH if k in _LENGTHS else v for k, v in q.items()}, speed)
    if drill is None or drill.tap != "rigid":
        return drill, why
    parts = MM_PER_INCH / FEED_PARTS
    return replace(drill, feed=drill.feed / parts, feed_out=drill.feed_out / parts), why


def _drill_of(number: int, q: Q, speed: float) -> Made:
    """The same with lengths in mm."""
    kinds = {200: _drill, 201: _ream, 203: _universal, 205: _deep, 240: _centre}
    if number not in (*kinds, 206, 207):
        return None, "is not executed by this reader"
    missing = [k for k in NEEDED[number] if k not in q]
    if missing:
        return None, f"lacks {missing[0]}: the control asks for it"
    strange = [k for k in q if k not in NEEDED[number] and k not in MAY.get(number, ())]
    if strange:
        return None, f"with {strange[0]}, which is no parameter of it in software 34059x"
    if q.get("Q395", 0.0) != 0.0 or q["Q201"] >= 0.0:
        return None, "with Q395, or with a depth that is not negative, is not executed by this reader"
    return _tap(q, speed, number == 207) if number in (206, 207) else kinds[number](q, speed)


def _levels(q: Q) -> tuple[float, float, float]:
    """Plane, bottom, level where the cycle ends."""
    return q["Q203"] + q["Q200"], q["Q203"] + q["Q201"], q["Q203"] + max(q["Q200"], q.get("Q204", 0.0))


def _feed(value: float) -> float:
    return value if 0.0 < value < RAPID else math.nan


def _drill(q: Q, speed: float) -> Made:
    plane, bottom, out = _levels(q)
    if q.get("Q210", 0.0) != 0.0:
        return None, "with Q210 is not executed by this reader"
    step = q.get("Q202", -q["Q201"])
    if not step > 0.0:
        return None, "lacks Q202"
    return Drill(plane, bottom, out, pecks(q["Q203"], bottom, step), "peck", APPROACH, q.get("Q211", 0.0),
                 _feed(q.get("Q206", 0.0))), ""


def _centre(q: Q, speed: float) -> Made:
    plane, bottom, out = _levels(q)
    if q.get("Q343", 0.0) != 0.0:
        return None, "by diameter (Q343) is not executed by this reader"
    return Drill(plane, bottom, out, (bottom,), dwell=q.get("Q211", 0.0), feed=_feed(q.get("Q206", 0.0))), ""


def _ream(q: Q, speed: float) -> Made:
    """Q208 0: out at the feed of the approach."""
    plane, bottom, out = _levels(q)
    feed = _feed(q.get("Q206", 0.0))
    back = q.get("Q208", 0.0)
    return Drill(plane, bottom, out, (bottom,), "feed_out", 0.0, q.get("Q211", 0.0), feed, feed if back == 0.0 else back), ""


def _universal(q: Q, speed: float) -> Made:
    """Q213 breaks of Q256 mm before the tool leaves the hole, Q212 less per peck down to Q205, Q208 out."""
    plane, bottom, out = _levels(q)
    if q.get("Q210", 0.0) != 0.0 or not q.get("Q202", 0.0) > 0.0:
        return None, "with Q210, or without Q202, is not executed by this reader"
    bottoms = pecks(q["Q203"], bottom, q["Q202"], q.get("Q212", 0.0), q.get("Q205", 0.0))
    breaks = q.get("Q213", 0.0)
    if 0.0 < breaks < len(bottoms) - 1:
        return None, "with fewer breaks (Q213) than pecks is not executed by this reader"
    style: DrillStyle = "break" if breaks else "peck"
    relief = q.get("Q256", APPROACH) if breaks else APPROACH
    return Drill(plane, bottom, out, bottoms, style, relief, q.get("Q211", 0.0),
                 _feed(q.get("Q206", 0.0)), _feed(q.get("Q208", 0.0))), ""


def _deep(q: Q, speed: float) -> Made:
    """Q258 advanced stop above the last depth, Q257 depth between chip breaks, Q379 starting point."""
    plane, bottom, out = _levels(q)
    if any(q.get(k, 0.0) != 0.0 for k in ("Q257", "Q379")) or q.get("Q258", 0.0) != q.get("Q259", q.get("Q258", 0.0)):
        return None, "with Q257, Q379, or Q259 other than Q258 is not executed by this reader"
    if not q.get("Q202", 0.0) > 0.0:
        return None, "lacks Q202"
    bottoms = pecks(q["Q203"], bottom, q["Q202"], q.get("Q212", 0.0), q.get("Q205", 0.0))
    return Drill(plane, bottom, out, bottoms, "peck", q.get("Q258", APPROACH), q.get("Q211", 0.0), _feed(q.get("Q206", 0.0)),
                 _feed(q.get("Q208", 0.0))), ""


def _tap(q: Q, speed: float, rigid: bool) -> Made:
    """206 with a floating chuck at the feed Q206, 207 at the pitch Q239 (negative: left-hand) times the
    speed; out as it came in."""
    plane, bottom, out = _levels(q)
    feed = abs(q.get("Q239", 0.0)) * speed if rigid else q.get("Q206", 0.0)
    if not feed > 0.0:
        return None, "lacks its pitch Q239, or the speed" if rigid else "lacks its feed Q206"
    return Drill(plane, bottom, out, (bottom,), "feed_out", 0.0, q.get("Q211", 0.0), feed, feed,
                 "rigid" if rigid else "floating", q["Q239"] if rigid else math.nan), ""
