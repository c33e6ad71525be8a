"""Plane splines as arcs: pairs of arcs that share their tangent with the curve at both ends and with each other between.

Biarcs: Bolton, Biarc curves, Computer-Aided Design 7 (1975), with equal lengths of both tangents.
"""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.compiled import chosen, loop

PLANE = 1e-6
"""of the size of a curve: control points this near to a plane lie in it, and FLAT of the tolerance at most"""
FLAT = 0.1
DENSER = 2.5
"""so many times as many places are looked at as chords of the same tolerance would need"""
_SHARE = 0.7
"""of the tolerance at those places: between them an arc strays by less than the chord does, 1 / DENSER^2 of it"""
_COMPILED = 40
"""curves that are as long interpreted (25 ms each) as the compiler takes"""
_STRAIGHT = 0.05
"""of the tolerance: an arc that bends less is a line"""


def plane_of(control: Floats, most: float) -> tuple[Floats, Floats, Floats] | None:
    """Unit vectors (3,) u, v along the plane of control points (N, 3) and its normal; None where they lie in none, or
    `most` off it."""
    span = control - control[0]
    size = np.ptp(control, axis=0)
    for k in (2, 0, 1):
        if size[k] <= min(PLANE * size.max(), most):
            eye = np.eye(3)
            return eye[(k + 1) % 3], eye[(k + 2) % 3], eye[k]
    _, _, axes = np.linalg.svd(span)
    if np.abs(span @ axes[2]).max() > min(PLANE * size.max(), most):
        return None
    return axes[0], axes[1], np.cross(axes[0], axes[1])


def biarcs(points: Floats, tangents: Floats, tolerance: float, before: int) -> Floats:
    """Arcs (A, 5) x, y of the end, x, y of the centre, turn (rad, + to the left, 0: a line) along a plane curve.

    `points`, `tangents` (M, 2): places of the curve, near to each other, and its unit tangents there; `before`: curves
    of the file so far. (0, 5) where arcs would not do: a place where the curve turns back.
    """
    fit = chosen(fit_arcs, size=before, enough=_COMPILED)
    return fit(points, tangents, _SHARE * tolerance, _STRAIGHT * tolerance)


@loop(alone=True)
def fit_arcs(points: Floats, tangents: Floats, tolerance: float, straight: float) -> Floats:
    """As many places as possible by each pair of arcs, one pair after the other."""
    last = len(points) - 1
    arcs = np.zeros((2 * last, 5))
    count, a, step = 0, 0, 1
    while a < last:
        good, bad = a, last + 1
        b = min(a + step, last)
        while bad - good > 1:
            if pair_strays(points, tangents, a, b) <= tolerance:
                good = b
                b = min(a + 2 * (b - a), last) if bad > last else (good + bad) // 2
                if good == last:
                    break
            else:
                bad = b
                b = (good + bad) // 2
        if good == a:
            return np.zeros((0, 5))
        x0, y0, x1, y1 = points[a, 0], points[a, 1], points[good, 0], points[good, 1]
        jx, jy = joint(points, tangents, a, good)
        if flat(points, a, good) <= tolerance:
            arcs[count] = (x1, y1, 0.0, 0.0, 0.0)
            count += 1
        else:
            arcs[count] = arc_by_tangent(x0, y0, tangents[a, 0], tangents[a, 1], jx, jy, straight)
            back = arc_by_tangent(x1, y1, -tangents[good, 0], -tangents[good, 1], jx, jy, straight)
            arcs[count + 1] = (x1, y1, back[2], back[3], -back[4])
            count += 2
        step, a = good - a, good
    return arcs[:count]


@loop
def joint(points: Floats, tangents: Floats, a: int, b: int) -> tuple[float, float]:
    """Where both arcs from place a to place b meet: in the middle between the corners of their tangents."""
    vx, vy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    tx, ty, ux, uy = tangents[a, 0], tangents[a, 1], tangents[b, 0], tangents[b, 1]
    along, across = vx * (tx + ux) + vy * (ty + uy), 2.0 * (1.0 - (tx * ux + ty * uy))
    square = vx * vx + vy * vy
    d = square / (along + np.sqrt(along * along + across * square))  # the positive root, without cancellation
    return (0.5 * (points[a, 0] + points[b, 0] + d * (tx - ux)), 0.5 * (points[a, 1] + points[b, 1] + d * (ty - uy)))


@loop
def arc_by_tangent(x: float, y: float, tx: float, ty: float, ex: float, ey: float,
                   straight: float) -> tuple[float, float, float, float, float]:
    """End, centre and turn of the arc that leaves (x, y) along the unit tangent and comes to (ex, ey)."""
    wx, wy = ex - x, ey - y
    along, across = tx * wx + ty * wy, tx * wy - ty * wx
    if abs(across) <= 4.0 * straight:  # the height of an arc is a quarter of how far its end is off its tangent
        return ex, ey, 0.0, 0.0, 0.0
    s = (wx * wx + wy * wy) / (2.0 * across)
    return ex, ey, x - s * ty, y + s * tx, 2.0 * np.arctan2(across, along)


@loop
def flat(points: Floats, a: int, b: int) -> float:
    """Largest distance of places between a and b from their chord."""
    cx, cy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    size, worst = np.hypot(cx, cy), 0.0
    for k in range(a + 1, b):
        worst = max(worst, abs(cx * (points[k, 1] - points[a, 1]) - cy * (points[k, 0] - points[a, 0])))
    return worst / size if size > 0.0 else np.inf


@loop
def pair_strays(points: Floats, tangents: Floats, a: int, b: int) -> float:
    """Largest distance of places between a and b from the arcs between them; inf where the curve turns too far."""
    cx, cy = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
    for k in range(a, b + 1):
        if cx * tangents[k, 0] + cy * tangents[k, 1] <= 0.0:
            return np.inf
    if b == a + 1:
        return 0.0
    jx, jy = joint(points, tangents, a, b)
    tx, ty, ux, uy = tangents[a, 0], tangents[a, 1], tangents[b, 0], tangents[b, 1]
    worst = 0.0
    for k in range(a + 1, b):
        before = cx * (points[k, 0] - jx) + cy * (points[k, 1] - jy) < 0.0
        if before:
            off = off_arc(points[a, 0], points[a, 1], tx, ty, jx, jy, points[k, 0], points[k, 1])
        else:
            off = off_arc(points[b, 0], points[b, 1], -ux, -uy, jx, jy, points[k, 0], points[k, 1])
        worst = max(worst, off)
    return worst


@loop
def off_arc(x: float, y: float, tx: float, ty: float, ex: float, ey: float, px: float, py: float) -> float:
    """How far (px, py) is off the circle, or line, that leaves (x, y) along the unit tangent and passes (ex, ey)."""
    wx, wy, qx, qy = ex - x, ey - y, px - x, py - y
    bend = 2.0 * (tx * wy - ty * wx) / (wx * wx + wy * wy)  # curvature
    # |q - c|^2 - r^2 = q^2 - 2 (c . q), over the sum of both lengths: finite for lines too
    across = tx * qy - ty * qx
    square = bend * (qx * qx + qy * qy) - 2.0 * across
    away: float = abs(square) / (1.0 + np.hypot(bend * qx + ty, bend * qy - tx))
    return away
