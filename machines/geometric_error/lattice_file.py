"""Lattice CSV: one row per node, `X [mm], Y [mm], Z [mm], dx [um], dy [um], dz [um], rx [arcsec], ...`, any order."""

from __future__ import annotations

import numpy as np

from machines.geometric_error.csv_table import ANGLES, LENGTHS, CsvTable, write_csv
from machines.geometric_error.lattice import COLUMNS, GAUGE, ErrorMap
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG

ROTARY = "ABC"
COORDINATES = "XYZUVWABC" + GAUGE
SAME = 1e-6
"""mm or rad: positions nearer than this are one"""


def map_from_csv(table: CsvTable) -> tuple[ErrorMap | None, list[Diagnostic]]:
    """The map of a table; None where rows are missing, twice, or columns are not understood."""
    letters = tuple(name for name in table.columns if name in COORDINATES)
    faults = _column_faults(table, letters)
    if faults:
        return None, faults
    places = np.stack([table.columns[letter] for letter in letters], axis=1)
    nodes, index = zip(*(_levels(column) for column in places.T), strict=True)
    shape = tuple(map(len, nodes))
    flat = np.ravel_multi_index(index, shape)
    count = np.bincount(flat, minlength=int(np.prod(shape)))
    if (count > 1).any():
        rows = np.flatnonzero(flat == int(np.argmax(count > 1)))
        lines = [table.lines[k] for k in rows]
        return None, [error("error-map.twice", f"lines {lines[0]} and {lines[1]} are the same node", file=table.file,
                            lines=lines[:6])]
    if (count == 0).any():
        at = np.unravel_index(int(np.argmin(count)), shape)
        where = ", ".join(f"{x} {nodes[k][i] / (DEG if x in ROTARY else 1.0):g}"
                          for k, (x, i) in enumerate(zip(letters, at, strict=True)))
        return None, [error("error-map.missing", f"node {where} is missing: {' x '.join(map(str, shape))} levels need "
                            f"{count.size} rows, there are {len(table)}", file=table.file, hint="give every node once")]
    values = np.zeros((count.size, 6))
    for k, column in enumerate(COLUMNS):
        if column in table.columns:
            values[flat, k] = table.columns[column]
    return ErrorMap(letters, nodes, values.reshape(*shape, 6)), []


def _levels(column: Floats) -> tuple[Floats, Ints]:
    """(ascending distinct positions, index of each row's)."""
    order = np.argsort(column, kind="stable")
    new = np.concatenate([[True], np.diff(column[order]) > SAME])
    index = np.empty(len(column), dtype=np.int64)
    index[order] = np.cumsum(new) - 1
    return column[order][new], index


def _column_faults(table: CsvTable, letters: tuple[str, ...]) -> list[Diagnostic]:
    found = []
    if not letters or not {"dx", "dy", "dz"} <= set(table.columns):
        found.append(error("error-map.column", "a map needs coordinates and dx, dy, dz; it has " + ", ".join(table.columns),
                           file=table.file, hint="write e.g. X [mm], Y [mm], Z [mm], dx [um], dy [um], dz [um]"))
    for name, unit in table.unit.items():
        known = name in COORDINATES or name in COLUMNS
        angular = name in ROTARY or name in COLUMNS[3:]
        if not known:
            found.append(error("error-map.column", f"column {name!r} is not known", file=table.file,
                               hint="coordinates " + " ".join(COORDINATES) + "; values " + " ".join(COLUMNS)))
        elif unit not in (ANGLES if angular else LENGTHS):
            found.append(error("error-map.unit", f"column {name!r} has unit {unit!r}", file=table.file,
                               hint="write one of " + ", ".join(ANGLES if angular else LENGTHS)))
    return found


def map_to_csv(error_map: ErrorMap, length: str = "um", angle: str = "arcsec") -> str:
    """The text of a map; what `map_from_csv` reads back."""
    mesh = [m.ravel() for m in np.meshgrid(*error_map.nodes, indexing="ij")]
    columns = {letter: ("deg" if letter in ROTARY else "mm", column)
               for letter, column in zip(error_map.letters, mesh, strict=True)}
    values = error_map.table.reshape(-1, 6)
    columns |= {name: (angle if k >= 3 else length, values[:, k]) for k, name in enumerate(COLUMNS)}
    return write_csv(columns, ["error map: gauge point and tool, actual less commanded, table frame"])
