"""Joints of a run: windings, branches, the free axis at a pole, against brute force and very fine continuation."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.machine import Limits
from postproc.joints.joint_path import nearest_solution, reachable_axes
from tests.postproc.joint_kit import solve
from tests.postproc.kit import angle, great_circle, machine, tilted, unit
from toolpaths.rotations import wrap

DEG = np.pi / 180.0


def limits_of(name: str, **travel: tuple[float, float]) -> Limits:
    """The limits of a machine with other travel, degrees."""
    m = machine(name)
    lower, upper = m.limits.lower.copy(), m.limits.upper.copy()
    for letter, (low, high) in travel.items():
        lower[m.axis_names.index(letter)], upper[m.axis_names.index(letter)] = low * DEG, high * DEG
    return replace(m.limits, lower=lower, upper=upper)


def run(name: str, axis: np.ndarray, limits: Limits | None = None,
        start: np.ndarray | None = None) -> np.ndarray:
    """Rotary joints of a run in degrees; the tip moves a little so that poses differ."""
    m = machine(name)
    tip = np.linspace(0, 1, len(axis))[:, None] * [10.0, 5.0, 0.0]
    q = solve(m.kinematics, tip, axis, limits or m.limits, m.home if start is None else start).q
    assert np.isfinite(q).all()
    got_tip, got_axis = m.kinematics.forward(q)
    assert np.abs(got_tip - tip).max() < 1e-8 and angle(got_axis, axis).max() < 1e-8
    return q[:, 3:] / DEG


def cone(theta: float, phi: np.ndarray) -> np.ndarray:
    return np.array([tilted(theta, p) for p in phi])


def over(theta: np.ndarray, miss: float, phi: float = 0.0) -> np.ndarray:
    """Axes on a straight path past the pole: theta degrees along direction phi, `miss` degrees next to it."""
    a, b = np.radians(theta), np.radians(miss)
    v = np.stack([np.sin(a) * np.cos(b), np.full(len(a), np.sin(b)), np.cos(a) * np.cos(b)], axis=1)
    c, s = np.cos(np.radians(phi)), np.sin(np.radians(phi))
    return v @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]).T


def test_wrap_is_into_the_half_open_turn() -> None:
    turns = np.array([0.0, np.pi, -np.pi, 3 * np.pi, 0.1 - 6 * np.pi, 2 * np.pi])
    assert np.allclose(wrap(turns), [0, np.pi, np.pi, np.pi, 0.1, 0], atol=1e-12)


# ---- windings ----------------------------------------------------------------------------------------------


def brute(branches: np.ndarray, limits: Limits, start: np.ndarray) -> tuple[float, np.ndarray] | None:
    """(seconds, joints) of the fastest continuous track inside travel over both branches and windings -4..4."""
    best = None
    for q in branches:
        base = np.unwrap(q[:, 3:], axis=0)
        for turns in product(range(-4, 5), repeat=2):
            rotary = base + 2 * np.pi * np.array(turns)
            if (rotary < limits.lower[3:] - 1e-9).any() or (rotary > limits.upper[3:] + 1e-9).any():
                continue
            course = seconds(np.column_stack([q[:, :3], rotary]), limits, start)
            if best is None or course < best[0] - 1e-9:
                best = (course, rotary)
    return best


def seconds(q: np.ndarray, limits: Limits, start: np.ndarray) -> float:
    """Time of a track, each step as long as its slowest axis needs."""
    return float((np.abs(np.diff(q, axis=0, prepend=start[None])) / limits.velocity).max(axis=1).sum())


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("name", ["mikron-ucp710", "head-table", "fork-head-ab", "nutating-head"])
def test_best_track_of_all_branches_and_windings(name: str) -> None:
    """Random spirals away from the pole: inside travel where any track is, and none is faster."""
    m, rng, inside = machine(name), np.random.default_rng(7), 0
    letters = m.axis_names[3:]
    for _ in range(40):
        phi = rng.uniform(0, 360) + np.linspace(0, rng.uniform(-500, 500), 120)
        axis = cone(rng.uniform(10, 40), phi)
        travel = {k: tuple(np.sort(rng.uniform(-400, 400, 2))) for k in letters}
        limits = limits_of(name, **travel)
        start = np.concatenate([np.zeros(3), rng.uniform(-6, 6, 2)])
        branches = m.kinematics.inverse(np.zeros((120, 3)), axis)
        want = brute(branches, limits, start)
        whole = solve(m.kinematics, np.zeros((120, 3)), axis, limits, start).q
        q = whole[:, 3:]
        if want is not None:
            inside += 1
            assert (q >= limits.lower[3:] - 1e-9).all() and (q <= limits.upper[3:] + 1e-9).all()
            assert seconds(whole, limits, start) == pytest.approx(want[0], abs=1e-6)
        assert np.abs(np.diff(q, axis=0)).max() < 0.5
    assert inside >= 5


def test_starts_wound_where_the_whole_run_then_fits() -> None:
    """C within +-200, 300 degrees round from C 175: only -185 to 115 fits."""
    limits = limits_of("mikron-ucp710", C=(-200, 200))
    q = run("mikron-ucp710", cone(30, np.linspace(-95, 205, 61)), limits)
    assert q[[0, -1], 1] == pytest.approx([-185, 115])
    assert q[:, 1].min() >= -200 - 1e-9 and q[:, 1].max() <= 200 + 1e-9


def test_unlimited_axis_keeps_on_turning() -> None:
    q = run("mikron-ucp710", cone(30, np.linspace(0, 1500, 301)))
    assert abs(abs(q[-1, 1] - q[0, 1]) - 1500) < 1e-6


def test_nearest_winding_to_where_the_machine_stands() -> None:
    start = np.array([0, 0, 0, 0.5, 14 * np.pi])
    q = run("mikron-ucp710", cone(30, np.linspace(0, 40, 9)), start=start)
    assert abs(q[0, 1] - 14 * 180) <= 180


# ---- the free axis -----------------------------------------------------------------------------------------


def test_free_axis_begins_where_the_run_will_need_it() -> None:
    axis = np.concatenate([np.tile([0, 0, 1.0], (5, 1)), cone(1, np.array([70])), cone(30, np.linspace(70, 90, 5))])
    c = run("mikron-ucp710", axis)[:, 1]
    assert np.ptp(c[:6]) < 1e-9


def test_free_axis_stands_still_in_the_middle_and_at_the_end() -> None:
    axis = np.concatenate([cone(20, np.array([70])), np.tile([0, 0, 1.0], (4, 1)), cone(20, np.array([200])),
                           np.tile([0, 0, 1.0], (4, 1))])
    c = run("mikron-ucp710", axis)[:, 1]
    assert np.ptp(c[:5]) < 1e-9 and np.ptp(c[5:]) < 1e-9


def test_free_axis_of_a_run_along_the_pole_stays_at_the_start() -> None:
    start = np.array([0, 0, 0, 0, 1.234])
    assert np.allclose(run("mikron-ucp710", np.tile([0, 0, 1.0], (6, 1)), start=start)[:, 1], 1.234 / DEG)


# ---- near the pole -----------------------------------------------------------------------------------------


def continued(name: str, axis: np.ndarray, q: np.ndarray, steps: int) -> np.ndarray:
    """Rotary joints at the end of each step when the exact motion is followed in very many small steps from q[i]."""
    m = machine(name)
    ends = []
    for i in range(len(axis) - 1):
        dense = great_circle(axis[i], axis[i + 1], np.linspace(0, 1, steps))
        branches = m.kinematics.inverse(np.zeros((steps, 3)), dense)[:, :, 3:]
        now = q[i]
        for k in range(1, steps):
            d = (branches[:, k] - now + np.pi) % (2 * np.pi) - np.pi
            now = now + d[np.abs(d).sum(axis=1).argmin()]
        ends.append(now)
    return np.array(ends)


@pytest.mark.parametrize(("name", "miss"),
                         [("mikron-ucp710", 0.5), ("mikron-ucp710", 0.01), ("head-table", -0.5)])
def test_next_to_the_pole_the_branch_is_followed_not_jumped(name: str, miss: float) -> None:
    """Points 2 degrees apart on both sides, none near the pole: C has to swing half a turn on one branch."""
    axis = over(np.arange(-9.0, 10.0, 2.0), miss, phi=25)
    limits = limits_of(name, **{machine(name).axis_names[3]: (-120, 120)})
    q = run(name, axis, limits) * DEG
    got = continued(name, axis, q, 1601)
    d = (got - q[1:] + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(d).max() < 1e-3
    assert abs(abs(q[-1, 1] - q[0, 1]) / DEG - 180) < 20, "the table swings round"


@pytest.mark.parametrize("on_pole", [True, False])
def test_over_the_pole_the_table_stands_still(on_pole: bool) -> None:
    """Exactly through the pole, with a point on it or none: the trunnion goes through zero, C rests."""
    theta = np.arange(-10.0, 11.0, 2.0) if on_pole else np.arange(-9.0, 10.0, 2.0)
    q = run("mikron-ucp710", over(theta, 0.0, phi=25), limits_of("mikron-ucp710", A=(-120, 120)))
    assert np.ptp(q[:, 1]) < 1e-6
    assert np.allclose(np.diff(q[:, 0]), np.diff(q[:, 0])[0], atol=1e-6)


def test_branch_changes_on_the_pole_where_travel_demands_it() -> None:
    """A -30 to 120: sixty degrees on both sides of the pole need half a turn of C on it."""
    q = run("mikron-ucp710", over(np.arange(-60.0, 61.0, 5.0), 0.0, phi=25))
    assert q[:, 0].min() >= -30 - 1e-9
    assert abs(abs(q[-1, 1] - q[0, 1]) - 180) < 1e-6
    moved = np.flatnonzero(np.abs(np.diff(q[:, 1])) > 1e-6)
    assert moved.tolist() in ([11], [12]), "only next to the pose on the pole"


def test_several_crossings_each_choose_for_their_own_stretch() -> None:
    """60 through the pole to 20, back to 60, and so on: A inside -30..120 along the whole path."""
    theta = np.concatenate([np.arange(60.0, -21.0, -5.0), np.arange(-15.0, 61.0, 5.0), np.arange(55.0, -61.0, -5.0)])
    q = run("mikron-ucp710", over(theta, 0.0))
    assert q[:, 0].min() >= -30 - 1e-9 and q[:, 0].max() <= 120


def test_many_random_walks_near_the_pole_have_no_jump() -> None:
    """Wherever two poses lie, the fine continuation from one ends at the other."""
    rng = np.random.default_rng(3)
    limits = limits_of("mikron-ucp710", A=(-120, 120))
    for _ in range(4):
        axis = unit(np.cumsum(rng.normal(0, [0.02, 0.02, 0], (8, 3)), axis=0) * [1, 1, 0] + [0.01, 0, 1])
        q = run("mikron-ucp710", axis, limits) * DEG
        d = (continued("mikron-ucp710", axis, q, 801) - q[1:] + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(d).max() < 0.02


# ---- no solution -------------------------------------------------------------------------------------------


def test_poses_out_of_reach_are_nan_and_the_others_go_on() -> None:
    """A head can tilt by 90 degrees at most on a nutating head; the axes below that have no solution."""
    m = machine("nutating-head")
    axis = cone(60, np.linspace(0, 40, 9))
    axis[3] = tilted(150, 15)
    axis[6] = tilted(120, 30)
    q = solve(m.kinematics, np.zeros((9, 3)), axis, m.limits, m.home).q
    assert np.flatnonzero(np.isnan(q).any(axis=1)).tolist() == [3, 6]
    assert np.isnan(q[[3, 6]]).all()
    good = np.isfinite(q).all(axis=1)
    assert np.abs(np.diff(q[good][:, 3:], axis=0)).max() < 0.8


def test_a_way_through_the_hole_at_the_pole_of_axes_that_are_not_square_ends(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With C out of square by 0.001, directions within 0.001 of its own cannot be taken: who follows a branch
    across them in ever smaller steps never arrives."""
    file = tmp_path / "measured.toml"
    file.write_text('base = "mikron-ucp710"\n[kinematics.axes.C]\ndirection = [0.001, 0, 0.9999995]\n')
    m = machines.load(file)
    axis = unit(np.array([[-0.02, 0.001, 1.0], [0.001, 0.0, 1.0], [0.03, -0.001, 1.0]]))[[0, 2]]
    assert np.isfinite(m.kinematics.inverse(np.zeros((2, 3)), axis)).all()
    calls: list[int] = []
    inverse = type(m.kinematics).inverse

    def counted(*args: object, **more: object) -> np.ndarray:
        calls.append(1)
        assert len(calls) < 2000
        return inverse(*args, **more)

    monkeypatch.setattr(type(m.kinematics), "inverse", counted)
    q = solve(m.kinematics, np.zeros((2, 3)), axis, m.limits, m.home).q
    assert np.isfinite(q).all()


@pytest.mark.parametrize("name", ["mill-3axis", "mill-4axis", "mikron-ucp710"])
def test_first_and_only_pose_without_solution(name: str) -> None:
    m = machine(name)
    axis = np.array([[0.6, 0, 0.8], [0, 0, 1.0]]) if name != "mikron-ucp710" else np.full((2, 3), np.nan)
    q = solve(m.kinematics, np.zeros((2, 3)), axis, m.limits, m.home).q
    assert np.isnan(q[0]).any()
    assert np.isfinite(q[1]).all() == (name != "mikron-ucp710")


def test_axes_just_outside_are_moved_onto_the_reachable_set_only_within_the_tolerance() -> None:
    kin = machine("mill-4axis").kinematics
    off = np.array([0.0, 1e-4, 2e-3])
    axis = np.stack([np.sin(off), 0.6 * np.cos(off), 0.8 * np.cos(off)], axis=1)
    got, moved = reachable_axes(kin, axis, 1e-3)
    assert np.allclose(moved, [0, 1e-4, 0], atol=1e-9)
    assert np.allclose(got[1], [0, 0.6, 0.8], atol=1e-9)
    assert np.array_equal(got[2], axis[2])


def test_nearest_solution_keeps_branch_and_winding() -> None:
    m, rng = machine("mikron-ucp710"), np.random.default_rng(5)
    q = np.column_stack([rng.uniform(-100, 100, (200, 3)), rng.uniform(0.1, 1.5, 200) * rng.choice([-1, 1], 200),
                         rng.uniform(-40, 40, 200)])
    tip, axis = m.kinematics.forward(q)
    assert np.abs(nearest_solution(m.kinematics, tip, axis, q + rng.normal(0, 0.01, q.shape)) - q).max() < 1e-8
