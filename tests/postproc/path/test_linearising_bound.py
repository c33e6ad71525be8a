"""The proved bound of linearising compared with dense truth: never below it, on every machine and under every law."""

from __future__ import annotations

import numpy as np
import pytest

import machines
from machines.kinematics.rod_loops import UNBOUNDED
from machines.kinematics.serial import Serial
from postproc.control.control import Control
from postproc.joints.joint_path import nearest_solution
from postproc.path.bound import CurveBlocks, bounds
from postproc.path.linearise import linearise
from tests.machines.random_slides import random_slides
from tests.postproc.joint_kit import DEG, angle, machine, segments, tilted, unit
from toolpaths.shape import Curves

NAMES = machines.names()
TIP, AXIS = 0.01, 0.05 * DEG


def moves(name: str, count: int, seed: int, size: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Straight joint moves (N, J), inside the workspace of parallel machines."""
    kin, rng = machine(name).kinematics, np.random.default_rng(seed)
    step = rng.normal(0, 1, (count, kin.joints)) * np.where(kin.rotary, 0.1, 12.0) * size
    if isinstance(kin, Serial):
        q0 = rng.uniform(-1, 1, (count, kin.joints)) * np.where(kin.rotary, 1.5, 100.0)
        return q0, q0 + step
    slides = random_slides(kin, rng, count)
    q0 = np.column_stack([slides, rng.uniform(-1, 1, (count, kin.joints - slides.shape[1]))])
    return q0, q0 + 0.3 * step


def dense(name: str, q0: np.ndarray, q1: np.ndarray, places: int) -> tuple[np.ndarray, np.ndarray]:
    """(tips, axes), each (places, N, 3), along the moves."""
    poses = [machine(name).kinematics.with_tool(80.0).forward(q0 + t * (q1 - q0)) for t in np.linspace(0, 1, places)]
    return np.stack([tip for tip, _ in poses]), np.stack([axis for _, axis in poses])


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_of_straight_moves_and_the_bound_of_the_third(name: str) -> None:
    """Against finite differences of the forward kinematics at 41 places."""
    q0, q1 = moves(name, 60, 5)
    n, h = len(q0), 1.0 / 40
    found = machine(name).kinematics.with_tool(80.0).jets(q0, q1)
    for jet, x in zip(found, dense(name, q0, q1, 41), strict=True):
        value, first, second = (np.stack([np.broadcast_to(c, n) for c in v], axis=1) for v in (
            jet.value, jet.first, jet.second))
        scale = max(np.abs(second).max(), np.abs(first).max(), 1e-3)
        assert np.abs(value - x[20]).max() < 1e-7
        assert np.abs(first - (x[21] - x[19]) / (2 * h)).max() < 1e-3 * scale
        assert np.abs(second - (x[21] - 2 * x[20] + x[19]) / h**2).max() < 1e-3 * scale
        third = np.linalg.norm(x[3:] - 3 * x[2:-1] + 3 * x[1:-2] - x[:-3], axis=2).max(axis=0) / h**3
        bound = np.broadcast_to(jet.third, n)
        assert (third <= bound * (1 + 1e-6) + 1e-4 * scale).all()
        bend = np.linalg.norm(x[2:] - 2 * x[1:-1] + x[:-2], axis=2).max(axis=0) / h**2
        assert (bend <= jet.bend() * (1 + 1e-9) + 1e-5 * scale).all()
        assert (bound < UNBOUNDED).mean() > 0.7


def curves_for(name: str, count: int, seed: int) -> tuple[Curves, np.ndarray, np.ndarray]:
    """Moves of the tool with the joints at both ends on one branch."""
    kin, rng = machine(name).kinematics.with_tool(80.0), np.random.default_rng(seed)
    q0, q1 = moves(name, count, seed)
    if isinstance(kin, Serial):
        tilt = np.where(q0[:, 3:] < 0.0, -1.0, 1.0) * np.clip(np.abs(q0[:, 3:]), 0.5, 1.3)
        q0[:, 3:], q1[:, 3:] = tilt, tilt + np.clip((q1 - q0)[:, 3:], -0.3, 0.3)
    start, axis0 = kin.forward(q0)
    end, axis1 = kin.forward(q1)
    end = start + (end - start) * rng.uniform(0.05, 1.0, (count, 1))
    q0, q1 = nearest_solution(kin, start, axis0, q0), nearest_solution(kin, end, axis1, q1)
    good = np.isfinite(q0).all(axis=1) & np.isfinite(q1).all(axis=1)
    return segments(start, end, axis0, axis1).take(np.flatnonzero(good)), q0[good], q1[good]


def truth(name: str, control: Control, curves: Curves, qa: np.ndarray, qb: np.ndarray, ua: np.ndarray,
          ub: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Largest (tip, axis) deviation of each block at 41 places: nearest point of the line, great circle there."""
    kin = machine(name).kinematics.with_tool(80.0)
    tip_off, axis_off = np.zeros(len(qa)), np.zeros(len(qa))
    span = curves.end - curves.start
    size = (span**2).sum(axis=1)
    whole = angle(curves.axis0, curves.axis1)
    normal = np.cross(curves.axis0, curves.axis1)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    for t in np.linspace(0, 1, 41):
        tip, axis, _ = control.between(qa, qb, np.full(len(qa), t), kin)
        u = np.clip(((tip - curves.start) * span).sum(axis=1) / size, 0, 1)
        tip_off = np.maximum(tip_off, np.linalg.norm(tip - curves.start - u[:, None] * span, axis=1))
        u = np.where(size > 0.01, u, ua + t * (ub - ua))[:, None] * whole[:, None]
        on = np.cos(u) * curves.axis0 + np.sin(u) * np.cross(normal, curves.axis0)
        axis_off = np.maximum(axis_off, angle(axis, on))
    return tip_off, axis_off


LAWS = [(name, law) for name in NAMES for law in ("axes", "tcp") if law == "axes" or (
    machine(name).kinematics.straight_slides and any(machine(name).rotary))]


@pytest.mark.covering
@pytest.mark.parametrize(("name", "law"), LAWS)
def test_bound_is_never_below_dense_truth(name: str, law: str) -> None:
    """Whole moves, far too long to pass, and the pieces that linearising makes of them."""
    kin = machine(name).kinematics.with_tool(80.0)
    control = Control(machine(name), law, np.zeros(3))
    curves, q0, q1 = curves_for(name, 24, 9)
    assert len(curves) >= 9
    n = len(curves)
    real = truth(name, control, curves, q0, q1, np.zeros(n), np.ones(n))
    stretch = CurveBlocks(curves, np.zeros(n), np.ones(n), q0, q1, kin.forward(q0), kin.forward(q1))
    for near in (1e9, 1e-9):
        bound = bounds(control, kin, stretch, near, near)
        assert (bound[0] >= real[0] - 1e-9).all() and (bound[1] >= real[1] - 1e-9).all()
    got = linearise(control, kin, curves, q0, q1, np.zeros(n, dtype=bool), TIP, AXIS)
    assert not len(got.broken)
    head = np.append(True, np.diff(got.curve) > 0)
    qa, ua = np.where(head[:, None], q0[got.curve], np.roll(got.q, 1, axis=0)), np.where(head, 0.0, np.roll(got.u, 1))
    tip, axis = truth(name, control, curves.take(got.curve), qa, got.q, ua, got.u)
    assert tip.max() <= got.worst_tip + 1e-9 <= TIP + 2e-9
    assert axis.max() <= got.worst_axis + 1e-9 <= AXIS + 2e-9
    if len(got.q) > 2 * n:
        assert max(tip.max() / TIP, axis.max() / AXIS) > 0.7, "and the bound is not much above it"


@pytest.mark.parametrize("name", ["mikron-ucp710", "head-table", "h4a-c-table"])
def test_no_longer_block_passes_the_same_bound(name: str) -> None:
    """Each piece but the last two of a curve made a fifth longer is outside: no division by this bound has fewer."""
    kin = machine(name).kinematics.with_tool(80.0)
    control = Control(machine(name), "axes", np.zeros(3))
    curves, q0, q1 = curves_for(name, 30, 4)
    got = linearise(control, kin, curves, q0, q1, np.zeros(len(curves), dtype=bool), TIP, AXIS)
    head = np.append(True, np.diff(got.curve) > 0)
    qa, ua = np.where(head[:, None], q0[got.curve], np.roll(got.q, 1, axis=0)), np.where(head, 0.0, np.roll(got.u, 1))
    more = np.append(got.curve[2:] == got.curve[:-2], [False, False])
    longer = np.flatnonzero(more & (ua + 1.2 * (got.u - ua) < 1.0))
    assert len(longer) > 20
    pick, u1 = curves.take(got.curve[longer]), (ua + 1.2 * (got.u - ua))[longer]
    tip, axis = pick.at(u1)
    qb = nearest_solution(kin, tip, axis, got.q[longer])
    stretch = CurveBlocks(pick, ua[longer], u1, qa[longer], qb, kin.forward(qa[longer]), kin.forward(qb))
    tip_bound, axis_bound = bounds(control, kin, stretch, TIP, AXIS)
    assert ((tip_bound > TIP) | (axis_bound > AXIS)).mean() > 0.97


def test_bound_holds_on_arcs_with_a_turning_axis() -> None:
    """Helices on a tilted table, against 2000 places of the helix."""
    name, rng = "mikron-ucp710", np.random.default_rng(2)
    kin = machine(name).kinematics
    control = Control(machine(name), "axes", np.zeros(3))
    for _ in range(2):
        normal, center, radius = tilted(rng.uniform(0, 40), rng.uniform(0, 360)), rng.uniform(-20, 20, 3), rng.uniform(3, 30)
        e1 = unit(np.cross(normal, [0.3, 0.8, 0.1]))
        e2, sweep, rise = np.cross(normal, e1), rng.uniform(1, 8), rng.uniform(-5, 5)
        start = center + radius * e1
        end = center + radius * (np.cos(sweep) * e1 + np.sin(sweep) * e2) + rise * normal
        a0, a1 = tilted(25, 10), tilted(35, 40)
        curve = Curves(start[None], end[None], a0[None], a1[None], np.ones(1, dtype=bool), center[None], normal[None],
                       np.array([sweep]))
        q0 = kin.inverse(start[None], a0[None])[0]
        got = linearise(control, kin, curve, q0, nearest_solution(kin, end[None], a1[None], q0), np.zeros(1, dtype=bool),
                        TIP, AXIS)
        assert not len(got.broken)
        fine = np.linspace(0, 1, 20001)
        angles = fine[:, None] * sweep
        helix = center + radius * (np.cos(angles) * e1 + np.sin(angles) * e2) + fine[:, None] * rise * normal
        before = q0[0]
        for q, u in zip(got.q, got.u, strict=True):
            t = np.linspace(0, 1, 25)[:, None]
            tip, axis = kin.forward(before + t * (q - before))
            window = slice(max(int((u - 0.3) * 20000), 0), int(u * 20000) + 300)
            far = np.linalg.norm(tip[:, None] - helix[None, window],
                                 axis=2)
            assert far.min(axis=1).max() <= got.worst_tip + 2e-6
            at = fine[window][far.argmin(axis=1)]
            theta = angle(a0, a1) * at[:, None]
            across = unit(np.cross(np.cross(a0, a1), a0))
            assert angle(axis, np.cos(theta) * a0 + np.sin(theta) * across).max() <= got.worst_axis + 2e-5
            before = q


def test_short_moves_need_no_point_and_cost_little() -> None:
    """A bound of 1e-6 mm for steps of 0.01 mm: nothing is added to dense data."""
    name = "mikron-ucp710"
    kin = machine(name).kinematics
    t = np.linspace(0, 3, 5000)
    tip, axis = np.stack([30 * np.cos(t), 30 * np.sin(t), t], axis=1), tilted(20 + 8 * np.sin(3 * t), 40 * t)
    curves = segments(tip[:-1], tip[1:], axis[:-1], axis[1:])
    q = kin.inverse(tip, axis)[0]
    q[:, 3:] = np.unwrap(q[:, 3:], axis=0)
    got = linearise(Control(machine(name), "axes", np.zeros(3)), kin, curves, q[:-1], q[1:],
                    np.zeros(len(curves), dtype=bool), TIP, AXIS)
    assert len(got.q) == len(curves) and got.worst_tip < 2e-5

