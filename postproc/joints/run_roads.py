"""The runs of a program as roads that can be looked at anywhere, for what a redundant machine leaves open along them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from machines.kinematics.base import Kinematics
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between
from toolpaths.shape import Curves
from toolpaths.shapes import arrays

TRAVEL, TURN = 10.0, 0.035
"""mm and rad that count as one step along a road"""


@dataclass(frozen=True)
@arrays(first="6", seconds="N")
class RunRoad:
    """One run: the pose (6,) that it begins at, its N curves behind it, and the time that each takes at the programmed feed.

    Attributes:
        kin: with the tool
        seconds: (N,) s, 0 where the tool goes as fast as it can
        held: rad, the spin that the tool is asked to have; NaN where any will do
    """

    kin: Kinematics
    first: Floats
    curves: Curves
    seconds: Floats
    held: float

    @cached_property
    def steps(self) -> Floats:
        """(N + 1,) steps from the beginning to each pose."""
        own = self.curves.length() / TRAVEL + angle_between(self.curves.axis0, self.curves.axis1) / TURN
        return np.concatenate([[0.0], np.cumsum(own)])

    def at(self, measure: Floats, places: Floats) -> tuple[Floats, Floats]:
        """(tip, axis) (K, 3) at `places` (K,) of a measure that is `measure` (N + 1,) at the poses, rising."""
        if not len(self.curves):
            return np.tile(self.first[:3], (len(places), 1)), np.tile(self.first[3:], (len(places), 1))
        index = np.clip(np.searchsorted(measure, places, side="right") - 1, 0, len(self.curves) - 1)
        width = measure[index + 1] - measure[index]
        u = np.where(width > 0.0, (places - measure[index]) / np.where(width > 0.0, width, 1.0), 1.0)
        return self.curves.take(index).at(np.clip(u, 0.0, 1.0))


@dataclass(frozen=True)
@arrays(measure="P", nodes="n", values="n F")
class ParameterCurve:
    """Open parameters along one road: `values` (n, F) at `nodes` (n,) of a measure that is `measure` (P,) at its poses.

    Attributes:
        columns: which open parameters they are
        grain: of the measure: the road is not cut into parts shorter than that
        straight: rad or mm that blocks, along which the parameters go nearly evenly, may leave the curve by
        round: True for a cubic B-spline with these control values at even nodes, which runs through its ends; False for
            straight lines between them
        seconds: s that the joints of the whole program take with these carriers at the programmed feed, and with carriers
            that do all; () of curves that are no split
    """

    measure: Floats
    nodes: Floats
    values: Floats
    columns: tuple[int, ...]
    grain: float
    straight: float
    round: bool = False
    seconds: tuple[float, ...] = ()

    def parts(self) -> Ints:
        """(N,) parts that each curve of the road is to be cut into: a part of a share of its length leaves the parabola by
        the square of that share."""
        count = len(self.measure) - 1
        inside = self.nodes[(self.nodes > self.measure[0]) & (self.nodes < self.measure[-1])]
        seen = np.concatenate([inside, 0.5 * (self.measure[1:] + self.measure[:-1])])
        if not count:
            return np.ones(0, dtype=np.int64)
        chords = self.at(self.measure)
        even = np.stack([np.interp(seen, self.measure, column) for column in chords.T], axis=1)
        off, owner = np.abs(self.at(seen) - even).max(axis=1), np.searchsorted(self.measure, seen, side="right") - 1
        worst = np.zeros(count)
        np.maximum.at(worst, np.clip(owner, 0, count - 1), off)
        most = np.maximum(np.diff(self.measure) / self.grain, 1.0)
        return np.ceil(np.clip(np.sqrt(worst / self.straight), 1.0, most) - 1e-9).astype(np.int64)

    def at(self, places: Floats) -> Floats:
        """(K, F) at places (K,) of the measure."""
        if len(self.nodes) == 1:
            return np.tile(self.values[0], (len(places), 1))
        if not self.round:
            return np.stack([np.interp(places, self.nodes, column) for column in self.values.T], axis=1)
        x = (places - self.nodes[0]) / (self.nodes[1] - self.nodes[0])
        k = np.clip(x.astype(np.int64), 0, len(self.nodes) - 2)
        t = np.clip(x - k, 0.0, 1.0)[:, None]
        c = np.concatenate([[2.0 * self.values[0] - self.values[1]], self.values,
                            [2.0 * self.values[-1] - self.values[-2]]])
        s = 1.0 - t
        return np.asarray((s**3 * c[k] + (4.0 - 6.0 * t**2 + 3.0 * t**3) * c[k + 1]
                           + (4.0 - 6.0 * s**2 + 3.0 * s**3) * c[k + 2] + t**3 * c[k + 3]) / 6.0)


def columns_of(kin: Kinematics, rotary: bool) -> tuple[int, ...]:
    """The open parameters that turn the tool about itself (`rotary`), or those that are joints."""
    return tuple(k for k, name in enumerate(kin.open_parameters) if (name not in kin.axis_names) == rotary)


def rest(kin: Kinematics, tip: Floats, axis: Floats) -> Floats:
    """(N, F) what `inverse` takes for the open parameters of poses; NaN where it has no joints."""
    if not columns_of(kin, False):
        return np.zeros((len(tip), len(kin.open_parameters)))
    q = kin.inverse(tip, axis)[0]
    good = np.isfinite(q).all(axis=1)
    result = np.full((len(tip), len(kin.open_parameters)), np.nan)
    result[good] = kin.parameters_at(q[good])
    return result


def together(curves: Sequence[ParameterCurve], count: int, places: Sequence[Floats]) -> Floats:
    """(K, F) the open parameters of all curves of one road at K places, each in the measure of its own curve."""
    result = np.zeros((len(places[0]), count))
    for curve, at in zip(curves, places, strict=True):
        result[:, curve.columns] = curve.at(at)
    return result
