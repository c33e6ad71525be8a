"""A platform on four legs that moves by three translations and one turn about a fixed direction: its closed forms.

With C the platform's reference point, theta its turn and b_k the joints that turn with it: B_k = C + R(theta) b_k + what
keeps its direction. Source: Company 2000, V.4.2, V.7 (V-22, V-23: asymmetric H4, turn about x), V.6 (V-10, V-16, V-18:
symmetric H4, turn about z). Platform coordinates are (x, y, z of C in mm, theta in rad), called `p` (N, 4).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from machines.kinematics.columns import blocks
from machines.kinematics.legs.loops import Loops
from machines.kinematics.legs.one_turn_modes import candidates
from machines.kinematics.sliders import determinant, platform_rates, solved
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass

STEPS = 30
"""Newton steps at most"""
CLOSED = 1e-12
"""largest (|AB|^2 - l^2) / 2 l^2 of a solved platform"""
LEVER = 100.0
"""mm per rad when poses are compared"""
TRUSTED = 0.25
"""a Newton solution farther than this from where it began (rad, or LEVER mm per rad) is checked against all modes"""
STARTS = 24
"""turns that Newton begins at where the polynomial of the turns vanishes: all spheres about points of one plane"""


@dataclass(frozen=True, eq=False)
class OneTurn:
    """The platform of `loops`, whose freedoms are x, y, z and one turn.

    Attributes:
        workspace: of C and theta; its middle is the home pose
    """

    loops: Loops
    workspace: Workspace

    @cached_property
    def order(self) -> list[int]:
        """x, y, z in cyclic order, the direction of the turn first"""
        k = "abc".index(self.loops.turns)
        return [k, (k + 1) % 3, (k + 2) % 3]

    @cached_property
    def side(self) -> float:
        """Sign of det Jx in the home assembly mode."""
        home = self.home[None]
        return float(np.sign(determinant(self.jx(home, self.inverse(home)))[0]))

    @property
    def home(self) -> Floats:
        """(4,): middle of the workspace, turn nearest 0"""
        return np.append(self.workspace.middle, np.clip(0.0, *self.workspace.tilt))

    def ends(self, p: Floats) -> Floats:
        """Platform joints B (N, 4, 3) mm."""
        return self._from(p[:, None, :3] + self._turned(p[:, 3]))

    def _from(self, turned: Floats) -> Floats:
        return turned if self.loops.kept is None else np.asarray(turned + self.loops.kept)

    def inverse(self, p: Floats) -> Floats:
        """Joints (N, 4) of the drives, V-22, NaN where a leg does not reach."""
        return self.loops.drives.solve(self.ends(p), self.loops.drives.roots)

    def jx(self, p: Floats, q: Floats) -> Floats:
        """(N, 4, 4): rows (AB, (CB x AB).u), V-23; mm and mm^2."""
        turned = self._turned(p[:, 3])
        return self._rows(self._from(p[:, None, :3] + turned) - self.loops.drives.feet(q), turned)

    def rates(self, p: Floats, q: Floats) -> Floats:
        """dp/dq (N, 4, 4)."""
        jx = self.jx(p, q)
        return platform_rates(jx, self.loops.drives.gains(jx[:, :, :3], q))

    def turn(self, theta: Floats) -> Floats:
        """R (N, 3, 3) of turns (N,)."""
        i, j, k = self.order
        result = np.tile(np.where(np.isfinite(theta), 0.0, np.nan)[:, None, None], (1, 3, 3))
        result[:, i, i] += 1.0
        result[:, j, j] = result[:, k, k] = np.cos(theta)
        result[:, k, j] = np.sin(theta)
        result[:, j, k] = -result[:, k, j]
        return result

    def turn_of(self, turn: Floats) -> Floats:
        """Turns (N,) of R (N, 3, 3): the inverse of `turn`."""
        _, j, k = self.order
        return np.asarray(np.arctan2(turn[:, k, j], turn[:, j, j]), dtype=np.float64)

    # ---- forward -------------------------------------------------------------------------------------------

    def forward(self, q: Floats, near: Floats | None = None) -> Floats:
        """Platform (N, 4) of joints (N, 4) in the mode nearest `near` (4,) or (N, 4), without it in the home mode.

        Home mode: the machine's own leg roots, the sign of det Jx and the range of the turn as in the home pose; where more
        than one solution is such, the one nearest the home pose. Newton from `near` (home), checked; where it
        leads elsewhere, all modes are computed and the one asked for is taken.
        """
        start = np.broadcast_to(self.home if near is None else near, (len(q), 4))
        parts = [self._forward(q[part], start[part], near is None) for part in blocks(len(q))]
        return np.concatenate(parts) if parts else np.empty((0, 4))

    def _forward(self, q: Floats, start: Floats, home: bool) -> Floats:
        p, closed = self.newton(q, start)
        good = closed & (self.at_home(p, q) if home else _distance(p, start) < TRUSTED)
        rest = np.flatnonzero(~good & np.isfinite(q).all(axis=1))
        p[~good] = np.nan
        if len(rest):
            p[rest] = self._pick(q[rest], None if home else start[rest])
        return p

    def modes(self, q: Floats) -> Floats:
        """All real assembly modes (8, N, 4) of joints q (N, 4): the home mode first, then by distance from it, NaN after.

        The elimination of C leaves a polynomial of degree 8 in exp(i theta) (`one_turn_modes`), which gives the 8
        solutions counted for such machines (V.6.1.2, V.7.1.2); each root is refined on the four rod equations.
        """
        seeds = self._seeds(q)
        count, n = seeds.shape[:2]
        every = np.tile(q, (count, 1))
        p, closed = self.newton(every, seeds.reshape(-1, 4))
        p = np.where(closed[:, None], p, np.nan)
        p[:, 3] = _wrap(p[:, 3])
        away = ~self.at_home(p, every).reshape(count, n)
        p = p.reshape(count, n, 4)
        far = _distance(p, self.home)
        order = np.argsort(np.where(np.isnan(far), np.inf, far) + np.where(away, 1e6, 0.0), axis=0)
        found = _distinct(np.take_along_axis(p, order[:, :, None], axis=0))
        return self.newton(np.tile(q, (len(found), 1)), found.reshape(-1, 4))[0].reshape(found.shape)

    def _seeds(self, q: Floats) -> Floats:
        """Where Newton begins (M, N, 4)."""
        drives, order = self.loops.drives, self.order
        feet = drives.feet(q) if self.loops.kept is None else drives.feet(q) - self.loops.kept
        found = candidates(feet[:, :, order], self.loops.joints[:, order], drives.spans(q))
        seeds = np.empty(found.shape)
        seeds[..., order], seeds[..., 3] = found[..., :3], found[..., 3]
        none = np.isnan(seeds[..., 3]).all(axis=0)
        if not none.any():
            return seeds
        more = np.full((2 * STARTS, len(q), 4), np.nan)
        middle = np.nanmean(feet, axis=1)
        for k, sign in enumerate(np.repeat([1.0, -1.0], STARTS)):
            place = middle + sign * (self.workspace.middle - middle)
            theta = 2.0 * np.pi * (k % STARTS) / STARTS
            more[k][none] = np.column_stack([place, np.full(len(q), theta)])[none]
        return np.concatenate([seeds, more])

    def at_home(self, p: Floats, q: Floats) -> Bools:
        """True (N,) where p belongs to the home mode: leg roots, sign of det Jx, range of the turn."""
        jx = self.jx(p, q)
        low, high = self.workspace.tilt
        inside = (p[:, 3] > low - TRUSTED) & (p[:, 3] < high + TRUSTED)
        result: Bools = inside & self.loops.drives.own(jx[:, :, :3], q) & (determinant(jx) * self.side > 0.0)
        return result

    def newton(self, q: Floats, start: Floats) -> tuple[Floats, Bools]:
        """(platform (N, 4), closed (N,)): Newton on the rod equations from `start` (N, 4)."""
        p = np.array(start, dtype=np.float64)
        closed = np.zeros(len(q), dtype=np.bool_)
        live = np.flatnonzero(np.isfinite(q).all(axis=1) & np.isfinite(p).all(axis=1))
        feet, squares, here = self.loops.drives.feet(q[live]), self.loops.drives.spans(q[live]) ** 2, p[live]
        if self.loops.kept is not None:
            feet = feet - self.loops.kept
        for _ in range(STEPS):
            if not len(live):
                break
            step, error = self._step(feet, squares, here)
            here -= step
            done = error < CLOSED
            left = ~done & np.isfinite(step).all(axis=1)
            if not left.all():
                p[live], closed[live] = here, done
                live, feet, squares, here = live[left], feet[left], squares[left], here[left]
        p[live] = here
        return p, closed

    def _step(self, feet: Floats, squares: Floats, p: Floats) -> tuple[Floats, Floats]:
        """(Newton step (N, 4), closure error (N,) relative to l^2)."""
        turned = self._turned(p[:, 3])
        rods = p[:, None, :3] + turned - feet
        gap = 0.5 * (np.einsum("nki,nki->nk", rods, rods) - squares)
        return solved(self._rows(rods, turned), gap), (np.abs(gap) / squares).max(axis=1)

    def _pick(self, q: Floats, near: Floats | None) -> Floats:
        modes = self.modes(q)
        if near is None:
            return np.where(self.at_home(modes[0], q)[:, None], modes[0], np.nan)
        far = _distance(modes, near)
        best = np.argmin(np.where(np.isnan(far), np.inf, far), axis=0)
        result: Floats = modes[best, np.arange(len(q))]
        return result

    def _turned(self, theta: Floats) -> Floats:
        """R(theta) b_k (N, 4, 3)."""
        i, j, k = self.order
        c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
        x, y, z = self.loops.joints[:, self.order].T
        turned = np.empty((len(theta), 4, 3))
        turned[..., i], turned[..., j], turned[..., k] = x, c * y - s * z, s * y + c * z
        return turned

    def _rows(self, rods: Floats, arms: Floats) -> Floats:
        _, j, k = self.order
        rows = np.empty((*rods.shape[:2], 4))
        rows[..., :3] = rods
        rows[..., 3] = arms[..., j] * rods[..., k] - arms[..., k] * rods[..., j]
        return rows


def _wrap(angle: Floats) -> Floats:
    result: Floats = angle - 2.0 * np.pi * np.ceil((angle - np.pi) / (2.0 * np.pi))
    return result


def _distance(a: Floats, b: Floats) -> Floats:
    """(...,) rad between platforms (..., 4): turn and place (LEVER mm per rad) together."""
    gap = a - b
    turn = _wrap(gap[..., 3])
    result: Floats = np.sqrt(np.sum(gap[..., :3] ** 2, axis=-1) / LEVER**2 + turn**2)
    return result


def _distinct(p: Floats) -> Floats:
    """The first 8 different solutions (8, N, 4) of sorted candidates (M, N, 4), NaN where fewer."""
    kept = np.full((8, *p.shape[1:]), np.nan)
    count = np.zeros(p.shape[1], dtype=np.int64)
    rows = np.arange(p.shape[1])
    for candidate in p:
        new = np.isfinite(candidate[:, 0]) & (count < 8)
        if not new.any():
            continue
        new &= ~np.any(_distance(candidate, kept) < 1e-7, axis=0)
        kept[count[new], rows[new]] = candidate[new]
        count[new] += 1
    return kept
