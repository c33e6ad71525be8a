"""Angles about two axes that take one direction to another: a spherical triangle solved by half angles."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from machines.kinematics import columns
from machines.kinematics.columns import Columns
from toolpaths.arrays import Floats, read_only
from toolpaths.rotations import angle_between, wrap


def meet(first: Floats, second: Floats, tool: Floats, from_pole: Floats) -> tuple[Floats, Floats]:
    """Both angles (N,) about `second` that bring `tool` to the angle `from_pole` (N,) from `first`.

    Second subproblem of Paden (1986) and Kahan as a spherical triangle with the sides a1 = first-second, a2 =
    second- tool and phi = first-axis; its angle psi at `second` by the half-angle formula, which keeps its
    digits near the singular direction (phi = |a1 - a2|) and near the edge of reach (phi = a1 + a2):
    tan^2(psi/2) = sin((phi+d)/2) sin((phi-d)/2) / (sin((s+phi)/2) sin((s-phi)/2)), d = a1 - a2, s = a1 + a2.
    """
    (a1, a2, nearest), phi = _triangle(*(tuple(v.tolist()) for v in (first, second, tool))), from_pole
    over = np.sin((phi + a1 - a2) / 2.0) * np.sin((phi - a1 + a2) / 2.0)
    under = np.sin((a1 + a2 + phi) / 2.0) * np.sin((a1 + a2 - phi) / 2.0)
    psi = 2.0 * np.arctan2(np.sqrt(np.maximum(over, 0.0)), np.sqrt(np.maximum(under, 0.0)))
    return wrap(nearest + psi), wrap(nearest - psi)


@lru_cache(maxsize=256)
def _triangle(first: tuple[float, ...], second: tuple[float, ...],
              tool: tuple[float, ...]) -> tuple[float, float, float]:
    """The sides a1, a2, and by how much `first` stands about `second` from `tool`: the same for all poses of a machine."""
    one, two, three = np.array(first), np.array(second), np.array(tool)
    return angle(one, two), angle(two, three), float(azimuth(two, columns.of_one(one)) - azimuth(two, columns.of_one(three)))


def azimuth(pole: Floats, v: Columns) -> Floats:
    """Angle of v about the unit `pole` (3,), from a fixed direction across it."""
    e1, e2 = map(columns.of_one, basis(pole))
    result: Floats = np.arctan2(columns.dot(e2, v), columns.dot(e1, v))
    return result


def basis(pole: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (3,), read-only, that make a right-handed frame with the unit `pole` (3,) as third."""
    return _basis(tuple(pole.tolist()))


@lru_cache(maxsize=256)
def _basis(direction: tuple[float, ...]) -> tuple[Floats, Floats]:
    pole = np.array(direction)
    helper = np.eye(3)[(int(np.argmax(np.abs(pole))) + 1) % 3]
    e1 = perpendicular(pole, helper)
    e1 = e1 / np.linalg.norm(e1)
    return read_only(e1), read_only(np.cross(pole, e1))


def perpendicular(pole: Floats, v: Floats) -> Floats:
    """What v (3,) has across the unit `pole` (3,)."""
    result: Floats = v - (v @ pole) * pole
    return result


def angle(a: Floats, b: Floats) -> float:
    """Angle between two unit vectors (3,), rad."""
    return float(angle_between(a, b))
