"""Times of one pass under many tool axes, on the knots of one plan: what all axes share is made once.

The joints of every axis are splines through the same sites, so that their derivatives at the knots are one
sparse matrix times the joints at the sites, and the solver starts from the motion of the axis before. A plan
of `timed` has knots of its own for each axis; what is chosen here is planned so in the end.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline
from scipy.sparse import csr_matrix, diags, identity, vstack

from postproc.feedrate.feed import AllowedFeed
from postproc.feedrate.interior import Multipliers
from postproc.feedrate.kernels.interior import pentadiagonal
from postproc.feedrate.limits import JointLimits, MotorLimits, squared_speed, steady_cap
from postproc.feedrate.paths import Eased
from postproc.feedrate.plan import PlannerOptions
from postproc.feedrate.problem import SpeedProblem
from postproc.feedrate.rows import UNBOUND
from postproc.feedrate.second_order import least_time, second_order
from postproc.feedrate.spline import rest_basis
from postproc.feedrate.windows import Method, solve_problem
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.planning.geometry import DEGREE, MachinePath
from toolpaths.arrays import Floats
from toolpaths.compiled import available, compiled

_MOVES = 1e-9
"""mm or rad: joints that move less along a stretch stand still"""
LONG = 50_000
"""knots of a pass from which each axis is planned in full, in windows"""


def load_compiler() -> None:
    """Load the compiler: all candidates are planned by compiled loops, so that a choice between two that are
    equally fast but for rounding does not hang on what else has been compiled."""
    if available():
        compiled(pentadiagonal)


class Ranking:
    """Of one pass. `first`, which must be runnable, is planned in full and lends its knots."""

    def __init__(self, first: Candidate) -> None:
        knots = sum(len(each) for each in first.knots)
        method = Method().settled()
        self._grids = [] if knots > LONG else [StretchKnots(stretch.s, each, AllowedFeed(stretch.feed), first.jerky, method)
                                               for stretch, each in zip(first.one.stretches, first.knots, strict=True)]

    def seconds(self, made: Candidate) -> float:
        """Least time of the cuts; inf where the machine cannot run them."""
        if made.refused or not self._grids:
            return made.seconds
        return made.drilling + float(sum(grid.seconds(q, made.limits) for grid, q in
                                         zip(self._grids, made.sites, strict=True)))


class StretchKnots:
    """Knots sigma (K,) of one stretch with sites s (N,)."""

    def __init__(self, s: Floats, sigma: Floats, feed: Callable[[Floats], Floats], jerky: bool,
                 method: Method) -> None:
        self.s, self.sigma, self.jerky, self.method = s, sigma, jerky, method
        path = MachinePath.through(s, np.zeros((len(s), 7)), np.zeros(len(s), dtype=bool))
        self.eased = Eased.between(path, float(s[0]), float(s[-1]), PlannerOptions().ease if jerky else 0.0)
        at = self.eased.parameter(sigma)
        self.slopes = _chained(path.fitted, self.eased.inside(at[0]), at)
        with np.errstate(divide="ignore"):
            self.cap = (feed(at[0]) / at[1]) ** 2
        h = np.diff(sigma)
        self.weight = 0.5 * (np.append(h, 0.0) + np.insert(h, 0, 0.0))
        self.near: Floats | None = None

    def seconds(self, q: Floats, limits: JointLimits) -> float:
        """Least time for joints (N, J) at the sites."""
        moving = np.ptp(q, axis=0) > _MOVES
        motors = limits.forces
        limits = JointLimits(limits.velocity[moving], limits.acceleration[moving], limits.jerk[moving])
        fitted = make_interp_spline(self.s, q[:, moving], k=DEGREE, check_finite=False).c
        dq, d2q, d3q = (self.slopes @ fitted).reshape(3, len(self.sigma), -1)
        cap = np.minimum(self.cap, squared_speed(dq, limits.velocity))
        middle = None
        if motors is not None:
            *forces, own = self._forces(q, motors, np.sqrt(cap))
            middle = np.column_stack((np.zeros_like(dq), own))
            free, one = np.full(q.shape[1], np.inf), np.ones(q.shape[1])
            limits = JointLimits(np.append(limits.velocity, free), np.append(limits.acceleration, one),
                                 np.append(limits.jerk, free))
            dq, d2q, d3q = (np.column_stack(pair) for pair in zip((dq, d2q, d3q), forces, strict=True))
        if not self.jerky:
            return least_time(self.sigma, second_order(self.sigma, dq, d2q, limits.acceleration, cap, self.method.kernel,
                                                       middle))
        free = np.isinf(cap)
        cap[free] = UNBOUND * steady_cap(d2q[free], d3q[free], limits)
        return self.solved(dq, d2q, d3q, cap, limits, middle)[0]

    def _forces(self, q: Floats, forces: MotorLimits, speed: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Rows (K, J) of the forces of joints (N, J) at the sites, at speeds up to (K,), and their middles."""
        fitted = make_interp_spline(self.s, q, k=DEGREE, check_finite=False)
        dq, d2q, _ = (self.slopes @ fitted.c).reshape(3, len(self.sigma), -1)
        first, second, middle = forces.rows(fitted(self.eased.inside(self.eased.parameter(self.sigma)[0])), dq, d2q, speed)
        return first, second, np.zeros_like(first), middle

    def solved(self, dq: Floats, d2q: Floats, d3q: Floats, cap: Floats, limits: JointLimits,
               middle: Floats | None = None) -> tuple[float, Floats, Multipliers]:
        """Least time, x and its two derivatives by sigma (3, K) at the knots, and the multipliers of all limits; arguments
        as of `SpeedProblem`, derivatives and `middle` (K, J). It starts from the motion of the call before."""
        basis = rest_basis(self.sigma, self.eased.ease)
        first, second, third = (np.ascontiguousarray(order.T) for order in (dq, d2q, d3q))
        problem = SpeedProblem(basis, first, second, third, limits, cap, np.zeros(len(cap), dtype=np.int64), self.weight,
                               np.ones((2, len(cap))), np.full(len(cap), -1),
                               middle=None if middle is None else np.ascontiguousarray(middle.T))
        found = solve_problem(problem, self.method.steps, self.near)
        self.near = found.c
        x = basis.values(found.c)
        return float(np.sum(self.weight * x[0] ** -0.5)), x, found.multipliers


def _chained(fitted: BSpline, s: Floats, at: Floats) -> csr_matrix:
    """(3K, N): from the coefficients of a spline to its first three derivatives by sigma at s (K,), by the
    chain rule; `at` (4, K) as of `Eased.parameter`."""
    first, second, third = (_slope(fitted.t, order, s) for order in (1, 2, 3))
    s1, s2, s3 = (diags(values) for values in at[1:])
    return csr_matrix(vstack([s1 @ first, s1 @ s1 @ second + s2 @ first,
                              s1 @ s1 @ s1 @ third + 3.0 * (s1 @ s2 @ second) + s3 @ first]))


def _slope(knots: Floats, order: int, s: Floats) -> csr_matrix:
    """(K, N): from coefficients to a derivative at s (K,): differences of coefficients (de Boor, A Practical
    Guide to Splines, 2001, chapter X, formula 15), then values of the basis of lower degree."""
    made = csr_matrix(identity(len(knots) - DEGREE - 1))
    for degree in range(DEGREE, DEGREE - order, -1):
        inner = knots[DEGREE - degree:len(knots) - (DEGREE - degree)]
        count = len(inner) - degree - 1
        rate = degree / (inner[degree + 1:degree + count] - inner[1:count])
        made = csr_matrix(diags(rate) @ (made[1:] - made[:-1]))
    return csr_matrix(BSpline.design_matrix(s, knots[order:len(knots) - order], DEGREE - order) @ made)
