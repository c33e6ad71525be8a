"""A run cut into segments inside which nothing changes: which states there are, what each costs, where it leads."""

from __future__ import annotations

from itertools import product

import numpy as np

from postproc.joints.lattice import Lattice
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

BranchState = tuple[int, tuple[int, ...]]
"""branch, turns of each wound joint"""
BAD, REWINDS, CUTS, WRONG, SECONDS = range(5)
"""columns of a cost, compared in this order: poses outside travel or without solution, rewinds, those of them
in the cut, poses on the wrong side of the preferred axis, time"""
NEVER = np.array([np.inf] * 5)


@dataclass(frozen=True)
@arrays(bad="S")
class Segment:
    """Poses first..last of a run, the states of them, and the poses (S,) where each is outside travel: all or none."""

    first: int
    last: int
    states: list[BranchState]
    bad: Ints
    index: dict[BranchState, int]

    def __len__(self) -> int:
        return len(self.states)


def tidy_segments(lattice: Lattice) -> list[Segment]:
    """Segments between the places where a branch changes, with the states that are inside travel all along each."""
    cuts = np.flatnonzero(_structure(lattice))
    first, last = np.concatenate([[0], cuts + 1]), np.append(cuts, lattice.poses - 1)
    least = np.maximum.reduceat(lattice.least, first, axis=1)
    most = np.minimum.reduceat(lattice.most, first, axis=1)
    inside = np.logical_and.reduceat(lattice.inside, first, axis=1)
    return [_segment(int(i), int(j), [s for b in range(len(least)) if inside[b, g]
                                      for s in _windings(b, least[b, g], most[b, g])], [])
            for g, (i, j) in enumerate(zip(first, last, strict=True))]


def rough_segments(lattice: Lattice, rewinds: bool) -> list[Segment]:
    """Segments between the places where travel admits other states.

    States that travel admits in the segments before and after count as outside; without rewinds, where
    nothing leads from one state to another, those of all segments.
    """
    change = _structure(lattice)
    for table in (lattice.least, lattice.most, lattice.inside[..., None]):
        change |= (table[:, 1:] != table[:, :-1]).any(axis=(0, 2))
    cuts = np.flatnonzero(change)
    first, last = np.concatenate([[0], cuts + 1]), np.append(cuts, lattice.poses - 1)
    least, most, inside = lattice.least[:, first], lattice.most[:, first], lattice.inside[:, first]
    result = []
    for g, (i, j) in enumerate(zip(first, last, strict=True)):
        near = slice(max(g - 1, 0), g + 2) if rewinds else slice(None)
        good: list[BranchState] = []
        every: list[BranchState] = []
        for b in range(len(least)):
            if inside[b, g]:
                good += _windings(b, least[b, g], most[b, g])
            ends = least[b, near].min(axis=0), most[b, near].max(axis=0)
            every += _windings(b, np.minimum(*ends), np.maximum(*ends))
        result.append(_segment(int(i), int(j), good, [s for s in every if s not in set(good)]))
    return result


def _structure(lattice: Lattice) -> Bools:
    """(N - 1,) True where a branch leads to another one."""
    own = np.arange(len(lattice.leads))[:, None]
    return np.asarray((lattice.leads != own).any(axis=0) | lattice.free)


def _windings(branch: int, least: Array, most: Array) -> list[BranchState]:
    return [(branch, turns) for turns in product(*(range(int(a), int(b) + 1) for a, b in zip(least, most, strict=True)))]


def _segment(first: int, last: int, good: list[BranchState], outside: list[BranchState]) -> Segment:
    states = good + outside
    bad = np.array([0] * len(good) + [last - first + 1] * len(outside), dtype=np.int64)
    return Segment(first, last, states, bad, {s: k for k, s in enumerate(states)})


def staying(lattice: Lattice, segment: Segment, wrong: Floats) -> Floats:
    """(S, 5) cost of going through a segment in each state; `wrong` (B, N + 1) counts poses on the wrong side."""
    result = np.zeros((len(segment), 5))
    branch = np.array([b for b, _ in segment.states], dtype=np.int64)
    result[:, BAD] = segment.bad
    result[:, WRONG] = wrong[branch, segment.last + 1] - wrong[branch, segment.first]
    result[:, SECONDS] = lattice.clock[branch, segment.last] - lattice.clock[branch, segment.first]
    return result


def leading(lattice: Lattice, segment: Segment, after: Segment) -> list[list[tuple[int, Floats]]]:
    """For each state of a segment the states of the next one that it may lead to, with the cost (5,) of the step.

    Where the branch is free the axis may go to any branch, in either direction round. A state that leads to
    none that is known goes to the nearest of its branch, which counts as one more pose outside.
    """
    pose, result = segment.last, []
    for branch, turns in segment.states:
        found = []
        for target in range(len(lattice.values)) if lattice.free[pose] else [int(lattice.leads[branch, pose])]:
            to, travel = lattice.on(branch, pose, turns, target)
            options = _round(lattice, to, travel) if lattice.free[pose] and target != branch else [(to, travel)]
            for wound, gone in options:
                k = after.index.get((target, wound))
                if k is not None:
                    found.append((k, _step(lattice, gone, 0)))
        if not found:
            nearest = _nearest(after, *lattice_target(lattice, branch, pose, turns))
            found = [(nearest, _step(lattice, np.zeros(lattice.values.shape[2]), 1))] if nearest >= 0 else []
        result.append(found)
    return result


def lattice_target(lattice: Lattice, branch: int, pose: int, turns: tuple[int, ...]) -> BranchState:
    """Where a state leads to by itself."""
    target = int(lattice.leads[branch, pose])
    return target, lattice.on(branch, pose, turns, target)[0]


def _round(lattice: Lattice, turns: tuple[int, ...], travel: Floats) -> list[tuple[tuple[int, ...], Floats]]:
    """The shorter path, and for each wound joint that turns the longer one."""
    result = [(turns, travel)]
    for w, j in enumerate(lattice.wound):
        if abs(travel[j]) > 1e-9:
            sense = -1 if travel[j] > 0.0 else 1
            other = travel.copy()
            other[j] += 2.0 * np.pi * sense
            result.append(((*turns[:w], turns[w] + sense, *turns[w + 1:]), other))
    return result


def _nearest(segment: Segment, branch: int, turns: tuple[int, ...]) -> int:
    """The state of that branch (else of any) with the nearest turns; -1 where there is none at all."""
    far = [(b != branch, sum(abs(x - y) for x, y in zip(t, turns, strict=True)), k)
           for k, (b, t) in enumerate(segment.states)]
    return min(far)[2] if far else -1


def _step(lattice: Lattice, travel: Floats, bad: int) -> Floats:
    return np.array([bad, 0.0, 0.0, 0.0, float(lattice.seconds(travel))])


def least_of(costs: Floats) -> Ints:
    """Where along the last but one axis of (..., K, 5) the least cost stands."""
    alive = np.ones(costs.shape[:-1], dtype=np.bool_)
    for column in range(costs.shape[-1]):
        value = np.where(alive, costs[..., column], np.inf)
        alive &= value <= value.min(axis=-1, keepdims=True)
    return np.asarray(alive.argmax(axis=-1), dtype=np.int64)
