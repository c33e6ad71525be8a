"""From the columns of a CSV table to the curve of a component error, or what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from machines.geometric_error.tables.choices import TableRule
from machines.geometric_error.tables.csv_table import ANGLES, LENGTHS, UNITS, CsvTable
from machines.geometric_error.tables.curves import TableCurve
from machines.geometric_error.tables.names import ErrorName
from machines.kinematics.chain import ROTARY
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG

CLOSES = 1e-6
"""share of a period, and part of a um or arcsec, that counts as nothing"""


class Fault(NamedTuple):
    """What is wrong: code, message, hint, line of the table; 0 where the fault is in what the table was asked for."""

    code: str
    message: str
    hint: str
    line: int = 0

    def at(self, table: CsvTable) -> Diagnostic:
        """The fault at its place in the table, the header where it has none."""
        return error(self.code, self.message, file=table.file, lines=[self.line or table.head],
                     hint=self.hint)


def table_curve(name: ErrorName, table: CsvTable, rule: TableRule = "linear", period: float = 0.0,
                sign: float = 1.0) -> TableCurve | Fault:
    """The curve of a component over the positions of its axis.

    Args:
        period: mm or rad after which it repeats; 0 for never. The first and last row may be one place
        sign: -1 where the table says how the part moves relative to the tool
    """
    columns = _columns(name, table)
    if isinstance(columns, Fault):
        return columns
    x, values = table.columns[name.axis], [table.columns[c] * sign for c in columns]
    if len(x) > 1 and (np.diff(x) < 0.0).all():  # measured on the return
        x, values = x[::-1], [v[::-1] for v in values]
    down = np.flatnonzero(np.diff(x) <= 0.0)
    if len(down):
        return _order(table, name, int(down[0]))
    if period:
        unit = DEG if name.axis in ROTARY else 1.0
        fault = _period_fault(x / unit, values, period / unit, UNITS["arcsec" if name.angular else "um"])
        if fault:
            return fault._replace(line=table.lines[-1])
        inside = x < x[0] + period * (1.0 - CLOSES)
        x, values = x[inside], [v[inside] for v in values]
    if len(x) == 1 and not period:
        return Fault("error-model.rows", f"{name} has one row: nothing is known of other positions",
                     f"write two rows or more, or [components.{name}] polynomial = [value] and its range", table.lines[0])
    if rule == "spline" and len(x) < 4:
        return Fault("error-model.spline", f"a spline needs 4 rows, the table has {len(x)}", "write linear")
    return TableCurve(x, np.concatenate(values), rule, len(values) == 2, period)


def _order(table: CsvTable, name: ErrorName, row: int) -> Fault:
    axis = name.axis
    unit, x = DEG if axis in ROTARY else 1.0, table.columns[axis]
    before, after = (float(v) / unit for v in x[row:row + 2])
    line = table.lines[row + 1]
    hint = "several readings of one place: postproc errors import --average takes their mean; both approach directions: " \
        f"{name}+ and {name}-" if len(np.unique(x)) < len(x) else "sort the rows by position"
    return Fault("error-model.order", f"positions of {axis} do not ascend: {after:g} after {before:g}", hint, line)


def _columns(name: ErrorName, table: CsvTable) -> list[str] | Fault:
    """The column or columns of a component."""
    both = [f"{name}+", f"{name}-"]
    wanted = both if both[0] in table.columns or both[1] in table.columns else [str(name)]
    if wanted == both and str(name) in table.columns:
        return Fault("error-model.column", f"{Path(table.file).name} has {name} next to {name}+ or {name}-",
                     f"write {name}+ and {name}- where both directions were measured, else {name} alone", table.head)
    for column in (name.axis, *wanted):
        if column not in table.columns:
            return Fault("error-model.column", f"{Path(table.file).name} has no column {column!r}",
                         "it has " + ", ".join(table.columns))
        angular = (column == name.axis and name.axis in ROTARY) or (column != name.axis and name.angular)
        known = ANGLES if angular else LENGTHS
        if table.unit[column] not in known:
            return Fault("error-model.unit", f"column {column!r} of {Path(table.file).name} has unit "
                         f"{table.unit[column]!r}", f"write {column} [unit] with one of " + ", ".join(known), table.head)
    return wanted


def _period_fault(x: Floats, values: list[Floats], period: float, unit: float) -> Fault | None:
    """What keeps a table at x (mm or degrees) from repeating."""
    span = float(x[-1] - x[0])
    if span > period * (1.0 + CLOSES):
        return Fault("error-model.period", f"the table spans {span:g}, more than its period {period:g}",
                     "give one period")
    apart = max(abs(float(v[0] - v[-1])) for v in values) / unit
    if span > period * (1.0 - CLOSES) and apart > CLOSES:
        what = "um" if unit == UNITS["um"] else "arcsec"
        return Fault("error-model.period", "first and last row are one place, but their values differ by "
                     f"{apart:.6g} {what}", "close the table: write the same values in both; errors import "
                     "--average takes their mean")
    return None
