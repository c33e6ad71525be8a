"""What a summary says of path and program: taken before they are let go, or where they are asked for."""

from __future__ import annotations

from typing import Literal

import numpy as np

from machines.machine import Machine
from postproc.compile.feed import Feeds
from postproc.compile.program import Program
from postproc.job.job import Job
from postproc.path.model import JointPath
from toolpaths.arrays import distinct
from toolpaths.dataclass import dataclass
from toolpaths.rotations import TWO_PI, whole_turns
from toolpaths.toolpath import Toolpath

Keep = Literal["all", "summary"]
"""of what lies between CL file and text: everything, or what a summary says"""


@dataclass(frozen=True)
class Unwound:
    """Of an axis without end stops that counts its turns: s that linking moves of the program unwind it, turns from home at
    which it ends, s that the next start unwinds those."""

    in_program_s: float
    turns_left: int
    next_start_s: float


@dataclass(frozen=True)
class WrittenFigures:
    """Counts of a program and the path it is written from.

    Attributes:
        blocks: of the program; added: those that linearising put between CL points; reduced: those at a lower feed
        rewinds, singular: drawings back that unwind an axis; passages by singular directions and turns on the spot
        worst_tip, worst_axis: bound of the deviation between points, mm and rad
        modes: by operation, the laws ("axes", "tcp", "tilted") that its cutting blocks are written under
        unwound: by letter of the axis
    """

    blocks: int
    added: int
    reduced: int
    rewinds: int
    singular: int
    worst_tip: float
    worst_axis: float
    modes: dict[str, list[str]]
    unwound: dict[str, Unwound]


def written_figures(job: Job, toolpath: Toolpath, path: JointPath, program: Program, feeds: Feeds) -> WrittenFigures:
    """Of a program that is compiled."""
    return WrittenFigures(len(program), points_added(path), int(feeds.slowed.sum()), len(path.rewinds),
                          len(path.turns) + len(path.events), path.worst_tip, path.worst_axis,
                          modes_of(program, toolpath), unwound(path, job))


def points_added(path: JointPath) -> int:
    """Blocks that linearising put between CL points."""
    return int((np.isfinite(path.u) & (path.u < 1.0)).sum())


def modes_of(program: Program, toolpath: Toolpath) -> dict[str, list[str]]:
    """By operation, the laws that its cutting blocks are written under."""
    cut = np.flatnonzero((program.code > 0) & ~program.link)
    section = np.searchsorted([s.first for s in program.sections], cut, side="right") - 1
    keys = distinct(toolpath.operation[program.row[cut]].astype(np.int64) * len(program.sections) + section)
    found: dict[str, list[str]] = {}
    for operation, k in zip(*(part.tolist() for part in divmod(keys, len(program.sections))), strict=True):
        name = toolpath.operations[operation].name or f"OPERATION {operation + 1}"
        laws = found.setdefault(name, [])
        if program.sections[k].law not in laws:
            laws.append(program.sections[k].law)
    return found


def unwound(path: JointPath, job: Job) -> dict[str, Unwound]:
    """What unwinding costs, by letter of each axis without end stops that counts its turns."""
    found, machine = dict[str, Unwound](), job.machine
    for j in np.flatnonzero(machine.endless).tolist() if len(path) else ():
        if j in job.control.rolls:
            continue
        velocity = float(machine.limits.velocity[j])
        step = np.abs(np.diff(path.q[:, j], prepend=machine.home[j])[np.isnan(path.u)])
        seconds = float((step - np.abs(step - whole_turns(step))).sum()) / velocity
        turns = round(float(path.q[-1, j] - machine.home[j]) / TWO_PI)
        found[machine.axis_names[j]] = Unwound(seconds, turns, abs(turns) * TWO_PI / velocity)
    return found


def is_summed_up(job: Job, machine: Machine) -> bool:
    """Whether these figures are all that is said of path and program: nothing of geometric errors, loads of motors,
    rods or drives, places, or planned feeds, which are worked out on them."""
    plain = job.errors is None and job.repeats is None and job.options.feed == "programmed" and not job.options.smooth
    return plain and machine.stiffness is None and machine.dynamics is None and machine.by_drives is None
