"""What nasty little CL files brought to light: names, modes that lack something, turns on the spot, large arcs."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

import toolpaths
from postproc.path.links import safe_space
from postproc.pipeline.result import PostResult
from postproc.reference.moves import Moves
from postproc.setup.model import Placement
from tests.postproc.kit import HEAD, codes, convert, good, goto, tilted, tool_setup, toolpath
from toolpaths.diagnostics import has_errors

OVER = ["RAPID", "GOTO/0,0,5"]
NX = ["UNITS/MM", "TOOL PATH/A,TOOL,T", "TLDATA/MILL,10,0,80,0,0", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1",
      "SPINDL/RPM,1000,CLW", "RAPID"]


@pytest.mark.parametrize("name", ["inch", "mm"])
def test_a_tnc_program_may_bear_any_name(name: str) -> None:
    path, found = toolpaths.read_bytes("\n".join([*HEAD, *OVER, "GOTO/9,0,5", "FINI"]).encode(),
                                       file=f"{name}.cls")
    assert not has_errors(found)
    assert f"BEGIN PGM {name.upper()} MM" in good(convert(path, "mill-3axis", "heidenhain-tnc640")).text


@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640"])
def test_a_mode_without_compensation_or_cycles_is_named(controller: str) -> None:
    cut = toolpath(*OVER, "CUTCOM/LEFT,1", "GOTO/9,0,5", "CUTCOM/OFF")
    tap = toolpath(*OVER, "CYCLE/TAP,DEPTH,5,MMPR,1,CLEAR,3", "GOTO/9,0,0", "CYCLE/OFF")
    result = convert(cut, "mikron-ucp710", controller, output="tcp")
    assert "cutcom.mode" in codes(result.diagnostics) and "cutcom.tilted" not in codes(result.diagnostics)
    [noted] = [d for d in convert(tap, "mikron-ucp710", controller, output="tcp").diagnostics
               if d.code == "cycle.not_native"]
    assert "in output mode tcp" in noted.message and "--output-mode" in noted.hint


@pytest.mark.covering(count=2)
@pytest.mark.parametrize("controller", ["linuxcnc", "fanuc-30i", "siemens-840d", "heidenhain-tnc640"])
def test_a_turn_on_the_spot_is_not_slow(controller: str) -> None:
    """Straight up half-way: C turns by 90 degrees there, which the feed of the tip knows nothing of."""
    axes = np.array([tilted(a, p) for a, p in ((30, 0), (15, 0), (0, 0), (15, 90), (30, 90))])
    tips = np.column_stack([np.zeros(5), np.arange(5) * 5.0, np.zeros(5)])
    path = toolpath("RAPID", *goto(tips[:1] + np.array([0.0, 0.0, 50.0]), axes[:1]), *goto(tips, axes))
    for mode in ("auto", "axes"):
        result = good(convert(path, "mikron-ucp710", controller, output=mode))
        assert "verify.slow" not in codes(result.diagnostics)


# ---- arcs and the room about them --------------------------------------------------------------------------


def made(*lines: str, controller: str = "linuxcnc") -> PostResult:
    path, found = toolpaths.read_bytes("\n".join([*NX, *lines, "END-OF-PATH", "FINI"]).encode(), file="a.cls")
    assert not has_errors(found), [str(d) for d in found]
    return convert(path, "mikron-ucp710", controller)


@pytest.mark.parametrize("controller", ["linuxcnc", "fanuc-30i", "siemens-840d", "heidenhain-tnc640"])
def test_a_short_arc_of_a_large_radius_asks_for_no_more_room(controller: str) -> None:
    """Its whole circle would reach 10 m away from the part: no path to link would be inside travel."""
    result = made("GOTO/0,0,20,0,0,1", "FEDRAT/MMPM,600", "GOTO/0,0,0", "CIRCLE/-5000,0,0,0,0,-1,5000,0.03,0.5,10,0",
                  "GOTO/-0.009,9.487,0", "RAPID", "GOTO/0,10,40", controller=controller)
    assert result.ok and result.job is not None
    assert np.ptp(result.job.space.corners, axis=0).max() < 25.0


@pytest.mark.covering(count=3)
@pytest.mark.parametrize("seed", range(6))
def test_the_room_is_that_of_dense_points_of_the_arcs(seed: int) -> None:
    """Random arcs and helices in random planes: the box is that of 20001 points of each."""
    rng = np.random.default_rng(seed)
    moves, dense = arcs_of(rng)
    space = safe_space(moves, tool_setup(), Placement(np.eye(3), np.zeros(3)))
    assert np.allclose(space.corners.min(axis=0), dense.min(axis=0), atol=1e-3)
    assert np.allclose(space.corners.max(axis=0), dense.max(axis=0), atol=1e-3)


def arcs_of(rng: np.random.Generator) -> tuple[Moves, np.ndarray]:
    """The moves of one arc in a random plane, and dense points of all that is cut, by plain trigonometry."""
    radius, turn = rng.uniform(1, 50), rng.uniform(0.1, 2 * np.pi)
    normal = tilted(rng.uniform(0, 90), rng.uniform(0, 360))
    first = np.cross(normal, [0.3, 0.5, 0.8])
    first /= np.linalg.norm(first)
    t = np.linspace(0.0, turn, 20001)[:, None]
    centre = rng.uniform(-20, 20, 3)
    dense = centre + radius * (np.cos(t) * first + np.sin(t) * np.cross(normal, first))
    numbers = ",".join(f"{v:.9f}" for v in (*centre, *-normal, radius, 0.03, 0.5, 10, 0))
    axis = ",".join(f"{v:.9f}" for v in normal)
    rows = [",".join(f"{v:.9f}" for v in p) for p in (dense[0] + 5 * normal, dense[0], dense[-1])]
    result = made(f"GOTO/{rows[0]},{axis}", "FEDRAT/MMPM,600", f"GOTO/{rows[1]}", f"CIRCLE/{numbers}",
                  f"GOTO/{rows[2]}")
    assert result.job is not None and len(result.job.moves.arcs) == 1
    return result.job.moves, np.vstack([dense, dense[:1] + 5 * normal])


# ---- every form at once ------------------------------------------------------------------------------------

PIECES = [
    ["GOTO/0,0,0", "CUTCOM/LEFT,7", "GOTO/10,0,0", "GOTO/10,10,0", "CUTCOM/OFF", "GOTO/0,20,0"],
    ["COOLNT/MIST", "GOTO/1,0,0", "COOLNT/THRU,HIGH", "GOTO/2,0,0", "COOLNT/AIR", "GOTO/3,0,0", "COOLNT/OFF"],
    ["DELAY/0.5", "GOTO/1,0,0", "DELAY/5,REV", "OPSTOP", "GOTO/3,0,0", "STOP", "GOTO/5,0,0"],
    ["PPRINT/HELLO (WORLD); 50% ~ \"x\"", "INSERT/M8", "GOTO/1,0,0", "INSERT/(comment)", "AUXFUN/9", "GOTO/4,0,0"],
    ["FEDRAT/MMPR,0.1", "GOTO/0,0,0", "SPINDL/RPM,2000,CLW", "GOTO/10,0,0", "FEDRAT/MMPM,99999", "GOTO/20,0,0"],
    ["GOTO/0,0,0", "GODLTA/0,0,10", "OPSKIP/ON", "GOTO/5,0,0", "COOLNT/FLOOD", "GOTO/5,5,0", "OPSKIP/OFF", "GOTO/0,5,0"],
    ["CYCLE/DEEP,DEPTH,20,STEP,4,MMPM,100,CLEAR,3", "GOTO/5,0,0", "GOTO/6,9,-3", "CYCLE/OFF", "GOHOME", "RAPID",
     "GOTO/0,0,5", "CYCLE/BORE,DEPTH,5,MMPM,100,CLEAR,3,RETURN,40,DWELL,1", "GOTO/9,9,0", "CYCLE/OFF"],
]
LEAN = [2, 3, 4]
"""numbers of the pieces that a leaning tool may cut too"""


def leaning(lines: list[str], axis: np.ndarray) -> list[str]:
    """The piece with its points in a frame whose Z is `axis`."""
    x = np.cross([0.0, 1.0, 0.0], axis)
    frame = np.column_stack([x / np.linalg.norm(x), np.cross(axis, x / np.linalg.norm(x)), axis])
    result = []
    for line in lines:
        numbers = line.removeprefix("GOTO/").split(",") if line.startswith("GOTO/") else []
        result += goto([frame @ np.array(numbers, dtype=float)], [axis]) if numbers else [line]
    return result


@pytest.mark.covering
@pytest.mark.parametrize("output", [{}, {"restart": True}, {"subprograms": True}],
                         ids=["plain", "restart", "subprograms"])
@pytest.mark.parametrize(("controller", "machine"), [
    *product(["linuxcnc", "generic-iso", "fanuc-30i", "siemens-840d", "heidenhain-tnc640"], ["mikron-ucp710"]),
    ("haas-ngc", "trunnion-bc"), ("fanuc-30i", "head-table"), ("linuxcnc", "linuxcnc-xyzac-trt")])
def test_every_form_is_written_and_proved(controller: str, machine: str, output: dict[str, bool]) -> None:
    if output.get("subprograms") and controller in ("linuxcnc", "generic-iso"):
        output = {"restart": True}
    lines = [n for piece in PIECES for n in ["RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,5", *piece, "RAPID", "GOTO/0,0,50"]]
    axis = tilted(30.0, 40.0)
    tilt = [n for k in LEAN for n in leaning(["RAPID", "GOTO/0,0,50", *PIECES[k], "RAPID", "GOTO/0,0,50"], axis)]
    usual = tool_setup()
    setup = usual.model_copy(update={"output": usual.output.model_copy(update={**output, "rapids_as_feed": True})})
    result = good(convert(toolpath(*lines, "LOADTL/2", "SPINDL/RPM,500,CCLW", *tilt), machine, controller, setup))
    assert result.comparison is not None and result.comparison.worst_tip < 0.01
    assert not [c for c in codes(result.diagnostics) if c.startswith(("verify.", "gcode.")) and c != "gcode.block_delete"]
