"""Blocks of a CL file, through its conversion, or of a G-code file, through the reader of its controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.control.control import Control, InterpolationMode
from postproc.control.rollover import rollovers
from postproc.controllers.model import ControllerFile
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.program import BlockOrigin, blocks_of
from postproc.cycle_time.tip_path import TipPath
from postproc.job.job import with_shop
from postproc.job.turned_places import turned
from postproc.pipeline.result import PostResult
from postproc.readback.dialects.readers import reader_for
from postproc.readback.execution.execute import Motion, run
from postproc.readback.execution.offsets import Offsets
from postproc.readback.execution.poses import BlockPoses, poses_before
from postproc.readback.text.canonical import Canonical
from postproc.reference.cutcom_of_tools import radii_of
from postproc.reference.holes import Phase
from postproc.setup.model import SetupFile, at_places, part_placement
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error, has_errors, warning
from toolpaths.input_files import read_input, unreadable


def from_conversion(result: PostResult, override: float = 1.0) -> MotionBlocks:
    """The blocks of a conversion that has succeeded, with operations and lines of its CL file.

    `override` as of `blocks_of`.
    """
    job, found = result.job, result.comparison
    if job is None or found is None or not result.ok:
        raise ValueError("a conversion that has failed has no blocks")
    code, motion = found.executed
    moves, path = found.moves.without_pecks(), job.toolpath
    owner = np.clip(found.owner, 0, len(moves) - 1)
    places = [job.places[k].name for k in job.modes.place.tolist()] or [""] * len(path.operations)
    names = tuple((op.name or f"operation {k + 1}") + (place and f" at {place}")
                  for k, (op, place) in enumerate(zip(path.operations, places, strict=True)))
    inside = (found.owner >= 0) & (found.owner < len(moves))
    kept = np.flatnonzero(found.moves.phase != Phase.PECK)
    origin = BlockOrigin(path.operation[moves.row[owner]].astype(np.int64), names,
                         np.where(inside, moves.line[owner], -1).astype(np.int64), np.where(inside, kept[owner], -1))
    tip = TipPath(motion, found.poses, tuple(result.machine.rotary))
    return replace(_blocks(code, motion, result.machine, job.control, result.controller, origin, override), tip=tip)


@dataclass(frozen=True)
class ExecutedProgram:
    """A program as its control runs it on a machine, from the machine's home.

    Attributes:
        lengths: gauge length by tool number and length register, mm
        control: of the first work offset
    """

    code: Canonical
    motion: Motion
    machine: Machine
    control: Control
    controller: ControllerFile
    lengths: Mapping[int, float]

    def poses(self) -> BlockPoses:
        """Tip and tool axis at any place of its blocks, in the part frame's place on the table."""
        by_length: dict[float, Kinematics] = {}

        def kinematics(number: int) -> Kinematics:
            length = self.lengths.get(number, 0.0)
            if length not in by_length:
                by_length[length] = self.machine.kinematics.with_tool(length)
            return by_length[length]

        return BlockPoses(self.control, kinematics, dict(self.lengths), poses_before(self.motion, self.control))


def executed_program(data: bytes, machine: Machine, controller: ControllerFile, setup: SetupFile, file: str = "",
                     others: Mapping[str, bytes] | None = None,
                     unknown_length: float = 0.0) -> tuple[ExecutedProgram | None, list[Diagnostic]]:
    """A program executed; None and why where it cannot be. Arguments as of `from_gcode`."""
    controller = with_shop(controller, machine, setup)
    machine = machine.on_control() if controller.kinematics.modules else machine
    origins, found = _origins(setup, machine)
    if has_errors(found):
        return None, found
    tip_law = machine.control_kinematics is not None and controller.kinematics.modules
    law: InterpolationMode = "tcp" if tip_law else "axes"
    controls = {code: Control(machine, law, origin, base=law, rapids=machine.rapids or controller.kinematics.rapids,
                              feed_rule=controller.feed.length, rolls=rollovers(machine, controller)[0])
                for code, origin in origins}
    lengths = {int(number): tool.length for number, tool in setup.tools.items()}
    code, motion, more = _executed(data, controller, controls, lengths, radii_of(setup), file, others)
    if motion is not None and (unknown := unknown_lengths(motion, lengths)):
        named = ", ".join(f"T{k}" for k in unknown[:6])
        more.append(warning("time.length", f"gauge lengths are not stated: {named}; the control's own kinematics move the "
                            f"axes by them, run with {unknown_length:g} mm", file=file, count=len(unknown),
                            hint="state gauge_length in [tools.N] of a set-up, and give it with --setup"))
        if unknown_length > 0.0:
            lengths |= dict.fromkeys(unknown, unknown_length)
            code, motion, again = _executed(data, controller, controls, lengths, radii_of(setup), file, others)
            more = more if code is not None and motion is not None and not has_errors(again) else again
    found += more
    if code is None or motion is None or has_errors(found):
        return None, found
    return ExecutedProgram(code, motion, machine, next(iter(controls.values())), controller, lengths), found


def from_gcode(data: bytes, machine: Machine, controller: ControllerFile, setup: SetupFile, file: str = "",
               others: Mapping[str, bytes] | None = None,
               override: float = 1.0, unknown_length: float = 0.0) -> tuple[MotionBlocks | None, list[Diagnostic]]:
    """The blocks of a program, from the machine's home; None and why where it cannot be executed.

    Tool lengths come from the set-up, by length register as by tool number; the work offset stands where the set-up puts
    the part. `others`: files of subprograms by name; `override` as of `blocks_of`.
    `unknown_length`: mm that a length register holds of which the set-up says nothing.
    """
    program, found = executed_program(data, machine, controller, setup, file, others, unknown_length)
    if program is None:
        return None, found
    blocks, more = program_blocks(program, file, override)
    return blocks, [*found, *more]


def program_blocks(program: ExecutedProgram, file: str = "", override: float = 1.0,
                   ) -> tuple[MotionBlocks | None, list[Diagnostic]]:
    """The blocks of a program that was executed; None and why where they take no time that can be said."""
    motion, missing = program.motion, program.motion.missing_feed
    if missing.any():
        return None, [error("gcode.feed", "cutting blocks without a feed in force", file=file,
                            lines=motion.line[missing][:6].tolist(), count=int(missing.sum()), hint="state F before them")]
    blocks = None
    if len(motion):
        blocks = _blocks(program.code, motion, program.machine, program.control, program.controller, None, override)
        blocks = replace(blocks, tip=TipPath(motion, program.poses(), tuple(program.machine.rotary)))
    if blocks is None or not len(blocks):
        return None, [error("gcode.no_motion", "the program moves nothing", file=file,
                            hint="name a program that has moves: G0, G1 with axis words")]
    return blocks, []


def unknown_lengths(motion: Motion, lengths: Mapping[int, float]) -> list[int]:
    """Length registers that hold nothing the set-up states, where the control runs the kinematics."""
    used = np.unique(motion.register[motion.frame > 0])
    return [register for register in used.tolist() if register > 0 and not lengths.get(register, 0.0)]


def _origins(setup: SetupFile, machine: Machine) -> tuple[list[tuple[str, Floats]], list[Diagnostic]]:
    """(register, zero of its work offset in the table frame) of the set-up, or of each of its places."""
    result, found = list[tuple[str, Floats]](), list[Diagnostic]()
    for k, here in enumerate(at_places(setup)):
        placement, more = part_placement(here)
        if placement is not None and setup.places:
            placement, turning = turned(machine, setup.places[k], placement, "")
            more += turning
        found += more
        result += [] if placement is None else [(here.work_offset_code, placement.points(np.zeros((1, 3)))[0])]
    return result, found


def _executed(data: bytes, controller: ControllerFile, controls: dict[str, Control], lengths: dict[int, float],
              radii: tuple[tuple[int, float], ...], file: str, others: Mapping[str, bytes] | None,
              ) -> tuple[Canonical | None, Motion | None, list[Diagnostic]]:
    """Text to canonical words to motion; `controls` with the work offset of each register."""
    control, *further = controls.values()
    machine, program = control.machine, controller.program
    home = control.words(machine.home[None, :], machine.kinematics, 0.0)[0] + control.work_offset
    reader = reader_for(controller, machine.axis_names, home, machine.stop, control.rolls,
                        machine.clamp_codes)
    held = {reader.offset_of(program.offset_text(name)): one.work_offset for name, one in controls.items()}
    reader.given(lambda register: held.get(register, control.work_offset), lengths, frozenset(held))
    code, found = reader.read(data, file, others)
    if code is None or has_errors(found):
        return None, None, found
    numbers = [reader.offset_of(program.offset_text(code)) for code in controls]
    offsets = Offsets(control.work_offset, control.xyz, lengths, home, control.length_on_z, controller.cycles.peck_relief,
                      control, reader.rises_first, reader.arc_slack, tuple(zip(numbers[1:], further, strict=True)),
                      radii, controller.cutter_compensation.corners, reader.home_in_planes)
    motion, more = run(code, machine.axis_names, offsets, file)
    return code, motion, [*found, *more]


def _blocks(code: Canonical, motion: Motion, machine: Machine, control: Control, controller: ControllerFile,
            origin: BlockOrigin | None, override: float) -> MotionBlocks:
    kinematics = controller.kinematics
    return blocks_of(code, motion, machine, control, origin, blends_unstated=kinematics.blends_unstated,
                     exact_path_rests=kinematics.exact_path_rests, by_radius=controller.feed.arc_inverse == "radius",
                     override=override)


def read_file(file: str | Path, hint: str = "a CL file, or a program of the controller") -> bytes:
    """The bytes of a file.

    Raises:
        DiagnosticError: where it cannot be read.
    """
    try:
        return read_input(file, standard_input=True)
    except OSError as fault:
        raise DiagnosticError([unreadable(fault, "time.open", file, f"name {hint}")]) from fault
