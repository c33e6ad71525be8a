"""Text back to motion and against the CL file: the proof of every conversion, and `postproc verify`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from postproc.job import Job
from postproc.readback.changes import check_changes
from postproc.readback.compare import Comparison, compare
from postproc.readback.dialects import reader_for
from postproc.readback.dialects.base import UNITS_UNSTATED
from postproc.readback.execute import Motion, Offsets, run
from postproc.readback.faults import Faults
from postproc.readback.poses import Executed, poses_before
from postproc.readback.slow import HEADER, planned_feeds
from postproc.readback.stops import check_stops
from toolpaths.diagnostics import Diagnostic, Severity, error, has_errors

_CORRECTED = re.compile(rb"(?im)^[^\n]*geometric errors [^\n]*corrected in this program")
CAUSES = frozenset({"verify.tool", "verify.tool_change", "verify.state", "verify.tap", "verify.hole"})
"""told first: a path that is off follows from them"""


def read_back(data: bytes, job: Job, file: str, progress: Callable[[str, int, int], None] | None = None, gcode: str = "",
              others: Mapping[str, bytes] | None = None) -> tuple[Comparison | None, list[Diagnostic]]:
    """Execute a program on the job's machine and compare its motion with the job's CL file.

    `others`: files of its subprograms, by the names that the program calls them by.
    """
    machine, control = job.machine, job.control
    home = control.words(machine.home[None, :], machine.kinematics, 0.0)[0] + control.work_offset
    reader = reader_for(job.controller, machine.axis_names, home)
    code, diagnostics = reader.read(data, gcode, others)
    diagnostics = [_located(_judged(d, reader.units_stay), job.toolpath.file) for d in diagnostics]
    if gcode and (job.errors is None or job.errors.corrected_by != "post") and _CORRECTED.search(data[:HEADER]):
        return None, [error("verify.error_model", "the program corrects geometric errors, none are given here",
                            file=gcode, hint="verify with --error-model, the file that its header names"), *diagnostics]
    if code is None or has_errors(diagnostics):
        return None, diagnostics
    offsets = Offsets(control.work_offset, control.xyz, job.register_lengths(), home, control.length_on_z,
                      job.controller.cycles.peck_relief, control, reader.rises_first, reader.arc_slack)
    motion, found = run(code, machine.axis_names, offsets, gcode)
    diagnostics += [_located(d, job.toolpath.file) for d in found]
    if has_errors(diagnostics):
        return None, diagnostics
    if not len(motion):
        return None, [*diagnostics, error("verify.no_motion", "the program moves nothing", file=gcode)]
    if progress:
        progress("read back", 0, len(motion))
    executed = _executed(job, motion, offsets.lengths)
    with np.errstate(invalid="ignore"):
        planned = job.options.feed == "planned" or planned_feeds(data)
        comparison = compare(motion, job, executed, gcode, planned)
    faults = Faults(job.toolpath.file, gcode)
    unseen = [*check_changes(code, motion, job, home, faults), *check_stops(code, motion, job, faults),
              *_bodies(motion, executed, job, comparison, faults)]
    told = sorted([*unseen, *comparison.diagnostics], key=lambda d: d.code not in CAUSES)
    return replace(comparison, executed=(code, motion)), [*diagnostics, *told]


def _bodies(motion: Motion, executed: Executed, job: Job, comparison: Comparison, faults: Faults) -> list[Diagnostic]:
    """What the tools touch, where the set-up names bodies."""
    if job.setup.bodies is None:
        return []
    from postproc.collision.program import check_bodies

    return check_bodies(motion, executed, job, comparison.owner, faults)


def _judged(d: Diagnostic, stays: bool) -> Diagnostic:
    """Units that nothing states: nothing is proved where another program may have left them in inches."""
    return d if d.code != UNITS_UNSTATED or stays else replace(d, severity=Severity.ERROR)


def _located(d: Diagnostic, file: str) -> Diagnostic:
    """A fault of a program without a file of its own: of the CL file it is made from, the line in the message."""
    if d.file or not d.lines:
        return d
    return replace(d, file=file, lines=(), message=f"{d.message} (line {d.lines[0]} of the program)")


def _executed(job: Job, motion: Motion, lengths: dict[int, float]) -> Executed:
    """Poses of the machine as it is: with its errors where the program corrects them."""
    before = poses_before(motion, job.control)
    if job.errors is None or job.errors.corrected_by != "post":
        return Executed(job.control, job.kinematics_of, lengths, before)
    from postproc.readback.actual import ActualExecuted

    return ActualExecuted(job.control, job.kinematics_of, lengths, before, model=job.errors, motion=motion)
