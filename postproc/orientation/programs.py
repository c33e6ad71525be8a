"""A conversion with chosen tool axes: the choice, and the program that proved it where that is the one asked for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from postproc.options import Options
from postproc.orientation.orient import OrientationChoice, orient
from postproc.orientation.rounds import Progress

if TYPE_CHECKING:
    from postproc.pipeline import PostResult

Stages = Callable[["PostResult", Progress | None], "PostResult"]


def oriented(start: PostResult, stages: Stages, progress: Progress | None = None) -> PostResult:
    """`start`, a conversion before its first stage, with the tool axes of the plan `orient` of its options.

    The plan is proved by `stages` (from a path to its program) with what convert, verify and trace all know: feeds, output
    mode, smoothing and geometric errors are left out, so that the three choose the same axes.
    """
    assert start.toolpath is not None
    plan, options = start.options.orient, common(start.options)

    def program(choice: OrientationChoice) -> PostResult:
        begun = replace(start, options=options, diagnostics=(), toolpath=choice.toolpath(plan), choice=choice)
        return stages(begun, progress)

    choice, found = orient(start.toolpath, start.machine, start.setup, start.options, progress, convert=program)
    path = start.toolpath if choice is None else choice.toolpath(plan)
    return replace(start, toolpath=path, choice=choice, diagnostics=(*start.diagnostics, *found))


def common(options: Options) -> Options:
    """The options by which tool axes are chosen and proved."""
    plain = Options()
    return replace(options, feed_mode=plain.feed_mode, output=plain.output, feed=plain.feed, merge_feeds=plain.merge_feeds,
                   smooth=plain.smooth, error_model=plain.error_model, error_beyond=plain.error_beyond)


def written(start: PostResult) -> PostResult | None:
    """The program that proved the choice of `start`, where it is what `start` would come to."""
    program = None if start.choice is None else start.choice.program
    if program is None or program.options != start.options:
        return None
    return replace(program, diagnostics=(*start.diagnostics, *program.diagnostics), choice=start.choice)
