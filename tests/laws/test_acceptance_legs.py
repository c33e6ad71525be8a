"""Figures that documents print for machines on legs, by the core: symmetric H4 (V.6), six slides (annex F), 2D Delta.

Source: Company 2000, V-19, table V-33, annex F as corrected (chains at 0, 120, 240 degrees, A 50 mm inwards, Om 1 m above
the joints); note "Etude du Robot Delta 2D".
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest

import machines
from machines.analysis.transmission import condition_number
from machines.geometric_error.actual.leg_frame import LegFrame, leg_frame
from machines.kinematics.legs.drives import Drives
from machines.kinematics.legs.loops import FREEDOMS, Loops
from machines.kinematics.legs.on_legs import OnLegs
from toolpaths.arrays import Floats

Phi = tuple[int, ...]
PLACES = ((180, 225, 270), (270, 315, 0), (0, 45, 90), (90, 135, 180))
"""degrees that a motor of V-21 may stand at: away from the platform, by 45"""
PRINTED = {"B": (2.03, 19.12), "C": (2.22, 11.42), "E": (1.74, 6.71), "F": (1.81, 14.12), "G": (2.03, 9.07),
           "H": (1.40, 14.02), "I": (1.90, 5.69), "K": (1.83, 9.03)}
"""best and worst condition number in the cylinder: the rows of table V-33 that are known"""


def on_legs(name: str) -> OnLegs:
    kinematics = machines.load(name).kinematics
    assert isinstance(kinematics, OnLegs)
    return kinematics


def test_the_leg_of_a_rotary_delta_is_sized_by_the_angle_between_rod_and_arm() -> None:
    """V-19, H 100, r 260, L 480 mm: cos b - sin b = 1/3, b 31.367 degrees, so at both ends of a diameter of 420 mm."""
    angle = np.radians(31.367)
    x, z = -210.0 + 260.0 - 480.0 * np.sin(angle), 100.0 + 480.0 * np.cos(angle)
    np.testing.assert_allclose([x, z], [-200.0, 510.0], atol=0.5)  # V-20
    arm = Drives(np.array([[x, 0.0, z]]), np.array([[0.0, 1.0, 0.0]]), np.array([480.0]), np.array([1.0]),
                 np.array([[-260.0, 0.0, 0.0]]), np.array([False]), np.array([True]))
    ends = np.array([[[210.0, 0.0, 0.0]], [[-210.0, 0.0, 100.0]]])
    q = arm.solve(ends, arm.roots)
    between = np.degrees(np.arccos(np.abs(arm.transmission(ends - arm.feet(q), q))))
    np.testing.assert_allclose(between, 31.367, atol=1e-3 * 31.367)
    np.testing.assert_allclose(np.degrees(q[:, 0]), [-90.0, 0.0], atol=0.05)  # the arm down, the arm level


# ---- table V-33 --------------------------------------------------------------------------------------------


@cache
def cylinder() -> tuple[Floats, Floats]:
    """(places (N, 3) mm, turns (N,)): radius 160 mm, 410 to 510 mm below the motors, 45 degrees either way."""
    sides = np.linspace(0.0, 160.0, 6), np.radians(15.0) * np.arange(24), np.linspace(-50.0, 50.0, 6)
    r, a, z, turn = (x.ravel() for x in np.meshgrid(*sides, np.radians([-45.0, -22.5, 0.0, 22.5, 45.0])))
    return np.column_stack([r * np.cos(a), r * np.sin(a), z]), turn


def with_motors_at(phi: Phi) -> OnLegs:
    """The machine of the file with its motors at other angles (degrees), V-6 to V-8, V-21."""
    own, angle = on_legs("h4-rotary"), np.radians(phi)
    out = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    points = np.array([[-60.0, -45.0, 460.0], [60.0, -45.0, 460.0], [60.0, 45.0, 460.0], [-60.0, 45.0, 460.0]]) + 200.0 * out
    along = np.stack([-out[:, 1], out[:, 0], out[:, 2]], axis=1)
    return replace(own, loops=replace(own.loops, drives=replace(own.legs, points=points, directions=along)))


def v4_in_the_middle(kinematics: OnLegs) -> float:
    """V-4 of unit vectors."""
    place, turn, q = (part[None] for part in kinematics.home)
    rods = kinematics.loops.matrix_at(place, turn, q)[1][0] / 480.0
    w = np.cross(rods, kinematics.legs.directions)
    return float(np.cross(np.cross(w[0], w[1]), np.cross(w[2], w[3]))[2])


def mirrored(phi: Phi) -> set[Phi]:
    """The same machine seen in a mirror across x, across y, or both."""
    def across(one: Phi) -> Phi:
        return tuple((180 - one[i]) % 360 for i in (1, 0, 3, 2))

    along = tuple(-phi[i] % 360 for i in (3, 2, 1, 0))
    return {phi, across(phi), along, across(along)}


def test_arrangements_of_the_symmetric_h4() -> None:
    """81 ways, 27 that no mirror makes one, 15 of them whose platform turns about z in the middle: the 12 rows of table V-33
    and 3 that it lacks; the condition numbers of the rows that are known."""
    every = [tuple(phi) for phi in product(*PLACES)]
    own = {min(mirrored(phi)) for phi in every}
    good = [phi for phi in sorted(own) if abs(v4_in_the_middle(with_motors_at(phi))) > 1e-6]
    assert (len(every), len(own), len(good)) == (81, 27, 15)
    found = {}
    for phi in good:
        numbers = condition_number(with_motors_at(phi).transmits, *cylinder())
        found[phi] = (float(numbers.min()), float(numbers.max()))
    print("\n9: " + "\n".join(f"{phi}: {best:.3f} {worst:.3f}" for phi, (best, worst) in found.items()))
    for row, printed in PRINTED.items():
        near = [phi for phi, numbers in found.items() if np.abs(np.subtract(numbers, printed)).max() < 0.01]
        assert len(near) == 1, (row, near)
        assert row not in "EI" or near[0] in mirrored({"E": (180, 315, 45, 180), "I": (180, 270, 90, 180)}[row])


def test_configurations_i_and_e() -> None:
    """Number 9, to 0.01; i is the machine of the file, both pass the check of a machine file over all of the cylinder."""
    file = on_legs("h4-rotary")
    np.testing.assert_allclose(with_motors_at((180, 270, 90, 180)).legs.points, file.legs.points, atol=1e-9)
    for phi, printed in (((180, 270, 90, 180), (1.90, 5.69)), ((180, 315, 45, 180), (1.74, 6.71))):
        numbers = condition_number(with_motors_at(phi).transmits, *cylinder())
        assert (numbers.min(), numbers.max()) == pytest.approx(printed, abs=0.01)


# ---- annex F -----------------------------------------------------------------------------------------------


@cache
def six_slides() -> LegFrame:
    """F.2.1: R 279, r 107, h 100, L 348 mm, the point Om 1 m above the joints."""
    kinematics = on_legs("hexaslide-parallel-z")
    angle, side = np.radians([0.0, 0.0, 120.0, 120.0, 240.0, 240.0]), 100.0 * np.array([-1.0, 1.0] * 3)

    def ring(radius: float, z: float) -> Floats:
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([radius * c - side * s, radius * s + side * c, np.full(6, z)], axis=1)

    drives = replace(kinematics.legs, points=ring(279.0 - 50.0, 0.0), directions=np.tile([0.0, 0.0, 1.0], (6, 1)),
                     lengths=np.full(6, 348.0), roots=-np.ones(6))
    loops = Loops(drives, ring(107.0, -1000.0), FREEDOMS)
    return leg_frame(replace(kinematics, loops=loops, clearance=None, gauge=np.zeros(3)))


def sensitivity(place: Floats, turn: Floats) -> Floats:
    """(N, 6, P): mm and rad of Om per mm of each parameter."""
    frame = six_slides()
    loops = frame.machine.loops
    return frame.platform_sensitivity(loops.drives.solve(loops.ends(place, turn), loops.drives.roots), place, turn)


def test_sensitivity_matrix_of_annex_f() -> None:
    """Number 10: rows of F-16 in the middle; turns in rad per m."""
    found = sensitivity(np.array([[0.0, 0.0, 1400.0]]), np.eye(3)[None])[0].T * np.repeat([1.0, 1000.0], 3)
    names = six_slides().zero.names
    rows = {"X.rail.x": (0.3333, -0.8911, -0.0624, 1.2478, 0.0, 1.6667), "X.rail.y": (0.0,) * 6,
            "X.rail.z": (-0.8905, 2.3805, 0.1667, -3.3333, 0.0, -4.4524),
            "Y.rail.x": (0.3333, 0.8911, -0.0624, -1.2478, 0.0, -1.6667),
            "Y.rail.z": (-0.8905, -2.3805, 0.1667, 3.3333, 0.0, 4.4524),
            "Z.rail.x": (-0.3025, -0.3671, 0.0312, 0.3119, -0.5403, -0.8333),
            "Z.rail.y": (0.5240, 0.6359, -0.0540, -0.5403, 0.9358, 1.4434),
            "Z.rail.z": (-1.6164, -1.9614, 0.1667, 1.6667, -2.8868, -4.4524),
            "X1.length": (-0.9508, 2.5418, 0.1780, -3.5592, 0.0, -4.7541)}
    for name, printed in rows.items():
        sign = -1.0 if name.endswith("length") and found[names.index(name)][0] * printed[0] < 0.0 else 1.0
        np.testing.assert_allclose(sign * found[names.index(name)], printed, atol=1e-4, err_msg=name)


def test_largest_effect_of_a_slides_place_over_the_workspace() -> None:
    """Number 11: table F-2, Om within 50 mm along x, y, z, each angle within 3 degrees; 3 of its 5 levels each, which
    hold the largest."""
    grid = np.stack([x.ravel() for x in np.meshgrid(*[np.linspace(-1.0, 1.0, 3)] * 6, indexing="ij")], axis=1)
    turn = np.tile(np.eye(3), (len(grid), 1, 1))
    for k in (2, 1, 0):  # Rz Ry Rx
        angle, (i, j) = np.radians(3.0 * grid[:, 3 + k]), ((k + 1) % 3, (k + 2) % 3)
        one = np.tile(np.eye(3), (len(grid), 1, 1))
        one[:, i, i] = one[:, j, j] = np.cos(angle)
        one[:, j, i] = np.sin(angle)
        one[:, i, j] = -one[:, j, i]
        turn = turn @ one
    found = sensitivity(50.0 * grid[:, :3] + np.array([0.0, 0.0, 1400.0]), turn)[:, :, :3]
    place, turned = (np.linalg.norm(part, axis=1).max(axis=0) for part in (found[:, :3], 1000.0 * found[:, 3:]))
    np.testing.assert_allclose(place, [2.4812, 1.7646, 5.2422], atol=1e-4)
    np.testing.assert_allclose(turned, [3.9264, 2.1175, 6.3577], atol=1e-4)


# ---- 2D Delta ----------------------------------------------------------------------------------------------


def test_cranks_of_the_planar_delta() -> None:
    """Number 17: theta 0, theta' 180 degrees give F = (0, +-263.818) mm; x = 0 wherever theta' = 180 - theta."""
    kin = on_legs("planar-delta")
    angle = np.radians(np.array([0.0, -20.0, 13.0, 41.0]))
    places = kin.assembly_modes(np.stack([angle, -angle], axis=1))[0] - kin.gauge + np.array([35.0, 345.0, 0.0])
    np.testing.assert_allclose(places[:, 0], [[0.0, 263.818, 0.0], [0.0, -263.818, 0.0]], atol=1e-3)
    np.testing.assert_allclose(places[:, :, 0], 0.0, atol=1e-9)
