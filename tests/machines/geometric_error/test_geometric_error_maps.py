"""Error maps: round about rotary axes, directions of table or machine, stated point and zero, made to a stated loss."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.actual_map import ActualByMap, part_side
from machines.geometric_error.actual.model import ErrorModel, uncertainty
from machines.geometric_error.actual.serial_errors import SerialErrors
from machines.geometric_error.exchange.make_map import map_loss, map_of, nodes_of, refined
from machines.geometric_error.exchange.volume import middle, samples
from machines.geometric_error.exchange.write_model import save
from machines.geometric_error.files.loader import load, load_checked
from machines.geometric_error.tables.csv_table import read_csv
from machines.geometric_error.tables.lattice import ErrorMap
from machines.geometric_error.tables.lattice_file import map_from_csv
from tests.machines.error_models import ARCSEC, joints, model
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, Severity
from toolpaths.units import DEG


def random_map(letters: tuple[str, ...], nodes: tuple[Floats, ...], **how: object) -> ErrorMap:
    table = np.random.default_rng(1).normal(size=(*map(len, nodes), 6)) * [0.03, 0.03, 0.03, 3e-5, 3e-5, 3e-5]
    return ErrorMap(letters, nodes, table, **how)


def loaded(folder: Path, table: str, keys: str = "") -> tuple[ErrorModel | None, list[Diagnostic]]:
    (folder / "m.csv").write_text(table)
    (folder / "e.toml").write_text(f'[map]\ntable = "m.csv"\n{keys}')
    return load_checked(folder / "e.toml", machines.load("mikron-ucp710"))


def test_a_coordinate_of_the_point_that_is_outside_counts_for_the_slides_that_move_it() -> None:
    ends = (np.array([-100.0, 100.0]),) * 3
    trunnion = "mikron-ucp710"
    for name, turn, wanted in (("mill-3axis", [], "Z"), (trunnion, [0.0, 0.3], "Z"),
                               (trunnion, [0.5, 0.3], "YZ")):
        machine = machines.load(name)
        actual = ErrorModel(map=random_map(("x", "y", "z"), ends)).on(machine.kinematics)
        assert isinstance(actual, ActualByMap)
        out = actual.outside(np.array([[0.0, 0.0, 150.0, *turn], [0.0, 0.0, 50.0, *turn]]))
        assert "".join(np.array(machine.axis_names)[out[0]]) == wanted and not out[1].any()


def test_nodes_of_one_place_ask_for_no_closer_look() -> None:
    """As of tables; from the last node of a coordinate that goes round to the first one counts too."""
    nodes = (np.array([-100.0, 0.0, 0.001, 100.0]), np.array([0.0, 1.0, 2.0]))
    given = ErrorModel(map=random_map(("x", "C"), nodes, periods=(0.0, 2.5)))
    assert given.detail(("X", "Y", "Z", "C")) == pytest.approx([0.1, 0.1, 0.1, 0.5])


# ---- round about -------------------------------------------------------------------------------------------

ROUND = "C [deg],dx [um],dy [um],dz [um]\n0,1,2,3\n90,5,2,3\n200,9,2,3\n360,1,2,3\n"


def test_a_map_goes_round_a_rotary_axis(tmp_path: Path) -> None:
    found, faults = loaded(tmp_path, ROUND, "repeats = { C = 360 }")
    assert found is not None and found.map is not None and not faults
    assert found.map.table.shape == (3, 6) and found.map.nodes[0] == pytest.approx(np.array([0.0, 90.0, 200.0]) * DEG)
    at = found.map.at(np.array([[45.0], [280.0], [-80.0], [360.0], [720.0 + 145.0]]) * DEG)
    assert at[:, 0] == pytest.approx([0.003, 0.005, 0.005, 0.001, 0.007])
    actual = found.on(machines.load("mikron-ucp710").kinematics)
    q = np.array([[0.0, 0.0, 0.0, 0.0, 50.0]])
    assert not actual.outside(q).any()
    still, faults = loaded(tmp_path, ROUND)
    assert still is not None
    assert still.on(machines.load("mikron-ucp710").kinematics).outside(q)[0].tolist() == [False] * 4 + [True]
    save(replace(found, name="back"), tmp_path)
    back = load(tmp_path / "back.toml", machines.load("mikron-ucp710")).map
    assert back is not None and back.periods == pytest.approx(found.map.periods)
    assert np.array_equal(back.table, found.map.table)


@pytest.mark.parametrize(("old", "new", "keys", "code", "word"), [
    ("360,1,", "360,1.5,", "repeats = { C = 360 }", "error-map.period", "differ by up to 0.5 um"),
    ("360,1,", "370,1,", "repeats = { C = 360 }", "error-map.period", "span 370"),
    ("", "", "repeats = { A = 360 }", "error-map.period", "A is not a coordinate"),
    ("", "", "repeats = { C = -360 }", "file.range", "repeats.C"),
    ("", "", "zero = { X = 1.0 }", "error-map.zero", "the map has C"),
    ("", "", "zero = { C = 400.0 }", "error-map.zero", "outside"),
    ("", "", 'directions = "bed"', "file.range", "directions")])
def test_faults_of_what_a_map_states(tmp_path: Path, old: str, new: str, keys: str, code: str,
                                     word: str) -> None:
    found, faults = loaded(tmp_path, ROUND.replace(old, new, 1), keys)
    assert found is None and faults[0].code == code and word in str(faults[0]), faults


# ---- what it states ----------------------------------------------------------------------------------------

def test_zero_and_sign_of_a_measured_map(tmp_path: Path) -> None:
    table = "X [mm],Y [mm],dx [um],dy [um],dz [um]\n0,0,1,2,3\n10,0,2,2,3\n0,5,1,2,3\n10,5,1,2,4\n"
    found, _ = loaded(tmp_path, table, "sign = -1\nzero = { X = 10.0, Y = 0.0 }")
    assert found is not None and found.map is not None
    assert found.map.table[1, 0] == pytest.approx(np.zeros(6), abs=1e-15)
    assert found.map.table[0, 0] == pytest.approx([0.001, 0, 0, 0, 0, 0], abs=1e-15)
    assert found.map.table[1, 1] == pytest.approx([0.001, 0, -0.001, 0, 0, 0], abs=1e-15)


def test_the_uncertainty_at_the_stated_zero_is_none_and_elsewhere_that_of_both(tmp_path: Path) -> None:
    table = "X [mm],dx [um],dy [um],dz [um]\n0,1,2,3\n10,2,2,3\n30,1,2,3\n"
    found, _ = loaded(tmp_path, table, "zero = { X = 5.0 }\n[sigma]\nnode = 2.0\n")
    assert found is not None and found.covariance is not None
    kin = machines.load("mikron-ucp710").kinematics
    q = np.array([[5.0, 0, 0, 0, 0], [30.0, 0, 0, 0, 0]])
    spread = uncertainty(found, found.on(kin), q).tip
    assert spread[0] == pytest.approx(np.zeros(3), abs=1e-12)  # the mean of the first two nodes, less itself
    assert spread[1] == pytest.approx(np.full(3, 0.002 * np.sqrt(1.5)))


def test_the_stated_point_is_displaced_whatever_the_tool(tmp_path: Path) -> None:
    """A map of a tip 120 mm out: that tip is displaced by the table's value, another one by the turn besides."""
    made = random_map(("X", "Z"), (np.array([-50.0, 50.0]), np.array([0.0, 80.0])), length=120.0)
    kin, q = machines.load("mikron-ucp710").kinematics, np.array([[50.0, 7.0, 80.0, 0.4, 1.0]])
    same, longer = (ErrorModel(map=made).on(kin.with_tool(length)) for length in (120.0, 170.0))
    assert same.place(q)[0] - kin.with_tool(120.0).forward(q)[0] == pytest.approx(made.table[1:, 1, :3], abs=1e-12)
    tip, axis, _ = longer.place(q)
    assert tip == pytest.approx(same.place(q)[0] - 50.0 * axis, abs=1e-12)


@pytest.mark.parametrize("name", ["mikron-ucp710", "linuxcnc-xyzac-trt", "head-table", "h4a-c-table"])
def test_directions_of_the_machine_turn_with_the_table(name: str) -> None:
    """A constant map along machine axes: what the table sees turns against it, as the chain's own forward has it."""
    machine = machines.load(name)
    kin = machine.kinematics
    bed = part_side(kin, machine.structure)
    assert bed == {"mikron-ucp710": ("C", "A"), "linuxcnc-xyzac-trt": ("C", "A"), "head-table": ("C",),
                   "h4a-c-table": ("C",)}[name]
    table = np.tile([0.01, -0.02, 0.03, 0.0, 0.0, 0.0], (2, 1))
    made = ErrorMap(("Z",), (np.array([-1e4, 1e4]),), table, bed=bed)
    q = joints(kin, 20)
    actual = ErrorModel(map=made).on(kin)
    w = actual.coordinates(q)
    moved = actual.place(w)[0] - kin.forward(q)[0]
    if name == "h4a-c-table":
        c = kin.axis.sense * q[:, 4]
        x, y = 0.01 * np.cos(c) + 0.02 * np.sin(c), 0.01 * np.sin(c) - 0.02 * np.cos(c)
        wanted = np.stack([x, y, 0.03 + 0.0 * c], axis=1)
    else:  # the slides stand on the bed: moving them is a displacement along the machine's axes
        slides = q.copy()
        slides[:, :3] += table[0, :3]
        wanted = kin.forward(slides)[0] - kin.forward(q)[0]
        if name == "head-table":  # X' stands under C', which is nearest the part
            assert machine.structure.startswith("w C' X'")
    assert moved == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("bed", [(), ("C", "A")])
def test_sensitivity_is_the_derivative_by_every_value(bed: tuple[str, ...]) -> None:
    nodes = (np.array([-100.0, 100.0]), np.array([0.0, 2.0, 4.0]))
    zero = random_map(("X", "C"), nodes, periods=(0.0, 2.0 * np.pi), length=30.0, bed=bed)
    zero = zero.with_values(0.0 * zero.values)
    kin, step = machines.load("mikron-ucp710").kinematics.with_tool(90.0), 1e-5
    q = joints(kin, 6)
    q[:, 0] *= 0.5
    q[:, 4] += 4.0
    columns, axis = ErrorModel(map=zero).on(kin).sensitivity(q), kin.forward(q)[1]
    for k in range(len(zero.values)):
        unit = np.eye(len(zero.values))[k] * step
        up, down = (ErrorModel(map=zero.with_values(sign * unit)).on(kin).place(q) for sign in (1.0, -1.0))
        assert (up[0] - down[0]) / (2 * step) == pytest.approx(columns[:, :3, k], rel=1e-6, abs=1e-7)
        assert (up[1] - down[1]) / (2 * step) == pytest.approx(np.cross(columns[:, 3:, k], axis), abs=1e-8)


# ---- made from a model -------------------------------------------------------------------------------------

@pytest.mark.parametrize(("name", "letters"), [("mikron-ucp710", "XYZ"), ("mikron-ucp710", "xyz"), ("head-table", "xzC"),
                                               ("uranesx", "xyz"), ("h4a-c-table", "xyzC"), ("h4a-spindle-axis", "xyz")])
def test_a_map_says_at_its_nodes_what_its_model_says(name: str, letters: str) -> None:
    machine = machines.load(name)
    kin = machine.kinematics
    full = model(kin, 4)
    actual, nominal = full.on(kin), full.zero().on(kin)
    fixed = middle(machine)
    fixed = fixed + (0.3 if any(kin.rotary) else 0.0) * np.array(kin.rotary)
    point = ActualByMap(nominal, random_map(tuple("xyz"), (np.zeros(1),) * 3))
    at = point.lattice_places(nominal.coordinates(fixed[None]))[0]
    centre = [at["xyz".index(x)] if x in "xyz" else float(fixed[kin.axis_names.index(x)]) for x in letters]
    about = {True: np.array([-0.4, 0.1, 0.5]), False: np.array([-40.0, 25.0])}
    nodes = tuple(c + about[x == "C"] for c, x in zip(centre, letters, strict=True))
    made = map_of(actual, nominal, random_map(tuple(letters), nodes, bed=part_side(kin, machine.structure)), fixed)
    by_map = ErrorModel(map=made).on(kin)
    w = nodes_of(ActualByMap(nominal, made), made.places(), fixed)
    assert by_map.lattice_places(w) == pytest.approx(made.places(), abs=1e-9)
    for one, two in zip(by_map.place(w), actual.place(w), strict=True):
        assert one == pytest.approx(two, abs=1e-11)
    assert np.abs(made.table[..., :3]).max() > 1e-3


def test_a_map_out_of_reach_is_refused() -> None:
    kin = machines.load("uranesx").kinematics
    full = model(kin)
    wide = random_map(("x", "y", "z"), (np.array([-2e3, 0.0]),) * 3)
    with pytest.raises(ValueError, match="node x -2000, y -2000, z -2000 is out of reach"):
        map_of(full.on(kin), full.zero().on(kin), wide, middle(machines.load("uranesx")))
    with pytest.raises(ValueError, match="tool is 50 mm long, the map's 0"):
        map_of(full.on(kin.with_tool(50.0)), full.zero().on(kin.with_tool(50.0)), wide, np.zeros(3))


def test_a_map_is_refined_to_a_stated_loss_and_no_further() -> None:
    machine = machines.load("mill-3axis")
    kin, full = machine.kinematics, model(machines.load("mill-3axis").kinematics, 5)
    actual, nominal = full.on(kin), full.zero().on(kin)
    base = random_map(("X", "Y", "Z"), (np.array([-150.0, 150.0]),) * 3)
    sizes, probe = [], joints(kin, 3000, 9)
    for loss in (0.01, 0.003):
        made, noted = refined(actual, nominal, base, np.zeros(3), loss, 500_000)
        found = map_loss(ErrorModel(map=made).on(kin), actual, probe)
        assert noted.tip_worst <= loss and found.tip_worst < 1.05 * loss
        half = tuple(np.linspace(x[0], x[-1], max(2, len(x) // 2)) for x in made.nodes)
        coarser = map_of(actual, nominal, random_map(base.letters, half), np.zeros(3))
        assert map_loss(ErrorModel(map=coarser).on(kin), actual, probe).tip_worst > loss
        sizes.append(made.table.size)
    assert sizes[0] < sizes[1]
    with pytest.raises(ValueError, match="takes more than 1000 nodes"):
        refined(actual, nominal, base, np.zeros(3), 1e-5, 1000)


def test_a_linear_error_needs_two_nodes() -> None:
    kin = machines.load("mill-3axis").kinematics
    square = ErrorModel(SerialErrors(constants={"EC0Y": 20 * ARCSEC}))
    base = random_map(("X", "Y", "Z"), (np.array([-150.0, 150.0]),) * 3)
    made, loss = refined(square.on(kin), square.zero().on(kin), base, np.zeros(3), 1e-4, 1000)
    assert made.table.shape == (2, 2, 2, 6) and loss.tip_worst < 1e-5


# ---- rows --------------------------------------------------------------------------------------------------

def test_scattered_rows_are_reported_before_memory_is_asked_for(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    rows = "\n".join(",".join(f"{x:.4f}" for x in row) for row in rng.uniform(-1, 1, (2000, 6)))
    (tmp_path / "m.csv").write_text(f"X [mm],Y [mm],Z [mm],dx [um],dy [um],dz [um]\n{rows}\n")
    table, _ = read_csv(tmp_path / "m.csv")
    assert table is not None
    found, faults = map_from_csv(table)
    assert found is None and faults[0].code == "error-map.scattered" and "there are 2000" in faults[0].message


@pytest.mark.parametrize("name", ["mikron-ucp710", "uranesx", "h4a-c-table", "h4a-spindle-axis", "mill-3axis"])
def test_the_volume_is_where_machine_and_model_hold(name: str) -> None:
    machine = machines.load(name)
    full = model(machine.kinematics)
    actual = full.on(machine.kinematics.with_tool(100.0))
    w = samples(full, machine, actual, 500)
    q = actual.joints(w)
    assert len(w) > 250 and np.isfinite(q).all() and not actual.outside(w).any()
    assert (q >= machine.limits.lower - 1e-6).all() and (q <= machine.limits.upper + 1e-6).all()
    assert np.isfinite(machine.kinematics.forward(middle(machine)[None])[0]).all()


def test_the_uncertainty_of_more_parameters_than_are_held_is_left_out_and_reported(tmp_path: Path,
                                                                         monkeypatch: pytest.MonkeyPatch) -> None:
    table = "X [mm],dx [um],dy [um],dz [um]\n-300,1,0,0\n300,3,0,0\n"
    found, faults = loaded(tmp_path, table, "[sigma]\nnode = 0.5\n")
    assert found is not None and found.covariance is not None and found.covariance.shape == (12, 12) and not faults
    (tmp_path / "c.csv").write_text("parameter,node[1].dy,node[0].dx\nnode[1].dy,4,1\nnode[0].dx,1,9\n")
    covariance = '[covariance]\ntable = "c.csv"\n'
    some, faults = loaded(tmp_path, table, covariance)
    assert some is not None and some.covariance is not None and not faults
    assert some.covariance[0, [0, 7]] == pytest.approx([9e-6, 1e-6]) and np.count_nonzero(some.covariance) == 4
    monkeypatch.setattr("machines.geometric_error.files.covariance.MOST", 11)
    for keys, code in (("[sigma]\nnode = 0.5\n", "error-model.sigma"),
                       (covariance, "error-model.covariance")):
        found, faults = loaded(tmp_path, table, keys)
        assert found is not None and found.map is not None and found.covariance is None
        assert [(d.code, d.severity, d.lines) for d in faults] == [(code, Severity.WARNING, (3,))]
        assert "12 parameters" in faults[0].message
