"""Unbroken cutting motion of a Path as smooth curves: what the planner plans, and what feeds without excess follow from.

A pass here is cutting motion in which nothing makes the control stop: no rapid, linking move, turn on the spot, dwell,
stop or switch. Holes are left out: canned cycles and their strokes stop at both ends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.feedrate.geometry import MachinePath, machine_path
from postproc.moves import Moves
from postproc.path import TRAVERSE, Path
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.smoothing.blend import SHARPEST
from toolpaths.smoothing.smooth import Smooth, Tolerance, smooth
from toolpaths.toolpath import Kind, Toolpath

RUNNING = frozenset({"PPRINT", "FEDRAT", "SEQNO", "MODE", "ROTATE", "SELECT", "INDIRV", "INDIRP", "TLON", "TLAXIS"})
"""Records at which no control stops."""


@dataclass(frozen=True)
class PassGeometry:
    """One pass.

    Attributes:
        first, last: rows of Moves, [first, last)
        block (k,): blocks of the Path; ends (k,): parameter s at their ends; begin (k,): at their starts
        smooth: the smoothed tip and axis
        paths: joints along s, between one stop and the next
    """

    first: int
    last: int
    block: Ints
    begin: Floats
    ends: Floats
    smooth: Smooth
    paths: tuple[MachinePath, ...]


def stops_of(toolpath: Toolpath, moves: Moves) -> Ints:
    """Rows of Moves before which a record makes the control stop."""
    index = np.array([e.index for e in toolpath.events if e.word not in RUNNING], dtype=np.int64)
    return np.unique(np.searchsorted(moves.row, index))


def chains(moves: Moves, stops: Ints) -> list[tuple[int, int]]:
    """[first, last) of rows of Moves that cut without a stop; holes left out."""
    cuts = (moves.kind != Kind.RAPID) & ~moves.link & (moves.hole < 0)
    begins = cuts & np.concatenate(([True], ~cuts[:-1]))
    begins[stops[stops < len(moves)]] = cuts[stops[stops < len(moves)]]
    begins[1:] |= cuts[1:] & (moves.tool[1:] != moves.tool[:-1])
    first = np.flatnonzero(begins)
    ends = np.flatnonzero(cuts & np.append(begins[1:] | ~cuts[1:], True)) + 1
    return list(zip(first.tolist(), ends.tolist(), strict=True))


def pass_geometry(path: Path, moves: Moves, kinematics: Callable[[int], Kinematics], tolerance: Tolerance, stops: Ints,
                  sharpest: float = SHARPEST, file: str = "") -> tuple[list[PassGeometry], list[Diagnostic]]:
    """All passes of a path, smoothed within `tolerance` of the moves.

    Args:
        kinematics: the kinematics with the tool of that index of the Toolpath
        stops: rows of Moves before which the motion stops, besides those where it turns on the spot
        sharpest: rad; it stops at corners that turn by more
    """
    result, diagnostics = [], []
    reference = moves.curves()
    for first, last in chains(moves, np.union1d(stops, path.turns)):
        block = _blocks(path, first, last)
        found = smooth(reference.take(np.arange(first, last)), tolerance, sharpest)
        if found is None or not len(block):
            continue
        try:
            result.append(_pass(path, first, last, block, found, kinematics(int(moves.tool[first]))))
        except ArithmeticError as fault:
            diagnostics.append(error("plan.reach", f"the smoothed path leaves what the machine can reach: {fault}",
                                     file=file, lines=moves.line[[first, last - 1]].tolist(),
                                     hint="--feed programmed, a smaller --tolerance, or move the part"))
    return result, diagnostics


def _blocks(path: Path, first: int, last: int) -> Ints:
    """Cutting blocks of these moves, turns on the spot left out."""
    low, high = np.searchsorted(path.move, [first, last])
    here = np.arange(low, high)
    return np.asarray(here[(path.code[here] != TRAVERSE) & (path.u[here] > 0.0)])


def _pass(path: Path, first: int, last: int, block: Ints, found: Smooth, kin: Kinematics) -> PassGeometry:
    local = path.move[block] - first
    ends = found.s[local] + path.u[block] * np.diff(found.s)[local]
    begin = np.concatenate((found.s[:1], ends[:-1]))
    jump = np.flatnonzero(np.diff(block) > 1) + 1
    cuts = np.unique(np.concatenate(([0.0], found.stops, ends[jump - 1], found.s[-1:])))
    paths = []
    for low, high in pairwise(cuts.tolist()):
        own = np.flatnonzero((ends > low) & (begin < high))
        near = _Near(np.append(begin[own[:1]], ends[own]), path.q[np.append(block[own[:1]] - 1, block[own])])
        paths.append(machine_path(found, low, high, kin, near))
    return PassGeometry(first, last, block, begin, ends, found, tuple(paths))


@dataclass(frozen=True)
class _Near:
    """Joints of the blocks at s, linear between their ends."""

    s: Floats
    q: Floats

    def __call__(self, s: Floats) -> Floats:
        return np.stack([np.interp(s, self.s, column) for column in self.q.T], axis=1)
