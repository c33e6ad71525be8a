"""Smoothing of CL points: inside the tolerance everywhere, smooth to the third derivative, exact off the joints."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline, make_interp_spline

from tests.toolpaths.smoothing_kit import smooth
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between, rotation
from toolpaths.shape import Curves
from toolpaths.smoothing.blend import HIGHEST, ramp
from toolpaths.smoothing.bspline import DEGREE, KnotVectors, basis
from toolpaths.smoothing.fit import fit
from toolpaths.smoothing.smooth import Smooth, Tolerance, smooth_all
from toolpaths.smoothing.stretches import corners
from toolpaths.smoothing.sweep import Data, Normal, compiled_sweep, sweep

TOLERANCE = Tolerance(0.005, np.radians(0.025))


def chain(tip: Floats, axis: Floats | None = None) -> Curves:
    """Straight moves through tips (M + 1, 3)."""
    moves = len(tip) - 1
    axis = np.tile([0.0, 0.0, 1.0], (moves + 1, 1)) if axis is None else axis
    none = np.zeros((moves, 3))
    return Curves(tip[:-1], tip[1:], axis[:-1], axis[1:], np.zeros(moves, dtype=bool), none, none,
                  np.zeros(moves))


def wave(s: Floats) -> tuple[Floats, Floats]:
    """A smooth curve and its tool axis."""
    phase = 2.0 * np.pi * s / 40.0
    tip = np.stack((30.0 * np.sin(0.4 * phase), 5.0 * np.sin(phase), 2.0 * np.cos(1.7 * phase)), axis=1)
    axis = np.stack((0.2 * np.sin(0.6 * phase), 0.15 * np.cos(0.8 * phase), np.ones(len(s))), axis=1)
    return tip, axis / np.linalg.norm(axis, axis=1, keepdims=True)


def rounded(step: float, length: float, places: int = 4) -> Curves:
    """The wave as a CL file has it."""
    tip, axis = wave(np.arange(0.0, length, step))
    axis = np.round(axis, 6)
    return chain(np.round(tip, places), axis / np.linalg.norm(axis, axis=1, keepdims=True))


def off(path: Smooth, curves: Curves, places: int) -> tuple[float, float]:
    """Largest distance of tip and angle of axis from the reference motion, at many places of every move."""
    worst = np.zeros(2)
    for u in np.linspace(0.0, 1.0, places):
        s = path.s[:-1] + u * np.diff(path.s)
        tip, axis = path.at(s)
        wanted, wanted_axis = curves.at(np.full(len(curves), u))
        worst = np.maximum(worst, [np.linalg.norm(tip - wanted, axis=1).max(), angle_between(axis, wanted_axis).max()])
    return float(worst[0]), float(worst[1])


def third(path: Smooth, s: Floats, h: float) -> Floats:
    """Third derivative of the tip by differences."""
    a, b, c, d = (path.at(s + k * h)[0] for k in (-1.5, -0.5, 0.5, 1.5))
    return np.asarray((d - 3.0 * c + 3.0 * b - a) / h**3)


@pytest.mark.parametrize("step", [0.05, 0.2, 0.4, 0.5])
def test_rounded_points_become_smooth_inside_the_tolerance(step: float) -> None:
    curves = rounded(step, 120.0)
    path = smooth(curves, TOLERANCE)
    assert path is not None and not len(path.stops)
    tip, axis = off(path, curves, 33)
    assert tip <= TOLERANCE.tip and axis <= TOLERANCE.axis
    assert 0.0 < path.worst <= 1.0


def test_noise_of_the_third_derivative_goes() -> None:
    curves = rounded(0.05, 80.0)
    path = smooth(curves, TOLERANCE)
    assert path is not None
    exact, axis = wave(np.arange(0.0, 80.0, 0.05))
    travel = np.concatenate(([0.0], np.cumsum(np.hypot(np.linalg.norm(np.diff(exact, axis=0), axis=1),
                                                       TOLERANCE.scale * angle_between(axis[:-1], axis[1:])))))
    inner = path.s[200:-200]
    true = make_interp_spline(travel, exact, k=7).derivative(3)(inner)
    noisy = make_interp_spline(path.s, np.concatenate((curves.start[:1], curves.end)), k=7).derivative(3)(inner)
    scale = np.linalg.norm(true, axis=1).max()
    assert np.linalg.norm(third(path, inner, 0.02) - true, axis=1).max() < 0.1 * scale
    assert np.linalg.norm(noisy - true, axis=1).max() > scale


def test_bound_of_each_chord_holds() -> None:
    curves = rounded(0.3, 60.0)
    p = np.hstack((np.concatenate((curves.start[:1], curves.end)),
                   11.0 * np.concatenate((curves.axis0[:1], curves.axis1))))
    s = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))))
    found, = fit(s, p, np.array([0, len(s)]), 0.004)
    spline = BSpline(found.t, found.c, DEGREE)
    u = np.linspace(0.0, 1.0, 101)[:, None]
    gap = spline(s[:-1] + u * np.diff(s)) - (p[:-1] + u[..., None] * np.diff(p, axis=0))
    truth = np.maximum(np.linalg.norm(gap[..., :3], axis=2), np.linalg.norm(gap[..., 3:], axis=2)).max(axis=0) / 0.004
    assert (found.ratio >= truth - 1e-12).all()
    assert found.ratio.max() <= 1.0 and np.median(found.ratio / truth) < 1.3


def test_square_keeps_its_sides_and_rounds_its_corners() -> None:
    curves = chain(np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0], [0, 0, 0]]))
    path = smooth(curves, TOLERANCE)
    assert path is not None and not len(path.stops)
    tip, _ = path.at(np.array([4.0, 9.9, 10.0, 10.1]))
    assert np.array_equal(tip[[0, 1, 3]], [[4.0, 0, 0], [9.9, 0, 0], [10.0, 10.1 - 10.0, 0]])
    assert 0.004 < np.linalg.norm(tip[2] - [10.0, 0, 0]) <= TOLERANCE.tip
    assert off(path, curves, 2001)[0] <= TOLERANCE.tip


def test_third_derivative_has_no_jump_at_a_blend() -> None:
    path = smooth(chain(np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0]])), Tolerance(0.05, 0.01))
    assert path is not None
    edge = float(path.blends.zones()[0, 0])
    half = float(path.blends.half[0])
    largest = np.linalg.norm(third(path, edge + np.linspace(0.1, 1.9, 50) * half, 1e-3 * half), axis=1).max()
    around = np.linalg.norm(third(path, edge + half * np.array([-0.01, 0.01]), 1e-3 * half), axis=1)
    assert around[0] < 1e-3 * largest and around[1] < 0.1 * largest
    speed = np.linalg.norm(np.diff(path.at(edge + np.linspace(0.0, 2.0, 400) * half)[0], axis=0), axis=1) / (half / 199.5)
    assert speed.max() <= 1.0 + 1e-9


def test_arc_stays_an_arc_and_meets_its_line_smoothly() -> None:
    up, center = np.array([[0.0, 0, 1], [0, 0, 1]]), np.array([[0.0, 0, 0], [10, 5, 0]])
    curves = Curves(np.array([[0.0, 0, 0], [10, 0, 0]]), np.array([[10.0, 0, 0], [10, 10, 0]]), up, up,
                    np.array([False, True]), center, up, np.array([0.0, np.pi]))
    path = smooth(curves, TOLERANCE)
    assert path is not None and not len(path.stops)
    zone = path.blends.zones()[0]
    assert zone[1] - zone[0] > 0.5
    s = np.linspace(zone[1], path.s[-1], 50)
    assert np.abs(np.linalg.norm(path.at(s)[0] - center[1], axis=1) - 5.0).max() < 1e-12
    assert 0.0 < off(path, curves, 3001)[0] <= TOLERANCE.tip


def test_motion_stops_where_it_turns_back_and_where_it_is_reported_to() -> None:
    back = smooth(chain(np.array([[0.0, 0, 0], [10, 0, 0], [0, 0.5, 0]])), TOLERANCE)
    assert back is not None and back.stops.tolist() == [10.0]
    square = chain(np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0]]))
    noted = smooth(square, TOLERANCE, sharpest=0.2)
    assert noted is not None and noted.stops.tolist() == [10.0]
    assert off(noted, square, 101)[0] < 1e-13


def test_points_too_far_apart_for_a_curve_become_lines_inside_the_tolerance() -> None:
    angle = np.linspace(0.0, np.pi, 20)
    curves = chain(10.0 * np.stack((np.cos(angle), np.sin(angle), np.zeros(20)), axis=1))
    path = smooth(curves, TOLERANCE)
    assert path is not None and not path.members.spline.any()
    assert off(path, curves, 401)[0] <= TOLERANCE.tip


def test_corner_between_dense_points_stays() -> None:
    one = np.stack((np.arange(0.0, 5.0, 0.1), np.zeros(50), np.zeros(50)), axis=1)
    two = np.array([5.0, 0.0, 0.0]) + np.stack((np.zeros(50), np.arange(0.0, 5.0, 0.1), np.zeros(50)), axis=1)
    curves = chain(np.round(np.concatenate((one, two)), 4))
    path = smooth(curves, TOLERANCE)
    assert path is not None and path.members.spline.sum() == 2
    assert np.abs(path.blends.s - 5.0).min() < 1e-9 and off(path, curves, 301)[0] <= TOLERANCE.tip


def test_tool_axis_alone_is_smoothed_and_moves_that_stand_still_count_for_nothing() -> None:
    tilt = np.linspace(0.0, 0.5, 40)
    axis = np.round(np.stack((np.sin(tilt), np.zeros(40), np.cos(tilt)), axis=1), 5)
    curves = chain(np.zeros((40, 3)), axis / np.linalg.norm(axis, axis=1, keepdims=True))
    path = smooth(curves, TOLERANCE)
    assert path is not None and path.s[-1] == pytest.approx(0.5 * TOLERANCE.scale, rel=1e-3)
    assert off(path, curves, 21)[1] <= TOLERANCE.axis
    assert smooth(chain(np.zeros((5, 3))), TOLERANCE) is None
    twice = smooth(chain(np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]])), TOLERANCE)
    assert twice is not None and twice.s.tolist() == [0.0, 1.0, 1.0, 2.0]


def test_turning_the_part_turns_the_path() -> None:
    curves = rounded(0.3, 30.0)
    turn = rotation(np.array([0.6, 0.0, 0.8]), np.array([0.7]))[0]
    moved = Curves(curves.start @ turn.T, curves.end @ turn.T, curves.axis0 @ turn.T, curves.axis1 @ turn.T,
                   curves.is_arc, curves.center, curves.normal, curves.sweep)
    one, two = smooth(curves, TOLERANCE), smooth(moved, TOLERANCE)
    assert one is not None and two is not None
    s = np.linspace(0.0, min(one.s[-1], two.s[-1]), 500)
    assert np.abs(one.at(s)[0] @ turn.T - two.at(s)[0]).max() < 1e-6


@pytest.mark.numeric
def test_compiled_pass_equals_numpy() -> None:
    rng = np.random.default_rng(3)
    knots = KnotVectors.clamped(np.array([0.0, 1, 2.5, 3, 4, 6, 7, 8.5]), np.array([0, 5, 8]))
    s = np.sort(rng.uniform(0.0, 4.0, 60))
    stretch = np.zeros(60, dtype=np.int64)
    k = knots.span(s, stretch)
    data = Data(s, rng.normal(size=(60, 6)), k, knots.coefficient[k])
    c, results = rng.normal(size=(knots.count, 6)), []
    for run in (sweep, compiled_sweep):
        weight, ratio = np.ones(60), np.zeros(60)
        normal = Normal(np.zeros((6, knots.count)), np.zeros((knots.count, 6)))
        run(knots.t, data, c, weight, 1.5, ratio, normal)
        results.append(np.concatenate([weight, ratio, normal.bands.ravel(), normal.right.ravel()]))
    assert results[0][:60].max() > 1.0
    np.testing.assert_allclose(results[1], results[0], rtol=1e-12, atol=1e-12)


def test_splines_of_two_stretches_equal_scipy() -> None:
    knots = KnotVectors.clamped(np.array([0.0, 1, 2.5, 3, 4, 4, 5, 6]), np.array([0, 5, 8]))
    rng = np.random.default_rng(1)
    c = rng.normal(size=knots.count)
    begin, last = knots.ends
    rows, exists = knots.derivative_rows(3)
    for g in range(2):
        t, own = knots.t[knots.first[g]:knots.first[g + 1]], c[begin[g]:last[g] + 1]
        spline = BSpline(t, own, DEGREE)
        s = np.linspace(t[0] - 0.3, t[-1] + 0.3, 40)
        k = knots.span(s, np.full(40, g))
        values = sum(basis(knots.t, k, s)[j] * c[knots.coefficient[k] + j] for j in range(6))
        np.testing.assert_allclose(values, spline(s), atol=1e-9)
        wanted = spline.derivative(3).c[:len(own) - 3]
        found = [rows[begin[g] + i] @ c[begin[g] + i:begin[g] + i + 4] for i in range(len(own) - 3)]
        np.testing.assert_allclose(found, wanted, rtol=1e-9)
        assert exists[begin[g]:last[g] - 2].all() and not exists[last[g] - 2:last[g] + 1].any()


def test_ramp_is_the_ramp_outside_and_three_times_differentiable() -> None:
    assert ramp(np.array([-2.0, -1.0, 1.0, 3.0])).tolist() == [0.0, 0.0, 1.0, 3.0]
    assert ramp(np.array([0.0]))[0] == HIGHEST
    h = 1e-3
    for edge in (-1.0, 1.0):
        inside = edge - np.sign(edge) * 2.0 * h
        around = ramp(inside + h * np.array([-1.5, -0.5, 0.5, 1.5]))
        assert abs(np.diff(around, 3)[0] / h**3) < 0.1


@pytest.mark.parametrize("sharp", [0.97, 0.999])
def test_dense_points_with_tight_turns_and_uneven_steps_stay_inside(sharp: float) -> None:
    rng = np.random.default_rng(7)
    phase = 2.0 * np.pi * np.cumsum(rng.uniform(0.05, 0.25, 3000)) / 25.0
    tip = np.stack((10.0 / np.pi * np.arcsin(sharp * np.sin(phase)), 0.02 * phase + np.cos(0.5 * phase),
                    2.0 * np.sin(0.5 * phase + 0.5)), axis=1)
    axis = np.stack((0.02 * np.sin(phase + 0.3), 0.03 * np.sin(2.0 * phase + 0.4), np.ones(3000)), axis=1)
    axis = np.round(axis / np.linalg.norm(axis, axis=1, keepdims=True), 6)
    curves = chain(np.round(tip, 4), axis / np.linalg.norm(axis, axis=1, keepdims=True))
    path = smooth(curves, TOLERANCE)
    assert path is not None and path.members.spline.any()
    worst_tip, worst_axis = off(path, curves, 41)
    assert worst_tip <= TOLERANCE.tip and worst_axis <= TOLERANCE.axis


def test_many_chains_at_once_are_those_one_by_one() -> None:
    rng = np.random.default_rng(4)
    square = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])
    noisy = np.round(np.cumsum(rng.normal(size=(60, 3)) * [0.02, 0.02, 0.02] + [0.3, 0.0, 0.0], axis=0), 4)
    straight = np.stack((0.2 * np.arange(40), np.zeros(40), 1e-4 * np.arange(40) ** 2), axis=1)
    chains = [chain(straight), chain(straight + np.array([0.0, 30.0, 0.0])), rounded(0.3, 30.0), chain(square),
              chain(np.zeros((4, 3))), rounded(0.6, 40.0), chain(noisy), rounded(0.1, 9.0)]
    columns = [np.concatenate([getattr(c, name) for c in chains]) for name in Curves.__dataclass_fields__]
    first = np.concatenate(([0], np.cumsum([len(c) for c in chains])))
    for own, curves in zip(smooth_all(Curves(*columns), first, TOLERANCE), chains, strict=True):
        alone = smooth(curves, TOLERANCE)
        assert (own is None) is (alone is None)
        if own is None or alone is None:
            continue
        s = np.linspace(0.0, alone.s[-1], 400)
        assert own.s.tolist() == alone.s.tolist() and own.members.first.tolist() == alone.members.first.tolist()
        np.testing.assert_allclose(own.at(s)[0], alone.at(s)[0], atol=1e-9)
        np.testing.assert_allclose(own.at(s)[1], alone.at(s)[1], atol=1e-10)
        assert own.worst == pytest.approx(alone.worst, abs=1e-6) and own.stops.tolist() == alone.stops.tolist()


def test_knots_are_halved_where_a_bend_needs_it() -> None:
    s = np.arange(0.0, 20.0, 0.05)
    p = np.zeros((len(s), 6))
    p[:, 0], p[:, 1] = s, 0.02 * np.exp(-((s - 10.0) / 0.12) ** 2)
    found, = fit(s, p, np.array([0, len(s)]), 0.001)
    gaps = np.diff(np.unique(found.t))
    near = np.abs(np.unique(found.t)[:-1] - 10.0) < 0.5
    assert found.ratio.max() <= 1.0
    assert gaps[near].min() < 0.06 and np.median(gaps[~near]) > 0.15


def test_corners_by_hand() -> None:
    none = np.zeros(9, dtype=bool)
    arc = none.copy()
    arc[4] = True
    polygon = corners(np.full(9, 1.0), np.full(8, 0.2), none, none[1:], 0.005)
    assert polygon.all()
    dense = np.zeros(8)
    dense[3] = 0.3
    assert np.flatnonzero(corners(np.full(9, 0.1), dense, none, none[1:], 0.005)).tolist() == [3]
    assert np.flatnonzero(corners(np.full(9, 0.1), np.zeros(8), arc, none[1:], 0.005)).tolist() == [3, 4]
    length = np.full(9, 0.1)
    length[6] = 5.0
    assert np.flatnonzero(corners(length, np.zeros(8), none, none[1:], 0.005)).tolist() == [5, 6]
    apart = np.zeros(8, dtype=bool)
    apart[1] = True
    assert np.flatnonzero(corners(np.full(9, 0.1), np.zeros(8), none, apart, 0.005)).tolist() == [1]
