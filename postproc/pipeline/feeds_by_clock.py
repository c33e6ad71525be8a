"""`--feed planned` next to the programmed feeds, by the time that the control takes for both programs.

The first plan is that of an ideal control: it says where blocks are cut. Where the control's own rules at corners and in
bends are known, the passes are planned again under these, and the words carry that plan.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np

from postproc.base.program_time import ControlPlan, FeedTimes, ProgramTime
from postproc.pipeline.result import PostResult


class ProgramClock(Protocol):
    """Times of written programs by the model of a control."""

    def __call__(self, result: PostResult, band: bool = False) -> ProgramTime: ...


@runtime_checkable
class PlanningClock(ProgramClock, Protocol):
    """One that also executes the control, and plans under its rules."""

    def plan(self, made: PostResult) -> ControlPlan | None:
        """What the control can do of a conversion with planned feeds; None where that is not known."""

    def executed(self, result: PostResult) -> ProgramTime:
        """The time with its band as the control executes the program, cycle by cycle where its model says how."""

    def ranked(self, result: PostResult) -> ProgramTime:
        """The time without its band, near the executed control's: for a choice among dozens of programs."""

    def least(self, result: PostResult) -> float:
        """s where the control had the whole tolerance for itself; 0 where that is no bound."""


StagedWhole = Callable[[PostResult], PostResult]
"""A conversion through all stages"""


def measured(clock: ProgramClock, made: PostResult) -> ProgramTime:
    """The time of a program with its band, by the executed control where its model says how: what is last decided by."""
    return clock.executed(made) if isinstance(clock, PlanningClock) else clock(made, band=True)


def ranked(clock: ProgramClock, made: PostResult) -> ProgramTime:
    """The time of a program among dozens, near the executed control's where the clock has one."""
    return clock.ranked(made) if isinstance(clock, PlanningClock) else clock(made)


def with_compared_feeds(start: PostResult, stages: StagedWhole, clock: ProgramClock | None) -> PostResult:
    """The program with planned feeds, and what they do; the programmed feeds where the control makes its ramps itself and
    planned ones take longer, unless tools have limits of their own, which only planned feeds keep. Other conversions as they
    are."""
    made = stages(start)
    if clock is None or start.options.feed != "planned" or not made.ok or made.motion is None or not made.motion.passes:
        return made
    plain = stages(replace(start, options=replace(start.options, feed="programmed", merge_feeds=0.0)))
    if not plain.ok:
        return made
    found = clock.plan(made) if isinstance(clock, PlanningClock) and start.controller.feed.limited_jerk else None
    if found is not None:
        carried = stages(replace(start, control_plan=found))
        made = carried if carried.ok else made
    planned, programmed = measured(clock, made), measured(clock, plain)
    slower = planned.seconds > programmed.seconds
    kept = not start.controller.feed.limited_jerk and slower and not (made.motion is not None and made.motion.source.tools)
    ideal = 0.0 if made.motion is None else made.motion.seconds
    plan = ideal if found is None or made.control_plan is None else found.seconds
    times = FeedTimes(programmed, planned, _stated(plain), _stated(made), plan, ideal, kept)
    return replace(plain if kept else made, motion=made.motion, feed_times=times)


def _stated(made: PostResult) -> float:
    """s that the F words of a program state."""
    return 0.0 if made.feeds is None else float(np.nansum(made.feeds.seconds))
