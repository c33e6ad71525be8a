"""One leg of a platform as a table, and legs that stand in a ring about z, from a few sizes."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, sin
from typing import Annotated, Literal

from pydantic import Field

from machines.key_problem import KeyProblem
from machines.models import Interval, Vector
from machines.user_model import UserModel
from toolpaths.units import DEG

Drive = Literal["slide", "arm", "length"]
Size = Annotated[float, Field(gt=-1e6, lt=1e6)]
"""mm; no machine is a kilometre long"""
Length = Annotated[float, Field(ge=0, lt=1e6)]
BoundedVector = tuple[Size, Size, Size]
_UP = (0.0, 0.0, 1.0)
_GOES_WITH = {"direction": ("slide", "arm"), "lean": ("slide",), "arm": ("arm",), "root": ("slide", "arm"),
              "rail_offset": ("slide",), "rail_ends": ("slide",)}
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
            arm=_sum((self.arm or 0.0, out)), rail_ends=self.rail_ends, rail_offset=_sum((self.rail_offset, out)),
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
