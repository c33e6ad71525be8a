"""Proof that a slice of a Delta's workspace holds no singular point, from the smallest singular value on a grid.

For slides along z. The smallest singular values of Jx and Jq change by at most sqrt(3) (2A + 1) |dx| between
two points of a horizontal slice (III-23 to III-42; III-29 with |sqrt(1+u) - 1| <= |u|, for the printed bound
fails for u < 0).
"""

from __future__ import annotations

import math

import numpy as np

from machines.kinematics.base import Kinematics
from machines.kinematics.rod_platform import RodPlatform
from machines.kinematics.sliders import smallest_singular_value
from toolpaths.arrays import Ints

FINEST = 1.0
"""mm: smallest step tried"""


def growth(spread: float, length: float, alpha: float) -> float:
    """A of III-37: slide travel per platform travel (1-norm) for steps up to `alpha` mm.

    Args:
        spread: R - r + rho, mm: largest horizontal distance of a platform joint from its slide
        length: of the rods, mm
    """
    return (2.0 * spread + alpha) / math.sqrt(length**2 - spread**2)


def safe_radius(spread: float, length: float, alpha: float) -> float:
    """mm that may be moved per mm of smallest singular value, 1 / (sqrt(3) (2A + 1)), III-42."""
    return 1.0 / (math.sqrt(3.0) * (2.0 * growth(spread, length, alpha) + 1.0))


def grid_step_that_proves(kinematics: RodPlatform, floor: float, alpha: float = 100.0) -> float | None:
    """Step (mm) of a square grid over the workspace that proves singular values above `floor` (mm), None without one.

    III.7.3: around a grid point whose value is s the values stay above `floor` within safe_radius x (s - floor). The
    step is halved until half of its diagonal is inside that at every point; half a step also stays below `alpha`.
    """
    legs, space = kinematics.legs, kinematics.workspace
    feet = (legs.points - kinematics.platform_joints)[:, :2]
    corners = np.stack(np.meshgrid(*zip(space.lower[:2], space.upper[:2], strict=True)), axis=-1).reshape(-1, 2)
    spread = float(np.linalg.norm(corners[:, None] - feet, axis=2).max())
    factor = safe_radius(spread, float(legs.lengths.min()), alpha)
    step = alpha
    while step >= FINEST:
        if 0.5 * math.sqrt(2.0) * step < factor * (_least(kinematics, step) - floor):
            return step
        step *= 0.5
    return None


def lipschitz_points(kinematics: Kinematics, margin: float) -> int | None:
    """Points that III.7.3 needs for a slice of a Delta with slides along z; None of any other machine, or without a proof.

    Args:
        margin: of the singular values, as a part of the rods' length
    """
    rods = kinematics.on_rods
    if rods is None or rods.platform_turns or not np.allclose(np.abs(rods.legs.directions[:, 2]), 1.0):
        return None
    step = grid_step_that_proves(rods, margin * float(rods.legs.lengths.max()))
    return None if step is None else int(np.prod(_counts(rods, step)))


def _counts(kinematics: RodPlatform, step: float) -> Ints:
    """(2,) points of a square grid over the workspace."""
    space = kinematics.workspace
    return np.asarray(np.ceil((space.upper - space.lower)[:2] / step).astype(np.int64) + 1)


def _least(kinematics: RodPlatform, step: float) -> float:
    """Smallest singular value of Jx and Jq (mm) over the grid of a slice."""
    space, legs = kinematics.workspace, kinematics.legs
    counts = _counts(kinematics, step)
    sides = [np.linspace(lo, hi, n) for lo, hi, n in zip(space.lower[:2], space.upper[:2], counts, strict=True)]
    x, y = (m.ravel() for m in np.meshgrid(*sides))
    ends = np.column_stack([x, y, np.full(len(x), space.middle[2])])[:, None, :] + kinematics.platform_joints
    rods = ends - legs.carriages(legs.inverse(ends))
    return float(min(smallest_singular_value(rods).min(), np.abs(legs.along(rods)).min()))
