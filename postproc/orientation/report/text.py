"""The choice for people: the passes as a plan has them, one pass in full, the plans side by side."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from postproc.base.options import Orientation
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.reaches import binding, feed_of, reaches
from postproc.orientation.candidates.rejections import KINDS, grouped, listed, runner_up
from postproc.orientation.candidates.search import PassSearch, Rejection
from postproc.orientation.passes.reasons import RejectionKind
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.plans import OrientationPlan
from postproc.orientation.plans.shares import shares_of, turns
from postproc.orientation.report.figures_of_choice import NAMES, UNITS, control_line, gain
from toolpaths.rotations import angle_between
from toolpaths.table_text import table_text
from toolpaths.units import DEG

SHOWN = 40
"""passes in the table; where there are more, those that gain most"""
REJECTED: dict[RejectionKind, int] = {"slower": 8, "bound": 3, "touches": 4, "travel": 3, "reach": 2, "limits": 3}
"""candidates of a pass in full, by reason"""
_WHYS = 3
"""reasons of the paper's choice missing"""
RUNS = 20
"""lines of the header of a program"""
_HEADS = ("pass", "line", "orientation", "time s", "CL axis s", "gain %", "limited by", "fastest s", "runner-up s",
          "rejected")


def as_text(choice: OrientationChoice, plan: Orientation = "auto", passes: Sequence[int] = ()) -> str:
    """Table of the passes as `plan` has them, `passes` (numbers) in full, and all plans."""
    picked = choice.plans[plan].picked
    rows = list(zip(choice.tried, picked, strict=True))
    shown = sorted(sorted(rows, key=lambda row: _saved(*row))[:SHOWN], key=lambda row: row[0].own.one.number)
    lines = [f"passes as {plan} has them", *table_text([_row(tried, made) for tried, made in shown], _HEADS, "rrlrrrlrrl")]
    if len(rows) > len(shown):
        lines.append(f"      and {len(rows) - len(shown)} passes that gain less; all are in --json")
    for number in passes:
        lines += ["", *_in_full(*rows[number])]
    noted = [line for line in (control_line(choice),) if line]
    return "\n".join([*lines, "", _totals(choice), *_plans(choice), *noted])


def header(choice: OrientationChoice, plan: Orientation, turned: bool = False) -> list[str]:
    """Lines for the header of a program: the plan, what tool axes follow; `turned`: some turn along cuts."""
    picked = choice.plans[plan].picked
    first = [k for k in range(len(picked)) if k == 0 or turns(picked[k - 1], picked[k])]
    lines = [_against(choice, plan, turned),
             f"planned {seconds(choice.plans[plan].seconds)} s, with the axes of the CL file "
             f"{seconds(choice.plans['keep'].seconds)} s"]
    for start, end in list(zip(first, [*first[1:], len(picked)], strict=True))[:RUNS]:
        made, before = (sum(one.seconds for one in some) for some in (
            picked[start:end], [tried.own for tried in choice.tried[start:end]]))
        lines.append(f"pass {start}" + (f" to {end - 1}" if end - start > 1 else "") + f": {orientation(picked[start])}, "
                     f"cuts {seconds(made)} s instead of {seconds(before)} s")
    return lines + ([f"and {len(first) - RUNS} more turns"] if len(first) > RUNS else [])


def _against(choice: OrientationChoice, plan: Orientation, turned: bool) -> str:
    """What the program is proved against."""
    pairs = list(zip(choice.tried, choice.plans[plan].picked, strict=True))
    if turned or any(not one.same(tried.own.axis, one.held) for tried, one in pairs):
        return "proved against the CL file with these axes, its tips moved to keep the ball's contact"
    if any(not one.same(tried.own.axis, tried.own.held) for tried, one in pairs):
        return "proved against the CL file as it is, rotary axes held that the tool axis leaves free"
    return "proved against the CL file as it is: no tool axis was turned"


def _saved(tried: PassSearch, made: Candidate) -> float:
    """Minus the seconds saved: passes that only another axis can run first, those that none can last."""
    return made.seconds - tried.own.seconds if math.isfinite(made.seconds) else math.inf


def orientation(made: Candidate) -> str:
    """Angles in words: "A45.000 C-12.500"."""
    return " ".join(f"{name}{round(value, 3) + 0.0:.3f}" for name, value in made.rotary().items())


def seconds(value: float | None) -> str:
    """Seconds; "-" where there are none."""
    return f"{value:.4f}" if value is not None and math.isfinite(value) else "-"


def percent(value: float | None) -> str:
    """Percent; "-" where there is none."""
    return "-" if value is None else f"{value + 0.0:.2f}"


def _row(tried: PassSearch, made: Candidate) -> tuple[object, ...]:
    one, before = tried.own.one, tried.own.seconds
    if not one.stretches:
        taken = (seconds(value if value > 0.0 else None) for value in (made.seconds, before))
        return (one.number, one.line, orientation(made), *taken, "-", "", "", "",
                f"axis kept: {one.fixed or 'its cuts have no length'}")
    start = (one.number, one.line, orientation(made), seconds(made.seconds), seconds(before),
             percent(gain(made.seconds, before)), " ".join(made.limiting).strip() or "-")
    kept = f"axis kept: {one.fixed}" if one.fixed else ""
    if not tried.rejected:
        return (*start, "", "", kept or "no other orientation in reach")
    after = runner_up(tried)
    beaten = seconds(None if after is None else after.seconds)
    reasons = "; ".join(filter(None, (listed(grouped([tried])), kept)))
    return (*start, seconds(tried.best.seconds), beaten, reasons or "-")


def _in_full(tried: PassSearch, made: Candidate) -> list[str]:
    """One pass: what its orientations reach along the mean direction, and each rejected candidate with its reason."""
    one = tried.own.one
    lines = [f"pass {one.number}, line {one.line}" + (f", axis kept: {one.fixed}" if one.fixed else "")]
    for name, it in _named(tried, made):
        lines += [f"  {name}: {orientation(it)}, {_state(it)}", *_reached(it)]
    lines += [f"  paper: none, {tried.unaimed}"] if tried.unaimed else []
    rejected_starts = sorted(tried.rejected, key=_rank)
    for kind, most in REJECTED.items():
        some = [lost for lost in rejected_starts if lost.kind == kind]
        lines += [f"  lost, {kind}: {orientation(lost.made)}{_off(lost.made)} {lost.why}" for lost in some[:most]]
        lines += [f"  lost, {kind}: {len(some) - most} more, all in --json"] if len(some) > most else []
    return lines


def _state(made: Candidate) -> str:
    """Seconds of an orientation, or why it cannot be run."""
    if made.refused:
        return f"cannot be run ({made.refused})"
    return f"{seconds(made.seconds)} s" + (f", {made.touching}" if made.touching else "")


def _named(tried: PassSearch, made: Candidate) -> list[tuple[str, Candidate]]:
    """The orientations of a pass that have names, each once."""
    names: list[list[str]] = []
    kept: list[Candidate] = []
    for name, it in (("CL axis", tried.own), ("paper", tried.aimed), ("fastest for this pass", tried.best),
                     ("best with its rapids", tried.swift), ("chosen", made)):
        if it is None:
            continue
        k = next((k for k, other in enumerate(kept) if other.same(it.axis, it.held)), len(kept))
        if k == len(kept):
            names.append([])
            kept.append(it)
        names[k].append(name)
    return [(", ".join(some), it) for some, it in zip(names, kept, strict=True)]


def _off(made: Candidate) -> str:
    """By how much a tool is turned off the CL's axis, where its angles do not say it."""
    off = float(angle_between(made.axis, made.one.axis)) / DEG
    return f", {off:.1f} degrees off" if off > 0.05 and sum(made.machine.rotary) < 2 else ""


def _rank(lost: Rejection) -> tuple[float, float]:
    """By time where that is known, then by how far the tool is turned."""
    seconds = lost.made.seconds
    return seconds if math.isfinite(seconds) else math.inf, float(angle_between(lost.made.axis, lost.made.one.axis))


def _reached(made: Candidate) -> list[str]:
    """What each order allows along the mean direction, and which of them alone is slowest."""
    feed = feed_of(made)
    found = (*reaches(made), *(() if feed is None else (feed,)))
    slowest = binding(found)
    if slowest is None:
        return []
    parts = ", ".join(f"{one.order} {one.rate:.0f} {UNITS[one.order]}" + (f" ({one.axis})" if one.axis else "")
                      for one in found)
    return [f"      along the mean direction {parts}; slowest alone: {slowest.order}"]


def _totals(choice: OrientationChoice) -> str:
    """What was tried, over all passes."""
    planned, lost = sum(one.planned for one in choice.tried), grouped(choice.tried)
    reasons = ", ".join(f"{text} {lost[kind]}" for kind, text in KINDS.items() if kind in lost)
    return f"{planned} orientations planned; rejected: {reasons or '-'}"


def _plans(choice: OrientationChoice) -> list[str]:
    every: dict[str, OrientationPlan] = {**{name: choice.plans[name] for name in NAMES},
                                         "vertex-aligned per pass": choice.paper}
    rows = []
    for name, plan in every.items():
        parts = shares_of(plan)
        whole, *others = (f"{value:.3f}" if math.isfinite(value) else "-" for value in
                          (plan.seconds, parts.cutting, parts.turning, parts.other))
        rows.append((name, whole, percent(gain(plan.seconds, choice.plans["keep"].seconds)), *others, parts.turns,
                     "takes what is refused" if plan.touches else ""))
    lines = table_text(rows, ("plan", "time s", "gain %", "cutting s", "turning s", "other s", "turns", ""), "lrrrrrrl")
    return lines + _proof(choice) + _unaimed(choice)


def _proof(choice: OrientationChoice) -> list[str]:
    """Whether the program of the plan that was asked for is written."""
    proof = choice.proof
    if proof is None:
        return []
    said = "refused" if not proof.ok else "proved" if proof.bounded else "checked, not proved"
    return [f"the program of {proof.plan} for {proof.controller} is {said}"]


def _unaimed(choice: OrientationChoice) -> list[str]:
    """Passes in which the paper chooses nothing, by why."""
    count = Counter(one.unaimed for one in choice.tried if one.unaimed)
    return [f"vertex-aligned per pass keeps the CL axis in {number} of {len(choice.tried)} passes: {why}"
            for why, number in count.most_common(_WHYS)]
