"""A layout that was found as a machine file, and a front of layouts as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from machines.analysis.extremes import MEASURES, largest_over, rates_over
from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.legs.drives import Drives
from machines.layouts.choices import Goal
from machines.layouts.forms import FORMS
from machines.layouts.search import (
    LayoutFound,
    LayoutQuestion,
    best,
    box_grid,
    contracted,
    extents,
    front,
    geometry,
    slides_of,
)
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import DiagnosticError, error
from toolpaths.drawing import image

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPARE, GRID = 20.0, (9, 9, 9, 1)
"""mm of travel beyond what the box needs; places at which it is looked at"""
WORDS: dict[Goal, str] = {"condition": "condition number", "bulk": "larger extent across z, mm",
                          "width": "smaller extent across z, mm", "speed": "drive speed per speed", "rod": "rods, mm"}


@dataclass(frozen=True)
class Design:
    """What was asked and found, and the front where one was asked for."""

    asked: LayoutQuestion
    found: LayoutFound
    front: tuple[LayoutFound, ...] = ()

    @property
    def text(self) -> str:
        """A machine file."""
        return machine_file(self.asked, self.found)

    @property
    def figures(self) -> dict[str, Any]:
        """Dimensions, figures over the box, the condition number proved."""
        asked, found = self.asked, self.found
        proved = largest_over(rates_over(geometry(asked, found.numbers, found.rod), 0.0), MEASURES["condition_number"])
        slides = slides_of(asked, found.numbers)
        size = extents(slides, contracted(slides, found.rod, box_grid(asked))[1])
        return {
            "layout": asked.layout, "box_mm": asked.box.tolist(), "platform_radius_mm": asked.platform, "goal": asked.goal,
            **{f"{name}_mm": value for name, value in found.numbers.items()}, "rod_mm": found.rod,
            "slides_through_mm": slides.points.tolist(),
            "condition_number": found.figures["condition"], "condition_number_nowhere_more_than": proved.most,
            "speed_transmission": found.figures["speed"], "extent_across_z_mm": found.figures["bulk"],
            "extents_mm": dict(zip("xyz", size.tolist(), strict=True)), "front": [_row(one) for one in self.front]}


def design(asked: LayoutQuestion, against: Goal | None = None, points: int = 7) -> Design:
    """The best dimensions of a layout.

    Raises:
        DiagnosticError: where no dimensions keep the limits.
    """
    found = best(asked)
    if found is None:
        limits = ", ".join(f"{key} {most:g}" for key, most in asked.limits.items()) or "none"
        raise DiagnosticError([error("design.none", f"no {asked.layout} layout was found for a box of "
                                     f"{' x '.join(f'{v:g}' for v in asked.box)} mm within the limits ({limits})",
                                     hint="loosen --max, or try another --layout")])
    return Design(asked, found, tuple(front(asked, against, points)) if against is not None else ())


def _row(one: LayoutFound) -> dict[str, float]:
    return {**{f"{name}_mm": value for name, value in one.numbers.items()}, "rod_mm": one.rod,
            "condition_number": one.figures["condition"], "extent_across_z_mm": one.figures["bulk"],
            "smaller_extent_across_z_mm": one.figures["width"], "speed_transmission": one.figures["speed"]}


def machine_file(asked: LayoutQuestion, found: LayoutFound) -> str:
    """A machine file of kind legs; dynamics are assumed, travel is what the box needs."""
    legs = geometry(asked, found.numbers, found.rod)
    place, _ = legs.workspace.grid(GRID)
    drives = Drives(legs.points, legs.directions, legs.lengths, legs.roots, legs.arms, legs.slide, legs.arm)
    q = drives.solve(np.concatenate([place, np.zeros((1, 3))])[:, None] + legs.joints, legs.roots)
    low, high = np.floor(q.min(axis=0) - SPARE), np.ceil(q.max(axis=0) + SPARE)
    half = (0.5 * asked.box).tolist()
    ring = FORMS[asked.layout].ring
    lines = [
        f'description = "{asked.layout} layout for {" x ".join(map(str, asked.box))} mm, dimensions by machine design"', "",
        "[kinematics]", 'kind = "legs"', 'freedoms = ["x", "y", "z"]', "",
        *(_leg_lines(legs) if ring is None else _ring_lines(asked, found, ring)), "[kinematics.workspace]",
        *(f"{letter} = [{-v:g}, {v:g}]" for letter, v in zip("xyz", half, strict=True)), ""]
    for k, letter in enumerate(legs.names):
        lines += [f"[axes.{letter}]", f"travel = [{low[k]:g}, {high[k]:g}]", "velocity = 1000", "acceleration = 10000",
                  "jerk = 100000", f"home = {q[-1, k]:.3f}", 'assumed = ["travel", "velocity", "acceleration", "jerk"]', ""]
    lines += ["[timing]", "tool_change = 5", "clamp = 0", "unclamp = 0", 'assumed = ["tool_change", "clamp", "unclamp"]']
    return "\n".join(lines) + "\n"


def _ring_lines(asked: LayoutQuestion, found: LayoutFound, lean: float) -> list[str]:
    return ["[kinematics.layout]", 'form = "star"', 'drive = "slide"', 'letters = ["X", "Y", "Z"]',
            f"radius = {found.numbers.get('radius', 0.0) + asked.platform:.6f}",
            f"height = {found.numbers.get('height', 0.0):.6f}", f"lean = {lean:g}", f"joint_radius = {asked.platform:.6f}",
            f"rod = {found.rod:.6f}", f"pair = {2.0 * asked.platform:.6f}", ""]


def _leg_lines(legs: LegGeometry) -> list[str]:
    def row(v: Floats) -> str:
        return f"[{', '.join(f'{x + 0.0:.6f}' for x in v)}]"

    lines = []
    for k, letter in enumerate(legs.names):
        half = 0.5 * legs.pairs[k]
        lines += [f"[kinematics.legs.{letter}]", 'drive = "slide"', f"point = {row(legs.points[k])}",
                  f"direction = {row(legs.directions[k])}", f"joint = {row(legs.joints[k])}", f"rod = {legs.lengths[k]:.6f}",
                  f"root = {legs.roots[k]:.0f}", f"rods = [{row(half)}, {row(-half)}]", ""]
    return lines


def front_figure(asked: LayoutQuestion, against: Goal, found: Sequence[LayoutFound], ending: FigureEnding) -> bytes:
    """The front: the goal against the other figure, speed as colour, rods written at each machine."""
    def fill(sheet: Figure) -> None:
        axes = sheet.subplots()
        x, y = ([one.figures[key] for one in found] for key in (against, asked.goal))
        dots = axes.scatter(x, y, c=[one.figures["speed"] for one in found], cmap="viridis", zorder=3)
        axes.plot(x, y, color="#8899aa", linewidth=1)
        for one, a, b in zip(found, x, y, strict=True):
            axes.annotate(f"L {one.rod:.0f}", (a, b), xytext=(4, 4), textcoords="offset points", fontsize=7)
        sheet.colorbar(dots, label=WORDS["speed"])
        axes.set_xlabel(WORDS[against])
        axes.set_ylabel(WORDS[asked.goal])

    title = f"{asked.layout}, box {' x '.join(f'{v:g}' for v in asked.box)} mm: {WORDS[asked.goal]} against {WORDS[against]}"
    return image((8.0, 6.0), title, fill, ending)
