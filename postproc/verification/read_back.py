"""Text back to motion and against the CL file: the proof of every conversion, and `postproc verify`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from machines.machine import Machine
from postproc.base.header_words import HEADER, NO_FILE, ProgramHeader, read_header, same_name
from postproc.base.options import Options
from postproc.base.progress import Progress
from postproc.control.control import Control
from postproc.job.job import Job
from postproc.readback.comparison.approaches import check_safe_planes
from postproc.readback.comparison.clamps import check_clamps, check_index
from postproc.readback.comparison.compare import Comparison, compare
from postproc.readback.comparison.faults import Faults
from postproc.readback.comparison.hooks import check_hooks
from postproc.readback.comparison.options import check_options
from postproc.readback.comparison.slow_moves import planned_feeds
from postproc.readback.comparison.starts import check_end, check_start
from postproc.readback.comparison.states import check_lengths, registers_of
from postproc.readback.comparison.stock import check_stock
from postproc.readback.comparison.stops_and_dwells import check_stops
from postproc.readback.comparison.tool_changes import check_changes
from postproc.readback.comparison.unstated_codes import check_length_alone, check_stated
from postproc.readback.dialects.base import ASSUMED, UNITS_UNSTATED, Reader, as_bytes
from postproc.readback.dialects.readers import reader_for
from postproc.readback.execution.execute import Motion, run
from postproc.readback.execution.offsets import Offsets
from postproc.readback.execution.poses import BlockPoses
from postproc.readback.text.canonical import Canonical, placed
from postproc.verification.asked_output import check_asked
from postproc.verification.executed import executed_poses
from postproc.verification.length_limits import LengthTrial, length_margins
from postproc.verification.lifted import always_lifted
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, Severity, error, has_errors, warning
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

if TYPE_CHECKING:
    from machines.geometric_error.actual.model import ErrorModel

CAUSES = frozenset({"verify.start", "verify.tool", "verify.tool_change", "verify.state", "verify.tap", "verify.hole"})
"""reported first: a path that is off follows from them"""


def other_axes(data: bytes, options: Options, gcode: str) -> list[Diagnostic]:
    """An error where the header of a program names other chosen tool axes than the options; nothing without our header."""
    header, chosen = read_header(data), options.orient != "keep"
    given = f"--orient {options.orient} --max-tilt {options.max_tilt:g}" if chosen else "no --orient"
    if header.axes is None:
        return [error("verify.orient", f"the header names no chosen tool axes, {given} is given", file=gcode,
                      hint="verify without --orient")] if chosen and header.ours else []
    plan, tilt = header.axes
    if chosen and (plan, tilt) == (options.orient, f"{options.max_tilt:g}"):
        return []
    return [error("verify.orient", f"the header says orient {plan}, max tilt {tilt} degrees, {given} is given", file=gcode,
                  hint=f"verify with --orient {plan} --max-tilt {tilt}")]


def other_setup(data: bytes, options: Options, off: bool, gcode: str) -> list[Diagnostic]:
    """What the header of a program says of its set-up where that is not the one given; `off`: the program fails."""
    header = read_header(data)
    stated, then = header.setup, header.setup.mark if header.setup else ""
    if header.hooks and not options.hooks:
        return [(error if off else warning)("verify.hooks", f"the header of the program names the blocks of the shop "
                f"{header.hooks}, none are given", file=gcode, hint=f"verify with --hooks {header.hooks}")]
    if then == options.setup_mark or (stated and not then) or not header.ours:
        return []
    given = f"{Path(options.setup).name or NO_FILE} (fingerprint {options.setup_mark})" if options.setup_mark else "none"
    named = stated.name if stated else ""
    says = f"the set-up {named} (fingerprint {then})" if stated else "no set-up"
    judge, so = (error, "what is off may follow from that alone") if off else (warning, "it is right under the one given")
    hint = "verify with the SetupFile as it was" if named == NO_FILE else f"verify with --setup {named} as it was"
    return [judge("verify.setup", f"the header of the program names {says}, {given} is given: {so}", file=gcode,
                  hint=f"{hint}, or convert again" if stated else "verify without --setup")]


def read_back(data: bytes | str, job: Job, file: str, progress: Progress | None = None,
              gcode: str = "", others: Mapping[str, bytes] | None = None,
              of_cl: Callable[[int], tuple[int, ...]] | None = None,
              margins: bool = False) -> tuple[Comparison | None, list[Diagnostic]]:
    """Execute a program on the job's machine and compare its motion with the job's CL file.

    A text becomes bytes only where it is read, so that memory holds it once.

    `others`: files of its subprograms, by the names that the program calls them by; `of_cl`: the lines of the CL file that a
    line of the program is written from, where that is known; `margins`: by how much tools may differ is looked for too.
    """
    machine, control = job.machine, job.control
    home = control.words(machine.home[None, :], machine.kinematics, 0.0)[0] + control.work_offset
    reader = reader_for(job.controller, machine.axis_names, home, machine.stop, control.rolls, machine.clamp_codes)
    code, diagnostics = _given(reader, job).read(data, gcode, others)
    header = read_header(as_bytes(data[:HEADER]))
    diagnostics = [_located(_judged(d, reader.units_stay), job.toolpath.file, of_cl) for d in diagnostics]
    if gcode and not job.corrects and header.corrected is not None:
        return None, [_twice(job, gcode), *diagnostics]
    if code is not None:
        diagnostics += placed([_located(d, job.toolpath.file, of_cl) for d in check_stated(code, reader, gcode)], code.files)
    if code is None or has_errors(diagnostics):
        return None, diagnostics
    offsets = _offsets(job, reader, home)
    motion, found = run(code, machine.axis_names, offsets, gcode)
    faults = Faults(job.toolpath.file, gcode)
    unseen, alone = check_start(code, job, faults), check_length_alone(data, code, job, gcode)
    code = (whole := _asked_later(code, motion, job, offsets)).without(_axis_words(machine))
    diagnostics += [_located(d, job.toolpath.file, of_cl) for d in found]
    if has_errors(diagnostics):
        return None, diagnostics
    if not len(motion):
        return None, [*diagnostics, error("verify.no_motion", "the program moves nothing", file=gcode)]
    if progress:
        progress("read back", 0, len(motion))
    executed = executed_poses(job, motion, offsets.lengths)
    with np.errstate(invalid="ignore"):
        called = {name: others[name] for name, _ in code.files[1:]} if others else {}
        planned, changed = planned_feeds(as_bytes(data if header.planned else ""), called, gcode or job.toolpath.file)
        comparison = compare(code, motion, job, executed, gcode, planned)
    job = job.with_moves(comparison.moves)
    lengths = [] if any(d.code == "verify.state" for d in comparison.diagnostics) else check_lengths(motion, job, faults)
    unseen += [*lengths, *changed, *check_end(motion, job, home, faults), *check_changes(code, motion, job, home, faults),
               *check_stops(code, motion, job, faults), *check_clamps(whole, motion, job, comparison.owner, faults),
               *alone, *check_options(code, motion, job, faults),
               *check_index(motion, job, home, comparison.owner, faults), *check_stock(data, job, faults),
               *check_safe_planes(motion, executed, job, home, comparison.owner, faults),
               *check_hooks(data, code, motion, job, comparison.owner, faults),
               *check_asked(data, whole, motion, job, reader, comparison.owner, home, faults),
               *_bodies(motion, executed, job, comparison, faults)]
    noted = sorted([*unseen, *comparison.diagnostics], key=lambda d: d.code not in CAUSES)
    if gcode and job.corrects and job.errors is not None:
        noted = [*(_of_model(header, job.errors, gcode, has_errors(noted)) if header.corrected is not None else
                   _uncorrected(header, job, motion, executed, comparison, gcode) if has_errors(noted) else []), *noted,
                 *_unmeasured(motion, executed, job, faults)]
    if margins and not has_errors([*comparison.diagnostics]):
        trial = LengthTrial(whole, offsets, job)
        comparison = replace(comparison, lengths=length_margins(trial, motion, executed, comparison))
    return comparison, [*diagnostics, *_converted_with(noted, header, job)]


def _converted_with(found: list[Diagnostic], header: ProgramHeader, job: Job) -> list[Diagnostic]:
    """The same; the first error names the tolerances of the header where these allow more than is asked for here."""
    options, errors = job.options, [k for k, d in enumerate(found) if d.severity is Severity.ERROR]
    stated = (("tolerance", header.tolerance, options.tolerance),
              ("axis-tolerance", header.axis_tolerance, options.axis_tolerance))
    said = [f"--{name} {mine:g}" for name, mine, here in stated if mine > here * (1.0 + 1e-9)]
    if not (said and errors and header.ours):
        return found
    k = errors[0]
    hint = f"verify with {' '.join(said)}, which the program was converted with by its header"
    return [*found[:k], replace(found[k], hint="; ".join(part for part in (found[k].hint, hint) if part)), *found[k + 1:]]


def _axis_words(machine: Machine) -> tuple[str, ...]:
    """Letters of words that say where axes and centres are."""
    return (*machine.axis_names, *(a.lower() for a in machine.axis_names), *"IJKijk")


def _asked_later(code: Canonical, motion: Motion, job: Job, offsets: Offsets) -> Canonical:
    """The program without axis words that nothing asks for once it is executed, half of what is known of a long one:
    what states its axes again, and what executes it with tools of other lengths, may ask for all of them, else heights
    and axes that are clamped by codes are asked for."""
    if job.setup.output.restart or not always_lifted(motion):
        return code
    names = job.machine.axis_names
    kept = {*job.machine.clamp_codes, *(names[z] for z in (int(offsets.xyz[2]),) if z >= 0)}
    return code.without(tuple(letter for letter in _axis_words(job.machine) if letter.upper() not in kept))


def _offsets(job: Job, reader: Reader, home: Floats) -> Offsets:
    """What the control adds to the words of a program; `home` (J,): the words of the home position."""
    radii = tuple((tool.number, tool.radius) for tool in job.cutcom if tool.radius)
    return Offsets(job.control.work_offset, job.control.xyz, job.register_lengths(), home, job.control.length_on_z,
                   job.controller.cycles.peck_relief, job.control, reader.rises_first, reader.arc_slack,
                   _others(job, reader), radii, job.controller.cutter_compensation.corners, reader.home_in_planes)


def _given(reader: Reader, job: Job) -> Reader:
    """The reader with what the control holds by the set-up, for programs that ask for it."""
    held = dict(_others(job, reader))
    reader.given(lambda register: held.get(register, job.control).work_offset, job.register_lengths(),
                 frozenset(registers_of(job, reader)))
    return reader


def _others(job: Job, reader: Reader) -> tuple[tuple[float, Control], ...]:
    """The control with the work offset of every further place, by the number of its register."""
    return tuple(zip(registers_of(job, reader)[1:], job.modes.others, strict=True))


def _unmeasured(motion: Motion, executed: BlockPoses, job: Job, faults: Faults) -> list[Diagnostic]:
    from postproc.readback.comparison.measured_range import check_measured
    from postproc.readback.execution.actual import ActualBlockPoses

    return check_measured(motion, executed, job, faults) if isinstance(executed, ActualBlockPoses) else []


def _twice(job: Job, gcode: str) -> Diagnostic:
    """That a program corrects errors that are not given here, or that the control is to correct."""
    if job.errors is None:
        return error("verify.error_model", "the program corrects geometric errors, none are given here", file=gcode,
                     hint="verify with --error-model, the file that its header names")
    return error("verify.error_model", f"the program corrects geometric errors, and the control is to correct those of "
                 f"{job.errors.name}: both would", file=gcode, hint='convert with this file, or write corrected_by = "post" '
                 "into it and take its errors out of the control")


def _uncorrected(header: ProgramHeader, job: Job, motion: Motion, executed: BlockPoses, comparison: Comparison,
                 gcode: str) -> list[Diagnostic]:
    """Why a program is off on the machine with errors: its header names none that it corrects.

    A program of another post may correct them all the same, so that no amounts are known.
    """
    if not (header.by_control or header.ours):
        return [warning("verify.error_model", "the header of the program names no error model, it is verified on the "
                        "machine with errors", file=gcode, hint="verify without --error-model, if it corrects none")]
    why = "by its header the control does" if header.by_control else "its header names no error model"
    return [error("verify.error_model", f"the program corrects no geometric errors ({why}): verified on the machine with "
                  "errors" + _amounts(job, motion, executed, comparison), file=gcode,
                  hint="verify without --error-model, or convert with it")]


def _of_model(header: ProgramHeader, errors: ErrorModel, gcode: str, off: bool) -> list[Diagnostic]:
    """What its header says of the model that a program corrects, its name and fingerprint, where that is not
    the one that it is verified with; `off`: the program fails. Programs without a fingerprint have only the name."""
    from machines.geometric_error.files.fingerprint import fingerprint

    name, then, now = header.corrected, header.model, fingerprint(errors)
    same = not name or same_name(name, errors.name)
    if then == now or (not then and (same or not off)):
        return []
    marks = f" (fingerprint {then} then, {now} now)" if then else ""
    note, so = (error, "what is off may follow from that alone") if off else (warning, "the program corrects other errors")
    if same:
        return [note("verify.error_model_changed", f"the error model {errors.name} has changed since the program was "
                     f"written{marks}: the program corrects the errors as they were", file=gcode,
                     hint="convert again, or verify with the model as it was")]
    return [note("verify.error_model", f"the header of the program names the error model {name}, it is verified with "
                 f"{errors.name}{marks}: {so}", file=gcode,
                 hint="verify with the model that the program was written with")]


def _amounts(job: Job, motion: Motion, executed: BlockPoses, comparison: Comparison) -> str:
    """How far errors take the tool from where the nominal machine has it at ends of feed blocks; "" where not known."""
    rows = np.flatnonzero(motion.code > 0)
    nominal = BlockPoses(job.control, job.kinematics_of, executed.lengths, executed.before)
    tip, axis = nominal.poses(motion, rows, 1.0)
    off = np.linalg.norm(comparison.tip[rows] - tip, axis=1)
    tilt = angle_between(comparison.axis[rows], axis) / DEG
    if not len(rows) or not (np.isfinite(off).all() and np.isfinite(tilt).all()):
        return ""
    return (f" the tip is off by up to {off.max():.6f} mm, allowed {job.options.tolerance:g} mm, the axis by "
            f"{tilt.max():.6f} degrees, allowed {job.options.axis_tolerance:g} degrees")


def _bodies(motion: Motion, executed: BlockPoses, job: Job, comparison: Comparison,
            faults: Faults) -> list[Diagnostic]:
    """What the tools touch, where the set-up names bodies."""
    if job.setup.bodies is None:
        return []
    from postproc.collision.program import check_bodies

    return check_bodies(motion, executed, job, comparison.owner, faults)


def _judged(d: Diagnostic, stays: bool) -> Diagnostic:
    """Units that nothing states, what is only taken to be so: nothing is proved where the control may have it otherwise."""
    assumed = d.code in ASSUMED or (d.code == UNITS_UNSTATED and not stays)
    return replace(d, severity=Severity.ERROR) if assumed else d


def _located(d: Diagnostic, file: str, of_cl: Callable[[int], tuple[int, ...]] | None) -> Diagnostic:
    """A fault of a program without a file of its own: of the CL file it is made from, the line in the message."""
    if d.file or not d.lines:
        return d
    message = f"{d.message} (line {d.lines[0]} of the program)"
    return replace(d, file=file, lines=of_cl(d.lines[0]) if of_cl else (), message=message)
