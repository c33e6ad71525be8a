"""The control's own tool table, from the file that the control writes of it.

LinuxCNC: the tool table itself (`T1 P1 Z120.03 D6 ; remark`). Fanuc and Haas: G10 L10 (geometry) and L11 or L1 (wear), each
with P and R (B-63944EN 14.2; Haas "G10 Set Offsets"), in mm or, behind G20, in inches. Haas besides: the file of offsets
that the control saves (.OFS; no manual shows it, a shop's guide to the HTS400 presetter does): LENGTH_GEOMETRY and
LENGTH_WEAR of each TOOL1, TOOL2 ...; it states no units, mm are taken. Siemens: $TC_DP3 (length 1), $TC_DP12 (wear) and
$TC_DP21 (adapter) of edge 1 of a tool archive, and $TC_TP2, the name by which tool management finds a tool. What controls
add along other axes is read too ($TC_DP4, 5, 13, 14, 22, 23; LinuxCNC: X, Y, A, B, C, U, V, W). Heidenhain:
TOOL.T, columns T, NAME, L and DL below the names in its header line; numbers have a decimal point or a comma, as the control
is set (SHB Data Interfaces, April 2010, p. 6-41). Any control: a table of text with the columns `register` or `tool`,
`length` and, where there is any, `wear`, mm.

Tables hold rows of tools that nobody has measured, with 0, and lengths that count from another tool, negative: such a row
is no fault of the file, only of a program that calls the tool.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import field
from pathlib import Path
from typing import Literal

from postproc.controllers.model import ControllerFile, WriterName
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error, require
from toolpaths.input_files import read_input, unreadable
from toolpaths.units import MM_PER_INCH

LONGEST = 2000.0
"""mm: no tool is longer"""
_HINT = "name the file that the control writes of its tool table, or one of text with the columns register and length"
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)")
_WORD = re.compile(r"\s*([A-DF-Z])\s*([+-]?(?:\d+\.?\d*|\.\d+))(?=[\sA-Z]|$)", re.IGNORECASE)
_HAAS_TOOL = re.compile(r"<TOOL(\d+)>(.*?)</TOOL\1>", re.IGNORECASE | re.DOTALL)
_HAAS_TAG = re.compile(r"<TOOL(?:_OFFSET|\d+)\b", re.IGNORECASE)
_HAAS_LENGTH = re.compile(r"<LENGTH_(GEOMETRY|WEAR)>([^<]*)</LENGTH_\1>", re.IGNORECASE)
_SIEMENS = re.compile(r"\$TC_DP(3|12|21)\s*\[\s*(\d+)\s*,\s*1\s*\]\s*=\s*([^\s;$]*)", re.IGNORECASE)
_ASIDE_OF_SIEMENS = re.compile(r"(\$TC_DP(?:4|5|13|14|22|23))\s*\[\s*(\d+)\s*,\s*1\s*\]\s*=\s*([^\s;$]*)", re.IGNORECASE)
_NAME_OF_SIEMENS = re.compile(r'\$TC_TP2\s*\[\s*(\d+)\s*\]\s*=\s*"([^"]*)"', re.IGNORECASE)
_INCH_OF_SIEMENS = re.compile(r"(?<![A-Z0-9_])G7(?:00|0)(?![0-9])", re.IGNORECASE)
_KLARTEXT = re.compile(r"^\s*BEGIN\s+\S*\s*\.T\s+(MM|INCH)\b", re.IGNORECASE)
_COLUMNS = {"register": "register", "h": "register", "tool": "tool", "t": "tool", "length": "length", "wear": "wear"}
By = Literal["register", "tool"]
Part = Literal["geometry", "wear", "adapter"]


@dataclass(frozen=True)
class ToolTable:
    """Lengths (mm), by length register or by tool number."""

    lengths: dict[int, float]
    by: By = "register"
    names: dict[int, str] = field(default_factory=dict)
    """by number: what the control calls the tool, capitals"""
    named: bool = False
    """the control looks for a tool by its name: T5 is the tool whose name is 5"""
    unusable: dict[int, float] = field(default_factory=dict)
    """mm by number: 0, negative or too long"""
    aside: dict[int, str] = field(default_factory=dict)
    """by number: what the control adds along other axes with the length"""


@dataclass
class _Rows:
    """What has been read so far: mm by number and part, faults with their lines."""

    file: str
    by: By = "register"
    parts: dict[int, dict[Part, float]] = field(default_factory=dict)
    names: dict[int, str] = field(default_factory=dict)
    named: bool = False
    aside: dict[int, list[str]] = field(default_factory=dict)
    faults: list[Diagnostic] = field(default_factory=list)

    def fault(self, code: str, what: str, line: int, hint: str) -> None:
        """A line that is not taken."""
        self.faults.append(error(f"tool-table.{code}", what, file=self.file, lines=[line], hint=hint))

    def number(self, text: str, line: int) -> float | None:
        """A number that is nothing but one; None, and a fault, for all else."""
        if _NUMBER.fullmatch(text.strip()):
            return float(text)
        self.fault("number", f"{text.strip()[:40]!r} is not a number", line,
                   "a number is like 120.03, with a decimal point")
        return None

    def add(self, number: float, part: Part, mm: float, line: int) -> None:
        """A length, or what is added to it."""
        n = int(number)
        if n == number == 0:  # the spindle without a tool
            return
        if n != number or n < 1:
            self.fault("register", f"{number:g} is not the number of a register or tool", line,
                       "numbers are 1, 2, 3 ...")
        elif self.parts.setdefault(n, {}).setdefault(part, mm) != mm:
            self.fault("twice", f"number {n} has two lengths, {self.parts[n][part]:g} and {mm:g} mm", line,
                       "leave the one that is not in force out")


def read_tool_table(file: str | Path, controller: ControllerFile, zeros: bool = False) -> ToolTable:
    """The lengths of a file; `zeros`: a table without a length of more than 0 is none the less a table.

    Raises:
        DiagnosticError: where the file cannot be read, or holds no lengths in a form that is known.
    """
    try:
        text = read_input(file).decode("utf-8", "replace").lstrip("\ufeff")
    except OSError as fault:
        raise DiagnosticError([unreadable(fault, "tool-table.open", file, _HINT)]) from fault
    return table_of(text, controller, str(file), zeros)


def table_of(text: str, controller: ControllerFile, file: str, zeros: bool = False) -> ToolTable:
    """Of the text of a table; errors as of `read_tool_table`."""
    lines, rows = text.splitlines(), _Rows(file)
    (_separated if _is_separated(lines) else _FORMS[controller.writer])(lines, rows)
    found, unusable = dict[int, float](), dict[int, float]()
    for number, parts in rows.parts.items():
        length = sum(parts.values())
        if "geometry" not in parts and length:
            rows.fault("wear", f"number {number} has a wear of {length:g} mm and no length", 1,
                       "write the table with geometry and wear")
        (found if parts.get("geometry") and 0.0 < length <= LONGEST else unusable)[number] = length
    if not found and not rows.faults and not (zeros and unusable):
        rows.faults.append(no_length(unusable, "", file) if unusable else error(
            "tool-table.empty", f"no length of a tool as {controller.writer} controls write it", file=file, hint=_HINT))
    require(rows.faults)
    aside = {number: ", ".join(words) for number, words in rows.aside.items()}
    return ToolTable(found, rows.by, rows.names, rows.named, unusable, aside)


def no_length(unusable: dict[int, float], who: str, file: str) -> Diagnostic:
    """The error of lengths (mm by number) that are none; `who`: what calls them."""
    said = ", ".join(f"number {number} has a length of {mm:g} mm" for number, mm in sorted(unusable.items())[:6])
    return error("tool-table.length", f"{said}{who}, allowed is more than 0, at most {LONGEST:g}", file=file,
                 count=len(unusable), hint="measure the tool: lengths are mm from the gauge point of the spindle to the "
                 "tip, not from another tool or a place on the table")


def _words(text: str, line: int, rows: _Rows) -> list[tuple[str, float]]:
    """The words of a block, capitals; none, and a fault, where something of it is not a word with a number."""
    found, at = list[tuple[str, float]](), 0
    while text[at:].strip():
        word = _WORD.match(text, at)
        if word is None:
            rows.fault("number", f"{text[at:].strip()[:40]!r} is not a word with a number", line,
                       "a word is a letter and a number with a decimal point, like Z120.03")
            return []
        found.append((word[1].upper(), float(word[2])))
        at = word.end()
    return found


def _single(words: list[tuple[str, float]], letters: str, line: int, rows: _Rows) -> dict[str, float] | None:
    """The numbers of letters that a block has once each; None, and a fault, otherwise."""
    values = {letter: [value for name, value in words if name == letter] for letter in letters}
    wrong = [letter for letter, found in values.items() if len(found) != 1]
    if wrong:
        rows.fault("words", f"the line needs {', '.join(letters)} once each, found {', '.join(wrong)} "
                   f"{'more than once' if values[wrong[0]] else 'nowhere'}", line, "write one register in each line")
        return None
    return {letter: found[0] for letter, found in values.items()}


def _linuxcnc(lines: list[str], rows: _Rows) -> None:
    for n, line in enumerate(lines, 1):
        words = _words(line.split(";")[0], n, rows)
        if any(letter == "Z" for letter, _ in words) and (values := _single(words, "TZ", n, rows)):
            rows.add(values["T"], "geometry", values["Z"], n)
            if aside := [f"{letter} {value:g}" for letter, value in words if letter in "XYABCUVW" and value != 0.0]:
                rows.aside.setdefault(int(values["T"]), []).extend(aside)


def _offsets(lines: list[str], rows: _Rows) -> None:
    unit = 1.0
    for n, line in enumerate(lines, 1):
        block = re.sub(r"\([^)]*\)", "", line).strip().removesuffix(";")  # as the screen shows the end of a block
        if not re.search(r"G\s*(10|20|21|91)(?!\d)", block, re.IGNORECASE):
            continue
        words = _words(block, n, rows)
        codes = {value for letter, value in words if letter == "G"}
        unit = MM_PER_INCH if 20.0 in codes else 1.0 if 21.0 in codes else unit
        if 91.0 in codes:
            rows.fault("increments", "G91: the numbers are added to what the control holds", n,
                       "write the table with G90")
        kinds = [value for letter, value in words if letter == "L"]
        if 10.0 not in codes or not set(kinds) & {1.0, 10.0, 11.0}:
            continue
        if "." not in block.upper().rpartition("R")[2] and ("R", 0.0) not in words:
            rows.fault("point", f"{block[:40]!r}: R has no decimal point, it may be mm or increments", n,
                       "write R with a decimal point: R120. is 120 mm")
        elif values := _single(words, "LPR", n, rows):
            rows.add(values["P"], "geometry" if values["L"] == 10.0 else "wear", values["R"] * unit, n)


def _haas(lines: list[str], rows: _Rows) -> None:
    if not any(_HAAS_TAG.search(line) for line in lines):
        _offsets(lines, rows)
        return
    text, parts = "\n".join(lines), dict[str, Part]({"GEOMETRY": "geometry", "WEAR": "wear"})
    for tool in _HAAS_TOOL.finditer(text):
        for found in _HAAS_LENGTH.finditer(tool[2]):
            line = text.count("\n", 0, tool.start(2) + found.start()) + 1
            value = rows.number(found[2], line)
            if value:  # pockets without a tool hold 0
                rows.add(float(tool[1]), parts[found[1].upper()], value, line)


def _siemens(lines: list[str], rows: _Rows) -> None:
    parts: dict[str, Part] = {"3": "geometry", "12": "wear", "21": "adapter"}
    rows.by = "tool"
    for n, line in enumerate(lines, 1):
        for number, name in _NAME_OF_SIEMENS.findall(line):
            rows.names[int(number)], rows.named = name.upper(), True
        block = re.sub(r'"[^"]*"', "", line).split(";")[0]
        if _INCH_OF_SIEMENS.search(block):
            rows.fault("inches", "G70 or G700: the numbers may be inches", n, "write the archive in mm")
        for part, tool, text in _SIEMENS.findall(block):
            value = rows.number(text, n)
            if value is not None:
                rows.add(float(tool), parts[part], value, n)
        for name, tool, text in _ASIDE_OF_SIEMENS.findall(block):
            if rows.number(text, n):
                rows.aside.setdefault(int(tool), []).append(f"{name.upper()} {text}")


def _klartext(lines: list[str], rows: _Rows) -> None:
    unit = next((found[1].upper() for line in lines if (found := _KLARTEXT.match(line))), "")
    head = next((n for n, line in enumerate(lines) if {"T", "L"} <= set(line.split())), None)
    if not unit or head is None:
        return
    rows.by = "tool"
    starts = [(found.group(), found.start()) for found in re.finditer(r"\S+", lines[head])]
    spans = {name: (begin, end)
             for (name, begin), end in zip(starts, [*(s for _, s in starts[1:]), None], strict=True)}
    parts: dict[str, Part] = {"L": "geometry", "DL": "wear"}
    cells_of = [(n, {name: line[slice(*spans[name])].strip() for name in ("T", "NAME", *parts) if name in spans})
                for n, line in enumerate(lines[head + 1:], head + 2)]
    comma = not any("." in cells.get(name, "") for _, cells in cells_of for name in parts)
    for n, cells in cells_of:
        if not cells["T"].isdigit() or int(cells["T"]) == 0 or not cells["L"]:
            continue
        if cells.get("NAME"):
            rows.names[int(cells["T"])] = cells["NAME"].upper()
        for name, part in parts.items():
            text = cells.get(name, "")
            value = rows.number(text.replace(",", ".") if comma else text, n) if text else None
            if value is not None:
                rows.add(float(cells["T"]), part, value * (MM_PER_INCH if unit == "INCH" else 1.0), n)


def _separator(head: str) -> str:
    return next((mark for mark in (";", "\t") if mark in head), ",")


def _is_separated(lines: list[str]) -> bool:
    first = next((line for line in lines if line.strip()), "")
    names = [cell.strip().lower() for cell in first.split(_separator(first))]
    return "length" in names and any(_COLUMNS.get(name) in ("register", "tool") for name in names)


def _numbered(lines: list[str]) -> Iterator[tuple[int, str]]:
    return ((n, line) for n, line in enumerate(lines, 1) if line.strip())


def _separated(lines: list[str], rows: _Rows) -> None:
    at, head = next(_numbered(lines))
    mark = _separator(head)
    names = [cell.strip().lower() for cell in head.split(mark)]
    columns = [_COLUMNS.get(name, "") for name in names]
    if "" in columns or len(set(columns)) < len(columns):
        rows.fault("columns", f"columns are {', '.join(names)}", at,
                   "allowed are register or tool, length, wear, each once")
        return
    rows.by = "register" if "register" in columns else "tool"
    for n, line in list(_numbered(lines))[1:]:
        cells = line.split(mark)
        if len(cells) != len(columns):
            rows.fault("cells", f"{len(cells)} cells, the header line has {len(columns)}", n,
                       f"separate the cells by {mark!r} throughout; numbers have a decimal point")
            continue
        values = {name: rows.number(cell, n) for name, cell in zip(columns, cells, strict=True) if cell.strip()}
        key, length, wear = (values.get(name) for name in (rows.by, "length", "wear"))
        if key is None or length is None:
            continue
        rows.add(key, "geometry", length, n)
        if wear is not None:
            rows.add(key, "wear", wear, n)


_Form = Callable[[list[str], _Rows], None]
_FORMS: dict[WriterName, _Form] = {"linuxcnc": _linuxcnc, "iso": _linuxcnc, "fanuc": _offsets, "haas": _haas,
                            "siemens": _siemens, "heidenhain": _klartext}
