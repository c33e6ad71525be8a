"""Polytopes of tip rates: half-spaces against vertices, all machines."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import machines
from machines.loader import names
from machines.machine import Machine
from machines.polytope import box_vertices, held_axis_polytope, held_axis_rates
from toolpaths.arrays import Floats

NAMES = names()
RNG = np.random.default_rng(9)


def _poses(machine: Machine, count: int = 12) -> Floats:
    """Joints near home that the machine can stand at."""
    span = np.where(machine.rotary, 0.4, 20.0)
    q = machine.home + RNG.uniform(-1.0, 1.0, (count, len(span))) * span
    tip, axis = machine.kinematics.forward(machine.home[None, :])
    if machine.kinematics.straight_slides:
        return q
    tips = tip + RNG.uniform(-20.0, 20.0, (count, 3))
    solved = machine.kinematics.inverse(tips, np.tile(axis, (count, 1)))[0]
    return np.asarray(solved[np.isfinite(solved).all(axis=1)])


@pytest.mark.parametrize("name", [name for name in NAMES if machines.load(name).kinematics.plane is None])
def test_rates_move_the_tip_and_hold_the_axis(name: str) -> None:
    machine = machines.load(name)
    q = _poses(machine)
    rates = held_axis_rates(machine.kinematics, q)
    assert np.isfinite(rates).all()
    assert not rates[:, ~np.array(machine.kinematics.drives_tip)].any()
    step = 1e-5
    for i in range(3):
        here, there = (machine.kinematics.forward(q + s * step * rates[:, :, i]) for s in (-0.5, 0.5))
        assert np.abs((there[0] - here[0]) / step - np.eye(3)[i]).max() < 1e-6
        assert np.abs(there[1] - here[1]).max() < 1e-12


@pytest.mark.parametrize("name", NAMES)
def test_reach_is_where_a_joint_meets_its_limit(name: str) -> None:
    machine = machines.load(name)
    q = _poses(machine)
    direction = RNG.normal(size=(len(q), 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    for limit in (machine.limits.velocity, machine.limits.acceleration, machine.limits.jerk):
        polytope = held_axis_polytope(machine.kinematics, q, limit)
        reach = polytope.reach(direction)
        rates = np.einsum("nji,ni->nj", held_axis_rates(machine.kinematics, q), direction) * reach[:, None]
        use = np.abs(rates) / limit
        assert use.max(axis=1) == pytest.approx(np.ones(len(q)), rel=1e-12)
        assert (use.argmax(axis=1) == polytope.binding(direction)).all()


@pytest.mark.parametrize("name", NAMES)
def test_vertices_are_the_corners_of_the_half_spaces(name: str) -> None:
    """Brute force: each three planes meet in a point; those inside all half-spaces are the corners."""
    machine = machines.load(name)
    q = _poses(machine)[:3]
    polytope = held_axis_polytope(machine.kinematics, q, machine.limits.jerk)
    for k in range(len(q)):
        normals, offsets = polytope.normals[k], polytope.offsets[k]
        corners = []
        for rows in itertools.combinations(range(len(offsets)), 3):
            a = normals[list(rows)]
            if abs(np.linalg.det(a)) > 1e-9 * np.prod(np.linalg.norm(a, axis=1)):
                point = np.linalg.solve(a, offsets[list(rows)])
                if (normals @ point <= offsets * (1.0 + 1e-9)).all():
                    corners.append(point)
        found = polytope.vertices(k)
        far = np.linalg.norm(found[:, None] - np.array(corners)[None], axis=2)
        assert far.min(axis=1).max() < 1e-5 * np.abs(found).max()
        assert far.min(axis=0).max() < 1e-5 * np.abs(found).max()


def test_serial_vertices_are_the_turned_box() -> None:
    machine = machines.load("mikron-ucp710")
    q = np.array([[10.0, 20.0, 30.0, 0.7, -1.1]])
    found = held_axis_polytope(machine.kinematics, q, machine.limits.jerk).vertices()
    turned = box_vertices(machine.limits.jerk[:3]) @ machine.kinematics.jacobian(q)[0, :3, :3].T
    assert len(found) == 8
    assert np.linalg.norm(found[:, None] - turned[None], axis=2).min(axis=1).max() < 1e-6


def test_nothing_reaches_farther_than_an_aimed_vertex() -> None:
    machine = machines.load("mikron-ucp710")
    q = np.zeros((2000, 5))
    q[:, 3:] = RNG.uniform(-np.pi, np.pi, (2000, 2))
    reach = held_axis_polytope(machine.kinematics, q, machine.limits.jerk).reach(np.array([0.6, -0.48, 0.64]))
    assert reach.max() <= np.linalg.norm(machine.limits.jerk[:3]) * (1.0 + 1e-12)


def test_unbounded_and_missing_poses() -> None:
    machine = machines.load("mill-3axis")
    q = np.vstack([machine.home, np.full(3, np.nan)])
    polytope = held_axis_polytope(machine.kinematics, q, np.array([1.0, 2.0, np.inf]))
    assert polytope.reach(np.array([0.0, 0.0, 1.0]))[0] == np.inf
    assert np.isnan(polytope.reach(np.array([1.0, 0.0, 0.0]))[1])
    assert polytope.binding(np.array([0.0, 1.0, 0.0])).tolist() == [1, -1]
    with pytest.raises(ValueError, match="no bounded polytope"):
        polytope.vertices(0)
