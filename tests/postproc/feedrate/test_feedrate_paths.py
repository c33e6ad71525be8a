"""Paths eased at their ends, and the mesh."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.feedrate.kernels.splines import spline
from postproc.feedrate.limits import JointLimits, squared_speed, steady_cap
from postproc.feedrate.mesh import FEWEST, Spacing, mesh
from postproc.feedrate.paths import Eased, SplinePath
from tests.postproc.feedrate_kit import MIKRON, PolynomialPath, random_path, unlimited
from toolpaths.compiled import compiled


def test_eased_derivatives_are_those_of_the_eased_path() -> None:
    eased = Eased.between(PolynomialPath([[1.0, 2.0, -0.3, 0.01], [0.0, -1.0, 0.02]], 30.0), 3.0, 28.0, 10.0)
    sigma, h = np.array([0.5, 4.0, 9.9, 15.0, eased.end - 9.0, eased.end - 0.5]), 1e-3
    for order in range(3):
        change = eased.derivatives(sigma + h)[order] - eased.derivatives(sigma - h)[order]
        np.testing.assert_allclose(eased.derivatives(sigma)[order + 1], change / (2.0 * h),
                                   rtol=2e-5, atol=2e-6)


def test_eased_ends_inverse_and_joints() -> None:
    eased = Eased.between(PolynomialPath([[0.0, 1.0]], 30.0), 3.0, 28.0, 10.0)
    ends = eased.derivatives(np.array([0.0, eased.end]))
    np.testing.assert_allclose(ends.q[:, 0], [3.0, 28.0])
    np.testing.assert_allclose(np.concatenate(ends[1:3]), 0.0, atol=1e-12)
    np.testing.assert_allclose(ends.d3q[:, 0], 12.0 / 10.0**2)
    sigma = np.linspace(0.0, eased.end, 50)
    np.testing.assert_allclose(eased.sigma(eased.parameter(sigma)[0]), sigma, atol=1e-4)
    inside = np.array([10.0, eased.end - 10.0])
    np.testing.assert_allclose(eased.derivatives(inside - 1e-9).d3q,
                               eased.derivatives(inside + 1e-9).d3q, atol=1e-8)
    assert np.all(np.isin(np.round(eased.breaks, 9), np.round(inside, 9)))


def test_short_stretch_keeps_room() -> None:
    eased = Eased.between(PolynomialPath([[0.0, 1.0]], 30.0), 3.0, 4.0, 25.0)
    assert eased.ease == 0.8 and eased.end == pytest.approx(1.0 + 0.64)
    assert np.all(np.diff(eased.parameter(np.linspace(0.0, eased.end, 99))[0]) > 0.0)


def test_mesh_follows_the_limits_gently() -> None:
    eased = Eased.between(random_path(2), 0.0, 100.0, 25.0)
    spacing = Spacing(dt=3e-3)
    knots = mesh(eased, MIKRON, lambda s: np.full(len(s), np.inf), spacing)
    h = np.diff(knots)
    assert (knots[0], knots[-1]) == (0.0, eased.end) and len(h) >= FEWEST
    at = eased.derivatives(knots)
    speed = np.sqrt(np.minimum(squared_speed(at.dq, MIKRON.velocity), steady_cap(at.d2q, at.d3q, MIKRON)))
    assert np.all(h <= 1.3 * np.minimum(spacing.dt * speed[:-1], spacing.longest))
    assert np.max(np.abs(np.diff(h)) / h[1:]) < 1.2 * spacing.slope


def test_mesh_narrows_for_a_slow_feed() -> None:
    eased = Eased.between(random_path(2), 0.0, 100.0, 25.0)

    def feed(sigma: np.ndarray) -> np.ndarray:
        return np.where(np.abs(sigma - 60.0) < 5.0, 4.0, np.inf)

    knots = mesh(eased, MIKRON, feed, Spacing(dt=3e-3))
    slow = np.diff(knots[np.abs(knots - 60.0) < 4.5])
    assert slow.max() <= 4.0 * 3e-3 * 1.001


def test_bad_values_are_refused() -> None:
    with pytest.raises(ValueError, match="degree 3"):
        SplinePath(np.zeros(8), np.zeros((4, 1)), 3)
    with pytest.raises(ValueError, match="positive"):
        JointLimits(np.array([1.0]), np.array([0.0]), np.array([1.0]))
    with pytest.raises(ValueError, match="shape"):
        JointLimits(np.ones(2), np.ones(3), np.ones(2))


@pytest.mark.numeric
@pytest.mark.parametrize("degree", [4, 5, 6])
def test_compiled_spline_equals_scipys(degree: int) -> None:
    """Rising places, any order, both ends, repeated knots, joints in columns."""
    rng = np.random.default_rng(degree)
    inner = np.sort(rng.uniform(0.0, 50.0, 40))
    inner[7:7 + degree - 3] = inner[7]
    knots = np.concatenate((np.zeros(degree + 1), inner, np.full(degree + 1, 50.0)))
    path = SplinePath(knots, rng.normal(size=(len(knots) - degree - 1, 3)), degree)
    rising = np.concatenate((np.linspace(0.0, 50.0, 301), inner))
    for s in (np.sort(rising), rng.permutation(rising)):
        plain = [order(s) for order in path._orders]
        out = np.empty((4, len(s), 3))
        compiled(spline)(path._orders[0].t, degree, *path._coefficients, s, out)
        for order, other in zip(plain, out, strict=True):
            np.testing.assert_allclose(other, order, rtol=1e-10, atol=1e-9 * np.abs(order).max())


def test_knots_follow_bulges_of_the_third_derivative() -> None:
    """Within one cell between breaks: the bulge of the jerk between two knots stays near the share asked for."""
    eased = Eased.between(random_path(2), 0.0, 100.0, 25.0)
    knots = mesh(eased, MIKRON, unlimited, Spacing(dt=1.0, longest=2.0, slope=1.0, hump=0.05))
    middle = 0.5 * (knots[1:] + knots[:-1])
    at, ends = eased.derivatives(middle), eased.derivatives(knots).d3q
    speed = np.sqrt(np.minimum(squared_speed(at.dq, MIKRON.velocity), steady_cap(at.d2q, at.d3q, MIKRON)))
    bulge = np.abs(at.d3q - 0.5 * (ends[1:] + ends[:-1])) * speed[:, None] ** 3 / MIKRON.jerk
    inside = (middle > 30.0) & (middle < eased.end - 30.0)
    assert 0.02 < np.quantile(bulge[inside].max(axis=1), 0.95) < 0.08
    assert len(mesh(eased, MIKRON, unlimited, Spacing(dt=1.0, longest=2.0, slope=1.0, hump=1e9))) < 0.9 * len(knots)
