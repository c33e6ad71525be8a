"""LinuxCNC with a screw compensation table of ours: its motors move by the table's value, each path its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
from machines.geometric_error.actual.model import ErrorModel
from machines.geometric_error.actual.serial_errors import Component, SerialErrors
from machines.geometric_error.exchange.exports import to_screws
from machines.geometric_error.tables.curves import TableCurve
from machines.geometric_error.tables.names import parse
from tests.linuxcnc import config
from toolpaths.arrays import Floats

STOPS = (-60.0, -13.0, 40.0, 71.0, 5.0, -40.0, -58.5)
"""mm, X: forwards four times, then backwards"""
TABLE = TableCurve(np.array([-80.0, -50.0, 0.0, 30.0, 80.0]),
                   np.array([0.010, -0.020, 0.005, 0.030, 0.015, 0.014, -0.012, 0.011, 0.041, 0.022]), both=True)


@pytest.fixture
def compensated(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The table of the X joint is on, and its motor's command is sampled instead of the joint's."""
    write = config.write
    name = parse("EXX")
    assert name is not None
    model = ErrorModel(SerialErrors((Component(name, TABLE),)))
    (tmp_path / "x.comp").write_text(to_screws(model, machines.load("mill-3axis"), {}, 1e-4, 1e-7).texts["X"])
    (tmp_path / "x.comp").chmod(0o644)
    tmp_path.chmod(0o755)

    def both(folder: Path, *arguments: object) -> None:
        write(folder, *arguments)
        hal, ini = folder / "sim.hal", folder / "sim.ini"
        hal.write_text(hal.read_text().replace("net sample0 joint.0.pos-cmd =>", "net feedback0 =>"))
        (folder / "x.comp").write_bytes((tmp_path / "x.comp").read_bytes())
        ini.write_text(ini.read_text().replace("[JOINT_0]", f"[JOINT_0]\nCOMP_FILE = {folder}/x.comp\n"
                                               "COMP_FILE_TYPE = 0"))

    monkeypatch.setattr(config, "write", both)


def at_rest(run_joints: Floats, stops: tuple[float, ...]) -> Floats:
    """X of the motor where it last stands within 0.2 mm of each stop, in order; NaN where no such stand was recorded."""
    still = np.flatnonzero(np.all(np.abs(np.diff(run_joints, axis=0)) < 1e-12, axis=1))
    found, first = [], 0
    for stop in stops:
        near = still[(still >= first) & (np.abs(run_joints[still, 0] - stop) < 0.2)]
        runs = np.split(near, np.flatnonzero(np.diff(near) > 1) + 1)
        longest = max(runs, key=len)
        found.append(run_joints[longest[-1], 0] if len(longest) else np.nan)
        first = int(longest[-1]) if len(longest) else first
    return np.array(found)


def test_the_motor_moves_by_the_tables_value(simulate, tmp_path: Path, compensated: None) -> None:
    """It stands where the joint is told to stand, less the table's value of the way that it came."""
    machine = machines.load("mill-3axis")
    program = tmp_path / "x.ngc"
    moves = "\n".join(f"G1 X{x} F3000\nG4 P0.3" for x in STOPS)
    program.write_text(f"G21 G90 G61 G94\nG53 G0 X-75\n{moves}\nM2\n")
    for _ in range(3):  # a busy host may lose samples: then the run is made again
        run = simulate(machine, program)
        assert run.errors == ()
        stands = at_rest(run.joints, STOPS)
        if np.isfinite(stands).all():
            break
    travel = np.sign(np.diff((-75.0, *STOPS)))
    assert travel.tolist() == [1, 1, 1, 1, -1, -1, -1]
    assert stands - np.array(STOPS) == pytest.approx(-TABLE.at(np.array(STOPS), travel), abs=5e-7)
