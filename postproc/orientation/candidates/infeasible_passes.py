"""Passes whose own axis cannot be run or touches something, those alike together; where no other axis is left, why."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable

import numpy as np

from postproc.orientation.candidates.candidate_times import Candidate, turned
from postproc.orientation.candidates.rejections import KINDS
from postproc.orientation.candidates.search import PassSearch, Rejection
from postproc.orientation.candidates.travel import MissingTravel, nearest_inside
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.passes import Pass, PassContext
from postproc.orientation.passes.poses import OUT_OF_REACH
from toolpaths.diagnostics import Diagnostic, error, warning
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

REACH = "move or turn the part in the set-up, or run `postproc place`"
_TURN = ("turn the part in the set-up (part.x_axis, part.y_axis) or use another machine: rotary axes stand where they do "
         "wherever the part is")
_APART_FIXED = "check part, fixtures and holder of the set-up, turn the part in it, or take a longer tool"
_APART = "check part, fixtures and holder of the set-up, allow more tilt (--max-tilt) or take a longer tool"
_BY = re.compile(r"(.+) by ([\d.]+) mm")
_BEYOND = re.compile(r"(travel: axis \w+) at .*: ([\d.]+) (too \w+)$")
_SURE = 5.0
"""mm that every axis lacks at least: where it is less, the search decides"""


def out_of_travel(work: PassContext, allowed: AllowedAxes) -> list[Diagnostic]:
    """Errors, before any search, where travel rules out passes whatever their tool axis: of those whose own axis is outside
    alike, the one that is farthest is looked at."""
    alike: dict[tuple[str, str], list[tuple[Pass, str]]] = {}
    for one in work.passes:
        own = turned(one, one.axis, work.machine).refused
        if own.startswith("travel"):
            alike.setdefault((_pair(own), one.fixed), []).append((one, own))
    found = []
    for some in alike.values():
        one, own = max(some, key=lambda each: _depth(each[1]))
        least = nearest_inside(one, work.machine, allowed)
        if _SURE < least.size < np.inf:
            found.append(_hopeless(work, some, one, f"{own}; {_no_other(one, least)}"))
    return found


def _hopeless(work: PassContext, some: list[tuple[Pass, str]], one: Pass, why: str) -> Diagnostic:
    more = f"; the CL's axis is outside alike in {len(some) - 1} more passes" if len(some) > 1 else ""
    lines = [one.line, *(each.line for each, _ in some if each is not one)]
    return error("orient.travel", f"pass {one.number} with the axis of the CL file: {why}{more}", file=work.toolpath.file,
                 lines=lines[:6], count=len(some), hint=_hint(why, one.fixed))


def _no_other(one: Pass, least: MissingTravel) -> str:
    """Why no other axis is left."""
    if one.fixed:
        return f"no other axis is allowed ({one.fixed})"
    return f"no other axis is inside travel, the nearest to it has {least.why.removeprefix('travel: ')}"


def unfit(work: PassContext, results: list[PassSearch]) -> list[Diagnostic]:
    """Warnings where another axis was found, else errors."""
    reached = [one for one in results if not one.own.refused]
    return [*_told(work, [one for one in results if one.own.refused], ("orient.own_reach", "orient.reach"),
                   lambda one: one.own.refused + _off(one.own)),
            *_told(work, [one for one in reached if one.own.touching], ("orient.own_touches", "orient.touches"),
                   lambda one: one.own.touching)]


def _off(own: Candidate) -> str:
    """By how much a serial machine misses an axis that it cannot take at all."""
    if own.refused != OUT_OF_REACH or not own.one.kin.slides_affine:
        return ""
    off = angle_between(own.one.kin.nearest_axis(own.one.axes), own.one.axes)
    return f": the rotary axes bring the tool no nearer to it than {off.max() / DEG:.3f} degrees" if off.max() > 0.0 else ""


def _hint(why: str, fixed: str) -> str:
    """What to do about it."""
    if why.startswith(OUT_OF_REACH) or (why.startswith("travel") and " degrees, " in why):
        return _TURN
    if why.startswith("travel") or "reach" in why:
        return REACH
    return _APART_FIXED if fixed else _APART


def _told(work: PassContext, bad: list[PassSearch], codes: tuple[str, str],
          why: Callable[[PassSearch], str]) -> list[Diagnostic]:
    """One diagnostic per kind; the deepest and the farthest beyond travel stands for all."""
    alike: dict[tuple[bool, str, str], list[PassSearch]] = {}
    for one in bad:
        alike.setdefault((one.best is not one.own, _pair(why(one)), one.own.one.fixed), []).append(one)
    result = []
    for (other, _, fixed), some in alike.items():
        worst = max(some, key=lambda one: _depth(why(one)))
        first = worst.own.one
        more = f" and {len(some) - 1} more" if len(some) > 1 else ""
        left = "" if other else "; " + (f"no other axis is allowed ({fixed})" if fixed else _others(some))
        make, code = (warning, codes[0]) if other else (error, codes[1])
        result.append(make(code, f"pass {first.number}{more} with the axis of the CL file: {why(worst)}{left}",
                           file=work.toolpath.file, lines=[one.own.one.line for one in some][:6], count=len(some),
                           hint=_hint(why(worst), fixed)))
    return result


def _others(some: list[PassSearch]) -> str:
    """What all other axes of passes lost by."""
    lost = [each for one in some for each in one.rejected if each.made is not one.own]
    count = Counter(each.kind for each in lost)
    parts = [f"{count[kind]} {text}" + (_nearest(lost) if kind == "touches" else "")
             for kind, text in KINDS.items() if count[kind]]
    return f"none of {len(lost)} other axes tried can be taken: {', '.join(parts)}" if lost else "no other axis is in reach"


def _nearest(lost: list[Rejection]) -> str:
    """The candidate that touches least."""
    least = min((each.why for each in lost if each.kind == "touches" and _BY.match(each.why)), key=_depth, default="")
    return f" (the least: {least})" if least else ""


def _pair(why: str) -> str:
    """What touches, which axis ends, without by how much and where; another reason as it stands."""
    found, beyond = _BY.match(why), _BEYOND.match(why)
    return f"{beyond[1]} {beyond[3]}" if beyond else found[1] if found else why


def _depth(why: str) -> float:
    """mm that something touches by, mm or degrees that an axis is beyond its travel; 0 where the reason is another."""
    found = _BY.match(why) or _BEYOND.match(why)
    return float(found[2]) if found else 0.0
