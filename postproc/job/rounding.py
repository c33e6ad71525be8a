"""What the rounding of the words may cost, before any is written."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from itertools import product

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.base.options import Options
from postproc.control.control import Control, InterpolationMode
from postproc.reference.moves import Moves
from toolpaths.arrays import Floats, distinct
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

LEVER = 0.1
"""share of the tip tolerance above which the slides make up for what rounded rotary words do to the tip"""


@dataclass(frozen=True)
class Rounding:
    """Largest deviation that the rounding of words can make: tip in mm, axis in rad.

    `made_up` is True where machine coordinates of the slides are those for the rounded rotary words, so that these
    move the tip no more.
    """

    tip: float
    axis: float
    made_up: bool = False


def rounding_bound(control: Control, kin: Kinematics, moves: Moves, grain: Floats,
                   laws: Collection[InterpolationMode], tolerance: float) -> Rounding:
    """Worst case of half a last decimal in every word, to first order (Jacobian), at up to 500 of the poses.

    `grain` (J,) is the last decimal of each word, mm or degrees; `laws` are those that the words may have. Where
    X, Y, Z are the tip, rotary words turn the tool about it.
    """
    rows = distinct(np.linspace(0, len(moves) - 1, min(len(moves), 500)).astype(int))
    some = kin.inverse(moves.tip[rows], kin.nearest_axis(moves.axis[rows]))[0]
    some = some[np.isfinite(some).all(axis=1)]
    if not len(some):
        return Rounding(0.0, 0.0)
    step = 0.5 * grain / control.unit
    jacobian = kin.jacobian(some)
    axis = np.linalg.norm(jacobian[:, 3:], axis=1) @ step
    if "axes" not in laws:
        return Rounding(float(np.linalg.norm(step[control.slides])), float(axis.max()))
    slides, rotary = control.slides, control.rotary
    linear = _farthest(jacobian[:, :3][:, :, slides] * step[slides])
    lever = np.linalg.norm(jacobian[:, :3][:, :, rotary], axis=1) @ step[rotary]
    if kin.straight_slides and lever.max() > LEVER * tolerance:
        return Rounding(float(linear.max()), float(axis.max()), True)
    return Rounding(float((linear + lever).max()), float(axis.max()))


def helix_bound(moves: Moves, grain: float, angle_grain: float, climbing: bool) -> float:
    """mm that the ends of arcs by pole and angle may be off besides (`polar_arc`); 0 without any.

    Args:
        grain, angle_grain: last decimals of lengths in mm, of angles in degrees
        climbing: True where plane arcs may climb too, by what a correction lifts their ends
    """
    rows = np.flatnonzero((moves.arc >= 0) & ~moves.link)
    arc = moves.arc[rows]
    rise = np.abs(np.einsum("ni,ni->n", moves.tip[rows] - moves.tip[rows - 1], moves.arcs.normal[arc]))
    radius = moves.arcs.radius[arc[climbing | (rise > 0.5 * grain)]]
    return float(np.hypot(grain, 0.5 * angle_grain * DEG * radius.max())) if len(radius) else 0.0


def _farthest(sides: Floats) -> Floats:
    """(N,) half the longest diagonal of the boxes with the half sides (N, 3, K): slides of parallel machines run aslant."""
    signs = np.array(list(product((1.0, -1.0), repeat=sides.shape[2])))
    result: Floats = np.linalg.norm(sides @ signs.T, axis=1).max(axis=1)
    return result


def rounding_problem(bound: Rounding, tolerance: float, axis_tolerance: float) -> list[Diagnostic]:
    """Rounding of the words may take a half of the tolerances at most: the rest is for the path."""
    if bound.tip <= tolerance / 2.0 and bound.axis <= axis_tolerance / 2.0:
        return []
    return [error("tolerance.rounding", f"rounding of the words alone may move the tip by {bound.tip:.6f} mm and the axis "
                  f"by {bound.axis / DEG:.6f} degrees, of {tolerance:g} mm and {axis_tolerance / DEG:g} degrees that are "
                  "allowed in addition to the control's own smoothing",
                  hint="more decimals in the controller's [format], or a "
                  "wider --tolerance, --axis-tolerance")]


def without_splines(options: Options, toolpath: Toolpath) -> tuple[Options, list[Diagnostic]]:
    """The options with the tolerance that arcs and chords in the place of splines leave; an error where it is too little."""
    slack = toolpath.spline_slack
    if slack and not 2.0 * slack < options.tolerance:
        return options, [error(
            "tolerance.splines", f"arcs and chords in the place of splines are up to {slack:g} mm off them, the tolerance "
            f"is {options.tolerance:g} mm", file=toolpath.file,
            hint="read the CL file with the tolerance of the program: --tolerance, tolerance= of toolpaths.read")]
    return replace(options, tolerance=options.tolerance - slack), []
