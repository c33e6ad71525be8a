"""Lengths of tools as the control's own tool table has them, from the file that the control writes of it.

LinuxCNC: the tool table itself (`T1 P1 Z120.03 D6 ; remark`). Fanuc and Haas: G10 L10 (geometry) and L11 (wear), each with P
and R (B-63944EN 14.2; Haas "G10 Set Offsets"). Siemens: $TC_DP3 (length 1), $TC_DP12 (wear) and $TC_DP21 (adapter) of edge 1
of a tool archive. Heidenhain: TOOL.T, columns T, L and DL below the names in its head line. Any control: a table of text
with the columns `register` (or `tool`) and `length`, mm.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from postproc.controllers.model import ControllerFile
from postproc.job.job import Job
from postproc.reference.events import tool_loads
from postproc.setup.model import SetupFile, ToolSetup
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error, require
from toolpaths.input_files import read_input, unreadable
from toolpaths.units import MM_PER_INCH

LONGEST = 2000.0
"""mm: no tool is longer"""
_HINT = "name the file that the control writes of its tool table, or one of text with the columns register and length"
_WORD = re.compile(r"(?i)([A-Z])\s*([+-]?(?:\d+\.?\d*|\.\d+))")
_SIEMENS = re.compile(r"(?i)\$TC_DP(3|12|21)\s*\[\s*(\d+)\s*,\s*1\s*\]\s*=\s*([+-]?[\d.]+(?:E[+-]?\d+)?)")
_KLARTEXT = re.compile(r"(?i)^\s*BEGIN\s+\S*\s*\.T\s+(MM|INCH)\b")
_NAMES = ("register", "tool", "t", "h")
TableRow = tuple[int, int, str, float]
"""(line, register, "" or what is added to the length: wear, adapter; mm); a later row goes before an earlier one"""


def read_tool_table(file: str | Path, controller: ControllerFile) -> dict[int, float]:
    """Lengths (mm) by length register, by tool number where tools have no register of their own.

    Raises:
        DiagnosticError: where the file cannot be read, or holds no lengths in a form that is known.
    """
    try:
        text = read_input(file).decode("utf-8", "replace").lstrip("\ufeff")
    except OSError as fault:
        raise DiagnosticError([unreadable(fault, "tool-table.open", file, _HINT)]) from fault
    return lengths_of(text, controller, str(file))


@dataclass(frozen=True)
class MeasuredLength:
    """A tool's length at the machine (mm) next to its gauge length."""

    number: int
    register: int
    gauge: float
    measured: float

    def line(self) -> str:
        """For people."""
        return (f"T{self.number}: gauge length {self.gauge:.4f} mm, register {self.register} of the tool table "
                f"{self.measured:.4f} mm ({self.measured - self.gauge:+.4f})")


def measured_lengths(table: dict[int, float], job: Job, file: str) -> tuple[list[MeasuredLength], list[Diagnostic]]:
    """The lengths of the tools that a CL file calls, in order of their numbers; errors for those that the table lacks."""
    wanted = sorted({(said.number, register) for said, register, _ in tool_loads(job.toolpath)})
    found = [MeasuredLength(number, register, job.length_of(number), table[register])
             for number, register in wanted if register in table]
    lacking = [f"{register} (T{number})" for number, register in wanted if register not in table]
    faults = [error("tool-table.missing", f"no length in register {', '.join(lacking)}, which the program calls", file=file,
                    hint="measure these tools, and write the table once more")] if lacking else []
    apart = sorted({one.number for one in found for other in found
                    if one.number == other.number and one.measured != other.measured})
    if apart:
        faults.append(error("tool-table.apart", f"registers of one tool hold different lengths: T{apart[0]}", file=file,
                            hint="give each length a tool number of its own in the CL file"))
    return found, faults


def with_measured(setup: SetupFile, found: list[MeasuredLength]) -> SetupFile:
    """A set-up with the lengths at the machine as gauge lengths."""
    tools = dict(setup.tools)
    for one in found:
        tools[str(one.number)] = tools.get(str(one.number), ToolSetup()).model_copy(update={"gauge_length": one.measured})
    return setup.model_copy(update={"tools": tools})


def lengths_of(text: str, controller: ControllerFile, file: str) -> dict[int, float]:
    """Of the text of a table; errors as of `read_tool_table`."""
    lines = text.splitlines()
    form = _separated if _is_separated(lines) else _FORMS[controller.writer]
    parts: dict[int, dict[str, float]] = {}
    found: dict[int, float] = {}
    faults: list[Diagnostic] = []
    for line, register, part, length in form(lines, faults, file):
        parts.setdefault(register, {})[part] = length
        found[register] = sum(parts[register].values())
        if not abs(found[register]) <= LONGEST:
            faults.append(error("tool-table.length", f"register {register} holds {found[register]:g} mm, at most "
                                f"{LONGEST:g} are possible", file=file, lines=[line], hint="lengths are mm"))
    if not found and not faults:
        faults.append(error("tool-table.empty", f"no length of a tool as {controller.writer} controls write it", file=file,
                            hint=_HINT))
    require(faults)
    return found


def _linuxcnc(lines: list[str], faults: list[Diagnostic], file: str) -> Iterator[TableRow]:
    for n, line in enumerate(lines, 1):
        words = {letter.upper(): float(value) for letter, value in _WORD.findall(line.split(";")[0])}
        if "T" in words and "Z" in words:
            yield n, int(words["T"]), "", words["Z"]


def _offsets(lines: list[str], faults: list[Diagnostic], file: str) -> Iterator[TableRow]:
    for n, line in enumerate(lines, 1):
        block = re.sub(r"\([^)]*\)", "", line)
        words = {letter.upper(): value for letter, value in _WORD.findall(block)}
        if float(words.get("G", -1)) != 10.0 or float(words.get("L", -1)) not in (10.0, 11.0):
            continue
        if "P" not in words or "R" not in words:
            faults.append(error("tool-table.words", f"{line.strip()[:60]!r} has no P or no R", file=file, lines=[n],
                                hint="G10 L10 P1 R120.0 is the length of register 1"))
        elif "." not in words["R"]:
            faults.append(error("tool-table.point", f"R{words['R']} has no decimal point: it may be mm or increments",
                                file=file, lines=[n], hint=f"write R{words['R']}. for mm"))
        else:
            yield n, int(float(words["P"])), words["L"], float(words["R"])


def _siemens(lines: list[str], faults: list[Diagnostic], file: str) -> Iterator[TableRow]:
    for n, line in enumerate(lines, 1):
        for part, tool, value in _SIEMENS.findall(line.split(";")[0]):
            yield n, int(tool), part, float(value)


def _klartext(lines: list[str], faults: list[Diagnostic], file: str) -> Iterator[TableRow]:
    unit = next((found[1].upper() for line in lines if (found := _KLARTEXT.match(line))), "")
    head = next((n for n, line in enumerate(lines) if {"T", "L"} <= set(line.split())), None)
    if not unit or head is None:
        return
    starts = [(found.group(), found.start()) for found in re.finditer(r"\S+", lines[head])]
    spans = {name: (begin, end) for (name, begin), end in zip(starts, [*(s for _, s in starts[1:]), None], strict=True)}
    for n, line in enumerate(lines[head + 1:], head + 2):
        cells = {name: line[slice(*spans[name])].strip() for name in ("T", "L", "DL") if name in spans}
        if not cells["T"].isdigit():
            continue
        try:
            length = sum(float(cells[name]) for name in ("L", "DL") if cells.get(name))
        except ValueError:
            faults.append(error("tool-table.number", f"L or DL of tool {cells['T']} is no number: {line.strip()[:60]!r}",
                                file=file, lines=[n], hint="values stand below the names of their columns"))
            continue
        yield n, int(cells["T"]), "", length * (MM_PER_INCH if unit == "INCH" else 1.0)


def _is_separated(lines: list[str]) -> bool:
    first = next((line for line in lines if line.strip()), "")
    names = _cells(first)
    return "length" in names and any(name in names for name in _NAMES)


def _cells(line: str) -> list[str]:
    return [cell.strip().lower() for cell in re.split(r"[,;\t]", line)]


def _separated(lines: list[str], faults: list[Diagnostic], file: str) -> Iterator[TableRow]:
    numbered = [(n, line) for n, line in enumerate(lines, 1) if line.strip()]
    names = _cells(numbered[0][1])
    at, length = next(k for k, name in enumerate(names) if name in _NAMES), names.index("length")
    for n, line in numbered[1:]:
        cells = _cells(line)
        try:
            yield n, int(cells[at]), "", float(cells[length])
        except (ValueError, IndexError):
            faults.append(error("tool-table.number", f"no register and length in {line.strip()[:60]!r}", file=file,
                                lines=[n], hint="a row is like 1,120.03: numbers with a decimal point"))


_Form = Callable[[list[str], list[Diagnostic], str], Iterator[TableRow]]
_FORMS: dict[str, _Form] = {"linuxcnc": _linuxcnc, "iso": _linuxcnc, "fanuc": _offsets, "haas": _offsets,
                            "siemens": _siemens, "heidenhain": _klartext}
