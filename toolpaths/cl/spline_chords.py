"""Clamped cubic B-splines: their points, and the chords that follow them within a tolerance, as few as may be."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints

DEGREE = 3
_MOST_CHORDS = 10000
_LEAST_CHORDS = 4
_LOOKS = 64
"""places of a span at which its bend is looked at"""
_TRIES, _HALVINGS = 60, 40
"""times that chords become more: shared out among their neighbours, then halved, as at a corner"""
_NEAR = 5
"""chords round one that is not proved among which one more is shared out"""
_SHARE = 0.95
"""of the tolerance that chords begin with"""
_LEAST = 1e-3
"""of a chord, on all of a spline: parameters rise where it is straight"""
_STANDS = 1e-6
"""of the largest speed along a spline: where it is less, its direction is not known"""
_BEZIER = np.array([[6.0, 0.0, 0.0, 0.0], [-5.0, 18.0, -9.0, 2.0], [2.0, -9.0, 18.0, -5.0], [0.0, 0.0, 0.0, 6.0]]) / 6.0
"""control points of a cubic from its points at 0, 1/3, 2/3 and 1"""


def spline_points(control: Floats, inner: Floats, chord: float) -> Floats:
    """Points (M, 3) after the first of a clamped cubic on [0, 1] whose chords keep within `chord` of it; (0, 3) where those
    that may be made are not proved.

    control (n, 3); inner (n - 3,): the inner knots and 1.
    """
    at = chord_places(control, inner, chord)
    return de_boor(control, knots_of(inner), at[1:], DEGREE) if len(at) else np.zeros((0, 3))


def chord_places(control: Floats, inner: Floats, chord: float) -> Floats:
    """Parameters (M + 1,) from 0 to 1 between which the chords of `spline_points` lie.

    A short chord, h in the parameter, is off by h^2 |C'' x C'|
    / (8 |C'|): equal steps of the integral of its root are the fewest chords (de Boor, Good approximation by splines with
    variable knots, 1973). Where `_follows` does not prove them there are more; (0,) where those that may be made are not
    proved either.
    """
    knots = knots_of(inner)
    edges, sums = _chords_before(control, knots, _SHARE * chord)
    count = int(np.clip(np.ceil(sums[-1]), 1, _MOST_CHORDS * len(control)))
    steps = np.linspace(0.0, sums[-1], count + 1)
    for number in range(_TRIES + _HALVINGS):
        at: Floats = np.interp(steps, sums, edges)
        bad = ~_follows(control, knots, at, chord)
        if not bad.any():
            return at
        if len(at) > _MOST_CHORDS * len(control):
            break
        steps = _more_steps(steps, bad) if number < _TRIES else np.sort(
            np.append(steps, 0.5 * (steps[:-1] + steps[1:])[bad]))
    return np.zeros(0)


def _more_steps(steps: Floats, bad: Bools) -> Floats:
    """Each stretch of steps that are `bad` (M - 1,), and of those next to them, as equal steps that are by a twentieth more,
    one at least."""
    if len(bad) > _NEAR:
        bad = np.convolve(bad, np.ones(_NEAR), "same") > 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], bad.astype(np.int8), [0]])))
    first, last = edges[::2], edges[1::2]
    more = last - first + np.maximum((last - first) // 20, 1)
    stretch = np.repeat(np.arange(len(more)), more)
    number = np.arange(len(stretch)) - np.repeat(np.cumsum(more) - more, more)
    made = steps[first][stretch] + number / more[stretch] * (steps[last] - steps[first])[stretch]
    kept = np.append(~bad, True)
    result: Floats = np.sort(np.concatenate([steps[kept], made]))
    return result


def _chords_before(control: Floats, knots: Floats, chord: float) -> tuple[Floats, Floats]:
    """Parameters (K,), how many chords (K,) lead there: the integral of sqrt(|C'' x C'| / (8 chord |C'|)), which rises."""
    breaks = np.unique(knots)
    at = (breaks[:-1, None] + np.diff(breaks)[:, None] * (np.arange(_LOOKS) + 0.5) / _LOOKS).ravel()
    slopes = _slopes(control, knots, DEGREE)
    speed = de_boor(slopes, knots[1:-1], at, DEGREE - 1)
    bend = de_boor(_slopes(slopes, knots[1:-1], DEGREE - 1), knots[2:-2], at, DEGREE - 2)
    size = np.linalg.norm(speed, axis=1)
    moves = size > _STANDS * size.max()
    across = np.where(moves, np.linalg.norm(np.cross(bend, speed), axis=1) / np.where(moves, size, 1.0),
                      np.linalg.norm(bend, axis=1))
    width = np.repeat(np.diff(breaks) / _LOOKS, _LOOKS)
    chords = np.maximum(width * np.sqrt(across / (8.0 * chord)), _LEAST * width)
    edges = np.append(0.0, np.cumsum(width))
    return edges / edges[-1], np.append(0.0, np.cumsum(chords))


def _follows(control: Floats, knots: Floats, at: Floats, chord: float) -> Bools:
    """(M - 1,) True where the chord between two parameters of `at` (M,) is proved to be within `chord` of its piece, which
    runs along it without turning back."""
    return np.asarray(chord_errors(control, knots, at) <= chord)


def chord_errors(control: Floats, knots: Floats, at: Floats) -> Floats:
    """(M - 1,) mm within which the chord between two parameters of `at` (M,) is proved to follow its piece from end to end.

    Each part between knots is a Bezier cubic: its hull bounds how far it is off the chord, less what 3 t (1 - t) <= 3/4
    takes from how far the inner control points are off the line between the outer ones; it goes on where its hull does.
    Where it does not, its hull is no further from the begin than it is large.
    """
    edges = np.union1d(at, knots)
    of: Ints = np.searchsorted(at, edges[:-1], side="right") - 1
    places = edges[:-1, None] + np.diff(edges)[:, None] * np.arange(4) / 3.0
    hull = np.einsum("ij,njk->nik", _BEZIER, de_boor(control, knots, places.ravel(), DEGREE).reshape(-1, 4, 3))
    ends = de_boor(control, knots, at, DEGREE)
    along = np.diff(ends, axis=0)
    length = np.linalg.norm(along, axis=1)
    unit = along / np.where(length > 0.0, length, 1.0)[:, None]
    from_start = hull - ends[of][:, None, :]
    off = from_start - np.einsum("nik,nk->ni", from_start, unit[of])[:, :, None] * unit[of][:, None, :]
    inner = np.linalg.norm(off[:, 1:3] - np.array([[2.0, 1.0], [1.0, 2.0]]) @ off[:, [0, 3]] / 3.0, axis=2).max(axis=1)
    away = np.linalg.norm(off[:, [0, 3]], axis=2).max(axis=1) + 0.75 * inner
    onward = (np.einsum("nik,nk->ni", np.diff(hull, axis=1), unit[of]) >= 0.0).all(axis=1)
    size = np.linalg.norm(from_start, axis=2).max(axis=1)
    result = np.zeros(len(at) - 1)
    np.maximum.at(result, of, np.where(onward, np.minimum(away, size), size))
    return result


def cubic_points(control: Floats, inner: Floats, chord: float, always: bool = False) -> tuple[Floats, Bools]:
    """Points (M, 3) as of `spline_points`, of chords of equal steps between knots, their numbers powers of two; which (M,)
    are at a knot; none where `places_of` has none. Pieces that bend have four chords at least, so that their points show
    that they are cubics; `always`: all pieces."""
    knots = knots_of(inner)
    at = places_of(control, knots, chord)
    if not len(at):
        return np.zeros((0, 3)), np.zeros(0, dtype=np.bool_)
    breaks = np.unique(knots)
    counts = np.diff(np.searchsorted(at, breaks, side="right"))
    powers = 2 ** np.ceil(np.log2(np.maximum(counts, 1))).astype(int)
    counts = np.where((counts > 1) | always, np.maximum(powers, _LEAST_CHORDS), 1)
    at = np.concatenate([np.linspace(a, c, n + 1)[1:] for a, c, n in zip(breaks, breaks[1:], counts, strict=False)])
    return de_boor(control, knots, at, DEGREE), np.isin(at, breaks)


def part_behind(control: Floats, inner: Floats, at: float) -> tuple[Floats, Floats]:
    """(control points, inner knots and 1) of what is left of a clamped cubic behind a parameter: blossoms at the knots that
    are left (Ramshaw, Blossoming, 1987)."""
    knots = knots_of(inner)
    rest = inner[inner > at]
    own = np.concatenate([np.full(DEGREE + 1, at), rest, np.full(DEGREE, rest[-1])])
    count = len(rest) + DEGREE
    wide = np.flatnonzero(own[1:] > own[:-1])
    of = own[wide[np.searchsorted(wide, np.arange(count))]]
    spans = np.searchsorted(knots, of, side="right") - 1
    arguments = own[np.arange(1, count + 1)[:, None] + np.arange(DEGREE)]
    return _blossoms(control, knots, spans, arguments), (rest - at) / (rest[-1] - at)


def _blossoms(control: Floats, knots: Floats, span: Ints, arguments: Floats) -> Floats:
    """(K, 3) blossoms of the pieces that begin at knots `span` (K,) at their three arguments (K, 3): de Boor's recursion
    with another argument at each level."""
    d = control[span[:, None] + np.arange(-DEGREE, 1)]
    for level in range(1, DEGREE + 1):
        for j in range(DEGREE, level - 1, -1):
            low, high = knots[span + j - DEGREE], knots[span + j + 1 - level]
            t = np.where(high > low, (arguments[:, level - 1] - low) / np.where(high > low, high - low, 1.0), 0.0)[:, None]
            d[:, j] = (1.0 - t) * d[:, j - 1] + t * d[:, j]
    result: Floats = d[:, DEGREE]
    return result


def knots_of(inner: Floats) -> Floats:
    """All knots of a clamped cubic on [0, 1], of the inner ones and 1."""
    return np.concatenate([np.zeros(DEGREE + 1), inner, np.ones(DEGREE)])


def places_of(control: Floats, knots: Floats, chord: float, least: int = 1) -> Floats:
    """(M,) parameters after the first between which chords keep within `chord`, at least so many to a span; none where
    a span takes more than may be made."""
    breaks = np.unique(knots)
    bend = _second_derivatives(control, knots, breaks)
    steps = np.ceil(np.diff(breaks) * np.sqrt(bend / (8.0 * chord)))
    if steps.max() > _MOST_CHORDS:
        return np.zeros(0)
    counts = np.maximum(steps, least).astype(int)
    return np.concatenate([np.linspace(a, c, n + 1)[1:] for a, c, n in zip(breaks, breaks[1:], counts, strict=False)])


def width_of(knots: Floats, count: int, degree: int) -> Floats:
    """(count - 1,) widths that differences of control points are divided by; 1 where knots coincide."""
    width = knots[degree + 1:degree + count] - knots[1:count]
    return np.where(width > 0.0, width, 1.0)


def _slopes(control: Floats, knots: Floats, degree: int) -> Floats:
    """Control points (n - 1, 3) of the derivative of a spline."""
    result: Floats = degree * np.diff(control, axis=0) / width_of(knots, len(control), degree)[:, None]
    return result


def _second_derivatives(control: Floats, knots: Floats, breaks: Floats) -> Floats:
    """Greatest |C''| in each span between breaks: C'' is linear there, so that its ends decide."""
    points, degree = control, DEGREE
    for _ in range(2):
        points = _slopes(points, knots, degree)
        knots, degree = knots[1:-1], degree - 1
    inside = np.concatenate([breaks[:-1], breaks[:-1] + (1.0 - 1e-9) * np.diff(breaks)])
    size = np.linalg.norm(de_boor(points, knots, inside, degree), axis=1).reshape(2, -1)
    result: Floats = size.max(axis=0)
    return result


def de_boor(control: Floats, knots: Floats, at: Floats, degree: int) -> Floats:
    """Points (M, 3) of the B-spline at parameters (M,), by de Boor's recursion (The NURBS Book, A3.1)."""
    span = np.clip(np.searchsorted(knots, at, side="right") - 1, degree, len(control) - 1)
    d = control[span[:, None] + np.arange(-degree, 1)]
    for level in range(1, degree + 1):
        for j in range(degree, level - 1, -1):
            low = knots[span + j - degree]
            high = knots[span + j + 1 - level]
            t = np.where(high > low, (at - low) / np.where(high > low, high - low, 1.0), 0.0)[:, None]
            d[:, j] = (1.0 - t) * d[:, j - 1] + t * d[:, j]
    result: Floats = d[:, degree]
    return result
