"""A machine from a machine file of Autodesk's older form (.machine; XML of HSM and Fusion): axes, ranges, speeds.

Sources: machine files in public, Autodesk/cam-posteditor, vs-code-extension/res/Machines (commits 19010fae,
78477181, 90e7df1e): attributes with units ("-120deg 120deg", "21600deg/min", "15s"), older ones without; 0 states nothing.
Of two rotary axes on one side U carries V: "YXBC axis on the Table" has U = B, "XYZCA axis on the Head" U = C. The
direction of a rotary axis is that of `createAxis` in posts, how the tool moves relative to the part: Autodesk's post for
the Pocket NC V2 has table axes [-1, 0, 0] and [0, -1, 0], as the maker's own kinematics of that machine.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from xml.parsers import expat

from machines.exchange.draft import Draft
from machines.exchange.fusion import LENGTHS
from toolpaths.dataclass import dataclass
from toolpaths.units import PER_MINUTE

_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([a-z]*)(/min)?")
_COORDINATES = {"0": 0, "1": 1, "2": 2, "X": 0, "Y": 1, "Z": 2}
_UNITS = {**LENGTHS, "deg": 1.0, "rpm": 1.0, "s": 1.0, "": 1.0}
_BY_HAND = "postproc machine new asks for what the control shows"


@dataclass(frozen=True)
class _Element:
    """An element of the file, and the line that it begins at."""

    name: str
    values: dict[str, str]
    line: int
    text: str = ""


def read_fusion_xml(path: Path, text: str, stated: Sequence[str]) -> tuple[Draft, dict[str, bool]]:
    """The draft of a machine file, and its axes: True for rotary ones."""
    draft = Draft(str(path), stated)
    try:
        elements = _elements(text)
    except (expat.ExpatError, ValueError) as fault:
        draft.error("import.number", f"no XML that is read: {fault}", 0,
                    "export the machine from the machine library again")
        return draft, {}
    if wrong := _no_mill(elements):
        draft.error("import.geometry", wrong[1], wrong[0], _BY_HAND)
        return draft, {}
    said = {one.name: one.text for one in elements if one.text}
    name = " ".join(said[key] for key in ("vendor", "model") if key in said) or path.stem
    draft.put(("description",), name, 1, name)
    draft.made(("kinematics", "kind"), "serial", "")
    draft.made(("retract_axis",), "Z", "")
    axes = [_Axis(one) for one in elements if one.name == "axis"]
    axes.sort(key=lambda axis: (axis.turns, axis.element.values.get("id", "")))
    names = [axis.name for axis in axes]
    if "" in names or len(set(names)) < len(names) or not set("XYZ") <= set(names):
        draft.error("import.geometry", f"axes {', '.join(n or 'without a coordinate' for n in names)}: X, Y, Z and at most "
                    "one of each of A, B, C are read", axes[0].element.line if axes else 0, _BY_HAND)
        return draft, {}
    table, head = ([axis.name for axis in axes if axis.link == link] for link in ("table", "head"))
    structure = " ".join(["w", *(f"{n}'" for n in table[::-1]), "b", *head, "(C1)", "t"])
    draft.put(("kinematics", "structure"), structure, axes[0].element.line, "link of each axis, U before V")
    for axis in axes:
        _put(draft, axis)
    _times(draft, elements)
    return draft, {axis.name: axis.turns for axis in axes}


class _Axis:
    """An `axis` element, its letter, and what it carries."""

    def __init__(self, element: _Element) -> None:
        self.element = element
        self.turns = element.values.get("actuator") == "rotational"
        self.link = "head" if element.values.get("link") == "head" else "table"
        place = _COORDINATES.get(element.values.get("coordinate", ""))
        self.name = "" if place is None else ("ABC" if self.turns else "XYZ")[place]

    def figures(self, key: str) -> list[float]:
        """Numbers of an attribute, mm and degrees, per second where they are per minute."""
        found = _NUMBER.findall(self.element.values.get(key, ""))
        return [float(value) * _UNITS.get(unit, 1.0) * (PER_MINUTE if per else 1.0) for value, unit, per in found]


def _elements(text: str) -> list[_Element]:
    """All elements in their order; text of those that hold nothing else."""
    found: list[_Element] = []
    parser = expat.ParserCreate("utf-8")  # as the text has been read, whatever its first line says

    def begins(name: str, values: dict[str, str]) -> None:
        found.append(_Element(name.split(":")[-1], values, parser.CurrentLineNumber))

    def holds(data: str) -> None:
        if found and data.strip() and len(found[-1].text) < 200:
            found[-1] = _Element(found[-1].name, found[-1].values, found[-1].line, found[-1].text + data.strip())

    def defines(*_: object) -> None:
        raise ValueError("it defines entities of its own")

    parser.StartElementHandler, parser.CharacterDataHandler, parser.EntityDeclHandler = begins, holds, defines
    parser.Parse(text.encode(), True)
    return found


def _no_mill(elements: list[_Element]) -> tuple[int, str] | None:
    """Line and reason where the file is no machine that is read."""
    if not elements or elements[0].name != "machine":
        return 1, "its first element is no <machine>"
    for one in elements:
        if one.name == "machining" and one.values.get("milling") == "no":
            return one.line, "milling=\"no\": only mills are read"
        if one.name == "spindle" and "axis" in one.values and one.values["axis"].split() != ["0", "0", "1"]:
            return one.line, f"spindle along {one.values['axis']}: only 0 0 1 is read"
    spindles = [one for one in elements if one.name == "spindle"]
    return (spindles[1].line, "two spindles: a machine of one is read") if len(spindles) > 1 else None


def _put(draft: Draft, axis: _Axis) -> None:
    name, line, values = axis.name, axis.element.line, axis.element.values
    travel, home, rapid = axis.figures("range"), axis.figures("homePosition"), axis.figures("rapidFeed")
    if values.get("cyclic") != "yes" and len(travel) not in (0, 2):
        draft.error("import.travel", f"range {values['range']!r} of {name} is not two ends", line,
                    "write range with both ends, as -120deg 120deg")
    elif axis.turns and (len(travel) != 2 or values.get("cyclic") == "yes"):
        draft.put(("axes", name, "travel"), "unlimited", line, "cyclic" if values.get("cyclic") == "yes" else "no range")
    elif len(travel) == 2:
        draft.put(("axes", name, "travel"), [travel[0], travel[1]], line, f"range {values['range']}")
    if home and (len(travel) != 2 or travel[0] <= home[0] <= travel[1]):
        draft.put(("axes", name, "home"), home[0], line, f"homePosition {values['homePosition']}")
    if rapid and rapid[0] > 0.0:
        draft.put(("axes", name, "velocity"), rapid[0], line, f"rapidFeed {values['rapidFeed']}")
    if axis.turns:
        _line_of(draft, axis)


def _line_of(draft: Draft, axis: _Axis) -> None:
    """Direction and point of a rotary axis; the file's own point counts from a place that nothing documents."""
    name, line, values = axis.name, axis.element.line, axis.element.values
    direction = axis.figures("axis")
    length = sum(v * v for v in direction) ** 0.5
    key = f"kinematics.axes.{name}"
    if len(direction) == 3 and length > 1e-9:
        draft.put(("kinematics", "axes", name, "direction"), [v / length for v in direction], line, f"axis {values['axis']}")
        draft.info("import.sense", f"{name} is taken to count as the tool turns relative to the part, right-handed about "
                   f"{values['axis']}: turn it by hand at the machine and compare", line)
    elif draft.user(f"{key}.direction") is None:
        draft.error("import.geometry", f"axis {name} has no direction", line, f"--set {key}.direction=[1,0,0]")
    if draft.user(f"{key}.point") is None:
        draft.error("import.geometry", f"the place of the line of {name}: its offset ({values.get('offset', 'none')}) "
                    "counts from a place of the model that is not documented", line,
                    f"--set {key}.point=[0,0,-400], a point of its line in machine coordinates, all axes at 0")


def _times(draft: Draft, elements: list[_Element]) -> None:
    """Largest feed and spindle speed, time of a tool change: 0 states none."""
    for element, key, path in (("capabilities", "maximumFeedrate", ("control", "largest_feed")),
                               ("spindle", "maximumSpeed", ("control", "largest_spindle_speed")),
                               ("machiningTime", "toolChangeTime", ("timing", "tool_change"))):
        for one in elements:
            found = _NUMBER.findall(one.values.get(key, "")) if one.name == element else []
            if found and float(found[0][0]) > 0.0:
                draft.put(path, float(found[0][0]) * _UNITS.get(found[0][1], 1.0), one.line, f"{key} {one.values[key]}")
