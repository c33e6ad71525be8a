"""The records of a CL file as this job takes them: numbers, CUTCOM, spindle, coolant and registers of machine and set-up."""

from __future__ import annotations

import sys

from machines.machine import Machine
from postproc.controllers.model import ControllerFile
from postproc.job.axis_letters import axis_letters
from postproc.reference.cutcom_of_tools import CutcomOfTool, tools_under_cutcom, with_compensation
from postproc.reference.length_registers import by_rule, own_registers
from postproc.reference.records import checked_records, plain_records
from postproc.reference.spindle_defaults import Stated, standing_cuts, stated_by_setup, too_fast, with_defaults
from postproc.reference.tool_numbers import numbered
from postproc.setup.model import SetupFile, assumed_values, other_machine
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, Severity
from toolpaths.toolpath import Toolpath


@dataclass(frozen=True)
class JobRecords:
    """The path with plain records, what the set-up states where the CL file states nothing, the tools of the CL file
    that cut under CUTCOM."""

    toolpath: Toolpath
    stated: Stated
    cutcom: tuple[CutcomOfTool, ...]


def job_records(toolpath: Toolpath, machine: Machine, controller: ControllerFile, setup: SetupFile,
                file: str) -> tuple[JobRecords, list[Diagnostic]]:
    """The records of a job, and what cannot be carried out; `file` is the set-up's."""
    toolpath, diagnostics = numbered(toolpath, setup, file)
    diagnostics += [*other_machine(setup, machine.name, file), *assumed_values(setup, file),
                    *axis_letters(machine, controller)]
    cutcom = tools_under_cutcom(toolpath, setup)
    toolpath, found = with_compensation(toolpath, setup)
    diagnostics += found
    toolpath, found = plain_records(toolpath, controller)
    diagnostics += found
    toolpath, stated = with_defaults(toolpath, setup)
    diagnostics += stated_by_setup(toolpath, stated)
    toolpath, found = checked_records(toolpath, controller)
    diagnostics += found
    if not any(d.severity is Severity.ERROR and d.code.split(".")[0] in ("spindle", "insert") for d in diagnostics):
        diagnostics += [*standing_cuts(toolpath), *too_fast(toolpath, machine.largest_spindle_speed)]
    toolpath = by_rule(toolpath, controller, machine.length_register, machine.radius_register)
    toolpath, found = own_registers(toolpath, controller)
    return JobRecords(toolpath, stated, cutcom), _of_milling(toolpath, [*diagnostics, *found])


def _of_milling(toolpath: Toolpath, found: list[Diagnostic]) -> list[Diagnostic]:
    """Without errors of turning operations: that they are turning is said once, elsewhere."""
    begins = [op.line for op in toolpath.operations] + [sys.maxsize]
    ranges = [range(op.line, begins[k + 1]) for k, op in enumerate(toolpath.operations) if op.turning]
    return [d for d in found if d.severity is not Severity.ERROR or not d.lines
            or not all(any(line in one for one in ranges) for line in d.lines)] if ranges else found
