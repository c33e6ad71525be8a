"""Tilted work planes: their frame, and the angles by which a controller names it.

A convention names the letters of three turns about the axes of the moving frame, one after another
(intrinsic), so that R = R_1(angle 1) R_2(angle 2) R_3(angle 3). "ZXZ" are Euler angles (Fanuc B-64484EN,
G68.2 with I, J, K: turns about Z, the new X, the new Z); "ZYX" is the same as turns about the fixed X, then
    Y, then Z (Heidenhain, PLANE SPATIAL: SPA,
SPB, SPC are fixed; Siemens, CYCLE800 with _MODE 27); "XYZ" turns about X, the new Y, the new Z (CYCLE800 with
_MODE 57): there the direction of a small tilt hangs on the last decimals of two angles. "rotary" has no
    angles of its own: the frame
is what the rotary axes make of it.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

TurnOrder = Literal["ZXZ", "ZYX", "XYZ"]
"""about which axes the three angles turn, each about the axes turned so far"""
Convention = Literal[TurnOrder, "rotary"]
"""how a plane's angles are written: those turns, or the words of the rotary axes"""
_GIMBAL = 1e-9
"""sine or cosine of the middle angle below which the first and third turn are about one axis"""


@dataclass(frozen=True, eq=False)
@arrays(rotation="3 3", origin="3")
class Plane:
    """A plane's frame in the table frame: columns of `rotation` (3, 3) are X', Y', Z'; `origin` (3,) mm."""

    rotation: Floats
    origin: Floats

    @cached_property
    def key(self) -> tuple[float, ...]:
        """The numbers of the plane, equal for equal planes."""
        return (*self.rotation.ravel().tolist(), *self.origin.tolist())

    def to_plane(self, tip: Floats) -> Floats:
        """Points (N, 3) of the table frame in coordinates of the plane."""
        result: Floats = (tip - self.origin) @ self.rotation
        return result

    def to_table(self, xyz: Floats) -> Floats:
        """Points (N, 3) of the plane in the table frame."""
        result: Floats = xyz @ np.ascontiguousarray(self.rotation.T) + self.origin
        return result


def turn(letter: str, degrees: float) -> Floats:
    """(3, 3) right-hand turn about X, Y or Z; exact at multiples of 90 degrees."""
    quarter = degrees / 90.0
    if quarter == round(quarter):
        c, s = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarter) % 4]
    else:
        c, s = float(np.cos(degrees * DEG)), float(np.sin(degrees * DEG))
    result = np.eye(3)
    i, j = {"X": (1, 2), "Y": (2, 0), "Z": (0, 1)}[letter]
    result[i, i] = result[j, j] = c
    result[i, j], result[j, i] = -s, s
    return result


def rotation_of(convention: TurnOrder, angles: tuple[float, ...]) -> Floats:
    """(3, 3) of three angles (degrees) under a convention of turns."""
    a, b, c = (turn(letter, angle) for letter, angle in zip(convention, angles, strict=True))
    result: Floats = a @ b @ c
    return result


def angles_of(convention: TurnOrder, rotation: Floats) -> tuple[float, float, float]:
    """The three angles (degrees) of a rotation (3, 3) under a convention of turns; the inverse of `rotation_of`.

    Middle angles are in 0..180 (ZXZ) or -90..90 (the others). Where first and third turn are about one axis,
    the third is 0.
    """
    if convention == "ZXZ":
        first, middle, third = _euler(rotation)
    elif convention == "ZYX":
        first, middle, third = _cardan(rotation)
    elif convention == "XYZ":
        third, middle, first = (-a for a in _cardan(rotation.T))
        if abs(np.cos(middle)) < _GIMBAL:
            first, third = float(np.arctan2(rotation[2, 1], rotation[1, 1])), 0.0
    else:
        raise ValueError(f"no convention of turns: {convention}")
    return first / DEG + 0.0, middle / DEG + 0.0, third / DEG + 0.0


def _euler(r: Floats) -> tuple[float, float, float]:
    """Rz(a) Rx(b) Rz(c): r[:, 2] = (sin a sin b, -cos a sin b, cos b), r[2, :2] = (sin b sin c, sin b cos c)."""
    sine = float(np.hypot(r[0, 2], r[1, 2]))
    middle = float(np.arctan2(sine, r[2, 2]))
    if sine < _GIMBAL:
        return float(np.arctan2(r[1, 0], r[0, 0])), middle, 0.0
    return float(np.arctan2(r[0, 2], -r[1, 2])), middle, float(np.arctan2(r[2, 0], r[2, 1]))


def _cardan(r: Floats) -> tuple[float, float, float]:
    """Rz(a) Ry(b) Rx(c): r[:, 0] = (cos a cos b, sin a cos b, -sin b), r[2, 1:] = (cos b sin c, cos b cos c)."""
    cosine = float(np.hypot(r[0, 0], r[1, 0]))
    middle = float(np.arctan2(-r[2, 0], cosine))
    if cosine < _GIMBAL:
        return float(np.arctan2(-r[0, 1], r[1, 1])), middle, 0.0
    return float(np.arctan2(r[1, 0], r[0, 0])), middle, float(np.arctan2(r[2, 1], r[2, 2]))


def stated(convention: Convention, rotation: Floats, rotary: tuple[float, ...],
           places: int) -> tuple[tuple[float, ...], Floats]:
    """(angles in degrees as the controller prints them, the rotation that those name).

    `rotary` are the words of the rotary axes, which are the angles of the convention "rotary".
    """
    if convention == "rotary":
        return rotary, rotation
    angles = tuple(round(a, places) + 0.0 for a in angles_of(convention, rotation))
    return angles, rotation_of(convention, angles)
