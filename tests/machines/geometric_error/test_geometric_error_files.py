"""Error model files: what is read, what is refused and how it is said, round trips, exchange with controls, maps."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.actual_map import ActualByMap
from machines.geometric_error.actual.model import ErrorModel, uncertainty
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.exchange.make_map import deviations, map_loss, map_of
from machines.geometric_error.exchange.tabulate import merged, sampled
from machines.geometric_error.exchange.write_model import save, table_to_csv
from machines.geometric_error.files.covariance import read_covariance
from machines.geometric_error.files.loader import error_model_schema, load, load_checked
from machines.geometric_error.tables.csv_table import read_csv, write_csv
from machines.geometric_error.tables.curves import Fourier, TableCurve
from machines.geometric_error.tables.lattice import ErrorMap
from machines.geometric_error.tables.lattice_file import map_from_csv, map_to_csv
from machines.geometric_error.tables.names import parse
from machines.geometric_error.tables.screw_tables import from_linuxcnc, to_linuxcnc
from machines.machine import Machine
from tests.machines.error_models import ARCSEC, joints, model
from toolpaths.arrays import Floats
from toolpaths.units import DEG

SAMPLES = Path(__file__).parents[3] / "samples" / "errors"

GOOD = """\
machine = "mikron-ucp710"
[components.EXX]
table = "x.csv"
[components.EAX]
table = "x.csv"
interpolation = "spline"
[components.EZY]
polynomial = [1.0, -2.0]
scale = 100
range = [-250, 250]
[components.ECC]
mean = 1.0
cosine = [5.0, 0.5]
sine = [0.0, -0.5]
[location]
EC0Y = 6.0
EX0C = 25
EA0S = -3
[reference.X]
point = [0, 0, 120]
[reference.C]
frame = "moving"
[sigma]
EXX = 0.5
EC0Y = 0.2
"""
TABLE = """\
# laser, 12 March
X [mm], EXX+ [um], EXX- [um], EAX [arcsec]
-300, 0, 1, 0
-100, 4, 6, 1
100, 7, 10, 2.5
300, 9, 13, 2
"""


def mikron() -> Machine:
    return machines.load("mikron-ucp710")


def put(folder: Path, text: str = GOOD, table: str = TABLE) -> Path:
    (folder / "x.csv").write_text(table)
    (folder / "e.toml").write_text(text)
    return folder / "e.toml"


def test_units_signs_and_places_of_a_file(tmp_path: Path) -> None:
    found = load(put(tmp_path), mikron())
    values = dict(zip(found.names, found.values, strict=True))
    assert values["EXX[1]+"] == pytest.approx(0.004) and values["EXX[3]-"] == pytest.approx(0.013)
    assert values["EAX[2]"] == pytest.approx(2.5 * ARCSEC)
    assert values["EZY.c1"] == pytest.approx(-0.002)
    assert values["ECC.cos1"] == pytest.approx(5.0 * ARCSEC) and values["ECC.sin2"] == pytest.approx(-0.5 * ARCSEC)
    assert values["EC0Y"] == pytest.approx(6.0 * ARCSEC) and values["EX0C"] == pytest.approx(0.025)
    assert found.axes.frame["C"] == "moving" and found.axes.reference["X"].tolist() == [0.0, 0.0, 120.0]
    assert found.covariance is not None
    sigma = dict(zip(found.names, np.sqrt(np.diag(found.covariance)), strict=True))
    assert sigma["EXX[0]-"] == pytest.approx(0.0005) and sigma["EC0Y"] == pytest.approx(0.2 * ARCSEC)
    assert sigma["ECC.mean"] == 0.0
    assert found.corrected_by == "post"


def test_the_sign_key_turns_a_measured_part_into_a_tool(tmp_path: Path) -> None:
    turned = GOOD.replace('interpolation = "spline"', 'interpolation = "spline"\nsign = -1')
    found = load(put(tmp_path, turned), mikron())
    assert dict(zip(found.names, found.values, strict=True))["EAX[2]"] == pytest.approx(-2.5 * ARCSEC)


FAULTS = [
    ("machine", 'machine = "mikron-ucp710"', 'machine = "another"', "error-model.machine", 1),
    ("key", "scale = 100", "scael = 100", "file.unknown-key", 9),
    ("name", "[components.EZY]", "[components.EZQ]", "file.value", 1),
    ("axis", "[components.EZY]", "[components.EZB]", "error-model.axis", 7),
    ("no range", "range = [-250, 250]", "", "file.value", 7),
    ("two kinds", "scale = 100", 'table = "x.csv"', "file.value", 7),
    ("no table", 'table = "x.csv"\n[components.EAX]', 'table = "y.csv"\n[components.EAX]', "error-table.not-found", 3),
    ("column", "[components.EAX]", "[components.EBX]", "error-model.column", 5),
    ("no effect", "EC0Y = 6.0", "EB0Y = 6.0", "error-model.no-effect", 16),
    ("shift of a slide", "EC0Y = 6.0", "EX0Y = 6.0", "error-model.no-effect", 16),
    ("slide frame", "point = [0, 0, 120]", 'frame = "moving"', "error-model.axis", 20),
    ("reference", "[reference.X]", "[reference.Q]", "error-model.axis", 19),
    ("sigma", "EXX = 0.5", "EYX = 0.5", "error-model.sigma", 24),
    ("legs", "[sigma]", "[legs.X]\nrail = [1.0, 0.0, 0.0]\n[sigma]", "error-model.legs", 23),
]


@pytest.mark.parametrize(("old", "new", "code", "line"), [f[1:] for f in FAULTS], ids=[f[0] for f in FAULTS])
def test_faults_are_named_with_their_line(tmp_path: Path, old: str, new: str, code: str, line: int) -> None:
    assert old in GOOD
    found, diagnostics = load_checked(put(tmp_path, GOOD.replace(old, new, 1)), mikron())
    assert found is None
    first = next(d for d in diagnostics if d.code == code)
    assert first.lines == (line,) and first.file.endswith("e.toml")
    assert first.message and len(diagnostics) <= 2


TABLE_FAULTS = [
    ("number", "100, 7,", "100, seven,", "error-table.row", 5),
    ("count", "100, 7, 10, 2.5", "100, 7, 10", "error-table.row", 5),
    ("nan", "100, 7,", "100, nan,", "error-table.row", 5), ("unit", "EXX+ [um]", "EXX+ [parsec]", "error-table.unit", 2),
    ("twice", "EXX- [um]", "EXX+ [um]", "error-table.header", 2),
    ("angle", "EAX [arcsec]", "EAX [um]", "error-model.unit", 2), ("no unit", "EXX+ [um]", "EXX+", "error-model.unit", 2),
    ("order", "-100, 4", "-400, 4", "error-model.order", 4), ("half", "EXX- [um]", "other [um]", "error-model.column", 3),
    ("empty", TABLE, "# nothing\n", "error-table.empty", None),
]


@pytest.mark.parametrize(("old", "new", "code", "line"), [f[1:] for f in TABLE_FAULTS],
                         ids=[f[0] for f in TABLE_FAULTS])
def test_faults_of_tables(tmp_path: Path, old: str, new: str, code: str, line: int | None) -> None:
    assert old in TABLE
    found, diagnostics = load_checked(put(tmp_path, GOOD, TABLE.replace(old, new, 1)), mikron())
    assert found is None
    first = next(d for d in diagnostics if d.code == code)
    assert first.lines == (() if line is None else (line,))


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("name", ["mikron-ucp710", "nutating-head", "uranesx", "h4a-c-table"])
def test_a_written_model_reads_back_the_same(tmp_path: Path, name: str) -> None:
    machine = machines.load(name)
    full = replace(model(machine.kinematics, 3), name="back", machine=name)
    rng = np.random.default_rng(0)
    if name == "uranesx":
        root = rng.normal(size=(len(full.names), 4)) * 1e-6
        full = replace(full, covariance=root @ root.T)
    else:
        full = replace(full, covariance=np.diag(np.linspace(1e-8, 1e-6, len(full.names)) ** 2))
    back = load(save(full, tmp_path, 'with "quotes"')[0], machine)
    assert back.names == full.names
    assert back.values == pytest.approx(full.values, rel=1e-10, abs=1e-13)  # twelve digits are written
    assert full.covariance is not None and back.covariance is not None
    assert back.covariance == pytest.approx(full.covariance, rel=1e-9, abs=1e-20)
    q = joints(machine.kinematics, 30)
    one, two = (m.on(machine.kinematics) for m in (full, back))
    w = one.coordinates(q)
    assert two.place(w)[0] == pytest.approx(one.place(w)[0], abs=1e-10)


def test_tables_of_one_axis_with_iso_names_come_back(tmp_path: Path) -> None:
    table, name = TableCurve(np.linspace(-0.3, 2.0, 7), np.linspace(-1, 1, 14) * 1e-5, both=True), parse("EAC")
    assert name is not None
    (tmp_path / "c.csv").write_text(table_to_csv([Component(name, table)]))
    back, found = read_csv(tmp_path / "c.csv")
    assert back is not None and not found and back.unit == {"C": "deg", "EAC+": "arcsec", "EAC-": "arcsec"}
    assert back.columns["EAC-"] == pytest.approx(table.values[7:], rel=1e-11)
    assert back.columns["C"] == pytest.approx(table.x, rel=1e-11)


def test_csv_takes_semicolons_and_keeps_comments_out(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("\ufeff# note\nX [in];v [um]\n1;2.5\n# more\n2;3\n", encoding="utf-8")
    table, _ = read_csv(tmp_path / "t.csv")
    assert table is not None and table.columns["X"].tolist() == [25.4, 50.8] and table.lines == (3, 5)
    assert write_csv({"X": ("in", table.columns["X"])}) == "X [in]\n1\n2\n"


def test_a_period_wants_its_ends_alike(tmp_path: Path) -> None:
    text = '[components.EXC]\ntable = "c.csv"\nrepeats = 360\n'
    for end, good in ((3, True), (2, False)):
        (tmp_path / "c.csv").write_text(f"C [deg], EXC [um]\n0, 3\n120, 5\n240, 1\n360, {end}\n")
        (tmp_path / "e.toml").write_text(text)
        found, diagnostics = load_checked(tmp_path / "e.toml", mikron())
        assert (found is not None) == good == (not diagnostics)
        if found is not None:
            assert len(found.names) == 3
            assert found.axes.components[0].curve.at(np.array([720.0, 480.0]) * DEG) == pytest.approx([0.003, 0.005])
    assert diagnostics[0].code == "error-model.period"


@pytest.mark.parametrize("text", ["parameter,EC0Y\nEC0Z,1\n",
                                  "parameter,EC0Y\n", "parameter,EC0Y,EX0C\nEC0Y,1,2\nEX0C,2,1\n",
                                  "parameter,EC0Y,EX0C\nEC0Y,1,2\nEX0C,1,9\n", "parameter,EC0Y\nEC0Y,one\n"])
def test_covariances_that_are_none(tmp_path: Path, text: str) -> None:
    (tmp_path / "c.csv").write_text(text)
    matrix, found = read_covariance(tmp_path / "c.csv", ["EC0Y", "EX0C"], ("e.toml", 3))
    assert matrix is None and found[0].code.startswith("error-table.")


def test_samples_are_what_their_script_writes(tmp_path: Path) -> None:
    subprocess.run([sys.executable, SAMPLES / "make_errors.py", tmp_path], check=True, timeout=60)
    made = sorted(p.name for p in tmp_path.iterdir())
    assert made == sorted(p.name for p in SAMPLES.iterdir() if p.suffix != ".py" and p.is_file())
    for name in made:
        assert (tmp_path / name).read_bytes() == (SAMPLES / name).read_bytes()


@pytest.mark.parametrize("path", sorted(SAMPLES.glob("*.toml")), ids=lambda p: p.stem)
def test_samples_are_realistic(path: Path) -> None:
    """10 to 100 um at the tip, and an uncertainty far below that."""
    machine = machines.load(path.stem)
    found = load(path, machine)
    kin = machine.kinematics.with_tool(80.0)
    actual, q = found.on(kin), joints(kin, 200)
    w = actual.coordinates(q)
    moved = np.linalg.norm(deviations(actual, found.zero().on(kin), w)[:, :3], axis=1)
    assert 0.01 < moved.max() < 0.25
    assert uncertainty(found, actual, w).tip_worst.max() < 0.2 * moved.max()


def test_the_schema_knows_the_tables() -> None:
    assert {"components", "location", "legs", "map",
            "base"} <= set(error_model_schema()["properties"])


# ---- LinuxCNC ----------------------------------------------------------------------------------------------

def test_linuxcnc_table_round_trip_both_kinds() -> None:
    name = parse("EXX")
    assert name is not None
    table = TableCurve(np.array([-100.0, 0.0, 250.0]),
                       np.array([0.01, 0.0, -0.02, 0.013, 0.001, -0.03]), both=True)
    text = to_linuxcnc(name, table)
    assert text.splitlines()[0] == "-100.000000000 -99.990000000 -99.987000000"
    back, _ = from_linuxcnc(text, name)
    assert back is not None and back.both and back.values == pytest.approx(table.values, abs=1e-9)
    trims, _ = from_linuxcnc("-100 -0.01 -0.013\n0 0 -0.001\n250 0.02 0.03\n", name, kind=1)
    assert trims is not None and trims.values == pytest.approx(table.values, abs=1e-9)
    turning = parse("ECC")
    assert turning is not None
    one, _ = from_linuxcnc(to_linuxcnc(turning, TableCurve(np.array([0.0, 1.0]), np.array([1e-5, -1e-5])), -1.0), turning,
                           -1.0)
    assert one is not None and not one.both and one.values == pytest.approx([1e-5, -1e-5], abs=1e-10)


@pytest.mark.parametrize("text", ["", "1 2\n", "1 1 1\n0 0 0\n", "a b c\n", "1 nan 1\n"])
def test_linuxcnc_tables_that_are_none(text: str) -> None:
    name = parse("EXX")
    assert name is not None
    table, found = from_linuxcnc(text, name)
    assert table is None and found[0].code.startswith("error-table.")


def test_linuxcnc_holds_positioning_errors_of_256_rows() -> None:
    straightness, positioning = parse("EYX"), parse("EXX")
    assert straightness is not None and positioning is not None
    table = TableCurve(np.arange(300.0), np.zeros(300))
    for name, given, word in ((straightness, table, "positioning"), (positioning, table, "256"),
                              (positioning, TableCurve(np.arange(5.0), np.zeros(5), "spline"), "sampled")):
        with pytest.raises(ValueError, match=word):
            to_linuxcnc(name, given)
    fewer = sampled(Fourier(np.array([0.0, 0.01, 0.0]), 100.0), np.linspace(0.0, 200.0, 81))
    assert to_linuxcnc(positioning, fewer).count("\n") == 81


def empty(letters: tuple[str, ...], nodes: tuple[Floats, ...], **how: object) -> ErrorMap:
    return ErrorMap(letters, nodes, np.zeros((*map(len, nodes), 6)), **how)


# ---- maps --------------------------------------------------------------------------------------------------

def test_a_map_of_a_mill_loses_little_and_less_when_it_is_finer() -> None:
    kin = machines.load("mill-3axis").kinematics
    full = model(kin, 5)
    actual, nominal = full.on(kin), full.zero().on(kin)
    probe, losses = joints(kin, 400, 9), []
    for count in (4, 8, 16):
        nodes = (np.linspace(-150.0, 150.0, count),) * 3
        made = map_of(actual, nominal, empty(("X", "Y", "Z"), nodes), np.zeros(3))
        losses.append(map_loss(ActualByMap(nominal, made), actual, probe))
    before = np.linalg.norm(deviations(actual, nominal, probe)[:, :3], axis=1).max()
    assert losses[0].tip_worst > losses[1].tip_worst > losses[2].tip_worst
    assert losses[2].tip_worst < 0.1 * before and losses[2].tip_rms < losses[2].tip_worst


def test_a_map_holds_at_its_nodes_with_any_tool_and_reads_back(tmp_path: Path) -> None:
    machine = mikron()
    kin = machine.kinematics
    full = model(kin, 5)
    actual, nominal = full.on(kin), full.zero().on(kin)
    nodes = (np.array([-100.0, 50.0]), np.array([0.0, 10.0, 30.0]), np.linspace(-0.5, 0.5, 3),
             np.array([0.1, 1.0]))
    made = map_of(actual, nominal, empty(("X", "Z", "A", "C"), nodes), np.array([0.0, 20.0, 0.0, 0.0, 0.0]))
    back = load(save(ErrorModel(map=made, name="m"), tmp_path)[0], machine)
    assert back.map is not None and back.map.table == pytest.approx(made.table, abs=1e-11)
    longer = kin.with_tool(150.0)
    q = np.array([[50.0, 20.0, 10.0, 0.5, 1.0], [-100.0, 20.0, 0.0, -0.5, 0.1]])
    tip, axis, _ = back.on(longer).place(q)
    wanted_tip, wanted_axis, _ = full.on(longer).place(q)
    assert tip == pytest.approx(wanted_tip, abs=1e-6)
    assert axis == pytest.approx(wanted_axis, abs=1e-9)
    zero = back.zero().on(longer).place(q)
    assert np.array_equal(zero[0], longer.forward(q)[0]) and np.array_equal(zero[1], longer.forward(q)[1])


def test_map_sensitivity_and_range() -> None:
    kin = machines.load("uranesx").kinematics.with_tool(60.0)
    nodes = (np.array([-100.0, 100.0]), np.array([-50.0, 80.0]))
    made = ErrorMap(("x", "y"), nodes, np.random.default_rng(2).normal(size=(2, 2, 6)) * 1e-5)
    actual = ErrorModel(map=made).on(kin)
    w = np.array([[10.0, 20.0, -60.0], [100.0, -50.0, 0.0], [101.0, 0.0, 0.0]])
    tip, _, _ = actual.place(w)
    assert tip - w == pytest.approx(actual.deviation(w, made.values)[:, :3], abs=1e-8)
    assert actual.outside(w).tolist() == [[False] * 3, [False] * 3, [True] * 3]
    assert ErrorModel(map=made).names[7] == "node[0,1].dy"


MAP = "X [mm],Y [mm],dx [um],dy [um],dz [um]\n0,0,1,2,3\n10,0,2,2,3\n0,5,1,2,3\n10,5,1,2,4\n"


@pytest.mark.parametrize(("old", "new", "code"), [("10,5,1,2,4\n", "", "error-map.missing"),
                                                  ("10,5,", "0,5,", "error-map.twice"),
                                                  ("dz [um]", "dw [um]", "error-map.column"),
                                                  ("X [mm]", "X [deg]", "error-map.unit")])
def test_faults_of_lattices(tmp_path: Path, old: str, new: str, code: str) -> None:
    (tmp_path / "m.csv").write_text(MAP.replace(old, new))
    table, _ = read_csv(tmp_path / "m.csv")
    assert table is not None
    found, diagnostics = map_from_csv(table)
    assert found is None and diagnostics[0].code == code


def test_lattice_csv_round_trip_in_any_order(tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text(MAP)
    first, _ = read_csv(tmp_path / "m.csv")
    assert first is not None
    one, _ = map_from_csv(first)
    assert one is not None and one.table[1, 1].tolist() == pytest.approx([0.001, 0.002, 0.004, 0, 0, 0])
    (tmp_path / "n.csv").write_text(map_to_csv(one))
    second, _ = read_csv(tmp_path / "n.csv")
    assert second is not None
    two, _ = map_from_csv(second)
    assert two is not None and np.array_equal(one.table, two.table)


def test_a_component_can_be_put_in_and_the_uncertainty_of_the_others_stays() -> None:
    name = parse("EXX")
    assert name is not None
    old = Component(name, TableCurve(np.array([0.0, 9.0]), np.ones(2)))
    start = ErrorModel(SerialErrors((old,), {"EC0Y": 1e-5, "EB0Z": 1e-5}),
                       covariance=np.diag([1.0, 1.0, 4.0, 9.0]) + np.eye(4)[:, ::-1])
    new = ErrorModel(SerialErrors((Component(name, TableCurve(np.array([0.0, 1.0]), np.zeros(2))),), {"EB0Z": 3e-5}))
    more = merged(start, new)
    assert more.names == ["EXX[0]", "EXX[1]", "EC0Y", "EB0Z"] and more.values.tolist() == [0.0, 0.0, 1e-5, 3e-5]
    assert more.covariance is not None and more.covariance.tolist() == np.diag([0.0, 0.0, 4.0, 0.0]).tolist()
    known = merged(start, ErrorModel(new.axes, covariance=np.diag([5.0, 6.0, 7.0])))
    assert known.covariance is not None and np.diag(known.covariance).tolist() == [5.0, 6.0, 4.0, 7.0]
    assert merged(ErrorModel(start.axes), new).covariance is None
