"""A measurement file to an error model: read, identify, report; a fit that the data do not support gives no model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from machines.calibration.account import account, finite, listed, parameters, series_signatures, signature, weighted
from machines.calibration.machine_fit import Measurements, fit
from machines.calibration.measurement_file import (
    BarModel,
    LaserModel,
    MeasurementModel,
    PosesModel,
    ReversalModel,
    RotaryModel,
)
from machines.calibration.reversal import identify, plan, statistics
from machines.calibration.rotary_fit import error_model, fit_rotary, hidden, told_apart
from machines.calibration.simulator import PARTS, Bench
from machines.geometric_error.axis_motion import ALONG
from machines.geometric_error.csv_table import ANGLES, LENGTHS, UNITS, CsvTable, read_csv
from machines.geometric_error.curves import Table
from machines.geometric_error.loader import load_checked as load_errors
from machines.geometric_error.model import ErrorModel
from machines.geometric_error.names import DIRECTIONS, ErrorName
from machines.geometric_error.serial_errors import Component, SerialErrors
from machines.kinematics.h4_axes import H4TableAxis
from machines.kinematics.serial import Serial
from machines.loader import load_checked as load_machine
from machines.machine import Machine
from machines.user_file import UserFile, nearest, read_toml, validate
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error, has_errors, info, warning

ARCSEC = UNITS["arcsec"]
SETUPS = 6
"""up to which the condition number of a rotary axis's readings is told"""
SUSPECT = 2.0
"""times the stated standard deviation: what is left of the readings by root mean square is more than noise"""
KINDS = ("reversal", "rotary", "poses", "ball_bar", "laser")


@dataclass(frozen=True)
class Calibration:
    """What was found: the model (None where the data do not support it) and the figures of `calibrate --json`."""

    model: ErrorModel | None
    figures: dict[str, Any]


def calibrate(source: str | Path) -> tuple[Calibration | None, list[Diagnostic]]:
    """Identify what a measurement file asks for; None and what is wrong where it cannot be read."""
    file, diagnostics = read_toml(source, None, "measurement")
    if file is None:
        return None, diagnostics
    checked, diagnostics = validate(file, MeasurementModel)
    if checked is None:
        return None, diagnostics
    given = [kind for kind in KINDS if getattr(checked, kind) is not None]
    if len(given) != 1:
        return None, [file.problem("calibrate.kind", (), f"{len(given)} kinds of measurement, one is needed",
                                   "write one of " + ", ".join(f"[{k}]" for k in KINDS))]
    origin = file.origin(("machine",))
    beside = Path(origin.file).parent / checked.machine
    machine, found = load_machine(beside if beside.suffix == ".toml" and beside.exists() else checked.machine)
    if machine is None:
        return None, found
    return _Run(file, checked, machine, given[0]).result()


class _Run:
    """One measurement file being worked on; collects what is wrong."""

    def __init__(self, file: UserFile, checked: MeasurementModel, machine: Machine, kind: str) -> None:
        self.file, self.checked, self.machine, self.kind = file, checked, machine, kind
        self.found: list[Diagnostic] = []

    def result(self) -> tuple[Calibration | None, list[Diagnostic]]:
        """See `calibrate`."""
        given = getattr(self.checked, self.kind)
        origin = self.file.origin((self.kind, "table"))
        table, found = read_csv(Path(origin.file).parent / given.table, (origin.file, origin.line))
        self.found += found
        if table is None:
            return None, self.found
        done = self._identified(given, table)
        if done is None or (has_errors(self.found) and done.model is not None):
            return None, self.found
        return done, self.found

    def _identified(self, given: Any, table: CsvTable) -> Calibration | None:
        if isinstance(given, ReversalModel):
            return self._reversal(given, table)
        return self._rotary(given, table) if isinstance(given, RotaryModel) else self._machine(given, table)

    def _problem(self, code: str, message: str, hint: str = "", key: str = "table") -> None:
        self.found.append(self.file.problem(code, (self.kind, key), message, hint))

    # ---- tables ----------------------------------------------------------------------------------------------------

    def _columns(self, table: CsvTable, wanted: Sequence[tuple[str, str]]) -> bool:
        """True where all columns are there with the right kind of unit: "length", "angle" or "" for a number."""
        for name, kind in wanted:
            units = {"length": LENGTHS, "angle": ANGLES, "": {"": 1.0}}[kind]
            if name not in table.columns:
                self._problem("calibrate.column", f"{Path(table.file).name} has no column {name!r}",
                              nearest(name, list(table.columns)))
            elif table.unit[name] not in units:
                self._problem("calibrate.unit", f"column {name!r} has unit {table.unit[name]!r}",
                              f"write {name} [unit] with one of " + ", ".join(units) if kind else f"write {name} alone")
        return not has_errors(self.found)

    def _places(self, table: CsvTable, steps: int) -> tuple[Floats, Floats, int] | None:
        """(set-up, step, number of set-ups) of each row."""
        setup, step = table.columns["setup"], table.columns["step"]
        bad = (setup != np.round(setup)) | (setup < 0) | (step != np.round(step)) | (step < 0) | (step >= steps)
        twice = np.ones(len(setup), dtype=np.bool_)
        twice[np.unique(setup * steps + step, return_index=True)[1]] = False
        for where, what in ((bad, f"is no set-up 0, 1, ... and step 0 .. {steps - 1}"), (twice, "was measured before")):
            if where.any():
                row = int(np.argmax(where))
                self.found.append(error("calibrate.row", f"set-up {setup[row]:g}, step {step[row]:g} {what}",
                                        file=table.file, lines=[table.lines[row]]))
                return None
        known = np.unique(setup)
        if known[-1] != len(known) - 1:
            missing = int(np.argmax(known != np.arange(len(known))))
            self._problem("calibrate.setup", f"set-up {known[-1]:g} has readings, set-up {missing} has none",
                          "number the set-ups 0, 1, ... without a gap; `shifts` says how far the indexer was turned in each")
            return None
        return setup.astype(np.int64), step.astype(np.int64), len(known)

    # ---- kinds -----------------------------------------------------------------------------------------------------

    def _axis(self, letter: str) -> int:
        """1 or -1: how the axis turns about x, y or z of the machine at positive commands; 0: not, a problem."""
        if letter not in self.machine.axis_names:
            self._problem("calibrate.axis", f"{self.machine.name} has no axis {letter}", "it has "
                          + ", ".join(self.machine.axis_names), "axis")
            return 0
        kinematics = self.machine.kinematics
        if not isinstance(kinematics, Serial):
            return -1 if isinstance(kinematics, H4TableAxis) and kinematics.sense < 0 else 1
        along = next(j.direction for j in kinematics.chain if j.name == letter)["ABC".index(letter)]
        if abs(along) < 1.0 - ALONG:
            self._problem("calibrate.axis", f"{letter} of {self.machine.name} is inclined: E{letter}{letter} is not its "
                          "positioning error", "measure poses, and name its parameters", "axis")
            return 0
        return 1 if along > 0.0 else -1

    def _carries_part(self, letter: str) -> bool:
        return f"{letter}'" in self.machine.structure or isinstance(self.machine.kinematics, H4TableAxis)

    def _reversal(self, given: ReversalModel, table: CsvTable) -> Calibration | None:
        sense = self._axis(given.axis)
        if not sense or not self._columns(table, (("setup", ""), ("step", ""), ("reading", "angle"))):
            return None
        places = self._places(table, given.steps)
        if places is None:
            return None
        setup, step, m = places
        if given.shifts and len(given.shifts) != m:
            self._problem("calibrate.shifts", f"{len(given.shifts)} shifts for {m} set-ups", "write one per set-up",
                          "shifts")
            return None
        readings = np.full((m, given.steps), np.nan)
        readings[setup, step] = table.columns["reading"]
        sigma = given.sigma_arcsec * ARCSEC
        fitted = identify(readings, sigma, given.zeroed, self.checked.robust, given.shifts or None)
        figures = account(fitted.result, fitted.conditioning.rank, fitted.conditioning.condition_number)
        degrees = np.asarray(np.arange(given.steps) * (360.0 / given.steps), dtype=np.float64)
        curves = {"axis": (fitted.axis, fitted.axis_sigma), "indexer": (fitted.indexer, fitted.indexer_sigma)}
        figures |= {"signatures": {k: signature(degrees, *curve, "arcsec") for k, curve in curves.items()},
                    "residuals": weighted(fitted.residuals, sigma, [f"set-up {k}" for k in range(m)]),
                    "axis_arcsec": listed(fitted.axis / ARCSEC), "axis_sigma_arcsec": listed(fitted.axis_sigma / ARCSEC),
                    "indexer_arcsec": listed(fitted.indexer / ARCSEC),
                    "set_by_closure": ["sum of the axis's errors over a turn", "sum of the indexer's errors over a turn",
                                       *(["constant of each set-up"] if given.zeroed else [])],
                    "residual_rms_arcsec": statistics(fitted.residuals).rms / ARCSEC,
                    "plan": [{"setups": c.setups, "sigma_arcsec": finite(c.sigma / ARCSEC), "minutes": c.minutes,
                              "condition_number": finite(c.condition_number)}
                             for c in plan(given.steps, sigma, self.checked.minutes_per_reading,
                                           self.checked.minutes_per_setup, _planned(given.steps, 12, 864), given.zeroed)]}
        if fitted.lacking:
            self._problem("calibrate.rank", f"the readings do not tell axis and indexer apart: {fitted.lacking}")
            return Calibration(None, figures)
        name = ErrorName(DIRECTIONS.index(given.axis), False, given.axis)
        x = 2.0 * np.pi * np.arange(given.steps) / given.steps
        model = ErrorModel(SerialErrors((Component(name, Table(x, sense * fitted.axis, "spline", period=2.0 * np.pi)),)),
                           covariance=fitted.covariance[: given.steps, : given.steps])
        return self._done(model, figures)

    def _rotary(self, given: RotaryModel, table: CsvTable) -> Calibration | None:
        kinds = (("setup", ""), ("step", ""), *((p, "length" if p[0] == "d" else "angle") for p in PARTS))
        sense = self._axis(given.axis)
        if not sense or not self._columns(table, kinds):
            return None
        places = self._places(table, given.steps)
        if places is None:
            return None
        setup, step, m = places
        readings = np.full((m, given.steps, 6), np.nan)
        readings[setup, step] = np.stack([table.columns[p] for p in PARTS], axis=1)
        sigma = np.repeat([given.sigma_um * 1e-3, given.sigma_arcsec * ARCSEC], 3)
        bench = Bench(given.steps, given.axis_to_indexer, given.indexer_to_reflector, np.array(given.shift))
        if given.harmonics > (given.steps - 1) // 2:
            self._problem("calibrate.harmonics", f"{given.steps} steps carry {(given.steps - 1) // 2} harmonics at the "
                          f"most, {given.harmonics} are asked for", "ask for fewer, or measure more steps", "harmonics")
            return None
        fitted = fit_rotary(bench, readings, sigma, given.harmonics, self.checked.robust)
        model = error_model(fitted, given.axis, sense=sense, carries_part=self._carries_part(given.axis))
        figures = account(fitted.result, fitted.result.rank, fitted.result.condition_number)
        figures |= {"not_identifiable": [[name] for name in fitted.lost], "signatures": series_signatures(fitted),
                    "residuals": weighted(fitted.residuals.reshape(-1, 6).T, sigma[:, None], list(PARTS)),
                    "plan": [{"setups": k, "condition_number": finite(told_apart(bench, k, sigma, given.harmonics))}
                             for k in range(1, _planned(given.steps, SETUPS, 216) + 1)]}
        untold = sorted(set(fitted.lost) - set(hidden(bench, sigma, given.harmonics)))
        if untold:
            self._problem("calibrate.rank", f"the readings do not tell {', '.join(untold[:12])}",
                          "measure one more set-up, the indexer turned by one increment more")
            return Calibration(None, figures)
        if fitted.lost:
            self.found.append(info("calibrate.hidden", "the mounting can pretend " + ", ".join(fitted.lost) + " as well; "
                                   "they are 0 in the model", file=self.file.file))
        return self._done(model, figures)

    def _machine(self, given: PosesModel | BarModel | LaserModel, table: CsvTable) -> Calibration | None:
        names = self.machine.axis_names
        joints = [(n, "angle" if r else "length") for n, r in zip(names, self.machine.rotary, strict=True)]
        wanted = {"poses": ("dx", "dy", "dz"), "ball_bar": ("distance",), "laser": ("reading",)}[self.kind]
        if not self._columns(table, [*joints, *((w, "length") for w in wanted)]):
            return None
        start = self._start()
        if start is None:
            return None
        q = np.stack([table.columns[n] for n in names], axis=1)
        read = np.stack([table.columns[w] for w in wanted], axis=1)
        kinematics, sigma = self.machine.kinematics.with_tool(given.tool_length), given.sigma_um * 1e-3
        if isinstance(given, PosesModel):
            measured = Measurements("position", q, read, sigma, zeroed=given.zeroed)
        elif isinstance(given, BarModel):
            measured = Measurements("distance", q, read[:, 0], sigma, centre=np.array(given.centre))
        else:
            toward = np.array(given.toward) / np.linalg.norm(given.toward)
            measured = Measurements("along", q, read[:, 0], sigma, toward=toward, zeroed=given.zeroed)
        try:
            fitted = fit(start, kinematics, measured, self.checked.parameters, self.checked.robust)
        except ValueError as fault:
            self.found.append(self.file.problem("calibrate.parameter", ("parameters",), str(fault)))
            return None
        result = fitted.result
        rows = result.residuals.reshape(len(q), -1).T
        figures = account(result, result.rank, result.condition_number) | {
            "setup_mm": fitted.setup, "residuals": weighted(rows, sigma, list(wanted))}
        if not result.converged:
            self._problem("calibrate.converged", "the fit does not come to an end", "check units and signs of the table")
        for group in result.not_identifiable:
            self._problem("calibrate.rank", f"the readings tell only combinations of {', '.join(group[:12])}",
                          "measure where they differ, or name fewer under parameters")
        return Calibration(None, figures) if has_errors(self.found) else self._done(fitted.model, figures)

    def _start(self) -> ErrorModel | None:
        if not self.checked.model:
            self.found.append(self.file.problem("calibrate.model", ("model",), "no error model to start from",
                                                "write model = \"start.toml\", with the parameters that are wanted, all 0"))
            return None
        origin = self.file.origin(("model",))
        model, found = load_errors(Path(origin.file).parent / self.checked.model, self.machine)
        self.found += found
        return model

    def _done(self, model: ErrorModel, figures: dict[str, Any]) -> Calibration:
        if figures["rms_after"] > SUSPECT:
            self.found.append(warning("calibrate.residual", f"what is left is {figures['rms_after']:.1f} times the stated "
                                      "standard deviation of the readings: the model's own doubt is too small by as much",
                                      file=self.file.file, hint="look for wrong signs, units and outliers (robust = true), "
                                      "or state what the instrument really does"))
        model = replace(model, machine=self.machine.name)
        figures["parameters"] = parameters(model)
        return Calibration(model, figures)


def _planned(steps: int, most: int, readings: int) -> int:
    """Set-ups up to which a campaign is planned: `most`, fewer where they have more readings than that; 2 at the least."""
    return max(2, min(steps, most, readings // steps))
