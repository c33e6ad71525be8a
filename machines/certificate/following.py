"""Where a platform stands anywhere in a box of poses whose other motions follow from hinges, a passive leg or rings.

With p the five numbers of a pose, the platform is at C = A (p + R d) + t C_k, R = R0(p) Rz(f), A across carriers C_k; the
turn of a platform that turns only as it goes aside is R = Rx Ry Rz of three angles. What follows, t and angles, is f, of
G(p, f) = 0 (`kinematics/holds.py`), as many equations. With f0 in the middle, Y near the inverse of dG/df there, and f
within r of f0 (Krawczyk):

    f - f0 in K = -Y (G(p0, f0) + dG/dp (P - p0)) + (I - Y dG/df) (f - f0)

If K is inside r there is one f for each p in the box, and df/dp = -(dG/df)^-1 dG/dp. Source: Krawczyk's operator (Neumaier,
Interval Methods for Systems of Equations, 5.1); the implicit function theorem.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from machines.certificate.spans import Span, crossed, dotted, joined, spanned
from machines.certificate.turns import applied, least_turns, product, turns_about
from machines.kinematics.leg_geometry import LegGeometry
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

STEPS, CLOSED = 20, 1e-10
"""of Newton in the middle of a box; mm that its equations may miss 0 by"""
TRIES, WIDER = 4, 1.3
"""radii that are tried; how much wider each is than what the last one gave"""


@dataclass(frozen=True, eq=False)
class FollowingPlatform:
    """N boxes: place (N, 3) mm, turn (N, 3, 3), rates of both by the five numbers of a pose (N, 5, 3), (N, 5, 3, 3), and
    travel of the carriers (N, M) mm; NaN where nothing is proved."""

    place: Span
    place_by: Span
    turn: Span
    turn_by: Span
    carried: Span


@dataclass(frozen=True, eq=False)
@arrays(shift="3")
class FollowingMotion:
    """What follows of a platform on legs; `shift` (3,) mm from the point asked for to the reference point, level."""

    legs: LegGeometry
    shift: Floats

    @property
    def count(self) -> int:
        """F: carriers, then angles."""
        return len(self.legs.carriers) + (1 if self.legs.axis_asked else 3)

    def at(self, pose: Span, f: Span) -> FollowingPlatform:
        """Of poses (N, 5) and what follows (N, F): rates are by the five numbers, then by f, each alone."""
        legs, n = self.legs, len(pose.lo)
        free = len(legs.carriers)
        turn, by = self._turn(pose, f[:, free:])
        out: Floats = np.asarray(np.linalg.pinv(legs.carriers) if free else np.zeros((3, 0)), dtype=np.float64)
        inward: Floats = np.asarray(np.eye(3) - out @ legs.carriers, dtype=np.float64)
        moved = pose[:, :3] + (turn * self.shift).sum(-1)
        linear = spanned(np.broadcast_to(np.eye(3), (n, 3, 3)))
        still = spanned(np.zeros((n, free, 3)))
        moved_by = joined([linear, (by * self.shift).sum(-1)], 1)
        place_by = joined([moved_by[:, :5].by(inward), still + legs.carriers, moved_by[:, 5:].by(inward)], 1)
        place = moved.by(inward)
        if free:
            place = place + f[:, :free].by(legs.carriers.T)
        none = spanned(np.zeros((n, 3, 3, 3)))
        turn_by = joined([none, by[:, :2], spanned(np.zeros((n, free, 3, 3))), by[:, 2:]], 1)
        return FollowingPlatform(place, place_by, turn, turn_by, moved.by(out.T) - f[:, :free])

    def _turn(self, pose: Span, angles: Span) -> tuple[Span, Span]:
        """(R (N, 3, 3), its rates by tilt, heading and the angles (N, 2 + A, 3, 3))."""
        if not self.legs.axis_asked:
            turn, by = turns_about("xyz", angles)
            return turn, joined([by[:, :2] * 0.0, by], 1)
        (first, first_by), (last, last_by) = least_turns("abc", pose), turns_about("z", angles)
        return product(first, last), joined([product(first_by, last[:, None]), product(first[:, None], last_by)], 1)

    def gaps(self, there: FollowingPlatform) -> tuple[Span, Span]:
        """(G (N, H) mm, its rates (N, D, H)) of platforms there."""
        holds = self.legs.holds
        assert holds is not None
        n, (r, dr) = spanned(holds.normals), (there.turn, there.turn_by)
        place, rates = there.place[:, None], there.place_by[:, :, None]
        first = dotted(place - holds.points, n) * holds.moves + dotted(applied(r, holds.joints), n)
        first_by = dotted(rates, n) * holds.moves + dotted(applied(dr, holds.joints), n)
        u, du, out = applied(r, holds.across), applied(dr, holds.across), place - holds.through
        return (joined([first, dotted(out, u) + holds.apart], 1),
                joined([first_by, dotted(rates, u[:, None]) + dotted(out[:, None], du)], 2))

    def rows(self, there: FollowingPlatform) -> tuple[Span, Span]:
        """((N, H, 6) rows of what holds the platform besides, turns by the lever, their rates by the pose (N, 5, H, 6))."""
        holds, lever = self.legs.holds, 1.0 / self.legs.lever
        assert holds is not None
        n, (r, dr) = len(there.place.lo), (there.turn, there.turn_by)
        normals = spanned(np.broadcast_to(holds.normals, (n, *holds.normals.shape)))
        arms, arms_by = applied(r, holds.joints), applied(dr, holds.joints)
        first = joined([normals * holds.moves[:, None], crossed(arms, normals) * lever], 2)
        moments = crossed(arms_by, normals[:, None]) * lever
        first_by = joined([moments * 0.0, moments], 3)
        u, du, arm = applied(r, holds.across), applied(dr, holds.across), -(there.place[:, None] - holds.through)
        second = joined([u, crossed(arm, u) * lever], 2)
        swung = crossed(-there.place_by[:, :, None], u[:, None]) + crossed(arm[:, None], du)
        return joined([first, second], 1), joined([first_by, joined([du, swung * lever], 3)], 2)


@lru_cache(maxsize=8)
def following(motion: FollowingMotion, pose: Span) -> FollowingPlatform:
    """The platform in boxes of poses (N, 5)."""
    f0 = _middle(motion, pose.middle)
    known: Bools = np.asarray(np.isfinite(f0).all(axis=1))
    f0 = np.where(known[:, None], f0, 0.0)
    spread, by = _enclosed(motion, pose, f0)
    known &= np.isfinite(spread).all(axis=1)
    spread = np.where(known[:, None], spread, 0.0)
    over = motion.at(pose, Span(f0 - spread, f0 + spread))
    return _total(motion, over, by, known)


def _middle(motion: FollowingMotion, pose: Floats) -> Floats:
    """f (N, F) of poses (N, 5), by Newton from rest; NaN where it does not close."""
    f, at = np.zeros((len(pose), motion.count)), spanned(pose)
    gap = np.full((len(pose), 1), np.inf)
    for _ in range(STEPS):
        value, by = motion.gaps(motion.at(at, spanned(f)))
        gap = value.lo
        if not (np.abs(gap) >= CLOSED).any():
            break
        with np.errstate(invalid="ignore", over="ignore"):
            f = f - np.einsum("nfh,nh->nf", np.linalg.pinv(_safe(np.swapaxes(by.lo[:, 5:], 1, 2))), np.nan_to_num(gap))
    return np.where((np.abs(gap) < CLOSED).all(axis=1, keepdims=True), f, np.nan)


def _safe(matrix: Floats) -> Floats:
    good: Bools = np.asarray(np.isfinite(matrix).all(axis=(1, 2)))
    return np.where(good[:, None, None], matrix, np.eye(matrix.shape[1]))


def _enclosed(motion: FollowingMotion, pose: Span, f0: Floats) -> tuple[Floats, Span]:
    """(r (N, F) within which f is, infinite where that is not proved; df/dp (N, 5, F)) of boxes (N, 5)."""
    half, n = pose.radius, len(f0)
    gap, by0 = motion.gaps(motion.at(spanned(pose.middle), spanned(f0)))
    near: Floats = np.asarray(np.linalg.pinv(_safe(np.swapaxes(by0.lo[:, 5:], 1, 2))), dtype=np.float64)
    still = _times(near, gap[:, :, None])[:, :, 0]
    by_pose = motion.gaps(motion.at(pose, spanned(f0)))[1][:, :5]
    steps = _times(near, Span(*(np.swapaxes(end, 1, 2) for end in (by_pose.lo, by_pose.hi))))
    first = _size(still) + (_size(steps) * half[:, None]).sum(axis=2)
    r, found, by = WIDER * first + 1e-12, np.full(f0.shape, np.inf), spanned(np.zeros((n, 5, f0.shape[1])))
    for _ in range(TRIES):
        rates = motion.gaps(motion.at(pose, Span(f0 - r, f0 + r)))[1]
        turned = Span(*(np.swapaxes(end, 1, 2) for end in (rates.lo, rates.hi)))
        off = _size(spanned(np.eye(f0.shape[1])) - _times(near, turned[:, :, 5:]))
        k = first + (off * r[:, None]).sum(axis=2)
        share = ((k - first) / r).max(axis=1)
        good = (k <= r).all(axis=1) & (share < 1.0) & np.isinf(found[:, 0])
        solved = _solved(-_times(near, turned[:, :, :5]), off, r, share)
        rest = _solved(still[:, :, None], off, r, share)
        tight = _size(rest)[:, :, 0] + (_size(solved) * half[:, None]).sum(axis=2)
        found = np.where(good[:, None], np.minimum(k, tight), found)
        rows = Span(*(np.swapaxes(end, 1, 2) for end in (solved.lo, solved.hi)))
        by = Span(*(np.where(good[:, None, None], new, old) for new, old in ((rows.lo, by.lo), (rows.hi, by.hi))))
        if np.isfinite(found).all():
            break
        r = np.where(np.isfinite(k), WIDER * np.maximum(k, r), r)
    return found, by


def _times(fixed: Floats, of: Span) -> Span:
    """Matrices (N, F, H) times spans (N, H, P)."""
    middle, radius = fixed @ of.middle, np.abs(fixed) @ of.radius
    return Span(middle - radius, middle + radius)


def _size(of: Span) -> Floats:
    """The most that something in it is away from 0."""
    return np.asarray(np.maximum(np.abs(of.lo), np.abs(of.hi)), dtype=np.float64)


def _solved(right: Span, off: Floats, weight: Floats, share: Floats) -> Span:
    """x (N, F, P) with (I - E) x = right, |E| <= off (N, F, F), which takes no more than its `share` (N,) < 1 of `weight`
    (N, F) out of that."""
    most = (_size(right) / weight[:, :, None]).max(axis=1) / np.where(share < 1.0, 1.0 - share, 1.0)[:, None]
    spread = (off * weight[:, None]).sum(axis=2)[:, :, None] * most[:, None]
    return Span(right.lo - spread, right.hi + spread)


def _total(motion: FollowingMotion, over: FollowingPlatform, by: Span, known: Bools) -> FollowingPlatform:
    """Rates by the five numbers alone, f following; NaN where nothing is proved."""
    free = len(motion.legs.carriers)

    def whole(rates: Span) -> Span:
        first, rest = rates[:, :5], rates[:, 5:]
        shape = (*by.lo.shape, *([1] * (rates.lo.ndim - 2)))
        total = first + (by.reshape(*shape) * rest[:, None]).sum(2)
        return _known(total, known)
    place_by, turn_by = whole(over.place_by), whole(over.turn_by)
    return FollowingPlatform(_known(over.place, known), place_by, _known(over.turn, known), turn_by,
                             _known(over.carried, known) if free else over.carried)


def _known(of: Span, known: Bools) -> Span:
    at = known.reshape(-1, *([1] * (of.lo.ndim - 1)))
    return Span(np.where(at, of.lo, np.nan), np.where(at, of.hi, np.nan))
