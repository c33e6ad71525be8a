"""The controller file: how blocks are spelt, arcs, cycles, feeds, what lies between blocks, output modes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, PrivateAttr

from machines.choices import Rapids, RolloverRule, Stop
from machines.user_file import load_toml
from machines.user_model import UserModel
from postproc.base.length_text import INCH, MM, LengthText
from postproc.controllers.cycles import Cycles
from postproc.controllers.output_modes import Modes
from postproc.controllers.pivots import PivotNames
from postproc.controllers.spelling import (
    Codes,
    Comment,
    Format,
    InchFormat,
    PartAlignment,
    ProgramBlocks,
    SmoothingLevel,
    SubprogramFormat,
    Tools,
    Units,
)
from postproc.controllers.texts import placeholders
from toolpaths.diagnostics import Diagnostic
from toolpaths.units import MM_PER_INCH

SMOOTHING = r"^G[0-9]+(\.[0-9]+)?(( ?, ?| )[A-Z][0-9]+(\.[0-9]*)?)*$"
"""words that a reader knows the control's smoothing by; Mazak and Mitsubishi put a comma before some ("G61.1,K3")"""
SmoothingText = Annotated[str, Field(pattern=SMOOTHING)]
Worded = Annotated[str, placeholders("letter", "value")]


WriterName = Literal["iso", "linuxcnc", "fanuc", "haas", "siemens", "heidenhain"]
"""dialects: each has a writer, a reader and a form of tool tables"""


class ArcRules(UserModel):
    """Which arcs the controller takes."""

    enabled: bool = True
    """arcs are written as arcs, else as lines"""
    largest_radius: float = Field(default=10000.0, gt=0.0)
    """mm; larger arcs are written as lines"""
    helix_planes: tuple[Literal[17, 18, 19], ...] = (17, 18, 19)
    """planes in which an arc may move along the third axis too"""
    helix_by_angle: bool = False
    """helices state the angle that they sweep, not their end (Klartext CP IPA): its last decimal moves the end"""
    start: tuple[str, ...] = ()
    """blocks of the safe start in programs that hold arcs in G18 or G19"""
    helical_option: str = ""
    """the option that arcs which rise need: a comment in the header of programs with such, where the machine file does
    not confirm it"""


class SplineRules(UserModel):
    """Cubics that the controller runs as one block, where the machine file says that the option is fitted."""

    word: str = ""
    """by which a program is known to hold such blocks; empty: the controller has none"""
    decimals: int = Field(default=6, ge=4, le=9)
    """of coefficients, mm or inches; where they have an exponent, of the mantissa"""
    control_points: str = ""
    """by which blocks state control points of a clamped cubic, the first one being where the tool stands; empty: none do"""
    interval: str = ""
    """stands in each of them: the same step between knots"""
    relies_on: str = ""
    """what a program with control points relies on, for its header"""


class FeedRules(UserModel):
    """Rules of the feed word."""

    inverse_time: bool = True
    """the controller has a feed by inverse time"""
    word_every_inverse_block: bool = True
    """every block of inverse time states its feed"""
    cleared_by_mode_change: bool = True
    """the feed must be stated again after a change of the feed mode"""
    least_inverse_rate: float = Field(default=0.0, ge=0.0)
    """mm/min below which inverse time runs X, Y, Z faster than asked (LinuxCNC 0.1)"""
    length: Literal["xyz-first", "all", "geometry"] = "xyz-first"
    """what a feed per minute refers to where X, Y, Z are machine coordinates: X, Y, Z before rotary axes, all axes
    alike, or the geometry axes before all others"""
    arc_inverse: Literal["length", "radius", "refuse"] = "length"
    """inverse time in arcs: speed by length, speed by radius, or not allowed"""
    limited_jerk: bool = True
    """the control limits the jerk of the axes: planned feeds are speeds of the plan, its ramps point by point; false: it
    makes its ramps by itself, and planned feeds are those that keep all limits while they are constant"""
    kept_by_units: bool = False
    """F counts in the units that hold before its block, and a change of units leaves the feed as it is; else F counts in
    the units of the block that moves"""


OutsideCorners = Literal["", "arc", "intersection"]


class CutterCompensation(UserModel):
    """Rules of cutter compensation next to its codes; moves are those in the plane of the words."""

    begins_on_arc: bool = False
    """the first move behind G41 or G42 may be an arc"""
    ends_on_arc: bool = False
    """the first move behind G40 may be an arc"""
    start: Literal["", "next"] = ""
    """where the first move behind G41 and G42 ends, and the one behind G40 begins. next: the radius off the contour, square
    to it, straight from and to the side of the tool; empty: otherwise or not known, nothing is offset back to the contour"""
    corners: OutsideCorners = ""
    """how the tool goes round outside corners of the contour: arc, on its radius round them; intersection of the shifted
    lines, up to a right angle; empty: not known"""
    states: str = ""
    """block before G41 or G42 of a contour that was offset back: what the control must have in force for these rules"""
    modal_register: bool = False
    """D holds until another is stated, whatever tool is loaded: where CUTCOM names none, the number of the
    tool's length register is written"""
    holds: str = "D{register}"
    """what holds the radius or its wear, as the header names it: {register} is that of CUTCOM, else the
    number of the tool"""


class InterpolationRules(UserModel):
    """Which motion lies between two blocks."""

    linear: Literal["joints"] = "joints"
    """straight in the joints, where words are machine coordinates"""
    rapids: Rapids = "straight"
    """dog-leg: every axis at its own rapid speed, so that the tool leaves the straight line"""
    modules: bool = False
    """the controller can run the kinematics named in a machine's [control] table; programs then hold the tip"""
    smoothing_share: float = Field(default=0.0, ge=0.0, le=0.8)
    """share of the tolerance left to the controller's own smoothing"""
    smoothing_fixed: float | None = Field(default=None, ge=0.0)
    """mm that it takes instead of a share, where its tolerance is a parameter of the control"""
    blends_unstated: bool = False
    """where a program states no path mode, corners are blended without a limit"""
    exact_path_rests: bool = False
    """under G61 the axes rest at the end of each block; else only where the path turns"""
    smoothing_in_modes: bool = True
    """it may be changed while the tip's or a plane's mode is on"""
    axis_smoothing_share: float = Field(default=0.0, ge=0.0, le=0.8)
    """share of the axis tolerance left to it"""


class RolloverRules(UserModel):
    """Modulo (roll-over) rotary axes: which path the control takes from word to word, and how words say it."""

    default: RolloverRule = "none"
    """of modulo axes whose machine file has no rollover; "none": they count their turns like others"""
    rules: tuple[RolloverRule, ...] = ("shortest", "sign", "none")
    """those that the control can have, by its parameters"""
    shortest: Worded = ""
    """how a word says that the shorter path is taken, with {letter} and {value}; empty: a parameter says it"""
    positive: Worded = ""
    """how it says that the axis turns in its positive direction; used for half a turn and more"""
    negative: Worded = ""
    """the same for the negative one"""
    zero_negative: Literal["-0", "-360"] = "-360"
    """the word of 0 degrees that is reached in the negative direction, where the sign is the direction; "-0"
    only where the control is known to heed the sign of zero"""
    on: tuple[str, ...] = ()
    """blocks of the safe start that put the shorter path in force, in programs for machines with modulo axes"""
    needs: dict[Literal["shortest", "sign"], Annotated[str, placeholders("axes")]] = Field(default_factory=dict)
    """settings that each rule needs: a comment in the header of programs for machines with modulo axes; {axes}
    are their letters"""


class Start(UserModel):
    """What is in force where a program begins."""

    codes: tuple[Annotated[str, Field(pattern=r"^G[0-9]+(\.[0-9]+)?$")], ...] = ()
    """codes that the control itself puts in force before every program, whatever ran before it (power-on or reset states
    that no parameter changes): `verify` takes them as stated; all other states the program must state itself"""


class Stops(UserModel):
    """What the control does at M0, and at M1 where its switch is on."""

    switch_off: Stop = "spindle and coolant"
    """what they switch off by themselves, where the machine file does not say ([control] stop): the read-back
    counts it as standing from there on. Programs restate spindle and coolant behind every stop, whatever stands here"""
    tool_change: Stop = "spindle and coolant"
    """what a tool change switches off by itself"""


class LinkRules(UserModel):
    """Linking moves as the control's maker wants them."""

    index: Literal["plane", "home"] = "plane"
    """where the tool waits while a link turns rotary axes, where the set-up does not say: on the safe plane,
    or with the retract axis at home"""


class ControllerFile(UserModel):
    """A controller: how its programs are spelt, and what it does with them."""

    description: str
    """one line for people"""
    writer: WriterName = "iso"
    """class that adds what data cannot say"""
    axes: Annotated[str, Field(pattern="^[A-Z]+$")] = "XYZUVWABC"
    """letters that words of axes may have"""
    sources: tuple[str, ...] = ()
    """documents that the rules come from"""
    _file: str = PrivateAttr(default="")
    format: Format = Format.unstated()
    units: Units = Units.unstated()
    """the words that state mm or inches"""
    inch: InchFormat = InchFormat.unstated()
    """what is different in a program in inches"""
    comment: Comment = Comment.unstated()
    program: ProgramBlocks = ProgramBlocks.unstated()
    start: Start = Start.unstated()
    codes: Codes = Codes.unstated()
    tools: Tools = Tools.unstated()
    stops: Stops = Stops.unstated()
    subprograms: SubprogramFormat = SubprogramFormat.unstated()
    subprogram_files: SubprogramFormat = SubprogramFormat(place="files")
    """the same in files of their own, which the set-up may ask for"""
    arcs: ArcRules = ArcRules.unstated()
    splines: SplineRules = SplineRules.unstated()
    """blocks of the control for cubics, written where the machine file says that the option is fitted"""
    cycles: Cycles = Cycles.unstated()
    feed: FeedRules = FeedRules.unstated()
    cutter_compensation: CutterCompensation = CutterCompensation.unstated()
    kinematics: InterpolationRules = InterpolationRules.unstated()
    modes: Modes = Modes.unstated()
    rollover: RolloverRules = RolloverRules.unstated()
    levels: dict[str, SmoothingLevel] = Field(default_factory=dict)
    """the control's own smoothing by kind of operation, for [output.smoothing] of the set-up"""
    smoothing_words: dict[SmoothingText, Annotated[float, Field(ge=0.0)]] = Field(default_factory=dict)
    """further words that set the control's smoothing, and the mm that each may take: "G61.1" = 0.005,
    "G61.1,K3" = 0.003 or "G05 P10000" = 0.005"""
    links: LinkRules = LinkRules.unstated()
    pivots: PivotNames = PivotNames.unstated()
    alignment: PartAlignment = PartAlignment.unstated()

    @property
    def file(self) -> str:
        """The file that it was loaded from, for diagnostics; "" for none."""
        return self._file

    @property
    def keeps_length(self) -> bool:
        """True where a tool change puts the length of the tool in force for good: no code takes it back."""
        return self.tools.length_automatic and not self.codes.length_cancel

    @property
    def plane_turns(self) -> bool:
        """True where stating a tilted plane may turn rotary axes."""
        return self.modes.tilted is not None and self.modes.tilted.turns_axes

    def with_shop(self, passive: tuple[str, ...], number: int | None) -> ControllerFile:
        """The controller with more codes that move nothing, those of the shop's hooks, and the number of the program."""
        if not passive and number is None:
            return self
        more = {"passive": tuple(dict.fromkeys((*self.program.passive, *passive))), "number": number or self.program.number}
        return self.model_copy(update={"program": self.program.model_copy(update=more)})

    def with_names(self, names: dict[int, str]) -> ControllerFile:
        """The controller that calls tools by these names too."""
        tools = self.tools.model_copy(update={"names": {**self.tools.names, **names}})
        return self.model_copy(update={"tools": tools}) if names else self

    def in_units(self, units: Literal["mm", "inch"] | None) -> ControllerFile:
        """The controller that writes lengths and feeds in the units asked for, else in its own."""
        units = units or self.format.units
        style: dict[str, object] = {"units": units}
        if units == "inch":
            style |= {"linear_decimals": self.inch.linear_decimals, "feed_decimals": self.inch.feed_decimals}
        return self.model_copy(update={"format": self.format.model_copy(update=style)})

    @property
    def unit(self) -> float:
        """mm of a unit of length in programs: 25.4 in inches."""
        return MM_PER_INCH if self.format.units == "inch" else 1.0

    @property
    def known_smoothing(self) -> dict[str, float]:
        """mm that words without a tolerance of their own may take: those of levels, and the further ones."""
        fixed = {level.blocks[-1]: level.tolerance for level in self.levels.values()
                 if level.tolerance is not None and level.blocks and re.fullmatch(SMOOTHING, level.blocks[-1])}
        return {**fixed, **self.smoothing_words}

    @property
    def lengths(self) -> LengthText:
        """How the header of a program says lengths."""
        return INCH if self.format.units == "inch" else MM

    @property
    def grain(self) -> float:
        """mm of the last decimal of a length."""
        return self.unit * 10.0 ** -self.format.linear_decimals

    @property
    def feed_unit(self) -> float:
        """mm/min of F1."""
        return MM_PER_INCH / self.inch.feed_parts if self.format.units == "inch" else 1.0

    @property
    def degree_is_inch(self) -> bool:
        """True where degrees count as inches in a feed that refers to all axes."""
        return self.format.units == "inch" and self.inch.degree == "inch"

    @property
    def units_word(self) -> str:
        """The word that states the units of the program."""
        return self.units.inch if self.format.units == "inch" else self.units.mm

    def divided(self, files: bool) -> ControllerFile:
        """The controller that writes operations into files of their own, where that is asked for."""
        return self.model_copy(update={"subprograms": self.subprogram_files}) if files else self


@cache
def builtin_files() -> Mapping[str, Path]:
    """Controller files of the product by name."""
    folder = Path(str(resources.files("postproc.controllers")))
    return {p.stem: p for p in sorted(folder.glob("*.toml"))}


def load_controller(source: str | Path) -> tuple[ControllerFile | None, list[Diagnostic]]:
    """The controller of a built-in name or a path."""
    if str(source) not in builtin_files():
        own, faults = load_toml(source, ControllerFile, builtin=builtin_files(), kind="controller")
        if own is not None:
            own._file = str(source)
        return own, faults
    spec, found = _of_package(str(source))
    return spec, [*found]


@cache
def _of_package(name: str) -> tuple[ControllerFile | None, tuple[Diagnostic, ...]]:
    """A controller of a built-in name: its files stay as they are while a process runs, and controllers do."""
    spec, found = load_toml(name, ControllerFile, builtin=builtin_files(), kind="controller")
    return spec, tuple(found)
