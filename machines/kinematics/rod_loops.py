"""A platform on rods along straight slide moves, with a bound of its third derivative over the whole move.

The platform follows from the rods' fixed lengths, differentiated three times; that Jx stays regular all along
the move is proved with it, and where it cannot be, there is no bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from machines.kinematics.sliders import Legs, solved
from machines.kinematics.taylor import TaylorAngle, TaylorVector
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_ROUNDS = 6
_GROWTH = 1.02
_PARTS, _AGAIN = 4, 2
UNBOUNDED = 1e30
"""a third derivative for which no bound was found"""
Jets = tuple[TaylorVector, TaylorVector]


def by_parts(jets: Callable[[Floats, Floats], Jets], q0: Floats, q1: Floats, again: int = _AGAIN) -> Jets:
    """`jets` of the moves q0 -> q1 (N, J); where a whole move is too long for a bound, the largest of the
    bounds of its parts, each over a shorter time, and these by parts `again`."""
    whole = jets(q0, q1)
    third = [np.array(np.broadcast_to(jet.third, len(q0)), dtype=np.float64) for jet in whole]
    rows = np.flatnonzero((np.maximum(*third) >= UNBOUNDED) & np.isfinite(q0).all(axis=1) & np.isfinite(q1).all(axis=1))
    if len(rows) and again:
        cuts = [q0[rows] + k / _PARTS * (q1[rows] - q0[rows]) for k in range(_PARTS + 1)]
        parts = by_parts(jets, np.concatenate(cuts[:-1]), np.concatenate(cuts[1:]), again - 1)
        for column, jet in zip(third, parts, strict=True):
            most = np.broadcast_to(jet.third, len(rows) * _PARTS).reshape(_PARTS, -1).max(axis=0)
            column[rows] = np.minimum(most * _PARTS**3, UNBOUNDED)
    tip, axis = (replace(jet, third=column) for jet, column in zip(whole, third, strict=True))
    return tip, axis


@dataclass(frozen=True)
@arrays(rods="N K 3", arms="N K 3", step="N K")
class RodLoop:
    """The closed loops of a platform along straight slide moves.

    With r_k the rods (from carriage to platform joint), b_k the arms (from the reference point C to the
    joint, turned), e_k = x x b_k and the tilt T about x, the rods' lengths stay: r.r = L^2, with r = C + b -
    A and the carriages A moving evenly. Differentiated once, twice and three times (II-15 to II-18 and V-23
    of Company 2000 carried on):

        r.r' = 0,   r.r'' = -r'^2,   r.r''' = -3 r'.r'',
        r' = C' + T'e - A',   r'' = C'' + T''e - T'^2 f,   r''' = C''' + T'''e - 3 T'T''f - T'^3 e,   f = b across x,

    linear systems with the matrix Jx = (r, r.e) for C and T at each order. Over the whole move everything on
    the right is bounded by norms; Jx differs from its value in the middle by at most what its rows can change
    in half the move, which bounds its least singular value from below. The bounds assume a largest |r'| and a
    largest T', and hold if
    they come out smaller: by continuity no rod can then leave them (as in Kantorovich's theorem).

    Attributes:
        rods, arms: (N, K, 3) mm in the middle
        step: (N, K) mm of the slides
        tilts: False for a platform that only translates
    """

    rods: Floats
    arms: Floats
    legs: Legs
    step: Floats
    tilts: bool

    def jets(self, place: Floats, tilt: Floats) -> tuple[TaylorVector, TaylorAngle]:
        """(C, tilt) along the move from their values (N, 3), (N,) in the middle."""
        first, rate, rod_rates = self._first()
        second = self._solved(-np.einsum("nki,nki->nk", rod_rates, rod_rates)
                              + rate[:, None] ** 2 * np.einsum("nki,nki->nk", self.rods, self._across))
        third = self._third(first, rate, rod_rates)
        c2, t2 = second[:, :3], second[:, 3] / self._lever if self.tilts else np.zeros(len(tilt))
        return (TaylorVector(_columns(place), _columns(first), _columns(c2), third),
                TaylorAngle(tilt, rate, t2, third / self._lever if self.tilts else 0.0))

    @cached_property
    def _across(self) -> Floats:
        """f: the arms' part across x."""
        result: Floats = self.arms * np.array([0.0, 1.0, 1.0])
        return result

    @cached_property
    def _along(self) -> Floats:
        """e = x x b."""
        along = np.zeros(self.arms.shape)
        along[..., 1], along[..., 2] = -self.arms[..., 2], self.arms[..., 1]
        return along

    @cached_property
    def _reach(self) -> Floats:
        """(K,) mm: |e| of each leg, the same at every tilt that is reached."""
        if not len(self.arms):
            return np.zeros(self.arms.shape[1])
        return np.asarray(np.nan_to_num(np.fmax.reduce(np.linalg.norm(self._along, axis=2), axis=0)), dtype=np.float64)

    @cached_property
    def _lever(self) -> float:
        """mm per rad that makes the tilt a length, so that norms mean something."""
        return max(float(self._reach.max(initial=0.0)), 1.0)

    @cached_property
    def _jx(self) -> Floats:
        if not self.tilts:
            return self.rods
        moment = np.einsum("nki,nki->nk", self.rods, self._along) / self._lever
        return np.concatenate([self.rods, moment[..., None]], axis=2)

    def _solved(self, right: Floats) -> Floats:
        result = solved(self._jx, right)
        result[~np.isfinite(right).all(axis=1)] = np.nan
        return result

    def _first(self) -> tuple[Floats, Floats, Floats]:
        """(C' (N, 3), T' (N,), r' (N, K, 3)) in the middle."""
        moved = self.step[..., None] * self.legs.directions
        x = self._solved(np.einsum("nki,nki->nk", self.rods, moved))
        rate = x[:, 3] / self._lever if self.tilts else np.zeros(len(x))
        return x[:, :3], rate, x[:, None, :3] + rate[:, None, None] * self._along - moved

    def _third(self, first: Floats, rate: Floats, rod_rates: Floats) -> Floats:
        """Bound (N,) of |(C''', lever T''')| over the move; UNBOUNDED where the loops cannot be."""
        at_middle: Floats = np.asarray(np.linalg.norm(rod_rates, axis=2), dtype=np.float64)
        speed: Floats = at_middle * _GROWTH
        turn = np.abs(rate) * _GROWTH
        least = np.linalg.svd(np.nan_to_num(self._jx), compute_uv=False)[:, -1]
        result = np.full(len(rate), UNBOUNDED)
        for _ in range(_ROUNDS):
            bend, rod_bend, grip = self._bounds(speed, turn, least)
            new_speed, new_turn = at_middle + 0.5 * rod_bend, np.abs(rate) + 0.5 * bend / self._lever
            held = (new_speed <= speed).all(axis=1) & (new_turn <= turn)
            result[held] = np.minimum(result[held], self._third_of(speed, turn, bend, rod_bend, grip)[held])
            speed = np.asarray(new_speed * _GROWTH)
            turn = new_turn * _GROWTH
        return result

    def _bounds(self, speed: Floats, turn: Floats, least: Floats) -> tuple[Floats, Floats, Floats]:
        """(|(C'', lever T'')| (N,), |r''| (N, K), 1 / least singular value of Jx (N,)) while |r'| <= speed, |T'| <= turn.

        NaN where Jx might become singular."""
        reach, lengths, t = self._reach, self.legs.lengths, turn[:, None]
        rows = np.hypot(speed, (reach * speed + t * reach * lengths) / self._lever if self.tilts else 0.0)
        left = least - 0.5 * np.sqrt((rows**2).sum(axis=1))
        grip = 1.0 / np.where(left > 0.0, left, np.nan)
        bend = grip * np.sqrt(((speed**2 + t**2 * reach * lengths) ** 2).sum(axis=1))
        tilt = bend[:, None] * reach / self._lever if self.tilts else 0.0
        return bend, bend[:, None] + tilt + t**2 * reach, grip

    def _third_of(self, speed: Floats, turn: Floats, bend: Floats, rod_bend: Floats, grip: Floats) -> Floats:
        reach, lengths, t = self._reach, self.legs.lengths, turn[:, None]
        tilt_bend = bend[:, None] / self._lever if self.tilts else 0.0 * bend[:, None]
        right = 3.0 * speed * rod_bend + (3.0 * t * tilt_bend + t**3) * reach * lengths
        return np.asarray(grip * np.sqrt((right**2).sum(axis=1)), dtype=np.float64)


def _columns(rows: Floats) -> list[Floats | float]:
    return list(rows.T)
