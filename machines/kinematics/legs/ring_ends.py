"""Rods that end on rings about z of a platform: how their ends go round on it, in the middle of a move and at most.

The foot A of such a rod stands still. With c the middle of its ring, A - c = h z + s o with o across z, and t = z x o, the
rod's end is c + radius o, the point of the ring nearest to A: the rod has no part along t. In directions of the platform the
foot moves by u = -v - w x (A - C), so in polar coordinates about z

    s' = o.u,   s turn' = t.u,   s turn'' = t.u2 - 2 s' turn',   u2 = -v' - w' x (A - C) - 2 w x u - w x (w x (A - C))

and the end goes round by k = radius turn' t, k' = radius turn'' t + radius turn' (w x t - turn' o). What k adds to the loops
of `bounds.py`, of which r.t = 0 takes out turn'' at the second order and turn''' at the third:

    b' = w x b + k,   second: -r.(2 w x k) + radius turn'^2 r.o
    third: -r.(2 w' x k + w x (w x k) + w x k' + k'')

each bounded by norms, with turn' and turn'' at their largest and s at its least; |u| and |turn'| are at most what they are
in the middle and what they change by in half a move.
"""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, dot, lengths, unit
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(radius="K", away="N K 3", axis="N 3", centre="N K 3")
class EndsOnRings:
    """Ends of K rods in the middle of N moves; all is 0 of rods that end on none.

    Attributes:
        radius: (K,) mm, 0 of none
        away: (N, K, 3) mm from the platform's reference point to the foot
        axis: (N, 3) z of the platform
        centre: (N, K, 3) mm from the reference point to the middle of the ring
    """

    radius: Floats
    away: Floats
    axis: Floats
    centre: Floats

    @property
    def _aside(self) -> Floats:
        """(N, K, 3) mm: s o."""
        apart = self.away - self.centre
        axis = np.broadcast_to(self.axis[:, None], apart.shape)
        return np.asarray(apart - dot(apart, axis)[:, :, None] * axis, dtype=np.float64)

    def passing(self, twist: Floats) -> Floats:
        """(N, K, 3) mm: u of platforms that move by the twist (N, 6)."""
        return -twist[:, None, :3] - cross(twist[:, None, 3:], self.away)

    def moved(self, twist: Floats) -> Floats:
        """(N, K, 3) mm: k of a twist (N, 6)."""
        along = cross(np.broadcast_to(self.axis[:, None], self._out.shape), self._out)
        return np.asarray((self.radius * self._rate(twist))[:, :, None] * along, dtype=np.float64)

    @property
    def _out(self) -> Floats:
        """(N, K, 3): o."""
        return unit(self._aside, 0.0)

    def _rate(self, twist: Floats) -> Floats:
        """(N, K) rad: turn'."""
        far = lengths(self._aside)
        round_ = dot(self.passing(twist), cross(np.broadcast_to(self.axis[:, None], self._out.shape), self._out))
        return np.where(self.radius > 0.0, round_ / np.where(far > 0.0, far, np.nan), 0.0)

    def bent(self, rods: Floats, twist: Floats) -> Floats:
        """(N, K) what the ends that go round add to the right side of second order, of rods (N, K, 3)."""
        k, inward = self.moved(twist), self.radius * self._rate(twist) ** 2 * dot(rods, self._out)
        return np.asarray(inward - 2.0 * dot(rods, cross(np.broadcast_to(twist[:, None, 3:], k.shape), k)), dtype=np.float64)

    def at_most(self, twist: Floats, spin: Floats, far: Floats, bend: Floats, lever: float) -> RingsAtMost:
        """Over whole moves with the twist (N, 6) in their middle, while |w| <= `spin` (N,), |(v', lever w')| <= `bend` (N,)
        and |A - C| <= `far` (N, K) mm; NaN where a foot may come to z or go round too far."""
        t, half = spin[:, None], 0.5
        turned = bend[:, None] * np.hypot(1.0, far / lever) + t**2 * far
        passing = (lengths(self.passing(twist)) + half * turned) / _left(1.0 - t)
        least = np.where(self.radius > 0.0, _left(lengths(self._aside) - half * passing), np.inf)
        passes = turned + 2.0 * t * passing
        rate = (np.abs(self._rate(twist)) + half * passes / least) / _left(1.0 - passing / least)
        return RingsAtMost(self.radius, t, bend[:, None] / lever, rate, (passes + 2.0 * passing * rate) / least)


def _left(of: Floats) -> Floats:
    return np.where(of > 0.0, of, np.nan)


@dataclass(frozen=True, eq=False)
@arrays(radius="K", spin="N 1", spun="N 1", rate="N K", change="N K")
class RingsAtMost:
    """What ends that go round do at most.

    Attributes:
        radius: (K,) mm
        spin, spun: (N, 1) rad, |w| and |w'|
        rate, change: (N, K) rad, |turn'| and |turn''|
    """

    radius: Floats
    spin: Floats
    spun: Floats
    rate: Floats
    change: Floats

    @property
    def moved(self) -> Floats:
        """(N, K) mm: |k|."""
        return np.asarray(self.radius * self.rate, dtype=np.float64)

    @property
    def _moves(self) -> Floats:
        """(N, K) mm: |k'|."""
        return np.asarray(self.radius * (self.change + self.rate * (self.spin + self.rate)), dtype=np.float64)

    @property
    def bent(self) -> Floats:
        """(N, K) mm: |w x k + k'|, what they add to |r''|."""
        return np.asarray(self.spin * self.moved + self._moves, dtype=np.float64)

    @property
    def third(self) -> Floats:
        """(N, K) mm: the part of the right side of third order, per mm of the rod; of k'' what r.t = 0 leaves."""
        w, n, change = self.spin, self.rate, self.change
        left = 2.0 * change * (w + n) + n * (self.spun + w**2 + 2.0 * n * w + change)
        return np.asarray((2.0 * self.spun + w**2) * self.moved + w * self._moves + self.radius * left, dtype=np.float64)
