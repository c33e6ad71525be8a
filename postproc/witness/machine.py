"""Poses of the tool from a machine file: a product of matrices axis by axis, or rods held against their lengths."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from postproc.witness.commanded import unit
from postproc.witness.held import Bars, HeldPlatform, held
from postproc.witness.text import Array

_ALONG = {"X": (1, 0, 0), "Y": (0, 1, 0), "Z": (0, 0, 1), "U": (1, 0, 0), "V": (0, 1, 0), "W": (0, 0, 1),
          "A": (1, 0, 0), "B": (0, 1, 0), "C": (0, 0, 1)}
_UP = np.array([0.0, 0.0, 1.0])
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
                tip = turned(along, value, tip - self.point[name]) + self.point[name]
                axis = turned(along, value, axis)
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


def turned(along: Array, angle: Array, v: Array) -> Array:
    """Vectors (N, 3) or (1, 3) turned about a unit vector by angles (N,): `rotations` without their matrices."""
    angle = angle[:1] if len(angle) and (angle == angle[0]).all() else angle
    sine, rest, result = np.sin(angle), 1.0 - np.cos(angle), np.empty((max(len(angle), len(v)), 3))
    columns = np.ascontiguousarray(v.T)
    first = across(along, columns)
    for k, (value, once, twice) in enumerate(zip(columns, first, across(along, first), strict=True)):
        result[:, k] = value + sine * once + rest * twice
    return result


def across(along: Array, v: Sequence[Array] | Array) -> list[Array]:
    """The vector product of one vector with others, these and that by columns."""
    return [along[j] * v[k] - along[k] * v[j] for j, k in ((1, 2), (2, 0), (0, 1))]


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
    (foot at 0, direction, platform joint, arm, what of the joint keeps its direction) (5, 3), rod, root.

    `pivot` stands on the platform, the gauge point `reach` from it, turned by an axis at the spindle."""

    legs: tuple[tuple[str, str, Array, float, float], ...]
    turns: str
    pivot: Array
    reach: Array
    rotary: str = ""
    carries: str = ""
    sense: float = 1.0
    carriers: dict[str, Array] = field(default_factory=dict)
    held: Array = field(default_factory=lambda: np.zeros(3))
    besides: HeldPlatform = field(default_factory=HeldPlatform)
    rings: dict[str, float] = field(default_factory=dict)
    tables: dict[str, Array] = field(default_factory=dict)
    wrist: dict[str, Array] = field(default_factory=dict)
    """(direction, point) (2, 3) of rotary axes in series: from the part to the bed, from the platform to the spindle"""
    bars: Bars | None = None
    wrong: bool = False
    """every rod is a leg of its own, the platform turns as it must; of two pairs in a plane the mean of each counts"""

    @property
    def flat(self) -> bool:
        """True where platform and carriers leave the tip in one plane."""
        return int(np.linalg.matrix_rank(np.array([*np.diag(1.0 - self.held), *self.carriers.values()]))) < 3

    def misfit(self, q: Array, letters: tuple[str, ...], tip: Array, axis: Array, length: Array) -> Array:
        """(N,) mm: the worst of rods off their length, and of the axis off what the platform can do (times
        1000); infinite where the foot of a rod stands on the wrong side of it."""
        return self._placed(q, letters, tip, axis, length)[0]

    def spins(self, q: Array, letters: tuple[str, ...], tip: Array, axis: Array, length: Array) -> Array:
        """(N,) rad that the rods turn a tool about itself from where the least turn of the platform has it."""
        platform = self._placed(q, letters, tip, axis, length)[1]
        side = (least_turns(axis)[:, :, 0] * platform[:, :, 1]).sum(axis=1)
        return np.asarray(np.arctan2(-side, (least_turns(axis)[:, :, 0] * platform[:, :, 0]).sum(axis=1)))

    def _placed(self, q: Array, letters: tuple[str, ...], tip: Array, axis: Array,
                length: Array) -> tuple[Array, Array]:
        """(what `misfit` gives, the platform (N, 3, 3))."""
        turn = self.sense * q[:, letters.index(self.rotary)] if self.rotary else np.zeros(len(q))
        if self.carries == "part":
            back = rotations(_UP, -turn)
            tip, axis = apply(back, tip), apply(back, axis)
        for name, (along, point) in self.tables.items():
            back = -q[:, letters.index(name)]
            tip, axis = turned(along, back, tip - point) + point, turned(along, back, axis)
        for name, along in self.carriers.items():
            tip = tip - q[:, letters.index(name)][:, None] * along
        head = rotations(np.eye(3)[int(self.turns != "b")], turn * (self.carries == "spindle"))
        tool = apply(head, _UP[None])
        if self.wrist:
            tool, reach = self._at_wrist(q, letters)
            turns = self.turns or self.wrong
            least = _between(np.broadcast_to(tool, axis.shape), axis) if turns else np.eye(3)[None]
            return self._closed(q, letters, (tip, axis, length), np.broadcast_to(least, (len(q), 3, 3)), (tool, reach))
        platform = self._nominal(axis * np.where(tool[:, 2:] < 0.0, -1.0, 1.0))  # past a quarter turn the head points back
        if self.wrong and (self.turns != "c" or self.bars is not None):
            platform = _between(np.broadcast_to(apply(platform, tool), axis.shape), axis) @ platform
        return self._closed(q, letters, (tip, axis, length), platform, (tool, apply(head, self.reach[None])))

    def _at_wrist(self, q: Array, letters: tuple[str, ...]) -> tuple[Array, Array]:
        """(tool axis, gauge point from the reference point) (N, 3) in directions of the platform."""
        tool, reach = np.broadcast_to(_UP, (len(q), 3)), np.broadcast_to(self.reach, (len(q), 3))
        for name, (along, point) in reversed(self.wrist.items()):
            value = q[:, letters.index(name)]
            tool, reach = turned(along, value, tool), turned(along, value, reach - point) + point
        return tool, reach

    def _closed(self, q: Array, letters: tuple[str, ...], claimed: tuple[Array, Array, Array], platform: Array,
                carried: tuple[Array, Array]) -> tuple[Array, Array]:
        """What `_placed` gives of a tip, axis and length that are `claimed`; `carried`: tool axis and gauge point on the
        platform."""
        (tip, axis, length), (tool, reach) = claimed, carried
        expected, gauge = apply(platform, tool), tip + length[:, None] * axis
        if self.wrong or "c" in self.turns:  # the tool turns about itself between blocks
            platform, off = self._spun(q, letters, gauge, platform, reach, axis)
        else:
            off = self._legs(q, letters, gauge, platform, reach, axis)[0]
        off = self._middles(off)
        aside = np.abs((gauge - apply(platform, reach + self.pivot)) * self.held).max(axis=1)
        worst = np.max([1000.0 * np.abs(axis - expected).max(axis=1), np.abs(off).max(axis=0), aside], axis=0)
        return np.asarray(worst), platform

    def _middles(self, off: Array) -> Array:
        """Of pairs that errors may twist, the mean of both rods."""
        return 0.5 * (off[::2] + off[1::2]) if self.wrong and self.held.any() else off

    def _nominal(self, axis: Array) -> Array:
        """(N, 3, 3): the platform as its freedoms let it turn towards tool axes (N, 3), spin left out."""
        if self.turns == "abc":
            return least_turns(axis)
        k, sign = int(self.turns != "b"), 1.0 if self.turns == "b" else -1.0
        tilt = np.arctan2(sign * axis[:, k], axis[:, 2]) * (self.turns in ("a", "b"))
        return np.broadcast_to(rotations(np.eye(3)[1 - k], tilt), (len(axis), 3, 3))

    def _spun(self, q: Array, letters: tuple[str, ...], gauge: Array, level: Array, reach: Array,
              axis: Array) -> tuple[Array, Array]:
        """(platform (N, 3, 3), mm by which each rod misses its length (K, N)) where the tool is turned about itself as the
        rods have it; `level` without."""
        best, found = level, np.full((1, len(q)), np.inf)
        for start in SPINS:
            platform, spin = level, np.full(len(q), start)
            swing = None if self.bars is None else self.bars.start(_spun(axis, spin) @ level)
            for _ in range(SPIN_STEPS):
                platform = _spun(axis, np.where(np.isfinite(spin), spin, 0.0)) @ platform
                off, slope, swung = self._legs(q, letters, gauge, platform, reach, axis, swing)
                loose, tilted = off, slope
                if self.bars is not None:
                    loose, tilted, by_off, by_slope = self.bars.freed(off, slope, swung)
                steep = np.maximum((tilted * tilted).sum(axis=0), 1e-300)
                spin = -(loose * tilted).sum(axis=0) / steep
                most = np.abs(spin).max(initial=0.0)
                if swing is not None:
                    turn = by_off + by_slope * np.where(np.isfinite(spin), spin, 0.0)
                    swing, most = swing - turn, max(most, np.abs(turn).max(initial=0.0))
                if not most > SPUN:
                    break
            found = np.broadcast_to(found, off.shape)
            missed, least = (np.abs(self._middles(one)).max(axis=0) for one in (off, found))
            better = missed < least
            best, found = np.where(better[:, None, None], platform, best), np.where(better, off, found)
            if (np.minimum(missed, least) <= ROD).all():
                break
        return best, found

    def _legs(self, q: Array, letters: tuple[str, ...], gauge: Array, platform: Array, reach: Array,
              axis: Array, swing: Array | None = None) -> tuple[Array, Array, Array]:
        """(mm by which each rod misses its length, how that changes as the platform turns about the tool axis, and as its
        bar turns) (K, N)."""
        offs, slopes, planes = [], [], []
        swung = np.zeros((len(self.legs), len(q)))
        for k, (letter, drive, (foot, along, joint, arm, kept, *plane), size, root) in enumerate(self.legs):
            value, own = q[:, letters.index(letter)], apply(platform, joint[None] - self.pivot - reach)
            crank = apply(rotations(along, value), arm[None]) if drive == "arm" else 0.0
            if self.bars is not None and swing is not None and self.bars.of[k] >= 0:
                end, turned_by = self.bars.ends(k, platform, swing[k])
                own = own + end
            rod = foot + (value[:, None] * along if drive == "slide" else crank) - gauge - own - kept
            moved = along if drive == "slide" else np.cross(along, crank) if drive == "arm" else 0.0
            if letter in self.rings:
                z = platform[:, :, 2]
                up = (rod * z).sum(axis=1)
                aside = np.sqrt(np.maximum((rod * rod).sum(axis=1) - up * up, 1e-300))
                rod = up[:, None] * z + ((aside - self.rings[letter]) / aside)[:, None] * (rod - up[:, None] * z)
            long, due = np.sqrt((rod * rod).sum(axis=1)), size + value * (drive == "length")
            wrong = ((rod * moved).sum(axis=1) * root < 0.0) | (due <= 0.0)
            offs.append(np.where(wrong, np.inf, long - due))
            slopes.append(-(rod * np.cross(axis, own)).sum(axis=1) / long)
            if self.bars is not None and swing is not None and self.bars.of[k] >= 0:
                swung[k] = -(rod * turned_by).sum(axis=1) / long
            planes += [(-rod @ normal, np.cross(axis, own) @ normal) for normal in plane]
        for off, slope in planes + self.besides.misses(gauge, self.pivot + reach, platform, axis):
            offs.append(off)
            slopes.append(slope)
        return np.array(offs), np.array(slopes), swung


def _spun(axis: Array, angle: Array) -> Array:
    """(N, 3, 3): turns by `angle` (N,) about unit vectors (N, 3)."""
    cross = np.zeros((len(axis), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        cross[:, k, j], cross[:, j, k] = axis[:, i], -axis[:, i]
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + s * cross + (1.0 - c) * (cross @ cross))


def _between(start: Array, end: Array) -> Array:
    """(N, 3, 3): the least turns that take unit vectors (N, 3) to others, none of them against it."""
    over, along = np.cross(start, end), (start * end).sum(axis=1)
    size = np.sqrt((over * over).sum(axis=1))
    about = over / np.where(size > 0.0, size, 1.0)[:, None]
    return _spun(about, np.arctan2(size, along))


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
        half, rail = 0.5j * layout.get("pair", 0.0) * out, layout.get("rail_offset", 0.0) * out
        level = 1j * out if layout["drive"] == "arm" else math.sin(lean) * out
        found[name] = {
            **layout, "direction": (level.real, level.imag, 0.0 if layout["drive"] == "arm" else math.cos(lean)),
            "hinge": ((1j * out).real, (1j * out).imag, 0.0) if layout.get("hinged") else None,
            "point": (foot.real, foot.imag, layout.get("height", 0.0)), "arm": (arm * out.real, arm * out.imag, 0.0),
            "joint": (end.real, end.imag, layout.get("joint_height", 0.0)),
            "rail_offset": (rail.real, rail.imag, 0.0),
            "rods": [(side * half.real, side * half.imag, 0.0) for side in (1.0, -1.0)] if half else []}
    return found


def legs_of(kinematics: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """The tables of all legs, by letter."""
    rings = [*([kinematics["layout"]] if "layout" in kinematics else []), *kinematics.get("rings", {}).values()]
    return {name: leg for part in (*map(ring, rings), kinematics.get("legs", {})) for name, leg in part.items()}


def rods(table: dict[str, Any]) -> Rods:
    """The rods of a machine file of kind "legs", "linear-delta" or "h4-linear"."""
    kinematics = table["kinematics"]
    rotary, carriers = kinematics.get("rotary", {}), kinematics.get("carriers", {})

    def rows(leg: dict[str, Any], *keys: str) -> Array:
        return np.array([leg.get(key, (0.0, 0.0, float(key == "direction"))) for key in keys], np.float64)

    bars, freedoms = kinematics.get("bars", {}), kinematics.get("freedoms", "xyza" if rotary else "xyz")
    legs = tuple((name, leg.get("drive", "slide"), rows({"point": leg.get("slide"), **leg, **_on_bar(leg, bars)}, "point",
                  "direction", "joint", "arm", "kept"), float(leg["rod"]), float(leg.get("root", 1)))
                 for name, leg in legs_of(kinematics).items())
    for _, _, leg, _, _ in legs:
        leg[1] = unit(leg[1])
    pivot, gauge = rows(rotary, "pivot")[0], kinematics.get("gauge", 0.0)
    reach = rows(kinematics, "gauge")[0] - pivot if kinematics.get("kind") == "legs" else -float(gauge) * _UP
    tables = legs_of(kinematics)
    besides, rings = held(kinematics, tables), {name: float(leg["ring"]) for name, leg in tables.items() if leg.get("ring")}
    freedoms = "xyzabc" if besides.any or rings else freedoms
    under, wrist = ({name: np.array([unit(np.array(one["direction"], np.float64)), one.get("point", (0.0, 0.0, 0.0))])
                           for name, one in kinematics.get(key, {}).items()} for key in ("table_axes", "spindle_axes"))
    return Rods(legs, "".join(sorted(set(freedoms) & set("abc"))), pivot, reach, rotary.get("letter", ""),
                rotary.get("carries", ""), float(rotary.get("positive", 1)),
                {name: unit(rows(one, "direction")[0]) for name, one in carriers.items()},
                np.array([float(letter not in freedoms) for letter in "xyz"]), besides, rings,
                under, wrist)


def _on_bar(leg: dict[str, Any], bars: dict[str, dict[str, Any]]) -> dict[str, Any]:
    return {"joint": bars[leg["bar"]]["hinge"], "kept": leg["joint"]} if leg.get("bar") else {}


def turning(table: dict[str, Any], letters: tuple[str, ...]) -> Array:
    """(J,) True for letters that count degrees: arms of legs whatever their letter, A, B, C that drive no leg."""
    legs = legs_of(table.get("kinematics", {}))
    return np.array([legs[name].get("drive") == "arm" if name in legs else name in "ABC" for name in letters])


def kinematics_of(table: dict[str, Any]) -> Chain | Rods | None:
    """The machine of a file; None of a kind that this witness does not know."""
    kind = table.get("kinematics", {}).get("kind", table.get("kinematics", {}).get("family"))
    if kind == "serial":
        return chain(table)
    return rods(table) if kind in ("linear-delta", "h4-linear", "legs") else None
