"""Frames, hole patterns and strings of programs: where the tool goes, worked out by hand, and what is refused."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from postproc.readback.dialects.readers import reader_for
from tests.postproc.kit import machine
from tests.postproc.readback.test_macros import HEAD, LINUXCNC, SINUMERIK, track
from tests.postproc.reader_kit import FANUC, HAAS, SIEMENS, TNC, control, controller, executed, faults, good, words

CYCLE = "G0 Z10\nF100 S100 M3\nMCALL CYCLE81(5,0,2,-3)\n"


def holes(body: str) -> list[list[float]]:
    """Where the tool drills."""
    return [end[:2] for end in track(SIEMENS, CYCLE + body + "MCALL\n") if end[2] == -3.0]


@pytest.mark.parametrize(("body", "ends"), [
    ("ROT Z90\nX10\nY5\nG91 X1\nG90\nROT\nX1\n", [[0, 10, 0], [-5, 10, 0], [-5, 11, 0], [1, 11, 0]]),
    ("TRANS X10 Y10\nAROT Z90\nX4 Y3\nATRANS X1\nX4\nTRANS\nX0\n", [[7, 14, 0], [7, 15, 0], [0, 15, 0]]),
    ("TRANS X10\nROT Z90\nX4\n", [[0, 4, 0]]),
    ("ROT RPL=90\nX2 Y=IC(1)\n", [[-1, 2, 0]]),
    ("ROT X90\nX1 Y2 Z3\nY3\n", [[1, -3, 2], [1, -3, 3]]),
    ("ROT X90 Z90\nX1 Y2 Z3\n", [[3, 1, 2]]),
    ("SCALE X2 Y3\nX1 Y1 Z1\nASCALE X2\nX1\n", [[2, 3, 1], [4, 3, 1]]),
    ("MIRROR X0\nX4 Y1\nTRANS Y2\nAMIRROR Y0\nY1\n", [[-4, 1, 0], [-4, 1, 0]]),
    ("ROT Z90\nX=R1 Y2\n", []),
    ("TRANS X10\nR1=$P_EP[X]\nAROT Z90\nX5\nR2=$P_EP[X]\nTRANS\nX=R1 Y=R2\n", [[0, 5, 0], [-10, 5, 0]]),
    ("ROT Z90\nG0 SUPA Z50 D0\nZ1\n", [[0, 0, 20], [0, 0, 1]])])
def test_frames_move_ends(body: str, ends: list[list[float]]) -> None:
    if "X=R1 Y2" in body:
        assert faults(SIEMENS, SINUMERIK + body + "M30\n") == {"gcode.variable": [4]}
        return
    assert track(SIEMENS, body) == ends


ARC = "X10 Y0\nG1 F100 X10\n{}\n"


@pytest.mark.parametrize("arc", ["G3 X0 Y10 I-10 J0", "G3 X0 Y10 I=AC(0) J=AC(0)", "G3 X0 Y10 CR=10", "G2 X0 Y10 CR=-10",
                                 "G3 X0 Y10 Z4 I-10 J0", "G42 G3 X0 Y10 CR=10\nG40 G1 X-20"])
@pytest.mark.parametrize(("frame", "moved"), [
    ("ROT Z30", lambda p: [p[0] * 0.75 ** 0.5 - p[1] / 2, p[0] / 2 + p[1] * 0.75 ** 0.5, p[2]]),
    ("MIRROR Y0", lambda p: [p[0], -p[1], p[2]]), ("SCALE X2 Y2", lambda p: [2 * p[0], 2 * p[1], p[2]]),
    ("TRANS X3 Y-4", lambda p: [p[0] + 3, p[1] - 4, p[2]]), ("MIRROR Z0", lambda p: [p[0], p[1], -p[2]])])
def test_a_circle_is_the_circle_moved(frame: str, arc: str, moved: Callable[[np.ndarray], list[float]]) -> None:
    """The arc of the plain program, its sense and centre moved point by point, is that of the program in the frame."""
    plain, _ = executed(SIEMENS, SINUMERIK + ARC.format(arc) + "M30\n")
    framed, found = executed(SIEMENS, SINUMERIK + frame + "\n" + ARC.format(arc) + frame.split()[0] + "\nM30\n")
    assert plain is not None and framed is not None, found
    work, k, n = np.array([10.0, 20.0, 30.0]), plain.code == 2, framed.code == 2
    assert k.sum() == n.sum() == 1
    np.testing.assert_allclose(framed.center[n][0] - work, moved(plain.center[k][0] - work), atol=1e-9)
    np.testing.assert_allclose(framed.end[-1, :3] - work, moved(plain.end[-1, :3] - work), atol=1e-9)
    assert framed.ccw[n][0] == (plain.ccw[k][0] != (frame == "MIRROR Y0"))


def test_motion_and_side_are_those_of_the_program_behind_a_mirror() -> None:
    body = "G1 F100 X10\nMIRROR Y0\nG3 X0 Y10 CR=10\nMIRROR\nX10 Y0 I=AC(0) J=AC(0)\nMIRROR X0\nG41 D1 G1 X20 Y0\nG40 X30\n"
    motion, found = executed(SIEMENS, SINUMERIK + body + "M30\n")
    assert motion is not None and not [d for d in found if d.severity.name == "ERROR"], [str(d) for d in found]
    assert motion.ccw[motion.code == 2].tolist() == [False, True]
    assert motion.compensation.tolist()[-2:] == [42, 40]


@pytest.mark.parametrize(("body", "line"), [
    ("SCALE X2\nG1 F9 X5\nG3 X0 Y5 I-5 J0\n", 5), ("ROT X30\nG1 F9 X5\nG3 X0 Y5 I-5 J0\n", 5), ("ROTS X5 Y6\n", 3),
    ("SCALE X0\n", 3), ("ROT X90\nG1 F9 X5\nG2 I-5\n", 5), ("SCALE X2\nAROT Z45\n", 4), ("ROT Z30\nX=DC(5)\n", 4),
    ("MCALL CYCLE81(5,0,2,-3)\nROT X90\n", 4), ("MCALL CYCLE81(5,0,2,-3)\nMIRROR Z0\n", 4),
    ("MCALL CYCLE81(5,0,2,-3)\nSCALE Z2\n", 4), ("G18\nMIRROR Y0\nCYCLE81(5,0,2,-3)\n", 5),
    ("ROT X90\nMCALL CYCLE81(5,0,2,-3)\n", 4), ("MCALL CYCLE81(5,0,2,-3)\nTRANS Z5\n", 4),
    ("G41 X5\nMIRROR X0\n", 4), ("ROT Z90\nTRAORI\n", 4), ("ROT Z90\nCYCLE800(0,\"\",0,57,0,0,0,0,0,0,0,0,0)\n", 4)])
def test_what_no_plain_block_says_is_refused(body: str, line: int) -> None:
    assert faults(SIEMENS, SINUMERIK + body + "M30\n") == {"gcode.frame_turned": [line]}


@pytest.mark.parametrize("row", ["G90 TRANS X10", "TRANS X1 X2", "ROT Z30 X"])
def test_a_frame_stands_alone_in_its_block(row: str) -> None:
    assert faults(SIEMENS, SINUMERIK + row + "\nM30\n") == {"gcode.expression": [3]}


def test_a_frame_asks_for_positions_that_it_needs() -> None:
    text = "G17 G40 G90 G94 G54 G71\nG0 X1\nROT Z30\nX2\nM30\n"
    assert faults(SIEMENS, text) == {"gcode.position_unknown": [4]}
    assert "gcode.position_unknown" not in faults(SIEMENS, text.replace("Z30", "Z90")), "X2 is Y2 there, whatever Y was"
    assert faults(SIEMENS, SINUMERIK + "TRAFOOF\nROT Z30\nX2\nM30\n") == {"gcode.position_unknown": [5]}


@pytest.mark.parametrize(("call", "places"), [
    ("HOLES1(0, 0, 90, 5, 10, 3)", [[0, 5], [0, 15], [0, 25]]), ("X100 Y0\nMCALL CYCLE81(5,0,2,-3)\nHOLES1(0,0,0,0,10,3)",
                                                                [[100, 0], [20, 0], [10, 0], [0, 0]]),
    ("HOLES2(0, 0, 10, 0, , 4)", [[10, 0], [0, 10], [-10, 0], [0, -10]]),
    ("HOLES2(5, 0, 10, 90, -90, 2)", [[5, 10], [15, 0]]),
    ("CYCLE801(1, 1, 0, 10, 5, 2, 3)", [[1, 1], [1, 6], [1, 11], [11, 11], [11, 6], [11, 1]]),
    ("ROT Z90\nCYCLE801(1, 2, 0, 10, 5, 1, 2)\nROT", [[-2, 1], [-7, 1]]),
    ("R1=2\nTRANS X5\nHOLES1(R1, 0, 0, 0, 1, R1)\nTRANS", [[7, 0], [8, 0]])])
def test_patterns_drill_at_their_places(call: str, places: list[list[float]]) -> None:
    assert holes(call + "\n") == places


@pytest.mark.parametrize(("body", "places"), [
    ("G18\nMCALL CYCLE81(5,0,2,-3)\nHOLES1(1, 2, 0, 0, 10, 2)\n", [[2, -3, 1], [2, -3, 11]]),
    ("G18\nTRANS Y1 Z5\nMCALL CYCLE81(5,0,2,-3)\nX1\n", [[1, -2, 0]]),
    ("G19\nATRANS X4\nMCALL CYCLE81(5,0,2,-3)\nHOLES2(1, 2, 5, 90, 0, 1)\n", [[1, 1, 7]])])
def test_holes_of_other_planes_lie_in_those_planes(body: str, places: list[list[float]]) -> None:
    motion = good(SIEMENS, SINUMERIK + body + "MCALL\nM30\n")
    assert words(motion)[0] == [0, 0, 0] and [words(motion)[k] for k in np.flatnonzero(motion.code == 1)] == places


SUBPROGRAM = "%_N_DEEP_SPF\nPROC DEEP\nG0 Z-3\nZ0\nM17\n"


@pytest.mark.parametrize("before", ["", "R1=1\n"])
def test_mcall_calls_a_subprogram_behind_each_block_that_moves(before: str) -> None:
    text = SINUMERIK + before + "MCALL DEEP\nX1\nX2\nMCALL\nX3\nM30\n" + SUBPROGRAM
    assert words(good(SIEMENS, text))[1:] == [[1, 0, 0], [1, 0, -3], [1, 0, 0], [2, 0, 0], [2, 0, -3], [2, 0, 0], [3, 0, 0]]


@pytest.mark.parametrize("call", ["HOLES1(0,0,0,5,10,2)", "HOLES2(0,0,10,0,0,3)", "CYCLE801(0,0,0,1,1,2,2)"])
def test_patterns_under_mcall_of_a_subprogram_are_refused(call: str) -> None:
    body = f"MCALL DEEP\n{call}\nMCALL\nM30\n"
    assert faults(SIEMENS, SINUMERIK + body + SUBPROGRAM) == {"gcode.cycle": [4]}
    assert not faults(SIEMENS, SINUMERIK + body.replace("\nHOLES", "\nMCALL\nHOLES").replace("CYCLE801", "MCALL\nCYCLE801")
                      + SUBPROGRAM)


@pytest.mark.parametrize("before", ["", "R1=1\n"])
@pytest.mark.parametrize("archive", ["{main}%_N_DEEP_SPF\nX7\nM17\n%_N_LAST_SPF\nX8\nM17\n", "{main}%_N_DEEP_SPF\nX7\nM17\n",
                                     "; all\n%_N_DEEP_SPF\nX7\nM17\n%_N_PART_MPF\n{main}"])
def test_the_program_that_runs_first_of_an_archive(archive: str, before: str) -> None:
    """What stands before all %_N_ rows, else the first main program, wherever it stands."""
    text = archive.format(main=SINUMERIK + before + "DEEP\nX1\nM30\n")
    assert words(good(SIEMENS, text)) == [[0, 0, 0], [7, 0, 0], [1, 0, 0]]


@pytest.mark.parametrize(("inside", "ends"), [
    ("G91 X1", [[1, 0, 0], [2, 0, 0]]), ("TRANS X5\nX1", [[6, 0, 0], [2, 0, 0]]),
    ("MIRROR X0\nG18 G1 F100 X1", [[-1, 0, 0], [2, 0, 0]]), ("G700\nX1", [[25.4, 0, 0], [2, 0, 0]])])
def test_save_gives_the_caller_its_codes_and_frame_back(inside: str, ends: list[list[float]]) -> None:
    text = SINUMERIK + "DEEP\nX2\nM30\n%_N_DEEP_SPF\nPROC DEEP SAVE DISPLOF\n" + inside + "\nM17\n"
    motion = good(SIEMENS, text)
    assert words(motion)[1:] == ends and motion.code[-1] == 0


def test_save_asks_for_codes_that_nothing_states() -> None:
    text = SINUMERIK + "DEEP\nX2\nM30\n%_N_DEEP_SPF\nPROC DEEP SAVE\nG60 X1\nM17\n"
    assert faults(SIEMENS, text) == {"gcode.mode": [9]}


def test_patterns_leave_the_code_of_motion() -> None:
    assert track(SIEMENS, "G1 F100 X1\nHOLES1(5,5,0,0,1,1)\nX9 Y9\n") == [[1, 0, 0], [5, 5, 0], [9, 9, 0]]
    motion, found = executed(SIEMENS, SINUMERIK + "G1 F100 X1\nCYCLE801(5,5,0,1,1,1,1)\nX9 Y9\nM30\n")
    assert motion is not None and motion.code[-1] == 1 and {d.code for d in found} == {"gcode.hole_order"}


@pytest.mark.parametrize("call", ["HOLES1(0,0,0,5)", "HOLES1(0,0,0,5,1,2.5)", "HOLES2(0,0,5,0,0,0)", "HOLES1(0,0,0,5,1,2,1)",
                                  "CYCLE801(0,0,0,1,1,1000,1000)"])
def test_patterns_without_their_values_are_refused(call: str) -> None:
    assert faults(SIEMENS, SINUMERIK + CYCLE + call + "\nM30\n") == {"gcode.cycle": [6]}


@pytest.mark.parametrize(("body", "ends"), [
    ('QS1 = "AB" || "C"\nQ1 = STRLEN( SRC_QS1 ) * 2\nL X+Q1 FMAX\n', [[6, 0, 0]]),
    ('DECLARE STRING QS1 = "7.5"\nQ2 = TONUMB( SRC_QS1 )\nFN 16: F-PRINT TNC:\\M.A / TNC:\\P.TXT\nL X+Q2 FMAX\n',
     [[7.5, 0, 0]]),
    ('QS1 = "HELLO"\nQS2 = SUBSTR( SRC_QS1 BEG1 LEN2 )\nQ1 = INSTR( SRC_QS1 SEA_QS2 BEG0 )\nL X+Q1 FMAX\n', [[1, 0, 0]]),
    ('Q1 = 2.345\nQS1 = TOCHAR( DAT+Q1 DECIMALS1 )\nQ2 = TONUMB( SRC_QS1 )\nL X+Q2 FMAX\n', [[2.3, 0, 0]]),
    ('QS1 = "A"\nQS2 = "B"\nQ1 = STRCOMP( SRC_QS1 SEA_QS2 )\nL X+Q1 FMAX\n', [[-1, 0, 0]]),
    ('QS1 = "A B"\nFN 9: IF +1 EQU +1 GOTO LBL QS1\nL X+5 FMAX\nLBL "A B"\nL Y+2 FMAX\n', [[0, 2, 0]]),
    ('QS1 = "SUB"\nCALL LBL QS1\nL M30\nLBL "SUB"\nL X+3 FMAX\nLBL 0\n', [[3, 0, 0]]),
    ('TOOL CALL 2 Z S500\nFN 18: SYSREAD Q1 = ID20 NR1\nFN 18: SYSREAD Q2 = ID60 NR3\nFN 18: SYSREAD Q3 = ID10 NR8 IDX1\n'
     'L X+Q1 Y+Q2 Z+Q3 FMAX\n', [[2, 500, 55.5]])])
def test_strings_and_system_data_of_klartext(body: str, ends: list[list[float]]) -> None:
    assert track(TNC, body)[:1] == ends


def test_a_program_called_by_a_string() -> None:
    body = 'QS1 = "PART" || "2"\nCALL PGM QS1\n'
    assert track(TNC, body, PART2_h=b"BEGIN PGM PART2 MM\nL X+4 FMAX\nEND PGM PART2 MM\n")[:1] == [[4, 0, 0]]


@pytest.mark.parametrize(("body", "code"), [
    ("L X+QS9 FMAX\n", "gcode.variable"), ("FN 18: SYSREAD Q1 = ID270 NR1 IDX1\n", "gcode.variable"),
    ('QS1 = "X"\nTOOL CALL QS1 Z S500\n', "gcode.tool_name"), ('QS1 = "X"\nQ1 = TONUMB( SRC_QS1 )\n', "gcode.expression"),
    ("FN 17: SYSWRITE ID50 NR1 IDX1 = +5\n", "gcode.variable"), ('QS1 = SYSSTR( ID10 NR1 )\n', "gcode.expression")])
def test_strings_that_nobody_has_set_are_refused(body: str, code: str) -> None:
    assert list(faults(TNC, f"BEGIN PGM A MM\n{body}END PGM A MM\n")) == [code]


def test_the_length_of_a_tool_is_that_of_the_set_up() -> None:
    reader = reader_for(controller(TNC), machine("mill-3axis").axis_names, control().machine.home)
    reader.given(lambda _: np.zeros(3), {3: 87.5}, frozenset())
    text = "BEGIN PGM A MM\nFN 18: SYSREAD Q1 = ID50 NR1 IDX3\nL Z+Q1 R0 FMAX\nL M30\nEND PGM A MM\n"
    code, found = reader.read(text.encode(), "A")
    assert code is not None and not found
    assert code.words.value[code.words.letter == ord("Z")].tolist() == [87.5]


@pytest.mark.parametrize("name", [FANUC, HAAS])
def test_skips_end_where_they_are_programmed(name: str) -> None:
    motion, found = executed(name, HEAD + "G31 X5. F100.\nX7.\nM30\n%\n")
    assert motion is not None and motion.code.tolist()[-2:] == [1, 0]
    assert [d.code for d in found] == ["gcode.skip"]


def test_m198_calls_a_file_as_m98_does() -> None:
    assert track(FANUC, "M198 P77\n", O0077_nc=b"O0077\nG0 X3.\nM99\n") == [[3, 0, 0]]


@pytest.mark.parametrize(("condition", "said"), [("#1GT0.3", True), ("#1EQ0.3", True), ("#1GT0.2999", False),
                                                 ("3EQ3", False)])
def test_comparisons_that_rounding_decides_are_named(condition: str, said: bool) -> None:
    _, found = executed(FANUC, HEAD + f"#1=0.1+0.2\nIF[{condition}]GOTO5\nG0 X1.\nN5 M30\n%\n")
    assert [d.code for d in found] == ["gcode.comparison"] * said


@pytest.mark.parametrize(("rows", "line"), [
    ("O1 ENDIF\n", 6), ("O1 ENDREPEAT\n", 6), ("O1 ENDWHILE\n", 6),
    ("O1 IF [1]\nO2 REPEAT [1]\nO1 ENDIF\nO2 ENDREPEAT\n", 8),
    ("O1 WHILE [1]\nO2 IF [1]\nO1 ENDWHILE\nO2 ENDIF\n", 8), ("O1 DO\nO2 IF [1]\nO1 WHILE [0]\nO2 ENDIF\n", 8)])
def test_o_words_belong_together(rows: str, line: int) -> None:
    assert faults(LINUXCNC, HEAD + rows + "M2\n") == {"gcode.jump": [line]}


def test_o_words_that_never_run_are_not_looked_at() -> None:
    assert track(LINUXCNC, "O1 IF [0]\nO2 ENDREPEAT\nO1 ENDIF\nG0 X1.\n") == [[1, 0, 0]]


def test_an_offset_that_the_set_up_does_not_state_is_named() -> None:
    for name, body in ((FANUC, "#1=#5241\n"), (LINUXCNC, "#1=#5241\n")):
        reader = reader_for(controller(name), machine("mill-3axis").axis_names, control().machine.home)
        reader.given(lambda _: np.zeros(3), {}, frozenset({54.0}))
        said = [[d.code for d in reader.read((HEAD + text + "M2\n").encode(), "A")[1]] for text in (
            body, body.replace("5241", "5221"), "G10 L2 P2 X1. Y0. Z0.\n" + body)]
        assert said == [["gcode.offset_unstated"], [], []], name
