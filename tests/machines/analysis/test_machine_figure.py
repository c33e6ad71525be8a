"""Figures of machines on legs: what is drawn is where the parts are."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import machines
from machines.analysis.machine_figure import PATH, foot_paths, machine_figure
from postproc.cli.app import app


@pytest.mark.parametrize("name", ["uranesx", "h4a-c-table", "rotary-delta", "hexapod", "planar-delta-z"])
def test_feet_run_over_the_travel_of_their_drives(name: str) -> None:
    machine = machines.load(name)
    paths = foot_paths(machine, machine.home)
    parts = machine.kinematics.clearance_parts
    assert parts is not None and paths.shape == (len(parts.leg_names), PATH, 3) and np.isfinite(paths).all()
    for k, letter in enumerate(parts.leg_names):
        j = machine.axis_names.index(letter)
        run = np.linalg.norm(np.diff(paths[k], axis=0), axis=1).sum()
        travel = machine.limits.upper[j] - machine.limits.lower[j]
        arm = np.linalg.norm(paths[k, 0] - parts.legs.points[k]) if machine.rotary[j] else 1.0
        assert run == pytest.approx(0.0 if name == "hexapod" else arm * travel, rel=1e-3)


def test_the_command_draws_machines_on_legs_and_refuses_others(tmp_path: Path) -> None:
    def show(*words: str) -> int:
        return CliRunner().invoke(app, ["machine", "show", *words]).exit_code
    svg, png = tmp_path / "m.svg", tmp_path / "m.png"
    assert show("rotary-delta", "--figure", str(svg)) == 0 and svg.read_text().startswith("<?xml")
    assert "workspace of the platform" in svg.read_text()
    assert show("rotary-delta", "--figure", str(svg), "--at", "A=20", "--at", "B=-5.5") == 0
    assert "at A20 B-5.5 C13.271" in svg.read_text()
    assert show("triaglide", "--figure", str(png), "--at", "X=50", "--at", "Y=-1600", "--at", "Z=1600") == 2
    for wrong in (["--at", "A=81"], ["--at", "X=1"], ["--at", "A=x"]):
        assert show("rotary-delta", "--figure", str(png), *wrong) == 2 and not png.exists(), wrong
    assert show("rotary-delta", "--at", "A=20") == 2
    assert show("mill-3axis", "--figure", str(png)) == 2 and not png.exists()
    assert show("uranesx", "--figure", str(tmp_path / "m.pdf")) == 2


def test_joints_where_the_legs_do_not_meet_are_refused() -> None:
    machine = machines.load("uranesx")
    with pytest.raises(ValueError, match="meet at no platform"):
        machine_figure(machine, ".png", machine.home + np.array([0.0, 0.0, 9000.0]))
    with pytest.raises(ValueError, match="no legs"):
        machine_figure(machines.load("mill-3axis"), ".png")
