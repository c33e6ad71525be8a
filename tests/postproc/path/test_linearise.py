"""Points between: the machine's motion measured densely against an own reference, and their number against the least."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.control.control import Control
from postproc.joints.joint_path import nearest_solution
from postproc.path.linearise import CurvePieces, _Front, family_turns, linearise
from tests.postproc.joint_kit import solve
from tests.postproc.kit import angle, great_circle, machine, pose_of, tilted, unit
from toolpaths.shape import Curves

TIP, AXIS = 0.01, np.radians(0.05)
DENSE = 200
MACHINES = ["mikron-ucp710", "trunnion-bc", "head-table", "fork-head-ab"]


def lines(start: np.ndarray, end: np.ndarray, axis0: np.ndarray, axis1: np.ndarray) -> Curves:
    n = len(start)
    return Curves(start, end, axis0, axis1, np.zeros(n, dtype=bool), np.zeros((n, 3)), np.zeros((n, 3)),
                  np.zeros(n))


def ends(name: str, curves: Curves) -> tuple[np.ndarray, np.ndarray]:
    """Joints at both ends of every curve, on one branch."""
    m = machine(name)
    q0, q1 = [], []
    for i in range(len(curves)):
        u = np.linspace(0, 1, 60)
        one = curves.take(np.full(60, i))
        tip, axis = one.at(u)
        q = solve(m.kinematics, tip, axis, m.limits, m.home).q
        q0.append(q[0])
        q1.append(q[-1])
    return np.array(q0), np.array(q1)


def split(name: str, curves: Curves, tip: float = TIP, axis: float = AXIS) -> tuple[CurvePieces, np.ndarray]:
    m = machine(name)
    q0, q1 = ends(name, curves)
    control = Control(m, "axes", np.zeros(3))
    return linearise(control, m.kinematics, curves, q0, q1, np.zeros(len(curves), dtype=bool), tip, axis), q0


def dense_poses(name: str, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tip and axis at DENSE points of the straight joint motion, by the tests' own matrices."""
    scale = np.where(np.array(machine(name).rotary), 180 / np.pi, 1.0)
    t = np.linspace(0, 1, DENSE)[:, None]
    return pose_of(name, (a + t * (b - a)) * scale, 0.0)


def worst(name: str, curves: Curves, pieces: CurvePieces, q0: np.ndarray) -> tuple[float, float]:
    """Largest tip distance from the line segment, and axis angle from the great circle at the nearest point."""
    tip_off = axis_off = 0.0
    for i in range(len(curves)):
        rows = np.flatnonzero(pieces.curve == i)
        assert pieces.u[rows[-1]] == 1.0 and (np.diff(pieces.u[rows]) > 0).all()
        before = q0[i]
        p, d = curves.start[i], curves.end[i] - curves.start[i]
        for k in rows:
            tip, axis = dense_poses(name, before, pieces.q[k])
            u = np.clip((tip - p) @ d / (d @ d), 0, 1)
            tip_off = max(tip_off, np.linalg.norm(tip - p - u[:, None] * d, axis=1).max())
            axis_off = max(axis_off, angle(axis, great_circle(curves.axis0[i], curves.axis1[i], u)).max())
            before = pieces.q[k]
    return tip_off, axis_off


def random_lines(name: str, count: int, seed: int) -> Curves:
    """Moves of 1 to 60 mm with the axis between 5 and 60 degrees from z, turning by up to 40 degrees."""
    rng = np.random.default_rng(seed)
    start = rng.uniform(-60, 60, (count, 3))
    end = start + unit(rng.normal(size=(count, 3))) * rng.uniform(1, 60, (count, 1))
    theta, phi = rng.uniform(8, 50, (2, count)), rng.uniform(0, 360, count)
    a0 = np.array([tilted(t, p) for t, p in zip(theta[0], phi, strict=True)])
    a1 = np.array([tilted(t, p) for t, p in zip(theta[1], phi + rng.uniform(-40, 40, count), strict=True)])
    return lines(start, end, a0, a1)


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("name", MACHINES)
def test_random_moves_stay_inside_the_tolerance_between_points(name: str) -> None:
    curves = random_lines(name, 12, 11)
    pieces, q0 = split(name, curves)
    tip, axis = worst(name, curves, pieces, q0)
    assert not len(pieces.broken)
    assert tip <= TIP * 1.05, "samples may miss the very top of the deviation, not more"
    assert axis <= AXIS * 1.05
    assert tip > 0.2 * TIP or axis > 0.2 * AXIS, "and the points are not needlessly many"


def single(name: str, curves: Curves, a: float, b: float, qa: np.ndarray) -> tuple[bool, np.ndarray]:
    """(is one block from u = a to u = b good, its end joints), by dense measuring."""
    m = machine(name)
    tip, axis = curves.at(np.array([b]))
    qb = nearest_solution(m.kinematics, tip, axis, qa[None])[0]
    got_tip, got_axis = dense_poses(name, qa, qb)
    p, d = curves.start[0], curves.end[0] - curves.start[0]
    u = np.clip((got_tip - p) @ d / (d @ d), 0, 1)
    tip_off = np.linalg.norm(got_tip - p - u[:, None] * d, axis=1).max()
    axis_off = angle(got_axis, great_circle(curves.axis0[0], curves.axis1[0], u)).max()
    return tip_off <= TIP and axis_off <= AXIS, qb


def fewest(name: str, curve: Curves, q: np.ndarray) -> int:
    """Blocks of the greedy longest-step division, which is optimal for deviations that grow with the length."""
    count, at = 0, 0.0
    while at < 1.0:
        low, high = 0.0, 1.0 - at
        if single(name, curve, at, 1.0, q)[0]:
            return count + 1
        for _ in range(12):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if single(name, curve, at, at + middle, q)[0] else (low, middle)
        _, q = single(name, curve, at, at + low, q)
        at, count = at + low, count + 1
    return count


@pytest.mark.parametrize("name", ["mikron-ucp710", "fork-head-ab"])
def test_number_of_points_is_near_the_least(name: str) -> None:
    curves = random_lines(name, 2, 5)
    pieces, q0 = split(name, curves)
    got = np.bincount(pieces.curve, minlength=2)
    least = [fewest(name, curves.take(np.array([i])), q0[i]) for i in range(2)]
    assert sum(least) >= 8
    assert got.sum() / sum(least) < 2.5
    assert (got >= least).all()


def test_arc_at_a_fixed_tilt_follows_the_circle() -> None:
    """On a tilted table the arc is no arc of the words; a dense check of radius, plane and sense."""
    name, normal, center = "mikron-ucp710", tilted(35, 20), np.array([10.0, -5.0, 8.0])
    e1 = unit(np.cross(normal, [0, 0, 1.0]))
    e2 = np.cross(normal, e1)
    sweep = np.radians(250)
    start, end = center + 20 * e1, center + 20 * (np.cos(sweep) * e1 + np.sin(sweep) * e2)
    curves = Curves(start[None], end[None], normal[None], normal[None], np.ones(1, dtype=bool), center[None],
                    normal[None], np.array([sweep]))
    pieces, q0 = split(name, curves)
    before, angles = q0[0], []
    for k in range(len(pieces.q)):
        tip, axis = dense_poses(name, before, pieces.q[k])
        off = tip - center
        assert np.abs(off @ normal).max() < TIP
        assert np.abs(np.linalg.norm(off, axis=1) - 20).max() < TIP * 1.05
        assert angle(axis, normal[None]).max() < AXIS
        angles.append(np.arctan2(off @ e2, off @ e1))
        before = pieces.q[k]
    swept = np.unwrap(np.concatenate(angles))
    assert swept[-1] - swept[0] == pytest.approx(sweep, abs=1e-6)
    assert len(pieces.q) < 2.5 * sweep / (2 * np.arccos(1 - TIP / 20))


def test_helix_with_a_turning_axis() -> None:
    """Two turns up a helix while the axis leans over: own helix formula."""
    name, turns, rise, radius = "trunnion-bc", 2.0, 12.0, 15.0
    sweep = turns * 2 * np.pi
    start, end = np.array([radius, 0, 0]), np.array([radius, 0, rise])
    a0, a1 = tilted(20, 40), tilted(35, 60)
    curves = Curves(start[None], end[None], a0[None], a1[None], np.ones(1, dtype=bool), np.zeros((1, 3)),
                    np.array([[0, 0, 1.0]]), np.array([sweep]))
    pieces, q0 = split(name, curves)
    fine = np.linspace(0, 1, 40001)
    helix = np.stack([radius * np.cos(fine * sweep), radius * np.sin(fine * sweep), rise * fine], axis=1)
    before = q0[0]
    u0 = 0.0
    for k in range(len(pieces.q)):
        tip, axis = dense_poses(name, before, pieces.q[k])
        near = slice(max(int(u0 * 40000) - 400, 0), int(pieces.u[k] * 40000) + 400)
        distance = np.linalg.norm(tip[::20, None] - helix[None, near], axis=2)
        assert distance.min(axis=1).max() < TIP * 1.1
        u = fine[near][distance.argmin(axis=1)]
        assert angle(axis[::20], great_circle(a0, a1, u)).max() < AXIS * 1.1
        before, u0 = pieces.q[k], pieces.u[k]


def test_turn_on_the_spot_keeps_the_tip_still() -> None:
    name, tip = "head-table", np.array([[40.0, 25.0, -10.0]])
    curves = lines(tip, tip, tilted(10, 0)[None], tilted(60, 80)[None])
    pieces, q0 = split(name, curves)
    before = q0[0]
    for k in range(len(pieces.q)):
        got, axis = dense_poses(name, before, pieces.q[k])
        assert np.linalg.norm(got - tip, axis=1).max() < TIP * 1.05
        u = np.linspace(0, 1, 20001)
        circle = great_circle(curves.axis0[0], curves.axis1[0], u)
        assert angle(axis[::20, None], circle[None]).min(axis=1).max() < AXIS * 1.05
        before = pieces.q[k]
    assert len(pieces.q) > 20


def test_straight_moves_at_fixed_rotaries_get_no_point() -> None:
    name = "mikron-ucp710"
    a = np.tile(tilted(30, 40), (2, 1))
    curves = lines(np.zeros((2, 3)), np.array([[50, 20, 10], [-30, 0, 5.0]]), a, a)
    pieces, _ = split(name, curves)
    assert pieces.curve.tolist() == [0, 1]
    assert pieces.u.tolist() == [1.0, 1.0]


def test_jump_of_the_joints_is_named_not_hidden() -> None:
    """From one branch to the other nothing between keeps the tip: the curve is broken."""
    name = "mikron-ucp710"
    m = machine(name)
    curves = lines(np.array([[30.0, 0, 0]]), np.array([[31.0, 0, 0]]), tilted(30, 40)[None],
                   tilted(31, 40)[None])
    b0 = m.kinematics.inverse(curves.start, curves.axis0)
    b1 = m.kinematics.inverse(curves.end, curves.axis1)
    control = Control(m, "axes", np.zeros(3))
    got = linearise(control, m.kinematics, curves, b0[0], b1[1], np.zeros(1, dtype=bool), TIP, AXIS)
    assert got.broken.tolist() == [0]


def test_tolerance_halved_means_about_forty_percent_more_points() -> None:
    """The deviation falls with the square of the length."""
    curves = random_lines("mikron-ucp710", 8, 21)
    wide, narrow = (len(split("mikron-ucp710", curves, f * TIP, f * AXIS)[0].q) for f in (1.0, 0.25))
    assert 1.4 < narrow / wide < 2.9


def test_turns_at_a_pole_take_the_value_that_the_curve_needs() -> None:
    name = "mikron-ucp710"
    m = machine(name)
    up = np.array([[0, 0, 1.0]])
    curves = lines(np.array([[30.0, 10, 0]]), np.array([[35.0, 10, 0]]), up, tilted(20, 140)[None])
    q0 = m.kinematics.inverse(curves.start, up, near=np.zeros((1, 5)))[0]
    q1 = m.kinematics.inverse(curves.end, curves.axis1)[0]
    rows, begun = family_turns(m.kinematics, curves, q0, q1)
    assert rows.tolist() == [0]
    turned = (begun[0, 4] - q1[0, 4] + np.pi) % (2 * np.pi) - np.pi
    assert abs(turned) < 1e-9
    tip, axis = pose_of(name, begun * [1, 1, 1, 180 / np.pi, 180 / np.pi], 0.0)
    assert np.allclose(tip, curves.start) and np.allclose(axis, up)
    assert len(family_turns(m.kinematics, curves, begun, q1)[0]) == 0


def helix(turns: int) -> Curves:
    """Turns of radius 10 and pitch 0.5 at a tilted tool axis."""
    end = np.array([[10.0, 0, -0.5 * turns]])
    axis, up = tilted(25, 40)[None], np.array([[0, 0, 1.0]])
    return Curves(np.array([[10.0, 0, 0]]), end, axis, axis, np.ones(1, dtype=bool), np.zeros((1, 3)), up,
                  np.array([2 * np.pi * turns]))


def test_the_steps_of_many_turns_are_not_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """As many blocks a turn as one turn has, in hardly more rounds, inside the tolerance all along."""
    rounds: list[int] = []
    advance = _Front.advance
    monkeypatch.setattr(_Front, "advance", lambda front: (rounds.append(len(front.index)), advance(front)))
    one = split("mikron-ucp710", helix(1))[0]
    of_one = len(rounds)
    curves = helix(60)
    many, q0 = split("mikron-ucp710", curves)
    assert len(rounds) - of_one <= 1.5 * of_one
    assert abs(len(many.u) / len(one.u) / 60 - 1) < 0.03 and (np.diff(many.u) > 0).all() and many.u[-1] == 1.0
    assert not len(many.broken) and many.worst_tip <= TIP
    q = np.concatenate([q0, many.q])
    for k in np.random.default_rng(1).integers(0, len(many.u), 60):
        tip, axis = dense_poses("mikron-ucp710", q[k], q[k + 1])
        along = np.interp(tip[:, 2], [-30.0, 0.0], [1.0, 0.0])
        assert np.abs(np.hypot(tip[:, 0], tip[:, 1]) - 10.0).max() < TIP
        assert np.linalg.norm(curves.take(np.zeros(DENSE, dtype=int)).at(along)[0] - tip, axis=1).max() < 3 * TIP
        assert angle(axis, curves.axis0).max() < 1e-9
