"""A platform on legs along straight moves of its drives, with a bound of its third derivative over the whole move.

`rod_loops.py` for any legs and freedoms. With r the rods, b the arms (turned), s the steps of the drives, A(q) their
joints, l(q) the lengths and (v, w) the platform's twist, f = r.r / 2 - l.l / 2 stays 0. Differentiated once, twice and
three times:

    r' = v + w x b - A',   b' = w x b,   b'' = w' x b + w x (w x b),   l'' = 0
    r.v + (b x r).w    =  r.A' + l l'
    r.v' + (b x r).w'  = -r'.r' + l'.l' - r.(w x (w x b)) + r.A''
    r.v'' + (b x r).w'' = -3 r'.r'' - r.(2 w' x (w x b) + w x (w' x b) + w x (w x (w x b))) + r.A'''

linear systems with the matrix Jx at each order; what holds a platform besides adds its rows (`holds.py`), ends of rods that
go round on rings their part of b' and of the right sides (`ring_ends.py`). Over the whole
move the right sides are bounded by norms; Jx differs from its value in the middle by at most what its rows can change in
half the move, which bounds its least singular value from below (Weyl). The bound assumes a largest (v'', w''), which with
(v, w) and (v', w') in the middle bounds these over the whole move, and holds if it comes out smaller: by continuity no
platform can then leave it.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from machines.kinematics import columns
from machines.kinematics.holds import Holds
from machines.kinematics.legs.loops import Loops
from machines.kinematics.legs.ring_ends import EndsOnRings
from machines.kinematics.rod_loops import UNBOUNDED
from machines.kinematics.sliders import solved
from machines.kinematics.taylor import TaylorAngle, TaylorVector
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross, dot, lengths
from toolpaths.shapes import arrays

_ROUNDS, _GROWTH = 6, 1.02


@dataclass(frozen=True)
@arrays(place="N 3", turn="N 3 3", first="N 6", second="N 6", spin="N", bend="N", third="N")
class PlatformJets:
    """A platform that moves: rates at the middle of the move, bounds over all of it; turns count by the lever.

    Attributes:
        place, turn: (N, 3) mm and (N, 3, 3)
        first, second: (N, 6) twist (v, w) and its derivative in the middle
        spin, bend, third: (N,) bounds of |w|, |w'| and |(v'', lever w'')|; third is UNBOUNDED where none was found
        lever: mm per rad
    """

    place: Floats
    turn: Floats
    first: Floats
    second: Floats
    spin: Floats
    bend: Floats
    third: Floats
    lever: float

    def point(self, arm: Floats) -> TaylorVector:
        """A point `arm` (3,) mm from the reference point, in directions of the platform."""
        return self._jet(arm, 1.0)

    def direction(self, axis: Floats) -> TaylorVector:
        """A direction (3,) that turns with the platform."""
        return self._jet(axis, 0.0)

    def carried(self, own: TaylorVector, moves: float) -> TaylorVector:
        """A point (moves = 1, from the reference point) or a direction (0) that itself moves on the platform."""
        n, w, bend = len(self.turn), self.first[:, 3:], self.second[:, 3:]
        b, b1, b2 = ((self.turn @ columns.to_rows(part, n)[:, :, None])[:, :, 0] for part in (
            own.value, own.first, own.second))
        first = moves * self.first[:, :3] + cross(w, b) + b1
        second = moves * self.second[:, :3] + cross(bend, b) + cross(w, cross(w, b)) + 2.0 * cross(w, b1) + b2
        size = lengths(columns.to_rows(own.value, n)) + 0.5 * own.speed()
        third = self.third * (moves + size / self.lever) + (3.0 * self.bend * self.spin + self.spin**3) * size
        third = third + 3.0 * (self.bend + self.spin**2) * own.speed() + 3.0 * self.spin * own.bend() + own.third
        return TaylorVector(list((moves * self.place + b).T), list(first.T), list(second.T), np.minimum(third, UNBOUNDED))

    def tilting(self, tilt: Floats, about: int) -> tuple[TaylorVector, TaylorAngle]:
        """The reference point, and the tilt (N,) of a platform that turns about x, y or z (0, 1, 2) alone."""
        return self._jet(np.zeros(3), 1.0), TaylorAngle(tilt, self.first[:, 3 + about], self.second[:, 3 + about],
                                                        self.third / self.lever)

    def _jet(self, arm: Floats, moves: float) -> TaylorVector:
        b, w, bend = self.turn @ arm, self.first[:, 3:], self.second[:, 3:]
        first = moves * self.first[:, :3] + cross(w, b)
        second = moves * self.second[:, :3] + cross(bend, b) + cross(w, cross(w, b))
        size = float(np.linalg.norm(arm))
        third = self.third * np.hypot(moves, size / self.lever) + (3.0 * self.bend * self.spin + self.spin**3) * size
        return TaylorVector(list((moves * self.place + b).T), list(first.T), list(second.T), np.minimum(third, UNBOUNDED))


@dataclass(frozen=True, eq=False)
@arrays(place="N 3", turn="N 3 3", q="N K", step="N K")
class MovingLoops:
    """The loops along straight moves of the drives by `step` (N, K), `place`, `turn` and `q` those in the middle."""

    loops: Loops
    place: Floats
    turn: Floats
    q: Floats
    step: Floats

    def jets(self) -> PlatformJets:
        """See the file."""
        drives, b, r, s = self.loops.drives, self._arms, self._rods, self.step
        moved = drives.moved(self.q) * s[:, :, None]
        first = self._solved(self.loops.driven(drives.gains(r, self.q) * s))
        v, w = first[:, None, :3], first[:, None, 3:]
        turns = cross(w, b)
        rod_rates = v + turns - moved + (0.0 if self._rings is None else self._rings.moved(first))
        curved = np.where(drives.arm, s * s, 0.0)[:, :, None] * -self._drive_arms
        held = None if self.loops.holds is None else -self.loops.holds.bent(self.place, self.turn, first)
        right = (drives.stretch * s) ** 2 - dot(rod_rates, rod_rates) + dot(r, curved - cross(w, turns))
        second = self._solved(self.loops.driven(right if self._rings is None else right + self._rings.bent(r, first), held))
        spin, bend, third = self._bounds(lengths(rod_rates), first, second)
        return PlatformJets(self.place, self.turn, first, second, spin, bend, third, self._lever)

    @cached_property
    def _arms(self) -> Floats:
        return self.loops.arms_at(self.place, self.turn)

    @cached_property
    def _rings(self) -> EndsOnRings | None:
        if self.loops.rings is None:
            return None
        away = self.loops.drives.points - self.place[:, None]
        return EndsOnRings(self.loops.rings, away, self.turn[:, :, 2], self.loops.arms(self.turn))

    @cached_property
    def _rods(self) -> Floats:
        return self.loops.matrix_at(self.place, self.turn, self.q)[1]

    @cached_property
    def _drive_arms(self) -> Floats:
        """(N, K, 3) mm: Rot(u, q) a."""
        return np.asarray(np.where(self.loops.drives.arm[:, None], self.loops.drives.feet(self.q) - self.loops.drives.points,
                                   0.0), dtype=np.float64)

    @cached_property
    def _jx(self) -> Floats:
        return self.loops.matrix(self._rods, self._arms, (self.place, self.turn))

    def _solved(self, right: Floats) -> Floats:
        x = solved(self._jx, right)
        x[~np.isfinite(right).all(axis=1)] = np.nan
        return self.loops.twists(x)

    @property
    def _lever(self) -> float:
        """mm per rad, of a platform that does not turn without end."""
        return self.loops.lever if self.loops.turns else np.inf

    @cached_property
    def _reach(self) -> Floats:
        """(K,) mm: |b| at most, 0 of a platform that does not turn."""
        b, rings = self.loops.joints, 0.0 if self.loops.rings is None else self.loops.rings
        return np.asarray(np.hypot(np.hypot(b[:, 0], b[:, 1]) + rings, b[:, 2]) * bool(self.loops.turns), dtype=np.float64)

    @cached_property
    def _longest(self) -> Floats:
        """(N, K) mm: the rods at most."""
        drives = self.loops.drives
        return np.asarray(drives.spans(self.q) + 0.5 * np.abs(self.step) * drives.stretch, dtype=np.float64)

    @cached_property
    def _drive(self) -> tuple[Floats, Floats, Floats]:
        """Bounds (N, K) of l', |A''| and |A'''|."""
        drives, s = self.loops.drives, np.abs(self.step)
        arm = np.where(drives.arm, drives.size, 0.0)
        return drives.stretch * s, arm * s**2, arm * s**3

    def _bounds(self, rod_speed: Floats, first: Floats, second: Floats) -> tuple[Floats, Floats, Floats]:
        """Bounds (N,) of |w|, |w'| and |(v'', lever w'')| from |r'| (N, K), the twist (N, 6) and its derivative in the
        middle; UNBOUNDED where none."""
        lever = self._lever
        spin, pace = lengths(first[:, 3:]), lengths(first[:, :3])
        bend = np.hypot(lengths(second[:, :3]), lever * lengths(second[:, 3:]) if self.loops.turns else 0.0)
        least = np.linalg.svd(np.nan_to_num(self._jx), compute_uv=False)[:, -1]
        result, assumed = np.full((3, len(first)), UNBOUNDED), np.zeros(len(first))
        for _ in range(_ROUNDS):
            most = bend + 0.5 * assumed
            spun, paced = spin + 0.5 * most / lever, pace + 0.5 * most
            third = self._third(rod_speed, first, (spun, paced, most), least)
            good = (third <= assumed) & (third < result[2])
            result[:, good] = np.stack([spun, most / lever, third])[:, good]
            assumed = third * _GROWTH
        return result[0], result[1], result[2]

    def _third(self, rod_speed: Floats, first: Floats, most: tuple[Floats, Floats, Floats], least: Floats) -> Floats:
        """Bound (N,) of |(v'', lever w'')| while |w|, |v| and |(v', lever w')| are at `most`, each (N,); NaN where Jx might
        become singular."""
        (spin, pace, bend), reach, longest, lever = most, self._reach, self._longest, self._lever
        t, (_, curved, sharp) = spin[:, None], self._drive
        rod_bend, arms = bend[:, None] * np.hypot(1.0, reach / lever) + t**2 * reach + curved, t * reach
        turning = (3.0 * spin * bend / lever + spin**3)[:, None] * reach + sharp
        if self._rings is not None:
            ends = self._rings.at_most(first, spin, longest + reach, bend, lever)
            rod_bend, arms, turning = rod_bend + ends.bent, arms + ends.moved, turning + ends.third
        speed = rod_speed + 0.5 * rod_bend
        rows = (np.hypot(speed, (reach * speed + arms * longest) / lever) ** 2).sum(axis=1)
        right = ((3.0 * speed * rod_bend + longest * turning) ** 2).sum(axis=1)
        if self.loops.holds is not None:
            held = HeldBounds(self.loops.holds, self.loops.weight, self.loops.holds.reach(self.place), pace, spin, lever)
            rows, right = rows + held.rows(), right + held.third(bend)
        left = least - 0.5 * np.sqrt(rows)
        return np.asarray(np.sqrt(right) / np.where(left > 0.0, left, np.nan), dtype=np.float64)


@dataclass(frozen=True)
@arrays(reach="N H", pace="N", spin="N")
class HeldBounds:
    """What holds add to the sums of squares of the bounds, each over a whole move of which the middle is known.

    Attributes:
        weight: mm, of their rows
        reach: (N, H) mm, |a| in the middle
        pace, spin: (N,) |v| and |w| at most
        lever: mm per rad
    """

    holds: Holds
    weight: float
    reach: Floats
    pace: Floats
    spin: Floats
    lever: float

    @property
    def _farthest(self) -> Floats:
        """(N, H) mm: |a| at most."""
        return np.asarray(self.reach + 0.5 * self.holds.travels * self.pace[:, None], dtype=np.float64)

    def rows(self) -> Floats:
        """(N,) square of what the rows of Jx change by in a whole move."""
        t, v, of = self.spin[:, None], self.pace[:, None], self.holds.travels
        moments = (self._farthest * t + of * v) / self.lever
        return np.asarray(self.weight**2 * (moments**2 + of * t**2).sum(axis=1), dtype=np.float64)

    def third(self, bend: Floats) -> Floats:
        """(N,) square of those of third order: a (3 w w' + w^3), of planes of the platform 3 v' w + 3 v (w' + w^2) more;
        `bend` (N,) bounds |(v', lever w')|."""
        t, v, b = self.spin[:, None], self.pace[:, None], bend[:, None]
        w = b / self.lever
        right = self._farthest * (3.0 * t * w + t**3) + 3.0 * self.holds.travels * (b * t + v * (w + t**2))
        return np.asarray(self.weight**2 * (right**2).sum(axis=1), dtype=np.float64)
