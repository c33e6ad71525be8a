"""A part that is not where it was meant: readings -> its place, with uncertainty -> what that does to each output mode -> a
set-up with the measured place, with which a conversion is proved."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from machines.machine import Machine
from postproc.alignment.control_entry import control_entry
from postproc.alignment.effects import ModeEffect, NominalProgram, composed, mode_effect, nominal_program
from postproc.alignment.fit import Alignment, aligned
from postproc.alignment.plausible import implausible, twice
from postproc.alignment.readings import read_readings
from postproc.base.options import Options
from postproc.base.progress import Progress
from postproc.control.control import InterpolationMode
from postproc.controllers.model import load_controller
from postproc.job.job import Job, prepare, with_shop
from postproc.pipeline.convert import convert
from postproc.pipeline.result import PostResult
from postproc.setup.model import PartPlacement, load_setup
from postproc.setup.places import one_part
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, has_errors, info, read_value, warning
from toolpaths.toolpath import Toolpath

MODES: tuple[InterpolationMode, ...] = ("axes", "tcp", "tilted")
COVERAGE = 2.0
"""k of the expanded uncertainty"""
OF_TOLERANCE = 0.5
"""share of the tolerance above which the uncertainty of the place is warned of"""
LEAN_SHARE = 0.1
"""share of the axis tolerance up to which a lean is taken by a machine that has no axis for it, to be safe"""


@dataclass(frozen=True)
class ProbeReading:
    """How the readings were taken: mm from the gauge point to the probe's ball, mm of noise (None: not stated)."""

    length: float = 0.0
    machine_coordinates: bool = False
    sigma: float | None = None


@dataclass(frozen=True, eq=False)
class AlignedPart:
    """What came of it.

    Attributes:
        part: the measured place for the set-up, None where a diagnostic is an ERROR
        uncertainty: mm, expanded (k = 2), of what is cut, at most
        entry: what to enter at the control instead of a new program, [] where it cannot
    """

    diagnostics: tuple[Diagnostic, ...]
    found: Alignment | None = None
    part: PartPlacement | None = None
    uncertainty: float = 0.0
    nominal: NominalProgram | None = None
    modes: tuple[ModeEffect, ...] = ()
    entry: tuple[str, ...] = ()
    program: PostResult | None = None


def align(toolpath: Toolpath, machine: Machine, controller: str | Path, options: Options, readings: Path,
          probe: ProbeReading, large: bool, found: list[Diagnostic], progress: Progress | None = None) -> AlignedPart:
    """The measured place of the part of a CL file on a machine and a control, and what it does to its program.

    Args:
        readings: CSV file, see `read_readings`
        large: takes a part that is farther off than a fixture's stops allow
        found: what reading the CL file found
    """
    spec, setup = read_value(load_controller(controller)), read_value(load_setup(options.setup or None, options.hooks))
    spec = with_shop(spec.divided(setup.output.files), machine, setup)
    known = [*found, *(d for d in toolpath.faults if d not in found)]
    if has_errors(known):
        return AlignedPart(tuple(known))
    job, more = prepare(toolpath, machine, spec, setup, options)
    more += one_part(setup.places, "a measured part", options.setup)
    if job is None or has_errors(more):
        return AlignedPart((*known, *more))
    read, more = read_readings(readings, job, probe.length, probe.machine_coordinates, probe.sigma)
    known += more if read is None else twice(read)
    if read is None or has_errors(known):
        return AlignedPart(tuple(known))
    place = aligned(read)
    known += implausible(place, large)
    if has_errors(known):
        return AlignedPart(tuple(known), place)
    return _proved(toolpath, machine, controller, job, place, known, progress)


def _proved(toolpath: Toolpath, machine: Machine, controller: str | Path, job: Job, place: Alignment,
            known: list[Diagnostic], progress: Progress | None) -> AlignedPart:
    """The part at its place: converted as the set-up asks for, and in each output mode that there is."""
    options, moved = job.options, composed(place.move, job.placement)
    part = PartPlacement(origin=_vector(moved.origin), x_axis=_vector(moved.rotation[:, 0]),
                         y_axis=_vector(moved.rotation[:, 1]))
    setup = job.setup.model_copy(update={"part": part})
    uncertainty = COVERAGE * float(place.uncertainty(job.space.corners).max())
    known = [*known, *_uncertain(place, uncertainty, options.tolerance)]
    nominal = nominal_program(job, place)
    program = convert(toolpath, machine, controller, setup, options, progress=progress)
    effects = []
    for mode in (one for one in MODES if job.modes.lacking[one] is None):
        result = convert(toolpath, machine, controller, setup.model_copy(update={
            "output": setup.output.model_copy(update={"operations": {}})}), replace(options, output=mode))
        effects.append(mode_effect(mode, result, job))
    entry: list[str] = []
    if program.job is not None:
        entry = control_entry(job, program.job, place)
    errors = [d for d in program.diagnostics if d not in known]
    if not program.ok and nominal.axis > LEAN_SHARE * options.axis_tolerance and int(np.sum(machine.rotary)) < 2:
        errors.append(info("align.tilt", f"the part leans by {nominal.axis:.4f} degrees: no axes of {machine.name} for that",
                           file=place.readings.file, hint=f"shim it until it leans by less than "
                           f"{LEAN_SHARE * options.axis_tolerance:g} degrees and measure again, or give --axis-tolerance "
                           f"{nominal.axis / LEAN_SHARE:.2g}, where the part allows it"))
    return AlignedPart((*known, *errors), place, part if program.ok else None, uncertainty, nominal, tuple(effects),
                       tuple(entry), program)


def _uncertain(place: Alignment, uncertainty: float, tolerance: float) -> list[Diagnostic]:
    """That the readings leave more open than the tolerance has room for, or leave something as it was meant."""
    file, result = place.readings.file, []
    if place.undetermined:
        words = {"x": "along x", "y": "along y", "z": "along z", "a": "turned about x", "b": "turned about y",
                 "c": "turned about z"}
        left = ", ".join(words[name] for name in place.undetermined)
        result.append(warning("align.open", f"the readings do not say where the part stands {left}: it is taken as it was "
                              "meant there", file=file, hint="touch points that say it, or see that the fixture holds it"))
    if uncertainty > OF_TOLERANCE * tolerance:
        result.append(warning("align.uncertain", f"the place of what is cut is known to {uncertainty:.4f} mm (k = 2), the "
                              f"tolerance is {tolerance:g} mm", file=file,
                              hint="touch points farther apart, more of them, or each several times"))
    return result


def _vector(values: Floats) -> tuple[float, float, float]:
    x, y, z = (np.asarray(values) + 0.0).tolist()
    return x, y, z


