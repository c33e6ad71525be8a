"""Blocks that end beside the curve: fewer of them within the same tolerance, by the tests' own matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.control.control import Control
from postproc.joints.joint_path import nearest_solution
from postproc.path.balanced import balanced
from postproc.path.linearise import CurvePieces, linearise
from tests.postproc.kit import angle, great_circle, machine, unit
from tests.postproc.path.test_linearise import dense_poses, lines
from toolpaths.shape import Curves

TIP, AXIS = 0.006, np.radians(0.5)
NAMES = ["mikron-ucp710", "trunnion-bc", "fork-head-ab"]


def turning(name: str, count: int = 24) -> tuple[Curves, np.ndarray, np.ndarray]:
    """A row of curves along a bend, the axis turning by some 4 degrees in each, and their joints."""
    s = np.linspace(0.0, 1.0, count + 1)
    tip = np.stack((40.0 * np.cos(s), 40.0 * np.sin(s), 4.0 * s), axis=1)
    axis = unit(np.stack((0.3 * np.cos(5.0 * s) + 0.2, 0.3 * np.sin(5.0 * s) + 0.5, np.ones(count + 1)), axis=1))
    kin = machine(name).kinematics
    q = [np.nan_to_num(kin.inverse(tip[:1], axis[:1])[0, 0])]
    for k in range(1, count + 1):
        q.append(nearest_solution(kin, tip[k:k + 1], axis[k:k + 1], q[-1][None])[0])
    joints = np.array(q)
    return lines(tip[:-1], tip[1:], axis[:-1], axis[1:]), joints[:-1], joints[1:]


def off(name: str, curves: Curves, made: CurvePieces, q0: np.ndarray) -> tuple[float, float]:
    """Largest distance of the tip from its line segment, and angle of the axis from the great circle near there."""
    worst, before = np.zeros(2), q0[0]
    for i, q in zip(made.curve.tolist(), made.q, strict=True):
        tip, axis = dense_poses(name, before, q)
        span = curves.end[i] - curves.start[i]
        u = np.clip((tip - curves.start[i]) @ span / (span @ span), 0.0, 1.0)
        worst[0] = max(worst[0], np.linalg.norm(tip - curves.start[i] - u[:, None] * span, axis=1).max())
        worst[1] = max(worst[1], angle(axis, great_circle(curves.axis0[i], curves.axis1[i], u)).max())
        before = q
    return float(worst[0]), float(worst[1])


@pytest.mark.parametrize("name", NAMES)
def test_fewer_blocks_within_the_same_tolerance(name: str) -> None:
    """Measured densely, and no further off than the bound that is stated; joints go on from block to block."""
    curves, q0, q1 = turning(name)
    m, still = machine(name), np.zeros(len(curves), dtype=bool)
    control = Control(m, "axes", np.zeros(3))
    plain = linearise(control, m.kinematics, curves, q0, q1, still, TIP, AXIS)
    made = balanced(control, m.kinematics, curves, q0, q1, ~still, TIP, AXIS, plain)
    assert len(made.curve) <= 0.85 * len(plain.curve)
    tip, axis = off(name, curves, made, q0)
    assert tip <= made.worst_tip <= TIP and axis <= made.worst_axis <= AXIS
    assert np.array_equal(made.q[-1], q1[-1]) and np.array_equal(np.unique(made.curve), np.arange(len(curves)))


def test_ends_stay_where_they_may_not_move() -> None:
    """Where a rapid or an arc comes next, and where the joints do not go on, the block ends on the curve."""
    curves, q0, q1 = turning("mikron-ucp710")
    m, movable = machine("mikron-ucp710"), np.ones(len(curves), dtype=bool)
    control = Control(m, "axes", np.zeros(3))
    movable[5] = False
    parted = q0.copy()
    parted[18] += 1e-4
    plain = linearise(control, m.kinematics, curves, parted, q1, ~movable, TIP, AXIS)
    arc = replace(curves, is_arc=np.arange(len(curves)) == 12)
    made = balanced(control, m.kinematics, arc, parted, q1, movable, TIP, AXIS, plain)
    last = dict(zip(made.curve.tolist(), made.q, strict=True))
    for curve in (4, 5, 11, 12, 17):
        assert np.array_equal(last[curve], q1[curve])
    assert np.array_equal(made.q[made.curve == 12], plain.q[plain.curve == 12])
    assert not np.array_equal(last[8], q1[8])


def test_words_of_the_tip_are_left() -> None:
    """The tip goes straight there: nothing bends."""
    curves, q0, q1 = turning("mikron-ucp710")
    m = machine("mikron-ucp710")
    control, free = Control(m, "tcp", np.zeros(3)), np.ones(len(curves), dtype=bool)
    plain = linearise(control, m.kinematics, curves, q0, q1, ~free, TIP, AXIS)
    assert balanced(control, m.kinematics, curves, q0, q1, free, TIP, AXIS, plain) is plain
