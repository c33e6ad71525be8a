"""One measurement file being worked on: its tables checked, what is wrong collected."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from machines.calibration.measurement_file import MeasurementModel, TableColumn
from machines.geometric_error.tables.csv_table import ANGLES, LENGTHS, CsvTable
from machines.geometric_error.tables.names import parse
from machines.machine import Machine
from machines.user_file import UserFile
from machines.value_words import nearest
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error, has_errors, info, warning

LARGEST = 1e6
"""mm or rad"""
EDGE = 1e-6
"""mm or rad beyond a travel that are numbers' own"""
UNIT = {"length": LENGTHS, "angle": ANGLES, "": {"": 1.0}}


class CalibrationRun:
    """A checked file with its machine; `found` collects what is wrong."""

    def __init__(self, file: UserFile, checked: MeasurementModel, machine: Machine, kind: str) -> None:
        self.file, self.checked, self.machine, self.kind = file, checked, machine, kind
        self.found: list[Diagnostic] = []

    def problem(self, code: str, message: str, hint: str = "", key: str = "table") -> None:
        """An error at a key of the kind of measurement."""
        self.found.append(self.file.problem(code, (self.kind, key), message, hint))

    def warn(self, code: str, message: str, hint: str = "") -> None:
        """A warning of the whole file."""
        self.found.append(warning(code, message, file=self.file.file, hint=hint))

    def note(self, code: str, message: str, hint: str = "") -> None:
        """An info of the whole file."""
        self.found.append(info(code, message, file=self.file.file, hint=hint))

    def columns(self, table: CsvTable, wanted: Sequence[TableColumn], optional: Sequence[str] = ()) -> bool:
        """True where all columns are there with the right kind of unit; those that are not used are reported."""
        self._missing(table, [column.name for column in wanted if column.name not in table.columns])
        for name, kind, _ in wanted:
            if name in table.columns and table.unit[name] not in UNIT[kind]:
                self._unit(table, name, kind)
        for name in optional:
            if table.unit.get(name):
                self._unit(table, name, "")
        known = [column.name for column in wanted]
        other = [name for name in table.columns if name not in (*known, *optional)]
        for name in [name for name in other if optional and name.lower().endswith("way")]:
            self.problem("calibrate.column", f"{Path(table.file).name}: {name!r} is the approach direction of no axis",
                         "write " + ", ".join(optional))
        self._sizes(table, [column.name for column in wanted if column.unit])
        if other:
            self.note("calibrate.unused", f"{Path(table.file).name}: {', '.join(other)[:200]} not used",
                      "columns are " + ", ".join([*known, *optional]))
        return not has_errors(self.found)

    def _sizes(self, table: CsvTable, names: Sequence[str]) -> None:
        """Numbers that are none."""
        for name in names:
            large = np.abs(table.columns.get(name, np.zeros(1))) > LARGEST
            if large.any():
                row = int(np.argmax(large))
                self.row(table, row, f"{name} is {table.columns[name][row]:.3g} mm or rad",
                         f"allowed are up to {LARGEST:g}")

    def _missing(self, table: CsvTable, names: Sequence[str]) -> None:
        """Columns that are not there; errors by their names (EXX) are another kind of table."""
        if not names:
            return
        hint = nearest(names[0], list(table.columns)) if len(names) == 1 else "it has " + ", ".join(table.columns)[:200]
        if any(parse(name.rstrip("+-")) for name in table.columns):
            hint = "tables of errors by their names are read by `postproc errors import`"
        self.problem("calibrate.column", f"{Path(table.file).name} has no column {', '.join(names)}", hint)

    def _unit(self, table: CsvTable, name: str, kind: str) -> None:
        self.problem("calibrate.unit", f"column {name!r} has unit {table.unit[name]!r}",
                     f"write {name} [unit] with one of " + ", ".join(UNIT[kind]) if kind else f"write {name} alone")

    def row(self, table: CsvTable, row: int, message: str, hint: str = "") -> None:
        """An error at a row of the table."""
        self.found.append(error("calibrate.row", message, file=table.file, lines=[table.lines[row]], hint=hint))

    def places(self, table: CsvTable, steps: int) -> tuple[Ints, Ints, int] | None:
        """(set-up, step, number of set-ups) of each row."""
        setup, step = table.columns["setup"], table.columns["step"]
        bad = (setup != np.round(setup)) | (setup < 0) | (step != np.round(step)) | (step < 0) | (step >= steps)
        twice = np.ones(len(setup), dtype=np.bool_)
        twice[np.unique(setup * steps + step, return_index=True)[1]] = False
        for where, what in ((bad, f"is not a set-up 0, 1, ... and a step 0 .. {steps - 1}"),
                            (twice, "was measured before")):
            if where.any():
                row = int(np.argmax(where))
                self.row(table, row, f"set-up {setup[row]:g}, step {step[row]:g} {what}")
                return None
        known = np.unique(setup)
        if known[-1] != len(known) - 1:
            missing = int(np.argmax(known != np.arange(len(known))))
            self.problem("calibrate.setup", f"set-up {known[-1]:g} has readings, set-up {missing} has none",
                         "number the set-ups 0, 1, ... without a gap; `shifts` says how far the indexer was turned in each")
            return None
        return setup.astype(np.int64), step.astype(np.int64), len(known)

    def joints(self, table: CsvTable) -> Floats:
        """(N, J) commanded positions; those beyond the travel of their axis are reported."""
        names, limits = self.machine.axis_names, self.machine.limits
        q = np.stack([table.columns[n] for n in names], axis=1)
        beyond = (q < limits.lower - EDGE) | (q > limits.upper + EDGE)
        for j, name in enumerate(names):
            if beyond[:, j].any():
                rows = np.flatnonzero(beyond[:, j])
                self.found.append(warning(
                    "calibrate.travel", f"{name} stands beyond its travel", file=table.file,
                    lines=[table.lines[r] for r in rows[:6]], count=len(rows),
                    hint=f"look at the unit of {name} [{table.unit[name]}], and at its travel in the machine file"))
        return q

    def approaches(self, table: CsvTable) -> Floats:
        """(N, J) from which direction each axis came: +1, -1, 0 (the mean of both) where no column says."""
        result = np.zeros((len(table), len(self.machine.axis_names)))
        for j, name in enumerate(self.machine.axis_names):
            given = table.columns.get(approach_column(name))
            if given is None:
                continue
            if (bad := ~np.isin(given, (-1.0, 0.0, 1.0))).any():
                row = int(np.argmax(bad))
                self.row(table, row, f"{approach_column(name)} is {given[row]:g}",
                         f"write 1 where {name} came from lesser values, -1 from greater ones, 0 where it is not known")
            result[:, j] = given
        return result


def approach_column(axis: str) -> str:
    """Name of the column that says from which direction an axis came."""
    return f"{axis} way"
