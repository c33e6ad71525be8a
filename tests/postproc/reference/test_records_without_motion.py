"""Records without motion: what cannot be carried out is said at its line, what can is written once and read back."""

from __future__ import annotations

import re

import numpy as np
import pytest

import toolpaths
from postproc.pipeline.result import PostResult
from tests.postproc.kit import body, codes, convert, good, toolpath
from toolpaths.diagnostics import Severity, has_errors

HEAD = ["UNITS/MM", "LOADTL/1", "FEDRAT/MMPM,600"]
CUT = ["RAPID", "GOTO/0,0,5", "GOTO/9,0,5"]


def made(*lines: str, head: list[str] | None = None, name: str = "mill-3axis",
         **options: object) -> PostResult:
    return convert(toolpath(*lines, head=HEAD if head is None else head), name, **options)


def refused(result: PostResult, code: str) -> int:
    """The line of the only kind of error there is."""
    errors = [d for d in result.diagnostics if d.severity is Severity.ERROR]
    assert {d.code for d in errors} == {code} and not result.text, [str(d) for d in result.diagnostics]
    return errors[0].lines[0]


def holes(record: str, *before: str) -> PostResult:
    return made("SPINDL/RPM,600,CLW", *before, "RAPID", "GOTO/0,0,50", f"CYCLE/{record}", "GOTO/10,0,0", "GOTO/20,0,0",
                "CYCLE/OFF", "RAPID", "GOTO/20,0,50")


# ---- cycles ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["REVERS", "SHIFT", "BORE7", "BORE8", "BORE9", "MILL", "CIRCUL", "THREAD"])
def test_a_cycle_that_the_controller_lacks_is_no_plain_drilling(kind: str) -> None:
    assert refused(holes(f"{kind},DEPTH,5,MMPM,100,CLEAR,3"), "cycle.not_native") == 8


@pytest.mark.parametrize("kind", ["DRILL", "THRU", "FACE", "DEEP,STEP,2", "BRKCHP,STEP,2", "BORE", "REAM"])
def test_these_may_be_single_moves(kind: str) -> None:
    assert good(holes(f"{kind},DEPTH,5,MMPM,100,RAPTO,3,RTRCTO,20"))


def test_taps_of_both_hands_and_none_without_a_turning_spindle() -> None:
    """LinuxCNC stops G84 under M4 and G74 under M3."""
    assert refused(holes("TAP,DEPTH,5,MMPM,100,CLEAR,3", "SPINDL/OFF"), "spindle.stopped") == 9
    right, left = (good(holes("TAP,DEPTH,5,MMPM,100,CLEAR,3", f"SPINDL/RPM,600,{turn}")).text for turn in ("CLW", "CCLW"))
    assert "G84" in right and "G74" not in right
    assert "G74" in left and "G84" not in left


def test_dwell_in_revolutions_is_written_in_seconds() -> None:
    """600 rev/min: 15 revolutions take 1.5 s; as a canned cycle and as single moves."""
    assert "G82 X10 Y0 Z-5 R3 P1.5 F100" in good(holes("DRILL,DEPTH,5,MMPM,100,CLEAR,3,DWELL,15,REV")).text
    single = body(good(holes("DRILL,DEPTH,5,MMPM,100,RAPTO,3,RTRCTO,60,DWELL,15,REV")).text)
    at = single.index("G1 Z-5 F100")
    assert single[at + 1:at + 3] == ["G4 P1.5", "G0 Z60"]
    found = holes("DRILL,DEPTH,5,MMPM,100,CLEAR,3,DWELL,15,REV", "SPINDL/OFF").diagnostics
    assert [d.lines[0] for d in found if d.code == "cycle.dwell"] == [8]


# ---- spindle -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("record", "want"), [
    ("RANGE,2,RPM,3000,CLW", "S3000 M3"), ("3000,RPM,CLW,RANGE,2", "S3000 M3"), ("3000,CCLW", "S3000 M4"),
    ("RPM,3000,CLW", "S3000 M3"), ("RPM,3000,CLW,LOW", "S3000 M3")])
def test_the_speed_is_the_number_after_rpm(record: str, want: str) -> None:
    result = good(made(f"SPINDL/{record}", *CUT))
    assert want in body(result.text)
    assert ("spindle.range" in codes(result.diagnostics)) == ("RANGE" in record or "LOW" in record)


@pytest.mark.parametrize(("record", "code"), [
    ("LOCK", "spindle.word"), ("ORIENT,90", "spindle.word"), ("RPM,3000,CLW,MAXRPM,2000", "spindle.limit"),
    ("RPM,0,CLW", "spindle.speed"), ("RPM,-100,CLW", "spindle.speed")])
def test_spindle_records_that_cannot_be_carried_out(record: str, code: str) -> None:
    assert refused(made(f"SPINDL/{record}", *CUT), code) == 4


def test_neutral_stops_the_spindle() -> None:
    result = good(made("SPINDL/RPM,500,CLW", *CUT, "SPINDL/NEUTRL", "RAPID", "GOTO/9,0,50"))
    assert "spindle.neutral" in codes(result.diagnostics) and "M5" in body(result.text)


@pytest.mark.parametrize(("lines", "code", "line"), [
    (["SPINDL/RPM,0", "DELAY/10,REV"], "spindle.speed", 4), (["DELAY/10,REV"], "delay.revolutions", 4),
    (["SPINDL/RPM,500,CLW", "SPINDL/OFF", "DELAY/10,REV"], "delay.revolutions", 6), (["DELAY/-1"], "delay.value", 4)])
def test_delays_that_have_no_time(lines: list[str], code: str, line: int) -> None:
    errors = [d for d in made(*lines, *CUT).diagnostics if d.severity is Severity.ERROR]
    assert [d.lines[0] for d in errors if d.code == code] == [line]


@pytest.mark.parametrize("record", ["RETRCT", "RETRCT/TOOL", "RETRCT/20"])
def test_a_retract_that_is_not_carried_out_is_no_reason_to_cut_across(record: str) -> None:
    assert refused(made("SPINDL/RPM,500,CLW", *CUT, record, "GOTO/9,9,0"), "retract.motion") == 4 + len(CUT) + 1


@pytest.mark.parametrize("after", [["RETRCT/OFF", "GOTO/9,9,0"], ["RETRCT"], ["RETRCT", "GOHOME"],
                                   ["RETRCT", "LOADTL/2", "RAPID", "GOTO/9,9,50"]])
def test_a_retract_that_nothing_is_cut_after_is_reported(after: list[str]) -> None:
    result = good(made("SPINDL/RPM,500,CLW", *CUT, *after))
    assert "event.not_carried_out" in codes(result.diagnostics)


# ---- tools -------------------------------------------------------------------------------------------------

NX = ["UNITS/MM", "FEDRAT/MMPM,600", "SPINDL/RPM,1000,CLW"]


def tool(name: str, size: float, number: int = 0) -> list[str]:
    return [f"TPRINT/{name}", f"TLDATA/MILL,{size},0,75,0,0", f"LOAD/TOOL,{number}"]


def test_different_tools_under_one_number_are_refused() -> None:
    result = made(*tool("EM10", 10.0, 4), *CUT, "RAPID", "GOTO/9,0,50", *tool("EM6", 6.0, 4), *CUT, head=NX)
    errors = [d for d in result.diagnostics if d.code == "tool.same_number"]
    assert len(errors) == 1 and "lines 9 and 17" in errors[0].hint and not result.text, [str(d) for d in result.diagnostics]


@pytest.mark.parametrize("load", [True, False])
def test_one_tool_without_a_number_is_refused(load: bool) -> None:
    lines = tool("EM10", 10.0)[:None if load else 2]
    assert refused(made(*lines, *CUT, "RAPID", "GOTO/9,0,50", *lines, *CUT, head=NX), "tool.number")


def test_the_same_tool_again_with_another_length_register() -> None:
    result = good(made("SPINDL/RPM,500,CLW", *CUT, "RAPID", "GOTO/9,0,50", "LOAD/TOOL,1,ADJUST,21", *CUT))
    blocks = body(result.text)
    assert blocks.count("G43 H21") == 1 and sum("M6" in b for b in blocks) == 1
    assert result.job is not None and result.job.register_lengths() == {1: 120.0, 21: 120.0}


# ---- text put in -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("record", "block"), [
    ("AUXFUN/8", "M8"), ("INSERT/M8", "M8"), ("INSERT/S100", "S100 M3"), ("INSERT/S100 M4", "S100 M4"),
    ("INSERT/M0", "M0"), ("AUXFUN/1", "M1"), ("INSERT/(BY HAND)", "(BY HAND)"), ("AUXFUN/7", "M7")])
def test_switches_put_in_as_text_count_as_records(record: str, block: str) -> None:
    result = good(made("SPINDL/RPM,500,CLW", *CUT, record, "GOTO/20,0,5", "GOTO/30,0,5"))
    lines = result.text.splitlines()
    assert block in lines[lines.index("G1 X9 F600"):]


def test_a_stop_of_the_spindle_put_in_as_text_counts_as_a_record() -> None:
    result = good(made("SPINDL/RPM,500,CLW", *CUT, "INSERT/M5", "RAPID", "GOTO/20,0,5"))
    assert "M5" in body(result.text)
    assert refused(made("SPINDL/RPM,500,CLW", *CUT, "INSERT/M5", "GOTO/20,0,5"), "spindle.stopped") == 9


@pytest.mark.parametrize("record", ["INSERT/M2", "INSERT/M30", "INSERT/%", "INSERT/M6", "INSERT/G91", "INSERT/F100",
                                    "INSERT/H3", "INSERT/T4", "PREFUN/90", "AUXFUN/30", "INSERT/TURN THE PART OVER",
                                    "AUXFUN/19", "INSERT/M8 G0 X1"])
def test_text_that_the_post_writes_itself_is_refused(record: str) -> None:
    assert refused(made("SPINDL/RPM,500,CLW", *CUT, record, "GOTO/20,0,5"), "insert.refused") == 8


def test_a_speed_alone_does_not_start_the_spindle() -> None:
    assert refused(made(*CUT[:2], "INSERT/S100", "GOTO/20,0,5"), "insert.refused") == 6


# ---- coolant, compensation, states -------------------------------------------------------------------------


@pytest.mark.parametrize(("word", "code"), [("THRU", "coolant.through"), ("AIR", "coolant.air"), ("TAP", "coolant.word"),
                                            ("STEAM", "coolant.word")])
def test_coolant_that_the_controller_lacks_is_reported(word: str, code: str) -> None:
    result = good(made("SPINDL/RPM,500,CLW", f"COOLNT/{word}", *CUT))
    assert code in codes(result.diagnostics) and ("M7" if word == "AIR" else "M8") in body(result.text)


def test_compensation_records_that_cannot_be_carried_out() -> None:
    assert refused(made("SPINDL/RPM,500,CLW", *CUT, "CUTCOM/LEFT,ZXPLAN", "GOTO/20,0,5"), "cutcom.plane") == 8
    for word in ("ON", "NORMDS"):
        result = good(made("SPINDL/RPM,500,CLW", *CUT, f"CUTCOM/{word}", "GOTO/20,0,5"))
        assert "cutcom.word" in codes(result.diagnostics) and not re.search("G4[12]", result.text)


def compensated(*lines: str) -> PostResult:
    return made("SPINDL/RPM,500,CLW", *CUT, "CUTCOM/LEFT,1", "GOTO/20,0,5", "GOTO/20,20,5", *lines)


@pytest.mark.parametrize("lines", [[], ["GOHOME"], ["CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/30,0,0", "CYCLE/OFF"],
                                   ["LOADTL/2", "SPINDL/RPM,500,CLW", *CUT]])
def test_compensation_ends_before_links_holes_and_tool_changes(lines: list[str]) -> None:
    blocks = body(good(compensated(*lines)).text)
    on = False
    for block in blocks:
        on = True if "G41" in block else False if "G40" in block else on
        assert not (on and re.search(r"G53|G8[0-9]|M6", block)), block
    assert sum("G41" in b for b in blocks) == sum("G40" in b for b in blocks) == 1


def test_cutting_on_after_compensation_had_to_end_is_refused() -> None:
    lines = ["CYCLE/DRILL,DEPTH,5,MMPM,100,CLEAR,3", "GOTO/30,0,0", "CYCLE/OFF", "GOTO/40,0,5", "GOTO/50,0,5"]
    assert refused(compensated(*lines), "cutcom.left_on") == 14


def test_states_are_written_where_they_change() -> None:
    lines = ["SPINDL/RPM,500,CLW", "COOLNT/FLOOD", *CUT, "COOLNT/FLOOD", "SPINDL/RPM,500,CLW", "GOTO/20,0,5", "COOLNT/OFF",
             "SPINDL/OFF", "RAPID", "GOTO/20,0,50", "LOADTL/2", "SPINDL/RPM,500,CLW", "COOLNT/ON", *CUT, "RAPID",
             "GOTO/0,0,50", "LOADTL/3", *CUT]
    blocks = [b for b in body(good(made(*lines)).text) if re.search(r"\bM\d|S\d", b)]
    assert blocks == ["T1 M6", "S500 M3", "M8", "M9", "M5", "T2 M6", "S500 M3", "M8", "M5", "M9", "T3 M6", "S500 M3", "M8"]


def test_feeds_of_a_control_that_runs_the_tip_are_those_of_the_file() -> None:
    """Words of 4 decimals in steps of 1.3 mm: F stays what the file says, no 1500.1347."""
    rng = np.random.default_rng(5)
    tips = np.cumsum(rng.uniform(0.5, 1.5, (60, 3)), axis=0)
    angle = np.radians(np.linspace(5, 15, 60))
    axes = np.column_stack([np.sin(angle), np.zeros(60), np.cos(angle)])
    points = [f"GOTO/{','.join(f'{v:.9f}' for v in row)}" for row in np.hstack([tips, axes])]
    result = good(made("SPINDL/RPM,500,CLW", "FEDRAT/MMPM,1500", "RAPID", *points, name="linuxcnc-xyzac-trt"))
    assert set(re.findall(r"F[\d.]+", "\n".join(body(result.text)))) == {"F1500"}


# ---- reading -----------------------------------------------------------------------------------------------


def test_a_path_that_was_read_with_errors_is_not_converted() -> None:
    path, found = toolpaths.read_bytes("UNITS/MM\nLOADTL/1\nFEDRAT/MMPM,600\nRAPID\nGOTO/0,0,5\nWIGGLE/1,2,3\nGOTO/1,0,5\n")
    assert has_errors(found)
    result = convert(path, "mill-3axis")
    assert not result.ok and not result.text
    assert [d for d in result.diagnostics if d.severity is Severity.ERROR] == [
        d for d in found if d.severity is Severity.ERROR]
