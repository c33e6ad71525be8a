"""The choice as figures and as text."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from postproc.options import Orientation
from postproc.orientation.orient import OrientationChoice
from postproc.orientation.timed import Turned

NAMES: tuple[Orientation, ...] = ("keep", "per-pass", "whole-part", "auto")


def as_dict(choice: OrientationChoice, plan: Orientation = "auto") -> dict[str, Any]:
    """JSON figures: seconds, degrees; null where the machine cannot run it. Passes as `plan` has them."""
    passes = [{"pass": tried.own.one.number, "line": tried.own.one.line, "fixed": tried.own.one.fixed,
               "orientation_deg": made.rotary(), "time_s": _finite(made.seconds),
               "reference_time_s": _finite(tried.own.seconds),
               "limiting_axis": made.limiting[0], "limiting_order": made.limiting[1],
               "axis": choice.work.placement.inverse().directions(made.axis[None])[0].tolist(),
               "planned": tried.planned, "pruned": tried.pruned,
               "rejected": [{"orientation_deg": _angles(other), "reason": why} for other, why in tried.rejected]}
              for tried, made in zip(choice.tried, choice.plans[plan].picked, strict=True)]
    plans = {name.replace("-", "_"): {"time_s": _finite(choice.plans[name].seconds),
                                      "cutting_s": _finite(sum(made.seconds for made in choice.plans[name].picked)),
                                      "turns": _turns(choice.plans[name].picked)} for name in NAMES}
    plans["paper_per_pass"] = {"time_s": _finite(choice.paper.seconds),
                               "cutting_s": _finite(sum(made.seconds for made in choice.paper.picked)),
                               "turns": _turns(choice.paper.picked)}
    return {"machine": choice.work.machine.name, "passes": passes, "plans": plans}


def as_text(choice: OrientationChoice) -> str:
    """A table of the passes as `auto` has them, and the plans."""
    lines = [f"{'pass':>5} {'line':>7}  {'orientation':<26} {'time s':>9} {'CL axis s':>9} {'gain %':>7}  limited by"]
    for tried, made in zip(choice.tried, choice.plans["auto"].picked, strict=True):
        angles = " ".join(f"{name}{value:.3f}" for name, value in made.rotary().items())
        before = tried.own.seconds
        gain = 100.0 * (1.0 - made.seconds / before) if math.isfinite(before) and before > 0.0 else 0.0
        why = tried.own.one.fixed or " ".join(made.limiting)
        lines.append(f"{tried.own.one.number:>5} {tried.own.one.line:>7}  {angles:<26} {made.seconds:>9.4f} "
                     f"{tried.own.seconds:>9.4f} {gain:>7.2f}  {why}")
    for name in NAMES:
        plan = choice.plans[name]
        lines.append(f"{name:<11} {plan.seconds:10.3f} s, cutting {sum(made.seconds for made in plan.picked):.3f} s, "
                     f"{_turns(plan.picked)} turns")
    return "\n".join(lines)


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _angles(made: Turned) -> dict[str, float | None]:
    return {name: _finite(value) for name, value in made.rotary().items()}


def _turns(picked: tuple[Turned, ...]) -> int:
    """How often the axis changes between passes."""
    return sum(bool(abs(a.axis - b.axis).max() > 1e-6) for a, b in pairwise(picked))
