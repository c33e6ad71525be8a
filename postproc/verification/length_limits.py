"""How far the lengths of tools may be off before their program fails, looked for where the read-back looks.

With a tool longer by x mm the tip of a place goes x times its speed (mm per mm) along a straight line, and what is left of
a tolerance or a clearance changes no faster than the tip. So from a place with room r the length may go r / speed
farther, and so on until no room is left. Cuts are then proved: the program is executed once more with tools of the
lengths found, and the bound of its deviation (`deviation_bound`) must keep the tolerances. Joints go evenly with the length.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from machines import reach
from postproc.job.job import Job
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.path.model import ARC
from postproc.readback.comparison.checks import CHUNK, off_line
from postproc.readback.comparison.compare import Comparison, bound_of_blocks, keeps_level, off_level, place_on_moves
from postproc.readback.comparison.length_margins import MUCH, LengthMargin, length_matters
from postproc.readback.execution.execute import Motion, run
from postproc.readback.execution.offsets import Offsets
from postproc.readback.execution.poses import FEW, BlockPoses, begins
from postproc.readback.text.canonical import Canonical
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from postproc.setup.model import ToolSetup
from postproc.verification.executed import executed_poses
from postproc.verification.length_ends import LEAST, SIGNS, Ends
from postproc.verification.lifted import lifted
from toolpaths.arrays import Bools, Floats, Ints, distinct, without_nan
from toolpaths.dataclass import dataclass
from toolpaths.rotations import lengths
from toolpaths.shapes import arrays

STEP = 0.1
"""mm that all tools are made longer by, to see what goes with the length"""
SHARE = 0.997
"""of a length that was found, which is then proved; of the proved one, which is stated: not on the edge"""
NEAR = 1.02
"""of a length that is proved to one that is not, which is near enough"""
TRIED = (1.0, 0.98, 0.9653, 0.9506, 0.9359, 0.9212, *(0.9212 * 0.82 * 0.5**k for k in range(8)))
"""of a length that was found, tried in this order until one is proved: from the third to the sixth it is near enough then"""


@dataclass(frozen=True, eq=False)
class LengthTrial:
    """A program and what the control holds, to be executed with tools of other lengths."""

    code: Canonical
    offsets: Offsets
    job: Job

    def executed(self, longer: Mapping[int, float], motion: Motion, poses: BlockPoses) -> tuple[Motion, BlockPoses]:
        """With tools longer by so many mm, by their numbers; `motion`, `poses` of the program with gauge lengths.

        Where no place of a block depends on the lengths, the motion is the same, and so is the gauge point
        (`BlockPoses.before`).
        """
        tools = dict(self.job.setup.tools)
        for number, mm in longer.items():
            tools[str(number)] = tools.get(str(number), ToolSetup()).model_copy(
                update={"gauge_length": self.job.length_of(number) + mm})
        job = replace(self.job, setup=self.job.setup.model_copy(update={"tools": tools}))
        held = job.register_lengths()
        letters = job.machine.axis_names
        known = lifted(motion, self.code, letters, self.offsets, held)
        again = run(self.code, letters, replace(self.offsets, lengths=held))[0] if known is None else known
        return again, executed_poses(job, again, held, poses.before if again is motion else None)


@dataclass(frozen=True, eq=False)
@arrays(tip="K 3", axis="K 3", d_tip="K 3", d_axis="K 3")
class _Places:
    """Blocks at one fraction of each: tips and axes as they are, and by how much both go on per mm of length."""

    tip: Floats
    axis: Floats
    d_tip: Floats
    d_axis: Floats

    @classmethod
    def of(cls, here: tuple[Floats, Floats], there: tuple[Floats, Floats]) -> _Places:
        """From poses with gauge lengths and with tools longer by `STEP`."""
        return cls(*here, *(without_nan((b - a) / STEP) for a, b in zip(here, there, strict=True)))

    @classmethod
    def joined(cls, parts: Sequence[_Places]) -> _Places:
        """Of several fractions one after the other."""
        return cls(*(np.concatenate(a) for a in zip(*((p.tip, p.axis, p.d_tip, p.d_axis) for p in parts), strict=True)))

    def at(self, k: Ints, x: Floats) -> tuple[Floats, Floats]:
        """(tip, axis) of some with tools longer by x (K,) mm."""
        axis = self.axis[k] + x[:, None] * self.d_axis[k]
        return self.tip[k] + x[:, None] * self.d_tip[k], axis / lengths(axis)[:, None]


def length_margins(trial: LengthTrial, motion: Motion, executed: BlockPoses, c: Comparison) -> tuple[LengthMargin, ...]:
    """Of every tool that moves, in order of their numbers; () where the program calls none."""
    job, numbers = trial.job, distinct(motion.tool[motion.tool >= 0])
    if not job.setup.output.tool_call or not len(numbers):
        return ()
    again, longer = trial.executed(dict.fromkeys(numbers.tolist(), STEP), motion, executed)
    if len(again) != len(motion):
        return tuple(LengthMargin(number, 0.0, 0.0, "other blocks", "other blocks") for number in numbers.tolist())
    ends, matters = Ends(numbers), length_matters(job)
    look = _Look(job, motion, executed, again, longer, c, ends, matters)
    look.cuts_and_links()
    look.points()
    look.travel()
    look.bounds_of_reach()
    if matters:
        _prove(_Proof(trial, motion, executed, c), ends)
    executed.forget()
    return tuple(_margin(job, ends, t) for t in range(len(numbers)))


def _margin(job: Job, ends: Ends, t: int) -> LengthMargin:
    (shorter, longer), (why, so), number = ends.mm[t].tolist(), ends.what[t], int(ends.numbers[t])
    whole = job.length_of(number)
    if shorter >= whole > 0.0:
        shorter, why = whole, "length 0"
    return LengthMargin(number, shorter if shorter < MUCH else np.inf, longer if longer < MUCH else np.inf, why, so,
                        job.setup.bodies is not None)


@dataclass(frozen=True, eq=False)
class _Look:
    """Looks at the places of a program; `matters`: the length is in the program, else registers take it up."""

    job: Job
    motion: Motion
    executed: BlockPoses
    again: Motion
    longer: BlockPoses
    c: Comparison
    ends: Ends
    matters: bool

    @cached_property
    def moves(self) -> Moves:
        """What the program is compared with."""
        return self.job.moves.without_pecks()

    def _tool(self, rows: Ints) -> Ints:
        return np.asarray(np.searchsorted(self.ends.numbers, np.maximum(self.motion.tool[rows], self.ends.numbers[0])))

    def _taken_up(self, ends: Floats, others: Floats) -> Bools:
        """(K,) places of machine coordinates (K, J) where the gauge point goes up by just what the tool is longer."""
        up = np.zeros(ends.shape[1])
        up[self.job.control.xyz[2]] = STEP
        return np.asarray((np.abs(others - ends - up) < LEAST * STEP).all(axis=1))

    def _rows(self) -> Iterator[Ints]:
        """Blocks whose tips go with the length, some at a time."""
        for first in range(0, len(self.motion), CHUNK):
            rows = np.arange(first, min(first + CHUNK, len(self.motion)))
            if not self.matters:
                still = self._taken_up(self.motion.end[rows], self.again.end[rows])
                still &= self._taken_up(begins(self.motion, rows), begins(self.again, rows))
                rows = rows[~still]
            if len(rows):
                yield rows

    def _poses(self, rows: Ints, t: float | Floats, keeps: bool) -> _Places:
        """Places of blocks that all keep their joints, or of which none does."""
        here = self.executed.poses(self.motion, rows, t)
        if keeps:
            return _Places(*here, -here[1], np.zeros_like(here[1]))
        return _Places.of(here, self.longer.poses(self.again, rows, t))

    def _keeps_joints(self, rows: Ints) -> Bools:
        """(K,) blocks of machine coordinates whose joints are those with longer tools too: the tip alone goes, along the
        tool."""
        if self.job.control.base == "tcp":
            return np.zeros(len(rows), dtype=bool)
        words = np.array([frame.law == "axes" for frame in self.motion.frames])[self.motion.frame[rows]]
        same = (self.motion.end[rows] == self.again.end[rows]).all(axis=1)
        return np.asarray(words & same & (begins(self.motion, rows) == begins(self.again, rows)).all(axis=1))

    def cuts_and_links(self) -> None:
        """Tolerances in cuts, clearance of links, at the places of `check_links` and `compare`."""
        for rows in self._rows():
            run_by, keeps = self.moves.run_by(self.c.owner[rows]), self._keeps_joints(rows)
            for kept in (True, False):
                alike = keeps == kept
                cuts, links = rows[run_by & alike], rows[~run_by & alike & (rows > 0)]
                for which, look in ((cuts, self._cuts), (links, self._links)):
                    if len(which):
                        look(which, kept)

    def _times(self, rows: Ints, keeps: bool) -> list[float | Floats]:
        """Fractions at which blocks are looked at; poses with longer tools are made at once too."""
        times = self.executed.times(self.motion, rows)
        if not keeps:
            self.longer.look_ahead(self.again, rows, times)
        return times

    def _cuts(self, rows: Ints, keeps: bool) -> None:
        moves, tolerance = self.moves, self.job.options.tolerance
        curves = moves.curves(self.c.owner[rows])
        begin, share = place_on_moves(self.motion, self.executed, rows, self.c.owner, moves)
        tool = self._tool(rows)
        level = (moves.phase[self.c.owner[rows]] == Phase.POSITION) & (self.motion.code[rows] == 0) & (
            self.executed.bent(self.motion, rows) | self.job.corrects) & keeps_level(curves, tolerance)
        for t in self._times(rows, keeps):
            places, guess = self._poses(rows, t, keeps), np.minimum(begin + t * share, 1.0)

            def left(k: Ints, x: Floats, places: _Places = places, guess: Floats = guess) -> Floats:
                some, (tip, axis) = curves.take(k), places.at(k, x)
                off, _, _ = some.deviation(tip, axis, guess[k], tolerance)
                return np.asarray(tolerance - np.where(level[k], off_level(some, tip), off))

            def left_of_axis(k: Ints, x: Floats, places: _Places = places, guess: Floats = guess) -> Floats:
                off = curves.take(k).deviation(*places.at(k, x), guess[k], tolerance)[1]
                return np.asarray(self.job.axis_tolerance - off)

            self.ends.leave(tool, lengths(places.d_tip), left, "tolerance")
            self.ends.leave(tool, lengths(places.d_axis), left_of_axis, "axis tolerance")

    def _links(self, rows: Ints, keeps: bool) -> None:
        near, moves = self.job.options.tolerance + self.executed.corrected_between(self.motion, rows), self.moves
        tool, owner, times = self._tool(rows), self.c.owner[rows], self._times(rows, keeps)
        together = max(1, FEW // len(rows))
        for first in range(0, len(times), together):
            places = _Places.joined([self._poses(rows, t, keeps) for t in times[first:first + together]])
            row = np.tile(np.arange(len(rows)), len(places.tip) // len(rows))

            def left(k: Ints, x: Floats, places: _Places = places, row: Ints = row) -> Floats:
                return _room(self.job, moves, owner[row[k]], *places.at(k, x), near[row[k]])

            self.ends.follow(tool[row], lengths(places.d_tip), left, "clearance")

    def points(self) -> None:
        """Points of the CL file, which blocks must come to within the tolerance."""
        done = np.flatnonzero(self.c.match >= 0)
        rows, tolerance = self.c.match[done], self.job.options.tolerance
        if not self.matters:
            keep = np.concatenate([~self._taken_up(self.motion.end[k], self.again.end[k]) for k in np.array_split(
                rows, len(rows) // CHUNK + 1)])
            done, rows = done[keep], rows[keep]
        for first in range(0, len(rows), CHUNK):
            part = slice(first, first + CHUNK)
            keeps = bool(self._keeps_joints(rows[part]).all())
            places, to = self._poses(rows[part], 1.0, keeps), self.moves.tip[done[part]]

            def left(k: Ints, x: Floats, places: _Places = places, to: Floats = to) -> Floats:
                return np.asarray(tolerance - lengths(places.at(k, x)[0] - to[k]))

            self.ends.leave(self._tool(rows[part]), lengths(places.d_tip), left, "tolerance")

    def travel(self) -> None:
        """Travel of all axes, at the places of `check_travel`; within blocks only where that is not between their ends."""
        for first in range(0, len(self.motion), CHUNK):
            rows = np.arange(first, min(first + CHUNK, len(self.motion)))
            rows = rows[~self._keeps_joints(rows)]
            if not len(rows):
                continue
            slope = self._travel_at(rows, [1.0])
            inner = rows[self._within(rows, slope)]
            if len(inner):
                self._travel_at(inner, self._times(inner, False))

    def _within(self, rows: Ints, slope: Floats) -> Bools:
        """(K,) blocks whose joints may be farther within than at the end of the block before and their own, or that go
        otherwise with the length there; `slope` (K, J) at their ends."""
        inner = np.append(True, (np.diff(rows) != 1) | (np.diff(self.motion.tool[rows]) != 0))
        inner[1:] |= (np.abs(np.diff(slope, axis=0)) > LEAST).any(axis=1)
        if self.job.control.base == "tcp" or not (self.motion.table.plain and self.again.table.plain):
            inner[:] = True
        return np.asarray(inner | (self.motion.code[rows] == ARC))

    def _travel_at(self, rows: Ints, times: Sequence[float | Floats]) -> Floats:
        """Looks at travel at fractions of blocks; joints per mm of length (K T, J) there."""
        limits, names = self.job.machine.limits, self.job.machine.axis_names
        q = np.concatenate([self.executed.joints(self.motion, rows, t) for t in times])
        slope: Floats = (np.concatenate([self.longer.joints(self.again, rows, t) for t in times]) - q) / STEP
        tool, goes_on = np.tile(self._tool(rows), len(times)), np.abs(slope) > LEAST
        for j in np.flatnonzero(goes_on.any(axis=0)).tolist():
            k = np.flatnonzero(goes_on[:, j])
            up, down = limits.upper[j] - q[k, j] + TRAVEL_SLACK, q[k, j] - limits.lower[j] + TRAVEL_SLACK
            for sign, direction in enumerate(SIGNS):
                goes = direction * slope[k, j]
                self.ends.add(tool[k], sign, np.where(goes > 0.0, up, down) / np.abs(goes), f"travel {names[j]}")
        return slope

    def bounds_of_reach(self) -> None:
        """Bounds of a parallel machine's workspace and joints, where those go with the length."""
        kin = self.job.control.machine.kinematics
        for first in range(0, len(self.motion) if reach.is_checked(kin) else 0, CHUNK):
            rows = np.arange(first, min(first + CHUNK, len(self.motion)))
            q, other = self.executed.joints(self.motion, rows, 1.0), self.longer.joints(self.again, rows, 1.0)
            k = np.flatnonzero((np.abs(other - q) > LEAST * STEP).any(axis=1))
            if not len(k):
                continue
            here = reach.reach(kin, q[k])
            slope = (reach.reach(kin, other[k]).values - here.values) / STEP
            for sign, direction in enumerate(SIGNS):
                with np.errstate(divide="ignore", invalid="ignore"):
                    mm = np.where(direction * slope < -LEAST, here.values / (-direction * slope), np.inf)
                for name, column in zip(here.names, np.nan_to_num(mm, nan=np.inf).T, strict=True):
                    self.ends.add(self._tool(rows[k]), sign, column, name)


def _prove(proof: _Proof, ends: Ends) -> None:
    """Lengths at which the bound of every cut keeps the tolerances: those that were found, else less.

    `low` is proved, `high` is not: less and less first, as places lie near to each other, then half between.
    """
    for sign, direction in enumerate(SIGNS):
        by_place = np.array([what[sign].endswith("tolerance") for what in ends.what])
        found = np.where(by_place, SHARE, 1.0) * ends.mm[:, sign]
        low, high, next_ = np.zeros(len(found)), np.array(found), np.array(found)
        for share in TRIED[1:]:
            k = np.flatnonzero((high > low) & (high > NEAR * low))
            if not len(k):
                break
            kept = proof.keeps(ends.numbers[k], direction * next_[k])
            low[k[kept]], high[k[~kept]] = next_[k[kept]], next_[k[~kept]]
            next_ = np.where(low > 0.0, 0.5 * (low + high), share * found)
        short = low < found
        for t in np.flatnonzero(short).tolist():
            ends.what[t][sign] = "tolerance"
        ends.mm[:, sign] = np.where(short | by_place, SHARE * low, ends.mm[:, sign])


@dataclass(frozen=True, eq=False)
class _Proof:
    """Judges lengths by the bounds of all cuts; `lost`: by tool the block that did not keep the tolerances last, whose
    move is looked at first the next time."""

    trial: LengthTrial
    motion: Motion
    executed: BlockPoses
    c: Comparison
    lost: dict[int, int] = field(default_factory=dict)

    def keeps(self, numbers: Ints, longer: Floats) -> Bools:
        """(K,) True where the cuts of each of the tools `numbers` (K,) keep the tolerances, longer by `longer` (K,) mm."""
        longer_by = dict(zip(numbers.tolist(), longer.tolist(), strict=True))
        motion, executed = self.trial.executed(longer_by, self.motion, self.executed)
        return np.array([self._keeps(motion, executed, number) for number in numbers.tolist()], dtype=np.bool_)

    def _keeps(self, motion: Motion, executed: BlockPoses, number: int) -> bool:
        """Whether all cuts of a tool keep the tolerances: not where those of the one move that was lost last do not."""
        job, cuts = self.trial.job, motion.tool == number
        moves, allowed = job.moves.without_pecks(), (job.options.tolerance, job.axis_tolerance)
        lost = self.lost.get(number)
        for some in [cuts] if lost is None else [cuts & (self.c.owner == self.c.owner[lost]), cuts]:
            owner = np.where(some, self.c.owner, len(moves))
            bound = bound_of_blocks(motion, executed, moves, owner, allowed, job.corrects, judge=True)
            if not (bound.tip <= allowed[0] and bound.axis <= allowed[1]):
                row = bound.tip_row if bound.tip > allowed[0] else bound.axis_row
                if row >= 0:
                    self.lost[number] = row
                return False
        return True


def _room(job: Job, moves: Moves, owner: Ints, tip: Floats, axis: Floats, near: Floats) -> Floats:
    """(K,) mm that tips of linking moves may go: clear of what is cut, or within `near` (K,) on the line of an approach or
    a retract, whichever is more (as `check_links` has it)."""
    clear = job.space.room(tip, axis) + job.options.tolerance
    to, before = (np.clip(owner + behind, 0, len(moves) - 1) for behind in (0, -1))
    on = [np.where(there, near - off_line(tip, moves.tip[at], moves.axis[at]), 0.0)
          for at, there in ((to, owner < len(moves)), (before, owner > 0))]
    return np.asarray(np.maximum(np.maximum.reduce([clear, *on]), 0.0))
