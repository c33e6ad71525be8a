"""The machine with errors along a path: nominal and corrected joints anywhere in its blocks, and the approach
directions of its axes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from machines.geometric_error.actual.actual import Actual, moving_sign
from machines.geometric_error.actual.correction import correct
from machines.geometric_error.actual.lost_motion import GRAIN, PlaySteps, turning_sign
from machines.geometric_error.actual.model import ErrorModel
from machines.kinematics.base import Kinematics
from postproc.base.group_rows import groups
from postproc.control.word_arcs import PLANE_COLUMNS
from postproc.correction.error_sampling import changes
from postproc.path.model import ARC, TRAVERSE, JointPath
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

MOMENT = 1e-3
"""of a block: how far back its direction at a place is looked at"""
LAST, LAST_OF_ARC = 1.0 / 16.0, 1.0 / 256.0
"""of a block: the same at its ends; turning back later than that counts as none. Joints of blocks by the tip
bow a little at every end, by less than they lose; those of arcs turn back for good"""
EDGES = tuple(k / 16.0 for k in range(17))
"""where the directions of the axes in a block are looked at"""
ALONE, LIFTS = -1, -2
"""instead of the hole of a block: of none, or of none and along Z of the words from where the block before ends"""
STANDS = 1e-9
"""rad that rotary joints of one orientation may differ by: inverse kinematics of points on one line of retract"""


@dataclass(frozen=True)
@arrays(q="K J", before="K 2", after="K 2", partial="K", unmeasured="K J")
class CorrectedEnds:
    """Corrected joints (K, J) and what `correct` said of them, for all blocks."""

    q: Floats
    before: Floats
    after: Floats
    partial: Bools
    unmeasured: Bools


class ErrorContext:
    """What is needed throughout: the machine with errors by tool, groups of one orientation.

    `whole`: (K,) the hole that a block is of where it is corrected as a whole, else ALONE or LIFTS; `level`: (K,) blocks
    that end at the plane of such holes, whose Z stands; `approach`: (K, J) sign of each joint's last motion
    at the ends of the blocks, 0 for the mean of both; `drift`: (K, J) of the correction over each block;
    `beyond`, `beyond_inside`: (K,) blocks that may end, or run, where errors were not measured.
    """

    def __init__(self, path: JointPath, tools: Ints, kinematics: Callable[[int], Kinematics], model: ErrorModel,
                 axis_tolerance: float, beyond: bool, share: float, mean: bool = False) -> None:
        self.path, self.tools, self.kinematics = path, tools, kinematics
        self.axis_tolerance, self.model = axis_tolerance, model
        self.beyond: Bools = np.isnan(path.u) | beyond
        self.beyond_inside: Bools = self.beyond | (path.code == TRAVERSE)
        self.axis_share, self.mean = share * axis_tolerance, mean
        self.whole: Ints = np.full(len(path), ALONE)
        self.level: Bools = np.zeros(len(path), dtype=np.bool_)
        self.approach: Floats = np.zeros(path.q.shape)
        self.drift: Floats = np.zeros(path.q.shape)
        self.rotary = np.array(kinematics(int(tools[0])).rotary)
        self.turning = self.rotary & ~np.array(kinematics(int(tools[0])).in_loops)
        """axes that hold the tool's direction while they stand: no cranks, which drive its tip"""
        self.group = one_orientation(self.stands, tools, path.home) if self.turning.any() else np.full(len(path), ALONE)
        self._actual: dict[int, Actual] = {}

    @cached_property
    def stands(self) -> Bools:
        """(K,) blocks that begin at the orientation at which they end: turning axes, and the nominal tool axis where slides
        turn it too, stand as at the end of the block before."""
        held = self.path.q[:, self.turning]
        if self.kinematics(int(self.tools[0])).slides_turn_tool:
            held = np.hstack([held, self.poses(self.path.q, np.arange(len(held)))[1]])
        return np.append(False, (np.abs(np.diff(held, axis=0)) <= STANDS).all(axis=1))

    def actual(self, tool: int) -> Actual:
        """The machine with errors at the tip of a tool."""
        if tool not in self._actual:
            self._actual[tool] = self.model.on(self.kinematics(tool))
        return self._actual[tool]

    @cached_property
    def bidirectional(self) -> list[int]:
        """Joints that have errors with two approach directions; none where all go by their `mean`."""
        return [] if self.mean else self.model.axes.bidirectional(self.names)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Letters of the joints."""
        return self.kinematics(int(self.tools[0])).axis_names

    def take_approaches(self, path: JointPath, words: Floats, drift: bool = True) -> None:
        """Find `approach` from the corrected `path` and its words (K, J) at block ends, and `drift` where
        that is by mean approach directions.

        Where words are machine coordinates their last change says.
        A joint that the correction alone moves turns back too: what it loses is more than what it moves by;
        inside a hole, which is moved as a whole, it does so by shares. Where joints do not run straight it is
        the sign of the last moment.
        """
        q = path.q
        step, change = (np.nan_to_num(np.diff(x, axis=0, prepend=x[:1])) for x in (q, q - self.path.q))
        if drift:
            self.drift = np.where(np.abs(change) > np.where(self.rotary, GRAIN[1], GRAIN[0]), change, 0.0)
        stated = axis_positions(path, self.tools)
        unit = path.frames[0].control.unit
        step[stated] = np.nan_to_num(np.diff(words, axis=0, prepend=words[:1]) / unit)[stated]
        bent = np.flatnonzero(self.bent)
        last = self.moving(bent, np.ones(len(bent)), self.last(bent))
        step[bent] = np.where(last != 0.0, last, step[bent])
        inside = np.flatnonzero((self.whole[1:] != ALONE) & (self.whole[1:] == self.whole[:-1])) + 1
        lateral = step[inside[:, None], self.bidirectional]
        step[inside[:, None], self.bidirectional] = np.where(np.abs(lateral) >= self.gaps(q[inside]),
                                                             lateral, 0.0)
        self.approach = turning_sign(step, self.rotary)
        self._approaches_inside(inside, q)

    def _approaches_inside(self, inside: Ints, q: Floats) -> None:
        """Take up by shares in blocks `inside` (N,) of holes, which go to joints q (K, J), from the approach
        directions before them."""
        if not len(inside):
            return
        before = np.setdiff1d(inside - 1, inside)
        rows, two = np.union1d(before, inside), self.bidirectional
        approach, steps = self.approach[rows][:, two], PlaySteps.of(np.nan_to_num(q[rows] - q[rows - 1])[:, two],
                                                                    self.gaps(q[rows]))
        begins = np.isin(rows, before)[:, None]
        steps = PlaySteps(*(np.where(begins, x, y) for x,
                            y in ((0.0, steps.shift), (approach, steps.low), (approach, steps.high))))
        self.approach[rows[:, None], two] = steps.walked().at(approach)

    @cached_property
    def bent(self) -> Bools:
        """(K,) blocks in which joints do not run straight."""
        return bent_blocks(self.path, self.rotary)

    def last(self, block: Ints) -> Floats:
        """(N,) LAST of blocks (N,), LAST_OF_ARC of arcs."""
        return np.where(self.path.code[block] == ARC, LAST_OF_ARC, LAST)

    def moving(self, block: Ints, t: Floats, moment: float | Floats = MOMENT) -> Floats:
        """(N, J) sign of each joint's motion at fraction t (N,) of blocks (N,), over a moment before; after it at the start.

        The correction counts as changing evenly over a block.
        """
        share = np.broadcast_to(moment, len(block))
        return moving_sign(self._step(block, t, share) + share[:, None] * self.drift[block], self.rotary)

    def _step(self, block: Ints, t: Floats, moment: Floats) -> Floats:
        before = np.clip(t - moment, 0.0, 1.0 - moment)
        result: Floats = self.nominal(block, before + moment) - self.nominal(block, before)
        return result

    def approach_at(self, block: Ints, t: Floats) -> Floats:
        """(N, J) sign of each joint's last motion inside blocks; a joint that rests there has that of the block's end."""
        if not self.bidirectional:
            return np.zeros((len(block), self.path.q.shape[1]))
        moving = self.moving(block, t)
        return np.asarray(np.where(moving != 0.0, moving, self.approach[block]))

    def begin_approach(self, block: Ints) -> Floats:
        """(N, J) sign of each joint's first motion in blocks (N,).

        That of the block before for one that rests, or that the correction alone moves: it has the whole
        block to take up what it loses.
        """
        first = np.zeros((len(block), self.path.q.shape[1]))
        if not self.bidirectional:
            return first
        arc = self.path.code[block] == ARC
        for rows, edges in ((np.flatnonzero(arc), EDGES), (np.flatnonzero(~arc), (0.0, 1.0))):
            for t in edges[::-1] if len(rows) else ():
                last = self.last(block[rows])
                step, drift = self._step(block[rows], np.full(len(rows), t), last), last[:, None] * self.drift[block[rows]]
                first[rows] = np.where(np.abs(step) > np.abs(drift), moving_sign(step + drift, self.rotary),
                                       first[rows])
        return np.asarray(np.where(first != 0.0, first, self.approach[np.maximum(block - 1, 0)]))

    def played(self, approach: Floats, q0: Floats, q: Floats) -> Floats:
        """Approach directions (N, J) of joints that have gone from q0 to q (N, J), `approach` (N, J) at q0."""
        result = np.array(approach)
        if self.bidirectional:
            j = self.bidirectional
            result[:, j] = PlaySteps.of(np.nan_to_num((q - q0)[:, j]), self.gaps(q)).at(approach[:, j])
        return result

    def gaps(self, q: Floats) -> Floats:
        """(N, T) lost motion of the joints in `bidirectional` at q (N, J)."""
        return self.model.axes.gaps(self.names, np.nan_to_num(q), self.bidirectional)

    def nominal(self, block: Ints, t: Floats) -> Floats:
        """Nominal joints (N, J) at fraction t (N,) of blocks (N,), along the arc of those that are arcs."""
        path = self.path
        result = self.straight(path, path.q[block - 1], path.q[block], block, t)
        for rows in groups(path.frame[block], self.tools[block]):
            k = rows[path.code[block[rows]] == ARC]
            if len(k):
                control = path.frames[int(path.frame[block[k[0]]])].control
                kin = self.kinematics(int(self.tools[block[k[0]]]))
                start, end = (control.words(path.q[at], kin, 0.0) for at in (block[k] - 1, block[k]))
                arc = block[k]
                words = on_arc(path.plane[arc], path.ccw[arc], path.center[arc], start, end, t[k],
                               control.xyz)
                result[k] = control.joints(words, kin, 0.0)
        return result

    def straight(self, path: JointPath, q0: Floats, q1: Floats, block: Ints, t: Floats,
                 owner: Ints | None = None) -> Floats:
        """Joints (N, J) at fraction t (N,) of straight blocks from q0 to q1 (N, J), under the law of each in `path`.

        Rapids are dog-legs where the control makes them that: what the correction adds to one axis comes at
        once. In a path made of others `owner` (N,) are the blocks here that its blocks are of.
        """
        result, rapid = np.empty_like(q0), path.code[block] == TRAVERSE
        tools = self.tools[block if owner is None else owner]
        for k in groups(path.frame[block], tools):
            control = path.frames[int(path.frame[block[k[0]]])].control
            kin = self.kinematics(int(tools[k[0]]))
            result[k] = control.between(q0[k], q1[k], t[k], kin, rapid[k])[2]
        return result

    @cached_property
    def detail(self) -> Floats:
        """(J,) mm or rad that joints may go between two looks."""
        return self.model.detail(self.names)

    def changes(self, q0: Floats, q1: Floats) -> Ints:
        """(N,) stretches of motion from q0 to q1 (N, J) in which errors rise or fall."""
        return changes(q1 - q0, self.detail)

    def reached(self) -> tuple[Floats, Floats]:
        """(K, J) least and greatest joints of blocks: at the end; where joints do not run straight on the
        approach direction; where cuts begin that a linking move leads to."""
        low, high = self.path.q.copy(), self.path.q.copy()
        cuts = np.flatnonzero((self.path.code[1:] != TRAVERSE) & np.isnan(self.path.u[:-1]) & ~self.path.home[:-1]) + 1
        low[cuts], high[cuts] = (f(low[cuts], self.path.q[cuts - 1]) for f in (np.fmin, np.fmax))
        block = np.flatnonzero(self.bent & ~self.path.home)
        for t in EDGES if len(block) else ():
            q = self.nominal(block, np.full(len(block), t))
            low[block], high[block] = np.fmin(low[block], q), np.fmax(high[block], q)
        return low, high

    def unmeasured(self, low: Floats, high: Floats) -> Bools:
        """(K, J) joints that go where errors were not measured, in blocks with joints from `low` to `high` (K, J)."""
        result = np.zeros(low.shape, dtype=np.bool_)
        for k in groups(self.tools):
            tool = int(self.tools[k[0]])
            poses = np.concatenate(self.kinematics(tool).forward(self.path.q[k]), axis=1)
            for q in (low[k], high[k]):
                result[k] |= self.actual(tool).outside(self.actual(tool).coordinates(q, poses))
        return result

    def ends(self) -> CorrectedEnds:
        """All block ends, by the approach directions `approach`; home blocks as they are."""
        n, joints = self.path.q.shape
        ends, before, after = self.path.q.copy(), np.zeros((n, 2)), np.zeros((n, 2))
        partial, unmeasured = np.zeros(n, dtype=bool), np.zeros((n, joints), dtype=bool)
        for k in groups(self.tools):
            rows = k[~self.path.home[k]]
            if not len(rows):
                continue
            tool = int(self.tools[k[0]])
            q = self.path.q[rows]
            tip, axis = self.kinematics(tool).forward(q)
            found = correct(self.actual(tool), q, tip, axis, group=self.group[rows], direction=self.approach[rows],
                            axis_tolerance=self.axis_tolerance, beyond=self.beyond[rows])
            ends[rows] = self._exact_turns(found.q, rows)
            before[rows] = np.stack([found.tip_before, found.axis_before], axis=1)
            after[rows] = np.stack([found.tip_after, found.axis_after], axis=1)
            partial[rows], unmeasured[rows] = found.partial, found.unmeasured
        return CorrectedEnds(ends, before, after, partial, unmeasured)

    def _exact_turns(self, q: Floats, rows: Ints) -> Floats:
        """The same joints, those of a group with the rotary axes of its first block to the last digit."""
        mine = self.group[rows]
        _, first, inverse = np.unique(np.where(mine >= 0, mine, -2 - np.arange(len(mine))), return_index=True,
                                      return_inverse=True)
        result = q.copy()
        result[:, self.turning] = q[first[inverse]][:, self.turning]
        return result

    def at(self, q: Floats, blocks: Ints, approach: Floats, turns: Floats | None = None) -> Floats:
        """Corrected joints (N, J) of nominal q (N, J) inside blocks (N,); `turns` (N, R) fixes the turning axes."""
        result = np.empty_like(q)
        for k in groups(self.tools[blocks]):
            tool = int(self.tools[blocks[k[0]]])
            tip, axis = self.kinematics(tool).forward(q[k])
            start = q[k].copy()
            if turns is not None:
                start[:, self.turning] = turns[k]
            result[k] = correct(self.actual(tool), start, tip, axis, direction=approach[k], turn=turns is None,
                                axis_tolerance=self.axis_tolerance, beyond=self.beyond_inside[blocks[k]]).q
        return result

    def corrected(self, there: Floats, block: Ints, approach: Floats, path: JointPath) -> Floats:
        """Corrected joints (N, J) of nominal ones inside blocks (N,) of the corrected `path`.

        Blocks at one orientation keep it.
        """
        ends = path.q[block - 1][:, self.turning], path.q[block][:, self.turning]
        held: Bools = np.all(ends[0] == ends[1], axis=1) & self.turning.any() & self.stands[block]
        q = np.empty_like(there)
        for rows, fixed in ((np.flatnonzero(held), True), (np.flatnonzero(~held), False)):
            if len(rows):
                q[rows] = self.at(there[rows], block[rows], approach[rows], ends[1][rows] if fixed else None)
        return q

    def poses(self, q: Floats, blocks: Ints) -> tuple[Floats, Floats]:
        """Nominal (tip, axis), each (N, 3), of q (N, J) inside blocks (N,)."""
        tip, axis = np.empty((len(q), 3)), np.empty((len(q), 3))
        for k in groups(self.tools[blocks]):
            tip[k], axis[k] = self.kinematics(int(self.tools[blocks[k[0]]])).forward(q[k])
        return tip, axis

    def off(self, nominal: Floats, q: Floats, blocks: Ints, approach: Floats) -> Floats:
        """Distance (N,) mm of the actual tip at q from the nominal one at `nominal` (N, J), inside blocks (N,)."""
        return np.asarray(np.linalg.norm(self.residual(nominal, q, blocks, approach)[:, :3], axis=1))

    def residual(self, nominal: Floats, q: Floats, blocks: Ints, approach: Floats) -> Floats:
        """Tip and axis (N, 6) of the actual machine at q less those of the nominal one at `nominal` (N, J)."""
        result = np.empty((len(q), 6))
        for k in groups(self.tools[blocks]):
            tool = int(self.tools[blocks[k[0]]])
            actual, wanted = self.actual(tool), np.concatenate(self.kinematics(tool).forward(nominal[k]), axis=1)
            w = actual.coordinates(q[k], wanted)
            result[k] = np.concatenate(actual.aim(w, approach[k]), axis=1) - wanted
        return result


def bent_blocks(path: JointPath, rotary: Bools) -> Bools:
    """(K,) blocks in which joints do not run straight: arcs, and those by the tip that turn an axis."""
    by_tip = np.array([frame.control.law == "tcp" for frame in path.frames])[path.frame]
    turns = np.concatenate([[False], (path.q[1:, rotary] != path.q[:-1, rotary]).any(axis=1)])
    first = np.arange(len(path)) == 0
    straight = path.frames[0].control.machine.kinematics.straight_slides
    result: Bools = ((path.code == ARC) | (by_tip & (turns | (not straight)))) & ~first
    return result


def axis_positions(path: JointPath, tools: Ints) -> Bools:
    """(K,) blocks in machine coordinates, as the block before, with the same tool; home is left out."""
    same = np.append(False, (np.diff(path.frame) == 0) & (np.diff(tools) == 0))
    law = np.array([frame.control.law == "axes" for frame in path.frames])[path.frame]
    return np.asarray(same & law & ~path.home & ~np.append(False, path.home[:-1]))


def one_orientation(stands: Bools, tools: Ints, home: Bools) -> Ints:
    """(K,) number of the run of blocks that keep their orientation (`stands`) with the same tool; ALONE for single blocks."""
    same = stands[1:] & (tools[1:] == tools[:-1]) & ~home[1:] & ~home[:-1]
    run = np.concatenate([[0], np.cumsum(~same)])
    count = np.bincount(run)
    result: Ints = np.where(count[run] > 1, run, ALONE)
    return result


def on_arc(plane: Ints, ccw: Bools, center: Floats, start: Floats, end: Floats, t: Floats,
           xyz: Ints) -> Floats:
    """Words (N, J) at fraction t (N,) of arc blocks from `start` to `end` (N, J); the third axis rises evenly."""
    result = start + t[:, None] * (end - start)
    for number, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero(plane == number)
        a, b = int(xyz[i]), int(xyz[j])
        middle = start[k][:, (a, b)] + center[k][:, (i, j)]
        first, last = start[k][:, (a, b)] - middle, end[k][:, (a, b)] - middle
        sense = np.where(ccw[k], 1.0, -1.0)
        swept = np.mod(sense * (np.arctan2(last[:, 1], last[:, 0]) - np.arctan2(first[:, 1], first[:, 0])),
                       2.0 * np.pi)
        swept = np.where(swept < 1e-9, 2.0 * np.pi, swept) * sense * t[k]
        cos, sin = np.cos(swept), np.sin(swept)
        result[k, a] = middle[:, 0] + cos * first[:, 0] - sin * first[:, 1]
        result[k, b] = middle[:, 1] + sin * first[:, 0] + cos * first[:, 1]
    return result
