"""Interior point under jerk: stencils, law next to rest, compiled against numpy, optimum against Clarabel."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline, make_interp_spline

from postproc.feedrate.interior import NumpySteps, solve_tied
from postproc.feedrate.interior_packed import PackedSteps
from postproc.feedrate.kernels.coefficients import tie_ends
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.mesh import Spacing, mesh
from postproc.feedrate.paths import Eased, SplinePath
from postproc.feedrate.problem import MotionKnots
from postproc.feedrate.spline import REST, rest_basis, rest_law, stencils
from postproc.feedrate.windows import solve_problem
from tests.postproc.feedrate_kit import MIKRON, bezier, random_path, uniform, unlimited
from tests.postproc.feedrate_reference import least_jerk_time
from toolpaths.compiled import compiled


def test_stencils_are_those_of_the_b_spline() -> None:
    rng = np.random.default_rng(1)
    sigma, c = np.cumsum(rng.uniform(0.1, 1.0, 12)), rng.normal(size=14)
    h = np.diff(sigma)
    knots = np.concatenate((sigma[0] - h[0] * np.arange(3, 0, -1), sigma, sigma[-1] + h[-1] * np.arange(1, 4)))
    spline = BSpline(knots, c, 3)
    table = stencils(sigma)
    for order in range(3):
        found = sum(table[order, a] * c[a:a + 12] for a in range(3))
        np.testing.assert_allclose(found[1:-1], spline(sigma[1:-1], order), rtol=1e-11, atol=1e-11)


def test_rest_law_is_constant_jerk() -> None:
    """sigma_dot^2 = X0 Psi and s(sigma) give s''' of time the same everywhere."""
    u, d = np.linspace(0.0, 0.3, 7), 20.0
    psi, slope, bend = rest_law(u, d)
    s1, s2, s3 = 6 * u**2 - 8 * u**3 + 3 * u**4, (12 * u - 24 * u**2 + 12 * u**3) / d, (12 - 48 * u + 36 * u**2) / d**2
    jerk = (s3 * psi + 1.5 * s2 * slope + 0.5 * s1 * bend) * np.sqrt(psi)
    np.testing.assert_allclose(jerk, 12.0 / d**2, rtol=1e-12)


def test_tied_ends_follow_the_law_and_join_smoothly() -> None:
    sigma = np.cumsum(np.random.default_rng(3).uniform(0.1, 0.2, 60))
    basis = rest_basis(sigma, 15.0)
    x = basis.values(np.full(62, 7.0))
    law = rest_law((sigma[:REST + 1] - sigma[0]) / 15.0, 15.0)
    np.testing.assert_allclose(x[:, :REST + 1], 7.0 * law, rtol=1e-10, atol=1e-12)
    law = rest_law((sigma[-1] - sigma[::-1][:REST + 1]) / 15.0, 15.0)
    np.testing.assert_allclose(x[:, ::-1][:, :REST + 1], 7.0 * law * [[1.0], [-1.0], [1.0]],
                               rtol=1e-10, atol=1e-12)
    part = rest_basis(sigma, 15.0, 20, 41)
    np.testing.assert_array_equal(part.stencil, basis.stencil[:, :, 20:41])
    assert part.tied == (1, 1)


@pytest.mark.numeric
@pytest.mark.parametrize(("first", "last"), [(0, 257), (0, 180), (70, 257), (70, 181)])
def test_compiled_equals_numpy(first: int, last: int) -> None:
    """Same iterates, also with free ends and numbers of knots that fill no lanes."""
    problem = uniform(random_path(4), 256).problem(first, last)
    plain, fast = solve_problem(problem, NumpySteps), solve_problem(problem, PackedSteps)
    assert plain.solved and fast.iterations == plain.iterations
    np.testing.assert_allclose(fast.c, plain.c, rtol=1e-9)


@pytest.mark.covering(count=5)
@pytest.mark.parametrize("seed", range(12))
def test_time_is_the_optimum(seed: int) -> None:
    """At most 1e-4 above a converged sequence of convex problems (Clarabel) on the same knots, within 40 iterations."""
    problem = uniform(random_path(seed, bend=(1.0, 3.0, 0.3)[seed % 3]), 192).problem()
    found = solve_problem(problem, NumpySteps)
    time = float(np.sum(problem.weight * problem.basis.values(found.c)[0] ** -0.5))
    assert found.solved and found.iterations <= 40
    assert problem.ratios(found.c).max() < 1.0
    best = least_jerk_time(problem, 0.8 * found.c)
    assert -3e-6 < time / best - 1.0 < 1e-4


def test_every_iterate_respects_the_limits() -> None:
    problem = uniform(bezier(), 300).problem()
    start = problem.start()
    assert 0.3 < problem.ratios(start).max() < 1.0
    steps, primal, dual = NumpySteps(problem, start), 0.0, 0.0
    for _ in range(12):
        steps.assemble(1e-3, primal, dual)
        assert problem.ratios(steps.c).max() < 1.0 and steps.c.min() > 0.0
        primal, dual = (min(1.0, 0.99 * step) for step in steps.direction(1e-3))


def test_twice_the_knots_change_the_time_little() -> None:
    times = []
    for dt in (4e-3, 1e-3):
        eased = Eased.between(bezier(), 0.0, 80.0, 25.0)
        grid = MotionKnots(eased, mesh(eased, MIKRON, lambda s: np.full(len(s), np.inf), Spacing(dt)),
                           MIKRON, unlimited)
        problem = grid.problem()
        times.append(float(np.sum(problem.weight * problem.basis.values(solve_problem(problem, NumpySteps).c)[0] ** -0.5)))
    assert times[0] == pytest.approx(times[1], rel=5e-4)


@pytest.mark.numeric
@pytest.mark.parametrize("joints", [1, 2, 3, 6, 9])
def test_one_to_nine_joints(joints: int) -> None:
    """Compiled as numpy, within the limits, and a joint that stands still changes nothing."""
    rng = np.random.default_rng(joints)
    spline = make_interp_spline(np.linspace(0.0, 100.0, 20),
                                np.cumsum(rng.normal(size=(20, joints)) * 4.0, axis=0), k=5)
    limits = JointLimits(*(value * np.ones(joints) for value in (500.0, 2500.0, 5e4)))
    problem = uniform(SplinePath(spline.t, spline.c), 300, limits).problem()
    plain, fast = solve_problem(problem, NumpySteps), solve_problem(problem, PackedSteps)
    np.testing.assert_allclose(fast.c, plain.c, rtol=1e-8)
    assert plain.solved and 0.97 < problem.ratios(plain.c).max() < 1.0
    still = SplinePath(spline.t, np.concatenate((spline.c, np.full((len(spline.c), 1), 3.0)), axis=1))
    wide = JointLimits(*(value * np.ones(joints + 1) for value in (500.0, 2500.0, 5e4)))
    more = uniform(still, 300, wide).problem()
    x = [one.basis.values(solve_problem(one, NumpySteps).c)[0] for one in (problem, more)]
    assert np.sum(more.weight * x[1] ** -0.5) == pytest.approx(np.sum(problem.weight * x[0] ** -0.5), rel=1e-4)


@pytest.mark.numeric
@pytest.mark.parametrize("tied", [(1, 1), (1, 11), (11, 1), (11, 11)])
def test_tied_equations_are_those_of_one_unknown(tied: tuple[int, int]) -> None:
    """Solved with both ends replaced by one unknown each, dense; untied ends change nothing. Compiled alike."""
    rng, n = np.random.default_rng(5), 40
    low = np.concatenate((rng.uniform(5.0, 6.0, (1, n)), rng.normal(size=(2, n))))
    full = np.diag(low[0]) + sum(np.diag(low[d, :n - d], k) for d in (1, 2) for k in (d, -d))
    right = rng.normal(size=n)
    spread = np.eye(n)[:, tied[0] - 1:n - tied[1] + 1]
    spread[:tied[0], 0], spread[n - tied[1]:, -1] = 1.0, 1.0
    wanted = spread @ np.linalg.solve(spread.T @ full @ spread, spread.T @ right)
    here = slice(tied[0] - 1, n - tied[1] + 1)
    other, force = low.copy(), right.copy()
    compiled(tie_ends)(other, force, *tied)
    np.testing.assert_allclose(solve_tied(low, right, tied), wanted, atol=1e-12)
    band = np.diag(other[0, here]) + sum(np.diag(other[d, here][:-d], k) for d in (1, 2) for k in (d, -d))
    np.testing.assert_allclose(np.linalg.solve(band, force[here]), wanted[here], atol=1e-12)
