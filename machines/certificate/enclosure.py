"""What legs do anywhere in a box of poses: reach, position of the drives, the platform's matrices with their derivatives.

With w = B - P, r = B - A and the law of each drive (`LegGeometry`):

    slide    r = w' - root h u,  w' across u,  h^2 = L^2 - w'^2;  q = w.u + root h;  dq = r.dB / (r.u)
    arm      q = atan2(w.(u x a), w.a) + root atan2(h, c),  c = (w^2 + a^2 - L^2) / 2,  h^2 = (w.a)^2 + (w.(u x a))^2 - c^2
    length   r = w,  q = |w| - L

h / L, or h / (L a), is the cosine of the angle between rod and motion of the drive: 0 in an inverse singularity. Rows of the
matrices: (r / l, (R b) x (r / l) / lever) of each leg, (0, (r / l) x s / lever) of each pair with s from rod to rod. A bar,
hinged about a, turns about a by itself: what a rod or a pair says about that turn stands in a column of its own, about all
others the bar is one with the platform.
"""

from __future__ import annotations

import numpy as np

from machines.certificate.following import following
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.spans import Span, angle_of, crossed, dotted, joined, spanned, stacked, turned_by
from machines.kinematics.leg_geometry import LegGeometry
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass

FREEDOMS = "xyzabc"


@dataclass(frozen=True, eq=False)
class Enclosure:
    """All that may be in N boxes; their letters are those of `LegGeometry`.

    Attributes:
        under: (N, K) mm^2, h^2 above: a leg that surely reaches has it above 0
        cosine: (N, K)
        cosine_change: (N, 5, K) by the five numbers of a pose
        q: (N, K) mm or rad
        matrix, change: (N, R, 6 + bars) and by the five numbers of a pose (N, 5, R, 6 + bars): legs, what holds the platform
            besides, then pairs
        rods, rods_by: (N, K, 3) r / l, and by the five numbers (N, 5, K, 3)
    """

    under: Span
    cosine: Span
    cosine_change: Span
    q: Span
    matrix: Span
    change: Span
    rods: Span
    rods_by: Span


def enclosed(poses: PosesOfBoxes, pose: Span) -> Enclosure:
    """Of boxes of poses (N, 5)."""
    legs = poses.legs
    ends, by, arms, arms_by = poses.ends(pose)
    with np.errstate(invalid="ignore", over="ignore"):
        each = [_leg(legs, k, ends[:, k], by[:, :, k]) for k in range(len(legs.names))]
        under, cosine, q = (stacked([one[i] for one in each], 1) for i in range(3))
        along, along_by = stacked([one[3] for one in each], 1), stacked([one[4] for one in each], 2)
        lever = 1.0 / legs.lever
        moment, moment_by = crossed(arms, along) * lever, (
            crossed(arms_by, along[:, None]) + crossed(arms[:, None], along_by)) * lever
        swing, swing_by = (_of_bars(legs, crossed(spanned(legs.kept), rod) * lever) for rod in (along, along_by)) \
            if legs.kept is not None else (_none(along), _none(along_by))
        rows = [joined([along, moment + swing[..., :3], swing[..., 3:]], -1)]
        changes = [joined([along_by, moment_by + swing_by[..., :3], swing_by[..., 3:]], -1)]
        paired = np.flatnonzero(legs.pairs.any(axis=1))
        if len(paired):
            apart = spanned(legs.pairs[paired] * lever)
            held, held_by = crossed(along[:, paired], apart), crossed(along_by[:, :, paired], apart)
            whole, whole_by = (_pairs_of_bars(legs, one, paired) for one in (held, held_by))
            rows.append(joined([held * 0.0, whole], -1))
            changes.append(joined([held_by * 0.0, whole_by], -1))
        if poses.follows is not None:
            held, held_by = poses.follows.rows(following(poses.follows, pose))
            rows.insert(1, held)
            changes.insert(1, held_by)
        cosine_by = stacked([one[5] for one in each], 2)
        return Enclosure(under, cosine, cosine_by, q, joined(rows, 1), joined(changes, 2), along, along_by)


def _none(rods: Span) -> Span:
    """What `_of_bars` gives of a platform without bars: no moments, no columns."""
    return spanned(np.zeros((*rods.lo.shape[:-1], 3)))


def _about(legs: LegGeometry) -> Floats:
    """(3,): the axis of a platform's one turn."""
    return np.asarray(np.eye(3)["abc".index(legs.turns)], dtype=np.float64)


def _of_bars(legs: LegGeometry, moments: Span, at: Ints | None = None) -> Span:
    """(..., K, 3 + bars): moments (..., K, 3) on bars less what is about their hinge, which stands in the column of the
    bar."""
    bars = np.asarray(legs.bars)[np.arange(len(legs.bars)) if at is None else at]
    about, own = _about(legs), np.equal.outer(bars, np.arange(bar_count(legs))).astype(np.float64)
    turn = dotted(moments, spanned(about))
    return joined([moments.by(np.eye(3) - np.outer(about, about)), turn[..., None] * own], -1)


def _pairs_of_bars(legs: LegGeometry, held: Span, at: Ints) -> Span:
    """(..., P, 3 + bars): what pairs of legs `at` hold: of those on a bar its turn about the hinge, not the platform's."""
    if legs.kept is None:
        return held
    on = (np.asarray(legs.bars)[at] >= 0)[:, None]
    split, whole = _of_bars(legs, held, at), joined([held, spanned(np.zeros((*held.lo.shape[:-1], bar_count(legs))))], -1)
    return Span(np.where(on, split.lo, whole.lo), np.where(on, split.hi, whole.hi))


def bar_count(legs: LegGeometry) -> int:
    """Bars of a platform."""
    return max(legs.bars, default=-1) + 1


LegSpans = tuple[Span, Span, Span, Span, Span, Span]
"""(h^2 (N,), cosine (N,), q (N,), r / l (N, 3), its derivatives (N, 5, 3), those of the cosine (N, 5))"""


def _leg(legs: LegGeometry, k: int, end: Span, by: Span) -> LegSpans:
    w = end - legs.points[k]
    if legs.slide[k]:
        return _slide(legs, k, w, by)
    return _arm(legs, k, w, by) if legs.arm[k] else _length(legs, k, w, by)


def _slide(legs: LegGeometry, k: int, w: Span, by: Span) -> LegSpans:
    u, size, root = legs.directions[k], float(legs.lengths[k]), float(legs.roots[k])
    flat = np.eye(3) - np.outer(u, u)
    aside, aside_by = w.by(flat), by.by(flat)
    under = spanned(size**2) - aside.square().sum(-1)
    half = under.root()
    rod = aside - half[:, None] * u * root
    slope = dotted(aside[:, None], aside_by).over(half[:, None]) * root
    rod_by = aside_by + slope[..., None] * u
    q = w.by(u[None])[:, 0] + half * root
    return under, half * (1.0 / size), q, rod * (1.0 / size), rod_by * (1.0 / size), slope * (-root / size)


def _arm(legs: LegGeometry, k: int, w: Span, by: Span) -> LegSpans:
    a, size, root = legs.arms[k], float(legs.lengths[k]), float(legs.roots[k])
    b = np.cross(legs.directions[k], a)
    reach = float(np.linalg.norm(a))
    x, y = w.by(a[None])[:, 0], w.by(b[None])[:, 0]
    c = (w.square().sum(-1) + (reach**2 - size**2)) * 0.5
    under = x.square() + y.square() - c.square()
    half = under.root()
    q = angle_of(x, y) + angle_of(c, half) * root
    known = np.isfinite(q.lo)
    cq, sq = turned_by(Span(np.where(known, q.lo, -np.pi), np.where(known, q.hi, np.pi)))
    foot = cq[:, None] * a + sq[:, None] * b
    moved = cq[:, None] * b - sq[:, None] * a
    rod = w - foot
    rate = dotted(rod[:, None], by).over((half * -root)[:, None])
    rod_by = by - rate[..., None] * moved[:, None]
    x_by, y_by = by.by(a[None])[..., 0], by.by(b[None])[..., 0]
    half_by = (x[:, None] * x_by + y[:, None] * y_by - c[:, None] * dotted(w[:, None], by)).over(half[:, None])
    scale = 1.0 / (size * reach)
    return under, half * scale, q, rod * (1.0 / size), rod_by * (1.0 / size), half_by * scale


def _length(legs: LegGeometry, k: int, w: Span, by: Span) -> LegSpans:
    square = w.square().sum(-1)
    long = square.root()
    along = w.over(long[:, None])
    along = Span(np.maximum(along.lo, -1.0), np.minimum(along.hi, 1.0))
    rate = dotted(along[:, None], by)
    along_by = (by - rate[..., None] * along[:, None]).over(long[:, None, None])
    one = spanned(np.ones_like(long.lo))
    return square, one, long - float(legs.lengths[k]), along, along_by, spanned(np.zeros_like(rate.lo))


def set_rows(legs: LegGeometry) -> int:
    """Rows of the matrices that set the platform's freedoms: legs, and what holds it besides."""
    return len(legs.names) + (0 if legs.holds is None else legs.holds.count)


def columns(legs: LegGeometry) -> tuple[list[int], list[int]]:
    """Columns of the matrices: of the freedoms, and of all motions that legs and pairs must hold.

    Where a file states too few rods to hold all motions (a linear Delta without its pairs), these are the freedoms alone.
    """
    free = [FREEDOMS.index(letter) for letter in legs.freedoms]
    every = ([0, 1, 2, 3, 4, 5] if "z" in legs.freedoms else [0, 1, 5]) + list(range(6, 6 + bar_count(legs)))
    return free, every if set_rows(legs) + int(legs.pairs.any(axis=1).sum()) >= len(every) else free


def least_singular(middle: Floats, change: Span, half: Floats) -> tuple[Floats, Floats, Floats]:
    """(bound (N,) of the least singular value, that in the middles (N,), share of each number of the pose (N, 5)).

    With M0 in the middle, Y its pseudo-inverse and M = M0 + sum d_i D_i, D_i anywhere between the ends of `change`
    (N, 5, R, C) and |d_i| <= half (N, 5): sigma(M) >= sigma(M0) (1 - sum half_i |Y D_i|), for Y M = I + Y (M - M0).
    """
    known: Bools = np.asarray(np.isfinite(middle).all(axis=(1, 2)), dtype=np.bool_)
    good: Bools = known & np.isfinite(change.lo).all(axis=(1, 2, 3)) & np.isfinite(change.hi).all(axis=(1, 2, 3))
    rows = np.where(good[:, None, None], middle, 0.0)
    values = np.linalg.svd(np.nan_to_num(middle), compute_uv=False)[:, -1]
    at = np.where(known, values, np.nan)
    inverse = np.linalg.pinv(rows)[:, None]
    safe = Span(*(np.where(good[:, None, None, None], end, 0.0) for end in (change.lo, change.hi)))
    mid, rad = safe.middle, safe.radius
    share = np.linalg.norm(inverse @ mid, ord=2, axis=(2, 3)) + np.linalg.norm(np.abs(inverse) @ rad, axis=(2, 3))
    share = share * half
    bound = np.where(good, at * (1.0 - share.sum(axis=1)), -np.inf)
    return np.asarray(bound), np.asarray(at), np.where(good[:, None], share, np.nan)
