"""CSV tables with units in their headers: `X [mm], EXX+ [um], EXX- [um]`, or in a row of units below them.

Numbers with a decimal point, separated by commas, semicolons or tabs; between semicolons or tabs a decimal
comma will do where the table has no point. `#` begins a comment line, lines of words above the header are
titles. UTF-8, UTF-16 with its mark, or Windows-1252, as spreadsheets save them. Inside mm and rad.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.input_files import advice, read_input, reason
from toolpaths.units import DEG, MM_PER_INCH

LENGTHS = {"mm": 1.0, "um": 1e-3, "m": 1e3, "in": MM_PER_INCH}
ANGLES = {"deg": DEG, "arcsec": DEG / 3600.0, "arcmin": DEG / 60.0, "urad": 1e-6, "mrad": 1e-3, "rad": 1.0}
UNITS = {**LENGTHS, **ANGLES}
_ALIASES = {"\u00b0": "deg", "inch": "in", "um/m": "urad"}
_MICRO = str.maketrans("\u00b5\u03bc", "uu")
_THOUSANDS = re.compile(r"-?\d{1,3}(,\d{3})+$")
TITLES = 60
"""lines at the most that stand above a header"""
MOST = 8
"""faults of a header that are reported"""
_HEAD = re.compile(r"(?P<name>[^\[\]()]+?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?$")
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")


def other_units(unit: str) -> dict[str, float]:
    """Other units that numbers under `unit` may be in, and what they are larger by."""
    known = LENGTHS if unit in LENGTHS else ANGLES
    return {other: size / known[unit] for other, size in known.items() if other != unit}


@dataclass(frozen=True)
class CsvTable:
    """Columns by name, mm and rad; `unit` as written ("" for none), `lines` (N,) the 1-based line of each row."""

    file: str
    columns: Mapping[str, Floats]
    unit: Mapping[str, str]
    lines: tuple[int, ...]
    head: int = 1
    """line of the header"""

    def __len__(self) -> int:
        return len(self.lines)


def read_csv(path: Path, cited: tuple[str, int] = ("", 0),
             gaps: bool = False) -> tuple[CsvTable | None, list[Diagnostic]]:
    """The table of a file; None and what is wrong with it.

    Args:
        cited: file and line that named it, for a message where it is missing
        gaps: True takes blank cells, as NaN
    """
    text, found = read_text(path, cited)
    if text is None:
        return None, found
    lines = [(n, line) for n, line in enumerate(text.splitlines(), 1) if line.strip(' \t;,"')]  # blank rows of a sheet too
    rows = [(n, line) for n, line in lines if not line.lstrip().startswith("#") and not line.startswith("sep=")]
    if len(rows) < 2:
        return None, [error("error-table.empty", "a header line and at least one row of numbers are needed, there "
                            + ("is the header alone" if rows else "is nothing"), file=str(path),
                            lines=[n for n, _ in rows], hint="write e.g. X [mm], EXX [um], then a row per position")]
    return _table(str(path), _below_titles(rows), gaps)


def _below_titles(rows: list[tuple[int, str]]) -> list[tuple[int, str]]:
    """Rows from the header on: the first line without numbers above one that begins with a number, or above units.

    All of them where there is no such line, or one above it has units, as it then is a header.
    """
    for k in range(min(len(rows) - 1, TITLES)):
        (_, line), (_, below) = rows[k:k + 2]
        mark = _mark(line)
        cells, under = _cells(line, mark), _cells(below, mark)
        number = next((_number(cell, mark != ",") for cell in under if cell), None)
        numbers = [cell for cell in cells if _number(cell, mark != ",") is not None]
        if not numbers and len(under) <= len(cells) and (number is not None or _units(under)):
            return rows[k:]
        if any(m and m["unit"] and unit_of(m["unit"]) in UNITS for m in map(_HEAD.match, cells)):
            break
    return rows


def _units(cells: Sequence[str]) -> bool:
    """True for a row of units."""
    return {unit_of(cell.strip("[]()")) for cell in cells} <= {*UNITS}


def read_text(path: Path, cited: tuple[str, int] = ("", 0)) -> tuple[str | None, list[Diagnostic]]:
    """The text of a file that another one cites; arguments as `read_csv`."""
    def fault(code: str, message: str, hint: str) -> tuple[None, list[Diagnostic]]:
        return None, [error(code, message, file=cited[0] or str(path), lines=[cited[1]], hint=hint)]

    try:
        text = _decoded(read_input(path))
    except FileNotFoundError:
        return fault("error-table.not-found", f"there is no table {path.name!r}",
                     f"looked in {path.parent or '.'}")
    except OSError as bad:
        return fault("error-table.unreadable", f"cannot read {path.name[:60]!r}: {reason(bad)}",
                     advice(bad, "name a CSV file"))
    if text is None:
        return fault("error-table.unreadable", f"{path.name} is not text", "save it as CSV, UTF-8")
    return text, []


def _decoded(data: bytes) -> str | None:
    """Text as spreadsheets save it; None for what is none."""
    codes = ["utf-16"] if data.startswith((b"\xff\xfe", b"\xfe\xff")) else ["utf-8-sig", "cp1252"]
    for code in codes:
        try:
            text = data.decode(code)
        except UnicodeDecodeError:
            continue
        return None if _CONTROL.search(text) else text
    return None


def _table(file: str, rows: list[tuple[int, str]], gaps: bool) -> tuple[CsvTable | None, list[Diagnostic]]:
    (first, head), *body = rows
    mark = _mark(head)
    cells = _cells(head, mark)
    found = [_HEAD.match(cell) for cell in cells]
    diagnostics = _no_head(file, first, head, body, mark) or _head_faults(file, first, cells, found)
    if diagnostics:
        return None, diagnostics
    names = [m["name"] for m in found if m]
    unit = {m["name"]: unit_of(m["unit"] or "") for m in found if m}
    below = _cells(body[0][1], mark)
    if len(body) > 1 and not any(unit.values()) and len(below) == len(names) and _units(below):
        unit, body = {name: unit_of(cell.strip("[]()")) for name, cell in zip(names, below, strict=True)}, body[1:]
    values, faults = _numbers(body, mark, names, gaps)
    if faults:
        fault, hint = faults[0][1:]
        return None, [error("error-table.row", fault, file=file, lines=[n for n, _, _ in faults[:6]], count=len(faults),
                            hint=hint or f"columns are {', '.join(names)[:200]}")]
    scaled = {name: values[:, k] * UNITS.get(unit[name], 1.0) for k, name in enumerate(names)}
    return CsvTable(file, scaled, unit, tuple(line for line, _ in body), first), []


def unit_of(text: str) -> str:
    """A unit as this module calls it; what it does not know as it is."""
    plain = text.strip().translate(_MICRO)
    return _ALIASES.get(plain, plain)


def _mark(line: str) -> str:
    """What separates the cells of a line."""
    return next((mark for mark in ";\t" if mark in line), ",")


def _cells(line: str, mark: str) -> list[str]:
    """Cells of a header without quotes, and without blank ones behind the last."""
    cells = [cell.strip().strip('"').strip() for cell in line.split(mark)]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return cells


def _no_head(file: str, line: int, head: str, body: Sequence[tuple[int, str]], mark: str) -> list[Diagnostic]:
    """A first line without columns: words of the program that wrote the file, or a file of another kind."""
    def fault(message: str, hint: str) -> list[Diagnostic]:
        return [error("error-table.header", message, file=file, lines=[line], hint=hint)]

    words = head.split()
    if mark in head or mark != ",":
        return []
    if len(words) > 1 and all(_number(word, False) is not None for word in words):
        return fault("the first line holds numbers, without commas, semicolons or tabs between them",
                     "a file of LinuxCNC is imported as X=x.comp; a table has a header, e.g. X [mm], EXX [um]")
    if any(m in text for _, text in body for m in ",;\t"):
        return fault(f"{head.strip()[:40]!r} is one column, the rows below have more",
                     "begin lines above the header with #; separate all lines by the same commas, semicolons or tabs")
    return []


def _head_faults(file: str, line: int, cells: Sequence[str],
                 found: Sequence[re.Match[str] | None]) -> list[Diagnostic]:
    result = []
    for cell, match in zip(cells, found, strict=True):
        if match is None or not match["name"]:
            hint = "write NAME [unit]" if cell else "name the column, or take it out"
            result.append(error("error-table.header", f"{cell[:40]!r} is not a column", file=file, lines=[line], hint=hint))
        elif match["unit"] is not None and unit_of(match["unit"]) not in UNITS:
            result.append(error("error-table.unit", f"unit {match['unit'][:20]!r} of column {match['name'][:40]} is not "
                                "known", file=file, lines=[line], hint="known: " + ", ".join(UNITS)))
    if not result and all(_number(cell, False) is not None for cell in cells):
        result.append(error("error-table.header", "the first line holds numbers", file=file, lines=[line],
                            hint="write a header line first, e.g. X [mm], EXX [um]"))
    names = [m["name"] for m in found if m]
    twice = sorted({name for name in names if names.count(name) > 1})
    result += [error("error-table.header", f"column {name} appears twice", file=file, lines=[line],
                     hint="name every column once") for name in twice]
    return result[:MOST]


def _numbers(body: Sequence[tuple[int, str]], mark: str, names: Sequence[str],
             gaps: bool) -> tuple[Floats, list[tuple[int, str, str]]]:
    """(values (N, C), faults as (line, what, hint)) of rows (line, text)."""
    values, faults = np.empty((len(body), len(names))), []
    comma = mark != "," and not any("." in text for _, text in body)
    for k, (line, text) in enumerate(body):
        plain = None if comma else _plain(text.split(mark), len(names))
        if plain is not None:
            values[k] = plain
            continue
        fault = _fill(values[k], text.split(mark), names, comma, gaps)
        if fault:
            faults.append((line, *fault))
    if comma and not faults and any("," in text for _, text in body) and _thousands(body, mark):
        faults.append((body[0][0], "commas before three digits each: decimals or thousands?",
                       "write decimal points, and no marks between thousands"))
    return values, faults


def _thousands(body: Sequence[tuple[int, str]], mark: str) -> bool:
    """True where every comma may be one between thousands."""
    return all(_THOUSANDS.match(cell.strip()) for _, text in body for cell in text.split(mark) if "," in cell)


def _plain(cells: list[str], count: int) -> list[float] | None:
    """The numbers of a line where there are `count` and nothing else, as most lines are; None where `_fill` has to look."""
    try:
        row = list(map(float, cells))
    except ValueError:
        return None
    return row if len(row) == count and math.isfinite(sum(row)) and not any("_" in cell for cell in cells) else None


def _fill(row: Floats, cells: list[str], names: Sequence[str], comma: bool,
          gaps: bool) -> tuple[str, str] | None:
    """Put the numbers of a line in `row`; what is wrong and what to do, None for nothing."""
    while len(cells) > len(names) and not cells[-1].strip():
        cells.pop()
    if len(cells) != len(names):
        hint = "write decimal points where commas separate the columns" if len(cells) == 2 * len(names) else ""
        return f"{len(cells)} values, {len(names)} columns", hint
    for k, cell in enumerate(cells):
        number = np.nan if not cell.strip() and gaps else _number(cell, comma)
        if not cell.strip() and not gaps:
            return f"no number in column {names[k][:40]}", "take the row out where nothing was measured; errors import " \
                "--average takes blank cells"
        if number is None:
            shown = f"{cell.strip()[:40]!r} in column {names[k][:40]}"
            hint = "" if any(map(str.isdigit, cell)) else "take columns without numbers out"
            return f"{shown} is not a number", "write decimal points throughout" if "," in cell else hint
        if not np.isfinite(number) and cell.strip():
            return f"{cell.strip()} in column {names[k][:40]} is not finite", "take the row out where nothing was measured"
        row[k] = number
    return None


def _number(cell: str, comma: bool) -> float | None:
    text = cell.strip().strip('"')
    try:
        return None if "_" in text else float(text.replace(",", ".") if comma else text)
    except ValueError:
        return None


def write_csv(columns: Mapping[str, tuple[str, Floats]], comment: Sequence[str] = ()) -> str:
    """Text of a table of name -> (unit, values (N,) in mm and rad); digits enough to read back the same numbers.

    A unit "" is written without brackets and its values as they are.
    """
    head = ",".join(f"{name} [{unit}]" if unit else name for name, (unit, _) in columns.items())
    scaled = [values / UNITS.get(unit, 1.0) for unit, values in columns.values()]
    rows = (",".join(f"{x:.12g}" for x in row) for row in zip(*scaled, strict=True))
    return "\n".join([*(f"# {line}" for line in comment), head, *rows, ""])
