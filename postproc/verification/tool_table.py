"""Lengths of tools as the control's own tool table has them, from the file that the control writes of it.

LinuxCNC: the tool table itself (`T1 P1 Z120.03 D6 ; remark`). Fanuc and Haas: G10 L10 (geometry) and L11 or L1 (wear), each
with P and R (B-63944EN 14.2; Haas "G10 Set Offsets"), in mm or, behind G20, in inches. Haas besides: the file of offsets
that the control saves (.OFS; no manual shows it, a shop's guide to the HTS400 presetter does): LENGTH_GEOMETRY and
LENGTH_WEAR of each TOOL1, TOOL2 ...; it states no units, mm are taken. Siemens: $TC_DP3 (length 1), $TC_DP12 (wear) and
$TC_DP21 (adapter) of edge 1 of a tool archive. Heidenhain: TOOL.T, columns T, L and DL below the names in its header line.
Any control: a table of text with the columns `register` or `tool`, `length` and, where there is any, `wear`, mm.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from postproc.controllers.model import ControllerFile, WriterName
from postproc.job.job import Job
from postproc.readback.comparison.length_margins import MUCH, LengthMargin
from postproc.reference.events import tool_loads
from postproc.setup.model import SetupFile, ToolSetup
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error, has_errors, require, warning
from toolpaths.input_files import read_input, unreadable
from toolpaths.units import MM_PER_INCH

LONGEST = 2000.0
"""mm: no tool is longer"""
FAR = 10.0
"""mm by which a tool is hardly ever off its gauge length"""
_HINT = "name the file that the control writes of its tool table, or one of text with the columns register and length"
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)")
_WORD = re.compile(r"\s*([A-DF-Z])\s*([+-]?(?:\d+\.?\d*|\.\d+))(?=[\sA-Z]|$)", re.IGNORECASE)
_HAAS_TOOL = re.compile(r"<TOOL(\d+)>(.*?)</TOOL\1>", re.IGNORECASE | re.DOTALL)
_HAAS_LENGTH = re.compile(r"<LENGTH_(GEOMETRY|WEAR)>([^<]*)</LENGTH_\1>", re.IGNORECASE)
_SIEMENS = re.compile(r"\$TC_DP(3|12|21)\s*\[\s*(\d+)\s*,\s*1\s*\]\s*=\s*([^\s;$]*)", re.IGNORECASE)
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


@dataclass
class _Rows:
    """What has been read so far: mm by number and part, faults with their lines."""

    file: str
    by: By = "register"
    parts: dict[int, dict[Part, float]] = field(default_factory=dict)
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
        if n != number or n < 1:
            self.fault("register", f"{number:g} is not the number of a register or tool", line,
                       "numbers are 1, 2, 3 ...")
        elif self.parts.setdefault(n, {}).setdefault(part, mm) != mm:
            self.fault("twice", f"number {n} has two lengths, {self.parts[n][part]:g} and {mm:g} mm", line,
                       "leave the one that is not in force out")


def read_tool_table(file: str | Path, controller: ControllerFile, doubled: bool = False) -> ToolTable:
    """The lengths of a file; `doubled`: those of `doubled_lengths`, which are 0 where all is right.

    Raises:
        DiagnosticError: where the file cannot be read, or holds no lengths in a form that is known.
    """
    try:
        text = read_input(file).decode("utf-8", "replace").lstrip("\ufeff")
    except OSError as fault:
        raise DiagnosticError([unreadable(fault, "tool-table.open", file, _HINT)]) from fault
    return table_of(text, controller, str(file), doubled)


def table_of(text: str, controller: ControllerFile, file: str, doubled: bool = False) -> ToolTable:
    """Of the text of a table; errors as of `read_tool_table`."""
    lines, rows = text.splitlines(), _Rows(file)
    (_separated if _is_separated(lines) else _FORMS[controller.writer])(lines, rows)
    found = {}
    for number, parts in rows.parts.items():
        length = sum(parts.values())
        if "geometry" not in parts:
            rows.fault("wear", f"number {number} has a wear of {length:g} mm and no length", 1,
                       "write the table with geometry and wear")
        elif not (length > 0.0 or doubled) or abs(length) > LONGEST:
            rows.fault("length", f"number {number} has a length of {length:g} mm, allowed is more than 0, at most "
                       f"{LONGEST:g}", 1, "lengths are mm from the gauge point of the spindle to the tip; leave unmeasured "
                       "tools out")
        found[number] = length
    if not found and not rows.faults:
        rows.faults.append(error("tool-table.empty", f"no length of a tool as {controller.writer} controls write it",
                                 file=file, hint=_HINT))
    require(rows.faults)
    return ToolTable(found, rows.by)


@dataclass(frozen=True)
class MeasuredLength:
    """A tool's length at the machine (mm) next to its gauge length; `allowed`: what the program takes, None where that is
    not known."""

    number: int
    register: int
    gauge: float
    measured: float
    allowed: LengthMargin | None = None

    @property
    def off(self) -> float:
        """mm that the tool is longer than its gauge length."""
        return self.measured - self.gauge

    @property
    def beyond(self) -> str:
        """What fails with this length; "" for nothing."""
        if self.allowed is None or -self.allowed.shorter <= self.off <= self.allowed.longer:
            return ""
        return self.allowed.ends_longer if self.off > self.allowed.longer else self.allowed.ends_shorter

    def line(self) -> str:
        """For people."""
        text = (f"T{self.number}: gauge length {self.gauge:.4f} mm, register {self.register} of the tool table "
                f"{self.measured:.4f} mm ({self.off:+.4f}")
        if self.allowed is None:
            return f"{text})"
        ends = (f"{sign}{mm:.4f}" if mm < np.inf else f"{sign}{MUCH:g} and more"
                for sign, mm in (("-", self.allowed.shorter), ("+", self.allowed.longer)))
        return f"{text}; allowed {' to '.join(ends)}{': ' + self.beyond + ' fails' if self.beyond else ''})"


def with_allowed(found: list[MeasuredLength], margins: tuple[LengthMargin, ...], from_gauge: bool) -> list[MeasuredLength]:
    """With what the program takes; `from_gauge`: margins count from gauge lengths, else from the lengths measured."""
    by_tool = {margin.number: margin for margin in margins}
    result = []
    for one in found:
        margin, more = by_tool.get(one.number), 0.0 if from_gauge else one.off
        if margin is not None:
            margin = replace(margin, shorter=margin.shorter - more, longer=margin.longer + more)
        result.append(replace(one, allowed=margin))
    return result


def lengths_at_machine(file: str | Path, job: Job) -> tuple[list[MeasuredLength], list[Diagnostic]]:
    """What the table of the control says of the tools of a program: their lengths, which the program is then verified with;
    none where its words hold the lengths already, so that those of the table must be 0.

    Raises:
        DiagnosticError: as of `read_tool_table`.
    """
    if job.controller.keeps_length and not job.control.length_on_z:
        return [], doubled_lengths(read_tool_table(file, job.controller, doubled=True), job, str(file))
    return measured_lengths(read_tool_table(file, job.controller), job, str(file))


def measured_lengths(table: ToolTable, job: Job, file: str) -> tuple[list[MeasuredLength], list[Diagnostic]]:
    """The lengths of the tools that a CL file calls, in order of their numbers; errors for those that the table lacks."""
    wanted = sorted({(said.number, register) for said, register, _ in tool_loads(job.toolpath)})
    keys = {(number, register): number if table.by == "tool" else register for number, register in wanted}
    found = [MeasuredLength(number, register, job.length_of(number), table.lengths[keys[number, register]])
             for number, register in wanted if keys[number, register] in table.lengths]
    lacking = [f"{table.by} {key}" + (f" (T{number})" if table.by == "register" else "")
               for (number, _), key in keys.items() if key not in table.lengths]
    faults = [error("tool-table.missing", f"no length of {', '.join(dict.fromkeys(lacking))}, which the program calls",
                    file=file, hint="measure these tools, and write the table once more")] if lacking else []
    apart = sorted({one.number for one in found for other in found
                    if one.number == other.number and one.measured != other.measured})
    if apart:
        faults.append(error("tool-table.apart", f"registers of one tool hold different lengths: T{apart[0]}", file=file,
                            hint="give each length a tool number of its own in the CL file"))
    return found, faults if has_errors(faults) else _questionable(found, job, file)


def doubled_lengths(table: ToolTable, job: Job, file: str) -> list[Diagnostic]:
    """Errors for tools whose lengths the control would add to words that hold them already: in its table they are 0."""
    found, faults = measured_lengths(table, job, file)
    wrong = [f"T{one.number}: {one.measured:g} mm" for one in found if one.measured != 0.0]
    return [fault for fault in faults if fault.code == "tool-table.missing"] + ([error(
        "tool.length_twice", "the words of the program hold the lengths of the tools already, and this controller adds "
        f"those of its tool table with every tool change: {', '.join(dict.fromkeys(wrong))}", file=file, count=len(wrong),
        hint="L and DL of these tools must be 0 in the control's tool table")] if wrong else [])


def _questionable(found: list[MeasuredLength], job: Job, file: str) -> list[Diagnostic]:
    """Lengths that may be in other units, or of another tool; bodies that the lengths do not reach."""
    far = [one for one in found if one.gauge and abs(one.measured - one.gauge) > FAR]
    result = [warning("tool-table.far", f"{one.line()}: {_inch_or_other(one)}", file=file,
                      hint="look at the tool and its register; inches are read behind G20 and in TOOL.T INCH")
              for one in far]
    shorter = [one for one in found if one.measured < one.gauge]
    if job.setup.bodies is not None and shorter:
        names = ", ".join(f"T{one.number}: {one.gauge - one.measured:.4f} mm" for one in shorter)
        result.append(warning("tool-table.bodies", "collisions are checked with shanks and holders as the set-up has "
                              f"them, but tools are shorter ({names})", file=file,
                              hint="write the lengths into the set-up, and shank and holder as they stand now"))
    return result


def _inch_or_other(one: MeasuredLength) -> str:
    inches = abs(one.measured * MM_PER_INCH - one.gauge) <= FAR
    return f"{one.measured:g} inches would be {one.measured * MM_PER_INCH:.4f} mm: is the table in inches?" if inches \
        else "is that this tool, and are the numbers mm?"


def with_measured(setup: SetupFile, found: list[MeasuredLength]) -> SetupFile:
    """A set-up with the lengths at the machine as gauge lengths."""
    tools = dict(setup.tools)
    for one in found:
        tools[str(one.number)] = tools.get(str(one.number), ToolSetup()).model_copy(update={"gauge_length": one.measured})
    return setup.model_copy(update={"tools": tools})


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


def _offsets(lines: list[str], rows: _Rows) -> None:
    unit = 1.0
    for n, line in enumerate(lines, 1):
        block = re.sub(r"\([^)]*\)", "", line).strip()
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
        if "." not in block.upper().rpartition("R")[2]:
            rows.fault("point", f"{block[:40]!r}: R has no decimal point, it may be mm or increments", n,
                       "write R with a decimal point: R120. is 120 mm")
        elif values := _single(words, "LPR", n, rows):
            rows.add(values["P"], "geometry" if values["L"] == 10.0 else "wear", values["R"] * unit, n)


def _haas(lines: list[str], rows: _Rows) -> None:
    if not any("<TOOL_OFFSET" in line.upper() for line in lines):
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
    for n, line in enumerate(lines, 1):
        block = line.split(";")[0]
        if _INCH_OF_SIEMENS.search(block):
            rows.fault("inches", "G70 or G700: the numbers may be inches", n, "write the archive in mm")
        for part, tool, text in _SIEMENS.findall(block):
            value = rows.number(text, n)
            if value is not None:
                rows.add(float(tool), parts[part], value, n)


def _klartext(lines: list[str], rows: _Rows) -> None:
    unit = next((found[1].upper() for line in lines if (found := _KLARTEXT.match(line))), "")
    head = next((n for n, line in enumerate(lines) if {"T", "L"} <= set(line.split())), None)
    if not unit or head is None:
        return
    starts = [(found.group(), found.start()) for found in re.finditer(r"\S+", lines[head])]
    spans = {name: (begin, end)
             for (name, begin), end in zip(starts, [*(s for _, s in starts[1:]), None], strict=True)}
    parts: dict[str, Part] = {"L": "geometry", "DL": "wear"}
    for n, line in enumerate(lines[head + 1:], head + 2):
        cells = {name: line[slice(*spans[name])].strip() for name in ("T", *parts) if name in spans}
        if not cells["T"].isdigit() or int(cells["T"]) == 0 or not cells["L"]:
            continue
        for name, part in parts.items():
            value = rows.number(cells[name], n) if cells.get(name) else None
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
