"""Random joints of parallel-kinematic machines, for tests."""

from __future__ import annotations

import numpy as np

from machines.kinematics.legs.in_series import LegsInSeries
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from toolpaths.arrays import Floats


def random_slides(kinematics: LegsWithAxis | LegsInSeries | OnLegs, rng: np.random.Generator, n: int) -> Floats:
    """Slides (n, 3 or 4) of random places and tilts of the workspace; of a machine on legs all joints."""
    if isinstance(kinematics, OnLegs):
        return kinematics.inverse(*poses_over_workspace(kinematics, rng, n))[0]
    place, tilt = kinematics.workspace.random(rng, n)
    if isinstance(kinematics, LegsInSeries):
        return kinematics.legs_at_place(place)[0]
    return kinematics.platform.inverse(np.column_stack([place, tilt]))


def poses_over_workspace(kinematics: OnLegs, rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    """(tip, axis) (n, 3) of random places and tilts in random directions, spin 0."""
    place, tilt = kinematics.workspace.random(rng, n)
    heading = rng.uniform(0.0, 2.0 * np.pi, n)
    axis = np.stack([np.sin(tilt) * np.cos(heading), np.sin(tilt) * np.sin(heading), np.cos(tilt)], axis=1)
    axis = kinematics.nearest_axis(axis)
    turn = kinematics.turn_of(axis, np.zeros(n))
    return place + turn @ kinematics.gauge - kinematics.tool_length * axis, axis
