"""CYCLE81 to CYCLE86 of SINUMERIK (Programming Manual Cycles): parameters by their place.

All begin with RTP (retraction), RFP (reference), SDIS (safety), DP (depth) or DPR (depth below RFP). The tool
goes rapidly to RFP + SDIS, feeds to the depth and leaves for RTP. CYCLE83: FDEP or FDPR first peck, DAM
below 0 the share of the last stroke that the next one is, _MDEP the least stroke (both assumed), DTB, DTS,
FRF, VARI (0 breaks chips: up by VRT, 1 mm by default; 1 leaves the hole, then stops DIS1 before the last depth: 0.6 mm down
to 30 mm depth, a fiftieth of the depth, 7 mm at the most, beyond).
"""

from __future__ import annotations

import math
from dataclasses import replace

from postproc.readback.text.canonical import DialectStatement, Drill
from postproc.readback.text.cycles import EPSILON, MOST, pecks

CYCLES = ("CYCLE81", "CYCLE82", "CYCLE83", "CYCLE84", "CYCLE840", "CYCLE85", "CYCLE86")
_SHALLOW, _LEAD, _MOST = 30.0, 0.6, 7.0


_LENGTHS = {"CYCLE83": (5, 6, 13, 14, 16), "CYCLE84": (8,), "CYCLE840": (10,)}
"""places of further lengths, next to the first five"""


def drill_of(s: DialectStatement, speed: float, unit: float = 1.0) -> tuple[Drill | None, str]:
    """(cycle, "") or (None, what is missing or not modelled); `speed` of the spindle, 1/min; `unit`: mm that lengths
    of the cycle and of F count in."""
    if unit != 1.0:
        places = (*range(5), *_LENGTHS.get(s.name, ()))
        s = replace(s, args=tuple(a * unit if k in places and isinstance(a, float) else a for k, a in enumerate(s.args)))
    drill, why = _drill_of(s, speed)
    if drill is None or not drill.tap:
        return drill, why
    return replace(drill, feed=drill.feed / unit, feed_out=drill.feed_out / unit), why


def _drill_of(s: DialectStatement, speed: float) -> tuple[Drill | None, str]:
    """The same with lengths in mm."""
    out, surface, safety, depth = (s.number(k) for k in range(4))
    if math.isnan(depth):
        depth = surface - s.number(4)
    elif not math.isnan(s.number(4)) and s.number(4) != surface - depth:
        return None, "has DP and DPR"
    if math.isnan(out + surface + depth):
        return None, "lacks RTP, RFP or DP"
    plane = surface + (0.0 if math.isnan(safety) else safety)
    dwell = s.number(8 if s.name == "CYCLE83" else 5, 0.0)
    if dwell < 0.0:
        return None, "dwells in turns of the spindle"
    plain = Drill(plane, depth, out, (depth,), dwell=0.0 if s.name == "CYCLE81" else dwell)
    kinds = {"CYCLE83": _deep, "CYCLE84": _tap, "CYCLE840": _tap, "CYCLE85": _bore, "CYCLE86": _fine}
    return kinds[s.name](s, plain, surface, speed) if s.name in kinds else (plain, "")


def _deep(s: DialectStatement, plain: Drill, surface: float, speed: float) -> tuple[Drill | None, str]:
    first = surface - s.number(5) if not math.isnan(s.number(5)) else s.number(6)
    share, breaks = -s.number(7, 0.0), s.number(11, 0.0) == 0.0
    if not first > 0.0:
        return None, "lacks FDEP or FDPR"
    if share < 0.0 or s.number(9, 0.0) != 0.0 or s.number(10, 1.0) not in (0.0, 1.0):
        return None, "with DAM above 0, DTS or FRF is not executed by this reader"
    if share > 0.0 and not (0.001 <= share <= 1.0 and s.number(13) > 0.0):
        return None, "with DAM below 0 needs a factor from -0.001 to -1 and _MDEP"
    depth = surface - plain.bottom
    lead = _LEAD if depth <= _SHALLOW else min(depth / 50.0, _MOST)
    relief = s.number(14, 1.0) if breaks else s.number(16, lead)
    strokes = _strokes(surface, plain.bottom, first, share, s.number(13, 0.0))
    return Drill(plain.plane, plain.bottom, plain.out, strokes, "break" if breaks else "peck",
                 relief, plain.dwell), ""


def _strokes(surface: float, bottom: float, first: float, share: float, least: float) -> tuple[float, ...]:
    """Depths of strokes: each `share` of the last one, `least` or more; all alike where `share` is 0."""
    if share == 0.0:
        return pecks(surface, bottom, first)
    depths, stroke = [surface - first], first
    while depths[-1] > bottom + EPSILON and len(depths) <= MOST:
        stroke = max(stroke * share, least)
        depths.append(depths[-1] - stroke)
    return (*depths[:-1], bottom)


def _tap(s: DialectStatement, plain: Drill, surface: float, speed: float) -> tuple[Drill | None, str]:
    """CYCLE84(..., DTB, SDAC, MPIT, PIT, POSS, SST, SST1), CYCLE840(..., DTB, SDR, SDAC, ENC, MPIT, PIT)."""
    rigid = s.name == "CYCLE84"
    hand = s.number(8 if rigid else 10)
    pitch = abs(hand)
    turning = s.number(10) if s.name == "CYCLE84" else speed
    back = s.number(11, 0.0) if s.name == "CYCLE84" else 0.0
    if not pitch * turning > 0.0:
        return None, "lacks its pitch or speed"
    return Drill(plain.plane, plain.bottom, plain.out, plain.bottoms, "feed_out", 0.0, plain.dwell, pitch * turning,
                 pitch * (back if back > 0.0 else turning), "rigid" if rigid else "floating",
                 hand if rigid else math.nan), ""


def _bore(s: DialectStatement, plain: Drill, surface: float, speed: float) -> tuple[Drill | None, str]:
    """CYCLE85(..., DTB, FFR, RFF): in and out at feeds of its own."""
    return Drill(plain.plane, plain.bottom, plain.out, plain.bottoms, "feed_out", 0.0, plain.dwell, s.number(6),
                 s.number(7)), ""


def _fine(s: DialectStatement, plain: Drill, surface: float, speed: float) -> tuple[Drill | None, str]:
    """CYCLE86(..., DTB, SDIR, RPA, RPO, RPAP, POSS): the tool is lifted off the wall by RPA, RPO."""
    if any(s.number(k, 0.0) != 0.0 for k in (7, 8, 9)):
        return None, "with RPA, RPO or RPAP is not executed by this reader"
    return plain, ""
