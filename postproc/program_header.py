"""Comment lines at the head of a program: what made it, what the work offset must hold, which tool axes were chosen."""

from __future__ import annotations

from pathlib import Path as FilePath
from typing import TYPE_CHECKING

from postproc import VERSION
from postproc.program import Program

if TYPE_CHECKING:
    from postproc.pipeline import PostResult

FINGERPRINT = "fingerprint of the geometric errors"
"""before the eight hex digits of the error model that a program was written with"""


def header_lines(result: PostResult) -> list[str]:
    """The head of the program of a conversion that is compiled."""
    assert result.program is not None and result.toolpath is not None and result.job is not None
    job, machine = result.job, result.machine
    letters = zip(machine.axis_names, job.control.work_offset, strict=True)
    offset = " ".join(f"{k}{v:.4f}" for k, v in letters)
    header = [f"postproc {VERSION}", f"source {FilePath(result.toolpath.file).name}", f"machine {machine.name}",
              f"controller {result.controller_name}", *result.options.header(),
              f"words: {_meanings(result.program)}",
              f"work offset {result.controller.program.offset_name(result.setup.work_offset_code)} in machine coordinates: "
              f"{offset}"]
    if result.setup.tool_numbers:
        numbers = dict.fromkeys(f"{t.name} = T{t.number}" for t in result.toolpath.tools if t.name)
        header.append("tool numbers of the set-up: " + ", ".join(numbers))
    if any(d.code == "feed.of_setup" for d in result.diagnostics):
        header.append(f"feed {result.setup.output.feed:g} mm/min of the set-up where the CL file states none")
    header += _corrections(result) + _orientations(result)
    if result.toolpath.name:
        header.insert(1, f"part {result.toolpath.name}")
    return header


def _orientations(result: PostResult) -> list[str]:
    """Header lines that say which tool axes were chosen."""
    if result.choice is None:
        return []
    from postproc.orientation.text import header

    return header(result.choice, result.options.orient)


def _corrections(result: PostResult) -> list[str]:
    """Header lines that say who corrects geometric errors."""
    if result.job is None or result.job.errors is None:
        return []
    name = result.job.errors.name
    if result.compensation is None:
        return [f"geometric errors {name}: corrected by the control, not in this program"]
    from machines.geometric_error.fingerprint import fingerprint

    return [f"geometric errors {name}: corrected in this program; the control must not correct them again",
            f"{FINGERPRINT} {fingerprint(result.job.errors)}", *result.compensation.lines()]


def _meanings(program: Program) -> str:
    """What the words of a program mean, in order of first use."""
    names = {"axes": "axis positions", "tcp": "tip in the work offset", "tilted": "tip in tilted planes"}
    return ", ".join(dict.fromkeys(names[section.law] for section in program.sections))
