"""By how much the length of a tool at the machine may differ from its gauge length before its program fails."""

from __future__ import annotations

from postproc.base.header_words import LENGTHS_PENDING
from postproc.base.length_text import MM, LengthText
from postproc.control.modes import table_axes
from postproc.job.job import Job
from toolpaths.dataclass import dataclass

MUCH = 50.0
"""mm that no length is wrong by: margins are not looked for beyond"""


ELSEWHERE = "lengths: not said here"
"""in the header of a program whose blocks are too short for it"""


@dataclass(frozen=True)
class LengthMargin:
    """How much shorter and longer than its gauge length (mm, inf: more than `MUCH`) a tool may be; what fails first."""

    number: int
    shorter: float
    longer: float
    ends_shorter: str
    ends_longer: str
    bodies: bool = False
    """bodies of the set-up are not looked at"""

    def line(self, said: LengthText = MM) -> str:
        """For the header of the program, in its units, and the summary; margins are rounded down."""
        ends = (end_text(sign, mm, what, said)
                for sign, mm, what in (("-", self.shorter, self.ends_shorter), ("+", self.longer, self.ends_longer)))
        return f"T{self.number}: length may differ by {'; by '.join(ends)}{'; bodies apart' if self.bodies else ''}"


def end_text(sign: str, mm: float, what: str, said: LengthText) -> str:
    """One end of a margin: "-0.012 mm, then tolerance"."""
    if mm < MUCH:
        return f"{sign}{said.down(mm, 3)} {said.name}, then {what}"
    return f"{sign}{MUCH / said.unit:.3g} {said.name} and more"


def taken_up_line(margins: tuple[LengthMargin, ...], said: LengthText = MM) -> str:
    """Where registers take differences up: the tool with the least room in either direction, of all tools in one line."""
    low, high = min(margins, key=lambda one: one.shorter), min(margins, key=lambda one: one.longer)
    ends = [end_text(sign, mm, f"T{number} {what}", said) for sign, mm, number, what in (
        ("-", low.shorter, low.number, low.ends_shorter), ("+", high.longer, high.number, high.ends_longer))]
    return f"lengths off are taken up by registers: {' to '.join(ends)}{'; bodies apart' if low.bodies else ''}"


def margin_lines(margins: tuple[LengthMargin, ...], job: Job, said: LengthText = MM, room: int = 1000) -> list[str]:
    """For the header and the summary: a line for each tool whose length is in the program, else one for all.

    Where a line has no `room` for what fails, the numbers alone: never a part of it.
    """
    if not margins:
        return []
    if length_matters(job):
        short = [f"T{one.number} {_numbers(one.shorter, one.longer, said)}" for one in margins]
        return [_fitting(one.line(said), less, room) for one, less in zip(margins, short, strict=True)]
    least = _numbers(min(one.shorter for one in margins), min(one.longer for one in margins), said)
    return [_fitting(taken_up_line(margins, said), f"lengths {least}", room)]


def _numbers(shorter: float, longer: float, said: LengthText) -> str:
    low, high = (said.down(min(mm, MUCH), 3) for mm in (shorter, longer))
    return f"-{low} +{high} {said.name}"


def _fitting(line: str, short: str, room: int) -> str:
    return next((text for text in (line, short, ELSEWHERE) if len(text) <= room), "")


def pending_lines(numbers: list[int], job: Job) -> list[str]:
    """What stands in their place in the header while the program is written; `numbers`: of the tools that move."""
    if not (job.setup.output.tool_call and numbers):
        return []
    return [f"T{number}: {LENGTHS_PENDING}" for number in numbers] if length_matters(job) else [LENGTHS_PENDING]


def length_matters(job: Job) -> bool:
    """True where the length of a tool is in the program: a tool that turns, a platform, errors that are corrected.

    Elsewhere the register takes a difference up in every cut, and only travel and links can fail.
    """
    if not job.setup.output.tool_call:
        return False
    turning = len(job.control.rotary) > len(table_axes(job.control))
    return turning or job.corrects or not job.machine.kinematics.straight_slides
