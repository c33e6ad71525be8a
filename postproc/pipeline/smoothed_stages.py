"""`--smooth` as a stage: which points are moved, what is reported of it, and passes taken back where the proof fails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from postproc.job.job import Job
from postproc.pipeline.result import PostResult
from postproc.reference.moves import Moves
from toolpaths.arrays import Ints
from toolpaths.diagnostics import Diagnostic, Severity, info, warning
from toolpaths.units import DEG

if TYPE_CHECKING:
    from postproc.planning.smoothed_moves import Smoothed

ExcludedPasses = frozenset[tuple[int, int]]
"""passes that are not smoothed, as `Smoothed.ranges`"""
Staged = Callable[[PostResult, ExcludedPasses], PostResult]
"""A conversion without smoothing of some passes"""
GRAIN = 2e-3, 2e-5
"""mm, rad: least of what a written point must be nearer to its own CL point than to its neighbours"""
TURNS = 2
"""conversions with the passes taken back that errors name; then all are"""
_SHOWN = 6


def written_moves(job: Job, shares: dict[str, float],
                  left: ExcludedPasses = frozenset()) -> tuple[Moves, list[Diagnostic]]:
    """The moves that are written: those of the CL file, with --smooth moved within their share of the tolerance."""
    if not job.options.smooth:
        return job.moves, []
    made = _smoothed(job, shares, left)
    return made.moves, _staying(job, made)


def _smoothed(job: Job, shares: dict[str, float], left: ExcludedPasses) -> Smoothed:
    from postproc.planning.pass_geometry import stops_of
    from postproc.planning.smoothed_moves import smoothed_moves
    from toolpaths.smoothing.smooth import Tolerance

    bound = job.rounding
    return smoothed_moves(job.moves, Tolerance(shares["points"], shares["axis_points"] * DEG),
                          stops_of(job.toolpath, job.moves),
                          Tolerance(max(GRAIN[0], 2.0 * bound.tip), max(GRAIN[1], 2.0 * bound.axis)), left)


def _staying(job: Job, made: Smoothed) -> list[Diagnostic]:
    """What is reported of points that stay, pass by pass."""
    rows = np.flatnonzero(made.stay)
    if not len(rows):
        return []
    passes = [one for one in made.ranges if made.stay[one[0]:one[1]].any()]
    return [info("smooth.points", f"{len(rows)} of {len(rows) + int(made.moved.sum())} points that --smooth would move stay "
                 f"where they are, in {_named(job, passes)}: they are nearer to their neighbours than it would move them",
                 file=job.toolpath.file, lines=job.moves.line[rows[:_SHOWN]].tolist(), count=len(rows))]


def with_passes_taken_back(result: PostResult, staged: Staged) -> PostResult:
    """A conversion with --smooth: where an error stands against it, again without smoothing the passes that
    it names, and then without any, so that what can be converted without --smooth can be with it."""
    left: ExcludedPasses = frozenset()
    for turn in range(TURNS + 1):
        made = staged(result, left)
        job, shares = made.job, made.shares
        if made.ok or job is None or shares is None or made.moves is None:
            return made if made.ok or not left else _plain(result, staged, made, left)
        smoothed = _smoothed(job, shares, left)
        ranges = [one for one in smoothed.ranges if smoothed.moved[one[0]:one[1]].any()]
        named = _named_by(job.moves, [d for d in made.diagnostics if d.severity is Severity.ERROR], ranges)
        if turn == TURNS or not named:
            return _plain(result, staged, made, left | frozenset(ranges))
        result = replace(result, diagnostics=(*result.diagnostics, _taken_back(job, named, made)))
        left |= frozenset(named)
    raise AssertionError("the last turn returns")


def _plain(result: PostResult, staged: Staged, failed: PostResult, passes: ExcludedPasses) -> PostResult:
    """Without --smooth; the failure of the smoothed program where that fails no less."""
    job = failed.job
    if job is None or not passes:
        return failed
    begun = replace(result, options=replace(result.options, smooth=False),
                    diagnostics=(*result.diagnostics, _taken_back(job, sorted(passes), failed)))
    made = staged(begun, frozenset())
    return made if made.ok else replace(made, options=result.options, diagnostics=tuple(
        d for d in made.diagnostics if d.code != "smooth.taken_back"))


def _named_by(moves: Moves, errors: list[Diagnostic], ranges: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The passes with a line that an error names, or next to one."""
    lines = np.array(sorted({line for one in errors for line in one.lines}), dtype=np.int64)
    rows: Ints = np.flatnonzero(np.isin(moves.line, lines))
    return [(begin, last) for begin, last in ranges
            if np.searchsorted(rows, begin - 1) < np.searchsorted(rows, last, side="right")]


def _taken_back(job: Job, passes: list[tuple[int, int]], failed: PostResult) -> Diagnostic:
    why = next(d for d in failed.diagnostics if d.severity is Severity.ERROR)
    first = np.array([begin for begin, _ in passes], dtype=np.int64)
    return warning("smooth.taken_back", f"{_named(job, passes)} cannot be smoothed within the tolerance and is written as "
                   f"in the CL file: with its points moved, {why.message}", file=job.toolpath.file,
                   lines=job.moves.line[first[:_SHOWN]].tolist(), count=len(passes))


def _named(job: Job, passes: list[tuple[int, int]]) -> str:
    """The first of some passes by operation, number and lines, and how many more there are."""
    begin, last = passes[0]
    path, row = job.toolpath, int(job.moves.row[begin])
    name = path.operations[int(path.operation[row])].name
    lines = job.moves.line[begin:last]
    more = f" and {len(passes) - 1} more" if len(passes) > 1 else ""
    return (f"pass {int(path.pass_[row])}" + (f" of {name}" if name else "") + f" (lines {int(lines.min())} to "
            f"{int(lines.max())})" + more)
