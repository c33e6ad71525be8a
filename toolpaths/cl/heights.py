"""Cycles whose planes the file states as heights over the origin: planes above each hole's top, one cycle per height."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from toolpaths.arrays import Array, Floats, Ints
from toolpaths.cl.build import Heights, ToolpathBuilder
from toolpaths.toolpath import Cycle

_SAME_HEIGHT = 6
"""decimals of mm"""
_AT_CLEARANCE = 0.002
"""mm between a clearance height and the point before the cycle"""


def height_of(tip: Floats, axis: Floats) -> Floats:
    """(N,) heights along the axis over the origin, of tips and axes (N, 3) in the same system."""
    found: Floats = np.einsum("ni,ni->n", tip, axis)
    return found


def place(b: ToolpathBuilder, tip: Floats, axis: Floats, height: Floats, cycle: Array, line: Ints) -> Array:
    """Cycle per row (N,), cycles of one height each appended to those of the builder; tips at a bottom go to the top.

    Args:
        tip, axis (N, 3): rows in the part frame; tip is changed
        height (N,): heights of the rows in the system of the file, mm
        cycle (N,): cycle per row, -1 without
    """
    for k, planes in b.heights.items():
        rows = np.flatnonzero(cycle == k)
        if not len(rows):
            continue
        if planes.from_bottom:
            _check_clearance(b, planes, height, cycle, int(rows[0]), line)
            depth = b.cycles[k].depth
            tip[rows] += depth * axis[rows]
            height[rows] += depth
        for n, top in enumerate(np.unique(np.round(height[rows], _SAME_HEIGHT))):
            made = _above(b.cycles[k], planes, float(top))
            if n == 0:
                b.cycles[k] = made
            else:
                cycle[rows[np.round(height[rows], _SAME_HEIGHT) == top]] = len(b.cycles)
                b.cycles.append(made)
    return cycle


def _above(cycle: Cycle, planes: Heights, top: float) -> Cycle:
    clearance = cycle.clearance if np.isnan(planes.start) else planes.start - top
    return replace(cycle, clearance=clearance, retract=planes.retract - top)


def _check_clearance(b: ToolpathBuilder, planes: Heights, height: Floats, cycle: Array, row: int,
                     line: Ints) -> None:
    """The tool stands at the clearance height before the first hole; else the numbers are not what they are taken for."""
    if row == 0 or cycle[row - 1] >= 0 or abs(height[row - 1] - planes.retract) <= _AT_CLEARANCE:
        return
    b.log.error("cl.cycle-height", f"the cycle's clearance height is {planes.retract:g} mm, and the tool stands at "
                f"{height[row - 1]:g} mm before it: it cannot be known whether its points are tops or bottoms of holes",
                int(line[row]), "give the dialect: --dialect generic where the points are the tops")
