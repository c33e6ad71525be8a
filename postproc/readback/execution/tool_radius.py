"""Radius compensation as the control executes it: the programmed contour shifted by what the register holds.

Start and end: straight to where the radius is square to the beginning of the next move, and from where it is square to the
end of the last (F2 cutter compensation, inner side; S1 NORM; T1 tool radius compensation; H1). Inside corners end where the
shifted moves meet. Outside corners: an arc round them (S1 G450, T1), or where shifted lines meet, up to a right angle (F2).
What the manuals say otherwise, or not at all, is not executed.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from postproc.controllers.model import OutsideCorners
from postproc.readback.execution.rows import MotionRows
from toolpaths.arrays import Bools, Floats, Ints

_STILL = 1e-7
"""mm"""
_ALIKE = 1e-4
"""mm by which a corner that is cut and one that is rounded differ where it makes no difference"""
_SIDEWAYS = 2e-3
"""mm"""

NotExecutedRows = dict[int, str]
"""what is not executed, by row"""


def with_radius(rows: MotionRows, start: Floats, radius: Floats, held: Bools, xyz: Ints,
                rule: OutsideCorners) -> tuple[MotionRows, NotExecutedRows]:
    """Rows of the tool's centre, ends in coordinates, of rows of the contour that begin at `start` (J,).

    radius (R,): mm to the left of the move, negative to the right, 0 where the words are the tool's centre; held (R,): rows
    that the control does not see while it runs the row before, so that it cannot reckon where that ends (Fanuc B-63944EN-2
    6.6.3: M00, M01 and what is not buffered, blocks without a move); `rule`: how outside corners are gone round.
    """
    faults, added = NotExecutedRows(), list[tuple[int, Floats]]()
    edges = np.flatnonzero(np.diff(np.concatenate([[0.0], radius, [0.0]])))
    end, contour = np.array(rows.end), np.array(rows.contour)
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        if not radius[a]:
            continue
        before = rows.end[a - 1] if a else start
        try:
            if b == len(radius) or radius[b]:
                raise _NotExecuted("the radius stays on to the end, or changes sides", b - 1)
            _check(held[a + 1:b], a + 1, "before it something stands that is no move")
            lead, at, vectors, corners = _stretch(rows, before, a, b, float(radius[a]), xyz[:2], rule)
            end[np.ix_(np.arange(lead, b), xyz[:2])], contour[lead:b + 1] = at, vectors
            added += [(lead + k, corner) for k, corner in corners]
        except _NotExecuted as fault:
            faults[min(fault.row, len(radius) - 1)] = str(fault)
    made = replace(rows, end=end, contour=contour)
    return (_with_corners(made, added, radius, xyz[:2]) if added else made), faults


class _NotExecuted(ValueError):
    def __init__(self, said: str, row: int) -> None:
        super().__init__(said)
        self.row = row


def _check(bad: Bools, first: int, said: str) -> None:
    if bad.any():
        raise _NotExecuted(said, first + int(np.argmax(bad)))


def _stretch(rows: MotionRows, before: Floats, a: int, b: int, shift: float, xy: Ints,
             rule: OutsideCorners) -> tuple[int, Floats, Floats, list[tuple[int, Floats]]]:
    """(first row that moves, X, Y (N, 2) where it and those before b end, `contour` (N + 1, 4), corners (2,) that an arc
    goes round, by the row before it, counted from the first) of rows a to before b, where b leads away."""
    points = np.concatenate([before[None, :], rows.end[a:b + 1]])[:, xy]
    arc, moves = rows.code[a:b + 1] == 2, np.linalg.norm(np.diff(points, axis=0), axis=1) > _STILL
    lead = int(np.argmax(moves | arc))
    a, points, arc, moves = a + lead, points[lead:], arc[lead:], moves[lead:]
    count = b - a
    if count < 2 or arc[0] or arc[-1]:
        raise _NotExecuted("a straight move in the plane leads neither to a contour nor away from one", a)
    _check(~(moves | arc) | (rows.code[a:b + 1] == 0) & (np.arange(count + 1) < count) | rows.hole[a:b + 1]
           | (rows.frame[a:b + 1] != rows.frame[a]), a, "a block that does not cut in the plane while the radius is on")
    center, sense = rows.center[a:b + 1][:, :2], np.where(rows.ccw[a:b + 1], 1.0, -1.0)
    into, out = (_ahead(points, center, arc, sense, at) for at in (0, 1))
    here, there = shift * _left(out[:-1]), shift * _left(into[1:])
    cos, sin = (out[:-1] * into[1:]).sum(axis=1), np.sign(shift) * _cross(out[:-1], into[1:])
    at = points[1:-1] + (here + there) / np.maximum(1.0 + cos, 1e-12)[:, None]
    at[0], at[-1] = points[1] + there[0], points[-2] + here[-1]
    off = np.array([(points[0] - points[1]) @ there[0], (points[-1] - points[-2]) @ here[-1]]) / abs(shift)
    _check(off < -_SIDEWAYS, a, "the move that leads to the contour, or away, is not on the side of the tool")
    size = np.linalg.norm(points[:-1] - center, axis=1) - sense * shift
    _check(arc & ~(size > 0.0), a, "an inside arc is smaller than the tool")
    bent = (abs(shift) * sin**2 > 8.0 * _ALIKE) | (cos <= 0.0)
    bent[[0, -1]] = False
    line = ~arc[:-1] & ~arc[1:]
    outer = bent & (sin < 0.0)
    if rule == "intersection":
        _check(outer & ~(line & (cos >= -1e-6)), a, "an outside corner of more than a right angle, or of an arc")
    elif rule != "arc":
        _check(outer, a, "an outside corner, which the control's file says nothing of")
    corners = np.flatnonzero(outer) if rule == "arc" else np.zeros(0, dtype=np.int64)
    at[corners] = points[1:-1][corners] + here[corners]
    for k in np.flatnonzero(bent & ~outer & ~line).tolist():
        at[k] = _meeting(points, center, arc, size, shift, k, at[k], a)
    begin = np.concatenate([points[:1], at])
    begin[corners + 1] = points[1:-1][corners] + there[corners]
    end = np.concatenate([at, points[-1:]])
    ran = ((end - begin) * np.diff(points, axis=0)).sum(axis=1)
    _check(~arc & ~(ran > 0.0), a, "an inside corner into which the tool does not fit")
    vectors = np.concatenate([points[:-1] - begin, points[1:] - end], axis=1)
    return a, at, vectors, [(int(k), points[k + 1]) for k in corners]


def _ahead(points: Floats, center: Floats, arc: Bools, sense: Floats, at: int) -> Floats:
    """(N, 2) direction of each move at its begin (0) or end (1)."""
    spoke = points[at:len(points) - 1 + at] - center
    ahead = np.where(arc[:, None], sense[:, None] * _left(spoke), np.diff(points, axis=0))
    return np.asarray(ahead / np.maximum(np.linalg.norm(ahead, axis=1), 1e-300)[:, None])


def _left(v: Floats) -> Floats:
    return np.stack([-v[:, 1], v[:, 0]], axis=1)


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _meeting(points: Floats, center: Floats, arc: Bools, size: Floats, shift: float, k: int, near: Floats,
             first: int) -> Floats:
    """Where shifted moves k and k + 1 of which one is an arc meet, by Newton's method from the bisector's point."""
    at = near
    for _ in range(50):
        value, slope = np.zeros(2), np.zeros((2, 2))
        for n, j in enumerate((k, k + 1)):
            if arc[j]:
                spoke = at - center[j]
                far = float(np.hypot(*spoke))
                value[n], slope[n] = far - size[j], spoke / max(far, 1e-300)
            else:
                chord = points[j + 1] - points[j]
                slope[n] = np.array([-chord[1], chord[0]]) / np.hypot(*chord)
                value[n] = slope[n] @ (at - points[j]) - shift
        if abs(np.linalg.det(slope)) < 1e-9 or np.abs(value).max() < 1e-10:
            break
        at = at - np.linalg.solve(slope, value)
    if not np.abs(value).max() < 1e-6:
        raise _NotExecuted("an inside corner into which the tool does not fit", first + k)
    return at


def _with_corners(rows: MotionRows, added: list[tuple[int, Floats]], radius: Floats, xy: Ints) -> MotionRows:
    """Rows with an arc of the radius behind those of `added`, round its corner, as a part of the next block."""
    behind = np.array([k for k, _ in added])
    index = np.sort(np.concatenate([np.arange(len(rows.block)), behind]))
    code, ccw, block, center, end, contour = (np.array(getattr(rows, name)[index]) for name in (
        "code", "ccw", "block", "center", "end", "contour"))
    new = behind + 1 + np.arange(len(behind))
    corner = np.array([at for _, at in added])
    code[new], ccw[new], block[new], center[new, :2] = 2, radius[behind] < 0.0, rows.block[behind + 1], corner
    end[np.ix_(new, xy)] = corner - rows.contour[behind + 1][:, :2]
    contour[new] = np.concatenate([rows.contour[behind][:, 2:], rows.contour[behind + 1][:, :2]], axis=1)
    others = {f.name: getattr(rows, f.name)[index] for f in fields(rows)}
    return replace(MotionRows(**others), code=code, ccw=ccw, block=block, center=center, end=end, contour=contour)
