"""Measurements that go to the same place several times: their means, and the doubt of those from the scatter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from machines.geometric_error.csv_table import CsvTable
from toolpaths.arrays import Floats, Ints

SAME = 1e-6
"""mm or rad: positions nearer than this are one"""


@dataclass(frozen=True)
class Averaged:
    """A table with one row per place.

    Attributes:
        table: the means, ascending by their places; the line of each is that of its first reading
        runs: (M,) readings of each place
        scatter: standard deviation of one reading by column, mm or rad, over all places; empty where none was read twice
    """

    table: CsvTable
    runs: Ints
    scatter: Mapping[str, float]

    def variance(self, column: str) -> Floats:
        """(M,) of the means, for readings that scatter alike everywhere and independently."""
        result: Floats = self.scatter[column] ** 2 / self.runs
        return result


def averaged(table: CsvTable, places: Sequence[str]) -> Averaged:
    """Rows at the same place, by the columns `places`, as one.

    Scatter: s^2 = sum (x - mean)^2 / (N - M), the pooled variance of N readings at M places.
    """
    levels = np.stack([levels_of(table.columns[name])[1] for name in places], axis=1)
    _, first, row, runs = np.unique(levels, axis=0, return_index=True, return_inverse=True, return_counts=True)
    row, spare = row.ravel(), len(table) - len(runs)
    columns, scatter = {}, {}
    for name, values in table.columns.items():
        columns[name] = np.bincount(row, weights=values) / runs
        if spare and name not in places:
            scatter[name] = float(np.sqrt(np.sum((values - columns[name][row]) ** 2) / spare))
    lines = tuple(table.lines[k] for k in first)
    return Averaged(CsvTable(table.file, columns, table.unit, lines, table.head), runs, scatter)


def levels_of(column: Floats) -> tuple[Floats, Ints]:
    """(ascending distinct positions, index of each row's)."""
    order = np.argsort(column, kind="stable")
    new = np.concatenate([[True], np.diff(column[order]) > SAME])
    index = np.empty(len(column), dtype=np.int64)
    index[order] = np.cumsum(new) - 1
    return column[order][new], index
