"""Machines of kind "legs" whose control has their kinematics: programs in tip coordinates, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
from machines.loader import load_checked
from tests.postproc.kit import good, setup_of, toolpath

LINEAR_DELTA = """description = "lineardeltakins as a platform on legs"
[kinematics]
kind = "legs"
freedoms = ["x", "y", "z"]
gauge = [0, 0, -20]
[kinematics.layout]
form = "star"
drive = "slide"
letters = ["X", "Y", "Z"]
angles = [90, 210, 330]
radius = 170
height = 20
joint_radius = 40
pair = 50
rod = 269
[kinematics.workspace]
x = [-60, 60]
y = [-60, 60]
z = [20, 250]
[timing]
tool_change = 5
clamp = 0
unclamp = 0
[control]
rapids = "straight"
module = "lineardeltakins"
""" + "".join(f"[axes.{letter}]\ntravel = [0, 620]\nvelocity = 300\nacceleration = 5000\njerk = 50000\nhome = 430\n"
              for letter in "XYZ")
CUT = ("LOADTL/1", "SPINDL/RPM,1000,CLW", "RAPID", "GOTO/-30,-20,20", "FEDRAT/MMPM,2400", "GOTO/-30,-20,-2",
       "GOTO/30,-15,-2", "GOTO/30,0,1", "RAPID", "GOTO/30,0,20")
SETUP = "[part]\norigin = [0, 0, 20]\n[tools.1]\ngauge_length = 80\n[clearance]\nmargin = 20\n"


def test_a_linear_delta_as_legs_gets_tip_programs(tmp_path: Path) -> None:
    """The pins are those of the slides less the platform, seen from the gauge point; the words are those of the CL file."""
    (tmp_path / "own.toml").write_text(LINEAR_DELTA)
    machine = machines.load(tmp_path / "own.toml")
    control = machine.control_kinematics
    assert control is not None and control.pins == {"lineardeltakins.L": 269.0, "lineardeltakins.R": pytest.approx(130.0)}
    result = good(postproc.convert(toolpath(*CUT), machine, "linuxcnc", setup_of(SETUP)))
    assert "(words: tool-centre-point control)" in result.text and "X30 Y-15\nY0 Z1\n" in result.text
    assert result.comparison is not None and result.comparison.worst_tip < 1e-6
    assert result.witness is not None and result.witness.own_kinematics and not result.witness.findings
    joints = machine.kinematics.inverse(np.array([[30.0, -15.0, 98.0]]), np.array([[0.0, 0.0, 1.0]]))[0, 0]
    feet = np.array([[0.0, 130.0], [-130.0 * 0.75**0.5, -65.0], [130.0 * 0.75**0.5, -65.0]])
    assert joints == pytest.approx(98.0 + np.sqrt(269.0**2 - ((feet - [30.0, -15.0]) ** 2).sum(axis=1)), abs=1e-9)


@pytest.mark.parametrize(("old", "new", "words"), [
    ('module = "lineardeltakins"', 'module = "genhexkins"', "known: lineardeltakins"),
    ("height = 20", "height = 10", "90, 210, 330 degrees and z = 0"),
    ("angles = [90, 210, 330]", "angles = [0, 120, 240]", "90, 210, 330 degrees and z = 0"),
    ("rod = 269", "rod = 269\nlean = 10", "slides along [0, 0, 1]")])
def test_what_the_module_cannot_be_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text(LINEAR_DELTA.replace(old, new))
    machine, found = load_checked(tmp_path / "own.toml")
    assert machine is None and any(d.code == "machine.control" and words in str(d) for d in found), [str(d) for d in found]


def test_a_hexapod_has_no_such_module(tmp_path: Path) -> None:
    (tmp_path / "own.toml").write_text('base = "hexapod"\n[control]\nmodule = "lineardeltakins"\n')
    _, found = load_checked(tmp_path / "own.toml")
    assert [d.code for d in found] == ["machine.control"] and "free in x y z on slides X, Y, Z" in str(found[0])
