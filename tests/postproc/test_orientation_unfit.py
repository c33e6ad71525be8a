"""Passes and plans that cannot be run: told once for those alike, with what the other axes lost by."""

from __future__ import annotations

from dataclasses import replace

from postproc.options import Options
from postproc.orientation.allowed import Allowed
from postproc.orientation.candidates import tried
from postproc.orientation.orient import orient
from postproc.orientation.passes import Pass, work_of
from postproc.orientation.unfit import unfit
from postproc.setup import SetupFile
from tests.postproc.kit import machine, toolpath
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Severity
from toolpaths.units import DEG

BALL = ["UNITS/MM", "CUTTER/16,8", "LOADTL/1", "SPINDL/RPM,1000,CLW", "FEDRAT/MMPM,30000"]
LINES = ["MULTAX", *(line for k in range(3) for line in (
    "RAPID", f"GOTO/0,{k},9,0,0,1", "RAPID",
    f"GOTO/0,{k},0,0,0,1", f"GOTO/80,{k},0,0,0,1", "RAPID", f"GOTO/80,{k},9,0,0,1"))]


class Everywhere:
    """Bodies that every axis touches, deeper in later passes and where the tool stands upright."""

    def touching(self, one: Pass, axis: Floats) -> str:
        return f"holder of T1 touches fixture vise by {one.number + 1.0 + axis[2]:.2f} mm (at line {one.line})"


def test_passes_that_always_touch_are_one_error() -> None:
    """The deepest stands for all; the others are counted by what they lost by, with the one that touches least."""
    path, m = toolpath(*LINES, head=BALL), machine("mikron-ucp710")
    work, _ = work_of(path, m, SetupFile(), Options())
    assert work is not None
    results = [tried(one, m, Allowed(60.0 * DEG, Everywhere())) for one in work.passes]
    found = unfit(work, results)
    assert [(d.code, d.severity, d.count) for d in found] == [("orient.touches", Severity.ERROR, 3)]
    lost = [each for one in results for each in one.rejected if each.made is not one.own]
    touching = sum(each.kind == "touches" for each in lost)
    least = min(each.made.axis[2] for each in results[0].rejected if each.kind == "touches")
    told = found[0].message
    assert told.startswith("pass 2 and 2 more with the axis of the CL file: holder of T1 touches fixture vise by 4.00 mm")
    assert f"none of {len(lost)} other axes tried can be taken" in told
    assert f"{touching} touches part, fixture or table (the least: holder of T1 touches fixture vise by {1 + least:.2f}" \
        in told


def test_no_plan_is_an_error_that_counts_a_pass_once() -> None:
    """Z ends 10 mm above the only cut: it can be run, and no way to it nor back from it."""
    m = machine("mikron-ucp710")
    upper = m.limits.upper.copy()
    upper[m.axis_names.index("Z")] = 10.0
    choice, found = orient(toolpath(*LINES[:8], head=BALL), replace(m, limits=replace(m.limits, upper=upper)), SetupFile(),
                           Options())
    assert choice is None
    assert [(d.code, d.severity, d.count, d.lines) for d in found] == [("orient.ways", Severity.ERROR, 1, (11,))]
    assert "so that no plan can be run" in found[0].message
