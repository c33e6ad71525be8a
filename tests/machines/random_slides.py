"""Random joints of parallel-kinematic machines, for tests."""

from __future__ import annotations

import numpy as np

from machines.kinematics.h4_linear import H4Linear
from machines.kinematics.linear_delta import LinearDelta
from toolpaths.arrays import Floats


def random_slides(kinematics: H4Linear | LinearDelta, rng: np.random.Generator, n: int) -> Floats:
    """Slides (n, 3 or 4) of random places and tilts of the workspace."""
    place, tilt = kinematics.workspace.random(rng, n)
    if isinstance(kinematics, LinearDelta):
        return kinematics.legs.inverse(place[:, None, :] + kinematics.platform)
    return kinematics.platform.inverse(np.column_stack([place, tilt]))
