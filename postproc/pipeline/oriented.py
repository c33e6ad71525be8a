"""A conversion with chosen tool axes: the choice, and the program that proved it where that is the one asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from postproc.base.options import Options
from postproc.base.progress import Progress
from postproc.orientation.passes.passes import work_of
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import bettered, planned_choice, unsolved
from postproc.orientation.turning.turning_choice import TurningChoice, turning_choice
from postproc.orientation.turning.turning_report import noted, unused
from postproc.pipeline.axes_by_clock import fastest
from postproc.pipeline.feeds_by_clock import ProgramClock
from postproc.pipeline.proved_axes import proved
from postproc.pipeline.result import PostResult
from postproc.pipeline.turned_axes import turned_by_clock, turned_by_plan

Stages = Callable[[PostResult, Progress | None], PostResult]


def oriented(start: PostResult, stages: Stages, progress: Progress | None = None,
             clock: ProgramClock | None = None) -> tuple[PostResult, PostResult | None]:
    """`start`, a conversion before its first stage, with the tool axes of the plan `orient` of its options;
    the program that proved the plan, written or refused, None where there is no choice.

    The plan is proved by `stages` (from a path to its program) with what convert, verify and trace all know:
    feeds, output mode, smoothing and geometric errors are left out, so that the three choose the same axes.
    With a `clock`, `auto` is the plan whose program is the fastest on the control. Where the set-up has a cone, the axes of
    `auto` turn along its cuts as well.
    """
    plan, options = start.options.orient, common(start.options)

    def program_of(choice: OrientationChoice) -> PostResult:
        begun = replace(start, options=options, diagnostics=(), toolpath=choice.toolpath(plan), choice=choice)
        return stages(begun, progress)

    clearance = start.setup.clearance
    index = clearance.index or start.controller.links.index  # the path between passes counts as the program goes it
    setup = start.setup.model_copy(update={"clearance": clearance.model_copy(update={"index": index})})
    choice, found = planned_choice(start.toolpath, start.machine, setup, start.options, progress)
    if choice is None:
        return start.with_found(found), None
    made, more = proved(choice, plan, program_of)
    if clock is not None and plan == "auto":
        made = fastest(made, program_of, clock)
    choice, found = bettered(made.choice), [*found, *more, *unsolved(made.choice, plan)]
    if plan != "auto":
        found += unused(start.setup.orientation, f"--orient {plan} is of 3+2 passes alone", start.options.setup)
    begun = replace(start.with_found(found), toolpath=choice.toolpath(plan), choice=choice)
    if plan != "auto" or not made.program.ok or not choice.work.setup.orientation.turns:
        return begun, made.program

    def program_with(turning: TurningChoice) -> PostResult:
        begun = replace(start, options=options, diagnostics=(), toolpath=turning.toolpath, choice=choice, turning=turning)
        return stages(begun, progress)
    return _turned(begun, made.program, program_with, clock, progress)


def _turned(begun: PostResult, keep: PostResult, write: Callable[[TurningChoice], PostResult], clock: ProgramClock | None,
            progress: Progress | None) -> tuple[PostResult, PostResult]:
    """With axes that turn along cuts where that is faster; `keep`: the program without."""
    work, found = work_of(begun.toolpath, begun.machine, begun.setup, begun.options)
    if work is None:
        return begun.with_found(found), keep
    tried = turning_choice(work, begun.options, progress)
    turning, made = turned_by_plan(tried, keep, write) if clock is None else turned_by_clock(tried, keep, write, clock)
    turned = turning.toolpath if any(turning.picked) else None
    choice = None if begun.choice is None else replace(begun.choice, turned=turned)
    begun = replace(begun.with_found(noted(turning)), toolpath=turning.toolpath, choice=choice, turning=turning)
    return begun, replace(made, turning=turning)


def common(options: Options) -> Options:
    """The options by which tool axes are chosen and proved."""
    plain = Options()
    return replace(options, feed_mode=plain.feed_mode, output=plain.output, feed=plain.feed, merge_feeds=plain.merge_feeds,
                   optimise=plain.optimise, off_path=plain.off_path, filled=plain.filled, smoothing=plain.smoothing,
                   smooth=plain.smooth, error_model=plain.error_model, error_beyond=plain.error_beyond)


def written(start: PostResult, program: PostResult | None) -> PostResult | None:
    """The program that proved the choice of `start`, where it is what `start` would come to."""
    if start.choice is None or program is None or program.options != start.options:
        return None
    return replace(program, diagnostics=(*start.diagnostics, *program.diagnostics), choice=start.choice,
                   turning=start.turning)
