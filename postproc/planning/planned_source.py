"""What a job plans: its path and moves with the limits of its tools; a warning where nobody keeps these."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.job.job import Job
from postproc.path.model import JointPath
from postproc.reference.events import compensation_states
from postproc.reference.moves import Moves
from postproc.setup.model import TOOL_LIMITS
from toolpaths.arrays import Bools
from toolpaths.diagnostics import Diagnostic, warning
from toolpaths.toolpath import Kind

if TYPE_CHECKING:
    from postproc.feedrate.limits import ToolLimits
    from postproc.planning.planned import Source
    from postproc.planning.planned_errors import PlannedCorrection

OFF = 40
"""state of CUTCOM"""


def source_of(job: Job, moves: Moves, path: JointPath, correction: PlannedCorrection | None = None,
              override: float = 1.0, limited_jerk: bool = True) -> Source:
    """The source of the planned motion of a job's path; `correction`, `override` and `limited_jerk` as of `Source`."""
    from postproc.planning.pass_geometry import stops_of
    from postproc.planning.planned import Source
    from toolpaths.smoothing.smooth import Tolerance

    return Source(path, moves, job.machine, job.kinematics, Tolerance(job.options.tolerance, job.axis_tolerance),
                  stops_of(job.toolpath, moves), job.toolpath.file, correction, override, limits_by_tool(job),
                  limited_jerk, cutting_forces(job))


def shifted_moves(job: Job, moves: Moves) -> Bools:
    """(M,) moves that the control may shift by a radius, up to the rapid behind CUTCOM/OFF.

    Their blocks stay whole: a control takes the radius up, and off, over one block, and finds corners between two; parts
    shorter than the radius are alarms or gouges.
    """
    shifted = compensation_states(job.toolpath)[moves.row] != OFF
    ends = (moves.kind == Kind.RAPID) & ~shifted
    number = np.arange(len(moves))
    last, end = (np.maximum.accumulate(np.where(what, number, -1)) for what in (shifted, ends))
    return np.asarray(last > end)


def limits_by_tool(job: Job) -> dict[int, ToolLimits]:
    """Limits by index of the tool, of those that have one."""
    from postproc.planning.planned import tool_limits

    found = {k: tool_limits(job.setup.tools[str(job.number_of(k))]) for k in _limited(job)}
    return {k: limits for k, limits in found.items() if limits is not None}


def _limited(job: Job) -> list[int]:
    """Tools that have limits in the set-up, by their index."""
    tools = {k: job.setup.tools.get(str(job.number_of(k))) for k in range(len(job.toolpath.tools))}
    return [k for k, tool in tools.items() if tool is not None and tool.limited]


def cutting_forces(job: Job) -> dict[int, float]:
    """N at the tip by index of the tool, of those that the set-up gives one."""
    tools = (job.setup.tools.get(str(job.number_of(k))) for k in range(len(job.toolpath.tools)))
    return {k: tool.cutting_force for k, tool in enumerate(tools) if tool is not None and tool.cutting_force}


def limits_not_kept(job: Job) -> list[Diagnostic]:
    """Warnings where tools of the CL file have limits in the set-up, or motors in the machine file, and the feeds are not
    planned."""
    found = []
    if job.machine.dynamics is not None and job.machine.dynamics.limited:
        found.append(warning("plan.motors", f"what the motors of {job.machine.name} can give ([dynamics]) is reported, "
                                            "not kept: "
                             "the feeds are those of the CL file", file=job.machine.file,
                             hint="convert with --feed planned"))
    numbers = sorted({job.number_of(k) for k in _limited(job)})
    if not numbers:
        return found
    return [*found, warning("setup.tool_limits", f"{', '.join(TOOL_LIMITS[:-1])} and {TOOL_LIMITS[-1]} of "
                    f"{', '.join(f'[tools.{n}]' for n in numbers)} are not kept: the feeds are those of the CL file",
                    file=job.options.setup or "", count=len(numbers), hint="convert with --feed planned")]
