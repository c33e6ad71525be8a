"""Branches, windings and rewinds of a whole program: the least of what must not be, then the least time.

Compared in this order: poses outside travel or without solution, rewinds, rewinds in the cut, poses on the wrong side of
the preferred axis, time with every axis at its velocity, the moves between the runs included.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field

import numpy as np

from machines.machine import Limits
from postproc.joints.direct import direct
from postproc.joints.greedy import greedy
from postproc.joints.lattice import Lattice, PoseRun, lattice_of
from postproc.joints.search import RunPiece, SegmentChoice, cheapest, pieces, wrong_side
from postproc.joints.states import BAD, NEVER, SECONDS, Segment, least_of, rough_segments, tidy_segments
from postproc.joints.tracks import TRAVEL_SLACK
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import TWO_PI, whole_turns, wrap
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(before="J", after="J")
class Rewind:
    """After pose `row` of a run the tool is drawn back, the joints go from `before` to `after` (J,), and it comes back."""

    row: int
    before: Floats
    after: Floats
    cuts: bool
    """True where the tool cuts at that pose"""


@dataclass(frozen=True)
@arrays(q="J", extra_cost="5")
class RejectedStart:
    """A state that a run could have begun in: joints (J,), and by how much (5,) the best end from there is more expensive.

    Infinitely where no winding of its branch goes through the run.
    """

    q: Floats
    extra_cost: Floats


@dataclass(frozen=True)
@arrays(q="N J", singular="N")
class RunSolution:
    """Joints (N, J) of a run, rotaries unwound; NaN rows where the machine cannot take the pose."""

    q: Floats
    singular: Bools
    """(N,) rows where the tool lies along a rotary axis"""
    rewinds: tuple[Rewind, ...] = ()
    outside: int = 0
    """poses outside travel or without solution, and steps between poses that no state makes inside travel"""
    rejected_starts: tuple[RejectedStart, ...] = ()
    greedy: int = 0
    """rewinds if every pose took the nearest joints"""


@dataclass(frozen=True)
class JointPreferences:
    """What the set-up prefers: `side` (joint: +1 or -1) of an axis, `start` (joint: rad) where the program begins."""

    side: Mapping[int, int] = field(default_factory=dict)
    start: Mapping[int, float] = field(default_factory=dict)


@dataclass
class _Stage:
    """One run while it is planned."""

    lattice: Lattice
    segments: list[Segment]
    rewinds: bool
    tidy: bool
    """some state goes through without leaving travel"""
    value: Floats = field(default_factory=lambda: np.zeros((0, 5)))
    choices: list[SegmentChoice] = field(default_factory=list)


def plan_runs(runs: list[PoseRun], limits: Limits, start: Floats, preferences: JointPreferences | None = None,
              may_rewind: bool = True,
              progress: Callable[[int], None] | None = None) -> list[RunSolution]:
    """The joints of runs, in order, from a machine that stands at `start` (J,).

    Between two runs the tool is drawn back, so that any state may follow any other at the price of the path there.

    Args:
        may_rewind: False where no run may be interrupted
        progress: called with the number of runs looked at
    """
    if (only := direct(runs, limits)) is not None:
        return [RunSolution(q, np.zeros(len(q), dtype=np.bool_)) for q in only]
    preferences = preferences or JointPreferences()
    start = start.copy()
    for joint, angle in preferences.start.items():
        start[joint] = angle
    stages = _stages(runs, limits, start, may_rewind, progress)
    end: Callable[[_Stage], Floats] = _free_end
    for stage in reversed(stages):
        wrong = wrong_side(stage.lattice, dict(preferences.side))
        stage.value, stage.choices = cheapest(stage.lattice, stage.segments, end(stage), stage.rewinds, wrong)
        end = _before(stage)
    solutions, at, end = [], start, _free_end
    stages.reverse()
    while stages:
        solutions.append(_solution(stages.pop(), at))
        at = _last(solutions[-1].q, at)
    return solutions


def _free_end(stage: _Stage) -> Floats:
    return np.zeros((len(stage.segments[-1]), 5))


def _before(after: _Stage) -> Callable[[_Stage], Floats]:
    """The cost (S, 5) of ending a run in each of its states, where the run `after` follows."""
    def end(stage: _Stage) -> Floats:
        to = _joints(after, 0, 0)
        costs = []
        for q in _joints(stage, -1, stage.lattice.poses - 1):
            every = after.value + _link(after.lattice, q, to)
            costs.append(every[int(least_of(every))])
        return np.stack(costs)
    return end


def _joints(stage: _Stage, segment: int, pose: int) -> Floats:
    """(S, J) joints of every state of a segment at a pose."""
    return np.stack([stage.lattice.joints(b, pose, turns) for b, turns in stage.segments[segment].states])


def _link(lattice: Lattice, q: Floats, to: Floats) -> Floats:
    """(S, 5) cost of the paths from joints q (J,) to joints (S, J); axes without limits go the shorter path."""
    step = to - q
    result = np.zeros((len(to), 5))
    result[:, SECONDS] = lattice.seconds(np.where(lattice.endless, wrap(step), step))
    return result


def _stages(runs: list[PoseRun], limits: Limits, start: Floats, may_rewind: bool,
            progress: Callable[[int], None] | None) -> list[_Stage]:
    """Every run with its states.

    A run whose tool lies along a rotary axis along the whole path may take that axis as it stands before or
    after it; where neither is inside travel, at a quarter turn. One that holds it has no choice.
    """
    result: list[_Stage] = []
    begins = _begins(runs, start)
    for k, run in enumerate(runs):
        near = [result[-1].lattice.values[b, -1] for b in range(len(result[-1].lattice.values))] if result else [start]
        if k + 1 < len(runs):
            near += begins[k + 1]
        rotary = np.array(run.kin.rotary)
        near = _distinct(near, start, rotary)
        stage = _stage(lattice_of(run, limits, np.stack(near) if run.held is None else run.held[None]), may_rewind)
        if stage.lattice.family.all() and not stage.tidy and run.held is None:
            quarters = [np.where(rotary, 0.5 * np.pi * i, start) for i in range(4)]
            stage = _stage(lattice_of(run, limits, np.stack(_distinct(near + quarters, start, rotary))), may_rewind)
        result.append(stage)
        if progress:
            progress(k + 1)
    return result


def _begins(runs: list[PoseRun], start: Floats) -> list[list[Floats]]:
    """Joints (J,) of every branch at the first pose of each run; those of one machine at once."""
    result, alike = [list[Floats]() for _ in runs], dict[int, list[int]]()
    for k, run in enumerate(runs):
        alike.setdefault(id(run.kin), []).append(k)
    for some in alike.values():
        tip, axis = (np.stack([getattr(runs[k], name)[0] for k in some]) for name in ("tip", "axis"))
        for k, branches in zip(some, runs[some[0]].kin.inverse(tip, axis, near=start).swapaxes(0, 1), strict=True):
            result[k] = list(branches)
    return result


def _distinct(near: list[Floats], start: Floats, rotary: Bools) -> list[Floats]:
    """Those (J,) with different rotary joints, in order; `start` where none is finite."""
    kept: list[Floats] = []
    for row in near:
        if np.isfinite(row).all() and not any(np.abs(wrap(row - k)[rotary]).max(initial=0.0) < 1e-9 for k in kept):
            kept.append(row)
    return kept or [start]


def _stage(lattice: Lattice, may_rewind: bool) -> _Stage:
    """Without rewinds where some state goes through; else with every place where travel ends."""
    segments = tidy_segments(lattice)
    if all(len(s) for s in segments):
        nothing = np.zeros((len(lattice.values), lattice.poses + 1))
        value, _ = cheapest(lattice, segments, np.zeros((len(segments[-1]), 5)), False, nothing)
        if (value[:, BAD] == 0.0).any():
            return _Stage(lattice, segments, False, True)
    return _Stage(lattice, rough_segments(lattice, may_rewind), may_rewind, False)


def _solution(stage: _Stage, at: Floats) -> RunSolution:
    """The run from where the machine stands."""
    lattice = stage.lattice
    q0 = _joints(stage, 0, 0)
    every = stage.value + _link(lattice, at, q0)
    best = int(least_of(every))
    taken = pieces(stage.segments, stage.choices, best)
    offset = _offsets(lattice, taken, at)
    q = np.concatenate([_rows(lattice, p, p.first) + o for p, o in zip(taken, offset, strict=True)])
    family = np.concatenate([lattice.family[p.state[0], p.first:p.last + 1] for p in taken])
    rewinds = tuple(Rewind(p.last, q[p.last], _rows(lattice, n, p.last)[0] + o, not bool(lattice.rest[p.last]))
                    for p, n, o in zip(taken, taken[1:], offset[1:], strict=False) if p.rewind)
    low, high = lattice.limits.lower - TRAVEL_SLACK, lattice.limits.upper + TRAVEL_SLACK
    stood = np.concatenate([q, *(r.after[None] for r in rewinds)])
    outside = int((~((stood >= low) & (stood <= high)).all(axis=1)).sum()) + _jumps(lattice, taken, q)
    return RunSolution(q, family, rewinds, outside, _rejected(lattice, stage.segments[0], q0, every, best),
                       greedy(lattice, at).rewinds)


def _jumps(lattice: Lattice, taken: list[RunPiece], q: Floats) -> int:
    """Steps to another winding that are neither rewinds nor turns on the spot: travel ends between two poses."""
    ends = np.array([p.last for p in taken[:-1] if not p.rewind and not lattice.free[p.last]], dtype=np.int64)
    step = np.abs(q[ends + 1] - q[ends])[:, lattice.rotary]
    return int((step > np.pi + 1e-6).any(axis=1).sum())


def _rejected(lattice: Lattice, first: Segment, q0: Floats, every: Floats,
              best: int) -> tuple[RejectedStart, ...]:
    """The other states of the first pose, and the branches that it has but the run has not."""
    shut = set(range(len(lattice.values))) - {branch for branch, _ in first.states}
    with np.errstate(invalid="ignore"):
        extra_cost = np.where(every == np.inf, np.inf, every - every[best])
    return (*(RejectedStart(q0[k], extra_cost[k]) for k in range(len(every)) if k != best),
            *(RejectedStart(lattice.values[b, 0], NEVER) for b in sorted(shut) if np.isfinite(lattice.values[b, 0]).all()))


def _rows(lattice: Lattice, piece: RunPiece, first: int) -> Floats:
    """Joints (K, J) of a piece from pose `first` on."""
    branch, turns = piece.state
    q: Floats = lattice.values[branch, first:piece.last + 1].copy()
    q[:, lattice.wound] += TWO_PI * np.array(turns, dtype=np.float64)
    return q


def _offsets(lattice: Lattice, taken: list[RunPiece], at: Floats) -> list[Floats]:
    """What each piece's axes without limits are to be turned by (J,), so that they go on the shorter path."""
    result, before = [], at
    for piece in taken:
        begin = _rows(lattice, RunPiece(piece.first, piece.first, piece.state, False), piece.first)[0]
        turned = np.where(lattice.endless, whole_turns(np.nan_to_num(before - begin)), 0.0)
        result.append(turned)
        before = _rows(lattice, piece, piece.last)[0] + turned
    return result


def _last(q: Floats, at: Floats) -> Floats:
    good = np.flatnonzero(np.isfinite(q).all(axis=1))
    return np.asarray(q[good[-1]] if len(good) else at)
