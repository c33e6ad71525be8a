"""Comment lines in the header of a program: what made it, what the work offset must hold, which tool axes were chosen."""

from __future__ import annotations

from pathlib import Path as FilePath

import numpy as np

from postproc.base.header_words import PENDING, corrected_by_control, corrected_here, feeds_line, model_mark
from postproc.base.version import VERSION
from postproc.compile.program import Program
from postproc.control.control import MODE_NAMES
from postproc.control.modes import table_axes
from postproc.job.job import Job
from postproc.joints.faults import opened
from postproc.pipeline.cutcom_header import cutcom_lines
from postproc.pipeline.pivot_header import pivot_lines
from postproc.pipeline.stage_values import CompiledStage
from postproc.readback.comparison.length_margins import pending_lines
from postproc.setup.criteria import criteria_of
from postproc.setup.model import stated_value


def header_lines(made: CompiledStage) -> list[str]:
    """The header of the program of a conversion that is compiled."""
    job, machine = made.job, made.machine
    said = made.controller.lengths
    header = [f"postproc {VERSION}", f"source {FilePath(made.toolpath.file).name}", f"machine {machine.name}",
              f"controller {made.controller_name}", PENDING, *made.options.header(said),
              f"words: {_meanings(made.program)}", *_work_offsets(job)]
    if made.source is not None and made.source.plug_in is not None:
        header.append(f"CL file as read by {made.source.plug_in.stamped()}")
    header += [f"machine by {machine.kind_code}"] * bool(machine.kind_code)
    header += [f"orientation criterion {one.plug_in.stamped()}" for one in criteria_of(made.setup.orientation.criteria)]
    if made.controller.program.stock and made.setup.rewind.stock is None:
        header.append("stock of the graphics: extents of the cuts ([rewind.stock] states none)")
    header += _measured(job)
    if made.setup.tool_numbers:
        numbers = dict.fromkeys(f"{t.name} = T{t.number}" for t in made.toolpath.tools if t.name)
        header.append("tool numbers of the set-up: " + ", ".join(numbers))
    if any(d.code == "feed.of_setup" for d in made.diagnostics):
        feed = (made.setup.output.feed or 0.0) / said.unit
        header.append(f"feed {feed:.6g} {said.name}/min of the set-up where the CL file states none")
    header += [f"ASSUMED, state it before cutting: {key} = {stated_value(made.setup, key)}" for key in made.setup.assumed]
    if made.motion is not None:
        header.append(feeds_line())
    header += [f"T{number}: {what}, of the set-up" for number, what in job.stated]
    header += [opened(made.path.opened, made.path.split_seconds)] * bool(made.path.opened)
    header += [*_tip_frame(made), *_corrections(made), *_orientations(made), *pivot_lines(job, made.program),
               *_tools(job), *cutcom_lines(job, made.program)]
    if made.toolpath.name:
        header.insert(1, f"part {made.toolpath.name}")
    return header


def _work_offsets(job: Job) -> list[str]:
    """What the register of each place must hold."""
    result, said = [], job.controller.lengths
    for k, place in enumerate(job.places):
        values = zip(job.machine.axis_names, job.control_at(k).work_offset, job.machine.rotary, strict=True)
        offset = " ".join(f"{a}{v:.4f}" if turns else f"{a}{said.plain(v)}" for a, v, turns in values)
        at = f"place {place.name}: " if place.name else ""
        turned = "".join(f" with {letter} at {angle:g}" for letter, angle in place.standing)
        result.append(f"{at}work offset {job.controller.program.offset_name(place.code)} in machine coordinates{turned}: "
                      f"{offset}")
    return result


def _tip_frame(made: CompiledStage) -> list[str]:
    """What is relied on where the frame of the tip's mode is not known for turned tables."""
    mode, control = made.controller.modes.tcp, made.job.control
    if mode is None or mode.frame == "table" or all(s.law != "tcp" for s in made.program.sections):
        return []
    code = made.job.modes.tcp_code
    if made.job.modes.at_zero:
        return [f"{code} is switched on with the tables at zero, right by both readings of its frame"]
    return [f"relies on the frame of {code} being the part's, turned with the table by its scale"] if len(
        table_axes(control)) else []


def _measured(job: Job) -> list[str]:
    """That the program calls no tool, and what the work offset holds of its length."""
    if job.setup.output.tool_call:
        return []
    axis, length = "Z", job.control.measured
    held = f"{axis} of the work offset holds its gauge length {job.controller.lengths.text(length)}" if length else \
        f"its length must be added to {axis} of the work offset"
    return ["no tool call, no length register: for the tool in the spindle, measured into the work offset", held]


def _tools(job: Job) -> list[str]:
    """A line for each tool that moves, in order of use: what must be in the magazine, and how long the set-up has it."""
    index, first = np.unique(job.moves.tool, return_index=True)
    said = job.controller.lengths
    found: dict[int, str] = {}
    for k in index[np.argsort(first, kind="stable")].tolist():
        number, length = job.number_of(k), job.gauge_length(k)
        tool = job.toolpath.tools[k] if k >= 0 else None
        if number < 0 or number in found:
            continue
        called = f"T{number}" if number or job.setup.output.tool_call else "without a number"
        parts = [f"tool {called}{f' {tool.name}' if tool and tool.name else ''}",
                 *([f"diameter {tool.diameter / said.unit:.4g} {said.name}"] if tool and tool.diameter else []),
                 f"gauge length {said.text(length)}" if length else "gauge length not stated"]
        found[number] = ", ".join(parts)
    return [*found.values(), *pending_lines(sorted(found), job)]


def _orientations(made: CompiledStage) -> list[str]:
    """Header lines that say which tool axes were chosen."""
    if made.choice is None:
        return []
    from postproc.orientation.report.text import header
    from postproc.orientation.turning.turning_report import header as turning_header

    turned = turning_header(made.turning) if made.turning is not None else []
    return [*header(made.choice, made.options.orient, bool(turned)), *turned]


def _corrections(made: CompiledStage) -> list[str]:
    """Header lines that say who corrects geometric errors."""
    if made.job.errors is None:
        return []
    name = made.job.errors.name
    if made.compensation is None:
        return [corrected_by_control(name)]
    from machines.geometric_error.files.fingerprint import fingerprint

    return [corrected_here(name),
            "they are corrected for this work offset and these gauge lengths: convert again for others",
            model_mark(fingerprint(made.job.errors)), *made.compensation.lines()]


def _meanings(program: Program) -> str:
    """What the words of a program mean, in order of first use."""
    return ", ".join(dict.fromkeys(MODE_NAMES[section.law] for section in program.sections))
