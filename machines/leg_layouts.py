"""One leg of a platform as a table, and legs that stand in a ring about z, from a few sizes."""

from __future__ import annotations

from math import cos, sin
from typing import Annotated, Literal

from pydantic import Field

from machines.models import NotNegative, Positive, Vector
from machines.slider_models import Interval
from machines.user_file import UserModel
from toolpaths.units import DEG

_UP = (0.0, 0.0, 1.0)


class DriveModel(UserModel):
    """One `[kinematics.legs.LETTER]` table, mm and degrees; the order of the tables is that of the joints."""

    drive: Literal["slide", "arm", "length"]
    """what moves: the rod's foot along a slide, round an axis at the end of an arm, or the rod's length"""
    point: Vector
    """slide: the rod's foot at q = 0; arm: a point of the axis; length: the rod's foot. In the machine frame"""
    direction: Vector = (0.0, 0.0, 1.0)
    """unit vector; slide: of positive q; arm: axis about which q turns by the right hand"""
    arm: Vector = (0.0, 0.0, 0.0)
    """arm: from the axis to the rod's foot at q = 0, square to the axis"""
    joint: Vector
    """platform joint relative to the platform's reference point"""
    rod: NotNegative
    """length of the rods; of a leg of changing length at q = 0"""
    root: Literal[1, -1] = 1
    """how the leg is assembled: 1 where the foot stands on the positive side of the platform joint, of an arm beyond it"""
    rods: Annotated[tuple[Vector, ...], Field(max_length=2)] = ()
    """each rod's place next to the leg's line, the same at both ends: two for a pair of parallel rods"""
    rail_offset: Vector = (0.0, 0.0, 0.0)
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
    drive: Literal["slide", "arm", "length"]
    """of all legs"""
    letters: tuple[str, ...]
    """of the drives, one a leg"""
    angles: tuple[float, ...] | None = None
    """degrees from x towards y; default: evenly from 0"""
    radius: NotNegative
    """from z to the feet, or to the axes of the arms"""
    height: float = 0.0
    """z of the feet"""
    lean: float = 0.0
    """degrees"""
    aside: tuple[float, ...] = ()
    """mm by which a foot and its platform joint stand next to their direction, one a leg; default: not at all"""
    joint_angles: tuple[float, ...] | None = None
    """degrees; default: as `angles`"""
    joint_radius: NotNegative
    """of the platform joints"""
    joint_height: float = 0.0
    """z of the platform joints from the reference point"""
    arm: Positive = 1.0
    """length of the arms"""
    rod: NotNegative
    """length of the rods, of a leg of changing length at q = 0"""
    pair: Positive | None = None
    """mm between the two rods of a leg; default: single rods"""
    root: Literal[1, -1] = 1
    """of all legs"""

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
            arm=_sum((self.arm, out)) if self.drive == "arm" else (0.0, 0.0, 0.0),
            rods=() if self.pair is None else tuple(_sum((half, side)) for half in (0.5 * self.pair, -0.5 * self.pair)))


def _ring(angle: float) -> tuple[Vector, Vector]:
    """Outwards and round, unit vectors."""
    c, s = cos(angle * DEG), sin(angle * DEG)
    return (c, s, 0.0), (-s, c, 0.0)


def _sum(*parts: tuple[float, Vector]) -> Vector:
    x, y, z = (float(sum(size * along[i] for size, along in parts)) for i in range(3))
    return x, y, z
