"""Unbroken cutting motion of a Path as smooth curves: what the planner plans, and what feeds without excess follow from.

A pass here is cutting motion in which nothing makes the control stop: no rapid, linking move, turn on the spot, dwell,
stop or switch. Holes are left out: canned cycles and their strokes stop at both ends.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import groupby, islice, pairwise

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.path.model import TRAVERSE, JointPath
from postproc.planning.geometry import MachinePath, PathStretch, machine_paths
from postproc.planning.planned_errors import PlannedCorrection
from postproc.reference.moves import Moves
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.shapes import arrays
from toolpaths.smoothing.blend import SHARPEST
from toolpaths.smoothing.smooth import Smooth, Tolerance, smooth_all
from toolpaths.toolpath import Kind, Toolpath

RUNNING = frozenset({"PPRINT", "FEDRAT", "SEQNO", "MODE", "ROTATE", "SELECT", "INDIRV", "INDIRP", "TLON", "TLAXIS"})
"""Records at which no control stops."""
LED = 1e-7
"""rad: axes that differ by less are those of the move"""


@dataclass(frozen=True)
@arrays(move="C", share="C", block="k", begin="k", ends="k")
class PassGeometry:
    """One pass.

    Attributes:
        move (C,): row of Moves of each curve that was smoothed; share (C,): how much of that move's path it is
        block (k,): blocks of the Path; begin, ends (k,): parameter s where they begin and end
        smooth: the smoothed tip and axis
        paths: joints along s, between one stop and the next
    """

    move: Ints
    share: Floats
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


def pass_geometry(path: JointPath, moves: Moves, kinematics: Callable[[int], Kinematics], tolerance: Tolerance, stops: Ints,
                  sharpest: float = SHARPEST, file: str = "",
                  correction: PlannedCorrection | None = None) -> tuple[list[PassGeometry], list[Diagnostic]]:
    """All passes of a path, smoothed within `tolerance` of the moves.

    Args:
        kinematics: the kinematics with the tool of that index of the Toolpath
        stops: rows of Moves before which the motion stops, besides those where it turns on the spot or is drawn back
        sharpest: rad; it stops at corners that turn by more
        correction: the joints are those that correct the machine's geometric errors
    """
    reference = moves.curves()
    written = [_written(path, block, reference, kinematics(int(moves.tool[first])))
               for first, last in chains(moves, np.union1d(stops, path.turns)) if len(block := _blocks(path, first, last))]
    if not written:
        return [], []
    begin = np.concatenate(([0], np.cumsum([len(one.move) for one in written])))
    smoothed = smooth_all(_joined(written), begin, tolerance, sharpest)
    passes = [_placed(path, one, found) for one, found in zip(written, smoothed, strict=True) if found is not None]
    paths = iter(_machine_paths(passes, moves, kinematics, correction))
    result, diagnostics = [], []
    for one in passes:
        own = list(islice(paths, len(one.stretches)))
        faults = [fault for fault in own if isinstance(fault, str)]
        if faults:
            diagnostics.append(error("plan.reach", f"the smoothed path leaves the reach of the machine: {faults[0]}",
                                     file=file, lines=moves.line[one.written.move[[0, -1]]].tolist(),
                                     hint="--feed programmed, a smaller --tolerance, or move the part"))
            continue
        result.append(PassGeometry(one.written.move, one.written.share, one.written.block, one.begin, one.ends, one.smooth,
                                   tuple(made for made in own if isinstance(made, MachinePath))))
    return result, diagnostics


def _joined(written: list[_Written]) -> Curves:
    """The curves of all passes in a row."""
    return Curves(*(np.concatenate([getattr(one.curves, name) for one in written])
                    for name in Curves.__dataclass_fields__))


def _blocks(path: JointPath, first: int, last: int) -> Ints:
    """Cutting blocks of these moves, turns on the spot left out."""
    low, high = np.searchsorted(path.move, [first, last])
    here = np.arange(low, high)
    return np.asarray(here[(path.code[here] != TRAVERSE) & (path.u[here] > 0.0)])


@dataclass(frozen=True)
@arrays(block="k", move="C", share="C", curve="k", u="k")
class _Written:
    """Curves as the blocks (k,) follow them: `curve` (k,) of each block, and where on it the block ends, `u` (k,)."""

    block: Ints
    curves: Curves
    move: Ints
    share: Floats
    curve: Ints
    u: Floats


def _written(path: JointPath, block: Ints, reference: Curves, kin: Kinematics) -> _Written:
    """The moves' curves with the tool axes that are written; moves whose axis is led aside, block by block.

    Axes differ from those of the moves where these are out of reach, or near a singular direction.
    """
    move, u = path.move[block], path.u[block]
    tip, wanted = reference.take(move).at(u)
    _, axis = kin.forward(path.q[block], near=np.hstack((tip, wanted)))
    aside = angle_between(axis, wanted) > LED
    axis = np.where(aside[:, None], axis, wanted)
    led = np.isin(move, move[aside & (u < 1.0)])
    cut = (u == 1.0) | led
    cut[-1] = True
    curve = np.cumsum(cut) - cut
    rows = np.flatnonzero(cut)
    own = reference.take(move[rows])
    start = np.concatenate((own.start[:1], tip[rows[:-1]]))
    _, first = kin.forward(path.q[block[:1] - 1], near=np.hstack((own.start[:1], own.axis0[:1])))
    aside_first = angle_between(first, own.axis0[:1]) > LED
    axis0 = np.concatenate((first if aside_first[0] else own.axis0[:1], axis[rows[:-1]]))
    begin = np.concatenate(([0.0], np.where(u[rows[:-1]] < 1.0, u[rows[:-1]], 0.0)))
    whole = ~led[rows]
    curves = Curves(start, tip[rows], axis0, axis[rows], own.is_arc & whole, own.center,
                    own.normal, own.sweep)
    return _Written(block, curves, move[rows], u[rows] - begin, curve, np.where(led, 1.0, u))


@dataclass(frozen=True)
@arrays(begin="k", ends="k")
class _Placed:
    """A pass with its blocks placed along s, and its stretches between stops."""

    written: _Written
    smooth: Smooth
    begin: Floats
    ends: Floats
    stretches: tuple[PathStretch, ...]
    first: tuple[int, ...]
    """block of the Path that each stretch begins in"""


def _placed(path: JointPath, written: _Written, found: Smooth) -> _Placed:
    """Where the blocks of a chain are along s, and where it stops."""
    block = written.block
    ends = found.s[written.curve] + written.u * np.diff(found.s)[written.curve]
    begin = np.concatenate((found.s[:1], ends[:-1]))
    jump = np.flatnonzero(np.diff(block) > 1) + 1
    cuts = np.unique(np.concatenate(([0.0], found.stops, ends[jump - 1], found.s[-1:])))
    stretches, first = [], []
    for low, high in pairwise(cuts.tolist()):
        own = np.flatnonzero((ends > low) & (begin < high))
        near = _Near(np.append(begin[own[:1]], ends[own]), path.q[np.append(block[own[:1]] - 1, block[own])],
                     bool(path.opened))
        stretches.append(PathStretch(found, low, high, near))
        first.append(int(block[own[0]]))
    return _Placed(written, found, begin, ends, tuple(stretches), tuple(first))


def _machine_paths(passes: list[_Placed], moves: Moves, kinematics: Callable[[int], Kinematics],
                   correction: PlannedCorrection | None) -> list[MachinePath | str]:
    """The joints along all stretches in order, those of one tool together."""
    tool = [int(moves.tool[one.written.move[0]]) for one in passes]
    result: list[MachinePath | str] = []
    for index, group in groupby(zip(tool, passes, strict=True), key=lambda pair: pair[0]):
        placed, kin = [one for _, one in group], kinematics(index)
        made = machine_paths([stretch for one in placed for stretch in one.stretches], kin)
        if correction is not None:
            block = [k for one in placed for k in one.first]
            good = [i for i, one in enumerate(made) if isinstance(one, MachinePath)]
            solved = [one for one in made if isinstance(one, MachinePath)]
            for i, one in zip(good, correction.of(solved, kin, [block[i] for i in good]), strict=True):
                made[i] = one
        result += made
    return result


@dataclass(frozen=True)
@arrays(s="N", q="N J")
class _Near:
    """Joints of the blocks at s, linear between their ends; `smooth` where what the machine leaves open follows them, which
    is to have no corners: cubic, without overshoot (Fritsch and Butland 1984)."""

    s: Floats
    q: Floats
    smooth: bool

    def __call__(self, s: Floats) -> Floats:
        places, rows = np.unique(self.s, return_index=True)
        if self.smooth and len(places) > 2:
            from scipy.interpolate import PchipInterpolator

            return np.asarray(PchipInterpolator(places, self.q[rows])(np.clip(s, places[0], places[-1])))
        return np.stack([np.interp(s, self.s, column) for column in self.q.T], axis=1)
