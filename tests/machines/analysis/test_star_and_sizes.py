"""Curves against sizes, forces in rods among the measures, star diagrams: against closed forms and other code."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from machines.analysis.certify_chain import chain_of, rotary_ranges
from machines.analysis.chain import scaled_jacobian
from machines.analysis.chain_extreme import largest_condition
from machines.analysis.limits_of_box import extents
from machines.analysis.measures import studied
from machines.analysis.sizes import over_sizes
from machines.analysis.star import MachiningTask, star_of
from machines.analysis.transmission import condition_number, worst
from machines.certificate.spans import Span, spanned
from postproc.cli.app import app
from toolpaths.diagnostics import DiagnosticError

UP = np.array([0.0, 0.0, 1.0])


def test_the_curve_of_the_condition_number_has_the_machines_own_value() -> None:
    """At the rods and the radius of the file that of the file; a rod that does not reach gives none."""
    m = machines.load("uranesx")
    found = over_sizes(m, "condition", {"rod": (1100.0, 1500.0)})
    own = worst(partial(condition_number, m.kinematics.transmits), m.kinematics.workspace, (9, 9, 3, 4))
    assert found.largest[found.sizes[:, 0] == 1300.0][0] == pytest.approx(own.value, rel=1e-9)
    both = over_sizes(m, "condition", {"rod": (1100.0, 1500.0), "radius": (500.0, 900.0)})
    at = (both.sizes == [1300.0, 700.0]).all(axis=1)
    assert both.largest[at][0] == pytest.approx(own.value, rel=1e-9)
    short = over_sizes(m, "condition", {"rod": (300.0, 1300.0)})
    assert np.isnan(short.largest[0]) and np.isfinite(short.largest[-1])
    assert short.csv.splitlines()[0] == "rod_mm,least,largest,x_mm,y_mm,z_mm,tilt_deg"
    with pytest.raises(DiagnosticError, match="in reach with none"):
        over_sizes(m, "condition", {"rod": (100.0, 300.0)})


def test_forces_in_the_rods_balance_force_and_moment() -> None:
    """III-18 to III-22: six rods hold any wrench; a force of inertia off the middle is that force and its moment."""
    m = machines.load("uranesx")
    legs = studied(m, "rod-force")
    place, tilt = np.array([[80.0, -120.0, 30.0]]), np.zeros(1)
    kin = m.kinematics
    q = kin.inverse(place, UP[None])[0]
    ends = kin.rig(q).ends[0], kin.rig(q).carriages[0]
    e = ((ends[0] - ends[1]) / 1300.0)[legs.leg]
    b = ends[0][legs.leg] + legs.shift - place[0]
    t = np.column_stack([e, np.cross(b, e)])
    back = np.linalg.inv(t.T)
    assert legs.value("rod-force", place, tilt)[0] == pytest.approx(np.linalg.norm(back[:, :3], axis=1).max())
    assert legs.value("rod-moment", place, tilt)[0] == pytest.approx(1e3 * np.linalg.norm(back[:, 3:], axis=1).max())
    rng = np.random.default_rng(0)
    f = rng.normal(size=(20_000, 3))
    f /= np.linalg.norm(f, axis=1, keepdims=True)
    seen = np.abs(np.column_stack([f, np.cross(70.0 * UP, f)]) @ back.T).max()
    value = legs.resized(offset=70.0).value("rod-inertia", place, tilt)[0]
    assert seen <= value * (1.0 + 1e-12) and value == pytest.approx(seen, rel=0.01)


def test_measures_that_a_machine_has_not_are_refused() -> None:
    for name, measure in (("mikron-ucp710", "condition"), ("hexapod", "acceleration"), ("h4-rotary", "rod-force")):
        with pytest.raises(DiagnosticError, match=r"analysis\.map"):
            studied(machines.load(name), measure)


def test_a_star_of_a_delta_in_closed_form() -> None:
    """UraneSX without masses of its drives: no turn; the drive's speed is that of value 4; its force while accelerating is
    the mass times the largest column norm of J; R + L of the file."""
    m = machines.load("uranesx")
    task = MachiningTask(rapid=2000.0, tool_radius=0.0, drive_mass=0.0, platform_mass=100.0, acceleration=1000.0)
    found = star_of(m, task).figures
    assert found["speed_translating_m_per_s"] == pytest.approx(2.761, rel=1e-3) and found["speed_turning_m_per_s"] == 0.0
    assert found["radius_and_rod_m"] == pytest.approx(2.0)
    force = worst(partial(machines_force, m.kinematics.transmits), m.kinematics.workspace, (5, 5, 5, 2))
    assert found["drive_force_accelerating_n"] == pytest.approx(100.0 * force.value, rel=1e-3)
    twice = star_of(m, replace(task, rapid=4000.0)).figures
    assert twice["power_accelerating_w"] == pytest.approx(2.0 * found["power_accelerating_w"])
    assert star_of(m, task, 600.0).figures["speed_translating_m_per_s"] is None


def machines_force(transmits: object, place: np.ndarray, tilt: np.ndarray) -> np.ndarray:
    """Largest force of a drive per force on the platform (III.6.3)."""
    jx, along = transmits.loops_at(place, tilt, 0.0)
    return np.asarray(np.linalg.norm(np.linalg.inv(jx / along[:, :, None]), axis=1).max(axis=1))


def test_power_of_a_star_is_force_times_speed_of_a_hexaslide() -> None:
    """At the pose that the diagram names, by the machine's own Jacobian: virtual work of one cutting force and one speed."""
    m = machines.load("hexaslide-parallel-z")
    task = MachiningTask(tool=100.0, tool_radius=0.0)
    found = star_of(m, task)
    x, y, z, tilt, heading = found.at[2]
    axis = np.array([[np.sin(tilt) * np.cos(heading), np.sin(tilt) * np.sin(heading), np.cos(tilt)]])
    kin = m.kinematics.with_tool(100.0)
    tip = np.array([[x, y, z]]) + (kin.gauge[2] - 100.0) * axis
    j = kin.twist_jacobian(kin.inverse(tip, axis)[0])[0]
    a, b = np.linalg.qr(np.column_stack([axis[0], np.eye(3)]))[0][:, 1:3].T
    turned = np.linspace(0.0, 2.0 * np.pi, 721)
    across = np.sqrt(2.0) * 4500.0 * (np.cos(turned)[:, None] * a + np.sin(turned)[:, None] * b)
    push = np.concatenate([across + 4500.0 * axis[0], across - 4500.0 * axis[0]])
    most = np.abs(push @ j[:3]).max()
    assert 0.8 * most <= found.values[2] <= most * (1.0 + 1e-9)


def test_extents_are_those_of_annex_c() -> None:
    """1.8 m across slides along x; UraneSX: 700 mm less 150 mm, sqrt 3 apart."""
    assert extents(machines.load("delta-parallel-x"))["extents_of_the_contracted_model_mm"]["y"] == pytest.approx(1800.0)
    found = extents(machines.load("uranesx"))
    assert found["extents_mm"]["y"] == pytest.approx(700.0 * np.sqrt(3.0))
    assert found["extents_of_the_contracted_model_mm"]["y"] == pytest.approx(550.0 * np.sqrt(3.0))
    assert extents(machines.load("mill-3axis")) == {}


@pytest.mark.parametrize("name", ["mill-4axis", "nutating-head", "mikron-ucp710"])
def test_rates_of_a_chain_over_boxes_hold_at_every_position(name: str) -> None:
    m = machines.load(name)
    chain = chain_of(m, 0.0)
    order = [m.axis_names.index(joint.name) for joint in chain.joints]
    at = [m.axis_names.index(joint.name) for joint in chain.turns]
    slides = [m.axis_names.index(joint.name) for joint in chain.slides]
    rng = np.random.default_rng(3)
    low = rng.uniform(-1.5, 1.0, (40, len(at)))
    box = chain.rates(m.home[slides], Span(low, low + 0.2))
    q = np.tile(m.home, (40, 1))
    q[:, at] = low + rng.uniform(0.0, 0.2, low.shape)
    exact = m.kinematics.jacobian(q)[:, :, order]
    np.testing.assert_allclose(chain.rates(m.home[slides], spanned(q[:, at])).lo, exact, atol=1e-9)
    assert (box.lo <= exact + 1e-9).all() and (exact <= box.hi + 1e-9).all()


def test_the_condition_number_of_a_chain_is_proved() -> None:
    m = machines.load("mill-4axis")
    chain = chain_of(m, 0.0)
    slides = [m.axis_names.index(joint.name) for joint in chain.slides]
    found = largest_condition(chain, m.home[slides], rotary_ranges(m, chain, {}), 100.0)
    q = np.tile(m.home, (721, 1))
    q[:, m.axis_names.index("A")] = np.linspace(-np.pi, np.pi, 721)
    seen = np.linalg.cond(scaled_jacobian(m, q)).max()
    assert seen <= found.most <= 1.02 * found.value and found.value == pytest.approx(seen, rel=0.01)


def test_the_commands_draw_and_write(tmp_path: Path) -> None:
    run, csv, figure = CliRunner(), tmp_path / "a.csv", tmp_path / "a.svg"
    done = run.invoke(app, ["machine", "analyse", "uranesx", "--map", "rod-inertia", "--along", "rod=1100:1500", "--offset",
                            "50", "--csv", str(csv), "--figure", str(figure), "--json", "-"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["along"] == ["rod"] and figure.read_text("utf-8").startswith("<?xml")
    star = run.invoke(app, ["machine", "star", "uranesx", "--rod", "1200", "--rod", "1300", "--csv", str(csv), "--figure",
                            str(figure), "--json", "-"])
    assert star.exit_code == 0, star.output
    assert [one["machine"] for one in json.loads(star.stdout)["machines"]] == ["uranesx, L 1200", "uranesx, L 1300"]
    assert len(csv.read_text("utf-8").splitlines()) == 3
    for words in (["--along", "rod=5"], ["--along", "rod=9:5"], ["--along", "depth=1:2"],
                  ["--along", "rod=1:2", "--at", "z=0"]):
        assert run.invoke(app, ["machine", "analyse", "uranesx", "--map", "condition", *words]).exit_code == 2
    assert run.invoke(app, ["machine", "star", "mikron-ucp710"]).exit_code == 1
