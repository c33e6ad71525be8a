"""Whether blocks at their planned constant feeds keep the limits of the axes: by samples of the joints' derivatives.

`steady_feed` finds the feeds from the hulls of B-spline coefficients; here the derivatives are evaluated at places of each
block, and compared with the limits as the machine file states them.
"""

from __future__ import annotations

import numpy as np

from machines.machine import Limits
from postproc.planning.pass_geometry import PassGeometry
from toolpaths.arrays import Floats

PLACES = (0.0, 0.5, 1.0)
"""of each block"""


def worst_ratio(one: PassGeometry, seconds: Floats, limits: Limits) -> Floats:
    """(k,) largest part of a velocity, acceleration or jerk limit that each block of a pass takes.

    Args:
        seconds: (k,) s of each block; 0 where no limit binds: such blocks are not looked at
        limits: of the axes; without jerk velocities and accelerations alone
    """
    worst = np.zeros(len(one.block))
    travel = one.ends - one.begin
    look = np.flatnonzero((seconds > 0.0) & (travel > 0.0))
    rate, path = travel[look] / seconds[look], np.searchsorted([p.end for p in one.paths], one.ends[look])
    for k, made in enumerate(one.paths):
        here = np.flatnonzero(path == k)
        for order, limit in enumerate((limits.velocity, limits.acceleration, limits.jerk), 1):
            slope = made.fitted.derivative(order)
            for place in PLACES:
                s = np.clip(one.begin[look[here]] + place * travel[look[here]], made.start, made.end)
                part = (np.abs(slope(s)) * rate[here, None]**order / limit).max(axis=1, initial=0.0)
                worst[look[here]] = np.maximum(worst[look[here]], part)
    return worst
