"""Holes of canned cycles: one correction for all blocks of a hole, so that it stays one, where that is near enough."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from machines.geometric_error.actual.lost_motion import GRAIN
from postproc.base.group_rows import groups
from postproc.correction.arcs import LOOKS
from postproc.correction.error_context import ALONE, LIFTS, ErrorContext
from postproc.correction.reversals import LOOSE
from postproc.correction.runs import RowRuns
from postproc.path.model import FEED, JointPath
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.toolpath import Kind

SAME = 0.5 * GRAIN[0]
"""mm: places nearer than this are one"""

IN_AIR = 8.0
"""times the share of the correction: what lost motion may leave at the levels of a hole that the tool comes back to"""


def whole_holes(path: JointPath, nominal: JointPath, moves: Moves, work: ErrorContext, allowed: float,
                always: Bools) -> tuple[JointPath, Ints]:
    """The path with holes corrected as a whole, and for each block (K,) its hole or ALONE or LIFTS; sets `work.level`.

    Every block of a hole is corrected as its bottom is, but along the tool: the planes that drilling begins
    at get the least correction of the bottoms of the holes that follow each other, so that one plane serves
    all of them and no peck is added, levels above them that of the block that the tool comes from to the
    first. A block that lifts the tool to the plane of the next hole goes with the hole that it lifts it from;
    those that bring it to the first from afar are corrected alone. Holes that this takes farther than LOOSE
    times `allowed` mm from where they belong keep the corrections of their blocks and are written out, but
    for those of cycles that `always` (C,) stay cycles: these have planes of their own where one does not serve them.
    """
    hole = np.where(np.isnan(path.u) | path.home, -1, moves.hole[path.move])
    feeds = moves.kind[path.move] != Kind.RAPID
    runs, owner, lifts = _sequences(path, nominal, hole, feeds, work)
    holes, whole, q = _along_tool(path, nominal, work, runs, owner, feeds), np.full(len(path), ALONE), path.q.copy()
    if not len(holes.runs) or (path.frames[0].control.xyz < 0).any():  # no words X, Y, Z: no cycles
        return path, whole
    holes = holes.without_first(holes.from_afar(LOOSE * allowed))
    stay = np.append(always, False)[moves.cycle[path.move[holes.rows]]]
    holes = replace(holes, apart=stay[holes.first] & (holes.spread > LOOSE * allowed))
    share = np.where(stay, np.inf, allowed)
    lead, moved, above = _leads(path, nominal, work, holes)
    joints = _joints(path, work, holes.owner[holes.hole], path.q[holes.rows], holes.corrected(above))
    near = _near(nominal, work, holes, joints, share)
    q[lead] = moved
    near = _approached(replace(path, q=q), work, holes, joints, share, near, lead)
    rows = near[holes.hole]
    q[holes.rows[rows]], whole[holes.rows[rows]] = joints[rows], holes.runs.begin[holes.hole[rows]]
    q[lead], work.level = moved, np.isin(np.arange(len(path)), lead[whole[lead + 1] >= 0])
    lifts = lifts[whole[lifts] == ALONE]
    q[lifts], whole[lifts] = _lifted(path, q, work, lifts), LIFTS
    return replace(path, q=q), whole


def _sequences(path: JointPath, nominal: JointPath, hole: Ints, feeds: Bools,
               work: ErrorContext) -> tuple[RowRuns, Ints, Ints]:
    """Holes at one orientation with one tool in one frame, as runs of blocks; for each (H,) the first block
    of all that follow each other so; and blocks that lift the tool to the plane of the next, none of this but
    of the one before."""
    runs, turns = RowRuns.of(hole), path.q[:, work.turning]
    same = np.append(False, (np.diff(path.frame) == 0) & (np.diff(work.tools) == 0) & (turns[1:] == turns[:-1]).all(axis=1))
    same[1:] &= work.stands[1:]
    drills = np.logical_or.reduceat(feeds, runs.begin)
    fine = (hole[runs.begin] >= 0) & (runs.begin > 0) & drills & runs.throughout(same | (np.diff(hole, prepend=-2) != 0))
    joined = same[runs.begin] & np.append(False, fine[:-1])
    lifts = np.flatnonzero(fine & same[runs.begin] & ~feeds[runs.begin] & (runs.size > 1))
    lifts = lifts[_lifting(nominal, work, runs.begin[lifts])]
    begin, end = runs.begin.copy(), runs.last + 1
    begin[lifts] += 1
    end[lifts - 1] += joined[lifts]
    first = np.maximum.accumulate(np.where(joined, 0, begin))
    return RowRuns(begin, end - begin).some(fine), first[fine], runs.begin[lifts]


def _lifting(path: JointPath, work: ErrorContext, block: Ints) -> Bools:
    """(N,) blocks (N,) that go up along Z of the words and nowhere else."""
    step = np.subtract(*(_words(path, work, block, path.q[k]) for k in (block, block - 1)))
    across = np.abs(step[:, :2]).max(axis=1, initial=0.0)
    return np.asarray((step[:, 2] > SAME) & (across <= SAME) & ~path.home[block - 1])


def _lifted(path: JointPath, q: Floats, work: ErrorContext, block: Ints) -> Floats:
    """Joints (N, J) of blocks (N,) that go up from where the block before ends at joints (K, J), along Z of the words."""
    xyz = np.append(_words(path, work, block, q[block - 1])[:, :2],
                    _words(path, work, block, q[block])[:, 2:], axis=1)
    return _joints(path, work, block, q[block], xyz)


@dataclass(frozen=True)
@arrays(owner="H", wanted="M 3", found="M 3", feeds="M", plane="H", apart="H")
class _Holes:
    """H holes of M blocks in words X, Y, Z.

    runs: their blocks; owner: (H,) first block of the holes that follow each other; feeds: (M,) blocks that drill
    wanted: (M, 3) nominal; found: (M, 3) corrected block by block
    plane: (H,) levels where drilling begins, nominal; apart: (H,) those with planes of their own
    """

    runs: RowRuns
    owner: Ints
    wanted: Floats
    found: Floats
    feeds: Bools
    plane: Floats
    apart: Bools

    @cached_property
    def rows(self) -> Ints:
        """(M,) blocks."""
        return self.runs.rows

    @cached_property
    def hole(self) -> Ints:
        """(M,) number of the hole."""
        return self.runs.of_rows

    @cached_property
    def first(self) -> Ints:
        """(H,) row of each hole's first block."""
        return self.runs.packed().begin

    @cached_property
    def bottom(self) -> Ints:
        """(H,) row of the deepest block."""
        return self.runs.least(np.where(self.feeds, self.wanted[:, 2], np.inf))

    @cached_property
    def start(self) -> Ints:
        """(H,) row of the block that ends where drilling begins."""
        return np.asarray(np.maximum(self.runs.first(self.feeds) - 1, self.first))

    @property
    def along_z(self) -> Bools:
        """(H,) False where the tool does not come down along Z of the words: no control drills that by itself."""
        down = self.wanted[self.bottom, 2] < self.wanted[self.start, 2]
        inside = (np.arange(len(self.hole)) >= self.start[self.hole])[:, None]
        flat = self.wanted[:, :2]
        wide = np.maximum.reduceat(np.where(inside, flat, -np.inf), self.first) - np.minimum.reduceat(
            np.where(inside, flat, np.inf), self.first)
        return np.asarray(down & (wide.max(axis=1) <= SAME))

    @cached_property
    def top(self) -> Floats:
        """(S,) highest plane of each sequence."""
        return np.asarray(np.maximum.reduceat(self.plane, self.sequences.begin))

    @cached_property
    def off(self) -> Floats:
        """(H, 3) correction of the bottom."""
        return np.asarray(self.found[self.bottom] - self.wanted[self.bottom])

    @cached_property
    def sequences(self) -> RowRuns:
        """Those that follow each other, as runs of holes."""
        return RowRuns.of(self.owner)

    @cached_property
    def least(self) -> Floats:
        """(S,) least correction along the tool of each sequence."""
        return np.minimum.reduceat(self.off[:, 2], self.sequences.begin)

    @property
    def spread(self) -> Floats:
        """(H,) mm between the corrections along the tool of the holes of each one's sequence."""
        most = np.maximum.reduceat(self.off[:, 2], self.sequences.begin)
        return np.asarray((most - self.least)[self.sequences.of_rows])

    @cached_property
    def level(self) -> Floats:
        """(H,) correction along the tool of each hole's plane."""
        return np.asarray(np.where(self.apart, self.off[:, 2], self.least[self.sequences.of_rows]))

    def from_afar(self, most: float) -> Ints:
        """(H,) blocks that bring the tool over the first hole of a sequence from above all planes, and down to it where it
        goes back no farther: where the correction across the tool differs by more than `most` mm from that at the bottom."""
        first, last, top = self.first, self.runs.packed().last, self.top[self.sequences.of_rows] + SAME
        across = np.linalg.norm((self.found[first] - self.wanted[first] - self.off)[:, :2], axis=1)
        far = (self.wanted[first, 2] > top) & (self.start > first) & (self.owner == self.runs.begin) & (across > most)
        return np.asarray(np.where(far, np.where(self.wanted[last, 2] > top, 1, self.start - first + 1), 0))

    def without_first(self, count: Ints) -> _Holes:
        """All without the first `count` (H,) blocks."""
        keep = np.arange(len(self.rows)) >= (self.first + count)[self.hole]
        owner = self.owner + count[self.sequences.begin][self.sequences.of_rows]
        return _Holes(RowRuns(self.runs.begin + count, self.runs.size - count), owner, self.wanted[keep], self.found[keep],
                      self.feeds[keep], self.plane, self.apart)

    def corrected(self, above: Floats) -> Floats:
        """(M, 3) all as the bottom, along the tool as `level` for the planes and `above` (S,) for what is above them."""
        z, sequence = self.wanted[:, 2], self.sequences.of_rows[self.hole]
        result = self.wanted + self.off[self.hole]
        result[:, 2] = z + np.where(z < self.plane[self.hole] - SAME, self.off[self.hole, 2],
                                    np.where(z <= self.top[sequence] + SAME, self.level[self.hole], above[sequence]))
        return result

    def some(self, keep: Bools) -> _Holes:
        """Some of them."""
        mine = keep[self.hole]
        return _Holes(self.runs.some(keep), self.owner[keep], self.wanted[mine], self.found[mine], self.feeds[mine],
                      self.plane[keep], self.apart[keep])


def _along_tool(path: JointPath, nominal: JointPath, work: ErrorContext, runs: RowRuns, owner: Ints,
                feeds: Bools) -> _Holes:
    """The holes of some runs that are drilled along Z of the words."""
    rows, frames = runs.rows, np.repeat(owner, runs.size)
    wanted, found = (_words(p, work, frames, p.q[rows]) for p in (nominal, path))
    holes = _Holes(runs, owner, wanted, found, feeds[rows], np.zeros(len(runs)),
                   np.zeros(len(runs), dtype=np.bool_))
    return replace(holes, plane=wanted[holes.start, 2]).some(holes.along_z) if len(runs) else holes


def _words(path: JointPath, work: ErrorContext, owner: Ints, q: Floats) -> Floats:
    """(N, 3) words X, Y, Z of joints (N, J) by the law of blocks (N,)."""
    result = np.empty((len(q), 3))
    for k in groups(path.frame[owner], work.tools[owner]):
        control, kin = path.frames[int(path.frame[owner[k[0]]])].control, work.kinematics(int(work.tools[owner[k[0]]]))
        result[k] = control.words(q[k], kin, 0.0)[:, control.xyz]
    return result


def _joints(path: JointPath, work: ErrorContext, owner: Ints, q: Floats, xyz: Floats) -> Floats:
    """Joints (N, J) that are q (N, J) but at other words X, Y, Z (N, 3), by the law of blocks (N,)."""
    result = np.empty_like(q)
    for k in groups(path.frame[owner], work.tools[owner]):
        control, kin = path.frames[int(path.frame[owner[k[0]]])].control, work.kinematics(int(work.tools[owner[k[0]]]))
        words = control.words(q[k], kin, 0.0)
        words[:, control.xyz] = xyz[k]
        result[k] = np.where(work.rotary, q[k], control.joints(words, kin, 0.0))
    return result


def _leads(path: JointPath, nominal: JointPath, work: ErrorContext,
           holes: _Holes) -> tuple[Ints, Floats, Floats]:
    """Blocks (N,) before holes that come to planes of these, their joints (N, J) at the correction of planes,
    and what the blocks before holes are corrected by along the tool (S,)."""
    first = holes.sequences.begin
    owner, plane = holes.owner[first], holes.plane[first]
    lead = owner - 1
    before, came = (_words(p, work, owner, p.q[lead]) for p in (nominal, path))
    level = (before[:, 2] >= plane - SAME) & (before[:, 2] <= holes.top + SAME)
    level &= (path.code[lead] != FEED) & ~path.home[lead]
    came[level, 2] = before[level, 2] + holes.level[first][level]
    return lead[level], _joints(path, work, owner[level], path.q[lead[level]], came[level]), (came - before)[:, 2]


def _near(nominal: JointPath, work: ErrorContext, holes: _Holes, joints: Floats, share: Floats) -> Bools:
    """(H,) holes that joints (M, J) leave within LOOSE times `share` (M,) mm of where they belong by the
    approach directions at their bottoms, and within IN_AIR times that by the approach directions of their blocks."""
    rows = holes.rows
    bottom = work.approach[rows[holes.bottom]][holes.hole]
    fine = work.off(nominal.q[rows], joints, rows, bottom) <= LOOSE * share
    return holes.runs.throughout(fine & (work.off(nominal.q[rows], joints, rows, work.approach[rows]) <= IN_AIR * share))


def _approached(path: JointPath, work: ErrorContext, holes: _Holes, joints: Floats, share: Floats, near: Bools,
                lead: Ints) -> Bools:
    """(H,) those of the holes that are `near` (H,) whose approach is near enough: from the hole before at its
    joints (M, J) where that stays whole, else from where `path` is; blocks `lead` (N,) stand."""
    row, limit = holes.runs.begin, IN_AIR * share[holes.first]
    follows = np.append(False, holes.runs.last[:-1] + 1 == row[1:]) & ~np.isin(row - 1, lead)
    both = np.flatnonzero(near & follows & np.append(False, near[:-1]))
    result, behind = near.copy(), np.zeros(len(near), dtype=np.bool_)
    for k, q, noted in ((np.flatnonzero(near), path.q[row - 1], result),
                        (both, joints[holes.first - 1], behind)):
        noted[k] = _approach_off(path, work, q[k], joints[holes.first[k]], row[k], share[holes.first[k]]) <= limit[k]
    for h in both.tolist():
        if result[h - 1]:
            result[h] = behind[h]
    return result


def _approach_off(path: JointPath, work: ErrorContext, q0: Floats, q1: Floats, row: Ints,
                  share: Floats) -> Floats:
    """(N,) mm, largest distance from the nominal motion on the path from q0 to q1 (N, J), to holes (blocks
    `row`), which get no points; 0 where the correction changes by no more than `share` (N,) mm over one
    stretch of the errors."""
    change = q1 - q0 - (work.path.q[row] - work.path.q[row - 1])
    near = (work.changes(q0, q1) == 1) & (np.abs(change).max(axis=1, initial=0.0) <= share)
    far, looks = np.flatnonzero(~near), len(LOOKS)
    k, t = np.repeat(far, looks), np.tile(LOOKS, len(far))
    got = work.straight(path, q0[k], q1[k], row[k], t)
    result = np.zeros(len(row))
    result[far] = work.off(work.nominal(row[k], t), got, row[k], work.approach[row[k]]).reshape(-1, looks).max(axis=1)
    return result
