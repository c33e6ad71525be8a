"""One component error as a function of the position of its axis: table, Fourier series or polynomial.

All curves are linear in their parameters: value = basis(x) . values. Positions mm or rad, values mm or rad.
Beyond its range a curve keeps its end value; `outside` says, and callers refuse such positions unless they
are set otherwise.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from machines.geometric_error.tables.choices import TableRule
from toolpaths.arrays import Bools, Floats, within
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

EVERYWHERE = (-np.inf, np.inf)
FINEST = 1.0 / 2000.0
"""of the length of a table: rows nearer to each other are readings of one place, and looked at as such"""


class Curve(ABC):
    """A function of one position, linear in P values."""

    values: Floats
    """(P,)"""
    range: tuple[float, float]
    """least and greatest position that the curve was made for"""

    @property
    @abstractmethod
    def detail(self) -> float:
        """mm or rad over which the curve rises or falls at most: what lies between looks as far apart is seen."""

    @property
    @abstractmethod
    def most(self) -> float:
        """mm or rad that no value exceeds anywhere, in either direction: a bound."""

    @property
    @abstractmethod
    def steepest(self) -> float:
        """mm or rad per mm or rad that no slope exceeds anywhere: a bound."""

    @property
    def apart(self) -> float:
        """mm or rad by which the values of the two approach directions nowhere differ by more: a bound."""
        return 0.0

    @abstractmethod
    def labels(self) -> list[str]:
        """What each value is called after the name of the component, P of them."""

    @abstractmethod
    def basis(self, x: Floats, direction: Floats) -> Floats:
        """(N, P) derivatives of the value by the parameters, arguments as in `at`."""

    def at(self, x: Floats, direction: Floats | float = 0.0) -> Floats:
        """Values (N,) at positions (N,) reached in `direction` (N,): +1, -1, 0 for the mean of both, between by shares."""
        result: Floats = self.basis(x, np.broadcast_to(np.asarray(direction, dtype=np.float64), x.shape)) @ self.values
        return result

    def apart_at(self, x: Floats) -> Floats:
        """By how much values (N,) at positions (N,) reached forwards are more than those reached backwards."""
        return np.zeros(len(x))

    def outside(self, x: Floats, margin: float = 0.0) -> Bools:
        """True (N,) where x lies outside the range by more than `margin`."""
        result: Bools = (x < self.range[0] - margin) | (x > self.range[1] + margin)
        return result

    def with_values(self, values: Floats) -> Self:
        """The same curve with other parameters (P,)."""
        if np.shape(values) != self.values.shape:
            raise ValueError(f"{type(self).__name__}.values has shape {np.shape(values)}, expected {self.values.shape}")
        return replace(self, values=values)  # type: ignore[type-var]  # every curve is a dataclass with `values`


@dataclass(frozen=True, eq=False)
@arrays(x="M", values="V")
class TableCurve(Curve):
    """Values measured at M ascending positions, both directions where `both`.

    Attributes:
        x: (M,) ascending
        values: (M,), or (2 M,) with `both`: approached forwards, then backwards
        rule: "linear", or "spline": the cubic spline through the points (not-a-knot; periodic with a period)
        period: 0, or the length after which the table repeats; x then lies within one period, its end left out
    """

    x: Floats
    values: Floats
    rule: TableRule = "linear"
    both: bool = False
    period: float = 0.0
    range: tuple[float, float] = field(init=False)

    def __post_init__(self) -> None:
        if len(self.values) != (count := len(self.x) * (2 if self.both else 1)):
            raise ValueError(f"TableCurve.values has {len(self.values)} entries, expected {count}")
        object.__setattr__(self, "range", EVERYWHERE if self.period else (float(self.x[0]), float(self.x[-1])))

    @property
    def detail(self) -> float:
        """See the base class: the least distance between positions."""
        return least_apart(self.closed(self.values[: len(self.x)])[0])

    @cached_property
    def most(self) -> float:
        """See the base class; linear tables reach it."""
        return max(self._bounds(values)[0] for values in self._approaches)

    @cached_property
    def steepest(self) -> float:
        """See the base class; reached."""
        return max(self._bounds(values)[1] for values in self._approaches)

    @cached_property
    def apart(self) -> float:
        """See the base class."""
        return self._bounds(np.subtract(*self._approaches))[0] if self.both else 0.0

    @property
    def _approaches(self) -> list[Floats]:
        return np.split(self.values, 2) if self.both else [self.values]

    def _bounds(self, values: Floats) -> tuple[float, float]:
        """(largest absolute value, steepest slope) between values (M,) at the positions, by the rule."""
        x, at = self.closed(values)
        largest, wide = float(np.abs(at).max()), float(np.diff(x).max(initial=0.0))
        if len(x) == 1:
            return largest, 0.0
        if self.rule == "linear":
            return largest, float(np.abs(np.diff(at) / np.diff(x)).max())
        slope = _steepest_of_spline(self._curve(values))
        return largest + 0.5 * wide * slope, slope

    def labels(self) -> list[str]:
        """[0], [1] ... by position; [0]+ forwards, [0]- backwards."""
        one = [f"[{k}]" for k in range(len(self.x))]
        return [name + "+" for name in one] + [name + "-" for name in one] if self.both else one

    def at(self, x: Floats, direction: Floats | float = 0.0) -> Floats:
        """See the base class."""
        values = self._by_approach(self.inside(x))
        if not self.both:
            return values[0]
        forward, backward = values
        share = 0.5 * (1.0 + np.clip(direction, -1.0, 1.0))
        result: Floats = backward + share * (forward - backward)
        return result

    def apart_at(self, x: Floats) -> Floats:
        """See the base class."""
        if not self.both:
            return np.zeros(len(x))
        forward, backward = self._by_approach(self.inside(x))
        return np.asarray(forward - backward)

    def basis(self, x: Floats, direction: Floats) -> Floats:
        """See the base class."""
        inside = self.inside(x)
        hats = self._curve(np.eye(len(self.x)))(inside) if self.rule == "spline" else self._hats(inside)
        if not self.both:
            return hats
        share = 0.5 * (1.0 + np.clip(direction, -1.0, 1.0))[:, None]
        return np.concatenate([share * hats, (1.0 - share) * hats], axis=1)

    def inside(self, x: Floats) -> Floats:
        """Positions (N,) within the table: carried into its period, or held at its ends."""
        if self.period:
            result: Floats = self.x[0] + np.mod(x - self.x[0], self.period)
            return result
        return within(x, self.x[0], self.x[-1])

    def closed(self, values: Floats) -> tuple[Floats, Floats]:
        """Positions (M or M + 1,) and values that go with them, the first repeated one period on."""
        if not self.period:
            return self.x, values
        return np.append(self.x, self.x[0] + self.period), np.concatenate([values, values[:1]])

    def _by_approach(self, x: Floats) -> list[Floats]:
        """Values (N,) at positions (N,) within the table: of both directions, or of the one there is."""
        if self.rule == "spline":
            return [curve(x) for curve in self._splines]
        return [np.interp(x, *table) for table in self._tables]

    @cached_property
    def _splines(self) -> list[CubicSpline]:
        return [self._curve(values) for values in self._approaches]

    @cached_property
    def _tables(self) -> list[tuple[Floats, Floats]]:
        return [self.closed(values) for values in self._approaches]

    def _curve(self, values: Floats) -> CubicSpline:
        from scipy.interpolate import CubicSpline

        return CubicSpline(*self.closed(values), bc_type="periodic" if self.period else "not-a-knot")

    def _hats(self, x: Floats) -> Floats:
        at_rest, n = self.closed(self.values[: len(self.x)])[0], len(self.x)
        result = np.zeros((len(x), n))
        if len(at_rest) == 1:
            result[:, 0] = 1.0
            return result
        at = np.clip(np.searchsorted(at_rest, x, side="right") - 1, 0, len(at_rest) - 2)
        share = (x - at_rest[at]) / (at_rest[at + 1] - at_rest[at])
        rows = np.arange(len(x))
        result[rows, at] = 1.0 - share
        result[rows, (at + 1) % n] += share
        return result


@dataclass(frozen=True, eq=False)
@arrays(values="V")
class Fourier(Curve):
    """mean + sum over k = 1.. of cosine_k cos(k phase) + sine_k sin(k phase), phase = 2 pi (x - origin) / period.

    `values` (1 + 2 K,): mean, K cosines, K sines.
    """

    values: Floats
    period: float = 2.0 * np.pi
    origin: float = 0.0
    range: tuple[float, float] = EVERYWHERE

    def __post_init__(self) -> None:
        if len(self.values) % 2 == 0:
            raise ValueError(f"Fourier.values has {len(self.values)} entries, expected 1 + 2 K")

    @property
    def detail(self) -> float:
        """See the base class: half a period of the highest harmonic."""
        order = len(self.values) // 2
        return 0.5 * self.period / order if order else np.inf

    @property
    def most(self) -> float:
        """See the base class."""
        return float(abs(self.values[0]) + self._amplitudes.sum())

    @property
    def steepest(self) -> float:
        """See the base class."""
        harmonics = np.arange(1, 1 + len(self.values) // 2)
        return float((harmonics * self._amplitudes).sum() * 2.0 * np.pi / self.period)

    @property
    def _amplitudes(self) -> Floats:
        _, cosine, sine = np.split(self.values, [1, 1 + len(self.values) // 2])
        return np.hypot(cosine, sine)

    def labels(self) -> list[str]:
        """mean, cos1, ..., sin1, ..."""
        harmonics = range(1, 1 + len(self.values) // 2)
        return [".mean", *(f".cos{k}" for k in harmonics), *(f".sin{k}" for k in harmonics)]

    def at(self, x: Floats, direction: Floats | float = 0.0) -> Floats:
        """See the base class; Horner's rule in exp(i phase)."""
        mean, cosine, sine = np.split(self.values, [1, 1 + len(self.values) // 2])
        turn = np.exp(1j * ((np.clip(x, *self.range) - self.origin) * (2.0 * np.pi / self.period)))
        total = np.zeros(x.shape, dtype=np.complex128)
        for wave in (cosine - 1j * sine)[::-1]:
            total = (total + wave) * turn
        result: Floats = mean[0] + total.real
        return result

    def basis(self, x: Floats, direction: Floats) -> Floats:
        """See the base class."""
        harmonics = np.arange(1, 1 + len(self.values) // 2)
        phase = (np.clip(x, *self.range) - self.origin)[:, None] * (2.0 * np.pi / self.period) * harmonics
        return np.concatenate([np.ones((len(x), 1)), np.cos(phase), np.sin(phase)], axis=1)


@dataclass(frozen=True, eq=False)
@arrays(values="V")
class Polynomial(Curve):
    """sum over k = 0.. of values_k ((x - origin) / scale)^k."""

    values: Floats
    range: tuple[float, float]
    origin: float = 0.0
    scale: float = 1.0

    @property
    def detail(self) -> float:
        """See the base class: the range by the degree."""
        return (self.range[1] - self.range[0]) / max(len(self.values) - 1, 1)

    @property
    def most(self) -> float:
        """See the base class."""
        return float((np.abs(self.values) * self._reach ** np.arange(len(self.values))).sum())

    @property
    def steepest(self) -> float:
        """See the base class."""
        k = np.arange(1, len(self.values))
        return float((k * np.abs(self.values[1:]) * self._reach ** (k - 1)).sum() / abs(self.scale))

    @property
    def _reach(self) -> float:
        """Largest |x - origin| / scale."""
        return max(abs(end - self.origin) for end in self.range) / abs(self.scale)

    def labels(self) -> list[str]:
        """.c0, .c1, ..."""
        return [f".c{k}" for k in range(len(self.values))]

    def at(self, x: Floats, direction: Floats | float = 0.0) -> Floats:
        """See the base class; Horner's rule."""
        t = (np.clip(x, *self.range) - self.origin) / self.scale
        result: Floats = np.full(x.shape, self.values[-1])
        for value in self.values[-2::-1]:
            result = result * t + value
        return result

    def basis(self, x: Floats, direction: Floats) -> Floats:
        """See the base class."""
        t = (np.clip(x, *self.range) - self.origin) / self.scale
        result: Floats = np.vander(t, len(self.values), increasing=True)
        return result


def _steepest_of_spline(curve: CubicSpline) -> float:
    """Largest absolute slope of a cubic spline: at a knot, or where the slope turns back between two."""
    slope = curve.derivative()
    second, first, _ = slope.c  # per cell: second h^2 + first h + slope at its beginning
    width = np.diff(slope.x)
    with np.errstate(divide="ignore", invalid="ignore"):
        vertex = np.where(second != 0.0, -0.5 * first / second, 0.0)
    inside = slope.x[:-1] + np.clip(vertex, 0.0, width)
    return float(np.abs(slope(np.concatenate([slope.x, inside]))).max())


def least_apart(x: Floats) -> float:
    """Least distance of M ascending positions, but no less than FINEST of them all; infinite for one."""
    return max(float(np.diff(x).min(initial=np.inf)), FINEST * float(x[-1] - x[0]))


def largest(curve: Curve) -> float:
    """A bound of a curve's absolute values, mm or rad, which linear tables reach."""
    if isinstance(curve, Polynomial):
        return float(np.abs(curve.at(np.linspace(*curve.range, 101))).max())
    return float(np.abs(curve.values).max() if isinstance(curve, TableCurve) else np.abs(curve.values).sum())
