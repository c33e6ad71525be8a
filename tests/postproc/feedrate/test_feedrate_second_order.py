"""Second-order plan: closed forms, toppra, HiGHS, compiled against numpy."""

from __future__ import annotations

import itertools
import warnings
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from postproc.feedrate import second_order as planner
from postproc.feedrate.limits import JointLimits, squared_speed
from postproc.feedrate.paths import Derivatives, SplinePath
from postproc.feedrate.plan import PlannerOptions, plan_second_order
from postproc.feedrate.second_order import FLAT, least_time, second_order
from tests.postproc.feedrate import second_order_by_numpy
from tests.postproc.feedrate_kit import MIKRON, PolynomialPath, bezier, random_path, zigzag
from tests.postproc.feedrate_reference import exact_rows, exact_second_order, largest_second_order
from toolpaths.arrays import Floats


def planned(path: SplinePath, sigma: Floats, kernel: bool) -> Floats:
    at = Derivatives(*(order(sigma) for order in path._orders))  # to the last bit the same for both
    return second_order(sigma, at.dq, at.d2q, MIKRON.acceleration,
                        squared_speed(at.dq, MIKRON.velocity), kernel)


def toppra_time(path: SplinePath, sigma: Floats, unit: float = 10.0) -> float:
    """Least time by TOPP-RA on the same grid, limits taken at both ends of each interval.

    It gets the parameter in units of `unit`: with squared speeds far above 1 its seidel solver finds no solution.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import toppra
        import toppra.algorithm
        from toppra import constraint

    class Evaluated(toppra.interpolator.AbstractGeometricPath):
        dof, path_interval, waypoints = 5, np.array([path.start, path.end]) / unit, None

        def __call__(self, s: Any, order: int = 0) -> Any:
            at = path.derivatives(np.atleast_1d(s) * unit)[order] * unit**order
            return at[0] if np.ndim(s) == 0 else at

    both = constraint.DiscretizationType.Interpolation
    rows = [constraint.JointVelocityConstraint(np.stack((-MIKRON.velocity, MIKRON.velocity), axis=1)),
            constraint.JointAccelerationConstraint(np.stack((-MIKRON.acceleration, MIKRON.acceleration), axis=1),
                                                   discretization_scheme=both)]
    speed = toppra.algorithm.TOPPRA(rows, Evaluated(), gridpoints=sigma / unit, solver_wrapper="seidel"
                                    ).compute_parameterization(0.0, 0.0, return_data=True)[1]
    return least_time(sigma / unit, speed**2)


@pytest.mark.numeric
@pytest.mark.parametrize("path", [bezier(1), bezier(2), bezier(3), zigzag(100.0), random_path(1)])
def test_compiled_equals_numpy_and_toppra(path: SplinePath, monkeypatch: pytest.MonkeyPatch) -> None:
    sigma = np.linspace(path.start, path.end, 301)
    fast, plain = planned(path, sigma, True), planned(path, sigma, False)
    monkeypatch.setattr(planner, "sweep", second_order_by_numpy.sweep)
    np.testing.assert_array_equal(fast, plain)
    np.testing.assert_array_equal(planned(path, sigma, False), plain)
    assert least_time(sigma, plain) == pytest.approx(toppra_time(path, sigma), rel=1e-6)


def reversing(travel: str, small: float, seed: int) -> tuple[Floats, Floats, Floats, Floats]:
    """sigma (N,), dq and d2q (N, J) over the limits, cap (N,): one joint whose row hardly depends on x1 in one interval.

    Its slope is `small` at the interval's begin, or the sum of curvature and slope/(2h) cancels to `small` at its end.
    """
    rng = np.random.default_rng(seed)
    sigma = np.cumsum(rng.uniform(0.1, 0.4, 9))
    dq, d2q = 1e-3 * rng.normal(size=(2, 9, 5))
    joint, k = int(rng.integers(5)), int(rng.integers(2, 7))
    if travel == "slope":
        dq[k, joint] = 1e-3 * small
    else:
        dq[k + 1, joint] = -2.0 * (sigma[k + 1] - sigma[k]) * d2q[k + 1, joint] * (1.0 + small)
    return sigma, dq, d2q, 0.05 / np.abs(dq).max(axis=1) ** 2


@pytest.mark.covering
@pytest.mark.numeric
@pytest.mark.parametrize("travel", ["slope", "sum"])
@pytest.mark.parametrize("power", range(-14, -5))
def test_rows_that_hardly_depend_on_the_next_speed_are_exact(travel: str, power: int) -> None:
    """Against fractions: x, every limit, and the time of the greedy solution. Compiled to the last bit as numpy."""
    unit = np.ones(5)
    for seed, sign in itertools.product(range(3), (-1.0, 1.0)):
        sigma, dq, d2q, cap = reversing(travel, sign * 10.0**power, seed)
        fast, plain = (second_order(sigma, dq, d2q, unit, cap, kernel) for kernel in (True, False))
        np.testing.assert_array_equal(fast, plain)
        exact = np.array(exact_second_order(sigma, dq, d2q, cap, FLAT), dtype=np.float64)
        np.testing.assert_allclose(plain, exact, rtol=0.0, atol=2e-15 / FLAT * exact.max())
        x = [Fraction(value) for value in plain.tolist()]
        used = max(abs(a * x[i] + b * x[i + 1]) for i, rows in enumerate(exact_rows(sigma, dq, d2q)) for a, b in rows)
        assert used <= 1 + Fraction(1e-14)
        greedy = np.array(exact_second_order(sigma, dq, d2q, cap), dtype=np.float64)
        assert least_time(sigma, plain) <= (1.0 + FLAT) * least_time(sigma, greedy)


@pytest.mark.parametrize("seed", range(3))
def test_every_limit_holds_and_no_linear_program_is_much_faster(seed: int) -> None:
    """Where a joint reverses, a larger sum of squares may exist that alternates between grid points; it is hardly faster."""
    path, sigma = random_path(seed), np.linspace(0.0, 100.0, 401)
    at = path.derivatives(sigma)
    cap = squared_speed(at.dq, MIKRON.velocity)
    x = planned(path, sigma, False)
    rate = 0.5 * np.diff(x) / np.diff(sigma)
    for here in (slice(0, -1), slice(1, None)):
        used = np.abs(at.d2q[here] * x[here, None] + at.dq[here] * rate[:, None]) / MIKRON.acceleration
        assert used.max() <= 1.0 + 1e-9
    assert np.all(x <= cap * (1.0 + 1e-12))
    best = largest_second_order(sigma, at.dq, at.d2q, MIKRON.acceleration, cap)
    assert least_time(sigma, x) <= 1.001 * least_time(sigma, np.maximum(best, 0.0))


@pytest.mark.parametrize(("velocity", "seconds"), [(1e6, 2.0 * np.sqrt(50.0 / 2000.0)),
                                                   (100.0, 50.0 / 100.0 + 100.0 / 2000.0)])
def test_straight_line(velocity: float, seconds: float) -> None:
    """Triangle and trapezium of speed: 2 sqrt(S/A), S/V + V/A."""
    limits = JointLimits(np.array([velocity]), np.array([2000.0]), np.array([np.inf]))
    made = plan_second_order(PolynomialPath([[0.0, 1.0]], 50.0), limits)
    assert made.seconds == pytest.approx(seconds, rel=2e-4)
    samples = made.trajectory()
    assert samples.q[0, 0] == 0.0 and samples.q[-1, 0] == pytest.approx(50.0, abs=1e-12)
    np.testing.assert_allclose(np.diff(samples.q[:, 0]) / 1e-3,
                               0.5 * (samples.qd[1:, 0] + samples.qd[:-1, 0]), atol=1.1)
    used = samples.usage(limits)
    assert max(used.velocity[0], used.acceleration[0]) <= 1.0 + 1e-6 and used.jerk[0] == 0.0


def test_feed_and_stops() -> None:
    path = random_path(1)
    made = plan_second_order(path, MIKRON, feed=30.0, stops=[40.0], options=PlannerOptions())
    samples = made.trajectory()
    assert samples.usage(MIKRON).feed <= 1.0 + 1e-9 and samples.sd.max() == pytest.approx(30.0, rel=1e-6)
    assert made.seconds == pytest.approx(sum(piece.seconds for piece in made.pieces))
    near = np.interp(40.0, samples.s, samples.sd)
    assert near < 0.1 * 30.0
