"""The box that a machine reaches with its tool level: inside every axis's travel and, where given, all clearances."""

from __future__ import annotations

import numpy as np

from machines.machine import Machine
from machines.reach import is_checked, reach
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass

POINTS = 9
"""grid points per direction of a box that is tried"""
STEPS = 30
"""bisections"""
FARTHEST = 10_000.0
"""mm: half a box never grows beyond this"""


@dataclass(frozen=True)
class Box:
    """Axis-parallel box in the table frame, mm."""

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]


def reachable_box(machine: Machine, middle: Floats, shape: Floats, axis: Floats | None = None) -> Box | None:
    """The largest box of the proportions `shape` (3,) about `middle` (3,) whose grid points are all in reach.

    Args:
        axis: tool direction (3,), +z without it

    Returns:
        None where not even `middle` is in reach.
    """
    tool = np.array([0.0, 0.0, 1.0]) if axis is None else axis
    if not _fits(machine, middle, 0.0 * shape, tool):
        return None
    half = 0.5 * shape / float(np.max(shape))
    low, high = 0.0, FARTHEST
    for _ in range(STEPS):
        size = 0.5 * (low + high)
        low, high = (size, high) if _fits(machine, middle, size * half, tool) else (low, size)
    return Box(_tuple(middle - low * half), _tuple(middle + low * half))


def reached(machine: Machine, tip: Floats, axis: Floats) -> Bools:
    """True (N,) where some branch is inside travel and, for a parallel machine, clears itself."""
    limits = machine.limits
    result = np.zeros(len(tip), dtype=np.bool_)
    for q in machine.kinematics.inverse(tip, axis):
        ok = np.all((q >= limits.lower) & (q <= limits.upper), axis=1)
        if is_checked(machine.kinematics) and ok.any():
            ok[ok] = _clear(machine, q[ok])
        result |= ok
    return result


def _clear(machine: Machine, q: Floats) -> Bools:
    margins = reach(machine.kinematics, q)
    result: Bools = np.all(margins.values[:, ~margins.of_box] >= 0.0, axis=1)
    return result


def _fits(machine: Machine, middle: Floats, half: Floats, axis: Floats) -> bool:
    """Whether all grid points are in reach; the corners first: of most boxes that are too large one of them is not."""
    for count in (2, POINTS):
        sides = [np.linspace(m - h, m + h, count) for m, h in zip(middle, half, strict=True)]
        tip = np.stack([side.ravel() for side in np.meshgrid(*sides)], axis=1)
        if not reached(machine, tip, np.tile(axis, (len(tip), 1))).all():
            return False
    return True


def _tuple(v: Floats) -> tuple[float, float, float]:
    return float(v[0]), float(v[1]), float(v[2])
