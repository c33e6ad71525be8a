"""Passes whose own axis cannot be run or touches something, those alike together; where no other axis is left, why."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable

from postproc.orientation.candidates import Lost, Tried
from postproc.orientation.losers import KINDS
from postproc.orientation.passes import Work
from toolpaths.diagnostics import Diagnostic, error, warning

REACH = "move or turn the part in the set-up, or run `postproc place`"
_APART = "check part, fixtures and holder of the set-up, allow more tilt (--max-tilt) or take a longer tool"
_BY = re.compile(r"(.+) by ([\d.]+) mm")


def unfit(work: Work, results: list[Tried]) -> list[Diagnostic]:
    """Warnings where another axis was found, else errors."""
    return [*_told(work, [one for one in results if one.own.refused], ("orient.own_reach", "orient.reach"), REACH,
                   lambda one: one.own.refused),
            *_told(work, [one for one in results if one.own.touching], ("orient.own_touches", "orient.touches"), _APART,
                   lambda one: one.own.touching)]


def _told(work: Work, bad: list[Tried], codes: tuple[str, str], hint: str, why: Callable[[Tried], str]) -> list[Diagnostic]:
    """One diagnostic per kind; of what touches, the deepest stands for all."""
    alike: dict[tuple[bool, str, str], list[Tried]] = {}
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
                           hint=hint))
    return result


def _others(some: list[Tried]) -> str:
    """What all other axes of passes lost by."""
    lost = [each for one in some for each in one.rejected if each.made is not one.own]
    count = Counter(each.kind for each in lost)
    parts = [f"{count[kind]} {text}" + (_nearest(lost) if kind == "touches" else "")
             for kind, text in KINDS.items() if count[kind]]
    return f"none of {len(lost)} other axes tried can be taken: {', '.join(parts)}" if lost else "no other axis is in reach"


def _nearest(lost: list[Lost]) -> str:
    """The candidate that touches least."""
    least = min((each.why for each in lost if each.kind == "touches" and _BY.match(each.why)), key=_depth, default="")
    return f" (the least: {least})" if least else ""


def _pair(why: str) -> str:
    """What touches, without by how much and where; another reason as it stands."""
    found = _BY.match(why)
    return found[1] if found else why


def _depth(why: str) -> float:
    """mm that something touches by; 0 where the reason is another."""
    found = _BY.match(why)
    return float(found[2]) if found else 0.0
