"""`--feed planned` next to the programmed feeds, by the time that the control takes for both programs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np

from postproc.base.program_time import FeedTimes, ProgramTime
from postproc.pipeline.result import PostResult


class ProgramClock(Protocol):
    """Times of written programs by the model of a control."""

    def __call__(self, result: PostResult, band: bool = False) -> ProgramTime: ...


StagedWhole = Callable[[PostResult], PostResult]
"""A conversion through all stages"""


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
    planned, programmed = clock(made, band=True), clock(plain, band=True)
    slower = planned.seconds > programmed.seconds
    kept = not start.controller.feed.limited_jerk and slower and not made.motion.source.tools
    times = FeedTimes(programmed, planned, _stated(plain), _stated(made), made.motion.seconds, kept)
    return replace(plain if kept else made, motion=made.motion, feed_times=times)


def _stated(made: PostResult) -> float:
    """s that the F words of a program state."""
    return 0.0 if made.feeds is None else float(np.nansum(made.feeds.seconds))
