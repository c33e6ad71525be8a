"""What a second reading of the controllers found: rules that text and reader had wrong together."""

from __future__ import annotations

import math

import pytest

from tests.postproc.kit import convert, good, toolpath
from tests.postproc.program_kit import LOAD, blocks, command, drilled, lines, program, step
from tests.postproc.reader_kit import FANUC, HAAS, SIEMENS, faults
from toolpaths.toolpath import Cycle

KEPT = "$SC_TOOL_LENGTH_CONST=17\n"
HEAD = "N10 G17 G710 G90 G94 G40 G64\nN20 G54\n"
ARC = "G18 G2 X2 Z0 I1 K0 F100\n"


# ---- Siemens: the tool length follows the plane ---------------------------------------------------------------------

@pytest.mark.parametrize(("text", "bad"), [
    (HEAD + "T1\nM6\nG0 X0 Y0\nD1 Z0\n" + ARC + "M30\n", True),
    (HEAD + KEPT + "T1\nM6\nG0 X0 Y0\nD1 Z0\n" + ARC + "M30\n", False),
    (HEAD + "T1\nM6\nD1\n" + KEPT + "G0 X0 Y0 Z0\n" + ARC + "M30\n", True),
    (HEAD + "$SC_TOOL_LENGTH_CONST=18\nT1\nM6\nG0 X0 Y0\nD1 Z0\n" + ARC + "M30\n", True),
    (HEAD + "G0 X0 Y0 Z0\n" + ARC + "M30\n", False),
    (HEAD + "T1\nM6\nG0 X0 Y0\nD1 Z0\nG17 G2 X2 Y0 I1 J0 F100\nM30\n", False)])
def test_siemens_planes_turn_the_length_unless_it_is_kept_from_the_next_edge_on(text: str, bad: bool) -> None:
    assert ("gcode.tool_length" in faults(SIEMENS, text)) == bad


def test_siemens_unknown_setting_data_are_not_read_over() -> None:
    assert "gcode.unknown_word" in faults(SIEMENS, HEAD + "$SC_TOOL_LENGTH_TYPE=2\nG0 X1\nM30\n")


def test_siemens_states_the_setting_only_for_arcs_that_need_it() -> None:
    for plane, stated in ((17, False), (18, True), (19, True)):
        made = program([step("rapid", X=0.0), step("cw", X=2.0, plane=plane, centre=(1.0, 1.0, 1.0), F=100.0)])
        assert any(KEPT.strip() in n for n in lines(SIEMENS, made)[:3]) == stated


def test_siemens_writes_no_arcs_in_other_planes_under_traori() -> None:
    path = toolpath("GOTO/0,0,0,0,0,1", "MOVARC/CENTER,5,0,0,AXIS,0,1,0,RADIUS,5", "GOTO/10,0,0",
                    "MOVARC/CENTER,10,5,0,AXIS,0,0,1,RADIUS,5", "GOTO/15,5,0", head=["MULTAX/ON", "UNITS/MM", "LOADTL/1",
                    "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"])
    tcp = good(convert(path, "mikron-ucp710", SIEMENS, output="tcp")).text
    axes = good(convert(path, "mikron-ucp710", SIEMENS, output="axes")).text
    assert "G18" in axes and KEPT in axes
    assert "G18" not in tcp and KEPT not in tcp and (" G2 " in tcp or " G3 " in tcp)


# ---- speeds as S can state them ---------------------------------------------------------------------------------------

@pytest.mark.parametrize(("controller", "text"), [
    (FANUC, "S1273 M3"), (HAAS, "S1273 M3"), (SIEMENS, "S1273.2395 M3"), ("linuxcnc", "S1273.239545 M3")])
def test_speeds_are_rounded_as_the_control_takes_them(controller: str, text: str) -> None:
    made = program([step("rapid", X=1.0)], {0: [command("START_SPINDLE_CLOCKWISE", 4000.0 / math.pi)]})
    assert text in blocks(controller, made)


def test_speed_of_tool_call_has_three_decimals() -> None:
    made = program([step("rapid", X=1.0)], {0: [LOAD[0], command("START_SPINDLE_CLOCKWISE", 1273.239545)]})
    assert blocks("heidenhain-tnc640", made)[:2] == ["TOOL CALL 3 Z S1273.24", "M3"]


def test_slow_speeds_are_not_rounded_away() -> None:
    made = program([step("rapid", X=1.0)], {0: [command("START_SPINDLE_CLOCKWISE", 0.3)]})
    assert "S1 M3" in blocks(FANUC, made)


@pytest.mark.parametrize("controller", [FANUC, HAAS])
def test_taps_keep_their_pitch_at_the_rounded_speed(controller: str) -> None:
    steps, hole = drilled("TAP", bottom=-10.0, feed=954.93)
    made = program(steps, {0: [command("START_SPINDLE_CLOCKWISE", 636.62)]}, holes=(hole,))
    text = next(n for n in blocks(controller, made, (Cycle("TAP", 10.0, 2.0, None, 954.93),)) if "G84" in n)
    assert float(text.rsplit("F", 1)[1]) / 637.0 == pytest.approx(1.5, abs=1e-5)


@pytest.mark.parametrize("word", ["S800.5 M3", "S800. M3"])
def test_a_point_in_a_speed_is_refused(word: str) -> None:
    for controller in (FANUC, HAAS):
        text = f"%\nO1\nG21 G17 G90\nG54\n{word}\nG0 X1.\nM30\n%\n"
        assert "gcode.decimal_point" in faults(controller, text)
        assert not faults(controller, text.replace(word, "S800 M3"))


# ---- texts ------------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("controller", "name"), [
    (FANUC, "(A  B C   D)"), (HAAS, "(A  B C   D)"), ("heidenhain-tnc640", "* - A %b C ; d"), (SIEMENS, "; A~%b C ; d")])
def test_names_of_operations_hold_nothing_that_ends_or_continues_a_block(controller: str, name: str) -> None:
    text = "A()B C % D" if controller in (FANUC, HAAS) else "A~%b C ; d"
    made = program([step("rapid", X=1.0)], {0: [command("OPERATION_START", text)]})
    assert name in blocks(controller, made)


@pytest.mark.parametrize(("seconds", "text"), [(0.00044, "DWELL 0.001"), (0.12345, "DWELL 0.123"), (2.0, "DWELL 2")])
def test_dwells_are_whole_milliseconds_and_none_is_lost(seconds: float, text: str) -> None:
    made = program([step("rapid", X=1.0)], {0: [command("DWELL", seconds)]})
    assert blocks("heidenhain-tnc640", made)[1] == f"CYCL DEF 9.1 {text}"
