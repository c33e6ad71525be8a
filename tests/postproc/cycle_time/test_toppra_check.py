"""`time --check toppra`: both planners agree at second order, and the plan is never faster."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from postproc.cli.app import app
from postproc.cycle_time.toppra_check import check
from tests.postproc.kit import convert, few_lines, good, toolpath
from tests.postproc.planning.test_planned_feed import wave
from toolpaths.diagnostics import DiagnosticError

LINES = ["RAPID", "GOTO/0,0,50", "FEDRAT/MMPM,3000", "GOTO/60,0,50"]


def test_a_line_by_its_closed_form() -> None:
    """60 mm from rest to rest at 50 mm/s and 2500 mm/s2: L/v + v/a."""
    result = good(convert(toolpath(*LINES), "mill-3axis"))
    found, more = check(result)
    limits = result.machine.limits
    assert found is not None and not more and found.passes == 1
    wanted = 60.0 / 50.0 + 50.0 / float(limits.acceleration[0])
    assert found.toppra == pytest.approx(wanted, rel=2e-3) and found.own == pytest.approx(found.toppra, rel=1e-6)
    assert found.plan >= found.toppra


def test_five_axes_at_their_feed() -> None:
    lines = wave(40)
    found, more = check(good(convert(toolpath("RAPID", lines[0], "FEDRAT/MMPM,6000", *lines[1:]), "mikron-ucp710")))
    assert found is not None and not more
    assert found.own == pytest.approx(found.toppra, rel=1e-4) and found.plan > 1.05 * found.toppra


def test_a_plan_that_is_too_fast_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("postproc.cycle_time.toppra_check.BEYOND", -1.0)
    _, more = check(good(convert(toolpath(*LINES), "mill-3axis")))
    assert [d.code for d in more] == ["time.check"]


def test_without_toppra_one_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "toppra", None)
    with pytest.raises(DiagnosticError, match=r"extra\.missing.*postproc\[check\]"):
        check(good(convert(toolpath(*LINES), "mill-3axis")))


def test_command_line(tmp_path: Path) -> None:
    (tmp_path / "contour.cls").write_text(few_lines("pocket.cls", (1,)))
    got = CliRunner().invoke(app, ["time", str(tmp_path / "contour.cls"), "-m", "mill-3axis", "--check", "toppra", "--json",
                                   "-"])
    assert got.exit_code == 0, got.stderr
    figures = json.loads(got.stdout)["check"]
    assert 0.0 < figures["toppra_s"] <= figures["plan_s"]
    program = tmp_path / "p.ngc"
    program.write_text("%\nG21 G90 G94 G17\nG0 X0 Y0 Z50\nG1 X10 F600\nM2\n%\n")
    wrong = CliRunner().invoke(app, ["time", str(program), "-m", "mill-3axis", "--check", "toppra"])
    assert wrong.exit_code == 1 and "name the CL file" in wrong.stderr
