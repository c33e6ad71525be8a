"""One leg of a platform as a table, legs that stand in a ring about z, from a few sizes, and what else holds a platform."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from math import cos, sin
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from machines.key_problem import KeyProblem
from machines.kinematics.holds import Holds, hinges, telescope, together, untwisted
from machines.models import Interval, Vector
from machines.user_model import UserModel
from toolpaths.units import DEG

Drive = Literal["slide", "arm", "length"]
Size = Annotated[float, Field(gt=-1e6, lt=1e6)]
"""mm; no machine is a kilometre long"""
Length = Annotated[float, Field(ge=0, lt=1e6)]
BoundedVector = tuple[Size, Size, Size]
UNIT = 1e-6
"""how far the length of a direction may be from 1 (it is normalised)"""
_UP = (0.0, 0.0, 1.0)
_GOES_WITH = {"direction": ("slide", "arm"), "lean": ("slide",), "arm": ("arm",), "root": ("slide", "arm"),
              "rail_offset": ("slide",), "rail_ends": ("slide",), "ring": ("length",)}
"""keys that not every drive has"""


class DriveModel(UserModel):
    """One `[kinematics.legs.LETTER]` table, mm and degrees; the order of the tables is that of the joints."""

    drive: Drive
    """what moves: the rod's foot along a slide, round an axis at the end of an arm, or the rod's length"""
    point: BoundedVector
    """slide: the rod's foot at q = 0; arm: a point of the axis; length: the rod's foot. In the machine frame"""
    direction: Vector = (0.0, 0.0, 1.0)
    """unit vector; slide: of positive q; arm: axis about which q turns by the right hand"""
    arm: BoundedVector = (0.0, 0.0, 0.0)
    """arm: from the axis to the rod's foot at q = 0, square to the axis"""
    joint: BoundedVector
    """platform joint relative to the platform's reference point, or to the hinge of its bar"""
    hinge: Vector | None = None
    """unit vector of a hinge at the foot, which keeps the leg in the plane square to it; default: free in all turns"""
    ring: Annotated[float, Field(gt=0, lt=1e6)] | None = None
    """length: radius of a ring about z of the platform, round `joint`, that turns freely and that the leg ends on"""
    bar: str | None = None
    """name of the bar of the platform that the joint is on, which keeps its direction; default: on the platform itself"""
    rod: Length
    """length of the rods; of a leg of changing length at q = 0"""
    root: Literal[1, -1] = 1
    """how the leg is assembled: 1 where the foot stands on the positive side of the platform joint, of an arm beyond it"""
    rods: Annotated[tuple[BoundedVector, ...], Field(max_length=2)] = ()
    """each rod's place next to the leg's line, the same at both ends: two for a pair of parallel rods"""
    rail_offset: BoundedVector = (0.0, 0.0, 0.0)
    """from the line of the foot to the middle of the rail"""
    rail_ends: Interval | None = None
    """q of the rail's ends; without it the rail is left out of the clearances"""


class PassiveModel(UserModel):
    """One `[kinematics.passive.NAME]` table: a leg without a drive, fixed to the platform, which slides through a universal
    joint of the bed and leaves the platform two turns about it and its travel along it, as in the middle of a Tricept."""

    point: BoundedVector
    """middle of the universal joint, in the machine frame, mm"""
    joint: BoundedVector = (0.0, 0.0, 0.0)
    """a point of the leg's line, mm from the reference point of the level platform"""
    line: Vector = (0.0, 0.0, 1.0)
    """unit vector along the leg, platform level"""
    hinge: Vector
    """unit vector: axis of the universal joint that is fixed to the bed, square to `line`"""

    def problems(self, path: tuple[str, ...]) -> Iterator[KeyProblem]:
        """Directions that are none, or not square to each other."""
        yield from direction_problems(self.line, (*path, "line"))
        yield from direction_problems(self.hinge, (*path, "hinge"))
        if abs(float(np.dot(self.line, self.hinge))) > UNIT:
            yield KeyProblem("machine.geometry", (*path, "hinge"), f"{list(self.hinge)} is not square to the leg along "
                             f"{list(self.line)}", "turn hinge until it is, with the platform level")


def direction_problems(vector: Vector, path: tuple[str, ...]) -> Iterator[KeyProblem]:
    """A vector at `path` that is no direction."""
    length = float(np.linalg.norm(vector))
    if abs(length - 1.0) > UNIT:
        yield KeyProblem("machine.geometry", path, f"{list(vector)} has length {length:.6g}, not 1", "write a unit vector")


def held_by(legs: Collection[DriveModel], passive: Collection[PassiveModel]) -> int:
    """How many of six freedoms of a platform hinges, rings and passive legs take."""
    return sum(leg.hinge is not None for leg in legs) + any(leg.ring is not None for leg in legs) + 3 * len(passive)


def holds_of(legs: Collection[DriveModel], passive: Collection[PassiveModel]) -> Holds | None:
    """What holds a platform besides its legs; None where nothing does."""
    arm = max(1.0, *(float(np.linalg.norm(leg.joint)) for leg in legs))
    hinged = [leg for leg in legs if leg.hinge is not None]
    parts = [telescope(np.array(one.point), np.array(one.joint), np.array(one.line), np.array(one.hinge), arm)
             for one in passive]
    if hinged:
        normals = np.array([leg.hinge for leg in hinged], dtype=np.float64)
        parts.append(hinges(normals / np.linalg.norm(normals, axis=1)[:, None], np.array([leg.point for leg in hinged]),
                            np.array([leg.joint for leg in hinged])))
    if any(leg.ring is not None for leg in legs):
        parts.append(untwisted(arm))
    return together(parts) if parts else None


def hinge_problems(leg: DriveModel, path: tuple[str, ...]) -> Iterator[KeyProblem]:
    """A hinge that is no direction, or whose plane the leg's drive would leave."""
    if leg.hinge is None:
        return
    yield from direction_problems(leg.hinge, (*path, "hinge"))
    along, drive = float(np.dot(leg.hinge, leg.direction)), np.array(leg.direction)
    if leg.drive == "slide" and abs(along) > UNIT:
        yield KeyProblem("machine.geometry", (*path, "hinge"), f"the slide along {list(leg.direction)} leaves the plane of "
                         f"the hinge {list(leg.hinge)}", "write a hinge that is square to the slide")
    if leg.drive == "arm" and np.linalg.norm(np.cross(leg.hinge, drive)) > UNIT:
        yield KeyProblem("machine.geometry", (*path, "hinge"), f"the arm about {list(leg.direction)} leaves the plane of "
                         f"the hinge {list(leg.hinge)}", "write a hinge along the axis of the arm")


class StarLayout(UserModel):
    """`[kinematics.layout]`: legs in a ring about z; mm and degrees.

    A leg whose drive stands in the direction `angles` has its foot, or the axis of its arm, at `radius` and `height`, and
    its platform joint at `joint_radius` and `joint_height` in the direction `joint_angles`. Slides lean outwards by `lean`
    from z. Arms point outwards at q = 0 and go down with positive q.
    """

    form: Literal["star"]
    drive: Drive
    """of all legs"""
    letters: tuple[str, ...]
    """of the drives, one a leg"""
    angles: tuple[float, ...] | None = None
    """degrees from x towards y; default: evenly from 0"""
    radius: Length
    """from z to the feet, or to the axes of the arms"""
    height: Size = 0.0
    """z of the feet"""
    lean: float = 0.0
    """degrees"""
    aside: tuple[Size, ...] = ()
    """mm by which a foot and its platform joint stand next to their direction, one a leg; default: not at all"""
    joint_angles: tuple[float, ...] | None = None
    """degrees; default: as `angles`"""
    joint_radius: Length
    """of the platform joints"""
    joint_height: Size = 0.0
    """z of the platform joints from the reference point"""
    arm: Annotated[float, Field(gt=0, lt=1e6)] | None = None
    """length of the arms"""
    rod: Length
    """length of the rods, of a leg of changing length at q = 0"""
    hinged: bool = False
    """true where every leg swings about a hinge at its foot, square to z and to its direction"""
    pair: Annotated[float, Field(gt=0, lt=1e6)] | None = None
    """mm between the two rods of a leg; default: single rods"""
    root: Literal[1, -1] = 1
    """of all legs; of arms: -1 with their elbows outside, as rotary Deltas are built, 1 inside"""
    rail_offset: Size = 0.0
    """mm outwards from the line of the foot to the middle of the rail, of all slides"""
    rail_ends: Interval | None = None
    """of all slides, as in the tables of legs"""

    def problems(self, path: tuple[str, ...]) -> Iterator[KeyProblem]:
        """Keys that do not go with the drive, an arm without its length, lists that are not one value a leg; at `path`."""
        yield from stray_keys(self, self.drive, path)
        if self.drive == "arm" and self.arm is None:
            yield KeyProblem("machine.geometry", (*path, "arm"), "drive = 'arm' and no length of the arms",
                             "write arm = mm from the axis to the elbow")
        for key in ("angles", "joint_angles", "aside"):
            values = getattr(self, key)
            if key in self.model_fields_set and values is not None and len(values) != len(self.letters):
                yield KeyProblem("machine.geometry", (*path, key), f"{key}: {len(values)} values for "
                                 f"{len(self.letters)} letters", "write one value a leg, or leave the key out")

    def legs(self) -> dict[str, DriveModel]:
        """By letter."""
        n = len(self.letters)
        angles = self.angles or tuple(360.0 * k / n for k in range(n))
        joints, aside = self.joint_angles or angles, self.aside or (0.0,) * n
        return {name: self._leg(*of) for name, *of in zip(self.letters, angles, joints, aside, strict=True)}

    def _leg(self, angle: float, joint_angle: float, aside: float) -> DriveModel:
        (out, side), (joint_out, joint_side), lean = _ring(angle), _ring(joint_angle), self.lean * DEG
        direction = side if self.drive == "arm" else _sum((sin(lean), out), (cos(lean), _UP))
        return DriveModel(
            drive=self.drive, rod=self.rod, root=self.root, direction=direction,
            point=_sum((self.radius, out), (aside, side), (self.height, _UP)),
            joint=_sum((self.joint_radius, joint_out), (aside, joint_side), (self.joint_height, _UP)),
            hinge=side if self.hinged else None, arm=_sum((self.arm or 0.0, out)), rail_ends=self.rail_ends,
            rail_offset=_sum((self.rail_offset, out)),
            rods=() if self.pair is None else tuple(_sum((half, side)) for half in (0.5 * self.pair, -0.5 * self.pair)))


def stray_keys(table: DriveModel | StarLayout, drive: Drive, path: tuple[str, ...]) -> Iterator[KeyProblem]:
    """Keys that a file states and the drive has no use for: nothing would obey them."""
    for key in sorted(table.model_fields_set):
        if drive not in _GOES_WITH.get(key, (drive,)):
            yield KeyProblem("machine.geometry", (*path, key), f"{key} does not go with drive = {drive!r}",
                             f"take {key} out; it goes with drive = {' or '.join(map(repr, _GOES_WITH[key]))}")


def _ring(angle: float) -> tuple[Vector, Vector]:
    """Outwards and round, unit vectors."""
    c, s = cos(angle * DEG), sin(angle * DEG)
    return (c, s, 0.0), (-s, c, 0.0)


def _sum(*parts: tuple[float, Vector]) -> Vector:
    x, y, z = (float(sum(size * along[i] for size, along in parts)) for i in range(3))
    return x, y, z
