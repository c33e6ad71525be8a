"""Programs and CL files to blocks: feeds, path modes, pauses, operations."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import postproc
import toolpaths
from postproc.controllers.model import load_controller
from postproc.cycle_time.blocks import Cause, CornerMode, MotionBlocks
from postproc.cycle_time.conversion import estimate_of
from postproc.cycle_time.estimate import estimate
from postproc.cycle_time.shape import shape
from postproc.cycle_time.source import from_conversion, from_gcode
from postproc.setup.model import SetupFile
from tests.postproc.kit import SAMPLES, TOOLS, convert, toolpath
from tests.postproc.time_kit import HEAD, blocks, machine, model
from toolpaths.cl.text.kinds_of_file import looks_like_gcode


def pauses(b: MotionBlocks, cause: Cause) -> list[tuple[int, float]]:
    p = b.pauses
    return [(int(k), float(s)) for k, s in zip(p.block[p.cause == cause], p.seconds[p.cause == cause], strict=True)]


def test_feeds_of_every_kind_are_mm_and_rad_per_second() -> None:
    five = machine("mikron-ucp710")
    b = blocks(f"{HEAD}\nF600\nG1 X10\nG1 A30\nG1 X20 A40\nG93 G1 X30 Y10 F30\nG1 C60 F6\nG94 F1200\nG1 X0", five)
    expected = [10.0, np.radians(10.0), 10.0, np.hypot(10, 10) * 0.5, np.radians(60) * 0.1, 20.0]
    assert b.speed == pytest.approx(expected, rel=1e-9)


def test_inch_feeds_are_those_of_millimetres() -> None:
    inch, mm = blocks("G20 G90 G94\nF60\nG1 X2\nG2 X4 I1 J0"), blocks("G21 G90 G94\nF1524\nG1 X50.8\nG2 X101.6 I25.4 J0")
    assert inch.speed == pytest.approx([25.4, 25.4]) == mm.speed
    assert shape(inch).length == pytest.approx(shape(mm).length, rel=1e-9)


def test_feeds_keep_the_units_in_which_linuxcnc_took_them() -> None:
    """F is carried out before G20 and G21 of its block, and stays what it was when the units change."""
    text = "G21 G90 G94\nF600\nG1 X10\nG20\nG1 X1\nF30\nG1 X2\nG21 F30\nG1 X60\nF900\nG1 X70"
    assert blocks(text).speed == pytest.approx([10.0, 10.0, 12.7, 12.7, 15.0])
    assert blocks(text, controller="generic-iso").speed == pytest.approx([10.0, 254.0, 12.7, 0.5, 15.0])


def test_blending_where_no_path_mode_is_stated_is_a_key_of_the_controller(tmp_path: Path) -> None:
    shop = tmp_path / "shop.toml"
    shop.write_text('base = "generic-iso"\nkinematics.blends_unstated = true\n')
    text = f"{HEAD}\nF600\nG1 X1\nG64 P0.02\nG1 X2"
    own, plain, fast = (blocks(text, controller=name).tolerance for name in ("linuxcnc", "generic-iso", str(shop)))
    assert own.tolist() == fast.tolist() == [np.inf, 0.02] and np.isnan(plain[0]) and plain[1] == 0.02


def test_a_dwell_of_nothing_is_a_stop() -> None:
    line = "\n".join(f"G4 P{{}}\nG1 X{10 * i}" for i in range(1, 9))
    none, some = (blocks(f"{HEAD}\nF3000\n{line.format(*[s] * 8)}") for s in ("0", "0.1"))
    assert none.forced.tolist() == some.forced.tolist() and none.forced.sum() == 7
    assert none.pauses.seconds.sum() == 0.0 and some.pauses.seconds.sum() == pytest.approx(0.8)


def test_slowest_inverse_time() -> None:
    """LinuxCNC runs no slower than 0.1 mm/min in inverse time."""
    assert blocks(f"{HEAD}\nG93 G1 X0.001 F1").speed == pytest.approx([0.1 / 60])


def test_path_modes() -> None:
    b = blocks(f"{HEAD}\nF600\nG1 X1\nG61\nG1 X2\nG61.1\nG1 X3\nG64 P0.02\nG1 X4\nG64 P0.03 Q0.01\nG1 X5\nG64\nG1 X6")
    assert b.path.tolist() == [CornerMode.BLEND, CornerMode.EXACT, CornerMode.STOP, CornerMode.BLEND, CornerMode.BLEND,
                               CornerMode.BLEND]
    assert b.tolerance.tolist() == [np.inf, np.inf, np.inf, 0.02, 0.03, np.inf]
    assert b.chain.tolist() == [0.0, 0.0, 0.0, 0.02, 0.01, 0.0]
    cycle = blocks(f"{HEAD} G64 P0.01\nG0 Z300\nG98 G81 X0 Y0 Z280 R290 F600\nG80\nG0 X9")
    assert cycle.path.tolist()[-1] == CornerMode.BLEND and CornerMode.EXACT in cycle.path.tolist()


def test_a_control_without_path_modes_uses_the_models_tolerance() -> None:
    b = blocks("G21 G90 G94 G17\nF600\nG1 X1\nG1 Y1", controller="generic-iso")
    assert np.isnan(b.tolerance).all()


def test_dwells_tool_changes_and_commands_rest_behind_their_block() -> None:
    mill = machine(timing=True)
    b = blocks(f"{HEAD}\nT1 M6\nM3 S900\nF600\nG1 X10\nG4 P1.5\nG1 X20\nM8\nT2 M6\nG1 X30\nM9", mill)
    assert pauses(b, Cause.DWELL) == [(0, 1.5)]
    assert pauses(b, Cause.TOOL_CHANGE) == [(-1, 5.0), (1, 5.0)]
    assert pauses(b, Cause.SPINDLE) == [(-1, 0.0)]
    assert b.forced.tolist() == [True, True, True]


def test_clamps_count_where_the_cut_leaves_turned_axes_at_rest() -> None:
    five = machine("mikron-ucp710", timing=True)
    indexed = f"{HEAD}\nG0 Z200\nG0 A30 C40\nG0 X5\nF600\nG1 Z190\nG1 X20\nG0 Z200\nG0 A0\nG1 X30 C50"
    b = blocks(indexed, five)
    assert pauses(b, Cause.INDEXING) == [(1, 1.0)]


def test_blocks_that_go_nowhere_are_left_out() -> None:
    b = blocks(f"{HEAD}\nF600\nG1 X10\nG1 X10\nG4 P1\nG1 X10 Y5")
    assert len(b) == 2 and pauses(b, Cause.DWELL) == [(0, 1.0)]


def test_operations_and_lines_of_a_cl_file() -> None:
    path, found = toolpaths.read(SAMPLES / "pocket.cls")
    result = postproc.convert(path, "mill-3axis", "linuxcnc", TOOLS, diagnostics=found)
    b = from_conversion(result)
    assert b.operations == ("POCKET", "CONTOUR", "DRILL_CORNERS")
    assert set(b.operation.tolist()) == {0, 1, 2}
    assert b.cl_line is not None
    cutting = b.cl_line[~b.rapid]
    assert (cutting > 0).all() and cutting.max() <= path.line.max()
    text = from_gcode(result.text.encode(), result.machine, result.controller, result.setup)[0]
    assert text is not None
    times = [estimate(one, result.machine, model("linuxcnc"), with_band=False).seconds for one in (b, text)]
    assert times[0] == pytest.approx(times[1], rel=1e-9)


def test_tip_of_a_controls_own_mode_runs_at_the_feed() -> None:
    """Under G43.4 the feed is the tip's, whatever path the axes take."""
    fanuc, _ = load_controller("fanuc-30i")
    assert fanuc is not None
    path, found = toolpaths.read(SAMPLES / "tool_axis_tour.apt")
    result = postproc.convert(path, "mikron-ucp710", "fanuc-30i", TOOLS,
                              postproc.Options(output="tcp"), found)
    if not result.ok:
        pytest.skip("; ".join(str(d) for d in result.diagnostics))
    b = from_conversion(result)
    assert b.given is not None
    tips = np.isfinite(b.given) & ~b.rapid
    assert tips.any() and (shape(b).length[tips] == b.given[tips]).all()
    assert b.pieces is not None and b.pieces.max() > 1
    lines = np.bincount(b.line[tips], weights=b.given[tips])
    assert (lines > 0.0).sum() < tips.sum()


def test_programs_and_cl_files_are_distinguished() -> None:
    for name in ("pocket.cls", "tool_axis_tour.apt", "inch_plate.apt", "h4a_dome.cls"):
        assert not looks_like_gcode((SAMPLES / name).read_bytes())
    for text in (b"%\nO0001\nG1 X1\n", b"(part)\nN10 G21 G90\n", b"G0 X1\n", b"/N5 M30\n", b"BEGIN PGM A MM\n",
                 b"0 BEGIN PGM A MM\n", b"; comment\nT1 M6\n", b"X10 Y5\n", b"; set\nN10 CYCLE800()\nN20 G17\n",
                 b"TRAORI\nG1 X1\n", b"N10 X=5/2\n"):
        assert looks_like_gcode(text), text
    for text in (b"PARTNO A\nUNITS/MM\nGOTO/1,2,3\n", b"TOOL PATH/A,TOOL,B\n", b"$$ note\nCUTTER/10\n", b"",
                 b"PARTNO B\nMACHIN/A\nX1 = POINT/1,2\n", b"N10 UNITS/MM\n", b"10 GOTO / 1,2,3\n"):
        assert not looks_like_gcode(text), text


def test_cycles_return_to_r_until_linuxcnc_is_reported_otherwise(tmp_path: Path) -> None:
    """Measured: a fresh LinuxCNC without G98 or G99; other controls begin with G98. It is a key of the controller file."""
    shop = tmp_path / "shop.toml"
    shop.write_text('base = "generic-iso"\ncycles.plane_at_start = true\n')
    text = f"{HEAD}\nG0 Z300\nF900\n{{}}G81 X5 Y5 Z280 R290\nX10\nG80"

    def last(level: str, controller: str = "linuxcnc") -> float:
        return float(blocks(text.format(level), controller=controller).end[-1, 2])
    assert last("") == last("G99 ") == 290.0
    assert last("G98 ") == last("", "generic-iso") == 300.0 and last("", str(shop)) == 290.0


def test_faults_of_a_program_are_reported() -> None:
    spec, _ = load_controller("linuxcnc")
    assert spec is not None
    for text, code in (("G1 X1\nM2\n", "gcode.feed"), ("M2\n", "gcode.no_motion"),
                       ("F100 G1 Q\nM2\n", "gcode.syntax")):
        made, found = from_gcode(text.encode(), machine(), spec, SetupFile(), "a.ngc")
        assert made is None and code in [d.code for d in found], [str(d) for d in found]


@pytest.mark.parametrize("controller", ["siemens-840d", "heidenhain-tnc640"])
def test_files_of_subprograms_take_the_time_of_the_program_in_one(controller: str) -> None:
    """Their lines begin anew: what is in force at a block (its smoothing here) goes by the order in which blocks run."""
    path = toolpath("RAPID", "GOTO/0,0,50", "FEDRAT/MMPM,6000", *(f"GOTO/{4 * k},{3 * (k % 3)},50" for k in range(1, 12)))
    times = []
    for files in (False, True):
        setup = SetupFile.model_validate({"output": {"files": files}, "tools": {"1": {"gauge_length": 120.0}}})
        made = convert(path, "mill-3axis", controller, setup=setup)
        assert made.ok and bool(made.files) == files
        found = estimate_of(made)
        assert found is not None
        times.append((found.seconds, from_conversion(made).tolerance))
    assert times[0][0] == pytest.approx(times[1][0], abs=1e-9) and np.array_equal(times[0][1], times[1][1], equal_nan=True)
