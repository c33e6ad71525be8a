"""Measures of a machine on legs over a slice of its workspace or along a line, as figures and comma-separated values.

Source: Company 2000, figures III-12 to III-20 (curves against a parameter, maps over a slice).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from machines.analysis.choices import MapMeasure, MapNumber
from machines.analysis.measures import WORDS, studied
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError, error
from toolpaths.drawing import image, level
from toolpaths.shapes import arrays
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAP_NUMBERS: tuple[MapNumber, ...] = ("x", "y", "z", "tilt")
POINTS = 41
"""per direction"""


@dataclass(frozen=True, eq=False)
@arrays(places="N 4", values="N")
class MeasuredPlaces:
    """Values at places (x, y, z in mm, tilt in degrees) along `along`: one of MAP_NUMBERS for a curve, two for a map."""

    machine: str
    measure: MapMeasure
    along: tuple[MapNumber, ...]
    places: Floats
    values: Floats

    @property
    def csv(self) -> str:
        """Comma-separated values with units in the heads."""
        rows = np.column_stack([self.places, self.values]).tolist()
        head = f"x_mm,y_mm,z_mm,tilt_deg,{self.measure}"
        return "\n".join([head, *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n"

    @property
    def figures(self) -> dict[str, Any]:
        """Largest and least value with their places; units in the keys."""
        good = np.where(np.isfinite(self.values), self.values, np.nan)
        ends = {"largest": int(np.nanargmax(good)), "least": int(np.nanargmin(good))}
        return {"machine": self.machine, "measure": self.measure, "along": list(self.along), "points": len(good)} | {
            key: {"value": float(good[k]), "at_mm": self.places[k, :3].tolist(), "at_tilt_deg": float(self.places[k, 3])}
            for key, k in ends.items()}

    @property
    def title(self) -> str:
        """Machine, measure, and where the numbers stand that do not change."""
        first = self.places[0]
        fixed = [f"{name} {first[i]:g} {'degrees' if name == 'tilt' else 'mm'}" for i, name in enumerate(MAP_NUMBERS)
                 if name not in self.along]
        return f"{self.machine}: {WORDS[self.measure]}, platform at {', '.join(fixed)}"


def measured(machine: Machine, measure: MapMeasure, along: tuple[MapNumber, ...],
             at: Mapping[MapNumber, float], offset: float = 0.0) -> MeasuredPlaces:
    """Over the workspace's range of one or two numbers, the others as `at` has them (mm, degrees), else in the middle;
    `offset` is the height of the centre of mass above the reference point, mm.

    Raises:
        DiagnosticError: of a machine without legs.
    """
    legs = studied(machine, measure).resized(offset=offset)
    space = legs.legs.workspace
    low, high = np.append(space.lower, space.tilt[0]), np.append(space.upper, space.tilt[1])
    middle = np.append(space.middle, np.clip(0.0, *space.tilt))
    for name, value in at.items():
        middle[MAP_NUMBERS.index(name)] = value * (DEG if name == "tilt" else 1.0)
    axes = [MAP_NUMBERS.index(name) for name in along]
    sides = np.meshgrid(*(np.linspace(low[i], high[i], POINTS) for i in axes), indexing="ij")
    places = np.tile(middle, (sides[0].size, 1))
    for i, side in zip(axes, sides, strict=True):
        places[:, i] = side.ravel()
    values = legs.value(measure, places[:, :3], places[:, 3])
    if not np.isfinite(values).any():
        raise DiagnosticError([error("analysis.reach", f"{machine.name} reaches none of these places, or is singular at "
                                                       "all of "
                                     "them", file=machine.file, hint="name places of its workspace with --at")])
    return MeasuredPlaces(machine.name, measure, along, places / np.array([1.0, 1.0, 1.0, DEG]), values)


def map_figure(found: MeasuredPlaces, ending: FigureEnding) -> bytes:
    """A curve, or lines of equal value over a slice; the largest and the least value are marked."""
    axes_of = [MAP_NUMBERS.index(name) for name in found.along]
    names = [f"{name}, {'degrees' if name == 'tilt' else 'mm'}" for name in found.along]

    def fill(sheet: Figure) -> None:
        axes = sheet.subplots()
        x = found.places[:, axes_of[0]]
        good = np.where(np.isfinite(found.values), found.values, np.nan)
        if len(axes_of) == 1:
            axes.plot(x, good, color="#2456a6")
            axes.set_ylabel(WORDS[found.measure])
            level(axes, good)
        else:
            y = found.places[:, axes_of[1]]
            shape = (POINTS, POINTS)
            lines = axes.contourf(x.reshape(shape), y.reshape(shape), good.reshape(shape), 20, cmap="viridis")
            sheet.colorbar(lines, label=WORDS[found.measure])
            axes.set_ylabel(names[1])
            for k, mark in ((int(np.nanargmax(good)), "^"), (int(np.nanargmin(good)), "v")):
                axes.plot(x[k], y[k], mark, color="#c0392b", label=f"{good[k]:.4g}")
            axes.legend(fontsize="small")
        axes.set_xlabel(names[0])

    return image((7.5, 6.0), found.title, fill, ending)
