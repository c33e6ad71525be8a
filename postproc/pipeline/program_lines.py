"""Blocks of a program that has just been written, at the lines of the CL file that they come from."""

from __future__ import annotations

import numpy as np

from postproc.compile.program import Program
from postproc.control.control import InterpolationMode
from postproc.controllers.model import ControllerFile

_NUMBER = "N0123456789 "
"""characters of block numbers"""


def section_lines(program: Program) -> list[tuple[InterpolationMode, int]]:
    """The law of each section of a program, and the line of the CL file that its first block is written from."""
    first = np.array([s.first for s in program.sections], dtype=np.int64)
    lines = program.line[np.minimum(first, len(program) - 1)] if len(program) else first
    return list(zip((s.law for s in program.sections), lines.tolist(), strict=True))


def cl_lines(line: int, text: str, sections: list[tuple[InterpolationMode, int]],
             controller: ControllerFile) -> tuple[int, ...]:
    """The first line of the CL file that is written in the tilted plane, or tool-centre-point mode, in which a line of the
    program stands: the last section of its law whose codes stand up to there. () where it stands in none."""
    head = text.split("\n", line)[:line]
    last: tuple[int, int] | None = None
    for law, mode in (("tcp", controller.modes.tcp), ("tilted", controller.modes.tilted)):
        word = mode.enter[0].split("{")[0].split(" ")[0] if mode is not None else ""
        at = [n for n, block in enumerate(head) if word and block.lstrip(_NUMBER).startswith(word)]
        own = [first for own_law, first in sections if own_law == law]
        if 0 < len(at) <= len(own) and (last is None or at[-1] > last[0]):
            last = at[-1], own[len(at) - 1]
    return (last[1],) if last is not None and last[1] > 0 else ()
