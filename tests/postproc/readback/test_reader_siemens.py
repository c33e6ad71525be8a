"""SINUMERIK 840D programs by hand: every expected number is worked out from the maker's rule in the test's name."""

from __future__ import annotations

import numpy as np
import pytest

from tests.postproc.reader_kit import SIEMENS, faults, good, words

HEAD = "; head X9\nN10 G17 G710 G90 G94 G40 G64\nN20 G54\n"
END = "N90 M30\n"


def program(body: str) -> str:
    return HEAD + body + END


def test_tool_by_m6_and_length_by_d() -> None:
    """T only readies; M6 loads and takes D1; D0 takes the length away with the next Z."""
    motion = good(SIEMENS, program("T1\nG0 X1 Y2\nM6\nD1 Z3\nG0 SUPA D0 Z400\nT2\nM6\nD1\nX4 Z3\n"))
    assert motion.end.tolist() == [[11, 22, 400], [11, 22, 133], [11, 22, 400], [14, 22, 88.5]]
    assert motion.tool.tolist() == [-1, 1, 1, 2] and motion.register.tolist() == [-1, 1, -1, 2]


def test_supa_with_a_length_in_force_is_refused() -> None:
    assert faults(SIEMENS, program("T1\nM6\nG0 SUPA Z400\n")) == {"gcode.machine_position": [6]}
    assert faults(SIEMENS, program("T1\nM6\nG0 SUPA X400\n")) == {}
    assert faults(SIEMENS, program("G0 SUPA D1 Z400\n")) == {"gcode.machine_position": [4]}  # of the tool that stands there
    assert faults(SIEMENS, program("G0 SUPA D0 Z400\n")) == {}


def test_ic_and_ac_beat_the_modal_code() -> None:
    motion = good(SIEMENS, program("G0 X1 Y2 Z3\nX=IC(1) Y=IC(-0.5)\nG91 X1\nX=AC(7) Y1\nG90 Z=IC(2)\n"))
    assert words(motion) == [[1, 2, 3], [2, 1.5, 3], [3, 1.5, 3], [7, 2.5, 3], [7, 2.5, 5]]


@pytest.mark.parametrize(("arc", "centre"), [
    ("G2 X6 Y0 CR=5", (3, -4)), ("G2 X6 Y0 CR=-5", (3, 4)), ("G3 X6 Y0 CR=5", (3, 4)), ("G3 X6 Y0 I3 J4", (3, 4)),
    ("G3 X6 Y0 I=AC(3) J=AC(4)", (3, 4)), ("G91 G3 X6 Y0 I=AC(3) J=AC(4)", (3, 4))])
def test_circles(arc: str, centre: tuple[float, float]) -> None:
    motion = good(SIEMENS, program(f"G0 X0 Y0 Z0\nF100\n{arc}\n"))
    assert (motion.center[1, :2] - [10, 20]).round(9).tolist() == list(centre)
    assert words(motion)[1] == [6, 0, 0]


def test_turns_of_a_helix() -> None:
    """TURN=2: two full turns and the one to the end point, a third of the rise each where that is a full one too."""
    motion = good(SIEMENS, program("G0 X0 Y0 Z0\nG3 X0 Y0 Z-6 I5 J0 TURN=2 F100\n"))
    assert words(motion) == [[0, 0, 0], [0, 0, -2], [0, 0, -4], [0, 0, -6]] and motion.code.tolist() == [0, 2, 2, 2]


def test_a_half_turn_behind_a_whole_one_rises_by_angle() -> None:
    motion = good(SIEMENS, program("G0 X0 Y0 Z0\nG3 X10 Y0 Z-6 I5 J0 TURN=1 F100\n"))
    assert words(motion) == [[0, 0, 0], [0, 0, -4], [10, 0, -6]]


def test_an_end_off_the_circle_is_refused() -> None:
    assert faults(SIEMENS, program("G0 X0 Y0 Z0\nG2 X10.1 Y0 I5 J0 F100\n")) == {"gcode.arc": [5]}


def heights(cycle: str, feed: str = "F100") -> list[tuple[float, int, float]]:
    motion = good(SIEMENS, program(f"S500 M3\nG0 X0 Y0 Z20\n{feed}\nMCALL {cycle}\nX0 Y0\nX5\nMCALL\nX9\n"))
    z = [(round(float(e[2]) - 30, 4), int(c), float(f)) for e, c, f in zip(motion.end, motion.code, motion.feed,
                                                                           strict=True)]
    assert words(motion)[-1][0] == 9 and z[-1][1] == 0
    half = (len(z) - 2) // 2
    return z[1:1 + half]


def kinds(cycle: str) -> list[tuple[float, int]]:
    return [(z, c) for z, c, _ in heights(cycle)]


def test_modal_call_drills_at_each_block_that_moves() -> None:
    motion = good(SIEMENS, program("G0 X0 Y0 Z20\nF100\nMCALL CYCLE81(9,2,1,-5)\nX1\nM8\nX2 Y1\nMCALL\nX9\n"))
    assert words(motion)[1:] == [[1, 0, 20], [1, 0, 3], [1, 0, -5], [1, 0, 9], [2, 1, 9], [2, 1, 3], [2, 1, -5], [2, 1, 9],
                                 [9, 1, 9]]


def test_call_without_mcall_drills_where_the_tool_stands() -> None:
    motion = good(SIEMENS, program("G0 X1 Y0 Z20\nF100\nCYCLE82(9,2,1,,7,0.5)\nX9\n"))
    assert words(motion)[1:] == [[1, 0, 3], [1, 0, -5], [1, 0, 9], [9, 0, 9]] and motion.dwell.tolist() == [0, 0, .5, 0, 0]


def test_deep_holes_out_of_the_hole_and_with_chips_broken() -> None:
    """FDPR 3 counts from RFP 0; VARI 1 stops 0.6 before the last depth, VARI 0 lifts by VRT."""
    assert kinds("CYCLE83(20,0,1,-8,,,3,0,0,0,1,1)")[0:] == [
        (1, 0), (-3, 1), (1, 0), (-2.4, 0), (-6, 1), (1, 0), (-5.4, 0), (-8, 1), (20, 0)]
    assert kinds("CYCLE83(20,0,1,-8,,-4,,0,0,0,1,0,,,0.5)") == [(1, 0), (-4, 1), (-3.5, 0), (-8, 1), (20, 0)]


def test_taps_feed_by_pitch_and_speed() -> None:
    assert heights("CYCLE84(20,0,1,-8,,0,3,,1.25,0,400,800)") == [(1, 0, 100), (-8, 1, 500), (1, 1, 1000), (20, 0, 100)]


@pytest.mark.parametrize("body", ["CYCLE84({})\nX9\n", "MCALL CYCLE84({})\nX1\nMCALL\nX9\n"])
def test_the_spindle_behind_a_tap_turns_as_sdac_says(body: str) -> None:
    for sdac, after in ((3, 1), (4, -1), (5, 0)):
        cycle = body.format(f"20,0,1,-8,,0,{sdac},,1.25,0,400,400")
        spindle = good(SIEMENS, program(f"S400 M3\nF100\nG0 X0 Y0 Z20\n{cycle}")).spindle.tolist()
        assert spindle[-1] == after and set(spindle[:-1]) == {1}


def test_reaming_has_feeds_of_its_own() -> None:
    assert heights("CYCLE85(20,0,1,-8,,0,60,120)") == [(1, 0, 100), (-8, 1, 60), (1, 1, 120), (20, 0, 100)]


def test_smoothing_by_cycle832() -> None:
    motion = good(SIEMENS, program("G0 X0\nCYCLE832(0.01,_FINISH,1)\nX1\nCYCLE832(0,_OFF,1)\nX2\nG60 X3\n"))
    assert motion.blend.tolist() == [np.inf, 0.01, np.inf, 0.0]


def test_dwell_in_seconds_leaves_the_feed_alone() -> None:
    motion = good(SIEMENS, program("G1 X1 F100\nG4 F2.5\nX2\n"))
    assert motion.dwell.tolist() == [2.5, 0] and motion.feed.tolist() == [100, 100]


def test_inches_of_g700() -> None:
    assert words(good(SIEMENS, program("G700 G0 X1\nG710 X1\n")))[0][0] == 25.4


def test_work_offsets_are_distinguished() -> None:
    assert good(SIEMENS, program("G0 X0\nG505\nX1\nG57 X2\n")).offset.tolist() == [54, 505, 57]


def test_subprograms_of_one_archive_and_of_other_files() -> None:
    text = "%_N_MAIN_MPF\nG54 G90 G0 X0 Y0 Z0\nPOCKET P2\nL7\nX9\nM30\n%_N_POCKET_SPF\nG91 X1\nG90\nM17\n"
    motion = good(SIEMENS, text, others={"L7.SPF": b"Y5\nRET\nY6\n"})
    assert words(motion) == [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 5, 0], [9, 5, 0]]
    assert motion.line.tolist() == [2, 8, 8, 1, 5]


@pytest.mark.parametrize(("block", "code"), [
    ("TRANS V5", "gcode.unknown_word"), ("ROTS X30 Y20", "gcode.frame_turned"), ("G0 C=DC(5)", "gcode.rollover"), ("R1=R2",
    "gcode.variable"),
    ("IF 5==5 GOTOF A", "gcode.jump"), ("G0 X=R1", "gcode.variable"), ("CIP X1 Y1 I1=2", "gcode.syntax"), ("G33 Z1 K1",
    "gcode.unknown_code"),
    ("SETAL(61000)", "gcode.alarm"), ("G646", "gcode.unknown_code"), ("RTLIOF", "gcode.unknown_word"), ("FGROUP(X)",
    "gcode.unknown_word"),
    ("G58 X1", "gcode.unknown_code"), ("D2", "gcode.tool"), ("G4 S5", "gcode.dwell"), ("G4 P5", "gcode.dwell"),
    ("CYCLE83(20,0,1,-8,,,3,1,0,0,1,1)", "gcode.cycle"), ("CYCLE86(20,0,1,-8,,0,3,1,0,0,0)", "gcode.cycle"),
    ("CYCLE81(20,0,1)", "gcode.cycle"), ("CYCLE82(20,0,1,-5,,-3)", "gcode.cycle"), ("POCKET3(1)", "gcode.unknown_word"),
    ("ORIVECT", "gcode.unknown_word"), ("TRACYL(40)", "gcode.unknown_word"), ("G0 X1,5", "gcode.syntax"), ("%",
    "gcode.syntax"),
    ("G0 G1 X1", "gcode.repeated"), ("B5", "gcode.unknown_word")])
def test_what_is_not_modelled_is_an_error_with_its_line(block: str, code: str) -> None:
    assert faults(SIEMENS, program(f"G0 X0 Y0 Z0\n{block}\n")).get(code) == [5]


@pytest.mark.parametrize("block", ['MSG("TRANS; X5")', "SOFT", "FFWON", "RTLION", "STOPRE", "G601", "; CYCLE800(1)",
    "N55", "CFTCP"])
def test_what_moves_nothing_is_passed(block: str) -> None:
    assert words(good(SIEMENS, program(f"G0 X0 Y0 Z0\n{block}\nX1\n"))) == [[0, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize(("body", "line"), [
    ("TRAORI\nG0 A1\nTRAFOOF\n", 4), ("TRAORI\nORIAXES\nCYCLE800(0,\"\",0,57,0,0,0,0,0,0,0,0,0,1,0,1)\n", 6),
    ("CYCLE800(1,\"\",0,57,0,0,0,0,0,0,0,0,0,1,0,1)\n", 4), ("CYCLE800(0,\"\",1,57,0,0,0,0,0,0,0,0,0,1,0,1)\n", 4),
    ("CYCLE800(0,\"\",0,57,0,0,0,0,0,0,0,0,0,2,0,1)\n", 4), ("CYCLE800(0,\"\",0,192,0,0,0,0,0,0,0,0,0,1,0,1)\n", 4)])
def test_modes_that_are_not_modelled_are_refused(body: str, line: int) -> None:
    assert faults(SIEMENS, program(body), "mikron-ucp710").get("gcode.mode") == [line]
