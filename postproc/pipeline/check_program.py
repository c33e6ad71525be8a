"""A program that checks the pivots at the machine: five poses of one point, with what must be read in each."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

import toolpaths
from postproc.base.options import OutputMode
from postproc.job.job import Job
from postproc.path.model import JointPath
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from postproc.reference.moves import Moves
from postproc.setup.model import SetupFile
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError, Severity, error
from toolpaths.shapes import arrays
from toolpaths.units import DEG

POSES = 5
"""the first along Z of the table, the others leaning"""
_LEANS = (30.0, 20.0, 10.0, 5.0)
"""degrees, the greatest that the machine can go to"""
_HEIGHTS = (1.0, 0.2)
"""of the point above all positions, in margins of safe planes"""
_CLEAR = 20.0
"""mm behind the point along the tool, from where a pose is come to"""


@dataclass(frozen=True)
@arrays(point="3", axes="5 3")
class _Check:
    """The point (3,) and the axes (5, 3) of the poses in the table frame, the tool's number, what the words mean."""

    point: Floats
    axes: Floats
    tool: int
    output: OutputMode


def check_program(made: PostResult, controller: str | Path, name: str) -> PostResult:
    """The check program for a conversion: the tool (a ball of the length to its centre, against an indicator on the table,
    or a probe) goes to one point above the part in five poses, the spindle standing, with a stop in each.

    Readings: the machine position that each comment names, and the indicator of the first pose in all. The first
    shows pivots that the control holds otherwise, the second a machine that is not as its file. Proved as any program.

    Args:
        made: a conversion that went well
        controller: as it was converted for
        name: of the program

    Raises:
        DiagnosticError: where the machine has no rotary axes, or no five poses are within its travel.
    """
    job = made.job
    if job is None or not made.ok:
        raise ValueError("a conversion that has failed has no check program")
    kin = made.machine.kinematics
    if not any(turns and tilts for turns, tilts in zip(kin.rotary, kin.turns_tool, strict=True)):
        raise DiagnosticError([error("check.no_rotary", f"{made.machine.name} has no rotary axis that turns tool or part: "
                                     "there are no pivots to check", file=made.toolpath.file,
                                     hint="convert without --check-program")])
    why = "none is within travel"
    for lean, height in product(_LEANS, _HEIGHTS):
        axes = _poses(job, point := _point(job, height), lean)
        if axes is None:
            continue
        check = _Check(point, axes, max(job.number_of(int(job.moves.tool[0])), 1), _output(job))
        first = _converted(made, job, controller, name, check, [""] * POSES)
        if first.ok and first.job is not None and first.path is not None and first.moves is not None:
            return _converted(made, job, controller, name, check, _readings(first.job, first.path, first.moves))
        why = next(d.message for d in first.diagnostics if d.severity is Severity.ERROR)
    raise DiagnosticError([error("check.poses", f"no five poses at ({', '.join(f'{v:.3f}' for v in point)}) mm of the table "
                                 f"frame: {why}", file=made.toolpath.file,
                                 hint=f"{job.setup.clearance.lower}, use a shorter tool, or place the part where the axes "
                                 "have more room ([part] of the set-up)")])


def checked_file(made: PostResult, controller: str | Path, file: Path | None) -> dict[Path, str]:
    """The check program by its file; nothing where none is asked for.

    Raises:
        DiagnosticError: as of `check_program`, and where it fails its own proof.
    """
    if file is None:
        return {}
    checked = check_program(made, controller, file.stem)
    if not checked.ok:
        raise DiagnosticError([d for d in checked.diagnostics if d.severity is Severity.ERROR])
    return {file: checked.text}


def _point(job: Job, height: float) -> Floats:
    """(3,) of the table frame: above the middle of all positions by `height` margins of safe planes."""
    low, high = job.moves.tip.min(axis=0), job.moves.tip.max(axis=0)
    middle = 0.5 * (low + high)
    middle[2] = high[2] + height * job.setup.clearance.margin
    return np.asarray(middle.round(3))


def _poses(job: Job, point: Floats, lean: float) -> Floats | None:
    """(5, 3) tool axes in the table frame that the machine can take: upright, then leaning; None where there are too few."""
    s, c = np.sin(lean * DEG), np.cos(lean * DEG)
    s2, c2 = np.sin(0.5 * lean * DEG), np.cos(0.5 * lean * DEG)
    around = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
    axes = np.concatenate([[[0.0, 0.0, 1.0]], *(np.column_stack([one * around, np.full(4, height)])
                                               for one, height in ((s, c), (s2, c2)))])
    kin = job.kinematics(int(job.moves.tool[0]))
    there = kin.inverse(np.tile(point, (len(axes), 1)), axes)
    limits = job.machine.limits
    inside = (there >= limits.lower - 1e-9) & (there <= limits.upper + 1e-9)
    reached = np.isfinite(there).all(axis=2) & inside[..., job.control.rotary].all(axis=2)
    found = np.flatnonzero(reached.any(axis=0))
    return axes[found[:POSES]] if len(found) >= POSES else None


def _output(job: Job) -> OutputMode:
    """The mode in which the control uses its pivots, where it has one."""
    had = job.control.base != "tcp" and job.controller.modes.tcp is not None and job.control.has_tip_modes
    return "tcp" if had else "auto"


def _converted(made: PostResult, job: Job, controller: str | Path, name: str, check: _Check,
               readings: list[str]) -> PostResult:
    """The conversion of the poses under what was converted, but for what belongs to its operations."""
    path, found = toolpaths.read_bytes(_text(job, check, readings), file=f"{name}.cls")
    output = made.setup.output.model_copy(update={
        "default": "auto", "operations": {}, "smoothing": {}, "restart": False, "subprograms": False, "files": False,
        "longest": 0, "spindle": None, "coolant": None, "program_name": None})
    tools = {n: t.model_copy(update={"spindle": None, "coolant": None}) for n, t in made.setup.tools.items()
             if int(n) == check.tool}
    setup = job.setup.model_copy(update={"output": output, "work_offset": "", "tool_numbers": {}, "assumed": [],
                                          "tools": tools})
    options = replace(made.options, output=check.output, setup="", setup_mark="", units="", dialect="", orient="keep",
                      feed="programmed", smooth=False, name=name)
    return convert(path, made.machine, controller, SetupFile.model_validate(setup.model_dump()), options, found)


def _text(job: Job, check: _Check, readings: list[str]) -> str:
    """The poses as a CL file in the system that is the work offset; three positions each, the second is the pose."""
    frame, placement = job.work_system, job.placement.inverse()
    origin, rotation = np.array(frame.origin), np.array(frame.rotation)

    def local(points: Floats, directions: bool) -> Floats:
        part = placement.directions(points) if directions else placement.points(points)
        return np.asarray((part if directions else part - origin) @ rotation)

    system = np.concatenate([origin, *rotation.T[:2]])
    lines = ["UNITS/MM", "TOOL PATH/CHECK OF PIVOTS,TOOL,CHECK", f"MSYS/{_numbers(system)}", f"LOAD/TOOL,{check.tool}"]
    axes, point = local(check.axes, True), local(check.point[None], False)[0]
    said, words = job.controller.lengths, (check.point - job.control.origin).round(4)  # its axes are the machine's
    place = " ".join(f"{letter}{said.plain(v + 0.0)}" for letter, v in zip("XYZ", words.tolist(), strict=True))
    lines += ["PPRINT/BALL OR PROBE, ITS LENGTH TO THE CENTRE, SPINDLE STANDING, RAPIDS SLOWED DOWN BY HAND",
              f"PPRINT/INDICATOR ON THE TABLE AT {place} OF THE WORK OFFSET"]
    for axis, reading in zip(axes, readings, strict=True):
        above, there = (f"GOTO/{_numbers(np.concatenate([tip, axis]))}" for tip in (point + _CLEAR * axis, point))
        lines += ["RAPID", above, "RAPID", there, *([f"PPRINT/{reading}"] if reading else []), "STOP", "RAPID", above]
    return "\n".join([*lines, "END-OF-PATH", "FINI", ""])


def _numbers(values: Floats) -> str:
    return ",".join(f"{v + 0.0:.9f}" for v in values)


def _readings(job: Job, path: JointPath, moves: Moves) -> list[str]:
    """What must be read in each pose: machine position of the axes, and the indicator."""
    rows = [3 * k + 1 for k in range(POSES)]
    blocks = [int(path.begin[int(np.searchsorted(moves.row, row)) + 1]) - 1 for row in rows]
    q = (path.q[blocks] * job.control.unit).round(4) + 0.0
    said, letters, rotary = job.controller.lengths, job.machine.axis_names, job.machine.rotary
    result = []
    for k, at in enumerate(q, 1):
        places = " ".join(f"{letter}{v:.4f}" if turns else f"{letter}{said.plain(v)}"
                          for letter, v, turns in zip(letters, at.tolist(), rotary, strict=True))
        result.append(f"POSE {k} OF {POSES}, MACHINE POSITION {places}, INDICATOR "
                      + ("SET TO ZERO" if k == 1 else "ZERO"))
    return result
