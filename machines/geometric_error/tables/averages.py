"""Measurements that go to the same place several times: their means, and the uncertainty of those from the scatter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from machines.geometric_error.tables.csv_table import CsvTable
from machines.geometric_error.tables.table_curves import Fault
from machines.kinematics.chain import ROTARY
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.units import DEG

SAME = 1e-6
"""mm or rad: positions nearer than this are one"""


@dataclass(frozen=True)
class Averaged:
    """A table with one row per place.

    Attributes:
        table: the means, ascending by their places; the line of each is that of its first reading
        rows: of the readings
        runs: (M,) readings of each place, by column
        scatter: standard deviation of one reading by column, mm or rad, over all places; empty where none was read twice
    """

    table: CsvTable
    rows: int
    runs: Mapping[str, Ints]
    scatter: Mapping[str, float]

    def variance(self, column: str) -> Floats:
        """(M,) of the means, for readings that scatter alike everywhere and independently."""
        if column not in self.scatter:
            return np.zeros(len(self.table))
        result: Floats = self.scatter[column] ** 2 / self.runs[column]
        return result


def averaged(table: CsvTable, places: Sequence[str],
             near: Mapping[str, float] | None = None) -> Averaged | Fault:
    """Rows at the same place, by the columns `places`, as one; cells without a number (NaN) are no readings.

    Scatter: s^2 = sum (x - mean)^2 / (N - M), the pooled variance of N readings at M places.

    Args:
        near: mm or rad by place column: positions no farther apart are one, given to that amount
    """
    levels = np.empty((len(table), len(places)))
    for k, name in enumerate(places):
        at = _places(table, name, (near or {}).get(name, 0.0))
        if isinstance(at, Fault):
            return at
        levels[:, k] = at
    _, first, row = np.unique(levels, axis=0, return_index=True, return_inverse=True)
    row, columns, runs, scatter = row.ravel(), dict[str, Floats](), {}, {}
    for name, values in table.columns.items():
        if name in places:
            columns[name] = levels[first, places.index(name)]
            continue
        there = np.isfinite(values)
        runs[name] = np.bincount(row[there], minlength=len(first))
        if not runs[name].all():
            return _missing(table, name, places, levels[first[int(np.argmin(runs[name]))]])
        columns[name] = np.bincount(row[there], weights=values[there], minlength=len(first)) / runs[name]
        spare = int(there.sum()) - len(first)
        if spare:
            scatter[name] = float(np.sqrt(np.sum((values - columns[name][row])[there] ** 2) / spare))
    lines = tuple(table.lines[k] for k in first)
    return Averaged(CsvTable(table.file, columns, table.unit, lines, table.head), len(table), runs, scatter)


def _places(table: CsvTable, name: str, near: float) -> Floats | Fault:
    """(N,) the place of each row along one coordinate."""
    column, unit = table.columns[name], DEG if name in ROTARY else 1.0
    levels, index = levels_of(column, max(near, SAME))
    if not near:
        return np.asarray(levels[index])
    last = np.full(len(levels), -np.inf)
    np.maximum.at(last, index, column)
    if (last - levels > near).any():
        k = int(np.argmax(last - levels))
        return Fault("error-import.near", f"positions of {name} from {levels[k] / unit:g} to {last[k] / unit:g} follow each "
                     f"other within {near / unit:g}: they are not one place", "take less with --near")
    return np.asarray((np.round(0.5 * (levels + last) / near) * near)[index])


def _missing(table: CsvTable, name: str, places: Sequence[str], at: Floats) -> Fault:
    where = ", ".join(f"{p} {v / (DEG if p in ROTARY else 1.0):g}" for p, v in zip(places, at.tolist(), strict=True))
    return Fault("error-import.reading", f"no reading of {name} at {where}", "take the rows of that place out, or measure "
                 "it there in one run at least; --average --near AXIS=AMOUNT where positions differ by little")


def levels_of(column: Floats, near: float = SAME) -> tuple[Floats, Ints]:
    """(ascending distinct positions, index of each row's); those that follow each other within `near` are one."""
    order = np.argsort(column, kind="stable")
    new = np.concatenate([[True], np.diff(column[order]) > near])
    index = np.empty(len(column), dtype=np.int64)
    index[order] = np.cumsum(new) - 1
    return column[order][new], index
