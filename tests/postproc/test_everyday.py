"""What a shop's files hold every day: tools numbered 0, no FEDRAT, LOADTL with ADJUST, PREFUN, MAXRPM."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

import postproc
import toolpaths
from postproc.cli import app
from postproc.controllers.model import load_controller
from postproc.setup import SetupFile
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


def errors(result: postproc.PostResult) -> list[str]:
    return [str(d) for d in result.diagnostics if d.severity is Severity.ERROR]


@pytest.mark.parametrize("name", ["mill-3axis", "mikron-ucp710", "linuxcnc-xyzac-trt"])
def test_the_length_of_tool_0_is_not_in_the_spindle_before_the_first_tool(name: str) -> None:
    with_it, without = converted(HEAD + CUT, name), converted(HEAD + CUT, name, of=setup(tools={"1": {"gauge_length": 100}}))
    assert not errors(with_it) and with_it.text == without.text


def test_what_cuts_before_the_first_tool_change_is_told_to_load_one() -> None:
    text = HEAD.replace("LOADTL/1\n", "") + CUT + "LOADTL/1\n" + CUT
    assert "load a tool before the first motion" in said(converted(text), "tool.length").hint


def test_inspect_prints_a_diagnostic_once(tmp_path: Path) -> None:
    file = tmp_path / "part.apt"
    file.write_text("GOTO/0,0,0\nGOTO/1,0,0\nFINI\n")
    got = CliRunner().invoke(app, ["inspect", str(file)])
    assert got.stderr.count("cl.no-units") == 1 and "cl.no-units" not in got.stdout and "2 points" in got.stdout
