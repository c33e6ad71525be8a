"""Interior point on the squared speed: one Newton step per linearisation, every iterate respects the limits.

Each row g(c) of `SpeedProblem` is convex in c (x^-1/2 less a linear form), so its tangent lies below it:
where the linearised slack stays positive, so does the true one. Slacks are therefore computed from c, never
stored. Newton's equations per step are
    (H + sum (z/g) grad g grad g') dc = -grad f + sum (mu/g) grad g,    dz = mu/g - z - (z/g) grad g' dc,
    H = 3/4 x^-5/2 max(w - sum of the jerk rows' z, 0),
positive definite and, as three coefficients meet at a knot, pentadiagonal. (Convex-concave tangent:
Debrouwere et al., IEEE T-RO 29 (2013); primal-dual interior point: Nocedal and Wright, Numerical Optimization, ch. 19.)
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from postproc.feedrate.problem import SpeedProblem
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

TAU = 0.99
"""Share of the path to the nearest bound that a step may go."""
TOLERANCE = 1e-3
"""Duality gap over time at which to stop; time is then some 3e-5 above the optimum. Much below, profiles chatter."""
MOST = 120


@dataclass(frozen=True)
@arrays(c="C")
class InteriorSolution:
    """Coefficients (K + 2,), iterations used, last gap over time, whether the tolerance was reached, multipliers."""

    c: Floats
    iterations: int
    gap: float
    solved: bool
    multipliers: Multipliers


class Multipliers(NamedTuple):
    """Of the rows: velocity (K,); acceleration and jerk (J, K), that of the upper bound less that of the lower."""

    velocity: Floats
    acceleration: Floats
    jerk: Floats


class NewtonSteps(Protocol):
    """One linearisation; numpy here, compiled loops in `interior_packed.py`."""

    @property
    def c(self) -> Floats:
        """Coefficients (K + 2,)."""
        ...

    def assemble(self, mu: float, primal: float, dual: float) -> tuple[float, float]:
        """Take the last direction so far, prepare the Newton equations; gap sum z g and time sum w x^-1/2."""
        ...

    def direction(self, mu: float) -> tuple[float, float]:
        """Solve them; the largest primal and dual steps (before the factor TAU)."""
        ...

    def multipliers(self) -> Multipliers:
        """At the last `assemble`."""
        ...


def solve(steps: NewtonSteps, rows: int, gap: float, tolerance: float = TOLERANCE,
          most: int = MOST) -> InteriorSolution:
    """Drive `steps` from a first `gap` until it is below tolerance x time.

    Any iterate respects the limits, so that a solution that is not `solved` is slow, not wrong.
    """
    mu, primal, dual = gap / rows, 0.0, 0.0
    time = np.inf
    for iteration in range(most):
        gap, time = steps.assemble(mu, primal, dual)
        if gap < tolerance * time:
            return InteriorSolution(steps.c, iteration, gap / time, True, steps.multipliers())
        primal, dual = (min(1.0, TAU * step) for step in steps.direction(mu))
        if not primal > 0.0:
            break
        shortest = min(primal, dual)
        expected = gap * (1.0 - shortest) + shortest * rows * mu
        mu = min(max((1.0 - shortest) ** 1.4 + 0.3, 0.3), 0.5) * expected / rows
    return InteriorSolution(steps.c, most, gap / time, False, steps.multipliers())


class NumpySteps:
    """The reference in numpy."""

    def __init__(self, problem: SpeedProblem, c: Floats) -> None:
        self.problem, self.c = problem, c.copy()
        self._a, self._j = problem.acceleration_rows(), problem.jerk_rows()
        self._z: list[Floats] = []
        self._dz: list[Floats] = []
        self._dc = np.zeros_like(c)

    def assemble(self, mu: float, primal: float, dual: float) -> tuple[float, float]:
        """See `NewtonSteps`."""
        self.c += primal * self._dc
        self._x = self.problem.basis.values(self.c)
        slack = self.slacks()
        self._z = [z + dual * dz for z, dz in zip(self._z, self._dz, strict=True)] if self._z else [mu / g for g in slack]
        self._slack = slack
        self._newton(mu)
        gap = sum(float(np.sum(z * g)) for z, g in zip(self._z, slack, strict=True))
        return gap, float(np.sum(self.problem.weight * self._x[0] ** -0.5))

    def slacks(self) -> list[Floats]:
        """Velocity (K,), acceleration + and - (J, K), jerk + and - (J, K), coefficients (K + 2,)."""
        x = self.problem.basis.values(self.c)
        root = x[0] ** -0.5
        acceleration = np.einsum("ijk,ik->jk", self._a, x[:2])
        if self.problem.middle is not None:
            acceleration = acceleration + self.problem.middle
        jerk = np.einsum("ijk,ik->jk", self._j, x)
        return [1.0 - x[0] / self.problem.cap, 1.0 - acceleration, 1.0 + acceleration, root - jerk, root + jerk, self.c]

    def _newton(self, mu: float) -> None:
        """Gradient (3, K) and Hessian (3, 3, K) in x, x', x'' at each knot, then the band (3, K + 2) in c."""
        problem, x = self.problem, self._x[0]
        half = 0.5 * x**-1.5
        ratio = [z / g for z, g in zip(self._z, self._slack, strict=True)]
        pull = [mu / g for g in self._slack]
        hessian, gradient = np.zeros((3, 3, len(x))), np.zeros((3, len(x)))
        gradient[0] = problem.weight * half - pull[0] / problem.cap - half * (pull[3] + pull[4]).sum(axis=0)
        gradient[:2] += np.einsum("ijk,jk->ik", self._a, pull[2] - pull[1])
        gradient += np.einsum("ijk,jk->ik", self._j, pull[4] - pull[3])
        curvature = np.maximum(problem.weight - (self._z[3] + self._z[4]).sum(axis=0), 0.0)
        hessian[0, 0] = 0.75 * x**-2.5 * curvature + ratio[0] / problem.cap**2 + half**2 * (ratio[3] + ratio[4]).sum(axis=0)
        hessian[:2, :2] += np.einsum("ajk,bjk,jk->abk", self._a, self._a, ratio[1] + ratio[2])
        hessian += np.einsum("ajk,bjk,jk->abk", self._j, self._j, ratio[3] + ratio[4])
        mixed = half * np.einsum("ijk,jk->ik", self._j, ratio[3] - ratio[4])
        hessian[0] += mixed
        hessian[:, 0] += mixed
        s = problem.basis.stencil
        self._band = _band(np.einsum("iak,ijk,jbk->abk", s, hessian, s), ratio[5])
        self._force = _gather(np.einsum("iak,ik->ak", s, gradient)) + pull[5]

    def direction(self, mu: float) -> tuple[float, float]:
        """See `NewtonSteps`."""
        self._dc = solve_tied(self._band, self._force, self.problem.basis.tied)
        if not np.any(self._dc):
            return 0.0, 0.0
        dx = self.problem.basis.values(self._dc)
        bend = -0.5 * self._x[0] ** -1.5 * dx[0]
        acceleration, jerk = np.einsum("ijk,ik->jk", self._a, dx[:2]), np.einsum("ijk,ik->jk", self._j, dx)
        change = [-dx[0] / self.problem.cap, -acceleration, acceleration, bend - jerk, bend + jerk, self._dc]
        self._dz = [mu / g - z - z / g * d for z, g, d in zip(self._z, self._slack, change, strict=True)]
        return (_reach(self._slack, change), _reach(self._z, self._dz))


    def multipliers(self) -> Multipliers:
        """See `NewtonSteps`."""
        z = self._z
        return Multipliers(z[0], z[1] - z[2], z[3] - z[4])


def _reach(values: list[Floats], changes: list[Floats]) -> float:
    """Largest step that keeps all values at least 0."""
    worst = max(float(np.max(-change / value)) for value, change in zip(values, changes, strict=True))
    return 1.0 / worst if worst > 0.0 else np.inf


def _gather(parts: Floats) -> Floats:
    """(3, K) contributions of each knot to c[k:k+3], summed (K + 2,)."""
    total = np.zeros(parts.shape[1] + 2)
    for a in range(3):
        total[a:a + parts.shape[1]] += parts[a]
    return total


def _band(parts: Floats, diagonal: Floats) -> Floats:
    """(3, K + 2): main diagonal and the two below, from (3, 3, K) contributions."""
    band = np.zeros((3, len(diagonal)))
    band[0] = diagonal
    knots = parts.shape[2]
    for a in range(3):
        for b in range(a + 1):
            band[a - b, b:b + knots] += parts[a, b]
    return band


def tie(low: Floats, right: Floats, tied: tuple[int, int]) -> slice:
    """Sum the equations of tied coefficients into one at either end, in place; the part that is left to solve."""
    first, last = tied
    n = len(right)
    for start, stop, keep in ((0, first, first - 1), (n - last, n, n - last)):
        inner = [low[d, start:max(stop - d, start)].sum() for d in range(3)]
        low[0, keep], right[keep] = inner[0] + 2.0 * (inner[1] + inner[2]), right[start:stop].sum()
    if first > 1:
        low[1, first - 1] += low[2, first - 2]
    if last > 1:
        low[1, n - last - 1] += low[2, n - last - 1]
    return slice(first - 1, n - last + 1)


def solve_tied(low: Floats, right: Floats, tied: tuple[int, int]) -> Floats:
    """Solve the pentadiagonal equations, lower band (3, n) and right side (n,); zeros where they are not definite."""
    from scipy.linalg import solveh_banded

    here = tie(low, right, tied)
    try:
        right[here] = solveh_banded(low[:, here], right[here], lower=True, check_finite=False)
    except np.linalg.LinAlgError:
        return np.zeros_like(right)
    right[:here.start], right[here.stop:] = right[here.start], right[here.stop - 1]
    return right
