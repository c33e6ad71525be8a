"""The angle of a tool about its own axis, measured from a reference that every kinematics shares."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.rotations import cross


def reference_x(axis: Floats) -> Floats:
    """x (N, 3) carried by the least rotation that takes z to the unit `axis` (N, 3).

    At axis = -z, where every half turn is least, the one about x is taken.
    """
    x, y, z = axis[:, 0], axis[:, 1], axis[:, 2]
    below = z < 0.0
    square = x * x + y * y
    # 1 / (1 + z) without cancellation near z = -1
    grow = np.where(below, (1.0 - z) / np.where(square > 0.0, square, 1.0),
                    1.0 / np.where(below, 1.0, 1.0 + z))
    return np.stack([1.0 - grow * x * x, -grow * x * y, -x], axis=1)


def tool_x(axis: Floats, spin: Floats) -> Floats:
    """The tool's own x direction (N, 3) at a spin (N,) about the unit `axis` (N, 3); undoes `spin_about`."""
    reference = reference_x(axis)
    return np.asarray(np.cos(spin)[:, None] * reference + np.sin(spin)[:, None] * cross(axis, reference))


def spin_about(axis: Floats, tool_x: Floats) -> Floats:
    """Angle (N,) rad about the unit `axis` (N, 3) from `reference_x(axis)` to `tool_x` (N, 3)."""
    reference = reference_x(axis)
    side = cross(axis, reference)
    result: Floats = np.arctan2(np.sum(side * tool_x, axis=1), np.sum(reference * tool_x, axis=1))
    return result
