"""Plans next to their programs: where a program is refused the plan avoids what it was refused for, and says it."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from machines.machine import Machine, Timing
from postproc.base.options import Options, Orientation
from postproc.cli.app import app
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.orient import orient
from postproc.orientation.plans.plans import OrientationPlan
from postproc.orientation.plans.shortest_sequence import shortest
from postproc.pipeline import convert as pipeline
from postproc.pipeline.convert import choose_axes
from postproc.pipeline.proved_axes import proved
from postproc.pipeline.result import PostResult
from postproc.setup.model import SetupFile
from tests.benchmarks.bench_orientation_limits import strips
from tests.postproc.kit import machine
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.toolpath import Toolpath

COUNT, POSTED = 8, 12
"""strips: as many as gain by leaning; where a post stands next to them"""
Box = tuple[list[float], list[float]]
POSTS: tuple[Box, ...] = (([-37.0, -127.0, -30.0], [-2.0, -51.0, 292.0]),)
"""next to the part: where the table leans, the tool would pass through it on its path from home"""


def quick() -> Machine:
    """Clamps in no time, so that few passes show what many do."""
    return replace(machine("mikron-ucp710"), timing=Timing(0.0, 0.05, 0.05))


def adjacent(*posts: Box) -> SetupFile:
    fixtures = [{"name": f"post {k}", "box": {"low": low, "high": high}} for k, (low, high) in enumerate(posts)]
    tool = {"gauge_length": 140.0, "flute_length": 30.0, "shank": [{"diameter": 14.0, "length": 40.0}],
            "holder": [{"diameter": 50.0, "length": 70.0}]}
    bodies = {"bodies": {"fixtures": fixtures}} if fixtures else {}
    return SetupFile.model_validate_json(json.dumps(bodies | {"tools": {"1": tool}}))


def converted(path: Toolpath, setup: SetupFile, plan: Orientation = "auto") -> PostResult:
    return pipeline.convert(path, quick(), "linuxcnc", setup, Options(orient=plan))


@cache
def refused() -> tuple[OrientationChoice, PostResult, list[Diagnostic]]:
    """The choice without a proof next to a post, the conversion with one, and what that says of orientations."""
    path, setup = strips([0.0] * POSTED), adjacent(*POSTS)
    choice, _ = orient(path, quick(), setup)
    assert choice is not None
    result = converted(path, setup)
    return choice, result, [d for d in result.diagnostics if d.code.startswith("orient.")]


def test_a_way_that_touches_is_not_taken() -> None:
    unproved, result, noted = refused()
    program = pipeline.convert(unproved.toolpath("auto"), quick(), "linuxcnc", adjacent(*POSTS))
    assert {d.code for d in program.diagnostics if d.severity > 1} == {"collision.touch"}
    assert result.ok and result.choice is not None
    auto, before = result.choice.plans["auto"], unproved.plans["auto"]
    assert before.seconds < auto.seconds < result.choice.plans["keep"].seconds
    assert [d.code for d in noted] == ["orient.passed_over"]
    assert f"{before.seconds:.3f} s, holder of T1 touches fixture post 0 by " in noted[0].message
    assert "on the move to pass 0 (line 10)" in noted[0].message


def test_what_is_barred_is_the_way_and_not_the_axis() -> None:
    """The tool may lean as it did in all passes that it does not come to from home."""
    unproved, result, _ = refused()
    assert result.choice is not None
    table, first = result.choice.table, unproved.plans["auto"]
    assert not any(bar.any() for bar in table.barred[1:-1]) and table.barred[0][0, first.states[0]]
    assert not table.barred[0].all()
    assert shortest(table.costs(), table.links)[1] < shortest(table.costs(), table.open_links())[1] < np.inf


def test_verify_chooses_the_same(tmp_path: Path) -> None:
    _, result, _ = refused()
    file = tmp_path / "p.ngc"
    file.write_text(result.text)
    verified = pipeline.verify(file, strips([0.0] * POSTED), quick(), "linuxcnc", adjacent(*POSTS),
                               Options(orient="auto"))
    assert verified.ok, [str(d) for d in verified.diagnostics]


@pytest.mark.parametrize(("plan", "count"),
                         [("per-pass", 2), pytest.param("whole-part", POSTED, marks=pytest.mark.slow)])
def test_other_plans_avoid_it_too(plan: Orientation, count: int) -> None:
    result = converted(strips([0.0] * count), adjacent(*POSTS), plan)
    assert result.ok and result.choice is not None and not result.choice.plans[plan].barred
    assert "orient.passed_over" in {d.code for d in result.diagnostics}


def test_the_program_that_proved_is_not_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Options] = []
    stages = pipeline._stages

    def counted(start: PostResult, progress: pipeline.Progress | None) -> PostResult:
        made.append(start.options)
        return stages(start, progress)

    monkeypatch.setattr(pipeline, "_stages", counted)
    path, setup = strips([0.0] * 2), adjacent()
    result = converted(path, setup)
    assert result.ok and len(made) == 1 and "planned" in result.text
    planned = pipeline.convert(path, quick(), "linuxcnc", setup,
                               Options(orient="auto", feed="planned", smooth=True))
    assert planned.ok and len(made) == 3 and [one.feed for one in made[1:]] == ["programmed", "planned"]


@cache
def some() -> OrientationChoice:
    """Strips that gain by leaning."""
    choice, _ = orient(strips([0.0] * COUNT), quick(), adjacent())
    assert choice is not None and choice.plans["auto"].states != choice.plans["keep"].states
    return choice


@cache
def good() -> PostResult:
    return converted(strips([0.0] * 2), adjacent())


class Control:
    """A control that refuses programs; `made` are the plans that it saw."""

    def __init__(self, plan: Orientation, once: bool = False, **faults: Diagnostic) -> None:
        self.plan, self.once, self.faults = plan, once, faults
        self.made: list[OrientationPlan] = []

    def __call__(self, choice: OrientationChoice) -> PostResult:
        plan = choice.plans[self.plan]
        self.made.append(plan)
        kept = not any(plan.states)
        if self.once and len(self.made) > 1:
            return good()
        found = [self.faults[name] for name in ("keep" if kept else "turned", "always") if name in self.faults]
        return replace(good(), diagnostics=tuple(found))


def fault(code: str = "travel.outside", *lines: int) -> Diagnostic:
    return error(code, "refused", file="strips.apt", lines=lines)


def test_the_axes_of_the_file_are_what_is_left() -> None:
    control = Control("auto", turned=fault())
    made, found = proved(some(), "auto", control)
    choice = made.choice
    assert choice.plans["auto"].states == (0,) * COUNT and choice.proof is not None and choice.proof.ok and made.program.ok
    assert [d.code for d in found] == ["orient.passed_over"] and "refused" in found[0].message


def test_what_the_file_is_refused_for_is_no_reason_to_choose_again() -> None:
    line = int(some().work.moves.line[5])
    control = Control("auto", always=fault("feed.missing", line))
    made, found = proved(some(), "auto", control)
    choice = made.choice
    assert len(control.made) == 2 and choice.plans["auto"] is some().plans["auto"]
    assert [d.code for d in found] == ["orient.unproved"]
    assert f"auto for linuxcnc is refused: refused (line {line})" in found[0].message


def test_only_auto_becomes_another_plan() -> None:
    made, found = proved(some(), "per-pass", Control("per-pass", turned=fault()))
    choice = made.choice
    assert choice.plans["per-pass"] is some().plans["per-pass"] and [d.code for d in found] == ["orient.unproved"]


@pytest.mark.parametrize(("offset", "whole"), [(0, False), (2, True)])
def test_lines_of_errors_say_what_is_barred(offset: int, whole: bool) -> None:
    """The first rapid of a pass is the path to it: that is barred from where it came. Its cut is the pass:
    however it is come to, it is."""
    one, first = some().work.passes[5], some().plans["auto"]
    line = int(some().work.moves.line[one.rows[0] + offset])
    control = Control("auto", turned=fault("travel.outside", line), once=True)
    made, found = proved(some(), "auto", control)
    choice = made.choice
    barred = choice.table.barred
    assert [k for k, bar in enumerate(barred) if bar.any()] == [5]
    assert bool(barred[5][:, first.states[5]].all()) == whole and barred[5][first.states[4], first.states[5]]
    assert choice.plans["auto"].states[5] != first.states[5] or not whole
    assert [d.code for d in found] == ["orient.passed_over"] and choice.plans["auto"].seconds > first.seconds


def test_the_command_proves_for_a_control(tmp_path: Path) -> None:
    out = tmp_path / "o.json"
    file = tmp_path / "strip.apt"
    file.write_text("\n".join(["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,30000", "MULTAX",
                               "RAPID", "GOTO/0,0,5,0,0,1", "GOTO/0,0,0,0,0,1", "GOTO/80,0,0,0,0,1", "FINI"]))
    arguments = ["orient", str(file), "-m", "mikron-ucp710", "--json", str(out)]
    done = CliRunner().invoke(app, [*arguments, "-c", "fanuc-30i"])
    values = json.loads(out.read_text())
    assert done.exit_code == 0 and (values["controller"], values["proved"]) == ("fanuc-30i", True)
    assert "\nthe program of auto for fanuc-30i is proved" in done.output
    failed = CliRunner().invoke(app, [*arguments, "-c", "fanuk-30i"])
    assert failed.exit_code == 1 and "fanuc-30i" in failed.output


def test_axes_chosen_without_a_program_are_not_proved() -> None:
    """What stands against a program whatever its axes: the plan is reported, and that it is not proved."""
    path = strips([0.0] * 2)
    result = choose_axes(path, quick(), "linuxcnc", Options(orient="auto"), [fault()])
    assert result.choice is None and not result.ok
