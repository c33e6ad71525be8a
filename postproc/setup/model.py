"""The set-up file: where the part stands, which system is the work offset, safe distances, tool lengths."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, Field, model_validator

from machines.hooks import HooksModel
from machines.toml_lines import KeyPath
from machines.user_file import read_toml, validate
from machines.user_model import UserModel
from postproc.base.options import OutputMode
from postproc.setup.bodies import BodiesModel, ToolBody
from postproc.setup.files import seen_from_here
from postproc.setup.hooks_file import load_hooks
from postproc.setup.joints import Joints
from postproc.setup.orientation import OrientationLimits
from postproc.setup.place import PlacementLimits
from postproc.setup.places import REGISTER, PlaceOrder, PlaceSetup
from postproc.setup.spindle import CoolantKind, SpindleSetup
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, warning
from toolpaths.shapes import arrays
from toolpaths.toolpath import Frame, Toolpath

Compensation = Literal["wear", "radius", "none"]
SetupVector = Annotated[tuple[float, float, float], Field(description="x, y, z")]


class PartPlacement(UserModel):
    """Where the part frame (the absolute frame of the CL file), or a system of the file, stands on the table,
    all axes at zero."""

    system: bool | Annotated[str, Field(min_length=1)] = False
    """true: origin, x_axis and y_axis are those of the system that is the work offset; a name: of that system
    of the CL file (see inspect); false: of the file's absolute frame"""
    origin: SetupVector = (0.0, 0.0, 0.0)
    """its origin in the table frame, mm"""
    x_axis: SetupVector = (1.0, 0.0, 0.0)
    """its x direction in the table frame"""
    y_axis: SetupVector = (0.0, 1.0, 0.0)
    """its y direction in the table frame"""


LOWER = "lower clearance.distance", "put clearance.centre nearer to the part", "lower clearance.margin"


class LinkClearance(UserModel):
    """How linking moves keep away from the part."""

    centre: SetupVector | None = None
    """centre of the safe planes in the part frame, mm; default: middle of the path's extents"""
    distance: float | None = Field(default=None, gt=0.0)
    """from the centre to every safe plane (each stands square to the tool axis), mm; default: outside the path. With
    [[places]] from the middle of each: the highest of these planes is the safe one"""
    margin: float = Field(default=50.0, gt=0.0)
    """added to the path's own extent where no distance is given, mm"""
    link_angle: float = Field(default=5.0, gt=0.0, le=180.0)
    """a rapid that turns the tool axis by more than this is linked by the safe planes, degrees"""
    index: Literal["plane", "home"] | None = None
    """where the tool waits while a link turns rotary axes: safe plane, or home (G53 Z0); default: the controller's"""
    between: Literal["home", "plane"] = "home"
    """where the tool goes between two [[places]]: the retract axis to home (G53 Z0), or along the safe plane above all"""
    in_plane: bool = False
    """true: on a machine that moves the tool in one plane alone, linking moves go straight in that plane, the tool lifted
    or switched off by other means ([hooks]); false: they are refused"""

    @property
    def lower(self) -> str:
        """What brings linking moves down, in words: one of LOWER."""
        return LOWER[0 if self.distance is not None else 1 if self.centre is not None else 2]


TOOL_LIMITS = ("tip_acceleration", "tip_jerk", "axis_rate")
"""keys of a tool that --feed planned keeps"""


class ToolSetup(ToolBody):
    """One tool in the machine."""

    gauge_length: float | None = Field(default=None, gt=0.0)
    """from the gauge point of the spindle to the tip, mm; default: not known, travel is checked as if it were 0"""
    spindle: SpindleSetup | None = None
    """where the CL file states no SPINDL for this tool, e.g. spindle = { rpm = 8000, direction = "clockwise" }"""
    coolant: CoolantKind | None = None
    """where the CL file states no COOLNT for this tool"""
    called: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]{1,31}$")] | None = None
    """name by which the control calls the tool (Siemens Operate T="...", TNC TOOL CALL "..."); default: its number"""
    compensation: Compensation | None = None
    """what CUTCOM is for this tool. wear: its register holds by how much the radius is greater than the CAM system's, 0
    for the tool as drawn (CL points of the tool's centre); radius: it holds the radius, and the path of the tool's centre
    is offset back to the contour (with contour = true the CL file holds that already); none: CUTCOM is not written, the
    words are the path of the tool's centre. Default: wear, radius where contour = true"""
    contour: bool = False
    """true: under CUTCOM the CL file holds the contour, not the path of the tool's centre"""
    keeps_spin: bool = False
    """true: its turn about its own axis matters (a probe, a tool with one edge and a spindle that is held): where the
    machine could turn it so, it stays at 0"""
    tip_acceleration: float | None = Field(default=None, gt=0.0)
    """largest acceleration of the tip along its path on the part, mm/s2; kept by --feed planned; default: no limit"""
    tip_jerk: float | None = Field(default=None, gt=0.0)
    """largest jerk of the tip along its path on the part, mm/s3; kept by --feed planned; default: no limit"""
    cutting_force: float = Field(default=0.0, ge=0.0, le=1e6)
    """N at the tip while it cuts, in the direction that is worst: taken off what the motors can give, where the machine file
    says that ([dynamics]); the deflection that `convert` prints is under it"""
    axis_rate: float | None = Field(default=None, gt=0.0)
    """largest rate at which the tool axis turns on the part, degrees/s; kept by --feed planned; default: no limit"""

    @property
    def limited(self) -> bool:
        """True where the tool has a limit of its own."""
        return any(getattr(self, name) is not None for name in TOOL_LIMITS)

    @property
    def length(self) -> float:
        """Gauge length, mm, 0 where it is not known."""
        return self.gauge_length or 0.0


class OutputSettings(UserModel):
    """What the words of the program mean, and how it is divided."""

    units: Literal["mm", "inch"] | None = None
    """of lengths and feeds in the program: coordinates, arcs, cycles, pitches, planes, header and proof; default: as the
    controller file has them ([format] units), mm. Angles, and feeds of rotary axes alone, stay degrees"""
    default: OutputMode = "auto"
    """axes: machine coordinates; tcp: tool-centre-point control; tilted: the tip in a tilted work plane,
    rotary axes standing still; auto: the best that controller and machine can. --output-mode takes precedence"""
    operations: dict[str, OutputMode] = Field(default_factory=dict)
    """by name of the operation"""
    smoothing: dict[str, str | Annotated[float, Field(gt=0.0)]] = Field(default_factory=dict)
    """of the control itself, by name of the operation: a level of the controller file ("roughing", "finishing"), or the
    mm that it may take, which the bound counts; others have that of the controller file"""
    restart: bool = False
    """every operation begins at home with everything restated, so that the program can be taken up there"""
    subprograms: bool = False
    """every operation is a subprogram, of the same file or (Siemens) in one of its own; it begins as with restart"""
    files: bool = False
    """every operation is a subprogram in a file of its own next to the program, which calls them"""
    longest: int = Field(default=0, ge=0)
    """most CL points of one part: longer operations are cut at rapids, each part begins as with restart; 0: any"""
    feed: float | None = Field(default=None, gt=0.0)
    """of cuts for which the CL file has stated none (no FEDRAT before them) but taps, mm/min; default: they are refused"""
    spindle: SpindleSetup | None = None
    """of tools for which neither the CL file (SPINDL) nor [tools.N] states one; default: cuts without it are refused"""
    coolant: CoolantKind | None = None
    """of tools for which neither the CL file (COOLNT) nor [tools.N] states one; default: off"""
    tool_call: bool = True
    """false: the program calls no tool and no length: the one tool of the file stands in the spindle already
    and its length is measured into the work offset. [tools.N] gauge_length (N = 0 for a tool without a
    number) is then part of the work offset that the header names"""

    program_number: int | None = Field(default=None, ge=1, le=9999)
    """of the program on controls that number them (O1234); default: that of the controller file"""
    program_name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_]{1,24}$")] | None = None
    """of the program on controls that name them (BEGIN PGM NAME MM) and of its subprograms; default: that of
    the output file"""
    rapids_as_feed: bool = False
    """true: rapids that would leave their line, each axis running at its own speed (dog-leg), are written as G1 at the speed
    of the slowest axis. Controls clamp or refuse such feeds, and the rapid override does not act on them. false: they
    stay G0, split where that is safe, else they are refused"""
    stop_between_tools: bool = False
    """an optional stop (M1) before every tool change but the first, spindle and coolant off; where the CL
    file stops there itself, none besides"""

    @property
    def apart(self) -> bool:
        """True where nothing that holds in one operation may be needed in the next."""
        return self.restart or self.divided or self.longest > 0

    @property
    def divided(self) -> bool:
        """True where operations are subprograms."""
        return self.subprograms or self.files


class Pivot(UserModel):
    """A rotary axis as the control's kinematics holds it."""

    point: SetupVector
    """a point of its line when all axes stand at 0, in machine coordinates, mm"""


class Stock(UserModel):
    """A box in the part frame, mm."""

    low: SetupVector
    """its least x, y, z"""
    high: SetupVector
    """its greatest x, y, z"""

    @property
    def corners(self) -> Floats:
        """(8, 3)"""
        return np.asarray(np.array([self.low, self.high])[np.indices((2, 2, 2)).reshape(3, -1).T, np.arange(3)])


class RewindSettings(UserModel):
    """Unwinding an axis in the middle of a run, where its travel ends."""

    allowed: bool = True
    """false: a path that needs a rewind is refused"""
    feed: float | None = Field(default=None, gt=0.0)
    """of the return into a cut, mm/min; default: that of the cut"""
    stock: Stock | None = None
    """the tool is drawn out of this box (and of what is cut); default: to the safe plane"""


class SetupFile(UserModel):
    """A set-up. Everything has a default: part frame on the table frame, first system of the file as work offset."""

    description: str = ""
    """one line"""
    assumed: list[str] = Field(default_factory=list)
    """keys whose values nobody has stated, e.g. assumed = ["tools.1.spindle", "output.feed"]: convert warns of each"""
    machine: str = ""
    """name of the machine that the set-up is for: on another one convert warns; default: any"""
    work_offset: str = ""
    """name of the system of the CL file that is the work offset; default: its first"""
    work_offset_code: str = Field(default="G54", pattern=REGISTER)
    """register of the control that holds it: G54 to G59, or a further one by the control's own name, as "G54.1 P12" (Fanuc),
    "G154 P40" or "G110" (Haas), "G520" (Siemens), "preset 12" (TNC), "G59.1" (LinuxCNC)"""
    part: PartPlacement = PartPlacement.unstated()
    places: list[PlaceSetup] = Field(default_factory=list, max_length=99)
    """[[places]]: the part stands at several places, each with a work offset of its own; [part] and work_offset_code
    are then those of no place, but what places do not state is as in [part]"""
    order: PlaceOrder = "tool"
    """of the places: tool: all that one tool cuts at every place before the next tool; part: one part after the other"""
    placement: PlacementLimits = PlacementLimits.unstated()
    clearance: LinkClearance = LinkClearance.unstated()
    tools: dict[Annotated[str, Field(pattern=r"^(0|[1-9][0-9]*)$")], ToolSetup] = Field(default_factory=dict)
    """by tool number without leading zeros, e.g. [tools.1]"""
    tool_numbers: dict[Annotated[str, Field(min_length=1)], Annotated[int, Field(ge=1, lt=10**9)]] = Field(
        default_factory=dict)
    """by name of the tool in the CL file (see inspect), e.g. [tool_numbers] "EM12" = 2: its number, whatever
    the file loads it by, and where it loads none; lengths in [tools.2] are then its. "unnamed" is a tool
    without name and number"""
    output: OutputSettings = OutputSettings.unstated()
    control_pivots: dict[Annotated[str, Field(pattern="^[ABC]$")], Pivot] = Field(default_factory=dict)
    """by rotary axis, e.g. [control_pivots.A]: what the control's parameters say; default: as the machine file"""
    rewind: RewindSettings = RewindSettings.unstated()
    joints: Joints = Joints.unstated()
    hooks: HooksModel = HooksModel.unstated()
    """blocks of the shop for this job, as in the machine file: a key that is stated here takes the place of that there"""
    bodies: BodiesModel | None = None
    """part, table and fixtures that the tools must not touch"""
    orientation: OrientationLimits = OrientationLimits.unstated()

    @model_validator(mode="after")
    def _places_differ(self) -> SetupFile:
        for key in ("name", "work_offset_code"):
            given = [getattr(one, key) for one in self.places]
            if twice := next((one for k, one in enumerate(given) if one in given[:k]), None):
                raise ValueError(f"places: {key} = {twice!r} stands twice")
        return self

    @model_validator(mode="after")
    def _assumed_keys(self) -> SetupFile:
        for key in self.assumed:
            if stated_value(self, key) is None:
                raise ValueError(f"assumed names {key!r}, which the set-up does not state")
        return self


def at_places(setup: SetupFile) -> list[SetupFile]:
    """The set-up of each place, with its [part] and register; the set-up itself where it names none."""
    return [setup.model_copy(update={"places": [], "work_offset_code": place.work_offset_code,
                                     "part": setup.part.model_copy(update=place.stated)})
            for place in setup.places] or [setup]


def alone(setup: SetupFile) -> SetupFile:
    """A set-up with one place that no table turns, as one with that place in [part]."""
    return at_places(setup)[0] if len(setup.places) == 1 and not setup.places[0].turn else setup


def stated_value(setup: SetupFile, key: str) -> Any:
    """The value of a dotted key, None where there is none."""
    value: Any = setup
    for step in key.split("."):
        value = value.get(step) if isinstance(value, dict) else getattr(value, step, None) if isinstance(
            value, BaseModel) and step in type(value).model_fields else None
    return value


def other_machine(setup: SetupFile, machine: str, file: str) -> list[Diagnostic]:
    """A warning where the set-up is for another machine than that of this name."""
    if not setup.machine or setup.machine == machine:
        return []
    return [warning("setup.machine", f"the set-up is for the machine {setup.machine!r}, this is {machine!r}: places, "
                    "lengths and speeds may be wrong here", file=file, lines=line_of(file, ("machine",)),
                    hint=f"write one for this machine (postproc setup new), or machine = {machine!r} in it where it fits "
                    "both")]


def assumed_values(setup: SetupFile, file: str) -> list[Diagnostic]:
    """Values of the set-up that nobody has stated."""
    return [warning("setup.assumed", f"{key} = {stated_value(setup, key)} is assumed: nobody has stated it",
                    file=file, hint="state yours, and take its name out of `assumed`") for key in setup.assumed]


@dataclass(frozen=True)
@arrays(rotation="3 3", origin="3")
class Placement:
    """A rigid change of frame: `rotation` (3, 3) and `origin` (3,), to the outer frame."""

    rotation: Floats
    origin: Floats

    def points(self, values: Floats) -> Floats:
        """Points (N, 3) in the outer frame; untouched where nothing moves, so that numbers stay bit for bit."""
        if self.is_identity:
            return values
        return self.directions(values) + self.origin

    def directions(self, values: Floats) -> Floats:
        """Directions (N, 3) in the outer frame."""
        if bool((self.rotation == np.eye(3)).all()):
            return values
        result: Floats = values @ np.ascontiguousarray(self.rotation.T)
        return result

    def behind(self, inner: Placement) -> Placement:
        """An inner change of frame, then this one."""
        return Placement(self.rotation @ inner.rotation, self.points(inner.origin[None, :])[0])

    def inverse(self) -> Placement:
        """The return."""
        return Placement(self.rotation.T, -self.rotation.T @ self.origin)

    @property
    def is_identity(self) -> bool:
        """True where outer and inner frame are the same."""
        return bool((self.rotation == np.eye(3)).all() and (self.origin == 0.0).all())


def load_setup(path: str | Path | None, hooks: str = "") -> tuple[SetupFile | None, list[Diagnostic]]:
    """The set-up of a file, or the default without one; under its own blocks of the shop those of the file `hooks`."""
    under, found = load_hooks(hooks) if hooks else (None, [])
    file, more = read_toml(path, kind="set-up") if path else (None, [])
    setup, faults = (None if path else SetupFile(), more) if file is None else validate(seen_from_here(file), SetupFile)
    if setup is None or found:
        return None, [*found, *faults]
    return (setup if under is None else setup.model_copy(update={"hooks": under.under(setup.hooks)})), faults


def part_placement(setup: SetupFile, file: str = "") -> tuple[Placement | None, list[Diagnostic]]:
    """T_table_part of a set-up; its two directions must be square to each other within 1e-6.

    Where `part.system` names a system it takes that one's coordinates to the table, until
    `setup_system.standing` has put the absolute frame in its place.
    """
    x, y = np.array(setup.part.x_axis), np.array(setup.part.y_axis)
    if not np.linalg.norm(x) > 0.0 or not np.linalg.norm(y) > 0.0:
        zero = "x_axis" if not np.linalg.norm(x) > 0.0 else "y_axis"
        return None, [error("setup.axes", f"part.{zero} is 0, 0, 0, which is no direction", file=file,
                            lines=line_of(file, ("part", zero)), hint="give two directions square to each other")]
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    if abs(float(x @ y)) > 1e-6:
        found = np.degrees(np.arccos(np.clip(x @ y, -1.0, 1.0)))
        return None, [error("setup.axes", f"part.x_axis and part.y_axis enclose {found:.4f} degrees, allowed: 90",
                            file=file, lines=line_of(file, ("part", "y_axis")),
                            hint="give two directions square to each other" + _at_default(setup))]
    y = y - (x @ y) * x
    y = y / np.linalg.norm(y)
    return Placement(np.stack([x, y, np.cross(x, y)], axis=1), np.array(setup.part.origin)), []


def _at_default(setup: SetupFile) -> str:
    """Which of the two directions the file does not give."""
    missing = [name for name in ("x_axis", "y_axis") if name not in setup.part.model_fields_set]
    return "".join(f"; part.{name} stands at its default {getattr(setup.part, name)}" for name in missing)


def work_frame(setup: SetupFile, toolpath: Toolpath, file: str = "") -> tuple[Frame | None, list[Diagnostic]]:
    """The system of the CL file that is the work offset; `file` is that of the set-up."""
    if not setup.work_offset:
        return toolpath.frames[0], []
    return system_of(setup.work_offset, toolpath, file, "work_offset", ("work_offset",))


def system_of(name: str, toolpath: Toolpath, file: str, key: str,
              path: tuple[str, ...]) -> tuple[Frame | None, list[Diagnostic]]:
    """The system of the CL file of that name, capitals or not; `key` and its `path` in the set-up's file ask for it."""
    for frame in toolpath.frames:
        if frame.name.lower() == name.lower():
            return frame, []
    names = ", ".join(f.name for f in toolpath.frames)
    return None, [error(f"setup.{path[-1]}", f"{key} = {name!r} is not a system of the CL file", file=file or toolpath.file,
                        lines=line_of(file, path), hint=f"it has: {names}")]


def line_of(file: str, path: KeyPath) -> list[int]:
    """Where a set-up file states a key."""
    values = read_toml(file)[0] if file else None
    return [values.origin(path).line] if values else []
