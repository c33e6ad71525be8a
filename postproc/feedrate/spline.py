"""The squared speed x(sigma) as a cubic B-spline over its knots, and the law it follows next to rest.

At a knot only three basis functions are non-zero, so x, x', x'' there are three-term stencils of the
coefficients c[k:k+3]. Over the first REST intervals from rest x = X0 Psi(u), the law of constant jerk: near u
= 0 slope and curvature of x have no weight in any limit, and an optimiser left free there would use it. X0 is
one unknown: the coefficients c[:REST + 3] are tied to it, and the stencils carry the factors.
"""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

REST = 8


def stencils(sigma: Floats) -> Floats:
    """(3, 3, K): [order of derivative, coefficient, knot] of the non-uniform cubic B-spline on knots sigma (K,)."""
    h = np.diff(sigma)
    h = np.concatenate((h[:1], h[:1], h, h[-1:], h[-1:]))
    a, b, c, d = h[:-3], h[1:-2], h[2:-1], h[3:]
    left, right = 1.0 / ((b + c) * (a + b + c)), 1.0 / ((b + c) * (b + c + d))
    table = np.empty((3, 3, len(sigma)))
    for order, (before, after, middle) in enumerate(
            ((c**2 * left, b**2 * right, 1.0), (-3.0 * c * left, 3.0 * b * right, 0.0), (6.0 * left, 6.0 * right, 0.0))):
        table[order] = before, middle - before - after, after
    return table


def rest_law(u: Floats, ease: float) -> Floats:
    """Psi and its first two derivatives by sigma, (3, N), for u = sigma/d: constant jerk from rest in the
    eased parameter.

    s = j t^3/6 and s = d (2u^3 - 2u^4 + 0.6u^5) give u_dot^2 ~ Psi = (1 - u + .3u^2)^(4/3) / (1 - 4u/3 + u^2/2)^2.
    """
    f, f1, f2 = 1.0 - u + 0.3 * u**2, -1.0 + 0.6 * u, 0.6
    g, g1, g2 = 1.0 - 4.0 / 3.0 * u + 0.5 * u**2, -4.0 / 3.0 + u, 1.0
    psi = f ** (4.0 / 3.0) / g**2
    rate = 4.0 / 3.0 * f1 / f - 2.0 * g1 / g
    bend = 4.0 / 3.0 * (f2 / f - (f1 / f) ** 2) - 2.0 * (g2 / g - (g1 / g) ** 2)
    return np.array([psi, psi * rate / ease, psi * (rate**2 + bend) / ease**2])


@dataclass(frozen=True)
@arrays(stencil="3 3 K")
class Basis:
    """Stencils (3, 3, K) and how many coefficients at each end are one unknown (1: none tied)."""

    stencil: Floats
    tied: tuple[int, int]

    @property
    def knots(self) -> int:
        return int(self.stencil.shape[2])

    def squared(self, c: Floats) -> Floats:
        """x (K,) alone."""
        s = self.stencil[0]
        return np.asarray(s[0] * c[:-2] + s[1] * c[1:-1] + s[2] * c[2:])

    def values(self, c: Floats) -> Floats:
        """x, x', x'' (3, K) at the knots from coefficients c (K + 2,)."""
        s = self.stencil
        return np.asarray(s[:, 0] * c[:-2] + s[:, 1] * c[1:-1] + s[:, 2] * c[2:])


def rest_basis(sigma: Floats, ease: float, first: int = 0, last: int | None = None) -> Basis:
    """Knots [first, last) of the basis on all of sigma (K,) with both ends at rest; 2 REST + 7 knots or more in all."""
    if len(sigma) < 2 * REST + 7:
        raise ValueError(f"{len(sigma)} knots; a motion from rest to rest needs at least {2 * REST + 7}")
    last = len(sigma) if last is None else last
    low = max(first - 2, 0)
    table = stencils(sigma[low:last + 2])[:, :, first - low:last - low]
    mirror = np.array([1.0, -1.0, 1.0])[:, None, None]
    tied = [1, 1]
    if first == 0:
        table, tied[0] = _tie(table, (sigma[:last] - sigma[0]) / ease, ease), REST + 3
    if last == len(sigma):
        table = _tie(table[:, ::-1, ::-1] * mirror, (sigma[-1] - sigma[first:][::-1]) / ease, ease)[:, ::-1, ::-1] * mirror
        tied[1] = REST + 3
    return Basis(np.ascontiguousarray(table), (tied[0], tied[1]))


def _tie(table: Floats, u: Floats, ease: float) -> Floats:
    """Stencils of the first knots in terms of X0, which c[:REST + 3] all equal."""
    law = rest_law(u[:REST + 1], ease)
    tied = table.copy()
    factors = np.linalg.solve(table[:, :, REST], law[:, REST])
    tied[:, :, :REST + 1] = 0.0
    tied[:, 0, :REST + 1] = law
    tied[:, 0, REST + 1] *= factors[1]
    tied[:, 1, REST + 1] *= factors[2]
    tied[:, 0, REST + 2] *= factors[2]
    return tied
