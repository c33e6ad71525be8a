"""LinuxCNC's own kinematics modules, loaded as they are installed, and our inverse: the same joints within 1e-6 mm.

A module asks its host for memory and pins alone (`kins_host.c`), so that no simulator runs. Its pose is the controlled point
and a, b, c in degrees, turns about x, then y, then z; its joints are in mm and degrees. pentakins has its own file,
linuxcnc-pentapod: struts that end on rings about the tool.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp

import numpy as np
import pytest

import machines
import postproc
from machines.kinematics.legs.attitudes import direction_of
from machines.kinematics.legs.on_legs import OnLegs
from machines.loader import load_checked
from tests.linuxcnc import outputs
from tests.linuxcnc.config import MODULES
from tests.machines.error_models import joints
from tests.machines.kinematics.test_legs import ARMS
from tests.postproc.control.test_tip_programs_of_legs import CRANKS, HEXAPOD, LINEAR_DELTA, LOW, TILTED
from tests.postproc.kit import good, setup_of, toolpath
from toolpaths.arrays import Floats

pytestmark = pytest.mark.skipif(not Path(MODULES, "genhexkins.so").exists() or shutil.which("gcc") is None,
                                reason="LinuxCNC's modules and gcc are needed (Debian: apt-get install linuxcnc-uspace gcc)")
SAME = 1e-6
"""mm or degrees"""


@cache
def host() -> ctypes.CDLL:
    folder = Path(mkdtemp(prefix="kins-host-"))
    try:
        subprocess.run(["gcc", "-O1", "-shared", "-fPIC", "-w", "-o", folder / "host.so",
                        Path(__file__).parent / "kins_host.c"], check=True)
        found = ctypes.CDLL(str(folder / "host.so"), mode=ctypes.RTLD_GLOBAL)
    finally:
        shutil.rmtree(folder)
    found.host_pin.restype = ctypes.POINTER(ctypes.c_double)
    return found


@cache
def loaded(module: str) -> ctypes.CDLL:
    host()
    library = ctypes.CDLL(str(Path(MODULES, f"{module}.so")))
    assert library.rtapi_app_main() == 0
    return library


def inverse(module: str, pins: dict[str, float], poses: Floats, count: int) -> Floats:
    """(N, count) joints that the module gives for poses (N, 6): x, y, z in mm, a, b, c in degrees."""
    own, library = host(), loaded(module)
    for name, value in pins.items():
        pin = own.host_pin(f"{module}.{name}".encode())
        assert pin, name
        pin[0] = value
    result, flags = np.empty((len(poses), count)), (ctypes.c_ulong * 1)(0)
    for row, pose in zip(result, poses, strict=True):
        found = (ctypes.c_double * 16)()
        assert library.kinematicsInverse((ctypes.c_double * 9)(*pose), found, flags, flags) == 0
        row[:] = found[:count]
    return result


def genhexkins_apart(count: int = 200) -> float:
    """mm between lengths of the hexapod and the module's, the worst of `count` poses."""
    kin = machines.load("hexapod").kinematics
    assert isinstance(kin, OnLegs)
    q = joints(kin, count)
    tip, axis, spin = kin.pose(q)
    turn = kin.turn_of(axis, spin)
    abc = np.degrees(np.column_stack([np.arctan2(turn[:, 2, 1], turn[:, 2, 2]), -np.arcsin(turn[:, 2, 0]),
                                      np.arctan2(turn[:, 1, 0], turn[:, 0, 0])]))
    ends = {"base": kin.legs.points, "platform": kin.loops.joints - kin.gauge}
    pins = {f"{what}.{k}.{letter}": value for what, points in ends.items() for k, point in enumerate(points)
            for letter, value in zip("xyz", point.tolist(), strict=True)}
    theirs = inverse("genhexkins", pins, np.column_stack([tip, abc]), 6)
    return float(np.abs(theirs - (kin.legs.lengths + q)).max())


def pentakins_apart(count: int = 200) -> float:
    """mm between lengths of struts on rings and the module's, the worst of `count` poses."""
    machine = machines.load("linuxcnc-pentapod")
    kin, control = machine.kinematics, machine.control_kinematics
    assert isinstance(kin, OnLegs) and kin.workspace is not None and control is not None
    rng = np.random.default_rng(0)
    axis = direction_of("abc", rng.uniform(0.0, kin.workspace.tilt[1], count), rng.uniform(0.0, 2.0 * np.pi, count))
    tip = rng.uniform(kin.workspace.lower, kin.workspace.upper, (count, 3))
    q = kin.inverse(tip, axis)[0]
    turn = kin._platform(q)[1]
    ab = np.degrees(np.column_stack([np.arctan2(turn[:, 2, 1], turn[:, 2, 2]), -np.arcsin(turn[:, 2, 0])]))
    pins = {key.split(".", 1)[1]: value for key, value in control.pins.items()} | {"tool-offset": 0.0}
    return float(np.abs(inverse("pentakins", pins, np.column_stack([tip, ab, 0.0 * ab[:, 0]]), 5) - q).max())


def rotarydeltakins_apart(count: int = 200) -> float:
    """Degrees between angles of a rotary Delta and the module's: its joint 0 stands at -y, 1 at 30 and 2 at 150 degrees, as
    the letters C and B of the file."""
    with TemporaryDirectory() as folder:
        Path(folder, "arms.toml").write_text(ARMS)
        machine, _ = load_checked(Path(folder, "arms.toml"))
    assert machine is not None
    q = joints(machine.kinematics, count)
    tip = machine.kinematics.forward(q)[0]
    pins = {"platformradius": 250.0, "thighlength": 350.0, "shinlength": 800.0, "footradius": 80.0}
    theirs = inverse("rotarydeltakins", pins, np.column_stack([tip, 0.0 * tip]), 3)
    return float(np.abs(theirs - np.degrees(q)[:, [0, 2, 1]]).max())


def lineardeltakins_apart(count: int = 200, legs: bool = False) -> float:
    """mm between slides of a linear Delta, also as kind "legs", and the module's, the worst of `count` poses."""
    with TemporaryDirectory() as folder:
        Path(folder, "own.toml").write_text(LINEAR_DELTA if legs else 'base = "linuxcnc-lineardelta"\n')
        machine = machines.load(Path(folder, "own.toml"))
    kin, control = machine.kinematics, machine.control_kinematics
    assert control is not None and kin.workspace is not None
    tip = np.random.default_rng(0).uniform(kin.workspace.lower, kin.workspace.upper, (count, 3)) - [0.0, 0.0, 20.0 * legs]
    ours = kin.inverse(tip, np.tile([0.0, 0.0, 1.0], (count, 1)))[0]
    pins = {key.split(".", 1)[1]: value for key, value in control.pins.items()}
    return float(np.abs(inverse("lineardeltakins", pins, np.column_stack([tip, 0.0 * tip]), 3) - ours).max())


APART: dict[str, Callable[[int], float]] = {
    "genhexkins": genhexkins_apart, "pentakins": pentakins_apart, "rotarydeltakins": rotarydeltakins_apart,
    "lineardeltakins": lineardeltakins_apart,
    "lineardeltakins, kind legs": partial(lineardeltakins_apart, legs=True)}
"""worst difference of joints, mm or degrees, at so many poses"""


@pytest.mark.parametrize("module", APART)
def test_the_joints_of_a_module_are_ours(module: str) -> None:
    assert APART[module](200) < SAME


UPRIGHT = ("RAPID", "GOTO/-40,-20,30", "FEDRAT/MMPM,1200", "GOTO/-40,-20,0", "GOTO/40,-20,0", "GOTO/40,20,5", "RAPID",
           "GOTO/40,20,30")


PENTAPOD = 'base = "linuxcnc-pentapod"\n'
HIGH = "[part]\norigin = [0, 140, 420]\n[tools.1]\ngauge_length = 80\n[clearance]\nmargin = 15\n"


@pytest.mark.parametrize(("text", "module", "cuts"), [(HEXAPOD, "genhexkins", TILTED), (CRANKS, "rotarydeltakins", UPRIGHT),
                                                      (PENTAPOD, "pentakins", TILTED)])
def test_the_module_moves_the_drives_of_a_tip_program_as_ours(text: str, module: str, cuts: tuple[str, ...],
                                                              tmp_path: Path) -> None:
    """Every block of a program, between its ends too, with the pins, zeros and order of joints that the files have."""
    (tmp_path / "own.toml").write_text(text)
    machine = machines.load(tmp_path / "own.toml")
    control = machine.control_kinematics
    assert control is not None and control.legs is not None
    result = good(postproc.convert(toolpath(*cuts), machine, "linuxcnc", setup_of(HIGH if module == "pentakins" else LOW)))
    assert "(words: tool-centre-point control)" in result.text
    motion, poses = outputs.read(result)[1], result.comparison.poses
    pins = {key.split(".", 1)[1]: value for key, value in control.pins.items()}
    rows = np.flatnonzero(motion.register >= 0)
    for share in (0.3, 1.0):
        words = motion.end[rows - 1] + share * (motion.end[rows] - motion.end[rows - 1])
        ours = result.machine.kinematics.drives(poses.joints(motion, rows, share))[:, list(control.legs.order)]
        held = pins | ({"tool-offset": 80.0} if control.tool_length_pin else {})
        theirs = inverse(module, held, np.pad(words, ((0, 0), (0, 6 - words.shape[1]))), ours.shape[1])
        angles = np.array(machine.rotary)[list(control.legs.order)]
        assert np.abs(theirs - np.where(angles, np.degrees(ours), ours + control.legs.zero)).max() < SAME
    assert result.witness is not None and not result.witness.findings
