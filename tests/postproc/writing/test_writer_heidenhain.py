"""Heidenhain TNC 640, Klartext: each rule of docs/reference/control-rules.md, on programs made by hand."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from postproc.compile.program import Section
from postproc.control.planes import Plane
from postproc.writing.heidenhain import sweep
from tests.postproc.program_kit import LOAD, blocks, command, drilled, lines, program, step
from toolpaths.toolpath import Cycle

TILTED = Section(1, "tilted", Plane(np.eye(3), np.zeros(3)), (12.5, 30.0, -45.0), (("A", -30.0), ("C", 12.5)))


def test_blocks_are_numbered_from_0_and_the_frame_names_the_program() -> None:
    text = lines("heidenhain-tnc640", program([step("rapid", X=1.0)]), name="my part-2")
    assert text[:3] == ["0 BEGIN PGM MY_PART_2 MM", "1 ; made by hand", "2 CYCL DEF 247 DATUM SETTING ~"]
    assert text[-1].endswith("END PGM MY_PART_2 MM")
    numbers = [int(m[1]) for m in map(re.compile(r"(\d+) ").match, text) if m]
    assert numbers == list(range(len(numbers)))


def test_numbers_carry_their_sign() -> None:
    made = program([step("rapid", X=10.0, Y=-0.5, Z=0.0), step("feed", X=-0.00001, F=600.0)])
    assert blocks("heidenhain-tnc640", made) == ["L X+10 Y-0.5 Z+0 R0 FMAX", "L X+0 F600"]


def test_fmax_holds_in_its_block_alone_and_the_feed_stays() -> None:
    made = program([step("feed", X=1.0, F=600.0), step("rapid", X=2.0), step("feed", X=3.0, F=600.0), step("rapid", X=4.0),
                    step("feed", X=5.0, F=0.25)])
    assert blocks("heidenhain-tnc640", made) == ["L X+1 R0 F600", "L X+2 FMAX", "L X+3", "L X+4 FMAX", "L X+5 F0.25"]


def test_home_is_m91_in_its_block() -> None:
    made = program([step("rapid", Z=600.0, home=True), step("rapid", Z=50.0)])
    assert blocks("heidenhain-tnc640", made) == ["L Z+600 R0 FMAX M91", "L Z+50 FMAX"]


def test_tool_call_takes_the_speed_that_follows_it() -> None:
    made = program([step("rapid", X=1.0)], {0: [*LOAD, command("SELECT_TOOL", 4.0)]})
    assert blocks("heidenhain-tnc640", made)[:3] == ["TOOL CALL 3 Z S5000", "M3", "TOOL DEF 4"]


def test_another_speed_is_a_tool_call_without_a_tool() -> None:
    made = program([step("rapid", X=1.0)], {0: LOAD, 1: [command("START_SPINDLE_COUNTERCLOCKWISE", 800.0)]})
    assert blocks("heidenhain-tnc640", made)[3:] == ["TOOL CALL S800", "M4"]


def test_compensation_is_taken_up_by_the_next_line() -> None:
    made = program([step("rapid", X=0.0), step("feed", X=1.0, F=100.0), step("feed", X=2.0, F=100.0),
                    step("feed", X=3.0, F=100.0)],
                   {1: [command("CUTTER_COMPENSATION_LEFT", 3.0)], 3: [command("CUTTER_COMPENSATION_OFF")]})
    assert blocks("heidenhain-tnc640", made) == ["L X+0 R0 FMAX", "L X+1 RL F100", "L X+2", "L X+3 R0"]


def test_arcs_have_a_centre_block_and_a_sense() -> None:
    made = program([step("rapid", X=10.0, Y=0.0, Z=5.0), step("ccw", X=0.0, Y=10.0, centre=(-10.0, 0.0, 0.0), F=300.0),
                    step("cw", X=10.0, Y=0.0, centre=(0.0, -10.0, 0.0), F=300.0)])
    assert blocks("heidenhain-tnc640", made)[1:] == ["CC X+0 Y+0", "C X+0 Y+10 DR+ F300", "CC X+0 Y+0", "C X+10 Y+0 DR-"]


def test_arcs_of_other_planes_name_the_axes_of_their_plane() -> None:
    made = program([step("rapid", X=10.0, Y=1.0, Z=0.0),
                    step("ccw", X=0.0, Z=10.0, plane=18, centre=(-10.0, 0.0, 0.0), F=300.0)])
    assert blocks("heidenhain-tnc640", made)[1:] == ["CC X+0 Z+0", "C X+0 Z+10 DR+ F300"]


def test_full_circle_ends_where_it_starts() -> None:
    made = program([step("rapid", X=10.0, Y=0.0), step("cw", X=10.0, Y=0.0, centre=(-10.0, 0.0, 0.0), F=300.0)])
    assert blocks("heidenhain-tnc640", made)[1:] == ["CC X+0 Y+0", "C X+10 Y+0 DR- F300"]


@pytest.mark.parametrize(("kind", "end", "angle"), [("ccw", (0.0, 10.0), "+90"), ("cw", (0.0, 10.0), "-270"),
                                                    ("ccw", (10.0, 0.0), "+360"), ("cw", (10.0, 0.0), "-360")])
def test_helix_goes_by_angle_and_height(kind: str, end: tuple[float, float], angle: str) -> None:
    made = program([step("rapid", X=10.0, Y=0.0, Z=5.0),
                    step(kind, X=end[0], Y=end[1], Z=3.0, centre=(-10.0, 0.0, 0.0), F=300.0)])
    sense = "DR+" if kind == "ccw" else "DR-"
    assert blocks("heidenhain-tnc640", made)[1:] == ["CC X+0 Y+0", f"CP IPA{angle} IZ-2 {sense} F300"]


def test_sweep_is_the_angle_between_the_radii() -> None:
    rng = np.random.default_rng(4)
    for start, turn in zip(rng.uniform(-4.0, 4.0, 40), rng.uniform(0.01, 6.27, 40), strict=True):
        a, b = (np.array([math.cos(v), math.sin(v)]) for v in (start, start + turn))
        assert abs(sweep(a, b, True) - math.degrees(turn)) < 1e-9
        assert abs(sweep(b, a, False) - math.degrees(turn)) < 1e-9


def test_plane_is_spatial_angles_and_reset() -> None:
    made = program([step("rapid", A=-30.0, C=12.5), step("rapid", X=1.0, Y=2.0, Z=50.0)],
                   {0: LOAD, 1: [command("ENTER_SECTION", 1.0)], 2: [command("LEAVE_SECTION", 1.0)]},
                   sections=(Section(0, "axes"), TILTED))
    assert blocks("heidenhain-tnc640", made)[3:] == [
        "PLANE SPATIAL SPA-45 SPB+30 SPC+12.5 TURN FMAX TABLE ROT", "L X+1 Y+2 Z+50 FMAX", "PLANE RESET STAY"]


def test_tcpm_is_entered_and_reset() -> None:
    made = program([step("rapid", A=1.0), step("feed", X=1.0, A=2.0, F=500.0)],
                   {1: [command("ENTER_SECTION", 1.0)], 2: [command("LEAVE_SECTION", 1.0)]},
                   sections=(Section(0, "axes"), Section(1, "tcp")))
    assert blocks("heidenhain-tnc640", made)[1:] == [
        "FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS", "L X+1 A+2 F500", "FUNCTION RESET TCPM"]


def test_safe_start_resets_the_modes_that_are_used() -> None:
    text = lines("heidenhain-tnc640", program([step("rapid", X=0.0)], sections=(Section(0, "axes"), TILTED)))
    assert "option 8" in text[2] and "rotary values of 0" in text[3] and text[4] == "4 PLANE RESET STAY"
    assert not any("TCPM" in line for line in text)


def test_tolerance_cycle_states_both_tolerances() -> None:
    text = lines("heidenhain-tnc640", program([step("rapid", X=0.0)]), smoothing=0.003, axis_smoothing=0.015)
    at = text.index("3 CYCL DEF 32.0 TOLERANCE")
    assert text[at + 1:at + 3] == ["4 CYCL DEF 32.1 T0.003", "5 CYCL DEF 32.2 HSC-MODE:0 TA0.015"]


def test_dwell_is_cycle_9() -> None:
    made = program([step("rapid", X=0.0)], {0: [command("DWELL", 1.5)]})
    assert blocks("heidenhain-tnc640", made)[:2] == ["CYCL DEF 9.0 DWELL TIME", "CYCL DEF 9.1 DWELL 1.5"]


def test_work_offset_is_a_preset() -> None:
    text = lines("heidenhain-tnc640", program([step("rapid", X=0.0)]), work_offset="G55")
    assert text[2:4] == ["2 CYCL DEF 247 DATUM SETTING ~", "Q339=+2 ;DATUM NUMBER"]


VALUES = [("DRILL", {}, 200, {"Q202": "+8", "Q211": "+0"}), ("DRILL", {"dwell": 0.5}, 200, {"Q211": "+0.5"}),
          ("DEEP", {"steps": (3.0,)}, 200, {"Q202": "+3"}), ("BRKCHP", {"steps": (3.0,)}, 203, {"Q202": "+3", "Q213": "+3"}),
          ("REAM", {}, 201, {"Q208": "+200"}), ("BORE", {}, 201, {"Q208": "+200"})]


@pytest.mark.parametrize(("kind", "more", "number", "own"), VALUES)
def test_cycles_are_defined_once_and_called_by_m99(kind: str, more: dict[str, float], number: int,
                                                   own: dict[str, str]) -> None:
    steps, hole = drilled(kind, retract=20.0)
    made = program(steps, holes=(hole,))
    _, text, place = blocks("heidenhain-tnc640", made, (Cycle(kind, 8.0, 2.0, None, 200.0, **more),))
    assert text.startswith(f"CYCL DEF {number} ") and place == "L X+10 Y+20 R0 FMAX M99"
    found = dict(re.findall(r"^(Q\d+)=(\S+)", text, re.MULTILINE))
    wanted = {"Q200": "+2", "Q201": "-8", "Q203": "+0", "Q204": "+20", "Q206": "+200", **own}
    assert {k: found[k] for k in wanted} == wanted
    assert [line.endswith(" ~") for line in text.split("\n")] == [True] * (text.count("\n")) + [False]


@pytest.mark.parametrize(("turning", "key", "pitch"),
                         [("CLOCKWISE", "TAP", "+0.5"), ("COUNTERCLOCKWISE", "TAP_LEFT", "-0.5")])
def test_taps_state_the_pitch(turning: str, key: str, pitch: str) -> None:
    steps, hole = drilled(key, feed=200.0)
    made = program(steps, {0: [command(f"START_SPINDLE_{turning}", 400.0)]}, holes=(hole,))
    text = blocks("heidenhain-tnc640", made, (Cycle("TAP", 8.0, 2.0, 2.0, 200.0),))[-2]
    assert text.startswith("CYCL DEF 207") and f"Q239={pitch} " in text


def test_no_word_of_another_dialect_is_left() -> None:
    steps, hole = drilled("DRILL")
    made = program([*steps, step("feed", X=1.0, F=5.0), step("rapid", Z=600.0, home=True)], {0: LOAD},
                   holes=(hole,))
    text = "\n".join(lines("heidenhain-tnc640", made, cycles=(Cycle("DRILL", 8.0, 2.0, 2.0, 200.0),)))
    assert not re.search(r"\bG\d|\bH\d|%|\(", text)
