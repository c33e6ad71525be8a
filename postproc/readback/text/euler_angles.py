"""Rotations as controls name them: angles about axes one after the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.units import DEG

UNIT = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


def about(letter: str, degrees: float) -> Floats:
    """(3, 3) right-hand turn about an axis (Rodrigues: cos I + sin [u] + (1 - cos) u u^T)."""
    u = np.array(UNIT[letter])
    c, s = np.cos(degrees * DEG), np.sin(degrees * DEG)
    cross = np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
    result: Floats = c * np.eye(3) + s * cross + (1.0 - c) * np.outer(u, u)
    return result


def turned(axes: str, degrees: Sequence[float], fixed: bool = False) -> Floats:
    """(3, 3) of turns in the order of `axes`, each about the axis as turned so far, or about `fixed` axes."""
    result = np.eye(3)
    for letter, angle in zip(axes, degrees, strict=True):
        result = about(letter, angle) @ result if fixed else result @ about(letter, angle)
    return result
