"""The jerk-limited problem on its knots: rows of limits, objective, a start that respects them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from postproc.feedrate.limits import JointLimits
from postproc.feedrate.paths import Eased
from postproc.feedrate.rows import rows
from postproc.feedrate.spline import Basis, rest_basis
from toolpaths.arrays import Floats, Ints
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(dq="J K", d2q="J K", d3q="J K", cap="K", capped="K", weight="K", tight="2 K")
class SpeedProblem:
    """Minimise sum w x^-1/2 over coefficients of x, K knots, J joints.

    rows `dq`, `d2q`, `d3q` (J, K) by sigma; `cap` (K,) bound on x and the row it comes from, `capped` (K,);
    `weight` (K,); `tight` (2, K) factors >= 1 on the acceleration and jerk rows. Per knot and joint
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
    capped: Ints
    weight: Floats
    tight: Floats

    @property
    def rows(self) -> int:
        """Number of limits, positive coefficients included."""
        return self.basis.knots * (4 * len(self.dq) + 2) + 2

    def acceleration_rows(self) -> Floats:
        """(2, J, K): factors of x and x'."""
        scale = self.tight[0] / self.limits.acceleration[:, None]
        return np.stack((self.d2q * scale, 0.5 * self.dq * scale))

    def jerk_rows(self) -> Floats:
        """(3, J, K): factors of x, x' and x''."""
        scale = self.tight[1] / self.limits.jerk[:, None]
        return np.stack((self.d3q * scale, 1.5 * self.d2q * scale, 0.5 * self.dq * scale))

    def start(self) -> Floats:
        """Equal coefficients (K + 2,), 0.9 of the largest that keep every limit."""
        return self.slowed(np.ones(self.basis.knots + 2), 0.9)

    def slowed(self, c: Floats, share: float = 0.98) -> Floats:
        """Coefficients c (K + 2,), times `share` of the largest factor that keeps every limit."""
        with np.errstate(divide="ignore"):
            most = np.max(self.ratios(c) * np.stack((np.ones_like(self.cap), *self.tight)), axis=1)
            velocity, acceleration, jerk = (1.0 / most).tolist()
        factor = share * min(velocity**2, acceleration, jerk ** (2.0 / 3.0))
        if not (0.0 < factor < np.inf):
            raise ArithmeticError("no slow motion respects the limits: the derivatives of the path are not finite")
        return np.asarray(factor * c)

    def ratios(self, c: Floats) -> Floats:
        """Velocity, acceleration and jerk over their limits at the knots, the worst joint, tightening left out, (3, K)."""
        x = self.basis.values(c)
        acceleration = np.abs(np.einsum("ijk,ik->jk", self.acceleration_rows(), x[:2])).max(axis=0) / self.tight[0]
        jerk = np.abs(np.einsum("ijk,ik->jk", self.jerk_rows(), x)).max(axis=0) / self.tight[1]
        return np.array([np.sqrt(x[0] / self.cap), acceleration, jerk * np.sqrt(x[0])])


@dataclass(frozen=True)
@arrays(sigma="K", tight="3 K")
class MotionKnots:
    """One motion from rest to rest on its knots; problems are made for stretches of it, so that memory stays small.

    `eased` path, `sigma` (K,) knots, `limits`; `feed` gives the largest ds/dt at s; `tight` (3, K) factors >=
    1 on the velocity, acceleration and jerk limits, None for ones.
    """

    eased: Eased
    sigma: Floats
    limits: JointLimits
    feed: Callable[[Floats], Floats]
    tight: npt.NDArray[np.float32] | None = None

    def speed_limit(self, sigma: Floats) -> Floats:
        """Largest sigma_dot (N,) that the feed allows."""
        return self.eased.speed_limit(sigma, self.feed)

    def problem(self, first: int = 0, last: int | None = None) -> SpeedProblem:
        """On knots [first, last), free at ends inside the motion."""
        last = len(self.sigma) if last is None else last
        sigma = self.sigma[first:last]
        at = rows(self.eased, sigma, self.limits, self.feed)
        tight = np.ones((3, len(sigma))) if self.tight is None else self.tight[:, first:last].astype(np.float64)
        h = np.diff(sigma)
        weight = 0.5 * (np.append(h, 0.0) + np.insert(h, 0, 0.0))
        dq, d2q, d3q = (np.ascontiguousarray(order.T) for order in at[:3])
        basis = rest_basis(self.sigma, self.eased.ease, first, last)
        return SpeedProblem(basis, dq, d2q, d3q, at.limits, at.cap / tight[0] ** 2, at.capped,
                            weight, tight[1:])
