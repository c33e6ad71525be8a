"""Bars: seconds that each order of motion alone takes along the mean direction, next to the planned time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.reaches import Reach, feed_of, reaches
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.figures.polytopes import COLOURS, SCALE, SHOWN, short
from toolpaths.drawing import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HIGH = 0.2
"""of a bar, where an orientation takes 1"""


def reach_panel(place: Axes, tried: PassSearch, made: Candidate) -> None:
    """For the CL's axis, the paper's, the best and the plan's: least seconds of each order, and the planned ones."""
    rows = {"CL axis": tried.own, "vertex-aligned": tried.aimed, "best": tried.best, "plan": made}
    kept = {name: it for name, it in rows.items() if it is not None}
    for at, it in enumerate(kept.values()):
        feed = feed_of(it)
        found = (*reaches(it), *(() if feed is None else (feed,)))
        behind = max([it.seconds if np.isfinite(it.seconds) else 0.0, *(one.seconds for one in found)])
        for k, one in enumerate(found):
            _bar(place, one, at + (k - 1.5) * HIGH, behind)
        if np.isfinite(it.seconds):
            place.plot([it.seconds] * 2, [at - 2.1 * HIGH, at + 2.1 * HIGH], color="black", linewidth=1.8,
                       label=_once(place, "planned"))
    place.set_yticks(range(len(kept)), list(kept))
    place.set_ylim(len(kept) - 0.4, -0.6)
    place.set_xlim(0.0, 1.45 * max([place.dataLim.x1, 1e-9]))
    place.set_xlabel("seconds: bars, the longest cut by one limit alone;\nblack, all cuts as planned",
                     fontsize="small")
    place.set_title("reach along the mean direction, and the joint that ends it", fontsize="small")
    place.grid(False, axis="y")
    place.legend(loc="upper center", bbox_to_anchor=(0.45, -0.2), ncols=5, fontsize="x-small", frameon=False,
                 columnspacing=1.0, handlelength=1.4)


def _bar(place: Axes, one: Reach, y: float, behind: float) -> None:
    """One order; its rate stands behind everything else of the orientation."""
    place.barh(y, one.seconds, height=0.9 * HIGH, color=COLOURS[one.order], label=_once(place, one.order))
    joint = f", {one.axis}" if one.axis else ""
    place.annotate(plain(f"{short(one.rate * SCALE[one.order])} {SHOWN[one.order]}{joint}"), (behind, y), xytext=(5, 0),
                   textcoords="offset points", va="center", fontsize="x-small", color=COLOURS[one.order])


def _once(place: Axes, label: str) -> str:
    """A label for the legend, the first time."""
    return "" if label in place.get_legend_handles_labels()[1] else label
