"""How far the tool of a machine on legs yields over its workspace, as plain data, a table and a map; units in the keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from machines.machine import Machine
from machines.stiffness.statics import Springs, compliance, drive_forces, force_rows, rod_forces, tip_stiffness
from machines.tolerances.influence import PlatformPoses, poses_at, poses_over
from machines.tolerances.report import rods_of
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.dataclass import dataclass
from toolpaths.drawing import image
from toolpaths.shapes import arrays
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 31
"""of a map, per direction"""


@dataclass(frozen=True, eq=False)
@arrays(force="3")
class StiffnessQuestion:
    """What is asked: stiffness of the parts (N/mm), length of the tool (mm), force at the tip (3,) N."""

    springs: Springs
    tool: float
    force: Floats


def stiffness(machine: Machine, asked: StiffnessQuestion) -> dict[str, Any]:
    """Least and largest stiffness of the tip, deflection, rod and drive forces under the force, with the pose of each.

    Of a machine with an axis between platform and spindle: that axis at 0.

    Raises:
        DiagnosticError: of a machine without legs.
    """
    rods = rods_of(machine)
    poses, point = poses_over(rods.legs), rods.legs.gauge - np.array([0.0, 0.0, asked.tool])
    rows = force_rows(rods, poses, point)
    c = compliance(rows, asked.springs)
    tip, bend = tip_stiffness(c), np.linalg.norm(c @ asked.force, axis=1)
    bars, drives = rod_forces(rows, asked.force), drive_forces(rows, asked.force)
    least, most, worst = int(tip.argmin()), int(tip.argmax()), int(bend.argmax())
    bar, drive = (np.unravel_index(int(np.abs(v).argmax()), v.shape) for v in (bars, drives))
    directions = {f"stiffness_{letter}_least_n_per_um": float(1e-3 / c[:, i, i].max())
                  for i, letter in enumerate("xyz") if c[:, i, i].max() > 0.0}
    found = {"machine": machine.name, "tool_mm": asked.tool, "poses": len(tip), "force_n": asked.force.tolist()}
    found |= {"spindle_axis_deg": 0.0} if rods.legs.head else {}
    found |= directions
    return found | {
        "stiffness_n_per_um": {"least": float(tip[least] * 1e-3), **_at(poses, least), "largest": float(tip[most] * 1e-3)},
        "deflection_um": {"worst": float(bend[worst] * 1e3), "along_xyz": (c[worst] @ asked.force * 1e3).tolist(),
                          **_at(poses, worst)},
        "rod_force_n": {"largest": float(bars[bar]), "rod": rods.names[int(bar[1])], **_at(poses, int(bar[0]))},
        "drive_force_n": {"largest": float(drives[drive]), "drive": rods.legs.names[int(drive[1])],
                          **_at(poses, int(drive[0]))}}


def _at(poses: PlatformPoses, k: int) -> Mapping[str, Any]:
    return {"at_mm": poses.pose[k, :3].tolist(), "at_tilt_deg": float(poses.pose[k, 3]) / DEG,
            "at_heading_deg": float(poses.pose[k, 4]) / DEG}


def stiffness_map(machine: Machine, asked: StiffnessQuestion, ending: FigureEnding) -> bytes:
    """Least stiffness of the tip over the horizontal slice through the middle of the workspace, tool level."""
    rods = rods_of(machine)
    space, point = rods.legs.workspace, rods.legs.gauge - np.array([0.0, 0.0, asked.tool])
    x, y = np.meshgrid(*(np.linspace(lo, hi, POINTS) for lo, hi in zip(space.lower[:2], space.upper[:2], strict=True)))
    tilt = float(np.clip(0.0, *space.tilt))
    pose = np.tile([0.0, 0.0, space.middle[2], tilt, 0.0], (x.size, 1))
    pose[:, :2] = np.column_stack([x.ravel(), y.ravel()])
    tip = tip_stiffness(compliance(force_rows(rods, poses_at(rods.legs, pose), point), asked.springs)) * 1e-3

    def fill(sheet: Figure) -> None:
        axes = sheet.subplots()
        lines = axes.contourf(x, y, tip.reshape(x.shape), 20, cmap="viridis")
        sheet.colorbar(lines, label="least stiffness of the tip, N/um")
        axes.set_xlabel("x, mm")
        axes.set_ylabel("y, mm")

    return image((7.5, 6.0), f"{machine.name}, tool {asked.tool:g} mm, platform at z {space.middle[2]:g} mm", fill, ending)
