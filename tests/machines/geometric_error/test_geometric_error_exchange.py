"""Exchange of error models: any curves as tables with their covariance, LinuxCNC's files both directions,
tables of others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.model import ErrorModel, uncertainty
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.exchange.bed_frame import bed_side
from machines.geometric_error.exchange.exports import ini_lines, location_csv, notices, to_screws, to_tables
from machines.geometric_error.exchange.imports import ImportOptions, read_sources, with_covariance
from machines.geometric_error.exchange.write_model import save, write_model
from machines.geometric_error.files.covariance import write_covariance
from machines.geometric_error.files.loader import load
from machines.geometric_error.tables.curves import Fourier, Polynomial, TableCurve
from machines.kinematics.serial import Serial
from machines.machine import Machine
from tests.machines.error_models import ARCSEC, component, correlated, joints, model
from toolpaths.arrays import Floats
from toolpaths.units import DEG

SAMPLES = Path(__file__).parents[3] / "samples" / "errors"


# ---- tables ------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("name", ["mikron-ucp710", "nutating-head", "h4a-c-table"])
def test_curves_become_tables_that_lose_what_is_reported_and_keep_the_uncertainty(name: str) -> None:
    machine = machines.load(name)
    full = correlated(model(machine.kinematics, 3))
    length, angle = 2e-3, 0.6 * ARCSEC
    made, losses = to_tables(full, machine, {}, length, angle)
    own = {str(c.name): c.curve for c in full.axes.components}
    for new in made.axes.components:
        old, lost = own[str(new.name)], losses[str(new.name)]
        assert isinstance(new.curve, TableCurve) and new.curve.rule == "linear"
        assert lost <= (angle if new.name.angular else length)
        if full.axes.frame.get(new.name.axis, "fixed") != made.axes.frame.get(new.name.axis, "fixed"):
            continue  # turned into the bed's directions
        low, high = old.range if np.isfinite(old.range).all() else (-7.0, 7.0)
        x = np.random.default_rng(1).uniform(low, high, 4000)
        assert np.abs(new.curve.at(x) - old.at(x)).max() <= 1.02 * lost + 1e-15
    kin = machine.kinematics.with_tool(60.0)
    one, two = full.on(kin), made.on(kin)
    w = one.coordinates(joints(kin, 300))
    (tip, axis, side), (other, leaning, adjacent) = one.place(w), two.place(w)
    axes = len(made.axes.axes)
    assert np.abs(other - tip).max() < axes * (2.0 * length + 600.0 * angle)
    assert np.abs([leaning - axis, adjacent - side]).max() < 2.0 * axes * angle
    before, after = uncertainty(full, one, w[:40]), uncertainty(made, two, w[:40])
    assert before.tip.min() > 1e-6
    assert after.tip == pytest.approx(before.tip, rel=0.3) and after.axis == pytest.approx(before.axis, rel=0.3)
    assert np.median(after.tip / before.tip) == pytest.approx(1.0, abs=0.05)


@pytest.mark.covering
@pytest.mark.parametrize("name", ["mikron-ucp710", "nutating-head", "head-table", "h4a-c-table", "h4a-spindle-axis"])
@pytest.mark.parametrize("frame", ["fixed", "moving"])
def test_errors_of_a_rotary_axis_in_any_frame_are_the_same_machine_in_that_of_the_bed(name: str, frame: str) -> None:
    """Fine tables next to the exact machine: what is left is of second order."""
    machine = machines.load(name)
    full = model(machine.kinematics, 3)
    turning = [x for x, turns in zip(machine.axis_names, machine.rotary, strict=True) if turns]
    parts = tuple(c for c in full.axes.components if c.name.axis in turning)
    full = replace(full, axes=SerialErrors(parts, frame=dict.fromkeys(turning, frame)))
    made, _ = to_tables(full, machine, {}, 1e-6, 3e-4 * ARCSEC)
    assert made.axes.frame == {x: bed_side(machine, x) for x in turning}
    one, two = (m.on(machine.kinematics) for m in (full, made))
    w = one.coordinates(joints(machine.kinematics, 200))
    (tip, axis, _), (other, leaning, _) = one.place(w), two.place(w)
    moved = np.abs(tip - full.zero().on(machine.kinematics).place(w)[0]).max()
    assert np.abs(other - tip).max() < 1e-4 * moved + 2e-5 and np.abs(leaning - axis).max() < 2e-8
    askew = replace(full, axes=replace(full.axes, frame={x: "fixed" if made.axes.frame[x] == "moving" else "moving"
                                                         for x in turning},
                                       reference={x: np.array([31.0, 22.0, 13.0]) for x in turning}))
    kept, _ = to_tables(askew, machine, {}, 1e-3, ARCSEC)
    assert kept.axes.frame == askew.axes.frame and len(notices(kept, machine)) == len(turning)


def test_tables_keep_their_own_rows_and_stay_as_they_are() -> None:
    machine = machines.load("mikron-ucp710")
    full = load(SAMPLES / "mikron-ucp710.toml", machine)
    made, losses = to_tables(full, machine, {}, 1e-4, 0.1 * ARCSEC)
    for old, new in zip(full.axes.components, made.axes.components, strict=True):
        if isinstance(old.curve, TableCurve):
            assert np.array_equal(old.curve.values, new.curve.values) and losses[str(old.name)] < 1e-15
    assert {type(c.curve) for c in full.axes.components} == {TableCurve, Fourier}
    stepped, _ = to_tables(full, machine, {"X": 100.0, "C": 45.0 * DEG}, 1e-4, 0.1 * ARCSEC)
    curves = {str(c.name): c.curve for c in stepped.axes.components}
    assert curves["EXX"].x.tolist() == pytest.approx(np.linspace(-355, 355, 9).tolist())
    assert curves["ECC"].x == pytest.approx(np.arange(8) * 45.0 * DEG)
    assert curves["ECC"].period == pytest.approx(2.0 * np.pi)


def test_what_cannot_be_a_table_is_refused() -> None:
    machine = machines.load("mikron-ucp710")
    with pytest.raises(ValueError, match="no component errors"):
        to_tables(ErrorModel(), machine, {}, 1e-4, 1e-7)
    wild = ErrorModel(SerialErrors((component("EXX", Fourier(np.ones(3), 0.01, 0.0, (0.0, 300.0))),)))
    with pytest.raises(ValueError, match="rows still lose"):
        to_tables(wild, machine, {}, 1e-4, 1e-7)
    with pytest.raises(ValueError, match="256 are held"):
        flat = ErrorModel(SerialErrors((component("EXX", Polynomial(np.ones(1), (0.0, 300.0))),)))
        to_screws(flat, machine, {"X": 1.0}, 1.0, 1.0)


# ---- LinuxCNC ----------------------------------------------------------------------------------------------

def as_linuxcnc(machine: Machine, texts: dict[str, str], q: Floats, approach: float) -> Floats:
    """Motor positions of commanded joints q, as LinuxCNC makes them: plus nominal less actual, linear between rows."""
    result = q.copy()
    for letter, text in texts.items():
        rows = np.array([[float(x) for x in line.split()] for line in text.splitlines()])
        j = machine.axis_names.index(letter)
        unit = DEG if machine.rotary[j] else 1.0
        nominal, actual = rows[:, 0] * unit, rows[:, 1 if approach > 0 else 2] * unit
        result[:, j] += np.interp(q[:, j], nominal, nominal - actual)
    return result


@pytest.mark.covering
@pytest.mark.parametrize("name", ["mikron-ucp710", "linuxcnc-xyzac-trt", "nutating-head", "mill-3axis"])
@pytest.mark.parametrize("approach", [1.0, -1.0])
def test_linuxcnc_with_the_files_leaves_the_rest(name: str, approach: float) -> None:
    """Also where joints count against the machine's axes (linuxcnc-xyzac-trt)."""
    machine = machines.load(name)
    kin = machine.kinematics
    assert isinstance(kin, Serial)
    full = model(kin, 3)
    bidirectional = TableCurve(np.linspace(-900.0, 900.0, 9),
                               np.linspace(-0.02, 0.03, 18) ** 2 * 30.0, both=True)
    rest = tuple(c for c in full.axes.components if str(c.name) != "EXX")
    full = replace(full, axes=replace(full.axes, components=(*rest, component("EXX", bidirectional))))
    screws = to_screws(full, machine, {}, 1e-4, 0.02 * ARCSEC)
    leaning = {"EBB"} if name == "nutating-head" else set()
    assert set(screws.left) == leaning and set(screws.texts) == set(kin.axis_names) - {x[2] for x in leaning}
    assert all(text.count("\n") <= 256 for text in screws.texts.values())
    assert {str(c.name) for c in screws.rest.axes.components if c.name.positioning and c.curve.values.any()} == leaning
    q = np.clip(joints(kin, 50), machine.limits.lower, machine.limits.upper)
    approaches = np.full(q.shape, approach)
    tip, axis, _ = full.on(kin).place(as_linuxcnc(machine, screws.texts, q, approach), approaches)
    wanted = screws.rest.on(kin).place(q, approaches)
    uncorrected = full.on(kin).place(q, approaches)
    assert np.abs(tip - wanted[0]).max() < 3e-4 < 0.1 * np.abs(uncorrected[0] - wanted[0]).max()
    assert np.abs(axis - wanted[1]).max() < 2e-7


@pytest.mark.parametrize(("angle", "step", "turns"),
                         [(0.1, 0.0, 2.0), (0.1, 4.0, 1.0), (0.1, 2.0, 0.5), (0.003, 0.0, 1.0)])
def test_an_axis_that_goes_round_has_rows_over_as_many_turns_as_there_are_rows(angle: float, step: float,
                                                                               turns: float) -> None:
    machine = machines.load("mikron-ucp710")
    full = load(SAMPLES / "mikron-ucp710.toml", machine)
    screws = to_screws(full, machine, {"C": step * DEG} if step else {}, 1e-3, angle * ARCSEC)
    table = screws.tables["C"]
    assert table.x[[0, -1]] == pytest.approx([-2 * np.pi * turns, 2 * np.pi * turns]) and len(table.x) <= 256
    if not step:
        assert screws.losses["ECC"] <= angle * ARCSEC
    kin, q = machine.kinematics, np.zeros((2, 5))
    q[:, 4] = 2 * np.pi * turns + np.array([-0.01, 0.01])
    assert full.on(kin).outside(q).sum() == 0
    assert screws.rest.on(kin).outside(q)[:, 4].tolist() == [False, True]


def test_an_axis_whose_errors_act_about_a_point_next_to_it_is_left(tmp_path: Path) -> None:
    machine = machines.load("mikron-ucp710")
    full = load(SAMPLES / "mikron-ucp710.toml", machine)
    for point, left in (([0.0, 0.0, 50.0], set()), ([30.0, 0.0, 50.0], {"ECC"})):  # along the line of C, and next to it
        moved = replace(full, axes=replace(full.axes, reference={"C": np.array(point)}))
        screws = to_screws(moved, machine, {}, 1e-4, 0.1 * ARCSEC)
        assert set(screws.left) == left and ("C" in screws.texts) == (not left)
        assert set(screws.left.values()) <= {"reference off the axis"}
        kin = machine.kinematics.with_tool(50.0)
        q = np.clip(joints(kin, 50), machine.limits.lower, machine.limits.upper)
        tip, _, _ = moved.on(kin).place(as_linuxcnc(machine, screws.texts, q, 1.0), np.ones(q.shape))
        assert np.abs(tip - screws.rest.on(kin).place(q, np.ones(q.shape))[0]).max() < 3e-4


def test_where_rows_end_inside_travel_the_rest_ends_too(tmp_path: Path) -> None:
    machine = machines.load("mill-3axis")
    ends = {"EXX": (-500.0, 500.0), "EYY": (-300.0, 400.0), "EZZ": (-300.0, 400.0)}
    full = ErrorModel(SerialErrors(tuple(component(name, TableCurve(np.array(x), np.array([0.0, 0.01])))
                                         for name, x in ends.items())), machine=machine.name)
    full = replace(full, covariance=np.diag(np.full(6, 1e-8)))
    screws = to_screws(full, machine, {}, 1e-4, ARCSEC)
    assert [(str(c.name), c.curve.range) for c in screws.rest.axes.components] == [("EYY", (-300.0, 400.0))]
    assert not screws.rest.values.any() and screws.rest.covariance is not None and not screws.rest.covariance.any()
    save(replace(screws.rest, name="rest"), tmp_path)
    rest = load(tmp_path / "rest.toml", machine).on(machine.kinematics)
    assert rest.outside(np.array([[0.0, -301.0, 0.0], [0.0, -299.0, 0.0]])).tolist() == [[False, True, False], [False] * 3]


@pytest.mark.parametrize("name", ["mikron-ucp710", "linuxcnc-xyzac-trt"])
def test_linuxcnc_files_come_back_to_their_resolution(name: str, tmp_path: Path) -> None:
    machine = machines.load(name)
    full = load(SAMPLES / f"{name}.toml", machine)
    screws = to_screws(full, machine, {}, 1e-3, ARCSEC)
    sources = []
    for letter, text in screws.texts.items():
        (tmp_path / f"{letter}.comp").write_text(text)
        sources.append(f"{letter}={tmp_path / letter}.comp")
    back, found = read_sources(sources, machine, ImportOptions())
    assert back is not None and not found
    for c in back.axes.components:
        table = screws.tables[c.name.axis]
        assert isinstance(c.curve, TableCurve) and c.curve.both == table.both
        assert c.curve.x == pytest.approx(table.x, abs=1e-9) and c.curve.values == pytest.approx(table.values, abs=2e-9)
    trims = tmp_path / "X1.comp"
    rows = np.array([[float(x) for x in line.split()] for line in screws.texts["X"].splitlines()])
    trims.write_text("\n".join(f"{a} {a - b:.9f} {a - c:.9f}" for a, b, c in rows))
    same, _ = read_sources([f"X={trims}"], machine, ImportOptions(kind=1))
    assert same is not None and same.values == pytest.approx(back.values[: len(same.values)], abs=2e-9)
    wrong, found = read_sources([f"X={trims}"], machine, ImportOptions(kind=0))
    assert wrong is None and found[0].code == "error-table.kind" and "type 1" in found[0].hint


def test_ini_lines_name_the_joint() -> None:
    assert ini_lines(machines.load("mikron-ucp710"), {"Y": "y.comp", "C": "c.comp"}) == [
        "[JOINT_1]", "COMP_FILE = y.comp", "COMP_FILE_TYPE = 0", "[JOINT_4]", "COMP_FILE = c.comp", "COMP_FILE_TYPE = 0"]


STEPS = {"X": 200.0, "Y": 200.0, "Z": 200.0, "A": 90.0 * DEG, "C": 60.0 * DEG}


# ---- tables of others --------------------------------------------------------------------------------------

def test_tables_per_axis_come_back_with_location_and_covariance(tmp_path: Path) -> None:
    machine = machines.load("mikron-ucp710")
    full = correlated(load(SAMPLES / "mikron-ucp710.toml", machine))
    made, _ = to_tables(replace(full, name="t"), machine, STEPS, 1.0, 1.0)
    more = {"t-location.csv": location_csv(made), "t-covariance.csv": write_covariance(made)}
    for name, text in {**write_model(made), **more}.items():
        (tmp_path / name).write_text(text)
    sources = [str(tmp_path / f"t-{x}.csv") for x in ("X", "Y", "Z", "A", "C", "location")]
    back, found = read_sources(sources, machine, ImportOptions(periods={"A": 2 * np.pi, "C": 2 * np.pi}))
    assert back is not None and not found and back.names == made.names
    assert back.values == pytest.approx(made.values, rel=1e-10, abs=1e-14)
    assert back.axes.frame == {"A": "moving", "C": "moving"}  # the bed: both carry the part
    doubted, found = with_covariance(back, tmp_path / "t-covariance.csv")
    assert doubted is not None and doubted.covariance is not None and not found
    assert doubted.covariance == pytest.approx(made.covariance, rel=1e-9, abs=1e-22)
    again = load(save(replace(doubted, name="again"), tmp_path)[0], machine)
    assert again.names == made.names and again.covariance == pytest.approx(made.covariance, rel=1e-9, abs=1e-22)


def test_a_lattice_of_others_comes_in_as_they_say(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text("C [deg];dx [um];dy [um];dz [um]\n0;1,5;2;3\n120;2;2;3\n240;1;2;3\n")
    machine = machines.load("mikron-ucp710")
    how = ImportOptions(periods={"C": 2 * np.pi}, sign=-1.0, tool_length=80.0, directions="machine")
    found, faults = read_sources([str(tmp_path / "m.csv")], machine, how)
    assert found is not None and found.map is not None and not faults
    assert found.map.table[0, :3].tolist() == pytest.approx([-0.0015, -0.002, -0.003])
    assert found.map.bed == ("C", "A") and found.map.length == 80.0 and found.map.periods == (2 * np.pi,)


def test_readings_of_the_same_place_are_averaged_and_scatter_is_the_uncertainty(tmp_path: Path) -> None:
    """Five runs there and back, as ISO 230-2 has them: means in order, s / sqrt(5) each."""
    rng, x = np.random.default_rng(5), np.linspace(-300.0, 300.0, 13)
    truth = np.stack([0.02 * x, 0.01 * x + 3.0], axis=1)
    runs = [truth + rng.normal(size=truth.shape) * [0.5, 0.8] for _ in range(5)]
    rows = [f"{x[k]},{run[k, 0]:.6f},{run[k, 1]:.6f}" for n, run in enumerate(runs) for k in range(13)[:: 1 - 2 * (n % 2)]]
    (tmp_path / "x.csv").write_text("X [mm],EXX+ [um],EXX- [um]\n" + "\n".join(rows))
    machine = machines.load("mikron-ucp710")
    found, noted = read_sources([str(tmp_path / "x.csv")], machine, ImportOptions(average=True))
    assert found is not None and found.covariance is not None
    assert found.values == pytest.approx(np.mean(runs, axis=0).T.ravel() * 1e-3, abs=1e-9)
    sigma = np.sqrt(np.diag(found.covariance)) * 1e3
    assert np.ptp(sigma[:13]) == 0.0 and sigma[0] == pytest.approx(0.5 / np.sqrt(5), rel=0.25)
    assert sigma[13] == pytest.approx(0.8 / np.sqrt(5), rel=0.25)
    pooled = np.sqrt(np.var([r[:, 0] for r in runs], axis=0, ddof=1).mean() / 5)
    assert sigma[0] == pytest.approx(pooled, rel=1e-6)
    assert [d.code for d in noted] == ["error-import.averaged"] and "65 readings at 13 places" in noted[0].message
    plain, faults = read_sources([str(tmp_path / "x.csv")], machine, ImportOptions())
    assert plain is None and faults[0].code == "error-model.order"


def test_a_lattice_of_several_readings_that_goes_round_has_a_uncertainty_by_node(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    nodes = [(z, c) for z in (0.0, 100.0) for c in (0.0, 90.0, 180.0, 270.0, 360.0)]
    value = {(z, c): z / 100.0 + np.cos(np.radians(c)) for z, c in nodes}
    rows = [f"{z},{c},{value[z, c]:.6f},{d:.6f},2,5" for z, c in nodes for d in ([1.0, 3.0] if z else [1.0, 3.0, 2.0, 2.0])]
    head = "Z [mm],C [deg],dx [um],dy [um],dz [um],rx [arcsec]"
    (tmp_path / "m.csv").write_text("\n".join([head, *rng.permutation(rows)]))
    how = ImportOptions(average=True, periods={"C": 2 * np.pi}, zero={"Z": 100.0, "C": np.pi / 2})
    found, noted = read_sources([str(tmp_path / "m.csv")], machines.load("mikron-ucp710"), how)
    assert found is not None and found.map is not None and found.covariance is not None
    assert found.map.table.shape == (2, 4, 6)
    assert found.map.table[1, :, 0] * 1e3 == pytest.approx([1.0, 0.0, -1.0, 0.0], abs=1e-6)
    assert found.map.table[0, :, 0] * 1e3 == pytest.approx([0.0, -1.0, -2.0, -1.0], abs=1e-6)
    variance = np.diag(found.covariance).reshape(2, 4, 6) * 1e6
    scatter = 5 * (2.0 + 2.0) / (30 - 8)  # sum of squares about the means over readings less places
    mean = scatter / np.array([[8.0, 4.0, 4.0, 4.0], [4.0, 2.0, 2.0, 2.0]])  # the end of a turn is its begin
    wanted = mean + mean[1, 1]  # the node that is taken off
    wanted[1, 1] = 0.0
    assert variance[:, :, 1] == pytest.approx(wanted)
    plain, _ = read_sources([str(tmp_path / "m.csv")], machines.load("mikron-ucp710"), replace(how, zero={}))
    assert plain is not None and plain.covariance is not None
    variance = np.diag(plain.covariance).reshape(2, 4, 6) * 1e6
    assert variance[:, :, 1] == pytest.approx(mean)
    assert variance[:, :, [0, 2, 3]] == pytest.approx(0.0, abs=1e-12) and "30 readings at 8 places" in noted[0].message
    outside, faults = read_sources([str(tmp_path / "m.csv")], machines.load("mikron-ucp710"),
                                   replace(how, zero={"Z": 101.0, "C": 0.0}))
    assert outside is None and faults[0].code == "error-map.zero"


def test_what_tables_do_not_say_is_reported() -> None:
    machine = machines.load("mikron-ucp710")
    full = load(SAMPLES / "mikron-ucp710.toml", machine)
    assert notices(to_tables(full, machine, {}, 1.0, 1.0)[0], machine) == []
    assert notices(to_screws(full, machine, {}, 1.0, 1.0).held, machine) == [
        "C goes round, its table holds from -720 to 720 degrees"]
    fixed = replace(full, axes=replace(full.axes, frame={"A": "moving", "C": "fixed"}))
    assert notices(fixed, machine) == [
        "errors of C are along x, y, z of the part's side of the axis, not of the bed as in ISO 230-1"]


AXIS = "X [mm],EXX [um],EYX [um]\n0,1,2\n100,3,4\n"
SOURCES = [
    ("another axis", {"a.csv": "B [deg],EXB [um]\n0,1\n9,2\n"}, "error-model.axis", "no axis 'B'"),
    ("two axes", {"a.csv": "X [mm],Y [mm],EXX [um]\n0,0,1\n1,1,2\n"}, "error-import.axis", "X and Y"),
    ("error of another axis", {"a.csv": AXIS.replace("EYX", "EYY")}, "error-model.column", "'EYY' is not a component error"),
    ("misspelt", {"a.csv": AXIS.replace("EYX", "EQX")}, "error-model.column", "'EQX'"),
    ("no errors", {"a.csv": "X [mm]\n0\n1\n"}, "error-model.column", "no errors of X"),
    ("order", {"a.csv": AXIS + "50,3,4\n"}, "error-model.order", "50 after 100"),
    ("repeated", {"a.csv": AXIS + "100,3,4\n"}, "error-model.order", "100 after 100"),
    ("one row", {"a.csv": "X [mm],EXX [um]\n0,1\n"}, "error-model.rows", "one row"),
    ("unit", {"a.csv": AXIS.replace("EYX [um]", "EYX [arcsec]")}, "error-model.unit", "'arcsec'"),
    ("no unit", {"a.csv": AXIS.replace("X [mm]", "X", 1)}, "error-model.unit", "column 'X'"),
    ("half", {"a.csv": AXIS.replace("EYX", "EYX+")}, "error-model.column", "no column 'EYX-'"),
    ("both and one", {"a.csv": "X [mm],EXX+ [um],EXX- [um],EXX [um]\n0,1,2,3\n1,1,2,3\n"}, "error-model.column",
     "next to"),
    ("twice", {"a.csv": AXIS, "b.csv": AXIS}, "error-import.twice", "is in"),
    ("map and tables", {"a.csv": AXIS, "b.csv": "X [mm],dx [um],dy [um],dz [um]\n0,1,2,3\n"}, "error-import.map",
     "combined"),
    ("location rows", {"a.csv": "EC0Y [arcsec]\n1\n2\n"}, "error-import.rows", "2 rows"),
    ("location unit", {"a.csv": "EC0Y [um]\n1\n"}, "error-model.unit", "'um'"),
    ("neither", {"a.csv": "foo [um]\n1\n"}, "error-import.columns", "'foo'"),
    ("no effect", {"a.csv": "EX0Y [um]\n1\n"}, "error-model.no-effect", "EX0Y"),
    ("no such axis", {"a.csv": "EC0V [arcsec]\n1\n"}, "error-model.machine", "errors of V"),
    ("missing", {}, "error-table.not-found", "no table"),
]


@pytest.mark.parametrize(("files", "code", "word"), [s[1:] for s in SOURCES], ids=[s[0] for s in SOURCES])
def test_faults_of_sources(tmp_path: Path, files: dict[str, str], code: str, word: str) -> None:
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    sources = [str(tmp_path / name) for name in files or {"a.csv": ""}]
    found, faults = read_sources(sources, machines.load("mikron-ucp710"), ImportOptions())
    assert found is None
    first = next(d for d in faults if d.code == code)
    assert word in first.message and first.hint and len(faults) <= 2


SCREWS = [("a b c\n0 0 0\n", "error-table.row"), ("0 0 0\n0 0 0\n", "error-table.row"), ("0 0 0\n", "error-table.empty"),
          ("0 nan 0\n1 1 1\n", "error-table.row"), ("", "error-table.empty"), ("0 0\n1 1\n", "error-table.row"),
          ("-100 0 0\n100 0 0\n", "error-table.kind")]


@pytest.mark.parametrize(("text", "code"), SCREWS)
def test_faults_of_screw_files(tmp_path: Path, text: str, code: str) -> None:
    (tmp_path / "x.comp").write_text(text)
    found, faults = read_sources([f"X={tmp_path / 'x.comp'}"], machines.load("mill-3axis"), ImportOptions())
    assert found is None and [d.code for d in faults] == [code] and faults[0].hint and faults[0].file.endswith("x.comp")
    none, faults = read_sources([f"B={tmp_path / 'x.comp'}"], machines.load("mill-3axis"), ImportOptions())
    assert none is None and faults[0].code == "error-model.axis"
    leaning, faults = read_sources([f"B={tmp_path / 'x.comp'}"], machines.load("nutating-head"),
                                   ImportOptions())
    assert leaning is None and "B of nutating-head leans" in faults[0].message
    rods, faults = read_sources([f"X={tmp_path / 'x.comp'}"], machines.load("uranesx"), ImportOptions())
    assert rods is None and faults[0].code == "error-model.axis" and "it has none" in faults[0].hint
