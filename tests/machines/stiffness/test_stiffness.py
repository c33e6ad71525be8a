"""Forces by virtual work, stiffness in closed form, deflection of the exact geometry under springs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize
from typer.testing import CliRunner

import machines
from machines.dynamics.yielding import drive_moves
from machines.dynamics_models import AxisMassModel, BodyModel, DynamicsModel, StiffnessModel
from machines.stiffness.statics import Springs, compliance, drive_forces, force_rows, rod_forces, tip_stiffness
from machines.tolerances.influence import middle_of, poses_over
from machines.tolerances.report import rods_of
from postproc.cli.app import app

KINDS = ["uranesx", "rotary-delta", "hexapod", "hexaslide-cone", "h4a-c-table"]


@pytest.mark.parametrize("name", KINDS)
def test_drives_do_the_work_of_the_force(name: str) -> None:
    """g.dq + F.dx = 0 for every move of the drives: rates of the machine's own Jacobian; arms at their ends."""
    m = machines.load(name)
    rods, rng = rods_of(m), np.random.default_rng(0)
    poses = poses_over(rods.legs).part(slice(11, 14))
    force, point = rng.normal(size=3), rods.legs.gauge - [0.0, 0.0, 80.0]
    found = drive_forces(force_rows(rods, poses, point), force)
    q = rods.loops.drives.solve(rods.loops.ends(poses.place, poses.turn), rods.legs.roots)
    twist = rods.loops.rates(poses.place, poses.turn, q)
    moved = twist[:, :3] + np.cross(twist[:, 3:], (poses.turn @ point)[:, :, None], axis=1)
    np.testing.assert_allclose(found * rods.loops.drives.size, -np.einsum("nik,i->nk", moved, force), atol=1e-9)


@pytest.mark.parametrize("name", KINDS)
def test_rods_balance_the_force(name: str) -> None:
    rods = rods_of(machines.load(name))
    poses, point = poses_over(rods.legs).part(slice(0, 5)), rods.legs.gauge
    rows = force_rows(rods, poses, point)
    force = np.array([100.0, -40.0, 250.0])
    f = rod_forces(rows, force)
    np.testing.assert_allclose(np.einsum("nri,nr->ni", rows.rods, f), np.tile([*(-force), 0.0, 0.0, 0.0], (5, 1)), atol=1e-8)


def test_stiffness_of_uranesx_in_its_middle_in_closed_form() -> None:
    """Six rods of slope h / L, h = sqrt(L^2 - 550^2): along z 6 k (h / L)^2; across it less than 3 k (550 / L)^2, what they
    were if the platform could not turn."""
    rods = rods_of(machines.load("uranesx"))
    k, slope = 7e4, np.sqrt(1300.0**2 - 550.0**2) / 1300.0
    c = compliance(force_rows(rods, middle_of(rods.legs), np.zeros(3)), Springs(k))[0]
    own = np.linalg.inv(c)
    assert own[2, 2] == pytest.approx(6 * k * slope**2) and np.abs(own - np.diag(np.diag(own))).max() < 1e-6 * k
    assert own[0, 0] == pytest.approx(own[1, 1]) and own[0, 0] < 3 * k * (550 / 1300) ** 2
    rows = force_rows(rods, middle_of(rods.legs), np.zeros(3)).rods[0, :, :3]
    np.testing.assert_allclose(np.diag(k * rows.T @ rows)[:2], 3 * k * (550 / 1300) ** 2)
    drives = compliance(force_rows(rods, middle_of(rods.legs), np.zeros(3)), Springs(np.inf, drive=k))[0]
    assert np.linalg.inv(drives)[2, 2] == pytest.approx(3 * k, rel=1e-9)  # each slide bears a third, straight


def test_joints_yield_at_both_ends_of_a_rod() -> None:
    rods = rods_of(machines.load("hexapod"))
    rows = force_rows(rods, middle_of(rods.legs), rods.legs.gauge)
    np.testing.assert_allclose(compliance(rows, Springs(np.inf, joint=1e5)), compliance(rows, Springs(0.5e5)), rtol=1e-12)
    assert tip_stiffness(compliance(rows, Springs(1e5)))[0] < 6e5


@pytest.mark.parametrize("name", ["uranesx", "hexaslide-cone"])
def test_deflection_is_that_of_least_energy_of_the_exact_geometry(name: str) -> None:
    """Rods as springs between fixed drives, drives as springs: energy minimised over the platform's pose and the drives."""
    rods = rods_of(machines.load(name))
    poses, point = poses_over(rods.legs).part(slice(40, 41)), rods.legs.gauge - [0.0, 0.0, 50.0]
    place, turn, drives = poses.place[0], poses.turn[0], rods.loops.drives
    q = drives.solve(rods.loops.ends(poses.place, poses.turn), rods.legs.roots)[0]
    k, kd, force, lever = 2e5, 5e4, np.array([300.0, -200.0, 500.0]), 200.0

    def lengths(x: np.ndarray) -> np.ndarray:
        w = x[3:6] / lever
        angle = np.linalg.norm(w)
        over = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        now = (np.eye(3) + np.sinc(angle / np.pi) * over + 0.5 * np.sinc(0.5 * angle / np.pi) ** 2 * over @ over) @ turn
        c = place + turn @ point + x[:3] - now @ point
        shift = rods.shift @ turn  # as the platform holds it
        feet = drives.feet((q + x[6:])[None])[0][rods.leg] + rods.shift
        return np.linalg.norm(c + (rods.legs.joints[rods.leg] + shift) @ now.T - feet, axis=1)

    free = lengths(np.zeros(6 + len(q)))

    def energy(x: np.ndarray) -> float:
        return float(0.5 * k * ((lengths(x) - free) ** 2).sum() + 0.5 * kd * (x[6:] ** 2).sum() - force @ x[:3])

    found = minimize(energy, np.zeros(6 + len(q)), method="BFGS", options={"gtol": 1e-3})
    expected = compliance(force_rows(rods, poses, point), Springs(k, drive=kd))[0] @ force
    np.testing.assert_allclose(found.x[:3], expected, rtol=5e-3, atol=2e-5)


def test_the_command_gives_figures_and_a_map(tmp_path: Path) -> None:
    run, figure = CliRunner(), tmp_path / "s.svg"
    done = run.invoke(app, ["machine", "stiffness", "uranesx", "--rod", "100", "--drive", "80", "--force", "0,0,-500",
                            "--figure", str(figure), "--json", "-"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert 0.0 < found["deflection_um"]["worst"] <= 500.0 / found["stiffness_n_per_um"]["least"] * (1.0 + 1e-6)
    assert found["drive_force_n"]["largest"] != 0.0 and figure.read_text("utf-8").startswith("<?xml")
    assert run.invoke(app, ["machine", "stiffness", "uranesx", "--rod", "100", "--force", "1,2"]).exit_code == 2
    assert "sensitivity.legs" in run.invoke(app, ["machine", "stiffness", "mill-3axis", "--rod", "1"]).stderr


def test_drives_yield_under_part_and_tool_and_where_friction_reverses() -> None:
    """A trunnion with a part off its axis: the table turns by m g r / k, the head's slide sinks by its weight over its own
    k; twice the friction over k where an axis reverses."""
    m, g = machines.load("mikron-ucp710"), 9.80665
    axes = {name: AxisMassModel(friction=100.0 if name == "Z" else 0.0) for name in m.axis_names}
    model = DynamicsModel(part=BodyModel(mass=50.0, centre=(0.0, 200.0, 0.0)), tool=BodyModel(mass=8.0), axes=axes)
    m = replace(m, dynamics=model, stiffness=StiffnessModel(drive=40.0, turn=2.0))
    q = np.zeros((1, len(m.axis_names)))
    found = drive_moves(m, m.kinematics, q)
    assert found is not None
    line = next(joint for joint in m.kinematics.chain if joint.name == "A")
    arm = 200.0 - line.point[1]
    turn = 50.0 * g * arm * 1e-3 / 2.0e3 * (line.direction @ [1.0, 0.0, 0.0])
    tip = m.kinematics.jacobian(q)[0, :3]
    a, z = m.axis_names.index("A"), m.axis_names.index("Z")
    weighed = np.abs(found[0][0] + tip[:, z] * 8.0 * g / 40e3)
    np.testing.assert_allclose(weighed, np.abs(tip[:, a] * turn), atol=1e-12)
    assert found[1][0] == pytest.approx(2.0 * 100.0 / 40e3)
