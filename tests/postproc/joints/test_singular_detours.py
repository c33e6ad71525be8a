"""Tool axes led past singular directions: optimal by linear programming, inside the tolerance everywhere between points."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from postproc.joints.lattice import PoseRun
from postproc.joints.plan import plan_runs
from postproc.joints.poles import poles_of
from postproc.joints.singular_detours import Led, lead_past
from postproc.joints.taut_string import taut_string
from tests.postproc.joint_kit import DEG, angle, lines, machine, tilted, unit
from toolpaths.shape import Curves

TOLERANCE = 0.02 * DEG


def past(miss: float, step: float, heading: float = 25.0) -> tuple[Curves, np.ndarray]:
    """A straight path of the axis past +z at `miss` degrees, points `step` degrees apart, 20 mm/s, 2 mm per degree."""
    a, b = np.radians(np.arange(-9 + step / 3, 9, step)), np.radians(miss)
    axis = np.stack([np.sin(a) * np.cos(b), np.full(len(a), np.sin(b)), np.cos(a) * np.cos(b)], axis=1)
    c, s = np.cos(heading * DEG), np.sin(heading * DEG)
    axis = axis @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]).T
    tip = np.stack([2.0 * a / DEG, 0 * a, 0 * a], axis=1)
    curves = lines(tip, axis)
    return curves, curves.length() / 20.0


def dense_deviation(curves: Curves, led: Led) -> float:
    """Largest angle between the led axes and the given ones at the same tip."""
    worst = 0.0
    given = curves.take(led.parent)
    for t in np.linspace(0, 1, 41):
        _, new = led.curves.at(np.full(len(led.parent), t))
        _, old = given.at(led.u0 + t * (led.u1 - led.u0))
        worst = max(worst, float(angle(new, old).max()))
    return worst


@pytest.mark.parametrize("name", ["mikron-ucp710", "head-table", "nutating-head", "h4a-c-table", "fork-head-ab"])
def test_poles_are_where_the_inverse_is_a_family(name: str) -> None:
    m = machine(name)
    poles = poles_of(m.kinematics)
    assert poles
    for pole in poles:
        tip = np.zeros((1, 3)) if m.kinematics.straight_slides else m.kinematics.workspace.middle[None]
        q = [m.kinematics.inverse(tip, pole.frame[2:], near=np.eye(5)[pole.joint] * v)[0] for v in (0.3, 1.1)]
        assert q[0][0, pole.joint] == pytest.approx(0.3) and q[1][0, pole.joint] == pytest.approx(1.1)


@pytest.mark.parametrize("name", ["mill-3axis", "mill-4axis", "delta-cone", "h4a-spindle-axis"])
def test_machines_without_a_pole(name: str) -> None:
    assert poles_of(machine(name).kinematics) == []


def test_taut_string_has_the_least_largest_slope() -> None:
    """Against linear programming over all values in the gates."""
    rng = np.random.default_rng(4)
    for _ in range(25):
        n = int(rng.integers(3, 40))
        at = np.cumsum(rng.uniform(0.1, 1.0, n))
        middle, width = np.cumsum(rng.normal(0, 1, n)), rng.uniform(0.0, 2.0, n) * (rng.random(n) < 0.8)
        width[[0, -1]] = 0.0
        got = taut_string(at, middle - width, middle + width)
        assert (np.abs(got - middle) <= width + 1e-12).all()
        difference = np.diff(np.eye(n), axis=0) / np.diff(at)[:, None]
        side = np.column_stack([np.vstack([difference, -difference]), -np.ones(2 * (n - 1))])
        best = linprog(np.append(np.zeros(n), 1.0), A_ub=side, b_ub=np.zeros(2 * (n - 1)),
                       bounds=[*zip(middle - width, middle + width, strict=True), (0, None)])
        assert np.abs(np.diff(got) / np.diff(at)).max() == pytest.approx(best.fun, abs=1e-7)


@pytest.mark.covering
@pytest.mark.parametrize("step", [2.0, 0.05])
@pytest.mark.parametrize("miss", [0.001, 0.015, 0.021, 0.1])
def test_led_axis_stays_inside_the_tolerance_and_turns_the_table_less(miss: float, step: float) -> None:
    m = machine("mikron-ucp710")
    curves, seconds = past(miss, step)
    led = lead_past(m.kinematics, curves, seconds, TOLERANCE, m.limits.velocity)
    assert dense_deviation(curves, led) <= TOLERANCE
    event, = led.events
    assert event.miss == pytest.approx(miss * DEG, rel=0.1) and event.joint == 4
    tip, axis = np.vstack([led.curves.start, led.curves.end[-1:]]), np.vstack([led.curves.axis0, led.curves.axis1[-1:]])
    q = plan_runs([PoseRun(m.kinematics, tip, axis)], m.limits, m.home)[0].q
    rate = np.abs(np.diff(q[:, 4])) / ((led.u1 - led.u0) * seconds[led.parent])
    assert rate.max() == pytest.approx(event.after, rel=0.02), "the machine's own table turns as the event says"
    if miss < 0.02:
        assert event.after < event.before / 100.0
    else:
        gain = event.before / event.after
        assert 1.1 < gain <= (miss * DEG + TOLERANCE) / (miss * DEG) * 1.6


def test_parts_cover_every_curve_once_in_order() -> None:
    curves, seconds = past(0.015, 2.0)
    m = machine("mikron-ucp710")
    led = lead_past(m.kinematics, curves, seconds, TOLERANCE, m.limits.velocity)
    for k in range(len(curves)):
        rows = np.flatnonzero(led.parent == k)
        assert led.u0[rows[0]] == 0.0 and led.u1[rows[-1]] == 1.0
        assert np.array_equal(led.u0[rows[1:]], led.u1[rows[:-1]])
    assert np.abs(led.curves.end[:-1] - led.curves.start[1:]).max() < 1e-12
    assert np.array_equal(led.curves.axis1[:-1], led.curves.axis0[1:])
    assert np.array_equal(led.curves.axis0[0], curves.axis0[0])
    assert angle(led.curves.axis1[-1], curves.axis1[-1]) < 1e-12


def test_nothing_is_touched_where_no_axis_is_too_fast() -> None:
    """Slow enough, far enough, exactly through, in rapid: the curves are as they were."""
    m = machine("mikron-ucp710")
    for miss, slower in ((0.5, 3000.0), (30.0, 1.0), (0.0, 1.0), (0.015, np.nan)):
        curves, seconds = past(miss, 0.5)
        led = lead_past(m.kinematics, curves, seconds * slower, TOLERANCE, m.limits.velocity)
        assert not led.events and len(led.parent) == len(curves)
        assert np.array_equal(led.curves.axis1, curves.axis1)


def test_wandering_about_the_pole() -> None:
    """Random walks round +z: inside the tolerance, and never faster than before."""
    m, rng, met = machine("mikron-ucp710"), np.random.default_rng(6), 0
    for _ in range(12):
        walk = np.cumsum(rng.normal(0, 0.03 * DEG, (60, 2)), axis=0)
        axis = unit(np.column_stack([walk - walk[30] + rng.normal(0, 0.01 * DEG, 2), np.ones(60)]))
        axis = np.vstack([tilted(3, rng.uniform(0, 360)), axis, tilted(3, rng.uniform(0, 360))])
        curves = lines(np.linspace(0, 10, 62)[:, None] * [1.0, 0, 0], axis)
        led = lead_past(m.kinematics, curves, curves.length() / 20.0, TOLERANCE, m.limits.velocity)
        assert dense_deviation(curves, led) <= TOLERANCE
        assert all(e.after < e.before for e in led.events)
        met += len(led.events)
    assert met >= 6
