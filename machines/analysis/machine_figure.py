"""A machine on legs drawn from three sides: rods, platform, tool, the paths of the drives over their travel, the workspace.

matplotlib is imported only when a figure is asked for. Nothing here knows what drives a leg: the path of its foot is drawn
as the kinematics give it, a line of a slide, an arc of an arm.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from machines.kinematics.clearance_geometry import ClearanceGeometry, ClearanceParts
from machines.kinematics.workspace import Workspace
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.drawing import ADJACENT, image

if TYPE_CHECKING:
    from matplotlib.figure import Figure

VIEWS = (("from the front", 0, 2), ("from the right", 1, 2), ("from above", 0, 1))
"""name, axes to the right and up"""
PATH = 49
"""joints along the travel of a drive"""
_SIZE = (13.0, 5.0)
"""inches"""


def machine_figure(machine: Machine, ending: FigureEnding, q: Floats | None = None) -> bytes:
    """An image file of a machine at joints q (J,) mm and rad, default home.

    Raises:
        ValueError: of a machine without legs, or joints at which its legs do not meet.
    """
    parts = machine.kinematics.clearance_parts
    if parts is None:
        raise ValueError(f"{machine.name} has no legs: only machines on legs are drawn")
    at = machine.home if q is None else q
    rig = machine.kinematics.rig(at[None])
    if not np.isfinite(rig.ends).all():
        raise ValueError(f"the legs of {machine.name} meet at no platform at {position_words(machine, at)}")
    feet = foot_paths(machine, at)

    def fill(sheet: Figure) -> None:
        for axes, (name, right, up) in zip(sheet.subplots(1, len(VIEWS)), VIEWS, strict=True):
            _view(axes, machine, parts, rig, feet, right, up)
            axes.set_title(name)

    return image(_SIZE, f"{machine.name}: {machine.structure}, at {position_words(machine, at)}", fill, ending)


def position_words(machine: Machine, q: Floats) -> str:
    """Joints (J,) mm and rad as the words of a program, mm and degrees."""
    shown = np.round(np.where(machine.rotary, np.degrees(q), q), 3) + 0.0
    return " ".join(f"{letter}{value:g}" for letter, value in zip(machine.axis_names, shown.tolist(), strict=True))


def foot_paths(machine: Machine, at: Floats) -> Floats:
    """(K, PATH, 3) mm: the foot of each leg over the travel of its drive, the others as at joints `at` (J,).

    A drive without an end of travel makes one turn.
    """
    parts = machine.kinematics.clearance_parts
    assert parts is not None
    paths = []
    for k, name in enumerate(parts.leg_names):
        j = machine.axis_names.index(name)
        low, high = machine.limits.lower[j], machine.limits.upper[j]
        low, high = (low, high) if np.isfinite(high - low) else (-np.pi, np.pi)
        q = np.tile(at, (PATH, 1))
        q[:, j] = np.linspace(low, high, PATH)
        paths.append(machine.kinematics.rig(q).carriages[:, k])
    return np.array(paths)


def _view(axes: Any, machine: Machine, parts: ClearanceParts, rig: ClearanceGeometry, feet: Floats, right: int,
          up: int) -> None:
    def line(points: Floats, **how: Any) -> None:
        axes.plot(points[:, right], points[:, up], **how)

    for k, name in enumerate(parts.leg_names):
        line(feet[k], color="#8899aa", linewidth=4, alpha=0.5, solid_capstyle="butt", label="travel" if k == 0 else None)
        if machine.rotary[machine.axis_names.index(name)]:
            line(np.stack([parts.legs.points[k], rig.carriages[0, k]]), color="#7d3c98", linewidth=2.5)
        for shift in _shifts(parts, k):
            line(np.stack([rig.carriages[0, k], rig.ends[0, k]]) + shift, color="#2456a6", linewidth=1.2, marker="o",
                 markersize=2.5)
        axes.annotate(name, rig.carriages[0, k][[right, up]], xytext=(4, 4), textcoords="offset points", fontsize=8)
    for end in rig.ends[0]:
        line(np.stack([rig.place[0], end]), color="#333333", linewidth=2.5)
    line(np.stack([rig.place[0], rig.gauge[0]]), color="#333333", linewidth=2.5)
    line(np.stack([rig.gauge[0], rig.gauge[0] - machine.kinematics.tool_length * rig.axis[0]]), color="#c0392b", linewidth=2)
    axes.plot(rig.gauge[0, right], rig.gauge[0, up], marker="v", color="#c0392b", linestyle="", label="gauge point")
    if (space := machine.kinematics.workspace) is not None:
        line(_box(space, right, up), color="#27813c", linestyle="--", label="workspace of the platform")
    axes.set_aspect("equal")
    axes.set_xlabel(f"{'xyz'[right]}, mm")
    axes.set_ylabel(f"{'xyz'[up]}, mm")
    if (right, up) == VIEWS[-1][1:]:
        axes.legend(**ADJACENT)


def _shifts(parts: ClearanceParts, k: int) -> Floats:
    """(R, 3) mm: places of the rods of leg k next to its line."""
    sizes = parts.clearance
    own = np.zeros((0, 3)) if sizes is None else sizes.shift[sizes.leg == k]
    return own if len(own) else np.zeros((1, 3))


def _box(space: Workspace, right: int, up: int) -> Floats:
    """(5, 3) mm: its outline in a view."""
    corners = np.tile(space.lower, (5, 1))
    corners[[1, 2], right] = space.upper[right]
    corners[[2, 3], up] = space.upper[up]
    return corners
