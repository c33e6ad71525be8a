"""Registers and names as the shop has them: further work offsets, length and radius registers by a rule,
number and name of the program."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

import machines
import postproc
from machines.machine import Machine
from postproc.base.options import Options
from postproc.pipeline.result import PostResult
from postproc.setup.model import OutputSettings, SetupFile
from postproc.verification import second_witness
from postproc.verification.read_back import read_back
from tests.postproc.control.test_clamps import SETUP, indexed
from tests.postproc.kit import toolpath
from toolpaths.diagnostics import DiagnosticError, Severity
from toolpaths.toolpath import Toolpath

FURTHER = [("fanuc-30i", "G54.1 P1", "G54.1 P1", "G54.1 P2"), ("fanuc-30i", "G54.1 P300", "G54.1 P300", "G54.1 P30"),
           ("haas-ngc", "G154 P99", "G154 P99", "G154 P9"), ("haas-ngc", "G110", "G154 P1", "G129"),
           ("siemens-840d", "G520", "G520", "G521"),
           ("siemens-840d", "G599", "G599", "G59"),
           ("heidenhain-tnc640", "preset 12", "CYCL DEF 247 DATUM SETTING ~\nQ339=+12 ;DATUM NUMBER", "Q339=+1 ")]


FOLDER = TemporaryDirectory()


def errors(result: PostResult) -> list[str]:
    return [d.code for d in result.diagnostics if d.severity is Severity.ERROR]


def verdict(result: PostResult, text: str) -> set[str]:
    assert result.job is not None
    return {d.code for d in read_back(text, result.job, "test.apt", gcode="edited.nc")[1] if d.severity is Severity.ERROR}


def at(code: str) -> SetupFile:
    return SETUP.model_copy(update={"work_offset_code": code})


@cache
def offset(controller: str, code: str) -> PostResult:
    return postproc.convert(indexed(), machines.load("mikron-ucp710"), controller, at(code), Options())


@pytest.mark.parametrize(("controller", "code", "written", "other"), FURTHER)
def test_further_work_offsets_are_written_and_read_back(controller: str, code: str, written: str,
                                                        other: str) -> None:
    result = offset(controller, code)
    assert result.ok and written in result.text, [str(d) for d in result.diagnostics]
    wrong = result.text.replace("Q339=+12 ", other) if code.startswith("preset") else re.sub(
        rf"(?m)(^|[ \n]){re.escape(written)}$", rf"\g<1>{other}", result.text)
    assert wrong != result.text and verdict(result, wrong)


@pytest.mark.parametrize(("controller", "code", "right"), [
    ("fanuc-30i", "G54.1 P301", "G54.1 P300"), ("fanuc-30i", "G54.1 P0", "G54.1 P1"), ("fanuc-30i", "G154 P1", "G54.1 P1"),
    ("haas-ngc", "G154 P100", "G154 P99"), ("haas-ngc", "G59.1", "G129"),
    ("haas-ngc", "G130", "G110"), ("fanuc-30i", "G59.1", "G59"), ("siemens-840d", "G600", "G599"),
    ("siemens-840d", "G504", "G505"), ("heidenhain-tnc640", "G54.1 P1", "preset 1"), ("linuxcnc", "G54.1 P1", "G59.3"),
    ("generic-iso", "preset 3", "G55")])
def test_what_the_control_has_not_is_refused_and_the_hint_names_what_it_has(controller: str, code: str, right: str) -> None:
    result = offset(controller, code)
    [bad] = [d for d in result.diagnostics if d.severity is Severity.ERROR]
    assert bad.code == "setup.work_offset_code" and result.text == ""
    assert offset(controller, right).ok and any(name in bad.hint for name in (right, "G54 to G59"))
    assert ("G59.1" in bad.hint) == (controller == "linuxcnc")


@pytest.mark.parametrize(("controller", "wrong"), [("fanuc-30i", "G54.1 P301"), ("haas-ngc", "G154 P100"),
                                                   ("haas-ngc", "G154 P0")])
def test_the_reader_knows_how_many_there_are(controller: str, wrong: str) -> None:
    result = offset(controller, "G54")
    assert "gcode.offset" in verdict(result, result.text.replace("\nG54\n", f"\n{wrong}\n"))


def test_what_further_offsets_need_is_said_where_they_are_used() -> None:
    assert "NUM_USER_FRAMES" in offset("siemens-840d", "G520").text
    assert "NUM_USER_FRAMES" not in offset("siemens-840d", "G54").text + offset("siemens-840d", "G59").text


# ---- registers by a rule -----------------------------------------------------------------------------------

@cache
def ruled(length: int, radius: int | None) -> Machine:
    file = Path(FOLDER.name, f"{length}-{radius}", "ruled.toml")
    file.parent.mkdir(exist_ok=True)
    rule = {"length_register": length, "radius_register": radius}
    file.write_text('base = "mikron-ucp710"\n[control]\n' + "".join(
        f'{key} = "T + {n}"\n' if n else f'{key} = "T"\n' for key, n in rule.items() if n is not None))
    return machines.load(file)


@cache
def contour() -> Toolpath:
    """Two tools, the second with registers of its own in the file; each cuts under CUTCOM, the first twice."""
    def cut(named: str) -> list[str]:
        return ["RAPID", "GOTO/0,0,40", "FEDRAT/MMPM,500", "GOTO/0,0,30", f"CUTCOM/LEFT{named}", "GOTO/20,0,30",
                "GOTO/40,0,30", "CUTCOM/OFF", "GOTO/50,10,30", "RAPID", "GOTO/50,10,40"]
    return toolpath(*cut(""), *cut(",1"), "LOADTL/2,ADJUST,7", "SPINDL/RPM,2000,CLW", *cut(",9"))


@cache
def registered(controller: str, length: int = 20, radius: int | None = 30) -> PostResult:
    return postproc.convert(contour(), ruled(length, radius), controller, SETUP, Options(output="axes"))


@pytest.mark.parametrize("controller", ["fanuc-30i", "haas-ngc", "linuxcnc", "generic-iso"])
def test_registers_follow_the_rule_where_the_file_names_none(controller: str) -> None:
    result, plain = registered(controller), registered(controller, 0, None)
    assert result.ok and plain.ok, [str(d) for d in result.diagnostics]
    text = re.sub(r"\(.*?\)", "", result.text)
    assert set(re.findall(r"H(\d+)", text)) == {"21", "7"} and re.findall(r"D(\d+)", text) == ["31", "31", "9"]
    assert set(re.findall(r"H(\d+)", re.sub(r"\(.*?\)", "", plain.text))) == {"1", "7"}
    for right, wrong in (("H21", "H1"), ("H7", "H22"), ("D31", "D1")):
        assert verdict(result, result.text.replace(right, wrong)), wrong
    assert verdict(registered(controller, 0, None), result.text)  # a reader without the rule


def test_a_file_that_names_the_tools_number_follows_the_rule_too() -> None:
    """NX writes ADJUST,1 for T1 by itself."""
    head = ["UNITS/MM", "LOADTL/1,ADJUST,1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,600"]
    path = toolpath("RAPID", "GOTO/0,0,40", "GOTO/0,0,30", head=head)
    result = postproc.convert(path, ruled(20, None), "fanuc-30i", SETUP, Options())
    assert result.ok and "H21" in result.text and not re.search(r"H1\b", result.text)
    assert "verify.state" in verdict(result, result.text.replace("H21", "H1"))


@pytest.mark.parametrize("controller", ["siemens-840d", "heidenhain-tnc640"])
def test_controls_without_registers_write_none(controller: str) -> None:
    path = indexed()
    one, other = (postproc.convert(path, machine, controller, SETUP, Options()).text
                  for machine in (ruled(20, 30), ruled(0, None)))
    assert one and one == other


def test_the_second_witness_goes_by_the_rule(monkeypatch: pytest.MonkeyPatch) -> None:
    result = registered("fanuc-30i")
    assert result.witness is not None and any("length registers" in str(what) for what in result.witness.compared)
    assert result.job is not None and result.source is not None and result.comparison is not None
    job = replace(result.job, machine=ruled(0, 30))
    said, _ = second_witness.second_witness(result.source, result.asked or result.setup, result.options, job,
                                            result.comparison, result.text)
    assert any(f.code == "length" for f in said.findings)


def test_keys_of_a_machine_file(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text('base = "mikron-ucp710"\n[control]\nlength_register = "T + 20"\nradius_register = "T"\n')
    machine = machines.load(file)
    assert (machine.length_register, machine.radius_register) == (20, 0)
    for wrong in ('length_register = "T - 1"', 'length_register = "20"', "length_register = 20"):
        file.write_text(f'base = "mikron-ucp710"\n[control]\n{wrong}\n')
        with pytest.raises(DiagnosticError):
            machines.load(file)


# ---- number and name of the program ------------------------------------------------------------------------

@pytest.mark.parametrize(("controller", "there"), [
    ("fanuc-30i", "%\nO4711\n"), ("haas-ngc", "%\nO4711\n"), ("heidenhain-tnc640", "0 BEGIN PGM BRACKET_7 MM\n")])
def test_number_and_name_are_those_of_the_job(controller: str, there: str) -> None:
    output = OutputSettings(program_number=4711, program_name="Bracket_7")
    setup = SETUP.model_copy(update={"output": output})
    result = postproc.convert(indexed(), machines.load("mikron-ucp710"), controller, setup, Options())
    assert result.ok and result.text.startswith(there)
    assert "O4711" not in offset(controller, "G54").text and "BRACKET" not in offset(controller, "G54").text


@pytest.mark.parametrize("controller", ["fanuc-30i", "siemens-840d"])
def test_subprograms_bear_the_name_of_the_job(controller: str) -> None:
    output = OutputSettings(program_number=4711, program_name="BRACKET", files=True)
    result = postproc.convert(indexed(), machines.load("mikron-ucp710"), controller,
                              SETUP.model_copy(update={"output": output}), Options())
    assert result.ok and result.files, [str(d) for d in result.diagnostics]
    assert controller != "siemens-840d" or all(name.startswith("BRACKET_") for name in result.files)


@pytest.mark.parametrize("number", [1001, 1002])
def test_a_number_that_a_subprogram_bears_is_refused(number: int) -> None:
    def made(number: int) -> PostResult:
        output = OutputSettings(program_number=number, subprograms=True)
        return postproc.convert(indexed(), machines.load("mikron-ucp710"), "fanuc-30i",
                                SETUP.model_copy(update={"output": output}), Options())
    taken = 1000 + len(made(4711).text.split("M98")) - 1
    result = made(number)
    assert (errors(result) == ["setup.program_number"]) == (number <= taken) and made(taken + 1).ok
