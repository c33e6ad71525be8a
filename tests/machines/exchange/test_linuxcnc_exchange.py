"""LinuxCNC's INI and HAL: what is read from where, in which unit, and a machine that goes there and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
from machines.exchange.export import export_linuxcnc
from machines.exchange.linuxcnc_files import EDGE
from machines.exchange.read import import_machine
from machines.machine import Machine

HEADER = """[EMC]
MACHINE = shop mill
VERSION = 1.1
[KINS]
KINEMATICS = {kins}
JOINTS = {joints}
[HAL]
HALFILE = shop.hal
[TRAJ]
COORDINATES = {letters}
LINEAR_UNITS = {unit}
ANGULAR_UNITS = degree
"""
JOINT = """[JOINT_{k}]
TYPE = {kind}
MIN_LIMIT = {low}
MAX_LIMIT = {high}
MAX_VELOCITY = {velocity}
MAX_ACCELERATION = {acceleration}
HOME = {home}
"""
TRT_HAL = """setp xyzac-trt-kins.x-rot-point 5
setp xyzac-trt-kins.y-rot-point -3   # measured
setp xyzac-trt-kins.z-rot-point 7
net across xyzac-trt-kins.y-offset
sets across 20
setp xyzac-trt-kins.z-offset [TABLE]UP
net len motion.tooloffset.z => xyzac-trt-kins.tool-offset
"""


OTHER_FORMS = """xyzac-trt-kins.x-rot-point = 5
xyzac-trt-kins.y-rot-point=-3   # measured
source pivots.hal
"""
"""the same pins as halcmd(1) has them otherwise"""


def joint(k: int, kind: str = "LINEAR", low: float = -10, high: float = 12, velocity: float = 4, acceleration: float = 50,
          home: float = 0) -> str:
    return JOINT.format(k=k, kind=kind, low=low, high=high, velocity=velocity, acceleration=acceleration, home=home)


def imported(folder: Path, ini: str, hal: str = "", stated: tuple[str, ...] = ()) -> tuple[str, Machine | None, list[str]]:
    """Text, machine and "severity code line" of what is found."""
    (folder / "shop.ini").write_text(ini)
    (folder / "shop.hal").write_text(hal)
    text, machine, found = import_machine(folder / "shop.ini", "auto", stated)
    return text, machine, [f"{d.severity.name} {d.code} {d.lines[0] if d.lines else 0}" for d in found]


def trt(unit: str = "mm", extra: str = "") -> str:
    turning = joint(3, "ANGULAR", -100, 50, 30, 300) + joint(4, "ANGULAR", -36000, 36000, 60, 600)
    return (HEADER.format(kins="xyzac-trt-kins", joints=5, letters="XYZAC", unit=unit) + "".join(map(joint, range(3)))
            + turning + "[TABLE]\nUP = 10\n" + extra)


def test_inch_per_second_becomes_mm_per_second_and_degrees_stay(tmp_path: Path) -> None:
    """By hand: 4 in/s is 101.6 mm/s (6.096 m/min), 50 in/s2 1270 mm/s2, 12 in 304.8 mm; 30 deg/s stays."""
    machine = imported(tmp_path, trt("inch"), TRT_HAL)[1]
    assert machine is not None
    assert machine.limits.velocity[0] == pytest.approx(101.6) and machine.limits.acceleration[0] == pytest.approx(1270.0)
    assert machine.limits.upper[0] == pytest.approx(304.8)
    assert np.degrees(machine.limits.velocity[3]) == pytest.approx(30.0)
    control = machine.control_kinematics
    assert control is not None and control.pins["xyzac-trt-kins.y-offset"] == pytest.approx(508.0)


def test_units_as_a_number_are_units_per_mm(tmp_path: Path) -> None:
    """0.03937... units per mm are inches: 4 of them per s are 101.6 mm/s."""
    machine = imported(tmp_path, trt(repr(1 / 25.4)), TRT_HAL)[1]
    assert machine is not None and machine.limits.velocity[0] == pytest.approx(101.6)


def test_pivots_come_from_hal(tmp_path: Path) -> None:
    """The built-in machine has the same pins: setp, a signal that is set, a key of the INI."""
    text, machine, found = imported(tmp_path, trt(), TRT_HAL)
    own, ours = machines.load("linuxcnc-xyzac-trt"), machine
    assert ours is not None and ours.control_kinematics == own.control_kinematics
    q = np.random.default_rng(2).uniform(-1.5, 1.5, (50, 5)) * [100, 100, 100, 1, 2]
    for mine, theirs in zip(ours.kinematics.forward(q), own.kinematics.forward(q), strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-9)
    assert 'point = "file: line 1, setp xyzac-trt-kins.x-rot-point 5, setp' in text
    assert ours.figures["X.velocity"] == "shop.ini: line 17, [JOINT_0] MAX_VELOCITY = 4"
    assert found == ["INFO import.assumed 0"]
    (tmp_path / "pivots.hal").write_text("\n".join(TRT_HAL.splitlines()[2:]))
    for hal in (OTHER_FORMS, OTHER_FORMS.replace("xyzac", "setp xyzac", 1)):
        other = imported(tmp_path, trt(), hal)[1]
        assert other is not None and other.control_kinematics == own.control_kinematics, "were LinuxCNC's defaults, unsaid"
    assert "WARNING import.file 3" in imported(tmp_path, trt(), OTHER_FORMS.replace("pivots", "none"))[2]
    assert ours.limits.assumed == {f"{letter}.jerk" for letter in "XYZAC"}


def test_a_pin_that_is_set_nowhere_is_linuxcncs_default_and_said_where_a_file_was_not_read(tmp_path: Path) -> None:
    ini = trt().replace("HALFILE = shop.hal", "HALFILE = LIB:basic_sim.tcl")
    machine, found = imported(tmp_path, ini)[1:]
    assert machine is not None and machine.control_kinematics is not None
    assert machine.control_kinematics.pins["xyzac-trt-kins.y-offset"] == 0.0
    assert found.count("WARNING import.pin 8") == 1, "one cause, one line"


def test_a_pin_that_something_drives_is_refused_until_it_is_stated(tmp_path: Path) -> None:
    hal = TRT_HAL.replace("sets across 20", "net across table-gui.offset")
    assert "ERROR import.pin 4" in imported(tmp_path, trt(), hal)[2]
    machine = imported(tmp_path, trt(), hal, ("xyzac-trt-kins.y-offset=20",))[1]
    assert machine is not None and machine.control_kinematics is not None
    assert machine.control_kinematics.pins["xyzac-trt-kins.y-offset"] == 20.0


@pytest.mark.parametrize("value", ["1", "TRUE"])
def test_pins_that_turn_axes_round_are_refused(value: str, tmp_path: Path) -> None:
    hal = TRT_HAL + f"setp xyzac-trt-kins.conventional-directions {value}\n"
    assert "ERROR import.pin 8" in imported(tmp_path, trt(), hal)[2]


def test_the_pivot_length_of_a_head_is_a_sum_with_the_tool(tmp_path: Path) -> None:
    """As LinuxCNC's own bridge mill: sum2 of a length and the tool's."""
    ini = HEADER.format(kins="5axiskins coordinates=XYZBCW", joints=6, letters="XYZBCW", unit="mm") + "".join(
        map(joint, (0, 1, 2, 5))) + joint(3, "ANGULAR", -120, 120, 60, 200) + joint(4, "ANGULAR", -360, 360, 60, 200)
    hal = """loadrt sum2 names=s
setp s.in0 250
net tool motion.tooloffset.z => s.in1
net pivot s.out => 5axiskins.pivot-length
"""
    machine, found = imported(tmp_path, ini, hal)[1:]
    assert machine is not None and machine.control_kinematics is not None
    assert found[0] == "WARNING import.axis 10"
    assert machine.control_kinematics.pins == {"pivotsum.in0": 250.0}
    turned = np.array([[0.0, 0, 0, np.pi / 2, 0.0]])  # s2r(250, 0, 90 deg): tip 250 along x, up by the pivot length
    tip, axis = machine.kinematics.forward(turned)
    np.testing.assert_allclose(tip[0], [250, 0, 250], atol=1e-9)
    np.testing.assert_allclose(axis[0], [-1, 0, 0], atol=1e-9)


TRIVIAL = HEADER.format(kins="trivkins coordinates=XYZA", joints=4, letters="XYZA", unit="mm") + "".join(
    map(joint, range(3))) + joint(3, "ANGULAR", -360, 360, 30, 300)


def test_trivkins_does_not_say_where_a_rotary_axis_is(tmp_path: Path) -> None:
    assert "ERROR import.geometry 5" in imported(tmp_path, TRIVIAL)[2]
    own = "[POSTPROC]\nSTRUCTURE = w A' X' b Y Z (C1) t\nPOINT_A = 0 0 55.5\n"
    for ini, stated in ((TRIVIAL + own, ()), (TRIVIAL, ("kinematics.structure=w A' X' b Y Z (C1) t",
                                                       "kinematics.axes.A.point=[0, 0, 55.5]"))):
        machine = imported(tmp_path, ini, "", stated)[1]
        assert machine is not None and machine.structure == "w A' X' b Y Z (C1) t"
        np.testing.assert_allclose(machine.kinematics.forward(np.array([[0, 0, 0, np.pi]]))[0][0], [0, 0, 111], atol=1e-9)


def test_the_tighter_of_joint_and_axis_counts_and_the_path_speed_is_a_largest_feed(tmp_path: Path) -> None:
    """3.5 mm/s on the path is F210; the axes alone could do 4."""
    cap = "LINEAR_UNITS = mm\nMAX_LINEAR_VELOCITY = 3.5\n"
    machine, found = imported(tmp_path, TRIVIAL.replace("LINEAR_UNITS = mm\n", cap).replace("XYZA", "XYZ")
                              + "[AXIS_X]\nMIN_LIMIT = -9\nMAX_VELOCITY = 5\n")[1:]
    assert machine is not None and machine.limits.lower[0] == -9.0 and machine.limits.velocity[0] == 3.5
    assert machine.largest_feed == pytest.approx(3.5)
    assert [one.rpartition(" ")[0] for one in found].count("INFO import.tighter") == 2


def test_wrapped_rotary_is_modulo(tmp_path: Path) -> None:
    machine = imported(tmp_path, trt(extra="[AXIS_C]\nWRAPPED_ROTARY = 1\n"), TRT_HAL)[1]
    assert machine is not None and machine.turns[4].modulo and not np.isfinite(machine.limits.upper[4])


@pytest.mark.parametrize(("old", "new", "code"), [
    ("LINEAR_UNITS = mm", "LINEAR_UNITS = furlong", "ERROR import.unit 11"),
    ("LINEAR_UNITS = mm\n", "", "ERROR import.unit 0"),
    ("COORDINATES = XYZAC", "COORDINATES = XZ", "ERROR import.geometry 10"),
    ("ANGULAR_UNITS = degree", "ANGULAR_UNITS = grad", "ERROR import.unit 12"),
    ("xyzac-trt-kins", "maxkins", "ERROR import.kinematics 5"),
    ("xyzac-trt-kins", "genserkins", "ERROR import.kinematics 5"),
    ("xyzac-trt-kins", "genhexkins", "ERROR import.kinematics 5"),
    ("xyzac-trt-kins", "xyzac-trt-kins sparm=identityfirst", "WARNING import.kinematics 5"),
    ("KINEMATICS = xyzac-trt-kins", "", "ERROR import.kinematics 0"),
    ("MAX_LIMIT = 12", "MAX_LIMIT = twelve", "ERROR import.number 16"),
    ("MAX_LIMIT = 12\n", "", "ERROR import.travel 15"),
    ("MAX_LIMIT = 12\n", "MAX_LIMIT = 12\nMAX_LIMIT = 13\n", "WARNING import.contradiction 17"),
    ("HOME = 0", "HOME = 99", "ERROR machine.home 19"),
    ("HALFILE = shop.hal", "HALFILE = shop.hal\n#INCLUDE none.inc", "WARNING import.file 9"),
])
def test_what_is_wrong_is_said_with_its_line(old: str, new: str, code: str, tmp_path: Path) -> None:
    found = imported(tmp_path, trt().replace(old, new, 1), TRT_HAL)[2]
    assert code in found
    assert [one for one in found if one.startswith("ERROR")] in ([], [code]), "one cause, one line"


def test_a_file_of_no_form_that_is_read(tmp_path: Path) -> None:
    assert imported(tmp_path, "x = 1\n")[2] == ["ERROR import.format 0"]


def there_and_back(machine: Machine, folder: Path) -> Machine:
    texts, found = export_linuxcnc(machine, machine.name)
    assert all(d.code == "export.left-out" for d in found), found
    for name, text in texts.items():
        (folder / name).write_text(text)
    back, more = import_machine(folder / f"{machine.name}.ini", "auto", ())[1:]
    assert back is not None, more
    return back


EXPRESSED = ("fork-head-ab", "head-table", "linuxcnc-lineardelta", "linuxcnc-xyzac-trt", "linuxcnc-xyzbc-trt",
             "mikron-ucp710", "mill-3axis", "mill-4axis", "nutating-head", "trunnion-bc")
"""but for modules of struts and arms, which the import refuses; `tests/linuxcnc/test_modules.py` holds their pins"""


@pytest.mark.parametrize("name", EXPRESSED)
def test_there_and_back(name: str, tmp_path: Path) -> None:
    """Kinematics, limits, home, turns, timing, what is assumed; travel ends a trace later (stops at home)."""
    ours = machines.load(name)
    back = there_and_back(ours, tmp_path)
    assert (back.axis_names, back.rotary, back.structure) == (ours.axis_names, ours.rotary, ours.structure)
    for what, mine in vars(back.limits).items():
        theirs, trace = getattr(ours.limits, what), 2.0 * EDGE if what in ("lower", "upper") else 0.0
        assert mine == theirs if isinstance(mine, frozenset) else np.allclose(mine, theirs, rtol=1e-14, atol=trace)
    ends = np.isfinite(ours.limits.lower), np.isfinite(ours.limits.upper)
    assert (back.limits.lower < ours.limits.lower)[ends[0]].all() and (back.limits.upper > ours.limits.upper)[ends[1]].all()
    np.testing.assert_allclose(back.home, ours.home, rtol=1e-14)
    assert (back.turns, back.timing, back.retract_axis) == (ours.turns, ours.timing, ours.retract_axis)
    assert (back.control_kinematics is None) == (ours.control_kinematics is None)
    some = np.random.default_rng(5).uniform(-0.2, 0.2, (40, len(ours.home)))
    q = ours.home + some * np.where(ours.rotary, 5.0, 40.0)
    for mine, theirs in zip(back.kinematics.forward(q)[:2], ours.kinematics.forward(q)[:2], strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-9)


def test_every_serial_machine_is_expressed() -> None:
    serial = {name for name in machines.names() if machines.load(name).structure.startswith(("w ", "["))}
    assert serial | {"linuxcnc-lineardelta"} == set(EXPRESSED) == {
        name for name in machines.names() if export_linuxcnc(machines.load(name), name)[0]} - {"linuxcnc-pentapod"}


@pytest.mark.parametrize(("name", "why"), [("h4a-c-table", "h4-linear"), ("delta-star", "names no module")])
def test_what_linuxcnc_cannot_run_is_refused_with_the_reason(name: str, why: str) -> None:
    texts, found = export_linuxcnc(machines.load(name), name)
    assert texts == {} and found[0].code == "export.kinematics" and why in found[0].message


def test_modulo_and_largest_feed_go_there_and_back(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('base = "mikron-ucp710"\n[axes.C]\nmodulo = true\ncutting_velocity = 20\n'
                                       '[control]\nlargest_feed = 12000\n')
    ours = machines.load(tmp_path / "own.toml")
    assert "axes.C.cutting_velocity" in export_linuxcnc(ours, "own")[1][0].message
    back = there_and_back(ours, tmp_path)
    assert back.turns == ours.turns and back.largest_feed == pytest.approx(ours.largest_feed)
    assert ours.largest_feed < ours.limits.velocity[0]
    np.testing.assert_allclose(back.limits.velocity, ours.limits.velocity, rtol=1e-14)


def test_what_is_assumed_stays_assumed(tmp_path: Path) -> None:
    """Written and read, a figure that no document states has not become one that a file states."""
    (tmp_path / "own.toml").write_text('base = "mill-3axis"\n' + "".join(
        f'[axes.{letter}]\nvelocity = 400\nassumed = {"[]" if letter != "X" else ["velocity"]}\n' for letter in "XYZ"))
    back = there_and_back(machines.load(tmp_path / "own.toml"), tmp_path)
    assert back.limits.assumed == {"X.velocity"}
    assert back.figures["Y.velocity"].startswith("own.ini: line")
