"""Curves of one axis that share their positions, evaluated together: what all of them need is computed once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable, Sequence

import numpy as np

from machines.geometric_error.tables.curves import Curve, Fourier, Polynomial, TableCurve
from toolpaths.arrays import Floats, within
from toolpaths.compiled import compiled, loop, wanted

COMPILE_FROM = 20_000
"""positions that are worth compiling for; fewer take the loop where any is compiled anyway"""
_ROWS, _NUMBERS = ("float64", 2), ("float64", 1)


class Bank(ABC):
    """C curves with the same basis."""

    @abstractmethod
    def at(self, x: Floats, direction: Floats | float) -> Floats:
        """Values (C, N) at positions x (N,), as `Curve.at`."""


def banks(curves: Sequence[Curve]) -> list[tuple[list[int], Bank]]:
    """Curves in groups of the same basis: (their numbers, their bank)."""
    groups: dict[Hashable, list[int]] = {}
    for k, curve in enumerate(curves):
        groups.setdefault(_key(curve, k), []).append(k)
    return [(numbers, _bank([curves[k] for k in numbers])) for numbers in groups.values()]


def _key(curve: Curve, number: int) -> Hashable:
    size = len(curve.values)
    if isinstance(curve, TableCurve):
        return TableCurve, curve.x.tobytes(), curve.rule, curve.both, curve.period
    if isinstance(curve, Fourier):
        return Fourier, size, curve.period, curve.origin, curve.range
    if isinstance(curve, Polynomial):
        return Polynomial, size, curve.origin, curve.scale, curve.range
    return number


def _bank(curves: list[Curve]) -> Bank:
    first, values = curves[0], np.array([curve.values for curve in curves])
    if isinstance(first, Fourier):
        return FourierBank(first, values)
    if isinstance(first, Polynomial):
        return PolynomialBank(first, values)
    if isinstance(first, TableCurve) and len(first.x) > 1:
        return SplineBank(first, values) if first.rule == "spline" else LinearBank(first, values)
    return OneByOne(curves)


class OneByOne(Bank):
    """Whatever has no bank of its own."""

    def __init__(self, curves: list[Curve]) -> None:
        self.curves = curves

    def at(self, x: Floats, direction: Floats | float) -> Floats:
        """See the base class."""
        return np.stack([curve.at(x, direction) for curve in self.curves])


class FourierBank(Bank):
    """Series: the waves by addition of angles, then one product."""

    def __init__(self, first: Fourier, values: Floats) -> None:
        self.first, self.values = first, values

    def at(self, x: Floats, direction: Floats | float) -> Floats:
        """See the base class."""
        first, count = self.first, self.values.shape[1] // 2
        phase = (within(x, *first.range) - first.origin) * (2.0 * np.pi / first.period)
        waves = np.ones((1 + 2 * count, len(x)))
        if count:
            c, s = waves[1], waves[1 + count] = np.cos(phase), np.sin(phase)
        for k in range(2, count + 1):
            waves[k] = waves[k - 1] * c - waves[count + k - 1] * s
            waves[count + k] = waves[count + k - 1] * c + waves[k - 1] * s
        result: Floats = self.values @ waves
        return result


class PolynomialBank(Bank):
    """Polynomials: Horner's rule on all of them."""

    def __init__(self, first: Polynomial, values: Floats) -> None:
        self.first, self.values = first, values

    def at(self, x: Floats, direction: Floats | float) -> Floats:
        """See the base class."""
        t = (within(x, *self.first.range) - self.first.origin) / self.first.scale
        result: Floats = np.repeat(self.values[:, -1:], len(x), axis=1)
        for column in self.values.T[-2::-1]:
            result = result * t + column[:, None]
        return result


class LinearBank(Bank):
    """Linear tables: the place between the rows is looked up once."""

    def __init__(self, first: TableCurve, values: Floats) -> None:
        self.first = first
        approaches = [first.closed(half) for values_of in values for half in np.split(values_of, 2 if first.both else 1)]
        self.x = approaches[0][0]
        self.y = np.array([y for _, y in approaches])
        self.slope = np.diff(self.y, axis=1) / np.diff(self.x)
        self.by_row = np.ascontiguousarray(self.y.T), np.ascontiguousarray(self.slope.T)

    def at(self, x: Floats, direction: Floats | float) -> Floats:
        """See the base class."""
        inside = self.first.inside(x)
        if wanted(len(x), COMPILE_FROM):
            share = np.broadcast_to(_share(direction), inside.shape) if self.first.both else inside[:0]
            return compiled(table_values)(inside, self.x, *self.by_row, share)
        row = within(np.searchsorted(self.x, inside, side="right") - 1, 0, len(self.x) - 2)
        found = self.y[:, row] + self.slope[:, row] * (inside - self.x[row])
        return found if not self.first.both else _shared(found, direction)


class SplineBank(Bank):
    """Spline tables: one piecewise cubic with a value per curve and approach direction."""

    def __init__(self, first: TableCurve, values: Floats) -> None:
        from scipy.interpolate import CubicSpline

        self.first = first
        approaches = [first.closed(half) for values_of in values for half in np.split(values_of, 2 if first.both else 1)]
        self.cubic = CubicSpline(approaches[0][0], np.array([y for _, y in approaches]), axis=1,
                                 bc_type="periodic" if first.period else "not-a-knot")

    def at(self, x: Floats, direction: Floats | float) -> Floats:
        """See the base class."""
        found = np.asarray(self.cubic(self.first.inside(x)))
        return found if not self.first.both else _shared(found, direction)


def _shared(found: Floats, direction: Floats | float) -> Floats:
    """(C, N) of values (2 C, N), forwards and backwards by turns, by shares of the approach direction."""
    result: Floats = found[1::2] + _share(direction) * (found[0::2] - found[1::2])
    return result


def _share(direction: Floats | float) -> Floats:
    """Share of the values forwards."""
    return np.asarray(0.5 * (1.0 + within(direction, -1.0, 1.0)))


@loop(takes=(_NUMBERS, _NUMBERS, _ROWS, _ROWS, _NUMBERS))
def table_values(inside: Floats, x: Floats, y: Floats, slope: Floats, share: Floats) -> Floats:
    """(C, N) values of linear tables at positions within them (N,).

    Args:
        x: (M,) positions of the rows; y: (M, C), slope: (M - 1, C), twice as many columns with two approach directions
        share: (N,) of the values forwards, which stand before those backwards; (0,) with one direction
    """
    both = len(share) > 0
    count = y.shape[1] // 2 if both else y.shape[1]
    result = np.empty((count, len(inside)))
    for n in range(len(inside)):
        row, behind = 0, len(x) - 1
        while behind - row > 1:
            middle = (row + behind) // 2
            if x[middle] <= inside[n]:
                row = middle
            else:
                behind = middle
        along = inside[n] - x[row]
        for c in range(count):
            if both:
                back = y[row, 2 * c + 1] + slope[row, 2 * c + 1] * along
                result[c, n] = back + share[n] * (y[row, 2 * c] + slope[row, 2 * c] * along - back)
            else:
                result[c, n] = y[row, c] + slope[row, c] * along
    return result
