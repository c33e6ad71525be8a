"""What the proof of a program covers and by what: a line for the summary, and one for the header of the program.

The header is part of the text that is read back. So it is written with a line in its place first (`PENDING`),
and that line is replaced when the proof is complete; the control sees a comment before and after, which is checked.
"""

from __future__ import annotations

from postproc.base.header_words import HEADER, PENDING
from postproc.base.length_text import MM, LengthText
from postproc.controllers.model import ControllerFile
from postproc.job.job import Job
from postproc.readback.comparison.compare import Comparison
from postproc.readback.comparison.length_margins import margin_lines, pending_lines
from postproc.readback.text.words import plain
from postproc.witness.evidence import Testimony
from postproc.writing.state import clean, comment_room
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.units import DEG

PLACES = 4
"""decimals of mm and degrees in the header"""
PER_LINE = 200
"""characters that a line of the header has at most, with the line of its tool"""
ELSEWHERE = "proof: not said here"
"""in the header of a program whose blocks are too short for it; the summary and the file of the proof say it"""


def statement(c: Comparison, said: Testimony | None) -> str:
    """The proof of a program in one line: how much of it, how near, by what, and what was not compared."""
    seen = f"{c.worst_tip:.6f} mm, {c.worst_axis / DEG:.6f} degrees"
    if c.unbounded:
        text = (f"checked, not proved: {c.unbounded} of {len(c.owner)} blocks have no bound, in {c.cuts - c.bounded_cuts} "
                f"of {c.cuts} cuts; tip and axis are within {seen} of the CL file at the places looked at")
    else:
        text = (f"proved: tip within {c.tip_bound:.6f} mm, axis within {c.axis_bound / DEG:.6f} degrees of the CL file all "
                f"along every block of {c.bounded_cuts} of {c.cuts} cuts ({seen} at the places looked at)")
    left = [] if said is None else [str(one) for one in said.not_compared]
    return f"{text}, by {_means(said)}" + (f"; not compared by the second reading: {'; '.join(left)}" if left else "")


def _means(said: Testimony | None) -> str:
    if said is None or not said.compared:
        return "read-back alone"
    return f"read-back and second reading of {'CL file and machine file' if said.own_kinematics else 'the CL file'}"


def head_line(c: Comparison, said: Testimony | None, room: int, lengths: LengthText = MM) -> str:
    """The same for the header of the program, in at most `room` characters, never cut short; bounds are rounded up.

    Without room for the names of what was not compared it says how many that are; without room for that, how
    near alone; and where not even that has room, that it is not said here. `lengths`: in units of the program.
    """
    second = said is not None and bool(said.compared)
    by = "read-back, second reading" if second else "read-back"
    if c.unbounded:
        near = f"{lengths.up(c.worst_tip)}, {_up(c.worst_axis / DEG)}"
        text = (f"checked, not proved: {c.cuts - c.bounded_cuts} of {c.cuts} cuts unbounded; "
                f"{lengths.up(c.worst_tip)} {lengths.name}, {_up(c.worst_axis / DEG)} degrees at places")
    else:
        cuts = f"all {c.cuts} cuts" if c.cuts == c.bounded_cuts else f"{c.bounded_cuts} of {c.cuts} cuts"
        near = f"{lengths.up(c.tip_bound)}, {_up(c.axis_bound / DEG)}"
        text = f"proved by {by}: {cuts} within {lengths.up(c.tip_bound)} {lengths.name}, {_up(c.axis_bound / DEG)} degrees"
    left = [] if said is None else [str(one) for one in said.not_compared]
    named = "; not in the second reading: " + "; ".join(left).replace("(", "- ").replace(")", "")
    count = f"; {len(left)} not read twice" if left else ""
    tight = f"{'not proved' if c.unbounded else 'proved'}: {near} {lengths.name}, degrees{count}"
    return next(line for line in ((text + named) if left else text, text + count, tight, ELSEWHERE, "")
                if len(line) <= room)


def _up(degrees: float) -> str:
    return MM.up(degrees, PLACES)


def with_statement(text: str, controller: ControllerFile, comparison: Comparison, witness: Testimony | None,
                   job: Job) -> tuple[str, list[Diagnostic]]:
    """The text of a proved program with its proof in the header; an error where no comment of the controller can hold it."""
    lines, file = {PENDING: head_line(comparison, witness, comment_room(controller), controller.lengths)}, job.toolpath.file
    lines |= dict(zip(pending_lines([one.number for one in comparison.lengths], job),
                      margin_lines(comparison.lengths, job, controller.lengths, comment_room(controller)),
                      strict=True))
    room = HEADER + PER_LINE * len(lines)
    head, found = text[:room], list[Diagnostic]()
    for pending, line in lines.items():
        head, faults = _in_place_of(head, controller, pending, line, file)
        found += faults
    return head + text[room:], found


def _in_place_of(head: str, controller: ControllerFile, pending: str, line: str,
                 file: str) -> tuple[str, list[Diagnostic]]:
    """The header with another comment in the place of one that was read back."""
    style = controller.comment
    capitals = f"{style.open}{_cleaned(controller, pending, True)}{style.close}" in head
    mark = f"{style.open}{_cleaned(controller, pending, capitals)}{style.close}"
    at = head.find(mark)
    if at < 0:
        return head, []
    line = f"{style.open}{_cleaned(controller, line, capitals)}{style.close}"
    begin, end = head.rfind("\n", 0, at) + 1, at + len(mark)
    if plain(head[begin:end].encode()) != plain((head[begin:at] + line).encode()):
        return head, [error("proof.comment", f"the proof cannot stand in a comment of the header: {line}",
                            file=file, hint="comment.forbidden of the controller file must name all that "
                            "ends a comment")]
    return head[:at] + line + head[end:], []


def _cleaned(controller: ControllerFile, text: str, capitals: bool) -> str:
    return clean(controller, text.upper() if capitals else text)
