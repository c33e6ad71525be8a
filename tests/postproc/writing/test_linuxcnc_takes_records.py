"""LinuxCNC's interpreter takes what the records ask for: compensation with a real tool, taps, dwells, switches."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from tests.linuxcnc import outputs
from tests.linuxcnc.interpreter import Canonical, ToolEntry
from tests.postproc.kit import convert, good, toolpath

HEAD = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,600,CLW", "FEDRAT/MMPM,600"]
SQUARE = ["RAPID", "GOTO/0,-20,5", "GOTO/0,-20,0", "CUTCOM/LEFT,1", "GOTO/0,0,0", "GOTO/0,60,0", "GOTO/60,60,0",
          "GOTO/60,0,0"]


def read(result: PostResult, interpret, folder: Path) -> Canonical:
    """The program under a tool table with diameters of 10 mm."""
    program = folder / "program.ngc"
    program.write_text(outputs.on_machine(result))
    table = {number: ToolEntry(entry.z, 10.0) for number, entry in outputs.tools(result).items()}
    return interpret(program, table)


@pytest.mark.parametrize(("tool", "diameter", "shift"), [
    ({"compensation": "wear"}, 0.0, 0.0), ({"compensation": "wear"}, 0.2, 0.1), ({"compensation": "wear"}, -0.2, -0.1),
    ({"contour": True}, 10.0, 5.0), ({"compensation": "none"}, 10.0, 0.0)])
def test_the_tool_table_holds_what_the_head_says(tool: dict[str, object], diameter: float, shift: float, interpret,
                                                 tmp_path: Path) -> None:
    """Wear: 0 is the path of the CL file, a greater radius to the left of it, a lesser one to the right; the contour
    by the radius; written uncompensated the table counts for nothing."""
    setup = SetupFile.model_validate({"tools": {"1": {"gauge_length": 90.0, **tool}}})
    lines = [*SQUARE, "CUTCOM/OFF", "GOTO/80,-20,0"]
    result = good(convert(toolpath(*lines, head=HEAD), "mill-3axis", setup=setup))
    program = tmp_path / "program.ngc"
    program.write_text(outputs.on_machine(result))
    c = interpret(program, {n: ToolEntry(entry.z, diameter) for n, entry in outputs.tools(result).items()})
    assert c.error == ""
    text = result.text.splitlines()
    up, across = (c.pos[c.line == 1 + text.index(word)] for word in ("Y60", "X60"))
    assert np.abs(up[-1, 0] + shift) < 1e-9 and np.abs(across[-1, 1] - 60.0 - shift) < 1e-9


@pytest.mark.parametrize("lines", [
    [], ["CUTCOM/OFF", "GOTO/60,-20,0"], ["GOHOME"], ["RAPID", "GOTO/60,0,50", "LOADTL/2", "SPINDL/RPM,600,CLW", *SQUARE],
    ["CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/30,30,0", "CYCLE/OFF", "RAPID", "GOTO/30,30,50"]])
def test_compensation_left_on_is_ended_where_linuxcnc_needs_it(lines: list[str], interpret,
                                                               tmp_path: Path) -> None:
    result = good(convert(toolpath(*SQUARE, *lines, head=HEAD), "mill-3axis"))
    text = result.text.splitlines()
    c = read(result, interpret, tmp_path)
    assert c.error == ""
    side = c.pos[c.line == 1 + text.index("Y60")][0]
    assert side[0] == pytest.approx(-5.0), "5 mm to the left of the contour"


@pytest.mark.parametrize("machine", ["mill-3axis", "linuxcnc-xyzac-trt"])
def test_switches_taps_and_dwells(machine: str, interpret, tmp_path: Path) -> None:
    lines = ["INSERT/M8", "RAPID", "GOTO/0,0,50", "CYCLE/TAP,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/10,0,0",
             "CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3,DWELL,15,REV", "GOTO/20,0,0", "CYCLE/OFF", "RAPID", "GOTO/20,0,50",
             "AUXFUN/9", "DELAY/20,REV", "LOADTL/1,ADJUST,21", "RAPID", "GOTO/0,0,50", "GOTO/1,0,50"]
    result = good(convert(toolpath(*lines, head=HEAD), machine))
    c = read(result, interpret, tmp_path)
    assert c.error == ""
    assert [s for s in c.seconds[np.isfinite(c.seconds) & (c.kind == 5)].tolist() if s > 0.1] == [1.5, 2.0]
    assert c.calls("FLOOD_ON") and c.calls("FLOOD_OFF")
