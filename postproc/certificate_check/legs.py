"""What legs do in balls of poses, by the rates of their closed loops: r.dB = (r.A') dq, then dr = dB - A' dq.

Written from the geometry in the certificate: points, directions, joints, rods. A pose is x, y, z, tilt, heading; the tool
axis is (sin t cos h, sin t sin h, cos t), the turn the least one that takes z to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from postproc.certificate_check.balls import Ball, FloatArray, ball, cos_sin, scalar, vector
from postproc.certificate_check.held import PoseBalls, Vectors, hold_rows, on_ring, turned


@dataclass(frozen=True, eq=False)
class Bounds:
    """Of N boxes and K legs: what the square root is taken of (K of (N,)), |cosine|, position of the drive, rows of the
    matrices (R of six (N,) and one for each bar), and their rates by the five numbers of a pose; platform joints, rods as
    unit vectors, and the rates of both."""

    under: list[Ball]
    cosine: list[Ball]
    q: list[Ball]
    rows: list[list[Ball]]
    rates: list[list[list[Ball]]]
    ends: list[Vectors]
    ends_by: list[list[Vectors]]
    rods: list[Vectors]
    rods_by: list[list[Vectors]]


def legs_in(geometry: dict[str, Any], shift: FloatArray, pose: PoseBalls) -> Bounds:
    """Bounds over poses, five numbers (N,) each; `shift` (3,) leads from the point of the region to the reference point."""
    legs = geometry["legs"]
    lever = 1.0 / max([1.0, *(math.hypot(*leg["joint"]) for leg in legs)])
    found = Bounds([], [], [], [], [], [], [], [], [])
    bars = 1 + max([-1, *(int(leg.get("bar", -1)) for leg in legs)])
    hinge = [i for i, name in enumerate("abc") if name in geometry["freedoms"]][:1] if bars else []
    pairs: list[tuple[list[Ball], list[list[Ball]]]] = []
    for leg in legs:
        joint, kept = np.array(leg["joint"], np.float64), [float(v) for v in leg.get("kept", (0.0, 0.0, 0.0))]
        arm, arm_by = carried(geometry, shift, pose, joint, moves=False)
        end, by = carried(geometry, shift, pose, joint)
        if leg.get("ring") and pose.standing is not None:
            apart = [ball(float(v)) - x for v, x in zip(leg["point"], end, strict=True)]
            out, out_by = on_ring(pose.standing, float(leg["ring"]), apart, [[-x for x in d] for d in by])
            arm, end = ([x + y for x, y in zip(v, out, strict=True)] for v in (arm, end))
            arm_by, by = ([[x + y for x, y in zip(d, e, strict=True)] for d, e in zip(v, out_by, strict=True)]
                          for v in (arm_by, by))
        end = [x + v for x, v in zip(end, kept, strict=True)]
        w = [end[i] - float(leg["point"][i]) for i in range(3)]
        under, cosine, q, rod, rod_by = _leg(leg, w, by)
        found.ends.append(end)
        found.ends_by.append(by)
        found.rods.append(rod)
        found.rods_by.append(rod_by)
        found.under.append(under)
        found.cosine.append(cosine)
        found.q.append(q)
        still = [ball(np.full_like(pose[0].m, v)) for v in kept]
        side, side_by = ([_swung(vector(still, r), hinge, int(leg.get("bar", -1)), bars, lever) for r in some]
                         for some in ([rod], rod_by))
        found.rows.append(_sum(rod + [m * lever for m in vector(arm, rod)], side[0]))
        none = [arm[0] * 0.0] * 3
        moments = [[x + y for x, y in zip(vector(a, rod), vector(arm, d), strict=True)]
                   for a, d in zip(arm_by, rod_by, strict=True)]
        found.rates.append([_sum(d + [m * lever for m in moment], s)
                            for d, moment, s in zip(rod_by, moments, side_by, strict=True)])
        if any(leg["pair"]):
            apart = [ball(np.full_like(pose[0].m, v)) * lever for v in leg["pair"]]
            bar = int(leg.get("bar", -1))
            held = [_swung(vector(r, apart), hinge if bar >= 0 else [], bar, bars, 1.0) for r in (rod, *rod_by)]
            pairs.append((_sum([*none, *none], held[0]), [_sum([*none, *none], h) for h in held[1:]]))
    besides = [] if pose.standing is None else hold_rows(geometry, pose.standing, lever)
    own = [pose[0] * 0.0] * bars
    found.rows.extend(row + own for row, _ in besides)
    found.rates.extend([rate + own for rate in rates] for _, rates in besides)
    found.rows.extend(row for row, _ in pairs)
    found.rates.extend(rate for _, rate in pairs)
    return found


def carried(geometry: dict[str, Any], shift: FloatArray, pose: PoseBalls, point: FloatArray, turns: bool = True,
            moves: bool = True) -> tuple[Vectors, list[Vectors]]:
    """Where a point (3,) of the platform is, from its reference point as it stands level, and its rates by the five numbers.

    Without `turns` a direction at rest, without `moves` a direction that turns with the platform.
    """
    if turns and pose.standing is not None:
        at = pose.standing
        there = turned(at.turn, point)
        swung = [vector(w, there) for _, w in at.twists]
        if not moves:
            return there, swung
        return ([x + y for x, y in zip(at.place, there, strict=True)],
                [[x + y for x, y in zip(v, s, strict=True)] for (v, _), s in zip(at.twists, swung, strict=True)])
    turning, turning_by = _turning(geometry, pose) if turns else (None, None)
    if not moves:
        there, by = _turn(turning, turning_by, point, pose[0])
        return there, [[pose[0] * 0.0] * 3 for _ in range(3)] + by
    still = _still(geometry)
    far = point + shift if turning is not None else point + still @ shift
    end, end_by = _turn(turning, turning_by, far, pose[0])
    place = [sum((pose[j] * float(still[i, j]) for j in range(1, 3)), pose[0] * float(still[i, 0])) for i in range(3)]
    return ([place[i] + end[i] for i in range(3)],
            [[ball(np.full_like(pose[0].m, still[i, j])) for i in range(3)] for j in range(3)] + end_by)


def _swung(moment: Vectors, hinge: list[int], bar: int, bars: int, lever: float) -> list[Ball]:
    """A moment on a bar: about its hinge it is the bar's own and stands in its column, about the others the platform's."""
    none = moment[0] * 0.0
    about = [none if i in hinge else m * lever for i, m in enumerate(moment)]
    own = moment[hinge[0]] * lever if hinge else none
    return about + [own if k == bar else none for k in range(bars)]


def _sum(row: list[Ball], side: list[Ball]) -> list[Ball]:
    """A row of six with what is on a bar: moments added, columns of the bars behind."""
    return row[:3] + [x + y for x, y in zip(row[3:], side[:3], strict=True)] + side[3:]


def _still(geometry: dict[str, Any]) -> FloatArray:
    """(3, 3): the part of a place that the platform itself takes; the rest is its carriers'."""
    return moving(geometry)[0]


def moving(geometry: dict[str, Any]) -> tuple[FloatArray, FloatArray]:
    """((3, 3) part of a place that the platform takes, (M, 3) travel of its carriers)."""
    free = [np.eye(3)[i] for i in range(3) if "xyz"[i] in geometry["freedoms"]]
    slides = [np.array(one["direction"], np.float64) for one in geometry["carriers"]]
    columns = np.array([*free, *slides]).T
    if len(free) == 3:  # carriers of a platform that moves by itself: poses are those seen from them
        return np.eye(3), np.zeros((len(slides), 3))
    shares = np.linalg.lstsq(columns, np.eye(3), rcond=None)[0]
    return columns[:, :len(free)] @ shares[:len(free)], shares[len(free):]


def _turning(geometry: dict[str, Any], pose: PoseBalls) -> tuple[Any, Any]:
    """(R as 3 x 3 balls, its rates by tilt and heading); None of a platform that does not turn."""
    turns = "".join(sorted(set(geometry["freedoms"]) & set("abc")))
    if not turns:
        return None, None
    if turns == "c":
        return _about_z(pose[3])
    heading = pose[4] if turns == "abc" else ball(np.full_like(pose[4].m, -0.5 * np.pi if turns == "a" else 0.0))
    (ct, st), (ch, sh) = cos_sin(pose[3]), cos_sin(heading)
    if turns != "abc":  # known to the last digit
        c0, s0 = (0.0, -1.0) if turns == "a" else (1.0, 0.0)
        ch, sh = ball(np.full_like(pose[4].m, c0)), ball(np.full_like(pose[4].m, s0))
    one = ball(np.ones_like(pose[4].m))
    left, zero = one - ct, one * 0.0
    xx, xy, yy = ch * ch, ch * sh, sh * sh
    turn = [[one - xx * left, -(xy * left), ch * st], [-(xy * left), one - yy * left, sh * st], [-(ch * st), -(sh * st), ct]]
    by_tilt = [[-(xx * st), -(xy * st), ch * ct], [-(xy * st), -(yy * st), sh * ct], [-(ch * ct), -(sh * ct), -st]]
    twice, apart = xy * left * 2.0, (yy - xx) * left
    by_heading = [[twice, apart, -(sh * st)], [apart, -twice, ch * st], [sh * st, -(ch * st), zero]]
    return turn, [by_tilt, by_heading]


def _about_z(angle: Ball) -> tuple[Any, Any]:
    """The same of a platform that turns about z alone."""
    c, s = cos_sin(angle)
    zero, one = c * 0.0, ball(np.ones_like(c.m))
    rate = [[-s, -c, zero], [c, -s, zero], [zero, zero, zero]]
    return [[c, -s, zero], [s, c, zero], [zero, zero, one]], [rate, [[zero] * 3] * 3]


def _turn(turning: Any, turning_by: Any, v: FloatArray, like: Ball) -> tuple[Vectors, list[Vectors]]:
    """(R v, its rates by tilt and heading)."""
    if turning is None:
        none = ball(np.zeros_like(like.m))
        return [ball(np.full_like(like.m, x)) for x in v], [[none] * 3, [none] * 3]

    def of(matrix: Any) -> Vectors:
        return [row[0] * float(v[0]) + row[1] * float(v[1]) + row[2] * float(v[2]) for row in matrix]
    return of(turning), [of(matrix) for matrix in turning_by]


def _leg(leg: dict[str, Any], w: Vectors, by: list[Vectors]) -> tuple[Ball, Ball, Ball, Vectors, list[Vectors]]:
    """(under the root, |cosine|, q, r / l, its rates) of w from the drive's point to the platform joint."""
    size, root = float(leg["rod"]), float(leg["root"])
    if leg["drive"] == "length":
        square = scalar(w, w)
        long = square.root()
        short = long.inverse()
        along = [x * short for x in w]
        stretch = [scalar(along, d) for d in by]
        rates = [[(d[i] - along[i] * s) * short for i in range(3)] for d, s in zip(by, stretch, strict=True)]
        return square, ball(np.ones_like(long.m)), long - size, along, rates
    if leg["drive"] == "slide":
        return _slide(leg, w, by, size, root)
    under, half, q, rod, moved = _arm(leg, w, size, root)
    arm, gain = math.hypot(*leg["arm"]), (half * -root).inverse()
    rates = []
    for d in by:
        rate = scalar(rod, d) * gain
        rates.append([(d[i] - moved[i] * rate) * (1.0 / size) for i in range(3)])
    return under, half * (1.0 / (size * arm)), q, [x * (1.0 / size) for x in rod], rates


def _slide(leg: dict[str, Any], w: Vectors, by: list[Vectors], size: float,
           root: float) -> tuple[Ball, Ball, Ball, Vectors, list[Vectors]]:
    """Of a slide: the part of w across it and the root of what the rod has left; moves along it change neither."""
    u = np.array(leg["direction"], np.float64)
    across = np.eye(3) - np.outer(u, u)

    def flat(v: Vectors) -> Vectors:
        return [v[0] * float(row[0]) + v[1] * float(row[1]) + v[2] * float(row[2]) for row in across]
    aside = flat(w)
    under = ball(size * size) - scalar(aside, aside)
    half = under.root()
    steep, rates = half.inverse(), []
    for d in by:
        moved = flat(d)
        slope = scalar(aside, moved) * steep * root
        rates.append([(moved[i] + slope * float(u[i])) * (1.0 / size) for i in range(3)])
    rod = [(aside[i] - half * (root * float(u[i]))) * (1.0 / size) for i in range(3)]
    q = w[0] * float(u[0]) + w[1] * float(u[1]) + w[2] * float(u[2]) + half * root
    return under, half * (1.0 / size), q, rod, rates


def _arm(leg: dict[str, Any], w: Vectors, size: float, root: float) -> tuple[Ball, Ball, Ball, Vectors, Vectors]:
    """(under the root, the root, q, rod, path of the foot per rad): cos q and sin q from where the circles meet."""
    a = [float(x) for x in leg["arm"]]
    b = [float(x) for x in np.cross(leg["direction"], a)]
    x, y = (w[0] * v[0] + w[1] * v[1] + w[2] * v[2] for v in (a, b))
    c = (scalar(w, w) + (math.fsum(v * v for v in a) - size * size)) * 0.5
    round_ = x * x + y * y
    under = round_ - c * c
    half = under.root()
    share = round_.inverse()
    cos, sin = (x * c - y * half * root) * share, (y * c + x * half * root) * share
    off = np.hypot(cos.r, sin.r) / np.maximum(np.hypot(cos.m, sin.m), 1e-300)
    spread = np.where(off < 1.0, np.arcsin(np.minimum(off, 1.0)) * (1.0 + 1e-10), np.pi)
    q = Ball(np.arctan2(sin.m, cos.m), np.where(np.isfinite(spread), spread, np.pi) + 1e-14)
    foot = [cos * a[i] + sin * b[i] for i in range(3)]
    return under, half, q, [w[i] - foot[i] for i in range(3)], [cos * b[i] - sin * a[i] for i in range(3)]
