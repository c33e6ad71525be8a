"""A sheet: the part as a whole, then passes in full."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from postproc.base.options import Orientation
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.figures.free_rotary import held_panel, is_held
from postproc.orientation.figures.map import axes_map
from postproc.orientation.figures.overview import angle_panel, gain_panel, plan_panel
from postproc.orientation.figures.polytopes import box_panel, order_panel
from postproc.orientation.figures.reach import reach_panel
from postproc.orientation.figures.turned_axes import panels_of, turned_panels
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.report.figures_of_choice import gain
from postproc.orientation.report.text import orientation, percent, seconds
from postproc.orientation.turning.turning_choice import TurningChoice
from toolpaths.choices import FigureEnding
from toolpaths.drawing import image, plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec

WIDTH = 10.0
PART = (2.6, 2.3, 2.3)
"""heights of the panels of the part; all in inches"""
PASS = (0.3, 4.4, 4.4)
"""heights of the headline and the panels of a pass"""


def draw(choice: OrientationChoice, plan: Orientation, passes: Sequence[int], ending: FigureEnding,
         turning: TurningChoice | None = None) -> bytes:
    """An image file of the plans, the passes as `plan` has them, and `passes` (numbers) in full.

    Without numbers the pass that can gain most is drawn.

    Args:
        turning: axes that turn along cuts; the cut that gains most is drawn
        ending: ".png" or ".svg"

    Raises:
        ValueError: for another ending.
    """
    shown = list(passes) or most_gaining(choice)
    title = f"tool orientations of {Path(choice.work.toolpath.file).name} on {choice.work.machine.name}"

    heights = [*PART, *panels_of(turning), *(PASS * len(shown))]
    first = len(heights) - len(PASS) * len(shown)

    def fill(sheet: Figure) -> None:
        grid = sheet.add_gridspec(len(heights), 2, height_ratios=heights)
        _part(sheet, grid, choice, plan)
        if turning is not None:
            turned_panels(sheet, grid, len(PART), turning)
        for k, number in enumerate(shown):
            made = choice.plans[plan].picked[number]
            _pass(sheet, grid, first + len(PASS) * k, choice.tried[number], made, choice.work)

    return image((WIDTH, sum(heights) + 0.4), title, fill, ending)


def most_gaining(choice: OrientationChoice) -> list[int]:
    """The pass that its best orientation saves most of, first of all one that only another can run; none
    where nothing can be turned."""
    saved = [one.own.seconds - one.best.seconds if np.isfinite(one.best.seconds) else 0.0 for one in choice.tried]
    free = [k for k, one in enumerate(choice.tried) if not one.own.one.fixed or one.rejected]
    return [max(free, key=lambda k: saved[k])] if free else []


def _part(sheet: Figure, grid: GridSpec, choice: OrientationChoice, plan: Orientation) -> None:
    plan_panel(sheet.add_subplot(grid[0, :]), choice)
    angle_panel(sheet.add_subplot(grid[1, :]), choice, plan)
    gain_panel(sheet.add_subplot(grid[2, :]), choice, plan)


def _pass(sheet: Figure, grid: GridSpec, row: int, tried: PassSearch, made: Candidate,
          work: PassContext) -> None:
    head = sheet.add_subplot(grid[row, :])
    head.set_axis_off()
    head.text(0.5, 0.0, plain(_headline(tried)), ha="center", fontweight="bold", fontsize="medium",
              transform=head.transAxes)
    box_panel(sheet.add_subplot(grid[row + 1, 0], projection="3d"), tried, work)
    order_panel(sheet.add_subplot(grid[row + 1, 1], projection="3d"), tried, work)
    if is_held(tried):
        held_panel(sheet.add_subplot(grid[row + 2, 0]), tried, made)
    else:
        axes_map(sheet, sheet.add_subplot(grid[row + 2, 0], projection="polar"), tried, made, work)
    reach_panel(sheet.add_subplot(grid[row + 2, 1]), tried, made)


def _headline(tried: PassSearch) -> str:
    one, own = tried.own.one, seconds(tried.own.seconds)
    head = f"pass {one.number}, line {one.line}"
    if one.fixed and not tried.rejected:
        return f"{head}: axis kept, {one.fixed}"
    if tried.best is tried.own:
        return f"{head}: best is the CL file's own orientation, {own} s"
    saved = gain(tried.best.seconds, tried.own.seconds)
    adjacent = ", the CL file's own cannot be run" if saved is None else f" instead of {own} s ({percent(saved)} % less)"
    kept = ", axis kept" if one.fixed else ""
    return f"{head}{kept}: best {orientation(tried.best)}, {seconds(tried.best.seconds)} s{adjacent}"
