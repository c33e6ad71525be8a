"""Solving a motion: in one piece, or for long ones in windows that overlap, every stitch checked.

Windows have free ends: far enough from its ends the optimal speed does not depend on them, so that neighbours agree
in the middle of the overlap. There the coefficients are blended; where they differ or the blend exceeds a
limit the overlap is widened.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from postproc.feedrate.interior import InteriorSolution, NewtonSteps, NumpySteps, solve
from postproc.feedrate.problem import MotionKnots, SpeedProblem
from postproc.feedrate.shares import weigh
from postproc.feedrate.spline import Basis
from toolpaths.arrays import Floats
from toolpaths.compiled import available
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

WINDOW, OVERLAP = 4096, 512
"""Knots of a window, and on each side beyond it."""
APART, OVER = 1e-3, 1.002
"""Relative difference of neighbours, and ratio to a limit in the blend, from which the overlap is widened."""
WIDEST = 16
"""Times the asked overlap beyond which it is not widened."""


COLD, WARM = 5.0, 1.0
"""First gap over time, from a slow start and from a similar motion; far below it the motion is hemmed in before it can
grow, and takes up to three times the steps."""


@dataclass(frozen=True)
class Method:
    """How to solve: compiled loops or numpy (None: compiled where that can be), threads, window and overlap in knots.

    Never by what is compiled already: the two differ in the last bits, and a program must not depend on what the process
    did before.
    """

    kernel: bool | None = None
    threads: int = 1
    window: int = WINDOW
    overlap: int = OVERLAP

    def settled(self) -> Method:
        """With `kernel` decided."""
        return self if self.kernel is not None else replace(self, kernel=available())

    @property
    def steps(self) -> Callable[[SpeedProblem, Floats], NewtonSteps]:
        """What makes one linearisation; numpy unless `kernel` is true."""
        if self.kernel:
            from postproc.feedrate.interior_packed import PackedSteps

            return PackedSteps
        return NumpySteps


@dataclass(frozen=True)
@arrays(c="C", weights="3 R")
class SolvedWindows:
    """Coefficients (K + 2,); most iterations of a window; worst stitch (relative difference); whether all
    were solved; seconds of each row (3, R + 1), see `shares.weigh`."""

    c: Floats
    iterations: int
    mismatch: float
    solved: bool
    weights: Floats
    basis: Basis | None = None
    """of all knots, where one window is the whole"""


class WindowSolution(NamedTuple):
    """A window's first knot, coefficients, iterations, success, the seconds of the rows in its own part, its basis."""

    first: int
    c: Floats
    iterations: int
    solved: bool
    weights: Floats
    basis: Basis | None


def solved(knots: MotionKnots, method: Method, near: Floats | None = None) -> SolvedWindows:
    """Least time on the knots; `near`: coefficients (K + 2,) of a similar motion to start from."""
    count = len(knots.sigma)
    make = method.settled().steps
    inner = np.linspace(0, count, max(1, round(count / method.window)) + 1).astype(int).tolist()
    windows = list(pairwise(inner))
    wide = [method.overlap] * len(windows)
    found = [WindowSolution(0, np.empty(0), 0, False, np.empty(0), None)] * len(windows)
    again = list(range(len(windows)))
    while again:
        _solve_some(knots, windows, wide, again, found, make, method.threads, near)
        c, bad, worst = _stitched(knots, inner, [min(pair) for pair in pairwise(wide)], found)
        again = sorted({i for j in bad for i in (j, j + 1) if wide[i] < min(count, WIDEST * method.overlap)})
        for i in again:
            wide[i] *= 2
    return SolvedWindows(_held(knots, c, inner) if bad else c, max(one.iterations for one in found), worst,
                         not bad and all(one.solved for one in found), np.sum([one.weights for one in found], axis=0),
                         found[0].basis)


def _held(knots: MotionKnots, c: Floats, inner: Sequence[int]) -> Floats:
    """Where windows do not agree however wide: all slowed until the stitches, too, respect the limits."""
    share = 1.0
    for middle in inner[1:-1]:
        first, last = max(middle - WINDOW, 0), min(middle + WINDOW, len(knots.sigma))
        here = c[first:last + 2]
        share = min(share, float(np.min(knots.problem(first, last).slowed(here) / here)))
    return c * share


def _solve_some(knots: MotionKnots, windows: Sequence[tuple[int, int]], wide: Sequence[int], which: Sequence[int],
                found: list[WindowSolution], make: Callable[[SpeedProblem, Floats], NewtonSteps], threads: int,
                near: Floats | None) -> None:
    def one(i: int) -> None:
        first, last = max(windows[i][0] - wide[i], 0), min(windows[i][1] + wide[i], len(knots.sigma))
        # A tied end needs its knots in one window.
        first, last = (0 if first < 16 else first), (len(knots.sigma) if last > len(knots.sigma) - 16 else last)
        problem = knots.problem(first, last)
        one = solve_problem(problem, make, None if near is None else near[first:last + 2])
        weights = weigh(problem, one.c, one.multipliers, windows[i][0] - first, windows[i][1] - first)
        found[i] = WindowSolution(first, one.c, one.iterations, one.solved, weights,
                                  problem.basis if len(windows) == 1 else None)

    if threads > 1 and len(which) > 1:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(one, which))
    else:
        for i in which:
            one(i)


def solve_problem(problem: SpeedProblem, make: Callable[[SpeedProblem, Floats], NewtonSteps],
                  near: Floats | None = None) -> InteriorSolution:
    """One problem from its slow start, or from coefficients `near` slowed until they respect its limits."""
    start = problem.start() if near is None else problem.slowed(near)
    seconds = float(np.sum(problem.weight * problem.basis.squared(start) ** -0.5))
    return solve(make(problem, start), problem.rows, (COLD if near is None else WARM) * seconds)


def _stitched(knots: MotionKnots, inner: Sequence[int], wide: Sequence[int],
              found: Sequence[WindowSolution]) -> tuple[Floats, list[int], float]:
    """All coefficients, the stitches that must be widened, the worst relative difference."""
    c = np.empty(len(knots.sigma) + 2)
    for i, one in enumerate(found):
        low, high = (0 if i == 0 else inner[i]), (len(c) if i == len(found) - 1 else inner[i + 1])
        c[low:high] = one.c[low - one.first:high - one.first]
    bad, worst = [], 0.0
    for i, middle in enumerate(inner[1:-1]):
        half = min(wide[i] // 4, middle, len(c) - middle)
        here = slice(middle - half, middle + half)
        left, right = (one.c[here.start - one.first:here.stop - one.first] for one in found[i:i + 2])
        u = (np.arange(2 * half) + 0.5) / (2 * half)
        c[here] = left + (right - left) * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        apart = float(np.max(np.abs(right - left) / np.minimum(left, right)))
        over = float(knots.problem(here.start, here.stop - 2).ratios(c[here]).max())
        worst = max(worst, apart)
        if apart > APART or over > OVER:
            bad.append(i)
    return c, bad, worst
