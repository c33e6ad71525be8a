"""`machine forces`, the dynamics of `machine analyse` and deflection, against other ways to the same numbers."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from machines.dynamics.limits import force_limits
from machines.dynamics.report import MotionAsked, dynamics_figures, forces_at, masses, needed
from machines.dynamics_models import AxisMassModel, BodyModel, DynamicsModel
from postproc.cli.app import app
from tests.machines.dynamics.heavy_machines import heavy
from toolpaths.diagnostics import DiagnosticError

UP = np.array([0.0, 0.0, 1.0])
MASSES = """
[dynamics.platform]
mass = 70
centre = [0, 0, 80]
[dynamics.axes.X]
mass = 70
rods = 20
force = 4000
[dynamics.axes.Y]
mass = 70
rods = 20
force = 4000
[dynamics.axes.Z]
mass = 70
rods = 20
force = 4000
[stiffness]
rod = 100
joint = 220
drive = 80
"""


def test_parts_add_up_to_the_motion_of_exact_joints() -> None:
    """Forces of joints that move as the inverse of the moving tip does, by differences of it."""
    m = heavy("hexapod")
    tip, v, a = np.array([30.0, -20.0, 10.0]) + machines.load("hexapod").kinematics.forward(m.home[None])[0][0], \
        np.array([300.0, 200.0, -100.0]), np.array([4000.0, -3000.0, 2000.0])
    found = forces_at(m, MotionAsked(tip, UP, v, a, np.array([100.0, 50.0, -400.0]), 0.0))
    h, inverse = 1e-4, m.kinematics.inverse
    before, here, after = (inverse((tip + s * h * v + 0.5 * (s * h) ** 2 * a)[None], UP[None])[0] for s in (-1.0, 0.0, 1.0))
    rate, faster = (after - before) / (2.0 * h), (after - 2.0 * here + before) / h**2
    motion = needed(m).forces(here, rate, faster)[0] + needed(m).drives.resisting(rate, faster)[0]
    push = -1e3 * np.array([100.0, 50.0, -400.0]) @ m.kinematics.jacobian(here)[0, :3]
    together = np.array([row["together"] for row in found["force_n_or_n_m"].values()])
    np.testing.assert_allclose(together, (motion + push) * 1e-3, rtol=0.0, atol=1e-4 * np.abs(together).max())


def test_rods_carry_what_massless_drives_give() -> None:
    """Without masses but the platform's, the motors give what the rods take along the slides: g = sum of f e.u."""
    m = machines.load("uranesx")
    axes = {name: AxisMassModel() for name in m.axis_names}
    m = replace(m, dynamics=DynamicsModel(platform=BodyModel(mass=50.0, centre=(20.0, 10.0, 90.0)), axes=axes))
    asked = MotionAsked(np.array([120.0, -80.0, -90.0]), UP, np.zeros(3), np.array([9000.0, 4000.0, -2000.0]),
                        np.array([0.0, 300.0, -200.0]), 110.0)
    found = forces_at(m, asked)
    q = np.array(list(found["joints"].values()))
    parts = m.kinematics.leg_parts
    assert parts is not None
    motion = m.kinematics.leg_motion(q[None], np.zeros((1, 3)), np.zeros((1, 3)))
    for k, (name, row) in enumerate(found["force_n_or_n_m"].items()):
        pair = sum(found["rod_force_n"][f"{name}{n}"] for n in (1, 2))
        assert row["together"] == pytest.approx(pair * float(motion.along[0, k, 2]), rel=1e-9)


def test_acceleration_that_the_motors_always_give_is_reached_and_not_passed() -> None:
    m = heavy("uranesx")
    assert m.dynamics is not None
    axes = {name: table.model_copy(update={"force": 5000.0}) for name, table in m.dynamics.axes.items()}
    m = replace(m, dynamics=m.dynamics.model_copy(update={"axes": axes}))
    most = dynamics_figures(m)["dynamics"]["tip_acceleration_by_forces_mm_per_s2"]["at_home"]
    limits = force_limits(m, m.kinematics)
    assert limits is not None
    q = m.home[None]
    back = np.linalg.inv(m.kinematics.jacobian(q)[0, :3])
    rng = np.random.default_rng(0)
    u = rng.normal(size=(4000, 3))
    u *= most / np.linalg.norm(u, axis=1, keepdims=True)
    use = limits.use(np.tile(q, (4000, 1)), np.zeros((4000, 3)), u @ back.T).max()
    assert 0.99 < use <= 1.0 + 1e-9
    own = masses(limits.dynamics, q)[0]
    np.testing.assert_allclose(own, own.T, rtol=1e-12)


def test_commands_print_forces_and_deflection(tmp_path: Path) -> None:
    file, setup, out = tmp_path / "mine.toml", tmp_path / "s.toml", tmp_path / "o.json"
    file.write_text('base = "uranesx"\n' + MASSES)
    text = Path("samples/delta.setup.toml").read_text()
    setup.write_text(text.replace("gauge_length = 120.0", "gauge_length = 120\ncutting_force = 800"))
    run = CliRunner().invoke(app, ["machine", "forces", str(file), "--acceleration", "10000,0,0", "--json", str(out)])
    assert run.exit_code == 0, run.output
    x = json.loads(out.read_text())["force_n_or_n_m"]["X"]
    assert x["share"] == pytest.approx(abs(x["together"]) / 4000.0)
    run = CliRunner().invoke(app, ["convert", "samples/pocket.cls", "-m", str(file), "-c", "linuxcnc", "--setup", str(setup),
                                   "-o", str(tmp_path / "o.ngc"), "--json", str(out)])
    assert run.exit_code == 0, run.output
    bent = json.loads(out.read_text())["deflection"]
    found = CliRunner().invoke(app, ["machine", "stiffness", str(file), "--rod", "100", "--joint", "220", "--drive", "80",
                                     "--tool", "120", "--json", str(out)])
    assert found.exit_code == 0, found.output
    least = json.loads(out.read_text())["stiffness_n_per_um"]
    assert 800.0 / least["largest"] <= bent["worst_um"] <= 800.0 / least["least"] and bent["tool"] == 1


@pytest.mark.parametrize(("table", "says"), [
    ("[dynamics.axes.Q]\nmass = 1\n", "no axis 'Q'"), ("[dynamics]\ndown = [0, 0, -2]\n", "length 2"),
    ("[dynamics.platform]\nmass = 1\n", "no platform"), ("[dynamics.axes.X]\nrods = 3\n", "rods is of legs"),
    ("[dynamics.axes.X]\nforce = 3\n", "moves no mass"), ("[stiffness]\nrod = 3\n", "rod is of machines with legs")])
def test_tables_that_the_machine_has_no_part_for_are_refused(tmp_path: Path, table: str, says: str) -> None:
    (tmp_path / "m.toml").write_text('base = "mill-3axis"\n' + table)
    with pytest.raises(DiagnosticError, match=says):
        machines.load(tmp_path / "m.toml")


def test_motor_that_cannot_hold_its_axis_is_refused(tmp_path: Path) -> None:
    """30 kg hang on 250 N: nothing is planned."""
    file = tmp_path / "m.toml"
    file.write_text('base = "mill-3axis"\n[dynamics.axes.Z]\nmass = 30\nforce = 250\n')
    run = CliRunner().invoke(app, ["convert", "samples/pocket.cls", "-m", str(file), "-c", "linuxcnc", "--feed", "planned",
                                   "-o", str(tmp_path / "o.ngc")])
    assert run.exit_code == 1 and "plan.force" in run.output and "motor of Z" in run.output


def test_shares_of_motors_in_steady_motion_and_while_all_axes_start(tmp_path: Path) -> None:
    """Of every choice of signs of the accelerations the largest is what is said; the summary of `convert` has both."""
    file = tmp_path / "u.toml"
    file.write_text('base = "uranesx"\n' + MASSES, encoding="utf-8")
    m = machines.load(file)
    kinematics = m.kinematics.with_tool(80.0)
    limits = force_limits(m, kinematics, 500.0)
    assert limits is not None and limits.names(m) == ("X", "Y", "Z")
    q = kinematics.inverse(np.array([[60.0, -40.0, -120.0]]), UP[None])[0]
    rate, most = np.array([[200.0, -100.0, 50.0]]), np.array([3000.0, 5000.0, 7000.0])
    steady, ramp = limits.loads(q, rate, most)
    force = needed(m).forces
    own = np.abs(force(q, rate, np.zeros_like(q)))[0] + 500e3 * np.linalg.norm(kinematics.jacobian(q)[0, :3], axis=0)
    np.testing.assert_allclose(steady[0], own / limits.limits)
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    seen = np.max([np.abs(force(q, np.zeros_like(q), (s * most)[None], 0.0))[0] for s in signs], axis=0)
    np.testing.assert_allclose(ramp[0], (own + seen) / limits.limits)
    samples = Path(__file__).parents[3] / "samples"
    done = CliRunner().invoke(app, ["convert", str(samples / "pocket.cls"), "-m", str(file), "-c", "linuxcnc", "--setup",
                                    str(samples / "delta.setup.toml"), "-o", str(tmp_path / "p.ngc"), "--json", "-"])
    found = json.loads(done.stdout)["motor_load"]
    assert 0.0 < found["steady"]["share"] < found["starting_and_stopping"]["share"] and found["steady"]["motor"] in "XYZ"
