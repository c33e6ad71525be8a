"""Poses, ball-bar and laser: errors of a whole machine, and where ball, bar and laser really were."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from machines.calibration.folded_names import folded, near
from machines.calibration.machine_fit import SETUP, MachineFit, MeasuredQuantity, Measurements, fit
from machines.calibration.measurement_file import COLUMNS, BarModel, LaserModel, PosesModel, TableColumn
from machines.calibration.outcome import MEANT, CalibrationOutcome, done, uncertain
from machines.calibration.quiet_columns import quiet_columns
from machines.calibration.result_figures import account, weighted
from machines.calibration.run import CalibrationRun, approach_column
from machines.calibration.unit_and_sign_checks import machine_table_fault
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.files.loader import load_checked as load_errors
from machines.geometric_error.tables.csv_table import LENGTHS, CsvTable
from machines.geometric_error.tables.curves import TableCurve
from machines.kinematics.base import Kinematics
from toolpaths.arrays import Floats
from toolpaths.diagnostics import has_errors

FAR = 1.0
"""mm that a ball, a bar or a laser's zero may be from what the file says"""
APART = 2.0
"""times the commanded distance, or one part of it, that the median of a bar's readings may be"""
MOST = 3
"""groups that are reported"""
SHORT = 1e-3
"""mm, a bar that is none"""
SEEN = 1e-6
"""mm or rad that an error differs by its approach direction, to be reported"""


def machine_errors(run: CalibrationRun, given: PosesModel | BarModel | LaserModel,
                   table: CsvTable) -> CalibrationOutcome | None:
    """The parameters that are asked for; None where the file is at fault."""
    names = run.machine.axis_names
    joints = [TableColumn(n, "angle" if r else "length") for n, r in zip(names, run.machine.rotary, strict=True)]
    if not run.columns(table, [*joints, *COLUMNS[run.kind]], [approach_column(n) for n in names]):
        return None
    q, approaches, start = run.joints(table), run.approaches(table), _start(run)
    if start is None or has_errors(run.found):
        return None
    kinematics = run.machine.kinematics.with_tool(given.tool_length)
    read = np.stack([table.columns[c.name] for c in COLUMNS[run.kind]], axis=1)
    measured = _measured(given, q, read, approaches)
    if not _reached(run, table, kinematics, q) or not _distances(run, table, kinematics, measured):
        return None
    if not _known(run, start):
        return None
    _lost_motion(run, start, approaches)
    fitted = fit(start, kinematics, measured, run.checked.parameters, run.checked.robust)
    return _judged(run, given, start, kinematics, measured, fitted, table)


def _measured(given: PosesModel | BarModel | LaserModel, q: Floats, read: Floats,
              approaches: Floats) -> Measurements:
    sigma = given.sigma_um * 1e-3
    if isinstance(given, PosesModel):
        return Measurements("position", q, read, sigma, zeroed=given.zeroed, approaches=approaches)
    if isinstance(given, BarModel):
        return Measurements("distance", q, read[:, 0], sigma, centre=np.array(given.centre),
                            approaches=approaches)
    toward = np.array(given.toward) / np.linalg.norm(given.toward)
    return Measurements("along", q, read[:, 0], sigma, toward=toward, zeroed=given.zeroed,
                        approaches=approaches)


def _start(run: CalibrationRun) -> ErrorModel | None:
    if not run.checked.model:
        run.found.append(run.file.problem("calibrate.model", ("model",), "no error model to start from",
                                          "write model = \"start.toml\", with the parameters that are wanted, all 0"))
        return None
    origin = run.file.origin(("model",))
    model, found = load_errors(Path(origin.file).parent / run.checked.model, run.machine)
    run.found += found
    return model


# ---- before the fit ----------------------------------------------------------------------------------------

def _known(run: CalibrationRun, start: ErrorModel) -> bool:
    """False where a parameter is asked for that the start model has not."""
    unknown = [word for word in run.checked.parameters if not any(name.startswith(word) for name in start.names)]
    for word in unknown:
        run.found.append(run.file.problem("calibrate.parameter", ("parameters",),
                                          f"{run.checked.model} has no parameter {word!r}", near(word, start.names)))
    return not unknown


def _reached(run: CalibrationRun, table: CsvTable, kinematics: Kinematics, q: Floats) -> bool:
    """False where the machine cannot stand at a row."""
    lost = ~np.isfinite(kinematics.forward(q)[0]).all(axis=1)
    if lost.any():
        run.row(table, int(np.argmax(lost)), f"{run.machine.name} cannot stand there ({int(lost.sum())} of {len(q)} rows)",
                "look at the units of the axes' columns")
    return not lost.any()


def _distances(run: CalibrationRun, table: CsvTable, kinematics: Kinematics, measured: Measurements) -> bool:
    """False where a bar's readings are of another size than the commanded distances."""
    if measured.centre is None:
        return True
    bars = np.linalg.norm(kinematics.forward(measured.q)[0] - measured.centre, axis=1)
    if bars[least := int(np.argmin(bars))] < SHORT:
        run.row(table, least, f"the tip stands {bars[least]:.3g} mm from the centre, where a bar has no direction",
                "look at centre and tool_length")
        return False
    middle = float(np.median(bars))
    read, unit = float(np.median(measured.read)), table.unit["distance"]
    if middle <= APART * read and read <= APART * middle:
        return True
    fits = [u for u, size in LENGTHS.items() if 0.5 < read / LENGTHS[unit] * size / max(middle, 1e-9) < 2.0]
    run.problem("calibrate.distance", f"distances are {read:.4g} mm in the middle; at the commanded positions they "
                f"would be {middle:.4g} mm", f"write distance [{fits[0]}] in the table" if fits else
                "distance is the whole length of the bar, not what it differs by; look at centre and tool_length")
    return False


def _lost_motion(run: CalibrationRun, start: ErrorModel, approaches: Floats) -> None:
    """Axes that come to another place from either direction, where the table does not say by which they came."""
    names = run.machine.axis_names
    silent = [names[j] for j in start.axes.bidirectional(names) if not approaches[:, j].any()]
    if silent:
        gaps = [f"{axis} (up to {1e3 * gap:.4g} um)" if (gap := _gap(start, axis)) > SEEN else axis for axis in silent]
        run.note("calibrate.ways", f"{run.checked.model} has errors by approach direction for {', '.join(gaps)}, the "
                 "table does not say from which direction it came: the mean is taken",
                 f"add a column {approach_column(silent[0])}, 1 or -1: readings "
                 "from one side alone are off by half of what the approach directions differ")


def _gap(start: ErrorModel, axis: str) -> float:
    """mm, the most that a displacement of an axis differs by its approach direction."""
    both = [c.curve for c in start.axes.components
            if c.name.axis == axis and not c.name.angular and isinstance(c.curve, TableCurve) and c.curve.both]
    return max((float(np.abs(np.diff(curve.values.reshape(2, -1), axis=0)).max()) for curve in both),
               default=0.0)


# ---- after the fit -----------------------------------------------------------------------------------------

def _judged(run: CalibrationRun, given: PosesModel | BarModel | LaserModel, start: ErrorModel, kinematics: Kinematics,
            measured: Measurements, fitted: MachineFit, table: CsvTable) -> CalibrationOutcome:
    result = fitted.result
    rows = result.residuals.reshape(len(measured.q), -1).T
    wanted = run.checked.parameters
    unknowns = sum(not wanted or name.startswith(wanted) for name in start.names)
    unknowns += len(SETUP[measured.kind]) if measured.zeroed else 0
    figures = account(result, result.rank, result.condition_number, unknowns, fitted.cost_instrument)
    figures["setup_mm"] = fitted.setup
    figures["residuals"] = weighted(rows, measured.sigma, [c.name for c in COLUMNS[run.kind]])
    if isinstance(given, BarModel):
        figures["centre_mm"] = [c + fitted.setup[name] for c, name in zip(given.centre, SETUP["distance"], strict=False)]
    if not result.converged:
        run.problem("calibrate.converged", "the fit does not converge",
                    "check units and signs of the table")
    _undetermined(run, result.not_identifiable)
    if has_errors(run.found):
        return CalibrationOutcome(None, figures)
    _far(run, given, measured.kind, fitted.setup)
    travel = run.machine.limits.lower, run.machine.limits.upper
    columns = [c.name for c in COLUMNS[run.kind]]
    units, joints = ([table.unit[name] for name in names] for names in (columns, run.machine.axis_names))
    column = np.arange(len(result.residuals)) % len(columns)
    quiet_columns(run, result, np.broadcast_to(measured.sigma, measured.read.shape).ravel(), column, columns, units)
    return done(run, fitted.model, figures, result.noise, {"sigma_um": given.sigma_um},
                lambda: machine_table_fault(start, kinematics, measured, wanted, travel, units, joints, columns), start,
                wanted)


def _undetermined(run: CalibrationRun, groups: Sequence[tuple[str, ...]]) -> None:
    """Parameters that the readings do not determine, alone or from each other."""
    alone, together = [g[0] for g in groups if len(g) == 1], [folded(g) for g in groups if len(g) > 1]
    approaches = any({name[-1] for name in g} == {"+", "-"} for g in groups)
    hint = "measure where they differ, or name fewer under parameters"
    if alone:
        run.problem("calibrate.rank", f"the readings do not determine {folded(alone)}", hint)
    if together:
        more = f", and of {len(together) - MOST} more" if len(together) > MOST else ""
        run.problem("calibrate.rank", f"the readings determine only combinations of {'; of '.join(together[:MOST])}{more}",
                    f"say in columns such as X way from which direction each axis came; or {hint}" if approaches else hint)


def _far(run: CalibrationRun, given: PosesModel | BarModel | LaserModel, kind: MeasuredQuantity,
         setup: dict[str, float]) -> None:
    """Ball, bar or zero where they cannot be."""
    off = np.array([setup[name] for name in SETUP[kind]])
    away = float(np.linalg.norm(off[:3]))
    if isinstance(given, BarModel):
        at = "[" + ", ".join(f"{c + d:.4f}" for c, d in zip(given.centre, off, strict=False)) + "]"
        if away > FAR:
            uncertain(run, "calibrate.place", f"the ball is found at {at}, {away:.4g} mm from centre = {list(given.centre)}",
                      f"look at tool_length = {given.tool_length:g} and centre; centre = {at} where that is right", "centre")
        if abs(off[3]) > FAR:
            uncertain(run, "calibrate.place",
                      f"distances are {abs(off[3]):.4g} mm too {'short' if off[3] > 0.0 else 'long'}",
                      f"distance is the whole length from ball to ball; look at its unit; {MEANT}")
    elif away > FAR:
        what = "the tip" if isinstance(given, PosesModel) else "the zero"
        uncertain(run, "calibrate.place", f"{what} is found {away:.4g} mm from where it should be",
                  f"readings are actual less nominal; look at their unit and at tool_length; {MEANT}")
