"""The pivots of a machine's rotary axes as the vectors that controls hold them by."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from machines.kinematics.chain import Joint
from machines.machine import Machine
from postproc.controllers.pivots import VectorKind
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_TURN = 0.7
"""rad by which an axis is turned to see whether it turns the slides"""


@dataclass(frozen=True)
@arrays(value="3")
class PivotVector:
    """One vector (3,) in machine coordinates, mm, all axes at 0: its kind, and the letters of the axes between which
    it goes ("" for the machine's zero and for the gauge point). Along an axis its pivot may lie anywhere."""

    kind: VectorKind
    origin: str
    end: str
    value: Floats


def pivot_vectors(machine: Machine) -> tuple[PivotVector, ...]:
    """The vectors of table and head; () for machines without a chain of axes, or with none that turns."""
    rotary = [j for j in machine.kinematics.chain if j.rotary and machine.by_drives is None]
    if not rotary:
        return ()
    carried = _carrying(machine)
    tables = [j for j in reversed(rotary) if j.name in carried]
    heads = [j for j in reversed(rotary) if j.name not in carried]
    return (*_vectors(tables, "table", "table_to_table", "closing_table"),
            *_vectors(heads, "tool_to_head", "head_to_head", "closing_head"))


def _carrying(machine: Machine) -> set[str]:
    """Letters of the rotary axes that carry the part: those that turn the slides as the table sees them."""
    kin, letters = machine.kinematics, machine.axis_names
    slides = [letters.index(j.name) for j in kin.chain if not j.rotary]
    rotary = [letters.index(j.name) for j in kin.chain if j.rotary]
    q = np.zeros((1 + len(rotary), kin.joints))
    q[np.arange(1, len(q)), rotary] = _TURN
    seen = kin.jacobian(q)[:, :3][:, :, slides]
    return {letters[j] for j, turned in zip(rotary, seen[1:], strict=True) if not np.allclose(seen[0], turned, atol=1e-9)}


def _vectors(joints: list[Joint], first: VectorKind, then: VectorKind, closing: VectorKind) -> list[PivotVector]:
    """From the zero to the first axis, from each to the next, and what closes the chain."""
    if not joints:
        return []
    points = _nearest(joints)
    result = [PivotVector(first, "", joints[0].name, points[0])]
    for (a, here), (b, there) in pairwise(zip(joints, points, strict=True)):
        result.append(PivotVector(then, a.name, b.name, there - here))
    return [*result, PivotVector(closing, joints[-1].name, "", -points[-1])]


def _nearest(joints: list[Joint]) -> list[Floats]:
    """A point of each axis: of two that are not parallel those nearest to each other, else that of the machine file."""
    if len(joints) != 2:
        return [joint.point for joint in joints]
    (p, u), (r, v) = ((joint.point, joint.direction) for joint in joints)
    across = 1.0 - float(u @ v) ** 2
    if across < 1e-12:
        return [p, r]
    s = float((r - p) @ (u - (u @ v) * v)) / across
    t = float((p - r) @ (v - (u @ v) * u)) / across
    return [p + s * u, r + t * v]
