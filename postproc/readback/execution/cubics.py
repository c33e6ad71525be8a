"""Blocks that run a polynomial of a parameter in X, Y, Z, as chords that keep within 0.0001 mm of it."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from postproc.readback.execution.rows import BlockSection, MotionRows
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error

CHORD = 1e-4
"""mm that the chords are off the curve at most; they are as many as a power of two, at equal steps of the parameter"""
LEAST, MOST = 4, 2**16
_DEGREES = np.arange(2.0, 6.0)


def with_curves(rows: MotionRows, start: Floats, curve: Floats, curves: Floats, xyz: Ints) -> MotionRows:
    """Rows (R) begun at `start` (J,) in which each of a `curve` (R,), a number of `curves` (C, 3, 4), is one for each chord.

    A chord of step h in the parameter is off the curve by h^2 / 8 of its second derivative at most: its bound over the whole
    block is the sum of the bounds of its terms. The first coefficient is what leads from begin to end of the block.
    """
    runs = np.flatnonzero(np.isfinite(curve) & (rows.code == 1))
    if not len(runs):
        return rows
    terms = curves[curve[runs].astype(np.int64)]
    bend = np.linalg.norm((np.abs(terms) * (_DEGREES * (_DEGREES - 1.0))).sum(axis=2), axis=1)
    chords = np.ones(len(rows.block), dtype=np.int64)
    exact = np.sqrt(bend / (8.0 * CHORD))
    chords[runs] = np.clip(2 ** np.ceil(np.log2(np.maximum(exact, 1.0))).astype(np.int64), LEAST, MOST)
    index = np.repeat(np.arange(len(chords)), chords)
    spread = type(rows)(**{f.name: getattr(rows, f.name)[index] for f in fields(rows)})
    place = np.full(len(chords), -1)
    place[runs] = np.arange(len(runs))
    inside = np.flatnonzero(place[index] >= 0)
    step = inside - (np.cumsum(chords) - chords)[index[inside]] + 1
    p = step / chords[index[inside]]
    begin = np.concatenate([start[None, :], rows.end[:-1]])[index[inside]][:, xyz]
    last, own = spread.end[inside][:, xyz], terms[place[index[inside]]]
    bows = (own * (p[:, None, None] ** _DEGREES - p[:, None, None])).sum(axis=2)
    end = np.array(spread.end)
    end[inside[:, None], xyz] = np.where(p[:, None] == 1.0, last, begin + (last - begin) * p[:, None] + bows)
    return replace(spread, end=end)


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
