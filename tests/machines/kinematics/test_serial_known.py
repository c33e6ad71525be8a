"""Serial kinematics against what documents print and other programs compute."""

import numpy as np
import pytest

import machines

# LinuxCNC 2.9.0~pre1, motion simulated with its own modules at standstill: programmed tip (G43, tool 75.5 mm
# long) and joints X Y Z, A or B, C in mm and degrees; pins: offsets 20 and 10, rotation point 5, -3, 7.
XYZAC = [
    (-124.30525, -78.956848, 90.38234), (79.319416618, 147.114106293, 67.780148571, -44.40412, 209.861002),
    (24.648611, -121.761407, -20.061918), (-92.693072597, -7.455885437, -2.025793008, 53.18647, -63.6436),
    (-6.284611, -102.078326, 70.373145), (-26.950395428, -98.485587007, 41.379821259, 48.876258, -12.189646),
    (-115.898394, -32.631543, 5.022055), (123.093850671, -21.534021918, 139.199321887, -61.882607, -212.199258),
    (-20.811594, 26.039571, 71.351336), (-7.849164321, -51.826260968, 54.7096763, 72.575112, 119.055807),
    (136.880176, -64.739651, 44.564162), (-120.979627672, -75.184039458, 62.228526064, 34.683486, -124.81283),
]
XYZBC = [
    (-124.30525, -78.956848, 90.38234), (12.460303081, 127.253271549, 182.934080118, -44.40412, 209.861002),
    (24.648611, -121.761407, -20.061918), (-75.194577128, -73.330670929, 164.515913639, 53.18647, -63.6436),
    (-6.284611, -102.078326, 70.373145), (31.038382885, -97.461787832, 166.736609058, 48.876258, -12.189646),
    (-115.898394, -32.631543, 5.022055), (81.793988829, -42.348347437, 173.372229713, -61.882607, -212.199258),
    (-20.811594, 26.039571, 71.351336), (67.020316579, -39.666524855, 140.117521104, 72.575112, 119.055807),
    (136.880176, -64.739651, 44.564162), (-79.355047617, -76.029437482, 198.234851203, 34.683486, -124.81283),
]


@pytest.mark.parametrize(("name", "recorded"), [("linuxcnc-xyzac-trt", XYZAC), ("linuxcnc-xyzbc-trt", XYZBC)])
def test_equal_to_linuxcnc_at_standstill(name, recorded):
    k = machines.load(name).kinematics.with_tool(75.5)
    tip, q = np.array(recorded[0::2]), np.array(recorded[1::2])
    q[:, 3:] = np.radians(q[:, 3:])
    ours, axis = k.forward(q)
    np.testing.assert_allclose(ours, tip, rtol=0, atol=1e-6)
    slides = k.inverse(tip, axis)[:, :, :3]
    assert np.abs(slides - q[:, :3]).max(axis=2).min(axis=0).max() < 1e-6


def test_pins_of_linuxcnc_follow_from_the_geometry():
    ac = machines.load("linuxcnc-xyzac-trt").control_kinematics
    assert ac.module == "xyzac-trt-kins" and ac.tool_length_pin == "xyzac-trt-kins.tool-offset"
    assert {pin.split(".")[1]: value for pin, value in ac.pins.items()} == {
        "x-rot-point": 5, "y-rot-point": -3, "z-rot-point": 7, "y-offset": 20, "z-offset": 10}
    bc = machines.load("linuxcnc-xyzbc-trt").control_kinematics
    assert {pin.split(".")[1]: value for pin, value in bc.pins.items()} == {
        "x-rot-point": 5, "y-rot-point": -3, "z-rot-point": 7, "x-offset": 20, "z-offset": 10}


def test_mikron_tool_axis_and_rotation():
    """Grandguillaume, Lavernhe, Tournier 2017: axis (sinA sinC, -sinA cosC, cosA), tip Rz(C) Rx(A) (X, Y, Z)."""
    k = machines.load("mikron-ucp710").kinematics
    q = np.random.default_rng(1).uniform(-3, 3, (200, 5))
    a, c = q[:, 3], q[:, 4]
    tip, axis = k.forward(q)
    printed = np.stack([np.sin(a) * np.sin(c), -np.sin(a) * np.cos(c), np.cos(a)], 1)
    np.testing.assert_allclose(axis, printed, atol=1e-15)
    y, z = np.cos(a) * q[:, 1] - np.sin(a) * q[:, 2], np.sin(a) * q[:, 1] + np.cos(a) * q[:, 2]
    x = q[:, 0]
    expected = np.stack([np.cos(c) * x - np.sin(c) * y, np.sin(c) * x + np.cos(c) * y, z], 1)
    np.testing.assert_allclose(tip, expected, atol=1e-14)


def test_mikron_limits_in_internal_units():
    m = machines.load("mikron-ucp710")
    assert m.axis_names == ("X", "Y", "Z", "A", "C") and m.rotary == (False, False, False, True, True)
    np.testing.assert_allclose(m.limits.jerk, [5000, 5000, 5000, 10 * np.pi, 100 * np.pi])
    np.testing.assert_allclose(m.limits.acceleration[3:], 2 * np.pi * 0.83)
    np.testing.assert_allclose(m.limits.velocity, [500, 500, 500, np.pi / 2, 2 * np.pi / 3])
    np.testing.assert_allclose(m.limits.lower, [-355, -275, -250, -np.pi / 6, -np.inf])
    assert m.limits.assumed == {f"{letter}.travel" for letter in "XYZAC"}
    assert m.retract_axis == 2 and m.timing.tool_change == 6 and "clamp" in m.timing.assumed


def test_a_half_turn_of_the_nutating_axis_lays_the_tool_flat():
    k = machines.load("nutating-head").kinematics
    _, axis = k.forward(np.array([[0, 0, 0, np.pi, 0], [0, 0, 0, np.pi, np.pi / 2]]))
    np.testing.assert_allclose(axis, [[0, 1, 0], [-1, 0, 0]], atol=1e-15)


def test_head_machines_swing_the_tip_about_their_pivot():
    m = machines.load("head-table")
    k = m.kinematics.with_tool(100.0)
    tip, axis = k.forward(np.array([[0, 0, 0, np.pi / 2, 0.0]]))
    np.testing.assert_allclose(tip, [[-280, 0, 180]], atol=1e-12)
    np.testing.assert_allclose(axis, [[1, 0, 0]], atol=1e-15)
