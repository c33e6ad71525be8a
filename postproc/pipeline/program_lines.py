"""Blocks of a program that has just been written, at the lines of the CL file that they come from."""

from __future__ import annotations

from postproc.compile.program import Program, Section
from postproc.controllers.model import ControllerFile

_NUMBER = "N0123456789 "
"""characters of block numbers"""


def cl_lines(line: int, text: str, program: Program, controller: ControllerFile) -> tuple[int, ...]:
    """The first line of the CL file that is written in the tilted plane, or tool-centre-point mode, in which a line of the
    program stands: the last section of its law whose codes stand up to there. () where it stands in none."""
    head = text.split("\n", line)[:line]
    last: tuple[int, Section] | None = None
    for law, mode in (("tcp", controller.modes.tcp), ("tilted", controller.modes.tilted)):
        word = mode.enter[0].split("{")[0].split(" ")[0] if mode is not None else ""
        at = [n for n, block in enumerate(head) if word and block.lstrip(_NUMBER).startswith(word)]
        own = [s for s in program.sections if s.law == law]
        if 0 < len(at) <= len(own) and (last is None or at[-1] > last[0]):
            last = at[-1], own[len(at) - 1]
    if last is None:
        return ()
    line = int(program.line[min(last[1].first, len(program) - 1)])
    return (line,) if line > 0 else ()
