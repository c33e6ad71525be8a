"""A machine from a FreeCAD machine file (.fcm, JSON): travels and velocities of its axes, what carries what.

Source: FreeCAD's CAM workbench, Machine/models (`Machine.to_dict`, `from_dict`): lengths in mm or inch, linear velocities in
mm/min or inch/min, rotary ones in degrees/min.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ValidationError

from machines.exchange.draft import Draft
from machines.kinematics.chain import ROTARY
from machines.models import Vector
from toolpaths.units import MM_PER_INCH, PER_MINUTE

_HINT = "state it: --set \"kinematics.structure=w C' A' b X Y Z (C1) t\""


class FreecadJoint(BaseModel):
    """Place and direction of an axis."""

    origin: Vector = (0.0, 0.0, 0.0)
    axis: Vector


class FreecadLimits(BaseModel):
    """Ends of travel."""

    min: float | None = None
    max: float | None = None


class FreecadAxis(BaseModel):
    """One axis; `joint` as a list is [origin, axis], in older files of linear axes [axis, origin]."""

    type: Literal["linear", "rotary", "angular"] = "linear"
    role: Literal["table_linear", "table_rotary", "head_linear", "head_rotary"] = "table_linear"
    joint: FreecadJoint | tuple[Vector, Vector] | None = None
    limits: FreecadLimits = FreecadLimits()
    max_velocity: float | None = None

    @property
    def placed(self) -> FreecadJoint | None:
        """The joint in its newer form."""
        if not isinstance(self.joint, tuple):
            return self.joint
        first, second = self.joint
        older = self.type == "linear" and any(first)
        return FreecadJoint(origin=second if older else first, axis=first if older else second)


class FreecadMachine(BaseModel):
    """The `machine` object."""

    name: str = ""
    units: Literal["metric", "imperial"] = "metric"
    axes: dict[str, FreecadAxis]


class FreecadFile(BaseModel):
    """A .fcm file; what the post-processors of FreeCAD alone read is left out."""

    machine: FreecadMachine


def read_freecad(path: Path, text: str, stated: Sequence[str]) -> tuple[Draft, dict[str, bool]]:
    """The draft of a machine file, and its axes: True for rotary ones."""
    draft = Draft(str(path), stated)
    try:
        machine = FreecadFile.model_validate_json(text).machine
    except ValidationError as faults:
        for fault in faults.errors():
            keys = [str(key) for key in fault["loc"]]
            draft.error("import.number", f"{'.'.join(keys) or 'the file'}: {fault['msg']}", _line(text, *keys),
                        "write it as FreeCAD does")
        return draft, {}
    if wrong := [name for name in machine.axes if name not in "XYZUVWABC" or (name in ROTARY) != (
            machine.axes[name].type != "linear")]:
        draft.error("import.geometry", f"axis {wrong[0]!r} is no linear axis X Y Z U V W and no rotary axis A B C",
                    _line(text, "axes", wrong[0]), "rename it in FreeCAD's machine editor")
        return draft, {}
    if without := [name for name in "XYZ" if name not in machine.axes]:
        draft.error("import.geometry", f"the machine has no axis {' '.join(without)}: a mill has X, Y and Z",
                    _line(text, "axes"), "add it in FreeCAD's machine editor")
        return draft, {}
    draft.put(("description",), machine.name or path.stem, _line(text, "machine", "name"), machine.name)
    draft.made(("kinematics", "kind"), "serial", "")
    draft.made(("retract_axis",), "Z", "")
    _structure(draft, machine, text)
    for name, axis in machine.axes.items():
        _axis(draft, name, axis, MM_PER_INCH if machine.units == "imperial" else 1.0, text)
    return draft, {name: name in ROTARY for name in machine.axes}


def _structure(draft: Draft, machine: FreecadMachine, text: str) -> None:
    """Roles say what is in the table; of two rotary axes `parent` does not say which one carries the other."""
    tables = [name for name, axis in machine.axes.items() if axis.role.startswith("table")]
    turning = [name for name in machine.axes if name in ROTARY]
    if len(turning) > 1:
        if "kinematics.structure" not in draft.stated:
            draft.error("import.geometry", f"the file does not say which of {' and '.join(turning)} carries the other",
                        _line(text, "axes", turning[0]), _HINT)
        return
    part = [*(n for n in turning if n in tables), *(n for n in tables if n not in turning)]
    tool = [*(n for n in machine.axes if n not in (*tables, *turning)), *(n for n in turning if n not in tables)]
    code = " ".join(["w", *(f"{name}'" for name in part), "b", *tool, "(C1)", "t"])
    draft.put(("kinematics", "structure"), code, _line(text, "axes"), "role of each axis")


def _axis(draft: Draft, name: str, axis: FreecadAxis, scale: float, text: str) -> None:
    turns = name in ROTARY
    unit = 1.0 if turns else scale
    low, high = axis.limits.min, axis.limits.max
    if low is not None and high is not None:
        draft.put(("axes", name, "travel"), [low * unit, high * unit], _line(text, "axes", name, "limits"),
                  f"limits min {low:g}, max {high:g}")
    elif low is not None or high is not None:
        draft.error("import.travel", f"axis {name} has one end of its travel only", _line(text, "axes", name, "limits"),
                    "write min and max")
    if axis.max_velocity:
        draft.put(("axes", name, "velocity"), axis.max_velocity * unit * PER_MINUTE,
                  _line(text, "axes", name, "max_velocity"), f"max_velocity {axis.max_velocity:g}")
    placed = axis.placed
    if placed is None or not any(placed.axis):
        point = f"kinematics.axes.{name}.point"
        if turns and point not in draft.stated:
            draft.error("import.geometry", f"the file does not say where {name} lies", _line(text, "axes", name),
                        f"state a point of its line in mm: --set \"{point}=[0, 0, 0]\"")
        return
    line = _line(text, "axes", name, "joint")
    length = sum(v * v for v in placed.axis) ** 0.5
    draft.put(("kinematics", "axes", name, "direction"), [v / length for v in placed.axis], line, "joint")
    if turns:
        draft.put(("kinematics", "axes", name, "point"), [v * scale for v in placed.origin], line, "joint")
        draft.info("import.sense", f"{name} is taken to turn the tool relative to the part about {list(placed.axis)}: the "
                   "file does not say it, so turn it by hand at the machine and compare", line)


def _line(text: str, *keys: str) -> int:
    """The line of a key, found below the keys before it."""
    at = 0
    for key in keys:
        found = text.find(f'"{key}"', at)
        at = found if found >= 0 else at
    return text.count("\n", 0, at) + 1
