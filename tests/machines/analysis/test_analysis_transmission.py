"""What the analysis gives: transmission, singularity, reachable box, tilt; printed figures are in tests/laws."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import machines
import machines.analysis.box as box
import machines.analysis.extremes as extremes
import machines.analysis.report as report
import machines.analysis.transmission as transmission
from machines.analysis.box import reachable_box, reached
from machines.analysis.directions import tilts
from machines.analysis.report import analyse
from machines.analysis.singularity import grid_step_that_proves
from machines.analysis.transmission import (
    condition_number,
    force_transmission,
    rates,
    speed_acceleration,
    worst,
)
from machines.kinematics.legs.on_legs import OnLegs
from machines.kinematics.legs.with_axis import LegsWithAxis
from postproc.cli.app import app


def delta(name: str) -> OnLegs:
    kinematics = machines.load(name).kinematics
    assert isinstance(kinematics, OnLegs)
    return kinematics


def test_worst_condition_number_of_a_compact_layout() -> None:
    """Table III-5 has 2.67, annex C 2.37; the other layouts are in tests/laws/test_acceptance.py."""
    kinematics = delta("delta-parallel-x-compact")
    found = worst(partial(condition_number, kinematics.transmits), kinematics.workspace)
    assert found.value == pytest.approx(2.67, rel=0.004)


def test_condition_number_is_that_of_the_jacobian() -> None:
    kinematics = delta("delta-hybrid")
    place, tilt = kinematics.workspace.random(np.random.default_rng(0), 200)
    q = kinematics.inverse(place, np.tile([0.0, 0.0, 1.0], (200, 1)))[0]
    jacobian = kinematics.jacobian(q)[:, :3]
    np.testing.assert_allclose(condition_number(kinematics.transmits, place, tilt), np.linalg.cond(jacobian), rtol=1e-9)
    np.testing.assert_allclose(rates(kinematics.transmits, place, tilt), jacobian, atol=1e-9)


@pytest.mark.parametrize("name", ["hexapod", "hexaslide-cone", "rotary-delta", "planar-delta-z"])
def test_legs_of_any_drive_transmit_as_their_jacobian_says(name: str) -> None:
    """Turns by the lever about the platform's reference point, arms by the path of their ends."""
    kin = delta(name)
    place, tilt = kin.workspace.random(np.random.default_rng(4), 20)
    place = place * kin.loops.basis[:3].any(axis=1)
    axis = np.stack([np.sin(tilt), 0.0 * tilt, np.cos(tilt)], axis=1)
    arm = kin.turn_of(axis, 0.0 * tilt) @ kin.gauge
    twist = kin.twist_jacobian(kin.inverse(place + arm, axis)[0])[:, :, kin.legs_at]
    twist[:, :3] -= np.cross(twist[:, 3:], arm[:, :, None], axis=1)
    twist[:, 3:] *= kin.transmits.lever
    own = twist[:, kin.loops.basis.any(axis=1)] / kin.legs.size
    widest = max(float(np.linalg.norm(a - b)) for a in kin.loops.joints for b in kin.loops.joints)
    assert kin.transmits.lever == (pytest.approx(0.5 * widest) if kin.loops.turns else 0.0)
    np.testing.assert_allclose(rates(kin.transmits, place, tilt), own, atol=1e-9)
    assert (condition_number(kin.transmits, place, tilt) >= 0.999999 * np.linalg.cond(own)).all()


def test_speed_acceleration_is_the_second_derivative_of_the_inverse() -> None:
    kinematics = delta("delta-cone")
    rng = np.random.default_rng(1)
    place, tilt = kinematics.workspace.random(rng, 20)
    direction = rng.normal(size=(4000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    bound = speed_acceleration(kinematics.on_rods, place, tilt)
    h, up = 0.1, np.tile([0.0, 0.0, 1.0], (4000, 1))
    for i in range(20):
        ahead, here, behind = (kinematics.inverse(place[i] + s * direction, up)[0] for s in (h, 0.0, -h))
        largest = np.abs(ahead - 2 * here + behind).max() / h**2
        assert largest == pytest.approx(bound[i], rel=5e-3)


def test_force_is_dual_to_speed() -> None:
    kinematics = delta("uranesx")
    place, tilt = kinematics.workspace.random(np.random.default_rng(2), 50)
    jacobian = rates(kinematics.transmits, place, tilt)
    force = np.random.default_rng(3).normal(size=(5000, 3))
    force /= np.linalg.norm(force, axis=1, keepdims=True)
    slides = np.abs(np.einsum("nij,mi->nmj", jacobian, force)).max(axis=(1, 2))
    np.testing.assert_allclose(force_transmission(kinematics.transmits, place, tilt), slides, rtol=5e-3)


def test_h4a_condition_number_stays_below_six() -> None:
    """V.7: 400 x 400 mm, 45 degrees in either direction, the turn divided by d = 100 mm."""
    kinematics = machines.load("h4a-c-table").kinematics
    assert isinstance(kinematics, LegsWithAxis) and kinematics.transmits.lever == pytest.approx(100.0)
    found = worst(partial(condition_number, kinematics.transmits), kinematics.workspace, (9, 2, 9, 9))
    assert 5.7 < found.value < 6.0 and found.least > 3.0


def test_worst_finds_a_maximum_inside_the_box() -> None:
    space = delta("uranesx").workspace
    peak = np.array([31.0, -77.0, 123.0])
    found = worst(lambda place, tilt: -np.linalg.norm(place - peak, axis=1), space)
    np.testing.assert_allclose(found.place, peak, atol=0.5)


def test_the_workspace_of_uranesx_is_proved_free_of_singular_points() -> None:
    kinematics = delta("uranesx")
    step = grid_step_that_proves(kinematics.on_rods, floor=100.0)
    assert step is not None and 1.0 < step <= 100.0
    assert grid_step_that_proves(kinematics.on_rods, floor=1000.0) is None


def test_a_rod_shorter_than_the_gap_has_no_constant_of_this_kind(tmp_path: Path) -> None:
    file = tmp_path / "short.toml"
    file.write_text('base = "delta-parallel-z-compact"\n[kinematics.legs.X]\nslide = [400, 0, 0]\nrod = 800\n')
    rods = machines.load(file).kinematics.on_rods
    assert rods is not None and grid_step_that_proves(rods, floor=0.0) is None


def test_the_command_proves_it_and_says_for_which_machines(few: None) -> None:
    def run(*words: str) -> Result:
        return CliRunner().invoke(app, ["machine", "analyse", *words, "--json", "-"])
    found = json.loads(run("uranesx", "--singular-above", "100").stdout)
    assert found["singular_values_above_mm"] == 100.0 and 1.0 < found["proved_by_grid_step_mm"] <= 100.0
    assert json.loads(run("uranesx", "--singular-above", "1000").stdout)["proved_by_grid_step_mm"] is None
    refused = run("mill-3axis", "--singular-above", "100")
    assert refused.exit_code == 1
    assert "analysis.singular" in refused.stderr and "leave --singular-above out" in refused.stderr
    assert run("mill-3axis").exit_code == 0


def test_reachable_box_is_the_largest_in_travel() -> None:
    machine = machines.load("uranesx")
    kinematics = delta("uranesx")
    shape = np.array([500.0, 500.0, 500.0])
    box = reachable_box(machine, kinematics.workspace.middle, shape)
    assert box is not None and box.upper[0] >= 249.0
    corners = np.stack(np.meshgrid(*zip(box.lower, box.upper, strict=True)), axis=-1).reshape(-1, 3)
    up = np.tile([0.0, 0.0, 1.0], (8, 1))
    assert reached(machine, corners * 0.999, up).all()
    assert not reached(machine, corners * 1.01, up).all()
    assert reachable_box(machine, np.array([0.0, 0.0, 9000.0]), shape) is None


def test_reachable_box_of_a_serial_machine_is_its_travel() -> None:
    found = analyse(machines.load("mill-3axis"))
    machine = machines.load("mill-3axis")
    for letter, lower, upper in zip("xyz", machine.limits.lower, machine.limits.upper, strict=True):
        np.testing.assert_allclose(found["reachable_box_mm"][letter], [lower, upper], atol=1e-3)


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few boxes and points: what more of them prove is in test_extremes_and_maps.py."""
    for module, name, value in ((report, "GRID", (3, 3, 3, 2)), (report, "COARSE", (2, 2, 2, 2)), (box, "POINTS", 3),
                                (box, "STEPS", 16), (extremes, "MOST", 20), (extremes, "START", 20),
                                (transmission, "ROUNDS", 2)):
        monkeypatch.setattr(module, name, value)


ALIKE = frozenset({"delta-coplanar", "delta-parallel-x-compact", "delta-parallel-z", "delta-parallel-z-compact",
                   "delta-perpendicular", "delta-star", "linuxcnc-lineardelta", "triaglide", "hexaslide-coplanar",
                   "hexaslide-parallel-z", "linuxcnc-xyzbc-trt", "mikron-ucp710"})
"""machines whose kind and number of axes another one has: they differ in figures"""


@pytest.mark.parametrize("name", [pytest.param(one, marks=pytest.mark.slow) if one in ALIKE else one
                                  for one in machines.names()])
def test_every_machine_is_analysed(name: str, few: None) -> None:
    """Unlimited axes included; the box is there for all that reach their middle with the tool as at home. Units stand in
    the keys of a report."""
    found = analyse(machines.load(name))
    assert found["axes"] == list(machines.load(name).axis_names)
    assert found["reachable_box_mm"] is not None or name == "linuxcnc-pentapod"  # no workspace of it is stated
    if name in ("uranesx", "h4a-c-table"):
        assert found["condition_number"]["worst"] > 1.0 and set(found["workspace_mm"]) == set("xyz")


@pytest.mark.parametrize(("name", "every", "largest"), [
    ("mill-3axis", 0.0, 0.0), ("mikron-ucp710", 120.0, 120.0), ("mill-4axis", 0.0, 180.0), ("uranesx", 0.0, 0.0),
    ("h4a-c-table", 45.0, 45.0), ("h4a-spindle-axis", 45.0, 60.0)])
def test_tilt_of_the_tool(name: str, every: float, largest: float) -> None:
    """Mikron: A to 120 degrees with C unlimited. H4a with B: tilt and B of 45 degrees, cos of both is 1/2."""
    assert tilts(machines.load(name)) == pytest.approx((every, largest), abs=0.5)  # the step of the grid
