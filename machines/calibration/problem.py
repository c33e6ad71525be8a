"""One form for every identification: what is guessed, what is free, how well it is measured; what comes out,
with its uncertainty.

Weighted least squares by Gauss-Newton steps; for linear models one step is the answer. Columns are scaled to
one length before ranks are taken, so that mm and rad count alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from machines.calibration.noise import Noise, noise_of
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

RANK = 1e-9
"""singular values (of the scaled, weighted Jacobian) below this part of the largest count as none"""
PART = 1e-6
"""least share of a parameter in what cannot be determined, to be named"""
HUBER = 1.345
"""standard deviations beyond which a residual counts linearly in a robust fit (Huber 1964: 95 % efficient)"""
STEPS, ROBUST_STEPS = 30, 300
"""of a fit; the weights of a robust one come to rest slowly"""
STOPS = 1e-8
"""standard deviations: a step that changes no reading by more is the last"""


@dataclass(frozen=True, eq=False)
@arrays(guess="#names", free="#names", observed="R", sigma="R")
class CalibrationProblem:
    """P parameters, R readings.

    Attributes:
        names: (P,) of the parameters
        guess: (P,) start, and what fixed parameters stay at
        free: (P,) True for those that are identified
        observed: (R,) readings
        sigma: (R,) their standard deviations
        predict: values (P,) -> readings (R,)
        jacobian: values (P,) -> d reading / d value (R, P)
    """

    names: tuple[str, ...]
    guess: Floats
    free: Bools
    observed: Floats
    sigma: Floats
    predict: Callable[[Floats], Floats]
    jacobian: Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
@arrays(values="P", sigma="P", covariance="P P", residuals="R", weights="R", leverage="R")
class CalibrationResult:
    """What a fit gives.

    Attributes:
        values, sigma: (P,) parameters and their standard deviations; sigma is 0 for fixed ones, inf where it is not known
        covariance: (P, P) of those that are identified, rows of the others 0; `scale` times what the stated
            noise makes it, where more than that noise is left of the readings
        noise: what is left against the stated noise; None where no reading is to spare
        converged: False where the steps did not end
        cost_before, cost_after: sum of squared weighted residuals
        rank, condition_number: of the scaled, weighted Jacobian of the free parameters
        not_identifiable: groups of names of which only combinations are known
        residuals: (R,) observed less predicted
        weights: (R,) 1, less where a robust fit mistrusts a reading
        leverage: (R,) degrees of freedom that the fit takes of each reading, their sum the rank
    """

    names: tuple[str, ...]
    values: Floats
    sigma: Floats
    covariance: Floats
    converged: bool
    cost_before: float
    cost_after: float
    rank: int
    condition_number: float
    not_identifiable: tuple[tuple[str, ...], ...]
    residuals: Floats
    weights: Floats
    leverage: Floats
    noise: Noise | None = None
    scale: float = 1.0

    @property
    def supported(self) -> bool:
        """True where the data determine every free parameter."""
        return self.converged and not self.not_identifiable


def solve(problem: CalibrationProblem, robust: bool = False) -> CalibrationResult:
    """Least squares; where the data do not determine all, the smallest change from the guess, and the groups
    that they leave."""
    values, weights = np.array(problem.guess), np.ones(len(problem.observed))
    start = problem.observed - problem.predict(values)
    residual, converged = start, False
    for _ in range(ROBUST_STEPS if robust else STEPS):
        decomposed = _Decomposed(problem, values, weights)
        step = decomposed.step(residual * np.sqrt(weights) / problem.sigma)
        values[problem.free] += step
        residual = problem.observed - problem.predict(values)
        before, weights = weights, _huber(residual / problem.sigma) if robust else weights
        still = np.abs(weights - before).max(initial=0.0) < 1e-6
        if still and np.abs(decomposed.effect(step)).max(initial=0.0) <= STOPS:
            converged = True
            break
    decomposed = _Decomposed(problem, values, weights)
    noise = noise_of(residual / problem.sigma, decomposed.rank, robust)
    scale = 1.0 if noise is None else noise.scale
    even = _Decomposed(problem, values, np.ones(len(residual))) if robust else decomposed
    covariance = scale * even.covariance(len(problem.names))
    groups = decomposed.groups()
    sigma = np.sqrt(np.diag(covariance))
    lost = {name for group in groups for name in group}
    sigma[[k for k, name in enumerate(problem.names) if name in lost]] = np.inf
    costs = _cost(start, problem, weights), _cost(residual, problem, weights)
    return CalibrationResult(problem.names, values, sigma, covariance, converged, *costs, decomposed.rank,
                             decomposed.condition_number, groups, residual, weights, decomposed.leverage, noise, scale)


def _cost(residual: Floats, problem: CalibrationProblem, weights: Floats) -> float:
    return float(np.sum(weights * (residual / problem.sigma) ** 2))


def _huber(normalised: Floats) -> Floats:
    size = np.abs(normalised)
    result: Floats = np.where(size > HUBER, HUBER / np.where(size > 0.0, size, 1.0), 1.0)
    return result


class _Decomposed:
    """Singular values of the weighted Jacobian of the free parameters, its columns scaled to length 1."""

    def __init__(self, problem: CalibrationProblem, values: Floats, weights: Floats) -> None:
        self.names, self.free = problem.names, problem.free
        weighted = problem.jacobian(values)[:, problem.free] * (np.sqrt(weights) / problem.sigma)[:, None]
        length = np.linalg.norm(weighted, axis=0)
        self.size = 1.0 / np.where(length > 0.0, length, np.inf)
        self.u, self.s, self.vt = np.linalg.svd(weighted * self.size, full_matrices=False)
        self.full = self.vt if len(self.vt) == self.vt.shape[1] else np.linalg.svd(weighted * self.size)[2]
        self.rank = int(np.sum(self.s > RANK * self.s.max(initial=0.0)))

    @property
    def condition_number(self) -> float:
        """Largest by smallest singular value; inf below full rank."""
        count = int(self.free.sum())
        return float(self.s[0] / self.s[count - 1]) if self.rank == count and count else float("inf") if count else 1.0

    @property
    def leverage(self) -> Floats:
        """(R,) diagonal of the projector on what the parameters can do to the readings."""
        result: Floats = np.sum(self.u[:, : self.rank] ** 2, axis=1)
        return result

    def step(self, residual: Floats) -> Floats:
        """The smallest (scaled) change that fits best."""
        noted = slice(0, self.rank)
        result: Floats = self.vt[noted].T @ ((self.u[:, noted].T @ residual) / self.s[noted]) * self.size
        return result

    def effect(self, step: Floats) -> Floats:
        """What a step changes the readings by, in standard deviations."""
        length = np.where(self.size > 0.0, 1.0 / np.where(self.size > 0.0, self.size, 1.0), 0.0)
        result: Floats = self.u @ (self.s * (self.vt @ (step * length)))
        return result

    def covariance(self, count: int) -> Floats:
        """(count, count): of what the data determine."""
        noted = self.vt[: self.rank].T / self.s[: self.rank] * self.size[:, None]
        result = np.zeros((count, count))
        result[np.ix_(self.free, self.free)] = noted @ noted.T
        return result

    def groups(self) -> tuple[tuple[str, ...], ...]:
        """Parameters that share a direction which the data do not determine, each set once."""
        names = [name for name, free in zip(self.names, self.free, strict=True) if free]
        undetermined = self.full[self.rank:].T
        projector = np.abs(undetermined @ undetermined.T)
        left, found = {k for k in range(len(names)) if projector[k, k] > PART}, []
        while left:
            group, front = set(), {min(left)}
            while front:
                group |= front
                front = {k for k in left - group if any(projector[k, other] > PART for other in group)}
            left -= group
            found.append(tuple(names[k] for k in sorted(group)))
        return tuple(found)


def linear(names: Sequence[str], matrix: Floats, observed: Floats, sigma: Floats,
           free: Bools | None = None) -> CalibrationProblem:
    """The problem matrix (R, P) times values = observed (R,), from 0."""
    chosen = np.ones(len(names), dtype=np.bool_) if free is None else free
    return CalibrationProblem(tuple(names), np.zeros(len(names)), chosen, observed, sigma, lambda values: matrix @ values,
                              lambda values: matrix)
