"""Points between the corrected ends of blocks, where the motion would leave the nominal one."""

from __future__ import annotations

import numpy as np

from postproc.correction.arcs import LOOKS as ARC_LOOKS
from postproc.correction.error_context import ALONE, MOMENT, ErrorContext
from postproc.correction.error_sampling import looks_between
from postproc.correction.reversals import LOOSE, SHORTEST, Divided, Starts, inserted, reversals, stretches
from postproc.path.model import ARC, FEED, TRAVERSE, JointPath
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

LOOKS = (1.0 / 64.0, *ARC_LOOKS)
"""where pieces are looked at; the first is past the corner of a dog-leg, where the correction of an axis has come"""
ROUNDS = 20
"""how often a block is halved at most; SHORTEST ends it before"""
LEAST = 0.2
"""of what is allowed, where the axis turns fast"""


def divided(path: JointPath, work: ErrorContext, starts: Starts, allowed: float) -> Divided:
    """The path with its blocks halved until their motion is near enough to the nominal one (`allowed` mm, see `_bound`)."""
    return inserted(path, *between(path, work, starts, allowed))


def between(path: JointPath, work: ErrorContext, starts: Starts,
            allowed: float) -> tuple[Ints, Floats, Floats]:
    """(block (M,), fraction (M,), joints (M, J)) of the points that `divided` inserts."""
    block = np.flatnonzero(stretches(path))
    block = block[~path.home[block - 1] & (work.whole[block] == ALONE)]
    pieces, found = _taken_up(path, work, starts, block, allowed)
    for _ in range(ROUNDS):
        pieces = pieces.rows(_off(pieces, path, work) > _bound(pieces, path, work, allowed))
        if not len(pieces.block):
            break
        middle = 0.5 * (pieces.t0 + pieces.t1)
        there, approach = work.nominal(pieces.block, middle), work.approach_at(pieces.block, middle)
        q = work.corrected(there, pieces.block, approach, path)
        found.append((pieces.block, middle, q))
        pieces = pieces.halved(middle, q, approach)
        pieces = pieces.rows(_long(pieces, work))
    where, share, joints = (np.concatenate(column) for column in zip(*found, strict=True))
    return where, share, joints


@dataclass(frozen=True)
@arrays(block="N", t0="N", t1="N", q0="N J", q1="N J", approach="N J", behind="N")
class BlockPieces:
    """Parts t0..t1 (N,) of blocks (N,) with the corrected joints (N, J) at their ends, and the approach
    directions (N, J) at t0; mm (N,)
    that the tip is off at t0 of rapids behind holes that are corrected as a whole: no point between fixes that."""

    block: Ints
    t0: Floats
    t1: Floats
    q0: Floats
    q1: Floats
    approach: Floats
    behind: Floats

    def rows(self, keep: Bools | Ints) -> BlockPieces:
        """Some of them."""
        return BlockPieces(self.block[keep], self.t0[keep], self.t1[keep], self.q0[keep], self.q1[keep], self.approach[keep],
                           self.behind[keep])

    def halved(self, middle: Floats, q: Floats, approach: Floats) -> BlockPieces:
        """Both halves of each, joints and approach directions in the middle being q and approach direction."""
        return BlockPieces(np.tile(self.block, 2), np.concatenate([self.t0, middle]), np.concatenate([middle, self.t1]),
                       np.concatenate([self.q0, q]), np.concatenate([q, self.q1]), np.concatenate([self.approach, approach]),
                           np.concatenate([self.behind, np.zeros(len(q))]))


def _taken_up(path: JointPath, work: ErrorContext, starts: Starts, block: Ints,
              allowed: float) -> tuple[BlockPieces, list[tuple[Ints, Floats, Floats]]]:
    """The blocks as pieces, cut where an axis turns back, and the points that take up what it loses by that.

    At a block's start that is one point, inside a block two at one place: corrected by the old approach
    direction and by the new one.
    """
    zero = np.zeros(len(block))
    turning, at = reversals(work, block[path.code[block] == FEED])
    there = work.nominal(turning, at)
    before, after = (work.approach_at(turning, t) for t in (at, np.minimum(at + 2.0 * MOMENT, 1.0)))
    old, new = (work.corrected(there, turning, approach, path) for approach in (before, after))
    cut = np.abs(new - old).max(axis=1, initial=0.0) > allowed
    turning, at, old, new, after = turning[cut], at[cut], old[cut], new[cut], after[cut]
    owner = np.concatenate([block, turning])
    t0, t1 = np.concatenate([zero, at]), np.concatenate([zero + 1.0, at])
    begins, ends = np.lexsort((t0, owner)), np.lexsort((t1, owner))
    pieces = BlockPieces(owner[begins], t0[begins], t1[ends], np.concatenate([starts.q[block], new])[begins],
                         np.concatenate([path.q[block], old])[ends], np.concatenate([starts.approach[block], after])[begins],
                         np.concatenate([_behind(path, work, starts, block), 0.0 * at])[begins])
    back = starts.block
    return pieces, [(back, np.zeros(len(back)), starts.q[back]), (turning, at, old), (turning, at, new)]


def _behind(path: JointPath, work: ErrorContext, starts: Starts, block: Ints) -> Floats:
    """`behind` (N,) of blocks (N,) as a whole."""
    result, k = np.zeros(len(block)), np.flatnonzero((path.code[block] == TRAVERSE) & (work.whole[block - 1] != ALONE))
    rows = block[k]
    result[k] = work.off(work.nominal(rows, np.zeros(len(rows))), starts.q[rows], rows, starts.approach[rows])
    return result


def _off(pieces: BlockPieces, path: JointPath, work: ErrorContext) -> Floats:
    """(N,) mm, largest distance from the nominal motion at LOOKS, and at more where errors change their course between."""
    worst, count = np.zeros(len(pieces.block)), work.changes(pieces.q0, pieces.q1)
    for look in LOOKS:
        worst = np.maximum(worst, _off_at(pieces, np.full(len(worst), look), path, work))
    for rows, share in looks_between(count):
        np.maximum.at(worst, rows, _off_at(pieces.rows(rows), share, path, work))
    return worst


def _off_at(pieces: BlockPieces, t: Floats, path: JointPath, work: ErrorContext) -> Floats:
    """(N,) mm from the nominal motion at t (N,) of pieces, beyond what is left of what their beginning is off by."""
    at = pieces.t0 + t * (pieces.t1 - pieces.t0)
    got = work.straight(path, pieces.q0, pieces.q1, pieces.block, t)
    approach = work.played(pieces.approach, pieces.q0, got)
    return np.asarray(work.off(work.nominal(pieces.block, at), got, pieces.block, approach) - (1.0 - t) * pieces.behind)


def _bound(pieces: BlockPieces, path: JointPath, work: ErrorContext, allowed: float) -> Floats:
    """(N,) mm: less where the axis turns so fast that the tip's being late would cost more than its share of
    the axis tolerance; LOOSE times as much for rapids and arcs."""
    ends = [np.concatenate(work.poses(work.nominal(pieces.block, t), pieces.block), axis=1) for t in (pieces.t0, pieces.t1)]
    approach, turn = (np.linalg.norm((ends[1] - ends[0])[:, part], axis=1) for part in (slice(0, 3), slice(3, 6)))
    late = work.axis_share * approach / np.where(turn > 0.0, turn, 1.0)
    cutting = np.where(turn > 0.0, np.clip(late, LEAST * allowed, allowed), allowed)
    loose = (path.code[pieces.block] != FEED) | (work.path.code[pieces.block] == ARC)
    result: Floats = np.where(loose, LOOSE * allowed, cutting)
    return result


def _long(pieces: BlockPieces, work: ErrorContext) -> Bools:
    """True (N,) for pieces that are worth halving."""
    step = np.abs(work.nominal(pieces.block, pieces.t1) - work.nominal(pieces.block, pieces.t0))
    result: Bools = (step / np.where(work.rotary, DEG, 1.0)).max(axis=1) > SHORTEST
    return result
