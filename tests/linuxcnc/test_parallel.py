"""Parallel machines on LinuxCNC: joint words with U read and run as meant; its lineardeltakins and our inverse agree."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import machines
import postproc
import toolpaths
from postproc.pipeline.result import PostResult
from postproc.setup.model import load_setup
from tests.linuxcnc import outputs
from tests.linuxcnc.simulator import Run
from tests.linuxcnc.test_motion import EXACT_STOP, cutting, deviations, poses, simulated
from tests.linuxcnc.test_outputs import check_feeds, check_motion, check_text
from tests.linuxcnc.test_simulator import TIGHT
from tests.postproc.kit import few_sides
from toolpaths.arrays import Floats, Ints
from toolpaths.toolpath import Kind

SAMPLES = Path("samples")
DELTA = "linuxcnc-lineardelta"
ZIGZAG = """UNITS/MM
LOADTL/1
SPINDL/RPM,1000,CLW
RAPID
GOTO/-30,-20,20
RAPID
GOTO/-30,-20,4
FEDRAT/MMPM,2400
GOTO/-30,-20,-2
GOTO/30,-15,-2
GOTO/30,0,1
GOTO/-25,5,-3
GOTO/-10,25,0
GOTO/28,22,-1
RAPID
GOTO/28,22,20
FINI
"""


def converted(sample: str, machine: str, setup_name: str, controller: str | Path = "linuxcnc") -> PostResult:
    setup, _ = load_setup(SAMPLES / f"{setup_name}.setup.toml")
    result = postproc.convert(few_sides(sample), machines.load(machine), controller, setup)
    assert result.ok, result.diagnostics
    return result


@pytest.mark.parametrize(("sample", "machine", "setup_name"), [
    ("h4a_dome.cls", "h4a-c-table", "h4a"), ("h4a_indexed.cls", "h4a-spindle-axis", "h4a"),
    pytest.param("pocket.cls", "uranesx", "delta", marks=pytest.mark.slow), ("pocket.cls", DELTA, "tools")])
def test_linuxcnc_reads_what_we_meant(interpret, sample: str, machine: str, setup_name: str) -> None:
    """Positions, feed modes and the time of each block, of programs whose words are joints (X, Y, Z, U and C or B)."""
    o = outputs.output(converted(sample, machine, setup_name), interpret)
    assert o.canonical.error == ""
    check_motion(o)
    check_feeds(o)
    check_text(o)
    cut = (o.motion.code > 0) & ~o.motion.hole
    assert o.motion.inverse[cut].all() == (machine != DELTA)


def zigzag(folder: Path, controller: str | Path, machine: str | Path = DELTA) -> PostResult:
    file = folder / "zigzag.apt"
    file.write_text(ZIGZAG)
    path, found = toolpaths.read(file)
    setup, _ = load_setup(SAMPLES / "tools.setup.toml")
    result = postproc.convert(path, machines.load(machine), controller, setup, diagnostics=found)
    assert result.ok, result.diagnostics
    return result


def test_lineardeltakins_at_the_points_of_a_posted_program(standstill) -> None:
    """Cartesian words of pocket.cls, and places all about its home: LinuxCNC's joints at rest there are ours, within 1e-6 mm."""
    result = converted("pocket.cls", DELTA, "tools")
    assert result.job is not None and "tool-centre-point control" in result.text
    machine, motion = result.machine, outputs.read(result)[1]
    gauge = np.unique(motion.end[(motion.register >= 0) & (motion.code > 0)], axis=0)
    assert len(gauge) > 30
    tip = machine.kinematics.forward(machine.home[None])[0] + np.random.default_rng(3).uniform(-40, 40, (20, 3))
    gauge = np.concatenate([gauge[::6], np.pad(tip, ((0, 0), (0, gauge.shape[1] - 3)))])
    theirs = standstill(machine, gauge)
    ours = machine.kinematics.inverse(gauge[:, :3], np.tile([0.0, 0.0, 1.0], (len(gauge), 1)))[0]
    assert np.abs(theirs - ours).max() < TIGHT


def test_joint_program_equals_the_joints_that_lineardeltakins_commands(standstill, tmp_path: Path) -> None:
    """The same machine without `[control]` module: the words at each CL point are LinuxCNC's joints there, rounded."""
    own = tmp_path / "joints.toml"
    own.write_text(f'base = "{DELTA}"\n[control]\nmodule = "trivkins"\n')
    joints, tips = zigzag(tmp_path, "linuxcnc", own), zigzag(tmp_path, "linuxcnc")
    assert joints.job is not None and "(words: machine coordinates without RTCP)" in joints.text
    words = outputs.read(joints)[1].end
    motion = outputs.read(tips)[1]
    gauge = motion.end[motion.code > 0]
    theirs = standstill(tips.machine, gauge)
    apart = np.abs(theirs[:, None, :] - words[None, :, :]).max(axis=2).min(axis=1)
    assert len(theirs) == 6 and apart.max() < 0.51e-4


@pytest.mark.parametrize(("base", "module", "turns"), [("hexapod", "genhexkins", True),
                                                       ("rotary-delta", "rotarydeltakins", False)])
def test_drives_at_rest_under_modules_with_axes_of_their_own(standstill, tmp_path: Path, base: str, module: str,
                                                             turns: bool) -> None:
    """Programmed positions with a tool of 80 mm, by the exported INI and HAL: LinuxCNC's joints are those of our drives."""
    own = tmp_path / "own.toml"
    own.write_text(f'base = "{base}"\n[control]\nmodule = "{module}"\n')
    machine = machines.load(own)
    control, axes = machine.control_kinematics, machine.on_control().kinematics.with_tool(80.0)
    assert control is not None and control.legs is not None
    tip = np.random.default_rng(3).uniform([-60, -60, -250], [60, 60, -200], (6, 3))
    axis = np.array([[0.1, 0.2, 1.0], [-0.2, 0.1, 1.0], [0.0, 0.0, 1.0]] * 2) if turns else np.tile([0.0, 0.0, 1.0], (6, 1))
    q = axes.inverse(tip, axis)[0]
    words = np.column_stack([tip - control.legs.origin, np.degrees(q[:, 3:])])
    theirs = standstill(machine, words, 80.0)
    ours = axes.drives(q)[:, list(control.legs.order)]
    assert np.abs(theirs - np.where(machine.rotary, np.degrees(ours), ours + control.legs.zero)).max() < TIGHT


@pytest.mark.parametrize("module", ["lineardeltakins", "trivkins"])
def test_the_tool_of_a_delta_stays_on_the_path(simulate, tmp_path: Path, module: str) -> None:
    own = tmp_path / "own.toml"
    own.write_text(f'base = "{DELTA}"\n[control]\nmodule = "{module}"\n')
    check_run(simulate, zigzag(tmp_path, "linuxcnc", own), tmp_path)


def test_the_tool_of_an_h4a_stays_on_the_path(simulate, tmp_path: Path) -> None:
    """Five joints X, Y, Z, U, C under inverse time, the control stopping at nothing but keeping to the path (G61)."""
    (tmp_path / "exact-stop.toml").write_text(EXACT_STOP)
    check_run(simulate, converted("h4a_dome.cls", "h4a-c-table", "h4a", tmp_path / "exact-stop.toml"), tmp_path)


def check_run(simulate, result: PostResult, folder: Path) -> None:
    run = simulated(simulate, result, folder)
    cycles, move, _ = cutting(result, run)
    assert len(cycles) > 1000
    cycles, move = cycles[::2], move[::2]
    assert result.job is not None
    tip, axis = poses(result, run.joints[cycles], lengths(result, run, cycles))
    off, tilt = deviations(result, tip, axis, move)
    print(f"\n{result.machine.name}: {len(cycles)} servo cycles, tip within {off.max():.6f} mm, axis within "
          f"{tilt.max():.6f} degrees")
    assert off.max() < result.options.tolerance and tilt.max() < result.options.axis_tolerance
    moves = result.job.moves
    ends = moves.tip[(moves.kind != Kind.RAPID) & ~moves.link]
    missed = [np.min(((tip - p) ** 2).sum(axis=1)) ** 0.5 for p in ends]
    assert max(missed) < 0.1


def lengths(result: PostResult, run: Run, cycles: Ints) -> Floats:
    """Gauge length (N,) of the tool in the spindle: joint words have no length offset that would say it."""
    assert result.job is not None
    motion = outputs.read(result)[1]
    by_line = np.zeros(int(max(motion.line.max(), run.line.max())) + 1)
    by_line[motion.line] = [result.job.length_of(int(number)) for number in motion.tool]
    return np.asarray(by_line[run.line[cycles]])
