"""Where the meaning of the words changes: sections of the program, and the commands that enter and leave them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise, takewhile

import numpy as np

from postproc.compile.program import Command, Commands, Section
from postproc.compile.word_rows import block_tools, unrounded_words
from postproc.job.job import Job
from postproc.path.model import JointPath
from postproc.reference.moves import Moves
from toolpaths.arrays import Ints

_BELONG_BEFORE = frozenset({"CUTTER_COMPENSATION_OFF", "DWELL"})
"""commands that stand before a mode is left"""


BELOW_HOME = 1.0
"""mm"""


def sections_of(job: Job, moves: Moves, path: JointPath, new: Ints) -> tuple[Section, ...]:
    """The sections of a path along `moves`, `new` (K + 1,) giving the number of each block among those that are written."""
    first = np.concatenate([[0], np.flatnonzero(np.diff(path.frame)) + 1])
    at = new[first]
    kept = np.flatnonzero(np.append(at[1:], new[-1]) > at)
    result: list[Section] = []
    for k in kept.tolist():
        frame = path.frames[int(path.frame[first[k]])]
        control, last = frame.control, result[-1] if result else None
        if last is None or (last.plane, last.law, last.place) != (control.plane, control.law, control.place):
            result.append(Section(int(at[k]), control.law, control.plane, frame.angles, frame.rotary, control.place))
        if control.law == "tilted" and "Z" in control.machine.axis_names:
            end = int(first[k + 1]) - 1 if k + 1 < len(first) else len(path) - 1
            result[-1] = replace(result[-1], out=_out(job, moves, path, end))
            if last is not None and last.law == "axes":
                result[-1] = replace(result[-1], into=_out(job, moves, path, int(first[k]) - 1))
    return tuple(result)


def _out(job: Job, moves: Moves, path: JointPath, end: int) -> float:
    """`Section.out` of a section that ends with block `end`."""
    machine, letters = job.control.machine, job.control.machine.axis_names
    axis = machine.retract_axis
    if axis < 0 or end + 1 >= len(path) or not path.home[end + 1] or not path.state[end + 1, axis]:
        return float("nan")
    up = np.stack([path.q[end], path.q[end]])
    up[1, axis] = machine.home[axis] - BELOW_HOME * np.sign(machine.home[axis] - path.q[end, axis])
    tool, z = block_tools(path, moves), letters.index("Z")
    below, above = unrounded_words(path, up, np.array([end, end]), tool, job.kinematics, job.offset_length)
    travel = np.abs(above - below)
    travel[z] -= abs(up[1, axis] - up[0, axis])
    if not above[z] > below[z] or np.abs(travel).max() > float(job.grid.grain.min()):
        return float("nan")
    return float(above[z]) + job.offset_length(int(tool[end]))


def with_sections(commands: Commands, sections: tuple[Section, ...], line: Ints) -> Commands:
    """The commands with those that leave one section and enter the next; `line` (K,): of the CL file, of each block.

    Cutter compensation ends inside its section, the last records of a place stand before the next place is called; all
    else at the same block comes after the change.
    """
    result = dict(commands)
    for k, (old, section) in enumerate(pairwise(sections), 1):
        here, other = result.get(section.first, ()), section.place != old.place
        before = tuple(c for c in here if c.name in _BELONG_BEFORE and old.law != "axes")
        rest = tuple(c for c in here if c not in before)
        ended = _ended(rest, section.place, int(line[section.first])) if other else ()
        change = (*((Command("LEAVE_SECTION", (float(k - 1),)),) if old.law != "axes" else ()), *ended,
                  *((Command("SET_ORIGIN_OFFSETS", (float(section.place),)),) if other else ()),
                  *((Command("ENTER_SECTION", (float(k),)),) if section.law != "axes" else ()))
        result[section.first] = (*before, *change, *rest[len(ended):])
    return result


def _ended(here: tuple[Command, ...], place: int, line: int) -> tuple[Command, ...]:
    """The last records of the place before, among the commands `here` at the first block of a place, with its `line`.

    Their lines are behind that; where the first place comes again (with the next tool) they are before the tool change.
    """
    change = next((c.line for c in here if c.name == "CHANGE_TOOL"), 0) if place == 0 else 0
    return tuple(takewhile(lambda c: c.line > line or c.line < change, here))
