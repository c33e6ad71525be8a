"""An error model drawn: component errors over the travel of their axes, and what all errors do to the tip in two sections.

matplotlib is imported only when a figure is asked for. What comes from files is drawn as it stands, never as markup.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component
from machines.geometric_error.exchange.tabulate import both_directions
from machines.geometric_error.exchange.volume import INSIDE, ranges, section
from machines.geometric_error.tables.csv_table import UNITS
from machines.machine import Machine
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.drawing import ADJACENT, image
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UM, ARCSEC = UNITS["um"], UNITS["arcsec"]
FINE = 721
"""positions along a curve"""
NODES = 21
"""places along each side of a section"""
ARROWS = 2
"""one arrow for so many places, each approach direction"""
_WIDTH, _HIGH, _SECTION = 11.0, 2.0, 4.2
"""inches: of the sheet, of a row of curves, of the sections"""
_UNCERTAINTY = 2.0
"""standard deviations of the band round a curve"""


def model_figure(model: ErrorModel, machine: Machine, tool_length: float, ending: FigureEnding) -> bytes:
    """An image file of a model on its machine.

    Args:
        tool_length: mm, of the tool whose tip the sections show
        ending: ".png" or ".svg"

    Raises:
        ValueError: for another ending.
    """
    axes = [letter for letter in machine.axis_names if any(c.name.axis == letter for c in model.axes.components)]
    size = _WIDTH, _HIGH * len(axes) + _SECTION
    title = f"errors {model.name or 'without a name'} of {machine.name}, {len(model.names)} parameters"

    def fill(sheet: Figure) -> None:
        rows = sheet.subfigures(len(axes) + 1, 1, height_ratios=[_HIGH] * len(axes) + [_SECTION], squeeze=False)[:, 0]
        for row, letter in zip(rows, axes, strict=False):
            _axis(row, model, machine, letter)
        _sections(rows[-1], model, machine, tool_length)

    return image(size, title, fill, ending)


def _axis(sheet: Any, model: ErrorModel, machine: Machine, letter: str) -> None:
    """The displacements of an axis on the left, its turns on the right; what it has none of has no panel."""
    turning = machine.rotary[machine.axis_names.index(letter)]
    number = {name: k for k, name in enumerate(model.names)}
    mine = [c for c in model.axes.components if c.name.axis == letter]
    kinds = sorted({c.name.angular for c in mine})
    for place, angular in zip(sheet.subplots(1, len(kinds), squeeze=False)[0], kinds, strict=True):
        for component in (c for c in mine if c.name.angular == angular):
            own = [number[f"{component.name}{label}"] for label in component.curve.labels()]
            known = None if model.covariance is None else model.covariance[np.ix_(own, own)]
            _curve(place, component, _positions(model, machine, component), DEG if turning else 1.0, known)
        place.set_xlabel(f"{letter}, {'degrees' if turning else 'mm'}")
        place.set_ylabel("arcsec" if angular else "um")
        place.legend(**ADJACENT)


def _positions(model: ErrorModel, machine: Machine, component: Component) -> Floats:
    j = machine.axis_names.index(component.name.axis)
    lower, upper = (float(x[j]) for x in ranges(model, machine))
    return np.linspace(lower, upper, FINE)


def _curve(place: Any, component: Component, x: Floats, position: float,
           covariance: Floats | None) -> None:
    """A component, approached backwards as dots where that differs; a band of its uncertainty."""
    curve, unit = component.curve, ARCSEC if component.name.angular else UM
    both = both_directions(curve)
    line, = place.plot(x / position, curve.at(x, 1.0 if both else 0.0) / unit, linewidth=1.1,
                       label=str(component.name))
    if both:
        place.plot(x / position, curve.at(x, -1.0) / unit, linewidth=1.1, linestyle=":", color=line.get_color(),
                   label=f"{component.name}, backwards")
    if covariance is not None:
        middle, basis = curve.at(x) / unit, curve.basis(x, np.zeros(len(x)))
        band = _UNCERTAINTY * np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", basis, covariance, basis), 0.0)) / unit
        place.fill_between(x / position, middle - band, middle + band, color=line.get_color(), alpha=0.15, linewidth=0.0,
                           rasterized=True)


def _round_part(value: float) -> float:
    """The greatest of 1, 2, 5, 10 ... that is no more than `value`; 0 for none."""
    if not value > 0.0:
        return 0.0
    ten = 10.0 ** np.floor(np.log10(value))
    return float(max(digit * ten for digit in (1.0, 2.0, 5.0) if digit * ten <= value))


def _sections(sheet: Any, model: ErrorModel, machine: Machine, tool_length: float) -> None:
    """What the tip is off by when commanded as the nominal machine, over x y and over x z."""
    kinematics = machine.kinematics.with_tool(tool_length)
    actual, nominal = model.on(kinematics), model.zero().on(kinematics)
    lower, upper = ranges(model, machine)
    for place, (across, up) in zip(sheet.subplots(1, 2), ((0, 1), (0, 2)), strict=True):
        if np.any(lower > upper):
            place.set_title("measured nowhere within travel", fontsize="small")
            continue
        q, one, two = section(machine, lower, upper, across, up, NODES)
        w = actual.coordinates(q)
        off = (actual.aim(w)[0] - nominal.aim(w)[0]) / UM
        off[actual.outside(w, INSIDE).any(axis=1)] = np.nan
        off = off.reshape(NODES, NODES, 3)
        shown = place.pcolormesh(one, two, np.linalg.norm(off, axis=2), shading="gouraud", cmap="viridis",
                                 rasterized=True)
        sheet.colorbar(shown, ax=place, label="tip off by, um")
        some = slice(None, None, ARROWS)
        long = _round_part(float(np.nanmax(np.linalg.norm(off[..., [across, up]], axis=2), initial=0.0)))
        if long:
            arrows = place.quiver(one[some], two[some], off[some, some, across], off[some, some, up], color="white",
                                  width=0.003)
            place.quiverkey(arrows, 0.9, 1.04, long, f"{long:g} um", labelpos="E", color="black")
        place.set_xlabel(f"{'xyz'[across]}, mm")
        place.set_ylabel(f"{'xyz'[up]}, mm")
        place.set_title(f"tool of {tool_length:g} mm, other axes in the middle", fontsize="small")
