"""Serial machines of any structure: random directions, points, order of axes; and where digits could get lost."""

from itertools import permutations

import numpy as np
import pytest

from machines.kinematics.chain import Joint
from machines.kinematics.frames import reference_x
from machines.kinematics.serial import Serial
from toolpaths.rotations import angle_between, rotation

X, Y, Z = np.eye(3)
SLIDES = (Joint("X", False, X), Joint("Y", False, Y), Joint("Z", False, Z))
S = np.sqrt(0.5)


def unit(rng, n=None):
    v = rng.normal(size=3 if n is None else (n, 3))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def random_machine(seed):
    """Skew slides anywhere between up to two skew rotary axes, the tool in any direction."""
    rng = np.random.default_rng(seed)
    turns = [Joint(name, True, unit(rng), rng.uniform(-300, 300, 3)) for name in "AB"[: seed % 3]]
    slides = [Joint(name, False, e + 0.2 * unit(rng)) for name, e in zip("XYZ", np.eye(3), strict=True)]
    chain = [(turns + slides)[i] for i in rng.permutation(len(turns) + 3)]
    names = tuple("XYZ") + tuple(t.name for t in turns)
    return Serial(tuple(chain), names, unit(rng)).with_tool(rng.uniform(0, 200)), rng


@pytest.mark.parametrize("seed", range(24))
def test_random_structures_keep_the_law(seed):
    k, rng = random_machine(seed)
    q = np.hstack([rng.uniform(-500, 500, (500, 3)), rng.uniform(-np.pi, np.pi, (500, k.joints - 3))])
    tip, axis = k.forward(q)
    found = k.inverse(tip, axis)
    rates = k.jacobian(q).copy()
    rates[:, 3:] *= 100.0
    rates[:, :, 3:] /= 100.0
    values = np.linalg.svd(rates, compute_uv=False)[:, : k.joints]
    fine = values[:, 0] < 1e4 * values[:, -1]  # slides apart by a rotary axis may become dependent
    assert fine.mean() > 0.9
    d = np.abs(found - q)
    d[..., 3:] = np.abs((d[..., 3:] + np.pi) % (2 * np.pi) - np.pi)
    assert d.max(axis=2).min(axis=0)[fine].max() < 1e-8
    for branch in found:
        again, direction = k.forward(branch)
        well = fine & (np.abs(branch).max(axis=1) < 1e5)
        assert np.abs(again - tip)[well].max() < 1e-8 and np.abs(direction - axis)[well].max() < 1e-12


@pytest.mark.parametrize("seed", range(12))
def test_moving_the_frame_moves_the_answer(seed):
    k, rng = random_machine(seed)
    turn = rotation(unit(rng), np.array([rng.uniform(0, 3)]))[0]
    moved = Serial(tuple(Joint(j.name, j.rotary, turn @ j.direction, turn @ j.point) for j in k.chain), k.axis_names,
                   turn @ k.tool_axis, k.tool_length)
    q = np.hstack([rng.uniform(-500, 500, (500, 3)), rng.uniform(-np.pi, np.pi, (500, k.joints - 3))])
    tip, axis = k.forward(q)
    tip_moved, axis_moved = moved.forward(q)
    np.testing.assert_allclose(tip_moved, tip @ turn.T, rtol=0, atol=1e-10)
    np.testing.assert_allclose(axis_moved, axis @ turn.T, rtol=0, atol=1e-12)
    twist = (turn @ k.twist_jacobian(q).reshape(-1, 2, 3, k.joints)).reshape(-1, 6, k.joints)
    np.testing.assert_allclose(moved.twist_jacobian(q), twist, rtol=0, atol=1e-10)


@pytest.mark.parametrize("seed", range(12))
def test_shifting_all_lines_and_the_part_is_shifting_the_gauge_point_back(seed):
    """tip' - d = motions(tip_0 - d): as far from the tip before as d is long, at every joint position."""
    k, rng = random_machine(3 * seed + 2)
    d = rng.uniform(-200, 200, 3)
    chain = tuple(Joint(j.name, j.rotary, j.direction, j.point + d) for j in k.chain)
    shifted = Serial(chain, k.axis_names, k.tool_axis, k.tool_length)
    q = np.hstack([rng.uniform(-500, 500, (100, 3)), rng.uniform(-np.pi, np.pi, (100, k.joints - 3))])
    tip, axis = k.forward(q)
    tip_shifted, axis_shifted = shifted.forward(q)
    np.testing.assert_allclose(axis_shifted, axis, rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(tip_shifted - d - tip, axis=1), np.linalg.norm(d), rtol=1e-10)
    along = ((tip_shifted - d - tip) * axis).sum(axis=1)
    np.testing.assert_allclose(along, -(d @ k.tool_axis), rtol=0, atol=1e-9)


def trunnion():
    return Serial((Joint("C", True, Z), Joint("A", True, X), *SLIDES), ("X", "Y", "Z", "A", "C"))


def nutating():
    head = Joint("C", True, Z, 200 * Z), Joint("B", True, np.array([0, S, S]), 200 * Z)
    return Serial((*SLIDES, *head), ("X", "Y", "Z", "B", "C"))


def skew_head():
    """Reach from 20 to 80 degrees: axes 50 degrees apart, tool 30 degrees from the second."""
    a, b = np.radians(50), np.radians(80)
    second, tool = np.array([np.sin(a), 0, np.cos(a)]), np.array([np.sin(b), 0, np.cos(b)])
    return Serial((*SLIDES, Joint("C", True, Z), Joint("B", True, second)), ("X", "Y", "Z", "B", "C"), tool)


def obtuse_head():
    """Axes 100 degrees apart, tool 120 degrees from the second: reach from 20 to 360 - 220 = 140 degrees."""
    a, b = np.radians(100), np.radians(220)
    second, tool = np.array([np.sin(a), 0, np.cos(a)]), np.array([np.sin(b), 0, np.cos(b)])
    return Serial((*SLIDES, Joint("C", True, Z), Joint("B", True, second)), ("X", "Y", "Z", "B", "C"), tool)


OFFSETS = np.concatenate([[0.0], 10.0 ** np.arange(-17.0, -0.5, 0.25)])


@pytest.mark.parametrize("make", [trunnion, nutating, skew_head, obtuse_head])
@pytest.mark.parametrize("end", [0, 1])
def test_no_digits_are_lost_near_the_singular_direction_and_the_edge_of_reach(make, end):
    k = make().with_tool(100.0)
    low, high = k.reach()
    polar = low + OFFSETS if end == 0 else high - OFFSETS
    for azimuth in (0.0, 1.0, -2.5):
        axis = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=1)
        tip = np.tile([300.0, -200.0, 100.0], (len(axis), 1))
        for q in k.inverse(tip, axis):
            again, direction = k.forward(q)
            assert np.abs(again - tip).max() < 1e-12 * 1000
            assert np.abs(direction - axis).max() < 2e-12, make.__name__
            well = OFFSETS > 1e-11
            assert angle_between(direction, axis)[well].max() < 2e-15


@pytest.mark.parametrize("make", [skew_head, obtuse_head])
def test_directions_just_out_of_reach_are_refused(make):
    k = make()
    tip = np.zeros((1, 3))
    for edge, sign in zip(k.reach(), (-1, 1), strict=True):
        for step, taken in ((3e-13, True), (1e-11, False), (0.1, False)):
            polar = edge + sign * step
            axis = np.array([[np.sin(polar), 0.0, np.cos(polar)]])
            assert np.isfinite(k.inverse(tip, axis)).all() == taken
            assert np.isfinite(k.inverse(tip, k.nearest_axis(axis))).all()


def test_tilted_tool_on_three_and_four_axes_is_refused():
    three = Serial(SLIDES, ("X", "Y", "Z"))
    four = Serial((Joint("A", True, X), *SLIDES), ("X", "Y", "Z", "A"))
    tilted = np.array([[1e-6, 0.0, 1.0]]) / np.hypot(1e-6, 1.0)
    for k in (three, four):
        assert np.isnan(k.inverse(np.zeros((1, 3)), tilted)).all()
        np.testing.assert_allclose(k.nearest_axis(tilted), [[0, 0, 1]], atol=1e-15)


def test_the_axis_need_not_be_of_length_one_but_must_have_one():
    k = trunnion()
    tip, axis = np.ones((2, 3)), np.array([[0.0, 3.0, 4.0], [0.0, 0.0, 0.0]])
    q = k.inverse(tip, axis)
    np.testing.assert_allclose(q[:, 0], k.inverse(tip, axis / 5.0)[:, 0], atol=1e-13)
    assert np.isnan(q[:, 1]).all()


def test_dependent_slides_have_no_solution():
    """X under the table C, Y and Z beyond it: at C = 90 degrees X and Y move the same path."""
    k = Serial((SLIDES[0], Joint("C", True, Z), Joint("A", True, X), SLIDES[1], SLIDES[2]),
               ("X", "Y", "Z", "A", "C"))
    q = k.inverse(np.ones((1, 3)), np.array([[0.6, 0.0, 0.8]]))
    assert np.isnan(q).all()


def test_order_of_the_branches():
    a = trunnion().inverse(np.zeros((1, 3)), np.array([[0.0, -0.6, 0.8]]))[:, 0, 3:]
    np.testing.assert_allclose(np.degrees(a), [[36.869897645844, 0], [-36.869897645844, 180]], atol=1e-10)


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_the_order_of_slides_side_by_side_is_of_no_matter(order):
    rng = np.random.default_rng(5)
    tip, axis = rng.uniform(-100, 100, (50, 3)), unit(rng, 50)
    k = trunnion()
    other = Serial((*k.chain[:2], *(SLIDES[i] for i in order)), k.axis_names)
    np.testing.assert_allclose(other.inverse(tip, axis), k.inverse(tip, axis), atol=1e-11)


def test_spin_is_measured_from_the_carried_x():
    k = trunnion()
    spin = k.pose(np.array([[0, 0, 0, 0, 0.5], [0, 0, 0, 0.7, 0.5]]))[2]
    np.testing.assert_allclose(spin, [0.5, 0.5], atol=1e-15)  # Rz(C) Rx(A): least tilt has no spin, so C is all


def test_reference_x_is_carried_by_the_least_rotation_also_near_minus_z():
    axis = np.vstack([unit(np.random.default_rng(3), 100), [[1e-9, 2e-9, -1.0], [0, 0, 1], [0, 0, -1]]])
    x = reference_x(axis)
    np.testing.assert_allclose(np.linalg.norm(x, axis=1), 1.0, rtol=0, atol=1e-14)
    np.testing.assert_allclose((x * axis).sum(axis=1), 0.0, rtol=0, atol=1e-14)
    turn = np.cross([0.0, 0.0, 1.0], axis)  # what lies along the axis of the least rotation stays
    np.testing.assert_allclose((x * turn).sum(axis=1), turn[:, 0], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(x[-1], [1, 0, 0])
