"""What a CL file commands, as the second witness has read it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from postproc.witness.text import Array

RAPID, LINE, ARC, HOLE, START = range(5)
UNKNOWN = -9
"""of tool, spindle or coolant: the file does not say"""
UNFOLLOWED = -8
"""of spindle or coolant: switched by codes of the machine, which this witness does not follow"""

KINDS = {"OFF": 0, "THRU": 12, "AIR": 13, "MIST": 11}
"""coolant by the word that says it, in this order; 1 is flood, 2 whatever flows"""
BITS = {1: (1,), 11: (2, 1), 12: (4, 1), 13: (8, 2, 1)}
"""what flows then, as the reader counts it; what comes next where the control has no code for it"""
OFF, SIDES = 40, {"LEFT": 41, "RIGHT": 42, "OFF": 40}
"""of cutter compensation, and by the words of CUTCOM"""
OWN = 0
"""of a length register: that of the tool's number"""
Pause = tuple[int, float, int]
"""a rest or stop: the position before which it stands, s or 0 for STOP and 1 for OPSTOP, its line"""


@dataclass(frozen=True)
class WitnessCycle:
    """A drilling cycle, mm from the hole's top along the tool axis; `feed` mm/min or (per turn) mm; `dwell` s, negative:
    revolutions; NaN: not stated."""

    kind: str
    depth: float
    clearance: float
    feed: float = math.nan
    per_turn: bool = False
    steps: tuple[float, ...] = ()
    dwell: float = 0.0
    retract: float = math.nan
    """where the tool leaves the hole to, NaN where no number says so"""
    line: int = 0


@dataclass(frozen=True)
class Commanded:
    """N positions in the absolute frame of the file, mm.

    Attributes:
        tip, axis (N, 3); kind (N,): RAPID, LINE, ARC, HOLE, START (not gone to); line (N,)
        known (N,): False where the position was not understood; gap (N,): the path to it was not
        feed (N,): mm/min, or mm per turn where `per_turn` (N,), or 1/min where `inverse` (N,); NaN: none
        arc (N,): index into centre, normal (K, 3), sweep (K,) rad; -1
        cycle (N,): index into cycles, -1; tool, spindle, coolant (N,): number; -1, 0, 1; "" to words; UNKNOWN
        splines: by row, points (P, 3) of the curve there
        side (N,): 40, 41 or 42 as CUTCOM says it: off, left, right of the path
        register (N,): length register that was named last, OWN where none was; registered (N,): row from which on it is
        rpm (N,): NaN where not stated; turned, flowed (N,): row of the last SPINDL and COOLNT record; name (N,): into names
        systems: rotation and origin of every system of the file by its name, in order; first: name of the one
            that the first position is in, "" for the absolute frame, None where that is not sure
        radius (N,): register that CUTCOM names, NaN; cutter (N,): mm, radius of a tool; flat, corner (N,): mm from
            its axis to the centre of its corner (0: a ball), and the radius of that, NaN of other ends
        surface (N, 3): normals that the file states, NaN
        unread: what was not understood, by its text
    """

    tip: Array
    axis: Array
    kind: Array
    line: Array
    known: Array
    gap: Array
    feed: Array
    per_turn: Array
    inverse: Array
    arc: Array
    centre: Array
    normal: Array
    sweep: Array
    cycle: Array
    cycles: tuple[WitnessCycle, ...]
    tool: Array
    side: Array
    register: Array
    registered: Array
    name: Array
    names: tuple[str, ...]
    spindle: Array
    rpm: Array
    turned: Array
    coolant: Array
    flowed: Array
    systems: dict[str, tuple[Array, Array]]
    first: str | None
    radius: Array
    flat: Array
    corner: Array
    cutter: Array
    surface: Array
    rests: tuple[Pause, ...]
    stops: tuple[Pause, ...]
    splines: dict[int, Array] = field(default_factory=dict)
    unread: dict[str, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.tip)

    def without_poses(self) -> Commanded:
        """The same with NaN in the place of tips and axes, which a long file has no room for twice."""
        unknown = np.broadcast_to(np.nan, (len(self), 3))
        return replace(self, tip=unknown, axis=unknown)


def unit(v: Array) -> Array:
    """Rows (N, 3) at length 1; NaN for zero rows."""
    size = np.sqrt((v * v).sum(axis=-1, keepdims=True))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(size > 0.0, v / size, np.nan))


def picked(values: Array, index: Array) -> Array:
    """Values (K, ...) by an index (N,); by one that is kept once, the value is."""
    if len(index) and index.strides[0] == 0:
        return np.broadcast_to(values[index[0]], (len(index), *values.shape[1:]))
    return np.asarray(values[index])


def loads(tool: Array) -> Array:
    """(N,) row at which the tool of each row was loaded."""
    if len(tool) and tool.strides[0] == 0:
        return np.broadcast_to(0, len(tool))
    return np.maximum.accumulate(np.where(np.diff(tool, prepend=tool[:1] - 1) != 0, np.arange(len(tool)), 0))


def registers_of(c: Commanded, loaded: Array, row: Array) -> Array:
    """(K,) length register in force at rows: one that was named since the tool was loaded, at `loaded` (N,), else OWN."""
    return np.where(c.registered[row] >= loaded[row], c.register[row], OWN)


def tools_of(c: Commanded, setup: dict[str, Any]) -> Array:
    """(N,) number of the tool: of the set-up by its name, else of the file; UNKNOWN where neither is sure.

    Where [tool_numbers] has names that this witness has not read, a tool without a name could be one of them.
    """
    asked = {str(name).upper(): int(n) for name, n in (setup.get("tool_numbers") or {}).items()}
    if not asked:
        return c.tool
    own = np.array([asked.get(name, UNKNOWN) for name in c.names] + [UNKNOWN])[c.name]
    sure = (c.name >= 0) | set(asked).issubset(c.names)
    return np.asarray(np.where(own != UNKNOWN, own, np.where(sure & (c.tool > 0), c.tool, UNKNOWN)))


def with_spindle(c: Commanded, setup: dict[str, Any]) -> Commanded:
    """With the set-up's spindle where it counts: `[tools.N]` for a tool that no SPINDL record is for,
    `[output]` where the spindle stands there too, either where no record at all states one, and the speed of
    either where the file turns the spindle without one."""
    output = (setup.get("output") or {}).get("spindle")
    own = {int(n): t["spindle"] for n, t in (setup.get("tools") or {}).items() if (t or {}).get("spindle")}
    if not len(c) or not (output or own):
        return c
    tool, silent = tools_of(c, setup), c.spindle == UNKNOWN
    begin = loads(tool)
    others = (c.turned < begin) | ((c.turned == begin) & (c.spindle == 0))
    known = ~silent & (c.spindle != UNFOLLOWED)
    spindle, rpm = c.spindle.copy(), c.rpm.copy()
    for number in np.unique(tool).tolist():
        wanted, here = own.get(number) or output, tool == number
        if not wanted:
            continue
        none = here & known & np.isnan(c.rpm)
        taken = here & (silent | (known & others & ((number in own) | (c.spindle == 0) | none)))
        rpm[taken | none] = wanted["rpm"]
        spindle[taken] = 1 if wanted["direction"] == "clockwise" else -1
    return replace(c, spindle=spindle, rpm=rpm)


def feeds_of(c: Commanded, setup: dict[str, Any], most: float) -> Array:
    """(N,) mm/min that the CL file asks for at every position, but taps no more than `most`; NaN where it does not say."""
    own = np.array([(x.feed, x.per_turn) for x in c.cycles] + [(math.nan, 0.0)], np.float64)
    hole = c.cycle >= 0
    feed = np.where(hole, own[c.cycle, 0], c.feed)
    per_turn = np.where(hole, own[c.cycle, 1] > 0, c.per_turn)
    tap = np.array([x.kind == "TAP" for x in c.cycles] + [False])[c.cycle]
    default = (setup.get("output") or {}).get("feed")
    if default:
        feed = np.where(np.isnan(feed) & ~c.inverse & ~tap, float(default), feed)
        per_turn = per_turn & ~(np.isnan(c.feed) & ~hole)
    feed = np.where(per_turn, feed * c.rpm, np.where(c.inverse & ~hole, math.nan, feed))
    return np.asarray(np.where(feed > np.where(tap, math.inf, most), most, feed))
