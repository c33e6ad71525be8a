"""Siemens machine data: units of the parameter manual, vectors of the commissioning manual."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
from machines.exchange.read import import_machine
from machines.machine import Machine
from postproc.job.pivot_vectors import pivot_vectors

AXES = """N10000 $MN_AXCONF_MACHAX_NAME_TAB[0]="X1"
N10000 $MN_AXCONF_MACHAX_NAME_TAB[1]="Y1"
N10000 $MN_AXCONF_MACHAX_NAME_TAB[2]="Z1"
N10000 $MN_AXCONF_MACHAX_NAME_TAB[3]="SP1"
N10000 $MN_AXCONF_MACHAX_NAME_TAB[4]="{first}1"
N10000 $MN_AXCONF_MACHAX_NAME_TAB[5]="{second}1"
CHANDATA(1)
N20070 $MC_AXCONF_MACHAX_USED[0]=1
N20070 $MC_AXCONF_MACHAX_USED[1]=2
N20070 $MC_AXCONF_MACHAX_USED[2]=3
N20070 $MC_AXCONF_MACHAX_USED[3]=5
N20070 $MC_AXCONF_MACHAX_USED[4]=6
N20080 $MC_AXCONF_CHANAX_NAME_TAB[0]="X"
N20080 $MC_AXCONF_CHANAX_NAME_TAB[1]="Y"
N20080 $MC_AXCONF_CHANAX_NAME_TAB[2]="Z"
N20080 $MC_AXCONF_CHANAX_NAME_TAB[3]="{first}"
N20080 $MC_AXCONF_CHANAX_NAME_TAB[4]="{second}"
N24110 $MC_TRAFO_AXES_IN_1[3]=4
N24110 $MC_TRAFO_AXES_IN_1[4]=5
"""
FIGURES = """N30300 $MA_IS_ROT_AX[AX5]=1
N32000 $MA_MAX_AX_VELO[AX1]=30000
N32300 $MA_MAX_AX_ACCEL[0,AX1]=5
N32431 $MA_MAX_AX_JERK[0,AX1]=50
N36100 $MA_POS_LIMIT_MINUS[AX1]=-450
N36110 $MA_POS_LIMIT_PLUS[AX1]=250   ; mm
N32000 $MA_MAX_AX_VELO[AX5]=50
N32300 $MA_MAX_AX_ACCEL[0,AX5]=2
N32431 $MA_MAX_AX_JERK[0,AX5]=20
N36100 $MA_POS_LIMIT_MINUS[AX5]=-120
N36110 $MA_POS_LIMIT_PLUS[AX5]=30
N30310 $MA_ROT_IS_MODULO[AX6]=1
N36110 $MA_POS_LIMIT_PLUS[AX6]=100000000
"""


def imported(folder: Path, text: str, stated: tuple[str, ...] = ()) -> tuple[Machine | None, list[str]]:
    """The machine, and "severity code line" of what is found."""
    (folder / "nc.ini").write_text(text)
    _, machine, found = import_machine(folder / "nc.ini", "auto", stated)
    return machine, [f"{d.severity.name} {d.code} {d.lines[0] if d.lines else 0}" for d in found]


def vector(name: str, values: object, first: int | None = None) -> str:
    """Three assignments: elements 0 to 2, or numbered names of swivel data record 1."""
    return "".join(f"${name}[{k}]={v}\n" if first is None else f"${name}{first + k}[1]={v}\n" for k, v in enumerate(values))


TABLE = "N24100 $MC_TRAFO_TYPE_1=40\n" + vector("MC_TRAFO5_AXIS1_1", (-1, 0, 0)) + vector(
    "MC_TRAFO5_AXIS2_1", (0, 0, -1)) + vector("MC_TRAFO5_BASE_TOOL_1", (0, 0, -600)) + vector(
    "MC_TRAFO5_JOINT_OFFSET_1", (0, 0.02, -50))
CLOSED = vector("MC_TRAFO5_PART_OFFSET_1", (0, -0.02, 650))
AC = AXES.format(first="A", second="C")


def test_units_by_hand(tmp_path: Path) -> None:
    """30000 mm/min are 500 mm/s, 5 m/s2 5000 mm/s2, 50 m/s3 50000 mm/s3; 50 rev/min are 300 deg/s, 2 rev/s2 720, 20 7200."""
    machine, found = imported(tmp_path, AC + TABLE + FIGURES)
    assert machine is not None, found
    limits, x, a, c = machine.limits, 0, 3, 4
    assert (limits.velocity[x], limits.acceleration[x], limits.jerk[x]) == pytest.approx((500.0, 5000.0, 50000.0))
    assert np.degrees((limits.velocity[a], limits.acceleration[a], limits.jerk[a])) == pytest.approx((300.0, 720.0, 7200.0))
    assert (limits.lower[x], limits.upper[x]) == (-450.0, 250.0)
    assert np.degrees((limits.lower[a], limits.upper[a])) == pytest.approx((-120.0, 30.0))
    assert machine.turns[c].modulo and np.isinf(limits.upper[c])
    assert machine.figures["A.velocity"] == "nc.ini: line 39, $MA_MAX_AX_VELO[AX5] = 50"
    assert {"X.travel", "A.jerk"}.isdisjoint(limits.assumed) and {"Y.travel", "C.velocity"} <= limits.assumed


def test_inches_where_the_scaling_is_not_metric(tmp_path: Path) -> None:
    machine = imported(tmp_path, "N10240 $MN_SCALING_SYSTEM_IS_METRIC=0\n" + AC + TABLE + FIGURES)[0]
    assert machine is not None and machine.limits.upper[0] == pytest.approx(6350.0)
    assert np.degrees(machine.limits.velocity[3]) == pytest.approx(300.0)
    assert machine.kinematics.chain[1].point[2] == pytest.approx(-15240.0)


def test_a_table_turns_the_part_about_its_vector(tmp_path: Path) -> None:
    """V1 = -1, 0, 0: the part turns about -x, the tool relative to it about +x, as ISO 841 has A."""
    machine = imported(tmp_path, AC + TABLE)[0]
    assert machine is not None and machine.structure == "w C' A' b X Y Z (C1) t"
    tip, axis = machine.kinematics.forward(np.array([[0, 0, -600.0, np.pi / 2, 0]]))
    np.testing.assert_allclose(tip[0], [0, 0, -600], atol=1e-9)
    np.testing.assert_allclose(axis[0], [0, -1, 0], atol=1e-9)


def dump(machine: Machine, record: bool) -> str:
    """Machine data of a machine of ours, by the vectors that its programs state for the control (header of the program)."""
    vectors = {v.kind: v.value for v in pivot_vectors(machine)}
    ends = {v.end for v in pivot_vectors(machine) if v.end}
    tables = [v.end for v in pivot_vectors(machine) if v.kind in ("table", "table_to_table")]
    heads = [v.end for v in pivot_vectors(machine) if v.kind in ("tool_to_head", "head_to_head")]
    order = [*reversed(heads), *tables]  # axis 2 is based on axis 1
    kind = "M" if tables and heads else "P" if tables else "T"
    base, joint = (("table", "table_to_table") if kind == "P" else ("tool_to_head", "table") if kind == "M" else
                   ("tool_to_head", "head_to_head"))
    none = np.zeros(3)
    text = AXES.format(first=order[0], second=order[1] if order[1:] else "W")
    assert ends == set(order)
    for k, name in enumerate(order):
        axis = next(j for j in machine.kinematics.chain if j.name == name)
        along = axis.direction * (-1.0 if name in tables else 1.0)
        text += vector("TC_CARR", along, 7 + 3 * k) if record else vector(f"MC_TRAFO5_AXIS{k + 1}_1", along)
    if record:
        first = (15, 4) if kind == "T" else (4, 15)
        return text + vector("TC_CARR", vectors[base], first[0]) + vector(
            "TC_CARR", vectors.get(joint, none), first[1]) + f'$TC_CARR23[1]="{kind}"\n'
    part = "_PART" if kind == "M" else ""
    number = {"T": 24, "P": 40, "M": 56}[kind]
    return text + f"$MC_TRAFO_TYPE_1={number}\n" + vector(
        "MC_TRAFO5_BASE_TOOL_1", vectors[base]) + vector(f"MC_TRAFO5_JOINT_OFFSET{part}_1", vectors.get(joint, none))


FIVE = ["mikron-ucp710", "trunnion-bc", "head-table", "fork-head-ab", "nutating-head", "mill-4axis"]


@pytest.mark.parametrize("record", [False, True], ids=["traori", "swivel data"])
@pytest.mark.parametrize("name", FIVE)
def test_what_the_header_of_a_program_states_gives_the_machine_back(name: str, record: bool, tmp_path: Path) -> None:
    ours = machines.load(name)
    back, found = imported(tmp_path, dump(ours, record))
    assert back is not None, found
    assert back.axis_names == ours.axis_names
    q = np.random.default_rng(4).uniform(-1.2, 1.2, (40, len(ours.home))) * np.where(ours.rotary, 1.0, 100.0)
    for mine, theirs in zip(back.kinematics.forward(q)[:2], ours.kinematics.forward(q)[:2], strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-9)


@pytest.mark.parametrize(("old", "new", "code"), [
    ("TRAFO_TYPE_1=40", "TRAFO_TYPE_1=49", "ERROR import.kinematics 20"),
    ("N24100 $MC_TRAFO_TYPE_1=40", '$NK_NAME[0]="ROOT"', "ERROR import.kinematics 20"),
    ("[2]=-600", "[2]=-600,5", "ERROR import.number 29"),
    ("[0]=-1", "[0]=one", "ERROR import.number 21"),
    ("$MC_TRAFO5_BASE_TOOL_1[2]=-600\n", "", "WARNING import.default 20"),
    ("TRAFO_TYPE_1=40", "TRAFO_TYPE_1=33", "INFO import.sense 20"),
    ("N24100", "$MC_TRAFO5_ROT_AX_OFFSET_1[0]=90\nN24100", "ERROR import.kinematics 20"),
    ("N24100", "$MC_TRAFO5_ROT_SIGN_IS_PLUS_1[1]=0\nN24100", "ERROR import.kinematics 20"),
    ("N24100", "N36110 $MA_POS_LIMIT_PLUS[AX1]=far\nN32000 $MA_MAX_AX_VELO[AX1]=fast\nN24100", "ERROR import.number 21"),
    ("N24100", "N36110 $MA_POS_LIMIT_PLUS[AX1]=300\nN24100", "ERROR import.travel 20"),
    ("N24100", "N36110 $MA_POS_LIMIT_PLUS(AX1)=300\nN24100", "WARNING import.line 20"),
    ("N24100", "N24100 $MC_TRAFO_TYPE_1=24\nN24100", "WARNING import.contradiction 21"),
    ("N24100", "$MC_TRAFO5_JOINT_OFFSET_PART_1[2]=-51\nN24100", "ERROR import.contradiction 20"),
    ("N24100", '$TC_CARR23[1]="P"\n$TC_CARR7[1]=-1\n$TC_CARR12[1]=-1\n$TC_CARR6[1]=-599\nN24100',
     "WARNING import.contradiction 20"),
    ("N24100", "$MC_TRAFO5_PART_OFFSET_1[2]=-650\nN24100", "WARNING import.contradiction 20"),
    ("N24100 $MC_TRAFO_TYPE_1=40", "N24100 $MC_TRAFO_TYPE_1=18", "ERROR import.geometry 20"),
    ("N24100", '$TC_CARR23[1]="P"\n$TC_CARR7[1]=-1\n$TC_CARR46[1]=0.004\nN24100', "WARNING import.fine 22"),
])
def test_what_is_wrong_is_said_with_its_line(old: str, new: str, code: str, tmp_path: Path) -> None:
    found = imported(tmp_path, AC + TABLE.replace(old, new, 1))[1]
    assert code in found
    assert sum(one.startswith("ERROR") for one in found) <= max(1, new.count("=")), "one cause, one line"


def test_a_file_cut_off_before_its_vectors_has_no_axes_at_the_zero(tmp_path: Path) -> None:
    assert imported(tmp_path, AC + TABLE[:TABLE.index("$MC_TRAFO5_BASE")])[1] == ["ERROR import.geometry 20"]


def test_other_ways_to_write_the_same(tmp_path: Path) -> None:
    """Several assignments in a line, small letters, TRUE and FALSE for 1 and 0."""
    plain = imported(tmp_path, "$MN_SCALING_SYSTEM_IS_METRIC=0\n" + AC + TABLE + FIGURES)[0]
    one_line = TABLE.replace("\n$MC_TRAFO5_BASE", " $MC_TRAFO5_BASE").replace("=1\n", "=TRUE\n")
    other = imported(tmp_path, "$MN_SCALING_SYSTEM_IS_METRIC=FALSE\n" + (AC + one_line).replace("$MC", "$mc")
                     + FIGURES.replace("MODULO[AX6]=1", "MODULO[ax6]=TRUE"))[0]
    assert plain is not None and other is not None and plain.turns == other.turns
    for mine, theirs in zip(plain.kinematics.chain, other.kinematics.chain, strict=True):
        np.testing.assert_array_equal([mine.point, mine.direction], [theirs.point, theirs.direction])


def test_older_types_have_axes_along_their_letters(tmp_path: Path) -> None:
    """Type 33 is the table of type 40 with A along X and C along Z; type 20 = 16 + 4 is a head whose C turns its A."""
    table, found = imported(tmp_path, AC + TABLE + CLOSED)
    assert not any("WARNING" in one for one in found), found
    older = imported(tmp_path, AC + TABLE.replace("TYPE_1=40", "TYPE_1=33"))[0]
    head = imported(tmp_path, AXES.format(first="C", second="A") + TABLE.replace("TYPE_1=40", "TYPE_1=20"))[0]
    assert table is not None and older is not None and head is not None
    q = np.array([[10.0, 20.0, 30.0, 0.5, 0.7]])
    for one, other in zip(table.kinematics.forward(q), older.kinematics.forward(q), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    assert (older.structure, head.structure) == (table.structure, "w b X Y Z C A (C1) t")
    points = {joint.name: joint for joint in head.kinematics.chain if joint.rotary}
    np.testing.assert_allclose(points["A"].point, [0.0, 0.0, -600.0])
    np.testing.assert_allclose(points["C"].point, [0.0, 0.02, -650.0])
    np.testing.assert_allclose([points["A"].direction, points["C"].direction], [[1, 0, 0], [0, 0, 1]])


def test_other_channels_are_left_out(tmp_path: Path) -> None:
    machine = imported(tmp_path, AC + TABLE + "CHANDATA(2)\nN24100 $MC_TRAFO_TYPE_1=24\n")[0]
    assert machine is not None and machine.structure == "w C' A' b X Y Z (C1) t"


def test_a_transformation_that_lacks_an_axis_is_one_fault(tmp_path: Path) -> None:
    """That nothing else says where the axes are is no second one."""
    (tmp_path / "m.arc").write_text(AXES.format(first="A", second="C") + "N24100 $MC_TRAFO_TYPE_1=24\n")
    found = [d for d in import_machine(tmp_path / "m.arc", "auto", ())[2] if d.code == "import.geometry"]
    assert [d.message for d in found] == ["$MC_TRAFO_TYPE_1 = 24, and no $MC_TRAFO5_AXIS1_1"]
    (tmp_path / "m.arc").write_text(AXES.format(first="A", second="C"))
    [other] = [d for d in import_machine(tmp_path / "m.arc", "auto", ())[2] if d.code == "import.geometry"]
    assert "neither a transformation" in other.message
