"""Vectors that move along a block: derivatives at its middle and a bound of the third over all of it.

A block runs over t in [0, 1]. Taylor's theorem with the Lagrange remainder turns a jet into bounds that hold for every
t, not only where somebody looked: with x''' bounded by T, |x''(t)| <= |x''(1/2)| + T/2, and so on downwards. Sums and
turns of jets are jets again (product rule, triangle inequality), so that a chain of axes needs no formula of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Self

import numpy as np

from machines.kinematics import columns
from machines.kinematics.columns import Columns, Number
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass

ZERO: Columns = [0.0, 0.0, 0.0]


@dataclass(frozen=True)
class TaylorAngle:
    """A number that moves along the block: value, first and second derivative (N,) at t = 1/2; |third| <= `third`."""

    value: Number
    first: Number
    second: Number = 0.0
    third: Number = 0.0

    def most(self) -> tuple[Number, Number]:
        """Bounds (N,) of |first| and |second| over the block."""
        return (np.abs(self.first) + 0.5 * np.abs(self.second) + 0.125 * self.third,
                np.abs(self.second) + 0.5 * self.third)


@dataclass(frozen=True)
class TaylorVector:
    """A vector that moves along the block: columns of value, first and second derivative at t = 1/2, |third| <= `third`."""

    value: Columns
    first: Columns = (0.0, 0.0, 0.0)
    second: Columns = (0.0, 0.0, 0.0)
    third: Number = 0.0

    def __add__(self, other: Self) -> TaylorVector:
        return TaylorVector(columns.plus(self.value, other.value), columns.plus(self.first, other.first),
                            columns.plus(self.second, other.second), self.third + other.third)

    def __sub__(self, other: Self) -> TaylorVector:
        return TaylorVector(columns.minus(self.value, other.value), columns.minus(self.first, other.first),
                            columns.minus(self.second, other.second), self.third + other.third)

    def slid(self, direction: Columns, by: TaylorAngle) -> TaylorVector:
        """Shifted along the unit `direction` by a number that moves."""
        value, first, second = (columns.plus(part, columns.times(size, direction)) for part, size in (
            (self.value, by.value), (self.first, by.first), (self.second, by.second)))
        return TaylorVector(value, first, second, self.third + by.third)

    def turned(self, direction: Columns, point: Columns, by: TaylorAngle) -> TaylorVector:
        """Turned about the line through `point` along the unit `direction` by an angle that moves.

        With W = direction x, r = R(angle) s: r' = R (a'W s + s'), r'' = R ((a''W + a'^2 W^2) s + 2 a'W s' +
        s''), and |r'''| <= (a''' + 3 a'a'' + a'^3)|W s| + 3 (a'' + a'^2)|W s'| + 3 a'|W s''| + |s'''|, each at its largest.
        """
        arm = columns.minus(self.value, point)
        across, turn = _about(direction)
        around = [across(v) for v in (arm, self.first, self.second)]
        first = columns.plus(columns.times(by.first, around[0]), self.first)
        second = columns.plus(columns.times(by.second, around[0]), self.second)
        second = columns.plus(second, columns.times(np.square(by.first), across(around[0])))
        second = columns.plus(second, columns.times(2.0 * by.first, around[1]))
        cos, sin = np.cos(by.value), np.sin(by.value)
        turned = [turn(cos, sin, v) for v in (arm, first, second)]
        return TaylorVector(columns.plus(turned[0], point), turned[1], turned[2], self._third(around, by))

    def _third(self, around: list[list[Floats | float]], by: TaylorAngle) -> Number:
        s, v, a = (_norm(x) for x in around)
        a = a + 0.5 * self.third
        s, v = s + 0.5 * v + 0.125 * _norm(around[2]) + self.third / 48.0, v + 0.5 * _norm(around[2]) + 0.125 * self.third
        rate, change = by.most()
        return ((by.third + 3.0 * rate * change + rate**3) * s + 3.0 * (change + rate**2) * v + 3.0 * rate * a
                + self.third)

    def speed(self) -> Number:
        """Bound (N,) of |first| over the block."""
        return _norm(self.first) + 0.5 * _norm(self.second) + 0.125 * self.third

    def bend(self) -> Number:
        """Bound (N,) of |second| over the block."""
        return _norm(self.second) + 0.5 * self.third


def straight(start: Columns, end: Columns) -> TaylorVector:
    """From one vector to another at constant speed."""
    return TaylorVector(columns.times(0.5, columns.plus(start, end)), columns.minus(end, start))


def _norm(v: Columns) -> Number:
    return np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


Across = Callable[[Columns], list[Number]]
TurnAbout = Callable[[Number, Number, Columns], list[Number]]


def _about(direction: Columns) -> tuple[Across, TurnAbout]:
    """direction x v, and v turned about it: of plain numbers as `columns` has it, which leaves out what is 0."""
    d = list(direction)
    if all(isinstance(x, float) for x in d):
        return partial(columns.across, d), partial(columns.turned, d)
    return partial(columns.cross, direction), partial(_turn, direction)


def _turn(direction: Columns, cos: Number, sin: Number, v: Columns) -> list[Floats | float]:
    """Rodrigues; `direction` may differ from point to point."""
    along = columns.dot(direction, v) * (1.0 - cos)
    over = columns.cross(direction, v)
    return [cos * v[i] + sin * over[i] + along * direction[i] for i in range(3)]
