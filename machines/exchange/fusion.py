"""A machine from a Fusion machine file (.mch, .machine; JSON): what carries what, travels, speeds, lines of rotary axes.

Sources: Autodesk, Fusion API, adsk.cam: RotaryMachineAxisInput.rotationAxis (machine coordinates, right-handed),
MachineAxis, MachineAxisConfiguration (`isReversed`, `coordinate`, speeds), MachineAxisCoordinates; for the keys of the file,
machine files in public: MakeraInc/CarveraProfiles, "Carvera 4-axis.mch" (commit 3e1d5408), MillenniumMachines/MillenniumOS,
milo-v1.5-std.mch (27e0a006), Autodesk/cam-posteditor, "autodesk 5ax table bc head
yxz.mch" (5cc74f79). Speeds are per minute there: 4000 mm/min, 21600 degrees/min.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import AfterValidator, BaseModel, ValidationError

from machines.exchange.draft import Draft, Value
from machines.kinematics.chain import ROTARY
from machines.models import Vector
from toolpaths.dataclass import dataclass
from toolpaths.units import MM_PER_INCH, PER_MINUTE

LENGTHS = {"mm": 1.0, "in": MM_PER_INCH, "inch": MM_PER_INCH}
"""mm per unit of `units.length`"""
_BY_HAND = "postproc machine new asks for what the control shows"
_UP = (0.0, 0.0, 1.0)


def _unit(vector: Vector) -> Vector:
    length = float(sum(v * v for v in vector)) ** 0.5
    if length < 1e-9:
        raise ValueError("a direction of length 0")
    x, y, z = (v / length + 0.0 for v in vector)
    return x, y, z


UnitDirection = Annotated[Vector, AfterValidator(_unit)]


class FusionLine(BaseModel):
    """The line of a rotary axis."""

    point: Vector
    direction: UnitDirection


class FusionFrame(BaseModel):
    """Where tool or part is attached."""

    point: Vector
    z_direction: UnitDirection = _UP


class FusionSpindle(BaseModel):
    """Turns per minute."""

    max_speed: float = 0.0


class FusionPart(BaseModel):
    """A body of the machine; `parts` are those that it carries. `direction`: how it moves itself, whatever the tool does."""

    id: str
    type: Literal["static", "linear", "rotary", "table", "head"]
    control: str = "driven"
    direction: UnitDirection | None = None
    axis_of_rotation: FusionLine | None = None
    offset: Vector = (0.0, 0.0, 0.0)
    min: float | None = None
    max: float | None = None
    home: float | None = None
    attach_frame: FusionFrame | None = None
    spindle: FusionSpindle | None = None
    parts: list[FusionPart] | None = None


class FusionUnits(BaseModel):
    """Of all figures of the tree."""

    length: str
    angle: str


class FusionTree(BaseModel):
    """`kinematics`."""

    parts: list[FusionPart]
    units: FusionUnits
    conventions: dict[str, str] = {}


class FusionAxis(BaseModel):
    """What the control does with an axis; speeds per minute, 0 where none is stated."""

    coordinate: int | None = None
    max_rapid_speed: float = 0.0
    reversed: bool = False
    zero_position_offset: float = 0.0


class FusionControl(BaseModel):
    """`controller`."""

    max_normal_speed: float = 0.0
    parts: dict[str, FusionAxis] = {}


class FusionTimes(BaseModel):
    """`machining`, seconds."""

    tool_change_time: float = 0.0


class FusionName(BaseModel):
    """`general`."""

    description: str = ""
    vendor: str = ""
    model: str = ""


_Section = TypeVar("_Section", FusionTree, FusionControl, FusionTimes)


class FusionFile(BaseModel):
    """A machine file; what the CAM system alone reads (collisions, post, pictures, tools) is left out."""

    kinematics: dict[str, FusionTree]
    controller: dict[str, FusionControl] = {}
    machining: dict[str, FusionTimes] = {}
    general: FusionName = FusionName()


@dataclass(frozen=True)
class _Mover:
    """One axis of the machine as the file has it."""

    letter: str
    part: FusionPart
    control: FusionAxis
    of_table: bool

    @property
    def turned(self) -> float:
        """-1 where the file's direction is against how the tool moves relative to the part."""
        return -1.0 if self.of_table != self.control.reversed else 1.0


def read_fusion(path: Path, text: str, stated: Sequence[str]) -> tuple[Draft, dict[str, bool]]:
    """The draft of a machine file, and its axes: True for rotary ones."""
    draft = Draft(str(path), stated)
    try:
        file = FusionFile.model_validate_json(text)
    except ValidationError as faults:
        for fault in faults.errors():
            keys = [str(key) for key in fault["loc"]]
            draft.error("import.number", f"{'.'.join(keys) or 'the file'}: {fault['msg']}", _line(text, *keys),
                        "export the machine from Fusion's machine library again")
        return draft, {}
    tree = _current(file.kinematics, FusionTree(parts=[], units=FusionUnits(length="mm", angle="degrees")))
    control = _current(file.controller, FusionControl())
    movers = list(_movers(draft, tree, control, text))
    scale = LENGTHS.get(tree.units.length)
    hand = tree.conventions.get("rotation", "right-handed")
    if scale is None or tree.units.angle != "degrees" or hand != "right-handed":
        draft.error("import.unit", f"lengths in {tree.units.length}, angles in {tree.units.angle}, turns {hand}: read are "
                    f"{', '.join(LENGTHS)}, degrees, right-handed", _line(text, "kinematics", "units"), _BY_HAND)
    heads = [part for part in _all(tree.parts) if part.type == "head" and part.attach_frame is not None]
    if scale is None or draft.found:
        return draft, {}
    said = " ".join(word for word in (file.general.vendor, file.general.model) if word) or file.general.description
    draft.put(("description",), said or path.stem, _line(text, "general"), said or path.stem)
    draft.made(("kinematics", "kind"), "serial", "")
    draft.made(("retract_axis",), "Z", "")
    draft.put(("kinematics", "structure"), _structure(movers), _line(text, "kinematics", "parts"), "tree of parts")
    gauge = heads[0].attach_frame.point if heads[0].attach_frame else (0.0, 0.0, 0.0)
    for mover in movers:
        _axis(draft, mover, gauge, scale, text)
    _of_control(draft, file, heads[0], scale, text)
    return draft, {mover.letter: mover.letter in ROTARY for mover in movers}


def _current(section: Mapping[str, _Section], without: _Section) -> _Section:
    """What a section says: its configuration "default", else the first, as "synced_configuration" of newer files."""
    return section["default"] if "default" in section else next(iter(section.values()), without)


def _of_control(draft: Draft, file: FusionFile, head: FusionPart, scale: float, text: str) -> None:
    """Largest feed and spindle speed, time of a tool change: 0 states none."""
    feed = _current(file.controller, FusionControl()).max_normal_speed
    speed = head.spindle.max_speed if head.spindle is not None else 0.0
    seconds = _current(file.machining, FusionTimes()).tool_change_time
    for path, value, unit, keys in (
            (("control", "largest_feed"), feed, scale, ("controller", "max_normal_speed")),
            (("control", "largest_spindle_speed"), speed, 1.0, ("kinematics", "max_speed")),
            (("timing", "tool_change"), seconds, 1.0, ("machining", "tool_change_time"))):
        if value > 0.0:
            draft.put(path, value * unit, _line(text, *keys), f"{keys[1]} {value:g}")


def _all(parts: list[FusionPart]) -> Iterator[FusionPart]:
    for part in parts:
        yield part
        yield from _all(part.parts or [])


def _branch(parts: list[FusionPart], end: str) -> list[list[FusionPart]]:
    """From the bed to every part of a type, both ends included."""
    found = [[part] for part in parts if part.type == end]
    return found + [[part, *rest] for part in parts for rest in _branch(part.parts or [], end)]


def _movers(draft: Draft, tree: FusionTree, control: FusionControl, text: str) -> Iterator[_Mover]:
    """Axes from the bed to the table, then from the bed to the head; what is not understood goes to the draft."""
    ends = {end: _branch(tree.parts, end) for end in ("table", "head")}
    for end, branches in ends.items():
        frame = branches[0][-1].attach_frame if len(branches) == 1 else None
        if len(branches) != 1 or frame is None:
            draft.error("import.geometry", f"{len(branches)} parts of type {end} with a place: a machine of one is read",
                        _line(text, "kinematics", end), _BY_HAND)
        elif frame.z_direction != _UP:
            draft.error("import.geometry", f"z of {end} is {list(frame.z_direction)}: only [0, 0, 1] is read",
                        _line(text, "kinematics", branches[0][-1].id), _BY_HAND)
    if draft.found:
        return
    letters: set[str] = set()
    for end, branches in ends.items():
        for part in branches[0][:-1]:
            if part.type != "static":
                mover = _Mover(_letter(part, control), part, control.parts.get(part.id, FusionAxis()), end == "table")
                if wrong := _wrong(mover, letters, f"kinematics.axes.{mover.letter}.point" in draft.stated):
                    draft.error("import.geometry", f"part {part.id}: {wrong}", _line(text, "kinematics", part.id), _BY_HAND)
                letters.add(mover.letter)
                yield mover


def _letter(part: FusionPart, control: FusionControl) -> str:
    """By the coordinate under which it is programmed: 0, 1, 2 are X, Y, Z, or A, B, C."""
    coordinate = control.parts.get(part.id, FusionAxis()).coordinate
    known = ROTARY if part.type == "rotary" else "XYZ"
    return known[coordinate] if coordinate is not None and 0 <= coordinate < 3 else part.id


def _on_line(part: FusionPart) -> bool:
    """True where `offset` is 0, or a place of the line about which a part turns: nothing that `point` does not say."""
    line = part.axis_of_rotation
    if line is None or not any(part.offset):
        return not any(part.offset)
    apart = [o - p for o, p in zip(part.offset, line.point, strict=True)]
    along = sum(a * d for a, d in zip(apart, line.direction, strict=True))
    return all(abs(a - along * d) < 1e-6 for a, d in zip(apart, line.direction, strict=True))


def _wrong(mover: _Mover, letters: set[str], stated: bool) -> str:
    """Why an axis is not read; "" where it is. `stated`: somebody has said where its line is."""
    part, known = mover.part, ROTARY if mover.part.type == "rotary" else "XYZUVW"
    if mover.letter not in known or mover.letter in letters:
        return f"{'two axes are' if mover.letter in letters else 'no coordinate; it is'} programmed as {mover.letter!r}"
    if part.control != "driven":
        return f"control = {part.control!r}, no driven axis"
    if mover.control.zero_position_offset:
        return "its zero_position_offset is not 0, and what it counts from is not documented"
    if not _on_line(part) and not stated:
        return (f"its offset {list(part.offset)} is no place of its line, and what it counts from is not documented: --set "
                f"kinematics.axes.{mover.letter}.point=[0,0,-400] states a place of the line, all axes at 0")
    line = part.axis_of_rotation if part.type == "rotary" else part.direction
    return "" if line is not None else "no direction"


def _structure(movers: list[_Mover]) -> str:
    table = [f"{mover.letter}'" for mover in movers if mover.of_table]
    return " ".join(["w", *table[::-1], "b", *(mover.letter for mover in movers if not mover.of_table), "(C1)", "t"])


def _axis(draft: Draft, mover: _Mover, gauge: Vector, scale: float, text: str) -> None:
    part, name = mover.part, mover.letter
    turns = name in ROTARY
    unit, line = 1.0 if turns else scale, _line(text, "kinematics", part.id)
    if part.min is not None and part.max is not None:
        draft.put(("axes", name, "travel"), [part.min * unit, part.max * unit], line, f"min {part.min:g}, max {part.max:g}")
    elif part.min is not None or part.max is not None:
        draft.error("import.travel", f"part {part.id} has one end of its travel only", line, "write min and max")
    elif turns:
        draft.made(("axes", name, "travel"), "unlimited", "no min, no max")
    if part.home is not None:
        draft.put(("axes", name, "home"), part.home * unit, line, f"home {part.home:g}")
    if (rapid := mover.control.max_rapid_speed) > 0.0:
        draft.put(("axes", name, "velocity"), rapid * unit * PER_MINUTE,
                  _line(text, "controller", part.id, "max_rapid_speed"), f"max_rapid_speed {rapid:g}")
    spun = part.axis_of_rotation
    direction = spun.direction if spun is not None and turns else part.direction or _UP
    ours: Value = [mover.turned * v + 0.0 for v in direction]
    draft.put(("kinematics", "axes", name, "direction"), ours, line, f"direction {list(direction)}")
    if spun is not None and turns:
        point: Value = [(p - g) * scale for p, g in zip(spun.point, gauge, strict=True)]
        draft.put(("kinematics", "axes", name, "point"), point, line,
                  f"point {list(spun.point)}, from the head's {list(gauge)}")
        whose = "the table" if mover.of_table else "the head"
        draft.info("import.sense", f"{name} is taken to turn {whose} itself right-handed about {list(direction)}"
                   f"{', reversed' if mover.control.reversed else ''}: turn it by hand at the machine and compare", line)


def _line(text: str, *keys: str) -> int:
    """The line of a key or a name, found below the keys before it."""
    at = 0
    for key in keys:
        found = text.find(f'"{key}"', at)
        at = found if found >= 0 else at
    return text.count("\n", 0, at) + 1
