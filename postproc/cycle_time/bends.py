"""Speeds at which a control with limited jerk passes corners and bends, by formulas.

What `postproc.clock` executes, for one vertex at a time: over a width w the direction changes by du as the quintic
S(x) = 10 x^3 - 15 x^4 + 6 x^5, whose first derivative is at most 15/8 and whose second at most 10/sqrt(3); so a joint j
takes the acceleration 15/8 |du_j| v^2/w and the jerk 10/sqrt(3) |du_j| v^3/w^2. The width is that of the tolerance:
12.8 e/|du| at a corner, sqrt(38.4 e/k) on a curve of curvature k. On a curve the curvature is the acceleration and its
change the jerk.
"""

from __future__ import annotations

import numpy as np

from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.shape import Shape
from toolpaths.arrays import Bools, Floats

STEEPEST, PLANNED = 0.02, 0.98
"""s in which full acceleration is built up at least, and the share of the jerks that is planned with"""
CORNER_WIDTH, CURVE_WIDTH = 12.8, 38.4
"""times the tolerance over the change of direction, and times the tolerance over the curvature (its root)"""
LEAST_WIDTH = 0.01
"""mm over which every corner is rounded off"""
FIRST, SECOND = 15.0 / 8.0, 10.0 / 3.0**0.5
"""largest derivatives of the quintic"""
FARTHEST = 50.0
"""blocks over which a curve is smoothed at most"""
SMOOTH_TURN, SMOOTH_SAG, EVEN, SLIGHT, ROUNDED = 1.0, 0.25, 1.5, 0.02, 0.003
"""what stands on a curve, as `postproc.clock.path` has it: turn, sag in mm, times what both neighbours turn, rad, mm"""
NOTHING = 1e-12
"""mm or rad, against division by 0"""


def bend_speed(blocks: MotionBlocks, form: Shape, model: CycleTimeModel, first: Floats, last: Floats,
               tolerance: Floats) -> Floats:
    """(E-1,) largest speed along the path between two blocks.

    Args:
        first, last (E, A): derivatives of the axes by path length at begin and end of each block
        tolerance (E-1,): mm that the path may leave the end of each block
    """
    axes = blocks.axes
    weight = blocks.arms
    length = np.where(blocks.arc, form.length, np.linalg.norm((blocks.end - blocks.start) * weight, axis=1))
    length = np.maximum(length, NOTHING)
    slower = np.where(form.length > 0.0, form.length / length, 1.0)
    change = first[1:] * slower[1:, None] - last[:-1] * slower[:-1, None]
    turn, change = np.linalg.norm(change * weight, axis=1), np.abs(change)
    acceleration = model.bend_acceleration * axes.acceleration
    jerk = model.bend_jerk * np.minimum(PLANNED * axes.jerk, axes.acceleration / STEEPEST)
    mean, half = (length[1:] + length[:-1]) / 2.0, np.minimum(length[1:], length[:-1])
    with np.errstate(divide="ignore", invalid="ignore"):
        wide = np.sqrt(CURVE_WIDTH * tolerance * mean / np.maximum(turn, NOTHING))
        if model.corner_step is None:
            width = np.minimum(CORNER_WIDTH * tolerance / np.maximum(turn, NOTHING), np.maximum(half, wide))
            width = np.maximum(width, LEAST_WIDTH)
            corner = _least(acceleration / FIRST, change, width, jerk / SECOND, change, width**2)
        else:
            corner = np.minimum(_over(model.corner_step / weight, change), np.sqrt(_over(axes.acceleration, change) * mean))
        bent = np.concatenate([change[:1], change, change[-1:]])
        bent = np.maximum(np.abs(change - bent[:-2]), np.abs(change - bent[2:]))
        curve = _least(acceleration, change, mean, jerk, bent, mean * np.clip(wide, mean, FARTHEST * mean))
    smooth = _smooth(turn, length, half, tolerance)
    speed = np.where(smooth, np.maximum(corner, curve) if model.corner_step is None else curve, corner)
    return np.asarray(speed * np.minimum(slower[1:], slower[:-1]))


def _over(limit: Floats, change: Floats) -> Floats:
    """(E-1,) least of limits (A,) over changes (E-1, A)."""
    return np.asarray((limit / change).min(axis=1, initial=np.inf))


def _least(acceleration: Floats, change: Floats, width: Floats, jerk: Floats, bent: Floats, area: Floats) -> Floats:
    """(E-1,) lesser of the speeds that accelerations and jerks (A,) allow."""
    return np.asarray(np.minimum(np.sqrt(_over(acceleration, change) * width), np.cbrt(_over(jerk, bent) * area)))


def _smooth(turn: Floats, length: Floats, half: Floats, tolerance: Floats) -> Bools:
    """(E-1,) whether both blocks are of one curve."""
    around = np.concatenate([[0.0], turn[:-1]]) + np.append(turn[1:], 0.0)
    slight = np.maximum(SLIGHT, ROUNDED / half)
    sag = turn * np.maximum(length[1:], length[:-1]) / 8.0
    return np.asarray((turn <= np.minimum(SMOOTH_TURN, np.maximum(EVEN * around, slight))) & (sag <= SMOOTH_SAG)
                      & (tolerance > 0.0))
