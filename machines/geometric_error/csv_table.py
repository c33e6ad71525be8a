"""CSV tables with units in their headers: `X [mm], EXX+ [um], EXX- [um]`.

Numbers with a decimal point, separated by commas, semicolons or tabs; `#` begins a comment line. Inside mm and rad.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG, MM_PER_INCH

LENGTHS = {"mm": 1.0, "um": 1e-3, "m": 1e3, "in": MM_PER_INCH}
ANGLES = {"deg": DEG, "arcsec": DEG / 3600.0, "arcmin": DEG / 60.0, "urad": 1e-6, "mrad": 1e-3, "rad": 1.0}
UNITS = {**LENGTHS, **ANGLES}
_HEAD = re.compile(r"(?P<name>[^\[\]]+?)\s*(?:\[(?P<unit>[^\]]*)\])?$")


@dataclass(frozen=True)
class CsvTable:
    """Columns by name, mm and rad; `unit` as written ("" for none), `lines` (N,) the 1-based line of each row."""

    file: str
    columns: Mapping[str, Floats]
    unit: Mapping[str, str]
    lines: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.lines)


def read_csv(path: Path, cited: tuple[str, int] = ("", 0)) -> tuple[CsvTable | None, list[Diagnostic]]:
    """The table of a file; None and what is wrong with it.

    Args:
        cited: file and line that named it, for a message where it is missing
    """
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        return None, [error("error-table.not-found", f"there is no table {path.name!r}", file=cited[0] or str(path),
                            lines=[cited[1]] if cited[1] else [], hint=f"looked in {path.parent or '.'}")]
    except (OSError, UnicodeDecodeError) as fault:
        return None, [error("error-table.unreadable", f"cannot read it: {fault}", file=str(path), hint="save it as UTF-8")]
    rows = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip() and not line.lstrip().startswith("#")]
    if len(rows) < 2:
        return None, [error("error-table.empty", "a header line and at least one row of numbers are needed", file=str(path))]
    return _table(str(path), rows)


def _table(file: str, rows: list[tuple[int, str]]) -> tuple[CsvTable | None, list[Diagnostic]]:
    (first, head), *body = rows
    mark = next((m for m in ";\t" if m in head), ",")
    found = [_HEAD.match(cell.strip()) for cell in head.split(mark)]
    diagnostics = _head_faults(file, first, head.split(mark), found)
    if diagnostics:
        return None, diagnostics
    names = [m["name"] for m in found if m]
    unit = {m["name"]: m["unit"] or "" for m in found if m}
    values = np.empty((len(body), len(names)))
    for k, (line, text) in enumerate(body):
        fault = _fill(values[k], text.split(mark), names)
        if fault:
            diagnostics.append(error("error-table.row", fault, file=file, lines=[line],
                                     hint=f"columns are {', '.join(names)}"))
    if diagnostics:
        return None, diagnostics
    scaled = {name: values[:, k] * UNITS.get(unit[name], 1.0) for k, name in enumerate(names)}
    return CsvTable(file, scaled, unit, tuple(line for line, _ in body)), []


def _head_faults(file: str, line: int, cells: Sequence[str], found: Sequence[re.Match[str] | None]) -> list[Diagnostic]:
    result = []
    for cell, match in zip(cells, found, strict=True):
        if match is None or not match["name"]:
            result.append(error("error-table.header", f"{cell.strip()!r} is no column", file=file, lines=[line],
                                hint="write NAME [unit]"))
        elif match["unit"] is not None and match["unit"] not in UNITS:
            result.append(error("error-table.unit", f"unit {match['unit']!r} of column {match['name']} is not known",
                                file=file, lines=[line], hint="known: " + ", ".join(UNITS)))
    names = [m["name"] for m in found if m]
    twice = sorted({name for name in names if names.count(name) > 1})
    result += [error("error-table.header", f"column {name} appears twice", file=file, lines=[line]) for name in twice]
    return result


def _fill(row: Floats, cells: Sequence[str], names: Sequence[str]) -> str:
    """Put the numbers of a line in `row`; what is wrong, "" for nothing."""
    if len(cells) != len(names):
        return f"{len(cells)} values, {len(names)} columns"
    for k, cell in enumerate(cells):
        try:
            row[k] = float(cell)
        except ValueError:
            return f"{cell.strip()!r} in column {names[k]} is not a number"
        if not np.isfinite(row[k]):
            return f"{cell.strip()} in column {names[k]} is not finite"
    return ""


def write_csv(columns: Mapping[str, tuple[str, Floats]], comment: Sequence[str] = ()) -> str:
    """Text of a table of name -> (unit, values (N,) in mm and rad); digits enough to read back the same numbers.

    A unit "" is written without brackets and its values as they are.
    """
    head = ",".join(f"{name} [{unit}]" if unit else name for name, (unit, _) in columns.items())
    scaled = [values / UNITS.get(unit, 1.0) for unit, values in columns.values()]
    rows = (",".join(f"{x:.12g}" for x in row) for row in zip(*scaled, strict=True))
    return "\n".join([*(f"# {line}" for line in comment), head, *rows, ""])
