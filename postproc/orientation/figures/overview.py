"""The part: plans side by side, the angles of the passes, what they gain."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from postproc.base.options import Orientation
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.plans import OrientationPlan
from postproc.orientation.plans.shares import shares_of
from postproc.orientation.report.figures_of_choice import NAMES, gain
from toolpaths.arrays import Floats
from toolpaths.drawing import ADJACENT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MANY = 60
"""passes beyond which lines take the place of marks"""


def plan_panel(place: Axes, choice: OrientationChoice) -> None:
    """Bars: cutting, turning and other seconds of each plan."""
    plans: dict[str, OrientationPlan] = {**{name: choice.plans[name] for name in NAMES},
                                         "vertex-aligned\nper pass": choice.paper}
    parts = [shares_of(plan) for plan in plans.values()]
    left = np.zeros(len(parts))
    for name, colour in (("cutting", "#1f5f8b"), ("turning", "#d08a3c"), ("other", "#bbbbbb")):
        width = np.nan_to_num([getattr(one, name) for one in parts], posinf=0.0, neginf=0.0)
        place.barh(list(plans), width, left=left, color=colour, label=DIRECTIONS[name])
        left += width
    before = choice.plans["keep"].seconds
    for k, (plan, one) in enumerate(zip(plans.values(), parts, strict=True)):
        saved = gain(plan.seconds, before)
        place.annotate(_noted(plan.seconds, saved, one.turns), (left[k], k), xytext=(4, 0), textcoords="offset points",
                       va="center", fontsize="small")
    place.invert_yaxis()
    place.set_xlim(0.0, 1.42 * max(float(left.max()), 1e-9))
    place.set_xlabel("seconds of the whole part")
    place.set_title("plans: keep, the axes of the CL file; vertex-aligned, "
                    "a vertex of the polytope in the cut",
                    fontsize="medium")
    place.grid(False, axis="y")
    place.legend(**ADJACENT)


def _noted(seconds: float, saved: float | None, turns: int) -> str:
    """Behind a bar."""
    if not np.isfinite(seconds):
        return "cannot be run"
    adjacent = "" if saved is None or abs(saved) < 0.05 else f", {abs(saved):.1f} % {'less' if saved > 0.0 else 'more'}"
    return f"{seconds:.1f} s{adjacent}, {turns} turns"


DIRECTIONS = {"cutting": "cutting", "turning": "turning: back,\nindex, approach", "other": "rapids, home,\ntool changes"}


def angle_panel(place: Axes, choice: OrientationChoice, plan: Orientation) -> None:
    """Rotary positions of the passes, those of the CL file next to."""
    picked = choice.plans[plan].picked
    number = np.arange(len(picked))
    for name, colour in zip(picked[0].rotary(), COLOURS, strict=False):
        own = _angles([one.own for one in choice.tried], name)
        place.plot(number, own, color=colour, linestyle=":", linewidth=1.0, drawstyle="steps-mid",
                   label=f"{name}, CL file")
        place.plot(number, _angles(picked, name), color=colour, linewidth=1.0, drawstyle="steps-mid",
                   marker=_mark(len(picked)), markersize=4.0, label=f"{name}, {plan}")
    place.set_xlim(-0.5, len(picked) - 0.5)
    unit = "degrees" if any(choice.work.machine.rotary) else "i, j, k of the tool"
    _labelled(place, "pass", unit, f"orientation of each pass: {plan}")
    (low, high), flat = place.get_ylim(), FLAT if any(choice.work.machine.rotary) else 2.2
    if high - low < flat:
        place.set_ylim(0.5 * (low + high - flat), 0.5 * (low + high + flat))
    place.legend(**ADJACENT)


FLAT = 10.0
"""least height of the panel of angles, degrees"""
COLOURS = ("#1f5f8b", "#c2453a", "#3f8f4f")


def gain_panel(place: Axes, choice: OrientationChoice, plan: Orientation) -> None:
    """Percent of the cut's time saved in each pass: the best found, the paper's choice, the plan."""
    tried, picked = choice.tried, choice.plans[plan].picked
    own = np.array([one.own.seconds for one in tried])
    number = np.arange(len(own))
    sets = {"best of the pass": np.array([one.best.seconds for one in tried]),
            "vertex-aligned": np.array([np.inf if one.aimed is None else one.aimed.seconds for one in tried]),
            plan: np.array([made.seconds for made in picked])}
    for (name, made), mark, colour in zip(sets.items(), ("*", "^", "o"), ("#3f8f4f", "#7a4fa0", "#1f5f8b"),
                                          strict=True):
        place.plot(number, _saved(made, own), label=name, marker=mark if len(own) <= MANY else "", markersize=5.0,
                   linestyle="-" if len(own) > MANY or name == plan else "", linewidth=1.0, color=colour, alpha=0.8)
    fixed = [k for k, one in enumerate(tried) if one.own.one.fixed]
    if fixed:
        place.plot(fixed, np.zeros(len(fixed)), linestyle="", marker="x", markersize=5.0, color="gray",
                   label="axis is kept")
    alone = np.flatnonzero(~np.isfinite(own))
    if len(alone):
        place.plot(alone, np.zeros(len(alone)), linestyle="", marker="+", markersize=7.0, color="#c2453a",
                   label="CL file's own\ncannot be run")
    place.set_xlim(-0.5, len(own) - 0.5)
    low, high = place.get_ylim()
    place.set_ylim(min(0.0, low), max(1.1 * high, 1.0))
    _labelled(place, "pass", "% of the planned cut", "time saved in each pass, without turns")
    place.legend(**ADJACENT)


def _saved(made: Floats, own: Floats) -> Floats:
    good = np.isfinite(made) & np.isfinite(own) & (own > 0.0)
    return np.where(good, 100.0 * (1.0 - np.where(good, made, 0.0) / np.where(good, own, 1.0)), np.nan)


def _angles(made: tuple[Candidate, ...] | list[Candidate], name: str) -> Floats:
    return np.array([one.rotary().get(name, np.nan) for one in made])


def _mark(count: int) -> str:
    return "o" if count <= MANY else ""


def _labelled(place: Axes, x: str, y: str, title: str) -> None:
    place.set_xlabel(x)
    place.set_ylabel(y)
    place.set_title(title, fontsize="medium")
    place.locator_params(axis="x", integer=True)
