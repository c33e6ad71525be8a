"""The residual field drawn: deviation before and after along the program, and where in the part it is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from postproc.report.residuals import ARCSEC, UM, Residuals
from toolpaths.arrays import Floats, Ints
from toolpaths.choices import FigureEnding
from toolpaths.drawing import image

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SIZE = (11.0, 8.5)
_BINS = 1500
"""of the course along the program, each drawn as its worst point"""
_DOTS = 20_000
"""points of a map"""
_ARROWS = 400
_LEAST = 1e-4
"""um or arcsec: the lower end of the courses"""
_BEFORE, _AFTER, _BOUND = "#9aa0a6", "#1f6fb2", "#c2453a"


def residual_figure(field: Residuals, ending: FigureEnding) -> bytes:
    """An image file of a field; `ending` ".png" or ".svg"."""
    return image(_SIZE, field.title, lambda sheet: _fill(sheet, field), ending)


def _fill(sheet: Figure, field: Residuals) -> None:
    places = sheet.subplots(2, 2, width_ratios=(1.4, 1.0))
    rows = ((slice(0, 3), UM, "tip, um", field.tip_bound),
            (slice(3, 6), ARCSEC, "axis, arcsec", field.axis_bound))
    for (course, there), (part, unit, name, bound) in zip(places, rows, strict=True):
        before, after = (np.linalg.norm(x[:, part], axis=1) / unit for x in (field.before, field.after))
        _course(course, before, after, bound / unit, name)
        _map(sheet, there, field, field.before if unit == UM else field.after, part, unit,
             "tip before, um" if unit == UM else "axis left, arcsec")


def _course(place: Any, before: Floats, after: Floats, bound: float, name: str) -> None:
    for values, color, label in ((before, _BEFORE, "before"), (after, _AFTER, "after")):
        at, worst = _worst(values)
        place.plot(at, np.maximum(worst, _LEAST), color=color, linewidth=0.9, label=f"{label}, worst "
                   f"{values.max(initial=0.0):.3g}")
    place.axhline(bound, color=_BOUND, linewidth=0.9, linestyle="--", label=f"bound {bound:.3g}")
    place.set_yscale("log")
    place.set_ylim(*_decades(np.concatenate([before, after, [bound]])))
    place.yaxis.set_major_formatter("{x:g}")
    place.yaxis.set_minor_formatter("")
    place.set_xlabel("CL points, in the order of the file")
    place.set_ylabel(name)
    place.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize="small", frameon=False)


def _decades(values: Floats) -> tuple[float, float]:
    """Powers of ten round values that are drawn."""
    drawn = np.log10(np.maximum(values, _LEAST))
    return 10.0 ** np.floor(drawn.min()), 10.0 ** (np.floor(drawn.max()) + 1.0)


def _worst(values: Floats) -> tuple[Ints, Floats]:
    """Numbers (B,) and values (B,) of the worst of each of up to _BINS stretches of values (M,)."""
    edges = np.unique(np.linspace(0, len(values), min(_BINS, len(values)) + 1).astype(np.int64))[:-1]
    return edges, np.maximum.reduceat(values, edges) if len(edges) else values


def _map(sheet: Figure, place: Any, field: Residuals, what: Floats, part: slice, unit: float,
         name: str) -> None:
    """The field over the two widest directions of the part, with arrows along them."""
    across, up = sorted(np.argsort(-np.ptp(field.tip, axis=0), kind="stable")[:2].tolist()) if len(field.tip) else (0, 1)
    rows = _spread(len(field.tip), _DOTS)
    size = np.linalg.norm(what[rows][:, part], axis=1) / unit
    dots = place.scatter(field.tip[rows, across], field.tip[rows, up], c=size, s=6, cmap="viridis",
                         rasterized=True)
    sheet.colorbar(dots, ax=place, label=name)
    rows = _spread(len(field.tip), _ARROWS)
    arrows = what[rows][:, part] / unit
    longest = float(np.linalg.norm(arrows, axis=1).max(initial=0.0))
    if longest > 0.0:
        place.quiver(field.tip[rows, across], field.tip[rows, up], arrows[:, across], arrows[:, up], angles="xy",
                     scale=12.0 * longest, width=0.003, color="#333333")
    place.set_aspect("equal", adjustable="datalim")
    place.set_xlabel(f"part {'xyz'[across]}, mm")
    place.set_ylabel(f"part {'xyz'[up]}, mm")


def _spread(count: int, most: int) -> Ints:
    """Up to `most` rows of `count`, evenly."""
    rows: Ints = np.unique(np.linspace(0, max(count - 1, 0), min(count, most)).astype(np.int64))
    return rows
