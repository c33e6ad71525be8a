"""By how much the length of a tool at the machine may differ from its gauge length before its program fails.

Where only the table turns, the length register takes a difference up and the tip stays where it is. It does
not where the tool turns and words are machine coordinates, on platforms whose slides the words are, and under
corrections that were made for one length. The program is executed once more with all tools longer by `STEP`:
how far that takes tips, axes and joints of every block is linear in the length where the axis is the same, as it is here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.base.length_text import MM, LengthText
from postproc.control.modes import table_axes
from postproc.job.job import Job
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.readback.comparison.checks import off_line
from postproc.readback.execution.execute import Motion, run
from postproc.readback.execution.offsets import Offsets
from postproc.readback.execution.poses import BlockPoses
from postproc.readback.text.canonical import Canonical
from postproc.reference.moves import Moves
from toolpaths.arrays import Floats, Ints
from toolpaths.rotations import angle_between, lengths
from toolpaths.shapes import arrays

STEP = 0.1
"""mm"""
MUCH = 50.0
"""mm that no length is wrong by"""
LEAST = 1e-6
"""mm or rad per mm: less is arithmetic"""
_SHARES = 0.0, 0.25, 0.5, 0.75, 1.0
"""where blocks are looked at"""


@dataclass(frozen=True)
class LengthMargin:
    """How much shorter and longer than its gauge length (mm, inf: no end was found) a tool may be; what fails first."""

    number: int
    shorter: float
    longer: float
    ends_shorter: str
    ends_longer: str
    bodies: bool = False
    """bodies of the set-up are not looked at"""

    def line(self, said: LengthText = MM) -> str:
        """For the header of the program, in its units, and the summary; margins are rounded down."""
        ends = (f"by {sign}{said.down(mm, 3)} {said.name}, then {what}" if mm < MUCH
                else f"by {sign}{MUCH / said.unit:.3g} {said.name} and more"
                for sign, mm, what in (("-", self.shorter, self.ends_shorter), ("+", self.longer, self.ends_longer)))
        return f"T{self.number}: length may differ {'; '.join(ends)}{'; bodies apart' if self.bodies else ''}"


def length_matters(job: Job) -> bool:
    """True where the length of a tool is in the program: a tool that turns, a platform, errors that are corrected."""
    if not job.setup.output.tool_call:
        return False
    turning = len(job.control.rotary) > len(table_axes(job.control))
    return turning or job.corrects or not job.machine.kinematics.straight_slides


def with_longer_tools(job: Job) -> Job:
    """The job with every tool longer by `STEP`."""
    tools = {number: tool.model_copy(update={"gauge_length": tool.length + STEP})
             for number, tool in job.setup.tools.items()}
    return replace(job, setup=job.setup.model_copy(update={"tools": tools}))


def longer_run(code: Canonical, offsets: Offsets, job: Job) -> tuple[Motion, Job, dict[int, float]] | None:
    """(motion of a program with every tool longer by `STEP`, the job with these tools, lengths by register);
    None where lengths do not matter."""
    if not length_matters(job):
        return None
    more = {register: length + STEP for register, length in offsets.lengths.items()}
    return run(code, job.machine.axis_names, replace(offsets, lengths=more))[0], with_longer_tools(job), more


def length_margins(motion: Motion, executed: BlockPoses, again: Motion, longer: BlockPoses, job: Job, owner: Ints,
                   left: tuple[float, float]) -> tuple[LengthMargin, ...]:
    """Of every tool that moves, in order of their numbers.

    Args:
        again, longer: as `motion` and `executed`, with every tool longer by `STEP`
        owner: (E,) move of the CL file that each block belongs to
        left: mm and rad that the bound of the program leaves of its tolerances
    """
    if len(again) != len(motion):
        return ()
    rates = _Rates.of(motion, executed, again, longer, job, owner, left)
    return tuple(rates.margin(number) for number in np.unique(motion.tool[motion.tool >= 0]).tolist())


@dataclass(frozen=True, eq=False)
@arrays(tool="E", tip="E", axis="E", q="E J", slope="E J", clear="E")
class _Rates:
    """What a longer tool does to E blocks.

    Attributes:
        job, tool: the job; (E,) tool numbers
        tip, axis: (E,) mm and rad per mm that cuts are off more; 0 in other blocks
        q, slope: (E, J) joints at the ends of blocks, and by how much they go on per mm
        clear: (E,) mm of length until a linking move comes too near to the part; infinite in cuts
        left: mm and rad that the bound of the program leaves of its tolerances
    """

    job: Job
    tool: Ints
    tip: Floats
    axis: Floats
    q: Floats
    slope: Floats
    clear: Floats
    left: tuple[float, float]

    @classmethod
    def of(cls, motion: Motion, executed: BlockPoses, again: Motion, longer: BlockPoses, job: Job, owner: Ints,
           left: tuple[float, float]) -> _Rates:
        """The rates of all blocks."""
        rows, moves = np.arange(len(motion)), job.moves.without_pecks()
        link = ~moves.run_by(owner)
        tip, axis, clear = np.zeros(len(rows)), np.zeros(len(rows)), np.full(len(rows), np.inf)
        near = job.options.tolerance + executed.corrected_between(motion, np.flatnonzero(link))
        for t in _SHARES:
            (here, along), (there, turned) = executed.poses(motion, rows, t), longer.poses(again, rows, t)
            moved = np.nan_to_num(lengths(there - here) / STEP)
            tip = np.maximum(tip, np.where(link, 0.0, moved))
            axis = np.maximum(axis, np.where(link, 0.0, np.nan_to_num(angle_between(turned, along) / STEP)))
            room = _room(job, moves, owner, np.flatnonzero(link), here, along, near)
            clear = np.minimum(clear, np.where(moved > LEAST, room / np.maximum(moved, LEAST), np.inf))
        q = executed.joints(motion, rows, 1.0)
        return cls(job, np.asarray(motion.tool), tip, axis, q, (longer.joints(again, rows, 1.0) - q) / STEP, clear,
                   left)

    def margin(self, number: int) -> LengthMargin:
        """Of one tool."""
        k = np.flatnonzero(self.tool == number)
        limits, names = self.job.machine.limits, self.job.machine.axis_names
        both = [(_least(self.left[0], self.tip[k]), "tolerance"), (_least(self.left[1], self.axis[k]), "axis tolerance"),
                (float(self.clear[k].min()), "clearance")]
        found = []
        for sign in (-1.0, 1.0):
            slope = sign * self.slope[k]
            ends = [(min(_least(limits.upper[j] + TRAVEL_SLACK - self.q[k, j], slope[:, j]),
                         _least(self.q[k, j] - limits.lower[j] + TRAVEL_SLACK, -slope[:, j])), f"travel {names[j]}")
                    for j in range(len(names))]
            found.append(min([*both, *ends], key=lambda one: one[0]))
        (shorter, why), (longer, so) = found
        whole = self.job.length_of(number)
        if shorter >= whole > 0.0:
            shorter, why = whole, "length 0"
        return LengthMargin(number, shorter, longer, why, so, self.job.setup.bodies is not None)


def _room(job: Job, moves: Moves, owner: Ints, k: Ints, tip: Floats, axis: Floats, near: Floats) -> Floats:
    """(E,) mm that tips of linking moves k (K,) may go: clear of what is cut, or within `near` (K,) on the
    line of an approach or a retract, whichever is more (as `check_links` has it); infinite in cuts."""
    clear = job.space.room(tip[k], axis[k]) + job.options.tolerance
    to, before = (np.clip(owner[k] + behind, 0, len(moves) - 1) for behind in (0, -1))
    on = [np.where(there, near - off_line(tip[k], moves.tip[at], moves.axis[at]), 0.0)
          for at, there in ((to, owner[k] < len(moves)), (before, owner[k] > 0))]
    result = np.full(len(owner), np.inf)
    result[k] = np.maximum(np.maximum.reduce([clear, *on]), 0.0)
    return result


def _least(room: Floats | float, rate: Floats) -> float:
    """mm of length that fit: the least of room over rate where there is a rate; inf for none."""
    goes = rate > LEAST
    if not goes.any():
        return np.inf
    return max(float((np.broadcast_to(room, rate.shape)[goes] / rate[goes]).min()), 0.0)
