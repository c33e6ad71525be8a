"""The jerk-limited problem on its knots: rows of limits, objective, a start that respects them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from postproc.feedrate.limits import JointLimits, squared_speed, steady_cap
from postproc.feedrate.paths import Derivatives
from postproc.feedrate.spline import Basis
from toolpaths.arrays import Floats

UNBOUND = 1e4
"""Where no velocity bounds x, this many times the steady cap does, so that numbers stay comparable."""


@dataclass(frozen=True)
class Problem:
    """Minimise sum w x^-1/2 over coefficients of x, K knots, J joints.

    rows `dq`, `d2q`, `d3q` (J, K) by sigma; `cap` (K,) bound on x; `weight` (K,); `tight` (2, K) factors >= 1 on the
    acceleration and jerk rows. Per knot and joint
        velocity      1 - x/cap >= 0
        acceleration  1 -+ (q'' x + q' x'/2)/A >= 0
        jerk          x^-1/2 -+ (q''' x + 3/2 q'' x' + 1/2 q' x'')/J >= 0
    """

    basis: Basis
    dq: Floats
    d2q: Floats
    d3q: Floats
    limits: JointLimits
    cap: Floats
    steady: Floats
    weight: Floats
    tight: Floats

    @property
    def rows(self) -> int:
        """Number of limits, positive coefficients included."""
        joints, knots = self.dq.shape
        return knots * (4 * joints + 1) + knots + 2

    def part(self, first: int, last: int) -> Problem:
        """The problem on knots [first, last), free at ends inside."""
        here = slice(first, last)
        cut = {name: np.ascontiguousarray(getattr(self, name)[..., here])
               for name in ("dq", "d2q", "d3q", "cap", "steady", "weight", "tight")}
        return replace(self, basis=self.basis.part(first, last), **cut)

    def acceleration_rows(self) -> Floats:
        """(2, J, K): factors of x and x'."""
        scale = self.tight[0] / self.limits.acceleration[:, None]
        return np.stack((self.d2q * scale, 0.5 * self.dq * scale))

    def jerk_rows(self) -> Floats:
        """(3, J, K): factors of x, x' and x''."""
        scale = self.tight[1] / self.limits.jerk[:, None]
        return np.stack((self.d3q * scale, 1.5 * self.d2q * scale, 0.5 * self.dq * scale))

    def start(self) -> Floats:
        """Coefficients (K + 2,), equal, that keep every limit strictly; halved until the ends at rest do, too."""
        low = 0.9 * float(np.min(np.minimum(self.cap, self.steady) / self.tight.max(axis=0)))
        acceleration, jerk = self.acceleration_rows(), self.jerk_rows()
        for _ in range(200):
            c = np.full(self.basis.knots + 2, low)
            x = self.basis.values(c)
            if (np.all(x[0] > 0.0) and np.all(x[0] < self.cap)
                    and np.all(np.abs(np.einsum("ijk,ik->jk", acceleration, x[:2])) < 1.0)
                    and np.all(np.abs(np.einsum("ijk,ik->jk", jerk, x)) < x[0] ** -0.5)):
                return c
            low *= 0.5
        raise ArithmeticError("no slow motion respects the limits: the derivatives of the path are not finite")


def build(basis: Basis, sigma: Floats, at: Derivatives, limits: JointLimits, feed: Floats) -> Problem:
    """The problem at knots sigma (K,); `feed` (K,) is the largest sigma_dot that the program allows, inf if none."""
    steady = steady_cap(at.d2q, at.d3q, limits)
    cap = np.minimum(squared_speed(at.dq, limits.velocity), feed**2)
    cap = np.where(np.isinf(cap), UNBOUND * steady, cap)
    if not np.all(np.isfinite(cap)):
        raise ValueError("the path stands still somewhere between its ends: no limit bounds the speed there")
    steady = np.minimum(steady, cap)
    h = np.diff(sigma)
    weight = 0.5 * (np.append(h, 0.0) + np.insert(h, 0, 0.0))
    rows = [np.ascontiguousarray(order.T) for order in at[1:]]
    return Problem(basis, *rows, limits, cap, steady, weight, np.ones((2, len(sigma))))
