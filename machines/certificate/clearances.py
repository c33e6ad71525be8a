"""How near the parts of a machine on legs come anywhere in a box of poses: rods, spindle, slides, stops of joints.

Rods, spindle and slides are round bars, segments X0 X1 and Y0 Y1 with a radius. For any unit vector n two segments are at
least min n.(X - Y) apart, over the four pairs of their ends; with n from one to the other as they stand in the middle of the
box that is their distance there, and the ends move by no more than their rates by the numbers of the pose. A joint's swing
is the angle between rod and its direction in the middle of the workspace, whose cosine is bounded likewise. What is
compared is what `machines/reach.py` compares. Source: separation of convex sets (Boyd and Vandenberghe, Convex
Optimization, 2.5.1); Company 2000, II.4.2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from machines.certificate.enclosure import Enclosure
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.spans import Span, dotted, spanned, stacked
from machines.kinematics.clearance_geometry import ClearanceGeometry, ClearanceSizes
from machines.kinematics.leg_geometry import LegGeometry
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import unit
from toolpaths.shapes import arrays

SHARED = 1e-6
"""mm: rods whose platform ends are nearer have one joint"""
UP = np.array([0.0, 0.0, 1.0])
RodOf = Callable[[int], tuple[Floats, Span]]
"""of a leg: ends of its rods (N, 2, 3) before their shifts, and how they move (N, 5, 2, 3)"""


@dataclass(frozen=True, eq=False)
@arrays(middle="K 3", middle_ends="K 3", level="K 3")
class PartsOfLegs:
    """Parts that may touch, and where joints stand in the middle of the workspace.

    Attributes:
        middle: (K, 3) unit vectors of the rods there; `level`: the same in the platform's own directions
        middle_ends: (K, 3) mm, platform joints there
    """

    sizes: ClearanceSizes
    middle: Floats
    middle_ends: Floats
    level: Floats

    @classmethod
    def of(cls, sizes: ClearanceSizes, rig: ClearanceGeometry) -> PartsOfLegs:
        """Of the parts as they stand in the middle (N = 1)."""
        rods = unit((rig.ends - rig.carriages)[0])
        return cls(sizes, rods, rig.ends[0], np.concatenate([rig.level(rod[None]) for rod in rods]))

    @property
    def any(self) -> bool:
        """Whether there is something to hold apart, or a stop."""
        given = self.sizes
        return given.rod_radius is not None or given.carriage_angle is not None or given.platform_angle is not None


@dataclass(frozen=True, eq=False)
@arrays(gap="N 2", at="N 2", share="N 5", worst="N")
class Gaps:
    """Of N boxes: least distance of two parts (mm) and least angle to a stop (rad), over the box and in its middle.

    Attributes:
        gap, at: (N, 2), infinite where a machine has no such parts
        share: (N, 5) what each number of the pose takes off the distance that is least
        worst: (N,) which of `names` is nearest in the middle, for the parts
    """

    gap: Floats
    at: Floats
    share: Floats
    worst: Ints


@dataclass(frozen=True, eq=False)
@arrays(ends="N 2 3")
class MovingBar:
    """A round bar: its ends (N, 2, 3) in the middles of boxes, how they move by the numbers of a pose (N, 5, 2, 3), radius
    mm."""

    name: str
    ends: Floats
    by: Span
    radius: float


def gaps(poses: PosesOfBoxes, parts: PartsOfLegs, pose: Span, here: Enclosure, over: Enclosure) -> Gaps:
    """Of boxes of poses (N, 5); `here` what is enclosed in their middles, `over` in all of each."""
    n, half = len(pose.lo), pose.radius
    distance, distance_at, share = np.full(n, np.inf), np.full(n, np.inf), np.zeros((n, 5))
    worst = np.zeros(n, dtype=np.int64)
    for k, (one, other) in enumerate(_pairs(parts, _bars(poses, parts, pose, here, over))):
        value, at, off = _apart(one, other, half)
        share = np.where((value < distance)[:, None], off, share)
        worst = np.where(at < distance_at, k, worst)
        distance, distance_at = np.minimum(distance, value), np.minimum(distance_at, at)
    swing, swing_at, off = _swings(poses, parts, pose, here, over)
    share = np.where((share.sum(axis=1) > 0.0)[:, None], share, off)
    return Gaps(np.stack([distance, swing], axis=1), np.stack([distance_at, swing_at], axis=1), share, worst)


def pair_names(legs: LegGeometry, parts: PartsOfLegs) -> list[str]:
    """Names of what is held apart, in the order of `Gaps.worst`."""
    none = np.zeros((1, 2, 3))
    still = spanned(np.zeros((1, 5, 2, 3)))
    bars = _named(legs, parts, lambda _: (none, still), (none, still))
    return [f"{one.name} - {other.name}" for one, other in _pairs(parts, bars)]


def _apart(one: MovingBar, other: MovingBar, half: Floats) -> tuple[Floats, Floats, Floats]:
    """(distance over boxes (N,), in their middles (N,), share of each number (N, 5)) of two bars, mm."""
    n = unit(_between(*(bar.ends[:, i] for bar in (one, other) for i in (0, 1))))
    thick = one.radius + other.radius
    found = [_along(one, other, n, i, j, half) for i in (0, 1) for j in (0, 1)]
    value, moved = np.stack([v for v, _ in found]), np.stack([m for _, m in found])
    over = (value - moved.sum(axis=2)).min(axis=0) - thick
    return np.nan_to_num(over, nan=-np.inf), np.nan_to_num(value.min(axis=0) - thick, nan=-np.inf), moved.max(axis=0)


def _along(one: MovingBar, other: MovingBar, n: Floats, i: int, j: int, half: Floats) -> tuple[Floats, Floats]:
    """(n.(X - Y) (N,) in the middles, by how much it moves with each number (N, 5))."""
    by = dotted(one.by[:, :, i] - other.by[:, :, j], spanned(n[:, None]))
    moved = np.maximum(np.abs(by.lo), np.abs(by.hi)) * half
    return np.asarray(((one.ends[:, i] - other.ends[:, j]) * n).sum(axis=1)), np.where(half > 0.0, moved, 0.0)


def _between(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """(N, 3) from the segments cd to ab where they are nearest: the least of what ends and common normal give."""
    u, v, w = b - a, d - c, a - c
    uu, vv, uv, uw, vw = ((x * y).sum(axis=1) for x, y in ((u, u), (v, v), (u, v), (u, w), (v, w)))
    under = uu * vv - uv * uv
    s = np.clip(np.where(under > 1e-12 * uu * vv, (uv * vw - uw * vv) / np.where(under > 0.0, under, 1.0), 0.0), 0.0, 1.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    return np.asarray(w + s[:, None] * u - t[:, None] * v)


def _pairs(parts: PartsOfLegs, bars: tuple[list[MovingBar], list[MovingBar]]) -> Iterator[tuple[MovingBar, MovingBar]]:
    rods, others = bars
    leg, shift = parts.sizes.leg, parts.sizes.shift
    for a, rod in enumerate(rods):
        for b in range(a + 1, len(rods)):
            apart = parts.middle_ends[leg[a]] + shift[a] - parts.middle_ends[leg[b]] - shift[b]
            if leg[a] != leg[b] and float(np.linalg.norm(apart)) >= SHARED:
                yield rod, rods[b]
        yield from ((rod, other) for other in others)


def _bars(poses: PosesOfBoxes, parts: PartsOfLegs, pose: Span, here: Enclosure,
          over: Enclosure) -> tuple[list[MovingBar], list[MovingBar]]:
    """(rods, spindle and slides) in boxes of poses."""
    legs = poses.legs
    end_at, _, _, _ = poses.ends(spanned(pose.middle))
    _, end_by, _, _ = poses.ends(pose)
    fixed = ~(legs.slide | legs.arm)
    foot_at = np.where(fixed[:, None], legs.points, end_at.lo - legs.lengths[:, None] * here.rods.lo)
    moving = end_by - over.rods_by * legs.lengths[:, None]
    foot_by = Span(*(np.where(fixed[:, None], 0.0, end) for end in (moving.lo, moving.hi)))
    low, high = (legs.gauge + v * UP for v in parts.sizes.spindle)
    spindle_at, _, _, _ = poses.carried(spanned(pose.middle), np.stack([low, high]))
    _, spindle_by, _, _ = poses.carried(pose, np.stack([low, high]))

    def rod(k: int) -> tuple[Floats, Span]:
        return (np.stack([foot_at[:, k], end_at.lo[:, k]], axis=1), stacked([foot_by[:, :, k], end_by[:, :, k]], 2))
    return _named(legs, parts, rod, (spindle_at.lo, spindle_by))


def _named(legs: LegGeometry, parts: PartsOfLegs, rod: RodOf, spindle: tuple[Floats, Span]) -> tuple[
        list[MovingBar], list[MovingBar]]:
    given = parts.sizes
    if given.rod_radius is None:
        return [], []
    leg, n = given.leg.tolist(), len(spindle[0])
    rods = [MovingBar(f"rod {legs.names[k]}{1 + leg[:i].count(k)}", rod(k)[0] + given.shift[i], rod(k)[1], given.rod_radius)
            for i, k in enumerate(leg)]
    others = [] if given.spindle_radius is None else [MovingBar("spindle", spindle[0], spindle[1], given.spindle_radius)]
    if given.rail_radius is not None and given.rail_offset is not None and given.rail_ends is not None:
        start = legs.points + given.rail_offset
        rails = start[:, None] + given.rail_ends[:, :, None] * legs.directions[:, None]
        others += [MovingBar(f"slide {name}", np.broadcast_to(rails[k], (n, 2, 3)), spanned(np.zeros((n, 5, 2, 3))),
                             given.rail_radius) for k, name in enumerate(legs.names)]
    return rods, others


def _swings(poses: PosesOfBoxes, parts: PartsOfLegs, pose: Span, here: Enclosure,
            over: Enclosure) -> tuple[Floats, Floats, Floats]:
    """(least angle to a stop over boxes (N,), in their middles (N,), share of each number (N, 5)), rad."""
    n = len(pose.lo)
    least, least_at, share = np.full(n, np.inf), np.full(n, np.inf), np.zeros((n, 5))
    still = spanned(np.broadcast_to(parts.middle, (n, *parts.middle.shape)))
    _, _, turned_at, _ = poses.carried(spanned(pose.middle), parts.level)
    _, _, turned, turned_by = poses.carried(pose, parts.level)
    stops = ((parts.sizes.carriage_angle, still, still, spanned(np.zeros((n, 5, *parts.middle.shape)))),
             (parts.sizes.platform_angle, turned_at, turned, turned_by))
    for most, at, to, to_by in stops:
        if most is None:
            continue
        cosine = dotted(here.rods, at).lo
        by = dotted(over.rods_by, to[:, None]) + dotted(over.rods[:, None], to_by)
        moved = np.maximum(np.abs(by.lo), np.abs(by.hi)) * pose.radius[:, :, None]
        moved = np.where((pose.radius > 0.0)[:, :, None], moved, 0.0)
        bound = np.nan_to_num(cosine - moved.sum(axis=1), nan=-1.0)
        angle = most - np.arccos(np.clip(bound, -1.0, 1.0)).max(axis=1)
        share = np.where((angle < least)[:, None], moved.max(axis=2), share)
        least = np.minimum(least, angle)
        least_at = np.minimum(least_at, most - np.arccos(np.clip(cosine, -1.0, 1.0)).max(axis=1))
    return least, least_at, share
