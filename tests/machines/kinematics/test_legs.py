"""Platforms on legs: the older kinds as data, LinuxCNC's formulas, a note and a thesis; files that are refused."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import machines
from machines.kinematics.legs import drives
from machines.kinematics.legs.bounds import MovingLoops
from machines.kinematics.legs.loops import Loops
from machines.kinematics.legs.modes import found_modes
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from machines.kinematics.sliders import Legs
from machines.kinematics.workspace import Workspace
from machines.loader import load_checked
from postproc.readback.execution.assembly import steps
from tests.machines.random_slides import poses_over_workspace, random_slides
from tests.source import ROOT
from toolpaths.arrays import Floats
from toolpaths.rotations import rotation

UP = np.array([0.0, 0.0, 1.0])


@cache
def two_axes() -> OnLegs:
    """The planar Delta of the note without the slide that carries it."""
    text = (ROOT / "machines/data/planar-delta-z.toml").read_text()
    for table in ("kinematics.carriers.Z", "axes.Z"):
        start = text.index(f"[{table}]")
        text = text[:start] + text[text.index("\n[", start) + 1:]
    with TemporaryDirectory() as folder:
        file = Path(folder) / "planar.toml"
        file.write_text(text.replace('retract_axis = "Z"\n', ""))
        kinematics = machines.load(file).kinematics
    assert isinstance(kinematics, OnLegs) and kinematics.axis_names == ("A", "B")
    return kinematics


@cache
def legs(name: str) -> OnLegs:
    if name == "planar-delta":
        return two_axes()
    kinematics = machines.load(name).kinematics
    assert isinstance(kinematics, OnLegs)
    return kinematics


def on_slides(slides: Legs, joints: Floats, space: Workspace, freedoms: str) -> OnLegs:
    """A platform on the same slides, as data; reference point and gauge point are one."""
    k = len(joints)
    return OnLegs(Loops(drives.on_slides(slides), joints, tuple(freedoms)), space, np.zeros(3), tuple("XYZU"[:k]),
                  (False,) * k, np.arange(k), np.zeros(0, np.int64), np.zeros((0, 3)))


CLOSED = ("uranesx", "delta-cone", "delta-hybrid", "planar-delta-z", "rotary-delta", "planar-delta", "triaglide")


@pytest.mark.parametrize("name", CLOSED)
def test_closed_forms_are_what_newton_finds(name: str) -> None:
    """Both modes of a platform that does not turn close every rod, apart by the sign of det Jx; Newton ends in the first."""
    kin = legs(name).with_tool(70.0)
    q = random_slides(kin, np.random.default_rng(1), 300)
    tips, axes = kin.assembly_modes(q)
    carried = q[:, kin.carriers_at] @ kin.carriers + kin.gauge - 70.0 * UP
    own, turn = q[:, kin.legs_at], np.tile(np.eye(3), (300, 1, 1))
    start = tips[0] - carried + np.array([0.4, -0.3, 0.2]) * kin.loops.basis[:3].any(axis=1)
    place, _, closed = kin.loops.newton(own, start, turn)
    assert closed.all() and tips.shape == axes.shape == (2, 300, 3)
    np.testing.assert_allclose(place + carried, tips[0], rtol=0, atol=1e-9)
    sides = [kin.loops.side(tip - carried, turn, own) for tip in tips]
    assert (sides[0] * sides[1] < 0.0).all() and (sides[0] * sides[0][0] > 0.0).all()
    for tip in tips:
        rods = kin.loops.ends(tip - carried, turn) - kin.legs.feet(own)
        np.testing.assert_allclose(np.linalg.norm(rods, axis=2), kin.legs.spans(own), rtol=0, atol=1e-8)
        np.testing.assert_allclose(kin.forward(q, np.hstack([tip, axes[0]]))[0], tip, rtol=0, atol=1e-12)


def test_assembly_modes_of_the_planar_delta_are_the_two_of_the_note() -> None:
    """theta = 0, theta' = 180 degrees: F at (0, +-263.818) mm, from a base 345 mm below the origin; four working modes."""
    kin = legs("planar-delta")
    f = kin.assembly_modes(np.zeros((1, 2)))[0][:, 0] - kin.gauge + np.array([35.0, 345.0, 0.0])
    np.testing.assert_allclose(f, [[0.0, 263.818, 0.0], [0.0, -263.818, 0.0]], atol=1e-3)
    q = kin.with_all_roots().inverse(kin.gauge[None], UP[None])[:, 0]
    apart = np.linalg.norm(q[:, None] - q, axis=2)[~np.eye(4, dtype=bool)]
    assert len(q) == 4 and np.isfinite(q).all() and apart.min() > 0.1
    for joints in q:
        assert np.abs(kin.assembly_modes(joints[None])[0] - kin.gauge).max(axis=(1, 2)).min() < 1e-9


@pytest.mark.parametrize("name", ["hexapod", "hexaslide-parallel-z"])
def test_found_modes_of_six_legs_close_every_rod(name: str) -> None:
    kin = legs(name)
    q = machines.load(name).home[None]
    place, turn = found_modes(kin.loops, q[0, kin.legs_at], kin.home[0])
    own = np.tile(q[:, kin.legs_at], (len(place), 1))
    rods = kin.loops.ends(place, turn) - kin.legs.feet(own)
    assert len(place) >= 4
    np.testing.assert_allclose(np.linalg.norm(rods, axis=2), kin.legs.spans(own), atol=1e-8)
    tips, _ = kin.assembly_modes(q)
    np.testing.assert_array_equal(tips[0], kin.forward(q)[0])


def test_the_bounds_of_slides_are_those_of_any_drive() -> None:
    """And nearer: from the second derivative in the middle, where those of slides go by norms."""
    kin = legs("uranesx").with_tool(70.0)
    q = random_slides(kin, np.random.default_rng(1), 300)
    step = np.tile([3.0, -2.0, 4.0], (300, 1))
    place, turn = kin._platform(q + 0.5 * step)
    mine = MovingLoops(kin.loops, place, turn, q + 0.5 * step, step).jets().third
    theirs = np.asarray(kin.jets(q, q + step)[0].third)
    assert (mine <= theirs).all() and (mine > 0.1 * theirs).all()


def test_the_platform_of_an_h4_as_data_is_the_platform_of_the_h4() -> None:
    """Four slides, three translations and the tilt about x."""
    h4 = machines.load("h4a-c-table").kinematics
    assert isinstance(h4, LegsWithAxis)
    same = on_slides(h4.on_rods.legs, h4.platform.loops.joints, h4.workspace, "xyza")
    place, tilt = h4.workspace.random(np.random.default_rng(2), 200)
    q = h4.platform.inverse(np.column_stack([place, tilt]))
    axis = np.stack([0.0 * tilt, -np.sin(tilt), np.cos(tilt)], axis=1)
    np.testing.assert_allclose(same.inverse(place, axis)[0], q, rtol=0, atol=1e-10)
    found = same.forward(q)
    np.testing.assert_allclose(np.hstack(found), np.hstack([place, axis]), rtol=0, atol=1e-9)
    rates = h4.platform.rates(np.column_stack([place, tilt]), q)
    np.testing.assert_allclose(same.twist_jacobian(q)[:, :4], rates, rtol=0, atol=1e-9)


def test_lengths_of_a_hexapod_by_the_formula_of_genhexkins() -> None:
    """|tip + R a - b| of LinuxCNC's module, with R the least turn from z to the axis."""
    kin = legs("hexapod").with_tool(80.0)
    tip, axis = poses_over_workspace(kin, np.random.default_rng(3), 40)
    q = kin.inverse(tip, axis)[0]
    base, platform = (np.array([[r * np.cos(a), r * np.sin(a), h] for a in np.radians(angles)]) for r, h, angles in (
        (600.0, 1000.0, [-10, 10, 110, 130, 230, 250]), (250.0, 150.0 + 80.0, [-50, 50, 70, 170, 190, 290])))
    turn = np.cross(UP, axis)
    angle = np.arcsin(np.linalg.norm(turn, axis=1))
    for k in range(40):
        r = rotation(turn[k] / np.linalg.norm(turn[k]), angle[k : k + 1])[0]
        strut = np.linalg.norm(tip[k] + platform @ r.T - base, axis=1)
        np.testing.assert_allclose(q[k], strut - 750.0, rtol=0, atol=1e-9)


def test_spin_that_is_asked_for_turns_the_tool_about_itself_alone() -> None:
    kin = legs("hexapod").with_tool(80.0)
    tip, axis = poses_over_workspace(kin, np.random.default_rng(4), 50)
    q = kin.inverse(tip, axis, spin=0.1)[0]
    found = kin.pose(q)
    np.testing.assert_allclose(np.hstack(found[:2]), np.hstack([tip, axis]), rtol=0, atol=1e-9)
    np.testing.assert_allclose(found[2], 0.1, rtol=0, atol=1e-12)


def test_every_choice_of_roots_is_a_pose_of_the_machine() -> None:
    """64 of six slides, the own one first; each closes the same loops."""
    kin = replace(legs("hexaslide-cone"), all_roots=True)
    tip, axis = poses_over_workspace(kin, np.random.default_rng(5), 20)
    q = kin.inverse(tip, axis)
    assert q.shape == (64, 20, 6) and kin.branches == 64
    np.testing.assert_array_equal(q[0], legs("hexaslide-cone").inverse(tip, axis)[0])
    turn = kin.turn_of(axis, np.zeros(20))
    for branch in q:
        _, rods = kin.loops.matrix_at(tip - turn @ kin.gauge, turn, branch)
        np.testing.assert_allclose(np.linalg.norm(rods, axis=2), kin.legs.spans(branch), rtol=0, atol=1e-9)
    assert len({tuple(row) for row in np.sign(q[:, 0] - q[:, 0].mean(axis=0))}) == 64


def test_cranks_turn_the_platform_so_their_blocks_are_walked_in_small_steps() -> None:
    """Another mode cannot be mistaken for the one before: 3 degrees a step, of a table under the part none."""
    one = np.radians([[0.0, 30.0, 0.0]])
    assert steps(legs("planar-delta-z"), 0.0 * one, one, np.inf).tolist() == [10]
    table = machines.load("h4a-c-table").kinematics
    assert steps(table, np.zeros((1, 5)), np.array([[0.0, 0.0, 0.0, 0.0, 3.0]]), np.inf).tolist() == [1]


BASE = {"hexapod": 'base = "hexapod"\n', "delta": """description = "own"
[kinematics]
kind = "legs"
freedoms = ["x", "y", "z"]
[kinematics.layout]
form = "star"
drive = "slide"
letters = ["X", "Y", "Z"]
radius = 700
joint_radius = 150
rod = 1300
pair = 200
[kinematics.workspace]
x = [-250, 250]
y = [-250, 250]
z = [-250, 250]
[timing]
tool_change = 5
clamp = 0
unclamp = 0
""" + "".join(f"[axes.{letter}]\ntravel = [600, 1600]\nvelocity = 1\nacceleration = 1\njerk = 1\nhome = 1300\n"
              for letter in "XYZ")}


ARMS = BASE["delta"].replace('drive = "slide"', 'drive = "arm"\nangles = [-90, 150, 30]\narm = 350\nroot = -1').replace(
    'letters = ["X", "Y", "Z"]', 'letters = ["A", "B", "C"]').replace("radius = 700", "radius = 250").replace(
    "joint_radius = 150", "joint_radius = 80").replace("rod = 1300", "rod = 800").replace(
    "x = [-250, 250]\ny = [-250, 250]\nz = [-250, 250]", "x = [-200, 200]\ny = [-200, 200]\nz = [-800, -550]")
for old, new in zip("XYZ", "ABC", strict=True):
    ARMS = ARMS.replace(f"[axes.{old}]\ntravel = [600, 1600]", f"[axes.{new}]\ntravel = [-60, 110]").replace("1300\n", "0\n")


BASE["arms"] = ARMS


def faults(tmp_path: Path, text: str) -> list[str]:
    file = tmp_path / "own.toml"
    file.write_text(text)
    machine, found = load_checked(file)
    assert (machine is None) == bool(found)
    return [str(d) for d in found]


def test_a_layout_of_five_lines_is_the_delta_of_the_file(tmp_path: Path) -> None:
    """No line of Python knows the machine: UraneSX from radius, joint radius, rod and pair."""
    assert faults(tmp_path, BASE["delta"]) == []
    q = np.array([[1300.0, 1250.0, 1350.0]])
    own = machines.load(tmp_path / "own.toml")
    np.testing.assert_allclose(own.kinematics.forward(q)[0], machines.load("uranesx").kinematics.forward(q)[0], atol=1e-9)
    assert own.structure == "3 legs on slides, platform free in x y z (Gruebler 3)"


def test_a_rotary_delta_by_the_rules_of_rotarydeltakins(tmp_path: Path) -> None:
    """LinuxCNC's module: hips at R, the first at -y, thigh outwards at 0 and knee down positive, shin from knee to ankle."""
    assert faults(tmp_path, ARMS) == []
    kin = machines.load(tmp_path / "own.toml").kinematics
    assert isinstance(kin, OnLegs)
    tip, axis = poses_over_workspace(kin, np.random.default_rng(6), 100)
    q = kin.inverse(tip, axis)[0]
    out = np.array([[0.0, -1.0, 0.0], [-np.sqrt(0.75), 0.5, 0.0], [np.sqrt(0.75), 0.5, 0.0]])
    knee = (250.0 + 350.0 * np.cos(q)[:, :, None]) * out - 350.0 * np.sin(q)[:, :, None] * UP
    np.testing.assert_allclose(np.linalg.norm(tip[:, None] + 80.0 * out - knee, axis=2), 800.0, rtol=0, atol=1e-9)
    assert (np.linalg.norm(knee[..., :2], axis=2) > 250.0).all() and np.abs(kin.forward(q)[0] - tip).max() < 1e-9


def test_the_planar_delta_of_the_note() -> None:
    """theta = 0 and theta' = 180 degrees: F at (0, 263.818) mm, of both places the upper one; symmetric angles: x = 0."""
    kin = legs("planar-delta-z")
    f = kin.forward(np.radians([[0.0, 0.0, 0.0], [0.0, 20.0, -20.0]]))[0] - np.array([35.0 - 35.0, 75.0 - 345.0, 0.0])
    np.testing.assert_allclose(f[:, 0], 0.0, atol=1e-9)
    np.testing.assert_allclose(f[0, 1], 263.818, atol=1e-3)
    assert np.isnan(kin.inverse(f, np.tile([0.0, 0.1, 1.0], (2, 1)))).all()


@pytest.mark.parametrize(("of", "old", "new", "code", "words"), [
    ("delta", "pair = 200\n", "", "machine.mobility", "3 legs and 0 pairs of rods do not hold the platform everywhere"),
    ("delta", "joint_radius = 150", "joint_radius = 700", "machine.singular", "must keep its sign"),
    ("delta", "x = [-250, 250]", "x = [-250, 2500]", "machine.workspace", "a leg does not reach x 1125"),
    ("delta", '["x", "y", "z"]', '["x", "z", "b"]', "machine.geometry", "is none of x y, x y z"),
    ("delta", '["x", "y", "z"]', '["x", "y"]', "machine.geometry", "3 legs for 2 freedoms"),
    ("delta", '"slide"', '"arm"\narm = 300', "machine.workspace", "a leg does not reach x -250"),
    ("delta", '"slide"', '"screw"', "file.range", "screw"),
    ("delta", "[kinematics.workspace]", '[kinematics.carriers.V]\ndirection = [0, 0, 1]\n[kinematics.carriers.W]\n'
     "direction = [0, 0, -1]\n[kinematics.workspace]", "machine.geometry", "where one another move it already"),
    ("delta", "[kinematics.workspace]", "[kinematics.workspace]\ntilt = [5, 9]", "machine.geometry", "cannot be the tilt"),
    ("delta", "[kinematics.workspace]", "[kinematics.workspace]\ntilt = [0, 20]", "machine.geometry", "none without turns"),
    ("delta", "pair = 200", "pair = 200\nangles = [0, 90]", "machine.geometry", "angles: 2 values for 3 letters"),
    ("delta", "pair = 200", "pair = 200\naside = [10]", "machine.geometry", "aside: 1 values for 3 letters"),
    ("delta", "pair = 200", "pair = 200\narm = 333", "machine.geometry", "arm does not go with drive = 'slide'"),
    ("delta", '"slide"', '"arm"', "machine.geometry", "no length of the arms"),
    ("delta", "pair = 200", "pair = 200\nroot = -1", "machine.travel", "no place of the workspace has all legs inside"),
    ("arms", "root = -1", "root = 1", "machine.home", "the legs meet at no platform"),
    ("arms", "root = -1", "root = 1", "machine.travel", "no place of the workspace has all legs inside"),
    ("delta", "[kinematics]", "retract_axis = 'Z'\n[kinematics]", "machine.retract-axis", "take retract_axis out"),
    ("delta", "pair = 200", "pair = 0.01", "machine.mobility", "do not hold the platform"),
    ("delta", "pair = 200", "pair = 1e-9", "machine.geometry", "the two rods of leg X coincide"),
    ("delta", "rod = 1300", "rod = 1e300", "file.range", "allowed: less than 1e+06"),
    ("delta", '["x", "y", "z"]', '["x", "y", "z"]\ngauge = [0, 0, 1e200]', "file.range", "allowed: less than 1e+06"),
    ("delta", "[timing]", "[kinematics.clearance]\nrail_radius = 9\n[timing]", "machine.geometry", "no rail would be"),
    ("hexapod", "", "[kinematics.layout]\nlean = 40\n", "machine.geometry", "lean does not go with drive = 'length'"),
    ("hexapod", "", "[kinematics.workspace]\ntilt = [-9, 9]\n", "machine.geometry", "cannot be the tilt"),
    ("hexapod", "", "[kinematics.layout]\njoint_angles = [-10, 10, 110, 130, 230, 250]\n", "machine.singular", "det Jx"),
    ("hexapod", "", "[kinematics.legs.X]\ndrive = 'length'\npoint = [590, -104, 1000]\njoint = [160, -190, 0]\nrod = 750\n"
     "rods = [[0, 9, 0], [0, -9, 0]]\n", "machine.mobility", "the pair of rods stops a turn that freedoms"),
    ("hexapod", "", "[kinematics.legs.X]\ndrive = 'slide'\npoint = [590, -104, 1000]\njoint = [160, -190, 0]\nrod = 0\n"
     "direction = [0, 0, 2]\n", "machine.geometry", "has length 2, not 1"),
])
def test_what_does_not_go_together_is_refused(tmp_path: Path, of: str, old: str, new: str, code: str, words: str) -> None:
    text = BASE[of].replace(old, new) if old else BASE[of] + new
    found = faults(tmp_path, text)
    assert any(f"[{code}]" in one and words in one for one in found), found
