"""Linear Delta: identity over the workspace, both assembly modes, Jacobian, LinuxCNC's lineardeltakins."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.kinematics.legs.on_legs import OnLegs
from postproc.witness.machine import rods
from toolpaths.arrays import Floats

NAMES = [name for name in machines.names() if name.startswith("delta-")] + ["uranesx", "linuxcnc-lineardelta"]


def delta(name: str) -> OnLegs:
    kinematics = machines.load(name).kinematics
    assert isinstance(kinematics, OnLegs)
    return kinematics


def up(n: int) -> Floats:
    return np.tile([0.0, 0.0, 1.0], (n, 1))


def poses(kinematics: OnLegs, n: int, seed: int = 0) -> Floats:
    return kinematics.workspace.random(np.random.default_rng(seed), n)[0]


@pytest.mark.parametrize("name", NAMES)
def test_forward_of_inverse_is_identity_over_the_workspace(name: str) -> None:
    kinematics = delta(name)
    tip = poses(kinematics, 100_000)
    q = kinematics.inverse(tip, up(len(tip)))
    assert q.shape == (1, len(tip), 3)
    found, axis = kinematics.forward(q[0])
    assert np.abs(found - tip).max() < 1e-9
    np.testing.assert_array_equal(axis, up(len(tip)))


@pytest.mark.parametrize("name", NAMES)
def test_every_choice_of_roots_is_a_pose_of_the_machine(name: str) -> None:
    kinematics = delta(name).with_tool(40.0)
    every = replace(kinematics, all_roots=True)
    tip = poses(kinematics, 2000)
    q = every.inverse(tip, up(len(tip)))
    assert q.shape == (8, len(tip), 3) and every.branches == 8
    np.testing.assert_array_equal(q[0], kinematics.inverse(tip, up(len(tip)))[0])
    for branch in q:
        tips, _ = every.assembly_modes(branch)
        assert np.nanmin(np.linalg.norm(tips - tip, axis=2), axis=0).max() < 1e-6
        near, _ = every.forward(branch, np.hstack([tip, up(len(tip))]))
        assert np.abs(near - tip).max() < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_assembly_modes_close_the_rods_and_differ(name: str) -> None:
    kinematics = delta(name)
    q = kinematics.inverse(poses(kinematics, 2000), up(2000))[0]
    tips, _ = kinematics.assembly_modes(q)
    assert tips.shape == (2, 2000, 3)
    for tip in tips:
        length = np.linalg.norm(kinematics.loops.ends(tip, up(2000)) - kinematics.legs.feet(q), axis=2)
        np.testing.assert_allclose(length, np.broadcast_to(kinematics.legs.lengths, length.shape), atol=1e-8)
    assert np.linalg.norm(tips[0] - tips[1], axis=1).min() > 1.0


@pytest.mark.parametrize("name", NAMES)
def test_jacobian_is_the_derivative_of_forward(name: str) -> None:
    kinematics = delta(name)
    q = kinematics.inverse(poses(kinematics, 300), up(300))[0]
    h = 1e-3
    numeric = np.stack([(kinematics.forward(q + h * e)[0] - kinematics.forward(q - h * e)[0]) / (2 * h)
                        for e in np.eye(3)], axis=2)
    jacobian = kinematics.jacobian(q)
    np.testing.assert_allclose(jacobian[:, :3], numeric, atol=1e-7)
    assert not jacobian[:, 3:].any()
    np.testing.assert_array_equal(kinematics.twist_jacobian(q), jacobian)


def test_a_tilted_tool_axis_has_no_solution_and_z_is_nearest() -> None:
    kinematics = delta("uranesx")
    axis = np.array([[0.0, 0.0, 1.0], [0.0, 1e-6, 1.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [0.0, 0.0, 2.0]])
    q = kinematics.inverse(np.zeros((5, 3)), axis)
    assert np.isfinite(q[0, [0, 4]]).all() and np.isnan(q[0, 1:4]).all()
    np.testing.assert_array_equal(kinematics.nearest_axis(axis), up(5))


def test_out_of_reach_is_nan_both_ways() -> None:
    kinematics = delta("uranesx")
    assert np.isnan(kinematics.inverse(np.array([[2000.0, 0.0, 0.0]]), up(1))).all()
    tip, axis, spin = kinematics.pose(np.array([[0.0, 0.0, 4000.0]]))
    assert np.isnan(tip).all() and np.isnan(axis).all() and np.isnan(spin).all()
    assert np.isnan(kinematics.jacobian(np.array([[0.0, 0.0, 4000.0]]))[:, :3]).all()


def test_one_point_is_a_batch_of_one() -> None:
    kinematics = delta("delta-parallel-x")
    tip = poses(kinematics, 50)
    q = kinematics.inverse(tip, up(50))
    for i in range(50):
        np.testing.assert_array_equal(kinematics.inverse(tip[i : i + 1], up(1))[:, 0], q[:, i])


def test_lineardeltakins_positions_that_linuxcnc_commanded() -> None:
    """Joints of LinuxCNC 2.9's simulation at standstill, module lineardeltakins with its default pins."""
    kinematics = delta("linuxcnc-lineardelta")
    control = machines.load("linuxcnc-lineardelta").control_kinematics
    assert control is not None and control.pins == {"lineardeltakins.L": 269.0, "lineardeltakins.R": 130.25}
    tip = np.array([[30.0, -20.0, 25.5], [-60.0, -50.0, 120.0]])
    joints = np.array(LINUXCNC)
    np.testing.assert_allclose(kinematics.inverse(tip, up(2))[0], joints, atol=1e-6)
    np.testing.assert_allclose(kinematics.forward(joints)[0], tip, atol=1e-6)


LINUXCNC = ((246.601645177, 248.956816789, 277.430399179), (310.449304278, 383.333276593, 325.602676147))


@pytest.mark.parametrize(("text", "code", "words"), [
    ('base = "delta-star"\n[kinematics.workspace]\nz = [-200, 1200]', "machine.singular", "det Jx"),
    ('base = "uranesx"\n[kinematics.workspace]\nx = [-900, 900]', "machine.workspace", "does not reach"),
    ('base = "uranesx"\n' + "\n".join(f"[kinematics.legs.{x}]\nrods = [[0, 0, 50], [0, 0, -50]]" for x in "XYZ"),
     "machine.mobility", "three pairs"),
    ('base = "uranesx"\n[kinematics.legs.U]\nslide = [0, 0, 0]\ndirection = [0, 0, 1]\nrod = 9', "machine.geometry",
     "4 legs"),
    ('base = "uranesx"\n[control]\nmodule = "lineardeltakins"', "machine.control", "90, 210, 330"),
    ('base = "linuxcnc-lineardelta"\n[control]\nmodule = "genhexkins"', "machine.control", "not known"),
    ('base = "linuxcnc-lineardelta"\n[kinematics.legs.X]\nrod = 270', "machine.control", "one length"),
])
def test_a_machine_file_that_does_not_work_is_refused_with_the_reason(tmp_path: Path, text: str, code: str,
                                                                      words: str) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(text, encoding="utf-8")
    machine, diagnostics = machines.load_checked(file)
    assert machine is None
    assert diagnostics[0].code == code and words in diagnostics[0].message and diagnostics[0].lines


@pytest.mark.parametrize(("name", "ring"), [
    ("uranesx", "radius = 700\njoint_radius = 150\nrod = 1300\npair = 200\nrail_offset = 80\nrail_ends = [600, 1800]"),
    ("delta-cone", "radius = 650\nlean = 30\njoint_radius = 0\nrod = 1550"),
    ("delta-star", "radius = 0\nheight = 850\nlean = 90\njoint_radius = 0\nrod = 1500"),
    ("delta-parallel-z", "angles = [180, 300, 60]\nradius = 850\njoint_radius = 0\nrod = 1400"),
    ("linuxcnc-lineardelta", "angles = [90, 210, 330]\nradius = 130.25\njoint_radius = 0\nrod = 269"),
])
def test_a_ring_of_slides_is_the_machine_whose_legs_are_typed(name: str, ring: str, tmp_path: Path) -> None:
    """All but round-off, rods and rails too; the second witness reads the same legs."""
    text = (Path(machines.__file__).parent / "data" / f"{name}.toml").read_text("utf-8")
    head, legs = text.split("[kinematics.legs.X]")
    layout = f'[kinematics.layout]\nform = "star"\ndrive = "slide"\nletters = ["X", "Y", "Z"]\n{ring}\n\n'
    (tmp_path / "own.toml").write_text(head + layout + legs[legs.index("[kinematics.workspace]"):], encoding="utf-8")
    own, typed = (machines.load(one).kinematics for one in (tmp_path / "own.toml", name))
    assert isinstance(own, OnLegs) and isinstance(typed, OnLegs) and own.clearance and typed.clearance
    for what in ("points", "directions", "lengths", "roots"):
        np.testing.assert_allclose(getattr(own.legs, what), getattr(typed.legs, what), atol=1e-12)
    np.testing.assert_allclose(own.loops.joints, typed.loops.joints, atol=1e-12)
    for what in ("shift", "rail_offset", "rail_ends"):
        np.testing.assert_allclose(getattr(own.clearance, what), getattr(typed.clearance, what), atol=1e-12)
    read = rods({"kinematics": tomllib.loads(head + layout)["kinematics"]})
    np.testing.assert_allclose([leg[0] for _, _, leg, _, _ in read.legs], own.legs.points, atol=1e-12)
