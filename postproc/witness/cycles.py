"""CYCLE records: kind, depth, start plane, feed, pecks of a hole, as each system writes them."""

from __future__ import annotations

import math
from dataclasses import replace

from postproc.witness.commanded import WitnessCycle
from postproc.witness.dialect import INCH, WitnessDialect
from postproc.witness.text import Record

_PECKED = {"DEEP": "DEEP", "DEEP2": "DEEP", "PECK": "DEEP", "BRKCHP": "BRKCHP", "BREAKCHP": "BRKCHP"}
_KINDS = ("DRILL", "TAP", "RIGID", "BORE", "BORE7", "BORE8", "BORE9", "REAM", "FACE", "CSINK", "THRU", "SPOT", "MILL",
          "REVERS", "SHIFT")
_PER_MINUTE = {"MMPM": 1.0, "IPM": INCH, "FPM": 12.0 * INCH, "PERMIN": 0.0, "MPM": 1000.0, "MMPS": 60.0}
_PER_TURN = {"MMPR": 1.0, "IPR": INCH, "FPR": 12.0 * INCH, "PERREV": 0.0}
_STEPS = ("STEP", "INCR", "PECKING", "1STPECK", "SUBPECK")
_LABELS = {*_STEPS, "FEDTO", "DEPTH", "RAPTO", "CLEAR", "RTRCTO", "RETURN", "AUTO", "MANUAL", "DWELL", "TPI", "PITCH",
           "DIAMET", "TLANGL", "TIMES", "BACK", "REV", *_PER_MINUTE, *_PER_TURN}


def cycle(r: Record, dialect: WitnessDialect, scale: float, feed: tuple[float, bool, bool], line: int) -> WitnessCycle:
    """A CYCLE record; depth NaN where numbers without words would have to be guessed."""
    words = [w for w in r.words if isinstance(w, str) and w not in _LABELS]
    plain = next((w for w in words if w in _KINDS and w != "DRILL"), "DRILL")
    kind = next((_PECKED[w] for w in words if w in _PECKED), plain)
    kind = {"RIGID": "TAP", "SPOT": "DRILL"}.get(kind, kind)
    bare = WitnessCycle(kind, math.nan, math.nan, feed[0], feed[1], line=line)
    return stated(bare, r, dialect, scale, line)


def stated(made: WitnessCycle, r: Record, dialect: WitnessDialect, scale: float, line: int) -> WitnessCycle:
    """A cycle with what a record states, which is the last one for CYCLE/ON."""
    known = set(r.words) <= {*_LABELS, *_PECKED, *_KINDS, "ON", "NEXT", "SEC"} | {w for w in r.words if isinstance(w, float)}
    first = next((w for w in r.words if isinstance(w, float) or w in _LABELS), "")
    if isinstance(first, float) or not known:
        return replace(made, depth=math.nan, line=line)
    depth, start = r.after("FEDTO", "DEPTH"), r.after("RAPTO", "CLEAR")
    if depth is not None:
        made = replace(made, depth=depth * dialect.depth * scale)
    if start is not None:
        made = replace(made, clearance=start * scale)
    out = r.after("RTRCTO", "RETURN")
    made = replace(made, retract=out * scale if out is not None else math.inf if "AUTO" in r.words else made.retract)
    steps = tuple(v * scale for v in _steps(r) if v > 0.0)
    rest = r.after("DWELL") or 0.0
    rest = -(r.after("REV") or rest or math.nan) if "REV" in r.words else rest
    return replace(_fed(made, r, scale), steps=steps or made.steps, dwell=rest, line=line)


def _steps(r: Record) -> list[float]:
    found, on = list[float](), False
    for word in r.words:
        if isinstance(word, str):
            on = word in _STEPS
        elif on:
            found.append(word)
    return found


def _fed(made: WitnessCycle, r: Record, scale: float) -> WitnessCycle:
    threads, pitch = r.after("TPI"), r.after("PITCH")
    if threads:
        return replace(made, feed=INCH / threads, per_turn=True)
    for table, per_turn in ((_PER_MINUTE, False), (_PER_TURN, True)):
        for word, factor in table.items():
            if (value := r.after(word)) is not None:
                return replace(made, feed=value * (factor or scale), per_turn=per_turn)
    if pitch and made.kind == "TAP":
        return replace(made, feed=pitch * scale, per_turn=True)
    return made
