"""What a calibration found, as plain numbers: the figures of `calibrate --json` and of its drawing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NotRequired, TypedDict

import numpy as np

from machines.calibration.problem import CalibrationResult
from machines.calibration.rotary_bench import PARTS
from machines.calibration.rotary_fit import RotaryFit
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.files.covariance import angular
from machines.geometric_error.tables.csv_table import UNITS
from machines.geometric_error.tables.curves import TableCurve
from machines.kinematics.chain import ROTARY
from toolpaths.arrays import Floats, finite

CURVE = 5
"""degrees between the points of a drawn series"""
Numbers = list[float | None]
"""plain numbers, None where one is not finite"""


class FoundParameter(TypedDict):
    """A parameter that was found; see `parameters`."""

    value: float
    sigma: float | None
    unit: str
    at: str


class Signature(TypedDict):
    """A curve over the position of an axis; see `signature`."""

    degrees: Numbers
    values: Numbers
    sigma: Numbers
    unit: str


class PlannedCampaign(TypedDict):
    """What so many set-ups would determine."""

    setups: int
    condition_number: float | None
    sigma_arcsec: NotRequired[float | None]
    minutes: NotRequired[float]


class CalibrationFigures(TypedDict):
    """The keys of `calibrate --json`: of every fit (`account`), and of its kind."""

    parameters: dict[str, FoundParameter]
    kept: int
    rank: int
    unknowns: int
    condition_number: float | None
    readings: int
    spare: int
    rms_before: float
    rms_instrument: float
    rms_after: float
    reduced: float | None
    chance: float | None
    covariance_scale: float
    converged: bool
    not_identifiable: list[list[str]]
    residuals: NotRequired[dict[str, Numbers]]
    signatures: NotRequired[dict[str, Signature]]
    plan: NotRequired[list[PlannedCampaign]]
    axis_arcsec: NotRequired[Numbers]
    axis_sigma_arcsec: NotRequired[Numbers]
    indexer_arcsec: NotRequired[Numbers]
    set_by_closure: NotRequired[list[str]]
    residual_rms_arcsec: NotRequired[float]
    setup_mm: NotRequired[dict[str, float]]
    centre_mm: NotRequired[list[float]]


def account(result: CalibrationResult, rank: int, number: float, unknowns: int,
            cost_instrument: float) -> CalibrationFigures:
    """Of every fit: rank of so many unknowns, condition number (None where it is infinite), weighted residual
    (root mean square) before, with nothing found but what belongs to the instrument, and after; `reduced` is
    that after, by readings less unknowns (None where there are no more readings than that), `chance` that
    readings at their stated noise leave as much, `covariance_scale` what the covariance of the stated noise
    was multiplied by."""
    count, spare, noise = max(len(result.residuals), 1), len(result.residuals) - result.rank, result.noise
    return {"parameters": {}, "kept": 0, "rank": rank, "unknowns": unknowns, "condition_number": finite(number),
            "readings": len(result.residuals), "spare": spare, "rms_before": float(np.sqrt(result.cost_before / count)),
            "rms_instrument": float(np.sqrt(cost_instrument / count)),
            "rms_after": float(np.sqrt(result.cost_after / count)),
            "reduced": None if noise is None else noise.left, "chance": None if noise is None else noise.more,
            "covariance_scale": result.scale,
            "converged": result.converged, "not_identifiable": [list(group) for group in result.not_identifiable]}


def parameters(model: ErrorModel, wanted: Sequence[str] = ()) -> dict[str, FoundParameter]:
    """By name, of those that begin as one of `wanted` (all without): value, sigma (None where it is not known), unit (um or
    arcsec), at: the position that a value of a table is of, "X -300", "X -300 +" with its approach direction ("" for all
    others)."""
    sigma = np.zeros(len(model.names)) if model.covariance is None else np.sqrt(np.diag(model.covariance))
    units = ["arcsec" if angular(name, model.rods) else "um" for name in model.names]
    places = _places(model)
    return {name: {"value": float(v / UNITS[u]), "sigma": float(s / UNITS[u]) if s > 0.0 else None, "unit": u,
                   "at": places.get(name, "")}
            for name, v, s, u in zip(model.names, model.values, sigma, units, strict=True)
            if not wanted or name.startswith(tuple(wanted))}


def _places(model: ErrorModel) -> dict[str, str]:
    """Where the values of tables belong, by name."""
    found = {}
    for component in model.axes.components:
        curve, axis = component.curve, component.name.axis
        if isinstance(curve, TableCurve):
            at = np.degrees(curve.x) if axis in ROTARY else curve.x
            for k, label in enumerate(curve.labels()):
                found[f"{component.name}{label}"] = f"{axis} {at[k % len(at)]:.7g}{' ' + label[-1] if curve.both else ''}"
    return found


def signature(degrees: Floats, values: Floats, sigma: Floats, unit: str) -> Signature:
    """A curve (N,) over the axis's position with its standard deviation; mm or rad in, `unit` out."""
    return {"degrees": listed(degrees), "values": listed(values / UNITS[unit]), "sigma": listed(sigma / UNITS[unit]),
            "unit": unit}


def series_signatures(fitted: RotaryFit) -> dict[str, Signature]:
    """The six series of a rotary axis over a turn, by reading; amplitudes that are not reported count as 0."""
    degrees = np.arange(0.0, 360.0 + CURVE, CURVE)
    phase = np.radians(degrees)[:, None] * np.arange(1, fitted.amplitudes.shape[2] + 1)
    waves = np.concatenate([np.cos(phase), np.sin(phase)], axis=1)
    size, found = waves.shape[1], {}
    for k, part in enumerate(PARTS):
        own = fitted.covariance[k * size:(k + 1) * size, k * size:(k + 1) * size]
        spread = np.sqrt(np.einsum("na,ab,nb->n", waves, own, waves))
        unit = "um" if part[0] == "d" else "arcsec"
        found[part] = signature(degrees, waves @ fitted.amplitudes[k].ravel(), spread, unit)
    return found


def weighted(rows: Floats, sigma: Floats | float, names: list[str]) -> dict[str, Numbers]:
    """Residuals (K, R) of K named rows in standard deviations (broadcast), None where there is no reading."""
    return {name: listed(row) for name, row in zip(names, rows / sigma, strict=True)}


def listed(values: Floats) -> Numbers:
    """Plain numbers, None where one is not finite."""
    return [finite(float(v)) for v in values]
