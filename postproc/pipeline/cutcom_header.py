"""What the radius registers of a program must hold, tool by tool, for its header."""

from __future__ import annotations

from postproc.compile.program import Program
from postproc.job.job import Job
from postproc.reference.cutcom_of_tools import CutcomOfTool


def cutcom_lines(job: Job, program: Program) -> list[str]:
    """A line for each tool that cuts under CUTCOM."""
    registers = _registers(program)
    return [_line(job, tool, registers.get(tool.number, [])) for tool in job.cutcom]


def _line(job: Job, tool: CutcomOfTool, registers: list[int]) -> str:
    name = f"T{tool.number}" if tool.number else "the tool"
    if tool.kind == "none":
        return f"{name}: CUTCOM is not written, the words are the path of the tool's centre"
    text = job.controller.cutter_compensation.holds
    held = " and ".join(dict.fromkeys(text.format(register=r) for r in registers or [tool.number]))
    radius = _radius(job, tool.number)
    if tool.kind == "radius":
        return f"{name}: CUTCOM by the radius, {held} holds {radius or 'the radius of the tool'}, the words are the contour"
    return (f"{name}: CUTCOM by the wear, {held} holds by how much the radius is greater than "
            f"{radius or 'that of the CAM system'}, the words are the path of the tool's centre")


def _radius(job: Job, number: int) -> str:
    """Half the diameter of set-up or CL file, "" where neither states one."""
    own = job.setup.tools.get(str(number))
    stated = [tool.diameter for tool in job.toolpath.tools if tool.number == number and tool.diameter]
    diameter = (own.diameter if own else None) or next(iter(stated), None)
    return f"{job.controller.lengths.text(0.5 * diameter)}" if diameter else ""


def _registers(program: Program) -> dict[int, list[int]]:
    """Registers that commands of compensation name, by tool."""
    number, result = 0, dict[int, list[int]]()
    for _, command in program.ordered():
        if command.name == "CHANGE_TOOL":
            number = int(float(command.args[0]))
        elif command.name.startswith("CUTTER_COMPENSATION") and command.args:
            result.setdefault(number, []).append(int(float(command.args[0])))
    return result
