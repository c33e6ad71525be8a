"""What the radius registers of a program must hold, tool by tool, for its header."""

from __future__ import annotations

from postproc.compile.program import Program
from postproc.job.job import Job
from postproc.reference.cutcom_of_tools import CutcomOfTool, radius_of
from postproc.setup.model import ToolSetup


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
    own = radius_of(tool.number, job.setup.tools.get(str(tool.number), ToolSetup()), job.toolpath)
    radius = job.controller.lengths.text(own) if own else ""
    if tool.kind == "radius":
        back = ", offset back from the path of the tool's centre" if tool.radius else ""
        return (f"{name}: CUTCOM by the radius, {held} holds {radius or 'the radius of the tool'}, the words are the "
                f"contour{back}")
    return (f"{name}: CUTCOM by the wear, {held} holds by how much the radius is greater than "
            f"{radius or 'that of the CAM system'}, the words are the path of the tool's centre")


def _registers(program: Program) -> dict[int, list[int]]:
    """Registers that commands of compensation name, by tool."""
    number, result = 0, dict[int, list[int]]()
    for _, command in program.ordered():
        if command.name == "CHANGE_TOOL":
            number = int(float(command.args[0]))
        elif command.name.startswith("CUTTER_COMPENSATION") and command.args:
            result.setdefault(number, []).append(int(float(command.args[0])))
    return result
