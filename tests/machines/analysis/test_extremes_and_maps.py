"""Largest values with what they exceed nowhere; indices of chains; what ends a box; maps and curves."""

from __future__ import annotations

import csv
import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

import machines
from machines.analysis.box import Box
from machines.analysis.chain import chain_figures, indices, scaled_jacobian
from machines.analysis.extremes import CLOSE, MEASURES, largest_over, rates_over, slide_acceleration
from machines.analysis.limits_of_box import ends_of_box, least_margins
from machines.analysis.transmission import (
    condition_number,
    conditioning_factor,
    force_transmission,
    manipulability,
    rates,
    speed_acceleration,
    speed_transmission,
    worst,
)
from postproc.cli.app import app
from toolpaths.drawing import level

SAME = {"condition_number": condition_number,
        "speed_transmission": speed_transmission, "force_transmission": force_transmission, "manipulability": manipulability,
        "conditioning_lost": lambda transmits, place, tilt: 1.0 / conditioning_factor(transmits, place, tilt)}


@pytest.mark.covering
@pytest.mark.parametrize("key", MEASURES)
@pytest.mark.parametrize("name", ["uranesx", "rotary-delta", "planar-delta-z", "hexaslide-coplanar"])
def test_nothing_found_by_other_code_is_above_what_is_proved(name: str, key: str) -> None:
    """Grid with refinement and random places, by the kinematics of the machine."""
    kin = machines.load(name).kinematics
    close = CLOSE if kin.leg_geometry.turns != "abc" else 1.0
    found = largest_over(rates_over(kin.leg_geometry, kin.transmits.lever), MEASURES[key], close)
    grid = worst(partial(SAME[key], kin.transmits), kin.workspace, (5, 5, 5, 3))
    place, tilt = kin.workspace.random(np.random.default_rng(0), 500)
    assert grid.value <= found.most * (1.0 + 1e-9) and SAME[key](kin.transmits, place, tilt).max() <= found.most
    if kin.leg_geometry.turns != "abc":
        assert found.value == pytest.approx(grid.value, rel=0.01) and found.most <= 1.0101 * found.value


@pytest.mark.parametrize("name", ["delta-hybrid", "tilting-arms-c-table", "hexapod", "h4-rotary"])
def test_bounds_of_a_box_hold_all_over_it_and_close_twice_as_fast(name: str) -> None:
    """Boxes by chance, places by chance inside: no measure is above its bound; half the box, half the distance and less."""
    kin, rng = machines.load(name).kinematics, np.random.default_rng(3)
    over = rates_over(kin.leg_geometry, kin.transmits.lever)
    lower, upper = over.ends
    middle, half = rng.uniform(lower, upper, (40, 5)), 0.02 * (upper - lower)
    excess = {key: np.zeros(2) for key in MEASURES}
    for k, size in enumerate((1.0, 0.5)):
        made = over.boxes(middle - size * half, middle + size * half)
        places = (middle + size * half * rng.uniform(-1.0, 1.0, (30, 40, 5))).reshape(-1, 5)
        inside = over.boxes(places, places)
        for key, measure in MEASURES.items():
            at = measure.value(made.middle)
            with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
                most = np.where(made.e < 1.0, measure.most(at, made.middle, made.spread), np.inf)
            assert (measure.value(inside.middle).reshape(30, 40) <= most * (1.0 + 1e-12)).all(), key
            good = np.isfinite(most)
            excess[key][k] = np.median((most / at - 1.0)[good])
    assert all(small < 0.55 * large for large, small in excess.values())


def test_speed_of_uranesx_is_that_of_its_flattest_rod() -> None:
    """A Delta on parallel slides: largest row norm of J^-1 = L / sqrt(L^2 - d^2), d to the farthest foot (row 4)."""
    kin = machines.load("uranesx").kinematics
    found = largest_over(rates_over(kin.leg_geometry, 0.0), MEASURES["speed_transmission"])
    feet = kin.legs.points[:, :2] - kin.loops.joints[:, :2]
    corners = np.array([[x, y] for x in (-250.0, 250.0) for y in (-250.0, 250.0)])
    d = np.linalg.norm(corners[:, None] - feet, axis=2).max()
    assert found.value == pytest.approx(1300.0 / np.sqrt(1300.0**2 - d**2), rel=1e-12)
    assert 2.0 * found.value == pytest.approx(2.761, rel=1e-3)


@pytest.mark.parametrize("name", ["uranesx", "delta-hybrid", "delta-star"])
def test_the_acceleration_of_slides_per_speed_squared_is_proved(name: str) -> None:
    """III.6.5, against the measure of the machine's own code on a grid."""
    kin = machines.load(name).kinematics
    found = largest_over(rates_over(kin.leg_geometry, 0.0), slide_acceleration(kin.leg_geometry))
    grid = worst(partial(speed_acceleration, kin.on_rods), kin.workspace, (7, 7, 5, 2))
    assert grid.value <= found.most * (1.0 + 1e-9) and found.value == pytest.approx(grid.value, rel=0.01)
    assert found.most <= 1.0101 * found.value


def test_the_condition_number_of_the_h4a_is_below_six_everywhere() -> None:
    """V.7, over the declared workspace and 45 degrees to both sides: proved, not seen."""
    kin = machines.load("h4a-c-table").kinematics
    assert largest_over(rates_over(kin.leg_geometry, kin.transmits.lever), MEASURES["condition_number"],
                        close=0.03).most < 6.0


def test_manipulability_says_nothing_of_a_lost_direction() -> None:
    """II-20 is the product of singular values, II-23 its part of the most that columns of that length could have."""
    kin = machines.load("hexaslide-cone").kinematics
    place, tilt = kin.workspace.random(np.random.default_rng(1), 20)
    j = rates(kin.transmits, place, tilt, 0.0)
    np.testing.assert_array_less(0.999999 * np.abs(np.linalg.det(j)), manipulability(kin.transmits, place, tilt))
    assert (conditioning_factor(kin.transmits, place, tilt) <= np.prod(np.linalg.svd(j, compute_uv=False), axis=1) / np.prod(
        np.linalg.norm(j, axis=1), axis=1) + 1e-12).all()
    delta = machines.load("uranesx").kinematics.transmits
    flat, middle = (np.array([[x, 0.0, 0.0]]) for x in (250.0, 0.0))
    none = np.zeros(1)
    assert manipulability(delta, flat, none) < manipulability(delta, middle, none)
    assert condition_number(delta, flat, none) > condition_number(delta, middle, none)


def test_indices_of_a_chain() -> None:
    """Of a mill with square slides all 1; where the tool lies along the rotary axis none."""
    square, singular = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], [[1.0, 1.0], [0.0, 1e-12], [0.0, 0.0]]
    condition, factor, size = indices(np.array([square, singular]))
    np.testing.assert_allclose(condition, [1.0, np.inf])
    np.testing.assert_allclose([factor, size], [[1.0, 0.0], [1.0, 0.0]], atol=1e-11)
    m = machines.load("mikron-ucp710")
    found = chain_figures(m)["indices"]
    assert found["singular_at"]["A"] == 0.0 and found["condition_number_at_home"] is None
    q = m.home.copy()
    q[m.axis_names.index("A")] = 1.0
    assert np.linalg.matrix_rank(scaled_jacobian(m, q[None])[0]) == 5
    assert chain_figures(machines.load("mill-3axis"))["indices"]["condition_number_worst"] == 1.0


def test_what_ends_a_box() -> None:
    mill = machines.load("mill-3axis")
    box = Box((-500.0, -100.0, -300.0), (500.0, 100.0, 300.0))
    assert ends_of_box(mill, box) == ["travel of X", "travel of Z"] or ends_of_box(mill, box) == ["travel of X"]
    delta = machines.load("uranesx")
    assert "reach of a leg" in ends_of_box(delta, Box((-900.0, -900.0, -100.0), (900.0, 900.0, 100.0)))
    assert ends_of_box(delta, None) == []


def test_the_nearest_stop_and_parts_are_those_of_the_margins() -> None:
    found = least_margins(machines.load("uranesx"))
    assert found["nearest_stop"]["what"].startswith("joint") and 0.0 < found["nearest_stop"]["deg"] < 30.0
    assert found["nearest_parts"]["what"].endswith("spindle") and found["nearest_parts"]["mm"] > 0.0


def test_maps_and_curves_as_table_and_figure(tmp_path: Path) -> None:
    run, table, figure = CliRunner(), tmp_path / "m.csv", tmp_path / "m.svg"
    done = run.invoke(app, ["machine", "analyse", "uranesx", "--map", "condition", "--at", "z=-100", "--csv", str(table),
                            "--figure", str(figure), "--json", "-"])
    assert done.exit_code == 0, done.output
    found, rows = json.loads(done.stdout), list(csv.DictReader(table.read_text("utf-8").splitlines()))
    values = np.array([float(row["condition"]) for row in rows])
    assert values.max() == pytest.approx(found["largest"]["value"], rel=1e-8) and {row["z_mm"] for row in rows} == {"-100"}
    assert len(rows) == 41**2 and "z -100 mm" in figure.read_text("utf-8")
    curve = run.invoke(app, ["machine", "analyse", "h4a-c-table", "--map", "speed", "--along", "tilt", "--csv", str(table)])
    assert curve.exit_code == 0 and len(table.read_text("utf-8").splitlines()) == 42
    for words in (["--along", "x"], ["--map", "speed", "--along", "q"], ["--map", "speed", "--at", "z"], ["--csv", "a.csv"]):
        assert run.invoke(app, ["machine", "analyse", "uranesx", *words]).exit_code == 2


@pytest.mark.parametrize(("name", "said"), [("uranesx", "condition number, platform at z 0 mm"),
                                            ("mill-4axis", "condition number over A")])
def test_a_figure_without_a_map_is_of_the_condition_number(tmp_path: Path, name: str, said: str) -> None:
    figure = tmp_path / "m.svg"
    done = CliRunner().invoke(app, ["machine", "analyse", name, "--figure", str(figure)])
    assert done.exit_code == 0 and said in figure.read_text("utf-8") and name in done.output


def test_slides_alone_have_no_figure_of_their_condition(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["machine", "analyse", "mill-3axis", "--figure", str(tmp_path / "m.svg")])
    assert done.exit_code == 1 and "leave --figure out" in done.output and not list(tmp_path.iterdir())


def test_a_curve_that_is_one_number_is_drawn_as_one() -> None:
    """Not its rounding over the whole height, with an axis of 1e-11 + 26.96."""
    sheet = Figure()
    axes = sheet.subplots()
    values = 26.96291202 + 1e-11 * np.arange(5.0)
    axes.plot(values)
    level(axes, values)
    low, high = axes.get_ylim()
    assert low < 0.95 * 26.96 and high > 1.05 * 26.96
    level(axes, np.array([1.0, 2.0, np.nan]))
    assert axes.get_ylim() == (low, high)
