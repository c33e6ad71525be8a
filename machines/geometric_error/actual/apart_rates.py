"""How differently a platform with errors and the same one without move as their drives go: a bound all along a move.

Both are driven alike: W J = D of each, W its rows (r, b x r / lever), J what the drives do (`rod_rates.py`). With d for what
is different, e with errors and n without, the end of a rod moving by x' = v + w x b - A', on a bar v + w x R h + o x p - A',

    W_e dJ = r_e.dA' + dl l' - dr.x'_n - r_e.(w_n x db)

so that dJ is small because errors are, however far the drives go; what moves both alike does not count. dr and db grow by dJ
and by what turns them; a bound of dJ that comes out smaller than it was assumed holds all along the move, by continuity. A
platform held by planes has their rows too (`kinematics/holds.py`); the end on a ring is where it is nearest.
"""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_ROUNDS, _GROWTH, _SMALL = 24, 1.2, 1e-18


@dataclass(frozen=True, eq=False)
@arrays(normals="N H 3", arms="N H 3", moves="H", travels="H", gain="N H K")
class HeldRows:
    """Rows (m e, a x e) of what holds N platforms besides rods.

    Attributes:
        normals, arms: (N, H, 3) e; a, mm
        moves, travels: (H,) m; 1 of planes that go with the platform
        gain: (N, H, K) mm that drives take feet out of planes by, at most, times `weight`
        weight: mm, of the rows
    """

    normals: Floats
    arms: Floats
    moves: Floats
    travels: Floats
    gain: Floats
    weight: float


@dataclass(frozen=True, eq=False)
@arrays(radius="R", joints="R 3", aside="N R")
class RingEnds:
    """Rods that end on rings: radii (R,) mm, 0 of none; middles of the rings on the platform (R, 3) mm; mm from their lines
    to the feet at least (N, R)."""

    radius: Floats
    joints: Floats
    aside: Floats


@dataclass(frozen=True, eq=False)
@arrays(on="R", own="R", hinges="R 3", joints="R 3", bodies="N R 3 3", lines="R 3", turns="N R K", about="N R K")
class BarEnds:
    """Rods that hold bars (`bar_loops.py`); rows of others count nothing.

    Attributes:
        on: (R,) 1 of those; own: (R,) mm, |p|
        hinges, joints: (R, 3) mm, h and j; lines: (R, 3) s; in directions of the platform, j in those of the bar
        bodies: (N, R, 3, 3) turns of the bars
        turns, about: (N, R, K) rad, |o| and its change per rad of s, at most
    """

    on: Floats
    own: Floats
    hinges: Floats
    joints: Floats
    bodies: Floats
    lines: Floats
    turns: Floats
    about: Floats


@dataclass(frozen=True, eq=False)
@arrays(place="N 3", turned="N 3 3", columns="N 6 K", rods="N R 3", arms="N R 3", size="R", moves="R 2 3", own="R K",
        stretch="R", length="N R", least="N", rates="N R K", shift="N K", turn="N K")
class Closure:
    """N platforms on R rods and what K drives do to them, at most, while they go as far as they may.

    Attributes:
        place, turned: (N, 3) mm, (N, 3, 3)
        columns: (N, 6, K) (v, w) per mm or rad of each drive, there
        rods, arms: (N, R, 3) mm, r and b; size: (R,) |b| at most
        moves: (R, 2, 3) what A' is made of: u and 0 of slides, u x a and a of arms
        own: (R, K) 1 where a drive is a rod's own; stretch: (R,) l'; length: (N, R) mm at most
        least: (N,) smallest singular value of W, turns by `lever`, at least; NaN where none is known
        rates, shift, turn: (N, R, K), (N, K) and (N, K) |x'|, |v| and |w| at most
        lever: mm per rad
    """

    place: Floats
    turned: Floats
    columns: Floats
    rods: Floats
    arms: Floats
    size: Floats
    moves: Floats
    own: Floats
    stretch: Floats
    length: Floats
    least: Floats
    rates: Floats
    shift: Floats
    turn: Floats
    lever: float
    holds: HeldRows | None = None
    rings: RingEnds | None = None
    bars: BarEnds | None = None

    @property
    def feet(self) -> Floats:
        """A (N, R, 3)"""
        return np.asarray(self.place[:, None] + self.arms - self.rods)


@dataclass(frozen=True, eq=False)
@arrays(rate="N K", arm="N R")
class DifferencesAtMost:
    """|dJ| (N, K) mm, turns by the lever, and |db| (N, R), at most."""

    rate: Floats
    arm: Floats

    @property
    def all(self) -> Floats:
        """(N, K + R) of them."""
        return np.hstack([self.rate, self.arm])

    def over(self, least: DifferencesAtMost) -> DifferencesAtMost:
        """A little more than the larger of both."""
        pairs = ((getattr(self, name), getattr(least, name)) for name in ("rate", "arm"))
        return DifferencesAtMost(*(_GROWTH * np.fmax(one, other) + _SMALL for one, other in pairs))


@dataclass(frozen=True, eq=False)
@arrays(reach="N K")
class Apart:
    """Platforms with errors and without, whose drives go by up to `reach` (N, K)."""

    actual: Closure
    nominal: Closure
    reach: Floats

    def rates(self) -> tuple[Floats, Floats]:
        """((N, K) mm that (dv, lever dw) are at most, infinite where no bound was found; (N,) rad between their turns)."""
        e, n = self.actual, self.nominal
        rate, angle = np.full(self.reach.shape, np.inf), np.full(len(self.reach), np.inf)
        scale = np.repeat([1.0, e.lever], 3)[:, None]
        guess = DifferencesAtMost(np.linalg.norm(scale * (e.columns - n.columns), axis=1), _apart(e.arms, n.arms))
        guess = guess.over(guess)
        open_ = e.least > 0.0
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            for _ in range(_ROUNDS):
                found = self._found(guess)
                good = open_ & (found.all <= guess.all).all(axis=1)
                rate[good], angle[good] = guess.rate[good], self._angle(guess)[good]
                open_ &= ~good
                if not open_.any():
                    break
                guess = found.over(guess)
        return rate, angle

    def _angle(self, at: DifferencesAtMost) -> Floats:
        """(N,) rad between the turns of both."""
        e, n = self.actual, self.nominal
        apart = np.linalg.norm(np.swapaxes(n.turned, 1, 2) @ e.turned - np.eye(3), axis=(1, 2))
        return np.asarray(apart + (at.rate * self.reach).sum(axis=1) / e.lever)

    def _shift(self, at: DifferencesAtMost) -> Floats:
        """(N,) mm between the places of both."""
        apart = np.linalg.norm(self.actual.place - self.nominal.place, axis=1)
        return np.asarray(apart + (at.rate * self.reach).sum(axis=1))

    def _found(self, at: DifferencesAtMost) -> DifferencesAtMost:
        """What follows from what is assumed."""
        e, n, go = self.actual, self.nominal, self.reach[:, None]
        turn, spun = at.rate[:, None] / e.lever, n.turn[:, None]
        spins, size = spun * at.arm[:, :, None], e.size
        if e.bars is not None and n.bars is not None:
            spins, size = self._of_bars(at, (e.bars, n.bars), spins), e.size + 2.0 * e.bars.own
        feet = np.linalg.norm(e.moves - n.moves, axis=(1, 2))[:, None] * e.own
        arm = _apart(e.arms, n.arms) + ((turn * e.size[:, None] + spun * at.arm[:, :, None]) * go).sum(axis=2)
        ends = at.rate[:, None] * np.hypot(1.0, size / e.lever)[:, None] + spins + feet
        rod = _apart(e.rods, n.rods) + (ends * go).sum(axis=2)
        if e.rings is not None and n.rings is not None:
            arm, rod = self._on_rings(at, (e.rings, n.rings), arm, rod)
            spins = spun * arm[:, :, None]
        wrong = rod[:, :, None] * n.rates + e.length[:, :, None] * (feet + spins)
        wrong = wrong + (np.abs(e.length - n.length) * e.stretch)[:, :, None] * e.own
        if e.holds is not None and n.holds is not None:
            wrong = np.concatenate([wrong, self._of_holds(at, e.holds, n.holds)], axis=1)
        return DifferencesAtMost(np.linalg.norm(wrong, axis=1) / e.least[:, None], arm)

    def _of_bars(self, at: DifferencesAtMost, bars: tuple[BarEnds, BarEnds], spins: Floats) -> Floats:
        """(N, R, K) mm of w x d(R h) + o x dp + do x p, of rods on no bars `spins`."""
        (e, n), angle = bars, self._angle(at)[:, None]
        hinge = np.linalg.norm(e.hinges - n.hinges, axis=1) + angle * np.linalg.norm(n.hinges, axis=1)
        line = np.linalg.norm(e.lines - n.lines, axis=1) + angle
        apart = np.linalg.norm(np.swapaxes(n.bodies, 2, 3) @ e.bodies - np.eye(3), axis=(2, 3))
        other = n.about * line[:, :, None]
        apart = apart + ((2.0 * (at.rate / self.actual.lever)[:, None] + other) * self.reach[:, None]).sum(axis=2)
        end = np.linalg.norm(e.joints - n.joints, axis=1) + apart * n.own
        own = self.nominal.turn[:, None] * hinge[:, :, None] + n.turns * end[:, :, None] + other * e.own[:, None]
        return np.where(e.on[:, None] > 0.0, own, spins)

    def _on_rings(self, at: DifferencesAtMost, rings: tuple[RingEnds, RingEnds], arm: Floats,
                  rod: Floats) -> tuple[Floats, Floats]:
        """db and dr (N, R), where rods end on rings by the directions in which these lie nearest to the feet."""
        (e, n), angle, shift = rings, self._angle(at)[:, None], self._shift(at)[:, None]
        feet = _apart(self.actual.feet, self.nominal.feet)
        middle = np.linalg.norm(e.joints - n.joints, axis=1) + angle * np.linalg.norm(n.joints, axis=1)
        past = feet + shift + middle + 2.0 * angle * (self.nominal.length + n.radius)
        apart = middle + np.abs(e.radius - n.radius) + e.radius * past / np.minimum(e.aside, n.aside)
        on = e.radius > 0.0
        return np.where(on, apart, arm), np.where(on, shift + apart + feet, rod)

    def _of_holds(self, at: DifferencesAtMost, e: HeldRows, n: HeldRows) -> Floats:
        """(N, H, K) mm of the rows of planes."""
        angle, shift = 2.0 * self._angle(at)[:, None], 2.0 * self._shift(at)[:, None]
        size = np.linalg.norm(n.arms, axis=2) + n.travels * (self.nominal.shift * self.reach).sum(axis=1)[:, None]
        normals = _apart(e.normals, n.normals) + angle * n.travels
        arms = _apart(e.arms, n.arms) + shift * n.travels + angle * size * (1.0 - n.travels)
        turn, moved = self.nominal.turn[:, None], self.nominal.shift[:, None] * n.moves[:, None]
        rows = normals[:, :, None] * (moved + turn * size[:, :, None]) + turn * arms[:, :, None]
        return np.asarray(e.weight * rows + e.gain)


def _apart(one: Floats, other: Floats) -> Floats:
    """(N, R) between vectors (N, R, 3)."""
    return np.asarray(np.linalg.norm(one - other, axis=2))
