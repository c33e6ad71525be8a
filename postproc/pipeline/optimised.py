"""`--optimise`: among what a post-processor may choose, the program that the control runs fastest; proved like any other.

One choice after the other is changed and kept where the written program takes less time on the control's model: output mode
of all and of each operation, block ends off the path where fewer blocks do, how much of the tolerance the control's
smoothing takes from linearising, all of what is left used up, points moved inside the tolerance, feed mode. A mode is also
tried with the choices that may make it the fastest: what the control smooths by itself wants the tolerance for that, points
of rotary axes for themselves. Nothing is slower than without: what is not faster is not taken, by times near the executed
control's and then by the control, executed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import get_args

import numpy as np

from postproc.base.options import FeedModeChoice, Options, OutputMode
from postproc.base.program_time import Optimised, OptimisedStep, ProgramTime
from postproc.pipeline.feeds_by_clock import PlanningClock, ProgramClock, StagedWhole, measured, ranked, with_compared_feeds
from postproc.pipeline.result import PostResult
from toolpaths.dataclass import dataclass

OFF_PATH = "block ends off the path"
_Change = Callable[[PostResult], PostResult]
"""What a conversion begins with, changed"""
SHARES = (0.05, 0.15, 0.45, 0.6, 0.75, 0.9)
"""of the tolerance for the control's smoothing, tried first; then half as far on both sides of the best, NEARER times"""
NEARER = 3
LEAST = 1e-4
"""part of the time that a choice must save to be taken"""
MUCH = 0.8
"""of the tolerance for the control's smoothing, with which each output mode is tried too"""
LITTLE = 1e-4
"""of the tolerance for the control's smoothing, where points are to have all of it"""
MOST = 8
"""operations whose output mode is tried by itself: those that take longest"""


@dataclass(frozen=True)
class _Best:
    """The fastest so far: what it is made from, the program, its time by the formulas that rank, and as executed."""

    start: PostResult
    made: PostResult
    time: ProgramTime
    executed: ProgramTime


def optimised(start: PostResult, stages: StagedWhole, clock: ProgramClock) -> PostResult:
    """The conversion of `start` with the choices that make its program the fastest; as it is where none is faster.

    On controls that make their ramps themselves planned feeds are written only where they are faster: with each choice."""
    planned = start.options.feed == "planned"
    compared = planned and not start.controller.feed.limited_jerk
    written = partial(with_compared_feeds, stages=stages, clock=clock) if compared else stages
    made = written(start)
    if not made.ok:
        return made
    search = _Search(_Best(start, made, ranked(clock, made), measured(clock, made)), written, clock)
    search.modes()
    search.to(OFF_PATH, _options(partial(replace, off_path=True)))
    search.smoothing()
    search.to(OFF_PATH, _options(partial(replace, off_path=True)))
    search.to("the tolerance used up", _options(partial(replace, filled=True)))
    for moved in (True, False):
        if moved != search.best.start.options.smooth:
            search.to("points moved inside the tolerance" if moved else "points unmoved",
                      _options(partial(replace, smooth=moved)))
    for mode in get_args(FeedModeChoice):
        search.to(f"feed mode {mode}", _options(partial(replace, feed_mode=mode)))
    best = search.best
    made = with_compared_feeds(best.start, stages, clock) if planned and not compared else best.made
    return replace(made, optimised=Optimised(tuple(search.steps), search.first, best.executed, search.tried, search.least()))


def _options(change: Callable[[Options], Options]) -> _Change:
    return lambda begun: replace(begun, options=change(begun.options))


class _Search:
    """The fastest so far, and how it was come to."""

    def __init__(self, best: _Best, stages: StagedWhole, clock: ProgramClock) -> None:
        self.best, self.stages, self.clock = best, stages, clock
        self.first, self.tried, self.steps = best.executed, 0, list[OptimisedStep]()

    def to(self, what: str, change: _Change) -> float:
        """Tries a choice, and takes it where it is faster; s of its program, infinite where none is written."""
        start = change(self.best.start)
        if start.options == self.best.start.options and start.setup == self.best.start.setup:
            return self.best.time.seconds
        self.tried += 1
        made = self.stages(start)
        if not made.ok:
            return np.inf
        time = ranked(self.clock, made)
        if time.seconds < (1.0 - LEAST) * self.best.time.seconds:
            executed = measured(self.clock, made)
            if executed.seconds < (1.0 - LEAST) * self.best.executed.seconds:
                self.steps.append(OptimisedStep(what, self.best.executed.seconds, executed.seconds))
                self.best = _Best(start, made, time, executed)
        return time.seconds

    def least(self) -> float:
        """s that no sharing of the tolerance beats: as few blocks as all of it allows, on a control that has all of it too; 0
        where that is not known."""
        if not isinstance(self.clock, PlanningClock):
            return 0.0
        change = partial(replace, off_path=True, filled=True, smoothing=LITTLE * self.best.start.options.tolerance)
        made = self.stages(_options(change)(self.best.start)) if self._states_smoothing() else self.best.made
        return min(self.clock.least(made), self.best.executed.seconds) if made.ok else 0.0

    def modes(self) -> None:
        """Output modes, of all operations and then of each, where the shop leaves them to us."""
        if self.best.start.options.output != "auto" or self.best.start.setup.output.default != "auto":
            return
        words = [mode for mode in get_args(OutputMode) if mode != "auto" and _has(self.best.start, mode)]
        if len(words) < 2:
            return
        begun = self.best.start
        others = [(OFF_PATH, partial(replace, off_path=True))]
        if self._states_smoothing():
            much = MUCH * begun.options.tolerance
            others.append((f"{OFF_PATH}, {MUCH:.0%} of the tolerance to the control's smoothing",
                           partial(replace, off_path=True, smoothing=much)))
        for mode in words:
            self.to(f"output mode {mode}", _in_mode(mode))
            for what, change in others:
                self.to(f"output mode {mode}, {what}", _both(mode, begun, change))
        for name in _longest(self.best) if len(begun.toolpath.operations) > 1 else ():
            for mode in words:
                if mode != self.best.start.setup.output.default:
                    self.to(f"output mode {mode} of {name}", _in_mode(mode, name))

    def smoothing(self) -> None:
        """The control's share of the tolerance, where its blocks state one."""
        if not self._states_smoothing():
            return
        tolerance, kinematics = self.best.start.options.tolerance, self.best.start.controller.kinematics
        now = self.best.start.options.smoothing
        known = {now / tolerance if now else kinematics.smoothing_share: self.best.time.seconds}
        for share in SHARES:
            known[share] = self._smoothed(share, tolerance)
        for _ in range(NEARER):
            shares = sorted(known)
            at = shares.index(min(known, key=lambda share: known[share]))
            for other in {max(at - 1, 0), min(at + 1, len(shares) - 1)} - {at}:
                share = round(0.5 * (shares[at] + shares[other]), 4)
                known[share] = self._smoothed(share, tolerance)

    def _states_smoothing(self) -> bool:
        """Whether the program says how much the control may take, and the shop leaves it to us."""
        start = self.best.start
        stated = any("{tolerance}" in block for block in start.controller.program.path_tolerance)
        return stated and start.controller.kinematics.smoothing_fixed is None and not start.setup.output.smoothing

    def _smoothed(self, share: float, tolerance: float) -> float:
        return self.to(f"{share:.0%} of the tolerance to the control's smoothing",
                       _options(partial(replace, smoothing=share * tolerance)))


def _has(start: PostResult, mode: OutputMode) -> bool:
    """Whether the control has an output mode."""
    return mode == "axes" or getattr(start.controller.modes, mode, None) is not None


def _in_mode(mode: str, name: str = "") -> _Change:
    """The output mode of one operation, or of all that are left to us."""
    def change(begun: PostResult) -> PostResult:
        output = begun.setup.output
        found = {"operations": {**output.operations, name: mode}} if name else {"default": mode}
        return replace(begun, setup=begun.setup.model_copy(update={"output": output.model_copy(update=found)}))
    return change


def _both(mode: str, begun: PostResult, change: Callable[[Options], Options]) -> _Change:
    """An output mode of all, with other options than those that a conversion began with."""
    return lambda _: _options(change)(_in_mode(mode)(begun))


def _longest(best: _Best) -> Iterator[str]:
    """Names of the operations that take longest."""
    job = best.made.job
    if job is None:
        return
    operation = job.toolpath.operation[job.moves.row]
    seconds = np.bincount(operation, weights=best.time.moves[:len(operation)], minlength=len(job.toolpath.operations))
    for k in np.argsort(-seconds)[:MOST].tolist():
        name = job.toolpath.operations[k].name
        if name and name not in best.start.setup.output.operations:
            yield name
