"""Directions of reference motions at their ends, tip and axis together."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves, turn_about

_STRAIGHT = 1e-7
"""rad: axes that differ by less are carried straight from one to the other"""


def rates(curves: Curves, scale: float) -> tuple[Floats, Floats]:
    """d(tip, scale axis)/du (N, 6) at u = 0 and at u = 1."""
    tip0 = curves.end - curves.start
    tip1 = tip0.copy()
    arc = np.flatnonzero(curves.is_arc)
    if len(arc):
        normal, sweep = curves.normal[arc], curves.sweep[arc]
        first, last = curves.start[arc] - curves.center[arc], curves.end[arc] - curves.center[arc]
        grown = turn_about(last, normal, -sweep) - first
        tip0[arc] = sweep[:, None] * np.cross(normal, first) + grown
        tip1[arc] = sweep[:, None] * np.cross(normal, last) + turn_about(grown, normal, sweep)
    angle = angle_between(curves.axis0, curves.axis1)
    bent = angle > _STRAIGHT
    factor = np.where(bent, angle / np.where(bent, np.sin(angle), 1.0), 1.0)[:, None]
    cosine = np.where(bent, np.cos(angle), 1.0)[:, None]
    axis0 = factor * (curves.axis1 - cosine * curves.axis0)
    axis1 = factor * (cosine * curves.axis1 - curves.axis0)
    return np.hstack((tip0, scale * axis0)), np.hstack((tip1, scale * axis1))


def lengths(curves: Curves, scale: float) -> Floats:
    """(N,) path of tip and axis together, mm: the root of squares of the tip's length and of scale times the angle."""
    return np.asarray(np.hypot(curves.length(), scale * angle_between(curves.axis0, curves.axis1)))


def turns(before: Floats, after: Floats) -> Floats:
    """Angle (N,) rad between directions (N, 6) of any length; pi/2 where one has none."""
    a, b = np.linalg.norm(before, axis=1, keepdims=True), np.linalg.norm(after, axis=1, keepdims=True)
    a, b = before / np.where(a > 0.0, a, 1.0), after / np.where(b > 0.0, b, 1.0)
    return np.asarray(2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)))
