"""The angles at which a pass may hold the rotary joint that its tool axis leaves free."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.joints.spin import free_joint
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.reaches import least_held
from postproc.orientation.candidates.search import PassSearch, Rejection
from toolpaths.drawing import plain
from toolpaths.units import DEG

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RING = 361
"""angles of the line"""


def is_held(tried: PassSearch) -> bool:
    """Whether held angles are what is to be seen of a pass: its axis is kept, or the best of it holds a joint."""
    angles = [lost for lost in tried.rejected if np.isfinite(lost.made.held)]
    return bool(np.isfinite(tried.best.held) or (tried.own.one.fixed and angles))


def held_panel(place: Axes, tried: PassSearch, made: Candidate) -> None:
    """Seconds over the held angle: the line is the least by the reach, marks are the angles tried."""
    best = tried.best
    joint = free_joint(best.one.kin, best.one.tip[0] + best.one.shift(best.axis), best.axis,
                       best.machine.home)
    name = best.machine.axis_names[joint]
    ring = np.linspace(-np.pi, np.pi, RING)
    place.plot(ring / DEG, least_held(best, joint, ring), color="#999999", linewidth=1.2,
               label="least by the reach")
    timed = [lost for lost in _here(tried) if np.isfinite(lost.made.seconds)]
    rest = [lost for lost in _here(tried) if not np.isfinite(lost.made.seconds)]
    place.plot([_angle(lost.made, joint) for lost in timed], [lost.made.seconds for lost in timed], linestyle="", marker="o",
               markersize=4.5, color="#1f5f8b", label=f"planned ({len(timed)})")
    if rest:
        at = np.array([_angle(lost.made, joint) for lost in rest])
        place.plot(at, least_held(best, joint, at * DEG), linestyle="", marker="d", markersize=4.5, markerfacecolor="white",
                   color="#555555", label=f"not planned: could not be fast enough, or refused ({len(rest)})")
    for it, mark, noted in ((best, "*", "best"), (made, "o", "plan")):
        if np.isfinite(it.seconds):
            place.plot(_angle(it, joint), it.seconds, linestyle="", marker=mark, markersize=12.0, markerfacecolor="none",
                       color="#c2453a", label=noted)
    place.set_xlabel(plain(f"{name} [degrees]"))
    place.set_ylabel("seconds of the cuts")
    place.set_title(f"angles at which {plain(name)} is held: the tool stands along it,\nso that only the polytope turns",
                    fontsize="small")
    place.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2, fontsize="x-small", frameon=False)


def _here(tried: PassSearch) -> list[Rejection]:
    """Rejected candidates with the axis of the best one."""
    return [lost for lost in tried.rejected if lost.made.same(tried.best.axis, lost.made.held)]


def _angle(made: Candidate, joint: int) -> float:
    """Degrees in (-180, 180]."""
    q = float(made.q[int(np.argmin(made.one.rapid)) if len(made.q) > 1 else 0, joint])
    return float(-(np.mod(-q + np.pi, 2.0 * np.pi) - np.pi)) / DEG
