"""The condition number of a chain over its rotary axes, as a figure. Source: Company 2000, II-19 (the number)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from machines.analysis.chain import indices, scaled_jacobian
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.drawing import image, level
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 73
"""positions per axis; with ends at multiples of 5 degrees on such multiples over a turn"""
MOST = 30.0
"""condition number above which the figure draws no more: near singular positions it grows without end"""


def chain_map(machine: Machine) -> tuple[list[str], list[Floats], Floats]:
    """(letters, positions in degrees, condition number): over the last rotary axis, or over the last two, (P,) or (P, P).

    Slides stand at home; infinite at singular positions. Lists are empty for machines without rotary axes.
    """
    chosen = np.flatnonzero(np.array(machine.rotary))[-2:].tolist()
    low, high = (np.where(np.isfinite(end), end, turn) for end, turn in (
        (machine.limits.lower, -np.pi), (machine.limits.upper, np.pi)))
    sides = [np.linspace(low[j], high[j], POINTS) for j in chosen]
    grid = np.meshgrid(*sides, indexing="ij")
    q = np.tile(machine.home, (grid[0].size if grid else 1, 1))
    for j, side in zip(chosen, grid, strict=True):
        q[:, j] = side.ravel()
    condition, _, _ = indices(scaled_jacobian(machine, q))
    shape = grid[0].shape if grid else (1,)
    return [machine.axis_names[j] for j in chosen], [side / DEG for side in sides], condition.reshape(shape)


def chain_map_figure(machine: Machine, ending: FigureEnding) -> bytes:
    """An image file: a curve over one rotary axis, lines of equal value over two.

    Raises:
        ValueError: of a machine without rotary axes.
    """
    letters, sides, condition = chain_map(machine)
    if not letters:
        raise ValueError(f"{machine.name} has no rotary axis: its condition number is 1 everywhere")
    shown = np.where(condition <= MOST, condition, np.nan)

    def fill(sheet: Figure) -> None:
        axes = sheet.subplots()
        axes.set_xlabel(f"{letters[0]}, degrees")
        if len(letters) == 1:
            axes.plot(sides[0], shown, color="#2456a6")
            axes.set_ylabel("condition number")
            level(axes, shown)
            return
        axes.set_ylabel(f"{letters[1]}, degrees")
        if np.isfinite(shown).any():
            levels = np.linspace(np.nanmin(shown), np.nanmax(shown) + 1e-9, 20)
            lines = axes.contourf(sides[0], sides[1], shown.T, levels, cmap="viridis")
            sheet.colorbar(lines, label=f"condition number; blank above {MOST:g}: near singular positions")

    return image((7.5, 6.0), f"{machine.name}: condition number over {' and '.join(letters)}, lever 100 mm", fill, ending)
