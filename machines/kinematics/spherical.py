"""Angles about two axes that take one direction to another: a spherical triangle solved by half angles."""

from __future__ import annotations

import numpy as np

from machines.kinematics import columns
from machines.kinematics.columns import Columns
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between, wrap


def meet(first: Floats, second: Floats, tool: Floats, from_pole: Floats) -> tuple[Floats, Floats]:
    """Both angles (N,) about `second` that bring `tool` to the angle `from_pole` (N,) from `first`.

    Second subproblem of Paden (1986) and Kahan as a spherical triangle with the sides a1 = first-second, a2 = second-
    tool and phi = first-axis; its angle psi at `second` by the half-angle formula, which keeps its digits near the
    singular direction (phi = |a1 - a2|) and near the edge of reach (phi = a1 + a2):
    tan^2(psi/2) = sin((phi+d)/2) sin((phi-d)/2) / (sin((s+phi)/2) sin((s-phi)/2)), d = a1 - a2, s = a1 + a2.
    """
    a1, a2, phi = angle(first, second), angle(second, tool), from_pole
    over = np.sin((phi + a1 - a2) / 2.0) * np.sin((phi - a1 + a2) / 2.0)
    under = np.sin((a1 + a2 + phi) / 2.0) * np.sin((a1 + a2 - phi) / 2.0)
    psi = 2.0 * np.arctan2(np.sqrt(np.maximum(over, 0.0)), np.sqrt(np.maximum(under, 0.0)))
    nearest = float(azimuth(second, columns.of_one(first)) - azimuth(second, columns.of_one(tool)))
    return wrap(nearest + psi), wrap(nearest - psi)


def azimuth(pole: Floats, v: Columns) -> Floats:
    """Angle of v about the unit `pole` (3,), from a fixed direction across it."""
    e1, e2 = map(columns.of_one, basis(pole))
    result: Floats = np.arctan2(columns.dot(e2, v), columns.dot(e1, v))
    return result


def basis(pole: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (3,) that make a right-handed frame with the unit `pole` (3,) as third."""
    helper = np.eye(3)[(int(np.argmax(np.abs(pole))) + 1) % 3]
    e1 = perpendicular(pole, helper)
    e1 = e1 / np.linalg.norm(e1)
    return e1, np.cross(pole, e1)


def perpendicular(pole: Floats, v: Floats) -> Floats:
    """What v (3,) has across the unit `pole` (3,)."""
    result: Floats = v - (v @ pole) * pole
    return result


def angle(a: Floats, b: Floats) -> float:
    """Angle between two unit vectors (3,), rad."""
    return float(angle_between(a, b))
