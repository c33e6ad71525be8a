"""`[kinematics] kind = "serial"`: an ISO 10791-6 code plus direction, point and sense of each axis."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cached_property
from typing import Literal

import numpy as np
from pydantic import Field, field_validator

from machines.figures import FigureSource, FigureTable, by_key
from machines.key_problem import KeyProblem
from machines.kinematics.chain import ROTARY, Joint
from machines.kinematics.serial import Serial
from machines.machine import ControlKinematics
from machines.models import KinematicsModel, Vector, blanks
from machines.user_model import UserModel
from toolpaths.arrays import Floats

ORDER = "XYZUVWABC"
"""linear letters before rotary ones: the order of q"""
_ISO_841 = {"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1), "U": (1, 0, 0), "V": (0, 1, 0), "W": (0, 0, 1),
            "A": (1, 0, 0), "B": (0, 1, 0), "C": (0, 0, 1)}
_TOKEN = re.compile(r"([XYZUVWABC])('?)$")
_SPINDLE = re.compile(r"\([A-Z]\d*\)$")
HEAD_MODULE, PIVOT_SUM = "5axiskins", "pivotsum"
"""LinuxCNC's module of a head C B, and the name of the sum (sum2) of its pivot length and the tool length"""
UNIT = 1e-6
"""how far the length of a direction in a file may be from 1 (it is normalised)"""
INDEPENDENT = 1e-3
"""least sine between rotary axes, least volume of the linear directions"""


SerialFigure = Literal["point", "direction"]


class SerialAxisModel(UserModel):
    """One `[kinematics.axes.LETTER]` table; as the axis stands when all joints are 0."""

    direction: Vector | None = None
    """unit vector of the positive sense, tool relative to part; without it that of ISO 841 (X, A along x, ...)"""
    point: Vector | None = None
    """rotary: a point of its line, mm in machine coordinates"""
    positive: Literal[1, -1] = 1
    """-1 where the machine counts against `direction`"""
    assumed: tuple[SerialFigure, ...] = ()
    """keys of this table whose figure no document states; `direction` stands for `positive` too"""
    source: dict[SerialFigure, FigureSource] = Field(default_factory=dict)
    """by key: the document of `[sources]` that states its figure, and the place in it"""


class SerialModel(KinematicsModel):
    """Three linear axes and up to two rotary ones."""

    kind: Literal["serial"]
    structure: str
    """ISO 10791-6 code, e.g. "w C' A' b X Y Z (C1) t"; primed axes carry the part, the spindle is in brackets"""
    axes: dict[str, SerialAxisModel] = Field(default_factory=dict)
    """geometry by axis letter"""
    tool_axis: Vector = (0.0, 0.0, 1.0)
    """unit vector from the tool tip to the spindle when all joints are 0"""

    @field_validator("structure")
    @classmethod
    def _reads_as_code(cls, code: str) -> str:
        _chain(code)
        return code

    @cached_property
    def letters(self) -> tuple[str, ...]:
        """Axis letters from the workpiece to the tool."""
        return _chain(self.structure)

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Letters in the order of q."""
        return tuple(sorted(self.letters, key=ORDER.index))

    def describe(self) -> str:
        """The ISO 10791-6 code."""
        return self.structure

    def build(self) -> Serial:
        """The kinematics at the gauge point."""
        return Serial(tuple(self._joint(name) for name in self.letters), self.axis_names,
                      np.array(self.tool_axis))

    def _joint(self, name: str) -> Joint:
        axis = self.axes.get(name, SerialAxisModel())
        direction = np.array(axis.direction or _ISO_841[name], dtype=np.float64) * axis.positive
        return Joint(name, name in ROTARY, direction, np.array(axis.point or (0.0, 0.0, 0.0)))

    def figures(self) -> list[FigureTable]:
        """The tables of the axes."""
        return [FigureTable(("kinematics", "axes", name), axis.assumed, by_key(axis.source))
                for name, axis in self.axes.items()]

    def problems(self) -> Iterator[KeyProblem]:
        """Tables that do not fit the code, vectors that are not of length 1, axes that depend on each other."""
        tables = list(self._table_problems())
        yield from tables
        if not tables:
            yield from self._geometry_problems()

    def _table_problems(self) -> Iterator[KeyProblem]:
        for name, axis in self.axes.items():
            path = ("axes", name)
            if name not in self.letters:
                yield KeyProblem("machine.axis-unknown", path, f"structure {self.structure!r} has no axis {name!r}",
                                 f"its axes are {', '.join(self.axis_names)}")
            elif name not in ROTARY and axis.point is not None:
                yield KeyProblem("machine.geometry", (*path, "point"), f"linear axis {name} has no point",
                                 "take it out")
            if axis.direction is not None:
                yield from _unit_problems((*path, "direction"), axis.direction)
        for name in self.letters:
            if name in ROTARY and (name not in self.axes or self.axes[name].point is None):
                yield KeyProblem("machine.geometry", ("axes", name), f"rotary axis {name} has no point",
                                 f"add [kinematics.axes.{name}] point = [x, y, z], a point of its line in mm")
        yield from _unit_problems(("tool_axis",), self.tool_axis)

    def _geometry_problems(self) -> Iterator[KeyProblem]:
        joints = {name: self._joint(name) for name in self.letters}
        linear = [j.direction for j in joints.values() if not j.rotary]
        turns = [j for j in joints.values() if j.rotary]
        volume = abs(float(np.linalg.det(np.array(linear))))
        if volume < INDEPENDENT:
            yield KeyProblem("machine.geometry", ("axes",), f"the linear axes span no space: volume of their directions "
                             f"{volume:.2g}, at least {INDEPENDENT:g}", "check their directions")
        if len(turns) == 2:
            yield from self._turn_problems(turns[0], turns[1])

    def _turn_problems(self, first: Joint, second: Joint) -> Iterator[KeyProblem]:
        path = ("axes", second.name)
        if _sine(first.direction, second.direction) < INDEPENDENT:
            yield KeyProblem("machine.geometry", path, f"rotary axes {first.name} and {second.name} are parallel",
                             "check their directions")
        elif _sine(second.direction, np.array(self.tool_axis)) < INDEPENDENT:
            yield KeyProblem("machine.geometry", path,
                             f"rotary axis {second.name} is parallel to the tool and only turns it about itself",
                             "check the structure: it lists the axes from the workpiece to the tool")

    def linuxcnc_keys(self) -> dict[str, str]:
        """Structure, directions and lines of the axes."""
        found = {"STRUCTURE": self.structure, "TOOL_AXIS": blanks(self.tool_axis)}
        for joint in map(self._joint, self.letters):
            found[f"DIRECTION_{joint.name}"] = blanks(joint.direction)
            found |= {f"POINT_{joint.name}": blanks(joint.point)} if joint.rotary else {}
        return found

    def control(self, module: str) -> ControlKinematics:
        """Pins of LinuxCNC's table-table modules (xyzac-trt-kins, xyzbc-trt-kins) and of 5axiskins, a head C B.

        The former hold the C line's point and the offset from it to the tilting axis; both axes turn against ISO 841.
        """
        known = {"xyzac-trt-kins": ("A", 1), "xyzbc-trt-kins": ("B", 0)}
        if module == HEAD_MODULE:
            return self._head_control()
        if module not in known:
            raise ValueError(f"module {module!r} is not known for serial machines; known: "
                             f"{', '.join((*known, HEAD_MODULE))}")
        tilt, across = known[module]
        if self.letters[:2] != ("C", tilt) or set(self.letters[2:]) != set("XYZ"):
            raise ValueError(f"{module} is for w C' {tilt}' and X, Y, Z in any order, not {self.structure!r}")
        self._check_directions(module, {name: -1 for name in self.letters if name in ROTARY})
        c, t = self._joint("C").point, self._joint(tilt).point
        offset = "xy"[across]
        pins = {"x-rot-point": c[0], "y-rot-point": c[1], "z-rot-point": c[2],
                f"{offset}-offset": t[across] - c[across], "z-offset": t[2] - c[2]}
        return ControlKinematics(module, {f"{module}.{pin}": float(value) for pin, value in pins.items()},
                                 f"{module}.tool-offset")

    def _head_control(self) -> ControlKinematics:
        """The pivot length P of 5axiskins, to which a sum adds the tool length; B against ISO 841, C as there (s2r)."""
        if self.letters[3:] != ("C", "B") or set(self.letters[:3]) != set("XYZ"):
            raise ValueError(f"{HEAD_MODULE} is for X, Y, Z in any order, then C B t, not {self.structure!r}")
        self._check_directions(HEAD_MODULE, {"B": -1, "C": 1})
        c, b = self._joint("C").point, self._joint("B").point
        if c[0] != 0.0 or c[1] != 0.0 or b[0] != 0.0:
            raise ValueError(f"{HEAD_MODULE} needs the lines of C and B through the spindle's own: points [0, 0, z]")
        return ControlKinematics(HEAD_MODULE, {f"{PIVOT_SUM}.in0": float(b[2])}, f"{PIVOT_SUM}.in1", "W",
                                 (f"{PIVOT_SUM}.out", f"{HEAD_MODULE}.pivot-length"))

    def _check_directions(self, module: str, turns: dict[str, int]) -> None:
        for name in self.letters:
            direction = np.array(_ISO_841[name]) * turns.get(name, 1)
            if not np.array_equal(self._joint(name).direction, direction):
                raise ValueError(f"{module} needs axis {name} along {direction.tolist()}")
        if self.tool_axis != (0.0, 0.0, 1.0):
            raise ValueError(f"{module} needs the tool along z when all joints are 0")


def _chain(code: str) -> tuple[str, ...]:
    """Controlled axes of an ISO 10791-6 code from the workpiece to the tool.

    Raises:
        ValueError: where the code is not understood.
    """
    tokens = code.strip().removeprefix("[").removesuffix("]").split()
    if len(tokens) < 3 or tokens[0] != "w" or tokens[-1] != "t" or tokens.count("b") != 1:
        raise ValueError(f"structure {code!r} must run from w over one b to t, e.g. \"w C' A' b X Y Z (C1) t\"")
    bed = tokens.index("b")
    found = [_letter(token, at < bed, code) for at, token in enumerate(tokens) if token not in ("w", "b", "t")]
    names = tuple(name for name in found if name)
    linear = [name for name in names if name not in ROTARY]
    if len(set(names)) < len(names) or len(linear) != 3 or len(names) > 5:
        raise ValueError(f"structure {code!r} has the axes {', '.join(names)}; three linear and up to two rotary ones, "
                         "each once, can be handled")
    return names


def _letter(token: str, on_part_side: bool, code: str) -> str:
    if _SPINDLE.match(token):
        return ""
    found = _TOKEN.match(token)
    if not found:
        raise ValueError(f"{token!r} in structure {code!r} is not an axis; write one of {' '.join(ORDER)}, primed "
                         "between w and b")
    if (found[2] == "'") != on_part_side:
        raise ValueError(f"{token!r} in structure {code!r}: axes are primed between w and b, not between b and t")
    return found[1]


def _unit_problems(path: tuple[str, ...], vector: Vector) -> Iterator[KeyProblem]:
    length = float(np.linalg.norm(vector))
    if abs(length - 1.0) > UNIT:
        near = ", ".join(f"{v / length:.9g}" for v in vector) if length > 0 else ""
        yield KeyProblem("machine.geometry", path, f"{list(vector)} has length {length:.6g}, not 1",
                         f"write [{near}]" if near else "write the direction as a unit vector")


def _sine(a: Floats, b: Floats) -> float:
    return float(np.linalg.norm(np.cross(a, b)))
