"""Blocks against the path that the CL file commands: deviation, rapid or feed, arcs, clearance of blocks that were added."""

from __future__ import annotations

import math

import numpy as np

from postproc.witness.block_times import lengths_of, seconds_of
from postproc.witness.clamps import limits_of
from postproc.witness.commanded import RAPID
from postproc.witness.evidence import Finding, FindingCode
from postproc.witness.machine import Chain
from postproc.witness.place import Cut, Poses
from postproc.witness.splines import goes_back
from postproc.witness.stretches import BOTTOM, ENTER, Targets, is_cut, is_rapid, off
from postproc.witness.text import Array

CHUNK = 20_000
STILL = 0.01
"""mm that a block may move the tip and be neither rapid nor feed"""
FULL, LEAST = 0.45, 0.04
"""shares of the margin that linking moves keep: where travel allows, and where it does not"""
EXACT = 1e-6
LINK = 0.01
"""mm that links may leave their straight line by on a machine that cannot lift the tool"""


class Walked:
    """Blocks with what of them is known: `owner` (E,) target of each, pose at its end, its deviation from its path (E,)."""

    def __init__(self, poses: Poses, targets: Targets, owner: Array, tip: Array, axis: Array,
                 tolerance: tuple[float, float]) -> None:
        self.poses, self.targets, self.owner, self.tip, self.axis = poses, targets, owner, tip, axis
        self.tolerance = tolerance
        self.code = poses.executed.code
        self.inside = owner < len(targets)
        m = np.minimum(owner, max(len(targets) - 1, 0))
        every = np.arange(len(owner), dtype=np.int32)
        begin = every[np.append(True, np.diff(owner) != 0)[:len(owner)]]
        count = np.diff(np.append(begin, len(owner)))
        self.first = np.repeat(begin, count)
        self.kind = np.where(self.inside, targets.kind[m], -1)
        self.returns, departs = self._left_holes()
        """(E,) blocks owned by a cut that leave the hole before it: they belong to the hole"""
        every[poses.executed.hole | self.returns] = len(owner)
        first = np.repeat(np.minimum.reduceat(every, begin), count)
        self.leaves = np.where(departs > 0, departs, np.where(first < len(owner), first, self.first))
        """first block of the target that is no return of a hole"""
        self.gap = np.where(self.inside, targets.gap[m], False)
        self.away, self.tilt = np.zeros(len(owner)), np.zeros(len(owner))
        self.length, unit = lengths_of(poses.executed)
        """(E,) mm or degrees that feeds refer to"""
        self.seconds = seconds_of(poses.executed, self.length, unit)
        """(E,) of blocks at feed"""

    def _left_holes(self) -> tuple[Array, Array]:
        """Of cuts behind a hole: (E,) True for the first blocks, which rise along its axis as far as its
        record says, else in rapid, in a cycle or up to its start plane; (E,) block behind the last one on
        that axis, where the cut leads off it and the record names no level (a tool may have been changed over
        the hole), -1 for others."""
        t, e, near = self.targets, self.poses.executed, self.tolerance[0] + EXACT
        rows = np.flatnonzero(is_cut(self.kind) & (self.kind != BOTTOM) & (self.owner > 0))
        rows = rows[(rows > 0) & (t.kind[self.owner[rows] - 1] == BOTTOM)]
        to, i = self.owner[rows], self.owner[rows] - 1
        along = t.axis[i]
        before, rise = (np.einsum("ni,ni->n", self.tip[k] - t.tip[i], along) for k in (rows - 1, rows))
        on = (_above(self.tip[rows], t.tip[i], along) <= near) & (
            np.einsum("ni,ni->n", self.axis[rows], along) >= math.cos(self.tolerance[1] + EXACT))
        plane = np.einsum("ni,ni->n", t.tip[i - 1] - t.tip[i], along)
        free = (self.code[rows] == 0) | e.hole[rows] | (rise <= plane + near)
        level = np.where(np.isfinite(t.out[i]), rise <= t.out[i] + near, free)
        returns, last = np.zeros(len(self.owner), bool), np.full(len(t) + 1, -1, np.int32)
        returns[rows] = on & level & (rise >= before - near)
        stays = np.append(np.int32(0), np.cumsum(~returns, dtype=np.int32))
        leads_off = on & t.free[to] & (_above(t.tip[to], t.tip[i], along) > 2.0 * near)
        np.maximum.at(last, to[leads_off], rows[leads_off] + 1)
        return returns & (stays[1:] == stays[self.first]), last[np.minimum(self.owner, len(t))]

    def start(self, rows: Array) -> tuple[Array, Array]:
        """(tip, axis) where the path of blocks `rows` begins: as commanded, or where the tool stood."""
        i = self.owner[rows]
        free = self.targets.free[i]
        start, axis = self.targets.start[i].copy(), self.targets.start_axis[i].copy()
        before = np.minimum(self.leaves[rows[free]], rows[free]) - 1
        start[free] = np.where((before >= 0)[:, None], self.tip[before], self.targets.tip[i[free]])
        axis[free] = np.where((before >= 0)[:, None], self.axis[before], self.targets.axis[i[free]])
        return start, axis

    def measure(self) -> None:
        """Deviation at the middle and the end of every block that serves a target."""
        rows = np.flatnonzero(self.inside & ~self.gap)
        for first in range(0, len(rows), CHUNK):
            k = rows[first:first + CHUNK]
            i, (start, start_axis) = self.owner[k], self.start(k)
            for d, a in off(self.targets, i, (self.poses.at(k, 0.5), (self.tip[k], self.axis[k])), start, start_axis):
                self.away[k] = np.fmax(self.away[k], np.nan_to_num(d, nan=np.inf))
                self.tilt[k] = np.fmax(self.tilt[k], np.nan_to_num(a, nan=np.inf))

    def on_path(self) -> Array:
        """(E,) blocks that stay on the path to their target."""
        return self.inside & ~self.gap & (self.away <= self.tolerance[0] + EXACT) & (self.tilt <= self.tolerance[1] + EXACT)


def apart(a: Array, b: Array, i: Array | None = None, j: Array | None = None) -> Array:
    """(N,) mm between rows (of those `i` and `j` where they are given), few at a time."""
    result = np.empty(len(a) if i is None else len(i))
    for first in range(0, len(result), CHUNK):
        part = slice(first, first + CHUNK)
        step = a[part if i is None else i[part]] - b[part if j is None else j[part]]
        result[part] = np.sqrt((step**2).sum(axis=1))
    return result


def check_path(w: Walked, lines: Array, cut: Cut | None, margin: float, link_angle: float, bent: bool,
               table: dict[str, object], fed_rapids: bool, flat: bool = False) -> list[Finding]:
    """Blocks off their path that are no retract, approach or move clear of what is cut; rapids in cuts and the reverse.

    Rapids that turn the tool axis by more than `link_angle` (degrees) have to be clear, or on such a line, themselves;
    where they are dog-legs (`bent`) they may be fed if the set-up asks for that; `flat`: none has to be clear, they go
    straight from cut to cut, or by home."""
    good = w.on_path()
    moved = np.append(np.zeros(1), apart(w.tip[1:], w.tip[:-1]))[:len(w.tip)]
    cutting, rapid = is_cut(w.kind) & ~w.gap & ~w.returns, is_rapid(w.kind) & ~w.gap
    found = []
    hurried = cutting & good & (w.code == 0) & (moved > STILL) & (w.kind != BOTTOM)
    found += _finding(w, np.flatnonzero(hurried), lines, "kind", "rapid motion on a cut of the CL file")
    after_hole = w.targets.kind[np.clip(w.owner - 1, 0, len(w.targets) - 1)] == BOTTOM
    fed = (w.kind == RAPID) & ~after_hole & ~w.gap & good & (w.code > 0) & (moved > STILL) & (not (bent and fed_rapids))
    found += _finding(w, np.flatnonzero(fed), lines, "kind", "feed motion on a rapid of the CL file")
    for target, points in w.targets.splines.items():
        rows = np.flatnonzero((w.owner == target) & good & (w.code > 0) & ~w.gap)
        if goes_back(w.tip[rows], points, w.tolerance[0] + EXACT):
            found += _finding(w, rows, lines, "path", "the tool does not go along the spline from its begin to its end")
    turned = _turned_in_rapid(w, math.radians(link_angle))
    good &= ~turned
    rows = np.flatnonzero(~good & ~w.gap & (np.arange(len(w.owner)) > 0) & ((w.code == 0) | cutting | rapid | ~w.inside))
    if not len(rows):
        return found
    low = _low(w, rows, cut, margin, bent, turned[rows], table)
    bad = rows[low]
    bad = bad[(w.code[bad] == 0) | (moved[bad] > EXACT)]
    cuts = bad[(w.code[bad] > 0) & cutting[bad]]
    if len(cuts):
        k = int(cuts[0])
        found += _finding(w, cuts, lines, "path", f"the tool is {w.away[k]:.6f} mm and {np.degrees(w.tilt[k]):.6f} degrees "
                          "off the path of the CL file")
    rest = bad[~np.isin(bad, cuts)]
    if flat:
        links = rows[((w.code[rows] == 0) | (bent and fed_rapids)) & ~np.isin(rows, cuts)]
        found += _finding(w, links[_astray(w, links, bent)], lines, "clearance", "motion that the CL file does not command "
                          "leaves the straight line from cut to cut, or by home")
        rest = rest[~np.isin(rest, links)]
    return found + _finding(w, rest, lines, "clearance", "motion that the CL file does not command comes nearer to what is "
                            "cut than the margin of the set-up")


def _astray(w: Walked, rows: Array, bent: bool) -> Array:
    """(K,) True for blocks of links that are not on the straight line to their target from where the path was left, nor on
    those to home and from there; rapids that are dog-legs (`bent`) at their ends alone."""
    m, near = len(w.targets), w.tolerance[0] + EXACT + LINK
    to, ends, begins = np.minimum(w.owner[rows], m - 1), w.owner[rows] >= m, w.owner[rows] == 0
    left = np.maximum.accumulate(np.where(w.on_path(), np.arange(len(w.owner)), 0))[rows]
    begin = np.zeros(1, np.int64)
    home, axis = w.poses.at(begin, 0.0)
    home = home + (w.poses.lengths(begin) - w.poses.lengths(rows))[:, None] * axis  # of each tool
    start = np.where(begins[:, None], home, w.tip[left])
    goals = [np.where(ends[:, None], home, goal) for goal in (w.targets.tip[to], w.targets.start[to])]
    astray = np.zeros(len(rows), bool)
    for t in (0.25, 0.5, 0.75, 1.0):
        tip = w.poses.at(rows, t)[0]
        off = [_off_segment(tip, a, b) for goal in goals for a, b in ((start, goal), (start, home), (home, goal))]
        astray |= ~(np.min(off, axis=0) <= near) & ((w.code[rows] > 0) | (not bent) | (t == 1.0))
    return astray


def _off_segment(tip: Array, begin: Array, end: Array) -> Array:
    """(K,) mm from straight lines between two points."""
    span = end - begin
    size = np.einsum("ni,ni->n", span, span)
    share = np.einsum("ni,ni->n", tip - begin, span) / np.where(size > 0.0, size, 1.0)
    rest = tip - begin - np.clip(share, 0.0, 1.0)[:, None] * span
    return np.asarray(np.sqrt((rest * rest).sum(axis=1)))


def _turned_in_rapid(w: Walked, angle: float) -> Array:
    """(E,) blocks of rapids of the CL file that turn the tool axis by more than an angle."""
    t = w.targets
    turns = np.einsum("ni,ni->n", t.start_axis, t.axis) < math.cos(angle)
    return np.asarray(w.inside & ((t.kind == RAPID) & ~t.free & turns)[np.minimum(w.owner, len(t) - 1)])


def _finding(w: Walked, rows: Array, lines: Array, code: FindingCode, message: str) -> list[Finding]:
    if not len(rows):
        return []
    k = int(rows[0])
    owner = int(w.owner[k])
    line = int(lines[w.targets.row[owner]]) if owner < len(w.targets) else 0
    return [Finding(code, message, line, int(w.poses.executed.line[k]), len(rows))]


def _low(w: Walked, rows: Array, cut: Cut | None, margin: float, bent: bool, turned: Array,
         table: dict[str, object]) -> Array:
    """(K,) True for blocks that are neither clear nor on the line of a retract or an approach, nor, but for
    those that are `turned` (K,), a rapid that keeps its height."""
    m, near = len(w.targets), w.tolerance[0] + EXACT
    to, before = np.minimum(w.owner[rows], m - 1), np.maximum(w.owner[rows] - 1, 0)
    ends, begins = w.owner[rows] >= m, w.owner[rows] == 0
    entry = w.targets.free[to] & is_rapid(w.targets.kind[to])
    start, start_axis = w.targets.start[to], w.targets.start_axis[to]
    here = np.maximum(w.first[rows] - 1, 0)
    # A rewind draws back within a move: from where the cut was left, and back to there.
    left = np.maximum.accumulate(np.where(w.on_path(), np.arange(len(w.owner)), 0))[rows]
    low = np.zeros(len(rows), bool)
    tight = np.zeros(len(rows), bool)
    # What comes to the end of a cut at feed is that cut: it may be on such a line, and nowhere else, however high.
    cuts = (w.code[rows] > 0) & is_cut(w.kind[rows]) & ~w.gap[rows] & (w.owner[rows] != np.append(w.owner, m + 1)[rows + 1])
    for t in (0.25, 0.5, 0.75, 1.0):
        tip, axis = w.poses.at(rows, t)
        line = np.fmin(_above(tip, w.targets.tip[before], w.targets.axis[before]), _above(tip, w.tip[here], w.axis[here]))
        line = np.fmin(line, _above(tip, w.tip[left], w.axis[left]))
        line = np.where(begins, np.inf, line)
        line = np.fmin(line, np.where(ends, np.inf, _above(tip, w.targets.tip[to], w.targets.axis[to])))
        line = np.fmin(line, np.where(ends | entry, np.inf, _above(tip, start, start_axis)))
        adjacent = ~(line <= near)
        adjacent &= turned | ~_level(w, rows, to, ends | begins, tip, near, cut if bent else None)
        low |= adjacent & cuts
        if cut is not None:
            low |= adjacent & ~cut.clear(tip, axis, LEAST * margin)
            tight |= adjacent & ~cut.clear(tip, axis, FULL * margin)
    short = np.flatnonzero(tight & ~low)
    if len(short):
        low[short] = ~_explained(w, rows[short], margin, table)
    return low


def _above(tip: Array, end: Array, axis: Array) -> Array:
    """(K,) mm from the half lines that leave `end` along `axis`."""
    offset = tip - end
    rise = np.maximum(np.einsum("ni,ni->n", offset, axis), 0.0)
    rest = offset - rise[:, None] * axis
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", rest, rest)))


def _level(w: Walked, rows: Array, to: Array, away: Array, tip: Array, near: float, cut: Cut | None) -> Array:
    """(K,) True for rapids to a hole or from one that keep the height of where they come from: the start plane of the hole
    before, or the position before. Where rapids are dog-legs (`cut`), those that keep above what is cut and the stock, and
    from hole to hole above the lower end."""
    before, along = np.maximum(to - 1, 0), w.targets.axis[to]
    drilled = w.targets.kind[before] == BOTTOM
    rise, first = (np.einsum("ni,ni->n", p, along) for p in (tip, w.targets.tip[before - drilled]))
    last = np.einsum("ni,ni->n", w.targets.tip[to], along) if cut else first
    of_hole = drilled | (w.targets.kind[to] == ENTER)
    keeps = of_hole & (rise >= np.minimum(first, last) - near)
    keeps |= rise >= (cut.top(along) - near if cut else np.inf)
    return np.asarray(~away & is_rapid(w.kind[rows]) & keeps)


def _explained(w: Walked, rows: Array, margin: float, table: dict[str, object]) -> Array:
    """(K,) True where a tool that is lifted by the margin would leave the travel of a slide, somewhere on the same link."""
    e, machine = w.poses.executed, w.poses.machine
    if not isinstance(machine, Chain):
        return np.ones(len(rows), bool)
    travel, _ = limits_of(table, e.letters)
    link = np.flatnonzero(np.isin(w.owner, w.owner[rows]))
    beyond = np.zeros(len(w.targets) + 1, bool)
    for first in range(0, len(link), CHUNK):
        k = link[first:first + CHUNK]
        linear, travels = machine.slides(e.joints(k), e.letters)
        lift = np.linalg.solve(travels, 0.95 * margin * w.axis[k][:, :, None])[:, :, 0]
        q = e.joints(k)[:, linear] + lift
        beyond[w.owner[k[((q < travel[linear, 0]) | (q > travel[linear, 1])).any(axis=1)]]] = True
    return np.asarray(beyond[w.owner[rows]])


def check_arcs(w: Walked, turns: Array, lines: Array) -> list[Finding]:
    """Arcs of the CL file that the program turns in the other direction, or by another angle."""
    t, m = w.targets, len(w.targets)
    if not t.sweep.any():
        return []
    rows = np.flatnonzero(w.inside & (t.sweep != 0.0)[np.minimum(w.owner, m - 1)])
    i = w.owner[rows]
    normal = t.normal[i]
    begin = np.where((rows > 0)[:, None], w.tip[np.maximum(rows - 1, 0)], t.start[i])
    u, v = begin - t.centre[i], w.tip[rows] - t.centre[i]
    low, high = np.einsum("ni,ni->n", u, normal), np.einsum("ni,ni->n", v, normal)
    step = np.arctan2(np.einsum("ni,ni->n", np.cross(u, v), normal), np.einsum("ni,ni->n", u, v) - low * high)
    size = np.einsum("ni,ni->n", turns[rows], normal)
    step = np.where(size != 0.0, step + 2.0 * np.pi * np.round((size - step) / (2.0 * np.pi)), step)
    turned = np.bincount(i, weights=step, minlength=m)
    radius = np.full(m, np.inf)
    radius[i] = np.sqrt(np.maximum((v * v).sum(axis=1) - high * high, 1e-6))
    some = np.bincount(i, minlength=m) > 0
    bad = np.flatnonzero(some & (np.abs(turned - t.sweep) > 4.0 * (w.tolerance[0] + 2e-3) / radius))
    if not len(bad):
        return []
    k = int(bad[0])
    block = int(rows[np.searchsorted(i, k)])
    return [Finding("arc", f"the tool turns by {np.degrees(turned[k]):.3f} degrees about the axis of the arc, the CL file "
                    f"says {np.degrees(t.sweep[k]):.3f}", int(lines[t.row[k]]), int(w.poses.executed.line[block]), len(bad))]
