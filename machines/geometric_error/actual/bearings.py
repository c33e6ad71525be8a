"""Errors of what holds a platform besides its rods: hinges of its bars, hinges of legs, rings, passive legs.

    bars.NAME.hinge, .hinge_turn        place of the hinge on the platform, and turn of its line about that place
    LEG.hinge_turn                      turn of the hinge of a leg, in the machine frame, on the guide as that is turned
    LEG.ring                            radius of the ring that the leg ends on
    passive.NAME.point, .hinge_turn     place of the universal joint in the bed, turn of its outer axis
    passive.NAME.joint, .line_turn      place and turn of the leg's line, and of the joint's inner axis with it, on the
                                        platform; it turns about its point nearest to the platform's reference point
    passive.NAME.square                 by which the joint's axes are off a right angle

mm and rad, in the frames of machine or platform. Where a hinge of a leg stands is where its foot is: rail, guide, carriage.
What the bar's own side of a hinge is off by is what the joints of its rods are off by together.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from machines.geometric_error.actual.rods import RodErrors
from machines.geometric_error.actual.transforms import turns
from machines.kinematics.holds import Holds
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import Loops
from toolpaths.arrays import Floats, Ints

BarParts = Literal["hinge", "hinge_turn"]
OF_BARS: tuple[BarParts, ...] = ("hinge", "hinge_turn")
OF_PASSIVE = ("point", "hinge_turn", "joint", "line_turn")
ANGLES = ("guide", "hinge_turn", "line_turn")
"""what counts in rad, of three numbers"""


def bearing_names(loops: Loops, legs: tuple[str, ...], bars: bool) -> tuple[str, ...]:
    """Of a platform; `bars`: whether those are closed exactly."""
    tables = [f"bars.{name}.{part}" for name in loops.bar_names for part in OF_BARS if bars]
    tables += [f"{legs[k]}.hinge_turn" for k in loops.hinged]
    passive = [[*(f"passive.{name}.{part}.{x}" for part in OF_PASSIVE for x in "xyz"), f"passive.{name}.square"]
               for name in loops.passive]
    rings = () if loops.rings is None else tuple(f"{legs[k]}.ring" for k in np.flatnonzero(loops.rings > 0.0))
    return (*(f"{name}.{x}" for name in tables for x in "xyz"), *rings, *(name for part in passive for name in part))


def held_with(loops: Loops, errors: RodErrors, rods: Drives, leg: Ints) -> Holds | None:
    """What holds a platform besides its `rods`, which have their errors, with its own; `leg` (R,) of each rod."""
    holds = loops.holds
    if holds is None:
        return None
    normals, joints, across = holds.normals.copy(), holds.joints.copy(), holds.across.copy()
    through, apart, lean, foot = holds.through.copy(), holds.apart.copy(), holds.lean.copy(), holds.foot.copy()
    for k, name in enumerate(loops.passive):
        at, two = f"passive.{name}.", slice(2 * k, 2 * k + 2)
        near = apart[two] @ across[two] + errors.bearing(at + "joint")
        line = turns(errors.bearing(at + "line_turn")[None])[0]
        normals[k] = turns(errors.bearing(at + "hinge_turn")[None])[0] @ normals[k]
        joints[k], across[two] = line @ joints[k], across[two] @ line.T
        apart[two] = across[two] @ near
        through[two] += errors.bearing(at + "point")
        lean[k] = np.linalg.norm(joints[k]) * np.sin(errors.bearing(at + "square")[0])
    for row, k in enumerate(loops.hinged, len(loops.passive)):
        rod = int(np.argmax(leg == k))
        turn = turns(errors.guide[k][None])[0] @ turns(errors.bearing(f"{errors.legs[k]}.hinge_turn")[None])[0]
        normals[row], joints[row] = turn @ normals[row], joints[row] + errors.platform[rod]
        foot[row] = rod if _off(rods, rod, normals[row], holds.points[row]) else -1
    return replace(holds, normals=normals, joints=joints, across=across, through=through, apart=apart, lean=lean, foot=foot)


def _off(rods: Drives, rod: int, normal: Floats, point: Floats) -> bool:
    """True where the foot of a rod leaves the plane through `point` (3,) square to `normal` (3,)."""
    return bool(np.any([(rods.points[rod] - point) @ normal, rods.slide[rod] * (rods.directions[rod] @ normal),
                        rods.arms[rod] @ normal, np.cross(rods.directions[rod], rods.arms[rod]) @ normal]))


def rings_with(loops: Loops, errors: RodErrors, leg: Ints) -> Floats | None:
    """(R,) mm, radii of the rings; None without any."""
    if loops.rings is None:
        return None
    more = [float(errors.bearing(f"{name}.ring").sum()) for name in errors.legs]
    return np.asarray((loops.rings + more)[leg])
