"""Hands a conversion to the second witness (`witness/`), which knows nothing of the project, and says what it found."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from machines.loader import builtin
from machines.machine import Machine
from machines.user_file import base_chain, values_of
from postproc.base.options import Options
from postproc.control.control import Control
from postproc.job.job import Job
from postproc.readback.comparison.compare import Comparison
from postproc.readback.comparison.states import registers_of
from postproc.readback.dialects.base import as_bytes
from postproc.readback.dialects.readers import reader_for
from postproc.readback.execution.poses import BlockPoses as Poses
from postproc.readback.execution.poses import arc_sweeps, begins, coordinates
from postproc.readback.text.modal import codes
from postproc.setup.model import SetupFile, at_places
from postproc.witness.evidence import Case, ExecutedBlocks, NotCompared, Testimony, together
from postproc.witness.machine import merged
from postproc.witness.second_reading import testify
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.input_files import is_regular, read_input
from toolpaths.toolpath import ClSource


def machine_tables(machine: Machine) -> list[dict[str, Any]]:
    """The machine's file as parsed, then that of its base and so on; none where there is no file. Limits that
    a caller has changed in memory stand before it."""
    known = builtin()
    path = Path(machine.file) if machine.file else known.get(machine.name)
    if path is None or not is_regular(path):
        return []
    tables = [values_of(file) for file in base_chain(path, known)]
    return tables if machine.limits is machine.stated else [{"axes": _limits_table(machine)}, *tables]


def _limits_table(machine: Machine) -> dict[str, dict[str, Any]]:
    """Travel and velocity of each axis as a machine file states them."""
    limits, units = machine.limits, _units(machine).tolist()
    return {letter: {"velocity": v * unit, "acceleration": a * unit, "jerk": j * unit,
                     "travel": [low * unit, high * unit] if math.isfinite(low) and math.isfinite(high) else "unlimited"}
            for letter, unit, low, high, v, a, j in zip(
                machine.axis_names, units, limits.lower.tolist(), limits.upper.tolist(), limits.velocity.tolist(),
                limits.acceleration.tolist(), limits.jerk.tolist(), strict=True)}


def limits_as_used(machine: Machine) -> Floats:
    """(J, 6) travel, velocity, acceleration, jerk and home of the axes: what the stages of a conversion have used."""
    limits = machine.limits
    return np.stack([limits.lower, limits.upper, limits.velocity, limits.acceleration, limits.jerk, machine.home], axis=1)


def executed_of(comparison: Comparison, poses: Poses, job: Job) -> ExecutedBlocks:
    """The motion of a program, read back, as plain arrays."""
    motion, control = comparison.executed[1], job.control
    degrees, machine = _units(job.machine), _by_drives(job.machine)

    def driven(q: Floats) -> Floats:
        return q if machine is job.machine else job.machine.kinematics.drives(q)

    whole = driven(poses.joints(motion, np.arange(len(motion)), 1.0)) if control.base == "tcp" else None
    straight = (motion.code != 2) & (motion.frame == 0) & (control.base != "tcp")
    if control.rapids == "dog-leg":
        straight &= motion.code != 0

    def joints(rows: Ints) -> Floats:
        return np.asarray(motion.end[rows] / degrees) if whole is None else np.asarray(whole[rows])

    def joints_at(rows: Ints, t: float | Floats) -> Floats:
        if isinstance(t, np.ndarray) and not t.any() and control.base != "tcp":
            return begins(motion, rows) / degrees
        return driven(poses.joints(motion, rows, t))

    def poses_at(rows: Ints, t: float | Floats) -> tuple[Floats, Floats]:
        if isinstance(t, float) and t == 1.0:
            return comparison.ends(rows)
        return poses.poses(motion, rows, t)

    def steps(rows: Ints) -> Floats:
        before, end = coordinates(motion, rows)
        return end - before

    def approach_at(rows: Ints, t: float | Floats) -> Floats:
        return poses.approach(motion, rows, t)

    by_tip = np.asarray(motion.frame > 0) | (control.base == "tcp")
    lengthless = np.array([f.law == "axes" for f in motion.frames])[motion.frame]
    lengthless = lengthless & (not control.length_on_z) & (not job.controller.keeps_length)
    start = motion.start / degrees if control.base != "tcp" else machine.home
    return ExecutedBlocks(machine.axis_names, job.machine.axis_names, joints, start, motion.line, motion.code,
                          np.asarray(straight), arc_sweeps(motion, control), motion.feed,
                          motion.inverse, motion.unit, by_tip, control.feed_rule,
                          control.degree_is_inch, job.controller.feed.arc_inverse == "radius", motion.compensation,
                          motion.radius, motion.contour, stops_of(comparison), motion.tool, motion.spindle, motion.rpm,
                          motion.coolant, motion.dwell, motion.pitch, motion.hole, motion.register, lengthless,
                          steps, joints_at, poses_at, approach_at if job.corrects else None)


def stops_of(comparison: Comparison) -> tuple[tuple[int, float], ...]:
    """(row of the motion before which it stands, M number) of every stop of the program, in order."""
    code, motion = comparison.executed
    return tuple(sorted((int(row), number) for number in (0.0, 1.0)
                        for row in np.searchsorted(motion.block, codes(code.words, "M", (number,))[0])))


def error_tables(file: str | Path) -> tuple[dict[str, Any], dict[str, bytes]]:
    """An error model file as parsed, over its bases, and its CSV tables by their paths, which stand in it."""
    parsed, tables = list[dict[str, Any]](), dict[str, bytes]()
    for one in base_chain(file):
        own = tomllib.loads(read_input(one).decode("utf-8-sig"))
        for cites in (*own.get("components", {}).values(), own.get("map", {})):
            if "table" in cites:
                path = one.parent / cites["table"]
                cites["table"] = str(path)
                tables[str(path)] = read_input(path)
        parsed.append(own)
    return merged(parsed), tables


def offset_joints(control: Control) -> Floats | None:
    """(J,) joints of the program's zero; None where words are no machine coordinates by it, or it holds a tool's length."""
    if control.base == "tcp" or control.measured or not control.machine.kinematics.straight_slides:
        return None
    return np.asarray(np.where(np.isin(np.arange(len(control.unit)), control.rotary), control.zero,
                               control.work_offset / _units(control.machine)))


def _by_drives(machine: Machine) -> Machine:
    """As its file has it, where the axes of programs are those of the control's kinematics."""
    return machine.by_drives or machine


def _units(machine: Machine) -> Floats:
    """(J,) word units per joint unit."""
    return np.where(machine.rotary, math.degrees(1.0), 1.0)


def second_witness(source: ClSource | None, setup: SetupFile, options: Options, job: Job,
                   comparison: Comparison, program: bytes | str = b"") -> tuple[Testimony, list[Diagnostic]]:
    """What the second witness says of a program that was read back, and its findings as errors.

    Args:
        source: what the path was read from
        setup: as the shop wrote it, [part] by whatever it names
        program: its text, which is looked at where the machine has modulo axes
    """
    if source is None:
        return Testimony((), (NotCompared("all", "the path is not as it was read from a file"),)), []
    found, said = list[Diagnostic](), list[Testimony]()
    unread = _unread_text(job, program, bool(len(comparison.executed[0].curves)))
    program = b"" if unread else program
    executed, shops = executed_of(comparison, comparison.poses, job), at_places(setup)
    for k, place in enumerate(job.places):
        case, name = _case(source, shops[k], options, job, comparison, program, k), place.name and f"place {place.name}: "
        if setup.places:
            case = replace(case, setup=case.setup | {"turn": setup.places[k].turn, "measured": setup.places[k].turned})
        rows = _rows_at(comparison, job, k)
        if rows is not None and not len(rows):
            return together(said), [error("witness.position", f"second witness: {name}no block of the program is made there",
                                          file=job.toolpath.file, hint="do not run this program")]
        try:
            said.append(testify(case, executed if rows is None else executed.take(rows)))
        except (ArithmeticError, AssertionError, LookupError, TypeError, ValueError) as fault:
            # A file that it does not get through weakens the proof, which the text then says; it must not stop the program.
            why = f"the second witness failed: {type(fault).__name__}: {fault}"
            hint = "leave --require-proof out, where the read-back alone is enough"
            found = [error("witness.failed", f"{name}{why}; the program is not proved", file=job.toolpath.file, hint=hint)]
            return Testimony((), (NotCompared("all", why),)), found if options.require_proof else []
        found += [error(f"witness.{f.code}", f"second witness: {name}{f.message} (line {f.block} of the program)",
                        file=job.toolpath.file, lines=[f.line] if f.line else [], count=f.count,
                        hint="do not run this program") for f in said[-1].findings]
    heard = together(said)
    if len(comparison.executed[0].curves) and not unread and all(one.what != "curves" for one in heard.compared):
        unread = [NotCompared("text", "polynomials: the program is not one text in the order in which it runs")]
    unread = [*unread, *_records_of_others(source)]
    found += [error("verify.not_compared", f"the second witness has not compared {one.why}", file=job.toolpath.file,
                    hint="leave --require-proof out, where the read-back alone is enough")
              for one in unread if options.require_proof]
    return replace(heard, not_compared=(*heard.not_compared, *unread)), [*found, *_order(setup, comparison, job)]


def _unread_text(job: Job, program: bytes | str, curves: bool) -> list[NotCompared]:
    """What this witness would read of the text itself, clamps, polynomials, turns of modulo axes, where variables, loops or
    calls of the program are executed: words in it are not what they are on the control."""
    what = [name for name, some in (("turns of modulo axes", bool(job.control.rolls)),
                                    ("clamps", bool(job.machine.clamp_codes)), ("polynomials", curves)) if some]
    reader = reader_for(job.controller, job.machine.axis_names)
    if not what or not program or not reader.in_macros(as_bytes(program)):
        return []
    return [NotCompared("text", f"{' and '.join(what)}: a program with variables, read back alone")]


def _records_of_others(source: ClSource) -> list[NotCompared]:
    """What this witness takes from a package: which records a file holds that only that package reads."""
    return [] if source.plug_in is None else [NotCompared("text", f"records of the CL file as read by {source.plug_in}")]


def _order(setup: SetupFile, comparison: Comparison, job: Job) -> list[Diagnostic]:
    """An error where the cuts do not go from place to place in the order of the set-up: each place once, or once for every
    tool between two changes."""
    motion, count = comparison.executed[1], len(job.places)
    if count < 2:
        return []
    cut = np.flatnonzero((motion.code > 0) & (comparison.owner < len(comparison.moves.without_pecks())))
    registers = registers_of(job, reader_for(job.controller, job.machine.axis_names))
    steps = [(int(tool) if setup.order == "tool" else 0, float(offset)) for tool, offset in zip(
        np.broadcast_to(motion.tool, len(motion))[cut], np.broadcast_to(motion.offset, len(motion))[cut], strict=True)]
    steps = [one for k, one in enumerate(steps) if k == 0 or steps[k - 1] != one]
    groups = [[offset for _, offset in some] for _, some in groupby(steps, key=lambda one: one[0])]
    again = setup.order == "tool"  # a tool may come back behind one that cuts nothing
    if all(some == registers * (len(some) // count if again else 1) for some in groups):
        return []
    return [error("witness.order", f'second witness: the places are not gone through as order = "{setup.order}" says',
                  file=job.toolpath.file, hint="do not run this program")]


def _rows_at(comparison: Comparison, job: Job, place: int) -> Ints | None:
    """The executed blocks under the work offset of a place: what the program itself says, not what it was written for; None
    for all of them where there is one place."""
    if len(job.places) < 2:
        return None
    reader = reader_for(job.controller, job.machine.axis_names)
    return np.flatnonzero(comparison.executed[1].offset == registers_of(job, reader)[place])


def _case(source: ClSource, setup: SetupFile, options: Options, job: Job, comparison: Comparison, program: bytes | str,
          place: int) -> Case:
    """What the witness is given of a program at one place."""
    control, words, curves = job.control_at(place), job.controller.codes, len(comparison.executed[0].curves) > 0
    errors = error_tables(options.error_model) if job.corrects and options.error_model else ({}, {})
    machine = _by_drives(job.machine)
    return Case(lambda: source.text, machine_tables(machine), setup.model_dump(), options.tolerance, job.axis_tolerance,
                source.units or None, source.dialect or None, control.rapids == "dog-leg", comparison.planned, job.corrects,
                *errors, "{register}" in words.length_offset, "{register}" in words.compensation_left,
                sum(bit for bit, code in ((1, words.flood), (2, words.mist), (4, words.through), (8, words.air)) if code),
                program=as_bytes(program) if control.rolls or job.machine.clamp_codes or curves else b"",
                clamps={a: (c.clamp, c.unclamp) for a, c in job.machine.clamp_codes.items()} if program else {},
                modulo={job.machine.axis_names[j]: roll.rule for j, roll in control.rolls.items()},
                origin=control.origin, limits=limits_as_used(machine), work_offset=offset_joints(control),
                chosen=job.toolpath.axis if options.orient != "keep" else None, cl_lines=source.lines)
