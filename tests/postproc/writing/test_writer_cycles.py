"""Canned cycles in the text of programs, and the single moves that stand for them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from postproc.setup.model import OutputSettings
from tests.postproc.kit import body, codes, convert, execute, good, goto, shop_file, tilted, tool_poses, tool_setup, toolpath
from toolpaths.rotations import rotation


def cycle(*lines: str, controller: str = "linuxcnc", before: str = "GOTO/0,0,50") -> list[str]:
    path = toolpath("RAPID", before, *lines)
    return [b for b in body(good(convert(path, "mill-3axis", controller)).text) if re.search(r"G8|G73|G9[89]|^X", b)
            and "G53" not in b and b != "G0 X0 Y0"]


@pytest.mark.parametrize(("record", "want"), [
    ("DRILL,DEPTH,12,MMPM,100,CLEAR,3", "G99 G81 X10 Y0 Z-12 R3 F100"),
    ("DRILL,DEPTH,12,MMPM,100,CLEAR,3,DWELL,1.5", "G99 G82 X10 Y0 Z-12 R3 P1.5 F100"),
    ("DRILL,DEPTH,12,RAPTO,3,RTRCTO,AUTO,MMPM,100", "G98 G81 X10 Y0 Z-12 R3 F100"),
    ("DEEP,DEPTH,12,MMPM,100,CLEAR,3,STEP,4", "G99 G83 X10 Y0 Z-12 R3 Q4 F100"),
    ("BRKCHP,DEPTH,12,MMPM,100,CLEAR,3,STEP,4", "G99 G73 X10 Y0 Z-12 R3 Q4 F100"),
    ("TAP,DEPTH,12,MMPM,100,CLEAR,3", "G99 G84 X10 Y0 Z-12 R3 F100"),
    ("BORE,DEPTH,12,MMPM,100,CLEAR,3", "G99 G85 X10 Y0 Z-12 R3 F100"),
    ("REAM,DEPTH,12,MMPM,100,CLEAR,3,DWELL,2", "G99 G89 X10 Y0 Z-12 R3 P2 F100"),
])
def test_each_kind_of_cycle(record: str, want: str) -> None:
    got = cycle(f"CYCLE/{record}", "GOTO/10,0,0", "GOTO/20,5,0", "CYCLE/OFF", "RAPID", "GOTO/20,5,50")
    assert got == [want, "X20 Y5", "G80"]


def test_cycle_words_are_restated_when_anything_changes() -> None:
    """Another top, another depth, another feed: Z, R and F again; the same again: place alone; G80 at the end."""
    got = cycle("CYCLE/DRILL,DEPTH,12,MMPM,100,CLEAR,3", "GOTO/10,0,0", "GOTO/20,0,-5",
                "CYCLE/DRILL,DEPTH,6,MMPM,100,CLEAR,3", "GOTO/30,0,-5",
                "CYCLE/DRILL,DEPTH,6,MMPM,80,CLEAR,3", "GOTO/40,0,-5", "GOTO/50,0,-5", "CYCLE/OFF",
                "RAPID", "GOTO/50,0,50")
    assert got == ["G99 G81 X10 Y0 Z-12 R3 F100", "G99 G81 X20 Y0 Z-17 R-2 F100", "G99 G81 X30 Y0 Z-11 R-2 F100",
                   "G99 G81 X40 Y0 Z-11 R-2 F80", "X50 Y0", "G80"]


def test_generic_iso_cycle() -> None:
    got = cycle("CYCLE/DEEP,DEPTH,12,MMPM,100,CLEAR,3,STEP,4", "GOTO/10,0,0", controller="generic-iso")
    assert got[0] == "G99 G83 X10. Y0. Z-12. R3. Q4. F100.", "Q4 without a point is 4 um on many controls"


def test_retract_that_no_code_makes_is_written_as_single_moves() -> None:
    """60 mm above the top is neither the plane nor the level the tool came from; it is that to the next hole."""
    path = toolpath("RAPID", "GOTO/0,0,50", "CYCLE/DRILL,DEPTH,12,RAPTO,3,RTRCTO,60,MANUAL,MMPM,100", "GOTO/10,0,0",
                    "GOTO/20,0,0")
    blocks = body(good(convert(path, "mill-3axis")).text)
    at = blocks.index("X10")
    assert blocks[at:at + 5] == ["X10", "Z3", "G1 Z-12 F100", "G0 Z60", "G98 G81 X20 Y0 Z-12 R3 F100"]


@pytest.mark.parametrize(("controller", "rows"), [
    ("linuxcnc", ["X10", "Z20", "G98 G81 X10 Y0 Z-12 R3 F100", "X20 Y0"]),
    ("siemens-840d", ["MCALL CYCLE81(20,0,3,-12)", "X10 Y0", "X20 Y0"])])
def test_a_retract_below_the_level_the_tool_came_from_is_the_cycles_own(controller: str, rows: list[str]) -> None:
    """Where the control goes back to the level that a cycle begins from, the tool stops there on its path down; where the
    cycle names the level it needs not."""
    path = toolpath("RAPID", "GOTO/0,0,50", "CYCLE/DRILL,DEPTH,12,RAPTO,3,RTRCTO,20,MANUAL,MMPM,100", "GOTO/10,0,0",
                    "GOTO/20,0,0")
    result = good(convert(path, "mill-3axis", controller))
    blocks = [re.sub(r"^(N\d+ )?(G0 )?", "", line) for line in result.text.splitlines()]
    at = blocks.index(rows[0])
    assert blocks[at:at + len(rows)] == rows and "Z20" not in blocks[:at]
    assert "cycle.as_moves" not in codes(result.diagnostics)


def test_pecks_that_grow_smaller_are_written_as_single_moves() -> None:
    """5 first, then 2: from R3 to -2, -4, -6, -7; no code says that."""
    path = toolpath("RAPID", "GOTO/0,0,50", "CYCLE/DEEP,DEPTH,7,MMPM,100,CLEAR,3,STEP,5,2", "GOTO/10,0,0")
    blocks = body(good(convert(path, "mill-3axis")).text)
    assert [b.split()[1] for b in blocks if b.startswith("G1")] == ["Z-2", "Z-4", "Z-6", "Z-7"]


def test_tapping_is_never_written_as_single_moves(tmp_path: Path) -> None:
    result = convert(toolpath("RAPID", "GOTO/0,0,50", "CYCLE/TAP,DEPTH,12,RAPTO,3,RTRCTO,20,MANUAL,MMPM,100", "GOTO/10,0,0",
                              "GOTO/20,0,0"), "mill-3axis", shop_file(tmp_path, "[cycles]\nenabled = false\n"))
    assert "cycle.not_native" in codes(result.diagnostics) and not result.text


def test_no_canned_cycle_under_inverse_time() -> None:
    path = toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,40", "CYCLE/DRILL,DEPTH,12,MMPM,100,CLEAR,3", "GOTO/10,0,0",
                    "CYCLE/OFF", "RAPID", "GOTO/10,0,50", "FEDRAT/MMPM,500", "GOTO/20,0,50")
    blocks = body(good(convert(path, "mill-3axis", feed_mode="inverse-time")).text)
    at = next(i for i, b in enumerate(blocks) if "G81" in b)
    assert "G94" in blocks[at - 1] or "G94" in blocks[at]
    assert blocks[at + 1] == "G80"
    assert next(b for b in blocks[at:] if "G1" in b.split()).startswith("G93")


def test_cycles_on_a_head_at_an_angle_are_single_moves() -> None:
    """A fork head leans: the hole does not run along the machine's Z, so there is no canned cycle."""
    axis = tilted(30, 0)
    path = toolpath("RAPID", *goto([50 * axis], [axis]), "CYCLE/DRILL,DEPTH,12,MMPM,100,CLEAR,3",
                    *goto([[10, 0, 0]]))
    result = good(convert(path, "fork-head-ab"))
    assert not re.search(r"G8[1-9]", "\n".join(body(result.text)).replace("G80", ""))
    steps = execute(result)
    tips = [p[0] for s, p in zip(steps, tool_poses(result, steps), strict=True) if s.kind == "feed"]
    assert np.allclose(tips[-1][-1], np.array([10, 0, 0]) - 12 * axis, atol=1e-3)


@pytest.mark.covering
@pytest.mark.parametrize("between", [[], ["COOLNT/FLOOD"], ["DELAY/1"]])
@pytest.mark.parametrize("controller", ["linuxcnc", "generic-iso"])
def test_no_cycle_goes_back_to_a_first_level_that_the_tool_has_left(between: list[str],
                                                                    controller: str) -> None:
    """From the plane of the hole before, LinuxCNC would go aslant to that level, and after a G80 it is none any more."""
    got = cycle("CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/10,0,0", *between,
                "CYCLE/DRILL,DEPTH,5,MMPM,100,RAPTO,3,RTRCTO,50", "GOTO/20,0,0", "GOTO/30,0,0", controller=controller)
    assert [b.replace(".", "").split(" F")[0] for b in got if b.startswith("G")] == [
        "G99 G81 X10 Y0 Z-5 R3", "G80", "G98 G81 X30 Y0 Z-5 R3", "G80"]


@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc"])
def test_a_command_between_holes_ends_the_first_level_too(controller: str) -> None:
    """G80 stands before the command: what the control takes for its first level then is the plane where the tool is."""
    got = cycle("CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/10,0,0", "COOLNT/FLOOD",
                "CYCLE/DRILL,DEPTH,5,MMPM,100,RAPTO,3,RTRCTO,50", "GOTO/20,0,0", "GOTO/30,0,0", controller=controller)
    assert [b.split(" Z")[0] for b in got if b.startswith("G9")] == ["G99 G81 X10. Y0.", "G98 G81 X30. Y0."]
    got = cycle("CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/10,0,0",
                "CYCLE/DRILL,DEPTH,5,MMPM,100,RAPTO,3,RTRCTO,50", "GOTO/20,0,0", controller=controller)
    assert [b.split(" Z")[0] for b in got if b.startswith("G9")] == ["G99 G81 X10. Y0.", "G98 G81 X20. Y0."]


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["siemens-840d", "heidenhain-tnc640", "fanuc-30i"])
@pytest.mark.parametrize("kind", ["DRILL", "TAP"])
@pytest.mark.parametrize("seed", [1, 3])
def test_holes_of_one_plane_may_differ_by_the_last_decimal(controller: str, kind: str, seed: int) -> None:
    """Points of four decimals in a tilted plane: the levels of the holes differ by the last one here and
    there, and a rapid of that length is no cut that was left out. Dog-leg rapids of a head between them are fed."""
    turned = rotation(np.array([0.6, -0.8, 0.0]), np.array([0.5]))[0]
    places = np.random.default_rng(seed).uniform(-20, 20, (40, 3)) * [1, 1, 0]
    feed = "MMPR,1" if kind == "TAP" else "MMPM,100"
    holes = goto(np.round(places @ turned.T, 4), np.tile(np.round(turned[:, 2], 7), (40, 1)))
    above = goto((turned @ [0, 0, 40.0])[None], turned[:, 2][None])
    path = toolpath("RAPID", *above, f"CYCLE/{kind},DEPTH,9,{feed},RAPTO,3,RTRCTO,3", *holes, "CYCLE/OFF",
                    "RAPID", *above)
    fed = tool_setup().model_copy(update={"output": OutputSettings(rapids_as_feed=True)})
    result = convert(path, "head-table", controller, setup=fed)
    assert result.ok, [str(d) for d in result.diagnostics]


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["siemens-840d", "heidenhain-tnc640", "fanuc-30i"])
@pytest.mark.parametrize("seed", [5, 8])
def test_a_tool_in_a_tilted_plane_rises_before_it_goes_to_a_higher_hole(controller: str, seed: int) -> None:
    """The lift of rounded words is off the vertical by a last decimal; without it the tool would cross at the hole's top."""
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0, 2 * np.pi)
    turned = rotation(np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([rng.uniform(0.2, 1.2)]))[0]
    places = rng.uniform(-20, 20, (30, 3)) * [1, 1, 0] + rng.choice([0.0, 3.0, -3.0], 30)[:, None] * [0, 0, 1]
    holes = goto(np.round(places @ turned.T, 4), np.tile(np.round(turned[:, 2], 7), (30, 1)))
    above = goto((turned @ [0, 0, 40.0])[None], turned[:, 2][None])
    record = "CYCLE/DEEP,DEPTH,9,MMPM,100,STEP,4,RAPTO,3,RTRCTO,3"
    result = convert(toolpath("RAPID", *above, record, *holes, "CYCLE/OFF", "RAPID", *above),
                     "head-table", controller)
    assert result.ok, [str(d) for d in result.diagnostics]
