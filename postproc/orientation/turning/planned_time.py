"""The planned time of a run and its slope by the joints at the sites: axis and feed are chosen together.

The plan of least time under velocity, acceleration, jerk and feed along fixed joints is a convex problem. Its multipliers z
say what every limit costs, so that the slope of its least time by anything that the limits g >= 0 depend on is dT/dp = - sum
of z dg/dp (envelope theorem: Bertsekas, Nonlinear Programming, 2016, section 4.3.2). With x = sigma_dot^2 and rows as in
`feedrate/problem.py`
    velocity      z (1 - x q'^2/V^2)                              gives  2 z x q'/V^2        by q'
    acceleration  z (1 -+ (q'' x + q' x'/2)/A)                    gives  z x/A by q'',       z x'/(2 A) by q'
    jerk          z (x^-1/2 -+ (q''' x + 3/2 q'' x' + 1/2 q' x'')/J)
                                                        z x/J by q''',  3/2 z x'/J by q'',  1/2 z x''/J by q'.
Derivatives by sigma are linear in the joints at the sites, and so the slope goes back through the transposed of that map.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from postproc.feedrate.feed import AllowedFeed
from postproc.feedrate.limits import JointLimits, squared_speed, steady_cap
from postproc.feedrate.mesh import Spacing
from postproc.feedrate.paths import Eased
from postproc.feedrate.plan import PlannerOptions, mesh_between
from postproc.feedrate.rows import UNBOUND
from postproc.feedrate.windows import Method
from postproc.orientation.candidates.ranking import StretchKnots
from postproc.orientation.turning.cutting_runs import TurningStretch
from postproc.planning.geometry import DEGREE, MachinePath
from toolpaths.arrays import Floats

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

COARSE = Spacing(dt=0.02, longest=1.0, hump=0.5)
"""knots of the search: the plan that is written has its own"""


class PlannedTime:
    """Of one stretch between stops."""

    def __init__(self, stretch: TurningStretch, limits: JointLimits) -> None:
        self.limits = replace(limits, forces=None, tool=None)
        feed = AllowedFeed(stretch.feed)
        path = MachinePath.through(stretch.s, np.hstack((stretch.q, stretch.tip, stretch.axis)),
                                   np.zeros(len(stretch.s), dtype=bool))
        eased = Eased.between(path, float(stretch.s[0]), float(stretch.s[-1]), PlannerOptions().ease)
        sigma = mesh_between(eased, self.limits, feed, COARSE)
        self._knots = StretchKnots(stretch.s, sigma, feed, True, Method().settled())
        self._sites, self._fitted = stretch.s, path.fitted.t

    @cached_property
    def _interpolation(self) -> SuperLU:
        """From coefficients of the spline to its values at the sites."""
        from scipy.interpolate import BSpline
        from scipy.sparse.linalg import splu

        return splu(BSpline.design_matrix(self._sites, self._fitted, DEGREE).tocsc())

    @cached_property
    def _transposed(self) -> SuperLU:
        """The same, transposed."""
        from scipy.interpolate import BSpline
        from scipy.sparse.linalg import splu

        return splu(BSpline.design_matrix(self._sites, self._fitted, DEGREE).T.tocsc())

    def seconds(self, q: Floats) -> tuple[float, Floats]:
        """Least time for joints (N, J) at the sites, and its slope by them (N, J)."""
        knots, most = self._knots, self.limits
        orders = (knots.slopes @ self._interpolation.solve(q)).reshape(3, len(knots.sigma), -1)
        dq, d2q, d3q = orders
        own = squared_speed(dq, most.velocity)
        cap = np.minimum(knots.cap, own)
        free = np.isinf(cap)
        cap[free] = UNBOUND * steady_cap(d2q[free], d3q[free], most)
        time, x, z = knots.solved(dq, d2q, d3q, cap, most)
        first, second, third = _slopes(orders, x, z.acceleration.T / most.acceleration, z.jerk.T / most.jerk)
        fast = np.abs(dq) / most.velocity
        worst = np.flatnonzero((own < knots.cap) & ~free), fast.argmax(axis=1)
        rows, joint = worst[0], worst[1][worst[0]]
        first[rows, joint] += 2.0 * z.velocity[rows] * x[0, rows] * dq[rows, joint] / most.velocity[joint] ** 2
        back = knots.slopes.T @ np.concatenate((first, second, third))
        return time, self._transposed.solve(np.ascontiguousarray(back))


def _slopes(orders: Floats, x: Floats, z_acceleration: Floats, z_jerk: Floats) -> tuple[Floats, Floats, Floats]:
    """Slopes (K, J) of the time by q', q'' and q''' from the multipliers over their limits (K, J)."""
    value, first, second = x[:, :, None]
    return (z_acceleration * 0.5 * first + z_jerk * 0.5 * second, z_acceleration * value + z_jerk * 1.5 * first,
            z_jerk * value)
