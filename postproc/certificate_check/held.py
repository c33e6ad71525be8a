"""Where a platform stands over balls of poses, which hinges, a passive leg or rings hold besides its legs.

The place C and the turn R of the platform solve six equations g(S, p) = 0: planes of the bed that hold joints, planes of the
platform that hold points of the bed, the place across the carriers, two of the tool axis. With the rates A of g by the twist
(v, w) of the platform the state that g(S, p) = (1 - s) g(S0, p0) has, s from 0 to 1 and p from the middle p0, moves by

    A (v, w) = -dg/dp dp/ds - g(S0, p0)

As long as A is regular within a distance d of S0, and nothing that comes of it moves the state by more than d, it goes to
its end and stays within. Source: continuation of an implicit function (Dieudonne, Foundations of Modern Analysis, 10.2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.certificate_check.balls import Ball, FloatArray, ball, cos_sin, product, scalar, vector

Vectors = list[Ball]
"""three components"""
STEPS, TRIES, WIDER = 20, 4, 1.4
"""of Newton to S0; distances that are tried; how much wider each is"""
LEAST = 0.05
"""least distance of one number of the state, in parts of the largest"""
ROUNDED = 1e-13
"""by which a turn of floats may miss one"""


@dataclass(frozen=True, eq=False)
class StandingPlatform:
    """Of N boxes: C, R by its rows, twists (v, w) by each of the five numbers, travel of the carriers, and by how much the
    platform moves with each number (N, 5) mm, as it does in the middle."""

    place: Vectors
    turn: list[Vectors]
    twists: list[tuple[Vectors, Vectors]]
    carried: list[Ball]
    moved: FloatArray


@dataclass(frozen=True, eq=False)
class PoseBalls:
    """Five numbers of a pose (N,), and where a platform stands that something holds besides its legs."""

    numbers: list[Ball]
    standing: StandingPlatform | None = None

    def __getitem__(self, i: int) -> Ball:
        return self.numbers[i]


def held(geometry: dict[str, Any]) -> bool:
    """True of a platform that something holds besides its legs."""
    return bool(geometry.get("bed") or geometry.get("platform"))


def pose_of(geometry: dict[str, Any], shift: FloatArray, numbers: list[Ball]) -> PoseBalls:
    """Five numbers with what follows of them; `shift` (3,) leads from the point of the region to the reference point."""
    return PoseBalls(numbers, _standing(geometry, shift, numbers) if held(geometry) else None)


def turned(turn: list[Vectors], v: Any) -> Vectors:
    """R v of a known vector."""
    return [row[0] * float(v[0]) + row[1] * float(v[1]) + row[2] * float(v[2]) for row in turn]


def hold_rows(geometry: dict[str, Any], at: StandingPlatform, lever: float) -> list[tuple[Vectors, list[Vectors]]]:
    """(row of six, its rates by the five numbers) of each thing that holds the platform besides."""
    found = []
    for plane in geometry["bed"]:
        n, arm = _like(plane["normal"], at.place), turned(at.turn, plane["joint"])
        swung = [vector(w, arm) for _, w in at.twists]
        still = [x * float(plane["moves"]) for x in n]
        none = [x * 0.0 for x in n]
        found.append((still + _times(vector(arm, n), lever), [none + _times(vector(s, n), lever) for s in swung]))
    for plane in geometry["platform"]:
        u, out = turned(at.turn, plane["across"]), _minus(_like(plane["through"], at.place), at.place)
        by = [vector(w, u) for _, w in at.twists]
        moment_by = [_minus(vector(out, d), vector(v, u)) for d, (v, _) in zip(by, at.twists, strict=True)]
        found.append((u + _times(vector(out, u), lever), [d + _times(m, lever) for d, m in zip(by, moment_by, strict=True)]))
    return found


def on_ring(at: StandingPlatform, ring: float, apart: Vectors, by: list[Vectors]) -> tuple[Vectors, list[Vectors]]:
    """(from the middle of a ring about z of the platform to where it is nearest to a point, its rates); `apart` leads from
    the middle to that point, `by` is how it changes."""
    z = turned(at.turn, (0.0, 0.0, 1.0))
    z_by = [vector(w, z) for _, w in at.twists]
    side = vector(apart, z)
    short = scalar(side, side).root().inverse()
    out = [x * short for x in vector(z, side)]
    rates = []
    for d, zd in zip(by, z_by, strict=True):
        moved = [x + y for x, y in zip(vector(d, z), vector(apart, zd), strict=True)]
        turning = [x + y for x, y in zip(vector(zd, side), vector(z, moved), strict=True)]
        longer = scalar(side, moved) * short * short
        rates.append([(x * short - o * longer) * ring for x, o in zip(turning, out, strict=True)])
    return [x * ring for x in out], rates


def _standing(geometry: dict[str, Any], shift: FloatArray, p: list[Ball]) -> StandingPlatform:
    middle, half = [ball(one.m) for one in p], np.stack([one.r for one in p], axis=1)
    place, turn, closed = _at_rest(geometry, shift, middle)
    gap, rows, right = _equations(geometry, shift, middle, *_state(place, turn, np.zeros((len(place), 6))))
    near = np.linalg.pinv(np.where(closed[:, None, None], rows.m, np.eye(6)))
    moves = np.abs(near @ right.m)
    off = np.abs((near @ gap.m[:, :, None])[:, :, 0])
    lever = max([1.0, *(math.hypot(*leg["joint"]) for leg in geometry["legs"])])
    scale = np.repeat([1.0, 1.0 / lever], 3)
    wide = WIDER * ((moves * half[:, None]).sum(axis=2) + off) + 1e-10
    wide = np.maximum(wide, LEAST * (wide / scale).max(axis=1, keepdims=True) * scale)
    found, near_enough = np.full(wide.shape, np.inf), (half[:, 3:].sum(axis=1) < 0.7)
    for _ in range(TRIES):
        by, rest = _twists((geometry, shift, p), (place, turn), (wide, wide), near, gap)
        reach = (((np.abs(by.m) + by.r) * half[:, None]).sum(axis=2) + np.abs(rest.m) + rest.r) * (1.0 + 1e-12)
        good = closed & near_enough & (reach <= wide).all(axis=1) & (wide[:, 3:].sum(axis=1) < 0.7) & np.isinf(found[:, 0])
        found = np.where(good[:, None], reach, found)
        wide = np.where(np.isfinite(reach) & np.isinf(found[:, :1]), WIDER * np.maximum(wide, reach), wide)
    proved = np.asarray(np.isfinite(found).all(axis=1), dtype=np.bool_)
    by, _ = _twists((geometry, shift, p), (place, turn), (np.where(proved[:, None], found, 0.0), wide), near, gap)
    by = Ball(by.m, np.where(proved[:, None, None], by.r, np.inf))
    c, r = _state(place, turn, found)
    moved = (0.05 * moves[:, :3].max(axis=1) + lever * moves[:, 3:].max(axis=1)) * half
    return StandingPlatform(c, r, [([by[:, k, i] for k in range(3)], [by[:, k, i] for k in range(3, 6)]) for i in range(5)],
                            _carried(geometry, shift, p, c, r), moved)


GivenPoses = tuple[dict[str, Any], FloatArray, list[Ball]]
"""geometry, from the point of the region to the reference point, five numbers"""


def _twists(asked: GivenPoses, start: tuple[FloatArray, FloatArray], within: tuple[FloatArray, FloatArray],
            near: FloatArray, gap: Ball) -> tuple[Ball, Ball]:
    """(twists (N, 6, 5) by the five numbers, twist (N, 6) that takes `gap` off) anywhere `within` (N, 6) of the start.

    near A = I - E, so x = near b + E x, whose size in parts of the second of `within` is bounded first.
    """
    distance, wide = within
    _, rows, right = _equations(*asked, *_state(*start, distance))
    off = product(near, rows)
    share_of = np.abs(off.m - np.eye(6)) + off.r
    taken = (share_of * wide[:, None]).sum(axis=2)
    share = (taken / wide).max(axis=1) * (1.0 + 1e-12)
    found = []
    for b in (right, Ball(gap.m[:, :, None], gap.r[:, :, None])):
        base = product(near, b)
        with np.errstate(divide="ignore", invalid="ignore"):
            most = ((np.abs(base.m) + base.r) / wide[:, :, None]).max(axis=1) / (1.0 - share)[:, None]
            spread = np.where((share < 1.0)[:, None, None], taken[:, :, None] * most[:, None], np.inf)
        found.append(Ball(base.m, (base.r + spread) * (1.0 + 1e-12)))
    return found[0], found[1][:, :, 0]


def _state(place: FloatArray, turn: FloatArray, wide: FloatArray) -> tuple[Vectors, list[Vectors]]:
    """(C, R) within `wide` (N, 6) of a place (N, 3) and a turn (N, 3, 3): [w] R0 of the first order, |w|^2 / 2 beyond."""
    x, y, z = wide[:, 3:].T
    size = np.abs(turn)
    first = np.stack([y[:, None] * size[:, 2] + z[:, None] * size[:, 1], x[:, None] * size[:, 2] + z[:, None] * size[:, 0],
                      x[:, None] * size[:, 1] + y[:, None] * size[:, 0]], axis=1)
    radius = (first + 0.5 * (x * x + y * y + z * z)[:, None, None]) * (1.0 + 1e-12) + ROUNDED
    return ([Ball(place[:, k], wide[:, k]) for k in range(3)],
            [[Ball(turn[:, i, j], radius[:, i, j]) for j in range(3)] for i in range(3)])


def _at_rest(geometry: dict[str, Any], shift: FloatArray, p: list[Ball]) -> tuple[FloatArray, FloatArray, Any]:
    """(C (N, 3), R (N, 3, 3), closed (N,)) of poses that are known, by Newton from the least turn."""
    tilt, heading, n = p[3].m, p[4].m, len(p[0].m)
    towards = np.stack([-np.sin(heading), np.cos(heading), np.zeros(n)], axis=1)
    turn = _rotations(tilt[:, None] * towards)
    place = np.stack([one.m for one in p[:3]], axis=1) + turn @ shift
    gap, lost = np.full((n, 6), np.inf), np.zeros(n, dtype=np.bool_)
    for _ in range(STEPS):
        found, rows, _ = _equations(geometry, shift, p, *_state(place, turn, np.zeros((n, 6))))
        gap = found.m
        lost = np.asarray(lost | ~np.isfinite(rows.m).all(axis=(1, 2)) | ~np.isfinite(gap).all(axis=1), dtype=np.bool_)
        step = -(np.linalg.pinv(np.where(lost[:, None, None], np.eye(6), rows.m)) @ np.where(lost[:, None], 0.0, gap)[
            :, :, None])[:, :, 0]
        place, turn = place + step[:, :3], _rotations(step[:, 3:]) @ turn
        if (np.abs(step) < 1e-12).all():
            break
    return place, turn, ~lost & (np.abs(gap) < 1e-7).all(axis=1)


def _rotations(by: FloatArray) -> FloatArray:
    """(N, 3, 3) by rotation vectors (N, 3), by unit quaternions."""
    angle = np.sqrt((by**2).sum(axis=1))
    share = 0.5 * np.sinc(angle / (2.0 * np.pi))
    w, (x, y, z) = np.cos(0.5 * angle), share * by.T
    size = np.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / size, x / size, y / size, z / size
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                     2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                     2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1).reshape(-1, 3, 3)


def _equations(geometry: dict[str, Any], shift: FloatArray, p: list[Ball], place: Vectors,
               turn: list[Vectors]) -> tuple[Ball, Ball, Ball]:
    """(g (N, 6), rates by the twist (N, 6, 6), -dg/dp (N, 6, 5))."""
    none = place[0] * 0.0
    gaps, rows, right = list[Ball](), list[Vectors](), list[list[Ball]]()
    for plane in geometry["bed"]:
        n, arm, m = _like(plane["normal"], place), turned(turn, plane["joint"]), float(plane["moves"])
        gaps.append(scalar(n, _minus(place, _like(plane["point"], place))) * m + scalar(n, arm))
        rows.append([x * m for x in n] + vector(arm, n))
        right.append([none] * 5)
    for plane in geometry["platform"]:
        u, out = turned(turn, plane["across"]), _minus(place, _like(plane["through"], place))
        gaps.append(scalar(out, u) + float(plane["apart"]))
        rows.append(u + vector(u, out))
        right.append([none] * 5)
    arm = turned(turn, shift)
    for direction in _across(geometry):
        at = _like(direction, place)
        gaps.append(scalar(at, _minus(_minus(place, arm), p[:3])))
        rows.append(at + _times(vector(arm, at), -1.0))
        right.append([*at, none, none])
    if set(geometry["freedoms"]) & set("abc"):
        (ct, st), (ch, sh) = cos_sin(p[3]), cos_sin(p[4])
        z, to = turned(turn, (0.0, 0.0, 1.0)), [st * ch, st * sh, ct]
        for square in _square_to(p[3].m, p[4].m):  # known to the last digit, the same over each box
            gaps.append(scalar(square, _minus(z, to)))
            rows.append([none] * 3 + vector(z, square))
            right.append([none] * 3 + [scalar(square, [ct * ch, ct * sh, -st]), scalar(square, [-(st * sh), st * ch, none])])
    if len(rows) != 6:
        raise ValueError(f"{len(rows)} equations hold the platform, not six")
    return _stacked(gaps), _matrix(rows), _matrix(right)


def _square_to(tilt: FloatArray, heading: FloatArray) -> tuple[Vectors, Vectors]:
    """Two directions across the tool axis of a pose. A unit vector z with the same shares along them as another that is less
    than a right angle from the axis is that other, or lies behind."""
    ct, st, ch, sh = np.cos(tilt), np.sin(tilt), np.cos(heading), np.sin(heading)
    return [ball(x) for x in (-sh, ch, 0.0 * ch)], [ball(x) for x in (ct * ch, ct * sh, -st)]


def _across(geometry: dict[str, Any]) -> FloatArray:
    """(3 - M, 3) unit vectors square to the carriers."""
    slides = np.array([one["direction"] for one in geometry["carriers"]], np.float64).reshape(-1, 3)
    return np.linalg.svd(slides)[2][len(slides):] if len(slides) else np.eye(3)


def _carried(geometry: dict[str, Any], shift: FloatArray, p: list[Ball], place: Vectors, turn: list[Vectors]) -> list[Ball]:
    """Travel of the carriers: what is left of the place of the reference point."""
    slides = np.array([one["direction"] for one in geometry["carriers"]], np.float64).reshape(-1, 3)
    arm = turned(turn, shift)
    left = [x + a - c for x, a, c in zip(p[:3], arm, place, strict=True)]
    return [left[0] * float(row[0]) + left[1] * float(row[1]) + left[2] * float(row[2])
            for row in (np.linalg.pinv(slides).T if len(slides) else ())]


def _like(v: Any, vectors: Vectors) -> Vectors:
    return [ball(np.full_like(vectors[0].m, float(x))) for x in v]


def _minus(a: Vectors, b: Vectors) -> Vectors:
    return [x - y for x, y in zip(a, b, strict=True)]


def _times(a: Vectors, share: float) -> Vectors:
    return [x * share for x in a]


def _stacked(values: list[Ball]) -> Ball:
    return Ball(np.stack([one.m for one in values], axis=-1), np.stack([one.r for one in values], axis=-1))


def _matrix(rows: list[list[Ball]]) -> Ball:
    found = [_stacked(row) for row in rows]
    return Ball(np.stack([one.m for one in found], axis=1), np.stack([one.r for one in found], axis=1))
