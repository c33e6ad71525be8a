"""The control's own smoothing by operation: levels and tolerances of the set-up, switched where each operation begins."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import machines
import postproc
from postproc.pipeline.convert import verify
from postproc.setup.model import SetupFile
from postproc.verification.read_back import read_back
from tests.postproc.kit import codes, convert, good, machine, shop_file, toolpath
from toolpaths.diagnostics import Severity
from toolpaths.toolpath import Toolpath

MACHINE = "mill-3axis"
CUTS = ["RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,2", "GOTO/0,0,-1", "GOTO/20,0,-1", "GOTO/20,20,-1", "RAPID",
        "GOTO/20,20,50"]
LEVELS = {
    "fanuc-30i": ("G05.1 Q1 R1", "G05.1 Q1 R10", "G05.1 Q0"),
    "haas-ngc": ("G187 P1 E0.005", "G187 P3 E0.003", "G187"),
    "siemens-840d": ("CYCLE832(0.005,_ORI_ROUGH,0.015)", "CYCLE832(0.003,_ORI_FINISH,0.015)", "CYCLE832(0,_OFF,1)"),
    "heidenhain-tnc640": ("CYCL DEF 32.2 HSC-MODE:1 TA0.015", "CYCL DEF 32.2 HSC-MODE:0 TA0.015", ""),
    "linuxcnc": ("G64 P0.003333 Q0.001667", "G64 P0.002 Q0.001", "")}
"""roughing, finishing, off at the end"""


def part() -> Toolpath:
    """ROUGH, FINE and REST, which states nothing, with one tool."""
    head = ["UNITS/MM"]
    body = [line for name in ("ROUGH", "FINE", "REST") for line in (
        f"TOOL PATH/{name},TOOL,T1", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600",
        *CUTS, "END-OF-PATH")]
    return toolpath(*body, head=head)


def setup(**asked: str | float) -> SetupFile:
    return SetupFile.model_validate({"output": {"smoothing": asked}, "tools": {"1": {"gauge_length": 80.0}}})


@pytest.mark.parametrize("controller", LEVELS)
def test_levels_stand_where_operations_begin(controller: str) -> None:
    rough, fine, off = LEVELS[controller]
    made = good(convert(part(), MACHINE, controller, setup(ROUGH="roughing", FINE="finishing")))
    first, then = made.text.index(rough), made.text.rindex(fine)
    cuts = [m.start() for m in re.finditer(r"(?m)^(?!.*BLK FORM).*Z-1\b", made.text)]
    assert len(cuts) == 3 and first < cuts[0] < then < cuts[1]
    assert not off or re.search(rf"(?m)(^|N\d+ ){re.escape(off)}$", made.text[cuts[2]:])


def test_no_word_without_a_level_stands_behind_one() -> None:
    """No page says that G05.1 Q1 does away with R1: REST, which states nothing, is cut with the level that takes no more."""
    asked = setup(ROUGH="roughing")
    made = good(convert(part(), MACHINE, "fanuc-30i", asked))
    assert re.findall(r"(?m)^G05\.1 Q1.*$", made.text) == ["G05.1 Q1 R1", "G05.1 Q1 R10"]
    assert made.job is not None
    found = read_back(made.text.replace("G05.1 Q1 R10", "G05.1 Q1").encode(), made.job, "part.cls")[1]
    assert "verify.smoothing" in {d.code for d in found if d.severity is Severity.ERROR}
    plain = good(convert(part(), MACHINE, "fanuc-30i", setup()))
    assert "G05.1 Q1\n" in plain.text and "R10" not in plain.text


@pytest.mark.parametrize("controller", LEVELS)
def test_a_level_that_takes_more_is_found_in_the_operation_that_must_not(controller: str, tmp_path: Path) -> None:
    """The finishing blocks replaced by the roughing ones: what is allowed counts by operation, not by program."""
    rough, fine, _ = LEVELS[controller]
    asked = setup(ROUGH="roughing", FINE="finishing")
    text = good(convert(part(), MACHINE, controller, asked)).text
    if controller == "heidenhain-tnc640":
        rough, fine = "32.1 T0.005", "32.1 T0.003"
    file = tmp_path / "part.nc"

    def found(text: str) -> set[str]:
        file.write_text(text)
        return {d.code for d in verify(file, part(), machine(MACHINE), controller, asked).diagnostics
                if d.code.startswith("verify.")}
    assert found(text) == set()
    at = text.rindex(fine)
    assert found(text[:at] + rough + text[at + len(fine):]) == {"verify.smoothing"}


@pytest.mark.parametrize(("controller", "word", "others"), [
    ("haas-ngc", "G187 P3 E0.003", ("G187 P1 E0.003", "G187 E0.003")),
    ("siemens-840d", "0.003,_ORI_FINISH", ("0.003,_ORI_ROUGH", "0.003,_ORI_SEMIFIN", "0.003,_FINISHED")),
    ("heidenhain-tnc640", "HSC-MODE:0", ("HSC-MODE:1", "")),
    ("fanuc-30i", "G05.1 Q1 R10", ("G05.1 Q1 R9", "G05.1 Q1", "G05.1 Q0", ""))])
def test_another_level_at_the_same_tolerance_is_an_error_where_one_is_asked_for(controller: str, word: str,
                                                                                 others: tuple[str, ...]) -> None:
    """The first of the other words is a warning in an operation that asks for none, whose level the controller file has."""
    made = good(convert(part(), MACHINE, controller, setup(ROUGH="roughing", FINE="finishing")))
    plain = good(convert(part(), MACHINE, controller, setup()))
    assert made.job is not None and plain.job is not None
    at = made.text.index(word, made.text.index(LEVELS[controller][0]))
    for other in others:
        _, found = read_back(made.text[:at] + other + made.text[at + len(word):], made.job, "part.cls")
        errors = [d for d in found if d.severity is Severity.ERROR]
        assert [d.code for d in errors if "level" in d.message] == ["verify.smoothing"], other
    usual = "G05.1 Q1" if controller == "fanuc-30i" else word
    at = plain.text.rindex(usual)
    _, found = read_back(plain.text[:at] + others[0] + plain.text[at + len(usual):], plain.job, "part.cls")
    assert [(d.code, d.severity) for d in found if d.code == "verify.smoothing"] == [("verify.smoothing", Severity.WARNING)]


@pytest.mark.parametrize(("controller", "word", "other", "code"), [
    ("haas-ngc", "G187 P3", "G187 P4", "gcode.smoothing"),
    ("heidenhain-tnc640", "HSC-MODE:0", "HSC-MODE:2", "gcode.smoothing")])
def test_a_level_that_the_control_has_not_is_refused(controller: str, word: str, other: str, code: str) -> None:
    made = good(convert(part(), MACHINE, controller, setup()))
    assert made.job is not None and word in made.text
    _, found = read_back(made.text.replace(word, other, 1), made.job, "part.cls")
    assert code in {d.code for d in found if d.severity is Severity.ERROR}


@pytest.mark.parametrize(("controller", "word", "others"), [
    ("siemens-840d", "_ORI_FINISH,0.015)", ("_ORI_FINISH,5)", "_ORI_FINISH)", "_FINISH,0.015)")),
    ("heidenhain-tnc640", " TA0.015", (" TA5", ""))])
def test_more_than_the_tool_axis_may_lose_is_found_where_cuts_turn_it(controller: str, word: str,
                                                                      others: tuple[str, ...]) -> None:
    """The tolerance of rotary axes has a share of its own; where they stand it takes nothing."""
    head = ["UNITS/MM", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600", "RAPID", "GOTO/0,0,20,0,0,1"]
    turning = toolpath(*(f"GOTO/{x},0,5,{0.02 * x},0,{(1.0 - (0.02 * x)**2)**0.5:.9f}" for x in range(0, 20, 4)), head=head)
    standing = toolpath("GOTO/0,0,5", "GOTO/10,0,5", "GOTO/10,10,5", head=head)
    for path, code in ((turning, "verify.smoothing"), (standing, None)):
        made = good(convert(path, "mikron-ucp710", controller, setup(), output="axes"))
        assert made.job is not None and word in made.text
        for other in others:
            _, found = read_back(made.text.replace(word, other), made.job, "part.cls")
            assert {d.code for d in found if d.severity is Severity.ERROR} == ({code} if code else set()), other


def test_the_bound_counts_the_most_that_an_operation_leaves_to_the_control() -> None:
    plain, rough = (good(convert(part(), MACHINE, "haas-ngc", one)) for one in (setup(), setup(ROUGH="roughing")))
    assert plain.shares["smoothing"] == pytest.approx(0.003) and rough.shares["smoothing"] == pytest.approx(0.005)
    assert rough.shares["linearising"] < plain.shares["linearising"]
    for controller in LEVELS:   # a number means the same on a control that has levels instead (G05.1 Q1 R1 would take less)
        refused = convert(part(), MACHINE, controller, setup(ROUGH=0.02))
        assert codes(refused.diagnostics) >= {"tolerance.smoothing"}, controller


@pytest.mark.parametrize(("controller", "asked", "block"), [
    ("haas-ngc", 0.001, "G187 P3 E0.001"), ("siemens-840d", 0.001, "CYCLE832(0.001,_ORI_FINISH,0.015)"),
    ("heidenhain-tnc640", 0.001, "CYCL DEF 32.1 T0.001"), ("linuxcnc", 0.0015, "G64 P0.001 Q0.0005"),
    ("fanuc-30i", 0.003, "G05.1 Q1 R10"), ("fanuc-30i", 0.006, "G05.1 Q1 R1")])
def test_a_tolerance_in_the_place_of_a_level(controller: str, asked: float, block: str) -> None:
    assert block in good(convert(part(), MACHINE, controller, setup(FINE=asked))).text


@pytest.mark.parametrize(("controller", "asked", "follow"), [
    ("haas-ngc", {"FINE": "mirror"}, {"FINE": "finishing"}), ("haas-ngc", {"FINISH": "finishing"}, {"FINE": "finishing"}),
    ("fanuc-30i", {"FINE": 0.0001}, {"FINE": 0.002}), ("generic-iso", {"FINE": 0.001}, {})])
def test_what_the_control_or_the_file_has_not_is_refused_with_what_it_has(controller: str, asked: dict[str, str | float],
                                                                          follow: dict[str, str | float]) -> None:
    made = convert(part(), MACHINE, controller, setup(**asked))
    fault = next(d for d in made.diagnostics if d.code == "setup.smoothing")
    assert not made.ok and ("level" in fault.hint or any(str(v) in fault.hint for v in (*follow, *follow.values())))
    good(convert(part(), MACHINE, controller, setup(**follow)))


@pytest.mark.covering
@pytest.mark.parametrize("controller", LEVELS)
@pytest.mark.parametrize("asked", ["finishing", 0.003])
def test_no_level_on_a_control_without_smoothing(controller: str, asked: str | float, tmp_path: Path) -> None:
    """smoothing = false of the machine file; both remedies of the hint are followed."""
    file = tmp_path / "shop.toml"
    file.write_text(f'base = "{MACHINE}"\n[control]\nsmoothing = false\n')
    made = postproc.convert(part(), machines.load(file), controller, setup(FINE=asked))
    found = [d for d in made.diagnostics if d.severity.name == "ERROR"]
    assert [d.code for d in found] == ["setup.smoothing"] and "smoothing = false" in found[0].message
    assert "smoothing = true" in found[0].hint
    assert postproc.convert(part(), machines.load(file), controller, setup()).ok
    file.write_text(file.read_text().replace("false", "true"))
    assert postproc.convert(part(), machines.load(file), controller, setup(FINE=asked)).ok


@pytest.mark.parametrize("word", ["G05.1 Q1 R5", "G05 P10000", "G61.1", "G61.1,K3", "G61.1, R0.01"])
def test_a_word_of_the_shop_states_what_it_may_move_by(word: str, tmp_path: Path) -> None:
    """In its documented spelling; what it takes counts in the bound, and more than its share is found."""
    own = shop_file(tmp_path, f'program.path_tolerance = ["{word}"]\nkinematics.smoothing_fixed = 0.004\n'
                    f'smoothing_words = {{ "{word}" = 0.004 }}\n', "fanuc-30i")
    made = good(convert(part(), MACHINE, own, setup()))
    assert f"\n{word}\n" in made.text and made.shares["smoothing"] == 0.004
    own.write_text(own.read_text().replace("= 0.004 }", "= 0.006 }"))
    assert "verify.smoothing" in codes(convert(part(), MACHINE, own, setup()).diagnostics)
    own.write_text(own.read_text().split("smoothing_words")[0])
    assert not convert(part(), MACHINE, own, setup()).ok or word == "G05.1 Q1 R5"


@pytest.mark.parametrize(("on", "off"), [("G05 P10000", "G05 P0"), ("G61.1", "G64"), ("G61.1,K3", "G64")])
def test_a_program_with_words_of_the_shop_is_read_in_every_spelling_of_them(on: str, off: str, tmp_path: Path) -> None:
    """On and off, with and without zeros and blanks; unnamed they are refused, and the hint names [smoothing_words]."""
    own = shop_file(tmp_path, f'smoothing_words = {{ "{on}" = 0.002, "{off}" = 0.0 }}\n', "fanuc-30i")
    usual, made = (good(convert(part(), MACHINE, c, setup())) for c in ("fanuc-30i", own))
    for first in (on, on.replace("G05 P", "G5P"), on.replace(",K3", " , K03.")):
        text = made.text.replace("G05.1 Q1", first).replace("G05.1 Q0", off)
        assert made.job is not None and usual.job is not None and first in text
        _, found = read_back(text, made.job, "part.cls")
        assert not [d for d in found if d.severity is Severity.ERROR], first
        _, found = read_back(text, usual.job, "part.cls")
        assert "[smoothing_words]" in next(d.hint for d in found if d.code in ("gcode.unknown_code", "gcode.not_executed"))
    for wrong in (",K3" in on) * ("G61.1,K4", "G61.1 K3", "G61.1,K33", "G61.1,I3"):
        _, found = read_back(text.replace(first, wrong), made.job, "part.cls")
        assert any(d.severity is Severity.ERROR for d in found), wrong


def test_it_is_not_changed_while_a_mode_is_on_where_the_control_cannot() -> None:
    """Fanuc: two operations under one G43.4; with restarts each begins outside of it."""
    turn = [f"GOTO/{x},0,5,{0.01 * x},0,{(1.0 - (0.01 * x)**2)**0.5:.9f}" for x in range(0, 20, 4)]
    body = [line for name in ("ROUGH", "FINE") for line in (
        f"TOOL PATH/{name},TOOL,T1", "MSYS/0,0,0,1,0,0,0,1,0", "LOAD/TOOL,1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600",
        "RAPID", "GOTO/0,0,20,0,0,1", *turn, "RAPID", "GOTO/16,0,20,0.16,0,0.987117014", "END-OF-PATH")]
    path = toolpath(*body, head=["UNITS/MM"])
    asked = setup(ROUGH="roughing", FINE="finishing")
    made = convert(path, "mikron-ucp710", "fanuc-30i", asked, output="tcp")
    again = asked.model_copy(update={"output": asked.output.model_copy(update={"restart": True})})
    text = good(convert(path, "mikron-ucp710", "fanuc-30i", again, output="tcp")).text
    assert "G05.1 Q1 R10" in text and text.index("G49", text.index("G43.4")) < text.index("G05.1 Q1 R10")
    if made.ok:  # the mode was left between the operations
        assert made.text.index("G49", made.text.index("G43.4")) < made.text.index("G05.1 Q1 R10")
    else:
        assert "output.smoothing_mode" in codes(made.diagnostics)
