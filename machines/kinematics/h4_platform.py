"""Platform of the asymmetric H4 on linear slides: three translations and a tilt about the fixed direction x.

Legs 1 and 2 are pairs of parallel rods with the joints of a pair along x, which leaves the platform only the
turn about x; legs 3 and 4 are single rods. With C the platform's reference point, theta its tilt and b_k the joints in the
platform: B_k = C + Rx(theta) b_k. Source: Company 2000, V.4.2, V.7 (V-22, V-23). Platform coordinates are (x, y, z of
C in mm, theta in rad), called `p` (N, 4).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from machines.kinematics.columns import blocks
from machines.kinematics.h4_modes import candidates
from machines.kinematics.sliders import Legs, determinant, platform_rates, solved
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Bools, Floats
from toolpaths.shapes import arrays

STEPS = 30
"""Newton steps at most"""
CLOSED = 1e-12
"""largest (|AB|^2 - L^2) / 2 L^2 of a solved platform"""
LEVER = 100.0
"""mm per rad when poses are compared"""
TRUSTED = 0.25
"""a Newton solution farther than this from where it began (rad, or LEVER mm per rad) is checked against all modes"""


@dataclass(frozen=True, eq=False)
@arrays(joints="4 3")
class H4Platform:
    """Four legs (2 pairs, 2 rods) and the platform they carry.

    Attributes:
        legs: 4 legs
        joints: (4, 3) mm, b_k
        workspace: of C and theta; its middle is the home pose
        side: sign of det Jx in the home assembly mode
    """

    legs: Legs
    joints: Floats
    workspace: Workspace
    side: float = field(init=False)

    def __post_init__(self) -> None:
        home = self.home[None]
        jx = self.jx(home, self.legs.inverse(self.ends(home)))
        object.__setattr__(self, "side", float(np.sign(determinant(jx)[0])))

    @property
    def home(self) -> Floats:
        """(4,): middle of the workspace, tilt nearest 0"""
        return np.append(self.workspace.middle, np.clip(0.0, *self.workspace.tilt))

    def ends(self, p: Floats) -> Floats:
        """Platform joints B (N, 4, 3) mm."""
        return p[:, None, :3] + self._turned(p[:, 3])

    def inverse(self, p: Floats) -> Floats:
        """Slides (N, 4), V-22, NaN where a rod does not reach."""
        return self.legs.inverse(self.ends(p))

    def jx(self, p: Floats, q: Floats) -> Floats:
        """(N, 4, 4): rows (AB, (CB x AB).x), V-23; mm and mm^2."""
        turned = self._turned(p[:, 3])
        return _rows(p[:, None, :3] + turned - self.legs.carriages(q), turned)

    def rates(self, p: Floats, q: Floats) -> Floats:
        """dp/dq (N, 4, 4)."""
        jx = self.jx(p, q)
        return platform_rates(jx, self.legs.along(jx[:, :, :3]))

    # ---- forward -------------------------------------------------------------------------------------------

    def forward(self, q: Floats, near: Floats | None = None) -> Floats:
        """Platform (N, 4) of slides (N, 4) in the mode nearest `near` (4,) or (N, 4), without it in the home mode.

        Home mode: the machine's own leg roots, the sign of det Jx and the tilt range as in the home pose; where more
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
        """All real assembly modes (8, N, 4) of slides (N, 4): the home mode first, then by distance from it, NaN after.

        The elimination of C leaves a polynomial of degree 8 in exp(i theta) (`h4_modes`), which gives the 8
        solutions counted for such machines (V.7.1.2); each root is refined on the four rod equations.
        """
        seeds = candidates(self.legs.carriages(q), self.joints, self.legs.lengths)
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

    def at_home(self, p: Floats, q: Floats) -> Bools:
        """True (N,) where p belongs to the home mode: leg roots, sign of det Jx, tilt range."""
        jx = self.jx(p, q)
        low, high = self.workspace.tilt
        inside = (p[:, 3] > low - TRUSTED) & (p[:, 3] < high + TRUSTED)
        result: Bools = inside & self.legs.own(jx[:, :, :3]) & (determinant(jx) * self.side > 0.0)
        return result

    def newton(self, q: Floats, start: Floats) -> tuple[Floats, Bools]:
        """(platform (N, 4), closed (N,)): Newton on the rod equations from `start` (N, 4)."""
        p = np.array(start, dtype=np.float64)
        closed = np.zeros(len(q), dtype=np.bool_)
        live = np.flatnonzero(np.isfinite(q).all(axis=1) & np.isfinite(p).all(axis=1))
        carriages, here = self.legs.carriages(q[live]), p[live]
        for _ in range(STEPS):
            if not len(live):
                break
            step, error = self._step(carriages, here)
            here -= step
            done = error < CLOSED
            left = ~done & np.isfinite(step).all(axis=1)
            if not left.all():
                p[live], closed[live] = here, done
                live, carriages, here = live[left], carriages[left], here[left]
        p[live] = here
        return p, closed

    def _step(self, carriages: Floats, p: Floats) -> tuple[Floats, Floats]:
        """(Newton step (N, 4), closure error (N,) relative to L^2)."""
        turned = self._turned(p[:, 3])
        rods = p[:, None, :3] + turned - carriages
        squares = self.legs.lengths**2
        gap = 0.5 * (np.einsum("nki,nki->nk", rods, rods) - squares)
        return solved(_rows(rods, turned), gap), (np.abs(gap) / squares).max(axis=1)

    def _pick(self, q: Floats, near: Floats | None) -> Floats:
        modes = self.modes(q)
        if near is None:
            return np.where(self.at_home(modes[0], q)[:, None], modes[0], np.nan)
        far = _distance(modes, near)
        best = np.argmin(np.where(np.isnan(far), np.inf, far), axis=0)
        result: Floats = modes[best, np.arange(len(q))]
        return result

    def _turned(self, tilt: Floats) -> Floats:
        """Rx(theta) b_k (N, 4, 3)."""
        c, s = np.cos(tilt)[:, None], np.sin(tilt)[:, None]
        x, y, z = self.joints.T
        turned = np.empty((len(tilt), 4, 3))
        turned[..., 0], turned[..., 1], turned[..., 2] = x, c * y - s * z, s * y + c * z
        return turned


def _rows(rods: Floats, arms: Floats) -> Floats:
    rows = np.empty((*rods.shape[:2], 4))
    rows[..., :3] = rods
    rows[..., 3] = arms[..., 1] * rods[..., 2] - arms[..., 2] * rods[..., 1]
    return rows


def _wrap(angle: Floats) -> Floats:
    result: Floats = angle - 2.0 * np.pi * np.ceil((angle - np.pi) / (2.0 * np.pi))
    return result


def _distance(a: Floats, b: Floats) -> Floats:
    """(...,) rad between platforms (..., 4): tilt and place (LEVER mm per rad) together."""
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
