"""Serial machines with errors: against a second implementation, to second order, and in cases that one can draw."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import machines
from machines.geometric_error.actual.actual_serial import ActualSerial
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.actual.transforms import cross_matrix, homogeneous, inverse, turns
from machines.geometric_error.tables.curves import Polynomial, TableCurve
from machines.geometric_error.tables.names import parse
from machines.kinematics.serial import Serial
from tests.machines.error_models import joints, serial_errors
from toolpaths.arrays import Floats

NAMES = ("mikron-ucp710", "trunnion-bc", "head-table", "fork-head-ab", "nutating-head", "linuxcnc-xyzac-trt", "mill-4axis",
         "mill-3axis")
TOOL = 85.0


def kinematics(name: str) -> Serial:
    found = machines.load(name).kinematics.with_tool(TOOL)
    assert isinstance(found, Serial)
    return found


def screw(torsor: Floats, centre: Floats) -> Floats:
    """4 x 4 of one torsor about a point, turned x y z in moving frames, by scipy."""
    result = np.eye(4)
    result[:3, :3] = Rotation.from_euler("XYZ", torsor[3:]).as_matrix()
    result[:3, 3] = torsor[:3] + centre - result[:3, :3] @ centre
    return result


def dense(kin: Serial, errors: SerialErrors, q: Floats) -> tuple[Floats, Floats]:
    """Tip and axis of one q (J,): a product of 4 x 4 matrices, one point at a time."""
    chain = np.eye(4)
    for joint in kin.chain:
        x = q[kin.axis_names.index(joint.name)]
        own = "XYZABC".index(joint.name)
        zero = errors.constants.get(f"E{joint.name}0{joint.name}", 0.0) * (-1.0 if joint.direction[own % 3] < 0 else 1.0)
        motion = np.eye(4)
        if joint.rotary:
            motion[:3, :3] = Rotation.from_rotvec(joint.direction * (x + zero)).as_matrix()
            motion[:3, 3] = joint.point - motion[:3, :3] @ joint.point
        else:
            motion[:3, 3] = joint.direction * (x + zero)
        centre = np.asarray(errors.reference.get(joint.name, joint.point))
        place = screw(errors.location(joint.name), joint.point if joint.rotary else centre)
        motion = place @ motion @ np.linalg.inv(place)
        torsor = np.zeros(6)
        for c in errors.components:
            if c.name.axis == joint.name:
                torsor["XYZABC".index(str(c.name)[1])] += c.curve.at(np.array([x]))[0]
        error = screw(torsor, centre)
        fixed = joint.rotary and errors.frame.get(joint.name, "fixed") == "fixed"
        chain = chain @ (error @ motion if fixed else motion @ error)
    chain = chain @ screw(errors.location("S"), np.zeros(3))
    return chain[:3, 3] + chain[:3, :3] @ (-kin.tool_length * kin.tool_axis), chain[:3, :3] @ kin.tool_axis


@pytest.mark.parametrize("name", NAMES)
def test_a_second_implementation_agrees(name: str) -> None:
    kin = kinematics(name)
    errors, q = serial_errors(kin, 3), joints(kin, 25, 4)
    tip, axis, side = ActualSerial(kin, errors).place(q)
    for row, t, a in zip(q, tip, axis, strict=True):
        wanted_tip, wanted_axis = dense(kin, errors, row)
        assert t == pytest.approx(wanted_tip, abs=1e-10)
        assert a == pytest.approx(wanted_axis, abs=1e-13)
    assert np.abs(np.sum(side * axis, axis=1)).max() < 1e-14


@pytest.mark.parametrize("name", NAMES)
def test_zero_parameters_are_exactly_the_nominal_machine(name: str) -> None:
    kin, q = kinematics(name), joints(kinematics(name), 500)
    errors = serial_errors(kin)
    tip, axis, _ = ActualSerial(kin, errors.with_values(np.zeros(len(errors.names)))).place(q)
    nominal = kin.forward(q)
    assert np.array_equal(tip, nominal[0]) and np.array_equal(axis, nominal[1])


@pytest.mark.parametrize("name", NAMES)
def test_first_order_agrees_to_second_order(name: str) -> None:
    kin, q = kinematics(name), joints(kinematics(name), 200)
    errors, (tip, axis) = serial_errors(kin, 5), kin.forward(q)
    left = []
    for size in (8.0, 4.0, 2.0):
        actual = ActualSerial(kin, errors.with_values(size * errors.values))
        moved = actual.deviation(q, actual.errors.values)
        t, a, _ = actual.place(q)
        left.append([np.abs(t - tip - moved[:, :3]).max(), np.abs(a - axis - np.cross(moved[:, 3:], axis)).max()])
    assert np.array(left[0]) / left[1] == pytest.approx([4.0, 4.0], rel=0.02)
    assert np.array(left[1]) / left[2] == pytest.approx([4.0, 4.0], rel=0.02)
    assert left[2][0] < 1e-4 and left[2][1] < 1e-6


@pytest.mark.parametrize("name", ["mikron-ucp710", "nutating-head"])
def test_sensitivity_is_the_derivative_by_every_parameter(name: str) -> None:
    """Each parameter in one random combination of eight."""
    kin, q, step = kinematics(name), joints(kinematics(name), 7), 1e-5
    zero = serial_errors(kin).with_values(np.zeros(len(serial_errors(kin).names)))
    columns = ActualSerial(kin, zero).sensitivity(q)
    axis = kin.forward(q)[1]
    count, rng = len(zero.names), np.random.default_rng(2)
    for start in range(0, count, 8):
        some = np.arange(start, start + 8) * 7919 % count
        label, approach = [zero.names[k] for k in some], np.zeros(count)
        approach[some] = rng.choice([-1.0, 1.0], len(some)) * rng.uniform(0.5, 1.0, len(some))
        unit = approach * step
        up, down = (ActualSerial(kin, zero.with_values(sign * unit)).place(q) for sign in (1.0, -1.0))
        tip, turned = columns[:, :3] @ approach, np.cross(columns[:, 3:] @ approach, axis)
        assert (np.abs((up[0] - down[0]) / (2 * step) - tip) <= np.maximum(1e-6, 1e-6 * np.abs(tip))).all(), label
        assert (np.abs((up[1] - down[1]) / (2 * step) - turned) <= np.maximum(1e-8, 1e-6 * np.abs(turned))).all(), label


def test_cases_that_one_can_draw() -> None:
    kin, q = kinematics("mill-3axis"), np.array([[100.0, 50.0, -20.0]])
    nominal = kin.forward(q)[0][0]

    def moved(errors: SerialErrors) -> Floats:
        return ActualSerial(kin, errors).place(q)[0][0] - nominal

    straightness = SerialErrors((Component(parse("EYX"), TableCurve(np.array([0.0, 200.0]), np.array([0.0, 0.04]))),))
    assert moved(straightness) == pytest.approx([0.0, 0.02, 0.0], abs=1e-13)
    assert moved(SerialErrors(constants={"EC0Y": 1e-4})) == pytest.approx([-50.0 * 1e-4, 0.0, 0.0], abs=1e-6)
    pitch = SerialErrors((Component(parse("EBX"), Polynomial(np.array([1e-4]), (-500.0, 500.0))),))
    assert moved(pitch)[0] == pytest.approx((-20.0 - TOOL) * 1e-4, abs=1e-7)  # Abbe: the tip is below the reference
    lower = SerialErrors(pitch.components, reference={"X": np.array([0.0, 0.0, -20.0 - TOOL])})
    assert abs(moved(lower)[0]) < 1e-7


def test_place_of_a_rotary_axis_moves_nothing_at_zero_and_twice_at_half_a_turn() -> None:
    kin = kinematics("mikron-ucp710")
    actual = ActualSerial(kin, SerialErrors(constants={"EX0C": 0.03}))
    q = np.array([[10.0, 20.0, 30.0, 0.0, 0.0], [10.0, 20.0, 30.0, 0.0, np.pi]])
    assert actual.place(q)[0] - kin.forward(q)[0] == pytest.approx(np.array([[0, 0, 0], [0.06, 0, 0]]), abs=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_a_zero_position_is_a_constant_positioning_error(name: str) -> None:
    """Also where the axis counts against its machine axis (linuxcnc-xyzac-trt); not where it leans (nutating-head B)."""
    kin, q = kinematics(name), joints(kinematics(name), 40)
    for letter in kin.axis_names:
        joint = next(j for j in kin.chain if j.name == letter)
        if np.abs(joint.direction).max() < 1.0:
            continue
        constant = Component(parse(f"E{letter}{letter}"), Polynomial(np.array([3e-4]), (-1e3, 1e3)))
        for frame in ("fixed", "moving"):
            zero = SerialErrors(constants={f"E{letter}0{letter}": 3e-4}, frame={letter: frame})
            tip, axis, _ = ActualSerial(kin, zero).place(q)
            wanted = ActualSerial(kin, SerialErrors((constant,), frame={letter: frame})).place(q)
            assert np.abs(tip - kin.forward(q)[0]).max() > 1e-4
            assert tip == pytest.approx(wanted[0], abs=1e-10) and axis == pytest.approx(wanted[1], abs=1e-13)


def test_the_zero_of_a_nutated_axis_is_about_its_own_line() -> None:
    kin, q = kinematics("nutating-head"), joints(kinematics("nutating-head"), 20)
    tip, axis, _ = ActualSerial(kin, SerialErrors(constants={"EB0B": 2e-4})).place(q)
    wanted = kin.forward(q + 2e-4 * (np.array(kin.axis_names) == "B"))
    assert tip == pytest.approx(wanted[0], abs=1e-11) and axis == pytest.approx(wanted[1], abs=1e-14)


def test_a_series_stays_in_the_bed_or_turns_with_the_table() -> None:
    """The same radial error at C = 90 degrees: seen from the part it differs by the turn of the table."""
    kin, q = kinematics("mikron-ucp710"), np.array([[0.0, 0.0, 50.0, 0.0, np.pi / 2]])
    radial = (Component(parse("EXC"), TableCurve(np.array([-4.0, 4.0]), np.array([0.02, 0.02]))),)
    fixed = ActualSerial(kin, SerialErrors(radial)).place(q)[0] - kin.forward(q)[0]
    moving = ActualSerial(kin, SerialErrors(radial, frame={"C": "moving"})).place(q)[0] - kin.forward(q)[0]
    assert fixed[0] == pytest.approx([0.02, 0.0, 0.0], abs=1e-12)
    assert moving[0] == pytest.approx([0.0, 0.02, 0.0], abs=1e-12)


def test_the_transform_of_the_reference_entry_by_entry() -> None:
    """C 1.10 with entry (1, 2) put right, and 1.12's order."""
    a, b, c = 0.3, -0.2, 0.5
    torsor = np.array([[1.0, 2.0, 3.0, a, b, c]])
    (ca, sa), (cb, sb), (cc, sc) = ((np.cos(v), np.sin(v)) for v in (a, b, c))
    wanted = [[cb * cc, cc * sa * sb - ca * sc, ca * cc * sb + sa * sc, 1.0],
              [cb * sc, ca * cc + sa * sb * sc, ca * sb * sc - cc * sa, 2.0],
              [-sb, cb * sa, ca * cb, 3.0], [0.0, 0.0, 0.0, 1.0]]
    assert homogeneous(torsor, "zyx")[0] == pytest.approx(np.array(wanted), abs=1e-15)
    assert turns(torsor[:, 3:])[0] == pytest.approx(Rotation.from_euler("XYZ", [a, b, c]).as_matrix(), abs=1e-15)


def transport(transform: np.ndarray) -> np.ndarray:
    """Transport matrices (N, 6, 6): what a small torsor in frame j is, seen at and along frame k (C 1.25).

    Args:
        transform: (N, 4, 4), frame k in frame j, so coordinates in k to coordinates in j
    """
    turned = np.swapaxes(transform[:, :3, :3], 1, 2)
    result = np.zeros((len(transform), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = turned
    result[:, :3, 3:] = turned @ np.swapaxes(cross_matrix(transform[:, :3, 3]), 1, 2)
    return result


def test_transport_is_what_a_small_torsor_does_farther_down_the_chain() -> None:
    rng = np.random.default_rng(8)
    frame = homogeneous(rng.normal(size=(4, 6)))
    small = 1e-6 * rng.normal(size=(4, 6))
    moved = inverse(frame) @ homogeneous(small) @ frame
    wanted = np.einsum("nij,nj->ni", transport(frame), small)
    assert moved[:, :3, 3] == pytest.approx(wanted[:, :3], abs=1e-11)
    assert moved[:, [2, 0, 1], [1, 2, 0]] == pytest.approx(wanted[:, 3:], abs=1e-11)
