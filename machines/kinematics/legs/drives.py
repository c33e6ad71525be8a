"""Legs of a platform, each a rod between a drive and a platform joint: a slide, an arm, or a rod that changes its length.

Leg k: the drive's joint is A(q), the platform's joint B, and |B - A(q)| = l(q).

    slide    A = P + q u               l = L        q in mm along the unit vector u
    arm      A = P + Rot(u, q) a       l = L        q in rad about the unit vector u through P; a across u
    length   A = P                     l = L + q    q in mm

A leg's `root` is the sign of (A - B).A', of two solutions: of a slide +1 takes the larger. Legs of changing length have one.
Source: Company 2000, II-7, II-8, II-12 to II-18 (slides); the same closure for the others.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from machines.kinematics.sliders import Legs, whole_rows
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import dot, wrap
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(points="K 3", directions="K 3", lengths="K", roots="K", arms="K 3", slide="K", arm="K")
class Drives:
    """K legs.

    Attributes:
        points: (K, 3) mm, P
        directions: (K, 3) unit vectors u, of no meaning to legs of changing length
        lengths: (K,) mm, L
        roots: (K,) +1 or -1
        arms: (K, 3) mm, a; 0 of all that are no arms
        slide, arm: (K,) what drives the leg; neither: its length
    """

    points: Floats
    directions: Floats
    lengths: Floats
    roots: Floats
    arms: Floats
    slide: Bools
    arm: Bools

    def __post_init__(self) -> None:
        unit = np.asarray(self.directions, dtype=np.float64)
        object.__setattr__(self, "directions", unit / np.linalg.norm(unit, axis=-1, keepdims=True))

    @cached_property
    def stretch(self) -> Floats:
        """(K,) l': 1 of legs that change their length, else 0."""
        return np.asarray(~(self.slide | self.arm), dtype=np.float64)

    @cached_property
    def size(self) -> Floats:
        """(K,) |A'| and l' together: 1 of slides and lengths, mm per rad of arms."""
        return np.where(self.arm, np.linalg.norm(self.arms, axis=1), 1.0)

    @cached_property
    def _across(self) -> Floats:
        """(K, 3) u x a"""
        return np.asarray(np.cross(self.directions, self.arms), dtype=np.float64)

    @cached_property
    def on_slides(self) -> Legs | None:
        """The same legs where all are rods on slides, which have the law of `sliders` in one go; else None."""
        return Legs(self.points, self.directions, self.lengths, self.roots) if self.slide.all() else None

    def feet(self, q: Floats) -> Floats:
        """A (N, K, 3) mm of joints q (N, K)."""
        if self.on_slides is not None:
            return self.on_slides.carriages(q)
        along = np.where(self.slide, q, 0.0)[:, :, None] * self.directions
        return np.asarray(self.points + along + self._arm(q), dtype=np.float64)

    def _arm(self, q: Floats) -> Floats:
        return np.asarray(np.cos(q)[:, :, None] * self.arms + np.sin(q)[:, :, None] * self._across
                          if self.arm.any() else 0.0)

    def moved(self, q: Floats) -> Floats:
        """A' (N, K, 3) per joint rate."""
        fixed = np.broadcast_to(self.slide[:, None] * self.directions, (*q.shape, 3))
        if not self.arm.any():
            return fixed
        return np.asarray(fixed + np.cos(q)[:, :, None] * self._across - np.sin(q)[:, :, None] * self.arms)

    def swung(self, q: Floats) -> Floats:
        """(N, K, 3) mm from the axis of each arm to the rod's foot, which is -A_qq; 0 of all that are no arms."""
        return np.asarray(np.broadcast_to(self._arm(q), (*q.shape, 3)), dtype=np.float64)

    def spans(self, q: Floats) -> Floats:
        """l (N, K) mm."""
        return np.asarray(self.lengths + self.stretch * q, dtype=np.float64)

    def gains(self, rods: Floats, q: Floats) -> Floats:
        """Diagonal of Jq (N, K), II-16: AB.A' + l l'; of the sign -root, 0 where the leg is singular."""
        return np.asarray(dot(rods, self.moved(q)) + self.stretch * self.spans(q), dtype=np.float64)

    def solve(self, joints: Floats, roots: Floats) -> Floats:
        """q (N, K) of platform joints (N, K, 3) with the given roots (K,); a row with a leg out of reach is NaN
        throughout."""
        if self.on_slides is not None:
            middle, half = self.on_slides.solve(joints)
            return whole_rows(middle + roots * half)
        q = np.empty(joints.shape[:2])
        for k in range(len(self.lengths)):
            w = joints[:, k] - self.points[k]
            of = self._on_slide if self.slide[k] else self._on_arm if self.arm[k] else self._of_length
            q[:, k] = of(k, w, float(roots[k]))
        return whole_rows(q)

    def _on_slide(self, k: int, w: Floats, root: float) -> Floats:
        """II-7 with the root taken of L^2 less the square of the distance of B from the slide."""
        u = self.directions[k]
        s = w @ u
        w = w - s[:, None] * u
        return np.asarray(s + root * _root(self.lengths[k] ** 2 - dot(w, w)), dtype=np.float64)

    def _on_arm(self, k: int, w: Floats, root: float) -> Floats:
        """w.Rot(u, q) a = (w.w + a.a - L^2) / 2."""
        x, y = w @ self.arms[k], w @ self._across[k]
        c = 0.5 * (dot(w, w) + self.size[k] ** 2 - self.lengths[k] ** 2)
        return np.asarray(wrap(np.arctan2(y, x) + root * np.arctan2(_root(x * x + y * y - c * c), c)), dtype=np.float64)

    def _of_length(self, k: int, w: Floats, root: float) -> Floats:
        return np.asarray(np.linalg.norm(w, axis=1) - self.lengths[k], dtype=np.float64)

    def root_choices(self) -> Floats:
        """(2^S, K) of the S slides and arms: the own roots first, then the first one changed, the second, both, ..."""
        free = np.flatnonzero(self.stretch == 0.0)
        result = np.tile(self.roots, (2 ** len(free), 1))
        result[:, free] *= 1.0 - 2.0 * ((np.arange(len(result))[:, None] >> np.arange(len(free))) & 1)
        return np.asarray(result, dtype=np.float64)

    def own(self, rods: Floats, q: Floats) -> Bools:
        """True (N,) where every leg is on the machine's own root and has a length."""
        gain = self.gains(rods, q)
        return np.asarray(np.where(self.stretch > 0.0, gain > 0.0, gain * self.roots < 0.0).all(axis=1))

    def transmission(self, rods: Floats, q: Floats) -> Floats:
        """Cosine (N, K) of the angle between rod and motion of its drive; 1 of legs of changing length."""
        return np.asarray(self.gains(rods, q) / (self.spans(q) * self.size), dtype=np.float64)


def on_slides(legs: Legs) -> Drives:
    """Rods of fixed length on slides."""
    k = len(legs.lengths)
    return Drives(legs.points, legs.directions, legs.lengths, legs.roots, np.zeros((k, 3)), np.ones(k, dtype=np.bool_),
                  np.zeros(k, dtype=np.bool_))


def _root(square: Floats) -> Floats:
    return np.asarray(np.sqrt(np.where(square >= 0.0, square, np.nan)), dtype=np.float64)
