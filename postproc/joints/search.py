"""The cheapest sequence of states of a run: backwards over its segments (Bellman), exact.

Inside a segment travel admits the same states everywhere and no branch changes, so one rewind there is
enough: two could be replaced by one that goes along the whole path. It is made at the cheapest pose.
"""

from __future__ import annotations

import numpy as np

from postproc.joints.lattice import Lattice
from postproc.joints.states import (
    BAD,
    CUTS,
    NEVER,
    REWINDS,
    SECONDS,
    WRONG,
    BranchState,
    Segment,
    leading,
    least_of,
    staying,
)
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import TWO_PI
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(to="S", at="S", next="S")
class SegmentChoice:
    """What is done in a segment from each state: a rewind to state `to` (S,) at pose `at` (S,), -1 for none;
    then the state `next` (S,) of the segment after."""

    to: Ints
    at: Ints
    next: Ints


@dataclass(frozen=True)
class RunPiece:
    """Poses first..last of a run in one state; a rewind to the next piece's state follows where `rewind`."""

    first: int
    last: int
    state: BranchState
    rewind: bool


def cheapest(lattice: Lattice, segments: list[Segment], end: Floats, rewinds: bool,
             wrong: Floats) -> tuple[Floats, list[SegmentChoice]]:
    """(cost (S, 5) to the end from each state of the first segment, what is done in each segment).

    Args:
        end: (S, 5) cost of ending in each state of the last segment
        rewinds: False where the tool may not draw back
        wrong: (B, N + 1) poses on the wrong side up to each pose
    """
    choices: list[SegmentChoice] = []
    value, after = end, None
    for segment in reversed(segments):
        out, following = (value, np.zeros(len(segment), dtype=np.int64)) if after is None else _onwards(
            lattice, segment, after, value)
        stay = staying(lattice, segment, wrong)
        value, to, at = stay + out, np.full(len(segment), -1), np.full(len(segment), -1)
        if rewinds and len(segment) > 1:
            turned, places = _rewinding(lattice, segment, wrong)
            every = turned + out[None]
            best = least_of(every)
            cost = every[np.arange(len(segment)), best]
            better = least_of(np.stack([value, cost], axis=1)) == 1
            value = np.where(better[:, None], cost, value)
            to, at = np.where(better, best, -1), np.where(better, places[np.arange(len(segment)), best], -1)
        choices.append(SegmentChoice(to, at, following))
        after = segment
    return value, choices[::-1]


def _onwards(lattice: Lattice, segment: Segment, after: Segment, value: Floats) -> tuple[Floats, Ints]:
    """(cost (S, 5) from the end of a segment on, state of the next segment (S,))."""
    out, following = np.tile(NEVER, (len(segment), 1)), np.full(len(segment), -1)
    for s, travels in enumerate(leading(lattice, segment, after)):
        if travels:
            costs = np.stack([cost + value[k] for k, cost in travels])
            best = int(least_of(costs))
            out[s], following[s] = costs[best], travels[best][0]
    return out, following


def _rewinding(lattice: Lattice, segment: Segment, wrong: Floats) -> tuple[Floats, Ints]:
    """(cost (S, S, 5) of going through a segment with a rewind from one state to another, pose (S, S) of the rewind)."""
    count = len(segment)
    costs, places = np.tile(NEVER, (count, count, 1)), np.full((count, count), -1)
    alike: dict[tuple[int, int, bool, bool, tuple[int, ...]], tuple[Floats, int]] = {}
    for s, t in np.argwhere(_worth_a_rewind(lattice, segment)).tolist():
        (b, turns), (c, others) = segment.states[s], segment.states[t]
        kind = (b, c, bool(segment.bad[s]), bool(segment.bad[t]), tuple(k - n for k, n in zip(others, turns, strict=True)))
        if kind not in alike:  # of windings their difference alone counts
            alike[kind] = _rewind(lattice, segment, s, t, wrong)
        costs[s, t], places[s, t] = alike[kind]
    return costs, places


def _worth_a_rewind(lattice: Lattice, segment: Segment) -> Bools:
    """(S, S) False from a state to itself and to windings farther off than the whole run turns: nearer ones serve as well,
    and an axis of very wide travel has hundreds."""
    turns = np.array([turns for _, turns in segment.states], dtype=np.float64).reshape(len(segment), -1)
    values = lattice.values[:, :, lattice.wound]
    least, most = (end(np.where(np.isfinite(values), values, 0.0), axis=(0, 1)) for end in (np.min, np.max))
    near = np.abs(turns[:, None] - turns[None]) * TWO_PI <= most - least + 2.0 * TWO_PI
    return np.asarray(near.all(axis=2) & ~np.eye(len(segment), dtype=np.bool_))


def _rewind(lattice: Lattice, segment: Segment, s: int, t: int, wrong: Floats) -> tuple[Floats, int]:
    """The cheapest rewind from state s to state t in a segment."""
    (b, turns), (c, others) = segment.states[s], segment.states[t]
    first, last = segment.first, segment.last
    # Outside travel nothing is gained by waiting: the rewind is made at once, or as late as can be.
    only = first if segment.bad[s] else last if segment.bad[t] else -1
    rows = np.array([only]) if only >= 0 else np.arange(first, last + 1)
    travel = lattice.between(lattice.values[b, rows], turns, lattice.values[c, rows], others)
    cost = np.zeros((len(rows), 5))
    cost[:, BAD] = (rows - first + 1) * (segment.bad[s] > 0) + (last - rows + 1) * (segment.bad[t] > 0)
    cost[:, REWINDS] = 1.0
    cost[:, CUTS] = ~lattice.rest[rows]
    cost[:, WRONG] = wrong[b, rows + 1] - wrong[b, first] + wrong[c, last + 1] - wrong[c, rows]
    clock = lattice.clock
    cost[:, SECONDS] = (clock[b, rows] - clock[b, first] + clock[c, last] - clock[c, rows] + lattice.away[rows]
                        + lattice.seconds(travel))
    best = int(least_of(cost))
    return cost[best], int(rows[best])


def pieces(segments: list[Segment], choices: list[SegmentChoice], start: int) -> list[RunPiece]:
    """The states taken from state `start` of the first segment on, neighbours of the same state joined."""
    result: list[RunPiece] = []
    state = start
    for segment, choice in zip(segments, choices, strict=True):
        first = segment.first
        if choice.to[state] >= 0:
            at = int(choice.at[state])
            _append(result, RunPiece(first, at, segment.states[state], True))
            state, first = int(choice.to[state]), at + 1
        if first <= segment.last:
            _append(result, RunPiece(first, segment.last, segment.states[state], False))
        state = int(choice.next[state])
    return result


def _append(result: list[RunPiece], piece: RunPiece) -> None:
    if result and not result[-1].rewind and result[-1].state == piece.state:
        piece = RunPiece(result.pop().first, piece.last, piece.state, piece.rewind)
    result.append(piece)


def wrong_side(lattice: Lattice, side: dict[int, int]) -> Floats:
    """(B, N + 1): poses up to each where a joint stands on the other side of 0 than `side` (joint: +1 or -1) prefers."""
    off: Bools = np.zeros(lattice.values.shape[:2], dtype=np.bool_)
    for joint, sign in side.items():
        off |= lattice.values[:, :, joint] * sign < -1e-9
    return np.concatenate([np.zeros((len(off), 1)), np.cumsum(off, axis=1)], axis=1).astype(np.float64)
