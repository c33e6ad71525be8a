"""Singular directions: where the tool lies along the rotary axis nearest the part, and which curves come near there."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from machines.kinematics.base import Kinematics
from toolpaths.arrays import Bools, Floats, runs
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between, cross, lengths
from toolpaths.shape import Curves
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(frame="3 3")
class Pole:
    """A singular direction (3,) with a frame (3, 3) whose third row it is, and the joint that turns about it."""

    frame: Floats
    joint: int

    def polar(self, axis: Floats) -> tuple[Floats, Floats]:
        """(angle from the pole (N,), azimuth about it (N,)) of unit vectors (N, 3)."""
        x, y, z = self.frame @ axis.T
        across = np.hypot(x, y)
        return np.arctan2(across, z), np.where(across > 0.0, np.arctan2(y, x), 0.0)

    def direction(self, theta: Floats, azimuth: Floats) -> Floats:
        """Unit vectors (N, 3); a negative angle stands for the opposite azimuth."""
        flat = np.stack([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)], axis=1)
        return np.asarray(flat @ self.frame)


def poles_of(kin: Kinematics) -> list[Pole]:
    """The singular directions that the tool can take: both directions along the rotary axis nearest the part, if it can.

    That axis is the one whose turning direction, seen from the part, does not depend on the joints.
    """
    return list(_poles(kin))


@lru_cache(maxsize=64)
def _poles(kin: Kinematics) -> tuple[Pole, ...]:
    rotary = np.flatnonzero(np.array(kin.rotary))
    if len(rotary) == 0 or kin.branches < 2:
        return ()
    found = kin.places_apart()
    if found is None:
        return ()
    turn = kin.twist_jacobian(found)[:, 3:, :]
    result = []
    for j in rotary:
        direction = turn[0, :, j]
        if np.abs(direction - turn[1, :, j]).max() < 1e-9:
            for travel in (direction, -direction):
                unit = travel / np.linalg.norm(travel)
                if angle_between(kin.nearest_axis(unit[None]), unit[None])[0] < 1e-9:
                    result.append(Pole(_frame(unit), int(j)))
    return tuple(result)


def _frame(unit: Floats) -> Floats:
    helper = np.eye(3)[(int(np.argmax(np.abs(unit))) + 1) % 3]
    x = helper - (helper @ unit) * unit
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(unit, x), unit])


def passages(pole: Pole, curves: Curves, near: float) -> tuple[Bools, Floats]:
    """(N,) curves that come within `near` rad of the pole, and how near (N,) they come."""
    normal = cross(curves.axis0, curves.axis1)
    size = lengths(normal)
    turning = size > 1e-12
    normal = np.where(turning[:, None], normal / np.where(turning, size, 1.0)[:, None], 0.0)
    unit = pole.frame[2]
    along = np.arctan2(np.einsum("ni,i->n", cross(normal, curves.axis0), unit), curves.axis0 @ unit)
    inside = turning & (along > 0.0) & (along < angle_between(curves.axis0, curves.axis1))
    ends = np.minimum(pole.polar(curves.axis0)[0], pole.polar(curves.axis1)[0])
    foot = np.abs(np.arcsin(np.clip(normal @ unit, -1.0, 1.0)))
    least = np.where(inside, np.minimum(foot, ends), ends)
    return turning & (least < near), least


def stretches(rows: Bools) -> list[tuple[int, int]]:
    """(first, last) of each unbroken stretch of True."""
    return [(first, end - 1) for first, end in runs(rows).tolist()]
