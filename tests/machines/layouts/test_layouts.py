"""Layouts of annex C found again, and what is written of them loads; figures by closed forms."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
import machines.layouts.search as search
from machines.analysis.certify import Wanted, certify
from machines.analysis.transmission import condition_number, speed_transmission, worst
from machines.layouts.cranks import angles_at, crank_file, largest_angle, of_bars, of_cylinder
from machines.layouts.design import machine_file
from machines.layouts.search import LayoutFound, LayoutQuestion, best, figures_of, front
from postproc.cli.app import app

BOX = np.array([500.0, 500.0, 400.0])


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs that find enough for a test."""
    for name, value in (("RESTARTS", 1), ("ROUNDS", 12), ("CROWD", 6), ("GRID", (3, 3, 2))):
        monkeypatch.setattr(search, name, value)


ANNEX_C: dict[str, tuple[search.SlideLayout, dict[str, float], float]] = {
    "along x": ("parallel-x", {"y1": 900.0, "y2": 0.0, "y3": 900.0, "z1": 800.0, "z2": 1200.0, "z3": 800.0}, 1700.0),
    "along x, compact": ("parallel-x", {"y1": 850.0, "y2": -150.0, "y3": 500.0, "z1": 450.0, "z2": 950.0, "z3": 750.0},
                         1350.0),
    "along z": ("parallel-z", {"radius": 850.0}, 1400.0), "along z, compact": ("parallel-z", {"radius": 700.0}, 1350.0),
    "coplanar": ("coplanar", {"half": 800.0, "middle": 0.0, "height": 1000.0}, 1700.0),
    "star": ("star", {"height": 850.0}, 1500.0),
    "hybrid": ("hybrid", {"half": 600.0, "height": 350.0, "behind": 450.0}, 1200.0),
    "cone": ("cone", {"radius": 650.0}, 1550.0)}
LIMITS: dict[str, dict[search.Goal, float]] = {
    "along x": {"rod": 1700.0, "width": 1810.0}, "along x, compact": {"rod": 1350.0, "width": 1350.0},
    "along z": {"rod": 1400.0}, "along z, compact": {"rod": 1350.0, "bulk": 1212.5},
    "coplanar": {"rod": 1700.0, "width": 1600.0}, "star": {"rod": 1500.0}, "hybrid": {"rod": 1200.0, "width": 1200.0},
    "cone": {"rod": 1550.0, "bulk": 2500.0}}
"""rods and extents that annex C chose, mm"""
FILES = {"along x": "delta-parallel-x", "along x, compact": "delta-parallel-x-compact", "along z": "delta-parallel-z",
         "along z, compact": "delta-parallel-z-compact", "coplanar": "delta-coplanar", "star": "delta-star",
         "hybrid": "delta-hybrid", "cone": "delta-cone"}


@pytest.mark.parametrize("row", ANNEX_C)
def test_layouts_of_annex_c_have_the_condition_numbers_of_their_machine_files(row: str) -> None:
    """By code of its own: the contracted model here, the machine's kinematics there; at the corners and on faces."""
    layout, numbers, rod = ANNEX_C[row]
    found = figures_of(LayoutQuestion(layout, BOX, 1.0, "condition"), numbers, rod)
    m = machines.load(FILES[row])
    seen = worst(partial(condition_number, m.kinematics.transmits), m.kinematics.workspace, (5, 5, 3, 2))
    assert found["condition"] == pytest.approx(seen.value, rel=1e-6)


@pytest.mark.parametrize(("row", "along", "printed"), [
    ("along x", "y", 1800.0), ("along x, compact", "y", 1350.0), ("along z", "y", 1500.0), ("along z, compact", "y", 1200.0),
    ("coplanar", "y", 1600.0), ("star", "x", 2500.0), ("hybrid", "y", 1200.0), ("cone", "y", 2400.0)])
def test_extents_are_those_of_annex_c(row: str, along: str, printed: float) -> None:
    """Rounded to 100 mm (slides along x to 50), as printed."""
    layout, numbers, rod = ANNEX_C[row]
    asked = LayoutQuestion(layout, BOX, 1.0, "condition")
    slides = search.slides_of(asked, numbers)
    size = search.extents(slides, search.contracted(slides, rod, search.box_grid(asked))[1])
    assert size["xyz".index(along)] == pytest.approx(printed, abs=55.0)


def test_extent_and_speed_of_slides_along_z_in_closed_form() -> None:
    """Slides on a circle: sqrt(3) R apart; the flattest rod is that to the corner farthest from its slide."""
    found = figures_of(LayoutQuestion("parallel-z", BOX, 80.0, "condition"), {"radius": 850.0}, 1400.0)
    assert found["bulk"] == pytest.approx(np.sqrt(3.0) * 850.0)
    feet = 850.0 * np.array([[1.0, 0.0], [-0.5, np.sqrt(0.75)], [-0.5, -np.sqrt(0.75)]])
    corners = 250.0 * np.array([[a, b] for a in (-1, 1) for b in (-1, 1)])
    d = np.linalg.norm(corners[:, None] - feet, axis=2).max()
    assert found["speed"] == pytest.approx(1400.0 / np.sqrt(1400.0**2 - d**2))


@pytest.mark.parametrize("row", ["along x", "along z", "coplanar", "star", "hybrid", "cone"])
def test_a_machine_file_has_the_figures_of_its_search(row: str, tmp_path: Path) -> None:
    """It loads (its pairs hold the platform's turns), and its workspace is proved."""
    layout, numbers, rod = ANNEX_C[row]
    asked = LayoutQuestion(layout, BOX, 120.0, "condition")
    expected = figures_of(asked, numbers, rod)
    file = tmp_path / f"{layout}.toml"
    file.write_text(machine_file(asked, LayoutFound(numbers, rod, expected)), encoding="utf-8")
    m = machines.load(file)
    for key, measure in (("condition", condition_number), ("speed", speed_transmission)):
        found = worst(partial(measure, m.kinematics.transmits), m.kinematics.workspace, (5, 5, 3, 2))
        assert found.value == pytest.approx(expected[key], rel=1e-5)
    assert certify(m, Wanted(travel=True)).figures["travel_proved"]


def test_a_layout_that_is_singular_inside_or_out_of_reach_is_none() -> None:
    """det Jx has both signs in the box, though no place looked at has a condition number above 50."""
    numbers = {"ay": -700.0, "az": -400.0, "bx": -700.0, "bz": -700.0, "cx": 100.0, "cy": -500.0}
    asked = LayoutQuestion("perpendicular", BOX, 1.0, "condition")
    rods, _ = search.contracted(search.slides_of(asked, numbers), 1800.0, search.box_grid(asked))
    assert np.linalg.det(rods).min() < 0.0 < np.linalg.det(rods).max()
    assert np.isinf(figures_of(asked, numbers, 1800.0)["condition"])
    assert np.isinf(figures_of(LayoutQuestion("star", 4.0 * BOX, 1.0, "condition"), {"height": 900.0}, 1000.0)["condition"])


def test_limits_are_kept_or_nothing_is_found(short: None) -> None:
    asked = LayoutQuestion("parallel-z", BOX, 100.0, "condition", {"bulk": 1472.3})
    found = best(asked)
    assert found is not None and found.figures["bulk"] <= 1472.3 * (1 + 1e-6) and found.figures["condition"] < 2.6
    assert best(LayoutQuestion("parallel-z", BOX, 100.0, "condition", {"bulk": 200.0})) is None


def test_a_front_has_no_machine_that_another_beats_in_both(short: None) -> None:
    found = front(LayoutQuestion("parallel-z", BOX, 100.0, "condition", {"rod": 1800.0}), "bulk", 4)
    assert len(found) >= 3
    pairs = [(one.figures["condition"], one.figures["bulk"]) for one in found]
    assert not any(a < c and b < d for a, b in pairs for c, d in pairs)


def test_the_command_writes_a_machine_that_loads(short: None, tmp_path: Path) -> None:
    run, file, figure = CliRunner(), tmp_path / "d.toml", tmp_path / "f.svg"
    done = run.invoke(app, ["machine", "design", "--layout", "star", "--box", "400x400x300", "--max", "rod=1200", "--front",
                            "bulk", "-o", str(file), "--figure", str(figure), "--json", "-"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["rod_mm"] <= 1200.0 * (1 + 1e-6)
    assert found["condition_number"] <= found["condition_number_nowhere_more_than"]
    assert machines.load(file).axis_names == ("X", "Y", "Z") and figure.read_text("utf-8").startswith("<?xml")
    none = run.invoke(app, ["machine", "design", "--layout", "star", "--max", "bulk=100"])
    assert none.exit_code == 1 and "design.none" in none.stderr
    for words in (["--box", "5x5"], ["--front", "condition"], ["--figure", "a.svg"], ["--max", "weight=3"]):
        assert run.invoke(app, ["machine", "design", *words]).exit_code == 2


def test_cranks_are_sized_as_v_19_has_it(tmp_path: Path) -> None:
    """H 100, r 260, L 480 mm: b0 31.367 degrees (printed 31.4), D 420 mm, P at -200 and 510 mm (V-20)."""
    run, file = CliRunner(), tmp_path / "c.toml"
    words = ["machine", "design", "--layout", "rotary-delta", "--box", "1x1x100"]
    done = run.invoke(app, [*words, "--arm", "260", "--rod", "480", "-o", str(file), "--json", "-"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["beta0_deg"] == pytest.approx(31.367, abs=1e-3) and found["cylinder_diameter_mm"] == pytest.approx(420.0)
    assert [found["motor_out_mm"], found["motor_above_floor_mm"]] == pytest.approx([200.0, 510.0], abs=0.5)
    m = machines.load(file)
    assert m.kinematics.workspace.upper[0] == pytest.approx(210.0 / np.sqrt(2.0), abs=1e-3)
    for bad in (["--arm", "50", "--rod", "480"], ["--arm", "260", "--rod", "100"]):
        refused = run.invoke(app, [*words, *bad])
        assert refused.exit_code == 1 and "design.cranks" in refused.stderr
    assert run.invoke(app, [*words, "--arm", "260"]).exit_code == 2
    assert run.invoke(app, ["machine", "design", "--layout", "star", "--arm", "260"]).exit_code == 2
    assert run.invoke(app, [*words[:4], "--box", "100x100x200"]).exit_code == 1


def test_angles_of_cranks_are_those_of_the_machine(tmp_path: Path) -> None:
    """In the plane of leg B (30 degrees) the sine of b is the cosine between rod and arm; by the machine's own joints."""
    sizes = of_cylinder(600.0, 150.0)
    file = tmp_path / "c.toml"
    file.write_text(crank_file(sizes, 90.0), encoding="utf-8")
    m = machines.load(file)
    out = np.array([np.cos(np.pi / 6.0), 0.5, 0.0])
    x, z = np.linspace(-150.0, 150.0, 7), np.linspace(0.0, 150.0, 7)
    tip = x[:, None] * out + (z - 75.0)[:, None] * [0.0, 0.0, 1.0]
    q = m.kinematics.inverse(tip, np.tile([0.0, 0.0, 1.0], (7, 1)))[0]
    rods, arms = (m.kinematics.loops.ends(tip, np.broadcast_to(np.eye(3), (7, 3, 3))) - m.kinematics.legs.feet(q))[:, 1], \
        m.kinematics.legs.swung(q)[:, 1]
    sine = (rods * arms).sum(axis=1) / (sizes.rod * sizes.arm)
    np.testing.assert_allclose(np.abs(np.arcsin(sine)), np.abs(angles_at(sizes, -x, z)), atol=1e-6)
    assert largest_angle(sizes) <= largest_angle(of_bars(sizes.arm, 1.05 * sizes.rod, 150.0))


@pytest.mark.slow
@pytest.mark.parametrize("row", ANNEX_C)
def test_annex_c_found_again_from_scratch(row: str) -> None:
    """No worse than what annex C chose, within the same rods and extents, and with no other start than the search's own."""
    layout, numbers, rod = ANNEX_C[row]
    asked = LayoutQuestion(layout, BOX, 100.0, "condition", LIMITS[row])
    found = best(asked)
    assert found is not None and found.figures["condition"] <= figures_of(asked, numbers, rod)["condition"] * (1.0 + 1e-9)
