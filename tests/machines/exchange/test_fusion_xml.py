"""Machine files of HSM and Fusion in XML: what moves, ranges and speeds with units, lines of rotary axes by the user."""

from pathlib import Path

import numpy as np
import pytest

from machines.exchange.read import import_machine
from machines.machine import Machine

FILE = """<?xml version="1.0" encoding="UTF-8" standalone="no" ?>
<machine xmlns="http://www.hsmworks.com/xml/2009/machine">
  <vendor>Our</vendor>
  <model>Trunnion</model>
  <machining additive="no" jet="no" milling="yes" turning="no"/>
  <machiningTime ratio="1" toolChangeTime="4s"/>
  <capabilities maximumBlockProcessingSpeed="0" maximumFeedrate="15000mm/min" workOffsets="100"/>
  <axis actuator="linear" coordinate="Z" homePosition="0mm" id="Z" link="head" range="-500mm 0mm" rapidFeed="30000mm/min"/>
  <spindle axis="0 0 1" maximumSpeed="12000rpm" minimumSpeed="0rpm"/>
  <axis actuator="linear" coordinate="Y" homePosition="0mm" id="Y" link="head" range="-10in 10in" rapidFeed="1000in/min"/>
  <axis actuator="linear" coordinate="0" id="X" link="table" range="-400 400" rapidFeed="0mm/min"/>
  <axis actuator="rotational" axis="0 0 2" coordinate="Z" cyclic="yes" id="V" link="table" range="-360deg 360deg"/>
  <axis actuator="rotational" axis="0 1 0" coordinate="Y" id="U" link="table" offset="0mm 0mm 300mm"
    range="-35deg 120deg" rapidFeed="18000deg/min"/>
</machine>
"""
POINTS = ("kinematics.axes.B.point=[0,0,-450]", "kinematics.axes.C.point=[0,0,-450]")


def imported(folder: Path, text: str, stated: tuple[str, ...] = POINTS) -> tuple[Machine | None, list[str]]:
    (folder / "m.machine").write_text(text)
    machine, found = import_machine(folder / "m.machine", "auto", stated)[1:]
    return machine, [f"{d.severity.name} {d.code} {d.message}" for d in found]


def test_a_trunnion(tmp_path: Path) -> None:
    machine, found = imported(tmp_path, FILE)
    assert machine is not None, found
    assert machine.structure == "w C' B' X' b Y Z (C1) t" and machine.description == "Our Trunnion"
    assert machine.limits.velocity[1:3] == pytest.approx([1000 * 25.4 / 60, 500.0])
    assert machine.limits.lower[:3] == pytest.approx([-400.0, -254.0, -500.0])
    assert np.degrees(machine.limits.upper[3]) == pytest.approx(120.0) and np.isinf(machine.limits.upper[4])
    assert (machine.largest_feed, machine.largest_spindle_speed, machine.timing.tool_change) == (250.0, 12000.0, 4.0)
    assert machine.figures["X.velocity"] == "assumed" and machine.figures["B.velocity"].startswith("m.machine: line 13, ")
    assert [line.split()[1] for line in found] == ["import.sense", "import.sense", "import.assumed"]


def test_the_tool_turns_about_the_part_as_the_axis_says(tmp_path: Path) -> None:
    """B = +30: relative to the part the tool axis is turned right-handed about y, so it leans to +x."""
    machine = imported(tmp_path, FILE)[0]
    assert machine is not None
    axis = machine.kinematics.forward(np.array([[0.0, 0.0, 0.0, np.radians(30.0), 0.0]]))[1]
    np.testing.assert_allclose(axis[0], [0.5, 0.0, np.cos(np.radians(30.0))], atol=1e-12)


def test_of_two_in_the_head_u_carries_v(tmp_path: Path) -> None:
    head = FILE.replace('id="V" link="table"', 'id="U" link="head"').replace('id="U" link="table"', 'id="V" link="head"')
    machine, found = imported(tmp_path, head, tuple(p.replace("-450", "200") for p in POINTS))
    assert machine is not None and machine.structure == "w X' b Y Z C B (C1) t", found


@pytest.mark.parametrize(("old", "new", "says"), [
    ('milling="yes"', 'milling="no"', "only mills are read"),
    ('spindle axis="0 0 1"', 'spindle axis="0 1 0"', "only 0 0 1 is read"),
    ('coordinate="0" id="X"', 'coordinate="Y" id="X"', "X, Y, Z and at most one"),
    ("</machine>", "", "no XML that is read"),
    ("<machine xmlns", '<!DOCTYPE m [<!ENTITY a "b">]>\n<machine xmlns', "entities of its own"),
    ('axis="0 1 0" coordinate="Y"', 'coordinate="Y"', "axis B has no direction"),
    ('range="-35deg 120deg"', 'range="-35deg"', "not two ends"),
])
def test_what_is_not_read_is_said_with_its_reason(tmp_path: Path, old: str, new: str, says: str) -> None:
    assert old in FILE
    machine, found = imported(tmp_path, FILE.replace(old, new, 1))
    assert machine is None and any(says in line for line in found), found


def test_lines_are_asked_for_by_the_words_that_state_them(tmp_path: Path) -> None:
    (tmp_path / "m.machine").write_text(FILE)
    machine, found = import_machine(tmp_path / "m.machine", "auto", ())[1:]
    asked = [d for d in found if d.code == "import.geometry"]
    assert machine is None and [d.lines for d in asked] == [(13,), (12,)]
    assert [d.hint.split(",")[0].removeprefix("--set ") for d in asked] == [
        "kinematics.axes.B.point=[0", "kinematics.axes.C.point=[0"]


@pytest.mark.parametrize(("old", "new"), [
    ('encoding="UTF-8"', 'encoding="none"'), ('range="-500mm 0mm"', 'range="1e999mm 0mm"'), ("</model>", "</model>\x01")])
def test_odd_files_are_read_or_refused(old: str, new: str, tmp_path: Path) -> None:
    assert old in FILE
    machine, found = imported(tmp_path, FILE.replace(old, new, 1))
    assert (machine is not None) == (old.startswith("encoding")) and found
