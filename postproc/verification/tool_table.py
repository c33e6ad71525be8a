"""Lengths of tools at the machine, as the control's own table has them, next to gauge lengths: `verify --tool-table`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.job.job import Job
from postproc.readback.comparison.length_margins import MUCH, LengthMargin
from postproc.reference.events import tool_loads
from postproc.setup.model import SetupFile, ToolSetup
from postproc.verification.tool_table_file import ToolTable, no_length, read_tool_table
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, has_errors, warning
from toolpaths.units import MM_PER_INCH

FAR = 10.0
"""mm by which a tool is hardly ever off its gauge length"""


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

    @property
    def most(self) -> float:
        """mm that the program takes in the direction in which the tool is off."""
        return 0.0 if self.allowed is None else self.allowed.longer if self.off > 0.0 else self.allowed.shorter

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


def outside(measured: tuple[MeasuredLength, ...], file: str) -> list[Diagnostic]:
    """The error of tools of a program that is not proved with them, whose lengths are beyond what it takes."""
    bad = [one for one in measured if one.beyond]
    if not bad:
        return []
    said = "; ".join(f"T{one.number} is {abs(one.off):.4f} mm {'longer' if one.off > 0.0 else 'shorter'} than its gauge "
                     f"length, {one.most:.4f} mm are allowed, then {one.beyond} fails" for one in bad)
    return [error("tool-table.outside", f"lengths at the machine are outside what the program allows: {said}", file=file,
                  count=len(bad), hint="write the lengths of the table as gauge_length into [tools.N] of the set-up, and "
                  "convert again, or set the tools to their gauge lengths")]


def lengths_at_machine(file: str | Path, job: Job) -> tuple[list[MeasuredLength], list[Diagnostic]]:
    """What the table of the control says of the tools of a program: their lengths, which the program is then verified with;
    none where its words hold the lengths already, so that those of the table must be 0.

    Raises:
        DiagnosticError: as of `read_tool_table`.
    """
    doubled = job.controller.keeps_length and not job.control.length_on_z
    table = read_tool_table(file, job.controller, zeros=doubled)
    return ([], doubled_lengths(table, job, str(file))) if doubled else measured_lengths(table, job, str(file))


def measured_lengths(table: ToolTable, job: Job, file: str) -> tuple[list[MeasuredLength], list[Diagnostic]]:
    """The lengths of the tools that a CL file calls, in order of their numbers; errors for those that the table lacks."""
    rows = _called_rows(table, job)
    found = [MeasuredLength(number, register, job.length_of(number), table.lengths[n])
             for (number, register), at in rows.items() for n in at if n in table.lengths]
    unmeasured = {n: table.unusable[n] for at in rows.values() for n in at if n in table.unusable}
    faults = [no_length(unmeasured, ", and the program calls it", file)] if unmeasured else []
    faults += [*_lacking(table, job, rows, file), *_aside(table, job, rows, file)]
    apart = sorted({one.number for one in found for other in found
                    if one.number == other.number and one.measured != other.measured})
    if apart:
        sisters = any(len(at) > 1 for (number, _), at in rows.items() if number == apart[0])
        who = "tools of one name" if sisters else "registers of one tool"
        faults.append(error("tool-table.apart", f"{who} hold different lengths: T{apart[0]}", file=file,
                            hint="leave those that do not stand in the spindle out of the table" if sisters
                            else "give each length a tool number of its own in the CL file"))
    return found, faults if has_errors(faults) else _questionable(found, job, file)


def doubled_lengths(table: ToolTable, job: Job, file: str) -> list[Diagnostic]:
    """Errors for tools whose lengths the control would add to words that hold them already: in its table they are 0."""
    rows, mm = _called_rows(table, job), {**table.unusable, **table.lengths}
    wrong = [f"T{number}: {mm[n]:g} mm" for (number, _), at in rows.items() for n in at if mm.get(n, 0.0) != 0.0]
    return _lacking(table, job, rows, file) + _aside(table, job, rows, file) + ([error(
        "tool.length_twice", "the words of the program hold the lengths of the tools already, and this controller adds "
        f"those of its tool table with every tool change: {', '.join(dict.fromkeys(wrong))}", file=file, count=len(wrong),
        hint="L and DL of these tools must be 0 in the control's tool table")] if wrong else [])


def _called_rows(table: ToolTable, job: Job) -> dict[tuple[int, int], list[int]]:
    """Numbers of the table's rows by tool number and length register that a CL file calls."""
    wanted = sorted({(said.number, register) for said, register, _ in tool_loads(job.toolpath)})
    return {one: _rows(table, job, *one) for one in wanted}


def _name(job: Job, number: int) -> str:
    """What the program calls a tool, capitals; "" for its number."""
    return job.controller.tools.names.get(number, "").upper()


def _rows(table: ToolTable, job: Job, number: int, register: int) -> list[int]:
    """Numbers of the table's rows that are a tool's: several where tools of one name stand in for each other."""
    name = _name(job, number) or (str(number) if table.named else "")
    if name and table.names:
        return [n for n, called in table.names.items() if called == name]
    return [number if table.by == "tool" else register]


def _called(table: ToolTable, job: Job, number: int, register: int) -> str:
    """What the control looks for in its table, for people."""
    name = _name(job, number) if table.names else ""
    if name or table.named:
        return f'tool "{name or number}" (T{number})'
    return f"tool {number}" if table.by == "tool" else f"register {register} (T{number})"


def _lacking(table: ToolTable, job: Job, rows: dict[tuple[int, int], list[int]], file: str) -> list[Diagnostic]:
    """The error of tools without a row."""
    without = [one for one, at in rows.items() if not any(n in table.lengths or n in table.unusable for n in at)]
    if not without:
        return []
    said = ", ".join(dict.fromkeys(_called(table, job, *one) for one in without))
    names = ", ".join(f'"{name}"' for name in list(table.names.values())[:6])
    return [error("tool-table.missing", f"no length of {said}, which the program calls", file=file,
                  hint=f"tools of the table are called {names}: write the name as `called` into [tools.N]"
                  if table.named else "measure these tools, and write the table once more")]


def _aside(table: ToolTable, job: Job, rows: dict[tuple[int, int], list[int]], file: str) -> list[Diagnostic]:
    """The error of tools that the control would set off along other axes than their length."""
    said = [f"{_called(table, job, *one)}: {table.aside[n]}" for one, at in rows.items() for n in at if n in table.aside]
    return [error("tool-table.aside", "the control adds more than a length with a tool, and the program is made for none of "
                  f"it: {'; '.join(dict.fromkeys(said))}", file=file, count=len(said),
                  hint="set these offsets to 0 in the tool table: a rotating tool has a length alone")] if said else []


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


