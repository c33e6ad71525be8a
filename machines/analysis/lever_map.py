"""The distance of the tip from each rotary axis of a chain over two slides: its torque per force at the tip, as a figure."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.drawing import image

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS, SAME = 41, 1e-6
"""positions per slide; mm that count as no difference"""


def lever_map(machine: Machine, letter: str) -> tuple[tuple[str, str], tuple[Floats, Floats], Floats]:
    """(letters of two slides, their positions in mm, (P, P) distance of the tip from rotary axis `letter`, mm).

    Of all pairs of slides that over which the distance differs most; other axes stand at home.

    Raises:
        ValueError: where fewer than two slides have ends, or the machine is no chain.
    """
    j = machine.axis_names.index(letter)
    ends = np.isfinite(machine.limits.lower) & np.isfinite(machine.limits.upper)
    slides = np.flatnonzero(~np.array(machine.rotary) & ends).tolist()
    if not machine.kinematics.straight_slides or len(slides) < 2:
        raise ValueError(f"{machine.name} is no chain with two slides that have ends")
    return max((_over(machine, j, a, b) for a, b in combinations(slides, 2)), key=lambda one: float(np.ptp(one[2])))


def _over(machine: Machine, j: int, a: int, b: int) -> tuple[tuple[str, str], tuple[Floats, Floats], Floats]:
    """The same over slides a and b."""
    sides = [np.linspace(machine.limits.lower[k], machine.limits.upper[k], POINTS) for k in (a, b)]
    grid = np.meshgrid(*sides, indexing="ij")
    q = np.tile(machine.home, (grid[0].size, 1))
    q[:, a], q[:, b] = (side.ravel() for side in grid)
    arm = np.linalg.norm(machine.kinematics.jacobian(q)[:, :3, j], axis=1).reshape(grid[0].shape)
    return (machine.axis_names[a], machine.axis_names[b]), (sides[0], sides[1]), arm


def moved_by_slides(machine: Machine) -> list[str]:
    """Rotary axes from which the slides move the tip: those that carry the part; [] for machines that are no chain, or with
    fewer than two slides that have ends."""
    slides = ~np.array(machine.rotary)
    travel = (machine.limits.upper - machine.limits.lower)[slides]
    if not machine.kinematics.straight_slides or np.isfinite(travel).sum() < 2:
        return []
    turning = [letter for letter, turns in zip(machine.axis_names, machine.rotary, strict=True) if turns]
    return [letter for letter in turning if np.ptp(lever_map(machine, letter)[2]) > SAME]


def lever_figure(machine: Machine, ending: FigureEnding) -> bytes:
    """An image file: a panel for each rotary axis.

    Raises:
        ValueError: where `moved_by_slides` has none.
    """
    turning = moved_by_slides(machine)
    if not turning:
        raise ValueError(f"{machine.name} has no rotary axis from which slides move the tip")
    maps = [lever_map(machine, letter) for letter in turning]

    def fill(sheet: Figure) -> None:
        panels = sheet.subplots(1, len(turning), squeeze=False)[0]
        for axes, letter, (names, sides, arm) in zip(panels, turning, maps, strict=True):
            lines = axes.contourf(sides[0], sides[1], arm.T, 20, cmap="viridis")
            sheet.colorbar(lines, label=f"torque of {letter} per force at the tip, Nm per kN")
            axes.set_xlabel(f"{names[0]}, mm")
            axes.set_ylabel(f"{names[1]}, mm")

    title = f"{machine.name}: torque of rotary axes per force, other axes at home"
    return image((6.0 * len(turning), 4.8), title, fill, ending)
