"""The table of stages: each takes what the one before hands on, an error ends the conversion, the README lists them."""

from __future__ import annotations

import ast
import typing
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import machines
import postproc
import toolpaths
from postproc.base.options import Options
from postproc.pipeline import stages
from postproc.pipeline.convert import convert
from postproc.pipeline.stage_values import BegunStage, VerifiedStage
from postproc.pipeline.stages import STAGES, Stage
from postproc.report.trace import as_text, trace_line
from tests.source import ROOT, nodes, product
from toolpaths.diagnostics import error

README = Path(postproc.__file__).parent / "README.md"
CL = b"UNITS/MM\nLOADTL/1\nSPINDL/3000,RPM,CLW\nRAPID\nGOTO/0,0,20\nFEDRAT/400,MMPM\nGOTO/0,0,0\nGOTO/9,0,0\nFINI\n"


def taken_and_handed_on(stage: Stage) -> tuple[type, set[type]]:
    hints = typing.get_type_hints(stage.run)
    value = typing.get_args(hints["return"])[0]
    return hints[next(iter(hints))], set(typing.get_args(value)) or {value}


def test_each_stage_takes_what_the_one_before_hands_on() -> None:
    given: type = BegunStage
    for stage in STAGES:
        takes, hands_on = taken_and_handed_on(stage)
        assert takes is given and hands_on <= {takes, given := max(hands_on, key=lambda kind: len(kind.__mro__))}
        assert issubclass(given, takes)
    assert given is VerifiedStage


ROAD = ("alignment", "cli", "collision", "compile", "correction", "cycle_time", "job", "path", "pipeline", "placement",
        "planning", "proof", "report", "setup", "setup_sheet", "verification")
"""rooms that hand a conversion on, or take what it comes to"""


def asserted(found: Iterable[ast.AST]) -> Iterator[str]:
    """What is said to be there instead of being handed on by a type that holds it."""
    return (ast.unparse(node) for node in found if isinstance(node, ast.Assert) and "is not None" in ast.unparse(node.test))


def test_no_stage_asserts_that_a_value_is_there() -> None:
    top = ROOT / "postproc"
    rooms = {path: path.relative_to(top).parts[0] for path in product() if path.is_relative_to(top)}
    assert set(ROAD) <= set(rooms.values())
    assert [f"{path}: {text}" for path, room in rooms.items() if room in ROAD for text in asserted(nodes(path))] == []


def test_an_asserted_value_is_noticed() -> None:
    assert list(asserted(ast.walk(ast.parse("def f(made):\n    assert made.job is not None and made.ok\n"))))


@pytest.mark.parametrize("at", range(len(STAGES)), ids=[stage.name for stage in STAGES])
def test_an_error_ends_the_conversion(at: int, monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[str] = []

    def counted(number: int, stage: Stage) -> Stage:
        def run(made: BegunStage, progress: stages.Progress | None) -> tuple[BegunStage, list[stages.Diagnostic]]:
            ran.append(stage.name)
            value, found = stage.run(made, progress)
            return value, [*found, error("test.stage", "planted", hint="none")] if number == at else found
        return replace(stage, run=run)

    monkeypatch.setattr(stages, "STAGES", tuple(counted(k, stage) for k, stage in enumerate(STAGES)))
    path, found = toolpaths.read_bytes(CL)
    result = convert(path, machines.load("mill-3axis"), options=Options(), diagnostics=found)
    assert ran == [stage.name for stage in STAGES[:at + 1]] and not result.ok and result.text == "" and not result.files
    traced, _ = trace_line(result, 5)
    assert [one["stage"] for one in traced["stages"] if one["done"]] == ran[:-1] and result.reached == ran[-1]
    assert f"ends before  {ran[-1]} (" in as_text(traced)
    assert result.job is not None and (result.program is not None) == ("compile" in ran)


def test_a_conversion_that_is_written_has_run_them_all() -> None:
    path, found = toolpaths.read_bytes(CL)
    result = convert(path, machines.load("mill-3axis"), options=Options(), diagnostics=found)
    traced, _ = trace_line(result, 5)
    assert result.ok and all(one["done"] for one in traced["stages"]) and "ends before" not in as_text(traced)


def test_the_readme_lists_the_stages() -> None:
    text = " ".join(README.read_text("utf-8").split())
    assert f"stages: {', '.join(stage.name for stage in STAGES)}." in text
