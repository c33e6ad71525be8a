"""Passes whose own axis cannot be run or touches something, those alike together; where no other axis is left, why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from postproc.orientation.candidates.candidate_times import Candidate, turned
from postproc.orientation.candidates.rejections import KINDS
from postproc.orientation.candidates.search import PassSearch, Rejection
from postproc.orientation.candidates.travel import MissingTravel, nearest_inside
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.passes import Pass, PassContext
from postproc.orientation.passes.reasons import Refusal, Touching
from toolpaths.diagnostics import Diagnostic, error, warning
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

REACH = "move or turn the part in the set-up, or run `postproc place`"
_TURN = ("turn the part in the set-up (part.x_axis, part.y_axis) or use another machine: rotary axes stand where they do "
         "wherever the part is")
_APART_FIXED = "check part, fixtures and holder of the set-up, turn the part in it, or take a longer tool"
_APART = "check part, fixtures and holder of the set-up, allow more tilt (--max-tilt) or take a longer tool"
_SURE = 5.0
"""mm that every axis lacks at least: where it is less, the search decides"""


def out_of_travel(work: PassContext, allowed: AllowedAxes) -> list[Diagnostic]:
    """Errors, before any search, where travel rules out passes whatever their tool axis: of those whose own
    axis is outside alike, the one that is farthest is looked at."""
    alike: dict[tuple[object, str], list[tuple[Pass, Refusal]]] = {}
    for one in work.passes:
        own = turned(one, one.axis, work.machine).refused
        if own is not None and own.kind == "travel":
            alike.setdefault((own.alike, one.fixed), []).append((one, own))
    found = []
    for some in alike.values():
        one, own = max(some, key=lambda each: each[1].depth)
        least = nearest_inside(one, work.machine, allowed)
        if _SURE < least.size < np.inf:
            rotary = own.rotary or (not one.fixed and least.why is not None and least.why.rotary)
            found.append(_hopeless(work, some, one, f"{own}; {_no_other(one, least)}", _TURN if rotary else REACH))
    return found


def _hopeless(work: PassContext, some: list[tuple[Pass, Refusal]], one: Pass, why: str,
              hint: str) -> Diagnostic:
    more = f"; the CL's axis is outside alike in {len(some) - 1} more passes" if len(some) > 1 else ""
    lines = [one.line, *(each.line for each, _ in some if each is not one)]
    return error("orient.travel", f"pass {one.number} with the axis of the CL file: {why}{more}", file=work.toolpath.file,
                 lines=lines[:6], count=len(some), hint=hint)


def _no_other(one: Pass, least: MissingTravel) -> str:
    """Why no other axis is left."""
    if one.fixed:
        return f"no other axis is allowed ({one.fixed})"
    return f"no other axis is inside travel, the nearest to it has {least.why.place if least.why else ''}"


def unfit(work: PassContext, results: list[PassSearch]) -> list[Diagnostic]:
    """Warnings where another axis was found, else errors."""
    reached = [one for one in results if not one.own.refused]
    return [*_noted(work, [one for one in results if one.own.refused], ("orient.own_reach", "orient.reach"),
                    lambda one: _missing(one.own)),
            *_noted(work, [one for one in reached if one.own.touching], ("orient.own_touches", "orient.touches"),
                    lambda one: one.own.touching)]


def _missing(own: Candidate) -> Refusal | None:
    """Why a pass cannot be run, with the angle by which a serial machine misses an axis that it cannot take at all."""
    if own.refused is None or own.refused.kind != "reach" or not own.one.kin.straight_slides:
        return own.refused
    off = angle_between(own.one.kin.nearest_axis(own.one.axes), own.one.axes)
    return replace(own.refused, missing=float(off.max()) / DEG)


def _hint(why: Refusal | Touching, fixed: str) -> str:
    """What to do about it."""
    if isinstance(why, Touching):
        return _APART_FIXED if fixed else _APART
    return _TURN if why.rotary else REACH


def _noted(work: PassContext, bad: list[PassSearch], codes: tuple[str, str],
           why: Callable[[PassSearch], Refusal | Touching | None]) -> list[Diagnostic]:
    """One diagnostic per kind; the deepest and the farthest beyond travel stands for all."""
    alike: dict[tuple[bool, object, str], list[tuple[PassSearch, Refusal | Touching]]] = {}
    for one in bad:
        if (reason := why(one)) is not None:
            alike.setdefault((one.best is not one.own, reason.alike, one.own.one.fixed), []).append((one, reason))
    result = []
    for (other, _, fixed), same in alike.items():
        worst, reason = max(same, key=lambda each: each[1].depth)
        some, first = [one for one, _ in same], worst.own.one
        more = f" and {len(some) - 1} more" if len(some) > 1 else ""
        left = "" if other else "; " + (f"no other axis is allowed ({fixed})" if fixed else _others(some))
        make, code = (warning, codes[0]) if other else (error, codes[1])
        result.append(make(code, f"pass {first.number}{more} with the axis of the CL file: {reason}{left}",
                           file=work.toolpath.file, lines=[one.own.one.line for one in some][:6], count=len(some),
                           hint=_hint(reason, fixed)))
    return result


def _others(some: list[PassSearch]) -> str:
    """What all other axes of passes were rejected for."""
    lost = [each for one in some for each in one.rejected if each.made is not one.own]
    count = Counter(each.kind for each in lost)
    parts = [f"{count[kind]} {text}" + (_nearest(lost) if kind == "touches" else "")
             for kind, text in KINDS.items() if count[kind]]
    return f"none of {len(lost)} other axes tried can be taken: {', '.join(parts)}" if lost else "no other axis is in reach"


def _nearest(lost: list[Rejection]) -> str:
    """The candidate that touches least."""
    touching = [each.why for each in lost if isinstance(each.why, Touching)]
    return f" (the least: {min(touching, key=lambda why: why.depth)})" if touching else ""
