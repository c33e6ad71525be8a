"""The path that a control makes of commanded points: fitted where they stand on a curve, corners rounded off.

Derivatives by path length are those of the polyline smoothed by a kernel of finite width: at a vertex the direction changes
by du over the width w as the quintic S(x) = 10 x^3 - 15 x^4 + 6 x^5, so that the third derivative is continuous; widths
overlap and add up. The deviation of a corner is 5/64 |du| w (integral of S from 0 to 1/2), that of a curve of curvature k
is k w^2/56 (variance of Beta(3, 3) is 1/28): the widths are chosen by the mean over w, which deviates more in both
cases (|du| w/8, k w^2/24).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from postproc.clock.curve import curve
from postproc.clock.kernels import add_turns
from postproc.feedrate.paths import Derivatives
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.compiled import chosen
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

SMOOTH_TURN, SMOOTH_SAG = 1.0, 0.25
"""largest change of direction of neighbouring blocks on one curve, rad, and the sag of its chord, mm: coarser than points of
a curve"""
EVEN, SLIGHT, ROUNDED = 1.5, 0.02, 0.003
"""on a curve a vertex turns at most EVEN times what both neighbours turn together, or SLIGHT rad, or what points rounded to
0.001 mm may turn: ROUNDED mm over the shorter chord"""
FEW_TURN, FEW_EVEN, FEW_SUM = 1.95, 8.0, 2.6
"""a bend that few points show: what one vertex turns at most (2 sin of half the angle), how many times what both neighbours
turn to the same side, and all three together (those of a square turn by 4.2: corners)"""
LEFT = 0.3
"""of the tolerance, that is left for smoothing at least where points have moved"""
PIECE_TURN, MOST_PIECES = 0.005, 96
"""rad that a fitted curve turns from piece to piece, and pieces of a block at most"""
WIDTHS = 0.01 * 1.3 ** np.arange(30)
"""mm (rad of rotary blocks): widths that are tried, 0.01 to 20"""
MEAN_SHARE = 1.6
"""by which the mean over a width deviates more than the kernel, at least"""
SLOPE = 2.0
"""by which the width may change with the path"""
PLACES = np.array([-0.5, -0.3, -0.14, 0.0, 0.14, 0.3, 0.5])
"""of a width where derivatives are taken"""
BEFORE, APART = 1e-7, 1e-6
"""mm before a rest where the direction is still that of the path that leads there; least distance of places"""
SHORTEST = 1e-5
"""mm: shorter blocks are no motion; the nearest place to a rest at which bends are seen"""
SMOOTH_BUMP = (140.0, -420.0, 420.0, -140.0)
"""140 x^3 (1 - x)^3, whose integral is 1 and whose derivatives up to the second vanish at 0 and 1"""
TAKES_BACK = 0.3
"""mm of an interval that takes back what the ones before went astray"""
COMPILE_FROM = 30
NOTHING = 1e-12
"""mm, against division by 0"""


@dataclass(frozen=True)
@arrays(points="V A", length="N", speed="N", tolerance="V", stop="V", weight="A", part="N")
class CommandedPath:
    """What a control is given, N blocks between V = N + 1 points.

    Attributes:
        points (V, A): machine coordinates, mm and rad
        length (N,): path of each block that the feed refers to, > 0 where the axes move; speed (N,): largest along it
        tolerance (V,): mm that the path may leave each point, 0 for none; stop (V,): the axes rest there
        weight (A,): mm that a unit of each axis counts in deviations
        part (N,): of a block of the program that each is, 1 where it is all of one; None: all are whole
    """

    points: Floats
    length: Floats
    speed: Floats
    tolerance: Floats
    stop: Bools
    weight: Floats
    part: Floats | None = None

    @property
    def parts(self) -> Floats:
        """`part` (N,), 1 where it is not stated."""
        return np.ones(len(self.length)) if self.part is None else self.part


@dataclass(frozen=True)
@arrays(s="M", q="M A", dq="M A", d2q="M A", d3q="M A", ends="V", stops="K")
class BlendedPath:
    """A path by its length in mm, axes weighted; a path of the planner (`ParametricPath`).

    Attributes:
        s (M,), q, dq, d2q, d3q (M, A): places, position and derivatives there
        ends (V,): s of the commanded points; stops (K,): s of rests, both ends included
    """

    s: Floats
    q: Floats
    dq: Floats
    d2q: Floats
    d3q: Floats
    ends: Floats
    stops: Floats

    @property
    def start(self) -> float:
        """0."""
        return float(self.s[0])

    @property
    def end(self) -> float:
        """Length."""
        return float(self.s[-1])

    @property
    def breaks(self) -> Floats:
        """Places between which derivatives are polynomials."""
        return self.s

    @cached_property
    def _pieces(self) -> tuple[Floats, Floats]:
        """(coefficients (7, M - 1, A) of dq by the share of each interval, q (M, A) where they lead): between places that
        the smoothing makes no polynomial q goes astray by some 1e-7 mm, which long intervals take back."""
        h = np.diff(self.s)[:, None]
        still = np.isin(self.s[1:], self.stops)[:, None] & (h < APART)
        d, b0, c0 = self.dq[:-1], self.d2q[:-1] * h, self.d3q[:-1] * h * h / 2
        f, b = self.dq[1:] - d - b0 - c0, self.d2q[1:] * h - b0 - 2 * c0
        c = self.d3q[1:] * h * h / 2 - c0
        bent = [b0, c0, 10 * f - 4 * b + c, -15 * f + 7 * b - 2 * c, 6 * f - 3 * b + c, np.zeros_like(d)]
        made = np.stack([d, *(np.where(still, 0.0, one) for one in bent)])
        step = h * (made / np.arange(1.0, 8.0)[:, None, None]).sum(axis=0)
        astray = np.cumsum(np.diff(self.q, axis=0) - step, axis=0)
        long = np.flatnonzero(h[:, 0] >= TAKES_BACK)
        back = np.diff(astray[long], axis=0, prepend=0.0)
        made[3:, long] += back / h[long] * np.array(SMOOTH_BUMP)[:, None, None]
        step[long] += back
        return made, np.concatenate([self.q[:1], self.q[:1] + np.cumsum(step, axis=0)])

    def derivatives(self, s: Floats) -> Derivatives:
        """At s (N,): polynomials that have the positions and derivatives of the places."""
        c, q = self._pieces
        k = np.clip(np.searchsorted(self.s, s, side="right") - 1, 0, len(self.s) - 2)
        h = (self.s[k + 1] - self.s[k])[:, None]
        x = (s - self.s[k])[:, None] / h
        at = c[:, k]
        whole, first, second, third = (np.zeros_like(x * at[0]) for _ in range(4))
        for n in range(6, -1, -1):
            third = third * x + 2.0 * second
            second = second * x + first
            first = first * x + at[n]
            whole = whole * x + at[n] / (n + 1.0)
        return Derivatives(q[k] + h * x * whole, first, second / h, third / (h * h))


def blended(path: CommandedPath) -> BlendedPath:
    """The path that the control runs."""
    moves = np.linalg.norm(np.diff(path.points, axis=0) * path.weight, axis=1) > SHORTEST
    group = np.concatenate([[0], np.cumsum(moves)])
    if not moves.any():
        flat = np.zeros((1, path.points.shape[1]))
        return BlendedPath(np.zeros(1), path.points[:1], flat, flat, flat, np.zeros(len(group)), np.zeros(1))
    first = np.flatnonzero(np.concatenate([[True], moves]))
    stop = np.logical_or.reduceat(path.stop, first)
    stop[[0, -1]] = True
    path = CommandedPath(path.points[first], path.length[moves], path.speed[moves],
                         np.minimum.reduceat(path.tolerance, first), stop, path.weight)
    made = _blended(path)
    return replace(made, ends=made.ends[group])


def _blended(path: CommandedPath) -> BlendedPath:
    """The same where each block moves."""
    points, length, tolerance, owner = fitted(path)
    ends = np.concatenate([[0.0], np.cumsum(length)])
    last = np.append(np.flatnonzero(np.diff(owner)), len(owner) - 1)
    blocks = np.concatenate([[0.0], ends[last + 1]])
    stops = blocks[path.stop]
    width = widths(points * path.weight, ends, tolerance, stops)
    u = np.diff(points, axis=0) / length[:, None]
    s = places(ends[1:-1], width, stops)
    turns = np.where(np.isin(ends[1:-1], stops)[:, None], 0.0, np.diff(u, axis=0))
    k = np.clip(np.searchsorted(ends, s, side="right") - 1, 0, len(u) - 1)
    q, dq = points[k] + (s - ends[k])[:, None] * u[k], u[k]
    d2q, d3q = np.zeros_like(dq), np.zeros_like(dq)
    add = chosen(add_turns, len(s), COMPILE_FROM)
    add(s, q, dq, d2q, d3q, ends[1:-1], turns, width)
    return BlendedPath(s, q, dq, d2q, d3q, blocks, stops)


def fitted(path: CommandedPath) -> tuple[Floats, Floats, Floats, Ints]:
    """(points (P + 1, A), length (P,) in mm, tolerance (P + 1,), block of each piece (P,)): blocks on one curve as pieces
    of the smoothest that the tolerance allows (`curve.py`)."""
    flat = path.points * path.weight
    step = np.diff(flat, axis=0)
    chord = np.maximum(np.linalg.norm(step, axis=1), 1e-12)
    u = step / chord[:, None]
    smooth, _ = _curved(u, chord, path)
    laid = curve(flat, u, chord, smooth, path.tolerance)
    count = np.clip(np.ceil(laid.bends() / PIECE_TURN), 1, MOST_PIECES).astype(np.int64)
    piece = np.repeat(np.arange(len(count)), count)
    part = (np.arange(len(piece)) - (np.cumsum(count) - count)[piece] + 1.0) / count[piece]
    x, h = part[:, None], laid.along[piece, None]
    inner = (laid.points[piece] * (1 + 2 * x) * (1 - x) ** 2 + laid.points[piece + 1] * x**2 * (3 - 2 * x)
             + h * laid.first[piece] * x * (1 - x) ** 2 + h * laid.last[piece] * x**2 * (x - 1))
    last = np.cumsum(count) - 1
    inner[last] = laid.points[1:]
    wide = np.concatenate([laid.points[:1], inner])
    length = np.maximum(np.linalg.norm(np.diff(wide, axis=0), axis=1), 1e-12)
    owner, ends = laid.owner[piece], last[laid.ends]
    moved = np.linalg.norm(wide[np.concatenate([[0], ends + 1])] - flat, axis=1)
    left = np.maximum(path.tolerance - moved, LEFT * path.tolerance)
    tolerance = np.maximum(left[owner], left[owner + 1])
    tolerance[ends] = left[1:]
    return wide / path.weight, length, np.concatenate([left[:1], tolerance]), owner


def sharp(path: CommandedPath) -> CommandedPath:
    """The path whose points keep their tolerance only where they stand on a curve: corners are not rounded off."""
    flat = path.points * path.weight
    step = np.diff(flat, axis=0)
    chord = np.maximum(np.linalg.norm(step, axis=1), 1e-12)
    smooth, _ = _curved(step / chord[:, None], chord, path)
    keeps = np.concatenate([[False], smooth, [False]])
    return replace(path, tolerance=np.where(keeps, path.tolerance, 0.0))


def _curved(u: Floats, chord: Floats, path: CommandedPath) -> tuple[Bools, Floats]:
    """Of inner points (N - 1,): whether both blocks are of one curve, change of direction."""
    turn = np.linalg.norm(np.diff(u, axis=0), axis=1)
    sag = turn * np.maximum(chord[:-1], chord[1:]) / 8.0
    around = np.concatenate([[0.0], turn[:-1]]) + np.append(turn[1:], 0.0) if len(turn) else turn
    slight = np.maximum(SLIGHT, ROUNDED / np.minimum(chord[:-1], chord[1:]))
    even = turn <= np.maximum(EVEN * around, slight)
    alike = _turned_alike(u, turn)
    few = (turn <= np.minimum(FEW_TURN, FEW_EVEN * alike)) & (turn + alike <= FEW_SUM)
    smooth = (sag <= SMOOTH_SAG) & (path.tolerance[1:-1] > 0.0) & ((turn <= SMOOTH_TURN) & even | few) & ~path.stop[1:-1]
    return smooth, turn


def _turned_alike(u: Floats, turn: Floats) -> Floats:
    """(N - 1,) what both neighbours of a vertex turn to the same side as it does."""
    cosine = (u[1:] * u[:-1]).sum(axis=1)
    same = (u[2:] * u[:-2]).sum(axis=1) < cosine[1:] * cosine[:-1]
    result = np.zeros(len(turn))
    result[1:] += np.where(same, turn[:-1], 0.0)
    result[:-1] += np.where(same, turn[1:], 0.0)
    return result


def widths(flat: Floats, ends: Floats, tolerance: Floats, stops: Floats) -> Floats:
    """(P - 1,) width over which each inner point is smoothed: the widest whose mean deviates by at most the tolerance,
    and all narrower ones too, between those that are tried by the ratio; it reaches over no rest."""
    s = ends[1:-1]
    if not len(s):
        return s
    middle = (flat[1:] + flat[:-1]) / 2.0 * np.diff(ends)[:, None]
    whole = np.concatenate([np.zeros((1, flat.shape[1])), np.cumsum(middle, axis=0)])
    before = s - stops[np.searchsorted(stops, s, side="right") - 1]
    behind = stops[np.minimum(np.searchsorted(stops, s, side="right"), len(stops) - 1)] - s
    room = 2.0 * np.minimum(before, behind)
    result, off = np.zeros(len(s)), np.zeros(len(s))
    alive = np.flatnonzero((tolerance[1:-1] > 0.0) & (room > 0.0))
    for width in WIDTHS:
        w = np.minimum(width, room[alive])
        mean = (_integral(flat, whole, ends, s[alive] + w / 2) - _integral(flat, whole, ends, s[alive] - w / 2)) / w[:, None]
        deviation, most = np.linalg.norm(mean - flat[alive + 1], axis=1), MEAN_SHARE * tolerance[alive + 1]
        good = deviation <= most
        between = np.where(good, 1.0, (most - off[alive]) / np.maximum(deviation - off[alive], NOTHING))
        result[alive] += between * (w - result[alive])
        off[alive] = deviation
        alive = alive[good & (width < room[alive])]
        if not len(alive):
            break
    result = np.minimum(np.minimum.accumulate(result - SLOPE * s) + SLOPE * s,
                        np.minimum.accumulate((result + SLOPE * s)[::-1])[::-1] - SLOPE * s)
    return np.asarray(np.maximum(result, np.minimum(WIDTHS[0], np.maximum(room, 1e-9))))


def _integral(flat: Floats, whole: Floats, ends: Floats, at: Floats) -> Floats:
    """(K, A) integral of the polyline from 0 to places `at` (K,)."""
    k = np.clip(np.searchsorted(ends, at, side="right") - 1, 0, len(ends) - 2)
    x = (at - ends[k])[:, None]
    slope = (flat[k + 1] - flat[k]) / (ends[k + 1] - ends[k])[:, None]
    return np.asarray(whole[k] + x * (flat[k] + slope * x / 2.0))


def places(s: Floats, width: Floats, stops: Floats) -> Floats:
    """(M,) places of derivatives: several over each width, only the points themselves where they stand close together; the
    stops, and where the path leads to them."""
    gap = np.diff(s, prepend=-np.inf, append=np.inf)
    close = np.maximum(gap[:-1], gap[1:]) < width / 6.0
    inside = s[~close, None] + width[~close, None] * PLACES
    every = np.unique(np.concatenate([s[close], inside.ravel(), (stops[1:] + stops[:-1]) / 2.0]))
    every = every[np.diff(np.floor(every / APART), prepend=-1.0) > 0.0]
    behind = np.searchsorted(stops, every, side="right")
    free = (behind > 0) & (behind < len(stops))
    every, behind = every[free], behind[free]
    every = every[np.minimum(every - stops[behind - 1], stops[behind] - every) > 2.0 * APART]
    every = every[np.diff(every, prepend=-np.inf) > APART]
    return np.asarray(np.unique(np.concatenate([every, stops, stops[1:-1] - BEFORE])))
