"""Strict mode: solved again, with tighter rows and more knots where limits are exceeded between knots."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from postproc.feedrate.problem import MotionKnots
from postproc.feedrate.solve_again import solved_again
from postproc.feedrate.tightening import Tighter, seen_between, slowdown, tighter
from postproc.feedrate.windows import Method, SolvedWindows
from toolpaths.arrays import Floats

SPLIT = (1.5, 1.5, 1.02, 1.02)
"""Ratios between knots from which an interval is halved, by the number of tightenings before."""
NEAR = 1.002
"""Factor on time that is left to the final slowing down: another solve would gain less than it takes."""


class StrictMotion(NamedTuple):
    """Knots, without their tightening, and report of a solve; the factor on time that it still needs between its knots, and its
    seconds with that."""

    grid: MotionKnots
    report: SolvedWindows
    slower: float
    seconds: float


def strictly(grid: MotionKnots, method: Method, passes: int) -> StrictMotion:
    """The fastest of up to `passes` + 1 solves, by what they still need."""
    best, near = None, None
    for before in range(passes + 1):
        grid, report = solved_again(grid, method, near)
        near = None
        last, better = _looked_at(grid, report, SPLIT[min(before, len(SPLIT) - 1)], bool(method.kernel))
        best = last if best is None or last.seconds < best.seconds else best
        if better is None:
            break
        grid, near = better.grid, inserted(report.c, better)
    assert best is not None
    return best


def _looked_at(grid: MotionKnots, report: SolvedWindows, split_from: float,
               kernel: bool) -> tuple[StrictMotion, Tighter | None]:
    """What a solve still needs; tighter knots where that is worth another one."""
    seen, seconds = seen_between(grid, report.c, kernel)
    slower = slowdown(seen)
    held = StrictMotion(replace(grid, tight=None), report, slower, slower * seconds)
    return held, tighter(grid, seen, split_from) if slower > NEAR else None


def inserted(c: Floats, better: Tighter) -> Floats:
    """Coefficients (K + 2,) of a motion on the knots before as they about are on the knots there are now."""
    return np.insert(c, better.behind + 2, 0.5 * (c[better.behind + 1] + c[better.behind + 2]))
