"""The choice as JSON figures: seconds, millimetres, degrees; null where the machine cannot run something."""

from __future__ import annotations

import math
from typing import Any

from postproc.base.options import Orientation
from postproc.base.program_time import ProgramTime
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.reaches import binding, feed_of, reaches
from postproc.orientation.candidates.rejections import grouped, runner_up
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.plans import OrientationPlan
from postproc.orientation.plans.shares import shares_of
from toolpaths.arrays import finite
from toolpaths.diagnostics import Diagnostic, warning
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

NAMES: tuple[Orientation, ...] = ("keep", "per-pass", "whole-part", "auto")


def as_dict(choice: OrientationChoice, plan: Orientation = "auto") -> dict[str, Any]:
    """The keys of `orient --json`; passes as `plan` has them."""
    picked, keep = choice.plans[plan].picked, choice.plans["keep"].seconds
    plans = {name.replace("-", "_"): _plan(choice.plans[name], keep) for name in NAMES}
    proof = choice.proof
    return {"machine": choice.work.machine.name, "plan": plan, "controller": proof.controller if proof else None,
            "proved": proof.ok and proof.bounded if proof else None,
            "on_the_control": on_the_control(choice),
            "passes": [_pass(tried, made, choice.work) for tried, made in zip(choice.tried, picked, strict=True)],
            "plans": plans | {"paper_per_pass": _plan(choice.paper, keep)}}


def chosen(choice: OrientationChoice, plan: Orientation) -> dict[str, Any]:
    """What a conversion says about its tool axes: the plan, its seconds, and each pass."""
    picked = choice.plans[plan].picked
    passes = [{"pass": tried.own.one.number, "line": tried.own.one.line, "fixed": tried.own.one.fixed,
               "axis": axis_of(made, choice.work), "orientation_deg": angles(made), "held_deg": held(made),
               "time_s": finite(made.seconds), "reference_time_s": finite(tried.own.seconds)}
              for tried, made in zip(choice.tried, picked, strict=True)]
    return {"plan": plan, "time_s": finite(choice.plans[plan].seconds),
            "reference_time_s": finite(choice.plans["keep"].seconds),
            "on_the_control": on_the_control(choice),
            "turned": sum(not made.same(tried.own.axis, tried.own.held)
                          for tried, made in zip(choice.tried, picked, strict=True)), "passes": passes}


def on_the_control(choice: OrientationChoice) -> dict[str, Any] | None:
    """Times of the programs of "keep" and "auto" on the control; None where they are not known."""
    if not choice.programs:
        return None
    return {"model": next(iter(choice.programs.values())).model, "gain_percent": choice.gain,
            **{name: {"time_s": one.seconds, "band_s": list(one.band)} for name, one in choice.programs.items()}}


def control_line(choice: OrientationChoice) -> str:
    """The same for people; "" where nothing is known."""
    keep, auto = choice.programs.get("keep"), choice.programs.get("auto")
    if auto is None:
        return ""
    said = f"on the control ({auto.model}): auto {_with_band(auto)}"
    if keep is None:
        return said + "; with the axes of the CL file no program is written"
    gained = "nothing gained" if not choice.gain else f"{choice.gain:.1f} % gained"
    noted = ", within the model's uncertainty" if 0.0 < keep.seconds - auto.seconds < auto.uncertainty else ""
    return f"{said}, with the axes of the CL file {_with_band(keep)}: {gained}{noted}"


def _with_band(one: ProgramTime) -> str:
    return f"{one.seconds:.2f} s (95 % {one.band[0]:.2f} to {one.band[1]:.2f} s)"


def slower(choice: OrientationChoice, plan: Orientation) -> list[Diagnostic]:
    """A warning where a plan takes longer than the axes of the CL file."""
    made, before = choice.plans[plan].seconds, choice.plans["keep"].seconds
    if not made > before or (plan == "auto" and choice.programs):
        return []
    return [warning("orient.slower", f"{plan} takes {made:.3f} s, the axes of the CL file {before:.3f} s: turning between "
                    "passes costs more than it gives", file=choice.work.toolpath.file,
                    hint="nothing is to be done: --orient auto is never slower than any other")]


def gain(made: float, before: float) -> float | None:
    """Percent of `before` saved; None where one of them is no time."""
    return 100.0 * (1.0 - made / before) if math.isfinite(made) and math.isfinite(before) and before > 0.0 else None


def angles(made: Candidate) -> dict[str, float | None]:
    """Rotary positions, degrees."""
    return {name: finite(value) for name, value in made.rotary().items()}


def held(made: Candidate) -> float | None:
    """The angle asked for of the rotary joint that the tool axis leaves free, degrees; None where none is."""
    return finite(made.held / DEG)


def axis_of(made: Candidate, work: PassContext) -> list[float]:
    """The tool axis in the frame of the CL file."""
    axis: list[float] = work.placement.inverse().directions(made.axis[None])[0].tolist()
    return axis


def _pass(tried: PassSearch, made: Candidate, work: PassContext) -> dict[str, Any]:
    one = tried.own.one
    return {"pass": one.number, "line": one.line, "fixed": one.fixed,
            "orientation_deg": angles(made), "held_deg": held(made),
            "time_s": finite(made.seconds), "reference_time_s": finite(tried.own.seconds),
            "gain_percent": gain(made.seconds, tried.own.seconds),
            "limiting_axis": made.limiting[0], "limiting_order": made.limiting[1],
            "axis": axis_of(made, work), "turned_deg": float(angle_between(made.axis, one.axis)) / DEG,
            "planned": tried.planned, "pruned": tried.pruned, "lost": grouped([tried]),
            "own": _short(tried.own), "best": _short(tried.best), "swift": _short(tried.swift), "paper": _short(tried.aimed),
            "paper_missing": str(tried.unaimed or ""),
            "next_best": _short(runner_up(tried)),
            "reach": {name: _reach(it) for name, it in (("own", tried.own), ("paper", tried.aimed), ("chosen", made))
                      if it is not None},
            "rejected": [{"orientation_deg": angles(other), "kind": kind, "reason": str(why)}
                         for other, why, kind in tried.rejected]}


def _short(made: Candidate | None) -> dict[str, Any] | None:
    """An orientation and its planned time."""
    return None if made is None else {"orientation_deg": angles(made), "held_deg": held(made),
                                      "time_s": finite(made.seconds), "touches": str(made.touching or "")}


def _reach(made: Candidate) -> dict[str, Any]:
    """What each order and the feed allow along the mean direction, and which of them alone takes longest."""
    found, feed = reaches(made), feed_of(made)
    every = found if feed is None else (*found, feed)
    slowest = binding(every)
    rates = {one.order: {"rate": one.rate, "unit": UNITS[one.order], "axis": one.axis, "least_s": one.seconds}
             for one in every}
    return rates | {"slowest": None if slowest is None else slowest.order}


UNITS = {"velocity": "mm/s", "acceleration": "mm/s2", "jerk": "mm/s3", "feed": "mm/s"}


def _plan(plan: OrientationPlan, keep: float) -> dict[str, Any]:
    parts = shares_of(plan)
    return {"time_s": finite(plan.seconds), "gain_percent": gain(plan.seconds, keep),
            "cutting_s": finite(parts.cutting), "turning_s": finite(parts.turning), "other_s": finite(parts.other),
            "turns": parts.turns}
