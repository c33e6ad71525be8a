"""`keep="summary"` lets go of path and program, and says the same; blocks do not depend on stretches."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

import postproc
import postproc.pipeline.stages as stages
from machines.dynamics_models import DynamicsModel
from postproc.pipeline.result import PostResult
from postproc.pipeline.written_figures import Keep, is_summed_up
from postproc.report.summary import as_dict, as_text
from tests.postproc.kit import TOOLS, few_lines, toolpath
from toolpaths import read_bytes
from toolpaths.diagnostics import error

CASES = (("five_tilted.cls", "mikron-ucp710", "siemens-840d"), ("blade.cls", "mikron-ucp710", "linuxcnc"),
         ("indexed_4axis.cls", "mill-4axis", "fanuc-30i"))


@cache
def made(name: str, machine: str, control: str, keep: Keep = "all") -> PostResult:
    path, found = read_bytes(few_lines(name), file=name)
    return postproc.convert(path, machine, control, TOOLS, diagnostics=found, keep=keep)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case[0])
def test_a_summary_says_the_same_without_path_and_program(case: tuple[str, str, str]) -> None:
    whole, lean = made(*case), made(*case, keep="summary")
    assert whole.ok and whole.path is not None and whole.program is not None and whole.figures is None
    assert lean.path is None and lean.program is None and lean.feeds is None and lean.figures is not None
    assert lean.text == whole.text and lean.diagnostics == whole.diagnostics
    said, of_whole = (as_dict(result, "x") | {"witness": None} for result in (lean, whole))  # which says its seconds
    assert said == of_whole and as_text(lean, "x") == as_text(whole, "x")


def test_all_is_kept_where_the_proof_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    """Refusals and other output modes are worked out on the path."""
    read_back = stages.read_back

    def failing(*given: object, **more: object) -> object:
        comparison, found = read_back(*given, **more)
        return comparison, [*found, error("verify.tip", "off", file="x")]

    monkeypatch.setattr(stages, "read_back", failing)
    path = toolpath("GOTO/0,0,10", "GOTO/10,0,10")
    lean, whole = (postproc.convert(path, "mill-3axis", "fanuc-30i", TOOLS, keep=keep) for keep in ("summary", "all"))
    assert not lean.ok and lean.path is not None and lean.figures is None
    assert lean.diagnostics == whole.diagnostics


def test_all_is_kept_where_a_summary_works_on_the_path() -> None:
    """Planned feeds, moved points, and loads of motors."""
    job = made(*CASES[0]).job
    assert job is not None and is_summed_up(job, job.machine)
    for options in (replace(job.options, feed="planned"), replace(job.options, smooth=True)):
        assert not is_summed_up(replace(job, options=options), job.machine)
    assert not is_summed_up(job, replace(job.machine, dynamics=DynamicsModel()))


def test_the_summary_says_that_moved_points_may_take_longer() -> None:
    plain = made(*CASES[0])
    smooth = replace(plain, options=replace(plain.options, smooth=True))
    gained = set(as_text(smooth, "x").splitlines()) - set(as_text(plain, "x").splitlines())
    assert len(gained) == 1 and "may take longer where points are moved" in gained.pop()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case[0])
def test_blocks_do_not_depend_on_how_many_moves_are_looked_at_together(case: tuple[str, str, str],
                                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("postproc.path.build._STRETCH", 7)
    path, found = read_bytes(few_lines(case[0]), file=case[0])
    assert postproc.convert(path, *case[1:], TOOLS, diagnostics=found).text == made(*case).text
