"""Paths q(sigma) with exact derivatives, and the change of parameter that lets a motion start and end at rest.

Near rest under bounded jerk x = s_dot^2 grows as s^(4/3), which no polynomial in s follows. With the parameter
sigma, where s = d (2 u^3 - 2 u^4 + 0.6 u^5), u = sigma/d on the first and last d (three times differentiable joint
with s = sigma - 0.4 d), sigma_dot is finite at rest, and rest needs no condition of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from scipy.interpolate import BSpline

from toolpaths.arrays import Floats

ROOM = 0.8
"""Largest share of a path's length that the change of parameter may take as d; 0.6 d at each end must fit."""


class Derivatives(NamedTuple):
    """Joints and their derivatives by the path parameter, each (N, J)."""

    q: Floats
    dq: Floats
    d2q: Floats
    d3q: Floats


class Path(Protocol):
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


class SplinePath:
    """Joint-space B-spline of degree 4 or more (5 is usual); parameter in the units of its knots."""

    def __init__(self, knots: Floats, coefficients: Floats, degree: int = 5) -> None:
        if degree < 4:
            raise ValueError(f"degree {degree}: the third derivative must be continuous, which takes degree 4 or more")
        self._orders = [BSpline(knots, coefficients, degree)]
        for _ in range(3):
            self._orders.append(self._orders[-1].derivative())
        self.start, self.end = float(knots[degree]), float(knots[-degree - 1])
        self.breaks: Floats = np.unique(knots[degree:len(knots) - degree])

    def derivatives(self, s: Floats) -> Derivatives:
        """See `Path`."""
        return Derivatives(*(np.asarray(order(s), dtype=np.float64) for order in self._orders))


@dataclass(frozen=True)
class Eased:
    """A stretch of a path in the parameter sigma in [0, end] that is at rest with finite sigma_dot at both ends."""

    path: Path
    first: float
    last: float
    ease: float

    @staticmethod
    def between(path: Path, first: float, last: float, ease: float) -> Eased:
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
        """Inverse of `parameter` (N,), by Newton's method from outside (monotone)."""
        sigma = np.asarray(s - self.first + 0.4 * self.ease, dtype=np.float64)
        bent = (sigma < self.ease) | (sigma > self.end - self.ease)
        guess = np.clip(sigma[bent], 0.3 * self.ease, self.end - 0.3 * self.ease)
        for _ in range(60):
            there = self.parameter(guess)
            guess = np.clip(guess - (there[0] - s[bent]) / np.maximum(there[1], 1e-12), 0.0, self.end)
        sigma[bent] = guess
        return sigma

    def speed_limit(self, sigma: Floats, feed: Callable[[Floats], Floats]) -> Floats:
        """Largest sigma_dot (N,) under `feed`, the largest ds/dt at s; inf at rest, where s stands still."""
        s = self.parameter(sigma)
        allowed = feed(s[0])
        return np.where(s[1] > 0.0, allowed / np.where(s[1] > 0.0, s[1], 1.0), np.inf)

    def derivatives(self, sigma: Floats) -> Derivatives:
        """Chain rule to third order, exact; see `Path`."""
        s = self.parameter(sigma)
        # Derivatives at a corner are those from inside the stretch.
        inner = self.path.derivatives(np.clip(s[0], self.first, np.nextafter(self.last, self.first)))
        bent = np.flatnonzero((sigma < self.ease) | (sigma > self.end - self.ease))
        s1, s2, s3 = s[1:, bent, None]
        q1, q2, q3 = inner.dq[bent], inner.d2q[bent], inner.d3q[bent]
        outer = Derivatives(inner.q, *(np.array(order) for order in inner[1:]))
        outer.dq[bent] = q1 * s1
        outer.d2q[bent] = q2 * s1**2 + q1 * s2
        outer.d3q[bent] = q3 * s1**3 + 3.0 * q2 * s1 * s2 + q1 * s3
        return outer


def _eased(sigma: Floats, ease: float) -> Floats:
    """s - (sigma - 0.4 d) and derivatives of that difference inside the first d, (4, N)."""
    u = sigma / ease
    return np.array([ease * (u**3 * (2.0 - 2.0 * u + 0.6 * u**2) - u + 0.4),
                     u**2 * (6.0 - 8.0 * u + 3.0 * u**2) - 1.0,
                     (12.0 * u - 24.0 * u**2 + 12.0 * u**3) / ease,
                     (12.0 - 48.0 * u + 36.0 * u**2) / ease**2])
