"""Eight hex digits of what an error model says, so that a program can show that its model has changed since."""

from __future__ import annotations

import hashlib

import numpy as np

from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.rods import RodErrors
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.files.covariance import angular
from machines.geometric_error.tables.csv_table import UNITS
from machines.geometric_error.tables.curves import Curve, Fourier, Polynomial, TableCurve
from machines.geometric_error.tables.lattice import ErrorMap
from machines.geometric_error.tables.names import ErrorName
from machines.kinematics.chain import ROTARY
from toolpaths.arrays import Floats
from toolpaths.units import DEG

LENGTH, ANGLE = UNITS["um"], UNITS["arcsec"]
DIGITS = 8
PLACES = 6
"""decimals that count, of um and arcsec (values), mm and degrees (positions)"""


def fingerprint(model: ErrorModel) -> str:
    """The same for files that make the same corrections, whatever their names, units, signs, order and spelling.

    Aside stand the name, the machine and who corrects, which other checks look at, and the covariance: what
    is known of the uncertainty changes no word of a program.
    """
    lines = [*_axes(model.axes), *([] if model.rods is None else _rods(model.rods)),
             *([] if model.map is None else _map(model.map))]
    return hashlib.sha256("\n".join(lines).encode("ascii")).hexdigest()[:DIGITS]


def _axes(axes: SerialErrors) -> list[str]:
    components = sorted(axes.components, key=lambda c: str(c.name))
    turning = {c.name.axis for c in components if c.name.axis in ROTARY}
    return [*(f"{c.name} {_curve(c.name, c.curve)}" for c in components),
            *(f"{name} {_text([value], ANGLE if angular(name) else LENGTH)}" for name, value in
              sorted(axes.constants.items()) if value),
            *(f"point {axis} {_text(axes.reference[axis])}" for axis in sorted({*axes.reference} & axes.axes)),
            *(f"frame {axis} {axes.frame.get(axis, 'fixed')}" for axis in sorted(turning))]


def _curve(name: ErrorName, curve: Curve) -> str:
    position, unit = DEG if name.axis in ROTARY else 1.0, ANGLE if name.angular else LENGTH
    parts: list[str]
    if isinstance(curve, TableCurve):
        approaches = np.split(curve.values, 2) if curve.both else [curve.values]
        parts = [f"table {curve.rule}", _text([curve.period], position), _text(curve.x, position),
                 *(_text(approach, unit) for approach in approaches)]
    elif isinstance(curve, Polynomial):  # coefficients of high powers are small numbers that count
        parts = ["polynomial", " ".join(f"{x:.10g}" for x in curve.values / unit),
                 _text([curve.origin, curve.scale, *curve.range], position)]
    else:
        assert isinstance(curve, Fourier)
        parts = ["series", _text(curve.values, unit), _text([curve.period, curve.origin, *curve.range], position)]
    return " : ".join(parts)


def _rods(rods: RodErrors) -> list[str]:
    unit = np.array([ANGLE if angular(name, rods) else LENGTH for name in rods.names])
    return [f"rods {' '.join(rods.rods)}", _text(rods.pairs), _text(rods.values / unit)]


def _map(error_map: ErrorMap) -> list[str]:
    """Coordinates in the order of the alphabet, as that of columns means nothing."""
    order = sorted(range(len(error_map.letters)), key=lambda k: error_map.letters[k])
    scale = [DEG if error_map.letters[k] in ROTARY else 1.0 for k in order]
    values = np.transpose(error_map.table, (*order, len(order))).reshape(-1, 6) / ([LENGTH] * 3 + [ANGLE] * 3)
    return [*(f"map {error_map.letters[k]} {_text([error_map.periods[k]], unit)} : {_text(error_map.nodes[k], unit)}"
              for k, unit in zip(order, scale, strict=True)),
            f"{_text([error_map.length])} {' '.join(error_map.bed)}", _text(values.ravel())]


def _text(values: Floats | list[float] | tuple[float, ...], unit: float = 1.0) -> str:
    """Numbers in units, to the places that count; no -0."""
    with np.errstate(over="ignore"):  # positions may be any number
        rounded = np.round(np.divide(values, unit), PLACES) + 0.0
    return " ".join(map(f"%.{PLACES}f".__mod__, rounded.tolist()))
