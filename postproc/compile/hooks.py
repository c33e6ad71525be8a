"""Blocks of the shop round tool calls, indexing moves, operations and stops (`[hooks]` of machine file and set-up)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from machines.hooks import HooksModel
from machines.kinematics.chain import ROTARY
from postproc.compile.clamps import CLAMP, FIRST, UNCLAMP, cutting, turning
from postproc.compile.program import Command, CommandName, Program
from toolpaths.arrays import Ints, runs

HOOK: CommandName = "HOOK"
"""command; its arguments are the block, and the tool's number, its name and the operation that it may name"""
STOPS = frozenset({"PROGRAM_STOP", "OPTIONAL_PROGRAM_STOP"})


@dataclass
class _Walk:
    """What holds while the commands are gone through."""

    hooks: HooksModel
    names: Mapping[int, str]
    coming: Mapping[int, float]
    """the tool that an operation cuts with, by its number among all, where it loads one before its first cut"""
    begun: int = 0
    tool: float = -1.0
    operation: str = ""
    out: list[Command] = field(default_factory=list)

    def put(self, place: str, line: int) -> None:
        """The blocks of a place."""
        name = self.names.get(int(self.tool), "")
        self.out += [Command(HOOK, (block, self.tool, name, self.operation), line)
                     for block in self.hooks.places.get(place, ())]

    def one(self, command: Command) -> None:
        """A command with the blocks round it."""
        line = command.line
        if command.name == "CHANGE_TOOL":
            self.tool = float(command.args[0])
            self.put("before_tool", line)
        elif command.name == "OPERATION_START":
            if self.operation:
                self.put("after_operation", line)
            self.operation = str(command.args[0])
        elif command.name in STOPS:
            self.put("before_stop", line)
        self.out.append(command)
        if command.name == "CHANGE_TOOL":
            self.put("after_tool", line)
        elif command.name == "OPERATION_START":
            loaded, self.tool = self.tool, self.coming.get(self.begun, self.tool)
            self.put("before_operation", line)
            self.tool, self.begun = loaded, self.begun + 1
        elif command.name in STOPS:
            self.put("after_stop", line)


def with_hooks(program: Program, hooks: HooksModel, names: Mapping[int, str]) -> Program:
    """The program with the blocks of the shop; `names`: of tools by number."""
    if not hooks.places:
        return program
    begins, ends = indexing_moves(program) if hooks.before_index or hooks.after_index else ({}, {})
    walk, result = _Walk(hooks, names, _coming(program)), dict[int, tuple[Command, ...]]()
    for block in sorted({*program.commands, *begins, *ends, len(program)}):
        walk.out, group = [], program.commands.get(block, ())
        closed, opened = _places(group, block in ends, block in begins)
        for k, command in enumerate((*group, None)):
            if k == closed:
                walk.put("after_index", ends[block])
            if k == opened:
                walk.put("before_index", begins[block])
            if command is not None:
                walk.one(command)
        if block == len(program) and walk.operation:
            walk.put("after_operation", 0)
        if walk.out:
            result[block] = tuple(walk.out)
    return replace(program, commands=result)


def _coming(program: Program) -> dict[int, float]:
    """The tools that operations load before their first cut, by number of the operation."""
    cuts, result, begun, first = runs(cutting(program))[:, 0], dict[int, float](), -1, 0
    for block, command in program.ordered():
        if command.name == "OPERATION_START":
            begun, first = begun + 1, int(np.append(cuts, len(program))[np.searchsorted(cuts, block)])
        elif command.name == "CHANGE_TOOL" and block <= first and begun >= 0:
            result.setdefault(begun, float(command.args[0]))
    return result


def indexing_moves(program: Program) -> tuple[dict[int, int], dict[int, int]]:
    """CL lines by the first block that may turn a rotary axis between two cuts, and by the block behind the last one.

    A tilted plane belongs to the indexing that it follows."""
    rotary = [j for j, letter in enumerate(program.letters) if letter in ROTARY and letter in program.turning]
    cut = cutting(program)
    turns = np.flatnonzero(turning(program, rotary) & ~cut) if rotary else np.zeros(0, dtype=np.int64)
    if not len(turns):
        return {}, {}
    cuts = runs(cut)[:, 0]
    after = np.searchsorted(cuts, turns)
    first = turns[np.append(True, after[1:] != after[:-1])]
    last = turns[np.append(after[1:] != after[:-1], True)]
    stops: Ints = np.append(cuts, len(program))[np.unique(after)]
    planes = [s.first for s in program.sections if s.law == "tilted"]
    end = [max([k + 1, *(p for p in planes if k < p <= stop)])
           for k, stop in zip(last.tolist(), stops.tolist(), strict=True)]
    lines = program.line.tolist()
    return ({k: lines[k] for k in first.tolist()}, {k: lines[min(k, len(lines) - 1)] for k in end})


def _places(group: tuple[Command, ...], ends: bool, begins: bool) -> tuple[int, int]:
    """Numbers of the commands of a block before which blocks behind and before an indexing move stand; -1 for none."""
    names = [c.name for c in group]
    after = max((i + 1 for i, name in enumerate(names) if name in (CLAMP, "ENTER_SECTION")),
                default=next((i for i, name in enumerate(names) if name not in FIRST), len(names)))
    before = next((i for i, name in enumerate(names) if name == UNCLAMP), len(names))
    if begins and ends:
        before = max(before, after)
    return (after if ends else -1), (before if begins else -1)
