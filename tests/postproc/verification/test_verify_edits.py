"""Programs of our own, edited in one harmful place: the read-back names what is wrong with each of them."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import pytest

from postproc.pipeline.result import PostResult, VerifyResult
from postproc.report.summary import verify_text
from postproc.verification.read_back import read_back
from tests.postproc.kit import convert, good, sample, toolpath
from toolpaths.diagnostics import Diagnostic, Severity

NAMES = ("linuxcnc", "fanuc-30i", "haas-ngc", "siemens-840d", "heidenhain-tnc640")
PART = """UNITS/MM
LOADTL/1
SPINDL/4000,RPM,CLW
COOLNT/FLOOD
RAPID
GOTO/-50,-60,50
RAPID
GOTO/-50,-60,2
FEDRAT/300,MMPM
GOTO/-50,-60,-5
CUTCOM/LEFT,1
FEDRAT/800,MMPM
GOTO/-45,-40,-5
GOTO/-45,30,-5
CUTCOM/OFF
GOTO/-70,30,-5
RAPID
GOTO/-70,30,50
LOADTL/2
SPINDL/2500,RPM,CLW
RAPID
GOTO/-30,0,50
CYCLE/DRILL,DEPTH,22,MMPM,250,CLEAR,2
GOTO/-30,0,0
GOTO/30,0,0
CYCLE/OFF
RAPID
GOTO/30,0,50
LOADTL/5
SPINDL/400,RPM,CLW
RAPID
GOTO/-30,0,50
CYCLE/TAP,DEPTH,18,MMPR,1.5,CLEAR,5
GOTO/-30,0,0
GOTO/30,0,0
CYCLE/OFF
RAPID
GOTO/30,0,50
SPINDL/OFF
COOLNT/OFF""".splitlines()


@cache
def part(controller: str) -> PostResult:
    return good(convert(toolpath(*PART, head=[]), "mill-3axis", controller))


def found(result: PostResult, old: str, new: str, at: int = 0, gcode: str = "") -> list[Diagnostic]:
    """What is found where the text `old`, after `at` others of it, is written as `new`."""
    before, *after = result.text.split(old)
    assert len(after) > at, (old, result.text)
    text = old.join([before, *after[:at]]) + new + old.join(after[at:])
    assert result.job is not None
    return read_back(text.encode(), result.job, "part.apt", gcode=gcode)[1]


def codes(diagnostics: list[Diagnostic], severity: Severity = Severity.ERROR) -> list[str]:
    return [d.code for d in diagnostics if d.severity is severity]


@pytest.mark.parametrize("controller", NAMES)
def test_a_program_of_our_own_has_nothing_to_be_reported(controller: str) -> None:
    result = part(controller)
    assert result.job is not None
    assert [d for d in read_back(result.text.encode(), result.job, "part.apt")[1] if d.severity is not Severity.INFO] == []


@pytest.mark.covering
@pytest.mark.parametrize(("controller", "old", "new"), [
    ("linuxcnc", "R5 F600", "R5 F500"), ("fanuc-30i", "R5. F600.", "R5. F500."), ("haas-ngc", "R5. F600.", "R5. F500."),
    ("linuxcnc", "G84", "G74"), ("fanuc-30i", "G84", "G74"), ("haas-ngc", "G84", "G74"),
    ("linuxcnc", "G84", "G85"), ("fanuc-30i", "R5. F600.", "R5. F700."),
    ("siemens-840d", ",,1.5,", ",,1.25,"), ("siemens-840d", ",,1.5,", ",,-1.5,"),
    ("siemens-840d", ",,1.5,0,400,400", ",,3,0,200,200"),
    ("heidenhain-tnc640", "Q239=+1.5", "Q239=+1.25"), ("heidenhain-tnc640", "Q239=+1.5", "Q239=-1.5"),
    ("heidenhain-tnc640", "Q239=+1.5", "Q239=+1.75"),
    ("heidenhain-tnc640", "207 RIGID TAPPING ~", "206 TAPPING ~\nQ206=+600 ;FEED ~\nQ211=+0 ;DWELL ~")])
def test_taps_keep_their_pitch_hand_and_kind(controller: str, old: str, new: str) -> None:
    result = part(controller)
    if "206 TAPPING" in new:  # which has no pitch
        result = replace(result, text=re.sub(r"Q239=[^\n]*\n", "", result.text))
    assert "verify.tap" in codes(found(result, old, new))


def test_taps_that_lose_what_couples_them_are_refused() -> None:
    assert "gcode.rigid_tap" in codes(found(part("fanuc-30i"), "M29 S400\n", ""))
    assert "gcode.cycle" in codes(found(part("heidenhain-tnc640"), "CYCL DEF 207", "CYCL DEF 206"))


CHANGES = {"linuxcnc": ("G53 G0 Z400\n", "M5\n", "M9\n"), "fanuc-30i": ("G53 G0 G49 Z400.\n", "M5\n", "M9\n"),
           "haas-ngc": ("G53 G0 G49 Z400.\n", "M5\n", "M9\n"), "siemens-840d": ("SUPA G0 D0 Z400\n", "M5\n", "M9\n"),
           "heidenhain-tnc640": ("L Z+400 FMAX M91\n", "M5\n", "M9\n")}


@pytest.mark.parametrize("controller", NAMES)
def test_tools_change_at_home_with_spindle_and_coolant_off(controller: str) -> None:
    home, stop, dry = CHANGES[controller]
    for old, at, what in ((home, 1, "away from home"), (stop, 0, "spindle turns"), (dry, 0, "coolant flows")):
        noted = [d for d in found(part(controller), old, "\n", at) if d.severity is Severity.ERROR]
        assert noted and noted[0].code == "verify.tool_change" and what in noted[0].message


@pytest.mark.parametrize(("at", "severity"), [(0, Severity.WARNING), (1, Severity.ERROR)])
@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc", "generic-iso"])
def test_a_length_cancelled_before_home_asks_for_the_setting(controller: str, at: int, severity: Severity) -> None:
    """The block that goes home before a tool change cancels the length (at 0 nobody knows whether one is in force); before
    it the tool may move down by the length. The machine file, or the header of the program, may say that it does not."""
    result, home = part(controller), "G53 G0 G49 Z400.\n"
    noted = [d for d in found(result, home, "G49\nG53 G0 Z400.\n", at) if d.code == "verify.length_alone"]
    setting = result.controller.tools.length_alone
    assert [(d.severity, setting in d.message) for d in noted] == [(severity, True)] and ("5006#6" in setting) == (
        controller == "fanuc-30i")
    said = replace(result, text=re.sub(r"(?i)\n\(source", f"\n(NEEDS {setting.upper()})\\g<0>", result.text, count=1))
    assert not [d for d in found(said, home, "G49\nG53 G0 Z400.\n", at) if d.code == "verify.length_alone"]


@pytest.mark.parametrize("controller", ["fanuc-30i", "siemens-840d", "heidenhain-tnc640", "haas-ngc"])
def test_tools_change_at_home_in_tilted_programs_too(controller: str) -> None:
    result = sample("five_faces.cls", "mikron-ucp710", controller)
    rows = result.text.splitlines()
    change = [i for i, row in enumerate(rows) if "M6" in row or "TOOL CALL" in row]
    if len(change) < 2:
        pytest.fail("the sample changes its tool once only")
    lift = max(i for i in range(change[1]) if any(w in rows[i] for w in ("G53", "SUPA", "M91")) and "Z" in rows[i])
    text = "\n".join([*rows[:lift], *rows[lift + 1:]]) + "\n"
    assert result.job is not None
    assert "verify.tool_change" in codes(read_back(text.encode(), result.job, "f.cls")[1])


@pytest.mark.parametrize("controller", ["linuxcnc", "fanuc-30i", "haas-ngc"])
def test_the_register_of_cutter_compensation_is_that_of_cutcom(controller: str) -> None:
    noted = [d for d in found(part(controller), "G41 D1", "G41 D2") if d.severity is Severity.ERROR]
    assert [d.code for d in noted] == ["verify.state"] and "is 2, it should be 1" in noted[0].message


@pytest.mark.parametrize(("controller", "old", "new"), [
    ("linuxcnc", "G81 X-30 Y0", "G82 P0.5 X-30 Y0"), ("fanuc-30i", "G81 X-30. Y0.", "G82 P500 X-30. Y0."),
    ("haas-ngc", "G81 X-30. Y0.", "G82 P500 X-30. Y0."), ("siemens-840d", "CYCLE81(2,0,2,-22)", "CYCLE82(2,0,2,-22,,0.5)"),
    ("heidenhain-tnc640", "Q211=+0 ", "Q211=+0.5 ")])
def test_rests_in_holes_are_those_of_the_cl_file(controller: str, old: str, new: str) -> None:
    assert "verify.hole" in codes(found(part(controller), old, new))


def test_a_rest_added_to_pecks_is_found() -> None:
    result = sample("pocket.cls", "mill-3axis", "fanuc-30i")
    assert "verify.hole" in codes(found(result, "Q4. F180.", "Q4. P800 F180."))


@pytest.mark.parametrize(("controller", "old", "new"), [
    ("linuxcnc", "Y30\n", "Y30\nM0\n"), ("fanuc-30i", "Y30.\n", "Y30.\nM0\n"), ("haas-ngc", "Y30.\n", "Y30.\nM1\n"),
    ("siemens-840d", "Y30\n", "Y30\nM0\n"), ("heidenhain-tnc640", "L Y+30\n", "L Y+30\nSTOP\n")])
def test_stops_that_are_added_are_reported(controller: str, old: str, new: str) -> None:
    assert "verify.stop" in codes(found(part(controller), old, new), Severity.WARNING)


@pytest.mark.parametrize("controller", NAMES)
def test_feeds_cut_to_a_quarter_are_reported_once(controller: str) -> None:
    noted = [d for d in found(part(controller), "F800", "F200") if d.code == "verify.slow"]
    assert len(noted) == 1 and noted[0].severity is Severity.ERROR and noted[0].count == 3 and "0.25" in noted[0].message


def test_the_first_line_names_the_cause() -> None:
    result = part("fanuc-30i")
    register, tool = found(result, "G43 H2", "G43 H5"), found(result, "T5 M6", "T4 M6")
    assert "length register 5 is taken, it should be 2" in register[0].message
    assert "tool 4 is taken, it should be 5" in tool[0].message


def test_messages_speak_the_words_of_the_control() -> None:
    tnc = part("heidenhain-tnc640")
    assert any("right (RR)" in d.message for d in found(tnc, " RL ", " RR "))
    assert any("datum 2" in d.message for d in found(tnc, "Q339=+1 ", "Q339=+2 "))
    smooth = [d for d in found(tnc, "32.1 T0.003", "32.1 T0.5") if d.code == "verify.smoothing"]
    assert smooth and "32.1" in smooth[0].hint


def test_corrections_of_the_header_are_asked_for_first() -> None:
    noted = found(part("linuxcnc"), "(feed mode auto)",
                  "(geometric errors E: corrected in this program; not by the control)",
                  gcode="p.ngc")
    assert noted[0].code == "verify.error_model" and codes(noted) == ["verify.error_model"]


def test_unknown_codes_name_file_line_and_way_out() -> None:
    noted = [d for d in found(part("fanuc-30i"), "M29 S400", "M88\nM29 S400") if d.code == "gcode.unknown_code"]
    assert noted[0].file == "test.apt" and "of the program" in noted[0].message and "program.passive" in noted[0].hint


def test_a_program_that_is_not_proved_has_no_deviation_to_show() -> None:
    result = part("fanuc-30i")
    assert result.job is not None
    comparison, noted = read_back(result.text.replace("F800.", "F1600.").encode(), result.job, "part.apt")
    text = verify_text(VerifyResult("p.nc", comparison, tuple(noted)))
    assert text.startswith("NOT proved") and "tip" not in text
