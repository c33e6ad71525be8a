"""Klartext programs by hand: every expected number is worked out from the maker's rule in the test's name."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.postproc.reader_kit import TNC, executed, faults, good, words

CENTRED = ("CYCL DEF 240 CENTERING ~\n Q200=2 ~\n Q343=0 ~\n Q201=-1 ~\n Q344=0 ~\n Q206=9 ~\n Q211=0 ~\n"
           " Q203=0 ~\n Q204=50 ~\n {}=0")


def program(body: str) -> str:
    """Numbered blocks with the frame; body lines with a leading blank go on in the block before."""
    rows = ["BEGIN PGM T1 MM", *body.splitlines(), "M30", "END PGM T1 MM"]
    number, result = 0, []
    for row in rows:
        result.append(row if row.startswith(" ") else f"{number} {row}")
        number += not row.startswith(" ")
    return "\n".join(result) + "\n"


START = "TOOL CALL 3 Z S500\nL X+0 Y+0 Z+20 R0 FMAX\n"
"""lines 2 and 3; the length of tool 3 is 0"""


def test_fmax_holds_in_its_block_and_f_from_block_to_block() -> None:
    motion = good(TNC, program("L X+1 F100\nL X+2 FMAX\nL X+3\nL Y-1.5 F80 M8\nL Y+.5 F MAX\n"))
    assert motion.code.tolist() == [1, 0, 1, 1, 0] and motion.feed[[0, 2, 3]].tolist() == [100, 100, 80]
    assert motion.flood.tolist() == [False, False, False, True, True]
    assert [w[:2] for w in words(motion)] == [[1, -20], [2, -20], [3, -20], [3, -1.5], [3, .5]]


def test_tool_call_takes_the_length_with_the_tool_and_m91_leaves_it() -> None:
    motion = good(TNC, program("L X+0 Y+0 FMAX\nTOOL CALL 1 Z S500 F99\nL Z+5 FMAX\nTOOL CALL S700\nL Z+400 R0 FMAX M91\n"
                               "TOOL CALL 2 Z\nL Z+5\n"))
    assert motion.end[1:, 2].tolist() == [135, 400, 90.5]
    assert motion.tool.tolist() == [-1, 1, 1, 2] and motion.rpm[1:].tolist() == [500, 700, 700]


def test_incremental_axes_and_radius_sides() -> None:
    motion = good(TNC, program("L X+1 Y+2 Z+3 FMAX\nL IX+1 IZ-1 RL F9\nL Y+0 IX-3 RR\nL IX+0.25 R0\n"))
    assert words(motion) == [[1, 2, 3], [2, 2, 2], [-1, 0, 2], [-.75, 0, 2]]
    assert motion.compensation.tolist() == [40, 41, 42, 40]


@pytest.mark.parametrize(("blocks", "centre", "end"), [
    ("CC X+3 Y+4\nC X+6 Y+0 DR+", (3, 4), (6, 0)), ("CC IX+3 IY+4\nC IX+6 DR+ F50", (3, 4), (6, 0)),
    ("CR X+6 Y+0 R+5 DR+", (3, 4), (6, 0)), ("CR X+6 Y+0 R-5 DR-", (3, 4), (6, 0)), ("CR X+6 Y+0 R+5 DR-", (3, -4), (6, 0)),
    ("CC X+5 Y+0\nCP IPA-90 DR-", (5, 0), (5, 5)), ("CC X+5 Y+0\nCP PA+90 DR-", (5, 0), (5, 5)),
    ("CC X+5 Y+0\nCP PA+90 DR+", (5, 0), (5, 5)), ("CC X+0 Y+5\nCP IPA+180 IZ+2 DR+", (0, 5), (0, 10))])
def test_circles(blocks: str, centre: tuple[float, float], end: tuple[float, float]) -> None:
    motion = good(TNC, program(START + "L F100\n" + blocks + "\n"))
    assert (motion.center[1, :2] - [10, 20]).round(9).tolist() == list(centre)
    assert words(motion)[1][:2] == list(end)
    assert bool(motion.ccw[1]) == ("DR+" in blocks)


def test_a_pole_without_coordinates_is_where_the_tool_stands() -> None:
    motion = good(TNC, program(START + "L F100\nL X+7 Y+1\nCC\nL X+9 Y+1\nC X+9 Y+1 DR-\nLP PR+4 PA+90\nLP IPA-90 FMAX\n"))
    assert (motion.center[3, :2] - [10, 20]).tolist() == [7, 1], "a full circle where end and start are one"
    assert words(motion)[4:] == [[7, 5, 20], [11, 1, 20]] and motion.code.tolist() == [0, 1, 1, 2, 1, 0]


def test_circles_in_the_other_planes() -> None:
    """DR+ turns Z towards X and Y towards Z, like G3 of G18 and G19."""
    motion = good(TNC, program(START + "L F100\nCC X+5 Z+20\nC X+5 Z+25 DR+\nCC Y+5 Z+25\nC Y+10 Z+25 DR-\n"))
    assert motion.plane[1:].tolist() == [18, 19] and motion.ccw[1:].tolist() == [True, False]
    assert (motion.center[1] - [10, 20, 30])[[0, 2]].tolist() == [5, 20]
    assert (motion.center[2] - [10, 20, 30])[[1, 2]].tolist() == [5, 25]


def test_a_helix_of_more_than_a_turn() -> None:
    """IPA 450 from angle 180 about X+5: a whole turn with 4 of the 5 mm, then a quarter to angle 270."""
    motion = good(TNC, program(START + "L F100\nCC X+5 Y+0\nCP IPA+450 IZ-5 DR+\nL IX+1\n"))
    assert words(motion)[1:] == [[0, 0, 16], [5, -5, 15], [6, -5, 15]]


CYCLE = "CYCL DEF {} ~\n Q200=+2 ;SET-UP ~\n Q201=-5 ;DEPTH ~\n Q203=+1 ;SURFACE ~\n Q204={} ;2ND{}\n"


STATES = {"200": (206, 202, 210, 211), "201": (206, 211, 208), "203": (206, 202, 210, 212, 213, 205, 211, 208, 256),
          "205": (206, 202, 212, 205, 258, 259, 257, 256, 211, 379, 253), "207": (239,), "240": (343, 344, 206, 211)}
"""parameters that the control asks for besides those of CYCLE (Cycle Programming 34059x)"""


def stated(number: str, rest: str) -> str:
    """The rest of a cycle with all that it must state; what a test does not name is 0."""
    return rest + "".join(f" ~\n Q{n}=+0" for n in STATES[number] if f"Q{n}=" not in rest)


def heights(number: str, rest: str = "", second: str = "+10") -> list[tuple[float, int, float]]:
    holes = "L X+4 R0 FMAX M99\nL X+5 R0 FMAX M99\n"
    motion = good(TNC, program(START + "L F77\n" + CYCLE.format(number, second, stated(number, rest)) + holes))
    assert motion.hole.sum() * 1 == len(motion) - 1
    z = [(round(float(e[2]) - 30, 4), int(c), float(f)) for e, c, f in zip(motion.end, motion.code, motion.feed,
                                                                                 strict=True)]
    first = [a for a, w in zip(z, words(motion), strict=True) if w[0] == 4][1:]
    second = [a for a, w in zip(z, words(motion), strict=True) if w[0] == 5][1:]
    assert [a[1:] for a in second[-len(first) + 1:]] == [a[1:] for a in first[1:]], "the second hole as the first"
    return first


def test_drilling_pecks_count_from_the_surface() -> None:
    """Plane 3, surface 1, bottom -4; pecks of 3: -2, -4; 0.2 before the last depth; out to the second clearance, 11."""
    assert heights("200", " ~\n Q206=+100 ;F ~\n Q202=+3 ;STEP ~\n Q211=+.5 ;DWELL") == [
        (3, 0, 77), (-2, 1, 100), (3, 0, 77), (-1.8, 0, 77), (-4, 1, 100), (11, 0, 77)]


def test_a_second_clearance_below_the_first_counts_nothing() -> None:
    assert heights("200", " ~\n Q206=+100 ~\n Q202=+9", "+0")[-1] == (3, 0, 77)


def test_chips_broken_by_203() -> None:
    rest = " ~\n Q206=+100 ~\n Q202=+2 ~\n Q212=+0 ~\n Q213=+3 ~\n Q205=+0 ~\n Q208=+99999 ~\n Q256=+0.3"
    assert heights("203", rest) == [
        (3, 0, 77), (-1, 1, 100), (-.7, 0, 77), (-3, 1, 100), (-2.7, 0, 77), (-4, 1, 100), (11, 0, 77)]


def test_reaming_leaves_at_its_own_feed_or_that_of_the_way_in() -> None:
    assert heights("201", " ~\n Q206=+100 ~\n Q208=+300") == [(3, 0, 77), (-4, 1, 100), (3, 1, 300), (11, 0, 77)]
    assert heights("201", " ~\n Q206=+100 ~\n Q208=+0")[2] == (3, 1, 100)


def test_rigid_taps_feed_by_pitch_and_speed() -> None:
    assert heights("207", " ~\n Q239=-1.25") == [(3, 0, 77), (-4, 1, 625), (3, 1, 625), (11, 0, 77)]


def test_pecks_get_smaller_by_q212_down_to_q205() -> None:
    rest = " ~\n Q206=+100 ~\n Q202=+3 ~\n Q212=+1.5 ~\n Q205=+1 ~\n Q258=+0.5 ~\n Q259=+0.5 ~\n Q257=+0"
    assert [z for z, c, _ in heights("205", rest) if c] == [-2, -3.5, -4]


def test_cycl_call_and_cycl_call_pos() -> None:
    cycle = CYCLE.format("240", "+10", stated("240", " ~\n Q206=+100"))
    body = START + cycle + "CYCL CALL M8\nCYCL CALL POS X+5 Y+6 Z+0 FMAX\n"
    motion = good(TNC, program(body))
    assert words(motion)[1:] == [[0, 0, 3], [0, 0, -4], [0, 0, 11], [5, 6, 11], [5, 6, 3], [5, 6, -4], [5, 6, 11]]
    assert motion.flood[1:].all()


def test_dwell_smoothing_and_preset() -> None:
    body = ("CYCL DEF 247 DATUM SETTING ~\n Q339=+3 ;NUMBER\nCYCL DEF 32.0 TOLERANCE\nCYCL DEF 32.1 T0.005\n"
            "CYCL DEF 32.2 HSC-MODE:0 TA0.01\nL X+1 F9\nCYCL DEF 9.0 DWELL TIME\nCYCL DEF 9.1 DWELL 1.5\nL X+2\n")
    motion = good(TNC, program(body))
    assert motion.offset.tolist() == [3, 3] and motion.blend.tolist() == [.005, .005] and motion.dwell.tolist() == [1.5, 0]
    assert motion.line.tolist() == [7, 10], "the block over two lines counts as both"


def test_labels_are_run_in_passing_called_and_repeated() -> None:
    body = "L X+0 FMAX\nLBL 1\nL IX+1 FMAX\nLBL 0\nCALL LBL 1\nLBL 2\nL IX+10 FMAX\nCALL LBL 2 REP 2\n"
    motion = good(TNC, program(body))
    assert [w[0] for w in words(motion)] == [0, 1, 2, 12, 22, 32]


def test_labels_behind_the_end_and_other_files() -> None:
    text = ("0 BEGIN PGM T1 MM\n1 L X+0 FMAX\n2 CALL LBL \"HOLE\"\n3 CALL PGM SUB\\P2.H\n4 M30\n"
            "5 LBL \"HOLE\"\n6 L IX+1 FMAX\n"
            "7 LBL 0\n8 END PGM T1 MM\n")
    motion = good(TNC, text, others={"P2.H": b"0 BEGIN PGM P2 MM\n1 L X+7 FMAX\n2 END PGM P2 MM\n"})
    assert [w[0] for w in words(motion)] == [0, 1, 7] and motion.line.tolist() == [2, 7, 2]


@pytest.mark.parametrize(("block", "code"), [
    ("CYCL DEF 26.0 SCALING", "gcode.not_executed"), ("CYCL DEF 19.0 TILT", "gcode.cycle"),
    ("CYCL DEF 10.1 9", "gcode.syntax"), ("CYCL DEF 11.1 SCL0", "gcode.syntax"),
    ("CYCL DEF 11.0 SCALING ~\n11.1 SCL 0.5", "gcode.syntax"), ("CYCL DEF 8.1 Z", "gcode.mode"),
    ("FN 18: Q1 = 5", "gcode.expression"), ("L X+Q1", "gcode.variable"),
    ("RND R5", "gcode.not_executed"), ("CHF 2", "gcode.not_executed"), ("APPR LT X+1 Y+1 LEN5", "gcode.not_executed"),
    ("CT X+1 Y+1", "gcode.not_executed"), ("FL X+1", "gcode.not_executed"), ("L X+1 M126", "gcode.rollover"),
    ("L X+1 M92", "gcode.unknown_code"), ("L X+1 M136", "gcode.unknown_code"), ("L X+1 F AUTO", "gcode.syntax"),
    ("TOOL CALL 1 X", "gcode.tool"), ("TOOL CALL 1 Z DL+0.5", "gcode.tool"), ("C X+1 Y+1 DR+", "gcode.pole"),
    ("LP PR+1 PA+5", "gcode.pole"),
    ("L X+1 M99", "gcode.cycle"), ("PLANE VECTOR BX1", "gcode.syntax"), ("LN X+1 NX1", "gcode.syntax"), ("L C+5 FMAX",
    "gcode.unknown_word"),
    ("CYCL DEF 208 BORE ~\n Q200=2", "gcode.cycle"), ("CALL LBL 77", "gcode.subprogram"), ("L X+1 X+2", "gcode.repeated"),
    ("PLANE RESET TURN FMAX", "gcode.mode"), ("FUNCTION TCPM F CONT AXIS POS PATHCTRL AXIS", "gcode.mode"),
    ("FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR", "gcode.mode"), ("PLANE SPATIAL SPA+0 SPB+0 TURN FMAX", "gcode.mode"),
    *((f"PLANE SPATIAL SPA+0 SPB+0 SPC+0{rest}", "gcode.mode") for rest in (
        "", " STAY R1", " FMAX", " TURN", " MOVE TABLE ROT", " TURN FMAX TABLE", " TURN FMAX ROT", " STAY MOVE FMAX",
        " TURN ABST5 FMAX")), ("L X+1 R1 F100", "gcode.unknown_word"),
    ("L X+1 R1 F100 M128", "gcode.syntax"), (CENTRED.format("Q396"), "gcode.cycle"),
    ("CYCL DEF 32.2 HSC-MODE:2", "gcode.smoothing")])
def test_what_is_not_modelled_is_an_error_with_its_line(block: str, code: str) -> None:
    assert faults(TNC, program(f"L X+0 Y+0 Z+0 FMAX\n{block}\n"), "mill-3axis").get(code) == [3]


@pytest.mark.parametrize("blocks", ["CC X+5 Y+0\nCP IPA+90 DR-\n", "CC X+5 Y+0\nC X+1 Y+0.1 DR+\n",
    "CC X+5 Z+20\nC X+5 Y+5 DR+\n"])
def test_arcs_that_a_tnc_stops_at(blocks: str) -> None:
    assert faults(TNC, program(START + "L F100\n" + blocks)) == {"gcode.arc": [6]}


def test_comments_blank_lines_and_headings() -> None:
    body = ("; L X+5\n* - FACE\nL X+1 FMAX ; L X+6\nBLK FORM 0.1 Z X+0 Y+0 Z-20\nBLK FORM 0.2 X+9 Y+9 Z+0\n"
            "TOOL DEF 2\n/L X+2 FMAX\nSTOP M0\n")
    motion, found = executed(TNC, program(body))
    assert motion is not None and [w[0] for w in words(motion)] == [1, 2]
    assert [(d.code, d.severity.name) for d in found] == [("gcode.block_delete", "WARNING")]


def test_the_block_switch_before_or_behind_the_number() -> None:
    motion, found = executed(TNC, "0 BEGIN PGM T MM\n1 L X+1 FMAX\n/22 L X+2 FMAX\n3 /L X+3 FMAX\n4 M30\n5 END PGM T MM\n")
    assert motion is not None and [w[0] for w in words(motion)] == [1, 2, 3]
    assert [(d.code, list(d.lines)) for d in found] == [("gcode.block_delete", [3, 4])]


def test_a_position_of_another_mode_is_not_known() -> None:
    """What X and Y are changes with the law: a pole counted from them has to wait until they are stated."""
    body = START + "FUNCTION RESET TCPM\nCC IX+1 IY+0\nC IX+2 DR+ F9\n"
    assert faults(TNC, program(body)) == {}, "no law was in force"
    body = START + "PLANE SPATIAL SPA+0 SPB+0 SPC+0 TURN FMAX TABLE ROT\nCC IX+1 IY+0\nPLANE RESET STAY\n"
    assert faults(TNC, program(body), "mikron-ucp710") == {"gcode.pole": [5]}


def test_inches_hold_for_poles_polar_words_and_cycles() -> None:
    """The whole program in inches: X, Y, CC, PR, and levels of a cycle; angles stay."""
    body = START + "L F100\nL X+3 Y+1\nCC X+1 Y+1\nCP IPA+30 DR+\n"
    mm, inch = (good(TNC, program(body).replace(" MM", units)) for units in (" MM", " INCH"))
    steps = [np.diff(motion.end[-3:, :3], axis=0) for motion in (mm, inch)]
    assert np.allclose(steps[1], 25.4 * steps[0], atol=1e-4)


def test_programs_of_two_units_are_refused() -> None:
    called = {"SUB.H": b"0 BEGIN PGM SUB MM\n1 L X+1 R0 FMAX\n2 END PGM SUB MM\n"}
    found = executed(TNC, program(START + "CALL PGM SUB.H\n").replace(" MM", " INCH"), others=called)[1]
    assert "gcode.units" in {d.code for d in found}


def test_polar_end_is_turned_about_the_pole() -> None:
    motion = good(TNC, program(START + "L F100\nL X+3 Y+1\nCC X+1 Y+1\nCP IPA+30 DR+\n"))
    assert np.allclose(words(motion)[-1][:2],
                       [1 + 2 * math.cos(math.pi / 6), 1 + 2 * math.sin(math.pi / 6)], atol=1e-4)
