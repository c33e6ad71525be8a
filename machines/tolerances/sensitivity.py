"""First-order influence of every dimension of a machine on legs: errors of the platform per error of each part.

Of a rod from A to B, of length L, with e = AB / L, O the point of the platform that is asked for, M the directions of the
carriage and R those of the platform:

    e.dX + (OB x e).dW = e.dP + ((A - pivot) x e).dG + (M^T e).dA - (R^T e).dB + dL

with dP the drive's place, dG the turn of its guide, dA, dB the rod's joints, dL its length. T [dX, dW] = V E, so S = T^-1 V.
Source: Company 2000, II-61, E-10 to E-17, F-1 to F-16 (signs of F-10 and levers of F-7 as its errata have them).
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import Loops
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, unit
from toolpaths.shapes import arrays

DimensionPart = Literal["drive", "guide", "foot", "joint", "rod", "axis", "zero"]
"""what has an error: place of a drive, turn of its guide, joint of a rod at the drive and at the platform, its length; the
line of an axis, where a drive or an axis counts from"""
PARTS: tuple[DimensionPart, ...] = ("drive", "guide", "foot", "joint", "rod")
AXES = {"drive": "xyz", "guide": "abc", "foot": "tnu", "joint": "xyz", "rod": ""}
"""directions: of the machine; turns about them; tangential, inwards, along the guide; of the platform"""
TURNS = frozenset((*"abc", "turn"))
"""directions of angles; those of a guide are angles too"""


@dataclass(frozen=True)
class LegDimension:
    """One dimension: part, whose it is (letter of the leg, with 1 or 2 of a pair's rods), direction."""

    part: DimensionPart
    of: str
    axis: str

    def __str__(self) -> str:
        return f"{self.part} {self.of} {self.axis}".rstrip()

    @property
    def angular(self) -> bool:
        """True where its error is a turn, in rad."""
        return self.part == "guide" or self.axis in TURNS


@dataclass(frozen=True, eq=False)
@arrays(leg="R", shift="R 3")
class RodsOfLegs:
    """The rods of a platform's legs.

    Attributes:
        leg: (R,) leg of each rod
        shift: (R, 3) mm from the line of the leg to the rod, at both ends
        from_origin: True where guides turn about the machine's origin, else about the drive's own point
    """

    legs: LegGeometry
    leg: Ints
    shift: Floats
    from_origin: bool = False

    @property
    def loops(self) -> Loops:
        """Their closed loops."""
        g = self.legs
        return Loops(Drives(g.points, g.directions, g.lengths, g.roots, g.arms, g.slide, g.arm), g.joints, g.freedoms)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the rods."""
        own = [self.legs.names[k] for k in self.leg]
        seen = [own[:k].count(name) + 1 for k, name in enumerate(own)]
        return tuple(f"{name}{n}" if own.count(name) > 1 else name for name, n in zip(own, seen, strict=True))

    @property
    def dimensions(self) -> tuple[LegDimension, ...]:
        """Those of drives, guides, feet, joints, rods."""
        whose = {"drive": self.legs.names, "guide": self.legs.names}
        return tuple(LegDimension(part, of, axis) for part in PARTS for of in whose.get(part, self.names)
                     for axis in (AXES[part] or " "))

    @property
    def solved(self) -> list[int]:
        """Motions that the rods determine: all of them, or where there are too few rods the freedoms."""
        every = [0, 1, 2, 3, 4, 5] if "z" in self.legs.freedoms else [0, 1, 5]
        return every if len(self.leg) >= len(every) else ["xyzabc".index(letter) for letter in self.legs.freedoms]


@dataclass(frozen=True, eq=False)
@arrays(motions="N R 6", errors="N R E")
class RodRows:
    """T (N, R, 6) and V (N, R, E) of N poses, mm, mm per rad."""

    motions: Floats
    errors: Floats


def rod_rows(rods: RodsOfLegs, place: Floats, turn: Floats, point: Floats) -> RodRows:
    """Rows of the rods at places (N, 3) and turns (N, 3, 3) of the platform, for a `point` (3,) of it."""
    loops, legs, n = rods.loops, rods.legs, len(place)
    ends = loops.ends(place, turn)
    q = loops.drives.solve(ends, loops.drives.roots)
    feet = loops.drives.feet(q)[:, rods.leg] + rods.shift
    ends = ends[:, rods.leg] + rods.shift
    e = unit(ends - feet)
    arms = ends - (place + turn @ point)[:, None]
    pivot = np.zeros((len(rods.leg), 3)) if rods.from_origin else legs.points[rods.leg]
    frame = frames(rods, q)
    per_leg = [e, cross(feet - pivot, e)]
    per_rod = [np.einsum("nrij,nri->nrj", frame, e), -np.einsum("nij,nri->nrj", turn, e)]
    at = np.arange(len(rods.leg))
    errors = []
    for block in per_leg:
        wide = np.zeros((n, len(at), len(legs.names), 3))
        wide[:, at, rods.leg] = block
        errors.append(wide.reshape(n, len(at), -1))
    for block in per_rod:
        wide = np.zeros((n, len(at), len(at), 3))
        wide[:, at, at] = block
        errors.append(wide.reshape(n, len(at), -1))
    errors.append(np.broadcast_to(np.eye(len(at)), (n, len(at), len(at))))
    return RodRows(np.concatenate([e, cross(arms, e)], axis=2), np.concatenate(errors, axis=2))


def frames(rods: RodsOfLegs, q: Floats) -> Floats:
    """(N, R, 3, 3) columns tangential, inwards, along the guide, of each rod's foot; an arm's turn with it.

    Inwards is towards the z axis of the machine, of a foot on that axis any direction across the guide.
    """
    legs, drives = rods.legs, rods.loops.drives
    u = legs.directions[rods.leg]
    out = legs.points[rods.leg] * np.array([1.0, 1.0, 0.0])
    out = np.where(np.linalg.norm(out, axis=1, keepdims=True) > 1e-9, out, np.eye(3)[np.abs(u).argmin(axis=1)])
    inward = -out
    inward = inward - (inward * u).sum(axis=1, keepdims=True) * u
    flat = np.linalg.norm(inward, axis=1, keepdims=True) > 1e-9
    inward = unit(np.where(flat, inward, np.cross(u, np.eye(3)[np.abs(u).argmin(axis=1)])))
    fixed = np.broadcast_to(inward, (len(q), *inward.shape))
    if legs.arm.any():
        swung = -unit(np.where(legs.arm[:, None], drives.feet(q) - legs.points, legs.directions))
        fixed = np.where(legs.arm[rods.leg][:, None], swung[:, rods.leg], fixed)
    along = np.broadcast_to(u, fixed.shape)
    return np.stack([cross(fixed, along), fixed, along], axis=3)


def platform_errors(rods: RodsOfLegs, rows: RodRows, right: Floats) -> Floats:
    """(N, 6, E): T^-1 of right sides (N, R, E), by least squares where there are more rods than motions."""
    result = np.zeros((len(right), 6, right.shape[2]))
    result[:, rods.solved] = np.linalg.pinv(rows.motions[:, :, rods.solved]) @ right
    return result


def sensitivity(rods: RodsOfLegs, place: Floats, turn: Floats, point: Floats) -> Floats:
    """S (N, 6, E): error of `point` (mm) and of the platform's turn (rad) per error of each dimension (mm, rad)."""
    rows = rod_rows(rods, place, turn, point)
    return platform_errors(rods, rows, rows.errors)


def adjusted(rods: RodsOfLegs, place: Floats, turn: Floats, point: Floats, middle: tuple[Floats, Floats]) -> Floats:
    """The same once the rods' lengths are set so that in the pose `middle`, (1, 3) and (1, 3, 3), nothing is off (F.3.4)."""
    rows, there = rod_rows(rods, place, turn, point), rod_rows(rods, *middle, point)
    return platform_errors(rods, rows, rows.errors - there.errors)
