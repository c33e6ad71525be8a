"""Clamps of rotary axes: released before the block that turns an axis, closed behind the last one, before the cut.

Which codes they are is the builder's (`[axes.A] clamp`, `unclamp` of the machine file). An axis that stands
through a stretch of cuts is clamped in it, one that turns in it is free through all of it. A control that
turns the axes itself where a plane is stated (G53.1, CYCLE800, PLANE ... TURN) finds them free. Where a
program may be taken up, nobody knows how they stand.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Literal

import numpy as np

from machines.machine import Machine
from postproc.compile.program import Command, Program
from toolpaths.arrays import Bools, runs
from toolpaths.dataclass import dataclass

ClampCommand = Literal["CLAMP", "UNCLAMP"]
CLAMP: ClampCommand = "CLAMP"
UNCLAMP: ClampCommand = "UNCLAMP"
"""commands; their argument is the code"""
FIRST = frozenset({"DWELL", "CUTTER_COMPENSATION_OFF"})
"""commands at the place of a clamp that belong to the block before it"""


@dataclass(frozen=True)
class _Switch:
    """A command at a block: behind the blocks before it and what begins there (`early`), or right before it."""

    block: int
    name: ClampCommand
    early: bool


def with_clamps(program: Program, machine: Machine, plane_turns: bool) -> Program:
    """The program with the clamps of the machine's axes; `plane_turns`: stating a plane may turn rotary axes.

    Axes that share a code are clamped and released together, by all codes of theirs."""
    clamps = machine.clamp_codes
    commands = {k: list(group) for k, group in program.commands.items()}
    cut = cutting(program)
    for group in machine.clamp_groups:
        codes = {CLAMP: dict.fromkeys(clamps[letter].clamp for letter in group),
                 UNCLAMP: dict.fromkeys(clamps[letter].unclamp for letter in group)}
        columns = [program.letters.index(letter) for letter in group]
        for switch in _switches(program, turning(program, columns), cut, plane_turns):
            line = int(program.line[min(switch.block, len(program) - 1)])
            for code in codes[switch.name]:
                _put(commands.setdefault(switch.block, []), Command(switch.name, (code,), line), switch.early)
    return replace(program, commands={k: tuple(group) for k, group in commands.items() if group})


def turning(program: Program, columns: list[int]) -> Bools:
    """(K,) blocks that turn one of the axes, or may: the first word of each, and words of linking blocks that
    state again where it stands, since it may stand elsewhere where a program is taken up there."""
    result = np.asarray(program.write[:, columns].any(axis=1) & program.link)
    for j in columns:
        rows = np.flatnonzero(program.write[:, j])
        words = program.words[rows, j]
        result[rows[np.append(True, words[1:] != words[:-1])[:len(rows)]]] = True
    return result


def cutting(program: Program) -> Bools:
    """(K,) blocks of cuts at feed, holes as a whole."""
    result = np.asarray((program.code > 0) & ~program.link)
    for hole in program.holes:
        result[hole.first:hole.last + 1] = True
    return result


def _switches(program: Program, turns: Bools, cut: Bools, plane_turns: bool) -> Iterator[_Switch]:
    """The switches of one clamp in order."""
    free, held = turns.copy(), list[int]()
    for first, last in runs(cut).tolist():
        if turns[first:last].any():
            free[first:last] = True
        else:
            held.append(first)
    planes = [s.first for s in program.sections if s.law == "tilted" and plane_turns]
    restarts = [k for k, c in program.ordered() if c.name == "OPERATION_START" and len(c.args) > 1]
    events = sorted([*((int(a), 3, int(b)) for a, b in runs(free)), *((k, 2, 0) for k in held),
                     *((k, 1, 0) for k in planes), *((k, 0, 0) for k in restarts), (len(program), 2, 0)])
    state, last = "", 0
    for k, kind, end in events:
        if kind == 0:
            state, last = "", max(last, k)
        elif kind == 1:
            if state != UNCLAMP:
                yield _Switch(k, UNCLAMP, False)
            state, last = UNCLAMP, max(last, k)
        elif kind == 2 and state != CLAMP:
            yield _Switch(min(last, k), CLAMP, True)
            state = CLAMP
        elif kind == 3:
            if state != UNCLAMP:
                yield _Switch(k, UNCLAMP, False)
            state, last = UNCLAMP, end


def _put(group: list[Command], command: Command, early: bool) -> None:
    """A clamp as early as it can stand, behind what enters a plane or begins an operation; a release as late,
    before a plane is stated."""
    names = [c.name for c in group]
    if early:
        after = [i + 1 for i, c in enumerate(group) if c.name in ("ENTER_SECTION", UNCLAMP)
                 or (c.name == "OPERATION_START" and len(c.args) > 1)]
        at = max(after, default=next((i for i, name in enumerate(names) if name not in FIRST), len(group)))
        while at < len(group) and names[at] == CLAMP:
            at += 1
    else:
        at = next((i for i, name in enumerate(names) if name == "ENTER_SECTION"), len(group))
    group.insert(at, command)
