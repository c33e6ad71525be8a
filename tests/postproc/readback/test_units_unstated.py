"""Programs that do not say whether they are in mm: what each control would do, and what `verify` makes of it."""

from __future__ import annotations

import re

import pytest

from postproc.pipeline.result import PostResult
from postproc.verification.read_back import read_back
from tests.postproc.kit import convert, good, toolpath
from tests.postproc.reader_kit import executed
from toolpaths.diagnostics import Diagnostic, Severity

CODE = "gcode.units_unstated"
STATED = {"linuxcnc": "G21 ", "generic-iso": "G21 ", "fanuc-30i": "G21 ", "haas-ngc": "G21 ", "siemens-840d": "G710 ",
          "heidenhain-tnc640": " MM"}


def cut(controller: str) -> PostResult:
    return good(convert(toolpath("RAPID", "GOTO/0,0,5", "GOTO/10,0,5", "GOTO/10,0,1"), "mill-3axis", controller))


def verified(result: PostResult, text: str) -> list[Diagnostic]:
    assert result.job is not None
    return read_back(text.encode(), result.job, "test.apt", gcode="MAIN")[1]


@pytest.mark.parametrize(("controller", "code"), STATED.items())
def test_verify_asks_for_the_units(controller: str, code: str) -> None:
    """Haas's units are a setting, which no program changes: a warning; those of the others may be left over."""
    result = cut(controller)
    assert not [d for d in verified(result, result.text) if d.code == CODE]
    bare = re.sub(f"{code}?(?=\\s)" if controller.startswith("heid") else code, "", result.text)
    assert bare != result.text
    found = [d for d in verified(result, bare) if d.code == CODE]
    wanted = Severity.WARNING if controller == "haas-ngc" else Severity.ERROR
    assert [d.severity for d in found] == [wanted]
    assert found[0].file == "MAIN" and found[0].hint


@pytest.mark.parametrize(("dialect", "text", "line"), [
    ("fanuc-30i", "G90 G0 X1.\nG21 X2.\nM30", 1), ("linuxcnc", "G4 P1\nG90 G0 X1\nG21\nM2", 2),
    ("siemens-840d", "G90\nG0 X1\nX=IC(1)\nG71\nM30", 2), ("haas-ngc", "S100 M3\nG91 G0 X1.\nM30", 2)])
def test_the_first_axis_word_without_units_is_named(dialect: str, text: str, line: int) -> None:
    found = [d for d in executed(dialect, text)[1] if d.code == CODE]
    assert [(d.severity, d.lines) for d in found] == [(Severity.WARNING, (line,))]


@pytest.mark.parametrize("text", ["G21 G0 X1.\nM30", "S100 M3\nG20\nG0 X1.\nM30", "S100 M3\nM30"])
def test_units_in_the_block_of_the_first_word_are_early_enough(text: str) -> None:
    assert not [d for d in executed("fanuc-30i", text)[1] if d.code == CODE]
