"""Which limit costs how much time: the plan's multipliers as seconds that add up to its time.

Time is homogeneous in the limits: velocities and feed times k, accelerations times k^2, jerks times k^3 give 1/k of the
time. By Euler's theorem T = sum over limits of n (-dT/dln L), n = 1, 2, 3 for velocity, acceleration, jerk,
and -dT/dln L is the multiplier z of a row times what it uses of its limit.
"""

from __future__ import annotations

import numpy as np

from postproc.feedrate.interior import Multipliers
from postproc.feedrate.problem import SpeedProblem
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(limits="3 _")
class LimitShares:
    """Seconds of each limit: `feed`, and `limits` (3, J + 1) for velocity, acceleration, jerk of the joints.

    The last column is the tool: rate of its axis, acceleration and jerk of the tip.
    """

    feed: float
    limits: Floats

    @property
    def seconds(self) -> float:
        """Sum of all."""
        return self.feed + float(self.limits.sum())

    def lost(self, alone: float) -> LimitShares:
        """The time lost against a motion that takes `alone` at the feed: over the limits in the proportion of their shares.

        `feed` is then `alone`, and the sum stays.
        """
        spent, lost = float(self.limits.sum()), self.seconds - alone
        return LimitShares(alone, self.limits * (lost / spent)) if spent > 0.0 else self

    def scaled(self, seconds: float) -> LimitShares:
        """With this sum."""
        factor = seconds / self.seconds
        return LimitShares(self.feed * factor, self.limits * factor)

    def __add__(self, other: LimitShares) -> LimitShares:
        return LimitShares(self.feed + other.feed, self.limits + other.limits)


def weigh(problem: SpeedProblem, c: Floats, z: Multipliers, first: int, last: int) -> Floats:
    """Seconds (3, R + 1) of each row of knots [first, last); the last column is the feed's.

    The row that holds an acceleration smooth counts as that acceleration, the force of a joint as its acceleration.
    """
    x = problem.basis.values(c)[:, first:last]
    here = slice(first, last)
    count = len(problem.dq) + 1
    velocity = 2.0 * z.velocity[here] * x[0] / problem.cap[here]
    found = np.zeros((3, count))
    found[0] = np.bincount(problem.capped[here], velocity, minlength=count)
    for order, used, multipliers in zip((1, 2), problem.used(x, here), (z.acceleration, z.jerk), strict=True):
        cost = (order + 1) * multipliers[:, here] * problem.tight[order - 1, here] * used
        found[order, :-1] = cost.sum(axis=1)
    smooth = problem.shortest[here]
    if (smooth >= 0).any():
        found[1] += np.bincount(smooth, cost[-1], minlength=count)
        found[2, -2] = 0.0
    start, joints = problem.forces
    own = found[1, start:start + joints].copy()
    found[1, start:start + joints] = 0.0
    found[1, :joints] += own
    return found


def shares(weights: Floats, joints: int, seconds: float) -> LimitShares:
    """From sums of `weigh`, the tool's rows together; the last bit, the gap of the solver, in proportion."""
    positive = np.maximum(weights, 0.0)
    tool = positive[:, joints:-1].sum(axis=1, keepdims=True)
    return LimitShares(float(positive[0, -1]), np.concatenate((positive[:, :joints], tool), axis=1)).scaled(seconds)
