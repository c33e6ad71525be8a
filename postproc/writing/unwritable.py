"""What a controller's language has no words for: said before the text is written, never left out in silence."""

from __future__ import annotations

from postproc.compile.program import Program
from postproc.controllers.model import ControllerFile
from postproc.writing.compensated import compensated_arcs
from toolpaths.diagnostics import REPORT, Diagnostic, error, warning
from toolpaths.toolpath import Cycle


def unwritable(controller: ControllerFile, program: Program, cycles: tuple[Cycle, ...], file: str,
               length_offsets: bool = True) -> list[Diagnostic]:
    """Commands and cycles that the controller's texts cannot say in full.

    `length_offsets` is False where the words hold the length of the tool already.
    """
    return [*_own_length(controller, program, file, length_offsets), *_radius_registers(controller, program, file),
            *compensated_arcs(controller, program, file), *_no_tool(controller, program, file),
            *_pitches(controller, program, cycles, file),
            *_smoothed_in_modes(controller, program, file)]


def _smoothed_in_modes(controller: ControllerFile, program: Program, file: str) -> list[Diagnostic]:
    """Operations that begin with another smoothing while a mode is on, in which the control cannot change it."""
    if controller.kinematics.smoothing_in_modes:
        return []
    law, lines, names = "axes", list[int](), list[str]()
    for block, command in program.ordered():
        if command.name == "ENTER_SECTION":
            law = program.sections[int(command.args[0])].law
        elif command.name == "LEAVE_SECTION":
            law = "axes"
        elif command.name == "SMOOTHING" and law != "axes":
            lines.append(command.line or int(program.line[min(block, len(program) - 1)]))
            names.append(str(command.args[0]))
    if not lines:
        return []
    return [error("output.smoothing_mode", f"the smoothing of {', '.join(names[:6])} would change while a mode of the tip "
                  "or of a plane is on", file=file, lines=lines[:6], count=len(lines),
                  hint="[output] restart = true of the set-up: every operation begins at home, outside of modes")]


def _own_length(controller: ControllerFile, program: Program, file: str,
                length_offsets: bool) -> list[Diagnostic]:
    """A length that a tool change puts in force for good, where the words hold it already."""
    if length_offsets or not controller.keeps_length:
        return []
    tools = sorted({float(command.args[0]) for _, command in program.ordered() if command.name == "CHANGE_TOOL"})
    if not tools:
        return []
    names = ", ".join(f"T{tool:g}" for tool in tools)
    return [warning("tool.length_twice", f"the words hold the lengths of {names} already, and this controller adds that of "
                    "its tool table with every tool change", file=file, count=len(tools),
                    hint="L and DL of these tools must be 0 in the control's tool table; verify --tool-table TOOL.T "
                    "looks whether they are")]


def _radius_registers(controller: ControllerFile, program: Program, file: str) -> list[Diagnostic]:
    """A radius register, where the tool brings its own."""
    codes = {"LEFT": controller.codes.compensation_left, "RIGHT": controller.codes.compensation_right}
    lines = [command.line for _, command in program.ordered()
             if command.name.startswith("CUTTER_COMPENSATION") and command.args
             and "{register}" not in codes[command.name.rsplit("_", 1)[1]]]
    if not lines:
        return []
    return [warning("cutcom.own_register", "the register of CUTCOM is not written: this controller takes the radius of the "
                    "tool in the spindle", file=file, lines=lines[:6], count=len(lines),
                    hint="leave the register out of CUTCOM (CUTCOM/LEFT) where the tool's own data in the "
                    "control holds that radius")]


def _pitches(controller: ControllerFile, program: Program, cycles: tuple[Cycle, ...],
             file: str) -> list[Diagnostic]:
    """Taps without a pitch, where the controller's cycle states it."""
    tables = controller.cycles.table, controller.cycles.with_dwell
    stating = {key for table in tables for key, spec in table.items() if "{pitch}" in spec.code}
    if not stating:
        return []
    starts = [block for block, command in program.ordered() if command.name.startswith("START_SPINDLE") and command.args]
    first = min(starts, default=len(program) + 1)
    lines = [cycles[hole.cycle].line for hole in program.holes
             if hole.key in stating and not cycles[hole.cycle].pitch and first > hole.first]
    if not lines:
        return []
    return [error("cycle.pitch", "a tap without pitch or spindle speed: this controller's cycle states the pitch", file=file,
                  lines=sorted(set(lines))[:6], count=len(lines),
                  hint=f"{REPORT}; state the pitch in CYCLE/TAP, or SPINDL/RPM before it")]


def _no_tool(controller: ControllerFile, program: Program, file: str) -> list[Diagnostic]:
    """Sections whose code states a length register, while no tool is loaded that names one."""
    modes = {"tcp": controller.modes.tcp, "tilted": controller.modes.tilted}
    stating = {law: block for law, mode in modes.items() if mode for block in mode.enter if "{register}" in block}
    register, lines, laws = False, list[int](), list[str]()
    for block, command in program.ordered():
        if command.name == "USE_TOOL_LENGTH_OFFSET":
            register = True
        elif command.name == "CHANGE_TOOL":
            register = False
        elif command.name == "ENTER_SECTION" and not register:
            law = program.sections[int(command.args[0])].law
            if law in stating:
                lines.append(int(program.line[min(block, len(program) - 1)]))
                laws.append(law)
    if not lines:
        return []
    code = stating[laws[0]].partition("{")[0].strip()
    return [error("tool.missing", f"the control runs the tool tip with a length register ({code}), and the file has loaded "
                  "no tool", file=file, lines=lines[:6], count=len(lines),
                  hint="write LOADTL/1 before the first GOTO, or --output-mode axes")]


def floating_taps(controller: ControllerFile, program: Program, cycles: tuple[Cycle, ...], absent: bool,
                  file: str) -> list[Diagnostic]:
    """Taps where rigid tapping is `absent`, by the machine file, and the control has no cycle for a floating holder."""
    lines = sorted({cycles[hole.cycle].line for hole in program.holes if hole.key.startswith("TAP")})
    if not absent or controller.cycles.floating or not lines:
        return []
    return [error("cycle.rigid_tap", "a tap, and by the machine file the control has no rigid tapping (rigid_tapping = "
                  "false): the tapping cycle of this controller is rigid", file=file, lines=lines[:6], count=len(lines),
                  hint="take the tap out of the CL file, or state rigid_tapping = true under [control] where it is fitted")]
