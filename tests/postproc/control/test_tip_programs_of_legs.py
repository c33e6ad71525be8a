"""Machines of kind "legs" whose control has their kinematics: programs in tip coordinates, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
from machines.loader import load_checked
from postproc.pipeline.result import PostResult
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
    ('module = "lineardeltakins"', 'module = "scarakins"', "known: lineardeltakins"),
    ('module = "lineardeltakins"', 'module = "pentakins"', "five legs with drive"),
    ('module = "lineardeltakins"', 'module = "genhexkins"', "six legs with drive"),
    ('module = "lineardeltakins"', 'module = "rotarydeltakins"', "three legs with drive"),
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


HEXAPOD, CRANKS = ('base = "hexapod"\n[control]\nmodule = "genhexkins"\n',
                   'base = "rotary-delta"\n[control]\nmodule = "rotarydeltakins"\n')
LOW = "[part]\norigin = [0, 0, -230]\n[tools.1]\ngauge_length = 80\n[clearance]\nmargin = 20\n"
TILTED = ("LOADTL/1", "SPINDL/RPM,1000,CLW", "RAPID", "GOTO/-40,-20,40,0,0,1", "FEDRAT/MMPM,1200",
          "GOTO/-40,-20,0,0,0,1",
          "GOTO/40,-20,0,0.2,0.1,0.9746794", "GOTO/40,20,5,-0.1,0.15,0.9836158", "RAPID",
          "GOTO/40,20,50,-0.1,0.15,0.9836158")


def written(folder: Path, text: str, cuts: tuple[str, ...], more: str = "", **options: object) -> PostResult:
    (folder / "own.toml").write_text(text)
    return postproc.convert(toolpath(*cuts), machines.load(folder / "own.toml"), "linuxcnc", setup_of(LOW + more),
                            postproc.Options(**options))


def test_a_hexapod_under_genhexkins_gets_turns_of_its_platform(tmp_path: Path) -> None:
    """A, B, C of R = Rz(c) Ry(b) Rx(a): its z is the tool, and the tool is not turned about itself."""
    result = good(written(tmp_path, HEXAPOD, TILTED))
    assert result.comparison is not None and result.comparison.bounded_cuts == result.comparison.cuts == 3
    assert result.witness is not None and result.witness.own_kinematics and not result.witness.findings
    assert "pivots" not in result.text and "X40 A-5.8579 B11.537 C-0.5923\n" in result.text
    a, b, c = np.radians([-5.8579, 11.537, -0.5923])
    axis = [np.cos(c) * np.sin(b) * np.cos(a) + np.sin(c) * np.sin(a),
            np.sin(c) * np.sin(b) * np.cos(a) - np.cos(c) * np.sin(a), np.cos(b) * np.cos(a)]
    assert axis == pytest.approx(np.array([0.2, 0.1, 0.9746794]) / np.linalg.norm([0.2, 0.1, 0.9746794]), abs=2e-6)


def test_cranks_under_rotarydeltakins_get_tips_from_the_plane_of_their_axes(tmp_path: Path) -> None:
    """Arms at z = 800, platform joints 100 above the gauge point: the zero of the module is at 700."""
    result = good(written(tmp_path, CRANKS, CUT))
    assert "(work offset G54 in machine coordinates: X0.0000 Y0.0000 Z-930.0000)" in result.text
    assert "X30 Y-15\nY0 Z1\n" in result.text
    assert result.witness is not None and result.witness.own_kinematics and not result.witness.findings


@pytest.mark.parametrize(("more", "code", "words"), [
    ("[axes.X]\ntravel = [0, 240]\n", "reach.clearance", "travel X: passed by"),
    ("[axes.V]\nvelocity = 3\n", "", "")])
def test_travel_and_speed_of_the_drives_count(more: str, code: str, words: str, tmp_path: Path) -> None:
    result = written(tmp_path, HEXAPOD + more, TILTED)
    if code:
        assert any(d.code == code and words in d.message for d in result.diagnostics), [str(d) for d in result.diagnostics]
        return
    whole = good(written(tmp_path, HEXAPOD, TILTED))
    assert good(result).program is not None and whole.program is not None
    feeds = [r.program.feed[np.isfinite(r.program.feed)] for r in (result, whole)]
    assert (feeds[0] < 0.9 * feeds[1]).any() and (feeds[0] <= feeds[1] + 1e-9).all()


def test_errors_of_legs_are_not_corrected_in_words_of_the_tip(tmp_path: Path) -> None:
    (tmp_path / "e.toml").write_text('machine = "own"\n[legs.X]\nlength = [0.1]\n')
    result = written(tmp_path, HEXAPOD, TILTED, error_model=str(tmp_path / "e.toml"))
    assert not result.ok and any("hold no error of its legs" in d.message for d in result.diagnostics)


def test_the_spin_is_planned_under_genhexkins_too(tmp_path: Path) -> None:
    result = good(written(tmp_path, HEXAPOD, TILTED, "[joints]\nspin = 20\n"))
    turn = pytest.approx(np.radians(20))
    assert result.path is not None and result.path.opened == (("spin", turn, turn),)
    assert result.witness is not None and not result.witness.findings


@pytest.mark.parametrize(("old", "new", "words"), [
    ("root = -1", "root = 1", "elbows outside"),
    ("angles = [-90, 30, 150]", "angles = [-80, 30, 150]", "at one radius and height"),
    ("[kinematics.workspace]", '[kinematics.legs.A]\ndrive = "arm"\npoint = [0, -300, 800]\ndirection = [1, 0, 0]\n'
     "arm = [0, -350, 0]\njoint = [0, -100, 0]\nrod = 790\nroot = -1\nrods = [[80, 0, 0], [-80, 0, 0]]\n"
     "[kinematics.workspace]", "rods of one length")])
def test_cranks_that_the_module_cannot_be_are_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    text = Path("machines/data/rotary-delta.toml").read_text("utf-8").replace(old, new)
    (tmp_path / "own.toml").write_text(text.replace("[control]", '[control]\nmodule = "rotarydeltakins"'), "utf-8")
    machine, found = load_checked(tmp_path / "own.toml")
    assert machine is None and any(words in str(d) for d in found), [str(d) for d in found]


def test_where_a_length_goes_is_looked_for_once_a_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Z of a trunnion moves the tip along the tool, one drive of a Delta or a hexapod does not: the same for every program."""
    for name, along in (("linear-delta-ac", False), ("hexapod", False), ("mikron-ucp710", True)):
        m = replace(machines.load(name))
        z = m.axis_names.index("Z") if "Z" in m.axis_names else 2
        assert m.moves_along_tool(z) is along, name
        monkeypatch.setattr(type(m.kinematics), "forward", lambda *asked: pytest.fail("looked for again"))
        assert m.moves_along_tool(z) is along
        monkeypatch.undo()
