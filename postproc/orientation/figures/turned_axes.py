"""A cut whose axis turns, with the CL file's axes and turned: speed and reach along the path, and how far it is turned."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.orientation.turning.reach_along import ReachAlong
from postproc.orientation.turning.turning_choice import RunChoice, TurningChoice
from postproc.orientation.turning.turning_report import most_gaining, reaches
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpec

HEIGHTS = (2.6, 2.3, 1.8)
"""of the panels, inches"""
OWN, TURNED = "#777777", "#1f5f8b"
_ABOVE = 1.15
"""of the highest planned speed: what the axis of speeds shows"""


def turned_panels(sheet: Figure, grid: GridSpec, row: int, choice: TurningChoice) -> None:
    """The panels, from a row of the grid on; nothing where no axis is turned."""
    one = most_gaining(choice)
    found = None if one is None else reaches(choice, one)
    if one is None or found is None:
        return
    _speeds(sheet.add_subplot(grid[row, :]), one, *found)
    _jerks(sheet.add_subplot(grid[row + 1, :]), *found)
    _angles(sheet.add_subplot(grid[row + 2, :]), one)


def panels_of(choice: TurningChoice | None) -> tuple[float, ...]:
    """Heights of the panels that a choice needs."""
    one = None if choice is None else most_gaining(choice)
    drawn = one is not None and choice is not None and bool(np.isfinite(choice.work.machine.limits.jerk).all())
    return HEIGHTS if drawn else ()


def _speeds(place: Axes, one: RunChoice, own: ReachAlong, now: ReachAlong) -> None:
    for reach, colour, name in ((own, OWN, "CL file's axes"), (now, TURNED, "axes turned")):
        place.plot(reach.s, reach.speed, color=colour, label=f"{name}: {reach.seconds:.3f} s")
        place.plot(reach.s, reach.velocity, color=colour, linewidth=0.6, linestyle=":")
    place.set_ylim(0.0, _ABOVE * max(own.speed.max(), now.speed.max()))
    place.set_ylabel("mm/s", fontsize="small")
    place.set_title(f"cut {one.run.number}, line {one.run.line[1]}: planned speed of the ball's centre; dotted, what the "
                    "velocities of the joints allow", fontsize="small")
    place.legend(fontsize="x-small", frameon=False)


def _jerks(place: Axes, own: ReachAlong, now: ReachAlong) -> None:
    for reach, colour in ((own, OWN), (now, TURNED)):
        place.semilogy(reach.s, np.maximum(reach.jerk, 1.0), color=colour, linewidth=0.8)
    place.yaxis.set_major_formatter("{x:.0f}")
    place.yaxis.set_minor_formatter("")
    place.set_ylabel("mm/s3", fontsize="small")
    place.set_title("jerk along the path that the joints leave, at the planned speed and acceleration", fontsize="small")


def _angles(place: Axes, one: RunChoice) -> None:
    place.plot(one.run.s, angle_between(one.run.axis, one.fields[one.taken].axes) / DEG, color=TURNED)
    place.axhline(one.run.cone / DEG, color=OWN, linestyle="--", linewidth=0.8)
    place.set_ylabel("degrees", fontsize="small")
    place.set_xlabel("mm along the cut", fontsize="small")
    place.set_title("by how much the axis is turned, and the cone", fontsize="small")
