"""Intervals of numbers, as arrays of lower and upper ends: what a figure may be anywhere in a box.

Ends are not rounded outwards: the search states less than it finds, and the check of a certificate, which shares no code
with this, rounds.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(lo="...", hi="...")
class Span:
    """Everything between `lo` and `hi`, arrays of one shape; they share their letters with whatever they are of."""

    lo: Floats
    hi: Floats

    @property
    def middle(self) -> Floats:
        """Half the sum of the ends."""
        return np.asarray(0.5 * (self.lo + self.hi), dtype=np.float64)

    @property
    def radius(self) -> Floats:
        """Half their distance."""
        return np.asarray(0.5 * (self.hi - self.lo), dtype=np.float64)

    def __getitem__(self, key: Any) -> Span:
        return Span(self.lo[key], self.hi[key])

    def __neg__(self) -> Span:
        return Span(-self.hi, -self.lo)

    def __add__(self, other: Span | Floats | float) -> Span:
        of = spanned(other)
        return Span(self.lo + of.lo, self.hi + of.hi)

    def __sub__(self, other: Span | Floats | float) -> Span:
        return self + -spanned(other)

    def __mul__(self, other: Span | Floats | float) -> Span:
        of = spanned(other)
        a, b, c, d = self.lo * of.lo, self.lo * of.hi, self.hi * of.lo, self.hi * of.hi
        return Span(np.minimum(np.minimum(a, b), np.minimum(c, d)), np.maximum(np.maximum(a, b), np.maximum(c, d)))

    def over(self, other: Span) -> Span:
        """self / other; everywhere where 0 is between the ends of `other`."""
        with np.errstate(divide="ignore", invalid="ignore"):
            good = (other.lo > 0.0) | (other.hi < 0.0)
            return self * Span(np.where(good, 1.0 / other.hi, -np.inf), np.where(good, 1.0 / other.lo, np.inf))

    def square(self) -> Span:
        """self times itself, which is never negative."""
        low, high = np.abs(self.lo), np.abs(self.hi)
        least = np.where((self.lo <= 0.0) & (self.hi >= 0.0), 0.0, np.minimum(low, high))
        return Span(least**2, np.maximum(low, high) ** 2)

    def root(self) -> Span:
        """The square root; its lower end is NaN where there may be none."""
        with np.errstate(invalid="ignore"):
            return Span(np.sqrt(self.lo), np.sqrt(self.hi))

    def sum(self, axis: int) -> Span:
        """Over an axis."""
        return Span(self.lo.sum(axis=axis), self.hi.sum(axis=axis))

    def by(self, matrix: Floats) -> Span:
        """matrix @ v of vectors (..., n) and a fixed matrix (m, n)."""
        middle, radius = self.middle @ matrix.T, self.radius @ np.abs(matrix).T
        return Span(middle - radius, middle + radius)

    def reshape(self, *shape: int) -> Span:
        """Of another shape."""
        return Span(self.lo.reshape(shape), self.hi.reshape(shape))


def spanned(value: Span | Floats | float) -> Span:
    """A number as the interval of it alone."""
    if isinstance(value, Span):
        return value
    fixed = np.asarray(value, dtype=np.float64)
    return Span(fixed, fixed)


def stacked(parts: list[Span], axis: int) -> Span:
    """Side by side along a new axis."""
    return Span(np.stack(np.broadcast_arrays(*(p.lo for p in parts)), axis=axis),
                np.stack(np.broadcast_arrays(*(p.hi for p in parts)), axis=axis))


def joined(parts: list[Span], axis: int) -> Span:
    """One behind the other along an axis."""
    return Span(np.concatenate([p.lo for p in parts], axis=axis), np.concatenate([p.hi for p in parts], axis=axis))


def crossed(a: Span, b: Span) -> Span:
    """a x b, the vectors in the last axis."""
    x, y, z = (a[..., i] for i in range(3))
    u, v, w = (b[..., i] for i in range(3))
    return stacked([y * w - z * v, z * u - x * w, x * v - y * u], -1)


def dotted(a: Span, b: Span) -> Span:
    """a . b, the vectors in the last axis."""
    return (a * b).sum(-1)


def turned_by(angle: Span) -> tuple[Span, Span]:
    """(cos, sin) of angles in rad, from the middle: exact where the angle is fixed."""
    c, s = np.cos(angle.middle), np.sin(angle.middle)
    rho = np.minimum(angle.radius, np.pi)
    near = Span(np.cos(rho), np.ones_like(rho))
    most = np.where(rho < 0.5 * np.pi, np.sin(rho), 1.0)
    aside = Span(-most, most)
    return near * c - aside * s, near * s + aside * c


def angle_of(x: Span, y: Span) -> Span:
    """atan2(y, x) next to that of the middles; of any size where x = y = 0 may be."""
    middle = np.arctan2(y.middle, x.middle)
    c, s = np.cos(middle), np.sin(middle)
    along, aside = x * c + y * s, y * c - x * s
    ends = np.stack([np.arctan2(v, u) for u in (along.lo, along.hi) for v in (aside.lo, aside.hi)])
    sure = along.lo > 0.0
    return Span(np.where(sure, middle + ends.min(axis=0), -np.inf), np.where(sure, middle + ends.max(axis=0), np.inf))
