"""What a second reading of the controllers found: rules that text and reader had wrong together."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from postproc.pipeline.convert import verify
from tests.postproc.kit import TOOLS, convert, good, toolpath
from tests.postproc.program_kit import LOAD, blocks, command, drilled, lines, program, step
from tests.postproc.reader_kit import FANUC, HAAS, SIEMENS, faults
from toolpaths.toolpath import Cycle

KEPT = "$SC_TOOL_LENGTH_CONST=17\n"
HEAD = "N10 G17 G710 G90 G94 G40 G64\nN20 G54\n"
ARC = "G18 G2 X2 Z0 I1 K0 F100\n"


# ---- Siemens: the tool length follows the plane ------------------------------------------------------------

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


# ---- speeds as S can state them ----------------------------------------------------------------------------

@pytest.mark.parametrize(("controller", "text"), [
    (FANUC, "S1273 M3"), (HAAS, "S1273 M3"), (SIEMENS, "S1273 M3"), ("linuxcnc", "S1273 M3")])
def test_speeds_are_rounded_as_the_control_takes_them(controller: str, text: str) -> None:
    made = program([step("rapid", X=1.0)], {0: [command("START_SPINDLE_CLOCKWISE", 4000.0 / math.pi)]})
    assert text in blocks(controller, made)


def test_speed_of_tool_call_has_three_decimals() -> None:
    made = program([step("rapid", X=1.0)], {0: [LOAD[0], command("START_SPINDLE_CLOCKWISE", 1.2732395)]})
    assert blocks("heidenhain-tnc640", made)[:2] == ["TOOL CALL 3 Z S1.273", "M3"]


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


# ---- texts -------------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("controller", "name"), [
    (FANUC, "(A  B C   D)"), (HAAS, "(A  B C   D)"), ("heidenhain-tnc640", "* - A %b C ; d"), (SIEMENS, "; A~%b C ; d")])
def test_names_of_operations_hold_nothing_that_ends_or_continues_a_block(controller: str, name: str) -> None:
    text = "A()B C % D" if controller in (FANUC, HAAS) else "A~%b C ; d"
    made = program([step("rapid", X=1.0)], {0: [command("OPERATION_START", text)]})
    assert name in blocks(controller, made)


@pytest.mark.parametrize(("seconds", "text"),
                         [(0.00044, "DWELL 0.001"), (0.12345, "DWELL 0.123"), (2.0, "DWELL 2")])
def test_dwells_are_whole_milliseconds_and_none_is_lost(seconds: float, text: str) -> None:
    made = program([step("rapid", X=1.0)], {0: [command("DWELL", seconds)]})
    assert blocks("heidenhain-tnc640", made)[1] == f"CYCL DEF 9.1 {text}"


# ---- what no position shows --------------------------------------------------------------------------------

def taps(between: str) -> str:
    head = "%\nO1\nG21 G17 G90 G94\nG54\nS500 M3\nG0 X0. Y0. Z9.\n"
    return f"{head}{between}G98 G84 X1. Y0. Z-9. R2. F500.\nX2. Y0.\nG80\nM30\n%\n"


@pytest.mark.parametrize(("between", "bad"), [
    ("", True), ("M29 S500\n", False), ("M29 S500\nG0 X1.\n", True),
    ("M29 S500\nG98 G84 X0. Y0. Z-5. R2. F500.\n", False), ("M29 S500\nG98 G84 X0. Y0. Z-5. R2. F500.\nG80\n", True)])
def test_taps_without_m29_are_refused_where_the_control_couples_by_it(between: str, bad: bool) -> None:
    assert ("gcode.rigid_tap" in faults(FANUC, taps(between))) == bad
    assert "gcode.rigid_tap" not in faults(HAAS, taps(between))


def test_a_plane_ends_with_the_length_off() -> None:
    text = ("%\nO1\nG21 G17 G90 G94\nG54\nT1 M6\nG68.2 X0. Y0. Z0. I0. J0. K0.\nG53.1\nG0 G43 H1 X0. Y0. Z9.\n{0}"
            "G69\nM30\n%\n")
    assert faults(FANUC, text.format("G49\n"), on="mikron-ucp710") == {}
    assert "gcode.mode" in faults(FANUC, text.format(""), on="mikron-ucp710")


WAITS = toolpath("GOTO/0,0,0", "STOP", "GOTO/5,0,0", "OPSTOP", "GOTO/9,0,0", "DELAY/1.5", "GOTO/9,5,0", "DELAY/20,REV",
                 "GOTO/9,9,0")


@pytest.mark.covering
@pytest.mark.parametrize("controller", ["linuxcnc", FANUC, HAAS, SIEMENS, "heidenhain-tnc640"])
@pytest.mark.parametrize(("code", "fault"), [
    (r"M0", "verify.stop"), (r"M1", "verify.stop"), (r"(G4 [PF]1\.?5(00)?|CYCL DEF 9\.1 DWELL 1\.5)", "verify.dwell"),
    (r"(G4 [PF]1\.?2(00)?|CYCL DEF 9\.1 DWELL 1\.2)", "verify.dwell")])
def test_stops_and_rests_are_missed(controller: str, code: str, fault: str, tmp_path: Path) -> None:
    text = good(convert(WAITS, "mill-3axis", controller)).text
    kept = [n for n in text.splitlines() if not re.fullmatch(rf"(N?\d+ )?{code}", n)]
    if controller == "heidenhain-tnc640" and "DWELL" in code and fault == "verify.dwell":
        whole = text.splitlines()
        gone = next(k for k, n in enumerate(whole) if re.fullmatch(rf"(N?\d+ )?{code}", n))
        assert whole[gone - 1].endswith("DWELL TIME")
        kept = [*whole[:gone - 1], *whole[gone + 1:]]
    assert len(kept) < len(text.splitlines())
    file = tmp_path / "TEST.nc"
    for lines_, expected in ((text.splitlines(), set()), (kept, {fault})):
        file.write_text("\n".join(lines_) + "\n")
        result = verify(file, WAITS, "mill-3axis", controller, TOOLS)
        assert {d.code for d in result.diagnostics if d.severity.name == "ERROR"} == expected


@pytest.mark.covering
@pytest.mark.parametrize("radius", [0.012, 0.03, 0.1])
@pytest.mark.parametrize("controller", [FANUC, SIEMENS])
def test_chords_of_tiny_arcs_are_not_taken_for_too_fast(controller: str, radius: float) -> None:
    path = toolpath("MULTAX/ON", "GOTO/0,0,0,0,0,1", f"MOVARC/CENTER,{radius},0,0,AXIS,0,0,1,RADIUS,{radius}",
                    f"GOTO/{2.0 * radius},0,0", "GOTO/9,0,0,0.0998334,0,0.9950042")
    result = good(convert(path, "mikron-ucp710", controller, output="tcp"))
    assert "tcp" in {s.law for s in result.program.sections} and result.comparison.tip_bound <= result.options.tolerance


def test_rests_beyond_an_hour_are_several_in_klartext() -> None:
    made = program([step("rapid", X=1.0)], {0: [command("DWELL", 7300.5)]})
    assert [n for n in blocks("heidenhain-tnc640", made) if "9.1" in n] == [
        "CYCL DEF 9.1 DWELL 3600", "CYCL DEF 9.1 DWELL 3600", "CYCL DEF 9.1 DWELL 100.5"]
