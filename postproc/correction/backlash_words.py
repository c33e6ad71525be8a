"""The last step of correction: words by whose own approach directions the machine brings the tip where it should be."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from machines.geometric_error.actual.lost_motion import PlaySteps
from postproc.control.word_arcs import PLANE_COLUMNS
from postproc.correction.arcs import new_centers
from postproc.correction.backlash_steps import BlockEnds, walk
from postproc.correction.error_context import ALONE, LIFTS, ErrorContext, axis_positions, bent_blocks, on_arc
from postproc.correction.reversals import Divided
from postproc.correction.runs import RowRuns
from postproc.path.model import ARC, FEED, TRAVERSE, JointPath
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

AT_ONCE = 50_000
"""blocks whose rates are found together"""
PARTS = 16
"""parts of a block whose joints do not run straight, for the approach directions of its axes"""
NOISE = 1e-3
"""of the approach directions: turning back by less is none"""
QUARTERS, NEAR = (0.25, 0.5, 0.75), 16.0
"""where joints are looked at, and the part of their approach direction off the straight one within which none
turns back: bows of second and third order do where they leave it there by a fourth and by an eleventh"""
BEGINS = 0.01
"""weight of what the beginning of a block is off by next to what the end before it is, but where lost motion is taken up"""
CLOSED = 0.05
"""mm between the ends of arcs that count as closed circles"""
ROUNDED = 2.5
"""times what rounding may leave: words that leave more are looked for farther off"""


@dataclass(frozen=True)
@arrays(grain="J")
class Writing:
    """How a path is written.

    words: rounded words (K, J) of its blocks at their ends
    joints: (N, J) of words (N, J) of the blocks (N,) of a path
    turned: joints (N, J) that are written as others are, with the exact rotary joints of the blocks (N,) of a path
    grain: (J,) a last decimal of each word
    """

    words: Callable[[JointPath], Floats]
    joints: Callable[[JointPath, Floats, Ints], Floats]
    turned: Callable[[JointPath, Floats, Ints], Floats]
    grain: Floats


def settled(made: Divided, work: ErrorContext, writing: Writing,
            allowed: float) -> tuple[JointPath, float, Floats]:
    """The path made of the blocks of `work`, with words by which axes that lose motion stand where they
    should; rad, the worst that is left of the axis at ends of CL moves where they do; and the approach
    directions (K, T) by which they do.

    Blocks keep their words where these bring the tip as near as rounding lets them. Closed circles, linking
    moves and blocks that name their axes keep them anyway, points between ends and rapids where they are off
    by no more than `allowed` mm. A hole that is corrected as a whole is moved as a whole, so that its bottom
    is where it should be; centres of arcs go with their ends.
    """
    path = made.path
    if not work.bidirectional or len(_columns(path)) != 3:
        return path, 0.0, np.zeros((len(path), 0))
    written = _Written(made, work, writing)
    n, approaches = walk(written.ends(allowed))
    left, changed = written.axis_left(approaches), np.flatnonzero(n.any(axis=1))
    if not len(changed):
        return path, left, approaches
    chosen, xyz = written.words.copy(), _columns(path)
    chosen[:, xyz] += n * writing.grain[xyz]
    q = path.q.copy()
    q[changed] = writing.turned(path, writing.joints(path, chosen[changed], changed), changed)
    arcs = np.flatnonzero((path.code == ARC) & (n.any(axis=1) | np.append(False, n[:-1].any(axis=1))))
    center = path.center.copy()
    center[arcs] = new_centers(path, arcs, *(words[rows][:, xyz] for words in (written.words, chosen)
                                             for rows in (arcs - 1, arcs)))
    return replace(path, q=q, center=center), left, approaches


def _columns(path: JointPath) -> Ints:
    """Columns of the words X, Y, Z; those of all slides where the machine has other letters."""
    control = path.frames[0].control
    return control.slides if (control.xyz < 0).any() else control.xyz


class _Written:
    """A path with its rounded words (K, J), the joints (K, J) that these mean, and what joints lose there (K, T)."""

    def __init__(self, made: Divided, work: ErrorContext, writing: Writing) -> None:
        self.made, self.path, self.work, self.writing = made, made.path, work, writing
        self.words = writing.words(self.path)
        found = writing.joints(self.path, self.words, np.arange(len(self.path)))
        self.q = np.where(self.path.home[:, None], self.path.q, found)
        self.gap = work.gaps(self.q)

    def ends(self, allowed: float) -> BlockEnds:
        """What `walk` takes."""
        path, size = self.path, len(self.path)
        first, bottom = self._holes()
        bend, last, begin = self._motion()
        free, counts = self._free(), np.arange(size)
        free[first] = np.isfinite(self.q[bottom]).all(axis=1, keepdims=True) * np.array([1.0, 1.0, 0.0])
        counts[first] = bottom
        like = self._like(first)
        back, tip_rates, off, by_approach = self._rates(np.flatnonzero(free.any(axis=1) | (like >= 0)), counts)
        near = 0.5 * np.linalg.norm(tip_rates, axis=(1, 2))
        between = ((self.made.until < 1.0) | (path.code == TRAVERSE)) & (counts == np.arange(size))
        goes_on = np.append(begin[1:], np.zeros((1, begin.shape[1])), axis=0)
        goes_on[first] = 0.0
        goes_on[np.append(self.made.part[1:] == 0.0, False)] = 0.0  # what is lost is taken up next
        later = _none(3, *self.gap.shape)
        later[:, first] = _composed(bend, last, first + 1, bottom - first)
        weight = np.where(between & (self.made.part == 0.0), 1.0, BEGINS)
        enough = np.maximum(ROUNDED * near, np.where(between, allowed, 0.0))
        near = np.where(between, enough, near)
        plain = axis_positions(path, self.work.tools[self.made.owner])
        return BlockEnds(off, by_approach, tip_rates, back, self.gap, bend, last, later, goes_on, weight, plain, near,
                         enough,
                         free,
                         like)

    def axis_left(self, approaches: Floats) -> float:
        """rad, the worst deviation of the axis at ends of CL moves, by approach directions (K, T)."""
        k = np.flatnonzero((self.path.u == 1.0) & (self.made.until == 1.0) & np.isfinite(self.q).all(axis=1))
        if not len(k):
            return 0.0
        approach, owner = np.zeros((len(k), self.q.shape[1])), self.made.owner[k]
        approach[:, self.work.bidirectional] = approaches[k]
        residual = self.work.residual(self.work.nominal(owner, np.ones(len(k))), self.path.q[k],
                                      owner, approach)
        return float(np.linalg.norm(residual[:, 3:], axis=1).max())

    def _like(self, first: Ints) -> Ints:
        """(K,) first block of the hole that a block is of, the one before for those that lift the tool; -1 for others."""
        hole, block = self.work.whole[self.made.owner], np.arange(len(self.path))
        result = np.where(hole < 0, -1, np.maximum.accumulate(np.where(np.isin(block, first), block, 0)))
        result[first] = -1
        return np.asarray(np.where(hole == LIFTS, block - 1, result))

    def _holes(self) -> tuple[Ints, Ints]:
        """First blocks and bottoms of the holes that are corrected as a whole."""
        hole = self.work.whole[self.made.owner]
        runs = RowRuns.of(hole)
        runs = runs.some(hole[runs.begin] >= 0)
        depth = np.where(self.path.code == FEED, self.words[:, _columns(self.path)[2]], np.inf)
        return runs.begin, runs.rows[runs.least(depth[runs.rows])]

    def _free(self) -> Floats:
        """(K, 3) words that may be others; not those of closed circles, of arcs and before them those of
        their planes alone where the control has no helix there."""
        path, words = self.path, self.words
        fixed = path.home | np.isnan(path.u) | path.state.any(axis=1) | (self.work.whole[self.made.owner] != ALONE)
        result = np.where(fixed | ~np.isfinite(self.q).all(axis=1), 0.0, 1.0)[:, None] * np.ones(3)
        result[self.work.level[self.made.owner] & (self.made.until == 1.0), 2] = 0.0
        xyz, helix = _columns(path), np.zeros(len(path), dtype=np.bool_)
        for law, k in path.by_control():
            helix[k] = np.isin(path.plane[k], law.helix_planes)
        for plane, flat in PLANE_COLUMNS.items():
            arcs = np.flatnonzero((path.code == ARC) & (path.plane == plane))
            chord = np.linalg.norm((words[arcs] - words[arcs - 1])[:, xyz[list(flat)]], axis=1)
            open_ = (chord > CLOSED) & (path.frame[arcs] == path.frame[arcs - 1])
            for rows in (arcs, arcs - 1):
                result[rows] *= open_[:, None] * (np.isin(np.arange(3), flat) | helix[arcs][:, None])
        return result

    def _motion(self) -> tuple[Floats, Floats, Floats]:
        """`bend` and `last` of `BlockEnds`, by pieces on arcs and where the words are the tip that turns; and
        the approach directions (K, T) by which blocks begin, 0 for joints that move by less than they lose."""
        t = self.work.bidirectional
        last = 2.0 * np.nan_to_num(np.diff(self.q, axis=0, prepend=self.q[:1]))[:, t] / self.gap
        bend, begin = _none(3, *self.gap.shape), np.where(np.abs(last) >= 2.0, np.sign(last), 0.0)
        bent = np.flatnonzero(bent_blocks(self.path, self.work.rotary))
        bent = bent[self._turning(bent)]
        if len(bent):
            places = (self._along(bent, k / PARTS) for k in range(PARTS + 1))
            bend[:, bent], last[bent], begin[bent] = _runs(
                2.0 * np.nan_to_num(two - one)[:, t] / self.gap[bent] for one, two in pairwise(places))
        return bend, last, begin

    def _turning(self, rows: Ints) -> Bools:
        """(N,) blocks (N,) in which a joint may turn back: not where all stay near the straight path."""
        t, gap = self.work.bidirectional, self.gap[rows]
        q0, step = self.q[rows - 1][:, t], (self.q[rows] - self.q[rows - 1])[:, t]
        apart = np.max([np.abs(self._along(rows, share)[:, t] - q0 - share * step) for share in QUARTERS], axis=0)
        return np.asarray(~(apart <= np.maximum(np.abs(step), 0.5 * NOISE * gap) / NEAR).all(axis=1))

    def _along(self, rows: Ints, share: float) -> Floats:
        """Joints (N, J) at a share of blocks (N,) as they are written."""
        path, work, words = self.path, self.work, self.words
        at, owner = np.full(len(rows), share), self.made.owner[rows]
        result = work.straight(path, self.q[rows - 1], self.q[rows], rows, at, owner)
        arcs = np.flatnonzero(path.code[rows] == ARC)
        block = rows[arcs]
        start = np.where((path.frame[block - 1] == path.frame[block])[:, None], words[block - 1],
                         words[block])
        here = on_arc(path.plane[block], path.ccw[block], path.center[block], start, words[block], at[arcs],
                      path.frames[0].control.xyz)
        result[arcs] = self.writing.joints(path, here, block)
        return result

    def _rates(self, k: Ints, counts: Ints) -> tuple[Floats, Floats, Floats, Floats]:
        """back, tip_rates, off, by_way of `BlockEnds`, 0 but for blocks k (N,); the tip counts at those of `counts` (K,)."""
        lossy, size, until = len(self.work.bidirectional), len(self.path), self.made.until
        back, tip_rates = np.zeros((size, lossy, 3)), np.zeros((size, 3, 3))
        off, by_approach = np.zeros((size, 3)), np.zeros((size, 3, lossy))
        for first in range(0, len(k), AT_ONCE):
            rows = k[first:first + AT_ONCE]
            at = counts[rows]
            back[rows], tip_rates[rows] = self._moved(at)
            off[rows], by_approach[rows] = self._left(at, until[at])
        return back, tip_rates, off, by_approach

    def _moved(self, at: Ints) -> tuple[Floats, Floats]:
        """back (N, T, 3) and tip_rates (N, 3, 3) of `BlockEnds` at blocks (N,)."""
        path, work, owner = self.path, self.work, self.made.owner[at]
        back, rates = np.zeros((len(at), len(work.bidirectional), 3)), np.zeros((len(at), 3, 3))
        here = work.poses(self.q[at], owner)[0]
        for i, column in enumerate(_columns(path).tolist()):
            adjacent = self.words[at]
            adjacent[:, column] += self.writing.grain[column]
            moved = self.writing.joints(path, adjacent, at)
            back[:, :, i] = (moved - self.q[at])[:, work.bidirectional]
            rates[:, :, i] = work.poses(moved, owner)[0] - here
        return back, rates

    def _left(self, at: Ints, until: Floats) -> tuple[Floats, Floats]:
        """off (N, 3) and by_way (N, 3, T) of `BlockEnds` at blocks (N,), `until` (N,) of the time of theirs in `work`."""
        work, owner = self.work, self.made.owner[at]
        wanted, approach = work.nominal(owner, until), np.zeros((len(at), self.q.shape[1]))
        off = work.residual(wanted, self.q[at], owner, approach)[:, :3]
        by_approach = np.zeros((len(at), 3, len(work.bidirectional)))
        for i, j in enumerate(work.bidirectional):
            forward = approach.copy()
            forward[:, j] = 1.0
            by_approach[:, :, i] = work.residual(wanted, self.q[at], owner, forward)[:, :3] - off
        return off, by_approach


def _runs(pieces: Iterable[Floats]) -> tuple[Floats, Floats, Floats]:
    """(3, N, T), (N, T), (N, T) of motion in pieces (N, T), 2 being what a joint loses: shift, low and high
    of all but the last run in one direction, that run, and the direction of the first run, 0 where it is
    shorter than what the joint loses."""
    first, *rest = pieces
    whole, run, gone, most = PlaySteps(*_none(3, *first.shape)), first, first, np.abs(first)
    for piece in rest:
        turns = (run * piece < 0.0) & (np.minimum(np.abs(run), np.abs(piece)) > NOISE)
        then = whole.then(PlaySteps(run, np.full(run.shape, -1.0), np.full(run.shape, 1.0)))
        whole = PlaySteps(*(np.where(turns, getattr(then, name), getattr(whole, name)) for name in ("shift", "low", "high")))
        run, gone = np.where(turns, piece, run + piece), gone + piece
        most = np.maximum(most, gone * np.sign(first))
    return np.stack([whole.shift, whole.low, whole.high]), run, np.where(most >= 2.0, np.sign(first), 0.0)


def _none(*shape: int) -> Floats:
    """Shift, low and high (3, K, T) of no motion."""
    result = np.zeros(shape)
    result[1], result[2] = -np.inf, np.inf
    return result


def _composed(bend: Floats, last: Floats, first: Ints, count: Ints) -> Floats:
    """Shift, low, high (3, H, T) of `count` (H,) blocks one after the other, from blocks `first` (H,) on."""
    result = _none(3, len(first), bend.shape[2])
    for k in range(int(count.max(initial=0))):
        rows = np.flatnonzero(count > k)
        block = first[rows] + k
        ones = np.ones((len(rows), bend.shape[2]))
        whole = PlaySteps(*result[:, rows]).then(PlaySteps(*bend[:, block])).then(PlaySteps(last[block], -ones, ones))
        result[:, rows] = np.stack([whole.shift, whole.low, whole.high])
    return result
