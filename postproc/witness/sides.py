"""Cutter compensation of every cut against CUTCOM of the CL file and the set-up."""

from __future__ import annotations

from typing import Any

import numpy as np

from postproc.witness.commanded import ARC, LINE, OFF, UNKNOWN, Commanded, tools_of
from postproc.witness.evidence import Case, ExecutedBlocks, Finding
from postproc.witness.motion import Walked
from postproc.witness.text import Array

_NAMES = {OFF: "off", 41: "left of the path", 42: "right of the path"}


def check_sides(w: Walked, c: Commanded, case: Case) -> tuple[list[Finding], int]:
    """Cuts on another side than CUTCOM says; how many blocks were compared, where either has compensation.

    A block that ends where two positions of the file are within the tolerance may belong to either.
    """
    e = w.poses.executed
    rows = np.flatnonzero(w.inside & (w.code > 0) & ~w.gap & ~w.returns & ((w.kind == LINE) | (w.kind == ARC)) & w.on_path())
    row = w.targets.row[w.owner[rows]]
    wanted, known = _wanted(c, case.setup)
    given = e.side[rows]
    if not ((given != OFF).any() or (c.side != OFF).any()):
        return [], 0
    near = (np.maximum(row - 1, 0), row, np.minimum(row + 1, len(c) - 1))
    good = np.any([wanted[k] == given for k in near], axis=0) | ~known[row]
    bad = np.flatnonzero(~good)
    compared = int(known[row].sum())
    shift = _radii(c, case.setup)[row]
    far = np.flatnonzero(_parallel(e, rows, np.nan_to_num(shift, nan=np.inf)) > w.tolerance[0])
    if len(far):
        k = int(far[0])
        return [Finding("compensation", f"the tool does not keep its radius from the programmed contour, {shift[k]:g} "
                        "mm", int(c.line[row[k]]), int(e.line[rows[k]]), len(far))], compared
    named, used = c.radius[row], e.radius[rows]
    other = np.flatnonzero(case.radius_named & good & (given != OFF) & np.isfinite(named) & (used != named)
                           & (named != tools_of(c, case.setup)[row]))
    if len(other) and not len(bad):
        k = int(other[0])
        return [Finding("compensation", f"the register of cutter compensation is {used[k]:g}, CUTCOM names {named[k]:g}",
                        int(c.line[row[k]]), int(e.line[rows[k]]), len(other))], compared
    if not len(bad):
        return [], compared
    k = int(bad[0])
    return [Finding("compensation", f"cutter compensation is {_NAMES[int(given[k])]}, by CL file and set-up it is "
                    f"{_NAMES[int(wanted[row[k]])]}", int(c.line[row[k]]), int(e.line[rows[k]]), len(bad))], compared


def _radii(c: Commanded, setup: dict[str, Any]) -> Array:
    """(N,) mm by which the control shifts words: the radius of tools that the register holds, and the file the centre of."""
    tool, result = tools_of(c, setup), np.zeros(len(c))
    for number, t in (setup.get("tools") or {}).items():
        if t and t.get("compensation") == "radius" and not t.get("contour"):
            result = np.where(tool == int(number), 0.5 * t["diameter"] if t.get("diameter") else c.cutter, result)
    return result


def _parallel(e: ExecutedBlocks, rows: Array, radius: Array) -> Array:
    """(K,) mm by which the centre's line is off the parallel of the contour's, its arc off the concentric one, of whichever
    sense; of a lead-in, which leaves the contour's begin, how much its end is too near; of a full circle nothing."""
    axes = [e.letters.index("X"), e.letters.index("Y")]
    step, (begin, end) = _plane(e.steps(rows)[:, axes]), (_plane(e.contour[rows][:, k:k + 2]) for k in (0, 2))
    side, lead, on = np.where(e.side[rows] == 41, 1.0, -1.0), abs(begin) < 1e-9, e.side[rows] != OFF
    far = np.where(on, np.maximum(radius - abs(end), 0.0), abs(end))
    normal = side * 1j * (step + end - begin) / np.maximum(abs(step + end - begin), 1e-9)
    off = np.max([abs((-at * normal.conj()).real - radius) for at in (begin, end)], axis=0)
    round_ = np.full(len(rows), np.inf)
    for sense in (1.0, -1.0):
        centre = 0.5 * step * (1.0 + sense * 1j / np.tan(0.5 * e.sweep[rows]))
        arc = abs(centre) + side * sense * radius
        round_ = np.fmin(round_, np.max([abs(abs(at - centre) - arc) for at in (begin, step + end)], axis=0))
    away = np.where(np.isnan(e.sweep[rows]), off, np.where(abs(step) < 1e-6, 0.0, round_))
    return np.where(on & ~(lead & (abs(end) > 1e-9)), away, far)


def _plane(xy: Array) -> Array:
    return np.asarray(xy @ np.array([1.0, 1j]))


def _wanted(c: Commanded, setup: dict[str, Any]) -> tuple[Array, Array]:
    """(side (N,), True (N,) where it is sure): off in holes and for tools whose path is not compensated."""
    bare = [int(n) for n, t in (setup.get("tools") or {}).items() if (t or {}).get("compensation") == "none"]
    side = np.where(c.cycle >= 0, OFF, c.side)
    if not bare:
        return side, np.ones(len(c), bool)
    tool = tools_of(c, setup)
    unsure = (tool == UNKNOWN) & (side != OFF)
    return np.where(np.isin(tool, bare), OFF, side), ~unsure
