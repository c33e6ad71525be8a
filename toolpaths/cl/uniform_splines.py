"""Clamped cubics with equal knots in the place of splines, of as few control points as a proved bound allows."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats, Ints
from toolpaths.cl.spline_chords import DEGREE, chord_errors, chord_places, de_boor, knots_of
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

FIT = 0.75
"""of the tolerance, for the spline; its own chords have the rest"""
_GRAIN = 0.12
"""of the tolerance, that the chords through which two curves are compared may be off each"""
_GROWTH = 1.15
"""of the number of control points, until the bound holds"""
_LEAST, _MOST = DEGREE + 1, 600
"""control points"""
_CORNER, _ALONE = 0.01, 6.0
"""rad of a turn between two chords next to each other, and times those of most, at which no smooth curve is laid"""
_CORRECTIONS, _HOPELESS = 2, 1.5
"""times that places are moved; times the tolerance above which that is no use"""
_MOST_SAMPLES, _EVEN = 6000, 4.0
"""points of a curve; times the narrowest step between its knots, up to which its own parameter is tried"""


@dataclass(frozen=True)
@arrays(points="N 3", places="N")
class _Sampled:
    """A curve by its points, their parameters from 0 to 1, and mm that its chords are off it."""

    points: Floats
    places: Floats
    off: float


def equal_knots(pieces: int) -> Floats:
    """(pieces,) the inner knots and 1 of a clamped cubic whose pieces are equally long in its parameter."""
    result: Floats = np.arange(1.0, pieces + 1.0) / pieces
    return result


def uniform_spline(control: Floats, inner: Floats, tolerance: float, most: int) -> Floats:
    """Control points (n, 3) of a clamped cubic with equal knots that is proved to keep within `tolerance` of one with
    control points (m, 3) and knots `inner` (m - 3,); (0, 3) where none of up to `most` points is proved, and where it
    has a corner.

    Least squares over points of the curve, placed by its own parameter and by length with more room where it bends; the
    better one counts. Both curves are off their chords by a known amount, and of two lines of chords with corners of the
    same number the distance (of Frechet, which keeps their order) is that of the corners at most.
    """
    at = chord_places(control, inner, _GRAIN * tolerance)
    if not 3 <= len(at) <= _MOST_SAMPLES:
        return np.zeros((0, 3))
    points = de_boor(control, knots_of(inner), at, DEGREE)
    along = np.diff(points, axis=0)
    size = np.linalg.norm(along, axis=1)
    if not (size > 0.0).all() or _has_corner(along):
        return np.zeros((0, 3))
    found = _fewest(_Sampled(points, _by_bend(along, size, tolerance), _GRAIN * tolerance), tolerance, most)
    width = np.diff(np.unique(np.append(0.0, inner)))
    if width.max() > _EVEN * width.min():
        return found
    other = _fewest(_Sampled(points, at, _GRAIN * tolerance), tolerance, min(most, len(found) - 1 if len(found) else most))
    return other if len(other) else found


def _by_bend(along: Floats, size: Floats, tolerance: float) -> Floats:
    """(N,) places from 0 to 1 by length, with more room where the curve bends: a cubic of length h is off a curve of radius
    r by about h^4 / (400 r^3), so that the steps allowed go by r^(3/4); room is shared out over neighbours."""
    bend = np.interp(np.arange(len(size)), np.arange(len(size) - 1) + 0.5, _angles(along) / (0.5 * (size[:-1] + size[1:])))
    room = (bend**3 / (400.0 * tolerance)) ** 0.25
    middle = np.cumsum(size) - 0.5 * size
    even = np.linspace(0.0, size.sum(), 4 * len(size) + 1)
    smooth = np.interp(even, middle, room)
    width = max(len(even) // 60, 1)
    kernel = np.ones(2 * width + 1) / (2 * width + 1)
    for _ in range(3):
        smooth = np.convolve(np.pad(smooth, width, mode="edge"), kernel, "valid")
    smooth = np.maximum(smooth, 0.3 * smooth.mean() + 1e-9)
    gone = np.append(0.0, np.cumsum(0.5 * (smooth[:-1] + smooth[1:]) * np.diff(even)))
    places = np.interp(np.append(0.0, np.cumsum(size)), even, gone)
    result: Floats = places / places[-1]
    return result


def _fewest(curve: _Sampled, tolerance: float, most: int) -> Floats:
    """Of numbers of control points that grow until the bound holds, then of the numbers since the last one, the least."""
    count, last, found = _LEAST, _LEAST - 1, np.zeros((0, 3))
    while count <= min(most, _MOST) and not len(found):
        found = _proved(curve, count, tolerance)
        if not len(found):
            last, count = count, max(int(count * _GROWTH), count + 1)
    low, high = last + 1, len(found)
    while len(found) and low < high:
        middle = (low + high) // 2
        less = _proved(curve, middle, tolerance)
        found, low, high = (less, low, middle) if len(less) else (found, middle + 1, high)
    return found


def _proved(curve: _Sampled, count: int, tolerance: float) -> Floats:
    """The control points (count, 3) by least squares, both ends held; (0, 3) where the bound is above the tolerance.

    Places go on to the nearest points of each spline (parameter correction; Hoschek, Intrinsic parametrization for
    approximation, 1988), in their order.
    """
    if len(curve.points) < count:
        return np.zeros((0, 3))
    pieces, places = count - DEGREE, curve.places * (count - DEGREE)
    for number in range(_CORRECTIONS + 1):
        span, basis = _basis(places, pieces)
        control = _least_squares(curve.points, span, basis, count)
        away = (basis[:, :, None] * control[span[:, None] + np.arange(DEGREE + 1)]).sum(axis=1) - curve.points
        bound = float(np.linalg.norm(away, axis=1).max()) + curve.off + float(
            chord_errors(control, knots_of(equal_knots(pieces)), places / pieces).max())
        if bound <= tolerance:
            return control
        if number and bound > _HOPELESS * tolerance:
            break
        places = _corrected(control, places, away, pieces)
    return np.zeros((0, 3))


def _least_squares(points: Floats, span: Ints, basis: Floats, count: int) -> Floats:
    """Control points (count, 3) nearest to points (N, 3), the first and the last one given."""
    rows: Ints = span[:, None] + np.arange(DEGREE + 1)
    cells = (rows[:, :, None] * count + rows[:, None, :]).ravel()
    normal = np.bincount(cells, (basis[:, :, None] * basis[:, None, :]).ravel(), count * count).reshape(count, count)
    right = np.stack([np.bincount(rows.ravel(), (basis * points[:, k, None]).ravel(), count) for k in range(3)], axis=1)
    control = np.zeros((count, 3))
    control[[0, -1]] = points[[0, -1]]
    inside = slice(1, count - 1)
    normal[np.arange(count), np.arange(count)] += 1e-12 * normal.trace() / count
    control[inside] = np.linalg.solve(normal[inside, inside], (right - normal[:, [0, -1]] @ control[[0, -1]])[inside])
    return control


def _corrected(control: Floats, places: Floats, away: Floats, pieces: int) -> Floats:
    """Places (N,) moved along the spline by what it is off (N, 3) there, in their order, the first and the last one kept."""
    knots = knots_of(equal_knots(pieces)) * pieces
    slope = DEGREE * np.diff(control, axis=0) / (knots[DEGREE + 1:-1] - knots[1:-DEGREE - 1])[:, None]
    speed = de_boor(slope, knots[1:-1], places, DEGREE - 1)
    moved = places - (away * speed).sum(axis=1) / np.maximum((speed * speed).sum(axis=1), 1e-30)
    moved[[0, -1]] = 0.0, pieces
    result: Floats = np.maximum.accumulate(np.clip(moved, 0.0, pieces))
    return result


def _basis(places: Floats, pieces: int) -> tuple[Ints, Floats]:
    """(first control point (N,), basis functions (N, 4)) at places between 0 and the number of pieces (The NURBS Book,
    A2.2)."""
    knots = knots_of(equal_knots(pieces)) * pieces
    span = np.clip(np.floor(places).astype(np.int64), 0, pieces - 1)
    at, basis = span + DEGREE, np.zeros((len(places), DEGREE + 1))
    basis[:, 0] = 1.0
    for k in range(1, DEGREE + 1):
        saved = np.zeros(len(places))
        for r in range(k):
            right, left = knots[at + r + 1] - places, places - knots[at + 1 - k + r]
            share = basis[:, r] / (right + left)
            basis[:, r] = saved + right * share
            saved = left * share
        basis[:, k] = saved
    return span, basis


def _has_corner(along: Floats) -> bool:
    """True where a turn between chords is large and alone: a corner that no smooth curve follows."""
    angles = _angles(along)
    return len(angles) > 0 and bool(angles.max() > max(_CORNER, _ALONE * float(np.quantile(angles, 0.95))))


def _angles(along: Floats) -> Floats:
    """(K - 1,) rad between chords next to each other."""
    across = np.linalg.norm(np.cross(along[:-1], along[1:]), axis=1)
    result: Floats = np.arctan2(across, (along[:-1] * along[1:]).sum(axis=1))
    return result
