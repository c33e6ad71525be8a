"""What a shop's files hold every day: tools numbered 0, no FEDRAT, LOADTL with ADJUST, PREFUN, MAXRPM."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

import postproc
import toolpaths
from postproc.cli.app import app
from postproc.cycle_time import source
from postproc.cycle_time.conversion import estimate_of
from postproc.orientation.passes.passes import work_of
from postproc.setup.model import SetupFile
from tests.postproc.kit import machine
from toolpaths.diagnostics import Diagnostic, Severity

HEAD = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\nFEDRAT/MMPM,600\n"
CUT = "RAPID\nGOTO/0,0,5\nGOTO/0,0,0\nGOTO/20,0,0\nRAPID\nGOTO/20,0,5\n"


def setup(**keys: object) -> SetupFile:
    """A set-up with lengths for tools 0, 1 and 2, and whatever a test states besides."""
    tools = {number: {"gauge_length": length} for number, length in (("0", 10.0), ("1", 100.0), ("2", 80.0))}
    return SetupFile.model_validate({"tools": tools, **keys})


def converted(text: str, name: str = "mill-3axis", controller: str | Path = "linuxcnc",
              of: SetupFile | None = None) -> postproc.PostResult:
    """A conversion of CL text."""
    path, found = toolpaths.read_bytes((text + "FINI\n").encode(), file="t.apt")
    return postproc.convert(path, machine(name), controller, setup=of or setup(), diagnostics=found)


def said(result: postproc.PostResult, code: str) -> Diagnostic:
    """The diagnostic of a code, which has to be there once."""
    one, = (d for d in result.diagnostics if d.code == code)
    return one


def blocks_of(result: postproc.PostResult) -> list[str]:
    """The program without the line of its header that says one set-up from another."""
    return [row for row in result.text.splitlines() if "fingerprint of the set-up" not in row]


def errors(result: postproc.PostResult) -> list[str]:
    return [str(d) for d in result.diagnostics if d.severity is Severity.ERROR]


@pytest.mark.parametrize("name", ["mill-3axis", "mikron-ucp710", "linuxcnc-xyzac-trt"])
def test_the_length_of_tool_0_is_not_in_the_spindle_before_the_first_tool(name: str) -> None:
    with_it, without = converted(HEAD + CUT, name), converted(HEAD + CUT, name,
                                                              of=setup(tools={"1": {"gauge_length": 100}}))
    assert not errors(with_it) and blocks_of(with_it) == blocks_of(without) != []


def test_what_cuts_before_the_first_tool_change_needs_a_number() -> None:
    text = HEAD.replace("LOADTL/1\n", "") + CUT + "LOADTL/1\n" + CUT
    assert '"unnamed" = 2' in said(converted(text), "tool.number").hint


def test_inspect_prints_a_diagnostic_once(tmp_path: Path) -> None:
    file = tmp_path / "part.apt"
    file.write_text("GOTO/0,0,0\nGOTO/1,0,0\nFINI\n")
    got = CliRunner().invoke(app, ["inspect", str(file)])
    assert got.stderr.count("cl.no-units") == 1 and "cl.no-units" not in got.stdout and "2 points" in got.stdout


NO_FEED = "UNITS/MM\nLOADTL/1\nSPINDL/RPM,1000,CLW\n"
HOLE = "CYCLE/DRILL,DEPTH,5,CLEAR,2\nGOTO/30,0,0\nCYCLE/OFF\n"


@pytest.mark.parametrize("controller", ["linuxcnc", "fanuc-30i", "siemens-840d", "heidenhain-tnc640"])
def test_the_feed_of_the_set_up_is_that_of_what_the_file_states_none_for(controller: str, tmp_path: Path) -> None:
    of, text = setup(output={"feed": 432.0}), NO_FEED + CUT + HOLE + "FEDRAT/MMPM,600\nRAPID\nGOTO/0,0,5\n" + CUT
    result = converted(text, controller=controller, of=of)
    assert not errors(result)
    assert said(result, "feed.of_setup").lines == (6, 7, 11) and "432 mm/min" in said(result, "feed.of_setup").message
    assert "F432" in result.text and "F600" in result.text and "432 mm/min of the set-up" in result.text.lower()
    path, _ = toolpaths.read_bytes((text + "FINI\n").encode(), file="t.apt")
    program = tmp_path / "p.nc"
    program.write_text(result.text)
    assert postproc.verify(program, path, machine("mill-3axis"), controller, setup=of).ok
    other = postproc.verify(program, path, machine("mill-3axis"), controller,
                            setup=setup(output={"feed": 200.0}))
    assert "verify.feed" in {d.code for d in other.diagnostics}


def test_a_missing_feed_is_refused_and_the_set_up_is_named() -> None:
    assert "[output] feed" in said(converted(NO_FEED + CUT + HOLE), "feed.missing").hint


def test_the_feed_of_the_set_up_replaces_none_that_is_stated() -> None:
    asked, plain = converted(HEAD + CUT, of=setup(output={"feed": 50.0})), converted(HEAD + CUT)
    assert asked.ok and blocks_of(asked) == blocks_of(plain) != []


def test_a_tap_takes_no_feed_of_the_set_up() -> None:
    of, text = setup(output={"feed": 50.0}), NO_FEED + "CYCLE/TAP,DEPTH,5,CLEAR,2{}\nGOTO/30,0,0\nCYCLE/OFF\n"
    assert said(converted(text.format(""), of=of), "cl.cycle-value").severity is Severity.ERROR
    path, _ = toolpaths.read_bytes(text.format(",MMPM,500").encode(), file="t.apt")
    unknown = replace(path, cycles=tuple(replace(c, feed=float("nan")) for c in path.cycles))
    assert said(postproc.convert(unknown, machine("mill-3axis"), setup=of), "feed.missing").severity is Severity.ERROR


TWO = "".join(f"TOOL PATH/OP_{name},TOOL,{name}\nTLDATA/MILL,{size},0,75,0,0\nMSYS/0,0,0,1,0,0,0,1,0\nLOAD/TOOL,0\n"
              f"SPINDL/RPM,2500,CLW\nFEDRAT/MMPM,400\n{CUT}END-OF-PATH\n" for name, size in (("EM12", 12), ("EM6", 6)))
NAMES = {"em12": 1, "EM6": 2}


def test_two_tools_of_one_number_are_refused_and_the_set_up_is_named() -> None:
    third = TWO.split("END-OF-PATH")[0].replace("EM12", "EM8").replace("MILL,12", "MILL,8").replace("TOOL,0", "TOOL,1")
    text = third + "END-OF-PATH\n" + TWO.replace("TOOL,0", "TOOL,3")
    hint = said(converted(text), "tool.same_number").hint
    assert '[tool_numbers]\n"EM12" = 3\n"EM6" = 2' in hint, "1 is the number of another tool"
    assert converted(text, of=setup(tool_numbers={"EM12": 3, "EM6": 2})).ok
    assert '[tool_numbers]\n"EM12" = 1\n"EM6" = 2' in said(converted(TWO), "tool.number").hint


@pytest.mark.parametrize("second", ["CUTTER/12,0\nTPRINT/T2 FINISHER", "CUTTER/12,0\nTPRINT/T2 FINISHER\nLOADTL/1"])
def test_a_second_name_under_one_number_and_size_is_said(second: str) -> None:
    """Nothing but the name tells two tools apart: they cut as one, which may be what the file means, or a lost LOADTL."""
    text = f"UNITS/MM\nCUTTER/12,0\nTPRINT/T1 ROUGHER\nLOADTL/1\nSPINDL/RPM,2500,CLW\nFEDRAT/MMPM,400\n{CUT}{second}\n{CUT}"
    found = said(converted(text), "tool.same_number")
    assert found.severity is Severity.WARNING and '"T1 ROUGHER" = 1\n"T2 FINISHER" = 2' in found.hint
    two = converted(text, of=setup(tool_numbers={"T1 ROUGHER": 1, "T2 FINISHER": 2}))
    assert two.ok and [n for n in (1, 2) if f"T{n} M6" in two.text] == [1, 2]
    assert all("names" not in d.message for d in converted(text.replace("T2 FINISHER", "t1 rougher")).diagnostics)


@pytest.mark.parametrize("controller", ["linuxcnc", "fanuc-30i", "siemens-840d", "heidenhain-tnc640"])
def test_the_set_up_numbers_tools_by_name(controller: str, tmp_path: Path) -> None:
    of = setup(tool_numbers=NAMES)
    result = converted(TWO, controller=controller, of=of)
    assert not errors(result) and result.job is not None and "EM12 = T1, EM6 = T2" in result.text.upper()
    plain = TWO.replace("LOAD/TOOL,0", "LOAD/TOOL,1", 1).replace("LOAD/TOOL,0", "LOAD/TOOL,2")
    assert said_by(result.text) == said_by(converted(plain, controller=controller).text)
    assert result.job.register_lengths() == {1: 100.0, 2: 80.0}
    path, _ = toolpaths.read_bytes((TWO + "FINI\n").encode(), file="t.apt")
    (tmp_path / "p.nc").write_text(result.text)
    assert postproc.verify(tmp_path / "p.nc", path, machine("mill-3axis"), controller, setup=of).ok
    swapped = setup(tool_numbers={"EM12": 2, "EM6": 1})
    assert not postproc.verify(tmp_path / "p.nc", path, machine("mill-3axis"), controller, setup=swapped).ok


def said_by(text: str) -> list[str]:
    """The blocks of a program without their numbers and without comments."""
    return [block.lstrip("0123456789 ") for block in text.splitlines() if "(" not in block and ";" not in block]


BACK = TWO + TWO.split("END-OF-PATH\n")[0] + "END-OF-PATH\n"
"""the first tool again after the second"""


@pytest.mark.parametrize("first", ["LOAD/TOOL,0", "LOAD/TOOL,7"])
def test_tools_that_the_set_up_numbers_are_called_where_the_file_loads_the_first_alone(first: str) -> None:
    """It was refused, though the hint of tools of one number asks for these lines of a set-up."""
    head, *rest = BACK.split("LOAD/TOOL,0\n")
    result = converted(head + first + "\n" + "".join(rest), of=setup(tool_numbers=NAMES))
    assert not errors(result) and said_by(result.text) == said_by(converted(BACK, of=setup(tool_numbers=NAMES)).text)
    loads = [e.values[0] for e in result.job.toolpath.events if e.word == "LOADTL"] if result.job else []
    assert loads == [1.0, 2.0, 1.0]


NUMBERED = "UNITS/MM\nSPINDL/RPM,900,CLW\nFEDRAT/MMPM,400\n" + "".join(
    f"TOOLNO/{n},MILL,{size},0\n{load}{CUT}" for n, size, load in ((1, 12, "LOADTL/1\n"), (2, 6, "")))
"""a record numbers the second tool, none loads it"""


def test_a_tool_that_the_file_numbers_and_never_loads_is_refused() -> None:
    found = said(converted(NUMBERED), "tool.not_loaded")
    assert "(T2)" in found.message and converted(NUMBERED.replace("MILL,6,0\n", "MILL,6,0\nLOADTL/2\n")).ok


@pytest.mark.parametrize(("controller", "written"), [("haas-ngc", "T0\n"), ("heidenhain-tnc640", "TOOL DEF 0\n")])
def test_an_empty_place_is_not_made_ready_before_a_tool(controller: str, written: str) -> None:
    """SELECT/TOOL,0 was written as T0, which takes the tool out of the spindle where a word T calls it at once."""
    text = f"UNITS/MM\nSPINDL/900,RPM,CLW\nFEDRAT/400\nLOADTL/1\nSELECT/TOOL,0\n{CUT}LOADTL/2\nSPINDL/900,RPM,CLW\n{CUT}"
    assert written not in converted(text, controller=controller).text
    assert written.replace("0", "2") in converted(text.replace("TOOL,0", "TOOL,2"), controller=controller).text
    assert written in converted(text + "SELECT/TOOL,0\nGOHOME\nLOADTL/0\n", controller=controller).text


def test_names_that_the_file_does_not_have_are_reported() -> None:
    found = said(converted(TWO, of=setup(tool_numbers={**NAMES, "BALL8": 3})), "setup.tool_name_unused")
    assert "BALL8" in found.message and "EM12, EM6" in found.hint


def test_a_selected_tool_is_that_which_is_loaded_next() -> None:
    text = TWO.replace("END-OF-PATH\n", "SELECT/TOOL,0\nEND-OF-PATH\n", 1)
    result = converted(text, of=setup(tool_numbers=NAMES))
    assert not errors(result) and "T2" in result.text.splitlines()


@pytest.mark.parametrize(("controller", "register", "code", "severity"), [
    ("siemens-840d", 1, "D1", Severity.INFO), ("siemens-840d", 20, "D1", Severity.WARNING),
    ("heidenhain-tnc640", 1, "TOOL CALL 10", Severity.WARNING), ("heidenhain-tnc640", 3, "TOOL CALL 10", Severity.WARNING)])
def test_a_register_that_the_controller_does_not_have_is_reported(controller: str, register: int, code: str,
                                                              severity: Severity, tmp_path: Path) -> None:
    of = setup(tools={"10": {"gauge_length": 70.0}})
    text = HEAD.replace("LOADTL/1", f"LOADTL/10,ADJUST,{register}") + CUT
    result = converted(text, controller=controller, of=of)
    assert not errors(result) and code in result.text
    found = said(result, "tool.register")
    assert found.severity is severity and f"T10 (register {register})" in found.message and found.lines == (2,)
    path, _ = toolpaths.read_bytes((text + "FINI\n").encode(), file="t.apt")
    (tmp_path / "p.nc").write_text(result.text)
    assert postproc.verify(tmp_path / "p.nc", path, machine("mill-3axis"), controller, setup=of).ok


def test_a_register_that_may_be_a_cutting_edge_is_refused() -> None:
    text = HEAD.replace("LOADTL/1", "LOADTL/10,ADJUST,2") + CUT
    found = said(converted(text, controller="siemens-840d"), "tool.register")
    assert found.severity is Severity.ERROR and "D2 to D9" in found.message
    assert not [d for d in converted(text).diagnostics if d.code == "tool.register"]


@pytest.mark.parametrize("controller", ["siemens-840d", "heidenhain-tnc640"])
def test_two_registers_of_one_tool_are_refused_where_it_has_one_length(controller: str) -> None:
    text = HEAD + CUT + "LOADTL/1,ADJUST,21\n" + CUT
    assert said(converted(text, controller=controller), "tool.register").severity is Severity.ERROR
    assert not errors(converted(text)) and "G43 H21" in converted(text).text


@pytest.mark.parametrize("controller", ["siemens-840d", "heidenhain-tnc640"])
def test_the_tools_own_number_as_register_is_nothing_to_report(controller: str) -> None:
    result = converted(HEAD.replace("LOADTL/1", "LOADTL/1,ADJUST,1") + CUT, controller=controller)
    assert not errors(result) and "tool.register" not in {d.code for d in result.diagnostics}


@pytest.mark.parametrize(("record", "advice"), [
    ("PREFUN/54", "work_offset_code in the set-up"), ("PREFUN/64", "from --tolerance"), ("INSERT/G4 P1", "DELAY/seconds"),
    ("INSERT/G17", "take the record out"), ("AUXFUN/50", "program.passive"), ("INSERT/G53 Z0", "GOHOME")])
def test_a_code_that_cannot_be_put_in_comes_with_what_to_do(record: str, advice: str) -> None:
    found = said(converted(HEAD + record + "\n" + CUT), "insert.refused")
    assert found.severity is Severity.ERROR and advice in found.hint


@pytest.mark.parametrize("record", ["SPINDL/RPM,1200,MAXRPM,2000,CLW", "SPINDL/1200,MAXRPM,2000,CLW",
                                    "SPINDL/MAXRPM,2000,RPM,1200,CLW"])
def test_the_limit_of_a_speed_is_left_out(record: str) -> None:
    result = converted(HEAD.replace("SPINDL/RPM,1000,CLW", record) + CUT)
    assert not errors(result) and "S1200 M3" in result.text and "2000" not in result.text
    assert said(result, "spindle.limit").severity is Severity.WARNING


def test_a_limit_alone_starts_no_spindle() -> None:
    result = converted(HEAD.replace("RPM,1000,CLW", "MAXRPM,2000") + CUT)
    assert said(result, "spindle.limit") and said(result, "spindle.not_started").severity is Severity.ERROR


def test_a_speed_above_its_limit_is_refused() -> None:
    found = errors(converted(HEAD.replace("RPM,1000", "RPM,1200,MAXRPM,1000") + CUT))
    assert any("1200" in e and "1000" in e for e in found)


def tap(options: str, spindle: str = "RPM,600,CLW", retract: str = "3") -> str:
    return (f"UNITS/MM\nLOADTL/1\nSPINDL/{spindle}\nRAPID\nGOTO/0,0,50\nCYCLE/TAP,DEPTH,5,MMPM,600,RAPTO,3,RTRCTO,{retract}"
            f"{options}\nGOTO/10,0,0\nCYCLE/OFF\n")


@pytest.mark.parametrize(("text", "controller", "reason"), [
    (tap(",DWELL,1"), "fanuc-30i", "it dwells for 1 s"),
    (tap("").replace("TAP", "BORE7"), "linuxcnc", "cycles.table has no BORE7"),
    (tap("").replace("CYCLE/TAP", "OPSKIP/ON\nCYCLE/TAP"), "fanuc-30i", "between OPSKIP/ON and OPSKIP/OFF")])
def test_a_cycle_that_cannot_be_written_names_the_reason(text: str, controller: str, reason: str) -> None:
    found = said(converted(text, controller=controller), "cycle.not_native")
    assert reason in found.message and found.hint
    reasons = ["it dwells", "has no BORE7", "OPSKIP", "along Z"]
    assert [w for w in reasons if w in found.message] == [w for w in reasons if w in reason]


def test_a_length_next_to_the_tool_is_no_register() -> None:
    result = converted(HEAD.replace("LOADTL/1", "LOADTL/1,LENGTH,120") + CUT)
    assert not errors(result) and "G43 H1" in result.text.splitlines()
    assert "[tools.1] gauge_length of the set-up is" in said(result, "cl.tool-length").message
    both = converted(HEAD.replace("LOADTL/1", "LOADTL/1,LENGTH,120,OFFSET,7") + CUT)
    assert "G43 H7" in both.text.splitlines()
    assert "G43 H5" in converted(HEAD.replace("LOADTL/1", "LOADTL/1,1,120,5") + CUT).text.splitlines()


@pytest.mark.parametrize("controller", ["linuxcnc", "heidenhain-tnc640"])
def test_the_estimate_takes_what_the_read_back_has_executed(controller: str,
                                                            monkeypatch: pytest.MonkeyPatch) -> None:
    result = converted(HEAD + CUT + HOLE.replace("CLEAR", "MMPM,100,CLEAR"), controller=controller)
    assert result.ok and result.job is not None and result.comparison is not None
    code, motion, _ = source._executed(result.text.encode(), result.controller, {"G54": result.job.control},
                                       result.job.register_lengths(), (), "", {})
    assert code is not None and motion is not None
    again = estimate_of(replace(result, comparison=replace(result.comparison, executed=(code, motion))))

    def read(*_: object) -> None:
        raise AssertionError("the text is read again")

    monkeypatch.setattr(source, "reader_for", read)
    first = estimate_of(result)
    assert first is not None and again is not None and first.seconds == again.seconds > 0.0
    assert first.band == again.band


def test_a_feed_between_the_cycle_and_its_first_hole_is_the_cycles() -> None:
    path, found = toolpaths.read_bytes((NO_FEED + HOLE.replace("\nGOTO", "\nFEDRAT/MMPM,120\nGOTO") + "FINI\n").encode())
    assert "cl.no-feed" in {d.code for d in found} and path.cycles[0].feed == pytest.approx(2.0)


def test_a_tool_of_the_set_up_that_the_file_does_not_use_is_reported() -> None:
    of = setup(tools={"0": {"gauge_length": 10.0}, "1": {"gauge_length": 10.0}})
    assert "T0" in said(converted(HEAD + CUT, of=of), "setup.tool_unused").message


def test_chosen_tool_axes_see_the_numbers_of_the_set_up() -> None:
    path, _ = toolpaths.read_bytes((TWO + "FINI\n").encode())
    work, found = work_of(path, machine("mikron-ucp710"), setup(tool_numbers=NAMES), postproc.Options(),
                          turning=False)
    assert work is not None and not found and {t.number for t in work.toolpath.tools} == {1, 2}
