"""From the state of `ToolpathBuilder` to a `Toolpath`: everything that is done to all rows at once."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from toolpaths.arrays import Array, Bools, Floats, Ints, distinct
from toolpaths.cl import indexing
from toolpaths.cl.arcs import UNIT_ROUNDING, CircleRecords, arcs_of, unit
from toolpaths.cl.build import ModalValue, ToolpathBuilder
from toolpaths.cl.heights import height_of, place
from toolpaths.cl.tools import AXIS_AGREES, is_of_milling
from toolpaths.cl.unnumbered import loaded, named
from toolpaths.diagnostics import Severity
from toolpaths.given_arrays import passes
from toolpaths.toolpath import Arcs, Cycle, FeedMode, Frame, Kind, Operation, Role, Tool, Toolpath

NORMAL_ROUNDING = 1e-3
T = TypeVar("T")


@dataclass
class PointRows:
    """The N rows while they are worked on, mm; `given` (N,): the record carries an axis of its own, `index`
    (N,): which map of the builder it takes."""

    tip: Floats
    axis: Floats
    third: Floats | None
    line: Ints
    given: Bools
    common: Bools | None = None
    index: Ints = field(default_factory=lambda: np.zeros(0, np.int64))

    def __len__(self) -> int:
        return len(self.line)


def assemble(b: ToolpathBuilder) -> Toolpath:
    """The toolpath; consumes the builder's arrays."""
    rows = _rows(b)
    n = len(rows)
    rows.index = spread(b.map, n, np.int64)
    _place_frames(b, rows)
    _fill_axis(b, rows)
    if b.scale != 1.0:
        rows.tip *= b.scale
    normal, contact = _normals(b, rows)
    rows.axis = _checked_axis(b, rows)
    height = height_of(rows.tip, rows.axis) if b.heights else None
    _to_part_frame(b, rows, normal, contact)
    _check_world_axes(b, rows)
    _add_deltas(b, rows)
    role, kind, arc = _kinds(b, n)
    arcs = _arcs(b, rows, kind, arc)
    cycle = spread(b.cycle, n, np.int32)
    cycle[(role != Role.POINT) | (arc >= 0)] = -1
    if height is not None:
        cycle = place(b, rows.tip, rows.axis, height, cycle, rows.line)
    role[cycle >= 0] = Role.HOLE
    kind[cycle >= 0] = Kind.RAPID
    cycle, cycles = _used_cycles(b, cycle)
    feed, mode = _feeds(b, rows, kind)
    cycles = _fed_cycles(b, cycle, cycles)
    operation, operations, frames = _operations(b, rows)
    tool, tools = _tools(b, n)
    events = b.events if b.declared else loaded(b.events, tools, tool, rows.line)
    pass_ = passes((kind == Kind.RAPID) & (role != Role.HOLE), operation, tool)
    return Toolpath(rows.tip, rows.axis, feed, mode, kind, role, arc, cycle, tool, operation, pass_, rows.line, arcs,
                    cycles, tools, operations, frames, tuple(events), normal, contact,
                    b.declared.units if b.declared else b.units, b.name, b.log.file,
                    spline_slack=max(b.spline_slack if b.splines else 0.0, b.declared.spline_slack if b.declared else 0.0))


def spread(track: ModalValue[T], n: int, dtype: type) -> Array:
    """The value of each of n rows."""
    starts = np.minimum(np.array([*track.starts, n]), n)
    return np.repeat(np.array(track.values, dtype), np.diff(starts))


def _rows(b: ToolpathBuilder) -> PointRows:
    """Plain points and the others in the order of the program."""
    points, extras = b.points, b.extras
    axis, third = points.axis, points.third
    if b.pieces == [(0, len(points))] or (not b.pieces and not len(points)):
        given = np.zeros(len(points), bool) if axis is None else ~np.isnan(axis[:, 0])
        own = axis.copy() if axis is not None else np.full((len(points), 3), np.nan)
        return PointRows(points.xyz.copy(), own, third, points.line, given)
    source = _source(b)
    tip = _merged(points.xyz, extras.xyz, len(points))[source]
    axis = _merged(axis, extras.axis, len(points))[source]
    has_third = third is not None or any(t[0] == t[0] for t in extras.third)
    third = _merged(third, extras.third, len(points))[source] if has_third else None
    line = np.concatenate([points.line, np.array(extras.line, np.int64)])[source]
    return PointRows(tip, axis, third, line, ~np.isnan(axis[:, 0]))


def _merged(plain: Floats | None, extra: list[tuple[float, float, float]], n: int) -> Floats:
    first = np.full((n, 3), np.nan) if plain is None else plain
    return np.concatenate([first, np.array(extra, np.float64).reshape(-1, 3)])


def _source(b: ToolpathBuilder) -> Ints:
    """Index into plain points followed by extras, per row."""
    pieces = np.array(b.pieces, np.int64).reshape(-1, 2)
    single = pieces[:, 0] < 0
    low = np.where(single, len(b.points) - 1 - pieces[:, 0], pieces[:, 0])
    length = np.where(single, 1, pieces[:, 1] - pieces[:, 0])
    first = np.cumsum(length) - length
    source: Ints = np.repeat(low - first, length) + np.arange(int(length.sum()))
    return source


def _fill_axis(b: ToolpathBuilder, rows: PointRows) -> None:
    """Modal axis: the last one given or set, (0, 0, 1) before any."""
    n = len(rows)
    if rows.given.all():
        return
    marks = dict(b.axis_marks)
    at = np.array([r for r in marks if r < n and not rows.given[r]], np.int64)
    source = np.where(rows.given, np.arange(n), -1)
    if b.dialect.six_common:
        plain = np.flatnonzero(~rows.given[1:] & rows.given[:-1] & ~np.isnan(rows.tip[1:, 0])) + 1
        source[plain] = plain
        rows.axis[plain] = (0.0, 0.0, 1.0)
    source[at] = at
    if len(at):
        rows.axis[at] = [marks[int(r)] for r in at]
    source = np.maximum.accumulate(source) if n else source
    rows.axis = np.where((source < 0)[:, None], [0.0, 0.0, 1.0], rows.axis[source])
    _check_multax_off(b, rows, marks)


def _check_multax_off(b: ToolpathBuilder, rows: PointRows,
                      marks: dict[int, tuple[float, float, float]]) -> None:
    """Systems differ in what points of three numbers after MULTAX/OFF mean; CATIA documents the locked axis."""
    for row, line in b.multax_off:
        if row < len(rows) and not rows.given[row] and row not in marks and abs(rows.axis[row, 2] - 1.0) > UNIT_ROUNDING:
            i, j, k = rows.axis[row].tolist()
            b.log.warning("cl.multax-off", f"points of three numbers after MULTAX/OFF keep the tool axis ({i:.6g}, {j:.6g}, "
                          f"{k:.6g}) of the point before", line, "state TLAXIS/0,0,1 where it is to be z")


def _check_world_axes(b: ToolpathBuilder, rows: PointRows) -> None:
    """`.clt`: the tool axis of the first point after TLAXIS and ROTABL must be what TLAXIS says."""
    ends = [*(row for row, _, _ in b.world_axes[1:]), len(rows)]
    for (row, stated, line), end in zip(b.world_axes, ends, strict=False):
        if row < end and not np.abs(rows.axis[row] - unit(np.array([stated]))[0]).max() <= AXIS_AGREES:
            i, j, k = rows.axis[row].tolist()
            b.log.error("cl.tlaxis", f"TLAXIS states the tool axis ({stated[0]:.6g}, {stated[1]:.6g}, {stated[2]:.6g}), by "
                        f"ROTABL it is ({i:.6g}, {j:.6g}, {k:.6g}): it cannot be known where the points are", line,
                        "write the file again in the CAM system")
    stated_at = {row for row, _, _ in b.world_axes}
    unstated = [line for row, line in b.turned_lines.items() if row < len(rows) and row not in stated_at]
    b.log.many(Severity.ERROR, "cl.tlaxis", "ROTABL turns the frame of the points behind it, and no TLAXIS stands between "
               "them and the points before: from where it turns cannot be known", np.array(unstated, np.int64),
               "write TLAXIS/i,j,k before these ROTABL, or the file again in the CAM system")


def _checked_axis(b: ToolpathBuilder, rows: PointRows) -> Floats:
    norm = np.linalg.norm(rows.axis, axis=1)
    bad = ~(np.abs(norm - 1.0) <= UNIT_ROUNDING)
    if bad.any():
        b.log.many(Severity.ERROR, "cl.axis", f"the tool axis has length {norm[bad][0]:.6g}, it must be 1 within "
                   f"{UNIT_ROUNDING}", rows.line[bad],
                   "write x, y, z, then i, j, k of length 1, and points for decimal commas: 10.25 for 10,25"
                   if _whole(rows, bad) else
                   "write the six numbers of GOTO again: x, y, z, then i, j, k of length 1")
    return unit(rows.axis)


def _whole(rows: PointRows, bad: Bools) -> bool:
    """True where all six numbers of such points are whole: a decimal comma may have split three."""
    six = np.hstack([rows.tip[bad], rows.axis[bad]])
    return bool((six == np.round(six)).all())


def _normals(b: ToolpathBuilder, rows: PointRows) -> tuple[Floats | None, Floats | None]:
    """Numbers 7 to 9 as (unit normal, contact point), NaN where a row has none."""
    if rows.third is None:
        return None, None
    norm = np.linalg.norm(rows.third, axis=1)
    is_normal = np.abs(norm - 1.0) <= NORMAL_ROUNDING
    is_normal[b.contacts] = False
    is_contact = ~np.isnan(norm) & ~is_normal
    normal = unit(np.where(is_normal[:, None], rows.third, np.nan)) if is_normal.any() else None
    if not is_contact.any():
        return normal, None
    unstated = np.setdiff1d(np.flatnonzero(is_contact), b.contacts)
    b.log.many(Severity.WARNING, "cl.contact", "numbers 7 to 9 of GOTO are not a unit vector; read as the contact point",
               rows.line[unstated])
    return normal, np.where(is_contact[:, None], rows.third * b.scale, np.nan)


def _place_frames(b: ToolpathBuilder, rows: PointRows) -> None:
    """Which map each row takes, and which rows of six numbers are in the common frame."""
    if not b.dialect.six_common:
        return
    n, inside = len(rows), spread(b.in_subprogram, len(rows), np.bool_)
    rapid = np.zeros(n, dtype=np.bool_)
    at = np.array(b.rapids, np.int64)
    rapid[at[at < n]] = True
    rows.index, approach = indexing.approaches(b, rows.tip, rapid, rows.index)
    local = indexing.local_rows(b, rows.given, inside, approach, rows.axis, rows.index)
    rows.common = rows.given & ~local
    indexing.check_frames(b, rows.index, ~rows.common, rows.line)
    indexing.check_axes(b, inside, rows.given, rows.axis, rows.index, rows.line)
    indexing.check_cuts(b, ~rapid, rows.index, rows.line)


def _to_part_frame(b: ToolpathBuilder, rows: PointRows, normal: Floats | None,
                   contact: Floats | None) -> None:
    for start, end in _runs(rows.index):
        found = b.maps[rows.index[start]]
        if found is None:
            continue
        rotation, origin = np.asfortranarray(found[0]), found[1]
        where = slice(start, end)
        local = where if rows.common is None else np.flatnonzero(~rows.common[where]) + start
        rows.tip[local] = rows.tip[local] @ rotation.T + origin
        rows.axis[local] = unit(rows.axis[local] @ rotation.T)
        if normal is not None:
            normal[local] = unit(normal[local] @ rotation.T)
        if contact is not None:
            contact[local] = contact[local] @ rotation.T + origin


def _runs(index: Ints) -> list[tuple[int, int]]:
    """(start, end) of the runs of equal values."""
    if not len(index):
        return []
    cut = (np.flatnonzero(np.diff(index)) + 1).tolist()
    return list(zip([0, *cut], [*cut, len(index)], strict=True))


def _add_deltas(b: ToolpathBuilder, rows: PointRows) -> None:
    """GODLTA: each from the row before it, in order."""
    if not b.deltas:
        return
    index = rows.index
    for row, step in b.deltas:
        if step[1] != step[1]:
            move = step[0] * b.scale * rows.axis[row]
        else:
            found = b.maps[index[row]]
            move = np.array(step) * b.scale
            if found is not None and (rows.common is None or not rows.common[row]):
                move = found[0] @ move
        rows.tip[row] = rows.tip[row - 1] + move


def _kinds(b: ToolpathBuilder, n: int) -> tuple[Array, Array, Array]:
    """(role, kind, arc index) by what the records say; cycles come later."""
    role = np.full(n, Role.POINT, np.int8)
    rows = np.array(list(b.roles), np.int64)
    if (rows >= n).any():
        b.log.error("cl.data-comment", "$$-> SPLINE or CUBIC counts more points than follow",
                    hint="write the file again: its end is missing, or correct the count")
    inside = rows < n
    role[rows[inside]] = np.array(list(b.roles.values()), np.int8)[inside]
    kind = np.full(n, Kind.FEED, np.int8)
    kind[role == Role.START] = Kind.RAPID
    rapids = np.array(b.rapids, np.int64)
    kind[rapids[rapids < n]] = Kind.RAPID
    arc = np.full(n, -1, np.int32)
    return role, kind, arc


def _arcs(b: ToolpathBuilder, rows: PointRows, kind: Array, arc: Array) -> Arcs:
    """Arcs of the circle records; marks their rows."""
    t = b.arcs
    keep = [k for k, row in enumerate(t.row) if _has_start(b, rows, kind, k, row)]
    if not keep:
        return Arcs.none()
    row = np.array(t.row, np.int64)[keep]
    numbers = np.array(t.numbers, np.float64).reshape(-1, 6)[keep]
    center, normal = numbers[:, :3] * b.scale, numbers[:, 3:] * np.array(t.sense, np.float64)[keep, None] + 0.0
    toward = np.array([t.toward.get(k, (np.nan,) * 3) for k in keep])
    _map_arcs(b, rows, row, center, normal, toward)
    against = np.einsum("ki,ki->k", np.cross(normal, rows.tip[row - 1] - center), toward) < 0.0
    normal[against] *= -1.0
    arc[row] = np.arange(len(row))
    kind[row] = Kind.ARC
    records = CircleRecords(rows.tip[row - 1], rows.tip[row], center, normal, np.array(t.radius)[keep] * b.scale,
                            np.array(t.times)[keep], np.array(t.sweep)[keep], np.array(t.line, np.int64)[keep])
    return arcs_of(records, b.dialect.full_circles, b.log)


def _has_start(b: ToolpathBuilder, rows: PointRows, kind: Array, k: int, row: int) -> bool:
    if row >= len(rows):
        return False
    if row == 0:
        b.log.error("cl.arc-start", "an arc needs a point before it", b.arcs.line[k],
                    "put a GOTO before the arc")
        return False
    if kind[row] == Kind.RAPID:
        b.log.error("cl.arc-rapid", "RAPID does not go with an arc", b.arcs.line[k],
                    "put RAPID before a GOTO")
        return False
    return b.arcs.row[k + 1:k + 2] != [row]


def _map_arcs(b: ToolpathBuilder, rows: PointRows, row: Ints, center: Floats, normal: Floats,
              toward: Floats) -> None:
    index = rows.index[row]
    if rows.common is not None:
        index = np.where(rows.common[row], 0, index)
    for i in distinct(index):
        found = b.maps[i]
        if found is not None:
            where = index == i
            center[where] = center[where] @ found[0].T + found[1]
            normal[where] = normal[where] @ found[0].T
            toward[where] = toward[where] @ found[0].T


def _used_cycles(b: ToolpathBuilder, cycle: Array) -> tuple[Array, tuple[Cycle, ...]]:
    """(index per row, cycles) without the cycles that drill no hole."""
    used = distinct(cycle[cycle >= 0])
    for i in sorted(set(range(len(b.cycles))) - set(used.tolist())):
        b.log.info("cl.cycle-empty", "no hole follows the CYCLE record", b.cycles[i].line)
    index = np.full(len(b.cycles) + 1, -1, np.int32)
    index[used] = np.arange(len(used))
    return index[cycle], tuple(b.cycles[i] for i in used)


def _fed_cycles(b: ToolpathBuilder, cycle: Array, cycles: tuple[Cycle, ...]) -> tuple[Cycle, ...]:
    """The cycles; those that state no feed, where none held yet, have that which holds at their first hole."""
    result = list(cycles)
    for k in [k for k, c in enumerate(cycles) if np.isnan(c.feed)]:
        row = int(np.flatnonzero(cycle == k)[0])
        feed, mode = b.feed.values[int(np.searchsorted(b.feed.starts, row, side="right")) - 1]
        result[k] = replace(cycles[k], feed=feed, feed_mode=mode)
    return tuple(result)


def _feeds(b: ToolpathBuilder, rows: PointRows, kind: Array) -> tuple[Floats, Array]:
    """Modal feed per row; NaN on rapids. A cutting move must have one, and it must be positive."""
    n = len(rows)
    starts = np.minimum(np.array([*b.feed.starts, n]), n)
    feed = np.repeat(np.array([v for v, _ in b.feed.values]), np.diff(starts))
    mode = np.repeat(np.array([m for _, m in b.feed.values], np.int8), np.diff(starts))
    rapid = kind == Kind.RAPID
    feed[rapid] = np.nan
    mode[rapid | np.isnan(feed)] = FeedMode.PER_TIME
    b.log.many(Severity.WARNING, "cl.no-feed", "cutting motion before any FEDRAT",
               rows.line[~rapid & np.isnan(feed)])
    b.log.many(Severity.ERROR, "cl.feed", "cutting motion at a feed of 0 or less",
               rows.line[~rapid & (feed <= 0.0)], "state a feed above 0 in the FEDRAT before, or RAPID where it cuts none")
    return feed, mode


def _turning(b: ToolpathBuilder, rows: PointRows, column: Ints) -> set[int]:
    """Operations that are turning: by a word for it, or by a surface speed where no tool axis leans and all points lie in
    one plane, as those of a lathe do: that of its spindle and the tip."""
    n = len(rows)
    marked = {int(column[row]) if row < n else op for op, row in b.surface_speed}
    mills = {op for op in marked if is_of_milling(rows.axis[column == op], rows.tip[column == op])}

    return {int(column[row]) if row < n else op for op, row in b.turning} | (marked - mills)


def _operations(b: ToolpathBuilder, rows: PointRows) -> tuple[Array, tuple[Operation, ...], tuple[Frame, ...]]:
    """(operation per row, operations with their frames, frames)."""
    n = len(rows)
    column = spread(b.operation, n, np.int32)
    if b.declared is not None and b.declared.operations:
        return np.maximum(column, 0), tuple(b.declared.operations), tuple(b.declared.frames) or (Frame("absolute"),)
    turning = _turning(b, rows, column)
    operations = [replace(op, turning=i in turning) for i, op in enumerate(b.operations)]
    if not operations or (n and column[0] < 0):
        operations.insert(0, Operation(turning=-1 in turning))
        column = column + 1
    used, first = np.unique(column, return_index=True)
    system = spread(b.system, n, np.int32)
    frame_of = dict(zip(used.tolist(), system[first].tolist() if n else [], strict=True))
    frames = list(b.frames)
    if not frames:
        return column, tuple(operations), (Frame("absolute"),)
    if -1 in frame_of.values():
        front = n > 0 and system[0] < 0
        frames.insert(0 if front else len(frames), Frame("absolute"))
        shift = 1 if front else 0
        frame_of = {k: (0 if front else len(frames) - 1) if v < 0 else v + shift for k, v in frame_of.items()}
    return column, tuple(replace(op, frame=frame_of.get(i, 0)) for i, op in enumerate(operations)), tuple(frames)


def _tools(b: ToolpathBuilder, n: int) -> tuple[Array, tuple[Tool, ...]]:
    if b.declared is not None:
        return spread(b.declared.tool, n, np.int32), tuple(b.declared.tools)
    order: dict[Tool, int] = {}
    index: ModalValue[int] = ModalValue(-1)
    for start, tool in zip(b.tool.starts, b.tool.values, strict=True):
        index.set(start, -1 if tool is None else order.setdefault(tool, len(order)))
    return spread(index, n, np.int32), named(tuple(order))
