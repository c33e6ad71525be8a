"""Feeds, holes, tool, spindle and coolant of every cut against the CL file and the set-up."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from postproc.witness.clamps import limits_of
from postproc.witness.commanded import (
    ARC,
    BITS,
    LINE,
    OWN,
    UNFOLLOWED,
    UNKNOWN,
    Commanded,
    WitnessCycle,
    feeds_of,
    loads,
    registers_of,
    tools_of,
)
from postproc.witness.evidence import Aspect, Case, Finding, FindingCode, NotCompared
from postproc.witness.machine import largest_feed, register_beyond
from postproc.witness.motion import CHUNK, Walked, apart
from postproc.witness.splines import length_of
from postproc.witness.stretches import BOTTOM
from postproc.witness.text import Array

ALLOWED, VELOCITY = 1.005, 1.02
"""shares: of a feed, in each move and in all of one feed, besides rounding; of an axis's velocity, by rounded words"""
_State = Literal["length", "tool", "spindle", "speed", "coolant"]
_STATES: dict[_State, tuple[FindingCode, Aspect]] = {
    "length": ("length", "length registers"), "tool": ("tool", "tools"), "spindle": ("spindle", "spindle states"),
    "speed": ("spindle", "spindle states"), "coolant": ("coolant", "coolant states")}
_RETRACT = 12
"""blocks behind the bottom of a hole in which the tool comes to its retract plane"""
_PECKED, _FEED_OUT = ("DEEP", "BRKCHP"), ("BORE", "REAM", "TAP")


def check_feeds(w: Walked, c: Commanded, case: Case, table: dict[str, Any], match: Array) -> tuple[list[Finding], int]:
    """Cuts that are faster than programmed, or slower and no axis explains it; the number of cuts that were compared."""
    t = w.targets
    rows = np.flatnonzero(w.inside & (w.code > 0) & ~w.gap & ~w.returns & ((w.kind == LINE) | (w.kind == ARC)) & w.on_path())
    m = len(t)
    seconds = np.bincount(w.owner[rows], weights=w.seconds[rows], minlength=m)[:m]
    length = apart(t.tip, t.start)  # few columns at a time: each is as long as the file
    k = np.flatnonzero(t.sweep != 0.0)
    flat = t.start[k] - t.centre[k]
    rise = np.einsum("ni,ni->n", t.tip[k] - t.start[k], t.normal[k])
    radius = np.sqrt(np.maximum((flat * flat).sum(axis=1) - np.einsum("ni,ni->n", flat, t.normal[k]) ** 2, 0.0))
    length[k] = np.hypot(radius * np.abs(t.sweep[k]), rise)
    length[list(t.splines)] = [length_of(points) for points in t.splines.values()]
    most = largest_feed(table)
    feed = feeds_of(c, case.setup, most)[t.row]
    inverse = c.inverse[t.row] & (t.kind != BOTTOM)
    asked, slack, k = 60.0 * length / feed, 60.0 / feed, np.flatnonzero(inverse)
    asked[k] = np.maximum(60.0 / c.feed[t.row[k]], 60.0 * length[k] / most)
    slack[k] = asked[k] / np.maximum(length[k], 1e-3)
    slack *= 0.002 + 4.0 * case.tolerance + np.abs(t.sweep) * case.tolerance
    check = ((t.kind == LINE) | (t.kind == ARC)) & ~t.gap & ~t.free & (match >= 0) & (seconds > 0.0) & np.isfinite(asked)
    feed[k] = asked[k]
    group = _groups(check, feed)
    pace = np.divide(asked, np.maximum(length, 1e-9), out=length)
    del feed, length, inverse
    hurried = w.owner[rows[_fast_blocks(w, rows, pace, case.tolerance)]]
    fast = check & ((seconds * ALLOWED + slack < asked) | (np.bincount(hurried, minlength=m) > 0)
                    | _off_in_all(group, asked, ALLOWED * seconds, slack))
    found = _feed_finding(w, c, np.flatnonzero(fast), asked, seconds, match)
    if not case.planned:
        late = check & ((seconds > ALLOWED * asked + slack) | _off_in_all(group, seconds, ALLOWED * asked, slack))
        needed = np.maximum(asked, _needed(w, rows, np.flatnonzero(late), pace, table))
        slow = late & ((seconds > ALLOWED * needed + slack)
                       | _off_in_all(np.where(late, group, 0), seconds, ALLOWED * needed, slack))
        found += _feed_finding(w, c, np.flatnonzero(slow), asked, seconds, match)
    return found, int(check.sum())


def _fast_blocks(w: Walked, rows: Array, pace: Array, tolerance: float) -> Array:
    """(K,) True for blocks of cuts whose F word, or whose time, takes the tip farther than `pace` (M,), s/mm, allows."""
    e, found = w.poses.executed, np.zeros(len(rows), bool)
    for first in range(0, len(rows), CHUNK):
        here = rows[first:first + CHUNK]
        length, most = apart(w.tip, w.tip, here, np.maximum(here - 1, 0)), pace[w.owner[here]]
        straight = ~e.inverse[here] & (np.abs(w.length[here] - length) < 1e-4 * length) & (length > 1.0)
        by_word = straight & ((e.feed[here] - 0.1) * e.unit[here] * most > 60.0 * ALLOWED)
        found[first:first + CHUNK] = ((length - 0.002 - 2.0 * tolerance) * most > ALLOWED * w.seconds[here]) | by_word
    return found


def _groups(check: Array, feed: Array) -> Array:
    """(M,) number of the feed of each target, from 1; 0 for what is not compared."""
    result = np.zeros(len(feed), np.int32)
    values = feed[check]
    if len(values):
        new = np.flatnonzero(np.append(True, values[1:] != values[:-1]))
        number = np.unique(values[new], return_inverse=True)[1]
        result[check] = 1 + np.repeat(number, np.diff(np.append(new, len(values))))
    return result


def _off_in_all(group: Array, more: Array, less: Array, slack: Array) -> Array:
    """(M,) True for targets of a group whose sum of `more` s passes that of `less` by what rounding, which
    goes in either direction, may make of the sum."""
    n = int(group.max(initial=0)) + 1
    over = np.bincount(group, weights=np.where(group > 0, more - less, 0.0), minlength=n)
    allowed = np.sqrt(np.bincount(group, weights=np.where(group > 0, slack * slack, 0.0), minlength=n))
    return np.asarray((over > allowed)[group] & (group > 0) & (more > less))


def _needed(w: Walked, rows: Array, slow: Array, pace: Array, table: dict[str, Any]) -> Array:
    """(M,) s of the targets `slow` where every block takes what the feed, `pace` (M,) s/mm, and the
    velocities of the axes ask for."""
    result = np.zeros(len(w.targets))
    late, (_, speed) = np.append(np.zeros(len(result), bool), False), limits_of(table, w.poses.executed.letters)
    late[slow] = True
    for first in range(0, len(rows), CHUNK):
        here = rows[first:first + CHUNK]
        here = here[late[w.owner[here]]]
        step = w.tip[here] - w.tip[np.maximum(here - 1, 0)]
        q, most = w.poses.before(here), np.sqrt(np.einsum("ni,ni->n", step, step)) * pace[w.owner[here]]
        most = np.maximum(most, 60.0 * w.length[here] / largest_feed(table))
        parts = 4 if w.poses.executed.words == w.poses.executed.letters else 8  # drives of a control's own kinematics bend
        for t in (np.arange(parts) + 1.0).tolist():
            after = w.poses.joints(here, t / parts)
            most = np.maximum(most, parts * (np.abs(after - q) / speed).max(axis=1))
            q = after
        np.add.at(result, w.owner[here], most)
    return result


def check_velocities(w: Walked, c: Commanded, table: dict[str, Any]) -> list[Finding]:
    """Straight blocks at feed whose F word asks an axis for more than its velocity."""
    e = w.poses.executed
    _, speed = limits_of(table, e.letters)
    bad = list[int]()
    for first in range(0, len(e), CHUNK):
        rows = np.arange(first, min(first + CHUNK, len(e)))
        rows = rows[(e.code[rows] == 1) & (w.seconds[rows] > 0.0)]
        needed = (np.abs(e.joints(rows) - w.poses.before(rows)) / speed).max(axis=1)
        bad += rows[w.seconds[rows] * VELOCITY + 1e-3 < needed].tolist()
    if not bad:
        return []
    owner = int(w.owner[bad[0]])
    line = int(c.line[w.targets.row[owner]]) if owner < len(w.targets) else 0
    return [Finding("velocity", "the feed asks an axis for more than its velocity", line, int(e.line[bad[0]]), len(bad))]


def _feed_finding(w: Walked, c: Commanded, at: Array, asked: Array, seconds: Array, match: Array) -> list[Finding]:
    if not len(at):
        return []
    ratio = asked[at] / np.where(seconds[at] > 0.0, seconds[at], 1.0)
    worst = int(np.abs(np.log(np.maximum(ratio, 1e-9))).argmax())
    k = at[worst]
    return [Finding("feed", f"the cut runs at {ratio[worst]:.3f} times the feed of the CL file",
                    int(c.line[w.targets.row[k]]), int(w.poses.executed.line[match[k]]), len(at))]


def check_states(w: Walked, c: Commanded, case: Case) -> tuple[list[Finding], dict[Aspect, int], list[NotCompared]]:
    """Tool, spindle, speed and coolant while cutting; how many blocks each was compared in; what could not be.

    Blocks that leave a hole at feed count with the hole; feed moves off the path are linking moves and belong to no cut."""
    cuts = (w.kind == LINE) | (w.kind == ARC) | (w.kind == BOTTOM)
    rows = np.flatnonzero(w.inside & (w.code > 0) & cuts & (w.on_path() | w.gap | w.returns))
    tool = tools_of(c, case.setup)
    coolant, loaded = _coolants(c, case.setup), loads(tool)
    found, counts, silent = dict[_State, Finding](), dict[Aspect, int](), list[NotCompared]()
    for first in range(0, max(len(rows), 1), CHUNK):
        here = rows[first:first + CHUNK]
        row = w.targets.row[w.owner[here] - w.returns[here]]
        named = registers_of(c, loaded, row)
        checks, unstated = _states_of(w, c, case, here, row, tool[row], coolant[row], named)
        for state, text, compared, is_, wanted, good in checks:
            bad = np.flatnonzero(compared & ~good)
            code, aspect = _STATES[state]
            counts[aspect] = counts.get(aspect, 0) + int(compared.sum())
            if len(bad) and state not in found:
                k = int(bad[0])
                found[state] = Finding(code, text.format(_said(state, is_[k]), _said(state, wanted[k])), int(c.line[row[k]]),
                                       int(w.poses.executed.line[here[k]]), 0)
            if len(bad):
                found[state] = replace(found[state], count=found[state].count + len(bad))
        if unstated.any() and not silent:
            silent = [NotCompared("spindle", "stated by no record", int(c.line[row[unstated.argmax()]]))]
    return [found[state] for state in _STATES if state in found], counts, silent


def _states_of(w: Walked, c: Commanded, case: Case, rows: Array, row: Array, tool: Array, coolant: Array, named: Array,
               ) -> tuple[tuple[tuple[_State, str, Array, Array, Array, Array], ...], Array]:
    """Of blocks that cut, by their rows of the CL file and what stands there: each state with the words of its fault, where
    it is compared, what it is and should be, where that is so; (K,) True where no record states the spindle."""
    e, output = w.poses.executed, case.setup.get("output") or {}
    own = np.where(tool >= 0, tool + (register_beyond(case.machine) if case.registers else 0), tool)
    register = np.where((named == OWN) | (named == tool) | (not case.registers), own, named)
    register = np.where(e.lengthless[rows] | (not output.get("tool_call", True)), -1, register)
    direction, rpm = c.spindle[row], c.rpm[row]
    if not output.get("tool_call", True):
        tool = np.full(len(rows), -1)
    tap = np.array([x.kind == "TAP" for x in c.cycles] + [False])[c.cycle[row]]
    flow = e.coolant[rows]
    stated = (direction != UNKNOWN) & (direction != UNFOLLOWED)
    speed = stated & (direction != 0) & np.isfinite(rpm) & ~tap
    some = any(_stated_coolant(case.setup))
    wet = np.where(coolant == UNKNOWN, some | (flow == 0), np.where(coolant == 0, flow == 0, flow > 0))
    for kind, bits in BITS.items():
        bit = next((b for b in bits if case.coolants & b), 0)
        wet &= (coolant != kind) | ((flow & bit) > 0) | (not bit)
    return ((
        ("length", "the length register is {0}, by the CL file it is {1}", tool != UNKNOWN, e.register[rows], register,
         e.register[rows] == register),
        ("tool", "the program cuts with {0}, the CL file with {1}", tool != UNKNOWN, e.tool[rows], tool,
         e.tool[rows] == tool),
        ("spindle", "the spindle is {0}, the CL file says {1}", stated & ~tap, e.spindle[rows], direction,
         e.spindle[rows] == direction),
        ("speed", "the spindle speed is {0}, the CL file says {1}", speed, e.rpm[rows], rpm,
         np.abs(e.rpm[rows] - rpm) <= 0.5 + 1e-3 * np.abs(rpm)),
        ("coolant", "the coolant is {0}, the CL file says {1}",
         (coolant != UNFOLLOWED) & ((coolant != UNKNOWN) | (not some)), flow, coolant, wet)),
        (direction == UNKNOWN) & ~tap)


def _coolants(c: Commanded, setup: dict[str, Any]) -> Array:
    """(N,) coolant, the set-up's for a tool that no COOLNT record is for: its own, or [output] where none flows."""
    (own, default), tool, result, silent = _stated_coolant(setup), tools_of(c, setup), c.coolant.copy(), c.coolant == UNKNOWN
    begin = loads(tool)
    later = np.isin(begin, begin[~silent & (c.flowed >= begin) & (c.coolant != 0)])
    others = ~later & (silent | ((c.flowed < begin) & (c.coolant != UNFOLLOWED)))
    for number in sorted(set(tool[np.isin(tool, list(own)) | bool(default)].tolist())):
        word = own.get(number) or default
        taken = (tool == number) & ((number in own) | silent | (c.coolant == 0))
        result[taken & others] = {"off": 0, "flood": 1, "mist": 11, "through": 12, "air": 13}.get(str(word), 2)
        result[taken & ~silent & (c.flowed == begin) & (c.coolant == 0)] = UNFOLLOWED
    return result


_SPINDLE = {1: "turning clockwise (M3)", -1: "turning anti-clockwise (M4)", 0: "stopped"}
_COOLANT = {0: "off", 1: "flood", 2: "on", 11: "mist", 12: "through the tool", 13: "air"}


def _said(state: _State, value: float) -> str:
    """A state in words; UNKNOWN of the file as nothing that is stated."""
    if value == UNKNOWN:
        return "nothing"
    if state in ("length", "tool"):
        names = ("none", f"{value:g}") if state == "length" else ("the tool in the spindle", f"T{value:g}")
        return names[int(value >= 0)]
    words = _SPINDLE if state == "spindle" else _COOLANT if state == "coolant" else {}
    return words.get(int(value), f"{value:g}") if state != "coolant" or value in words else "on"


def _stated_coolant(setup: dict[str, Any]) -> tuple[dict[int, str], str | None]:
    """The set-up's coolant by number of tool, and that of [output]."""
    own = {int(n): t["coolant"] for n, t in (setup.get("tools") or {}).items() if (t or {}).get("coolant")}
    return own, (setup.get("output") or {}).get("coolant")


def check_holes(w: Walked, c: Commanded, case: Case, match: Array, most: float) -> tuple[list[Finding], int]:
    """Depth, pecks, dwell and thread of every hole."""
    t, e = w.targets, w.poses.executed
    bad: dict[str, list[tuple[int, int]]] = {}
    holes = np.flatnonzero((t.kind == BOTTOM) & (match >= 0))
    edges = np.searchsorted(w.owner, np.append(holes, 0)[:-1], side="left")
    levels = _initial_levels(w, c, holes, match, case.tolerance)
    for i, first, level in zip(holes.tolist(), edges.tolist(), levels, strict=True):
        last = int(match[i])
        blocks = np.arange(first, last + 1)
        if len(blocks):
            rpm = float(c.rpm[t.row[i]])
            cycle = _limited(c.cycles[c.cycle[t.row[i]]], rpm, most)
            for what in [*_hole_faults(w, i, blocks, cycle, rpm, case.tolerance),
                         *_retract_fault(w, i, last, cycle, level, case.tolerance)]:
                bad.setdefault(what, []).append((i, last))
    return [Finding("hole", what, int(c.line[t.row[at[0][0]]]), int(e.line[at[0][1]]), len(at))
            for what, at in bad.items()], len(holes)


def _limited(cycle: WitnessCycle, rpm: float, most: float) -> WitnessCycle:
    """The cycle at no more than the largest cutting feed, mm/min, rests in s; taps keep their thread."""
    cycle = replace(cycle, dwell=-60.0 * cycle.dwell / (rpm or math.nan)) if cycle.dwell < 0.0 else cycle
    feed = cycle.feed * rpm if cycle.per_turn else cycle.feed
    return cycle if cycle.kind == "TAP" or not feed > most else replace(cycle, feed=most, per_turn=False)


def _hole_faults(w: Walked, i: int, blocks: Array, cycle: WitnessCycle, rpm: float, tolerance: float) -> list[str]:
    t, e = w.targets, w.poses.executed
    depth = (t.tip[i] - w.tip[blocks]) @ t.axis[i]
    total, found = cycle.depth + cycle.clearance, []
    if depth.max() > tolerance + 1e-6:
        found.append("the hole is deeper than the CL file says")
    fed = e.code[blocks] > 0
    deepest = np.maximum.accumulate(np.where(fed, depth, -np.inf))
    reached = np.append(-total, deepest[:-1])
    if (~fed & (depth > np.maximum(reached, -total) + 1e-3)).any():
        found.append("rapid motion into uncut material of a hole")
    back = np.append(depth[1:], -np.inf) < deepest - 0.01  # lost motion may be taken up first
    turns = deepest[np.isfinite(deepest) & (depth >= deepest - 0.01) & back]
    steps = np.diff(np.append(-cycle.depth, np.maximum(sorted(set(np.round(turns, 6).tolist())), -cycle.depth)))
    allowed = [max(cycle.steps[min(k, len(cycle.steps) - 1):], default=np.inf) for k in range(len(steps))]
    if cycle.kind in _PECKED and (steps > np.array(allowed) + 0.01).any():
        found.append("the hole is drilled in deeper pecks than the CL file says")
    lifts = [depth[k:n].min() <= 0.01 - total for k, n in pairwise(np.flatnonzero(fed & (depth >= deepest - 0.01) & back))]
    if cycle.kind in _PECKED and cycle.steps and lifts and (any(lifts) if cycle.kind == "BRKCHP" else not all(lifts)):
        found.append("between pecks the tool does not leave the hole, or leaves it, as the CL file says")
    if not cycle.steps and len(blocks) > 1 and (np.diff(depth) < -0.01).any():
        found.append("the hole is drilled in pecks, the CL file has none")
    rest = float(e.dwell[blocks].sum())
    if cycle.dwell == cycle.dwell and not cycle.dwell * 0.99 - 2e-3 <= rest <= cycle.dwell * 1.01 + 2e-3:
        found.append(f"the tool rests {rest:g} s in the hole, the CL file says {cycle.dwell:g} s")
    pitch = e.pitch[blocks[-1]]
    if cycle.kind != "TAP" and math.isfinite(pitch):
        found.append("the hole is tapped, the CL file does not tap it")
    wanted = cycle.feed if cycle.per_turn else cycle.feed / rpm if rpm > 0.0 else math.nan
    if cycle.kind == "TAP" and abs(abs(pitch) - wanted) > 0.001 * wanted + 1e-4:
        found.append(f"the thread has a pitch of {abs(pitch):g} mm, by the CL file {wanted:g} mm")
    out = blocks[-1] + 1
    if cycle.kind in _FEED_OUT and out < len(e) and e.code[out] == 0:
        found.append("the tool leaves the hole in rapid, the CL file asks for feed")
    if cycle.kind != "TAP":
        found += _feed_fault(w, blocks[fed & (depth > reached + 1e-3)], cycle, rpm)
    return found


def _initial_levels(w: Walked, c: Commanded, holes: Array, match: Array, tolerance: float) -> list[float]:
    """Height along its axis from which the tool came to the run of holes that each belongs to; NaN where the program
    links to them."""
    t, result = w.targets, list[float]()
    for n, i in enumerate(holes.tolist()):
        along, before = t.axis[i], i - 2
        if n and holes[n - 1] == i - 2 and t.row[i] == t.row[i - 2] + 1 and (t.axis[i - 2] == along).all():
            result.append(result[-1])
            continue
        result.append(math.nan)
        if before < 0 or match[before] < 0 or match[i - 1] < 0 or w.gap[match[i - 1]] or (t.axis[before] != along).any() \
                or c.tool[t.row[before]] != c.tool[t.row[i]]:
            continue
        level = float(t.tip[before] @ along)
        blocks = slice(int(match[before]), int(match[i - 1]) + 1)
        if (w.tip[blocks] @ along).max() <= max(level, float(t.tip[i - 1] @ along)) + 2.0 * tolerance:
            result[-1] = level
    return result


def _retract_fault(w: Walked, i: int, last: int, cycle: WitnessCycle, level: float, tolerance: float) -> list[str]:
    """That the tool leaves a hole below the retract plane, that of RTRCTO,AUTO at the `level` from which it came, or
    below the start plane."""
    t = w.targets
    back = level - float(t.tip[i] @ t.axis[i]) - cycle.depth
    wanted = np.nanmax([cycle.clearance, back if math.isinf(cycle.retract) else cycle.retract])
    low = float(wanted) - _risen(w, i, last, cycle.depth, tolerance)
    if low <= tolerance + 1e-6:
        return []
    return [f"the tool leaves the hole {low:.4f} mm below the retract plane of the CL file"]


def _risen(w: Walked, i: int, last: int, depth: float, tolerance: float) -> float:
    """mm above the top of hole i that the tool comes to before it leaves the axis of the hole, behind block `last`."""
    t, stop = w.targets, min(last + _RETRACT, len(w.tip))
    offset = w.tip[last:stop] - t.tip[i]
    rise = offset @ t.axis[i]
    rest = offset - rise[:, None] * t.axis[i]
    leaves = np.flatnonzero((rest * rest).sum(axis=1) > (2.0 * tolerance) ** 2)
    return float(rise[:leaves[0] if len(leaves) else None].max()) - depth


def _feed_fault(w: Walked, blocks: Array, cycle: WitnessCycle, rpm: float) -> list[str]:
    """That a block which goes deeper than those before it is faster than the feed of the cycle, or slower and
    no axis is at its velocity."""
    feed = cycle.feed * rpm if cycle.per_turn else cycle.feed
    step = w.tip[blocks] - w.tip[np.maximum(blocks - 1, 0)]
    length = np.sqrt(np.einsum("ni,ni->n", step, step))
    long = (length > 0.1) & (w.seconds[blocks] > 0.0)
    if not math.isfinite(feed) or not long.any():
        return []
    ratio = 60.0 * length[long] / w.seconds[blocks[long]] / feed
    slack = 0.002 / length[long]
    wrong = (ratio > ALLOWED + slack) | (ratio < 1.0 / ALLOWED - slack)
    return [f"the hole is drilled at {ratio[int(wrong.argmax())]:.3f} times the feed of the CL file"] if wrong.any() else []
