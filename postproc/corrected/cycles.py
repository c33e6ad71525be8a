"""Holes of canned cycles: one correction for all blocks of a hole, so that it stays one, where that is near enough."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from postproc.corrected.arcs import LOOKS
from postproc.corrected.reversals import LOOSE
from postproc.corrected.work import ALONE, Work
from postproc.moves import Moves
from postproc.path import FEED, TRAVERSE, Path
from toolpaths.arrays import Bools, Floats, Ints

SAME = 1e-6
"""mm: places nearer than this are one"""

IN_AIR = 8.0
"""times the share of the correction: what lost motion may leave at the levels of a hole that the tool comes back to"""


def whole_holes(path: Path, nominal: Path, moves: Moves, work: Work, allowed: float, always: Bools) -> tuple[Path, Ints]:
    """The path with holes corrected as a whole, and the hole (K,) that each block is of, ALONE for those of none.

    Every block of a hole is corrected as its bottom is, but along the tool: the plane that drilling begins at gets the
    least correction of the bottoms of the holes that follow each other, so that one plane serves all of them and no peck is
    added, levels above it that of the block that the tool comes from to the first. Holes that this takes farther than LOOSE
    times `allowed` mm from where they belong keep the corrections of their blocks and are written out, but for those of
    cycles that `always` (C,) stay cycles.
    """
    hole = np.where(np.isnan(path.u) | path.home, -1, moves.hole[path.move])
    runs = np.flatnonzero(np.concatenate([[True], np.diff(hole) != 0]))
    whole, q = np.full(len(path), ALONE), path.q.copy()
    kept = np.append(always, False)[moves.cycle[path.move]]
    for rows in _sequences(path, hole, runs, work):
        _correct_sequence(path, nominal, rows, work, np.where(kept, np.inf, allowed), q, whole)
    return replace(path, q=q), whole


def _sequences(path: Path, hole: Ints, runs: Ints, work: Work) -> list[list[Ints]]:
    """Holes (their block numbers) that follow each other with one tool in one frame at one orientation."""
    found: list[list[Ints]] = []
    for first, last in zip(runs, np.append(runs[1:], len(hole)), strict=True):
        rows = np.arange(first, last)
        if hole[first] < 0 or first == 0 or not (path.code[rows] == FEED).any() or not _one_place(path, rows, work):
            continue
        joined = found and found[-1][-1][-1] == first - 1 and _one_place(path, np.array([first - 1, first]), work)
        found[-1].append(rows) if joined else found.append([rows])
    return found


def _one_place(path: Path, rows: Ints, work: Work) -> bool:
    """True where blocks share frame, tool and rotary axes."""
    turns = path.q[rows][:, work.rotary]
    return bool((path.frame[rows] == path.frame[rows[0]]).all() and (work.tools[rows] == work.tools[rows[0]]).all()
                and (turns == turns[0]).all())


def _correct_sequence(path: Path, nominal: Path, holes: list[Ints], work: Work, allowed: Floats, q: Floats,
                      whole: Ints) -> None:
    """Put the joints of the holes that stay whole into `q`, and mark them in `whole`; allowed (K,) mm."""
    lead = int(holes[0][0]) - 1
    kin = work.kinematics(int(work.tools[lead + 1]))
    new, old = (p.frames[int(p.frame[lead + 1])].control for p in (path, nominal))
    at = [_Hole(rows, old.words(nominal.q[rows], kin, 0.0)[:, new.xyz], new.words(path.q[rows], kin, 0.0)[:, new.xyz],
                path.code[rows] == FEED) for rows in holes]
    at = [hole for hole in at if hole.along_z]
    if not at:
        return
    least = min(hole.off[2] for hole in at)
    before, came = old.words(nominal.q[[lead]], kin, 0.0), new.words(path.q[[lead]], kin, 0.0)
    z = new.xyz[2]
    if abs(before[0, z] - at[0].plane) <= SAME and path.code[lead] != FEED and not path.home[lead]:
        came[0, z] = before[0, z] + least
        q[lead] = np.where(work.rotary, path.q[lead], new.joints(came, kin, 0.0)[0])
    for hole in at:
        words = new.words(path.q[hole.rows], kin, 0.0)
        words[:, new.xyz] = hole.corrected(least, float((came - before)[0, z]))
        joints = np.where(work.rotary, path.q[hole.rows], new.joints(words, kin, 0.0))
        way = np.tile(work.way[hole.rows[hole.bottom]], (len(hole.rows), 1))
        share = allowed[hole.rows]
        if _approach_off(path, work, q, joints, int(hole.rows[0]), float(share[0])) <= IN_AIR * share[0] and (
                work.off(nominal.q[hole.rows], joints, hole.rows, way) <= LOOSE * share).all() and (
                work.off(nominal.q[hole.rows], joints, hole.rows, work.way[hole.rows]) <= IN_AIR * share).all():
            q[hole.rows], whole[hole.rows] = joints, hole.rows[0]


def _approach_off(path: Path, work: Work, q: Floats, joints: Floats, row: int, share: float) -> float:
    """mm, largest distance from the nominal motion on the way to a hole (block `row`), which gets no points; 0 where the
    correction changes by no more than `share` mm over one stretch of the errors."""
    change = joints[0] - q[row - 1] - (work.path.q[row] - work.path.q[row - 1])
    near = work.changes(q[row - 1:row], joints[:1])[0] == 1 and np.abs(change).max() <= share
    if path.code[row] != TRAVERSE or near:
        return 0.0
    block, t = np.full(len(LOOKS), row), np.array(LOOKS)
    got = work.straight(path, np.tile(q[row - 1], (len(t), 1)), np.tile(joints[0], (len(t), 1)), block, t)
    way = np.tile(work.way[row], (len(t), 1))
    return float(work.off(work.nominal(block, t), got, block, way).max())


@dataclass(frozen=True)
class _Hole:
    """A hole in words X, Y, Z: `wanted` (N, 3) nominal, `found` (N, 3) corrected block by block; `feeds` (N,) drill."""

    rows: Ints
    wanted: Floats
    found: Floats
    feeds: Bools

    @cached_property
    def bottom(self) -> int:
        """Number of the deepest block."""
        return int(np.argmin(np.where(self.feeds, self.wanted[:, 2], np.inf)))

    @cached_property
    def start(self) -> int:
        """Number of the block that ends where drilling begins."""
        return max(int(np.argmax(self.feeds)) - 1, 0)

    @property
    def along_z(self) -> bool:
        """False where the tool does not come down along Z of the words: no control drills that by itself."""
        down = self.wanted[self.bottom, 2] < self.wanted[self.start, 2]
        return bool(down and np.ptp(self.wanted[self.start:, :2], axis=0).max() <= SAME)

    @property
    def plane(self) -> float:
        """Level where drilling begins, nominal."""
        return float(self.wanted[self.start, 2])

    @property
    def off(self) -> Floats:
        """(3,) correction of the bottom."""
        return np.asarray(self.found[self.bottom] - self.wanted[self.bottom])

    def corrected(self, plane: float, above: float) -> Floats:
        """(N, 3) all as the bottom, along the tool `plane` for the plane and `above` for what is above it."""
        result = self.wanted + self.off
        z = self.wanted[:, 2]
        result[:, 2] = z + np.where(z < self.plane - SAME, self.off[2], np.where(z <= self.plane + SAME, plane, above))
        return result
