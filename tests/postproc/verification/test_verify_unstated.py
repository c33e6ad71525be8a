"""What a program must state by itself: modal codes, where the tool stands, feeds of the CL file, Klartext in order."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from postproc.pipeline.result import PostResult
from postproc.verification.read_back import read_back
from tests.postproc.kit import convert, good, sample, shop_file, toolpath
from tests.postproc.reader_kit import FANUC, HAAS, SIEMENS, TNC
from toolpaths.diagnostics import Diagnostic, Severity

LINUXCNC, ISO = "linuxcnc", "generic-iso"
ALL = (FANUC, SIEMENS, TNC, HAAS, LINUXCNC, ISO)
WORDED = (FANUC, SIEMENS, HAAS, LINUXCNC, ISO)
"""controls with modal codes for what Klartext has in every block"""


def errors(result: PostResult, text: str) -> list[Diagnostic]:
    assert result.job is not None
    found = read_back(text.encode(), result.job, "f.cls", gcode="f.nc")[1]
    return [d for d in found if d.severity is Severity.ERROR]


def caught(result: PostResult, text: str) -> set[str]:
    assert text != result.text
    return {d.code for d in errors(result, text)}


@cache
def pocket(controller: str) -> PostResult:
    return sample("pocket.cls", "mill-3axis", controller)


@pytest.mark.parametrize("controller", ALL)
def test_programs_as_written_state_everything(controller: str) -> None:
    assert not errors(pocket(controller), pocket(controller).text)


@pytest.mark.covering
@pytest.mark.parametrize("controller", WORDED)
@pytest.mark.parametrize(("codes", "named"), [
    ("G17", "G17"), ("G90", "G90"), ("G94", "G94"), ("G40", "G40"), ("G54", "work offset"), ("G98|G99", "G98"),
    ("G91.1", "G91.1")])
def test_a_program_without_a_modal_code_names_it(controller: str, codes: str, named: str) -> None:
    """Left out wherever it stands: the state is a parameter, or what the program before has left."""
    result = pocket(controller)
    text = re.sub(rf"\b({codes})(?![.\d]) ?", "", result.text)
    if text == result.text:
        assert (codes == "G98|G99" and controller == SIEMENS) or (codes == "G91.1" and controller != LINUXCNC)
        return
    found = [d for d in errors(result, text) if d.code == "gcode.unstated"]
    if codes == "G91.1" or found:
        assert any(named in d.message for d in found)
        assert all(d.lines and d.hint for d in found)
    else:
        assert errors(result, text)


def test_the_controller_file_may_say_what_the_control_itself_states(tmp_path: Path) -> None:
    """Following the hint: [start] codes."""
    file = shop_file(tmp_path, '[start]\ncodes = ["G17", "G94"]\n', FANUC)
    result = good(convert(toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,5", "GOTO/9,0,5"), "mill-3axis", file))
    text = re.sub(r"G(17|94) ", "", result.text)
    assert text != result.text and not errors(result, text)
    assert "gcode.unstated" in caught(result, re.sub(r"G(17|94|90) ", "", result.text))


@pytest.mark.parametrize("controller", ALL)
def test_a_start_from_an_unknown_pose(controller: str) -> None:
    """Without the first block, which lifts the tool in machine coordinates, and with it in the coordinates of the part."""
    result = pocket(controller)
    lines = result.text.splitlines()
    code = r"\b(G53|SUPA|M91)\b"
    first = next(i for i, line in enumerate(lines) if re.search(code, line))
    if controller == TNC:
        lines.insert(first, "900 L R0")
        first += 1
    assert "verify.start" in caught(result, "\n".join(lines[:first] + lines[first + 1:]) + "\n")
    plain = [*lines[:first], re.sub(rf" ?{code}", "", lines[first]), *lines[first + 1:]]
    assert caught(result, "\n".join(plain) + "\n") & {"verify.start", "gcode.unstated"}, "a TNC: no length before TOOL CALL"


def test_an_axis_that_is_never_stated_before_the_tool_comes_down() -> None:
    """The first move over the part leaves Y where it stands: the next block states it too late."""
    result = good(convert(toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,5", "GOTO/9,0,5"), "mill-3axis", FANUC))
    block = next(line for line in result.text.splitlines() if re.fullmatch(r"(G0 )?X0\. Y0\.", line))
    assert "verify.start" in caught(result, result.text.replace(block, block.replace(" Y0.", ""), 1))


def test_a_program_that_is_left_in_the_part() -> None:
    result = pocket(FANUC)
    lines = result.text.splitlines()
    last = max(i for i, line in enumerate(lines) if re.match(r"G53 G0 (G49 )?Z", line))
    assert "verify.end" in caught(result, "\n".join(lines[:last] + lines[last + 2:]) + "\n")


@pytest.mark.covering
@pytest.mark.parametrize("controller", ALL)
@pytest.mark.parametrize("share", [0.995, 0.97, 0.7])
def test_feeds_that_are_a_little_too_low(controller: str, share: float) -> None:
    """One F word of a straight cut."""
    result = pocket(controller)
    words = [w for w in re.finditer(r"(?<= F)\d+(?=[.\s])", result.text) if int(w[0]) < 2000]
    word = words[len(words) // 2]
    low = f"{float(word[0]) * share:.3f}".rstrip("0")
    text = result.text[:word.start()] + low + result.text[word.end():].removeprefix(".")
    assert "verify.slow" in caught(result, text)


def test_planned_feeds_count_only_as_they_were_written() -> None:
    result = good(convert(toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,5", "FEDRAT/MMPM,900", "GOTO/9,0,5", "GOTO/9,9,5"),
                          "mill-3axis", FANUC, feed="planned"))
    assert "FINGERPRINT OF THE PLANNED FEEDS" in result.text and not errors(result, result.text)
    word = re.search(r"F(\d+)\.", result.text[result.text.index("G1"):])
    assert word
    assert "verify.slow" in caught(result, result.text.replace(word[0], f"F{0.9 * float(word[1]):.0f}."))
    assert "verify.slow" in caught(result, re.sub(r"\(FINGERPRINT OF THE PLANNED.*\n", "", result.text))


# ---- Klartext ----------------------------------------------------------------------------------------------


def drilled() -> PostResult:
    return good(convert(toolpath("RAPID", "GOTO/0,0,50", "DELAY/2", "CYCLE/DRILL,DEPTH,12,RAPTO,3,RTRCTO,20,MMPM,100",
                                 "GOTO/10,0,0", "GOTO/20,0,0", "CYCLE/OFF"), "mill-3axis", TNC))


@pytest.mark.parametrize("part", ["32.0", "32.1", "9.0", "9.1"])
def test_a_cycle_of_which_a_part_is_missing(part: str) -> None:
    result = drilled()
    text = re.sub(rf"(?m)^\d+ CYCL DEF {part}.*\n", "", result.text)
    assert caught(result, text) & {"gcode.cycle", "verify.smoothing"} == {"gcode.cycle"}


@pytest.mark.parametrize("name", ["Q200", "Q201", "Q206", "Q202", "Q210", "Q203", "Q204", "Q211"])
def test_a_cycle_without_one_of_its_parameters(name: str) -> None:
    result = drilled()
    assert "gcode.cycle" in caught(result, re.sub(rf"(?m)^{name}=.*\n", "", result.text))


def test_a_cycle_that_runs_on_into_the_next_block() -> None:
    result = drilled()
    assert "gcode.syntax" in caught(result, re.sub(r"(?m)^Q395=.*\n", "", result.text))


def test_a_preset_without_its_number() -> None:
    result = drilled()
    assert caught(result, re.sub(r"(?m)^Q339=.*\n", "", result.text))


@pytest.mark.parametrize("block", ["TOOL CALL S900", "CYCL DEF 32.0 TOLERANCE\n90 CYCL DEF 32.1 T0.003", "PLANE RESET STAY",
                                   "FUNCTION RESET TCPM", "M129"])
def test_radius_compensation_stands_through_what_must_not_see_it(block: str) -> None:
    result = good(convert(toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,5", "CUTCOM/LEFT", "GOTO/9,0,5", "GOTO/9,9,5",
                                   "GOTO/0,9,5", "CUTCOM/OFF", "GOTO/0,0,5"), "mill-3axis", TNC))
    lines = result.text.splitlines()
    on = next(i for i, line in enumerate(lines) if " RL" in line)
    spoilt = "\n".join([*lines[:on + 1], f"900 {block}", *lines[on + 1:]]) + "\n"
    assert "gcode.compensation" in caught(result, spoilt)
    before = "\n".join([*lines[:on], f"900 {block}", *lines[on:]]) + "\n"
    assert "gcode.compensation" not in caught(result, before)


@pytest.mark.parametrize("controller", [FANUC, TNC])
def test_compensation_that_is_left_on_for_a_rapid(controller: str) -> None:
    result = good(convert(toolpath("RAPID", "GOTO/0,0,50", "GOTO/0,0,5", "CUTCOM/LEFT,1", "GOTO/9,0,5", "GOTO/9,9,5",
                                   "CUTCOM/OFF", "GOTO/0,9,5", "RAPID", "GOTO/0,9,50"), "mill-3axis", controller))
    code = r"\n(\d+ )?G40\n" if controller == FANUC else r" R0(?= F| X| Y|\n)"
    on = result.text.index("G41" if controller == FANUC else " RL")
    at = next(m for m in re.finditer(code, result.text) if m.start() > on)
    text = result.text[:at.start()] + ("\n" if controller == FANUC else "") + result.text[at.end():]
    assert "verify.state" in caught(result, text)


def test_a_work_offset_that_traori_may_have_lost_is_stated_again() -> None:
    """The reader kept it: a program without it was proved, though the control may drop its frames."""
    first, then = "0,0.17513,0.9845447", "0.05,0.3420201433257,0.9383616"
    result = good(convert(toolpath("LOADTL/1", "SPINDL/900,RPM,CLW", "RAPID", f"GOTO/5,0,50,{first}", "FEDRAT/500,MMPM",
                                   f"GOTO/5,0,5,{first}", f"GOTO/9,0,5,{then}", "RAPID", f"GOTO/9,20,50,{then}"),
                          "mikron-ucp710", SIEMENS, output="tcp"))
    text, count = re.subn(r"(TRAORI\n)(?:N\d+ )?G54\n", r"\1", result.text)
    assert count == 1 and [d.code for d in errors(result, text)] == ["gcode.unstated"]
    assert not errors(result, re.sub(r"(TRAORI)\n(?:N\d+ )?G54\n", r"\1 G54\n", result.text))
