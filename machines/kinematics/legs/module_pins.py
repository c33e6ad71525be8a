"""Platforms on legs that modules of LinuxCNC describe: their pins, joints and zero, or why they are none of theirs.

Sources: genhexkins.c, pentakins.c, rotarydeltakins-common.h of LinuxCNC 2.9 (src/emc/kinematics), kins(9). genhexkins has
six struts whose joints are their lengths, any base and platform. rotarydeltakins has three cranks at -90, 30 and 150 degrees
about z, arms outwards at 0 and downwards with growing angles, parallel rods to a platform whose point is in the plane of its
joints; its zero is in the plane of the cranks' axes. pentakins has five struts whose joints are their lengths and which end
on rings about the tool; its turn about z is 0.
"""

from __future__ import annotations

from dataclasses import field

import numpy as np

from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import Loops
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import lengths
from toolpaths.shapes import arrays
from toolpaths.units import DEG

SAME = 1e-9
"""mm, or parts of a direction, that dimensions may differ by"""
STRUTS = 5
"""of pentakins"""
CRANKS = np.array([-90.0, 30.0, 150.0]) * DEG


@dataclass(frozen=True)
@arrays(zero="K", origin="3")
class ModulePins:
    """A module as it stands for a platform on K legs.

    Attributes:
        pins: by their names
        tool_length_pin: of the tool's length, "" without one
        order: leg of each joint of the module
        zero: (K,) what its joints count more than the drives, mm or rad
        origin: (3,) mm, its zero in the machine frame
    """

    pins: dict[str, float]
    tool_length_pin: str
    order: tuple[int, ...]
    zero: Floats
    origin: Floats = field(default_factory=lambda: np.zeros(3))


def genhexkins(loops: Loops, gauge: Floats) -> ModulePins:
    """Base and platform of six struts, the platform seen from the gauge point.

    Raises:
        ValueError: where the legs are others; the message says what the module needs.
    """
    drives = loops.drives
    if loops.turns != "abc" or loops.holds is not None or not drives.stretch.all() or loops.kept is not None:
        raise ValueError("genhexkins needs six legs with drive = \"length\" and a platform free in x y z a b c")
    ends = {"base": drives.points, "platform": loops.joints - gauge}
    pins = {f"genhexkins.{what}.{k}.{letter}": value for what, points in ends.items() for k, point in enumerate(points)
            for letter, value in zip("xyz", point.tolist(), strict=True)}
    return ModulePins(pins, "genhexkins.tool-offset", tuple(range(len(drives.lengths))), drives.lengths)


def pentakins(loops: Loops, gauge: Floats) -> ModulePins:
    """Base of five struts, rings seen from the gauge point.

    Raises:
        ValueError: where the legs are others; the message says what the module needs.
    """
    drives, ends = loops.drives, loops.joints - gauge
    if loops.rings is None or len(ends) != STRUTS:
        raise ValueError("pentakins needs five legs with drive = \"length\" and ring, and a platform free in x y z a b")
    if np.abs(ends[:, :2]).max() > SAME:
        raise ValueError("pentakins needs rings round the line of the tool: joint and gauge with the same x and y")
    pins = {f"pentakins.base.{k}.{letter}": value for k, point in enumerate(drives.points)
            for letter, value in zip("xyz", point.tolist(), strict=True)}
    for k, (ring, height) in enumerate(zip(loops.rings.tolist(), ends[:, 2].tolist(), strict=True)):
        pins |= {f"pentakins.effector.{k}.r": ring, f"pentakins.effector.{k}.z": height}
    return ModulePins(pins, "pentakins.tool-offset", tuple(range(STRUTS)), drives.lengths)


def rotarydeltakins(loops: Loops, gauge: Floats) -> ModulePins:
    """Radii, arms and rods of three cranks, the platform seen from the gauge point.

    Raises:
        ValueError: where the legs are others; the message says what the module needs.
    """
    drives: Drives = loops.drives
    if loops.freedoms != ("x", "y", "z") or not drives.arm.all():
        raise ValueError("rotarydeltakins needs three legs with drive = \"arm\" and a platform free in x y z")
    feet, hips, arms = loops.joints - gauge, drives.points, drives.arms
    heading = np.arctan2(arms[:, 1], arms[:, 0])
    order = tuple(int(np.abs(np.exp(1j * heading) - np.exp(1j * turn)).argmin()) for turn in CRANKS)
    out = np.stack([np.cos(CRANKS), np.sin(CRANKS), 0.0 * CRANKS], axis=1)
    hips, feet, arms, axes = (part[list(order)] for part in (hips, feet, arms, drives.directions))
    hip, foot, thigh, shin = (float(part[0]) for part in (
        (hips * out).sum(axis=1), (feet * out).sum(axis=1), lengths(arms), drives.lengths))
    up = np.array([0.0, 0.0, 1.0])
    wanted = ((hips, hip * out + hips[0, 2] * up, "axes of the cranks at one radius and height"),
              (feet, foot * out + feet[0, 2] * up, "joints of the platform at one radius and height"),
              (arms, thigh * out, "arms outwards from z at -90, 30 and 150 degrees"),
              (np.cross(axes, arms), -thigh * up + 0.0 * arms, "cranks that lower their arms as they turn positively"),
              (drives.lengths, shin + 0.0 * drives.lengths, "rods of one length"),
              (drives.roots, -1.0 + 0.0 * drives.roots, "elbows outside (root = -1)"))
    for there, needed, text in wanted:
        if len(set(order)) < len(order) or np.abs(there - needed).max() > SAME * max(thigh, 1.0):
            raise ValueError(f"rotarydeltakins needs {text}")
    pins = {"platformradius": hip, "thighlength": thigh, "shinlength": shin, "footradius": foot}
    return ModulePins({f"rotarydeltakins.{name}": value for name, value in pins.items()}, "", order, np.zeros(3),
                      (hips[0, 2] - feet[0, 2]) * up)


MODULES = {"genhexkins": genhexkins, "pentakins": pentakins, "rotarydeltakins": rotarydeltakins}
"""by their names"""
