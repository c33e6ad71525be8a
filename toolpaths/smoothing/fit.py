"""Quintic P-splines through rounded points, inside a tolerance at the points and on the chords between them.

A P-spline (Eilers and Marx 1996) weighs the points against the size of the third derivative. Places that are
off by too much get more weight in the next round; where that does not help the knots are halved.
"""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.smoothing.bspline import DEGREE, ORDER, KnotVectors
from toolpaths.smoothing.sweep import WIDTH, Data, Normal, evaluate, sweep_here

PENALTY = 1000.0
"""Weight of (width^3 third derivative)^2 against one point's square of deviation."""
SPARSE, DENSE = 4.0, 2.0
"""Points to a knot in the beginning, where chords are near the curve and where they are not."""
NEAR = 0.25
"""Height of the curve over its chord, over the tolerance, from which knots are dense."""
ROUNDS = 10
HALVINGS = 1
"""More of them follow the polyline, wiggling: what is outside then becomes lines."""
BETWEEN = 0.02
"""Least weight of the middle of a chord; it grows with the curve's height over the chord."""
GOOD = 0.95
"""Ratio of deviation to tolerance at the places that ends the rounds."""


@dataclass(frozen=True)
@arrays(c="K 6")
class SplineFit:
    """Splines of G stretches: knots and coefficients (K, 6)."""

    knots: KnotVectors
    c: Floats


@dataclass(frozen=True)
@arrays(t="T", c="K 6", ratio="C")
class Spline:
    """One stretch: clamped knots t, coefficients c (k, 6), `ratio` (P - 1,) bound of deviation over tolerance
    on each chord of its polyline."""

    t: Floats
    c: Floats
    ratio: Floats


def assembled(splines: list[Spline], shift: float) -> SplineFit | None:
    """All of them, their parameters less by `shift`; None for none."""
    if not splines:
        return None
    first = np.concatenate(([0], np.cumsum([len(one.t) for one in splines])))
    return SplineFit(KnotVectors(np.concatenate([one.t for one in splines]) - shift, first),
                     np.concatenate([one.c for one in splines]))


@dataclass(frozen=True)
@arrays(s="N", p="N 6", stretch="N", weight="N", ends="P", chord="C", row="C")
class _Polyline:
    """The points with the middles of their chords: s, p, stretch and weight of N places in order.

    `ends` (P,) parameter of the points, `chord` numbers (by their first point) of the chords inside
    stretches, `row` the place where each of these begins; its middle and its end follow.
    """

    s: Floats
    p: Floats
    stretch: Ints
    weight: Floats
    ends: Floats
    chord: Ints
    row: Ints


def fit(s: Floats, p: Floats, first: Ints, tolerance: float) -> list[Spline]:
    """One spline for each polyline, its end points kept; none depends on the others.

    Args:
        s (P,): parameter of the points, rising inside a stretch, and from stretch to stretch
        p (P, 6): points
        first (G + 1,): where each stretch begins; 2 points or more to a stretch
        tolerance: of the columns 0 to 2 and 3 to 5 each, by length
    """
    found: dict[int, Spline] = {}
    active, knots = np.arange(len(first) - 1), None
    for halvings_left in reversed(range(HALVINGS + 1)):
        height = heights(s, p, first) / tolerance
        line = _polyline(s, p, first, height)
        knots = _first_knots(s, first, height) if knots is None else knots
        made, ratio = _rounds(knots, line, (p[first[:-1]], p[first[1:] - 1]), tolerance)
        again = (np.maximum.reduceat(np.append(ratio, 0.0), first[:-1]) > 1.0) & (halvings_left > 0)
        for k in np.flatnonzero(~again).tolist():
            found[int(active[k])] = _one(made, ratio, first, k)
        if not again.any():
            break
        knots = _halved(knots, s, ratio > 1.0).taken(again)
        rows = np.repeat(again, np.diff(first))
        s, p, first, active = s[rows], p[rows], np.append(0, np.cumsum(np.diff(first)[again])), active[again]
    return [found[k] for k in range(len(found))]


def _one(made: SplineFit, ratio: Floats, first: Ints, k: int) -> Spline:
    """Stretch k of a fit."""
    begin, last = made.knots.ends
    return Spline(made.knots.t[made.knots.first[k]:made.knots.first[k + 1]], made.c[begin[k]:last[k] + 1],
                  ratio[first[k]:first[k + 1] - 1])


def heights(s: Floats, p: Floats, first: Ints) -> Floats:
    """(P - 1,) height over each chord of a curve that turns there as the polyline turns at the chord's ends.

    An arc of length h that turns by an angle a rises h a/8 over its chord; half of the turn at each end is
    the chord's. Chords at the end of a stretch take the turn at their other end for both; those between
    stretches count as 0.
    """
    step = np.diff(s)
    step[first[1:-1] - 1] = 1.0
    along = np.diff(p, axis=0) / step[:, None]
    turn = np.concatenate(([0.0], np.linalg.norm(np.diff(along, axis=0), axis=1), [0.0]))
    turn[first[1:-1]], turn[first[1:-1] - 1] = 0.0, 0.0
    before, behind = turn[:-1].copy(), turn[1:].copy()
    before[first[:-1]], behind[first[1:] - 2] = turn[first[:-1] + 1], turn[first[1:] - 2]
    result = step * (before + behind) / 16.0
    result[first[1:-1] - 1] = 0.0
    return np.asarray(result)


def _first_knots(s: Floats, first: Ints, height: Floats) -> KnotVectors:
    """Knots at points, denser where the chords are far from the curve, and at the ends of each stretch."""
    share = np.concatenate(([0.0], np.cumsum(np.where(height > NEAR, 1.0 / DENSE, 1.0 / SPARSE))))
    passed = np.floor(share - np.repeat(share[first[:-1]], np.diff(first)) + 1e-9)
    keep = np.append(True, np.diff(passed) > 0.0)
    keep[np.minimum(first[:-1] + 1, len(s) - 1)] = False
    keep[first[1:] - 2] = False
    keep[first[:-1]], keep[first[1:] - 1] = True, True
    return KnotVectors.clamped(s[keep], np.concatenate(([0], np.cumsum(keep)))[first])


def _polyline(s: Floats, p: Floats, first: Ints, height: Floats) -> _Polyline:
    stretch = np.repeat(np.arange(len(first) - 1), np.diff(first))
    chord = np.flatnonzero(stretch[1:] == stretch[:-1])
    row = 2 * chord - stretch[chord]
    size = 2 * len(s) - len(first) + 1
    middle = np.zeros(size, dtype=bool)
    middle[row + 1] = True
    every, values, weight = np.empty(size), np.empty((size, WIDTH)), np.ones(size)
    number = np.empty(size, dtype=np.int64)
    every[~middle], every[middle] = s, 0.5 * (s[chord] + s[chord + 1])
    values[~middle], values[middle] = p, 0.5 * (p[chord] + p[chord + 1])
    number[~middle], number[middle] = stretch, stretch[chord]
    weight[middle] = np.clip(height[chord] / NEAR, BETWEEN, 1.0)
    return _Polyline(every, values, number, weight, s, chord, row)


def _rounds(knots: KnotVectors, line: _Polyline, fixed: tuple[Floats, Floats],
            tolerance: float) -> tuple[SplineFit, Floats]:
    """The fit on these knots after some rounds of raising weights, and the bound on each chord (P - 1,).

    A stretch that is good enough stays as it is.
    """
    k = knots.span(line.s, line.stretch)
    places = Data(line.s, line.p, k, k - DEGREE - ORDER * line.stretch)
    penalty, run, weight = _penalty(knots), sweep_here(), line.weight.copy()
    c, ratio = np.zeros((knots.count, WIDTH)), np.zeros(len(k))
    begin = np.flatnonzero(np.diff(line.stretch, prepend=-1))
    of_stretch = np.repeat(np.arange(len(begin)), np.diff(knots.first) - ORDER)
    for turn in range(ROUNDS + 1):
        normal = Normal(penalty.copy(), np.zeros((knots.count, WIDTH)))
        run(knots.t, places, c, weight, tolerance if turn else np.inf, ratio, normal)
        good = np.maximum.reduceat(ratio, begin) <= (GOOD if turn else -1.0)
        if turn == ROUNDS or good.all():
            break
        c = np.where(good[of_stretch][:, None], c, _solved(knots, normal, fixed))
    made = SplineFit(knots, c)
    return made, _bound(made, line, ratio, tolerance)


def _penalty(knots: KnotVectors) -> Floats:
    """Lower bands (6, K) of the penalty's matrix."""
    rows, exists = knots.derivative_rows(3)
    rows = rows * np.where(exists, knots.widths() ** 3, 0.0)[:, None] * np.sqrt(PENALTY)
    bands = np.zeros((ORDER, knots.count))
    for i in range(4):
        for j in range(i, 4):
            product = rows[:, i] * rows[:, j]
            bands[j - i, i:] += product[:len(product) - i]
    return bands


def _solved(knots: KnotVectors, normal: Normal, fixed: tuple[Floats, Floats]) -> Floats:
    """Coefficients (K, 6) with the first and last of each stretch as given."""
    bands, right = normal.bands, normal.right
    begin, last = knots.ends
    head, tail = fixed
    for d in range(1, ORDER):
        right[begin + d] -= bands[d, begin][:, None] * head
        right[last - d] -= bands[d, last - d][:, None] * tail
        bands[d, begin] = 0.0
        bands[d, last - d] = 0.0
    bands[0, begin], bands[0, last] = 1.0, 1.0
    right[begin], right[last] = head, tail
    from scipy.linalg import solveh_banded

    return np.asarray(solveh_banded(bands, right, lower=True, overwrite_ab=True, overwrite_b=True, check_finite=False))


def _bound(made: SplineFit, line: _Polyline, ratio: Floats, tolerance: float) -> Floats:
    """(P - 1,) bound of deviation over tolerance on each chord, 0 on those between stretches.

    From values on the chord: between two places a distance d apart a function stays within d^2/8 of its second
    derivative's maximum of the straight line. Where ends and middle do not suffice the eighths are looked at, too.
    """
    begin, end = line.ends[line.chord], line.ends[line.chord + 1]
    curved = (end - begin) ** 2 / 8.0 * steepest(made.knots, made.c, begin, end) / tolerance
    off = np.max([ratio[line.row + j] for j in range(3)], axis=0)
    bound = off + curved / 4.0
    uncertainty = np.flatnonzero((bound > 1.0) & (off <= 1.0))
    for part in (0.125, 0.25, 0.375, 0.625, 0.75, 0.875) if len(uncertainty) else ():
        off[uncertainty] = np.maximum(off[uncertainty], _ratio_at(made, line, uncertainty, part, tolerance))
    bound[uncertainty] = off[uncertainty] + curved[uncertainty] / 64.0
    result = np.zeros(len(line.ends) - 1)
    result[line.chord] = bound
    return result


def _ratio_at(made: SplineFit, line: _Polyline, which: Ints, part: float, tolerance: float) -> Floats:
    """Deviation over tolerance (N,) at that part of the chords `which` (N,)."""
    row = line.row[which]
    s = line.s[row] + part * (line.s[row + 2] - line.s[row])
    k = made.knots.span(s, line.stretch[row])
    chord = line.p[row] + part * (line.p[row + 2] - line.p[row])
    off = evaluate(made.knots.t, made.c, Data(s, chord, k, made.knots.coefficient[k])) - chord
    return np.asarray(np.maximum(np.linalg.norm(off[:, :3], axis=1), np.linalg.norm(off[:, 3:], axis=1)) / tolerance)


def steepest(knots: KnotVectors, c: Floats, begin: Floats, end: Floats) -> Floats:
    """(N,) bound of the second derivative's length, of tip or axis, between begin and end (N,).

    A spline stays within the hull of its coefficients, and its second derivative is a spline, too.
    """
    rows, exists = knots.derivative_rows(2)
    second = np.zeros(knots.count + ORDER)
    for half in (slice(0, 3), slice(3, 6)):
        value = sum(rows[:-2, j, None] * c[j:len(c) - 2 + j, half] for j in range(3))
        size = np.where(exists[:-2], np.linalg.norm(value, axis=1), 0.0)
        second[:len(size)] = np.maximum(second[:len(size)], size)
    spans = np.max([second[knots.coefficient + j] for j in range(4)], axis=0)
    low = np.searchsorted(knots.t, begin, side="right") - 1
    high = np.maximum(np.searchsorted(knots.t, end, side="left"), low + 1)
    return np.asarray(np.maximum.reduceat(spans, np.stack((low, high), axis=1).ravel())[::2])


def _halved(knots: KnotVectors, s: Floats, bad: Bools) -> KnotVectors:
    """Knots with one more in the middle of each span that a bad chord (P - 1,) touches, and of those next to."""
    values, begin = knots.simple()
    chord = np.flatnonzero(bad)
    mark = np.zeros(len(values) + 1, dtype=np.int64)
    np.add.at(mark, np.maximum(np.searchsorted(values, s[chord], side="right") - 2, 0), 1)
    np.add.at(mark, np.minimum(np.searchsorted(values, s[chord + 1], side="left") + 1, len(values)), -1)
    inside = np.ones(len(values), dtype=bool)
    inside[begin[1:] - 1] = False
    where = np.flatnonzero((np.cumsum(mark[:-1]) > 0) & inside)
    added = np.searchsorted(where, begin)
    middle = 0.5 * (values[where] + values[where + 1])
    return KnotVectors.clamped(np.insert(values, where + 1, middle), begin + added)
