"""Bars: seconds that each order of motion alone takes along the mean direction, beside the planned time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.orientation.candidates import Tried
from postproc.orientation.figures.polytopes import COLOURS, SCALE, SHOWN
from postproc.orientation.reaches import reaches
from postproc.orientation.timed import Turned
from toolpaths.drawing import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HIGH = 0.26
"""of a bar, where an orientation takes 1"""


def reach_panel(place: Axes, tried: Tried, made: Turned) -> None:
    """For the CL's axis, the paper's, the best and the plan's: least seconds of each order, and the planned ones."""
    rows = {"CL axis": tried.own, "paper": tried.aimed, "best": tried.best, "plan": made}
    kept = {name: it for name, it in rows.items() if it is not None}
    for at, it in enumerate(kept.values()):
        for k, one in enumerate(reaches(it)):
            y = at + (k - 1) * HIGH
            place.barh(y, one.seconds, height=0.9 * HIGH, color=COLOURS[one.order], label=one.order if at == 0 else "")
            told = plain(f"{one.rate * SCALE[one.order]:.3g} {SHOWN[one.order]}, {one.axis}")
            behind = max(one.seconds, it.seconds) if abs(one.seconds - it.seconds) < 0.25 * it.seconds else one.seconds
            place.annotate(told, (behind, y), xytext=(4, 0), textcoords="offset points", va="center", fontsize="x-small")
        if np.isfinite(it.seconds):
            place.plot([it.seconds] * 2, [at - 1.6 * HIGH, at + 1.6 * HIGH], color="black", linewidth=1.8,
                       label="planned" if at == 0 else "")
    place.set_yticks(range(len(kept)), list(kept))
    place.set_ylim(len(kept) - 0.4, -0.6)
    place.set_xlim(0.0, 1.28 * max([place.dataLim.x1, 1e-9]))
    place.set_xlabel("seconds: bars, the longest cut by one order alone;\nblack, all cuts as planned", fontsize="small")
    place.set_title("reach along the mean direction, and the joint that ends it", fontsize="small")
    place.grid(False, axis="y")
    place.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=4, fontsize="x-small", frameon=False)
