"""Reversal and rotary measurements: the errors of one rotary axis, distinguished from those of the indexer on it."""

from __future__ import annotations

import numpy as np

from machines.calibration.folded_names import folded
from machines.calibration.measurement_file import COLUMNS, ReversalModel, RotaryMeasurementModel
from machines.calibration.outcome import CalibrationOutcome, done
from machines.calibration.quiet_columns import quiet_columns
from machines.calibration.result_figures import (
    CalibrationFigures,
    account,
    listed,
    series_signatures,
    signature,
    weighted,
)
from machines.calibration.reversal import Reversal, cost_without, identify, plan, statistics
from machines.calibration.rotary_bench import PARTS, Bench
from machines.calibration.rotary_fit import RotaryFit, distinguishable, error_model, fit_rotary, hidden
from machines.calibration.run import CalibrationRun
from machines.calibration.unit_and_sign_checks import reversal_table_fault, rotary_table_fault
from machines.geometric_error.actual.axis_motion import ALONG
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.tables.csv_table import UNITS, CsvTable
from machines.geometric_error.tables.curves import TableCurve
from machines.geometric_error.tables.names import DIRECTIONS, ErrorName
from machines.kinematics.chain import ROTARY
from toolpaths.arrays import Floats, finite

ARCSEC = UNITS["arcsec"]
SETUPS = 6
"""up to which the condition number of a rotary axis's readings is reported"""


def reversal(run: CalibrationRun, given: ReversalModel, table: CsvTable) -> CalibrationOutcome | None:
    """The signature of an axis; None where the file is at fault."""
    sense = _sense(run, given.axis)
    if not sense or not run.columns(table, COLUMNS["reversal"]) or (places := run.places(table, given.steps)) is None:
        return None
    setup, step, m = places
    if given.shifts and len(given.shifts) != m:
        run.problem("calibrate.shifts", f"{len(given.shifts)} shifts for {m} set-ups",
                    "write one per set-up", "shifts")
        return None
    readings = np.full((m, given.steps), np.nan)
    readings[setup, step] = table.columns["reading"]
    sigma = given.sigma_arcsec * ARCSEC
    fitted = identify(readings, sigma, given.zeroed, run.checked.robust, given.shifts or None)
    figures = _reversal_figures(run, given, fitted, readings, sigma)
    if not fitted.result.supported:
        run.problem("calibrate.rank", "the readings do not distinguish axis and indexer: rank "
                    f"{fitted.conditioning.rank} of {fitted.conditioning.unknowns}", "measure one more set-up, the indexer "
                    "turned by a number of increments that has no divisor in common with the number of steps")
        return CalibrationOutcome(None, figures)
    name = ErrorName(DIRECTIONS.index(given.axis), False, given.axis)
    x = 2.0 * np.pi * np.arange(given.steps) / given.steps
    model = ErrorModel(SerialErrors((Component(name, TableCurve(x, sense * fitted.axis, "spline", period=2.0 * np.pi)),)),
                       covariance=fitted.covariance[: given.steps, : given.steps])
    return done(run, model, figures, fitted.result.noise, {"sigma_arcsec": given.sigma_arcsec},
                lambda: reversal_table_fault(readings, sigma, given, table.unit["reading"]))


def _reversal_figures(run: CalibrationRun, given: ReversalModel, fitted: Reversal, readings: Floats,
                      sigma: float) -> CalibrationFigures:
    degrees = np.asarray(np.arange(given.steps) * (360.0 / given.steps), dtype=np.float64)
    curves = {"axis": (fitted.axis, fitted.axis_sigma), "indexer": (fitted.indexer, fitted.indexer_sigma)}
    known, planned = fitted.conditioning, _planned(given.steps, 12, 864)
    alone = cost_without(readings, sigma, given.zeroed, run.checked.robust, given.shifts or None)
    return {**account(fitted.result, known.rank, known.condition_number, known.unknowns, alone),
        "signatures": {k: signature(degrees, *curve, "arcsec") for k, curve in curves.items()},
        "residuals": weighted(fitted.residuals, sigma, [f"set-up {k}" for k in range(len(readings))]),
        "axis_arcsec": listed(fitted.axis / ARCSEC), "axis_sigma_arcsec": listed(fitted.axis_sigma / ARCSEC),
        "indexer_arcsec": listed(fitted.indexer / ARCSEC),
        "set_by_closure": ["sum of the axis's errors over a turn", "sum of the indexer's errors over a turn",
                           *(["constant of each set-up"] if given.zeroed else [])],
        "residual_rms_arcsec": statistics(fitted.residuals).rms / ARCSEC,
        "plan": [{"setups": c.setups, "sigma_arcsec": finite(c.sigma / ARCSEC), "minutes": c.minutes,
                  "condition_number": finite(c.condition_number)}
                 for c in plan(given.steps, sigma, run.checked.minutes_per_reading, run.checked.minutes_per_setup, planned,
                               given.zeroed)]}


def rotary(run: CalibrationRun, given: RotaryMeasurementModel, table: CsvTable) -> CalibrationOutcome | None:
    """The six series of an axis; None where the file is at fault."""
    sense = _sense(run, given.axis)
    if not sense or not run.columns(table, COLUMNS["rotary"]) or (places := run.places(table, given.steps)) is None:
        return None
    setup, step, m = places
    readings = np.full((m, given.steps, 6), np.nan)
    readings[setup, step] = np.stack([table.columns[p] for p in PARTS], axis=1)
    sigma = np.repeat([given.sigma_um * 1e-3, given.sigma_arcsec * ARCSEC], 3)
    bench = Bench(given.steps, given.axis_to_indexer, given.indexer_to_reflector, np.array(given.shift))
    if given.harmonics > (given.steps - 1) // 2:
        run.problem("calibrate.harmonics", f"{given.steps} steps carry {(given.steps - 1) // 2} harmonics at the "
                    f"most, {given.harmonics} are asked for", "ask for fewer, or measure more steps", "harmonics")
        return None
    fitted = fit_rotary(bench, readings, sigma, given.harmonics, run.checked.robust)
    figures = _rotary_figures(given, bench, fitted, sigma)
    never = hidden(bench, sigma, given.harmonics) if fitted.lost else ()
    undetermined = [name for name in fitted.lost if name not in never]
    if undetermined:
        run.problem("calibrate.rank", f"the readings do not determine {folded(undetermined)}",
                    "measure one more set-up, the indexer turned by one increment more")
        return CalibrationOutcome(None, figures)
    if fitted.lost:
        run.note("calibrate.hidden",
                 f"an error of the mounting has the same effect as {', '.join(fitted.lost)}; they are 0 in the model")
    model = error_model(fitted, given.axis, sense=sense, carries_part=_carries_part(run, given.axis))
    column = np.flatnonzero(np.isfinite(readings)) % len(PARTS)
    quiet_columns(run, fitted.result, sigma[column], column, PARTS, [table.unit[p] for p in PARTS])
    return done(run, model, figures, fitted.result.noise,
                {"sigma_um": given.sigma_um, "sigma_arcsec": given.sigma_arcsec},
                lambda: rotary_table_fault(bench, readings, sigma, given.harmonics, [table.unit[p] for p in PARTS]))


def _rotary_figures(given: RotaryMeasurementModel, bench: Bench, fitted: RotaryFit,
                    sigma: Floats) -> CalibrationFigures:
    planned = _planned(given.steps, SETUPS, 216)
    return {**account(fitted.result, fitted.noted, fitted.condition_number, fitted.amplitudes.size, fitted.cost_instrument),
        "not_identifiable": [[name] for name in fitted.lost], "signatures": series_signatures(fitted),
        "residuals": weighted(fitted.residuals.reshape(-1, 6).T, sigma[:, None], list(PARTS)),
        "plan": [{"setups": k, "condition_number": finite(distinguishable(bench, k, sigma, given.harmonics))}
                 for k in range(1, planned + 1)]}


def _sense(run: CalibrationRun, letter: str) -> int:
    """1 or -1: how the axis turns about x, y or z of the machine at positive commands; 0: not, a problem."""
    machine, kinematics = run.machine, run.machine.kinematics
    if letter not in machine.axis_names:
        run.problem("calibrate.axis", f"{machine.name} has no axis {letter}", "it has " + ", ".join(machine.axis_names),
                    "axis")
        return 0
    along = kinematics.axis_line(letter)[0][ROTARY.index(letter)]
    if abs(along) < 1.0 - ALONG:
        run.problem("calibrate.axis", f"{letter} of {machine.name} is inclined: E{letter}{letter} is not its "
                    "positioning error", "measure poses, and name its parameters", "axis")
        return 0
    return 1 if along > 0.0 else -1


def _carries_part(run: CalibrationRun, letter: str) -> bool:
    return f"{letter}'" in run.machine.structure or run.machine.kinematics.carries_part(letter)


def _planned(steps: int, most: int, readings: int) -> int:
    """Set-ups up to which a campaign is planned: `most`, fewer where they have more readings than that; 2 at least."""
    return max(2, min(steps, most, readings // steps))
