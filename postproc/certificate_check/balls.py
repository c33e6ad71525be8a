"""FloatArray with what they may be off by, rounding included: middle and radius, every result rounded outwards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
EPS = 4.0 * float(np.finfo(np.float64).eps)
"""more than the rounding of one operation, and of the radius that goes with it"""
TINY = 1e-290


@dataclass(frozen=True, eq=False)
class Ball:
    """All numbers within `r` of `m`, arrays of one shape."""

    m: FloatArray
    r: FloatArray

    def __getitem__(self, key: Any) -> Ball:
        return Ball(self.m[key], self.r[key])

    def __neg__(self) -> Ball:
        return Ball(-self.m, self.r)

    def __add__(self, other: Ball | FloatArray | float) -> Ball:
        o = ball(other)
        return _out(self.m + o.m, self.r + o.r)

    def __sub__(self, other: Ball | FloatArray | float) -> Ball:
        return self + -ball(other)

    def __mul__(self, other: Ball | FloatArray | float) -> Ball:
        o = ball(other)
        return _out(self.m * o.m, np.abs(self.m) * o.r + self.r * (np.abs(o.m) + o.r))

    def inverse(self) -> Ball:
        """1 / self; of infinite radius where 0 is in it."""
        with np.errstate(divide="ignore", invalid="ignore"):
            least = np.abs(self.m) - self.r * (1.0 + EPS)
            middle = 1.0 / self.m
            radius = self.r / (np.abs(self.m) * least)
        good = least > 0.0
        return _out(np.where(good, middle, 0.0), np.where(good, radius, np.inf))

    def root(self) -> Ball:
        """The square root; of infinite radius where there may be none."""
        least, most = self.m - self.r * (1.0 + EPS), self.m + self.r * (1.0 + EPS)
        good = least > 0.0
        low, high = np.sqrt(np.where(good, least, 1.0)), np.sqrt(np.where(good, most, 1.0))
        return _out(np.where(good, 0.5 * (low + high), 0.0), np.where(good, 0.5 * (high - low) + EPS * high, np.inf))

    def least(self) -> FloatArray:
        """Lower ends."""
        return np.asarray(self.m - self.r - EPS * (np.abs(self.m) + self.r))

    def most(self) -> FloatArray:
        """Upper ends."""
        return np.asarray(self.m + self.r + EPS * (np.abs(self.m) + self.r))


def _out(middle: FloatArray, radius: FloatArray) -> Ball:
    return Ball(np.asarray(middle), np.asarray((radius + EPS * np.abs(middle)) * (1.0 + EPS) + TINY))


def ball(value: Ball | FloatArray | float) -> Ball:
    """A number that is known to its last digit."""
    if isinstance(value, Ball):
        return value
    known = np.asarray(value, dtype=np.float64)
    return Ball(known, np.zeros_like(known))


def cos_sin(angle: Ball) -> tuple[Ball, Ball]:
    """(cos, sin), rad: Taylor to the second order about the middle."""
    c, s = np.cos(angle.m), np.sin(angle.m)
    bend = 0.5 * angle.r**2 + EPS
    return (_out(c, np.minimum(np.abs(s) * angle.r + bend, 2.0)), _out(s, np.minimum(np.abs(c) * angle.r + bend, 2.0)))


def scalar(a: list[Ball], b: list[Ball]) -> Ball:
    """a . b of three components each."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def vector(a: list[Ball], b: list[Ball]) -> list[Ball]:
    """a x b of three components each."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def product(matrix: FloatArray, other: Ball) -> Ball:
    """matrix @ other, of matrices (..., n, m) and (..., m, k)."""
    size = np.abs(matrix)
    middle = matrix @ other.m
    rounding = EPS * matrix.shape[-1] * (size @ np.abs(other.m))
    return Ball(middle, np.asarray((size @ other.r) * (1.0 + matrix.shape[-1] * EPS) + rounding + TINY))


def spectral(other: Ball) -> FloatArray:
    """At most the largest singular value of any matrix (..., n, m) in it."""
    size = other.m.shape[-1] * other.m.shape[-2]
    finite = np.asarray(np.isfinite(other.r).all(axis=(-1, -2)) & np.isfinite(other.m).all(axis=(-1, -2)))
    middle = np.where(finite[..., None, None], other.m, 0.0)
    most = np.linalg.norm(middle, ord=2, axis=(-2, -1)) * (1.0 + 1e-10)
    spread = np.sqrt((np.where(finite[..., None, None], other.r, 0.0) ** 2).sum(axis=(-1, -2))) * (1.0 + size * EPS)
    return np.where(finite, most + spread, np.inf)
