"""Whether rods, spindle and slides stay apart in balls of poses, and joints short of their stops.

Two segments X0 X1 and Y0 Y1 are at least min n.(X_i - Y_j) / |n| apart, for any n: a plane square to n separates them. The n
that is tried joins the points that are nearest in the middle of a box; a bad n would confirm less, never too much. The swing
of a joint is held by the cosine between a rod and where it points in the middle of the workspace. Source: Company 2000,
II.4.2; separating planes, Boyd and Vandenberghe, Convex Optimization, 2.5.1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.certificate_check.balls import Ball, FloatArray, ball, scalar
from postproc.certificate_check.held import PoseBalls, Vectors
from postproc.certificate_check.legs import Bounds, carried

ONE_JOINT = 1e-6
"""mm: platform ends of rods nearer than this are one joint"""


@dataclass(frozen=True)
class RoundBar:
    """Both ends in the middles of boxes, and their rates by the five numbers of a pose; radius in mm."""

    ends: tuple[Vectors, Vectors]
    rates: tuple[list[Vectors], list[Vectors]]
    radius: float


def apart(geometry: dict[str, Any], shift: FloatArray, poses: tuple[PoseBalls, PoseBalls], here: Bounds, over: Bounds,
          half: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """((N, 2) least distance mm and least angle to a stop rad, the same in the middles, (N, 5) share of each number).

    Args:
        poses: five numbers each, in the middles and over the boxes
        half: (N, 5)
    """
    n = len(half)
    bars = _bars(geometry, shift, poses, here, over)
    least, at, share = np.full(n, np.inf), np.full(n, np.inf), np.zeros((n, 5))
    for one, other in _pairs(geometry["parts"], bars):
        value, middle, moved = _distance(one, other, half)
        share = np.where((value < least)[:, None], moved, share)
        least, at = np.minimum(least, value), np.minimum(at, middle)
    swing, swing_at, moved = _stops(geometry, poses, here, over, half)
    share = np.where((share.sum(axis=1) > 0.0)[:, None], share, moved)
    return np.stack([least, swing], axis=1), np.stack([at, swing_at], axis=1), share


def _pairs(parts: dict[str, Any], bars: tuple[list[RoundBar], list[RoundBar]]) -> Iterator[tuple[RoundBar, RoundBar]]:
    rods, others = bars
    stated, ends = parts["rods"], parts["middle_ends"]
    for i, rod in enumerate(rods):
        for j in range(i + 1, len(rods)):
            gap = np.add(ends[stated[i]["leg"]], stated[i]["shift"]) - np.add(ends[stated[j]["leg"]], stated[j]["shift"])
            if stated[i]["leg"] != stated[j]["leg"] and float(np.sqrt(gap @ gap)) >= ONE_JOINT:
                yield rod, rods[j]
        for other in others:
            yield rod, other


def _bars(geometry: dict[str, Any], shift: FloatArray, poses: tuple[PoseBalls, PoseBalls], here: Bounds,
          over: Bounds) -> tuple[list[RoundBar], list[RoundBar]]:
    parts = geometry["parts"]
    if parts["rod_radius"] is None:
        return [], []
    rods = []
    for rod in parts["rods"]:
        k, aside = int(rod["leg"]), [float(v) for v in rod["shift"]]
        leg = geometry["legs"][k]
        if leg["drive"] == "length":
            foot = [ball(np.full_like(poses[0][0].m, float(v))) for v in leg["point"]]
            foot_by = [[d[0] * 0.0] * 3 for d in over.ends_by[k]]
        else:
            size = float(leg["rod"])
            foot = [b - r * size for b, r in zip(here.ends[k], here.rods[k], strict=True)]
            foot_by = [[b - r * size for b, r in zip(d, e, strict=True)]
                       for d, e in zip(over.ends_by[k], over.rods_by[k], strict=True)]
        rods.append(RoundBar(([x + v for x, v in zip(foot, aside, strict=True)],
                              [x + v for x, v in zip(here.ends[k], aside, strict=True)]), (foot_by, over.ends_by[k]),
                             float(parts["rod_radius"])))
    return rods, [*_spindle(geometry, shift, poses), *_slides(geometry, poses[0])]


def _spindle(geometry: dict[str, Any], shift: FloatArray, poses: tuple[PoseBalls, PoseBalls]) -> Iterator[RoundBar]:
    parts = geometry["parts"]
    if parts["spindle_radius"] is None:
        return
    places = [np.add(geometry["gauge"], (0.0, 0.0, float(v))) for v in parts["spindle"]]
    (low, _), (high, _) = (carried(geometry, shift, poses[0], v) for v in places)
    (_, low_by), (_, high_by) = (carried(geometry, shift, poses[1], v) for v in places)
    yield RoundBar((low, high), (low_by, high_by), float(parts["spindle_radius"]))


def _slides(geometry: dict[str, Any], pose: PoseBalls) -> Iterator[RoundBar]:
    parts = geometry["parts"]
    if parts["rail_radius"] is None:
        return
    still = [[pose[0] * 0.0] * 3 for _ in range(5)]
    for leg, aside, ends in zip(geometry["legs"], parts["rail_offset"], parts["rail_ends"], strict=True):
        places = [np.add(leg["point"], aside) + float(q) * np.array(leg["direction"], np.float64) for q in ends]
        low, high = ([ball(np.full_like(pose[0].m, float(v))) for v in place] for place in places)
        yield RoundBar((low, high), (still, still), float(parts["rail_radius"]))


def _distance(one: RoundBar, other: RoundBar, half: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(lower bound over boxes (N,), in the middles at most (N,), share of each number (N, 5)), mm."""
    normal = _normal(*(np.stack([x.m for x in end], axis=1) for bar in (one, other) for end in bar.ends))
    n = [ball(column) for column in normal.T]
    short = scalar(n, n).root().inverse()
    thick = one.radius + other.radius
    least, middle, share = np.full(len(half), np.inf), np.full(len(half), np.inf), np.zeros((len(half), 5))
    for i in (0, 1):
        for j in (0, 1):
            gap = scalar(n, [x - y for x, y in zip(one.ends[i], other.ends[j], strict=True)])
            value, total = gap, gap * 0.0
            for k in range(5):
                rate = scalar(n, [x - y for x, y in zip(one.rates[i][k], other.rates[j][k], strict=True)])
                moved = np.where(half[:, k] > 0.0, (np.abs(rate.m) + rate.r) * half[:, k], 0.0) * (1.0 + 1e-12)
                share[:, k] = np.maximum(share[:, k], moved)
                total = total + Ball(np.zeros_like(moved), moved)
            bound = ((value + total) * short - thick).least()
            least = np.minimum(least, np.where(np.isfinite(bound), bound, -np.inf))
            middle = np.minimum(middle, (gap * short - thick).most())
    return least, middle, share


def _normal(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """(N, 3): from the segment cd to ab where they are nearest, by turns of projection; of segments that touch, x."""
    s, t = np.full(len(a), 0.5), np.full(len(a), 0.5)
    u, v = b - a, d - c
    for _ in range(60):
        t = np.clip(np.einsum("ij,ij->i", a + s[:, None] * u - c, v) / np.maximum(np.einsum("ij,ij->i", v, v), 1e-30), 0.0,
                    1.0)
        s = np.clip(np.einsum("ij,ij->i", c + t[:, None] * v - a, u) / np.maximum(np.einsum("ij,ij->i", u, u), 1e-30), 0.0,
                    1.0)
    gap = a + s[:, None] * u - c - t[:, None] * v
    size = np.sqrt((gap**2).sum(axis=1))
    return np.where((size > 1e-9)[:, None], gap / np.maximum(size, 1e-30)[:, None], np.array([1.0, 0.0, 0.0]))


def _stops(geometry: dict[str, Any], poses: tuple[PoseBalls, PoseBalls], here: Bounds, over: Bounds,
           half: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    parts, n = geometry["parts"], len(half)
    least, at, share = np.full(n, np.inf), np.full(n, np.inf), np.zeros((n, 5))
    for most, key, turns in ((parts["carriage_angle"], "middle", False), (parts["platform_angle"], "level", True)):
        if most is None:
            continue
        for k in range(len(geometry["legs"])):
            to = np.array(parts[key][k], np.float64)
            (there, _), (wide, by) = (carried(geometry, np.zeros(3), pose, to, turns, False) for pose in poses)
            cosine = scalar(here.rods[k], there)
            total, moves = cosine, np.zeros((n, 5))
            for i in range(5):
                rate = scalar(over.rods_by[k][i], wide) + scalar(over.rods[k], by[i])
                moves[:, i] = np.where(half[:, i] > 0.0, (np.abs(rate.m) + rate.r) * half[:, i], 0.0) * (1.0 + 1e-12)
                total = total + Ball(np.zeros(n), moves[:, i])
            bound = np.where(np.isfinite(total.least()), total.least(), -1.0)
            angle = float(most) - np.arccos(np.clip(bound, -1.0, 1.0)) * (1.0 + 1e-12) - 1e-12
            share = np.where((angle < least)[:, None], moves, share)
            least = np.minimum(least, angle)
            at = np.minimum(at, float(most) - np.arccos(np.clip(cosine.most(), -1.0, 1.0)))
    return least, at, share
