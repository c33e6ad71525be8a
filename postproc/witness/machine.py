"""Poses of the tool from a machine file: a product of matrices axis by axis, or rods held against their lengths."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.witness.commanded import unit
from postproc.witness.text import Array

_ALONG = {"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1), "U": (1, 0, 0), "V": (0, 1, 0), "W": (0, 0, 1),
          "A": (1, 0, 0), "B": (0, 1, 0), "C": (0, 0, 1)}
LIMITS = ("least", "greatest", "velocity", "acceleration", "jerk", "home")
ROD = 1e-4
"""mm by which a rod may miss its length"""


def largest_feed(table: dict[str, Any]) -> float:
    """mm/min of the largest cutting feed; infinite where the machine file states none."""
    return float((table.get("control") or {}).get("largest_feed") or math.inf)


def register_beyond(tables: list[dict[str, Any]]) -> int:
    """What the length register of a tool is more than its number where the CL file names none: 20 of "T + 20"."""
    return int(str((merged(tables).get("control") or {}).get("length_register", "T")).partition("+")[2] or 0)


def merged(tables: list[dict[str, Any]]) -> dict[str, Any]:
    """A machine file over its base, over that one's base: tables merged, everything else replaced."""
    result: dict[str, Any] = {}
    for table in reversed(tables):
        result = _over(result, table)
    return result


def _over(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    result = dict(below)
    for key, value in above.items():
        old = result.get(key)
        result[key] = _over(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
    return result


@dataclass(frozen=True)
class Chain:
    """A serial machine: letters from the workpiece to the tool, direction and point (rotary) of each axis at zero."""

    letters: tuple[str, ...]
    direction: dict[str, Array]
    point: dict[str, Array]
    tool: Array

    def pose(self, q: Array, letters: tuple[str, ...], length: Array) -> tuple[Array, Array]:
        """(tip, axis) (N, 3) in the table frame at joints q (N, J), mm and rad, of tools of `length` (N,) mm."""
        tip, axis = -length[:, None] * self.tool, self.tool[None]
        for name in reversed(self.letters):
            value, along = q[:, letters.index(name)], self.direction[name]
            if name in "ABC":
                turn = rotations(along, value)
                tip = apply(turn, tip - self.point[name]) + self.point[name]
                axis = apply(turn, axis)
            else:
                tip = tip + value[:, None] * along
        return tip, np.array(np.broadcast_to(axis, tip.shape))

    def slides(self, q: Array, letters: tuple[str, ...]) -> tuple[list[int], Array]:
        """(numbers of the linear joints, their directions (N, 3, 3) of motion in the table frame, one in each column)."""
        linear = [k for k, name in enumerate(letters) if name not in "ABC"]
        none = np.zeros(len(q))
        base, _ = self.pose(q, letters, none)
        moved = [self.pose(q + np.eye(len(letters))[k], letters, none)[0] - base for k in linear]
        return linear, np.stack(moved, axis=2)

    def turned(self, place: tuple[Array, Array], turn: dict[str, float]) -> tuple[Array, Array]:
        """On the table at zero: a place (rotation, origin) as it stands with tables turned by `turn` (degrees)."""
        q = np.radians(np.array([[0.0] * len(self.letters), [turn.get(name, 0.0) for name in self.letters]]))
        at, (_, slides) = self.pose(q, self.letters, np.zeros(2))[0], self.slides(q, self.letters)
        rotation = slides[1] @ np.linalg.inv(slides[0])
        return rotation @ place[0], rotation @ (place[1] - at[0]) + at[1]


def rotations(along: Array, angle: Array) -> Array:
    """(N, 3, 3), or (1, 3, 3) where all angles are the same: turns about a unit vector, by Rodrigues' formula."""
    if len(angle) and (angle == angle[0]).all():
        angle = angle[:1]
    x, y, z = along
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + s * cross + (1.0 - c) * (cross @ cross))


def apply(turns: Array, v: Array) -> Array:
    """Turns (N, 3, 3) or (1, 3, 3) of vectors (N, 3) or (1, 3)."""
    return np.asarray(v @ np.ascontiguousarray(turns[0].T) if len(turns) == 1 else np.einsum("nij,nj->ni", turns, v))


def chain(table: dict[str, Any]) -> Chain:
    """The chain of a machine file of kind "serial"."""
    kinematics = table["kinematics"]
    names = re.findall(r"(?<![(\w])([XYZUVWABC])'?(?=\s)", kinematics["structure"])
    axes = kinematics.get("axes", {})
    direction, point = {}, {}
    for name in names:
        own = axes.get(name, {})
        along = np.array(own.get("direction", _ALONG[name]), np.float64)
        direction[name] = unit(along) * float(own.get("positive", 1))
        point[name] = np.array(own.get("point", (0.0, 0.0, 0.0)), np.float64)
    return Chain(tuple(names), direction, point,
                 unit(np.array(kinematics.get("tool_axis", (0.0, 0.0, 1.0)), np.float64)))


@dataclass(frozen=True)
class Rods:
    """A machine on slides: whether its rods have their lengths where a tool is claimed to be."""

    slide: Array
    direction: Array
    joint: Array
    length: Array
    root: Array
    legs: tuple[str, ...]
    gauge: float
    rotary: str
    carries: str
    sense: float
    pivot: Array

    def misfit(self, q: Array, letters: tuple[str, ...], tip: Array, axis: Array, length: Array) -> Array:
        """(N,) mm: the worst of rods off their length, and of the axis off what the platform can do (times
        1000); infinite where a carriage stands on the wrong side of its rod."""
        turn = self.sense * q[:, letters.index(self.rotary)] if self.rotary else np.zeros(len(q))
        if self.carries == "part":
            back = rotations(np.array([0.0, 0.0, 1.0]), -turn)
            tip, axis = apply(back, tip), apply(back, axis)
        s, c = (np.sin(turn), np.cos(turn)) if self.carries == "spindle" else (np.zeros(len(q)), np.ones(len(q)))
        tilt = np.arctan2(-axis[:, 1], axis[:, 2]) if self.rotary else np.zeros(len(q))
        expected = np.stack([s, -np.sin(tilt) * c, np.cos(tilt) * c], axis=1)
        platform = rotations(np.array([1.0, 0.0, 0.0]), tilt)
        centre = tip + (self.gauge + length)[:, None] * axis - apply(platform,
                                                                     np.broadcast_to(self.pivot, tip.shape))
        worst = 1000.0 * np.abs(axis - expected).max(axis=1)
        for k, name in enumerate(self.legs):
            carriage = self.slide[k] + q[:, letters.index(name)][:, None] * self.direction[k]
            rod = carriage - centre - apply(platform, np.broadcast_to(self.joint[k], tip.shape))
            size = np.sqrt((rod * rod).sum(axis=1))
            wrong = (rod @ self.direction[k]) * self.root[k] < 0.0
            worst = np.maximum(worst, np.where(wrong, np.inf, np.abs(size - self.length[k])))
        return np.asarray(worst)


def rods(table: dict[str, Any]) -> Rods:
    """The rods of a machine file of kind "linear-delta" or "h4-linear"."""
    kinematics = table["kinematics"]
    legs, rotary = kinematics["legs"], kinematics.get("rotary", {})

    def column(key: str, default: Any = (0.0, 0.0, 0.0)) -> Array:
        return np.array([leg.get(key, default) for leg in legs.values()], np.float64)

    return Rods(column("slide"), unit(column("direction")), column("joint"), column("rod"), column("root", 1.0), tuple(legs),
                float(kinematics.get("gauge", 0.0)), rotary.get("letter", ""), rotary.get("carries", ""),
                float(rotary.get("positive", 1)), np.array(rotary.get("pivot", (0.0, 0.0, 0.0)), np.float64))


def kinematics_of(table: dict[str, Any]) -> Chain | Rods | None:
    """The machine of a file; None of a kind that this witness does not know."""
    kind = table.get("kinematics", {}).get("kind", table.get("kinematics", {}).get("family"))
    if kind == "serial":
        return chain(table)
    return rods(table) if kind in ("linear-delta", "h4-linear") else None


def limits_of(table: dict[str, Any], letters: tuple[str, ...]) -> tuple[Array, Array]:
    """(travel (J, 2), velocity at feed (J,)) in mm, rad, s; infinite where unlimited."""
    unit_of = np.array([math.pi / 180.0 if name in "ABC" else 1.0 for name in letters])
    travel, speed = [], []
    for name in letters:
        axis = table.get("axes", {}).get(name, {})
        found = axis.get("travel", "unlimited")
        travel.append((-math.inf, math.inf) if isinstance(found, str) else found)
        speed.append(min(axis.get("velocity", math.inf), axis.get("cutting_velocity", math.inf)))
    return np.array(travel, np.float64) * unit_of[:, None], np.array(speed, np.float64) * unit_of


def other_limits(table: dict[str, Any], letters: tuple[str, ...], given: Array) -> list[str]:
    """The limits (J, 6) that are not those of the machine file, in words."""
    found = []
    for name, values in zip(letters, given.tolist(), strict=True):
        axis, scale = table.get("axes", {}).get(name, {}), math.pi / 180.0 if name in "ABC" else 1.0
        travel = (-math.inf, math.inf) if axis.get("travel") == "unlimited" else axis.get("travel") or (None, None)
        stated = [*travel, *(axis.get(key) for key in LIMITS[2:])]
        found += [f"the {what} of {name} is {value / scale:g} here, {own:g} in the machine file"
                  for what, own, value in zip(LIMITS, stated, values, strict=True)
                  if own is not None and not math.isclose(own * scale, value, rel_tol=1e-9, abs_tol=1e-9)]
    return found
