"""Faults of a program that has just been written, at the lines of the CL file that its blocks come from."""

from __future__ import annotations

import re
from dataclasses import replace

from postproc.compile.program import Program, Section
from postproc.controllers.model import ControllerFile
from toolpaths.diagnostics import Diagnostic

_LINE = re.compile(r"\(line (\d+) of the program\)")

_NUMBER = re.compile(r"^N?\d+ ?(?=\D)")
"""of a block, before its words"""


def with_cl_lines(found: list[Diagnostic], text: str, program: Program, controller: ControllerFile) -> list[Diagnostic]:
    """Diagnostics that name a line of the program alone, with the first line of the CL file that is written in the same
    tilted plane or tool-centre-point mode."""
    return [replace(d, lines=_lines(int(at[1]), text, program, controller))
            if not d.lines and (at := _LINE.search(d.message)) else d for d in found]


def _lines(line: int, text: str, program: Program, controller: ControllerFile) -> tuple[int, ...]:
    """The section that a line of the program stands in is the last one of its law whose codes stand up to there."""
    head = text.split("\n", line)[:line]
    last: tuple[int, Section] | None = None
    for law, mode in (("tcp", controller.modes.tcp), ("tilted", controller.modes.tilted)):
        word = mode.enter[0].split("{")[0].split(" ")[0] if mode is not None else ""
        at = [n for n, block in enumerate(head) if word and _NUMBER.sub("", block).startswith(word)]
        own = [s for s in program.sections if s.law == law]
        if 0 < len(at) <= len(own) and (last is None or at[-1] > last[0]):
            last = at[-1], own[len(at) - 1]
    if last is None:
        return ()
    cl = int(program.line[min(last[1].first, len(program) - 1)])
    return (cl,) if cl > 0 else ()
