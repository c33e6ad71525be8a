"""Fanuc 30i: each rule of docs/reference/control-rules.md that its text has to follow, on programs made by hand."""

from __future__ import annotations

import numpy as np
import pytest

from postproc.compile.program import Section
from postproc.control.planes import Plane
from tests.postproc.program_kit import LOAD, blocks, command, drilled, lines, program, step
from toolpaths.toolpath import Cycle

TILTED = Section(1, "tilted", Plane(np.eye(3), np.zeros(3)), (12.5, 30.0, -45.0), (("A", -30.0), ("C", 12.5)))
TCP = Section(1, "tcp", None, (), (("A", -30.0), ("C", 12.5)))


def test_every_number_has_a_point() -> None:
    made = program([step("rapid", X=10.0, Y=-0.5, Z=0.0), step("feed", X=1.25, F=600.0)])
    assert blocks("fanuc-30i", made) == ["G0 X10. Y-0.5 Z0.", "G1 X1.25 F600."]


def test_program_frame_and_number() -> None:
    text = lines("fanuc-30i", program([step("rapid", X=0.0)]))
    assert text[:3] == ["%", "O0001", "(MADE BY HAND)"] and text[-2:] == ["M30", "%"]


def test_comments_are_capitals_without_brackets() -> None:
    made = program([step("rapid", X=0.0)], {0: [command("COMMENT", "left (side)")]})
    assert blocks("fanuc-30i", made)[0] == "(LEFT  SIDE )"


def test_length_register_stands_with_the_first_z() -> None:
    made = program([step("rapid", X=1.0), step("rapid", Z=50.0), step("rapid", Z=5.0)], {0: LOAD})
    assert blocks("fanuc-30i", made) == ["G49", "T3 M6", "S5000 M3", "G0 X1.", "G43 H3 Z50.", "Z5."]


def test_z_in_machine_coordinates_takes_no_length_register() -> None:
    made = program([step("rapid", Z=600.0, home=True), step("rapid", Z=50.0)], {0: LOAD})
    assert blocks("fanuc-30i", made)[3:] == ["G53 G0 Z600.", "G43 H3 Z50."]


def test_no_length_register_where_axis_positions_hold_the_length() -> None:
    made = program([step("rapid", Z=50.0)], {0: LOAD})
    assert blocks("fanuc-30i", made, length_offsets=False) == ["T3 M6", "S5000 M3", "G0 Z50."]


def test_tilted_plane_is_stated_without_a_length_and_the_length_inside() -> None:
    made = program([step("rapid", X=0.0, Z=100.0), step("rapid", X=1.0, Y=2.0, Z=50.0), step("rapid", Z=90.0)],
                   {0: LOAD, 1: [command("ENTER_SECTION", 1.0)], 3: [command("LEAVE_SECTION", 1.0)]},
                   sections=(Section(0, "axes"), TILTED))
    assert blocks("fanuc-30i", made)[3:] == [
        "G0 G43 H3 X0. Z100.", "G49", "G68.2 X0. Y0. Z0. I12.5 J30. K-45.", "G53.1", "G0 G43 H3 X1. Y2. Z50.", "Z90.", "G49",
        "G69"]


def test_the_plane_of_zero_angles_is_stated_too() -> None:
    flat = Section(0, "tilted", Plane(np.eye(3), np.zeros(3)), (0.0, 0.0, 0.0), ())
    made = program([step("rapid", X=1.0)], {0: [command("ENTER_SECTION", 1.0)]},
                   sections=(Section(0, "axes"), flat))
    assert blocks("fanuc-30i", made)[0] == "G68.2 X0. Y0. Z0. I0. J0. K0."


def test_tcp_is_entered_with_the_register_and_left_by_g49_then_the_length_again() -> None:
    made = program([step("rapid", A=-30.0, C=12.5), step("rapid", X=1.0, Y=2.0, Z=50.0, A=-30.0, C=12.5),
                    step("feed", X=2.0, A=-20.0, F=500.0), step("rapid", Z=80.0), step("rapid", Z=200.0)],
                   {0: LOAD, 1: [command("ENTER_SECTION", 1.0)], 4: [command("LEAVE_SECTION", 1.0)]},
                   sections=(Section(0, "axes"), TCP, Section(4, "axes")))
    assert blocks("fanuc-30i", made)[3:] == [
        "G0 A-30. C12.5", "G43.4 H3", "G0 X1. Y2. Z50. A-30. C12.5", "G1 X2. A-20. F500.", "G0 Z80.", "G49",
        "G0 G43 H3 Z200."]


def test_tcp_on_heads_takes_the_register_that_axis_positions_do_not() -> None:
    made = program([step("rapid", A=1.0), step("rapid", Z=5.0), step("rapid", Z=9.0)],
                   {0: LOAD, 1: [command("ENTER_SECTION", 1.0)], 2: [command("LEAVE_SECTION", 1.0)]},
                   sections=(Section(0, "axes"), TCP, Section(2, "axes")))
    assert blocks("fanuc-30i", made, length_offsets=False)[2:] == ["G0 A1.", "G43.4 H3", "G0 Z5.", "G49", "G0 Z9."]


def test_safe_start_ends_a_plane_only_in_programs_with_planes() -> None:
    plain = lines("fanuc-30i", program([step("rapid", X=0.0)]))
    tilted = lines("fanuc-30i", program([step("rapid", X=0.0)], sections=(Section(0, "axes"), TILTED)))
    assert "G69" not in plain and tilted[tilted.index("G69") - 1] == "G49" and "G17 G21 G40 G80 G90 G94 G98" in tilted


def test_the_head_names_the_parameters_that_a_mode_needs() -> None:
    text = lines("fanuc-30i", program([step("rapid", X=0.0)], sections=(Section(0, "axes"), TILTED, TCP)))
    needed = [line for line in text if line.startswith("(NEEDS ")]
    assert [key in line for key, line in zip(("G43.4", "19696#5", "ROTARY VALUES OF 0", "G68.2", "5006#6",
                                                      "G05.1"), needed, strict=True)] == [True] * 6
    assert [line for line in lines("fanuc-30i", program([step("rapid", X=0.0)])) if "NEEDS" in line] == needed[-1:]


def test_smoothing_states_no_tolerance_and_is_taken_back() -> None:
    text = lines("fanuc-30i", program([step("rapid", X=0.0)]))
    assert text.index("G05.1 Q1") < text.index("G05.1 Q0")


@pytest.mark.parametrize(("plane", "centre", "words"), [
    (17, (-5.0, 2.0, 0.0), "I-5. J2."), (18, (-5.0, 0.0, 2.0), "I-5. K2."), (19, (0.0, -5.0, 2.0), "J-5. K2.")])
def test_arcs_state_the_centre_of_their_plane_alone(plane: int, centre: tuple[float, float, float],
                                                    words: str) -> None:
    made = program([step("ccw", X=1.0, Y=2.0, Z=3.0, plane=plane, centre=centre, F=100.0)])
    head = "" if plane == 17 else f"G{plane} "
    assert blocks("fanuc-30i", made) == [f"{head}G3 X1. Y2. Z3. {words} F100."]


def test_full_circle_is_one_block_with_its_end_at_its_start() -> None:
    made = program([step("rapid", X=10.0, Y=0.0), step("cw", X=10.0, Y=0.0, centre=(-10.0, 0.0, 0.0), F=300.0)])
    assert blocks("fanuc-30i", made)[1] == "G2 X10. Y0. I-10. J0. F300."


def test_inverse_time_is_stated_in_every_block() -> None:
    made = program([step("feed", X=1.0, F=2.0, inverse=True), step("feed", X=2.0, F=2.0, inverse=True),
                    step("feed", X=3.0, F=2.0), step("feed", X=4.0, F=2.0)])
    assert blocks("fanuc-30i", made) == ["G93 G1 X1. F2.", "X2. F2.", "G94 X3. F2.", "X4."]


def test_dwell_is_whole_milliseconds() -> None:
    made = program([step("rapid", X=0.0)], {0: [command("DWELL", 1.25)]})
    assert blocks("fanuc-30i", made)[0] == "G4 P1250"


def test_cycles_dwell_in_milliseconds_and_peck_with_a_point() -> None:
    steps, hole = drilled("DRILL")
    made = program(steps, holes=(hole,))
    assert blocks("fanuc-30i", made, (Cycle("DRILL", 8.0, 2.0, 2.0, 200.0, dwell=0.5),))[1:] == [
        "G99 G82 X10. Y20. Z-8. R2. P500 F200.", "G80"]
    steps, hole = drilled("DEEP", retract=20.0)
    made = program(steps, holes=(hole,))
    assert blocks("fanuc-30i", made, (Cycle("DEEP", 8.0, 2.0, None, 200.0, steps=(3.0,)),))[1:] == [
        "G98 G83 X10. Y20. Z-8. R2. Q3. F200.", "G80"]


@pytest.mark.parametrize(("turning", "key", "code"),
                         [("CLOCKWISE", "TAP", "G84"), ("COUNTERCLOCKWISE", "TAP_LEFT", "G74")])
def test_taps_are_rigid(turning: str, key: str, code: str) -> None:
    steps, hole = drilled(key, feed=750.0)
    made = program(steps, {0: [command(f"START_SPINDLE_{turning}", 500.0)]}, holes=(hole,))
    assert blocks("fanuc-30i", made, (Cycle("TAP", 8.0, 2.0, 2.0, 750.0),))[2:] == [
        "M29 S500", f"G99 {code} X10. Y20. Z-8. R2. F750.", "G80"]


def test_further_work_offsets_are_g54_1() -> None:
    text = lines("fanuc-30i", program([step("rapid", X=0.0)]), work_offset="G54.1 P2")
    assert "G54.1 P2" in text


def test_compensation_names_its_register() -> None:
    made = program([step("feed", X=1.0, F=100.0), step("feed", X=2.0, F=100.0)],
                   {0: [command("CUTTER_COMPENSATION_LEFT", 7.0)], 1: [command("CUTTER_COMPENSATION_OFF")]})
    assert blocks("fanuc-30i", made) == ["G41 D7", "G1 X1. F100.", "G40", "X2."]
