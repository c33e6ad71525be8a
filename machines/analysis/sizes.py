"""Extremes of a measure over the workspace against sizes of the machine: figures III-12 and III-14 to III-20 of Company
2000.

For each size the measure is looked at on a grid of the declared workspace, faces included, as III.6 does.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from machines.analysis.choices import MapMeasure, SizeNumber
from machines.analysis.measures import WORDS, studied
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError, error
from toolpaths.drawing import image
from toolpaths.shapes import arrays
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CURVE, MAP, GRID = 41, 21, (9, 9, 3, 4)
"""sizes of a curve; per direction of a map; places and tilts of the workspace"""
SIZE_WORDS: Mapping[SizeNumber, str] = {
    "rod": "length of the rods, mm", "radius": "distance of the drives from the z axis, mm",
    "offset": "centre of mass above the reference point, mm"}


@dataclass(frozen=True, eq=False)
@arrays(sizes="N A", least="N", largest="N", place="N 4")
class SizeStudy:
    """Sizes (N, A) along `along`, the least and the largest value over the workspace (NaN where it is not in reach), where
    the largest is: x, y, z mm, tilt degrees."""

    machine: str
    measure: MapMeasure
    along: tuple[SizeNumber, ...]
    sizes: Floats
    least: Floats
    largest: Floats
    place: Floats

    @property
    def csv(self) -> str:
        """Comma-separated values with units in the heads."""
        head = ",".join([*(f"{name}_mm" for name in self.along), "least", "largest", "x_mm", "y_mm", "z_mm", "tilt_deg"])
        rows = np.column_stack([self.sizes, self.least, self.largest, self.place]).tolist()
        return "\n".join([head, *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n"

    @property
    def figures(self) -> dict[str, Any]:
        """The sizes of which the largest value over the workspace is least, and greatest; units in the keys."""
        k, worst = int(np.nanargmin(self.largest)), int(np.nanargmax(self.largest))
        return {"machine": self.machine, "measure": self.measure, "of": "the platform's reference point, over the workspace",
                "along": list(self.along), "sizes": len(self.sizes), "in_reach": int(np.isfinite(self.largest).sum()),
                "best": self._row(k), "worst": self._row(worst)}

    def _row(self, k: int) -> dict[str, Any]:
        return {f"{name}_mm": float(v) for name, v in zip(self.along, self.sizes[k], strict=True)} | {
            "largest": float(self.largest[k]), "least": float(self.least[k]), "at_mm": self.place[k, :3].tolist(),
            "at_tilt_deg": float(self.place[k, 3])}


def over_sizes(machine: Machine, measure: MapMeasure, ranges: Mapping[SizeNumber, tuple[float, float]],
               offset: float = 0.0) -> SizeStudy:
    """Along one size, or two.

    Raises:
        DiagnosticError: of a machine without legs, or where no size has the workspace in reach.
    """
    legs = studied(machine, measure).resized(offset=offset)
    count = CURVE if len(ranges) == 1 else MAP
    sizes = np.array(list(product(*(np.linspace(low, high, count) for low, high in ranges.values()))))
    place, tilt = legs.legs.workspace.grid(GRID)
    least, largest = np.full(len(sizes), np.nan), np.full(len(sizes), np.nan)
    where = np.full((len(sizes), 4), np.nan)
    for k, row in enumerate(sizes.tolist()):
        other = legs.resized(**dict(zip(ranges, row, strict=True)))
        if all(np.isfinite(other.transmits.loops_at(place, tilt, float(h))[1]).all() for h in other.transmits.headings):
            value = other.value(measure, place, tilt)
            j = int(value.argmax())
            least[k], largest[k], where[k] = value.min(), value[j], [*place[j], tilt[j] / DEG]
    if not np.isfinite(largest).any():
        words = ", ".join(f"{name} {low:g} to {high:g} mm" for name, (low, high) in ranges.items())
        raise DiagnosticError([error("analysis.reach", f"{machine.name} has its workspace in reach with none of {words}",
                                     file=machine.file, hint="name other sizes with --along rod=LOW:HIGH")])
    return SizeStudy(machine.name, measure, tuple(ranges), sizes, least, largest, where)


def size_figure(found: SizeStudy, ending: FigureEnding) -> bytes:
    """Curves of the largest and the least value, or lines of equal largest value over two sizes."""
    def fill(sheet: Figure) -> None:
        axes = sheet.subplots()
        largest = np.where(np.isfinite(found.largest), found.largest, np.nan)
        if len(found.along) == 1:
            axes.plot(found.sizes[:, 0], largest, color="#2456a6", label="largest")
            axes.plot(found.sizes[:, 0], np.where(np.isfinite(largest), found.least, np.nan), color="#8899aa", label="least")
            axes.set_ylabel(WORDS[found.measure])
            axes.legend(fontsize="small")
        else:
            x, y, v = (a.reshape(MAP, MAP) for a in (found.sizes[:, 0], found.sizes[:, 1], largest))
            most = float(np.nanpercentile(largest, 90.0))
            sheet.colorbar(axes.contourf(x, y, np.minimum(v, most), 20, cmap="viridis"),
                           label=f"largest {WORDS[found.measure]}")
            axes.set_ylabel(SIZE_WORDS[found.along[1]])
        axes.set_xlabel(SIZE_WORDS[found.along[0]])

    return image((7.5, 6.0), f"{found.machine}: {WORDS[found.measure]} over the workspace, of the reference point", fill,
                 ending)
