"""What a part off its place does to programs: to the one that was written for the nominal place, to one for the measured."""

from __future__ import annotations

import numpy as np

from postproc.alignment.fit import Alignment
from postproc.control.control import InterpolationMode
from postproc.job.job import Job
from postproc.pipeline.result import PostResult
from postproc.setup.model import Placement
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Severity
from toolpaths.rotations import angle_between, lengths
from toolpaths.toolpath import Kind
from toolpaths.units import DEG


@dataclass(frozen=True)
class NominalProgram:
    """How far the program for the nominal place is off on the part where it stands, at most, over all points of the CL file.

    Attributes:
        tip: mm, with the work offset as it is
        touched_off: mm, with the origin of the work offset set again on the part, its directions as they are
        axis: degrees that the tool axis is off, in both cases: only rotary axes can change it
    """

    tip: float
    touched_off: float
    axis: float


@dataclass(frozen=True)
class ModeEffect:
    """What becomes of one output mode.

    Attributes:
        converted: the program for the measured place; rotary: least and greatest word of each rotary axis, degrees
        refused: why there is none
        by_control: True where the control can correct the program for the nominal place itself, rotary axes with it
    """

    mode: InterpolationMode
    converted: bool
    rotary: dict[str, tuple[float, float]]
    refused: str
    by_control: bool


def nominal_program(job: Job, found: Alignment) -> NominalProgram:
    """Of the job's moves; arcs and straight lines go no farther than their ends and the circles' outermost places."""
    used = job.moves.kind != Kind.RAPID
    used |= np.append(used[1:], False)
    tip, axis = job.moves.tip[used], job.moves.axis[used]
    if len(job.moves.arcs):
        tip = np.concatenate([tip, job.space.corners])
    there, origin = found.move.points(tip), job.control.origin[None]
    shift = found.move.points(origin) - origin
    return NominalProgram(float(lengths(there - tip).max()), float(lengths(there - tip - shift).max()),
                          float(angle_between(found.move.directions(axis), axis).max()) / DEG)


def mode_effect(mode: InterpolationMode, result: PostResult, job: Job) -> ModeEffect:
    """Of a conversion for the measured place in one output mode."""
    errors = [d for d in result.diagnostics if d.severity is Severity.ERROR]
    names = [name for name, turns in zip(job.machine.axis_names, job.machine.rotary, strict=True) if turns]
    extents = result.extents or {}
    return ModeEffect(mode, result.ok, {name: extents[name] for name in names if name in extents} if result.ok else {},
                      str(errors[0].message) if errors else "",
                      mode in job.controller.alignment.corrects)


def composed(move: Placement, part: Placement) -> Placement:
    """The part's place after the move."""
    return Placement(move.rotation @ part.rotation, move.points(part.origin[None])[0])
