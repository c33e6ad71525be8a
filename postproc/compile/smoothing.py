"""Where the control's own smoothing changes: at the first block of each operation that has another."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from postproc.compile.program import Command, Program
from postproc.job.smoothing import SmoothingPlan
from toolpaths.arrays import Bools
from toolpaths.toolpath import Toolpath


def with_smoothing(program: Program, plan: SmoothingPlan, toolpath: Toolpath) -> Program:
    """The program with a command at each operation whose smoothing is another than that of the one before.

    It stands before the first cut: where a mode has been left, if that is so before it, and before one is entered.
    """
    if not plan.named or not len(program):
        return program
    operation = toolpath.operation[program.row]
    begins = np.concatenate([[0], np.flatnonzero(np.diff(operation)) + 1]).tolist()
    commands, before, law = dict(program.commands), plan.default, _laws(program)
    for first, last in pairwise([*begins, len(program)]):
        wanted = plan.used[int(operation[first])]
        if wanted != before:
            k = _place(program, law, first, last)
            group, named = list(commands.get(k, ())), toolpath.operations[int(operation[first])]
            at = next((n for n, c in enumerate(group) if c.name == "ENTER_SECTION"), len(group))
            group.insert(at, Command("SMOOTHING", (named.name,), named.line))
            commands[k] = tuple(group)
        before = wanted
    return replace(program, commands=commands)


def _laws(program: Program) -> Bools:
    """(K,) blocks that stand in a mode of the tip or of a plane."""
    firsts = np.array([section.first for section in program.sections])
    own = np.array([section.law != "axes" for section in program.sections])
    return np.asarray(own[np.searchsorted(firsts, np.arange(len(program)), side="right") - 1])


def _place(program: Program, own: Bools, first: int, last: int) -> int:
    """The block of an operation first..last before which its smoothing is set."""
    cut = next((k for k in range(first, last) if program.code[k] > 0), last - 1)
    for k in range(first, cut + 1):
        if k == 0 or not own[k - 1] or any(c.name == "LEAVE_SECTION" for c in program.commands.get(k, ())):
            return k
    return first
