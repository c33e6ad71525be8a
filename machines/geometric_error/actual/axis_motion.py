"""The motion of one axis with its errors, exactly: what points and directions on its tool side do (columns)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.actual.transforms import homogeneous
from machines.geometric_error.tables.names import DIRECTIONS, OWN, SPINDLE, ErrorName
from machines.kinematics import columns
from machines.kinematics.base import Kinematics
from machines.kinematics.chain import Joint
from machines.kinematics.columns import Columns
from machines.kinematics.frames import reference_x
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

X, Y, Z = np.eye(3)
SERIES = 1e-5
"""rad^2: below it the first terms of sine and cosine that are left out are less than 1e-17"""
ALONG = 1e-9
"""sine below which a direction lies along an axis"""


@dataclass(frozen=True, eq=False)
@arrays(direction="3", point="3", reference="3")
class Line:
    """An axis as its location errors leave it: direction (3,), a point of its line (3,), reference point
    (3,), and by how much it stands farther than it counts."""

    joint: Joint
    index: int
    direction: Floats
    point: Floats
    reference: Floats
    moving: bool
    zero: float


def actual_line(joint: Joint, index: int, errors: SerialErrors) -> Line:
    """L M(q + z) L^-1 is the motion about or along the line that L has moved."""
    centre = np.asarray(errors.reference.get(joint.name, joint.point), dtype=np.float64)
    pivot = joint.point if joint.rotary else centre
    location = homogeneous(errors.location(joint.name)[None])[0]
    moving = not joint.rotary or errors.frame.get(joint.name, "fixed") == "moving"
    return Line(joint, index, location[:3, :3] @ joint.direction, pivot + location[:3, 3], centre, moving,
                sense(joint) * errors.zero_position(joint.name))


def sense(joint: Joint) -> float:
    """-1.0 where the axis counts against the machine axis that it is named after, else 1.0."""
    return -1.0 if joint.direction[DIRECTIONS.index(OWN[joint.name]) % 3] < 0.0 else 1.0


def along(joint: Joint) -> Floats:
    """(6,) torsor of the axis's own motion per mm or rad, in the sense of the machine axis that it is named after."""
    own = sense(joint) * joint.direction
    return np.concatenate([np.zeros(3), own] if joint.rotary else [own, np.zeros(3)])


def actual_tool(axis: Floats, length: float, errors: SerialErrors) -> tuple[Floats, Floats, Floats]:
    """(tip, axis, x of the tool), each (3,) from the gauge point, as the spindle's errors leave them."""
    spindle = homogeneous(errors.location(SPINDLE)[None])[0]
    turned = [spindle[:3, :3] @ v for v in (-length * axis, axis, reference_x(axis[None])[0])]
    return turned[0] + spindle[:3, 3], turned[1], turned[2]


def driven(line: Line, x: Floats, approach: Floats | float, errors: SerialErrors,
           carried_along: Sequence[Columns]) -> list[Columns]:
    """A point and directions by T_i of `serial_errors`: the axis commanded to x (N,), its last motion `approach` (N,)."""
    error = errors.torsors(line.joint.name, x, approach)
    if line.moving:
        return moved(line, x, displaced(error, line.reference, carried_along))
    return displaced(error, line.reference, moved(line, x, carried_along))


def moved(line: Line, x: Floats, carried_along: Sequence[Columns]) -> list[Columns]:
    """A point and directions by the axis's motion along or about its actual line, counted from its actual zero."""
    (point, *vectors), x = carried_along, x + line.zero
    if not line.joint.rotary:
        return [columns.plus(point, [x * d if d != 0.0 else 0.0 for d in line.direction.tolist()]), *vectors]
    cos, sin, place = np.cos(x), np.sin(x), columns.of_one(line.point)
    turned = columns.plus(columns.turn(line.direction, cos, sin, columns.minus(point, place)), place)
    return [turned, *(columns.turn(line.direction, cos, sin, v) for v in vectors)]


def displaced(torsor: list[Floats | float], centre: Floats,
              carried_along: Sequence[Columns]) -> list[Columns]:
    """A point and directions by one small transform about `centre`: turned about z, y, x, then displaced (C 1.14).

    The point gets what its arm changes by, so that zero angles leave it to the last digit.
    """
    arm = columns.minus(carried_along[0], columns.of_one(centre))
    turned: list[Columns] = [arm, *carried_along[1:]]
    for axis, angle in ((Z, torsor[5]), (Y, torsor[4]), (X, torsor[3])):
        if isinstance(angle, float):
            continue
        cos, sin = _small(angle)
        turned = [columns.turn(axis, cos, sin, v) for v in turned]
    point = columns.plus(carried_along[0], columns.minus(turned[0], arm))
    return [columns.plus(point, torsor[:3]), *turned[1:]]


def _small(angle: Floats) -> tuple[Floats, Floats]:
    """(cos, sin) of angles (N,): their series up to the fifth power where that is all their digits."""
    square = angle * angle
    if not square.max(initial=0.0) < SERIES:
        return np.cos(angle), np.sin(angle)
    return 1.0 - square * (0.5 - square / 24.0), angle * (1.0 - square * (1.0 / 6.0 - square / 120.0))


def effect(name: ErrorName, kinematics: Kinematics) -> bool:
    """False where a location error moves nothing: shift of a slide, shift along or turn about an axis's own line.

    Its zero position, along or about its line, does. Of axes that the machine has not nothing is known here.
    """
    if name.zero_position or name.axis not in (SPINDLE, *kinematics.axes_with_errors):
        return True
    unit = np.eye(3)[name.part % 3]
    if name.axis == SPINDLE:
        return not name.angular or float(np.linalg.norm(np.cross(unit, kinematics.tool_axis))) > ALONG
    direction, _ = kinematics.axis_line(name.axis)
    rotary = kinematics.rotary[kinematics.axis_names.index(name.axis)]
    return (rotary or name.angular) and float(np.linalg.norm(np.cross(unit, direction))) > ALONG
