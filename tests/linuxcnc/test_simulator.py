"""LinuxCNC's motion control next to our machines: the same joints for the same pose, and times that theory gives."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import machines
from machines.machine import Machine
from tests.linuxcnc import simulator
from tests.linuxcnc.simulator import Run
from toolpaths.arrays import Floats

TIGHT = 1e-6
"""mm and degrees"""


def write(folder: Path, text: str) -> Path:
    program = folder / "program.ngc"
    program.write_text(text)
    return program


def random_poses(machine: Machine, count: int) -> Floats:
    """(N, 5) tip x y z within 200 mm and both rotary joints inside their travel, as a program has them."""
    rng = np.random.default_rng(7)
    rotary = np.flatnonzero(machine.rotary)
    span = np.degrees(np.clip(machine.limits.upper[rotary], None, 2.5 * np.pi))
    return np.hstack([rng.uniform(-200, 200, (count, 3)), rng.uniform(-0.95, 0.95, (count, len(rotary))) * span])


@pytest.mark.covering
@pytest.mark.parametrize(("name", "tool_length"), [("linuxcnc-xyzac-trt", 0.0), ("linuxcnc-xyzac-trt", 75.5),
                                                 ("linuxcnc-xyzbc-trt", 75.5)])
def test_joints_at_standstill_are_our_inverse(standstill, name: str, tool_length: float) -> None:
    machine = machines.load(name)
    poses = random_poses(machine, 20)
    joints = standstill(machine, poses, tool_length)
    model, unit = machine.kinematics.with_tool(tool_length), np.where(machine.rotary, 180 / np.pi, 1.0)
    angles = np.where(machine.rotary, joints / unit, 0.0)
    axis = model.forward(angles)[1]
    branches = model.inverse(poses[:, :3], axis, near=joints / unit) * unit
    distance = np.abs(branches - joints)
    turns = np.where(machine.rotary, np.minimum(np.mod(distance, 360), 360 - np.mod(distance, 360)), distance)
    best = np.nanmin(turns.max(axis=2), axis=0)
    assert best.max() < TIGHT
    np.testing.assert_allclose(joints[:, 3:], poses[:, 3:], rtol=0, atol=TIGHT)


def test_straight_move_takes_length_over_feed_and_one_ramp(recorded, tmp_path: Path) -> None:
    machine = machines.load("mill-3axis")
    run = recorded(machine, write(tmp_path, "G21 G90 G94 G61\nF1000\nG1 X100\nM2\n"))
    speed, acceleration = 1000 / 60, float(machine.limits.acceleration[0])
    assert run.errors == ()
    assert run.seconds == pytest.approx(100 / speed + speed / acceleration, abs=0.006)
    np.testing.assert_allclose(run.joints[-1], np.add(machine.home, [100, 0, 0]), atol=1e-9)


@pytest.mark.slow  # whoever compares a time with a recorded one at another warp shows it too
def test_warp_does_not_change_the_machine_time(recorded, tmp_path: Path) -> None:
    program = write(tmp_path, "G21 G90 G94 G61\nF6000\nG1 X50\nG1 Y30\nM2\n")
    times = [recorded(machines.load("mill-3axis"), program, warp=warp).seconds for warp in (Fraction(3, 4), 20)]
    assert times[0] == pytest.approx(times[1], abs=0.005)


def test_pose_and_joints_belong_together_in_motion(simulate, tmp_path: Path) -> None:
    """Joints trail the pose through a smoothing of 1 ms, nothing more."""
    machine = machines.load("linuxcnc-xyzac-trt")
    text = "G21 G90 G94 G61\nT1 M6\nG43 H1\nF3000\nG1 X20 Y10 Z5 A20 C40\nG1 X-20 A-15 C-60\nM2\n"
    run = simulate(machine, write(tmp_path, text), {1: (75.5, 6.0)})
    assert run.errors == () and run.axes == "XYZAC"
    unit = np.where(machine.rotary, 180 / np.pi, 1.0)
    tip = machine.kinematics.with_tool(75.5).forward(run.joints / unit)[0]
    assert np.abs(tip - (run.pose[:, :3] - np.array([0, 0, 75.5]))).max() < 2e-3
    assert set(run.line[run.line > 0]) == {5, 6}


def test_what_the_control_refuses_is_reported(simulate, tmp_path: Path) -> None:
    run = simulate(machines.load("mill-3axis"), write(tmp_path, "G21 G90 G94\nG1 X600 F3000\nM2\n"))
    assert any("exceed" in error for error in run.errors)


def recording(seconds: float, waited: float, still: float = 0.0) -> Run:
    """A run of one joint that moves for so long and stands in between; the host was busy for `waited` s of it."""
    travel = np.ones(round(1000 * seconds))
    travel[100:100 + round(1000 * still)] = 0.0
    joints = np.cumsum(travel)[:, None]
    return Run(t=1e-3 * np.arange(len(travel)), joints=joints, pose=joints, line=np.ones(len(travel), dtype=int), axes="X",
               errors=(), starved=0.0, waited=waited)


@pytest.mark.parametrize(("taken", "seconds", "made"), [
    ([(10.0, 0.0, 0.0)], 10.0, 1),  # nobody waited
    ([(10.0, 5.0, 0.0)], 10.0, 1),  # nothing stood while they did
    ([(10.0, 0.01, 0.5)], 10.0, 1),  # a programmed dwell on a quiet host
    ([(10.2, 5.0, 0.7), (10.0, 0.01, 0.5)], 10.0, 2),
    ([(10.2, 5.0, 0.7), (10.1, 4.0, 0.6), (10.005, 3.0, 0.5), (10.0, 2.0, 0.5)], 10.0, 4),
    ([(10.5 - 0.1 * k, 5.0, 1.0) for k in range(6)], 10.0, 6)])
def test_starved_recordings_are_made_again(monkeypatch: pytest.MonkeyPatch, taken: list[tuple[float, float, float]],
                                           seconds: float, made: int) -> None:
    """Until one is beyond uncertainty or the two shortest agree, each at half the warp of the one before; the
    shortest counts."""
    warps: list[Fraction] = []

    def simulated(machine: Machine, program: Path, tools: None, warp: Fraction) -> Run:
        warps.append(warp)
        return recording(*taken[len(warps) - 1])

    monkeypatch.setattr(simulator, "simulate", simulated)
    found = simulator.recorded(machines.load("mill-3axis"), Path("program.ngc"), warp=20)
    assert found.seconds == pytest.approx(seconds, abs=0.002)
    assert warps == [Fraction(20, 2**k) for k in range(made)]
