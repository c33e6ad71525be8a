"""Centres of arcs by I, J, K or radius, and arcs of several turns, in the coordinates of their law."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING

import numpy as np

from postproc.control.word_arcs import PLANE_AXIS, PLANE_COLUMNS
from toolpaths.arrays import Array, Bools, Floats, Ints

if TYPE_CHECKING:
    from postproc.readback.execution.rows import MotionRows

_SMALL = 1e-9
_RADIUS_SLACK = 0.01
"""mm that a chord may be longer than the diameter, where the control says nothing"""


def centres(start: Floats, end: Floats, plane: Array, ccw: Bools, relative: Floats, absolute: Floats, radius: Floats,
            slack: float) -> tuple[Floats, dict[int, str]]:
    """(centres (K, 3), what is wrong with arc k) of arcs between start and end (K, 3).

    A centre is given from the start, in coordinates (K, 3), or by the radius (K,), whose sign says the arc of
    more than half a turn (-). `slack`: mm by which the radius may differ between the ends.
    """
    center = np.where(np.isfinite(absolute), absolute, start + np.nan_to_num(relative))
    bad: dict[int, str] = {}
    for code, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero((plane == code) & np.isfinite(radius))
        if len(k):
            first, last = start[k][:, (i, j)], end[k][:, (i, j)]
            center[k[:, None], [i, j]] = _by_radius(first, last, radius[k], ccw[k])
            chord = np.linalg.norm(last - first, axis=1)
            for n in np.flatnonzero((chord > 2.0 * np.abs(radius[k]) + min(slack, _RADIUS_SLACK)) | (chord < _SMALL)):
                bad[int(k[n])] = f"an arc of radius {radius[k][n]:g} cannot span {chord[n]:.4f} mm"
        k = np.flatnonzero((plane == code) & ~np.isfinite(radius))
        if len(k):
            middle = center[k][:, (i, j)]
            first, last = (np.linalg.norm(point[k][:, (i, j)] - middle, axis=1) for point in (start, end))
            off = np.abs(first - last)
            for n in np.flatnonzero(off > slack):
                bad[int(k[n])] = f"the radius differs by {off[n]:.4f} mm between the ends of the arc, allowed {slack:g} mm"
            for n in np.flatnonzero(np.minimum(first, last) < _SMALL):
                bad[int(k[n])] = "an arc that begins or ends at its own centre: centre or radius are missing, or 0"
    return center, bad


def _by_radius(first: Floats, last: Floats, radius: Floats, ccw: Bools) -> Floats:
    """Centres (K, 2): on the left of the path for anti-clockwise arcs of up to half a turn."""
    chord = last - first
    length = np.maximum(np.linalg.norm(chord, axis=1), _SMALL)
    height = np.sqrt(np.maximum(radius**2 - 0.25 * length**2, 0.0))
    left = np.stack([-chord[:, 1], chord[:, 0]], axis=1) / length[:, None]
    side = np.where(ccw == (radius > 0.0), 1.0, -1.0)
    result: Floats = 0.5 * (first + last) + (side * height)[:, None] * left
    return result


def whole_turns(rows: MotionRows, arcs: Ints, turns: Array, start: Floats, plane: Array, ccw: Bools,
                xyz: Ints) -> MotionRows:
    """Rows in which each arc of `turns` (K,) more turns has a row for each; what is square to the plane rises evenly."""
    extra = np.zeros(len(rows.block), dtype=np.int64)
    extra[arcs] = turns
    index = np.repeat(np.arange(len(extra)), extra + 1)
    spread = type(rows)(**{f.name: getattr(rows, f.name)[index] for f in fields(rows)})
    end = spread.end.copy()
    at = np.arange(len(extra)) + np.cumsum(extra) - extra
    for k in np.flatnonzero(turns > 0).tolist():
        row, count = int(at[arcs[k]]), int(turns[k])
        i, j = PLANE_COLUMNS[int(plane[k])]
        part = _last_turn(start[k][[i, j]], rows.end[arcs[k]][xyz[[i, j]]], rows.center[arcs[k]][[i, j]],
                          bool(ccw[k]))
        before = np.array(rows.end[arcs[k]])
        before[xyz] = start[k]
        share = 1.0 / (count + part)
        third = int(xyz[PLANE_AXIS[int(plane[k])]])
        for turn in range(count):
            end[row + turn] = before
            end[row + turn, third] += (turn + 1) * share * (rows.end[arcs[k], third] - before[third])
    return replace(spread, end=end)


def _last_turn(first: Floats, last: Floats, center: Floats, ccw: bool) -> float:
    """Share of a turn from first to last; equal ends are a whole one."""
    a, b = first - center, last - center
    angle = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b) / (2.0 * np.pi)
    share = (angle if ccw else -angle) % 1.0
    return float(share) if share > _SMALL else 1.0
