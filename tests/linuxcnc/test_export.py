"""What `machine export` writes, run by LinuxCNC: its interpreter reads the INI, its motion has our kinematics."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.exchange.export import export_linuxcnc
from machines.exchange.read import import_machine
from machines.machine import Machine
from tests.linuxcnc.test_simulator import TIGHT, random_poses

HEAD = """base = "linuxcnc-xyzbc-trt"
[kinematics]
structure = "w b X Y Z C B (C1) t"
[kinematics.axes.B]
point = [0, 0, 180]
direction = [0, -1, 0]
[kinematics.axes.C]
point = [0, 0, 0]
direction = [0, 0, 1]
[control]
module = "5axiskins"
"""


def back(machine: Machine, folder: Path) -> Machine:
    """The machine of the exported INI."""
    for name, text in export_linuxcnc(machine, "m")[0].items():
        (folder / name).write_text(text)
    found = import_machine(folder / "m.ini", "auto", ())
    assert found[1] is not None, found[2]
    return found[1]


@pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC's interpreter rs274 is not installed "
                    "(Debian: apt-get install linuxcnc-uspace)")
def test_the_interpreter_takes_the_exported_ini(tmp_path: Path) -> None:
    """C is modulo there: C-10 goes on to the next 350 in its own direction."""
    (tmp_path / "own.toml").write_text('base = "mikron-ucp710"\n[axes.C]\nmodulo = true\n')
    back(machines.load(tmp_path / "own.toml"), tmp_path)
    (tmp_path / "p.ngc").write_text("G21 G90 G94 F100\nG1 X10 A5 C20\nG1 C-10\nM2\n")
    (tmp_path / "m.var").write_text("5161\t0\n")
    done = subprocess.run(["rs274", "-i", "m.ini", "-t", "m.tbl", "-g", "p.ngc"], cwd=tmp_path, capture_output=True,
                          text=True, timeout=60, check=False)
    ends = [float(row.rsplit(",", 1)[1]) for row in re.findall(r"STRAIGHT_FEED\(([^)]*)\)", done.stdout)]
    assert "PROGRAM_END" in done.stdout and ends == pytest.approx([20.0, 10.0]), done.stdout + done.stderr


@pytest.mark.covering
@pytest.mark.parametrize(("name", "length"), [("5axiskins", 0.0), ("5axiskins", 75.5), ("linuxcnc-xyzac-trt", 75.5)])
def test_the_imported_machine_stands_where_linuxcnc_stands(standstill, name: str, length: float, tmp_path: Path) -> None:
    """A head under 5axiskins, whose pivot length is a sum with the tool's, and tables; through the INI."""
    (tmp_path / "head.toml").write_text(HEAD)
    machine = back(machines.load(tmp_path / "head.toml" if name == "5axiskins" else name), tmp_path)
    poses = random_poses(machine, 12)
    joints = standstill(machine, poses, length)
    unit = np.where(machine.rotary, 180 / np.pi, 1.0)
    tip = machine.kinematics.with_tool(length).forward(joints / unit)[0]
    np.testing.assert_allclose(tip, poses[:, :3], rtol=0, atol=TIGHT)
    np.testing.assert_allclose(joints[:, 3:], poses[:, 3:], rtol=0, atol=TIGHT)
