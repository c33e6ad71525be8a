"""A measurement file to an error model: read, identify, report; a fit that the data do not support gives no model."""

from __future__ import annotations

from pathlib import Path

from machines.calibration.machine_run import machine_errors
from machines.calibration.measurement_file import COLUMNS, MeasurementModel, ReversalModel, RotaryMeasurementModel
from machines.calibration.outcome import CalibrationOutcome
from machines.calibration.rotary_run import reversal, rotary
from machines.calibration.run import CalibrationRun
from machines.geometric_error.tables.csv_table import CsvTable, read_csv
from machines.loader import load_checked as load_machine
from machines.user_file import read_toml, validate
from toolpaths.diagnostics import Diagnostic, has_errors
from toolpaths.input_files import there_is


def calibrate(source: str | Path, accept_residual: bool = False) -> tuple[CalibrationOutcome | None, list[Diagnostic]]:
    """Identify what a measurement file asks for; None and what is wrong where it cannot be read. Where the
    data do not support a model, or only one that cannot be, the figures come without it.

    Args:
        accept_residual: as in the file; one of them is enough
    """
    file, diagnostics = read_toml(source, None, "measurement")
    if file is None:
        return None, diagnostics
    checked, diagnostics = validate(file, MeasurementModel)
    if checked is None:
        return None, diagnostics
    if accept_residual:
        checked = checked.model_copy(update={"accept_residual": True})
    given = [kind for kind in COLUMNS if getattr(checked, kind) is not None]
    if len(given) != 1:
        return None, [file.problem("calibrate.kind", (), f"{len(given)} kinds of measurement, one is needed",
                                   "write one of " + ", ".join(f"[{k}]" for k in COLUMNS))]
    origin = file.origin(("machine",))
    adjacent = Path(origin.file).parent / checked.machine
    machine, found = load_machine(adjacent if adjacent.suffix == ".toml" and there_is(adjacent) else checked.machine)
    if machine is None:
        return None, found
    return _worked(CalibrationRun(file, checked, machine, given[0]))


def _worked(run: CalibrationRun) -> tuple[CalibrationOutcome | None, list[Diagnostic]]:
    given = getattr(run.checked, run.kind)
    origin = run.file.origin((run.kind, "table"))
    table, found = read_csv(Path(origin.file).parent / given.table, (origin.file, origin.line))
    run.found += found
    done = None if table is None else _identified(run, table)
    if done is not None and has_errors(run.found):
        done = CalibrationOutcome(None, done.figures)
    return done, run.found


def _identified(run: CalibrationRun, table: CsvTable) -> CalibrationOutcome | None:
    given = getattr(run.checked, run.kind)
    if isinstance(given, ReversalModel):
        return reversal(run, given, table)
    return rotary(run, given, table) if isinstance(given, RotaryMeasurementModel) else machine_errors(run, given, table)
