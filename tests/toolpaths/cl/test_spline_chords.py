"""Chords of splines: within their tolerance, along the curve, and nearly as few as can be."""

from __future__ import annotations

import numpy as np
import pytest

from toolpaths.arrays import Floats
from toolpaths.cl.curves import spline_arcs
from toolpaths.cl.spline_chords import DEGREE, cubic_points, de_boor, knots_of, spline_points

LOOKS = 8001


def curve(seed: int) -> tuple[Floats, Floats]:
    """A clamped cubic of 5 to 12 control points in space with uneven knots."""
    random = np.random.default_rng(seed)
    count = int(random.integers(5, 13))
    control = np.cumsum(random.normal(size=(count, 3)) * [30.0, 30.0, 8.0], axis=0)
    return control, np.sort(np.append(random.random(count - 4), 1.0))


def dense(control: Floats, inner: Floats) -> Floats:
    return de_boor(control, knots_of(inner), np.linspace(0.0, 1.0, LOOKS), DEGREE)


def strays(points: Floats) -> float:
    """mm that places of a curve (N, 3) are off the chord from the first to the last."""
    along = points[-1] - points[0]
    unit = along / np.linalg.norm(along)
    across = points - points[0] - np.outer((points - points[0]) @ unit, unit)
    return float(np.linalg.norm(across, axis=1).max())


def worst(control: Floats, inner: Floats, chord: float) -> float:
    """mm that a curve is off its chords, each place off those that are next to where it is in order."""
    ends = np.concatenate([control[:1], spline_points(control, inner, chord)])
    places, result, k = dense(control, inner), 0.0, 0
    along, squares = np.diff(ends, axis=0), (np.diff(ends, axis=0) ** 2).sum(axis=1)
    for place in places:
        near = range(k, min(k + 3, len(along)))
        t = [float(np.clip((place - ends[n]) @ along[n] / max(squares[n], 1e-300), 0.0, 1.0)) for n in near]
        off = [float(np.linalg.norm(ends[n] + s * along[n] - place)) for n, s in zip(near, t, strict=True)]
        result = max(result, min(off))
        k += int(np.argmin(off))
    return result


def least(control: Floats, inner: Floats, chord: float) -> int:
    """Chords of which each is the longest that its places allow, one after the other."""
    places, begin, count = dense(control, inner), 0, 0
    while begin < len(places) - 1:
        low, high = begin + 1, len(places) - 1
        step = 2
        while begin + step < len(places) - 1 and strays(places[begin:begin + step + 1]) <= chord:
            low, step = begin + step, 2 * step
        high = min(begin + step, high)
        while high > low:
            middle = (low + high + 1) // 2
            low, high = (middle, high) if strays(places[begin:middle + 1]) <= chord else (low, middle - 1)
        begin, count = low, count + 1
    return count


@pytest.mark.parametrize("seed", range(3))
def test_chords_keep_within_their_tolerance(seed: int) -> None:
    control, inner = curve(seed)
    assert 0.5 * 0.05 < worst(control, inner, 0.05) <= 0.05 * (1.0 + 1e-9)


def test_chords_that_are_not_proved_are_none() -> None:
    """So large a curve takes more chords than are made of one: none, in the place of chords of an unknown deviation."""
    control = np.array([[0.0, 0.0, 0.0], [10.0, 10.0, 0.0], [0.0, 10.0, 5.0], [10.0, 0.0, 0.0]]) * 1e5
    inner = np.array([1.0])
    assert not len(spline_points(control, inner, 1e-4)) and not len(cubic_points(control, inner, 1e-4)[0])
    assert not len(spline_arcs(control[:, [0, 1, 1]], inner, 1e-4))


def test_few_more_chords_than_the_least() -> None:
    """Equal steps of the parameter between knots take twice as many; the tenth is the proof, at bends of few chords."""
    counts = np.array([(len(spline_points(*curve(seed), 0.02)), least(*curve(seed), 0.02)) for seed in range(3)])
    made, fewest = counts.sum(axis=0)
    assert fewest <= made < 1.15 * fewest


@pytest.mark.parametrize(("control", "inner"), [
    ([[0, 0, 0], [10, 0, 0], [20, 0, 0], [30, 0, 0]], [1.0]),  # straight
    ([[0, 0, 0], [30, 0, 0], [-20, 0, 0], [10, 0, 0]], [1.0]),  # there and back along a line
    ([[0, 0, 0], [10, 10, 0], [0, 10, 0], [10, 0, 0]], [1.0]),  # a cusp
    ([[0, 0, 0], [5, 0, 0], [9, 0, 0], [10, 0, 0], [10, 1, 0], [10, 5, 2], [10, 9, 0]], [0.5, 0.5, 0.5, 1.0]),  # a corner
    ([[0, 0, 0], [0, 0, 0], [0, 0, 0], [5, 5, 5]], [1.0]), ([[3, 3, 3]] * 5, [0.5, 1.0])])
def test_curves_that_stand_or_turn_back(control: list[list[float]], inner: list[float]) -> None:
    points, knots = np.array(control, dtype=float), np.array(inner)
    assert len(spline_points(points, knots, 0.01)) < 200
    assert worst(points, knots, 0.01) <= 0.01 * (1.0 + 1e-9)
