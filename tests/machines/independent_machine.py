"""A machine with geometric errors, read from its files and built a second time; nothing of the code under test is used.

Serial machines are products of 4 x 4 matrices, one point at a time, torsors "displaced, then turned about x,
y, z" (Oueslati 2004, 1.12 to 1.18). Machines on rods close |A'B| = L + dl six times (Company 2000, II-52 to
II-58, E-1 to E-9) by scipy's least squares in place and rotation vector of the platform. What the files mean
is what the READMEs of `machines` and `machines/geometric_error` say.
"""

from __future__ import annotations

import csv
import math
import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

DATA = Path(__file__).parents[2] / "machines" / "data"
UNITS = {"mm": 1.0, "um": 1e-3, "m": 1e3, "in": 25.4, "deg": math.pi / 180.0, "arcsec": math.pi / 648000.0, "urad": 1e-6}
DIRECTIONS = "XYZABC"
Way = float
Curve = Callable[[float, Way], float]


def matrix(turn: Rotation | None = None, shift: Any = (0.0, 0.0, 0.0)) -> np.ndarray:
    """4 x 4."""
    result = np.eye(4)
    result[:3, :3] = np.eye(3) if turn is None else turn.as_matrix()
    result[:3, 3] = shift
    return result


def at(point: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """The motion about a point instead of the origin."""
    return matrix(shift=point) @ motion @ matrix(shift=-point)


def torsor(six: np.ndarray) -> np.ndarray:
    """Displaced, then turned about x, y, z, each about the axes as turned before."""
    return matrix(Rotation.from_euler("XYZ", six[3:]), six[:3])


@dataclass(frozen=True)
class Axis:
    """One axis of the chain in the order from the part to the tool; what carries the part stands before the bed."""

    letter: str
    rotary: bool
    line: np.ndarray
    point: np.ndarray
    carries_part: bool


class Errors:
    """An error file and its tables; values in mm and rad at positions in mm and rad."""

    def __init__(self, file: Path) -> None:
        self.folder, self.toml = file.parent, tomllib.loads(file.read_text())
        self.length = UNITS[self.toml.get("length_unit", "um")]
        self.angle = UNITS[self.toml.get("angle_unit", "arcsec")]
        self.curves = {name: self.curve(name, given) for name, given in self.toml.get("components", {}).items()}
        self.reference: dict[str, Any] = self.toml.get("reference", {})

    def unit(self, name: str) -> float:
        return self.angle if name[1] in "ABC" else self.length

    def constants(self, letter: str) -> np.ndarray:
        """(6,) of E?0L; the axis's own direction is its zero position and 0 here."""
        given = self.toml.get("location", {})
        names = [f"E{d}0{letter}" for d in DIRECTIONS]
        return np.array([0.0 if name[1] == letter else given.get(name, 0.0) * self.unit(name) for name in names])

    def zero(self, letter: str) -> float:
        """E L 0 L: how much farther the axis stands along or about x, y or z than it counts."""
        return float(self.toml.get("location", {}).get(f"E{letter}0{letter}", 0.0)) * self.unit(f"E{letter}")

    def six(self, letter: str, position: float, approach: Way = 0.0) -> np.ndarray:
        names = [f"E{d}{letter}" for d in DIRECTIONS]
        return np.array([self.curves[name](position, approach) if name in self.curves else 0.0 for name in names])

    def curve(self, name: str, given: dict[str, Any]) -> Curve:
        place = UNITS["deg"] if name[2] in "ABC" else 1.0
        sign = float(given.get("sign", 1))
        if "table" in given:
            return self.table(name, given, place, sign)
        low, high = (v * place for v in given.get("range", (-math.inf, math.inf)))
        origin, size = given.get("origin", 0.0) * place, self.unit(name) * sign

        def polynomial(x: float, _: Way) -> float:
            t = (min(max(x, low), high) - origin) / (given.get("scale", 1.0) * place)
            return float(size * sum(a * t**k for k, a in enumerate(given["polynomial"])))

        def series(x: float, _: Way) -> float:
            phase = 2.0 * math.pi * (min(max(x, low), high) - origin) / (given.get("repeats", 360.0) * place)
            waves = [(given.get("cosine", ()), math.cos), (given.get("sine", ()), math.sin)]
            return float(size * (given.get("mean", 0.0)
                                 + sum(a * f((k + 1) * phase) for amounts, f in waves for k, a in enumerate(amounts))))

        return polynomial if "polynomial" in given else series

    def rows(self, name: str, values: np.ndarray) -> np.ndarray:
        """The values of a table as they are counted, mm or rad."""
        del name
        return values

    def table(self, name: str, given: dict[str, Any], place: float, sign: float) -> Curve:
        lines = [line for line in (self.folder / given["table"]).read_text().splitlines() if line and line[0] != "#"]
        head, *rows = csv.reader(lines)
        columns = {}
        for k, title in enumerate(head):
            found = re.fullmatch(r"\s*(\S+) \[(\w+)\]\s*", title)
            assert found is not None
            columns[found[1]] = np.array([float(row[k]) for row in rows]) * UNITS[found[2]]
        period, spline = given.get("repeats", 0.0) * place, given.get("interpolation") == "spline"
        approaches = [between(columns[name[2]], sign * self.rows(name, columns[key]), spline, period)
                      for key in (f"{name}+", f"{name}-", name) if key in columns]
        return lambda x, approach: (approaches[0](x) * (1.0 + approach) + approaches[-1](x) * (1.0 - approach)) / 2.0


def between(x: np.ndarray, y: np.ndarray, spline: bool, period: float) -> Callable[[float], float]:
    """The table between its rows; at its ends it stays."""
    if period:
        if x[-1] - x[0] < period * (1.0 - 1e-9):
            x, y = np.append(x, x[0] + period), np.append(y, y[0])
        y = np.append(y[:-1], y[0])
    cubic = CubicSpline(x, y, bc_type="periodic" if period else "not-a-knot") if spline else None

    def value(at: float) -> float:
        at = x[0] + (at - x[0]) % period if period else min(max(at, x[0]), x[-1])
        return float(np.interp(at, x, y) if cubic is None else cubic(at))

    return value


class Machine:
    """A machine file; joints linear axes (or slides) first, then rotary ones."""

    def __init__(self, file: str | Path) -> None:
        path = Path(file) if str(file).endswith(".toml") else DATA / f"{file}.toml"
        self.toml = tomllib.loads(path.read_text())
        self.kinematics: dict[str, Any] = self.toml["kinematics"]

    @cached_property
    def chain(self) -> list[Axis]:
        found, part = [], True
        for token in re.sub(r"\(.*?\)", "", self.kinematics["structure"]).split():
            part = part and token != "b"
            letter = token.rstrip("'")
            if letter in DIRECTIONS:
                given = self.kinematics.get("axes", {}).get(letter, {})
                line = np.array(given.get("direction", np.eye(3)[DIRECTIONS.index(letter) % 3]), dtype=float)
                line = line / np.linalg.norm(line) * given.get("positive", 1)
                found.append(Axis(letter, letter in "ABC", line, np.array(given.get("point", (0, 0, 0)), dtype=float), part))
        return found

    @cached_property
    def letters(self) -> list[str]:
        if self.kinematics["kind"] == "serial":
            return sorted(axis.letter for axis in self.chain if not axis.rotary) + sorted(
                axis.letter for axis in self.chain if axis.rotary)
        turning = self.kinematics.get("rotary", {}).get("letter", "")
        return [*self.kinematics["legs"], *turning]

    def pose(self, q: np.ndarray, tool: float, errors: Errors | None = None, approach: np.ndarray | None = None,
             near: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """(tip, axis) (3,) in the table frame of joints q (J,); `near` (6,): roughly the same, for machines on rods."""
        approaches = np.zeros(len(q)) if approach is None else approach
        now = dict(zip(self.letters, zip(q, approaches, strict=True), strict=True))
        frame = np.eye(4)
        if self.kinematics["kind"] == "serial":
            for axis in self.chain:
                frame = frame @ moved(axis, *now[axis.letter], errors)
            gauge = 0.0
        else:
            frame, gauge = self.on_rods(q, tool, errors, near)
        spindle = np.eye(4) if errors is None else torsor(errors.constants("S"))
        frame = frame @ matrix(shift=(0.0, 0.0, -gauge)) @ spindle
        return frame[:3, 3] - tool * frame[:3, 2], frame[:3, 2]

    def on_rods(self, q: np.ndarray, tool: float, errors: Errors | None,
                near: np.ndarray | None) -> tuple[np.ndarray, float]:
        """(Platform and what it carries in the table frame, mm from there to the gauge point)."""
        gauge, axis = float(self.kinematics.get("gauge", 0.0)), self.rotary_axis
        slides = q[: len(self.kinematics["legs"])]
        start = np.append(self.middle, [0.0, 0.0, 0.0]) if near is None else self.start(q, tool + gauge, near)
        platform = self.platform(slides, errors, start)
        if axis is None:
            return platform, gauge
        turn = moved(axis, q[-1], 0.0, errors)
        return (turn @ platform if axis.carries_part else platform @ turn), gauge

    def start(self, q: np.ndarray, below: float, near: np.ndarray) -> np.ndarray:
        """(6,) place and rotation vector of the platform from tip and axis in the table frame, `below` mm under it."""
        tip, axis = near[:3], near[3:]
        if self.rotary_axis is not None and self.rotary_axis.carries_part:
            table = np.linalg.inv(moved(self.rotary_axis, q[-1], 0.0, None))
            tip, axis = table[:3, :3] @ tip + table[:3, 3], table[:3, :3] @ axis
        return np.append(tip + below * axis, [math.atan2(-axis[1], axis[2]), 0.0, 0.0])

    @cached_property
    def rotary_axis(self) -> Axis | None:
        """The table under the part, or the axis between platform and spindle."""
        given = self.kinematics.get("rotary")
        if given is None:
            return None
        line = np.eye(3)["ABC".index(given["letter"])] * given.get("positive", 1)
        return Axis(given["letter"], True, line, np.array(given.get("pivot", (0, 0, 0)), dtype=float),
                    given["carries"] == "part")

    @cached_property
    def middle(self) -> np.ndarray:
        box = self.kinematics["workspace"]
        return np.array([0.5 * (box[k][0] + box[k][1]) for k in "xyz"])

    def rods(self, slides: np.ndarray, errors: Errors | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(A', B on the platform, lengths) of the six rods with their errors, mm; (6, 3), (6, 3), (6,)."""
        starts, ends, lengths = [], [], []
        for (letter, leg), q in zip(self.kinematics["legs"].items(), slides, strict=True):
            given = {} if errors is None else errors.toml.get("legs", {}).get(letter, {})
            mm, rad = (1.0, 1.0) if errors is None else (errors.length, errors.angle)
            slide, u, joint = (np.array(leg[k], dtype=float) for k in ("slide", "direction", "joint"))
            u = u / np.linalg.norm(u)
            offset = np.array(leg.get("rail_offset", (0, 0, 0)), dtype=float)
            rail = slide + offset
            guide = guide_axes(u, -offset if np.any(offset) else self.middle - rail)
            turn = Rotation.from_euler("XYZ", np.array(given.get("guide", (0, 0, 0))) * rad).as_matrix()
            for k, adjacent in enumerate(leg.get("rods") or self.pair(leg, given.get("pair", 50.0))):
                own, far = (np.array(given[key][k]) * mm if given.get(key) else np.zeros(3)
                            for key in ("carriage", "platform"))
                starts.append(rail + np.array(given.get("rail", (0, 0, 0))) * mm
                              + turn @ (q * u + np.array(adjacent) - offset) + guide @ own)
                ends.append(joint + np.array(adjacent) + far)
                lengths.append(leg["rod"] + (given["length"][k] * mm if given.get("length") else 0.0))
        return np.array(starts), np.array(ends), np.array(lengths)

    def pair(self, leg: dict[str, Any], half: float) -> list[np.ndarray]:
        """Two rods square to the slide and, in the middle of the workspace, to themselves."""
        slide, u, joint = (np.array(leg[k], dtype=float) for k in ("slide", "direction", "joint"))
        far = self.middle + joint - slide
        along = far @ u
        q = along + leg.get("root", 1) * math.sqrt(leg["rod"] ** 2 - far @ far + along**2)
        across = np.cross(u, far - q * u)
        across *= half / np.linalg.norm(across)
        return [across, -across]

    def platform(self, slides: np.ndarray, errors: Errors | None, start: np.ndarray) -> np.ndarray:
        """4 x 4 of the platform whose six rods have their lengths, from `start` (6,): place, rotation vector."""
        a, b, lengths = self.rods(slides, errors)
        size = np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3])

        def gaps(x: np.ndarray) -> np.ndarray:
            ends = x[:3] + b @ Rotation.from_rotvec(x[3:] * 1e-3).as_matrix().T
            return np.linalg.norm(ends - a, axis=1) - lengths

        found = least_squares(gaps, start / size, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
        assert np.abs(found.fun).max() < 1e-9, "the rods do not close"
        return matrix(Rotation.from_rotvec(found.x[3:] * 1e-3), found.x[:3])


def moved(axis: Axis, position: float, approach: Way, errors: Errors | None) -> np.ndarray:
    """4 x 4 of one axis: its line as it lies, its own motion from its zero, its component errors."""
    zero = 0.0
    if errors is not None:
        lean = axis.line[DIRECTIONS.index(axis.letter) % 3]
        zero = errors.zero(axis.letter) * (-1.0 if lean < 0.0 else 1.0)
    step = position + zero
    turn = Rotation.from_rotvec(axis.line * step)
    motion = at(axis.point, matrix(turn)) if axis.rotary else matrix(shift=axis.line * step)
    if errors is None:
        return motion
    given = errors.reference.get(axis.letter, {})
    centre = np.array(given.get("point", axis.point if axis.rotary else (0, 0, 0)), dtype=float)
    place = at(axis.point if axis.rotary else centre, torsor(errors.constants(axis.letter)))
    motion = place @ motion @ np.linalg.inv(place)
    wrong = at(centre, torsor(errors.six(axis.letter, position, approach)))
    frame = given.get("frame", "bed")
    before = axis.rotary and (not axis.carries_part if frame == "bed" else frame == "fixed")
    return wrong @ motion if before else motion @ wrong


def guide_axes(u: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Columns: x across the slide towards the joint, y, z along the slide."""
    x = towards - (towards @ u) * u
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(u, x), u])
