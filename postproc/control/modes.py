"""The output mode of each run: machine coordinates, tool-centre-point mode or tilted plane; by rule or as asked for."""

from __future__ import annotations

from dataclasses import field, replace
from functools import cached_property, lru_cache
from typing import Literal, get_args

import numpy as np

from machines.choices import BoughtOption
from machines.kinematics.base import Kinematics
from postproc.base.options import Options, OutputMode
from postproc.control.control import Control, InterpolationMode, tool_frames
from postproc.control.planes import Plane, stated
from postproc.controllers.model import ControllerFile
from postproc.controllers.output_modes import Mode
from postproc.setup.model import SetupFile, line_of
from toolpaths.arrays import Array, Floats, Ints, distinct
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.shapes import arrays
from toolpaths.toolpath import Toolpath

MissingMode = Literal["own kinematics", "no tip modes", "no tool call", "no tip mode of the control", "no retract axis",
                      "no plane of the control", "rotary head"]
"""what is missing for an output mode"""
ASKED: tuple[OutputMode, ...] = get_args(OutputMode)
PREFERRED: dict[bool, tuple[InterpolationMode, ...]] = {True: ("tilted", "axes", "tcp"), False: ("tcp", "axes")}
"""modes that "auto" takes, the first that can be had: where the tool axis of a run stands still, and where it turns"""
Refused = frozenset[tuple[int, InterpolationMode]]
"""(operation, mode) that "auto" passes over, because that mode could not be written or proved for it"""
OPTION_OF: dict[OutputMode, BoughtOption] = {"tilted": "tilted_planes", "tcp": "tip_control"}
"""the option of the control that an output mode needs"""
CONSTANT = 0.1
"""share of the axis tolerance within which the tool axis of a run counts as standing still"""


@dataclass(frozen=True, eq=False)
class WordFrame:
    """A control under one law, with what a tilted plane states: printed angles, and rotary words by letter (degrees)."""

    control: Control
    angles: tuple[float, ...] = ()
    rotary: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True, eq=False)
@arrays(asked="int8: O", decimals="J", place="_")
class OutputModes:
    """What controller and machine can do, and what is asked for each operation.

    Attributes:
        control: under its base law
        asked (operations,): index into ASKED
        decimals (J,): of the axis words
        tool_call: False where no length register is ever in force
        refused: what "auto" passes over
        others: the control with the work offset of each further place, under its base law
        place (operations,): number of the place of each; empty: all at the first
    """

    control: Control
    controller: ControllerFile
    asked: Array
    decimals: Ints
    tool_call: bool = True
    refused: Refused = frozenset()
    others: tuple[Control, ...] = ()
    place: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def of(self, operation: int) -> OutputModes:
        """The modes at the place of an operation."""
        return self.at(int(self.place[operation])) if len(self.place) else self

    def at(self, place: int) -> OutputModes:
        """The modes with the work offset of a place."""
        return self._places[place]

    @cached_property
    def _places(self) -> tuple[OutputModes, ...]:
        return self, *(replace(self, control=control) for control in self.others)

    @cached_property
    def lacking(self) -> dict[InterpolationMode, MissingMode | None]:
        """What is missing for a law, None where it can be had."""
        control, modes = self.control, self.controller.modes
        if control.base == "tcp":
            return {"axes": "own kinematics", "tcp": None, "tilted": "own kinematics"}
        machine: MissingMode | None = None
        if not (control.has_tip_modes and self.tool_call):
            machine = "no tool call" if control.has_tip_modes else "no tip modes"
        tables = modes.tilted is not None and modes.tilted.tables_only and not control.has_rotary_tables_only
        away = self.at_zero and control.machine.retract_axis < 0
        return {"axes": None,
                "tcp": machine or ("no tip mode of the control" if not modes.tcp else "no retract axis" if away else None),
                "tilted": machine or ("no plane of the control" if not modes.tilted else "rotary head" if tables else None)}

    @cached_property
    def tcp(self) -> WordFrame:
        """The frame of the law "tcp", the same for all runs."""
        if self.control.base == "tcp":
            return self.base
        control = self.control.under("tcp")
        mode = self.controller.modes.tcp
        return WordFrame(_with_arcs(control, mode))

    def from_home(self, law: InterpolationMode) -> bool:
        """True where a mode is entered at the height of home on travel from there: a tilted plane where no length may be in
        force when it is stated, the mode by the tip where it takes the length itself."""
        mode = self.controller.modes.tilted
        return self.tip_from_home if law == "tcp" else law == "tilted" and mode is not None and mode.length == "off"

    @property
    def tip_from_home(self) -> bool:
        """True where the mode by the tip takes the length register itself, and its end cancels it: it is then entered and
        left at the height of home, so that no length changes near the part."""
        mode = self.controller.modes.tcp
        return mode is not None and self.control.base != "tcp" and mode.length == "off" and any(
            "{register}" in block for block in mode.enter)

    @property
    def tcp_code(self) -> str:
        """What switches the mode by the tip on."""
        mode = self.controller.modes.tcp
        return mode.enter[0].split(" ")[0] if mode else ""

    @cached_property
    def at_zero(self) -> bool:
        """True where the mode by the tip has to be entered with the rotary tables at zero."""
        mode = self.controller.modes.tcp
        return mode is not None and self.control.base != "tcp" and self.control.entry_frame != "table" and bool(
            len(table_axes(self.control)))

    @cached_property
    def base(self) -> WordFrame:
        """The frame that programs begin in, and that home and indexing moves are made in."""
        return WordFrame(self.control)

    def law(self, operation: int, constant: bool) -> InterpolationMode:
        """The law of a run of that operation, `constant` where its tool axis stands still."""
        asked = ASKED[int(self.asked[operation])]
        return self.possible(operation, constant)[0] if asked == "auto" else asked

    def possible(self, operation: int, constant: bool) -> list[InterpolationMode]:
        """The laws that "auto" may take for such a run, in order: those that are refused only where there is no other."""
        had = [law for law in PREFERRED[constant] if self.lacking[law] is None]
        return [law for law in had if (operation, law) not in self.refused] or had[-1:]

    def cutting_laws(self) -> set[InterpolationMode]:
        """The laws that runs may come to have."""
        apart = {operation for operation, _ in self.refused}
        alike = {int(asked): k for k, asked in enumerate(self.asked) if k not in apart}
        return {self.law(k, constant) for k in (*alike.values(), *apart) for constant in (True, False)}

    def plane(self, kin: Kinematics, q: Floats) -> tuple[WordFrame, Floats]:
        """(the tilted frame for joints q (J,), q with its rotary joints as the words state them).

        The frame is that of the tool at the rounded rotary words; its own printed angles are rounded too, and used so.
        """
        mode, control = self.controller.modes.tilted, self.control
        assert mode is not None
        words = np.round(q * control.unit, 12)
        words[control.rotary] = [round(float(words[j]), int(self.decimals[j])) + 0.0 for j in control.rotary]
        at = words / control.unit
        rotary = tuple((control.machine.axis_names[j], float(words[j])) for j in control.rotary)
        if rotary in self._planes:
            return self._planes[rotary], at
        angles, rotation = stated(mode.angles, tool_frames(kin, at[None])[0], tuple(v for _, v in rotary),
                                  mode.decimals)
        tilted = control.under("tilted", Plane(rotation, control.origin))
        frame = WordFrame(_with_arcs(tilted, mode), angles, rotary)
        self._planes[rotary] = frame
        return frame, at

    @cached_property
    def _planes(self) -> dict[tuple[tuple[str, float], ...], WordFrame]:
        return {}


def _with_arcs(control: Control, mode: Mode | None) -> Control:
    """The control with the arcs that its mode takes."""
    if mode is None or (mode.arcs and mode.arc_planes == control.arc_planes):
        return control
    return replace(control, arc_limit=control.arc_limit if mode.arcs else 0.0, arc_planes=mode.arc_planes)


def output_modes(control: Control, controller: ControllerFile, setup: SetupFile, options: Options, toolpath: Toolpath,
                 decimals: Ints, refused: Refused = frozenset()) -> tuple[OutputModes, list[Diagnostic]]:
    """The modes of a job, and what is asked for but cannot be had."""
    default = setup.output.default if options.output == "auto" else options.output
    names = [setup.output.operations.get(op.name, default) for op in toolpath.operations]
    modes = OutputModes(control, controller, np.array([ASKED.index(name) for name in names], dtype=np.int8), decimals,
                        setup.output.tool_call, refused)
    return modes, [*_not_available(modes, toolpath), *_unknown_operations(setup, options, toolpath),
                   *_no_subprograms(controller, setup, options)]


def _missing(what: MissingMode, machine: str) -> str:
    """What is missing for a mode, in words."""
    words: dict[MissingMode, str] = {
        "own kinematics": "the control runs the kinematics of this machine for the whole program",
        "no tip modes": f"{machine} is not a serial machine with slides X, Y, Z along its axes and a rotary axis",
        "no tool call": "it needs the tool's length in a register, and the set-up has [output] tool_call = false",
        "no tip mode of the control": "the controller has no tool-centre-point mode ([modes.tcp])",
        "no retract axis": f"the mode is entered at home with the tables at zero, and {machine} names no retract_axis",
        "no plane of the control": "the controller has no tilted plane ([modes.tilted])",
        "rotary head": f"the controller's plane is for rotary tables only, {machine} has a rotary head"}
    return words[what]


def _not_available(modes: OutputModes, toolpath: Toolpath) -> list[Diagnostic]:
    result = []
    can = ", ".join(law for law, why in modes.lacking.items() if not why)
    for asked in distinct(modes.asked).tolist():
        law = ASKED[asked]
        missing = modes.lacking[law] if law != "auto" else None
        absent = OPTION_OF.get(law)
        if absent and modes.control.machine.options.absent(absent):
            where, line = modes.control.machine.options.stated[absent]
            result.append(error("output.option", f"output mode {law} needs an option that the control does not have by the "
                                f"machine file: {absent} = false", file=where, lines=[line],
                                hint=f"take {absent} out of [control] or state true where it is fitted; without it this "
                                f"controller and machine have: {can}"))
            continue
        if missing is not None:
            lines = [op.line for op, a in zip(toolpath.operations, modes.asked, strict=True) if a == asked and op.line]
            result.append(error("output.mode", f"output mode {law} is not possible: "
                                f"{_missing(missing, modes.control.machine.name)}", file=toolpath.file,
                                lines=lines[:6], count=max(len(lines), 1), hint=f"this controller and machine have: {can}"))
    return result


def _no_subprograms(controller: ControllerFile, setup: SetupFile, options: Options) -> list[Diagnostic]:
    if not setup.output.divided or controller.subprograms.call:
        return []
    key = "files" if setup.output.files else "subprograms"
    table = "subprogram_files" if setup.output.files else "subprograms"
    return [error("output.subprograms", f"[output] {key}: the controller has none ([{table}] of its file)",
                  file=options.setup, lines=line_of(options.setup, ("output", key)),
                  hint="restart = true begins every operation afresh in one program")]


def _unknown_operations(setup: SetupFile, options: Options, toolpath: Toolpath) -> list[Diagnostic]:
    names = {op.name for op in toolpath.operations}
    known = ", ".join(sorted(n for n in names if n)) or "no named operation"
    return [error("setup.operation", f"[output.operations] names {name!r}, which is not an operation of the CL file",
                  file=options.setup, lines=line_of(options.setup, ("output", "operations", name)),
                  hint=f"it has: {known}")
            for name in setup.output.operations if name not in names]


def turning_run(lines: list[int], file: str) -> Diagnostic:
    """A run that turns the tool while it is to be written in a tilted plane."""
    return error("output.turning", "output mode tilted for a run that turns the tool axis", file=file, lines=lines[:6],
                 count=len(lines), hint="use auto or tcp for this operation")


@lru_cache(maxsize=8)
def table_axes(control: Control) -> Ints:
    """Joint numbers of the rotary axes that carry the part: those that turn the slides as the table sees them."""
    kin, found = control.machine.kinematics, np.zeros(0, dtype=np.int64)
    if control.has_tip_modes:
        q = np.zeros((1 + len(control.rotary), kin.joints))
        q[np.arange(1, len(q)), control.rotary] = 0.7
        slides = kin.slide_directions(q, control.xyz)
        turned = [not np.allclose(slides[0], other, atol=1e-9) for other in slides[1:]]
        found = control.rotary[np.array(turned, dtype=bool)]
    found.setflags(write=False)
    return found
