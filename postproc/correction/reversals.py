"""Where axes turn back: blocks begin by the new approach direction, arcs are cut there; and points put into a path."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from machines.geometric_error.actual.lost_motion import carried_on
from postproc.control.word_arcs import PLANE_COLUMNS
from postproc.correction.error_context import ALONE, EDGES, ErrorContext
from postproc.path.model import ARC, FEED, TRAVERSE, JointPath
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

BISECTIONS = 14
"""halvings to find where between two looks an axis turns back"""
LOOSE = 4.0
"""times the share of the correction for rapids of the CL file, and for arcs and the lines that replace them,
which take no share of linearising; linking moves only have to come to their ends"""
SHORTEST = 0.05
"""mm of the path of the tip or degrees of a rotary axis: a block that short is not divided"""


def arcs_cut(path: JointPath, work: ErrorContext) -> Divided:
    """The path with arcs cut where an axis that loses motion turns back."""
    arcs = np.flatnonzero((path.code == ARC) & (np.arange(len(path)) > 0))
    block, t = reversals(work, arcs)
    q = work.nominal(block, t)
    apart = [np.linalg.norm(q - other, axis=1) > SHORTEST for other in (path.q[block - 1], path.q[block])]
    again = np.concatenate([[False], (block[1:] == block[:-1]) & (np.linalg.norm(np.diff(q, axis=0), axis=1) <= SHORTEST)]) \
        if len(block) else np.zeros(0, dtype=bool)
    keep = apart[0] & apart[1] & ~again
    block, t = block[keep], t[keep]
    made = inserted(path, block, t, work.nominal(block, t))
    cut, owner, tools = made.path, made.owner, work.tools
    center = cut.center.copy()
    for k in np.flatnonzero((owner[1:] == owner[:-1]) & (cut.code[1:] == ARC)) + 1:
        control, kin = cut.frames[int(cut.frame[k])].control, work.kinematics(int(tools[owner[k]]))
        ends = control.words(np.stack([path.q[owner[k] - 1], cut.q[k - 1]]), kin, 0.0)[:, control.xyz]
        flat = list(PLANE_COLUMNS[int(cut.plane[k])])
        center[k, flat] -= (ends[1] - ends[0])[flat]
    return replace(made, path=replace(cut, center=center))


@dataclass(frozen=True)
@arrays(q="K J", approach="K J", block="N")
class Starts:
    """Joints (K, J) and approach directions (K, J) where blocks begin when corrected; those of `block` (N,)
    after taking up what an axis has lost."""

    q: Floats
    approach: Floats
    block: Ints


def starts_of(path: JointPath, nominal: JointPath, work: ErrorContext, allowed: float) -> Starts:
    """Corrected joints where blocks begin; those in which an axis turns back begin by the new approach
    direction, where that moves one by more than `allowed` mm, rapids LOOSE times as much."""
    start, begun = (np.concatenate([x[:1], x[:-1]]) for x in (path.q, work.approach))
    block = np.flatnonzero(stretches(path) | ((path.code == ARC) & (np.arange(len(path)) > 0)))
    block = block[~path.home[block] & ~path.home[block - 1] & (work.whole[block] == ALONE)]
    approach = work.begin_approach(block)
    turned = np.any(approach * work.approach[block - 1] < 0.0, axis=1)
    back = block[turned]
    q = work.corrected(nominal.q[back - 1], back, approach[turned], path)
    loose = np.where(path.code[back] == TRAVERSE, LOOSE, 1.0)
    jump = np.abs(q - start[back]).max(axis=1, initial=0.0) > loose * allowed
    start[back[jump]], begun[back[jump]] = q[jump], approach[turned][jump]
    return Starts(start, begun, back[jump])


def stretches(path: JointPath) -> Bools:
    """(K,) feed moves and rapids of the CL file, straight ones: their path counts, not their ends alone."""
    straight = (path.code == FEED) | (path.code == TRAVERSE)
    return np.asarray(straight & np.isfinite(path.u) & ~path.home & (np.arange(len(path)) > 0))


def reversals(work: ErrorContext, block: Ints) -> tuple[Ints, Floats]:
    """(block, fraction), by block, of the places inside blocks where a joint that loses motion turns back.

    On arcs a joint may do so twice; on straight blocks once, and only where the words are the tip.
    """
    arc = work.path.code[block] == ARC
    tip = np.array([frame.control.law == "tcp" for frame in work.path.frames])[work.path.frame[block]]
    found = [_bisected(work, block[arc], EDGES), _bisected(work, block[~arc & tip], (0.0, 1.0))]
    where, at = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.lexsort((at, where))
    return where[order], at[order]


def _bisected(work: ErrorContext, block: Ints, edges: tuple[float, ...]) -> tuple[Ints, Floats]:
    """(block, fraction) of the places where the direction of a joint changes between two of the edges."""
    where, at = [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
    if not len(block) or not work.bidirectional:
        return where[0], at[0]
    last = work.last(block)
    signs = np.stack([work.moving(block, np.full(len(block), t), last) for t in edges])
    for j in work.bidirectional:
        sign = carried_on(signs[:, :, j])
        for i, (one, two) in enumerate(pairwise(sign)):
            rows = np.flatnonzero(one * two < 0.0)
            low, high = np.maximum(edges[i] - last[rows], 0.0), np.full(len(rows), edges[i + 1])
            for _ in range(BISECTIONS if len(rows) else 0):
                middle = 0.5 * (low + high)
                still = work.moving(block[rows], middle)[:, j] == one[rows]
                low, high = np.where(still, middle, low), np.where(still, high, middle)
            where.append(block[rows])
            at.append(low)
    return np.concatenate(where), np.concatenate(at)



@dataclass(frozen=True)
@arrays(owner="K", part="K")
class Divided:
    """A path made of another's blocks: `owner` (K,) which of them each block is of, `part` (K,) of its time."""

    path: JointPath
    owner: Ints
    part: Floats

    @property
    def until(self) -> Floats:
        """(K,) part of the time of its block of the other path that has gone when a block ends."""
        gone = np.cumsum(self.part)
        first = np.flatnonzero(np.diff(self.owner, prepend=-1))
        before = np.repeat((gone - self.part)[first], np.diff(first, append=len(gone)))
        last = np.append(self.owner[1:] != self.owner[:-1], True)
        return np.asarray(np.where(last, 1.0, np.clip(gone - before, 0.0, 1.0)))

    def of(self, before: Divided) -> Divided:
        """The same, reported of the path that `before` was made from."""
        return Divided(self.path, before.owner[self.owner], before.part[self.owner] * self.part)


def inserted(path: JointPath, block: Ints, t: Floats, q: Floats) -> Divided:
    """The path with points (M, J) at fractions t (M,) of blocks (M,): columns, times and beginnings carried along."""
    n = len(path)
    owner = np.concatenate([block, np.arange(n)])
    share = np.concatenate([t, np.ones(n)])
    order = np.lexsort((share, owner))
    owner, share = owner[order], share[order]
    columns = {name: getattr(path, name)[owner] for name in ("move", "code", "home", "plane", "ccw", "center", "state",
                                                             "frame")}
    columns["code"][(share == 0.0) & (columns["code"] == ARC)] = FEED  # taking up on the spot
    first = np.concatenate([[True], owner[1:] != owner[:-1]])
    before = np.where(first, 0.0, np.concatenate([[0.0], share[:-1]]))
    begins = np.concatenate([[0.0], path.u[:-1]])
    fresh = np.concatenate([[True], path.move[1:] != path.move[:-1]]) | ~(begins < path.u)
    begins = np.where(fresh, 0.0, begins)
    u = begins[owner] + share * (path.u - begins)[owner]
    begin = np.searchsorted(owner, path.begin, side="left")
    made = replace(path, q=np.concatenate([q, path.q])[order], u=np.where(share == 1.0, path.u[owner], u),
                   seconds=path.seconds[owner] * (share - before), begin=begin.astype(np.int64), **columns)
    return Divided(made, owner, share - before)
