"""One law, all machines: what every kinematics promises, over every file of the catalogue and kinds of others."""

import machines_under_law as law
import numpy as np
import pytest

import machines
from machines.kinematics.serial import Serial
from tests.machines.own_kinds import OWN

pytestmark = pytest.mark.parametrize("name", [*machines.names(), *OWN])


def test_forward_of_inverse_is_identity(name):
    m = law.machine(name)
    _, tip, axis = law.shared_poses(name, law.POOL, calm=False)
    branches = m.kinematics.inverse(tip, axis)
    assert branches.shape == (m.kinematics.branches, len(tip), m.kinematics.joints)
    assert np.isfinite(branches).any(axis=(0, 2)).all()
    for q in branches:
        real = np.isfinite(q).all(axis=1)
        again, direction = m.kinematics.forward(q[real], near=np.hstack([tip, axis])[real])
        worst = np.abs(np.hstack([again - tip[real], law.SCALE * (direction - axis[real])])).max(axis=1)
        beyond = worst > 1e-9
        if beyond.any():
            bound = law.tolerance(m, q[real][beyond], tip[real][beyond], axis[real][beyond])
            np.testing.assert_array_less(worst[beyond], bound)


def test_inverse_of_forward_contains_the_joints(name):
    m = law.machine(name)
    q, tip, axis = law.shared_poses(name, law.POOL, seed=2, calm=False)
    tip, axis = m.kinematics.forward(q, near=np.hstack([tip, axis]))
    found = law.gap(m, m.kinematics.inverse(tip, axis), q).max(axis=2).min(axis=0)
    beyond = found > 1e-9
    if beyond.any():
        bound = law.tolerance(m, q[beyond], tip[beyond], axis[beyond])
        np.testing.assert_array_less(found[beyond], bound)


def test_branches_are_joint_positions_that_the_inverse_gives_again(name):
    m = law.machine(name)
    _, tip, axis = law.shared_poses(name, 300, seed=3)
    for q in m.kinematics.inverse(tip, axis):
        found = law.gap(m, m.kinematics.inverse(*m.kinematics.forward(q, np.hstack([tip, axis]))), q)
        assert np.nanmax(np.nanmin(found.max(axis=2), axis=0)) < 1e-6


def test_rotary_joints_are_principal_values(name):
    m = law.machine(name)
    _, tip, axis = law.shared_poses(name, 600, seed=4)
    turned = m.kinematics.inverse(tip, axis)[..., np.array(m.rotary)]
    assert np.all((turned > -np.pi) & (turned <= np.pi))


def test_jacobian_equals_central_differences(name):
    m = law.machine(name)
    _, tip, axis = law.shared_poses(name, 200, seed=5)
    near = np.hstack([tip, axis])
    q = m.kinematics.inverse(tip, axis)[0]
    jacobian = m.kinematics.jacobian(q, near)
    assert jacobian.shape == (len(q), 6, m.kinematics.joints)
    for j, turns in enumerate(m.rotary):
        h = 1e-5 if turns else 1e-3
        step = np.zeros(m.kinematics.joints)
        step[j] = h
        ahead, behind = (np.hstack(m.kinematics.forward(q + s, near)) for s in (step, -step))
        difference = (ahead - behind) / (2 * h)
        real = np.isfinite(difference).all(axis=1)
        assert real.mean() > 0.95
        scale = np.maximum(1.0, np.abs(jacobian[real, :, j]).max(axis=1, keepdims=True))
        assert (np.abs(difference - jacobian[:, :, j])[real] / scale).max() < 1e-6


def test_slides_run_as_the_jacobian_has_them(name):
    """To the last bit, so that no program depends on which of them was asked; in any order, some of them, all joints."""
    m = law.machine(name)
    q, _, _ = law.shared_poses(name, 20, seed=8, calm=False)
    slides = np.flatnonzero(~np.array(m.rotary))
    for some in (slides, slides[::-1], slides[1:2], np.arange(m.kinematics.joints)):
        np.testing.assert_array_equal(m.kinematics.slide_directions(q, some), m.kinematics.jacobian(q)[:, :3][:, :, some])


def test_twist_agrees_with_the_jacobian(name):
    m = law.machine(name)
    _, tip, axis = law.shared_poses(name, 200, seed=6)
    near = np.hstack([tip, axis])
    q = m.kinematics.inverse(tip, axis)[0]
    jacobian, twist = m.kinematics.jacobian(q, near), m.kinematics.twist_jacobian(q, near)
    np.testing.assert_allclose(twist[:, :3], jacobian[:, :3], rtol=1e-12, atol=1e-12)
    turned = np.cross(twist[:, 3:], axis[:, :, None], axis=1)
    np.testing.assert_allclose(turned, jacobian[:, 3:], rtol=1e-10, atol=1e-10)


def test_a_batch_equals_its_points_one_by_one(name):
    m = law.machine(name)
    q, tip, axis = law.shared_poses(name, 8, seed=7)
    batch = m.kinematics.inverse(tip, axis)
    poses = m.kinematics.pose(q)
    rates = m.kinematics.jacobian(q)
    for i in range(len(q)):
        one = slice(i, i + 1)
        np.testing.assert_allclose(m.kinematics.inverse(tip[one], axis[one])[:, 0], batch[:, i],
                                   rtol=0, atol=1e-10)
        np.testing.assert_allclose(m.kinematics.jacobian(q[one])[0], rates[i], rtol=1e-10, atol=1e-10)
        for alone, together in zip(m.kinematics.pose(q[one]), poses, strict=True):
            np.testing.assert_allclose(alone[0], together[i], rtol=0, atol=1e-10)


def test_no_points_give_no_joints(name):
    k = law.machine(name).kinematics
    none = np.empty((0, 3))
    assert k.inverse(none, none).shape == (k.branches, 0, k.joints)
    assert k.forward(np.empty((0, k.joints)))[0].shape == (0, 3)


def test_the_tip_of_a_tool_lies_its_length_below_the_gauge_point(name):
    m = law.machine(name)
    _, tip, axis = law.shared_poses(name, 400, seed=8)
    long = m.kinematics.with_tool(123.5)
    assert long.tool_length == 123.5 and m.kinematics.tool_length == 0.0
    q = m.kinematics.inverse(tip, axis)
    np.testing.assert_allclose(long.inverse(tip - 123.5 * axis, axis), q, rtol=0, atol=1e-9)
    below, direction = long.forward(q[0], near=np.hstack([tip - 123.5 * axis, axis]))
    np.testing.assert_allclose(below, tip - 123.5 * axis, rtol=0, atol=1e-9)
    np.testing.assert_allclose(direction, axis, rtol=0, atol=1e-11)
    back = long.with_tool(0.0).forward(q[0], near=np.hstack([tip, axis]))[0]
    np.testing.assert_allclose(back, tip, rtol=0, atol=1e-9)


def test_every_value_of_a_free_joint_gives_the_same_pose(name):
    m = law.machine(name)
    k = m.kinematics
    _, tip, axis = law.shared_poses(name, 100, seed=9)
    q = k.inverse(tip, axis)[0]
    turning = k.twist_jacobian(q, np.hstack([tip, axis]))[:, 3:, np.array(m.rotary)]
    seen = 0
    for column in range(turning.shape[2]):
        for sign in (1.0, -1.0):
            along = sign * turning[:, :, column]
            free = k.inverse(tip, along)
            for b in range(k.branches):
                family = np.isfinite(free[b]).all(axis=1)
                family[family] = k.singular(free[b][family])
                seen += int(family.sum())
                for value in (-7.0, -3.0, 0.0, 0.4, 3.1):
                    near = np.full((int(family.sum()), k.joints), value)
                    member = k.inverse(tip[family], along[family], near=near)[b]
                    assert k.singular(member).all()
                    assert (member == value).any(axis=1).all()
                    again, direction = k.forward(member, near=np.hstack([tip, along])[family])
                    np.testing.assert_allclose(again, tip[family], rtol=0, atol=1e-9)
                    np.testing.assert_allclose(direction, along[family], rtol=0, atol=1e-11)
    if isinstance(k, Serial) and any(m.rotary):
        assert (seen > 0) == (k.reach()[0] < 1e-12 or k.reach()[1] > np.pi - 1e-12)


def test_nearest_axis_is_reachable_idempotent_and_keeps_what_is_in_reach(name):
    m = law.machine(name)
    k = m.kinematics
    wild = law.unit(np.random.default_rng(10).normal(size=(500, 3)))
    near = k.nearest_axis(wild)
    np.testing.assert_allclose(np.linalg.norm(near, axis=1), 1.0, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(k.nearest_axis(near), near)
    _, tip, axis = law.shared_poses(name, 500, seed=11)
    np.testing.assert_array_equal(k.nearest_axis(axis), axis)
    best = (near @ axis.T).max(axis=1)  # near must not be beaten by any direction the machine is known to take
    assert ((wild * near).sum(axis=1) >= (wild @ axis.T).max(axis=1) - 1e-9).all(), best.min()
    if k.straight_slides:
        assert np.isfinite(k.inverse(np.broadcast_to(tip[0], near.shape), near)).all()
        kept = (near == wild).all(axis=1)
        assert np.isnan(k.inverse(np.broadcast_to(tip[0], near.shape), wild)[:, ~kept]).all()


def test_home_lies_inside_the_travel_and_is_a_pose(name):
    m = law.machine(name)
    assert np.all((m.home >= m.limits.lower) & (m.home <= m.limits.upper))
    assert np.isfinite(np.hstack(m.kinematics.forward(m.home[None]))).all()


def test_joints_outside_the_loops_take_the_pose_along_in_its_mode(name):
    """However far they go at once: what is followed from block to block takes no steps for them."""
    m = law.machine(name)
    outside = ~np.array(m.kinematics.in_loops)
    if m.kinematics.transmits is None or not outside.any():
        return
    q, tip, axis = law.shared_poses(name, 20, seed=7)
    far = q + outside * np.where(m.rotary, 2.0, 300.0) * np.random.default_rng(7).uniform(-1.0, 1.0, q.shape)
    pose = m.kinematics.carried(np.hstack([tip, axis]), q, far)
    assert np.abs(pose[:, :3] - tip).max() > 20.0
    np.testing.assert_allclose(np.hstack(m.kinematics.forward(far, near=pose)), pose, rtol=0.0, atol=1e-7)
