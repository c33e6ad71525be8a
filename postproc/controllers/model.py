"""The controller file: formats, modal groups, interpolation, arcs, cycles, feeds, comments, program frame."""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from machines.user_file import UserModel, load_toml
from postproc.controllers.texts import (
    CYCLE_VALUES,
    Named,
    Numbered,
    Registered,
    Timed,
    WorkOffsets,
    placeholders,
)
from toolpaths.diagnostics import Diagnostic


class Format(UserModel):
    """How numbers and blocks are spelt."""

    linear_decimals: int = Field(default=4, ge=0, le=9)
    rotary_decimals: int = Field(default=4, ge=0, le=9)
    feed_decimals: int = Field(default=4, ge=0, le=9)
    trim_zeros: bool = True
    """no zeros at the end of a decimal fraction"""
    decimal_point: bool = False
    """a point even in whole numbers"""
    space: bool = True
    """a blank between words"""
    line_length: int = Field(default=252, ge=40)
    """most characters of a block"""
    sequence_step: int = Field(default=0, ge=0)
    """block numbers: step, 0 for none"""
    sequence_prefix: str = Field(default="N", pattern=r"^[N:]?$")
    """letter before a block number"""
    plus_sign: bool = False
    """a sign before positive numbers too"""


class Comment(UserModel):
    """Comments of a block."""

    open: str = "("
    close: str = ")"
    forbidden: str = "()"
    """characters that a comment must not hold"""


class Frame(UserModel):
    """Blocks that stand around every program."""

    begin: tuple[Named, ...] = ("%",)
    """{name} is the program's name, {number} its number in four digits"""
    number: int = Field(default=1, ge=1, le=9999)
    """of the program, where the controller has numbers"""
    preamble: tuple[Annotated[str, placeholders("work_offset")], ...] = ()
    """safe start: units, modes and planes that the program relies on; {work_offset} is the set-up's code"""
    work_offsets: WorkOffsets = Field(default_factory=dict)
    """what the controller writes for G54 to G59 and G59.1 to G59.3; empty: those codes themselves"""
    operation: tuple[Annotated[str, placeholders("comment", "name", "number")], ...] = ()
    """blocks at the start of each operation, from where a program can be taken up: {name} of the operation, {comment} with
    it, {number} 100, 200, ..."""
    passive: tuple[Annotated[str, Field(pattern=r"^[GM][0-9]+(\.[0-9]+)?$")], ...] = ()
    """codes of the shop's own blocks that move nothing: read back without being executed"""
    path_tolerance: tuple[Annotated[str, placeholders("tolerance", "chain", "axis")], ...] = ()
    """blocks that set the control's own smoothing; {tolerance} and {chain} in mm, {axis} in degrees"""
    ending: tuple[str, ...] = ("M30",)
    end: tuple[Named, ...] = ("%",)
    """{name} and {number} as in `begin`"""


class Codes(UserModel):
    """G and M codes by canonical function."""

    traverse: str = "G0"
    feed: str = "G1"
    arc_cw: str = "G2"
    arc_ccw: str = "G3"
    planes: dict[str, str] = Field(default_factory=lambda: {"17": "G17", "18": "G18", "19": "G19"})
    per_minute: str = "G94"
    inverse_time: str = "G93"
    machine_coordinates: str = "G53"
    spindle_cw: str = "M3"
    spindle_ccw: str = "M4"
    spindle_stop: str = "M5"
    flood: str = "M8"
    mist: str = "M7"
    through: str = ""
    """coolant through the tool; empty: the controller has none, flood is used with a warning"""
    coolant_off: str = "M9"
    stop: str = "M0"
    optional_stop: str = "M1"
    tool_select: Numbered = "T{number}"
    tool_change: Numbered = "T{number} M6"
    length_offset: Registered = "G43 H{register}"
    length_cancel: str = "G49"
    dwell: Timed = "G4 P{seconds}"
    rigid_tap: Annotated[str, placeholders("speed")] = ""
    """block before a tapping cycle that couples feed and spindle"""
    compensation_left: Registered = "G41 D{register}"
    compensation_right: Registered = "G42 D{register}"
    compensation_off: str = "G40"


class Tools(UserModel):
    """Tool change, length register and preload."""

    preload: bool = False
    """the next tool is selected right after a change"""
    length_with_z: bool = False
    """the length register stands in the first block that states Z, not in a block of its own"""
    length_automatic: bool = False
    """a tool change puts the tool's length in force by itself; with an empty `length_cancel` it cannot be taken back"""
    home_without_length: bool = False
    """blocks in machine coordinates switch the length register off"""


class Subprograms(UserModel):
    """Operations as subprograms in the same file."""

    call: Annotated[str, placeholders("number")] = ""
    """block that calls one; empty: the controller has none in a file. Numbers are 1001, 1002, ..."""
    begin: tuple[Annotated[str, placeholders("number")], ...] = ()
    end: tuple[Annotated[str, placeholders("number")], ...] = ()
    place: Literal["before", "after"] = "after"
    """before the main program's first block, or behind its end"""


class Arcs(UserModel):
    """Which arcs the controller takes."""

    enabled: bool = True
    largest_radius: float = Field(default=10000.0, gt=0.0)
    """mm; larger arcs are written as lines"""
    helix_planes: tuple[Literal[17, 18, 19], ...] = (17, 18, 19)
    """planes in which an arc may move along the third axis too"""


class CannedCycle(UserModel):
    """One drilling cycle of the controller."""

    code: Annotated[str, placeholders(*CYCLE_VALUES)]
    """its code, or its whole text with values in braces (`CYCLE_VALUES`), a line each"""
    peck: str = ""
    """word of the peck depth"""
    dwell: str = ""
    """word of the dwell"""


class Cycles(UserModel):
    """Canned cycles by the kind of the CL file.

    Where a kind is missing, DRILL, THRU, CSINK, FACE, DEEP, BRKCHP, BORE and REAM become single moves; others are refused.
    TAP_LEFT stands for taps that turn anti-clockwise.
    """

    enabled: bool = True
    table: dict[str, CannedCycle] = Field(default_factory=dict)
    with_dwell: dict[str, CannedCycle] = Field(default_factory=dict)
    """used instead where the cycle dwells"""
    to_initial: str = "G98"
    to_plane: str = "G99"
    cancel: str = "G80"
    planes: tuple[int, ...] = (17,)
    """planes in which cycles may run"""
    rigid_only: tuple[str, ...] = ("TAP",)
    """kinds that must not become single moves, beside those that never do"""
    dwell_milliseconds: bool = False
    """the dwell of a cycle is a whole number of ms, else s"""
    peck_relief: float = Field(default=0.254, ge=0.0)
    """mm before the last depth to which the tool returns rapidly"""


class Feed(UserModel):
    """Rules of the feed word."""

    inverse_time: bool = True
    """the controller has a feed by inverse time"""
    word_every_inverse_block: bool = True
    cleared_by_mode_change: bool = True
    """the feed must be stated anew after a change of the feed mode"""
    least_inverse_rate: float = Field(default=0.0, ge=0.0)
    """mm/min below which inverse time runs X, Y, Z faster than asked (LinuxCNC 0.1)"""
    length: Literal["xyz-first", "all", "geometry"] = "xyz-first"
    """what a feed per minute refers to where X, Y, Z are axis positions: X, Y, Z before rotary axes, all axes alike, or
    the geometry axes before all others"""
    arc_inverse: Literal["length", "radius", "refuse"] = "length"
    """inverse time in arcs: speed by length, speed by radius, or not allowed"""


class Kinematics(UserModel):
    """Which motion lies between two blocks."""

    linear: Literal["joints"] = "joints"
    rapids: Literal["straight", "dog-leg"] = "straight"
    """dog-leg: every axis at its own rapid speed, so that the tool leaves the straight line"""
    modules: bool = False
    """the controller can run the kinematics named in a machine's [control] table; programs then hold the tip"""
    smoothing_share: float = Field(default=0.0, ge=0.0, le=0.8)
    """share of the tolerance left to the controller's own smoothing"""
    smoothing_fixed: float | None = Field(default=None, ge=0.0)
    """mm that it takes instead of a share, where its tolerance is a parameter of the control"""
    axis_smoothing_share: float = Field(default=0.0, ge=0.0, le=0.8)
    """share of the axis tolerance left to it"""


class Mode(UserModel):
    """How a mode is switched on and off, and what may stand in it."""

    enter: tuple[str, ...]
    """blocks that switch it on"""
    leave: tuple[str, ...]
    """blocks that switch it off"""
    start: tuple[str, ...] = ()
    """blocks of the safe start, in programs that use the mode"""
    relies_on: tuple[str, ...] = ()
    """settings of the control that the mode needs: comments at the head of programs that use it"""
    length: Literal["any", "off", "on"] = "any"
    """how the length register must stand where the mode is entered, and where its `leave` blocks begin"""
    arcs: bool = True
    """arcs may stand in it while the rotary axes stand still"""
    cycles: bool = True
    """canned cycles may stand in it"""
    compensation: bool = True
    """cutter compensation may stand in it"""


class TcpMode(Mode):
    """Tool-centre-point mode: X, Y, Z are the tip in the work offset, fixed to the part; F is the speed of the tip."""

    enter: tuple[Annotated[str, placeholders("register", "work_offset")], ...]
    """blocks that switch it on; {register} is the length register in force"""
    leave: tuple[Annotated[str, placeholders("register", "work_offset")], ...]
    """blocks that switch it off"""
    cycles: bool = False
    compensation: bool = False


class TiltedMode(Mode):
    """Tilted working plane: rotary axes stand still, X, Y, Z are the tip in a turned frame at the work offset's zero."""

    enter: tuple[Annotated[str, placeholders("first", "second", "third", "direction", "work_offset")], ...]
    """blocks that state the plane; {first}, {second}, {third} are the angles in the order of `angles`, {direction} is 1,
    or -1 where the first rotary axis that tilts the tool stands at a negative angle"""
    leave: tuple[Annotated[str, placeholders("work_offset")], ...]
    """blocks that end it"""
    angles: Literal["ZXZ", "ZYX", "XYZ", "rotary"]
    """turns about the axes of the moving frame, in order; "rotary": the frame is that of the rotary axes themselves"""
    decimals: int = Field(default=4, ge=0, le=9)
    """of the angles"""
    tables_only: bool = False
    """only for machines whose rotary axes all carry the part"""


class Modes(UserModel):
    """Output modes beside axis positions."""

    tcp: TcpMode | None = None
    tilted: TiltedMode | None = None


class ControllerFile(UserModel):
    """A controller."""

    description: str
    writer: Literal["iso", "linuxcnc", "fanuc", "haas", "siemens", "heidenhain"] = "iso"
    """class that adds what data cannot say"""
    sources: tuple[str, ...] = ()
    """documents that the rules come from"""
    format: Format = Format()
    comment: Comment = Comment()
    program: Frame = Frame()
    codes: Codes = Codes()
    tools: Tools = Tools()
    subprograms: Subprograms = Subprograms()
    arcs: Arcs = Arcs()
    cycles: Cycles = Cycles()
    feed: Feed = Feed()
    kinematics: Kinematics = Kinematics()
    modes: Modes = Modes()


def builtin_files() -> dict[str, Path]:
    """Controller files of the product by name."""
    folder = Path(str(resources.files("postproc.controllers")))
    return {p.stem: p for p in sorted(folder.glob("*.toml"))}


def load_controller(source: str | Path) -> tuple[ControllerFile | None, list[Diagnostic]]:
    """The controller of a built-in name or a path."""
    return load_toml(source, ControllerFile, builtin=builtin_files(), kind="controller")
