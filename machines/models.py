"""The machine file: what each key may hold. Lengths mm, angles degrees, times s (so mm/s, deg/s2, ...)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Iterable, Iterator
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, Field, PrivateAttr

from machines.certificate.lookup import comes_with_package
from machines.choices import Park, Rapids, RolloverRule, SplineBlocks, Stop
from machines.dynamics_models import DynamicsModel, StiffnessModel
from machines.figures import Document, FigureSource, FigureTable, by_key, source_problems
from machines.hooks import HooksModel
from machines.key_problem import KeyProblem
from machines.kinematics.base import Kinematics
from machines.machine import ControlKinematics
from machines.user_model import UserModel
from toolpaths.arrays import Floats
from toolpaths.units import DEG

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Vector = tuple[float, float, float]
JOINTS_ARE_AXES = "trivkins"
"""LinuxCNC's name for no kinematics of the control's own"""


def _upward(travel: Any) -> Any:
    if travel != "unlimited" and not travel[0] < travel[1]:
        raise ValueError(f"{list(travel)} is empty; write [lower, upper]")
    return travel


def _whole_turn(turn: tuple[float, float]) -> tuple[float, float]:
    if not (turn[1] - turn[0] == 360.0 and turn[0] <= 0.0 < turn[1]):
        raise ValueError(f"{list(turn)} is not one whole turn with 0 in it; write [0, 360] or [-180, 180]")
    return turn


Turn = Annotated[tuple[float, float], AfterValidator(_whole_turn)]
Register = Annotated[str, Field(pattern=r"^T( \+ [1-9][0-9]{0,3})?$")]
MCode = Annotated[str, Field(pattern=r"^(M[0-9]{1,5})?$")]
AxisFigure = Literal["travel", "velocity", "acceleration", "jerk", "home"]
TimingFigure = Literal["tool_change", "clamp", "unclamp"]
Interval = Annotated[tuple[float, float], AfterValidator(_upward)]
Travel = Annotated[tuple[float, float] | Literal["unlimited"], AfterValidator(_upward)]


class KinematicsModel(UserModel):
    """Base of the `[kinematics]` table of every kind of machine (`kinds.py`)."""

    kind: str
    """kind of machine; decides which other keys there are"""
    _certificate: str = PrivateAttr("")

    @property
    def certificate(self) -> str:
        """The file that proves the declared workspace to be reached and free of singular positions; "" where it has to be
        sampled."""
        return self._certificate

    @property
    def examined(self) -> bool:
        """True where the proof comes with the package: `problems` need not look at the workspace."""
        return comes_with_package(self._certificate)

    def take_certificate(self, file: str) -> None:
        """There is such a proof."""
        self._certificate = file

    @abstractmethod
    def build(self) -> Kinematics:
        """The kinematics at the gauge point; called only where `problems` has none."""

    def describe(self) -> str:
        """The structure in one line: ISO 10791-6 code, or what the kind is called."""
        return self.kind

    def problems(self) -> Iterator[KeyProblem]:
        """What makes the geometry unusable; paths within this table."""
        yield from ()

    def travel_problems(self, travel: Floats, home: Floats) -> Iterator[KeyProblem]:
        """What makes travels (J, 2) and home (J,), mm and rad, unusable with the geometry; paths from the file's top."""
        yield from ()

    def figures(self) -> list[FigureTable]:
        """Tables of the geometry that name sources of their figures; paths from the top of the file."""
        return []

    def control(self, module: str) -> ControlKinematics:
        """The control's kinematics `module` with the pins that this geometry gives.

        Raises:
            ValueError: where the module cannot describe this machine, saying why.
        """
        raise ValueError(f"no module of a control is known for kind {self.kind!r}")

    def linuxcnc_keys(self) -> dict[str, str] | None:
        """What LinuxCNC's INI has no key for, by key of its section [POSTPROC]; None where it cannot run the machine."""
        return None


class AxisModel(UserModel):
    """One `[axes.LETTER]` table."""

    travel: Travel
    """[lower, upper] in machine coordinates, mm or degrees; "unlimited" for a rotary axis without end stops"""
    velocity: Positive
    """mm/s or deg/s"""
    acceleration: Positive
    """mm/s2 or deg/s2"""
    jerk: Positive
    """mm/s3 or deg/s3"""
    cutting_velocity: Positive | None = None
    """mm/s or deg/s that the axis is moved with at feed at most, where that is less than its velocity, which is
    that of rapids. Fanuc: parameter 1430, under look-ahead 1432; default: the velocity"""
    home: float
    """position for tool change and program start, mm or degrees"""
    modulo: bool = False
    """the control counts this rotary axis modulo 360 degrees (roll-over): its words stay inside one turn.
    Fanuc: parameter 1008#0 ROA = 1 and 1260 = 360; Siemens: MD30310 $MA_ROT_IS_MODULO; LinuxCNC: WRAPPED_ROTARY = 1"""
    modulo_range: Turn = (0.0, 360.0)
    """degrees, the turn that words of a modulo axis are written in"""
    rollover: RolloverRule | None = None
    """which path the control takes to a word of a modulo axis: the shorter one (Fanuc 1008#1 RAB = 0,
    Heidenhain M126), that of the word's sign (Fanuc RAB = 1, LinuxCNC), or none: it counts the turns after
    all. Default: that of the controller"""
    park: Park = "turn"
    """where an axis without end stops is parked: at the whole turn that is nearest to home, or at home
    itself, all turns unwound; a modulo axis that rolls over has no turns to unwind"""
    clamp: MCode = ""
    """M code that clamps this rotary axis, e.g. "M10", where the program has to say it; the builder's manual
    has it. Empty: the machine clamps by itself"""
    unclamp: MCode = ""
    """M code that releases it, before every block that turns it, e.g. "M11" """
    assumed: tuple[AxisFigure, ...] = ()
    """keys of this table whose figure no document states"""
    source: dict[AxisFigure, FigureSource] = Field(default_factory=dict)
    """by key: the document of `[sources]` that states its figure, and the place in it, e.g. travel = "brochure: p. 12" """

    @property
    def range(self) -> tuple[float, float]:
        """(lower, upper), infinite where unlimited."""
        return (-float("inf"), float("inf")) if self.travel == "unlimited" else self.travel


class TimingModel(UserModel):
    """The `[timing]` table, seconds."""

    tool_change: NotNegative
    """chip to chip at home"""
    clamp: NotNegative
    """to clamp a rotary axis"""
    unclamp: NotNegative
    """to release it"""
    assumed: tuple[TimingFigure, ...] = ()
    """keys of this table whose figure no document states"""
    source: dict[TimingFigure, FigureSource] = Field(default_factory=dict)
    """by key: the document of `[sources]` that states its figure, and the place in it"""


class ControlModel(UserModel):
    """The `[control]` table: what the control of this machine does of its own."""

    module: str = JOINTS_ARE_AXES
    """LinuxCNC kinematics module, where the control computes the joints itself; its pins follow from `[kinematics]`.
    trivkins: none, words are joints after all"""
    stop: Stop | None = None
    """what a stop (M0; M1 where its switch is on) switches off: "spindle and coolant", "spindle" or "nothing"; the builder's
    PLC decides on most controls. Default: what the controller file has ([stops])"""

    tilted_planes: bool | None = None
    """the option of tilted work planes is fitted (Fanuc G68.2, Haas G254 DWO, Siemens CYCLE800, Heidenhain PLANE); false:
    it is not. Default, here and below: not confirmed, it is used and the header of the program names it"""
    tip_control: bool | None = None
    """the option of tool-centre-point control (G43.4, G234 TCPC, TRAORI, TCPM)"""
    smoothing: bool | None = None
    """the option of the control's own smoothing (Fanuc G05.1 Q1); false: its blocks are left out"""
    rigid_tapping: bool | None = None
    """the option of rigid tapping (Fanuc M29); false: taps need a floating holder, where the cycle allows one"""
    helical: bool | None = None
    """the option of helical interpolation; false: helices are written as lines"""
    splines: bool | SplineBlocks | None = None
    """the option of spline interpolation (Siemens POLY, iTNC 530 SPL): true or "poly" writes splines of the CL file by it,
    one block for each cubic; "bspline" by control points (Siemens BSPLINE); a control without them gets arcs and chords,
    and a warning; default: they are arcs and chords, and a program with such blocks is refused"""
    tip_frame: Literal["table", "entry"] | None = None
    """what X, Y, Z are the tip in, where a rotary table stands turned when tool-centre-point control is switched on (Fanuc
    parameter 19696#5 WKP); default: as the controller file has it ([modes.tcp] frame)"""
    power_on: tuple[Annotated[str, Field(pattern=r"^G[0-9]+(\.[0-9]+)?$")], ...] = ()
    """codes that this machine puts in force before every program (Fanuc parameter 3402), next to those of the controller
    file ([start] codes)"""
    settings: tuple[Annotated[str, Field(min_length=4)], ...] = ()
    """parameters and settings that are as programs need them, each by words of its "needs ..." line in the header, which
    then leaves it out: settings = ["5006#6 TOS = 1", "rotary values of 0"]"""
    rapids: Rapids | None = None
    """path of rapids that move several axes: "straight" or "dog-leg", each axis at its own speed. Fanuc: parameter 1401#1
    LRP; Haas: setting 335; Siemens: RTLION, RTLIOF. Default: what the controller file has ([kinematics] rapids)"""
    largest_feed: Positive | None = None
    """mm/min, as F words have it: the largest cutting feed of the machine, which the control clamps greater feeds to or
    refuses. Fanuc: parameter 1422; default: none but the velocities of the axes"""
    largest_spindle_speed: Positive | None = None
    """rev/min: cuts at more are refused, and `setup new` takes no more; default: not stated, nothing is checked"""
    look_ahead: int | None = Field(default=None, ge=1)
    """blocks that the control sees ahead while it plans speeds, by the option that is fitted; default: as the model of the
    cycle time has it"""
    block_time: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    """s that the control takes for a block at least; default: likewise"""
    length_register: Register = "T"
    """the length register H of a tool for which the CL file names none or the tool's number T: "T", or "T +
    20"; of controls that name registers"""
    radius_register: Register | None = None
    """the register D of a CUTCOM that names none or the tool's number, by the same rule, e.g. "T + 30";
    default: that of the length where D is modal, else the tool's own"""


class MachineModel(UserModel):
    """A machine file."""

    description: str
    """one line"""
    kinematics: KinematicsModel
    axes: dict[str, AxisModel]
    """travel and dynamics by axis letter"""
    retract_axis: str | None = None
    """linear axis that lifts the tool off the part at home"""
    timing: TimingModel
    control: ControlModel | None = None
    """what the control of this machine does of its own, and which options it has"""
    hooks: HooksModel = HooksModel.unstated()
    """blocks of the shop round tool calls, indexing moves, operations and stops"""
    dynamics: DynamicsModel | None = None
    """masses of what the axes move, and what the motors can give"""
    stiffness: StiffnessModel | None = None
    """what rods, joints and drives yield by"""
    sources: dict[str, Document] = Field(default_factory=dict)
    """documents that figures come from, by a short name that `source` of the tables begins with"""

    def problems(self) -> Iterator[KeyProblem]:
        """Faults between tables; the geometry's first, for without it the rest means nothing."""
        geometry = [KeyProblem(p.code, ("kinematics", *p.path), p.message, p.hint) for p in self.kinematics.problems()]
        yield from geometry
        yield from source_problems(self.sources, self.figures())
        if geometry:
            return
        kinematics = self.kinematics.build()
        rotary = dict(zip(kinematics.axis_names, kinematics.rotary, strict=True))
        axes = list(self._axis_problems(rotary)) or list(self._travel_problems(kinematics))
        yield from axes
        if self.dynamics is not None and not kinematics.chain and kinematics.leg_parts is None:
            yield KeyProblem("machine.dynamics", ("dynamics",), "masses are known of chains of axes and of platforms on "
                             "legs that end in joints, not of this machine", "take [dynamics] out")
        elif self.dynamics is not None:
            yield from self.dynamics.problems(*_moving_parts(kinematics))
        if self.stiffness is not None:
            yield from self.stiffness.problems(kinematics.leg_parts is not None)
        parts = kinematics.clearance_parts
        held = () if parts is None else parts.leg_names
        if self.retract_axis is not None and (rotary.get(self.retract_axis, True) or self.retract_axis in held):
            slides = ", ".join(name for name, turns in rotary.items() if not turns and name not in held)
            yield KeyProblem("machine.retract-axis", ("retract_axis",), f"retract_axis = {self.retract_axis!r} is not a "
                             "linear axis of this machine" + " that lifts the tool by itself" * bool(held),
                             f"choose from {slides}" if slides else "take retract_axis out: a leg moves the tool aside too")
        if self.control is not None:
            try:
                self.control_kinematics()
            except ValueError as fault:
                yield KeyProblem("machine.control", ("control", "module"), str(fault),
                                 "write one that is known, or take module out: joints are the program's axes then")

    def figures(self) -> list[FigureTable]:
        """The tables that hold figures with a source, or assumed ones."""
        axes = [FigureTable(("axes", name), a.assumed, by_key(a.source)) for name, a in self.axes.items()]
        masses = [] if self.dynamics is None else self.dynamics.figures()
        if self.stiffness is not None:
            masses = [*masses, FigureTable(("stiffness",), self.stiffness.assumed, by_key(self.stiffness.source))]
        timing = FigureTable(("timing",), self.timing.assumed, by_key(self.timing.source))
        return [*self.kinematics.figures(), *axes, *masses, timing]

    def control_kinematics(self) -> ControlKinematics | None:
        """What the control runs; None where joints are the program's axes.

        Raises:
            ValueError: where the module cannot describe this machine, saying why.
        """
        if self.control is None or self.control.module == JOINTS_ARE_AXES:
            return None
        return self.kinematics.control(self.control.module)

    def _travel_problems(self, kinematics: Kinematics) -> Iterator[KeyProblem]:
        scale = np.where(kinematics.rotary, DEG, 1.0)
        axes = [self.axes[name] for name in kinematics.axis_names]
        travel, home = np.array([axis.range for axis in axes]), np.array([axis.home for axis in axes])
        yield from self.kinematics.travel_problems(travel * scale[:, None], home * scale)

    def _axis_problems(self, rotary: dict[str, bool]) -> Iterator[KeyProblem]:
        for name in rotary.keys() - self.axes.keys():
            yield KeyProblem("machine.axis-missing", ("axes",), f"axis {name} of the kinematics has no table",
                             f"add [axes.{name}] with travel, velocity, acceleration, jerk, home")
        for name, axis in self.axes.items():
            if name not in rotary:
                yield KeyProblem("machine.axis-unknown", ("axes", name),
                                 f"[axes.{name}]: the kinematics has no axis {name}", f"its axes are {', '.join(rotary)}")
            elif axis.travel == "unlimited" and not rotary[name]:
                yield KeyProblem("machine.travel", ("axes", name, "travel"),
                                 f"linear axis {name} cannot have unlimited travel", "write travel = [lower, upper] in mm")
            elif (axis.cutting_velocity or 0.0) > axis.velocity:
                yield KeyProblem("machine.cutting-velocity", ("axes", name, "cutting_velocity"),
                                 f"axis {name} has cutting_velocity = {axis.cutting_velocity:g}, more than its velocity "
                                 f"{axis.velocity:g}", "the velocity is that of rapids: write one that is not greater")
            elif problem := _modulo_problem(name, axis, rotary[name]) or _clamp_problem(name, axis, rotary[name]):
                yield problem
            elif not axis.range[0] <= axis.home <= axis.range[1]:
                yield KeyProblem("machine.home", ("axes", name, "home"),
                                 f"home {axis.home:g} of {name} lies outside its travel {list(axis.range)}",
                                 f"write home = {min(max(axis.home, axis.range[0]), axis.range[1]):g}, or correct travel")


def _moving_parts(kinematics: Kinematics) -> tuple[dict[str, Collection[str]], tuple[str, ...]]:
    """What each axis is, by letter, and of "platform" and "head" those that there are: see `DynamicsModel.problems`."""
    names = kinematics.axis_names
    found: dict[str, Collection[str]] = dict.fromkeys(names, ())
    if (parts := kinematics.leg_parts) is None:
        return found, ()
    for at, stretches in zip(parts.legs_at, parts.stretches, strict=True):
        found[names[at]] = ("leg", "length") if stretches else ("leg",)
    found |= {names[at]: ("carrier",) for at in parts.carriers_at}
    return found, ("platform", "head") if any(axis.at_spindle for axis in parts.axes) else ("platform",)


def blanks(numbers: Iterable[float]) -> str:
    """Numbers with blanks between them, as LinuxCNC's files have them."""
    return " ".join(f"{float(number):.15g}" for number in numbers)


def register_beyond(rule: str) -> int:
    """What a rule ("T + 20") adds to the number of the tool."""
    return int(rule.partition("+")[2] or 0)


def _modulo_problem(name: str, axis: AxisModel, rotary: bool) -> KeyProblem | None:
    """What stands against the keys of roll-over of an axis."""
    used = [key for key in ("modulo", "modulo_range", "rollover", "park") if key in axis.model_fields_set]
    path = ("axes", name, *used[:1])
    if axis.modulo and not rotary:
        return KeyProblem("machine.modulo", path, f"linear axis {name} cannot be modulo", "take modulo out")
    if used and axis.travel != "unlimited" and (axis.modulo or "park" in used):
        return KeyProblem("machine.modulo", path, f"axis {name} has {used[0]}, and its travel ends at {list(axis.range)}",
                       'write travel = "unlimited" for an axis without end stops, else take it out')
    stray = [key for key in used if key in ("modulo_range", "rollover")]
    if stray and not axis.modulo:
        return KeyProblem("machine.modulo", ("axes", name, stray[0]), f"axis {name} has {stray[0]}, and is not modulo",
                       f"add modulo = true, or take {stray[0]} out")
    if axis.rollover == "sign" and axis.modulo_range[0] != 0.0:
        return KeyProblem("machine.modulo", ("axes", name, "modulo_range"), f"axis {name}: where the sign of a word is the "
                       f"direction, words are 0 to 360 degrees, not {list(axis.modulo_range)}", "modulo_range = [0, 360]")
    return None


def _clamp_problem(name: str, axis: AxisModel, rotary: bool) -> KeyProblem | None:
    """What stands against the clamp codes of an axis."""
    used = "clamp" if axis.clamp else "unclamp"
    if not axis.clamp and not axis.unclamp:
        return None
    if not rotary:
        return KeyProblem("machine.clamp", ("axes", name, used), f"linear axis {name} has {used}",
                          f"take {used} out")
    if not axis.clamp or not axis.unclamp or axis.clamp == axis.unclamp:
        return KeyProblem("machine.clamp", ("axes", name, used), f"axis {name} has clamp = {axis.clamp!r} and unclamp = "
                          f"{axis.unclamp!r}", 'write both, two codes, e.g. clamp = "M10", unclamp = "M11"')
    return None
