"""Lattice CSV: one row per node, `X [mm], Y [mm], Z [mm], dx [um], dy [um], dz [um], rx [arcsec], ...`, any order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from machines.geometric_error.tables.averages import SAME, levels_of
from machines.geometric_error.tables.csv_table import ANGLES, LENGTHS, CsvTable, write_csv
from machines.geometric_error.tables.lattice import COLUMNS, POINT, ErrorMap
from machines.kinematics.chain import ROTARY
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG

COORDINATES = "XYZUVWABC" + POINT
CROWDED = 50
"""a lattice of more nodes than this many times its rows is none"""


def map_from_csv(table: CsvTable, periods: Mapping[str, float] | None = None) -> tuple[ErrorMap | None, list[Diagnostic]]:
    """The map of a table; None where rows are missing, twice, or columns are not understood.

    Args:
        periods: mm or rad, by coordinate that goes round; its first and last level may be one place
    """
    letters = tuple(name for name in table.columns if name in COORDINATES)
    faults = _column_faults(table, letters)
    if faults:
        return None, faults
    places = np.stack([table.columns[letter] for letter in letters], axis=1)
    nodes, index = zip(*(levels_of(column) for column in places.T), strict=True)
    shape = tuple(map(len, nodes))
    if math.prod(shape) > CROWDED * len(table):
        return None, [error("error-map.scattered", "the rows are not a lattice: " + _levels_of(letters, shape) +
                            f" levels need {math.prod(shape)} rows, there are {len(table)}", file=table.file,
                            hint="write the commanded positions, the same levels of each coordinate in every row")]
    flat = np.ravel_multi_index(index, shape)
    values = np.zeros((math.prod(shape), 6))
    for k, column in enumerate(COLUMNS):
        if column in table.columns:
            values[flat, k] = table.columns[column]
    lattice = ErrorMap(letters, nodes, values.reshape(*shape, 6))
    faults = _row_faults(table, lattice, flat)
    return (None, faults) if faults else round_about(lattice, periods or {}, table.file)


def _row_faults(table: CsvTable, lattice: ErrorMap, flat: Ints) -> list[Diagnostic]:
    """Nodes that are given twice or not at all; `flat` (N,): the node of each row."""
    count = np.bincount(flat, minlength=lattice.table.size // 6)
    if (count > 1).any():
        node = int(np.argmax(count > 1))
        lines = [table.lines[k] for k in np.flatnonzero(flat == node)]
        return [error("error-map.twice", f"lines {lines[0]} and {lines[1]} are the same node, {lattice.described(node)}; "
                      f"{int((count > 1).sum())} nodes are there more than once", file=table.file, lines=lines[:6],
                      hint="give every node once; where rows are readings of it, postproc errors import --average takes "
                      "their mean")]
    if (count == 0).any():
        where, levels = lattice.described(int(np.argmin(count))), _levels_of(lattice.letters, lattice.table.shape[:-1])
        return [error("error-map.missing", f"node {where} is missing: {levels} levels need {count.size} rows, there are "
                      f"{len(table)}", file=table.file, hint="give every node once")]
    return []


def _levels_of(letters: Sequence[str], shape: Sequence[int]) -> str:
    return " x ".join(f"{letter} {n}" for letter, n in zip(letters, shape, strict=True))


def round_about(lattice: ErrorMap, periods: Mapping[str, float],
                file: str) -> tuple[ErrorMap | None, list[Diagnostic]]:
    """The lattice with coordinates that go round; what keeps them from it."""
    nodes, table, found = list(lattice.nodes), lattice.table, []
    for letter, period in periods.items():
        if letter not in lattice.letters:
            found.append(error("error-map.period", f"{letter} is not a coordinate of the map", file=file,
                               hint="its coordinates are " + ", ".join(lattice.letters)))
            continue
        k = lattice.letters.index(letter)
        unit, span = DEG if letter in ROTARY else 1.0, float(nodes[k][-1] - nodes[k][0])
        if span > period + SAME:
            found.append(error("error-map.period", f"the levels of {letter} span {span / unit:g}, more than its period "
                               f"{period / unit:g}", file=file, hint="give one period"))
        elif span > period - SAME:
            apart = np.abs(np.take(table, 0, k) - np.take(table, -1, k)).max(axis=tuple(range(table.ndim - 2)))
            if (apart > SAME * np.where(np.arange(6) < 3, 1.0, DEG)).any():
                found.append(error("error-map.period", f"the first and last level of {letter} are one place, but their "
                                   f"values differ by up to {1e3 * apart[:3].max():.3g} um and "
                                   f"{apart[3:].max() / ANGLES['arcsec']:.3g} arcsec", file=file,
                                   hint="write the same values in both, or leave the last level out; errors import "
                                   "--average takes their mean"))
            nodes[k], table = nodes[k][:-1], np.delete(table, -1, axis=k)
    if found:
        return None, found
    round_ = tuple(periods.get(letter, 0.0) for letter in lattice.letters)
    return replace(lattice, nodes=tuple(nodes), table=table, periods=round_), []


def _column_faults(table: CsvTable, letters: tuple[str, ...]) -> list[Diagnostic]:
    found = []
    if not letters or not {"dx", "dy", "dz"} <= set(table.columns):
        found.append(error("error-map.column", "a map needs coordinates and dx, dy, dz; it has " + ", ".join(table.columns),
                           file=table.file, lines=[table.head],
                           hint="write e.g. X [mm], Y [mm], Z [mm], dx [um], dy [um], dz [um]"))
    for name, unit in table.unit.items():
        known = name in COORDINATES or name in COLUMNS
        angular = name in ROTARY or name in COLUMNS[3:]
        if not known:
            found.append(error("error-map.column", f"column {name[:40]!r} is not known", file=table.file, lines=[table.head],
                               hint="coordinates " + " ".join(COORDINATES) + "; values " + " ".join(COLUMNS)))
        elif unit not in (ANGLES if angular else LENGTHS):
            found.append(error("error-map.unit", f"column {name!r} has unit {unit!r}", file=table.file, lines=[table.head],
                               hint="write one of " + ", ".join(ANGLES if angular else LENGTHS)))
    return found


def map_to_csv(error_map: ErrorMap) -> str:
    """The text of a map; what `map_from_csv` reads back."""
    columns = {letter: ("deg" if letter in ROTARY else "mm", column)
               for letter, column in zip(error_map.letters, error_map.places().T, strict=True)}
    values = error_map.table.reshape(-1, 6)
    columns |= {name: ("arcsec" if k >= 3 else "um", values[:, k]) for k, name in enumerate(COLUMNS)}
    point = f"tip of a tool of {error_map.length:g} mm" if error_map.length else "gauge point"
    directions = "machine" if error_map.bed else "table"
    return write_csv(columns, [f"error map: {point}, actual less commanded, tool relative to part, directions of the "
                               f"{directions}"])


def zeroed(error_map: ErrorMap, zero: Mapping[str, float]) -> ErrorMap | tuple[str, str]:
    """The map less what it says at the place `zero` (mm or rad by coordinate); or what is wrong, and what to do."""
    letters = error_map.letters
    if set(zero) != set(letters):
        return (f"zero gives {', '.join(zero)}, the map has {', '.join(letters)}",
                "give every coordinate of the map once")
    place = np.array([[zero[letter] for letter in letters]])
    if error_map.outside(place, SAME).any():
        return "the place lies outside the map", "; ".join(
            f"{letter} is from {nodes[0] / unit:g} to {nodes[-1] / unit:g}" for letter, nodes in
            zip(letters, error_map.nodes, strict=True) for unit in (DEG if letter in ROTARY else 1.0,))
    return replace(error_map, table=error_map.table - error_map.at(place)[0])


def zeroed_covariance(covariance: Floats, error_map: ErrorMap, zero: Mapping[str, float]) -> Floats:
    """Covariance (P, P) of the values of a map less what it says at `zero` (as in `zeroed`), from that of the values."""
    node, weight = error_map.weights(np.array([[zero[letter] for letter in error_map.letters]]))
    taken = np.zeros((6, len(covariance)))
    for k, share in zip(node[0], weight[0], strict=True):
        taken[range(6), range(6 * k, 6 * k + 6)] += share
    nodes, rows, columns = len(covariance) // 6, taken @ covariance, covariance @ taken.T
    result: Floats = covariance.copy()
    result.reshape(nodes, 6, -1)[...] -= rows
    result.reshape(-1, nodes, 6)[...] -= columns[:, None, :]
    result.reshape(nodes, 6, nodes, 6)[...] += (rows @ taken.T)[:, None, :]
    np.fill_diagonal(result, np.maximum(result.diagonal(), 0.0))  # round-off
    return result
