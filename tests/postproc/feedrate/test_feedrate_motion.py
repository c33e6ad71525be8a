"""What a plan hands on: by place, by block, in chunks; what each limit costs; limits at the tool; override."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from postproc.feedrate.limits import JointLimits, ToolLimits
from postproc.feedrate.mesh import Spacing
from postproc.feedrate.motion import Plan
from postproc.feedrate.paths import Derivatives, Eased
from postproc.feedrate.plan import PlannerOptions, plan, plan_second_order
from postproc.feedrate.rows import tool
from postproc.feedrate.windows import Method
from tests.postproc.feedrate_kit import MIKRON, PolynomialPath, only_jerk, random_path, zigzag
from toolpaths.arrays import Floats

STRICT = PlannerOptions(strict=True)


@pytest.fixture(scope="module")
def made() -> Plan:
    return plan(random_path(5), MIKRON, feed=40.0, stops=[30.0, 71.0])


def test_by_place_is_by_time(made: Plan) -> None:
    samples = made.trajectory()
    inner = (samples.sd > 1.0)
    np.testing.assert_allclose(made.time(samples.s[inner]), samples.t[inner], atol=1e-7)
    np.testing.assert_allclose(made.speed(samples.s[inner]), samples.sd[inner], rtol=1e-6)
    np.testing.assert_allclose(made.time(np.array([0.0, 30.0, 71.0, 100.0])), [0.0, *made.ends], atol=1e-9)
    assert made.speed(np.array([0.0, 30.0, 100.0])).tolist() == [0.0, 0.0, 0.0]


def test_the_last_sample_is_at_rest(made: Plan) -> None:
    samples = made.trajectory()
    assert samples.t[-1] >= made.seconds > samples.t[-2]
    assert not np.any(np.concatenate((samples.qd[-1], samples.qdd[-1], samples.qddd[-1])))


def test_at_places(made: Plan) -> None:
    samples = made.trajectory()
    some = made.at(samples.s[50:-50:7])
    for name in ("q", "qd", "qdd", "t"):
        np.testing.assert_allclose(getattr(some, name), getattr(samples, name)[50:-50:7],
                                   rtol=1e-5, atol=1e-4)
    bound, other = some.binding(MIKRON), samples.binding(MIKRON)
    assert np.mean(bound.axis == other.axis[50:-50:7]) > 0.98
    with pytest.raises(ValueError, match="not all on the path"):
        made.at(np.array([101.0]))


def test_blocks(made: Plan) -> None:
    """Times add up to the whole, also over stops; lowest and highest are those of dense places."""
    cuts = np.array([0.0, 0.5, 10.0, 29.0, 30.0, 33.0, 60.0, 70.0, 72.0, 100.0])
    blocks = made.blocks(cuts)
    assert blocks.seconds.sum() == pytest.approx(made.seconds, rel=1e-9)
    np.testing.assert_allclose(blocks.mean * blocks.seconds, np.diff(cuts))
    for i, (a, b) in enumerate(pairwise(cuts)):
        dense = made.speed(np.append(np.linspace(a, b, 400), np.clip([30.0, 71.0], a, b)))
        assert blocks.lowest[i] == pytest.approx(dense.min(), rel=5e-3, abs=0.2)
        assert blocks.highest[i] == pytest.approx(dense.max(), rel=5e-3)
    assert blocks.lowest[[0, 3, 4, 7, 8]].tolist() == [0.0] * 5 and blocks.lowest[5] > 0.0


def test_chunks_are_the_whole(made: Plan) -> None:
    samples = made.trajectory()
    parts = [(chunk, own) for chunk, own in made.chunks(777)]
    for name in ("t", "q", "qddd", "feed"):
        np.testing.assert_array_equal(np.concatenate([getattr(chunk, name)[own] for chunk, own in parts]),
                                      getattr(samples, name))
    whole = samples.usage(MIKRON)
    parted = parts[0][0].usage(MIKRON, parts[0][1])
    for chunk, own in parts[1:]:
        parted = parted.worse(chunk.usage(MIKRON, own))
    for name in ("velocity", "acceleration", "jerk", "feed"):
        np.testing.assert_allclose(getattr(parted, name), getattr(whole, name), rtol=1e-6)
    np.testing.assert_allclose(made.usage().jerk, whole.jerk, rtol=1e-12)


def test_shares_are_the_slopes_of_the_time() -> None:
    """Each share is -n dT/dln L, by differences of plans with changed limits; the sum is the time."""
    path, limits = zigzag(100.0), MIKRON
    fine = PlannerOptions(spacing=Spacing(1.5e-3))
    base = plan(path, limits, feed=100.0, options=fine)
    shares = base.shares
    assert shares.seconds == pytest.approx(base.seconds, rel=1e-12)
    step = 0.02
    for order, name in enumerate(("velocity", "acceleration", "jerk")):
        for joint in range(5):
            times = []
            for factor in (1.0 - step, 1.0 + step):
                changed = getattr(limits, name).copy()
                changed[joint] *= factor
                times.append(plan(path, replace(limits, **{name: changed}), feed=100.0, options=fine).seconds)
            slope = (order + 1) * (times[0] - times[1]) / (2.0 * step)
            assert shares.limits[order, joint] == pytest.approx(slope, abs=6e-3 * base.seconds)
    times = [plan(path, limits, feed=100.0 * factor, options=fine).seconds for factor in (1.0 - step, 1.0 + step)]
    assert shares.feed == pytest.approx((times[0] - times[1]) / (2.0 * step), abs=6e-3 * base.seconds)


def test_shares_of_known_motions() -> None:
    """Straight under jerk alone: all of it; at a slow feed: nearly all the feed's, lost time is the jerk's."""
    line = PolynomialPath([[0.0, 1.0]], 60.0)
    shares = plan(line, only_jerk([5000.0])).shares
    assert shares.limits[2, 0] == pytest.approx(shares.seconds, rel=1e-6) and shares.feed == 0.0
    slow = plan(line, only_jerk([5000.0]), feed=2.0)
    assert slow.shares.feed > 0.97 * slow.seconds
    lost = slow.lost
    assert lost.feed == pytest.approx(30.0, rel=1e-6) and lost.seconds == pytest.approx(slow.seconds, rel=1e-9)
    assert lost.limits[2, 0] == pytest.approx(slow.seconds - 30.0, rel=1e-6)
    with pytest.raises(ValueError, match="second-order"):
        _ = plan_second_order(line, only_jerk([5000.0])).shares


@pytest.mark.numeric
@pytest.mark.parametrize("kernel", [True, False])
def test_shares_do_not_depend_on_windows(kernel: bool) -> None:
    path = zigzag(300.0)
    whole = plan(path, MIKRON, feed=120.0, options=PlannerOptions(method=Method(kernel=False)))
    parts = plan(path, MIKRON, feed=120.0, options=PlannerOptions(method=Method(window=800, overlap=600, kernel=kernel)))
    np.testing.assert_allclose(parts.shares.limits, whole.shares.limits, atol=4e-3 * whole.seconds)
    assert parts.shares.feed == pytest.approx(whole.shares.feed, abs=4e-3 * whole.seconds)


def test_override_scales_the_feed_alone() -> None:
    path = random_path(6)
    slow = plan(path, MIKRON, feed=8.0, options=PlannerOptions(override=0.5))
    np.testing.assert_allclose(slow.seconds, plan(path, MIKRON, feed=4.0).seconds)
    samples = plan(path, MIKRON, feed=lambda s: 8.0 + 0.0 * s,
                   options=PlannerOptions(override=1e6, strict=True)).trajectory()
    assert samples.usage(MIKRON).worst <= 1.0
    with pytest.raises(ValueError, match="override"):
        plan(path, MIKRON, feed=8.0, options=PlannerOptions(override=0.0))


class Circle:
    """Joints are the tip on a circle of radius r, the axis turning with it."""

    start, breaks = 0.0, np.zeros(0)

    def __init__(self, r: float) -> None:
        self.r, self.end = r, 2.0 * np.pi * r

    def tip(self, s: Floats) -> Derivatives:
        turn = [s / self.r + k * np.pi / 2 for k in range(4)]
        return Derivatives(*(self.r ** (1 - k) * np.stack((np.cos(at), np.sin(at), 0.0 * at), axis=1)
                             for k, at in enumerate(turn)))

    def axis(self, s: Floats) -> Derivatives:
        return Derivatives(*(order * 0.1 / self.r for order in self.tip(s)))

    derivatives = tip


FREE = JointLimits(*np.full((3, 3), 1e5))


def test_limits_at_the_tool_hold_by_length() -> None:
    """On a circle: sqrt(A r) from acceleration, (J r^2)^(1/3) from jerk, rate / |da/ds| from the tilt."""
    circle = Circle(20.0)
    for most, speed in ((ToolLimits(acceleration=500.0, jerk=1e5), 100.0), (ToolLimits(jerk=20000.0), 200.0),
                        (ToolLimits(tilt_rate=0.3, jerk=1e5), 60.0)):
        made = plan(circle, replace(FREE, tool=most), options=STRICT)
        samples = made.trajectory()
        used = samples.usage(made.limits)
        assert used.worst <= 1.0 and used.tool.max() > 0.97
        assert samples.sd.max() == pytest.approx(speed, rel=0.02)
        assert np.mean(samples.binding(made.limits).axis == 3) > 0.5
        assert made.shares.limits[:, 3].sum() == pytest.approx(made.seconds, rel=1e-3)
        assert samples.tool is not None
        np.testing.assert_allclose(np.linalg.norm(samples.qdd, axis=1), samples.tool[:, 1],
                                   rtol=1e-9, atol=1e-9)


def test_second_order_limits_at_the_tool() -> None:
    """On a circle: sqrt(A r) from acceleration, less up to 7.6 % for the octagon; from the tilt rate / |da/ds|."""
    circle = Circle(20.0)
    for most, speed in ((ToolLimits(acceleration=500.0), 100.0), (ToolLimits(tilt_rate=0.3), 60.0),
                        (ToolLimits(jerk=20000.0), 200.0)):
        samples = plan_second_order(circle, replace(FREE, tool=most)).trajectory()
        assert 0.95 * speed < samples.sd.max() < 1.005 * speed
        assert samples.tool is not None and samples.tool[5:-5, 1].max() < 1.02 * most.acceleration


class Screw(PolynomialPath):
    """Tip on a slender helix: its steady jerk is along the binormal, k t sd^3 with curvature k and torsion t.

    One solve limits it next to the jerk in the plane of curvature, strict their sum.
    """

    r, c = 0.05, 1.0

    def __init__(self, length: float) -> None:
        super().__init__([[0.0, 1.0]], length)

    def tip(self, s: Floats) -> Derivatives:
        rate = 1.0 / np.hypot(self.r, self.c)
        turn = [rate * s + k * np.pi / 2 for k in range(4)]
        rise = [self.c * rate * s, np.full(len(s), self.c * rate), 0.0 * s, 0.0 * s]
        return Derivatives(*(np.stack((self.r * rate**k * np.cos(at), self.r * rate**k * np.sin(at), up), axis=1)
                             for k, (at, up) in enumerate(zip(turn, rise, strict=True))))

    def axis(self, s: Floats) -> Derivatives:
        return Derivatives(*(0.0 * order for order in self.tip(s)))


def test_jerk_out_of_the_plane_of_curvature_is_limited() -> None:
    limits = JointLimits(np.array([1e4]), np.array([1e6]), np.array([1e7]), ToolLimits(jerk=500.0))
    path = Screw(60.0)
    made = plan(path, limits)
    curvature, torsion = (value / (path.r**2 + path.c**2) for value in (path.r, path.c))
    speed = (500.0 / (curvature * torsion)) ** (1.0 / 3.0)
    assert made.speed(np.array([30.0]))[0] == pytest.approx(speed, rel=0.02)
    assert 1.1 < made.usage().tool[2] < 1.45
    strict = plan(path, limits, options=STRICT)
    assert strict.usage().worst <= 1.0 and strict.seconds < 1.13 * made.seconds


def test_normal_at_an_inflection_comes_from_the_next_derivative() -> None:
    class Cubic(PolynomialPath):
        def tip(self, s: Floats) -> Derivatives:
            zero, one = 0.0 * s, 0.0 * s + 1.0
            return Derivatives(*(np.stack(row, axis=1) for row in (
                (s, zero, (s - 5.0) ** 3), (one, zero, 3.0 * (s - 5.0) ** 2), (zero, zero, zero), (zero, zero, 6.0 * one))))

        def axis(self, s: Floats) -> Derivatives:
            return self.tip(s)

    eased = Eased.between(Cubic([[0.0, 1.0]], 10.0), 0.0, 10.0, 2.0)
    sigma = eased.sigma(np.array([5.0]))
    frame = np.concatenate(tool(eased, sigma, eased.parameter(sigma)).frame)
    np.testing.assert_allclose(np.abs(frame), np.eye(3)[[0, 2, 1]], atol=1e-9)


def test_tool_on_a_straight_line_gives_nothing_away() -> None:
    """Tip acceleration and jerk along a line: the same as those limits on one joint."""
    one = plan(PolynomialPath([[0.0, 1.0]], 80.0),
               JointLimits(np.array([1e9]), np.array([1000.0]), np.array([20000.0])))

    class Line(PolynomialPath):
        def tip(self, s: Floats) -> Derivatives:
            return self.derivatives(s)

        def axis(self, s: Floats) -> Derivatives:
            return Derivatives(*(0.0 * order for order in self.derivatives(s)))

    free = JointLimits(*np.full((3, 3), 1e6), tool=ToolLimits(acceleration=1000.0, jerk=20000.0))
    made = plan(Line([[0.0, 0.6], [0.0, 0.0], [0.0, 0.8]], 80.0), free)
    assert made.seconds == pytest.approx(one.seconds, rel=2e-4)


def test_bad_limits_at_the_tool_are_refused() -> None:
    with pytest.raises(ValueError, match="positive"):
        ToolLimits(jerk=0.0)
