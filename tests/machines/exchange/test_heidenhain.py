"""Heidenhain's kinematics: the description table of an iTNC 530, and what other forms are said to be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
from machines.exchange.read import import_machine
from machines.machine import Machine
from postproc.job.pivot_vectors import pivot_vectors

MANUAL = """NR KEY AXIS COORD
Trans X 0.016
Trans Z 250.051
MachAxis B
MachAxis Y
MachAxis X
MachBase
MachAxis Z
Trans X -298.923
Trans Y 200.172
MachAxis C
[END]
"""
"""the example of the Technical Manual, p. 670: figures and order"""
COLUMNS = {"NR": 7, "KEY": 9, "AXIS": 5, "COORD": 11, "ASTATUS": 8, "FILE": 10, "COMPTAB": 8}
"""name and width"""
ROWS = [("ToolAxis", "Z", ""), ("TOOLFILE", "", ""), ("MachAxis", "Z", ""), ("MachAxis", "X", ""), ("MachBase", "", ""),
        ("CMO", "", ""), ("MachAxis", "Y", ""), ("Trans", "X", "-350.012"), ("Trans", "Z", "-615.25"), ("MachAxis", "A", ""),
        ("Trans", "Y", "+0.021"), ("Trans", "Z", "50"), ("MachAxis", "C", "")]


def table(rows: list[tuple[str, str, str]], first: str = "BEGIN  AC_TAB  .TAB  MM") -> str:
    """As the control's file has it: columns at their places, lines numbered, a file in the rows of bodies."""
    lines = [first, "".join(name.ljust(width) for name, width in COLUMNS.items())]
    for number, (key, axis, coord) in enumerate(rows):
        cells = (str(number), key, axis, coord, "", "BED.TAB" if key == "CMO" else "", "")
        lines.append("".join(cell.ljust(width) for cell, width in zip(cells, COLUMNS.values(), strict=True)))
    return "\n".join([*lines, "[END]", ""])


def imported(folder: Path, text: str, name: str = "kin.tab") -> tuple[Machine | None, list[str]]:
    """The machine, and "severity code line" of errors and warnings."""
    (folder / name).write_text(text)
    _, machine, found = import_machine(folder / name, "auto", ())
    return machine, [f"{d.severity.name} {d.code} {d.lines[0] if d.lines else 0}" for d in found
                     if d.severity.name != "INFO"]


def test_the_example_of_the_manual(tmp_path: Path) -> None:
    """B turns the head, 250.051 mm above the gauge point; C is the table, beyond the head's own offset in X."""
    text = "\n".join(["BEGIN KIN.TAB MM", *MANUAL.splitlines()])
    for written in (MANUAL, text, text.replace(".016", ",016"), text.replace(" ", "\t").replace("BEGIN\tKIN", "BEGIN KIN")):
        machine, found = imported(tmp_path, written.replace("\nTrans\t", "\n\tTrans\t").replace("\nMach", "\n\tMach")
                                  if "\t" in written else written)
        assert machine is not None and not found, found
        assert machine.structure == "w C' Z' b X Y B (C1) t"
        points = {joint.name: joint.point for joint in machine.kinematics.chain}
        np.testing.assert_allclose(points["B"], [0.016, 0.0, 250.051])
        np.testing.assert_allclose(points["C"][:2], [-298.907, 200.172])
    tip = machine.kinematics.forward(np.array([[0.0, 0, 0, np.pi / 2, 0]]))[0][0]
    np.testing.assert_allclose(tip, [0.016 - 250.051, 0.0, 250.051 + 0.016], atol=1e-9)


def test_a_table_at_its_places_with_rows_that_say_nothing_of_lines(tmp_path: Path) -> None:
    machine, found = imported(tmp_path, table(ROWS))
    assert machine is not None and not found and machine.structure == "w C' A' Y' b X Z (C1) t"
    np.testing.assert_allclose([j.point for j in machine.kinematics.chain if j.rotary],
                               [[-350.012, 0.021, -565.25], [-350.012, 0, -615.25]])
    assert "A.travel" in machine.limits.assumed and "X.velocity" in machine.limits.assumed
    inch = imported(tmp_path, table(ROWS, "BEGIN AC_TAB.TAB INCH"))[0]
    assert inch is not None and inch.kinematics.chain[0].point[2] == pytest.approx(-565.25 * 25.4)


@pytest.mark.parametrize("name", ["mikron-ucp710", "trunnion-bc", "head-table", "fork-head-ab", "mill-4axis"])
def test_what_the_header_of_a_program_states_gives_the_machine_back(name: str, tmp_path: Path) -> None:
    ours = machines.load(name)
    vectors = {v.end: v for v in pivot_vectors(ours) if v.end}
    order = [*(n for n, v in vectors.items() if "head" in v.kind), "X", "Y", "Z", *(
        n for n, v in vectors.items() if "head" not in v.kind)]
    rows, at = list[tuple[str, str, str]](), np.zeros(3)
    for letter in order:
        if letter in vectors:
            one = vectors[letter]
            to = one.value + (at if one.origin else 0.0)
            rows += [("Trans", "XYZ"[k], f"{to[k] - at[k]:.6f}") for k in range(3) if to[k] != at[k]]
            at = to
        rows.append(("MachAxis", letter, ""))
    back, found = imported(tmp_path, table(rows))
    assert back is not None and not found and back.axis_names == ours.axis_names
    q = np.random.default_rng(4).uniform(-1.2, 1.2, (20, len(ours.home))) * np.where(ours.rotary, 1.0, 100.0)
    for mine, theirs in zip(back.kinematics.forward(q)[:2], ours.kinematics.forward(q)[:2], strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-5)


@pytest.mark.parametrize("old, new, found", [
    ("MachBase", "MachRail", "ERROR import.kinematics 7"),
    ("250.051", "25O.051", "ERROR import.kinematics 3"),
    ("Trans Y 200.172", "Trans A 45", "ERROR import.kinematics 10"),
    ("Trans Y 200.172", "SUBFILE1 TABLE.TAB", "ERROR import.kinematics 10"),
    ("MachAxis C", "MachAxis B", "ERROR import.kinematics 11"),
    ("MachAxis Y", "ToolAxis Y", "ERROR import.kinematics 5"),
    ("MachAxis Y\n", "", "ERROR import.geometry 4"),
    ("[END]", "", "ERROR import.kinematics 12"),
    ("MachAxis Y\nMachAxis X\nMachBase\nMachAxis Z\n", "MachAxis Y\nMachAxis A\nMachAxis X\nMachAxis Z\n",
     "ERROR import.geometry 6"),
])
def test_what_is_not_understood_is_said_with_its_line(old: str, new: str, found: str, tmp_path: Path) -> None:
    assert imported(tmp_path, MANUAL.replace(old, new)) == (None, [found])


def test_what_kinematics_comp_adds_is_named(tmp_path: Path) -> None:
    text = table(ROWS).replace("12     MachAxis C    " + " " * 29, "12     MachAxis C    " + " " * 29 + "XC1")
    machine, found = imported(tmp_path, text)
    assert machine is not None and found == ["WARNING import.fine 15"]


@pytest.mark.parametrize("text, says", [
    ('CfgKinSimpleAxis (\n key:="A"\n)\n', "configuration data (CfgKinSimpleAxis)"),
    ("MP7500 : %0001\nMP7510.0 : 1\n", "machine parameters (MP7500)"),
    ("<KinematicsDesign><Chain/></KinematicsDesign>\n", "not known here (KinematicsDesign)")])
def test_other_forms_are_named_in_one_line_with_what_to_enter_instead(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "kin.txt").write_text(text)
    [found] = import_machine(tmp_path / "kin.txt", "auto", ())[2]
    assert found.code == "import.format" and says in found.message and 'form = "heidenhain"' in found.hint
