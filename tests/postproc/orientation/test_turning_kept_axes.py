"""Why cuts keep their axes, each reason by itself, and that a cone which is not used is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from postproc.base.options import Options
from postproc.orientation.turning.cutting_runs import runs_of
from postproc.orientation.turning.turning_report import unused
from postproc.pipeline.convert import convert
from postproc.setup.orientation import OrientationLimits
from tests.postproc.kit import machine
from tests.postproc.orientation.turning_cases import OPTIONS, only_run, swing, with_cone
from toolpaths.arrays import Floats
from toolpaths.smoothing.smooth import Tolerance
from toolpaths.toolpath import Role
from toolpaths.units import DEG


def changed(values: Floats, at: int, to: float) -> Floats:
    """A copy with another value at one place."""
    made = np.array(values)
    made[at] = to
    return made


@pytest.mark.parametrize(("column", "at", "to", "why"), [
    ("tool", 8, 7, "not one cut"), ("hole", 1, 0, "begins at a hole"), ("spin", 8, 0.2, "held about its axis"),
    ("role", 9, Role.CUBIC, "splines that the control runs itself")])
def test_what_a_cut_is_of_keeps_its_axes(column: str, at: int, to: float, why: str) -> None:
    """A row of another tool, a cut from a hole on, a tool held about its axis, a spline: each with its own reason."""
    work, run = only_run(swing(), with_cone())
    assert not run.fixed and run.rows[0] == 2
    if column == "role":
        work = replace(work, toolpath=replace(work.toolpath, role=changed(work.toolpath.role, at, to)))
    else:
        work = replace(work, moves=replace(work.moves, **{column: changed(getattr(work.moves, column), at, to)}))
    found = runs_of(work, Tolerance(OPTIONS.tolerance, OPTIONS.axis_tolerance * DEG), 1.0)
    assert any(why in one.fixed for one in found), [one.fixed for one in found]


def test_operations_and_criteria_that_keep_axes() -> None:
    """Fixed by the set-up, and limited by an installed package, whose limit is of one axis for a whole pass."""
    path = swing()
    name = path.operations[-1].name
    assert f"keeps the axis of operation {name!r}" in only_run(path, with_cone(fixed_operations=(name,)))[1].fixed
    work, _ = only_run(path, with_cone())
    limits = work.setup.orientation.model_copy(update={"criteria": {"package": {}}})
    limited = replace(work, setup=work.setup.model_copy(update={"orientation": limits}))
    found = runs_of(limited, Tolerance(OPTIONS.tolerance, OPTIONS.axis_tolerance * DEG), 1.0)
    assert "packages limit its axis" in found[0].fixed


@pytest.mark.parametrize("plan", ["per-pass", "whole-part"])
def test_a_cone_that_a_plan_does_not_use_is_said(plan: str) -> None:
    limits = with_cone().orientation
    note, = unused(limits, f"--orient {plan} is of 3+2 passes alone", "")
    assert note.code == "orient.cone_unused" and plan in note.message
    assert not unused(OrientationLimits(), "", "")
    made = convert(swing(cuts=1), machine("mikron-ucp710"), "generic-iso", with_cone(), Options(orient=plan))
    assert "orient.cone_unused" in {one.code for one in made.diagnostics}
