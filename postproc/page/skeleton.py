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
    """(S, K, 12) each leg in the part frame, mm, at joints q (S, J), mm and rad: drive and platform joint, then the ends of
    what it moves on: of a slide its rail, of an arm its axis and the drive joint, of a leg of changing length nothing.

    None of a machine without legs, and where the tool that the legs carry is not where the kinematics has it.
    """
    kinematics: Kinematics = job.kinematics(int(job.moves.tool[0]))
    if kinematics.chain or not len(q):
        return None
    rig = kinematics.rig(q)
    if not rig.carriages.shape[1]:
        return None
    tip, axis = kinematics.forward(q)
    gauge, *parts = (seen_from_table(kinematics, q, points) for points in (
        rig.gauge[:, None], rig.carriages, rig.ends, *drives(job.machine, kinematics, q, rig.carriages)))
    off = tip + kinematics.tool_length * axis - gauge[:, 0]
    if not _carried(kinematics):  # parts are seen from what carries the whole platform
        parts, off = [part + off[:, None] for part in parts], np.zeros_like(off)
    if not np.abs(off).max(initial=0.0) < SAME:
        return None
    back = job.placement.inverse()
    return np.concatenate([back.points(part.reshape(-1, 3)).reshape(part.shape) for part in parts], axis=2)


def drives(machine: Machine, kinematics: Kinematics, q: Floats, feet: Floats) -> tuple[Floats, Floats]:
    """Two points (S, K, 3) of what moves each foot (S, K, 3) at joints q (S, J), seen as the feet are: the ends of its
    slide's travel, or its arm's axis and the foot itself; the foot twice of a leg of changing length and where nobody
    knows."""
    made = kinematics.leg_geometry
    if made is None or len(made.names) != feet.shape[1] or not set(made.names) <= set(machine.axis_names):
        return feet, feet
    at = [machine.axis_names.index(name) for name in made.names]
    ends = [np.where(np.isfinite(limit[at]), limit[at], 0.0) for limit in (machine.limits.lower, machine.limits.upper)]
    there = [np.where(made.slide, end - q[:, at], 0.0)[..., None] * made.directions for end in ends]
    arm = feet - made.points
    out = np.where(made.arm[:, None], arm - np.sum(arm * made.directions, axis=2, keepdims=True) * made.directions, 0.0)
    return feet - out + there[0], feet + there[1]


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
