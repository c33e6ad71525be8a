"""Our programs in LinuxCNC's motion control: from its joints, through our kinematics, the tool is on the CL path."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from machines.machine import Machine
from postproc.pipeline.result import PostResult
from postproc.setup.model import load_setup
from tests.linuxcnc import outputs
from tests.linuxcnc.simulator import Run
from toolpaths.arrays import Floats, Ints
from toolpaths.rotations import angle_between, slerp
from toolpaths.toolpath import Kind

SAMPLES = Path("samples")
EXACT_STOP = """base = "linuxcnc"
description = "LinuxCNC that keeps to the path"

[program]
preamble = ["G21 G90 G94 G17 G40 G49 G80", "G54", "G61"]
path_tolerance = []

[kinematics]
smoothing_share = 0.0
"""
CASES = [("tool_axis_tour.apt", "linuxcnc-xyzac-trt"), ("tool_axis_tour.apt", "mikron-ucp710"),
         ("five_faces.cls", "linuxcnc-xyzbc-trt")]
BLENDED_AXIS = 0.05
"""degrees beyond the axis tolerance: G64 P limits how far X, Y, Z are rounded off, not the rotary axes"""


def quick(machine: Machine) -> Machine:
    """The machine with ten times the acceleration, so that short blocks do not last."""
    return replace(machine, limits=replace(machine.limits, acceleration=10.0 * machine.limits.acceleration))


def converted(sample: str, machine: str, controller: str | Path) -> PostResult:
    path, found = toolpaths.read(SAMPLES / sample)
    setup, _ = load_setup(SAMPLES / "tools.setup.toml")
    result = postproc.convert(path, machines.load(machine), controller, setup, diagnostics=found)
    assert result.ok, result.diagnostics
    return result


def simulated(simulate, result: PostResult, folder: Path, warp: int = 20) -> Run:
    """The program on LinuxCNC with the work offset of its header and the tools of the set-up."""
    (folder / "program.ngc").write_text(outputs.on_machine(result, home=False))
    run: Run = simulate(quick(result.machine), folder / "program.ngc", outputs.tools(result), warp=warp)
    assert run.errors == ()
    return run


LINE_LAG = 2
"""servo cycles by which LinuxCNC's line number follows the joints: the last of a stretch belong to the rapid behind it"""


def cutting(result: PostResult, run: Run) -> tuple[Ints, Ints, Floats]:
    """(servo cycles (N,) in feed blocks of the path, the CL move (N,) of each, its tool's gauge length (N,))."""
    assert result.comparison is not None and result.job is not None
    motion, owner, moves = outputs.read(result)[1], result.comparison.owner, result.job.moves.without_pecks()
    last = int(max(motion.line.max(), run.line.max()))
    feeding = (motion.code > 0) & (owner < len(moves)) & ~moves.link[np.minimum(owner, len(moves) - 1)]
    move, register = np.full(last + 1, -1), np.full(last + 1, -1)
    move[motion.line[feeding]] = owner[feeding]
    register[motion.line] = motion.register
    plain = np.ones(last + 1, dtype=bool)
    plain[motion.line[motion.hole]] = False
    feeds = (move[run.line] >= 0) & plain[run.line]
    feeds[:-LINE_LAG] &= feeds[LINE_LAG:]
    cycles = np.flatnonzero(feeds)
    lengths = result.job.register_lengths()
    length = np.array([lengths.get(int(h), 0.0) for h in range(-1, int(register.max()) + 1)])
    return cycles, move[run.line[cycles]], length[register[run.line[cycles]] + 1]


def poses(result: PostResult, joints: Floats, length: Floats) -> tuple[Floats, Floats]:
    """(tip, axis) (N, 3) of LinuxCNC's joints, mm and degrees, by our forward kinematics."""
    unit = np.where(result.machine.rotary, 180.0 / np.pi, 1.0)
    tip, axis = np.empty((len(joints), 3)), np.empty((len(joints), 3))
    for value in np.unique(length):
        k = length == value
        tip[k], axis[k] = result.machine.kinematics.with_tool(float(value)).forward(joints[k] / unit)
    return tip, axis


def deviations(result: PostResult, tip: Floats, axis: Floats, move: Ints) -> tuple[Floats, Floats]:
    """(mm, degrees) (N,) off the straight line and the great circle from the CL point before to the move's own.

    Where one block runs into the next the nearest of the three moves counts.
    """
    assert result.job is not None
    moves = result.job.moves.without_pecks()
    best = np.full((2, len(tip)), np.inf)
    for step in (0, -1, 1):
        to = np.clip(move + step, 1, len(moves) - 1)
        start, travel = moves.tip[to - 1], moves.tip[to] - moves.tip[to - 1]
        size = np.maximum((travel**2).sum(axis=1), 1e-12)
        u = np.clip(((tip - start) * travel).sum(axis=1) / size, 0.0, 1.0)
        off = np.linalg.norm(tip - start - u[:, None] * travel, axis=1)
        tilt = np.degrees(angle_between(axis, slerp(moves.axis[to - 1], moves.axis[to], u)))
        better = off + tilt < best.sum(axis=0)
        best[:, better] = np.stack([off, tilt])[:, better]
    return best[0], best[1]


def passed(result: PostResult, run: Run) -> Floats:
    """(M,) mm from each cutting CL point to the nearest servo cycle, drilling cycles included."""
    assert result.job is not None
    motion, moves, lengths = outputs.read(result)[1], result.job.moves.without_pecks(), result.job.register_lengths()
    register = np.full(int(max(motion.line.max(), run.line.max())) + 1, -1)
    register[motion.line] = motion.register
    cycles = np.flatnonzero(register[run.line] >= 0)
    length = np.array([lengths[int(h)] for h in register[run.line[cycles]]])
    tip, _ = poses(result, run.joints[cycles], length)
    points = moves.tip[(moves.kind != Kind.RAPID) & ~moves.link]
    return np.array([np.min(((tip - p) ** 2).sum(axis=1)) for p in points]) ** 0.5


@pytest.mark.parametrize(("sample", "machine", "stopping"), [(*CASES[0], True), (*CASES[1], False),
                                                             pytest.param(*CASES[2], True, marks=pytest.mark.slow),
                                                             pytest.param(*CASES[2], False, marks=pytest.mark.slow)])
def test_tool_stays_on_the_path(simulate, tmp_path: Path, sample: str, machine: str, stopping: bool) -> None:
    """Tip inside the tolerance, of which G64 P and Q have their share; the axis too where the control does not blend."""
    (tmp_path / "exact-stop.toml").write_text(EXACT_STOP)
    result = converted(sample, machine, tmp_path / "exact-stop.toml" if stopping else "linuxcnc")
    assert ("G61" in result.text) == stopping
    run = simulated(simulate, result, tmp_path)
    cycles, move, length = cutting(result, run)
    assert len(cycles) > 1000
    off, tilt = deviations(result, *poses(result, run.joints[cycles], length), move)
    options = result.options
    assert off.max() < options.tolerance
    assert tilt.max() < options.axis_tolerance + (0.0 if stopping else BLENDED_AXIS)
    feeding = np.linalg.norm(np.diff(run.pose[cycles, :3], axis=0), axis=1)[np.diff(cycles) == 1].max()
    assert passed(result, run).max() < 0.5 * feeding + options.tolerance
