"""Error models as maps, and what is reported of a model: figures, ranges, what correction leaves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.correction import correct
from machines.geometric_error.actual.model import ErrorModel, uncertainty
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.exchange.exports import lattice_for, to_map, worst
from machines.geometric_error.exchange.imports import ImportOptions, read_sources
from machines.geometric_error.exchange.survey import absent, beyond_travel, survey, unmeasured
from machines.geometric_error.exchange.tabulate import without
from machines.geometric_error.exchange.volume import ranges
from machines.geometric_error.files.loader import load
from machines.geometric_error.tables.curves import Fourier, TableCurve
from machines.geometric_error.tables.names import parse
from tests.machines.error_models import ARCSEC, component, correlated, model
from toolpaths.diagnostics import Severity
from toolpaths.units import DEG

SAMPLES = Path(__file__).parents[3] / "samples" / "errors"


@pytest.mark.covering(count=2)
@pytest.mark.parametrize(("name", "over"), [("mill-3axis", ""), ("mill-4axis", "XYZA"), ("uranesx", ""),
                                            ("h4a-spindle-axis", "")])
def test_a_map_of_all_coordinates_loses_as_much_everywhere_as_inside(name: str, over: str) -> None:
    machine = machines.load(name)
    full = model(machine.kinematics, 5)
    lattice, fixed = lattice_for(full, machine, over, {"A": 30 * DEG} if "A" in over else {}, {}, 0.0, "machine")
    made = to_map(full, machine, lattice, fixed, 0.006)
    assert made.inside.tip_worst <= 0.006 and made.volume is not None
    if name != "h4a-spindle-axis":  # its tilt and B are no coordinates
        assert made.volume.tip_worst < 0.0065
    assert made.model.names and made.model.on(machine.kinematics) is not None


def test_a_map_carries_the_uncertainty_of_its_model_at_its_nodes() -> None:
    machine = machines.load("mikron-ucp710")
    full = correlated(load(SAMPLES / "mikron-ucp710.toml", machine))
    steps = {"X": 400.0, "Y": 300.0, "Z": 500.0}
    lattice, fixed = lattice_for(full, machine, "", steps, {"A": 0.4, "C": 1.0}, 0.0, "machine")
    made = to_map(full, machine, lattice, fixed, None)
    assert made.model.covariance is not None and lattice.table.size == 6 * 3 * 3 * 2 and not made.uncertainty_lost
    kin = machine.kinematics.with_tool(90.0)
    q = np.column_stack([lattice.places(), np.tile([0.4, 1.0], (18, 1))])
    before, after = uncertainty(full, full.on(kin), q), uncertainty(made.model, made.model.on(kin), q)
    assert after.tip == pytest.approx(before.tip, rel=1e-3) and after.axis == pytest.approx(before.axis, rel=1e-3)
    finer, _ = lattice_for(full, machine, "", {}, {}, 0.0, "machine")
    assert to_map(full, machine, finer, fixed, None).uncertainty_lost


def test_a_map_goes_round_where_its_model_does() -> None:
    machine = machines.load("mikron-ucp710")
    for curve, period, last in ((Fourier(np.array([0.0, 0.01, 0.0])), 2 * np.pi, 330.0),
                                (TableCurve(np.array([0.0, 1.0, 4.0]), np.zeros(3)), 0.0, np.degrees(4.0))):
        full = ErrorModel(SerialErrors((component("EXC", curve),)))
        lattice, fixed = lattice_for(full, machine, "C", {}, {}, 0.0, "machine")
        assert lattice.periods == (period,) and np.degrees(lattice.nodes[0][-1]) == pytest.approx(last)
        assert to_map(full, machine, lattice, fixed, None).model.map is not None


def test_figures_of_a_model() -> None:
    machine = machines.load("mikron-ucp710")
    full = load(SAMPLES / "mikron-ucp710.toml", machine)
    found = survey(full, machine, 80.0)
    assert found["components"]["EXX"]["lost_motion"] == pytest.approx(3.0) and found["components"]["EXX"]["both_ways"]
    assert found["components"]["ECY"]["unit"] == "arcsec"
    peak = max(abs(float(x.split(",")[3])) for x in (SAMPLES / "mikron-ucp710-X.csv").read_text().splitlines()[2:])
    assert abs(found["components"]["EYX"]["largest"]) == pytest.approx(peak)
    assert found["location"]["EC0Y"] == {"value": pytest.approx(6.0), "unit": "arcsec", "kind": "line"}
    assert found["covariance"]["largest_um"] == pytest.approx(0.5) and not found["covariance"]["correlated"]
    volume = found["volume"]
    q = np.array([[volume["tip_worst_at"][x] for x in machine.axis_names]]) * np.where(machine.rotary, DEG, 1.0)
    kin = machine.kinematics.with_tool(80.0)
    moved = np.linalg.norm(full.on(kin).place(q)[0] - kin.forward(q)[0])
    assert volume["tip_worst_um"] == pytest.approx(1e3 * moved, rel=1e-4) and volume["tip_rms_um"] < volume["tip_worst_um"]
    tip, axis = worst(full, machine, 80.0, full)
    assert [tip, axis] == [volume["tip_worst_um"], volume["axis_worst_arcsec"]]  # at the same places
    assert volume["ways_at_mean"] == ["EXX", "EYY", "EZZ"]
    less = without(full, [n for n in map(parse, ("EXX", "EZC")) if n])
    assert absent(less, machine) == ["EXX", "EZC"] and len(less.names) == len(full.names) - 35
    assert less.covariance is not None and np.diag(less.covariance)[0] == pytest.approx((0.5e-3) ** 2)
    assert unmeasured(full, machine, "e") == []
    short = ErrorModel(SerialErrors((component("EXX", TableCurve(np.array([0.0, 10.0]), np.zeros(2))),)))
    turn = ErrorModel(SerialErrors((component("EXC", TableCurve(np.array([0.0, 2 * np.pi]), np.zeros(2))),)))
    noted = unmeasured(turn, machine, "e.toml")
    assert len(noted) == 1 and "repeats" in noted[0].hint
    assert "C goes round, the model holds from 0 to 360" in noted[0].message
    assert ranges(turn, machine)[1][4] == pytest.approx(2 * np.pi)
    noted = unmeasured(short, machine, "e.toml")
    assert len(noted) == 1 and "X travels from -355 to 355, the model holds from 0 to 10" in noted[0].message


@pytest.mark.parametrize(("name", "turns"), [("mikron-ucp710", 2), ("mill-4axis", 1), ("uranesx", 0)])
def test_what_correction_leaves_is_what_the_commands_leave_where_it_is_reported(name: str, turns: int) -> None:
    machine = machines.load(name)
    full = model(machine.kinematics, 3)
    volume = survey(full, machine, 80.0)["volume"]
    assert volume["turns"] == turns and volume["residual_lost"] == 0 and volume["residual_tip_worst_um"] < 1e-3
    assert volume["residual_axis_rms_arcsec"] <= volume["axis_rms_arcsec"]
    kin = machine.kinematics.with_tool(80.0)
    q = np.array([[volume["residual_axis_worst_at"][x] for x in machine.axis_names]])
    q = q * np.where(machine.rotary, DEG, 1.0)
    found = correct(full.on(kin), q, *kin.forward(q))
    place = full.on(kin).place(full.on(kin).coordinates(found.q))
    left = np.linalg.norm(place[1] - kin.forward(q)[1]) / ARCSEC
    assert volume["residual_axis_worst_arcsec"] == pytest.approx(left, rel=1e-3)
    assert volume["residual_near_pole"] == (turns == 2)
    assert (volume["residual_axis_rms_arcsec"] < 0.1 * volume["axis_rms_arcsec"]) == (turns == 2)


@pytest.mark.parametrize(("text", "noted"), [
    ("X [mm],EXX [um]\n-300000,0\n300000,5\n", "X was measured from -300000 to 300000, it travels from -355 to 355 mm"),
    ("X [in],EXX [um]\n-355,0\n355,5\n", "X was measured from -9017 to 9017"),
    ("A [rad],EAA [arcsec]\n-30,0\n120,5\n", "A was measured from -1718.87 to 6875.49, it travels from -30 to 120 degrees"),
    ("X [mm],Y [mm],dx [um],dy [um],dz [um]\n0,0,1,1,1\n0,1000,1,1,1\n9,0,1,1,1\n9,1000,1,1,1\n", "Y was measured"),
    ("X [mm],EXX [um]\n-360,0\n360,5\n", ""), ("C [deg],ECC [arcsec]\n-400,0\n400,5\n", "")])
def test_a_range_far_beyond_travel_is_reported(text: str, noted: str, tmp_path: Path) -> None:
    machine = machines.load("mikron-ucp710")
    (tmp_path / "x.csv").write_text(text)
    found, _ = read_sources([str(tmp_path / "x.csv")], machine, ImportOptions())
    assert found is not None
    warned = beyond_travel(found, machine, "e.toml")
    assert [d.code for d in warned] == ["error-model.travel"] * bool(noted)
    assert all(noted in d.message and d.severity is Severity.WARNING and "unit" in d.hint for d in warned)
