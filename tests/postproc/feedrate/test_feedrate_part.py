"""Test part of the orientation paper (Grandguillaume, Lavernhe, Tournier 2017, equation 8 and section IV):
bicubic patch, ball-end mill of 16 mm, passes in planes Xp, three axes with a jerk of 5 m/s3 each and no other limit."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from postproc.feedrate.plan import PlannerOptions, plan
from tests.postproc.feedrate_kit import PolynomialPath, only_jerk
from toolpaths.arrays import Floats

HEIGHTS = np.array([[0.0, 0.0, 10.0, 10.0], [0.0, 0.0, 10.0, 10.0], [10.0, 10.0, 0.0, 0.0], [10.0, 10.0, 0.0, 0.0]])
"""z of the control points, rows along X, columns along Y, 20 mm apart: X and Y are the parameters times 60 mm."""
RADIUS, SIDE = 8.0, 60.0
LIMITS = only_jerk([5000.0] * 3)


def bernstein(t: Floats) -> tuple[Floats, Floats]:
    """Cubic basis (N, 4) and its derivative."""
    t = t[:, None]
    value = np.array([1.0, 3.0, 3.0, 1.0]) * t ** np.arange(4) * (1.0 - t) ** np.arange(3, -1, -1)
    lower = np.array([1.0, 2.0, 1.0]) * t ** np.arange(3) * (1.0 - t) ** np.arange(2, -1, -1)
    return value, 3.0 * (np.pad(lower, ((0, 0), (1, 0))) - np.pad(lower, ((0, 0), (0, 1))))


def normal(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Height (N,) and upward unit normal (N, 3) of the patch."""
    (u, du), (v, dv) = bernstein(x / SIDE), bernstein(y / SIDE)
    slopes = [np.einsum("ni,ij,nj->n", a, HEIGHTS, b) / SIDE for a, b in ((du, v), (u, dv))]
    up = np.stack((-slopes[0], -slopes[1], np.ones_like(x)), axis=1)
    return np.einsum("ni,ij,nj->n", u, HEIGHTS, v), up / np.linalg.norm(up, axis=1, keepdims=True)


def ball_centre(plane: float) -> Floats:
    """Ball centre in the plane Xp while it touches the patch, points (N, 3) along Y."""
    y = np.linspace(0.0, SIDE, 401)
    x = np.full_like(y, plane)
    for _ in range(100):
        x = 0.3 * x + 0.7 * (plane + RADIUS * -normal(x, y)[1][:, 0])
    z, up = normal(x, y)
    centre = np.stack((x, y, z), axis=1) + RADIUS * up
    assert np.abs(centre[:, 0] - plane).max() < 1e-9
    return centre


def programmed(plane: float) -> tuple[Floats, float, Floats]:
    """Polynomials of degree 5 in chord length (3, 6), its end, direction of the chord."""
    points = ball_centre(plane)
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    fits = [Polynomial.fit(along, points[:, axis], 5) for axis in (1, 2)]
    assert max(np.abs(fit(along) - points[:, axis]).max() for fit, axis in zip(fits, (1, 2), strict=True)) < 0.01
    chord = points[-1] - points[0]
    return np.stack([np.zeros(6)] + [fit.convert().coef for fit in fits]), float(along[-1]), chord / np.linalg.norm(chord)


def rotation(a: float, c: float) -> Floats:
    """Part to machine at joints A, C: (Rz(C) Rx(A))'."""
    about_z = np.array([[np.cos(c), -np.sin(c), 0.0], [np.sin(c), np.cos(c), 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(a), -np.sin(a)], [0.0, np.sin(a), np.cos(a)]])
    return np.asarray((about_z @ about_x).T)


def on_vertices(f: Floats) -> list[tuple[float, float]]:
    """All A, C that turn a vertex of the jerk cube into direction f (equation 7)."""
    found = []
    for x, y, z in product((-1.0, 1.0), repeat=3):
        lift = np.arcsin(np.sqrt(3.0) * f[2] / np.hypot(y, z))
        for angle in (lift, np.pi - lift):
            a = angle - np.arctan2(z, y)
            found.append((a, np.arctan2(f[1], f[0]) - np.arctan2(np.cos(a) * y - np.sin(a) * z, x)))
    return found


def seconds(polynomials: Floats, end: float, turn: Floats, options: PlannerOptions | None = None) -> float:
    return plan(PolynomialPath((turn @ polynomials).tolist(), end), LIMITS, options=options).seconds


@pytest.mark.parametrize(("options", "close"),
                         [(PlannerOptions(), 0.005), (PlannerOptions(strict=True), 0.01)])
def test_pass_0_as_printed(options: PlannerOptions, close: float) -> None:
    """0.7268 s at A = C = 0."""
    polynomials, end, _ = programmed(0.0)
    assert seconds(polynomials, end, np.eye(3), options) == pytest.approx(0.7268, rel=close)


def test_gain_of_pass_30_as_printed() -> None:
    """16 % where a vertex of the cube points along the chord; the ideal of a straight pass is 16.73 %."""
    polynomials, end, f = programmed(30.0)
    base = seconds(polynomials, end, np.eye(3))
    turned = [seconds(polynomials, end, rotation(a, c)) for a, c in on_vertices(f)]
    assert len(turned) == 16
    np.testing.assert_allclose(turned, turned[0], rtol=1e-6)
    assert 100.0 * (1.0 - turned[0] / base) == pytest.approx(16.0, abs=1.0)
    assert 100.0 * (1.0 - turned[0] / base) < 100.0 * (1.0 - 3.0 ** (-1.0 / 6.0))


def test_bent_passes_gain_less() -> None:
    """The direction varies most on pass 0, least on pass 30."""
    gains = []
    for plane in (0.0, 15.0, 30.0):
        polynomials, end, f = programmed(plane)
        gains.append(1.0 - seconds(polynomials, end, rotation(*on_vertices(f)[0])) / seconds(polynomials, end, np.eye(3)))
    assert 0.05 < gains[0] < gains[1] < gains[2]
