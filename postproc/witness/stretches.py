"""Positions of the CL file as targets of a program, and how far blocks are from the path between two of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from postproc.witness.commanded import ARC, HOLE, LINE, RAPID, START, Commanded, picked
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
    """The targets of a CL file; `tip`, `axis` (N + 1, 3), `centre`, `normal`, `splines` are its own in the table frame; the
    first tip and axis stands before itself."""
    (begin, tip), (begin_axis, axis) = (tip[:-1], tip[1:]), (axis[:-1], axis[1:])
    depth, above, out = (picked(np.array([*values, other]), c.cycle) for values, other in (
        ([x.depth for x in c.cycles], 0.0), ([x.clearance for x in c.cycles], 0.0),
        ([np.maximum(x.clearance, x.retract) for x in c.cycles], np.nan)))
    hole = c.kind == HOLE
    plain = hole & ~(np.isfinite(depth) & np.isfinite(above))
    good = c.known & ~plain & (c.kind != START)
    row = np.repeat(np.arange(len(c), dtype=np.int32), good * (1 + hole.astype(np.int8)))
    second = np.zeros(len(row), bool)
    second[1:] = (row[1:] == row[:-1])
    on_hole = hole[row]
    kind = np.where(on_hole, np.where(second, BOTTOM, ENTER), c.kind[row]).astype(np.int8)
    before = np.maximum(row - 1, 0)
    if len(row) == len(c) and not on_hole.any():  # one behind the other: where each begins is where the last one ended
        start, there, start_axis, along = begin, tip, begin_axis, axis
    else:
        lift = np.where(on_hole, np.where(second, -depth[row], above[row]), 0.0)
        there, along = tip[row] + lift[:, None] * axis[row], axis[row]
        start, start_axis = tip[before], axis[before]
    free = (row == 0) | ~c.known[before] | hole[before] | on_hole
    # A cut behind a hole begins where the tool has left it to, where the record says where that is.
    left = np.flatnonzero((row > 0) & is_cut(kind) & ~on_hole & good[before] & hole[before] & np.isfinite(out[before]))
    if len(left):
        start[left] += out[before[left], None] * start_axis[left]
    free[left] = False
    if on_hole.any():
        start[second], start_axis[second], free = there[np.flatnonzero(second) - 1], axis[row[second]], free & ~second
    del before
    lost = np.concatenate([np.zeros(1, np.int32), np.cumsum(~good & (c.kind != START), dtype=np.int32)])
    skipped = np.zeros(len(row), bool)
    if len(row):
        skipped[1:] = lost[row[1:]] != lost[row[:-1] + 1]
        skipped[0] = lost[row[0]] > 0
    round_ = (kind == ARC) & (c.arc[row] >= 0)
    mid, about, sweep = (np.broadcast_to(0.0, (len(row), *size)) for size in ((3,), (3,), ()))
    if round_.any():
        mid, about, sweep = mid.copy(), about.copy(), sweep.copy()
        arc = c.arc[row[round_]]
        mid[round_], about[round_], sweep[round_] = centre[arc], normal[arc], c.sweep[arc]
    skipped &= ~second
    gap = c.gap[row] | skipped
    if round_.any():
        sweep[gap] = 0.0
    left = np.where(second, depth[row] + out[row], np.nan) if second.any() else np.broadcast_to(np.nan, len(row))
    return Targets(there, along, kind, row, start, start_axis, free, gap, skipped, mid, about, sweep, left,
                   {int(k): splines[int(row[k])] for k in np.flatnonzero(np.isin(row, list(splines)))} if splines else {})


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
    return match, np.searchsorted(reached, np.arange(len(tip)), side="left").astype(np.int32)


def turns_of(poses: Poses) -> Array:
    """(E, 3) rotation vectors of the blocks that are arcs, in the table frame; 0 for others."""
    e = poses.executed
    rows = np.flatnonzero((e.code == 2) & np.isfinite(e.sweep))
    if not len(rows):
        return np.broadcast_to(0.0, (len(e), 3))
    result = np.zeros((len(e), 3))
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


def off(targets: Targets, i: Array, poses: Sequence[tuple[Array, Array]], start: Array,
        start_axis: Array) -> list[tuple[Array, Array]]:
    """(mm, rad) (K,) by which each of some poses (K, 3) is off the path to the targets `i` (K,) from `start`: a line or an
    arc, and the great circle of the axes."""
    tilts = _from_circle([axis for _, axis in poses], start_axis, targets.axis[i])
    return [(_away(targets, i, tip, start), tilt) for (tip, _), tilt in zip(poses, tilts, strict=True)]


def _away(targets: Targets, i: Array, tip: Array, start: Array) -> Array:
    away = from_line(tip, start, targets.tip[i])
    round_ = np.flatnonzero(targets.sweep[i] != 0.0)
    if len(round_):
        k = i[round_]
        away[round_] = _from_arc(tip[round_], start[round_], targets.tip[k], targets.centre[k], targets.normal[k],
                                 targets.sweep[k])
    for target in np.unique(i).tolist() if targets.splines else ():
        if target in targets.splines:
            away[i == target] = off_chords(tip[i == target], targets.splines[target])
    return away


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


def _from_circle(axes: Sequence[Array], first: Array, last: Array) -> list[Array]:
    """(K,) rad of each of some directions (K, 3) from the great circle between two."""
    square = np.cross(first, last)
    size = np.sqrt(np.einsum("ni,ni->n", square, square))
    found = [np.minimum(_angle(axis, first), _angle(axis, last)) for axis in axes]
    if not (size > 1e-9).any():
        return found
    pole = square / np.where(size > 1e-9, size, 1.0)[:, None]
    behind, before = np.cross(pole, first), np.cross(last, pole)
    for axis, ends in zip(axes, found, strict=True):
        inside = (np.einsum("ni,ni->n", behind, axis) >= 0.0) & (np.einsum("ni,ni->n", before, axis) >= 0.0)
        aside = np.abs(np.arcsin(np.clip(np.einsum("ni,ni->n", pole, axis), -1.0, 1.0)))
        np.copyto(ends, np.minimum(aside, ends), where=(size > 1e-9) & inside)
    return found


def _angle(a: Array, b: Array) -> Array:
    d = a - b
    return np.asarray(2.0 * np.arcsin(np.minimum(0.5 * np.sqrt(np.einsum("ni,ni->n", d, d)), 1.0)))


def is_cut(kind: Array) -> Array:
    """(N,) True for targets that are come to at feed."""
    return np.asarray((kind == LINE) | (kind == ARC) | (kind == BOTTOM))


def is_rapid(kind: Array) -> Array:
    """(N,) True for targets that are come to in rapid."""
    return np.asarray((kind == RAPID) | (kind == ENTER))
