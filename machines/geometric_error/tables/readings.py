"""Tables as measuring programs deliver them: a column for each run, a file for each approach direction or
run, headers of their own.

What comes out are rows of single readings under ISO 230-1 names, NaN where there is none, which `averages` makes means of.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from machines.geometric_error.tables.csv_table import LENGTHS, CsvTable
from machines.geometric_error.tables.names import ErrorName, parse
from machines.geometric_error.tables.table_curves import CLOSES, Fault
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error

POSITIONS = ("target", "position", "nominal", "sollposition")
"""columns of positions, besides the letter of the axis, in a table whose component is named outside"""
_RUN = re.compile(r"(?P<name>E[XYZABC][XYZUVWABC]|run|lauf|error|deviation|abweichung)?[ _#]*(?P<before>\d*)[ _#]*"
                  r"(?P<way>[+-]?)[ _#]*(?P<after>\d*)$", re.IGNORECASE)
_DIRECTIONS = (re.compile("\u2191|\\b(?:up|forward)\\b", re.IGNORECASE),
               re.compile("\u2193|\u2212|\\b(?:down|backward|reverse)\\b", re.IGNORECASE))
"""of ISO 230-2 and in words; a long minus"""
_OF_RUN = re.compile(r"(E[XYZABC][XYZUVWABC][+-]?)(\d+)$")
_NUMBERED = ("RUN", "LAUF")
_SINGLE = ("", "ERROR", "DEVIATION", "ABWEICHUNG")


def by_iso_names(table: CsvTable, name: ErrorName | None) -> CsvTable | Fault:
    """The table with its columns called EXX, EXX+, EXX-, EXX+1 ..., as other spellings of them say.

    Args:
        name: component that all values are of; then a column may also be called after positions, errors and runs
    """
    columns, unit = dict[str, Floats](), dict[str, str]()
    for column, values in table.columns.items():
        new = _iso_name(column) if name is None else _of_component(column, name)
        if new is None:
            return Fault("error-import.column", f"column {column[:40]!r} is neither a position nor a run",
                         f"write target for positions, {name}+ and {name}- for values, or run 1+, run 1-, run 2+ ...; take "
                         "others out", table.head)
        if new != column and not table.unit[column]:
            return Fault("error-model.unit", f"column {column[:40]!r} has no unit", f"write {column[:40]} [mm] or the like, "
                         "or a row of units below the header", table.head)
        if new in columns:
            return Fault("error-import.column", f"column {column[:40]!r} is {new} again", "name runs and positions once",
                         table.head)
        columns[new], unit[new] = values, table.unit[column]
    if name is not None and name.axis not in columns:
        return Fault("error-import.column", "no column holds positions",
                     f"call it {name.axis} or target", table.head)
    return CsvTable(table.file, columns, unit, table.lines, table.head)


def _match(column: str) -> re.Match[str] | None:
    for approach, sign in zip(_DIRECTIONS, "+-", strict=True):
        column = approach.sub(sign, column)
    return _RUN.match(column)


def _iso_name(column: str) -> str:
    """EXX+3 of EXX 3 up, EXX3+ ...; a column that is no component's as it is."""
    found = _match(column)
    if found is None or len(found["name"] or "") != len("EXX"):
        return column
    return f"{found['name']}{found['way']}{found['before'] or found['after']}"


def _of_component(column: str, name: ErrorName) -> str | None:
    """What a column of a table of one component is; None for what is unknown."""
    if column.casefold() in (name.axis.casefold(), *POSITIONS):
        return name.axis
    found = _match(column)
    if found is None or not found[0]:
        return None
    called, run = (found["name"] or "").upper(), found["before"] or found["after"]
    known = called in (str(name), *_SINGLE) or (called in _NUMBERED and run)
    return f"{name}{found['way']}{run}" if known else None


def run_of(column: str) -> tuple[str, str]:
    """(component with its approach direction, number of the run) of a column as EXX+3; (the column, "") for
    one of no run."""
    found = _OF_RUN.match(column)
    return (found[1], found[2]) if found else (column, "")


def runs_as_rows(table: CsvTable) -> CsvTable:
    """Columns of runs below each other, those of no run first; positions in all."""
    places, parts = [c for c in table.columns if len(c) == 1], dict[str, dict[str, str]]()
    for column in table.columns:
        base, run = run_of(column)
        if column not in places:
            parts.setdefault(run, {})[column] = base
    return stacked([_part(table, {**dict(zip(places, places, strict=True)), **mine}) for mine in parts.values()]) \
        if len(parts) > 1 or "" not in parts else table


def turned_back(table: CsvTable, letter: str, period: float, near: float) -> CsvTable:
    """The table with readings whole periods, mm or rad, after others as of the same places; `near` as in `averaged`."""
    x = table.columns[letter]
    at = x - period * np.floor((x - x.min() + max(near, CLOSES * period)) / period)
    return CsvTable(table.file, {**table.columns, letter: at}, table.unit, table.lines, table.head)


def _part(table: CsvTable, names: dict[str, str]) -> CsvTable:
    """The columns `names` of a table, called otherwise."""
    return CsvTable(table.file, {new: table.columns[c] for c, new in names.items()},
                    {new: table.unit[c] for c, new in names.items()}, table.lines, table.head)


def stacked(tables: Sequence[CsvTable]) -> CsvTable:
    """The rows of all tables below each other, NaN in columns that one has not."""
    names = list(dict.fromkeys(name for table in tables for name in table.columns))
    columns = {name: np.concatenate([table.columns.get(name, np.full(len(table), np.nan)) for table in tables])
               for name in names}
    unit = {name: unit for table in reversed(tables) for name, unit in table.unit.items()}
    files = ", ".join(dict.fromkeys(table.file for table in tables))
    return CsvTable(files, columns, unit, tuple(line for table in tables for line in table.lines),
                    tables[0].head)


def together(tables: Sequence[CsvTable], average: bool) -> list[CsvTable]:
    """Tables of one axis as one where they are readings of the same errors (`average`), or the two approach
    directions of one."""
    groups: list[list[CsvTable]] = []
    for table in tables:
        mine = next((group for group in groups if _belongs(table, group, average)), None)
        if mine is None:
            groups.append([table])
        else:
            mine.append(table)
    return [group[0] if len(group) == 1 else stacked(group) for group in groups]


def _belongs(table: CsvTable, group: Sequence[CsvTable], average: bool) -> bool:
    """True where a table has errors of the positions and kind that a group has."""
    there = {name: unit in LENGTHS for other in group for name, unit in other.unit.items()}
    mine = {name: unit in LENGTHS for name, unit in table.unit.items()}
    places, values = ({n for n in mine if len(n) == 1}, {n for n in mine if len(n) > 1})
    if not places or places != {n for n in there if len(n) == 1} or any(there.get(n, k) != k for n, k in mine.items()):
        return False
    shared = {run_of(n)[0].rstrip("+-") for n in values} & {run_of(n)[0].rstrip("+-") for n in there}
    return bool(shared) and (average or not values & {*there})


def unknown_columns(table: CsvTable) -> list[Diagnostic]:
    """Columns that are nothing, of a table without positions of an axis."""
    columns = [column for column in table.columns if not ((name := parse(column)) and name.location)]
    if not columns:
        return []
    laser = any(column.casefold() in POSITIONS for column in columns)
    what = "columns " * (len(columns) > 1) + ", ".join(repr(column[:40]) for column in columns[:4])
    more = " ..." * (len(columns) > 4)
    return [error("error-import.columns", f"{what}{more}: neither positions of an axis, nor coordinates or values of a map, "
                  "nor location errors", file=table.file, lines=[table.head],
                  hint=f"positions and runs of one error are imported as e.g. EXX={Path(table.file).name}" if laser else
                  "write e.g. X [mm], EXX [um]; or X [mm], dx [um], dy [um], dz [um]; or EC0Y [arcsec]")]
