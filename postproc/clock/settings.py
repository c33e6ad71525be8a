"""How a control plans: limits of its joints, what it reads ahead, its rules at corners, its filters."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

STEEPEST = 0.02
"""s in which full acceleration is built up where no jerk is stated"""
BACKWARD = -0.94
"""cosine of the change of direction below which the axes rest: 160 degrees"""
PLANNED = 0.98
"""of the jerks is planned with: the rest is for what changes within a cycle"""


@dataclass(frozen=True)
@arrays(velocity="A", acceleration="A", jerk="A", corner_step="A", smoothing="A")
class ControlSettings:
    """How a control plans.

    Attributes:
        velocity, acceleration, jerk (A,): largest of each axis, mm or rad per s, s2, s3; jerk inf where none is stated
        buffer: blocks that are read ahead; block_time: s that each takes at least
        cycle: s of interpolation: the motion is sampled, and planned, at this
        bend_acceleration, bend_jerk: shares of the limits that bends may take; the rest is for changes of speed
        corner_step (A,): mm/s or rad/s by which the velocity of each axis may jump at a corner; None: corners are rounded
            off within the tolerance instead, as points on curves are in any case
        smoothing (A,): s over which a filter averages the set points of each axis; None: no filter
    """

    velocity: Floats
    acceleration: Floats
    jerk: Floats
    buffer: int = 200
    block_time: float = 0.0
    cycle: float = 0.002
    bend_acceleration: float = 0.75
    bend_jerk: float = 0.75
    corner_step: Floats | None = None
    smoothing: Floats | None = None

    @property
    def jerks(self) -> Floats:
        """(A,) jerks that are planned with."""
        return np.asarray(np.minimum(PLANNED * self.jerk, self.acceleration / STEEPEST))

    @property
    def delay(self) -> float:
        """s by which filters hold the axes back."""
        return 0.0 if self.smoothing is None else float(self.smoothing.max())
