"""Each machine with each control: a small part is written and proved, whatever the words hold."""

from __future__ import annotations

from contextlib import nullcontext
from functools import cache
from pathlib import Path

import pytest

import machines
import postproc
import toolpaths
from postproc.base.options import Options
from postproc.controllers.model import builtin_files
from postproc.setup.model import load_setup
from tests.margins import looked_at
from tests.postproc.kit import setup_of
from toolpaths.diagnostics import Severity

SAMPLES = Path(__file__).parents[3] / "samples"
PART = """UNITS/MM
LOAD/TOOL,1
SPINDL/RPM,3000,CLW
COOLNT/ON
RAPID
GOTO/2,3,30
FEDRAT/MMPM,400
GOTO/2,3,-1
GOTO/9,5,-1
CIRCLE/9,9,-1,0,0,1,4
GOTO/13,9,-1
RAPID
GOTO/13,9,30
STOP
SPINDL/RPM,3000,CLW
GOTO/2,8,30
LOAD/TOOL,2
SPINDL/RPM,900,CLW
GOTO/4,4,30
CYCLE/DRILL,DEPTH,6,MMPM,100,CLEAR,3
GOTO/4,4,0
GOTO/8,4,0
CYCLE/OFF
RAPID
GOTO/8,4,30
FINI
"""

FLAT = b"""UNITS/MM
LOAD/TOOL,1
SPINDL/RPM,3000,CLW
RAPID
GOTO/2,3,0
FEDRAT/MMPM,400
GOTO/9,5,0
CIRCLE/9,9,0,0,0,1,4
GOTO/13,9,0
STOP
SPINDL/RPM,3000,CLW
RAPID
GOTO/2,8,0
FINI
"""
"""what a machine can do that moves the tool in one plane alone"""
IN_PLANE = "[tools.1]\ngauge_length = 110.0\n[part]\norigin = [0.0, 0.0, -110.0]\n[clearance]\nin_plane = true\n"
PLACED = {"linuxcnc-pentapod": "[tools.1]\ngauge_length = 90.0\n[tools.2]\ngauge_length = 80.0\n[part]\n"
          "origin = [0.0, 140.0, 400.0]\n[clearance]\nmargin = 20\n"}
"""set-ups of machines whose origin is far below their workspace"""


COARSE = {"h4a-spindle-axis": 0.02, "rotary-delta": 0.04, "tilting-arms-c-table": 0.04}
"""mm: tolerances where the control has three decimals of a degree"""

MARGINS = ("h4-rotary", "delta-star")
"""machines on legs whose margins of tool lengths are looked for in `make test` too, of each way that rods run"""


@cache
def part_for(machine: str) -> tuple[toolpaths.Toolpath, object]:
    """The part, and the set-up that puts it where the machine reaches."""
    own = machines.load(machine)
    if own.kinematics.plane is not None:
        return toolpaths.read_bytes(FLAT)[0], setup_of(IN_PLANE)
    if machine in PLACED:
        return toolpaths.read_bytes(PART)[0], setup_of(PLACED[machine])
    kind = "tools" if own.kinematics.workspace is None or own.control_kinematics else (
        "h4a" if machine.startswith("h4a") else "delta")
    setup, _ = load_setup(SAMPLES / f"{kind}.setup.toml")
    return toolpaths.read_bytes(PART)[0], setup


@pytest.mark.covering
@pytest.mark.parametrize("control", sorted(builtin_files()))
@pytest.mark.parametrize("machine", machines.names())
def test_a_small_part_is_written_and_proved(machine: str, control: str, request: pytest.FixtureRequest) -> None:
    """With the margins of tool lengths where slides are straight, and on one of the others; `make slow`: on all."""
    path, setup = part_for(machine)
    few = not machines.load(machine).kinematics.straight_slides and machine not in MARGINS
    with looked_at() if request.node.get_closest_marker("slow") or not few else nullcontext():
        _proved(machine, control, path, setup)


def _proved(machine: str, control: str, path: toolpaths.Toolpath, setup: object) -> None:
    tolerance = COARSE.get(machine, 0.01) if control == "haas-ngc" else 0.01
    result = postproc.convert(path, machine, control, setup, Options(tolerance=tolerance))
    if set(machines.load(machine).axis_names) - set(result.controller.axes):
        assert {d.code for d in result.diagnostics if d.severity is Severity.ERROR} == {"write.axis_letters"}
        return
    assert result.ok, [str(d) for d in result.diagnostics if d.severity is Severity.ERROR]
    bounds = 0 if result.machine.kinematics.jets_proved else result.comparison.unbounded if result.comparison else -1
    assert result.comparison is not None and result.comparison.unbounded == bounds and result.witness is not None
    assert not [d for d in result.diagnostics if d.code.startswith("witness")]
