"""Reversal: a rotary axis and the indexer on it distinguished by turning one against the other.

n steps of a full turn, m set-ups. In set-up k the indexer's zero is turned by k increments, so that step i of
the axis meets increment i + k of the indexer: reading = axis_i - indexer_(i+k) + constant of the set-up.
Steps are 0 .. n - 1.

Each of the two signatures sums to 0 over the turn: that is set (closure), not measured, and so is the
constant of every set-up when the instrument is zeroed again. Source: Oueslati 2004 ("C"), 1.36 to 1.56, with
1.45 put right: the rows of set-up k are those of the identity, shifted by k.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from machines.calibration.problem import CalibrationProblem, CalibrationResult, solve
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


def reversal_matrix(n: int, m: int, measured: Bools | None = None, closure: bool = True,
                    shifts: Sequence[int] | None = None) -> Floats:
    """M of C 1.48: rows set-up by set-up, then the two closures; columns axis (n), indexer (n).

    Args:
        measured: (m, n) False where there is no reading; its row is left out
        shifts: increments by which the indexer is turned in each set-up; default 0, 1, 2, ...
    """
    step = np.arange(n)
    rows = []
    for k in range(m):
        block = np.zeros((n, 2 * n))
        block[step, step] = 1.0
        block[step, n + (step + (k if shifts is None else shifts[k])) % n] = -1.0
        rows.append(block if measured is None else block[measured[k]])
    sums = np.kron(np.eye(2), np.ones(n))
    return np.concatenate([*rows, sums] if closure else rows)


@dataclass(frozen=True, eq=False)
class Conditioning:
    """Rank and condition number (2-norm; inf below full rank) of a reversal system with its closures."""

    rank: int
    unknowns: int
    condition_number: float


def conditioning(n: int, m: int, measured: Bools | None = None,
                 shifts: Sequence[int] | None = None) -> Conditioning:
    """Of M as it is written, C 2.2: rank 13 for m = 1 and 24 from m = 2 on where n = 12."""
    values = np.linalg.svd(reversal_matrix(n, m, measured, shifts=shifts), compute_uv=False)
    rank = int(np.sum(values > 1e-10 * values[0]))
    return Conditioning(rank, 2 * n, float(values[0] / values[-1]) if rank == 2 * n else float("inf"))


@dataclass(frozen=True, eq=False)
@arrays(axis="n", indexer="n", axis_sigma="n", indexer_sigma="n", offsets="m", residuals="m n",
        covariance="2*n 2*n")
class Reversal:
    """Signatures of axis and indexer, in the unit of the readings.

    Attributes:
        axis, indexer: (n,) each with sum 0
        axis_sigma, indexer_sigma: (n,) standard deviations, inf where the readings do not determine
        offsets: (m,) constant of each set-up (0 where they are not asked for)
        residuals: (m, n) reading less model, NaN where there is none
        result: of the fit, in parameters that keep the closures
        conditioning: of the system with closures
        covariance: (2 n, 2 n) of axis and indexer
    """

    axis: Floats
    indexer: Floats
    axis_sigma: Floats
    indexer_sigma: Floats
    offsets: Floats
    residuals: Floats
    result: CalibrationResult
    conditioning: Conditioning
    covariance: Floats


def identify(readings: Floats, sigma: float | Floats, offsets: bool = True, robust: bool = False,
             shifts: Sequence[int] | None = None) -> Reversal:
    """Axis and indexer from readings (m, n), NaN where one is missing; weighted least squares with the closures exact.

    Args:
        sigma: standard deviation of the readings, one or (m, n)
        offsets: True where the instrument was zeroed again at each set-up
        shifts: as in `reversal_matrix`
    """
    m, n = readings.shape
    measured, basis = np.isfinite(readings), np.kron(np.eye(2), closed_basis(n))
    result = solve(_problem(readings, sigma, offsets, shifts), robust)
    both = basis @ result.values[: 2 * n - 2]
    covariance = basis @ result.covariance[: 2 * n - 2, : 2 * n - 2] @ basis.T
    spread = np.sqrt(np.diag(covariance)) if result.supported else np.full(2 * n, np.inf)
    residuals = np.full((m, n), np.nan)
    residuals[measured] = result.residuals
    return Reversal(both[:n], both[n:], spread[:n], spread[n:], result.values[2 * n - 2:], residuals, result,
                    conditioning(n, m, measured, shifts), covariance)


def cost_without(readings: Floats, sigma: float | Floats, offsets: bool = True, robust: bool = False,
                 shifts: Sequence[int] | None = None) -> float:
    """Sum of squared weighted residuals where the axis is taken as perfect; arguments as `identify`."""
    problem = _problem(readings, sigma, offsets, shifts)
    indexer = np.arange(len(problem.names)) >= readings.shape[1] - 1
    return solve(replace(problem, free=problem.free & indexer), robust).cost_after


def reversal_span(readings: Floats, offsets: bool = True, shifts: Sequence[int] | None = None) -> Floats:
    """Orthonormal columns (K, rank) of what `identify` can explain of the known readings (K,) of one standard deviation."""
    problem = _problem(readings, 1.0, offsets, shifts)
    u, s, _ = np.linalg.svd(problem.jacobian(problem.guess)[:, problem.free], full_matrices=False)
    return np.asarray(u[:, s > 1e-9 * s.max(initial=0.0)])


def _problem(readings: Floats, sigma: float | Floats, offsets: bool,
             shifts: Sequence[int] | None) -> CalibrationProblem:
    """In parameters that keep the closures: axis (n - 1), indexer (n - 1), constants of the set-ups (m)."""
    m, n = readings.shape
    measured = np.isfinite(readings)
    matrix = reversal_matrix(n, m, measured, False, shifts)
    basis = np.kron(np.eye(2), closed_basis(n))
    setup = np.repeat(np.arange(m), n)[measured.ravel()]
    columns = np.eye(m)[setup] if offsets else np.zeros((len(setup), m))
    design = np.concatenate([matrix @ basis, columns], axis=1)
    names = (*(f"axis.{k}" for k in range(1, n)), *(f"indexer.{k}" for k in range(1, n)),
             *(f"offset.{k}" for k in range(m)))
    free = np.ones(len(names), dtype=np.bool_)
    free[2 * n - 2:] = offsets
    weights = np.broadcast_to(sigma, readings.shape)[measured]
    return CalibrationProblem(names, np.zeros(len(names)), free, readings[measured], weights, lambda v: design @ v,
                              lambda v: design)


def closed_basis(n: int) -> Floats:
    """(n, n - 1) orthonormal columns that sum to 0."""
    centred = np.eye(n) - 1.0 / n
    return np.asarray(np.linalg.svd(centred)[0][:, : n - 1])


@dataclass(frozen=True)
class Statistics:
    """As the reference defines them: deviation with N - 1, root mean square with N."""

    mean: float
    deviation: float
    rms: float
    largest: float


def statistics(values: Floats) -> Statistics:
    """Of values of any shape; NaN are left out."""
    known = values[np.isfinite(values)]
    deviation = float(known.std(ddof=1)) if len(known) > 1 else float("nan")
    return Statistics(float(known.mean()), deviation, float(np.sqrt(np.mean(known**2))),
                      float(np.abs(known).max()))


@dataclass(frozen=True)
class Campaign:
    """What m set-ups cost and give: mean standard deviation of the axis's signature, minutes on the machine."""

    setups: int
    sigma: float
    condition_number: float
    minutes: float


def plan(n: int, sigma: float, minutes_per_reading: float, minutes_per_setup: float, most: int | None = None,
         offsets: bool = True) -> list[Campaign]:
    """Campaigns of 2 set-ups and more: expected uncertainty against machine time; sigma is infinite where it
    cannot be determined."""
    found = []
    for m in range(2, (most or n) + 1):
        noted = identify(np.zeros((m, n)), sigma, offsets)
        found.append(Campaign(m, float(np.sqrt(np.mean(noted.axis_sigma**2))), noted.conditioning.condition_number,
                              m * (minutes_per_setup + n * minutes_per_reading)))
    return found
