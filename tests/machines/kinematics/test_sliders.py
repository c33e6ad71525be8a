"""The leg law: rods keep their length, both roots, rates, singular measures."""

import numpy as np
import pytest

from machines.kinematics.sliders import Legs, platform_rates, smallest_singular_value, three_spheres


def some_legs(rng: np.random.Generator, k: int = 4) -> Legs:
    return Legs(rng.uniform(-500, 500, (k, 3)), rng.normal(size=(k, 3)), rng.uniform(900, 1200, k),
                rng.choice([-1.0, 1.0], k))


def test_rods_keep_their_length_with_every_root() -> None:
    rng = np.random.default_rng(1)
    legs = some_legs(rng)
    joints = rng.uniform(-300, 300, (500, 4, 3))
    q = legs.both(joints)
    assert q.shape == (16, 500, 4)
    for branch in q:
        rods = joints - legs.carriages(branch)
        np.testing.assert_allclose(np.linalg.norm(rods, axis=2),
                                   np.broadcast_to(legs.lengths, (500, 4)), atol=1e-9)


def test_own_roots_come_first_and_changed_ones_in_binary_order() -> None:
    rng = np.random.default_rng(2)
    legs = some_legs(rng)
    joints = rng.uniform(-300, 300, (50, 4, 3))
    q = legs.both(joints)
    np.testing.assert_array_equal(q[0], legs.inverse(joints))
    for b, branch in enumerate(q):
        signs = np.sign(legs.along(legs.carriages(branch) - joints))
        changed = (signs != legs.roots).astype(int)
        assert np.all(changed @ [1, 2, 4, 8] == b)
    assert np.all(legs.own(joints - legs.carriages(q[0])))
    assert not np.any(legs.own(joints - legs.carriages(q[5])))


def test_a_rod_too_short_makes_the_whole_row_nan() -> None:
    legs = Legs(np.zeros((3, 3)), np.eye(3), np.full(3, 100.0), np.ones(3))
    joints = np.array([[[0.0, 99.0, 0], [0, 0, 0], [0, 0, 0]], [[0.0, 101.0, 0], [0, 0, 0], [0, 0, 0]]])
    q = legs.inverse(joints)
    assert np.isfinite(q[0]).all() and np.isnan(q[1]).all()


def test_rates_are_the_derivative_of_the_inverse() -> None:
    rng = np.random.default_rng(3)
    legs = some_legs(rng, 3)
    tip = rng.uniform(-200, 200, (200, 3))
    offsets = rng.uniform(-50, 50, (3, 3))
    q = legs.inverse(tip[:, None] + offsets)
    rods = tip[:, None] + offsets - legs.carriages(q)
    rates = platform_rates(rods, legs.along(rods))
    h = 1e-4
    ahead, behind = ([legs.inverse((tip + s * e)[:, None] + offsets) for e in np.eye(3)] for s in (h, -h))
    numeric = (np.stack(ahead, axis=2) - np.stack(behind, axis=2)) / (2 * h)
    np.testing.assert_allclose(np.linalg.inv(rates), numeric, atol=1e-6)


def test_singular_measures() -> None:
    legs = Legs(np.zeros((3, 3)), np.eye(3), np.full(3, 100.0), np.ones(3))
    square = np.array([[[0.0, 100, 0], [0, 0, 100], [100, 0, 0]]])
    np.testing.assert_allclose(legs.transmission(square), 0.0)
    flat = np.array([[[100.0, 0, 0], [0, 100, 0], [60, 80, 0]]])
    assert smallest_singular_value(flat)[0] == pytest.approx(0.0, abs=1e-12)
    assert np.isnan(platform_rates(flat, legs.along(flat))).all()


def test_three_spheres_meet_in_two_points() -> None:
    rng = np.random.default_rng(4)
    centres = rng.uniform(-300, 300, (300, 3, 3))
    radii = np.array([700.0, 800.0, 900.0])
    foot, out = three_spheres(centres, radii)
    for point in (foot + out, foot - out):
        distance = np.linalg.norm(point[:, None] - centres, axis=2)
        met = np.isfinite(distance[:, 0])
        assert met.sum() > 200
        np.testing.assert_allclose(distance[met], np.broadcast_to(radii, (met.sum(), 3)), atol=1e-7)
    met = np.isfinite(foot[:, 0] + out[:, 0])
    assert np.all(np.linalg.det((foot + out)[met][:, None] - centres[met]) > 0)
