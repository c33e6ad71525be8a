"""Blocks that run a polynomial of a parameter in X, Y, Z, or a spline by its control points, as chords that keep within
0.0001 mm of it."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from postproc.readback.execution.rows import BlockSection, MotionRows
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.cl.spline_chords import DEGREE, de_boor, knots_of
from toolpaths.cl.uniform_splines import equal_knots
from toolpaths.diagnostics import Diagnostic, error

CHORD = 1e-4
"""mm that the chords are off the curve at most; they are as many as a power of two, at equal steps of the parameter"""
LEAST, MOST = 4, 2**16
_DEGREES = np.arange(2.0, 6.0)


def with_curves(rows: MotionRows, start: Floats, curve: Floats, curves: Floats, splines: Ints, xyz: Ints) -> MotionRows:
    """Rows (R) begun at `start` (J,) in which each of a `curve` (R,), a number of `curves` (C, 3, 4), is one for each chord.

    A chord of step h in the parameter is off the curve by h^2 / 8 of its second derivative at most: its bound over the whole
    block is the sum of the bounds of its terms. The first coefficient is what leads from begin to end of the block. Rows
    whose number of `splines` (C,) is not below 0 end at control points of clamped cubics with equal knots.
    """
    curved = np.isfinite(curve) & (rows.code == 1)
    number = np.full(len(curve), -1)
    if len(splines):
        number[curved] = splines[curve[curved].astype(np.int64)]
    runs = np.flatnonzero(curved & (number < 0))
    if not curved.any():
        return rows
    terms = curves[curve[runs].astype(np.int64)]
    bend = np.linalg.norm((np.abs(terms) * (_DEGREES * (_DEGREES - 1.0))).sum(axis=2), axis=1)
    chords = np.ones(len(rows.block), dtype=np.int64)
    chords[runs] = _chords(bend)
    before = np.concatenate([start[None, :], rows.end[:-1]])
    points = {int(k): _spline_points(before, rows.end, np.flatnonzero(number == k), xyz)
              for k in np.unique(number[number >= 0])}
    for k, ends in points.items():
        at = np.flatnonzero(number == k)
        chords[at] = np.bincount(np.arange(len(ends)) * len(at) // len(ends), minlength=len(at))
    index = np.repeat(np.arange(len(chords)), chords)
    spread = type(rows)(**{f.name: getattr(rows, f.name)[index] for f in fields(rows)})
    place = np.full(len(chords), -1)
    place[runs] = np.arange(len(runs))
    inside = np.flatnonzero(place[index] >= 0)
    step = inside - (np.cumsum(chords) - chords)[index[inside]] + 1
    p = step / chords[index[inside]]
    begin = before[index[inside]][:, xyz]
    last, own = spread.end[inside][:, xyz], terms[place[index[inside]]]
    bows = (own * (p[:, None, None] ** _DEGREES - p[:, None, None])).sum(axis=2)
    end = np.array(spread.end)
    end[inside[:, None], xyz] = np.where(p[:, None] == 1.0, last, begin + (last - begin) * p[:, None] + bows)
    for k, ends in points.items():
        end[np.flatnonzero(number[index] == k)[:, None], xyz] = ends
    return replace(spread, end=end)


def _chords(bend: Floats) -> Ints:
    """How many chords (N,) keep within `CHORD` of curves by their second derivatives: powers of two."""
    exact = np.sqrt(bend / (8.0 * CHORD))
    result: Ints = np.clip(2 ** np.ceil(np.log2(np.maximum(exact, 1.0))).astype(np.int64), LEAST, MOST)
    return result


def _spline_points(before: Floats, end: Floats, rows: Ints, xyz: Ints) -> Floats:
    """Ends (N, 3) of the chords of a clamped cubic with equal knots, as many in each piece; its control points are where the
    first of its `rows` begins and where they end."""
    control = np.concatenate([before[rows[:1]], end[rows]])[:, xyz]
    pieces = len(control) - DEGREE
    knots = knots_of(equal_knots(pieces)) * pieces
    slope = DEGREE * np.diff(control, axis=0) / (knots[DEGREE + 1:-1] - knots[1:-DEGREE - 1])[:, None]
    inner = knots[1:-1]
    bend = (DEGREE - 1) * np.diff(slope, axis=0) / (inner[DEGREE:-1] - inner[1:-DEGREE])[:, None]
    count = int(_chords(np.linalg.norm(bend, axis=1).max(keepdims=True))[0]) * pieces
    at: Floats = np.arange(1.0, count + 1.0) * (pieces / count)
    points = de_boor(control, knots, at, DEGREE)
    points[-1] = control[-1]
    return points


def refused_curves(section: BlockSection, inverse: Bools, shifted: Bools, linear: Bools, line: Ints,
                   file: str) -> list[Diagnostic]:
    """Polynomials where no page says what they do: under inverse time or radius compensation, in machine coordinates, with a
    rotary axis in their block; `linear` (J,) says which axes are X, Y, Z."""
    runs = np.isfinite(section.curve)
    if not runs.any():
        return []
    turns = section.stated[:, ~linear].any(axis=1)
    result = []
    for bad, what in ((inverse, "under inverse time"), (shifted, "under radius compensation"),
                      (section.machine, "in machine coordinates"), (turns, "with a rotary axis in its block"),
                      (section.motion != 1, "without a code of feed in force")):
        blocks = np.flatnonzero(runs & bad)
        if len(blocks):
            result.append(error("gcode.curve", f"a polynomial {what} is not executed", file=file,
                                lines=line[blocks + section.first][:6].tolist(), count=len(blocks),
                                hint="write such a curve as lines or arcs"))
    return result
