"""The whole planner: closed forms, printed figures, strict samples, stops, feed, windows, what binds."""

from __future__ import annotations

from dataclasses import replace
from itertools import cycle

import numpy as np
import pytest

from postproc.feedrate import interior, solve_again, windows
from postproc.feedrate.feed import AllowedFeed, StepFeed
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.mesh import Spacing
from postproc.feedrate.motion import Plan
from postproc.feedrate.plan import PlannerOptions, plan, plan_second_order
from postproc.feedrate.problem import MotionKnots
from postproc.feedrate.trajectory import JointTrajectory
from postproc.feedrate.windows import Method, SolvedWindows, solved
from tests.postproc.feedrate_kit import MIKRON, PolynomialPath, only_jerk, random_path, uniform, zigzag
from toolpaths.arrays import Floats

STRICT = PlannerOptions(strict=True)
PASS_0 = PolynomialPath([[0.0], [0.0, 1.0], [0.0, 0.0, 30.0 / 60.0**2, -20.0 / 60.0**3]], 60.0)
"""Pass Xp = 0 of the bicubic part: control points (0, 0), (20, 0), (40, 10), (60, 10) of equation 8 in (Yp, Zp)."""


def s_curve(length: float, v: float, a: float, j: float) -> float:
    """Rest to rest under velocity, acceleration, jerk, all three reached: S/V + V/A + A/J."""
    assert v >= a * a / j and length >= v * (v / a + a / j)
    return length / v + v / a + a / j


def test_straight_line_under_jerk_alone() -> None:
    """(32 S/J)^(1/3)."""
    made = plan(PolynomialPath([[0.0, 1.0]], 60.0), only_jerk([5000.0]))
    assert made.solved and made.seconds == pytest.approx((32.0 * 60.0 / 5000.0) ** (1.0 / 3.0), rel=2e-4)


@pytest.mark.parametrize(("length", "v", "a", "j"), [(80.0, 100.0, 1000.0, 20000.0),
                                                      (3.0, 5.0, 200.0, 50000.0),
                                                      (900.0, 500.0, 900.0, 5000.0)])
def test_straight_line_under_all_limits(length: float, v: float, a: float, j: float) -> None:
    made = plan(PolynomialPath([[0.0, 1.0]], length),
                JointLimits(*(np.array([value]) for value in (v, a, j))))
    assert made.seconds == pytest.approx(s_curve(length, v, a, j), rel=2e-3)


def test_gain_of_a_straight_pass() -> None:
    """Along the diagonal of three equal jerks instead of along one: 1 - 3^(-1/6) = 16.73 % of the time."""
    along = plan(PolynomialPath([[0.0], [0.0, 1.0], [0.0]], 60.0), only_jerk([5000.0] * 3)).seconds
    diagonal = plan(PolynomialPath([[0.0, 3.0**-0.5]] * 3, 60.0), only_jerk([5000.0] * 3)).seconds
    assert 1.0 - diagonal / along == pytest.approx(1.0 - 3.0 ** (-1.0 / 6.0), abs=2e-4)


@pytest.mark.parametrize(("options", "close"), [(PlannerOptions(), 0.005), (STRICT, 0.01)])
def test_pass_of_the_bicubic_part(options: PlannerOptions, close: float) -> None:
    """Printed figures, 15: 0.7268 s with A = C = 0 under a jerk of 5 m/s3 in X, Y, Z alone."""
    made = plan(PASS_0, only_jerk([5000.0] * 3), options=options)
    assert made.seconds == pytest.approx(0.7268, rel=close)


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("seed", range(4))
def test_strict_exceeds_nothing_and_costs_little(seed: int) -> None:
    path = random_path(seed, bend=(1.0, 2.0)[seed % 2])
    fast, strict = plan(path, MIKRON), plan(path, MIKRON, options=STRICT)
    samples = strict.trajectory()
    used = samples.usage(MIKRON)
    assert used.worst <= 1.0 and used.worst > 0.97
    assert strict.seconds <= 1.007 * fast.seconds
    assert plan_second_order(path, MIKRON).seconds < fast.seconds
    assert np.abs(np.diff(np.pad(samples.q, ((3, 3), (0, 0)), mode="edge"), 3, axis=0) / 1e-9 / MIKRON.jerk).max() <= 1.0


def test_samples_are_the_derivatives_of_each_other_and_lie_on_the_path() -> None:
    path = random_path(3)
    samples = plan(path, MIKRON).trajectory()
    np.testing.assert_allclose(np.diff(samples.t), 1e-3, rtol=1e-9)
    np.testing.assert_allclose(path.derivatives(samples.s).q, samples.q, atol=1e-9)
    middle = slice(20, -20)
    for low, high in ((samples.q, samples.qd), (samples.qd, samples.qdd)):
        slope = (low[2:] - low[:-2]) / 2e-3
        error = np.abs(slope - high[1:-1]) / np.abs(high).max(axis=0)
        assert error[middle].max() < 2e-2
    assert np.all(samples.q[0] == path.derivatives(np.array([0.0])).q[0]) and np.all(samples.qd[[0, -1]] == 0.0)


def test_usage_sees_a_start_that_is_not_at_rest() -> None:
    t = np.arange(100) * 1e-3
    moving, zero = (t * 10.0)[:, None], np.zeros((100, 1))
    samples = JointTrajectory(t, t, moving, zero, zero, zero, zero[:, 0], np.full(100, np.inf))
    used = samples.usage(JointLimits(np.array([20.0]), np.array([1000.0]), np.array([1e6])))
    assert used.velocity[0] == pytest.approx(0.5)
    assert used.acceleration[0] == pytest.approx(10.0) and used.jerk[0] == pytest.approx(10.0)
    assert used.worst == pytest.approx(10.0)


def test_stops_stand_still_and_add_up() -> None:
    path, stops = random_path(5), [30.0, 30.5, 71.0]
    made = plan(path, MIKRON, stops=stops, options=STRICT)
    assert len(made.pieces) == 4 and made.seconds == pytest.approx(sum(piece.seconds for piece in made.pieces))
    samples = made.trajectory()
    assert samples.usage(MIKRON).worst <= 1.0
    for s, t in zip(stops, made.ends[:-1], strict=True):
        assert np.interp(t, samples.t, samples.s) == pytest.approx(s, abs=1e-5)
        assert np.interp(t, samples.t, samples.sd) < 0.02


def test_corner_at_a_stop_uses_its_own_side() -> None:
    """Two straight lines at a right angle: each takes its own joint's time."""
    limits = only_jerk([5000.0, 500.0])
    times = [plan(PolynomialPath(line, 20.0), limits).seconds for line in ([[0.0, 1.0], [0.0]], [[0.0], [0.0, 1.0]])]

    class Corner(PolynomialPath):
        def derivatives(self, s):
            at = super().derivatives(s)
            second = s >= 20.0
            return type(at)(*(np.where(second[:, None], other, one) for one, other in zip(
                at, PolynomialPath([[20.0], [-20.0, 1.0]], 40.0).derivatives(s), strict=True)))

    both = plan(Corner([[0.0, 1.0], [0.0]], 40.0), limits, stops=[20.0])
    assert [piece.seconds for piece in both.pieces] == pytest.approx(times, rel=1e-4)


def test_feed_binds_and_steps() -> None:
    path = random_path(6)
    made = plan(path, MIKRON, feed=lambda s: np.where(s < 50.0, 8.0, 12.0), options=STRICT)
    samples = made.trajectory()
    assert samples.usage(MIKRON).worst <= 1.0
    assert np.median(samples.sd[samples.s < 45.0]) == pytest.approx(8.0, rel=5e-3)
    bound = samples.binding(MIKRON)
    assert np.mean(bound.axis == -1) > 0.8 and set(bound.order[bound.axis == -1]) <= {0, 1}


def test_what_binds_is_what_limits() -> None:
    """Straight in the second joint, jerk alone: jerk of joint 1 everywhere but at its three reversals."""
    limits, path = only_jerk([5000.0, 5000.0]), PolynomialPath([[0.0], [0.0, 1.0]], 60.0)
    bound = plan(path, limits, options=PlannerOptions(spacing=Spacing(1e-3))).trajectory().binding(limits)
    assert np.mean((bound.axis == 1) & (bound.order == 3)) > 0.9
    assert np.all(bound.ratio <= 1.01)


def stitched(method: Method) -> tuple[Plan, Plan]:
    path = zigzag(300.0)
    knots = uniform(path, 3000).sigma
    return plan(path, MIKRON, knots=knots), plan(path, MIKRON, options=PlannerOptions(method=method),
                                                 knots=knots)


@pytest.mark.numeric
@pytest.mark.parametrize("kernel", [True, False])
def test_windows_equal_the_whole(kernel: bool) -> None:
    whole, parts = stitched(Method(window=800, overlap=600, threads=2, kernel=kernel))
    assert parts.solved and 0.0 < parts.mismatch < 1e-3
    assert parts.seconds == pytest.approx(whole.seconds, rel=1e-4)
    assert parts.trajectory().usage(MIKRON).worst < 1.01 * whole.trajectory().usage(MIKRON).worst


def test_short_overlaps_are_widened() -> None:
    grid: MotionKnots = uniform(zigzag(300.0), 3000)
    report = solved(grid, Method(window=800, overlap=40))
    assert report.mismatch < 1e-3
    assert grid.problem().ratios(report.c).max() < 1.002


def test_windows_that_stop_early_are_slow_not_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    """They do not agree then; the motion is slowed as a whole and says so."""
    most = cycle((8, 40))
    monkeypatch.setattr(windows, "solve", lambda steps, rows, gap: interior.solve(steps, rows, gap, most=next(most)))
    path = zigzag(300.0)
    grid = uniform(path, 3000)
    report = solved(grid, Method(window=800, overlap=100))
    assert not report.solved and report.mismatch > 0.1
    assert grid.problem().ratios(report.c).max() < 1.0
    again = plan(path, MIKRON, knots=grid.sigma,
                 options=PlannerOptions(method=Method(window=800, overlap=100)))
    assert again.solved and again.seconds == pytest.approx(plan(path, MIKRON, knots=grid.sigma).seconds, rel=1e-3)


def test_what_is_not_solved_is_solved_on_finer_knots(monkeypatch: pytest.MonkeyPatch) -> None:
    path = random_path(2)
    good, sizes = plan(path, MIKRON), list[int]()

    def failing(knots: MotionKnots, method: Method, near: Floats | None = None) -> SolvedWindows:
        sizes.append(len(knots.sigma))
        return replace(solved(knots, method, near), solved=len(sizes) > 2)

    monkeypatch.setattr(solve_again, "solved", failing)
    made = plan(path, MIKRON)
    assert made.solved and sizes == [sizes[0], sizes[0], 2 * sizes[0] - 1]
    assert made.seconds == pytest.approx(good.seconds, rel=2e-3)


def test_what_is_not_solved_at_all_keeps_the_limits_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    path = random_path(2)
    good = plan(path, MIKRON)
    monkeypatch.setattr(windows, "solve", lambda steps, rows, gap: interior.solve(steps, rows, gap, most=6))
    made = plan(path, MIKRON)
    assert not made.solved and made.usage().worst <= 1.0 + 1e-9 and made.seconds > good.seconds


def test_nothing_depends_on_units() -> None:
    """Micrometres along the path and in the joints: same time."""
    plain = plan(PASS_0, only_jerk([5000.0] * 3)).seconds
    big = PolynomialPath([[0.0], [0.0, 1.0], [0.0, 0.0, 30.0 / 60.0**2 * 1e-3, -20.0 / 60.0**3 * 1e-6]], 60e3)
    spacing = Spacing(longest=250.0)
    micro = plan(big, only_jerk([5e6] * 3), options=PlannerOptions(ease=25e3, spacing=spacing)).seconds
    assert micro == pytest.approx(plain, rel=1e-9)


def test_bad_requests_are_refused() -> None:
    path = random_path(1)
    with pytest.raises(ValueError, match="stops must rise"):
        plan(path, MIKRON, stops=[50.0, 20.0])
    with pytest.raises(ValueError, match="second_order"):
        plan(path, replace(MIKRON, jerk=np.full(5, np.inf)))
    with pytest.raises(ValueError, match="without stops"):
        plan(path, MIKRON, stops=[50.0], knots=np.linspace(0.0, 1.0, 100))
    with pytest.raises(ValueError, match="no speed above 0"):
        plan(path, MIKRON, feed=lambda s: np.where(s > 50.0, 0.0, 10.0))


def test_feeds_of_blocks_cost_nothing_between_them() -> None:
    """Steps of the feed lie on knots: strict holds them at once, and a slow cruise needs few knots."""
    rng = np.random.default_rng(3)
    feed = StepFeed(np.linspace(0.0, 100.0, 51), rng.uniform(5.0, 40.0, 50))
    fast, strict = (plan(random_path(1), MIKRON, feed=feed, options=PlannerOptions(strict=mode)) for mode in (False, True))
    assert fast.usage().feed < 1.04 and strict.usage().worst <= 1.0
    assert strict.seconds < 1.002 * fast.seconds
    sigma = strict.pieces[0].profile.sigma
    assert np.abs(sigma[None, :] - strict.pieces[0].eased.sigma(feed.breaks)[:, None]).min(axis=1).max() < 1e-9
    slow = plan(random_path(2), MIKRON, feed=0.05)
    assert slow.seconds == pytest.approx(100.0 / 0.05, rel=1e-3) and len(slow.pieces[0].profile.sigma) < 3000


def test_feeds_of_blocks_by_their_edges() -> None:
    feed = StepFeed(np.array([0.0, 10.0, 20.0, 30.0]), np.array([5.0, 5.0, 9.0]))
    assert feed.breaks.tolist() == [20.0]
    assert feed(np.array([-1.0, 9.0, 25.0, 31.0])).tolist() == [5.0, 5.0, 9.0, 9.0]
    assert AllowedFeed(feed, 2.0)(np.array([19.9, 20.0, 20.1])).tolist() == [10.0, 10.0, 18.0]
    with pytest.raises(ValueError, match="rise"):
        StepFeed(np.array([0.0, 0.0]), np.array([5.0]))
    with pytest.raises(ValueError, match="positive"):
        StepFeed(np.array([0.0, 1.0]), np.array([0.0]))


def test_where_tightening_is_in_vain_the_best_is_kept() -> None:
    """A jerk so high that the motion is one of second order: strict stays next to V/A + S/V."""
    made = plan(PolynomialPath([[0.0, 1.0]], 100.0), JointLimits(*np.array([[500.0], [2500.0], [5e8]])),
                options=STRICT)
    assert made.usage().worst <= 1.0 and made.seconds < 1.06 * 0.4
