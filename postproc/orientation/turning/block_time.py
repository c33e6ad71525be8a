"""The time of a run on controls that slow down at every block, and its slope by the joints at the poses.

Such a control goes each block along a straight line in the joints, from nearly rest to nearly rest (LinuxCNC 2.9 with rotary
axes: `cycle_time/linuxcnc.py`). Its time is that of the joint that needs longest, 2 sqrt(d/a) or, where it reaches its
velocity, d/v + v/a, or that of the feed. A mean of high power stands for the longest: it has slopes everywhere.
"""

from __future__ import annotations

import numpy as np

from postproc.feedrate.limits import JointLimits
from toolpaths.arrays import Floats

POWER = 8.0
"""of the mean that stands for the longest of some times"""
STILL = 1e-5
"""mm or rad below which the time of a joint counts as that of this distance"""


def block_time(q: Floats, limits: JointLimits, fed: Floats) -> tuple[float, Floats]:
    """Seconds of the blocks between joints (N, J), `fed` (N - 1,) s at the programmed feed, and the slope by the joints."""
    travel = np.diff(q, axis=0)
    distance = np.sqrt(travel**2 + STILL**2)
    v, a = limits.velocity, limits.acceleration
    short = distance < v**2 / a
    seconds = np.where(short, 2.0 * np.sqrt(distance / a), distance / v + v / a)
    rate = np.where(short, 1.0 / np.sqrt(distance * a), 1.0 / v) * travel / distance
    every = np.column_stack((seconds, fed))
    longest = np.maximum(every.max(axis=1), 1e-12)
    mean = longest * ((every / longest[:, None]) ** POWER).sum(axis=1) ** (1.0 / POWER)
    own = (seconds / mean[:, None]) ** (POWER - 1.0) * rate
    slope = np.zeros_like(q)
    slope[1:] += own
    slope[:-1] -= own
    return float(mean.sum()), slope
