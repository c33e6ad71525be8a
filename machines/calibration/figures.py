"""A calibration drawn: signatures (or parameters) with their uncertainty, residuals, condition number against set-ups.

matplotlib is imported only when a figure is asked for. What comes from files is drawn as it stands, never as markup.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from machines.calibration.result_figures import CalibrationFigures, FoundParameter, Numbers, PlannedCampaign, Signature
from toolpaths.choices import FigureEnding
from toolpaths.drawing import ADJACENT, image, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE = 8.0, 3.2
"""inches, of one panel"""
MANY = 40
"""points of a curve beyond which they are not marked; names of parameters below the axis"""
BOUND = 1.96
"""standard deviations of the 95 % bounds drawn"""


def draw(figures: CalibrationFigures, title: str, ending: FigureEnding) -> bytes:
    """The figures of a `Calibration` as an image file.

    Args:
        ending: ".png" or ".svg"

    Raises:
        ValueError: for another ending.
    """
    panels = _panels(figures)

    def fill(sheet: Figure) -> None:
        for place, (panel, given) in zip(np.ravel(sheet.subplots(len(panels), 1)), panels, strict=True):
            panel(place, given)

    return image((SIZE[0], SIZE[1] * len(panels)), title, fill, ending)


def _panels(figures: CalibrationFigures) -> list[tuple[Any, Any]]:
    """(function, what it draws), top to bottom; signatures by unit."""
    curves = figures.get("signatures", {})
    units = sorted({curve["unit"] for curve in curves.values()})
    found: list[tuple[Any, Any]] = [(_signatures, {k: c for k, c in curves.items() if c["unit"] == u}) for u in units]
    if not curves:
        chosen = figures["parameters"]
        found = [(_parameters, {k: p for k, p in chosen.items() if p["unit"] == u})
                 for u in sorted({p["unit"] for p in chosen.values()})]
    found.append((_residuals, figures["residuals"]))
    return found + ([(_conditions, figures["plan"])] if figures.get("plan") else [])


def _signatures(place: Axes, curves: dict[str, Signature]) -> None:
    for name, curve in curves.items():
        x, y, sigma = _floats(curve["degrees"]), _floats(curve["values"]), _floats(curve["sigma"])
        line, = place.plot(x, y, marker="." if len(x) < MANY else "", label=plain(name))
        place.fill_between(x, y - BOUND * sigma, y + BOUND * sigma, color=line.get_color(), alpha=0.2,
                           linewidth=0.0)
    _labelled(place, "position [deg]", f"signature [{next(iter(curves.values()))['unit']}], 95 % bounds")
    place.legend(**ADJACENT)


def _parameters(place: Axes, chosen: dict[str, FoundParameter]) -> None:
    values, sigma = _floats([p["value"] for p in chosen.values()]), _floats([p["sigma"] for p in chosen.values()])
    at = np.arange(len(values))
    place.errorbar(at, values, yerr=BOUND * sigma, fmt="o", markersize=3.0, capsize=3.0)
    named = at[:: -(-len(at) // MANY)]
    place.set_xticks(named, [plain(list(chosen)[k]) for k in named], rotation=90, fontsize="small")
    _labelled(place, "parameter", f"value [{next(iter(chosen.values()))['unit']}], 95 % bounds")


def _residuals(place: Axes, rows: dict[str, Numbers]) -> None:
    for name, row in rows.items():
        place.plot(_floats(row), linestyle="", marker=".", label=plain(name))
    for bound in (-BOUND, BOUND):
        place.axhline(bound, color="gray", linewidth=0.8, linestyle="--")
    _labelled(place, "reading", "residual [standard deviations]")
    place.legend(**ADJACENT)


def _conditions(place: Axes, plan: list[PlannedCampaign]) -> None:
    setups, number = [c["setups"] for c in plan], _floats([c["condition_number"] for c in plan])
    place.plot(setups, number, marker="o")
    place.set_xticks(setups)
    for m, value in zip(setups, number, strict=True):
        if np.isnan(value):
            place.axvline(m, color="tab:red", linewidth=0.8, linestyle=":",
                          label="" if place.get_legend_handles_labels()[1] else "not reported")
    if np.isnan(number).any():
        place.legend(**ADJACENT)
    _labelled(place, "set-ups m", "condition number")


def _labelled(place: Axes, x: str, y: str) -> None:
    place.set_xlabel(x)
    place.set_ylabel(y)


def _floats(values: list[float | None]) -> np.ndarray[Any, np.dtype[np.float64]]:
    """NaN for None."""
    return np.array([np.nan if v is None else v for v in values], dtype=np.float64)
