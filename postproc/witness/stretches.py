"""Positions of the CL file as targets of a program, and how far blocks are from the path between two of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.witness.commanded import ARC, HOLE, LINE, RAPID, START, Commanded
from postproc.witness.loops import walk
from postproc.witness.place import Poses
from postproc.witness.splines import length_of, off_chords
from postproc.witness.text import Array

ENTER, BOTTOM = 5, 6
"""kinds of targets: the start plane of a hole, its bottom"""


@dataclass(frozen=True)
class Targets:
    """M poses that a program has to come to, in order, in the table frame.

    Attributes:
        tip, axis (M, 3); kind (M,): RAPID, LINE, ARC, ENTER, BOTTOM; row (M,): of the CL file
        start (M, 3), start_axis: where the path there begins; free (M,): that is wherever the tool stands
        gap (M,): the path there is not known; skipped (M,): by positions that are not known
        centre, normal (M, 3), sweep (M,): of arcs, 0 for others
        splines: by target, points (P, 3) of the curve there
        out (M,): of bottoms, mm above them to which the tool leaves the hole; NaN where no number says so
    """

    tip: Array
    axis: Array
    kind: Array
    row: Array
    start: Array
    start_axis: Array
    free: Array
    gap: Array
    skipped: Array
    centre: Array
    normal: Array
    sweep: Array
    out: Array
    splines: dict[int, Array]

    def __len__(self) -> int:
        return len(self.row)


def targets_of(c: Commanded, tip: Array, axis: Array, centre: Array, normal: Array, splines: dict[int, Array]) -> Targets:
    """The targets of a CL file; `tip`, `axis`, `centre`, `normal`, `splines` are its own in the table frame."""
    depth = np.array([x.depth for x in c.cycles] + [0.0])[c.cycle]
    above = np.array([x.clearance for x in c.cycles] + [0.0])[c.cycle]
    hole = c.kind == HOLE
    plain = hole & ~(np.isfinite(depth) & np.isfinite(above))
    good = c.known & ~plain & (c.kind != START)
    count = np.where(good, np.where(hole, 2, 1), 0)
    row = np.repeat(np.arange(len(c)), count)
    second = np.zeros(len(row), bool)
    second[1:] = (row[1:] == row[:-1])
    on_hole = hole[row]
    kind = np.where(on_hole, np.where(second, BOTTOM, ENTER), c.kind[row]).astype(np.int8)
    lift = np.where(on_hole, np.where(second, -depth[row], above[row]), 0.0)
    before = np.maximum(row - 1, 0)
    if len(row) == len(c) and not on_hole.any():  # one behind the other: where each begins is where the last one ended
        (start, there), (start_axis, along) = (_and_before(v) for v in (tip, axis))
    else:
        there, along = tip[row] + lift[:, None] * axis[row], axis[row]
        start, start_axis = tip[before], axis[before]
    free = (row == 0) | ~c.known[before] | hole[before] | on_hole
    # A cut behind a hole begins where the tool has left it to, where the record says where that is.
    out = np.array([np.maximum(x.clearance, x.retract) for x in c.cycles] + [np.nan])[c.cycle]
    left = np.flatnonzero((row > 0) & is_cut(kind) & ~on_hole & good[before] & hole[before] & np.isfinite(out[before]))
    if len(left):
        start[left] += out[before[left], None] * start_axis[left]
    free[left] = False
    if on_hole.any():
        start[second], start_axis[second], free = there[np.flatnonzero(second) - 1], axis[row[second]], free & ~second
    lost = np.concatenate([[0], np.cumsum(~good & (c.kind != START))])
    skipped = np.zeros(len(row), bool)
    if len(row):
        skipped[1:] = lost[row[1:]] != lost[row[:-1] + 1]
        skipped[0] = lost[row[0]] > 0
    arc = c.arc[row]
    round_ = (kind == ARC) & (arc >= 0)
    mid, about, sweep = (np.broadcast_to(0.0, (len(row), *size)) for size in ((3,), (3,), ()))
    if round_.any():
        mid, about, sweep = mid.copy(), about.copy(), sweep.copy()
        mid[round_], about[round_], sweep[round_] = centre[arc[round_]], normal[arc[round_]], c.sweep[arc[round_]]
    skipped &= ~second
    gap = c.gap[row] | skipped
    return Targets(there, along, kind, row, start, start_axis, free, gap, skipped, mid, about, np.where(gap, 0.0, sweep),
                   np.where(second, depth[row] + out[row], np.nan),
                   {int(k): splines[int(row[k])] for k in np.flatnonzero(np.isin(row, list(splines)))} if splines else {})


def _and_before(values: Array) -> tuple[Array, Array]:
    """(rows before, rows) of values (N, 3), which are held once; before the first stands itself."""
    both = np.concatenate([values[:1], values])
    return both[:-1], both[1:]


def matched(targets: Targets, tip: Array, axis: Array, turns: Array, tolerance: float,
            axis_tolerance: float) -> tuple[Array, Array]:
    """(block (M,) that ends at each target, -1; target (E,) that each block serves, M behind the last)."""
    sides = [targets.centre, targets.normal]
    around = np.concatenate(sides, axis=1) if targets.sweep.any() else np.broadcast_to(np.zeros(6), (len(targets), 6))
    least = np.zeros(len(targets))
    half = np.array([0.5 * length_of(points) for points in targets.splines.values()])
    least[list(targets.splines)] = np.where(half > tolerance, half, 0.0)  # on a shorter one the tool may stand
    match = walk(tip, axis, turns, targets.tip, targets.axis, targets.sweep, around, targets.skipped, least,
                 (tolerance, axis_tolerance))
    reached = match[:int(np.argmax(match < 0))] if (match < 0).any() else match
    return match, np.searchsorted(reached, np.arange(len(tip)), side="left")


def turns_of(poses: Poses) -> Array:
    """(E, 3) rotation vectors of the blocks that are arcs, in the table frame; 0 for others."""
    e = poses.executed
    result = np.zeros((len(e), 3))
    rows = np.flatnonzero((e.code == 2) & np.isfinite(e.sweep))
    if not len(rows):
        return result
    part = np.minimum(0.25, 0.5 * np.pi / np.maximum(np.abs(e.sweep[rows]), 1e-12))
    points = []
    for share in (0.0, 1.0, 2.0):
        q = e.joints_at(rows, share * part)
        points.append(_pose_of(poses, rows, q, share * part))
    cross = np.cross(points[1] - points[0], points[2] - points[1])
    size = np.sqrt(np.einsum("ni,ni->n", cross, cross))
    result[rows] = cross * (np.abs(e.sweep[rows]) / np.where(size > 0.0, size, 1.0))[:, None]
    return result


def _pose_of(poses: Poses, rows: Array, q: Array, t: Array) -> Array:
    from postproc.witness.machine import Chain

    if isinstance(poses.machine, Chain):
        return poses.machine.pose(q, poses.executed.letters, poses.lengths(rows))[0]
    return poses.executed.poses_at(rows, t)[0]


def off(targets: Targets, i: Array, tip: Array, axis: Array, start: Array, start_axis: Array) -> tuple[Array, Array]:
    """(mm, rad) (K,) by which poses are off the path to the targets `i` (K,) from `start`: a line or an arc,
    and the great circle of the axes."""
    away = from_line(tip, start, targets.tip[i])
    round_ = np.flatnonzero(targets.sweep[i] != 0.0)
    if len(round_):
        k = i[round_]
        away[round_] = _from_arc(tip[round_], start[round_], targets.tip[k], targets.centre[k], targets.normal[k],
                                 targets.sweep[k])
    for target in np.unique(i).tolist() if targets.splines else ():
        if target in targets.splines:
            away[i == target] = off_chords(tip[i == target], targets.splines[target])
    return away, _from_circle(axis, start_axis, targets.axis[i])


def from_line(tip: Array, start: Array, end: Array) -> Array:
    """(K,) mm from lines between two points."""
    travel, offset = end - start, tip - start
    length = np.einsum("ni,ni->n", travel, travel)
    share = np.clip(np.einsum("ni,ni->n", offset, travel) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
    rest = offset - share[:, None] * travel
    return np.asarray(np.sqrt(np.einsum("ni,ni->n", rest, rest)))


def _from_arc(tip: Array, start: Array, end: Array, centre: Array, normal: Array, sweep: Array) -> Array:
    """(K,) mm from arcs and helices: off the radius and the rise that belong to the angle."""
    first, here = start - centre, tip - centre
    low, height = np.einsum("ni,ni->n", first, normal), np.einsum("ni,ni->n", here, normal)
    u, v = first - low[:, None] * normal, here - height[:, None] * normal
    last = end - centre
    w = last - np.einsum("ni,ni->n", last, normal)[:, None] * normal
    radius, final, size = (np.sqrt(np.einsum("ni,ni->n", x, x)) for x in (u, w, v))
    angle = np.arctan2(np.einsum("ni,ni->n", np.cross(u, v), normal), np.einsum("ni,ni->n", u, v)) % (2.0 * np.pi)
    rise = np.einsum("ni,ni->n", end - start, normal)
    best = np.full(len(tip), np.inf)
    for turn in range(-1, int(np.abs(sweep).max() // (2.0 * np.pi)) + 1):
        at = np.clip((angle + 2.0 * np.pi * turn) / sweep, 0.0, 1.0)
        miss = (angle + 2.0 * np.pi * turn - at * sweep) * size
        off_radius = size - (radius + at * (final - radius))
        best = np.minimum(best, np.sqrt(off_radius**2 + (height - low - at * rise) ** 2 + miss**2))
    return best


def _from_circle(axis: Array, first: Array, last: Array) -> Array:
    """(K,) rad from the great circle between two directions."""
    square = np.cross(first, last)
    size = np.sqrt(np.einsum("ni,ni->n", square, square))
    ends = np.minimum(_angle(axis, first), _angle(axis, last))
    if not (size > 1e-9).any():
        return ends
    pole = square / np.where(size > 1e-9, size, 1.0)[:, None]
    inside = (np.einsum("ni,ni->n", np.cross(pole, first), axis) >= 0.0) & (
        np.einsum("ni,ni->n", np.cross(last, pole), axis) >= 0.0)
    aside = np.abs(np.arcsin(np.clip(np.einsum("ni,ni->n", pole, axis), -1.0, 1.0)))
    return np.where((size > 1e-9) & inside, np.minimum(aside, ends), ends)


def _angle(a: Array, b: Array) -> Array:
    d = a - b
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.sqrt(np.einsum("ni,ni->n", d, d)), 1.0)))


def is_cut(kind: Array) -> Array:
    """(N,) True for targets that are come to at feed."""
    return np.asarray((kind == LINE) | (kind == ARC) | (kind == BOTTOM))


def is_rapid(kind: Array) -> Array:
    """(N,) True for targets that are come to in rapid."""
    return np.asarray((kind == RAPID) | (kind == ENTER))
