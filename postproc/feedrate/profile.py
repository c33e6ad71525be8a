"""A speed profile x(sigma), exact between knots, and the time that belongs to each place."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from postproc.feedrate.kernels.samples import passed
from postproc.feedrate.spline import Basis, rest_basis
from toolpaths.arrays import Floats, Ints
from toolpaths.compiled import available, compiled
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

CHUNK = 16384
"""Knots handled at once."""
KERNEL_FROM = 64
"""Times at once from which the compiled loop finds their places."""
_GAUSS = np.polynomial.legendre.leggauss(5)
_UNIT_GAUSS = np.array([0.5 + 0.5 * _GAUSS[0], _GAUSS[1]])


class Places(NamedTuple):
    """Along sigma at some times, each (N,): place, and its first three time derivatives."""

    sigma: Floats
    speed: Floats
    acceleration: Floats
    jerk: Floats


@dataclass(frozen=True)
@arrays(sigma="K", pieces="4 K-1")
class Profile:
    """x = sigma_dot^2 as a cubic in each interval: sigma (K,), pieces (4, K-1), powers of sigma - sigma[k] rising."""

    sigma: Floats
    pieces: Floats

    @cached_property
    def times(self) -> Floats:
        """Time at the knots (K,): integral of x^-1/2; in closed form where x is linear, as it may then reach 0."""
        spent = np.zeros(len(self.sigma))
        for first in range(0, len(spent) - 1, CHUNK):
            here = slice(first, min(first + CHUNK, len(spent) - 1))
            spent[first + 1:here.stop + 1] = self._spent(self.pieces[:, here], np.diff(self.sigma[first:here.stop + 1]))
        return np.cumsum(spent, out=spent)

    def squared(self, k: Ints, travel: Floats) -> tuple[Floats, Floats, Floats]:
        """x, x', x'' at `travel` behind knots k."""
        return _cubic(self.pieces[:, k], travel)

    @cached_property
    def _linear(self) -> bool:
        return not any(np.any(row) for row in self.pieces[2:])

    def _spent(self, pieces: Floats, travel: Floats) -> Floats:
        """Time from the start of pieces (4, N) to `travel` behind it."""
        a, b, c, d = pieces
        if self._linear:
            return np.asarray(2.0 * travel / np.maximum(np.sqrt(a) + np.sqrt(np.maximum(a + travel * b, 0.0)), 1e-300))
        total = np.zeros(travel.shape)
        for node, weight in zip(*_GAUSS, strict=True):
            u = (0.5 + 0.5 * node) * travel
            total += weight / np.sqrt(a + u * (b + u * (c + u * d)))
        return np.asarray(0.5 * travel * total)

    def at(self, t: Floats) -> Places:
        """Places at rising times t (N,) within [0, times[-1]]."""
        if len(t) >= KERNEL_FROM and not self._linear and available():  # by size alone, as the paths
            out = np.empty((2, len(t)))
            compiled(passed)(self.sigma, self.times, self.pieces, _UNIT_GAUSS, np.asarray(t, dtype=np.float64), out)
            k, travel = out[0].astype(np.int64), out[1]
            return _places(self.sigma[k] + travel, *_cubic(self.pieces[:, k], travel))
        k = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.sigma) - 2)
        rest, h, pieces = t - self.times[k], self.sigma[k + 1] - self.sigma[k], self.pieces[:, k]
        a, b, c, d = pieces
        # Motion of constant jerk from the knot: exact where x is linear, else the start of Newton's method.
        speed = np.sqrt(a)
        travel = np.clip(rest * (speed + rest * (0.25 * b + rest * c * speed / 6.0)), 0.0, h)
        for _ in range(0 if self._linear else 2):
            x = a + travel * (b + travel * (c + travel * d))
            travel = np.clip(travel + (rest - self._spent(pieces, travel)) * np.sqrt(x), 0.0, h)
        return _places(self.sigma[k] + travel, *_cubic(pieces, travel))

    def when(self, sigma: Floats) -> tuple[Floats, Places]:
        """Times (N,) at which places sigma (N,) are passed, and the motion there."""
        k = np.clip(np.searchsorted(self.sigma, sigma, side="right") - 1, 0, len(self.sigma) - 2)
        travel, pieces = sigma - self.sigma[k], self.pieces[:, k]
        return self.times[k] + self._spent(pieces, travel), _places(sigma, *_cubic(pieces, travel))


def _cubic(pieces: Floats, travel: Floats) -> tuple[Floats, Floats, Floats]:
    """x, x', x'' at `travel` behind the start of pieces (4, N)."""
    a, b, c, d = pieces
    return (a + travel * (b + travel * (c + travel * d)), b + travel * (2.0 * c + 3.0 * d * travel),
            2.0 * c + 6.0 * d * travel)


def _places(sigma: Floats, x: Floats, x1: Floats, x2: Floats) -> Places:
    speed = np.sqrt(np.maximum(x, 0.0))
    return Places(sigma, speed, 0.5 * x1, 0.5 * x2 * speed)


def spline_profile(sigma: Floats, basis: Basis, c: Floats) -> Profile:
    """From coefficients; next to rest, where x follows the law of constant jerk, by cubics with its values and slopes."""
    x, x1, x2 = basis.values(c)
    h = np.diff(sigma)
    pieces = np.array([x[:-1], x1[:-1], 0.5 * x2[:-1], np.diff(x2) / (6.0 * h)])
    for end, k in enumerate((np.arange(basis.tied[0] - 3), len(h) - 1 - np.arange(basis.tied[1] - 3))):
        if basis.tied[end] > 1:
            rise = (x[k + 1] - x[k]) / h[k]
            pieces[2, k] = (3.0 * rise - 2.0 * x1[k] - x1[k + 1]) / h[k]
            pieces[3, k] = (x1[k] + x1[k + 1] - 2.0 * rise) / h[k] ** 2
    return Profile(sigma, pieces)


def knots_profile(sigma: Floats, ease: float, c: Floats) -> Profile:
    """Of a motion from rest to rest on knots sigma (K,) by coefficients (K + 2,)."""
    pieces = np.empty((4, len(sigma) - 1))
    for first, part in profile_parts(sigma, ease, c):
        pieces[:, first:first + part.pieces.shape[1]] = part.pieces
    return Profile(sigma, pieces)


def profile_parts(sigma: Floats, ease: float, c: Floats, size: int = CHUNK) -> Iterator[tuple[int, Profile]]:
    """The same in parts, each with its first knot."""
    count = len(sigma)
    cuts = np.linspace(0, count, max(1, count // size) + 1).astype(int)
    for first, last in pairwise(cuts.tolist()):
        stop = min(last + 1, count)
        yield first, spline_profile(sigma[first:stop], rest_basis(sigma, ease, first, stop), c[first:stop + 2])


def linear_profile(sigma: Floats, x: Floats) -> Profile:
    """From squared speeds at the knots, linear between them."""
    zero = np.zeros(len(x) - 1)
    return Profile(sigma, np.array([x[:-1], np.diff(x) / np.diff(sigma), zero, zero]))
