"""One leg law for rods of fixed length between a carriage on a straight slide and a joint of the platform.

Leg k: the carriage's joint is A = P + q u (u a unit vector), the platform's joint is B, and |B - A| = L. All slider
machines share this file; what differs between them is only where the joints B are.

Source: thesis "Machines-outils rapides a structure parallele" (Company 2000), II-7, II-8 (inverse), II-12 to II-18
(rates). A leg's `root` is the sign of u.(A - B): +1 takes the larger of the two solutions, -1 the smaller.
"""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import cross
from toolpaths.shapes import arrays


@dataclass(frozen=True, eq=False)
@arrays(points="K 3", directions="K 3", lengths="K", roots="K")
class Legs:
    """K legs.

    Attributes:
        points: (K, 3) mm, carriage joint at q = 0
        directions: (K, 3) unit vectors, positive q
        lengths: (K,) mm, rods
        roots: (K,) +1 or -1, how each leg is assembled
    """

    points: Floats
    directions: Floats
    lengths: Floats
    roots: Floats

    def __post_init__(self) -> None:
        unit = np.asarray(self.directions, dtype=np.float64)
        object.__setattr__(self, "directions", unit / np.linalg.norm(unit, axis=-1, keepdims=True))

    def solve(self, joints: Floats) -> tuple[Floats, Floats]:
        """(middle, half), each (N, K) mm: q = middle + root * half for platform joints (N, K, 3).

        II-7 with the root taken of L^2 less the square of the distance of B from the slide, which cancels
        less than the printed form. `half` is NaN where the rod is too short, 0 where the leg is singular.
        """
        middle = np.empty(joints.shape[:2])
        half = np.empty(joints.shape[:2])
        for k, (point, u, length) in enumerate(zip(self.points, self.directions, self.lengths, strict=True)):
            w = joints[:, k] - point
            s = w @ u
            w -= s[:, None] * u
            under = length * length - np.einsum("ni,ni->n", w, w)
            middle[:, k] = s
            half[:, k] = np.sqrt(np.where(under >= 0.0, under, np.nan))
        return middle, half

    def inverse(self, joints: Floats) -> Floats:
        """Slides (N, K) mm with the machine's own roots; a row with one leg out of reach is NaN throughout."""
        middle, half = self.solve(joints)
        return whole_rows(middle + self.roots * half)

    def both(self, joints: Floats) -> Floats:
        """Slides (2^K, N, K) for every choice of roots, in the order of `root_choices`."""
        middle, half = self.solve(joints)
        return np.stack([whole_rows(middle + roots * half) for roots in self.root_choices()])

    def root_choices(self) -> Floats:
        """(2^K, K): the own roots first, then leg 1 changed, leg 2, legs 1 and 2, leg 3, ... (binary order)."""
        k = len(self.roots)
        changed = (np.arange(2**k)[:, None] >> np.arange(k)) & 1
        return np.asarray(self.roots * (1.0 - 2.0 * changed))

    def carriages(self, q: Floats) -> Floats:
        """Carriage joints A (N, K, 3) mm of slides q (N, K)."""
        result: Floats = self.points + q[:, :, None] * self.directions
        return result

    def along(self, rods: Floats) -> Floats:
        """Diagonal of Jq (II-16): u.AB (N, K) mm of rods AB (N, K, 3); 0 where the leg is singular."""
        result: Floats = np.einsum("nki,ki->nk", rods, self.directions)
        return result

    def transmission(self, rods: Floats) -> Floats:
        """Cosine (N, K) of the angle between rod and slide: signed, 0 where the leg is at the end of its reach."""
        return self.along(rods) / self.lengths

    def own(self, rods: Floats) -> Bools:
        """True (N,) where every leg is on the machine's own root."""
        result: Bools = np.all(self.along(rods) * self.roots < 0.0, axis=1)
        return result


def whole_rows(q: Floats) -> Floats:
    """`q` (N, K) with every row that holds a NaN made NaN."""
    result: Floats = np.where(np.isnan(q).any(axis=1, keepdims=True), np.nan, q)
    return result


def platform_rates(jx: Floats, along: Floats) -> Floats:
    """J = Jx^-1 Jq (N, K, K), II-17: platform rates per slide rate; NaN where Jx is exactly singular.

    Args:
        jx: (N, K, K), rows (AB, moments of AB about the platform's reference point)
        along: (N, K) of `Legs.along`
    """
    bad = unsolvable(jx)
    safe = np.where(bad[:, None, None], np.eye(jx.shape[1]), jx)
    rates: Floats = np.asarray(np.linalg.inv(safe) * along[:, None, :], dtype=np.float64)
    rates[bad] = np.nan
    return rates


def determinant(jx: Floats) -> Floats:
    """(N,) of matrices (N, K, K); NaN where an entry is not finite. Its sign cannot change inside an assembly mode."""
    bad = ~np.isfinite(np.sum(jx, axis=(1, 2)))
    result: Floats = np.linalg.det(np.where(bad[:, None, None], 0.0, jx)) + np.where(bad, np.nan, 0.0)
    return result


def unsolvable(jx: Floats) -> Bools:
    """True (N,) where a matrix (N, K, K) is exactly singular or not finite."""
    result: Bools = ~(np.abs(determinant(jx)) > 0.0)
    return result


def solved(jx: Floats, right: Floats) -> Floats:
    """x (N, K) of jx x = right, matrices (N, K, K); NaN where one is exactly singular or not finite.

    Only where the elimination meets a singular matrix are determinants asked which it is.
    """
    try:
        return np.asarray(np.linalg.solve(jx, right[:, :, None])[:, :, 0], dtype=np.float64)
    except np.linalg.LinAlgError:
        bad = unsolvable(jx)
        safe = np.where(bad[:, None, None], np.eye(jx.shape[1]), jx)
        x: Floats = np.asarray(np.linalg.solve(safe, right[:, :, None])[:, :, 0], dtype=np.float64)
        x[bad] = np.nan
        return x


def smallest_singular_value(jx: Floats) -> Floats:
    """(N,) of Jx (N, K, K) as it comes (mm for rods): the distance from a singular platform, III.7."""
    return np.asarray(np.linalg.svd(jx, compute_uv=False)[..., -1], dtype=np.float64)


def three_spheres(centres: Floats, radii: Floats) -> tuple[Floats, Floats]:
    """(foot, out), each (N, 3): the spheres around `centres` (N, 3, 3) with `radii` (3,) or (N, 3) meet at foot + out and
    foot - out.

    `out` is along (c2 - c1) x (c3 - c1), so that det of the rods is positive at foot + out. NaN where they do not meet.
    """
    first = centres[:, 0]
    e1, e2 = centres[:, 1] - first, centres[:, 2] - first
    normal = cross(e1, e2)
    square = np.einsum("ni,ni->n", normal, normal)
    k1 = 0.5 * (np.einsum("ni,ni->n", e1, e1) + radii[..., 0] ** 2 - radii[..., 1] ** 2)
    k2 = 0.5 * (np.einsum("ni,ni->n", e2, e2) + radii[..., 0] ** 2 - radii[..., 2] ** 2)
    square = np.where(square > 0.0, square, np.nan)
    foot = (k1[:, None] * cross(e2, normal) + k2[:, None] * cross(normal, e1)) / square[:, None]
    rest = radii[..., 0] ** 2 - np.einsum("ni,ni->n", foot, foot)
    height = np.sqrt(np.where(rest >= 0.0, rest, np.nan) / square)
    return first + foot, height[:, None] * normal


def two_circles(centres: Floats, radii: Floats) -> tuple[Floats, Floats]:
    """(foot, out), each (N, 3): in the plane z = 0 the spheres around `centres` (N, 2, 3) with `radii` (N, 2) meet at
    foot + out and foot - out.

    `out` is a quarter turn ahead of c2 - c1, so that det of the rods is positive at foot + out. NaN where they do not meet.
    """
    first, along = centres[:, 0, :2], centres[:, 1, :2] - centres[:, 0, :2]
    r1, r2 = (radii**2 - centres[:, :, 2] ** 2).T
    square = np.einsum("ni,ni->n", along, along)
    square = np.where(square > 0.0, square, np.nan)
    share = 0.5 * (1.0 + (r1 - r2) / square)
    rest = r1 / square - share**2
    height = np.sqrt(np.where(rest >= 0.0, rest, np.nan))
    zero = np.zeros(len(centres))
    foot = first + share[:, None] * along
    return (np.column_stack([foot, zero + 0.0 * height]),
            np.column_stack([-height * along[:, 1], height * along[:, 0], zero]))
