"""The jerk-limited problem on its knots: rows of limits, objective, a start that respects them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from postproc.feedrate.limits import JointLimits, steady_cap
from postproc.feedrate.paths import Eased
from postproc.feedrate.rows import LimitRows, rows
from postproc.feedrate.spline import Basis, rest_basis
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

SHORT = 0.01
"""s: accelerations that full jerk reaches in less may overshoot between knots, which see them at their ends alone"""
CHANGE = 0.12
"""of an acceleration limit, by which such accelerations change within an interval at the largest speed"""


@dataclass(frozen=True)
@arrays(dq="J K", d2q="J K", d3q="J K", cap="K", capped="K", weight="K", tight="2 K", shortest="K", middle="J K")
class SpeedProblem:
    """Minimise sum w x^-1/2 over coefficients of x, K knots, J joints.

    rows `dq`, `d2q`, `d3q` (J, K) by sigma; `cap` (K,) bound on x and the row it comes from, `capped` (K,);
    `weight` (K,); `tight` (2, K) factors >= 1 on the acceleration and jerk rows; `shortest` (K,) the row whose
    acceleration the last row holds smooth (see `_smooth`), -1 without such a row. Per knot and joint
        velocity      1 - x/cap >= 0
        acceleration  1 -+ ((q'' x + q' x'/2)/A + o) >= 0, o its `middle` (J, K), None: 0
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
    shortest: Ints
    forces: tuple[int, int] = (0, 0)
    """first row of forces, and how many there are, one a joint"""
    middle: Floats | None = None

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
        used, jerk = self.used(x)
        acceleration, jerk = self._taken(used).max(axis=0), np.abs(jerk).max(axis=0)
        return np.array([np.sqrt(x[0] / self.cap), acceleration, jerk * np.sqrt(x[0])])

    def used(self, x: Floats, here: slice = slice(None)) -> tuple[Floats, Floats]:
        """Of the limits, tightening left out: acceleration, and jerk over x^1/2, each (J, N), at knots `here`; x (3, N)."""
        dq, d2q, d3q = self.dq[:, here], self.d2q[:, here], self.d3q[:, here]
        half = 0.5 * dq
        return ((d2q * x[0] + half * x[1]) / self.limits.acceleration[:, None],
                (d3q * x[0] + 1.5 * d2q * x[1] + half * x[2]) / self.limits.jerk[:, None])

    def _taken(self, used: Floats) -> Floats:
        """(J, K) of what rows (J, K) may use on the side on which they do."""
        if self.middle is None:
            return np.abs(used)
        return np.maximum(used / (1.0 - self.middle), -used / (1.0 + self.middle))


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
        count = 0 if self.limits.forces is None else len(self.limits.velocity)
        forces = at.dq.shape[1] - count, count
        at, shortest = _smooth(at, self.sigma[first:last], self._widest(first, last))
        dq, d2q, d3q = (np.ascontiguousarray(order.T) for order in at[:3])
        middle = None if at.middle is None else np.ascontiguousarray(at.middle.T)
        basis = rest_basis(self.sigma, self.eased.ease, first, last)
        return SpeedProblem(basis, dq, d2q, d3q, at.limits, at.cap / tight[0] ** 2, at.capped,
                            weight, tight[1:], shortest, forces, middle)

    def _widest(self, first: int, last: int) -> Floats:
        """The longer of the intervals before and behind each knot of [first, last)."""
        low = max(first - 1, 0)
        h = np.diff(self.sigma[low:last + 1])
        both = np.maximum(np.insert(h, 0, 0.0), np.append(h, 0.0))
        return np.asarray(both[first - low:first - low + last - first])


def _smooth(at: LimitRows, sigma: Floats, widest: Floats) -> tuple[LimitRows, Ints]:
    """The rows and one more, where an acceleration limit is reached in less than SHORT; the row (K,) it stands for, or -1.

    Rows see the acceleration at knots. Where jerk allows the whole of it within an interval h, x'' alternates from
    knot to knot at next to no cost in time, and the acceleration between knots is many times its limit: it overshoots
    by h |q' x''|/8. The row |q' x''| h/2 <= CHANGE A sqrt(y/x), y the largest x there, leaves a quarter of CHANGE;
    finer knots widen it, so that the time goes to that of the limits alone.
    """
    count = at.dq.shape[1]
    limits = at.limits
    reached = np.array(limits.acceleration)
    if limits.forces is not None:
        own = limits.forces.acceleration
        reached[-len(own):] = np.where(own < SHORT * limits.jerk[:len(own)], own, np.inf)
    short = np.flatnonzero(np.isfinite(reached) & (reached < SHORT * limits.jerk))
    if not len(short):
        return at, np.full(len(sigma), -1)
    steep = np.abs(at.dq[:, short]) / limits.acceleration[short]
    row = steep.max(axis=1) * widest / (CHANGE * np.sqrt(_reached(at, sigma)))
    zero = np.zeros((len(sigma), 1))
    wide = JointLimits(np.append(limits.velocity, np.inf), np.append(limits.acceleration, np.inf),
                       np.append(limits.jerk, 1.0), limits.tool, limits.forces)
    capped = np.where(at.capped == count, count + 1, at.capped)
    middle = None if at.middle is None else np.column_stack((at.middle, zero))
    return LimitRows(np.column_stack((at.dq, row)), np.column_stack((at.d2q, zero)), np.column_stack((at.d3q, zero)),
                     wide, at.cap, capped, middle), short[steep.argmax(axis=1)]


def _reached(at: LimitRows, sigma: Floats) -> Floats:
    """About the largest x (K,) that the accelerations let the motion reach under the caps: |q''| x <= A, x' by what is left
    or added, |x'| <= 2 (A + |q''| x)/|q'|."""
    top = np.minimum(at.cap, steady_cap(at.d2q, at.d3q, at.limits))
    with np.errstate(divide="ignore"):
        slope = (2.0 * (at.limits.acceleration + np.abs(at.d2q) * top[:, None]) / np.abs(at.dq)).min(axis=1)
    rise = np.diff(sigma) * np.minimum(np.maximum(slope[1:], slope[:-1]), top.max() / np.diff(sigma))
    gained = np.insert(np.cumsum(rise), 0, 0.0)
    forth = gained + np.minimum.accumulate(top - gained)
    return np.asarray(np.minimum(forth, np.minimum.accumulate((top + gained)[::-1])[::-1] - gained))
