"""The curve that a control lays through points of a curve: the smoothest that the tolerance allows.

Cubic pieces between points, joined in position and direction, whose third derivative q''' and whose jumps of curvature are
least in the mean (smoothing splines; C. de Boor, A Practical Guide to Splines, 1978, chapter XIV), while the points move by
a share of their tolerance. How much a q''' counts depends on the place: with limited jerk an axis that comes from a sharp
bend of radius r has, at the distance d behind it, at most the speed of (d^2 j)^(1/3), and there q''' v^3 <= j allows
q''' = 1/d^2. So q''' is weighed by the square of the radius that the bends around leave: the least r + d of all places.
A spline with equal weights bends to the other side before and behind a bend that few points show, by an amount that depends
on where the points stand; this one does not, and points rounded to 0.001 mm bend it little.
"""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from postproc.clock.tangents import tangents
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

SHARE, LEAST, MOST = 0.2, 0.0006, 0.5
"""share of the tolerance by which points are expected to move, mm that it is at least (points rounded to 0.001 mm), and
share that it is at most all the same"""
FIXED = 1e-5
"""mm by which corners move"""
ROUNDS, BY_TURN = 4, 2
"""times that the curve is laid, and with the radii of the points' turns; then with its own"""
SHARP, PARTS = 0.15, 6
"""rad that a point turns from which the blocks next to it are of that many pieces: their bend may be anywhere in them"""
NARROWER = 0.6
"""power by which a sharp point that turns more than its neighbours has a smaller radius: it bends in less than a block"""
FLATTEST, NARROWEST, REACH = 30.0, 0.003, 15.0
"""mm: largest and least radius; blocks over which points may be smoothed"""
ROUNDING = 0.0015
"""mm that points rounded to 0.001 mm may be off: the turn it makes over the shorter block is no bend"""
BEFORE_CORNER = 0.3
"""of the shorter block: the radius at corners and rests, where curves may bend as they like"""
SLACK, LONGER, FURTHER, WIDEST = 1.01, 1.05, 1.2, 2.8
"""of what points may move, of an arc's length and height, rad that an arc turns: beyond those a curve has strayed from its
points"""
BY_CHORD = 0.5
"""power of the chord by which splines through points are parametrised: centripetal (E. T. Y. Lee, Computer-Aided Design 21,
1989)"""
RIDGES = 0.0, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4
"""added to the scaled diagonal, one after the other, until the equations of very uneven points can be solved"""
STRAIGHT = 1e-3
"""weight with which a direction is that of its block: it decides where nothing else does"""
SAMPLES, WEIGHTS = (one / 2.0 for one in np.polynomial.legendre.leggauss(5))
"""places and weights of Gauss' rule of five points on -1/2 to 1/2"""


@dataclass(frozen=True)
@arrays(points="P A", first="M A", last="M A", along="M", owner="M", ends="N")
class FittedCurve:
    """M cubic pieces.

    Attributes:
        points (P, A): M + 1 ends of the pieces
        first, last (M, A): derivatives by the parameter at both ends of each piece; along (M,): length of its parameter
        owner (M,): block of each piece; ends (N,): last piece of each block
    """

    points: Floats
    first: Floats
    last: Floats
    along: Floats
    owner: Ints
    ends: Ints

    def bends(self) -> Floats:
        """(M,) rad that each piece turns, about and at least."""
        d = np.diff(self.points, axis=0)
        angle = [_angle(self.first, self.last), 2.0 * _angle(self.first, d), 2.0 * _angle(d, self.last)]
        return np.asarray(np.max(angle, axis=0))


def curve(flat: Floats, u: Floats, chord: Floats, smooth: Bools, tolerance: Floats) -> FittedCurve:
    """The curve through points `flat` (N + 1, A), its blocks in directions `u` (N, A), of lengths `chord` (N,): inner points
    that are `smooth` (N - 1,) are of a curve and may move within their tolerance (N + 1,), others are corners."""
    turn = np.where(smooth, 2.0 * np.arcsin(np.clip(np.linalg.norm(np.diff(u, axis=0), axis=1) / 2.0, 0.0, 1.0)), 0.0)
    sharp = np.concatenate([[False], turn > SHARP, [False]])
    count = np.where(sharp[1:] | sharp[:-1], PARTS, 1)
    owner = np.repeat(np.arange(len(u)), count)
    ends = np.cumsum(count) - 1
    part = (np.arange(len(owner)) - (ends - count + 1)[owner] + 1.0) / count[owner]
    points = np.concatenate([flat[:1], flat[owner] + part[:, None] * (u * chord[:, None])[owner]])
    points[ends + 1] = flat[1:]
    if not smooth.any():
        return FittedCurve(points, u, u, chord, owner, ends)
    joined = np.ones(len(points), dtype=bool)
    at = np.concatenate([[0], ends + 1])
    inner = np.concatenate([[False], smooth, [False]])
    joined[at] = inner
    stays = np.where(inner, np.clip(SHARE * tolerance, LEAST, np.maximum(MOST * tolerance, FIXED)), FIXED)
    corner = BEFORE_CORNER * np.minimum(np.append(chord, chord[-1]), np.append(chord[0], chord))
    radius = np.full(len(points), FLATTEST)
    radius[at] = np.where(inner, np.concatenate([corner[:1], _radii(turn, chord), corner[-1:]]), corner)
    most = np.maximum(MOST * tolerance, FIXED)
    line = FittedCurve(points, u[owner], u[owner], (chord / count)[owner], owner, ends)
    laid = _laid(line, joined, at, stays, most, radius)
    run = np.concatenate([[0], np.cumsum(~smooth)])
    astray = np.bincount(run, weights=_astray(laid, flat, (u, chord), turn, most))[run] > 0.0
    return _interpolated(laid, flat, (u, chord), smooth, astray) if astray.any() else laid


def _astray(laid: FittedCurve, flat: Floats, blocks: tuple[Floats, Floats], turn: Floats, most: Floats) -> Bools:
    """(N,) blocks whose ends have moved by more than `most` (N + 1,), or that are longer or further from their chord than an
    arc of what their ends turn (N - 1,): points that scatter by more than their tolerance are of no curve near them."""
    u, chord = blocks
    at = np.concatenate([[0], laid.ends + 1])
    off = ~(np.linalg.norm(laid.points[at] - flat, axis=1) <= SLACK * most)
    half = np.minimum(np.append(turn, 0.0) + np.concatenate([[0.0], turn]), WIDEST) / 2.0
    arc = chord * half / np.maximum(np.sin(half), 1e-12)
    length = np.bincount(laid.owner, weights=_lengths(laid))
    far = laid.points[:-1] + np.diff(laid.points, axis=0) / 2.0 + laid.along[:, None] * (laid.first - laid.last) / 8.0
    far -= flat[laid.owner]
    far -= (far * u[laid.owner]).sum(axis=1)[:, None] * u[laid.owner]
    away = ~(np.linalg.norm(far, axis=1) <= (FURTHER * chord / 2.0 * np.tan(half / 2.0) + most[1:] + most[:-1])[laid.owner])
    return np.asarray(off[1:] | off[:-1] | ~(length <= LONGER * np.where(half > 1e-6, arc, chord))
                      | (np.bincount(laid.owner, weights=away) > 0.0))


def _interpolated(laid: FittedCurve, flat: Floats, blocks: tuple[Floats, Floats], smooth: Bools,
                  which: Bools) -> FittedCurve:
    """The curve with the blocks of `which` (N,), whole runs from corner to corner, as splines through their points."""
    u, chord = blocks
    along = chord**BY_CHORD
    first, last = tangents(u, chord, along, smooth)
    keep, rows = ~which[laid.owner], np.flatnonzero(which)
    owner = np.concatenate([laid.owner[keep], rows])
    order = np.argsort(owner, kind="stable")

    def merged(one: Floats, other: Floats) -> Floats:
        return np.concatenate([one[keep], other[rows]])[order]

    points = merged(laid.points[1:], flat[1:])
    start = flat[:1] if which[0] else laid.points[:1]
    return FittedCurve(np.concatenate([start, points]), merged(laid.first, first), merged(laid.last, last),
                       merged(laid.along, along), owner[order], np.cumsum(np.bincount(owner, minlength=len(u))) - 1)


def _laid(line: FittedCurve, joined: Bools, at: Ints, stays: Floats, most: Floats, radius: Floats) -> FittedCurve:
    """Pieces on straight blocks laid on the curve; `joined` (P,) ends at which the direction is one, `at` (N + 1,) rows of
    the commanded points, `stays` and `most` (N + 1,) mm by which they are expected to move and may, `radius` (P,) at the
    ends."""
    here, h, rows = line, line.along, np.flatnonzero(~joined)
    for k in range(ROUNDS):
        both = (np.concatenate([h[:1], h]) + np.append(h, h[-1]))[at] / 2.0
        known = radius if k < BY_TURN else _of_curve(here, radius, rows)
        least, weight = np.full(len(radius), np.inf), np.zeros(len(radius))
        least[at], weight[at] = np.sqrt((REACH * both) ** 3 / stays), both / stays**2
        room = np.minimum(np.clip(known, NARROWEST, FLATTEST), least)
        here = _least_rough(line, h, joined, weight, _around(room, h))
        h = _lengths(here)
        off = np.linalg.norm((here.points - line.points)[at], axis=1)
        stays = stays * np.minimum(1.0, most / np.maximum(off, FIXED))
    return here


def _radii(turn: Floats, chord: Floats) -> Floats:
    """(N - 1,) radii at inner points by what they turn, less what rounding may turn."""
    shorter = np.minimum(chord[1:], chord[:-1])
    radius = (chord[1:] + chord[:-1]) / 2.0 / np.maximum(turn - ROUNDING / shorter, 1e-4)
    least = np.minimum(np.concatenate([[0.0], turn[:-1]]), np.append(turn[1:], 0.0))
    narrow = np.clip(least / np.maximum(turn, 1e-9), 0.01, 1.0) ** NARROWER
    return np.asarray(np.where(turn > SHARP, narrow * radius, radius))


def _of_curve(here: FittedCurve, radius: Floats, rows: Ints) -> Floats:
    """(P,) radii of a curve at the ends of its pieces, at corners `rows` those that were given."""
    h, d = here.along[:, None], np.diff(here.points, axis=0)
    begin = np.linalg.norm(6.0 * d / h**2 - (4.0 * here.first + 2.0 * here.last) / h, axis=1)
    end = np.linalg.norm(-6.0 * d / h**2 + (2.0 * here.first + 4.0 * here.last) / h, axis=1)
    bent = 1.0 / np.maximum(np.maximum(np.append(begin, 0.0), np.concatenate([[0.0], end])), 1e-3)
    bent[rows] = radius[rows]
    return np.asarray(bent)


def _around(radius: Floats, h: Floats) -> Floats:
    """(P,) least radius plus distance of all places, seen from each."""
    s = np.concatenate([[0.0], np.cumsum(h)])
    return np.asarray(np.minimum(np.minimum.accumulate(radius - s) + s, np.minimum.accumulate((radius + s)[::-1])[::-1] - s))


def _lengths(here: FittedCurve) -> Floats:
    """(M,) lengths of the pieces."""
    d, h = np.diff(here.points, axis=0), here.along[:, None]
    total = np.zeros(len(h))
    for x, weight in zip((SAMPLES + 0.5).tolist(), WEIGHTS.tolist(), strict=True):
        slope = 6.0 * x * (1.0 - x) * d + h * ((1.0 - x) * (1.0 - 3.0 * x) * here.first + x * (3.0 * x - 2.0) * here.last)
        total += weight * np.linalg.norm(slope, axis=1)
    return total


def _angle(one: Floats, other: Floats) -> Floats:
    """(M,) rad between rows."""
    size = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
    return np.asarray(np.arccos(np.clip((one * other).sum(axis=1) / np.maximum(size, 1e-300), -1.0, 1.0)))


def _least_rough(line: FittedCurve, h: Floats, joined: Bools, weight: Floats, radius: Floats) -> FittedCurve:
    """The curve of least sum of h (r^2 q''')^2 over the pieces, (r^2 jump of q'')^2/h over joined ends, and weight times
    (off the line)^2, by its normal equations; unknown is how far ends and directions are from the line's, by curve."""
    from scipy.linalg import LinAlgError, solveh_banded  # loaded where a control's clock is asked for

    row = np.cumsum(np.where(joined, 1, 2)) - 1  # of the end as the begin of a piece: corners are two, the end of one curve
    back = np.where(joined, row, row - 1)        # and the begin of the next
    n, axes = int(row[-1]) + 1, line.points.shape[1]
    real, piece = np.zeros(n - 1), np.ones(n - 1)
    real[row[:-1]], piece[row[:-1]] = h * (radius[:-1] * radius[1:]) ** 2, h
    step = np.zeros((n - 1, axes))
    step[row[:-1]] = np.diff(line.points, axis=0)
    u = np.zeros((n, axes))
    u[row[:-1]] = line.first
    u[back[1:][~joined[1:]]] = line.last[~joined[1:]]
    mean = line.last[:-1] + line.first[1:]
    inner = joined[1:-1]
    u[row[1:-1][inner]] = (mean / np.maximum(np.linalg.norm(mean, axis=1), 1e-9)[:, None])[inner]
    bands, right = np.zeros((6, 2 * n)), np.zeros((2 * n, axes))
    third = [12 / piece**3, 6 / piece**2, -12 / piece**3, 6 / piece**2]
    _add(bands, right, third, real, third[1][:, None] * (u[:-1] + u[1:]) - third[0][:, None] * step)
    jump = np.zeros(n)
    jump[row[joined]] = radius[joined] ** 4
    a, b = piece[:-1], piece[1:]
    second = [-6 / a**2, -2 / a, 6 / a**2 - 6 / b**2, -4 / a - 4 / b, 6 / b**2, -2 / b]
    bent = (6 / b**2)[:, None] * step[1:] + (6 / a**2)[:, None] * step[:-1]
    bent -= (2 / a)[:, None] * u[:-2] + (4 / a + 4 / b)[:, None] * u[1:-1] + (2 / b)[:, None] * u[2:]
    _add(bands, right, second, jump[1:-1] * 2.0 / (a + b), bent)
    bands[5, 2 * row] += weight
    bands[5, 2 * back] += np.where(joined, 0.0, weight)
    bands[5, 1::2] += STRAIGHT * np.append(piece, piece[-1])
    bands[5, bands[5] == 0.0] = 1.0
    scale = 1.0 / np.sqrt(bands[5])
    for k in range(6):
        bands[k, 5 - k:] *= scale[5 - k:] * scale[:2 * n - (5 - k)]
    for ridge in RIDGES:
        bands[5] += ridge
        with suppress(LinAlgError):
            found = scale[:, None] * solveh_banded(bands, scale[:, None] * right, check_finite=False)
            break
    else:
        found = np.full((2 * n, axes), np.nan)
    first, last = u[row[:-1]] + found[2 * row[:-1] + 1], u[back[1:]] + found[2 * back[1:] + 1]
    return FittedCurve(line.points + found[2 * row], first, last, h, line.owner, line.ends)


def _add(bands: Floats, right: Floats, factors: list[Floats], weight: Floats, rest: Floats) -> None:
    """Add the squares of weighted sums (K,) of unknowns, of neighbouring ends each, to the normal equations."""
    count = len(weight)
    for i, one in enumerate(factors):
        right[i::2][:count] -= (weight * one)[:, None] * rest
        for j in range(i, len(factors)):
            bands[5 - (j - i), j::2][:count] += weight * one * factors[j]
