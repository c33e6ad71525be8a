"""Tables as measuring programs deliver them: a column for each run, a file for each way or run, headers of their own.

What comes out are rows of single readings under ISO 230-1 names, NaN where there is none, which `averages` makes means of.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from machines.geometric_error.csv_table import LENGTHS, CsvTable
from machines.geometric_error.names import ErrorName
from machines.geometric_error.table_curves import Fault
from toolpaths.arrays import Floats

POSITIONS = ("target", "position", "nominal")
"""columns of positions, besides the letter of the axis, in a table whose component is named outside"""
_RUN = re.compile(r"(?P<name>E[XYZABC][XYZUVWABC]|run|error|deviation)?[ _#]*(?P<before>\d*)[ _#]*(?P<way>[+-]?)[ _#]*"
                  r"(?P<after>\d*)$", re.IGNORECASE)
_ARROWS = str.maketrans("\u2191\u2193\u2212", "+--")
"""ways as ISO 230-2 shows them, and the sign of minus"""


def of_component(table: CsvTable, name: ErrorName) -> CsvTable | Fault:
    """The table with its columns called after component `name`: a column of positions, and one for each run and way."""
    columns, unit = dict[str, Floats](), dict[str, str]()
    for column, values in table.columns.items():
        found = _RUN.match(column.translate(_ARROWS))
        if column.casefold() in (name.axis.casefold(), *POSITIONS):
            new = name.axis
        elif found and found[0] and (found["name"] or "").upper() in ("", str(name), "RUN", "ERROR", "DEVIATION"):
            new = f"{name}{found['way']}{found['before'] or found['after']}"
        else:
            return Fault("error-import.column", f"column {column[:40]!r} is neither a position nor a run",
                         f"write {name.axis} or target for positions, {name}+ and {name}- for values, or run 1+, run 1-, "
                         "run 2+ ...", table.head)
        if new in columns:
            return Fault("error-import.column", f"column {column[:40]!r} is {new} again", "name every run once", table.head)
        columns[new], unit[new] = values, table.unit[column]
    if name.axis not in columns:
        return Fault("error-import.column", "no column holds positions", f"call it {name.axis} or target", table.head)
    return CsvTable(table.file, columns, unit, table.lines, table.head)


def run_of(column: str) -> tuple[str, str]:
    """(component with its way, number of the run) of a column as EXX+3, EXX 3+, EXX3; (the column, "") for one of no run."""
    found = _RUN.match(column.translate(_ARROWS))
    run = (found["before"] or found["after"]) if found else ""
    return (f"{found['name']}{found['way']}", run) if found and run and len(found["name"] or "") == 3 else (column, "")


def runs_as_rows(table: CsvTable) -> CsvTable | Fault:
    """Columns of runs below each other, those of no run first; positions in all."""
    places, parts = [c for c in table.columns if len(c) == 1], dict[str, dict[str, str]]()
    for column in table.columns:
        base, run = run_of(column)
        if column in places:
            continue
        mine = parts.setdefault(run, {})
        if base in mine.values():
            return Fault("error-import.column", f"column {column[:40]!r} is run {run} of {base} again",
                         "name every run once", table.head)
        mine[column] = base
    return stacked([_part(table, {**dict(zip(places, places, strict=True)), **mine}) for mine in parts.values()]) \
        if len(parts) > 1 or "" not in parts else table


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
    return CsvTable(files, columns, unit, tuple(line for table in tables for line in table.lines), tables[0].head)


def together(tables: Sequence[CsvTable], average: bool) -> list[CsvTable]:
    """Tables of one axis as one where they are readings of the same errors (`average`), or the two ways of one."""
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
