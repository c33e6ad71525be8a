"""Motions that the planner does not solve: whoever uses their times reports it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

import postproc
import toolpaths
from postproc.base.options import Options
from postproc.cycle_time.planned import planned_times
from postproc.cycle_time.source import from_conversion
from postproc.feedrate.motion import Plan
from postproc.feedrate.plan import plan
from postproc.orientation.candidates import candidate_times
from postproc.orientation.plans.orient import orient
from postproc.planning import planned
from postproc.setup.model import SetupFile
from tests.postproc.kit import TOOLS, machine, toolpath
from tests.postproc.orientation.test_orientation_report import written
from tests.postproc.time_kit import model
from toolpaths.diagnostics import Diagnostic, Severity


def unsolved(*given: Any, **options: Any) -> Plan:
    return replace(plan(*given, **options), solved=False)


def only(found: list[Diagnostic], code: str) -> Diagnostic:
    one, = (d for d in found if d.code == code)
    assert one.severity is Severity.WARNING and one.lines
    return one


def test_times_of_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    path = toolpath("RAPID", "GOTO/0,0,50", "RAPID", "GOTO/0,0,5", "FEDRAT/MMPM,1200", "GOTO/200,0,5", "RAPID",
                    "GOTO/200,0,50")
    result = postproc.convert(path, "mill-3axis", "linuxcnc", TOOLS)
    blocks, ideal = from_conversion(result), model("ideal")
    assert not planned_times(result, blocks, ideal)[1]
    monkeypatch.setattr(planned, "plan", unsolved)
    only(planned_times(result, blocks, ideal)[1], "time.unsolved")


def test_times_of_orientations(monkeypatch: pytest.MonkeyPatch) -> None:
    path, _ = toolpaths.read_bytes(written(1).encode(), file="passes.apt")
    monkeypatch.setattr(candidate_times, "plan", unsolved)
    choice, found = orient(path, machine("mikron-ucp710"), SetupFile(), Options(), workers=1)
    assert choice is not None and only(found, "orient.unsolved").count == 1
