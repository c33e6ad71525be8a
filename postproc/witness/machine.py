"""Poses of the tool from a machine file: a product of matrices axis by axis, or rods held against their lengths."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from postproc.witness.commanded import unit
from postproc.witness.text import Array

_ALONG = {"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1), "U": (1, 0, 0), "V": (0, 1, 0), "W": (0, 0, 1),
          "A": (1, 0, 0), "B": (0, 1, 0), "C": (0, 0, 1)}
LIMITS = ("least", "greatest", "velocity", "acceleration", "jerk", "home")
ROD = 1e-4
"""mm by which a rod may miss its length"""
SPIN_STEPS, SPUN = 8, 1e-10
SPINS = (0.0, 0.5, -0.5, 1.0, -1.0)
"""rad: from where the turn of a tool about itself, which no file states, is sought in so many steps, to SPUN rad"""


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
    return Chain(tuple(names), direction, point, unit(np.array(kinematics.get("tool_axis", (0.0, 0.0, 1.0)), np.float64)))


@dataclass(frozen=True)
class Rods:
    """A platform on rods: whether they have their lengths where a tool is claimed to be; of each leg its letter, its drive,
    (foot at 0, direction, platform joint, arm) (4, 3), rod, root."""

    legs: tuple[tuple[str, str, Array, float, float], ...]
    turns: str
    gauge: float
    pivot: Array
    rotary: str = ""
    carries: str = ""
    sense: float = 1.0
    carriers: dict[str, Array] = field(default_factory=dict)
    held: Array = field(default_factory=lambda: np.zeros(3))
    wrong: bool = False
    """every rod is a leg of its own, the platform turns as it must; of two pairs in a plane the mean of each counts"""

    @property
    def flat(self) -> bool:
        """True where platform and carriers leave the tip in one plane."""
        return int(np.linalg.matrix_rank(np.array([*np.diag(1.0 - self.held), *self.carriers.values()]))) < 3

    def misfit(self, q: Array, letters: tuple[str, ...], tip: Array, axis: Array, length: Array) -> Array:
        """(N,) mm: the worst of rods off their length, and of the axis off what the platform can do (times
        1000); infinite where the foot of a rod stands on the wrong side of it."""
        turn = self.sense * q[:, letters.index(self.rotary)] if self.rotary else np.zeros(len(q))
        if self.carries == "part":
            back = rotations(np.array([0.0, 0.0, 1.0]), -turn)
            tip, axis = apply(back, tip), apply(back, axis)
        s, c = (np.sin(turn), np.cos(turn)) if self.carries == "spindle" else (np.zeros(len(q)), np.ones(len(q)))
        for name, along in self.carriers.items():
            tip = tip - q[:, letters.index(name)][:, None] * along
        k, sign, spins = int(self.turns != "b"), 1.0 if self.turns == "b" else -1.0, self.wrong or self.turns == "abc"
        tilt = np.arctan2(sign * axis[:, k], axis[:, 2]) * bool(self.turns)
        platform = least_turns(axis) if spins else rotations(np.eye(3)[1 - k], tilt)
        expected = axis if spins else apply(platform, np.stack([s, 0.0 * s, c], axis=1))
        above = tip + (self.gauge + length)[:, None] * axis
        platform, off = self._spun(q, letters, above, platform) if spins else (
            platform, self._legs(q, letters, above, platform)[0])
        if self.wrong and self.held.any():
            off = 0.5 * (off[::2] + off[1::2])
        aside = np.abs((above - apply(platform, self.pivot[None])) * self.held).max(axis=1)
        return np.asarray(np.max([1000.0 * np.abs(axis - expected).max(axis=1), np.abs(off).max(axis=0), aside], axis=0))

    def _spun(self, q: Array, letters: tuple[str, ...], above: Array, level: Array) -> tuple[Array, Array]:
        """(platform (N, 3, 3), mm by which each rod misses its length (K, N)) where the tool is turned about itself as the
        rods have it; `level` without."""
        best, found, z = level, np.full((len(self.legs), len(q)), np.inf), np.array([0.0, 0.0, 1.0])
        for start in SPINS:
            platform, spin = level, np.full(len(q), start)
            for _ in range(SPIN_STEPS):
                platform = platform @ rotations(z, np.where(np.isfinite(spin), spin, 0.0))
                off, slope = self._legs(q, letters, above, platform)
                if not np.abs(spin := -(off * slope).sum(axis=0) / (slope * slope).sum(axis=0)).max(initial=0.0) > SPUN:
                    break
            better = np.abs(off).max(axis=0) < np.abs(found).max(axis=0)
            best, found = np.where(better[:, None, None], platform, best), np.where(better, off, found)
            if (np.abs(found).max(axis=0) <= ROD).all():
                break
        return best, found

    def _legs(self, q: Array, letters: tuple[str, ...], above: Array, platform: Array) -> tuple[Array, Array]:
        """(mm by which each rod misses its length, how that changes as the platform turns about its own z) (K, N)."""
        offs, slopes = [], []
        for letter, drive, (foot, along, joint, arm), size, root in self.legs:
            value, own = q[:, letters.index(letter)], joint[None] - self.pivot
            reach = apply(rotations(along, value), arm[None]) if drive == "arm" else 0.0
            rod = foot + (value[:, None] * along if drive == "slide" else reach) - above - apply(platform, own)
            moved = along if drive == "slide" else np.cross(along, reach) if drive == "arm" else 0.0
            long, due = np.sqrt((rod * rod).sum(axis=1)), size + value * (drive == "length")
            wrong = ((rod * moved).sum(axis=1) * root < 0.0) | (due <= 0.0)
            offs.append(np.where(wrong, np.inf, long - due))
            slopes.append(-(rod * apply(platform, np.cross([0.0, 0.0, 1.0], own))).sum(axis=1) / long)
        return np.array(offs), np.array(slopes)


def least_turns(axis: Array) -> Array:
    """(N, 3, 3): the least turns that take z to unit vectors (N, 3), none of them against it."""
    x, y, z = axis.T
    return np.stack([1.0 - x * x / (1.0 + z), -x * y / (1.0 + z), x, -x * y / (1.0 + z), 1.0 - y * y / (1.0 + z), y,
                     -x, -y, z], axis=1).reshape(-1, 3, 3)


def ring(layout: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The legs of a table `[kinematics.layout]`."""
    names, found = layout["letters"], {}
    angles = layout.get("angles") or [360.0 * k / len(names) for k in range(len(names))]
    asides, arm = layout.get("aside") or [0.0] * len(names), layout.get("arm", 1.0)
    for name, *turns, aside in zip(names, angles, layout.get("joint_angles") or angles, asides, strict=True):
        (out, there), lean = np.exp(1j * np.radians(turns)), math.radians(layout.get("lean", 0.0))
        foot, end = (layout["radius"] + 1j * aside) * out, (layout["joint_radius"] + 1j * aside) * there
        level = 1j * out if layout["drive"] == "arm" else math.sin(lean) * out
        found[name] = {
            **layout, "direction": (level.real, level.imag, 0.0 if layout["drive"] == "arm" else math.cos(lean)),
            "point": (foot.real, foot.imag, layout.get("height", 0.0)), "arm": (arm * out.real, arm * out.imag, 0.0),
            "joint": (end.real, end.imag, layout.get("joint_height", 0.0))}
    return found


def legs_of(kinematics: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The tables of all legs, by letter."""
    return {**(ring(kinematics["layout"]) if "layout" in kinematics else {}), **kinematics.get("legs", {})}


def rods(table: dict[str, Any]) -> Rods:
    """The rods of a machine file of kind "legs", "linear-delta" or "h4-linear"."""
    kinematics = table["kinematics"]
    rotary, carriers = kinematics.get("rotary", {}), kinematics.get("carriers", {})

    def rows(leg: dict[str, Any], *keys: str) -> Array:
        return np.array([leg.get(key, (0.0, 0.0, float(key == "direction"))) for key in keys], np.float64)

    legs = tuple((name, leg.get("drive", "slide"), rows({"point": leg.get("slide"), **leg}, "point", "direction", "joint",
                  "arm"), float(leg["rod"]), float(leg.get("root", 1))) for name, leg in legs_of(kinematics).items())
    for _, _, leg, _, _ in legs:
        leg[1] = unit(leg[1])
    if kinematics.get("kind") == "legs":
        return Rods(legs, "".join(sorted(set(kinematics["freedoms"]) & set("abc"))), 0.0, rows(kinematics, "gauge")[0],
                    carriers={name: unit(rows(one, "direction")[0]) for name, one in carriers.items()},
                    held=np.array([float(letter not in kinematics["freedoms"]) for letter in "xyz"]))
    return Rods(legs, "a" if rotary else "", float(kinematics.get("gauge", 0.0)), rows(rotary, "pivot")[0],
                rotary.get("letter", ""), rotary.get("carries", ""), float(rotary.get("positive", 1)))


def kinematics_of(table: dict[str, Any]) -> Chain | Rods | None:
    """The machine of a file; None of a kind that this witness does not know."""
    kind = table.get("kinematics", {}).get("kind", table.get("kinematics", {}).get("family"))
    if kind == "serial":
        return chain(table)
    return rods(table) if kind in ("linear-delta", "h4-linear", "legs") else None


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
