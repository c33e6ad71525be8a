"""Text of programs: numbers, modality, feed modes, comments, lengths, by an own executor and by hand."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from postproc.setup.model import SetupFile
from tests.postproc.kit import (
    body,
    codes,
    convert,
    execute,
    flat,
    good,
    goto,
    sample,
    shop_file,
    tilted,
    tool_poses,
    tool_setup,
    toolpath,
    words_of,
)

# ---- numbers and modality ----------------------------------------------------------------------------------


def test_words_are_rounded_to_the_decimals_and_trimmed() -> None:
    got = flat("GOTO/1.00006,2.5,5", "GOTO/1.00014,-0.00004,5", "GOTO/100,0.12346,5")
    assert got[:3] == ["G1 X1.0001 Y2.5 F600", "Y0", "X100 Y0.1235"]
    assert not re.search(r"-0(?![.\d])|\.\d*0(\s|$)|\.(\s|$)", "\n".join(got))


def test_only_words_that_change_are_stated_and_codes_once() -> None:
    assert flat("GOTO/10,0,5", "GOTO/10,10,5", "FEDRAT/MMPM,300", "GOTO/0,10,5", "RAPID", "GOTO/0,10,50", "GOTO/0,9,50",
                "GOTO/0,9,50")[:5] == ["G1 X10 F600", "Y10", "X0 F300", "G0 Z50", "G1 Y9"]


def test_rounding_never_adds_up() -> None:
    """Steps of 0.00004 mm round to nothing alone; a thousand of them arrive."""
    points = np.column_stack([np.arange(1, 1001) * 4e-5, np.zeros(1000), np.zeros(1000)])
    got = flat(*goto(points))
    x = [words_of(b)["X"] for b in got if "X" in words_of(b) and "G53" not in b]
    assert x[-1] == "0.04" and 300 < len(x) <= 400


def test_generic_iso_writes_points_in_whole_numbers() -> None:
    got = flat("GOTO/10,0,5", "GOTO/10.5,-3,0", controller="generic-iso")
    assert got[:2] == ["G1 X10. F600.", "X10.5 Y-3. Z0."]


def test_shop_file_numbers_blocks_and_sets_decimals(tmp_path: Path) -> None:
    shop = shop_file(tmp_path, "[format]\nsequence_step = 10\nlinear_decimals = 3\nspace = false\n")
    result = good(convert(toolpath("RAPID", "GOTO/0,0,5", "GOTO/1.234567,0,5"), "mill-3axis", shop))
    numbered = [n for n in result.text.splitlines() if not n.startswith(("%", "("))]
    assert [int(re.match(r"N(\d+)", n)[1]) for n in numbered] == [10 * (i + 1) for i in range(len(numbered))]
    assert any(re.fullmatch(r"N\d+G1X1.235F600", n) for n in numbered)
    assert not [n for n in numbered if "G53 G0" not in n and re.search(r"[XYZ][\d.-]+ ", n)]


def test_too_few_decimals_for_the_tolerance_are_reported(tmp_path: Path) -> None:
    shop = shop_file(tmp_path, "[format]\nlinear_decimals = 1\n")
    result = convert(toolpath("RAPID", "GOTO/0,0,5", "GOTO/1.26,0,5"), "mill-3axis", shop)
    assert "tolerance.rounding" in codes(result.diagnostics) and not result.ok


# ---- rotary moves ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["mikron-ucp710", "head-table", "linuxcnc-xyzac-trt"])
def test_no_tiny_residue_next_to_a_rotary_move(name: str) -> None:
    """What LinuxCNC would take for the length of an inverse-time block: X, Y, Z steps of a few last decimals."""
    spin = [tilted(30, p) for p in range(0, 60, 3)]
    tips = np.random.default_rng(6).normal(0, 7e-5, (len(spin), 3))
    path = toolpath("RAPID", *goto([[0, 0, 0.0]], [spin[0]]), *goto(tips, np.array(spin)))
    result = good(convert(path, name))
    before: dict[str, float] = {}
    seen = 0
    for block in body(result.text):
        now = {k: float(v) for k, v in words_of(block).items() if k in "XYZABC"}
        step = [abs(now[k] - before[k]) for k in "XYZ" if k in now and k in before]
        if any(k in now for k in "ABC") and "G0" not in block and before:
            seen += 1
            assert not step or max(step) == 0 or max(step) > 2.5e-4, block
        before |= now
    assert seen >= 19


def test_snapped_residues_stay_below_the_rounding() -> None:
    """What is not written never adds up: the tip of the text stays on the CL points."""
    spin = np.array([tilted(30, p) for p in np.arange(0, 90, 0.25)])
    result = good(convert(toolpath("RAPID", *goto([[0, 0, 0.0]], [spin[0]]), *goto(np.zeros((len(spin), 3)), spin)),
                          "mikron-ucp710"))
    steps = execute(result)
    cut = [p for s, p in zip(steps, tool_poses(result, steps), strict=True) if s.kind == "feed"]
    assert max(np.linalg.norm(tip, axis=1).max() for tip, _ in cut) < 0.01


# ---- feeds -------------------------------------------------------------------------------------------------


def test_inverse_time_states_f_in_every_block_and_per_minute_again_after_it() -> None:
    a = [tilted(t, 40) for t in (10, 12, 14, 16)]
    tips = np.array([[0, 0, 0], [5, 0, 0], [9, 0, 0.0]])
    path = toolpath("RAPID", *goto([[0, 0, 50]], [a[0]]), *goto(tips, np.array(a[1:])),
                    "RAPID", *goto([[9, 0, 60]], [a[3]]), "RAPID", *goto([[0, 0, 60]], [a[3]]),
                    *goto([[0, 0, 0]], [a[3]]), *goto([[0, 8, 0]], [a[3]]))
    mode, motion, switches = "G94", "", []
    for block in body(good(convert(path, "mikron-ucp710")).text):
        for code in re.findall(r"G9[34]", block):
            switches.append(code)
            assert code != mode and "F" in words_of(block), "a change of mode states the new F in its block"
            mode = code
        motion = (re.findall(r"G[0-3]\b", block) or [motion])[-1]
        if motion == "G1" and mode == "G93" and re.search(r"[XYZAC]-?\d", block):
            assert "F" in words_of(block), block
    assert switches == ["G93", "G94"]


def test_feed_of_inverse_blocks_gives_the_programmed_tip_speed() -> None:
    """Sum over each CL move of 1/F is its length over its feed: from the text alone."""
    rng = np.random.default_rng(2)
    tips = np.cumsum(rng.uniform(3, 8, (6, 3)), axis=0)
    axes = np.array([tilted(20 + 4 * i, 30 + 5 * i) for i in range(6)])
    result = good(convert(toolpath("RAPID", *goto(tips[:1], axes[:1]), "FEDRAT/MMPM,100", *goto(tips[1:], axes[1:])),
                          "mikron-ucp710"))
    steps = [s for s in execute(result) if s.kind == "feed"]
    assert all(s.inverse for s in steps)
    total = sum(60.0 / s.feed for s in steps)
    assert total == pytest.approx(np.linalg.norm(np.diff(tips, axis=0), axis=1).sum() / (100 / 60), rel=1e-4)


@pytest.mark.parametrize("mode", ["per-minute", "inverse-time"])
def test_feed_mode_can_be_demanded(mode: str) -> None:
    text = good(convert(toolpath("RAPID", "GOTO/0,0,5", "GOTO/30,40,5"), "mill-3axis", feed_mode=mode)).text
    assert ("G1 X30 Y40 F600" in text) == (mode == "per-minute")
    assert ("G93 G1 X30 Y40 F12\n" in text) == (mode == "inverse-time")


def test_feed_is_reduced_where_an_axis_would_be_too_fast() -> None:
    """C turns 90 degrees in a 0.1 mm move at 6000 mm/min: at 120 degrees/s it takes 0.75 s, F 80."""
    a, b = tilted(1, 0), tilted(1, 90)
    result = good(convert(toolpath("RAPID", *goto([[0, 0, 0]], [a]), "FEDRAT/MMPM,6000", *goto([[0.1, 0, 0]], [b])),
                          "mikron-ucp710"))
    steps = [s for s in execute(result) if s.kind == "feed"]
    c = np.array([s.end[4] for s in steps])
    start = [s for s in execute(result) if s.kind == "rapid" and s.line < steps[0].line][-1].end[4]
    seconds = np.array([60 / s.feed for s in steps])
    assert (np.abs(np.diff([start, *c])) / seconds <= 120 * (1 + 1e-3)).all()
    assert seconds.sum() == pytest.approx(0.75, rel=0.25)
    assert "feed.reduced" in codes(result.diagnostics)


def test_axis_limits_are_kept_by_every_sample() -> None:
    for file, name in (("tool_axis_tour.apt", "mikron-ucp710"), ("blade.cls", "trunnion-bc")):
        result = sample(file, name)
        limit = result.machine.limits.velocity * np.where(np.array(result.machine.rotary), 180 / np.pi, 1)
        before = None
        for s in execute(result):
            if before is not None and s.kind == "feed" and s.inverse:
                assert (np.abs(s.end - before) <= limit * 60 / s.feed * 1.001 + 1e-6).all(), s
            before = s.end


# ---- comments and lengths ----------------------------------------------------------------------------------


@pytest.mark.parametrize("controller", ["linuxcnc", "generic-iso"])
def test_comments_cannot_break_out_or_overflow(controller: str) -> None:
    path = toolpath("PPRINT/A (G0 Z-50) %;\tB" + "x" * 400, "PPRINT/äöü ()", "RAPID", "GOTO/0,0,5",
                    "GOTO/9,0,5")
    result = good(convert(path, "mill-3axis", controller))
    limit = result.controller.format.line_length
    for line in result.text.splitlines():
        assert len(line) <= limit
        assert line.isascii() and line.isprintable()
        if line.startswith("("):
            assert line.endswith(")") and "(" not in line[1:] and ")" not in line[:-1]
    assert "G0 Z-50" not in [b.strip() for b in re.sub(r"\([^()]*\)", "", result.text).splitlines()]


def test_header_says_what_made_the_file() -> None:
    text = sample("pocket.cls", "mill-3axis").text
    for want in ("source pocket.cls", "machine mill-3axis", "controller linuxcnc", "tolerance 0.01 mm"):
        assert f"({want}" in text
    assert "/work" not in text and "/home" not in text


def test_ends_of_every_program() -> None:
    for file, name, controller in (("pocket.cls", "mill-3axis", "linuxcnc"),
                                   ("five_faces.cls", "mikron-ucp710", "generic-iso")):
        lines = sample(file, name, controller).text.splitlines()
        assert (lines[0], lines[-1]) == ("%", "%")
        assert lines[-2] == ("M2" if controller == "linuxcnc" else "M30")
        start = "G21 G90 G91.1 G94 G17 G40 G49 G80" if controller == "linuxcnc" else "G21 G90 G94 G17 G40 G80"
        assert lines.index(start) < lines.index("G54") < next(i for i, n in enumerate(lines) if "M6" in n)
        assert sum("G21" in n for n in lines) == 1


def test_order_around_a_tool_change() -> None:
    """Up and home, spindle and coolant off, length cancelled, change, length of the new tool, only then motion."""
    lines = [n for n in sample("pocket.cls", "mill-3axis").text.splitlines() if not n.startswith("(")]
    at = lines.index("T2 M6")
    before, after = lines[at - 5:at], lines[at + 1:at + 5]
    assert before.index("G53 G0 Z400") < before.index("M5") < before.index("G49")
    assert "M9" in before
    assert after[0] == "G43 H2" and "S2800 M3" in after


def test_speed_and_coolant_records() -> None:
    blocks = flat("GOTO/1,0,5", "SPINDL/RPM,2000,CCLW", "GOTO/2,0,5", "SPINDL/RPM,1500,CLW", "GOTO/2.5,0,5", "SPINDL/OFF",
                  "COOLNT/MIST", "RAPID", "GOTO/3,0,5", "SPINDL/ON", "DELAY/2.5", "GOTO/4,0,5", "COOLNT/OFF", "OPSTOP",
                  "STOP", "GOTO/5,0,5")
    assert blocks[:16] == ["G1 X1 F600", "S2000 M4", "X2", "S1500 M3", "X2.5", "M5", "M7", "G0 X3", "S1500 M3", "G4 P2.5",
                           "G1 X4", "M9", "M1", "M0", "S1500 M3", "X5"]


def test_length_offset_register_follows_the_tool_record() -> None:
    path = toolpath("LOADTL/3,OSETNO,7", "RAPID", "GOTO/0,0,5", "GOTO/1,0,5",
                    head=["UNITS/MM", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"])
    text = good(convert(path, "mill-3axis")).text
    assert "T3 M6\nG43 H7" in text


def test_unused_setup_leaves_words_alone() -> None:
    """Gauge lengths move no word on a machine whose tool stands along Z: the length offset holds them."""
    path = toolpath("RAPID", "GOTO/0,0,5", "GOTO/9,0,5")
    with_tools = good(convert(path, "mill-3axis", setup=tool_setup())).text
    without = good(convert(path, "mill-3axis", setup=SetupFile())).text
    pick = [b for b in body(with_tools) if "G1" in b]
    assert pick == [b for b in body(without) if "G1" in b] == ["G1 X9 F600"]
