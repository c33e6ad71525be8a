"""Poses of a program's blocks on the machine with its geometric errors: the proof of their correction."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.error_rates import STEEPEST_GAP, ErrorRates, joined, unknown_rates
from machines.geometric_error.actual.lost_motion import GRAIN, PlaySteps
from machines.geometric_error.actual.model import ErrorModel
from postproc.correction.error_sampling import changes, looks_between
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import FEW, BlockPoses, alike, begins
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

ARC = 2
LOOKS = 16
"""parts of a block whose joints do not run straight, for the approach directions of its axes"""
ARC_LOOKS = 0.25, 0.5, 0.75, 1.0
"""where the approach direction of joints in a block is added up"""
PLACES = 3
"""whose poses are kept"""
AT_ONCE = 50_000
"""such blocks that are looked at together"""


@dataclass(frozen=True)
class ActualBlockPoses(BlockPoses):
    """As `BlockPoses`, but where the tool of the machine with errors is; `motion` is the whole program's."""

    model: ErrorModel = field(kw_only=True)
    motion: Motion = field(kw_only=True)

    def poses(self, motion: Motion, rows: Ints, t: float | Floats) -> tuple[Floats, Floats]:
        """(tip, axis) (K, 3) of the blocks `rows` at fraction t, errors in, by the approach direction that
        each axis last moved."""
        for asked, ahead in self._together:
            if asked is rows and (k := ahead.number(t)) >= 0:
                if not ahead.poses:
                    tools = np.tile(motion.tool[rows], len(ahead.times))
                    made = self._aimed(tools, ahead.near, ahead.q, ahead.approach)
                    ahead.poses.extend(a.reshape(len(ahead.times), len(rows), 3) for a in made)
                return ahead.poses[0][k], ahead.poses[1][k]
        return self._aimed(motion.tool[rows], *self._at(motion, rows, t))

    def _aimed(self, tools: Ints, near: Floats, q: Floats, approach: Floats) -> tuple[Floats, Floats]:
        """(tip, axis) (K, 3) with tools (K,) at joints (K, J), their approach directions (K, J), near poses (K, 6)."""
        tip, axis = np.empty((len(tools), 3)), np.empty((len(tools), 3))
        for k, (number,) in alike(tools):
            actual = self.actual(number)
            tip[k], axis[k] = actual.aim(actual.coordinates(q[k], near[k]), approach[k])
        return tip, axis

    def _at(self, motion: Motion, rows: Ints, t: float | Floats) -> tuple[Floats, Floats, Floats]:
        """(nominal pose (K, 6), joints (K, J), their approach directions (K, J)); those of the places asked for last are
        kept: bounds ask for the same ones several times."""
        for kept, time, found in self._seen:
            if kept is rows and time is t:
                return found
        found = (np.concatenate(super().poses(motion, rows, t), axis=1), super().joints(motion, rows, t),
                 self._approach(motion, rows, t))
        if len(rows) <= AT_ONCE:
            self._seen[:] = [*self._seen[1 - PLACES:], (rows, t, found)]
        return found

    def look_ahead(self, motion: Motion, rows: Ints, times: Sequence[float | Floats]) -> None:
        """See `BlockPoses`."""
        self._together.clear()
        if 0 < len(rows) * len(times) <= (AT_ONCE if len(times) <= PLACES else FEW):
            shares = np.concatenate([np.broadcast_to(np.asarray(t), len(rows)) for t in times])
            found = self._at(motion, np.tile(rows, len(times)), shares)
            pose, q, approach = (part.reshape(len(times), len(rows), -1) for part in found)
            self._seen[:] = [(rows, t, (pose[k], q[k], approach[k])) for k, t in enumerate(times)]
            self._together.append((rows, _Together(times, *found)))

    def joints(self, motion: Motion, rows: Ints, t: float | Floats) -> Floats:
        """See `BlockPoses`."""
        known = next((found[1] for kept, time, found in self._seen if kept is rows and time is t), None)
        return super().joints(motion, rows, t) if known is None else known

    @cached_property
    def _seen(self) -> list[tuple[Ints, float | Floats, tuple[Floats, Floats, Floats]]]:
        return []

    @cached_property
    def _together(self) -> list[tuple[Ints, _Together]]:
        return []

    def nominal(self, motion: Motion, rows: Ints, t: float | Floats) -> tuple[Floats, Floats]:
        """See `BlockPoses`."""
        pose = self._at(motion, rows, t)[0]
        return pose[:, :3], pose[:, 3:]

    def off_law(self, motion: Motion, rows: Ints) -> Bools:
        """See `BlockPoses`: all blocks."""
        return np.ones(len(rows), dtype=bool)

    def error_rates(self, motion: Motion, rows: Ints, q: Floats, reach: Floats) -> ErrorRates:
        """See `BlockPoses`: of the errors, and of other pivots of the control where it has some."""
        found = joined((k, self.actual(tool).error_rates(q[k], reach[k]) or unknown_rates(len(k), q.shape[1]))
                       for k, (tool,) in alike(motion.tool[rows]))
        held = np.flatnonzero(self._other_pivots(motion, rows))
        if not len(held):
            return found
        tip = np.array(found.tip)
        tip[held] += super().error_rates(motion, rows[held], q[held], reach[held]).tip
        return replace(found, tip=tip)

    def approach(self, motion: Motion, rows: Ints, t: float | Floats) -> Floats:
        """See `BlockPoses`."""
        return self._at(motion, rows, t)[2]

    def gaps(self, motion: Motion, rows: Ints, q: Floats, reach: Floats) -> Floats:
        """See `BlockPoses`: at q, less what it may change by within `reach`."""
        result = np.full(q.shape, np.inf)
        if self._bidirectional:
            here = self.model.axes.gaps(self.control.machine.axis_names, q, self._bidirectional)
            result[:, self._bidirectional] = np.maximum(here - STEEPEST_GAP * reach[:, self._bidirectional], min(GRAIN))
        return result

    def corrected_between(self, motion: Motion, rows: Ints) -> Floats:
        """(K,) mm: what errors come to at both ends together; axes with rapids of their own take it up one by one."""
        return np.asarray(sum(np.linalg.norm(self.poses(motion, rows, t)[0] - self.nominal(motion, rows, t)[0], axis=1)
                              for t in (0.0, 1.0)))

    def looks(self, motion: Motion, rows: Ints) -> Iterator[tuple[Ints, Floats]]:
        """See `BlockPoses`: errors may change their course on the path."""
        step, before = np.zeros((len(rows), len(self.control.machine.axis_names))), self.joints(motion, rows, 0.0)
        for t in ARC_LOOKS:
            here = self.joints(motion, rows, t)
            step, before = step + np.abs(here - before), here
        return looks_between(changes(step, self.model.detail(self.control.machine.axis_names)))

    def actual(self, number: int) -> Actual:
        """The machine with errors at the tip of a tool by its number."""
        if number not in self._actual:
            self._actual[number] = self.model.on(self.kinematics(number))
        return self._actual[number]

    @cached_property
    def _actual(self) -> dict[int, Actual]:
        return {}

    @cached_property
    def _bidirectional(self) -> list[int]:
        return self.model.axes.bidirectional(self.control.machine.axis_names)

    @cached_property
    def _curved(self) -> Bools:
        """(E,) blocks whose joints may turn back on the path: arcs, and those whose words are the tip while
        an axis turns."""
        motion, turning = self.motion, self.control.rotary
        by_tip = np.array([frame.law == "tcp" for frame in motion.frames])[motion.frame] | (self.control.base == "tcp")
        turns = motion.end[:, turning] != begins(motion, np.arange(len(motion)))[:, turning]
        return np.asarray((motion.code == ARC) | (by_tip & (turns.any(axis=1) | (not len(turning)))))

    @cached_property
    def _last(self) -> Floats:
        """(1 + E, T) the approach directions of the joints in `_bidirectional` before the program and at the
        ends of its blocks."""
        every = self._steps(self.motion, np.arange(len(self.motion)), 1.0)
        none = np.zeros((1, len(self._bidirectional)))
        return np.concatenate([none, every.walked().at(none)])

    def _approach(self, motion: Motion, rows: Ints, t: float | Floats) -> Floats:
        """(K, J) from which direction each joint is where it is; one that has turned back has taken up what
        it loses by shares."""
        approach = np.zeros((len(rows), len(self.control.machine.axis_names)))
        if self._bidirectional:
            approach[:, self._bidirectional] = self._steps(motion, rows, t).at(self._last[rows])
        return approach

    def _steps(self, motion: Motion, rows: Ints, t: float | Floats) -> PlaySteps:
        """What the motion of blocks up to fraction t does to the approach directions (K, T)."""
        share = np.broadcast_to(np.asarray(t, dtype=np.float64), len(rows))
        even = self._of(*self._joints_at(motion, rows, (np.zeros(len(rows)), share)))
        result = {name: getattr(even, name).copy() for name in ("shift", "low", "high")}
        bent = np.flatnonzero(self._curved[rows])
        for at in range(0, len(bent), AT_ONCE):
            k = bent[at:at + AT_ONCE]
            some, of_some = np.unique(rows[k], return_inverse=True)  # parts of one block stand next to each other
            looks = self._looked_at(motion, some)
            last = np.minimum((share[k] * LOOKS).astype(np.int64), LOOKS - 1)
            gone = PlaySteps(*(steps[last, of_some] for steps in looks))
            before, middle, q = self._joints_at(motion, rows[k], (
                last / LOOKS, 0.5 * (last / LOOKS + share[k]), share[k]))
            turn = _turning(before, middle, q)
            whole = gone.then(self._of(before, turn)).then(self._of(turn, q))
            for name, values in result.items():
                values[k] = getattr(whole, name)
        return PlaySteps(**result)

    def _looked_at(self, motion: Motion, rows: Ints) -> tuple[Floats, Floats, Floats]:
        """Shift, low and high, each (LOOKS, K, T), from the beginning of blocks to each look; kept for the next time."""
        known = self._kept.get("rows")
        if known is None or not np.array_equal(known[0], rows):
            looked = self._joints_at(motion, rows, [np.full(len(rows), 0.5 * k / LOOKS) for k in range(2 * LOOKS - 1)])
            q = next(looked)
            whole = self._of(q, q)
            stages = [whole]
            for _ in range(1, LOOKS):
                before, middle, q = q, next(looked), next(looked)
                turn = _turning(before, middle, q)
                whole = whole.then(self._of(before, turn)).then(self._of(turn, q))
                stages.append(whole)
            shift, low, high = (np.stack([getattr(stage, name) for stage in stages]) for name in ("shift", "low", "high"))
            known = self._kept["rows"] = rows, shift, low, high
        return known[1:]

    @cached_property
    def _kept(self) -> dict[str, tuple[Ints, Floats, Floats, Floats]]:
        return {}

    def _joints_at(self, motion: Motion, rows: Ints, times: Sequence[Floats]) -> Iterator[Floats]:
        """Joints (K, J) of blocks at fractions (K,), of one fraction after the other; of few blocks all are made at once."""
        if len(rows) * len(times) > AT_ONCE:
            return (self.joints(motion, rows, t) for t in times)
        every = self.joints(motion, np.tile(rows, len(times)), np.concatenate(times))
        return iter(every.reshape(len(times), len(rows), every.shape[1]))

    def _of(self, before: Floats, q: Floats) -> PlaySteps:
        step = np.nan_to_num((q - before)[:, self._bidirectional])
        return PlaySteps.of(step, self.model.axes.gaps(self.control.machine.axis_names, q, self._bidirectional))


@dataclass(frozen=True, eq=False)
@arrays(near="M 6", q="M J", approach="M J")
class _Together:
    """Places looked ahead at, one fraction of the blocks after the other: nominal poses (M, 6), joints (M, J), their
    approach directions; `poses`: tips and axes (times, K, 3), once they are asked for."""

    times: Sequence[float | Floats]
    near: Floats
    q: Floats
    approach: Floats
    poses: list[Floats] = field(default_factory=list)

    def number(self, t: float | Floats) -> int:
        """Of a fraction among `times`; -1 for another."""
        return next((k for k, time in enumerate(self.times) if time is t), -1)


def _turning(before: Floats, middle: Floats, after: Floats) -> Floats:
    """Joints (N, J) where they turn back between three places as far apart in time, by the parabola through
    them; those that do not are in the middle."""
    slope, bend = 0.5 * (after - before), 0.5 * (after + before) - middle
    with np.errstate(divide="ignore", invalid="ignore"):
        there = np.where(2.0 * np.abs(bend) > np.abs(slope), -0.5 * slope / bend, 0.0)
    return np.asarray(middle + there * (slope + there * bend))
