"""All six errors of a rotary axis from reversal readings, as an error model for the post-processor.

Each error is a Fourier series of the axis's position (C annex A.1, which offers polynomials; a turn is periodic), the
indexer's are free at every increment, the mounting's eighteen are free in each set-up. The readings are linear in all of
them (transport matrices, C 1.25). What mounting and indexer can pretend as well is found by rank and left out: it is listed,
never divided by.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from machines.calibration.problem import CalibrationResult, linear, solve
from machines.calibration.simulator import MOUNTS, PARTS, Bench, motion_jacobian, mount_jacobian
from machines.geometric_error.curves import Fourier
from machines.geometric_error.model import ErrorModel
from machines.geometric_error.names import DIRECTIONS, ErrorName
from machines.geometric_error.serial_errors import Component, SerialErrors
from toolpaths.arrays import Bools, Floats


@dataclass(frozen=True, eq=False)
class RotaryFit:
    """Series of the six errors, (6, 2, H): cosine and sine amplitudes of harmonics 1 .. H, mm and rad.

    Attributes:
        amplitudes, sigma: (6, 2, H); where they are not told amplitude 0 and sigma inf
        covariance: (12 H, 12 H) of the flattened amplitudes
        lost: names of the amplitudes that mounting or indexer can pretend as well
        result: of the fit; the smallest one where the readings leave it open
        residuals: (m, n, 6)
    """

    amplitudes: Floats
    sigma: Floats
    covariance: Floats
    lost: tuple[str, ...]
    result: CalibrationResult
    residuals: Floats


def fit_rotary(bench: Bench, readings: Floats, sigma: Floats, harmonics: int) -> RotaryFit:
    """From readings (m, n, 6), NaN where one is missing; `sigma` (6,) of displacements and turns.

    Raises:
        ValueError: where the steps cannot carry that many harmonics.
    """
    m, n, _ = readings.shape
    if not 1 <= harmonics <= (n - 1) // 2:
        raise ValueError(f"{n} steps carry {(n - 1) // 2} harmonics at the most, {harmonics} are asked for")
    design, names = _design(bench, m, harmonics)
    known = np.isfinite(readings).ravel()
    weights = np.tile(sigma, m * n)[known]
    rows, observed = design[known], readings.ravel()[known]
    count = 12 * harmonics
    lost = _lost(rows / weights[:, None], count)
    result = solve(linear(names, rows, observed, weights))
    values = np.where(lost, 0.0, result.values[:count])
    shape = (len(PARTS), 2, harmonics)
    spread = np.where(lost, np.inf, np.sqrt(np.diag(result.covariance)[:count]))
    residuals = np.full(readings.size, np.nan)
    residuals[known] = result.residuals
    covariance = result.covariance[:count, :count] * np.outer(~lost, ~lost)
    return RotaryFit(values.reshape(shape), spread.reshape(shape), covariance,
                     tuple(np.array(names[:count])[lost].tolist()), result, residuals.reshape(readings.shape))


def _design(bench: Bench, m: int, harmonics: int) -> tuple[Floats, tuple[str, ...]]:
    """(m n 6, P) columns: series of the axis, indexer at every increment, mounting of every set-up; and their names."""
    n = bench.steps
    axis, indexer = motion_jacobian(bench)
    mounts = mount_jacobian(bench)
    phase = bench.angles[:, None] * np.arange(1, harmonics + 1)
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=1)
    series = np.einsum("nrp,nch->nrpch", axis, waves).reshape(n, 6, -1)
    blocks = []
    for k in range(m):
        met = np.zeros((n, 6, 6, n))
        met[np.arange(n), :, :, (np.arange(n) + k) % n] = indexer
        own = np.zeros((n, 6, m, mounts.shape[2]))
        own[:, :, k] = mounts
        blocks.append(np.concatenate([series, met.reshape(n, 6, -1), own.reshape(n, 6, -1)], axis=2).reshape(6 * n, -1))
    names = [f"{part}.{wave}{h}" for part in PARTS for wave in ("cos", "sin") for h in range(1, harmonics + 1)]
    names += [f"indexer.{part}[{i}]" for part in PARTS for i in range(n)]
    names += [f"setup{k}.{mount}.{part}" for k in range(m) for mount in MOUNTS for part in PARTS]
    return np.concatenate(blocks), tuple(names)


def _lost(rows: Floats, count: int) -> Bools:
    """(count,) True for the first columns that lie in the span of the others beyond them, or of lost and others."""
    wanted, nuisance = rows[:, :count], rows[:, count:]
    u, s, _ = np.linalg.svd(nuisance, full_matrices=False)
    span = u[:, s > 1e-9 * s[0]]
    left = wanted - span @ (span.T @ wanted)
    left = left / np.maximum(np.linalg.norm(wanted, axis=0), 1e-300)
    _, values, vt = np.linalg.svd(left, full_matrices=False)
    untold = vt[values <= 1e-6 * max(values[0], 1e-300)]
    result: Bools = np.asarray(np.sum(untold**2, axis=0) > 1e-6)
    return result


def error_model(fitted: RotaryFit, axis: str, machine: str = "", name: str = "") -> ErrorModel:
    """The model of the axis with its covariance; series in the turned frame ("moving"), means 0 (they are mounting)."""
    harmonics = fitted.amplitudes.shape[2]
    components = [Component(ErrorName(part, False, axis), Fourier(np.concatenate([[0.0], *fitted.amplitudes[part]])))
                  for part in range(len(DIRECTIONS))]
    model = ErrorModel(SerialErrors(tuple(components), frame={axis: "moving"}), name=name or axis, machine=machine)
    at = np.concatenate([1 + part * (1 + 2 * harmonics) + np.arange(2 * harmonics) for part in range(len(DIRECTIONS))])
    covariance = np.zeros((len(model.names), len(model.names)))
    covariance[np.ix_(at, at)] = fitted.covariance
    return replace(model, covariance=covariance)
