"""Linking moves by home, all those of a program at once: what most tool changes need.

They are those of `plan_link` at its first try. Where that fails, or a run is in a mode of its own, the link is left to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

import postproc.path.reach as reach
from machines.kinematics.base import Kinematics
from postproc.base.group_rows import groups
from postproc.control.control import Control
from postproc.control.modes import WordFrame
from postproc.joints.joint_path import nearest_solution
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.path.blocks import LEG, PARTS, PathBuilder, rapid_codes
from postproc.path.linearise import linearise
from postproc.path.links import LEG_TOLERANCE, RISE, SAMPLES, SafeSpace, has_retract_axis
from postproc.path.model import TRAVERSE
from postproc.path.solved_runs import SolvedRun, SolvedRuns
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.shapes import arrays
from toolpaths.toolpath import Kind

RETRACT, HOME, INDEX, APPROACH = 0, 1, 2, 5
"""places of the blocks of a link"""


@dataclass(frozen=True)
@arrays(tip="K 3", axis="K 3", q="K J", tool="K")
class _Poses:
    """K poses with their joints, and the tools of each by number: tip, axis (K, 3), q (K, J), tool (K,)."""

    tip: Floats
    axis: Floats
    q: Floats
    tool: Ints
    tools: Sequence[Kinematics]

    def each_tool(self) -> list[tuple[Kinematics, Ints]]:
        """Each tool with its rows."""
        return [(self.tools[int(self.tool[k[0]])], k) for k in groups(self.tool)]

    def take(self, rows: Ints) -> _Poses:
        """Some of the poses."""
        return replace(self, tip=self.tip[rows], axis=self.axis[rows], q=self.q[rows], tool=self.tool[rows])


def add_home_links(out: PathBuilder, base: WordFrame, space: SafeSpace, runs: SolvedRuns, moves: Moves,
                   linked: Bools) -> Bools:
    """Add the links by home before those of the runs `linked` (runs,) that a first try brings home and back,
    clear and inside travel; (runs,) True where that is done."""
    control, each = base.control, runs.each
    done = np.zeros(len(each), dtype=np.bool_)
    fits = [k for k in np.flatnonzero(linked).tolist() if k and each[k].frame is base and each[k - 1].frame is base
            and moves.kind[each[k].first] == Kind.RAPID]
    if len(fits) < 2 or not has_retract_axis(control) or reach.is_checked(control.machine.kinematics):
        return done
    tools = list({id(run.kin): run.kin for run in each}.values())
    before = _poses([each[k - 1] for k in fits], [each[k - 1].last - 1 for k in fits], tools, runs, moves)
    after = _poses([each[k] for k in fits], [each[k].first for k in fits], tools, runs, moves)
    turning = np.asarray(angle_between(before.axis, after.axis) > 1e-9)
    up0, up1 = _raised(space, before, turning), _raised(space, after, turning)
    home = up0.q.copy()
    last = control.machine.retract_axis
    home[:, last] = control.machine.home[last]
    steps = _from_home(control, home, up1.q)
    good = _one_block(control, before, up0) & _one_block(control, up1, after) & _inside(control, [up0.q, after.q, *(
        q for q, _ in steps)]) & _clear(control, space, after, [home, *(q for q, _ in steps)])
    keep = np.flatnonzero(good)
    done[np.array(fits)[keep]] = True
    rows = np.array([each[k].first for k in fits], dtype=np.int64)[keep]
    _add_legs(out, base, before.take(keep), up0.take(keep), rows, RETRACT)
    state = np.zeros(home.shape[1], dtype=np.bool_)
    state[last] = True
    _add_rapids(out, base, home[keep], rows, HOME, state, True)
    out.begin[rows] = out.count + np.arange(len(rows))
    for k, (q, states) in enumerate(steps):
        _add_rapids(out, base, q[keep], rows, INDEX + k, states, False)
    _add_legs(out, base, up1.take(keep), after.take(keep), rows, APPROACH)
    return done


def _poses(some: Sequence[SolvedRun], rows: Sequence[int], tools: Sequence[Kinematics], runs: SolvedRuns,
           moves: Moves) -> _Poses:
    at, number = np.array(rows, dtype=np.int64), {id(kin): k for k, kin in enumerate(tools)}
    tool = np.array([number[id(run.kin)] for run in some], dtype=np.int64)
    return _Poses(moves.tip[at], runs.axis[at], runs.q[at], tool, tools)


def _raised(space: SafeSpace, poses: _Poses, turning: Bools) -> _Poses:
    """The poses lifted along their tool axes to their safe planes; left where they are already above."""
    height = np.einsum("ni,ni->n", poses.axis, poses.tip - space.centre)
    lift = space.planes(poses.axis, turning) + np.where(turning, RISE, 0.0) - height
    tip, q = poses.tip + np.maximum(lift, 0.0)[:, None] * poses.axis, poses.q.copy()
    for kin, k in poses.each_tool():
        q[k] = nearest_solution(kin, tip[k], poses.axis[k], poses.q[k])
    return replace(poses, tip=tip, q=q)


def _from_home(control: Control, home: Floats, up: Floats) -> list[tuple[Floats, Bools]]:
    """Rotary axes, then the slides but the retract axis, then that one: joints (K, J) and the axes (J,) that are stated."""
    last, rotary = control.machine.retract_axis, np.array(control.machine.rotary)
    turned, moved = home.copy(), up.copy()
    turned[:, control.rotary] = up[:, control.rotary]
    moved[:, last] = home[:, last]
    lifting = np.arange(home.shape[1]) == last
    return [(q, state) for q, state in ((turned, rotary), (moved, ~rotary & ~lifting), (up, lifting)) if state.any()]


def _one_block(control: Control, start: _Poses, end: _Poses) -> Bools:
    """(K,) True where one block leads along the tool axis from pose to pose."""
    result = np.zeros(len(start.tip), dtype=np.bool_)
    for kin, k in start.each_tool():
        n = len(k)
        line = Curves(start.tip[k], end.tip[k], start.axis[k], end.axis[k], np.zeros(n, dtype=bool), np.zeros((n, 3)),
                      np.zeros((n, 3)), np.zeros(n))
        pieces = linearise(control, kin, line, start.q[k], end.q[k], np.zeros(n, dtype=bool),
                           LEG_TOLERANCE, 1e-3)
        one = np.bincount(pieces.curve, minlength=n) == 1
        one[pieces.broken] = False
        result[k] = one
    return result


def _inside(control: Control, joints: Sequence[Floats]) -> Bools:
    """(K,) True where all joints (K, J) are inside travel."""
    limits = control.machine.limits
    low, high = limits.lower - TRAVEL_SLACK, limits.upper + TRAVEL_SLACK
    return np.asarray(np.all([((q >= low) & (q <= high)).all(axis=1) for q in joints], axis=0))


def _clear(control: Control, space: SafeSpace, poses: _Poses, travels: Sequence[Floats]) -> Bools:
    """(K,) True where the tool is clear at even places of the paths through joints (K, J), one after the other."""
    result = np.ones(len(poses.tip), dtype=np.bool_)
    for kin, k in poses.each_tool():
        for begin, end in pairwise(travels):
            for t in np.linspace(0.0, 1.0, SAMPLES).tolist():
                tip, axis, _ = control.between(begin[k], end[k], np.full(len(k), t), kin,
                                               np.ones(len(k), dtype=bool))
                result[k] &= space.clear(tip, axis, 0.5 * space.margin)
    return result


def _add_legs(out: PathBuilder, frame: WordFrame, start: _Poses, end: _Poses, rows: Ints, part: int) -> None:
    """Blocks along the tool axis in rapid, at feed where rapids would leave the line; none where nothing moves."""
    moved = (start.q != end.q).any(axis=1)
    for kin, every in start.each_tool() if len(rows) else ():
        k = every[moved[every]]
        code = rapid_codes(frame.control, kin, start.q[k], end.q[k], *LEG)
        out.add(frame, end.q[k], rows[k], np.full(len(k), np.nan), code, np.where(code == TRAVERSE, np.nan, 0.0),
                place=PARTS * rows[k] + part)


def _add_rapids(out: PathBuilder, frame: WordFrame, q: Floats, rows: Ints, part: int, state: Bools,
                home: bool) -> None:
    n = len(q)
    out.add(frame, q, rows, np.full(n, np.nan), np.full(n, TRAVERSE, dtype=np.int8), np.full(n, np.nan), home,
            state=np.tile(state, (n, 1)), place=PARTS * rows + part)
