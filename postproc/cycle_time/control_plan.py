"""The plan of a control: least time on the path that the control makes of the blocks, under its own rules.

The planner's ideal motion rounds corners off within the whole tolerance and uses the axes' limits to the full; a control
rounds them off by its own rules, reads some blocks ahead and gives bends a share of the limits. Planned on the control's
path (`postproc.clock`) under those rules, the feed of each block can be run there: the highest speed of the plan in it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from postproc.base.program_time import ControlPlan
from postproc.clock.allowed import Allowed
from postproc.clock.control import between_rests, looked_over
from postproc.clock.path import BlendedPath
from postproc.clock.settings import ControlSettings
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.control import MOST_BLOCKS, MOST_STOPS, commanded, feeds
from postproc.cycle_time.estimate import as_used
from postproc.cycle_time.lookahead import rests
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.shape import shape
from postproc.cycle_time.source import from_conversion
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.mesh import Spacing
from postproc.feedrate.paths import Derivatives
from postproc.feedrate.plan import PlannerOptions, plan
from postproc.pipeline.result import PostResult
from postproc.verification.planned_words import blocks_of_rows
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass

NEAR = 0.05
"""by which words are above the plan's highest speeds: a control that ramps by itself a little otherwise is not held by them
(3 % of the time with 0.002)"""
KNOTS = Spacing(dt=5e-4)
"""corners of some hundredths of a millimetre lie between wider knots, and whole passes are slowed down for them"""
SLOWEST = 1e-9
"""mm/s of the path: less is rest"""
OPTIONS = PlannerOptions(strict=True, spacing=KNOTS)


def control_plan(made: PostResult, model: CycleTimeModel) -> ControlPlan | None:
    """What a control can do of a conversion with planned feeds, its programmed feeds as largest speeds; None where the
    model executes no control, for programs that are too long, and where nothing is planned.

    Raises:
        ValueError, ArithmeticError: no motion within the limits was found.
    """
    if model.kind != "control" or made.path is None or made.feeds is None or made.motion is None or not made.motion.passes:
        return None
    model, blocks = model.of_machine(made.machine), from_conversion(made)
    blocks = as_used(_as_programmed(blocks, made), model)
    form = shape(blocks)
    stops = rests(blocks, form)
    if len(blocks) > MOST_BLOCKS or np.count_nonzero(stops) > MOST_STOPS:
        return None
    given, settings, owner = commanded(blocks, model, form, stops, feeds(blocks, form, model))
    path, room = looked_over(given, settings)
    if room is None:
        return None
    planned = np.zeros(len(made.path), dtype=bool)
    for one in made.motion.passes:
        planned[one.block] = True
    own = _path_blocks(blocks, made)[owner]
    cuts = np.where((own >= 0) & planned[own] & ~blocks.rapid[owner], own, -1)
    needed, seconds = np.zeros(len(made.path)), 0.0
    for first, last in zip(room.rests[:-1].tolist(), room.rests[1:].tolist(), strict=True):
        rows = _inside(path, float(room.s[first]), float(room.s[last]))
        cut = cuts[rows] >= 0
        if cut.any():
            ends = np.clip(np.append(path.ends[rows], path.ends[rows[-1] + 1]), room.s[first], room.s[last])
            speeds = _stretch(path, room.between(first, last), settings, ends)
            seconds += float(speeds.seconds[cut].sum()) + settings.delay + model.stop_time
            needed += _least(cuts[rows][cut], np.diff(ends)[cut], speeds.highest[cut], len(needed))
    return ControlPlan(needed, seconds)


def _least(block: Ints, length: Floats, highest: Floats, count: int) -> Floats:
    """(count,) s of blocks at the highest speed that the plan has in them, of their pieces (n,)."""
    most = np.zeros(count)
    np.maximum.at(most, block, highest)
    return np.bincount(block, weights=length, minlength=count) / np.maximum((1.0 + NEAR) * most, SLOWEST)


def _inside(path: BlendedPath, first: float, last: float) -> Ints:
    """Pieces that move between two rests."""
    low, high = path.ends[:-1], path.ends[1:]
    return np.flatnonzero((high > low) & ((low + high) / 2.0 > first) & ((low + high) / 2.0 < last))


class _Speeds(NamedTuple):
    """s and highest speed of pieces (n,)."""

    seconds: Floats
    highest: Floats


def _stretch(path: BlendedPath, room: Allowed, settings: ControlSettings, ends: Floats) -> _Speeds:
    """Of the pieces between `ends` (n + 1,), from rest to rest under what the control allows: as the planner has them; as
    the control does it where velocities may jump at corners, which no plan of the axes' accelerations has."""
    if settings.corner_step is None:
        found = plan(_Stretch(path, room), JointLimits(settings.velocity, settings.acceleration, settings.jerks),
                     _Most(room), options=OPTIONS).blocks(ends)
        return _Speeds(found.seconds, found.highest)
    moved = between_rests(room, 0, len(room.s) - 1, settings)
    s, v = np.append(moved[:, 0], room.s[-1]), np.append(moved[:, 1], 0.0)
    t = np.interp(ends, s, settings.cycle * np.arange(len(s)))
    every = np.unique(np.concatenate([ends, s[(s > ends[0]) & (s < ends[-1])]]))
    speed, at = np.interp(every, s, v), np.searchsorted(every, ends)
    return _Speeds(np.diff(t), np.maximum(np.maximum.reduceat(speed, at[:-1]), speed[at[1:]]))


@dataclass(frozen=True)
class _Most:
    """Largest speed by place, as a function for the planner."""

    room: Allowed

    def __call__(self, s: Floats) -> Floats:
        """(N,) at s (N,): between places by the ratio."""
        return np.asarray(np.exp(np.interp(s, self.room.s, np.log(self.room.cap))))


@dataclass(frozen=True)
class _Stretch:
    """The path between two rests, as the planner takes it."""

    path: BlendedPath
    room: Allowed

    @property
    def start(self) -> float:
        """The first rest."""
        return float(self.room.s[0])

    @property
    def end(self) -> float:
        """The next rest."""
        return float(self.room.s[-1])

    @property
    def breaks(self) -> Floats:
        """Places of the control's look-ahead."""
        return self.room.s

    def derivatives(self, s: Floats) -> Derivatives:
        """At s (N,)."""
        return self.path.derivatives(s)


def _as_programmed(blocks: MotionBlocks, made: PostResult) -> MotionBlocks:
    """The blocks with the feeds that are programmed instead of those that were planned."""
    if made.path is None or made.feeds is None:
        return blocks
    own, asked, stated = _path_blocks(blocks, made), made.path.seconds, made.feeds.seconds
    with np.errstate(divide="ignore", invalid="ignore"):
        faster = np.where((asked > 0.0) & (stated > asked), stated / asked, 1.0)
    return replace(blocks, speed=blocks.speed * np.where(own >= 0, faster[own], 1.0))


def _path_blocks(blocks: MotionBlocks, made: PostResult) -> Ints:
    """(E,) block of the path that each block of the program is, -1 where that is not known."""
    if made.path is None or made.moves is None or made.comparison is None or blocks.row is None:
        return np.full(len(blocks), -1)
    known = blocks_of_rows(made.path, made.moves, made.comparison)
    return np.where(blocks.row >= 0, known[blocks.row], -1)
