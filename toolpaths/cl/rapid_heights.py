"""No rapid goes below what the same tool cuts along the same axis, and every approach lies off what follows it."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.toolpath import Kind, Role, Toolpath

BELOW = 0.02
"""mm"""
_WIDE = 1_000_100
_SAME = 1e-6
"""of an axis, from row to row"""


def low_rapids(p: Toolpath) -> Ints:
    """Rows of the rapids that stand lower, along the tool axis of a pass, than the lowest point that the tool cuts along it
    in all the file: those of the pass with its axis, and its last one with any. Only passes of one axis are judged."""
    cut = (p.kind != Kind.RAPID) | (p.role == Role.HOLE)
    rapid = ~cut & (p.role == Role.POINT)
    if not cut.any() or not rapid.any() or not np.isfinite(p.axis).all() or not np.isfinite(p.tip).all():
        return np.zeros(0, np.int64)
    if p.axis.strides[0] == 0 or bool((p.axis == p.axis[0]).all()):
        return _low_of_one_axis(p, cut, rapid)
    return _low_of_passes(p, cut, rapid)


def _lowest(p: Toolpath, height: Floats) -> Floats:
    """Heights with those of holes at their bottoms."""
    holes = np.flatnonzero(p.cycle >= 0)
    if len(holes):
        height = height.copy()
        height[holes] -= np.array([c.depth for c in p.cycles])[p.cycle[holes]]
    return height


def _low_of_one_axis(p: Toolpath, cut: Bools, rapid: Bools) -> Ints:
    height = p.tip @ p.axis[0]
    lowest = _lowest(p, height)
    found = []
    for tool in range(-1, len(p.tools)):
        mine = p.tool == tool
        cuts = lowest[mine & cut]
        if len(cuts):
            found.append(np.flatnonzero(mine & rapid & (height < cuts.min() - BELOW)))
    return np.sort(np.concatenate(found)) if found else np.zeros(0, np.int64)


def _low_of_passes(p: Toolpath, cut: Bools, rapid: Bools) -> Ints:
    start = np.flatnonzero(np.append(True, p.pass_[1:] != p.pass_[:-1]))
    number = np.cumsum(np.append(False, p.pass_[1:] != p.pass_[:-1]))
    rows = np.flatnonzero(cut)
    first = rows[np.minimum(np.searchsorted(rows, start), len(rows) - 1)]
    axis = p.axis[first]
    off = np.abs(p.axis - axis[number]).max(axis=1) > _SAME
    fixed = ~np.logical_or.reduceat(off & cut, start) & (number[first] == np.arange(len(start)))
    height = np.einsum("ni,ni->n", p.tip, axis[number])
    lowest = np.fmin.reduceat(np.where(cut, _lowest(p, height), np.inf), start)
    i, j, k = (np.round(axis[fixed] / _SAME) + _WIDE).astype(np.int64).T
    _, direction = np.unique((i * 2 * _WIDE + j) * 2 * _WIDE + k, return_inverse=True)
    _, group = np.unique(direction.ravel() * (len(p.tools) + 1) + p.tool[first][fixed], return_inverse=True)
    floor = np.full(len(start), -np.inf)
    least = np.full(int(group.max(initial=-1)) + 1, np.inf)
    np.fmin.at(least, group.ravel(), lowest[fixed])
    floor[fixed] = least[group.ravel()]
    last = np.zeros(len(cut), dtype=np.bool_)
    last[np.maximum(first - 1, 0)] = True
    judged = rapid & (~off | last) & (np.arange(len(cut)) < first[number])
    return np.flatnonzero(judged & (height < floor[number] - BELOW))
