"""Motions that the planner does not solve at once are solved again: in one window, then on a finer mesh.

Any iterate respects the limits at the knots, so that the fastest of the tries is what is left where none is solved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from postproc.feedrate.problem import MotionKnots
from postproc.feedrate.windows import Method, SolvedWindows, solved
from toolpaths.arrays import Floats

WHOLE = 100_000
"""knots up to which a motion is solved again in one window"""
FINER = 2
"""times that all intervals are halved"""
LARGEST = 4_000_000
"""knots beyond which they are not"""


def solved_again(grid: MotionKnots, method: Method,
                 near: Floats | None = None) -> tuple[MotionKnots, SolvedWindows]:
    """The motion on its knots, or on finer ones where those do not solve it; `solved` is False where none did.

    Args:
        near: coefficients (K + 2,) of a similar motion to start from
    """
    best = grid, solved(grid, method, near)
    if best[1].solved:
        return best
    for finer, how, start in _others(grid, method, best[1].c):
        try:
            report = solved(finer, how, start)
        except ArithmeticError:
            continue
        if report.solved:
            return finer, report
        best = min(best, (finer, report), key=lambda one: seconds(*one))
    return best


def _others(grid: MotionKnots, method: Method,
            c: Floats) -> Iterator[tuple[MotionKnots, Method, Floats | None]]:
    """Knots, method and start of each further try: from where the first one stood, then from rest on halved intervals."""
    yield grid, _whole(grid, method), c
    for _ in range(FINER):
        if 2 * len(grid.sigma) > LARGEST:
            return
        grid = halved(grid)
        yield grid, _whole(grid, method), None


def _whole(grid: MotionKnots, method: Method) -> Method:
    return replace(method, window=len(grid.sigma)) if len(grid.sigma) <= WHOLE else replace(
        method, window=4 * method.window, overlap=4 * method.overlap)


def halved(grid: MotionKnots) -> MotionKnots:
    """All intervals in two; new knots as tight as the tighter of their neighbours."""
    sigma = np.insert(grid.sigma, np.arange(1, len(grid.sigma)), 0.5 * (grid.sigma[1:] + grid.sigma[:-1]))
    if grid.tight is None:
        return replace(grid, sigma=sigma)
    between = np.maximum(grid.tight[:, 1:], grid.tight[:, :-1])
    return replace(grid, sigma=sigma, tight=np.insert(grid.tight, np.arange(1, grid.tight.shape[1]), between, axis=1))


def seconds(grid: MotionKnots, report: SolvedWindows) -> float:
    """Time of a solve, as its objective has it."""
    problem = grid.problem()
    return float(np.sum(problem.weight * problem.basis.squared(report.c) ** -0.5))
