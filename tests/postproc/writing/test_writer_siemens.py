"""Siemens 840D sl: each rule of docs/reference/control-rules.md that its text has to follow, on programs made by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.compile.program import Section
from postproc.control.planes import Plane
from tests.postproc.program_kit import LOAD, blocks, command, drilled, lines, program, step
from toolpaths.toolpath import Cycle

TILTED = Section(1, "tilted", Plane(np.eye(3), np.zeros(3)), (12.5, 30.0, -45.0), (("A", -30.0), ("C", 12.5)))


def test_blocks_are_numbered_and_comments_are_not() -> None:
    text = lines("siemens-840d", program([step("rapid", X=1.0)]))
    assert text[0] == "; made by hand" and text[1] == "N10 G17 G710 G90 G94 G40 G64" and text[-1].endswith(" M30")


def test_home_is_reached_without_offsets_and_length_and_the_length_comes_back_with_z() -> None:
    made = program([step("rapid", Z=600.0, home=True), step("rapid", X=1.0), step("rapid", Z=50.0),
                    step("rapid", Z=600.0, home=True), step("rapid", Z=9.0)], {1: LOAD})
    assert blocks("siemens-840d", made) == ["SUPA G0 D0 Z600", "T3", "M6", "S5000 M3", "G0 X1", "D1 Z50", "SUPA G0 D0 Z600",
                                            "D1 Z9"]


def test_length_is_off_where_axis_positions_hold_it() -> None:
    made = program([step("rapid", Z=50.0)], {0: LOAD})
    assert blocks("siemens-840d", made, length_offsets=False) == ["T3", "M6", "D0", "S5000 M3", "G0 Z50"]


@pytest.mark.parametrize(("angle", "direction"), [(-30.0, -1), (30.0, 1), (0.0, 1)])
def test_tilted_plane_names_its_turns_and_the_side_of_the_first_axis(angle: float, direction: int) -> None:
    section = replace(TILTED, rotary=(("A", angle), ("C", 12.5)))
    made = program([step("rapid", A=angle, C=12.5), step("rapid", X=1.0, Y=2.0, Z=50.0)],
                   {0: LOAD, 1: [command("ENTER_SECTION", 1.0)], 2: [command("LEAVE_SECTION", 1.0)]},
                   sections=(Section(0, "axes"), section))
    assert blocks("siemens-840d", made)[5:] == [
        "D1", f'CYCLE800(0,"",0,27,0,0,0,12.5,30,-45,0,0,0,{direction},0,1)', "G0 X1 Y2 Z50", "CYCLE800()"]


def test_tcp_states_the_work_offset_and_linear_rotary_axes() -> None:
    made = program([step("rapid", A=1.0), step("rapid", X=1.0, Y=2.0, Z=50.0, A=1.0, C=0.0)],
                   {0: LOAD, 1: [command("ENTER_SECTION", 1.0)], 2: [command("LEAVE_SECTION", 1.0)]},
                   sections=(Section(0, "axes"), Section(1, "tcp")))
    assert blocks("siemens-840d", made, work_offset="G58")[5:] == [
        "D1", "TRAORI", "G505", "ORIMKS ORIAXES", "G0 X1 Y2 Z50 A1 C0", "TRAFOOF", "G505"]


def test_programmable_offsets_are_not_taken_for_settable_ones() -> None:
    for code, settable in (("G57", "G57"), ("G58", "G505"), ("G59", "G506")):
        text = lines("siemens-840d", program([step("rapid", X=0.0)]), work_offset=code)
        assert text[2] == f"N20 {settable}"


def test_smoothing_states_both_tolerances_and_one_degree_without_rotary_axes() -> None:
    made = program([step("rapid", X=0.0)])
    assert "N30 CYCLE832(0.003,_ORI_FINISH,0.015)" in lines("siemens-840d", made, smoothing=0.003,
                                                            axis_smoothing=0.015)
    text = lines("siemens-840d", made, smoothing=0.003)
    assert "N30 CYCLE832(0.003,_ORI_FINISH,1)" in text and "N50 CYCLE832(0,_OFF,1)" in text


def test_dwell_is_seconds_in_f() -> None:
    assert blocks("siemens-840d", program([step("rapid", X=0.0)], {0: [command("DWELL", 1.5)]}))[0] == "G4 F1.5"


CALLS = [("DRILL", {}, "MCALL CYCLE81(20,0,2,-8)"), ("DRILL", {"dwell": 0.5}, "MCALL CYCLE82(20,0,2,-8,,0.5)"),
         ("DEEP", {"steps": (3.0,)}, "MCALL CYCLE83(20,0,2,-8,,,3,0,0,0,1,1)"),
         ("BRKCHP", {"steps": (3.0,)}, "MCALL CYCLE83(20,0,2,-8,,,3,0,0,0,1,0)"),
         ("TAP", {"pitch": 1.5}, "MCALL CYCLE84(20,0,2,-8,,0,3,,1.5,0,5000,5000)"),
         ("REAM", {}, "MCALL CYCLE85(20,0,2,-8,,0,200,200)")]


@pytest.mark.parametrize(("kind", "more", "call"), CALLS, ids=lambda v: v if isinstance(v, str) else "")
def test_cycles_are_modal_calls_with_the_feed_before_them(kind: str, more: dict[str, float],
                                                          call: str) -> None:
    steps, hole = drilled(kind, retract=20.0)
    made = program([*steps, step("feed", Z=30.0, F=200.0)], {0: LOAD}, holes=(hole,))
    text = blocks("siemens-840d", made, (Cycle(kind, 8.0, 2.0, None, 200.0, **more),))
    assert text[4:] == ["G0 D1 X0 Y0 Z20", "F200", call, "G0 X10 Y20", "MCALL", "G1 Z30"]


def test_left_hand_taps_have_a_negative_pitch() -> None:
    steps, hole = drilled("TAP_LEFT", retract=20.0)
    made = program(steps, {0: [command("START_SPINDLE_COUNTERCLOCKWISE", 400.0)]}, holes=(hole,))
    text = blocks("siemens-840d", made, (Cycle("TAP", 8.0, 2.0, None, 200.0),))
    assert "MCALL CYCLE84(20,0,2,-8,,0,4,,-0.5,0,400,400)" in text


def test_second_hole_is_its_place_alone() -> None:
    steps, hole = drilled("DRILL")
    steps += [step("rapid", X=30.0), step("feed", Z=-8.0, F=200.0), step("rapid", Z=2.0)]
    made = program(steps, holes=(hole, replace(hole, first=4, last=6, drill=5)))
    assert blocks("siemens-840d", made, (Cycle("DRILL", 8.0, 2.0, 2.0, 200.0),))[1:] == [
        "F200", "MCALL CYCLE81(2,0,2,-8)", "G0 X10 Y20", "X30 Y20", "MCALL"]
