"""Paths q(sigma) with exact derivatives, and the change of parameter that lets a motion start and end at rest.

Near rest under bounded jerk x = s_dot^2 grows as s^(4/3), which no polynomial in s follows. With the
parameter sigma, where s = d (2 u^3 - 2 u^4 + 0.6 u^5), u = sigma/d on the first and last d (three times
differentiable joint with s = sigma - 0.4 d), sigma_dot is finite at rest, and rest needs no condition of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from postproc.feedrate.kernels.splines import spline
from toolpaths.arrays import Floats
from toolpaths.compiled import available, compiled
from toolpaths.dataclass import dataclass

KERNEL_FROM = 64
"""Places at once from which a spline is evaluated by the compiled loop: twice as quick as scipy."""
ROOM = 0.8
"""Largest share of a path's length that the change of parameter may take as d; 0.6 d at each end must fit."""


class Derivatives(NamedTuple):
    """Joints and their derivatives by the path parameter, each (N, J)."""

    q: Floats
    dq: Floats
    d2q: Floats
    d3q: Floats


class ParametricPath(Protocol):
    """What the planner asks of a path: three times continuously differentiable between `breaks`."""

    @property
    def start(self) -> float: ...

    @property
    def end(self) -> float: ...

    @property
    def breaks(self) -> Floats:
        """Parameters where higher derivatives jump, for instance spline knots; may be empty."""
        ...

    def derivatives(self, s: Floats) -> Derivatives:
        """At s (N,), any order."""
        ...


class ParametricToolPath(ParametricPath, Protocol):
    """A path that also knows the tool, as limits at the tool need it."""

    def tip(self, s: Floats) -> Derivatives:
        """Tip in the part frame at s (N,): each (N, 3)."""
        ...

    def axis(self, s: Floats) -> Derivatives:
        """Tool axis in the part frame, likewise; the first derivative suffices."""
        ...


class SplinePath:
    """Joint-space B-spline of degree 4 or more (5 is usual); parameter in the units of its knots."""

    def __init__(self, knots: Floats, coefficients: Floats, degree: int = 5) -> None:
        if degree < 4:
            raise ValueError(f"degree {degree}: the third derivative must be continuous, which takes degree 4 or more")
        from scipy.interpolate import BSpline

        self._orders = [BSpline(np.ascontiguousarray(knots, dtype=np.float64), np.asarray(coefficients, np.float64), degree)]
        for _ in range(3):
            self._orders.append(self._orders[-1].derivative())
        self._coefficients = [np.ascontiguousarray(order.c) for order in self._orders]
        self.start, self.end = float(knots[degree]), float(knots[-degree - 1])
        self.breaks: Floats = np.unique(knots[degree:len(knots) - degree])

    def derivatives(self, s: Floats) -> Derivatives:
        """See `ParametricPath`."""
        if len(s) >= KERNEL_FROM and available():  # by size alone: the last bits differ from scipy's
            first = self._orders[0]
            out = np.empty((4, len(s), self._coefficients[0].shape[1]))
            at = np.ascontiguousarray(s, dtype=np.float64)
            compiled(spline)(first.t, first.k, *self._coefficients, at, out)
            return Derivatives(*out)
        return Derivatives(*(np.asarray(order(s), dtype=np.float64) for order in self._orders))


@dataclass(frozen=True)
class Eased:
    """A stretch of a path in the parameter sigma in [0, end] that is at rest with finite sigma_dot at both ends."""

    path: ParametricPath
    first: float
    last: float
    ease: float

    @staticmethod
    def between(path: ParametricPath, first: float, last: float, ease: float) -> Eased:
        """The stretch [first, last] of `path`, d the lesser of `ease` and 0.8 of its length."""
        return Eased(path, first, last, min(ease, ROOM * (last - first)))

    @property
    def start(self) -> float:
        """Always 0."""
        return 0.0

    @property
    def end(self) -> float:
        """Length in sigma."""
        return (self.last - self.first) + 0.8 * self.ease

    @property
    def breaks(self) -> Floats:
        """Breaks of the path inside the stretch, in sigma, and the joints of the change of parameter."""
        inside = self.path.breaks[(self.path.breaks > self.first) & (self.path.breaks < self.last)]
        joints = np.array([self.ease, self.end - self.ease])
        return np.unique(np.concatenate((self.sigma(inside), joints[(joints > 0.0) & (joints < self.end)])))

    def parameter(self, sigma: Floats) -> Floats:
        """s and its first three derivatives by sigma, (4, N)."""
        s = np.empty((4, len(sigma)))
        s[0], s[1], s[2:] = self.first + sigma - 0.4 * self.ease, 1.0, 0.0
        head, tail = sigma < self.ease, sigma > self.end - self.ease
        if head.any():
            s[:, head] += _eased(sigma[head], self.ease)
        if tail.any():
            s[:, tail] += _eased(self.end - sigma[tail], self.ease) * np.array([[-1.0], [1.0], [-1.0], [1.0]])
        return s

    def sigma(self, s: Floats) -> Floats:
        """Inverse of `parameter` (N,), by Newton's method."""
        sigma = np.asarray(s - self.first + 0.4 * self.ease, dtype=np.float64)
        for first, edge, sense in ((True, self.first, 1.0), (False, self.last, -1.0)):
            bent = (sigma < self.ease) if first else (sigma > self.end - self.ease)
            if bent.any():
                travel = self.ease * _eased_back(np.maximum(sense * (s[bent] - edge), 0.0) / self.ease)
                sigma[bent] = travel if first else self.end - travel
        return sigma

    def speed_limit(self, sigma: Floats, feed: Callable[[Floats], Floats]) -> Floats:
        """Largest sigma_dot (N,) under `feed`, the largest ds/dt at s; inf at rest, where s stands still."""
        s = self.parameter(sigma)
        allowed = feed(s[0])
        return np.where(s[1] > 0.0, allowed / np.where(s[1] > 0.0, s[1], 1.0), np.inf)

    def derivatives(self, sigma: Floats) -> Derivatives:
        """Chain rule to third order, exact; see `ParametricPath`."""
        s = self.parameter(sigma)
        return self.chained(sigma, s, self.path.derivatives(self.inside(s[0])))

    def inside(self, s: Floats) -> Floats:
        """`s` moved so far that derivatives at a corner are those from inside the stretch."""
        return np.clip(s, self.first, np.nextafter(self.last, self.first))

    def chained(self, sigma: Floats, s: Floats, inner: Derivatives) -> Derivatives:
        """Derivatives by sigma from those by s; s (4, N) as of `parameter`. Written over
        `inner` where that may be changed."""
        bent = np.flatnonzero((sigma < self.ease) | (sigma > self.end - self.ease))
        if not len(bent):
            return inner
        s1, s2, s3 = s[1:, bent, None]
        q1, q2, q3 = inner.dq[bent], inner.d2q[bent], inner.d3q[bent]
        outer = Derivatives(inner.q, *(order if order.flags.writeable else np.array(order) for order in inner[1:]))
        outer.dq[bent] = q1 * s1
        outer.d2q[bent] = q2 * s1**2 + q1 * s2
        outer.d3q[bent] = q3 * s1**3 + 3.0 * q2 * s1 * s2 + q1 * s3
        return outer


def _eased_back(travel: Floats) -> Floats:
    """u (N,) in [0, 1] with 2 u^3 - 2 u^4 + 0.6 u^5 = path."""
    u = np.minimum(np.cbrt(0.5 * travel) * (1.0 + np.cbrt(0.5 * travel) * (1.0 / 3.0 + 0.4 * travel)), 1.0)
    for _ in range(6):
        slope = u**2 * (6.0 - 8.0 * u + 3.0 * u**2)
        excess = u**3 * (2.0 - 2.0 * u + 0.6 * u**2) - travel
        u = np.clip(u - np.divide(excess, slope, out=np.zeros_like(u), where=slope > 0.0), 0.0, 1.0)
    return u


def _eased(sigma: Floats, ease: float) -> Floats:
    """s - (sigma - 0.4 d) and derivatives of that difference inside the first d, (4, N)."""
    u = sigma / ease
    return np.array([ease * (u**3 * (2.0 - 2.0 * u + 0.6 * u**2) - u + 0.4),
                     u**2 * (6.0 - 8.0 * u + 3.0 * u**2) - 1.0,
                     (12.0 * u - 24.0 * u**2 + 12.0 * u**3) / ease,
                     (12.0 - 48.0 * u + 36.0 * u**2) / ease**2])
