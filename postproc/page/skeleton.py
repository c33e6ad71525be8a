"""The machine as lines that move: a chain of axes as data for the page, legs of a platform at places in time."""

from __future__ import annotations

from typing import Any

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.job.job import Job
from toolpaths.arrays import Floats
from toolpaths.units import DEG

PLACES = 600
"""of legs along the program; between two of them the page draws straight"""
SAME = 1e-6
"""mm: carriages, platform and tool as they are seen from the table agree with the kinematics"""


def chain(machine: Machine, job: Job) -> dict[str, Any] | None:
    """The axes from the workpiece to the tool: letter, turning or not, unit direction and point (mm) at 0, travel, and
    whether it carries the part; None of a machine that is no chain. `table_from_part` as rotation rows and origin."""
    kinematics = machine.kinematics
    if not kinematics.chain:
        return None
    on_part = machine.structure.split()
    axes = [{"letter": joint.name, "turns": joint.rotary, "direction": joint.direction.tolist(),
             "point": joint.point.tolist(), "carries_part": f"{joint.name}'" in on_part,
             "travel": travel(machine, machine.axis_names.index(joint.name))} for joint in kinematics.chain]
    return {"axes": axes, "tool_axis": np.asarray(kinematics.tool_axis).tolist(), "table_from_part": _placement(job)}


def travel(machine: Machine, joint: int) -> list[float | None]:
    """[least, greatest] position in mm or degrees, None where an axis has no end."""
    unit = DEG if machine.rotary[joint] else 1.0
    ends = (machine.limits.lower[joint] / unit, machine.limits.upper[joint] / unit)
    return [float(end) if np.isfinite(end) else None for end in ends]


def _placement(job: Job) -> dict[str, list[Any]]:
    return {"rotation": job.placement.rotation.tolist(), "origin": job.placement.origin.tolist()}


def places_in_time(count: int) -> Floats:
    """Points (up to PLACES of `count`, evenly) at which legs are drawn."""
    return np.unique(np.linspace(0, max(count - 1, 0), min(count, PLACES)).astype(np.int64))


def legs(job: Job, q: Floats) -> Floats | None:
    """(S, K, 6) drive and platform joint of each leg in the part frame, mm, at joints q (S, J), mm and rad.

    None of a machine without legs, and where the tool that the legs carry is not where the kinematics has it.
    """
    kinematics: Kinematics = job.kinematics(int(job.moves.tool[0]))
    if kinematics.chain or not len(q):
        return None
    rig = kinematics.rig(q)
    if not rig.carriages.shape[1]:
        return None
    tip, axis = kinematics.forward(q)
    gauge, feet, ends = (seen_from_table(kinematics, q, points) for points in (
        rig.gauge[:, None], rig.carriages, rig.ends))
    off = tip + kinematics.tool_length * axis - gauge[:, 0]
    if not _carried(kinematics):  # parts are seen from what carries the whole platform
        feet, ends, off = feet + off[:, None], ends + off[:, None], np.zeros_like(off)
    if not np.abs(off).max(initial=0.0) < SAME:
        return None
    back = job.placement.inverse()
    both = [back.points(part.reshape(-1, 3)).reshape(part.shape) for part in (feet, ends)]
    return np.concatenate(both, axis=2)


def _carried(kinematics: Kinematics) -> list[int]:
    """Rotary joints between the bed and the part."""
    return [j for j, (letter, turns) in enumerate(zip(kinematics.axis_names, kinematics.rotary, strict=True))
            if turns and kinematics.carries_part(letter)]


def seen_from_table(kinematics: Kinematics, q: Floats, points: Floats) -> Floats:
    """Points (S, K, 3) of the bed as the table that its rotary axes carry sees them, the axis nearest the part last."""
    for j in _carried(kinematics):
        direction, point = kinematics.axis_line(kinematics.axis_names[j])
        c, s = np.cos(q[:, j])[:, None, None], np.sin(q[:, j])[:, None, None]
        arm = points - point
        along = (arm @ direction)[..., None] * direction
        points = point + along + c * (arm - along) + s * np.cross(np.broadcast_to(direction, arm.shape), arm)
    return points
