"""All six errors of a rotary axis from reversal readings, as an error model for the post-processor.

Each error is a Fourier series of the axis's position (C annex A.1, which offers polynomials; a turn is
periodic), the indexer's are free at every increment, the mounting's eighteen are free in each set-up. The
readings are linear in all of them (transport matrices, C 1.25). What mounting and indexer cause as well
is found by rank and left out: it is listed, never divided by.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.calibration.problem import CalibrationResult, linear, solve
from machines.calibration.rotary_bench import MOUNTS, PARTS, Bench, motion_jacobian, mount_jacobian
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, ErrorFrame, SerialErrors
from machines.geometric_error.tables.curves import Fourier
from machines.geometric_error.tables.names import DIRECTIONS, ErrorName
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

ENOUGH = 3
"""set-ups, turned by one increment each: more determine no other amplitudes"""
SPAN = 1e-9
"""of the largest singular value"""
NOTED = 1e-6
"""of a column's length: where mounting and indexer leave less of it, it is not determined"""


@dataclass(frozen=True, eq=False)
@arrays(amplitudes="6 2 H", sigma="6 2 H", covariance="12*H 12*H", residuals="m n 6")
class RotaryFit:
    """Series of the six errors, (6, 2, H): cosine and sine amplitudes of harmonics 1 .. H, mm and rad.

    Attributes:
        amplitudes, sigma: (6, 2, H); where they are not determined amplitude 0 and sigma inf
        covariance: (12 H, 12 H) of the flattened amplitudes
        lost: names of the amplitudes that mounting or indexer cause as well
        result: of the fit; the smallest one where the readings leave it open
        residuals: (m, n, 6)
        noted, condition_number: how many amplitudes the readings determine, and how far apart (2-norm,
            columns of length 1), with mounting and indexer taken out
        cost_instrument: sum of squared weighted residuals where nothing but indexer and mounting is found
    """

    amplitudes: Floats
    sigma: Floats
    covariance: Floats
    lost: tuple[str, ...]
    result: CalibrationResult
    residuals: Floats
    noted: int
    condition_number: float
    cost_instrument: float


def fit_rotary(bench: Bench, readings: Floats, sigma: Floats, harmonics: int,
               robust: bool = False) -> RotaryFit:
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
    lost, noted = _noted(_left(rows / weights[:, None], count))
    result = solve(linear(names, rows, observed, weights), robust)
    scale = np.sqrt(result.weights) / weights
    alone = np.linalg.lstsq(rows[:, count:] * scale[:, None], observed * scale, rcond=SPAN)[0]
    values = np.where(lost, 0.0, result.values[:count])
    shape = (len(PARTS), 2, harmonics)
    spread = np.where(lost, np.inf, np.sqrt(np.diag(result.covariance)[:count]))
    residuals = np.full(readings.size, np.nan)
    residuals[known] = result.residuals
    covariance = result.covariance[:count, :count] * np.outer(~lost, ~lost)
    return RotaryFit(values.reshape(shape), spread.reshape(shape), covariance,
                     tuple(np.array(names[:count])[lost].tolist()), result, residuals.reshape(readings.shape),
                     len(noted), _condition(noted), float(np.sum((scale * (observed - rows[:, count:] @ alone)) ** 2)))


def rotary_span(bench: Bench, readings: Floats, sigma: Floats, harmonics: int) -> tuple[Floats, Floats]:
    """What `fit_rotary` can explain of the known readings (K,) in order, divided by their standard
    deviations: orthonormal columns (K, rank); and those standard deviations (K,)."""
    known, weights = np.isfinite(readings).ravel(), np.tile(sigma, readings.size // 6)
    columns = _design(bench, len(readings), harmonics)[0][known]
    u, s, _ = np.linalg.svd(columns / weights[known][:, None], full_matrices=False)
    return u[:, s > SPAN * s[0]], weights[known]


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


def hidden(bench: Bench, sigma: Floats, harmonics: int) -> tuple[str, ...]:
    """Names of the amplitudes that the mounting causes as well, however many set-ups are measured."""
    design, names = _design(bench, min(bench.steps, ENOUGH), harmonics)
    lost, _ = _noted(_left(design / np.tile(sigma, len(design) // 6)[:, None], 12 * harmonics))
    return tuple(np.array(names[:12 * harmonics])[lost].tolist())


def distinguishable(bench: Bench, m: int, sigma: Floats, harmonics: int) -> float:
    """Condition number (2-norm, columns of length 1) of the amplitudes that m set-ups determine, mounting and
    indexer taken out; inf where they determine none."""
    rows = _design(bench, m, harmonics)[0] / np.tile(sigma, m * bench.steps)[:, None]
    return _condition(_noted(_left(rows, 12 * harmonics))[1])


def _condition(noted: Floats) -> float:
    return float(noted[0] / noted[-1]) if len(noted) else float("inf")


def _left(rows: Floats, count: int) -> Floats:
    """The first columns, scaled to length 1, less what lies in the span of the others."""
    wanted, nuisance = rows[:, :count], rows[:, count:]
    u, s, _ = np.linalg.svd(nuisance, full_matrices=False)
    span = u[:, s > SPAN * s[0]]
    result: Floats = (wanted - span @ (span.T @ wanted)) / np.maximum(np.linalg.norm(wanted, axis=0), 1e-300)
    return result


def _noted(left: Floats) -> tuple[Bools, Floats]:
    """Of what mounting and indexer leave of the wanted columns (K, P): True (P,) for those that they or lost
    ones can make up, and the singular values of what is determined."""
    square, count = np.linalg.qr(left, mode="r"), left.shape[1]
    _, values, vt = np.linalg.svd(np.concatenate([square, np.zeros((count - len(square), count))]))
    return np.asarray(np.sum(vt[values <= NOTED] ** 2, axis=0) > 1e-6), values[values > NOTED]


def error_model(fitted: RotaryFit, axis: str, machine: str = "", sense: int = 1,
                carries_part: bool = False) -> ErrorModel:
    """The model of the axis with its covariance; means 0 (they are mounting).

    The readings have z where what moves turns to at positive commands, x along the machine axis that follows the letter in
    X, Y, Z (A: Y, B: Z, C: X). An axis that carries the tool has its series in the turned frame ("moving"); one that carries
    the part moves the tool relative to it by the inverse, in the frame of the part ("fixed").

    Args:
        sense: -1 where positive commands turn the tool's side against the machine axis
        carries_part: True for an axis on the part's side
    """
    harmonics = fitted.amplitudes.shape[2]
    turn = _to_machine("ABC".index(axis), -sense if carries_part else sense) * (-1.0 if carries_part else 1.0)
    amplitudes = np.einsum("pr,rch->pch", turn, fitted.amplitudes)
    components = [Component(ErrorName(part, False, axis), Fourier(np.concatenate([[0.0], *amplitudes[part]])))
                  for part in range(len(DIRECTIONS))]
    frame: ErrorFrame = "fixed" if carries_part else "moving"
    model = ErrorModel(SerialErrors(tuple(components), frame={axis: frame}), name=axis, machine=machine)
    at = np.concatenate([1 + part * (1 + 2 * harmonics) + np.arange(2 * harmonics) for part in range(len(DIRECTIONS))])
    covariance, spread = np.zeros((len(model.names), len(model.names))), np.kron(turn, np.eye(2 * harmonics))
    covariance[np.ix_(at, at)] = spread @ fitted.covariance @ spread.T
    return replace(model, covariance=covariance)


def _to_machine(along: int, sense: int) -> Floats:
    """(6, 6) torsors of the readings to those along x, y, z of the machine; z of the readings is `sense` times `along`."""
    columns = np.eye(3)[[(along + 1) % 3, (along + 2) % 3, along]].T * [1.0, sense, sense]
    return np.asarray(np.kron(np.eye(2), columns), dtype=np.float64)
