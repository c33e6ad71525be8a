"""Machines of kinds that the project does not have, from CL file to program: each command works on them or says why not."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
from typer.testing import CliRunner

import postproc
from machines.kinds import FILES
from postproc.cli.app import app
from postproc.control.control import Control
from postproc.pipeline.result import PostResult
from postproc.verification.proof_text import statement
from tests.machines.own_kinds import SAMPLE, own_machine
from tests.postproc.kit import HEAD, codes, good, goto, setup_of, tool_setup, toolpath

CONTROLS = ["fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc", "linuxcnc", "generic-iso"]
OFF = "[part]\norigin = [150.0, 20.0, 0.0]\n[tools.1]\ngauge_length = 100.0\n"
"""away from the table's centre, where the polar mill is singular"""
TILTS = np.radians([0.0, 10.0, 25.0, 40.0, -20.0, 0.0])
TIPS = np.array([[-40, -30, 0], [-20, -10, 5], [10, 0, 0], [30, 20, -5], [40, 10, 0], [0, 0, 0.0]])
AXES = np.stack([0.0 * TILTS, -np.sin(TILTS), np.cos(TILTS)], axis=1)


LEVEL = ["RAPID", "GOTO/-30,-20,30", "GOTO/-30,-20,2", "GOTO/-30,-20,-2", "GOTO/10,-20,-2",
         "MOVARC/10,0,-2,0,0,1,20,ANGLE,90", "GOTO/30,0,-2", "GOTO/30,10,-2", "GOTO/30,10,30",
         "CYCLE/DRILL,DEPTH,10,MMPM,200,CLEAR,3", "GOTO/0,0,0", "GOTO/20,5,0", "CYCLE/OFF", "RAPID", "GOTO/20,5,30"]


@cache
def level():
    return toolpath(*LEVEL)


@cache
def tilted():
    up = np.array([[0.0, 0.0, 40.0]])
    return toolpath("RAPID", *goto(TIPS[:1] + up, AXES[:1]), *goto(TIPS, AXES), "RAPID",
                    *goto(TIPS[-1:] + up, AXES[-1:]))


@cache
def converted(name: str, controller: str) -> PostResult:
    path, setup = (tilted(), tool_setup()) if name.startswith("tilting") else (level(), setup_of(OFF))
    return good(postproc.convert(path, own_machine(name), controller=controller, setup=setup))


@pytest.mark.covering
@pytest.mark.parametrize("controller", CONTROLS)
@pytest.mark.parametrize("name", ["scissors", "polar", "tilting"])
def test_a_kind_with_inverse_and_forward_alone_converts_checked_not_proved(name: str, controller: str) -> None:
    result = converted(name, controller)
    comparison = result.comparison
    assert comparison is not None and comparison.unbounded > 40 and comparison.worst_tip < 0.01
    assert statement(comparison, result.witness).startswith("checked, not proved: ")
    assert "checked, not proved: " in result.text.lower()


def test_a_length_that_the_words_hold_is_no_other_length_to_a_control_that_always_adds_its_own() -> None:
    found = converted("tilting", "heidenhain-tnc640").diagnostics
    assert "tool.length_twice" in codes(found)
    assert "tool.length_twice" not in codes(converted("scissors", "heidenhain-tnc640").diagnostics)


@pytest.mark.parametrize("name", ["scissors", "polar"])
def test_points_between_on_the_way_to_a_hole_are_written(name: str) -> None:
    """No slide of a scissors or polar mill keeps the tip straight: from hole to hole it goes by points, cycle or not."""
    result = converted(name, "linuxcnc")
    tip = result.comparison.tip
    over = (np.abs(tip[:, 2] - 3.0) < 1e-6) & (tip[:, 0] > 150.5) & (tip[:, 0] < 169.5)
    assert over.sum() >= 1 and (np.abs(tip[over, 1] - 20.0 - 0.25 * (tip[over, 0] - 150.0)) < 0.01).all()


def test_under_tip_control_a_screw_that_tilts_the_tool_is_followed() -> None:
    """No joint is rotary and the axis turns: X, Y, Z are the tip, U goes evenly, the axis is as its kinematics has it."""
    result = converted("tilting-by-control", "linuxcnc")
    comparison, machine = result.comparison, result.machine
    _, motion = comparison.executed
    cut = np.flatnonzero((motion.code == 1) & (comparison.owner < len(result.job.moves)))
    u0, u1 = (np.concatenate([motion.start[None], motion.end])[k][:, 3] for k in (cut, cut + 1))
    assert np.abs(u1 - u0).max() > 5.0 and comparison.unbounded > 0
    for t in np.linspace(0.0, 1.0, 9):
        q = np.zeros((len(cut), 4))
        q[:, 3] = u0 + t * (u1 - u0)
        _, axis = comparison.poses.poses(motion, cut, float(t))
        np.testing.assert_allclose(axis, machine.kinematics.forward(q)[1], atol=1e-9)
    ends = comparison.poses.poses(motion, cut, 1.0)[1]
    assert np.ptp(ends[:, 1]) > 0.9
    turned = np.flatnonzero(np.abs(u1 - u0) > 1.0)
    middle = comparison.poses.poses(motion, cut[turned], 0.5)[1]
    assert (np.linalg.norm(middle - ends[turned], axis=1) > 1e-3).all()


def test_words_of_tip_control_and_back_where_a_linear_joint_turns_the_tool() -> None:
    """What words mean at the ends of blocks and between: the axis is that of the joints there, never that of the start."""
    machine = own_machine("tilting-by-control")
    control, kin = Control(machine, "tcp", np.array([10.0, 20.0, 5.0]), base="tcp"), machine.kinematics.with_tool(80.0)
    q = np.array([[0.0, 5, 200, -60], [40, 30, 180, 90], [-20, 10, 220, 0]])
    np.testing.assert_allclose(control.joints(control.words(q, kin, 80.0), kin, 80.0), q, atol=1e-7)
    tip, axis, there = control.between(q[:2], q[1:], np.array([0.3, 0.7]), kin)
    np.testing.assert_allclose(there[:, 3], [-15.0, 27.0], atol=1e-12)
    for found, expected in zip((tip, axis), kin.forward(there), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-7)
    assert (np.linalg.norm(axis - kin.forward(q[:2])[1], axis=1) > 0.2).all()
    (bent,) = control.bent(q[:2], q[1:], np.array([0.5]), kin)
    np.testing.assert_allclose(bent[:, 3], [15.0, 45.0], atol=1e-12)


def run(*words: str, code: int = 0) -> str:
    done = CliRunner().invoke(app, [*words, "-m", str(SAMPLE.with_suffix(".toml"))], env={FILES: str(SAMPLE)})
    assert done.exit_code == code, done.output
    return done.output


@pytest.fixture
def part(tmp_path) -> str:
    file = tmp_path / "part.apt"
    file.write_text("\n".join([*HEAD, *LEVEL, "FINI"]))
    (tmp_path / "setup.toml").write_text(OFF)
    return str(file)


def test_the_sample_works_in_every_command(tmp_path, part: str) -> None:
    out, setup, control = str(tmp_path / "part.nc"), ("--setup", str(tmp_path / "setup.toml")), ("-c", "fanuc-30i")
    assert "checked, not proved" in run("convert", part, *control, "-o", out, *setup, "--proof")
    proof = json.loads((tmp_path / "part.nc.proof.json").read_text())
    assert [one["file"] for one in proof["inputs"]["machine"]] == ["my_machine.toml", "my_machine.py"]
    assert not proof["proved"] and proof["read_back"]["bound"] is None
    assert "checked, not proved" in run("verify", out, part, *control, *setup)
    assert "rapids" in run("time", part, *control, *setup)
    assert "line 9: " in run("trace", part, "--line", "9", *control, *setup)
    assert "the program of auto for linuxcnc is checked, not proved" in run("orient", part, *setup)
    again = str(tmp_path / "again.nc")
    refused = run("convert", part, *control, "-o", again, *setup, "--require-proof", code=1)
    assert "verify.no_bound" in refused and "leave --require-proof out" in refused and not (tmp_path / "again.nc").exists()


def test_the_sample_is_placed_and_analysed(tmp_path, part: str) -> None:
    (tmp_path / "setup.toml").write_text(OFF + "[placement]\nx = [-20, 20]\ny = [-20, 20]\n")
    assert "place" in run("place", part, "--setup", str(tmp_path / "setup.toml"), "-o",
                          str(tmp_path / "placed.toml"))
    assert (tmp_path / "placed.toml").exists()
    for words in (["analyse"], ["show"], ["check"]):
        done = CliRunner().invoke(app, ["machine", *words, str(SAMPLE.with_suffix(".toml"))],
                                  env={FILES: str(SAMPLE)})
        assert done.exit_code == 0 and "scissors" in done.output, done.output


def test_errors_that_the_kind_has_no_form_for_are_refused(tmp_path, part: str) -> None:
    (tmp_path / "errors.toml").write_text('[location]\nEA0S = 0.001\n')
    refused = run("convert", part, "-c", "linuxcnc", "-o", str(tmp_path / "o.ngc"), "--setup", str(tmp_path / "setup.toml"),
                  "--error-model", str(tmp_path / "errors.toml"), code=1)
    assert "errors of Scissors machines cannot be modelled" in refused and not (tmp_path / "o.ngc").exists()
