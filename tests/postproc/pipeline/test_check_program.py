"""The program that checks the pivots at the machine: one point in five poses, readings that show a wrong pivot."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from postproc.cli.app import app
from postproc.pipeline.check_program import POSES, check_program
from postproc.pipeline.result import PostResult
from postproc.verification.read_back import read_back
from tests.postproc.kit import SAMPLES, TOOLS, convert, good, machine, pose_of, setup_of, toolpath
from toolpaths.diagnostics import DiagnosticError

OFF = "[part]\norigin = [31, -12, 5]\n[tools.1]\ngauge_length = 90\n[tools.2]\ngauge_length = 65\n"
TURNED = OFF.replace("[tools.1]", "x_axis = [0, 1, 0]\ny_axis = [-1, 0, 0]\n[tools.1]", 1)
PART = ["RAPID", "GOTO/0,0,40", "FEDRAT/MMPM,500", "GOTO/0,0,30", "GOTO/20,8,30", "RAPID", "GOTO/20,8,40"]
PLACES = [("trunnion-bc", "fanuc-30i"), ("trunnion-bc", "haas-ngc"), ("mikron-ucp710", "siemens-840d"),
          ("head-table", "siemens-840d"), ("fork-head-ab", "heidenhain-tnc640"), ("trunnion-bc", "heidenhain-tnc640"),
          ("trunnion-bc", "linuxcnc"), ("mill-4axis", "fanuc-30i")]


@cache
def checked(name: str, controller: str, setup: str = OFF) -> PostResult:
    made = good(convert(toolpath(*PART), name, controller, setup_of(setup)))
    return good(check_program(made, controller, "check"))


def flat(text: str) -> str:
    """The text in one line without numbers of blocks and brackets, for comments that are folded."""
    return re.sub(r"\s+", " ", re.sub(r"(?m)^N?\d+ |[();]", "", text))


def readings(result: PostResult) -> np.ndarray:
    """(5, J) machine positions that the comments name, mm and degrees."""
    found = re.findall(r"POSE \d OF 5, MACHINE POSITION ([-XYZABC\d. ]+), INDICATOR", flat(result.text))
    return np.array([[float(v) for v in re.findall(r"[XYZABC](-?[\d.]+)", one)] for one in found])


@pytest.mark.covering
@pytest.mark.parametrize(("name", "controller"), PLACES)
@pytest.mark.parametrize("setup", [OFF, TURNED])
def test_all_poses_are_of_one_point(name: str, controller: str, setup: str) -> None:
    """By kinematics of homogeneous matrices; the poses differ, the spindle stands, the program stops in each."""
    result = checked(name, controller, setup)
    there = readings(result)
    assert there.shape == (POSES, len(machine(name).axis_names))
    if name != "mill-4axis":
        tip, axis = pose_of(name, there, 90.0)
        assert np.abs(tip - tip[0]).max() < 2e-3
        assert len(np.unique(axis.round(3), axis=0)) == POSES
        said = re.search(r"(?i)INDICATOR ON THE TABLE AT X(\S+) Y(\S+) Z(\S+) OF THE WORK OFFSET", flat(result.text))
        assert said and np.abs(np.array([float(v) for v in said.groups()]) - (tip[0] - [31.0, -12.0, 5.0])).max() < 2e-3
    assert not re.search(r"\bM[34]\b", re.sub(r"\(.*?\)|;.*", "", result.text))
    assert len(re.findall(r"(?m)\bM0\b$", result.text)) == POSES


@pytest.mark.covering
@pytest.mark.parametrize(("name", "controller"), PLACES)
def test_the_program_goes_to_what_it_says(name: str, controller: str) -> None:
    """At every stop the axes stand, as the program is read back, where the comment before it has them."""
    result = checked(name, controller)
    assert result.comparison is not None and result.comparison.executed is not None and result.comparison.poses is not None
    motion = result.comparison.executed[1]
    stops = [k for k, line in enumerate(result.text.splitlines(), 1) if re.search(r"(?<![A-Z])M0$", line)]
    rows = np.array([np.flatnonzero(motion.line < line)[-1] for line in stops])
    units = np.where(np.array(machine(name).rotary), 180.0 / np.pi, 1.0)
    at = result.comparison.poses.joints(motion, rows, 1.0) * units
    assert np.abs(at - readings(result)).max() < 2e-3


@pytest.mark.parametrize(("name", "controller"), [("trunnion-bc", "fanuc-30i"), ("head-table", "siemens-840d"),
                                                  ("fork-head-ab", "heidenhain-tnc640")])
def test_a_pivot_that_the_control_holds_otherwise_is_read(name: str, controller: str) -> None:
    """A pivot off by 0.05 mm square to its axis moves the reading of some pose, less that of the first, by half of it."""
    there, one = readings(checked(name, controller)), machine(name)
    units = np.where(np.array(one.rotary), 180.0 / np.pi, 1.0)
    kin = one.kinematics
    points = {j.name: np.array(j.point) for j in kin.chain if j.rotary}
    for joint in (j for j in kin.chain if j.rotary):
        for across in np.eye(3)[np.abs(joint.direction) < 0.5]:
            other = kin.with_pivots({**points, joint.name: points[joint.name] + 0.05 * across}).with_tool(90.0)
            tip = other.forward(there / units)[0]
            assert np.linalg.norm(tip - tip[0], axis=1).max() > 0.025, (joint.name, across)


def test_it_is_proved_like_any_program() -> None:
    result = checked("trunnion-bc", "fanuc-30i")
    assert result.job is not None and "PROVED BY READ-BACK, SECOND READING" in result.text and "G43.4" in result.text
    spoilt = result.text.replace(" B30.", " B31.", 1)
    found = read_back(spoilt.encode(), result.job, "check.cls")[1]
    assert spoilt != result.text and any(d.severity.name == "ERROR" for d in found)


def test_without_rotary_axes_or_room_it_is_refused() -> None:
    made = good(convert(toolpath(*PART), "mill-3axis", "fanuc-30i", setup_of(OFF)))
    with pytest.raises(DiagnosticError, match="no rotary axis"):
        check_program(made, "fanuc-30i", "check")
    made = good(convert(toolpath(*PART), "trunnion-bc", "fanuc-30i", setup_of(OFF)))
    tight = made.setup.model_copy(update={"clearance": made.setup.clearance.model_copy(update={"margin": 9000.0})})
    assert made.job is not None
    with pytest.raises(DiagnosticError, match="no five poses"):
        check_program(replace(made, setup=tight, job=replace(made.job, setup=tight)), "fanuc-30i", "check")


def test_the_command_writes_both_or_none(tmp_path: Path) -> None:
    arguments = ["convert", str(SAMPLES / "pocket.cls"), "-c", "heidenhain-tnc640", "--setup", str(TOOLS),
                 "-o", str(tmp_path / "p.h"), "--check-program", str(tmp_path / "pivots.h")]
    assert CliRunner().invoke(app, [*arguments, "-m", "mill-3axis"]).exit_code == 1 and not list(tmp_path.iterdir())
    assert CliRunner().invoke(app, [*arguments, "-m", "trunnion-bc"]).exit_code == 0
    assert {f.name for f in tmp_path.iterdir()} == {"p.h", "pivots.h"}
    assert (tmp_path / "pivots.h").read_text().startswith("0 BEGIN PGM PIVOTS MM")
