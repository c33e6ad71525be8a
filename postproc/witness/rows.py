"""From the state of a reading to all positions at once: axes that hold on, systems, increments, arcs."""

from __future__ import annotations

import numpy as np

import postproc.witness.arcs as arcs
from postproc.witness.commanded import ARC, HOLE, LINE, RAPID, START, Commanded, unit
from postproc.witness.execution import Execution, Z
from postproc.witness.splines import points_of
from postproc.witness.text import Array

_CHUNK = 20_000

def assembled(e: Execution) -> Commanded:
    """All positions of a file that is read."""
    n, points = e.row, e.text.points
    extra = np.array([row for row, *_ in e.extra], np.int64)
    numbers, line = points, e.text.line
    if len(extra):
        plain = np.ones(n, bool)
        plain[extra] = False
        numbers, line = np.empty((n, 6)), np.empty(n, np.int64)
        numbers[plain], line[plain] = points, e.text.line
        numbers[extra] = [(*xyz, *axis) for _, xyz, axis, _ in e.extra]
        line[extra] = [number for *_, number in e.extra]
    tip, given = numbers[:, :3] * e.scale, ~np.isnan(numbers[:, 3])
    common = given & (e.inside.column(n, np.int64) == 0) if e.dialect.local_three else np.zeros(n, bool)
    axis = unit(_axes(e, numbers[:, 3:], given))
    place = e.frame.column(n, np.int64)
    matrices, origins = arcs.stacked(e.frames)
    turned = (matrices != np.eye(3)).any(axis=(1, 2)) | origins.any(axis=1)
    rows = np.flatnonzero(turned[place] & ~common)
    for first in range(0, len(rows), _CHUNK):
        at = rows[first:first + _CHUNK]
        matrix = matrices[place[at]]
        tip[at] = np.einsum("nij,nj->ni", matrix, tip[at]) + origins[place[at]]
        axis[at] = np.einsum("nij,nj->ni", matrix, axis[at])
    for row, step in e.deltas:
        matrix = np.eye(3) if common[row] else e.frames[place[row]][0]
        move = step[0] * axis[row] if len(step) == 1 else matrix @ np.array(step)
        tip[row] = tip[row - 1] + e.scale * move if row else np.nan
    kind, cycle = np.full(n, LINE, np.int8), e.cycle.column(n, np.int32).copy()
    arc, centre, normal, sweep, uncertain = arcs.resolved(e.arcs, tip, place, common, e.frames, e.scale, e.dialect)
    kind[list(e.arcs.keys() & set(range(n)))] = ARC
    cycle[arc >= 0] = -1
    start = np.array(sorted(e.start), np.int64)
    cycle[start[start < n]] = -1
    kind[cycle >= 0] = HOLE
    rapid = np.array(sorted(e.rapid), np.int64)
    rapid = rapid[rapid < n]
    kind[rapid[kind[rapid] != HOLE]] = RAPID
    kind[start[start < n]] = START
    surface = np.full((n, 3), np.nan) if e.surface else np.broadcast_to(np.nan, (n, 3))
    for row, given_ in e.surface.items():
        surface[row] = np.array(given_) if common[row] else e.frames[place[row]][0] @ np.array(given_)
    feed, spindle, end = (np.array(one.values, np.float64) for one in (e.feed, e.spindle, e.end))
    known = e.known.column(n, bool) & np.isfinite(tip).all(axis=1) & np.isfinite(axis).all(axis=1)
    gap = np.zeros(n, bool)
    gap[[row for row in e.gap if row < n] + uncertain] = True
    return Commanded(tip, axis, kind, line, known, gap, e.feed.spread(feed[:, 0], n), e.feed.spread(feed[:, 1] > 0, n),
                     e.feed.spread(feed[:, 2] > 0, n), arc, centre, normal,
                     sweep, cycle, tuple(e.cycles), e.tool.column(n, np.int64), e.side.column(n, np.int64),
                     e.register.column(n, np.int64), e.register.spread(np.array(e.register.rows, np.int32), n),
                     e.name.column(n, np.int32), tuple(e.names),
                     e.spindle.spread(spindle[:, 0].astype(np.int64), n), e.spindle.spread(spindle[:, 1], n),
                     e.spindle.spread(np.array(e.spindle.rows, np.int32), n), e.coolant.column(n, np.int64),
                     e.coolant.spread(np.array(e.coolant.rows, np.int32), n), e.systems, _first_system(e, place),
                     e.radius.column(n, np.float64), e.end.spread(end[:, 0], n), e.end.spread(end[:, 1], n),
                     e.cutter.column(n, np.float64), surface, tuple(e.rests), tuple(e.stops),
                     _splines(e, tip, place, common), e.unread)


def _splines(e: Execution, tip: Array, place: Array, common: Array) -> dict[int, Array]:
    """Points of every spline by its row, from the position before."""
    result = {}
    for row, (knots, control) in e.splines.items():
        matrix, origin = e.frames[0 if common[row] else place[row]]
        result[row] = points_of(np.vstack([tip[row - 1], e.scale * control @ matrix.T + origin]), knots)
    return result


def _first_system(e: Execution, place: Array) -> str | None:
    """The system that the first position is in; frames that are turned with a table have no name."""
    if e.shifted or len(e.frames) != len(e.systems) + 1:
        return None
    return list(e.systems)[int(place[0]) - 1] if len(place) and place[0] else ""


def _axes(e: Execution, written: Array, given: Array) -> Array:
    """The tool axis of every row: its own, else the last that was written or set."""
    n = len(written)
    if given.all():
        return written
    source, values = np.where(given, np.arange(n), -1), written
    marks = {row: axis for row, axis in e.axes.items() if row < n and not given[row]}
    if e.dialect.local_three:
        for row in (np.flatnonzero(~given[1:] & given[:-1]) + 1).tolist():
            marks.setdefault(row, Z)
    if marks:
        rows = np.array(list(marks), np.int64)
        values = written.copy()
        values[rows], source[rows] = list(marks.values()), rows
    source = np.maximum.accumulate(source)
    return np.where((source < 0)[:, None], Z, values[source])
