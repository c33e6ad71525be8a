"""The journey: passes -> candidates of each -> plans keep, per pass, whole part, auto -> the toolpath with new axes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from machines.machine import Machine
from postproc.collision.passes import pass_bodies
from postproc.options import Options, Orientation
from postproc.orientation.allowed import Allowed
from postproc.orientation.candidates import Tried, tried
from postproc.orientation.limited import limit_faults
from postproc.orientation.passes import Pass, Work, work_of
from postproc.orientation.plans import OrientationPlan, plans_of
from postproc.orientation.ranking import prepare
from postproc.orientation.reoriented import reoriented
from postproc.orientation.rounds import PassFault, Progress, each_pass
from postproc.setup import SetupFile
from toolpaths.diagnostics import Diagnostic, error, has_errors, warning
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG

_REACH = "move or turn the part in the set-up, or run `postproc place`"
_APART = "check part, fixtures and holder of the set-up, allow more tilt (--max-tilt) or take a longer tool"


@dataclass(frozen=True)
class OrientationChoice:
    """What was found: per pass what was tried, and the plans side by side.

    Attributes:
        paper: the paper's choice in each pass (a vertex along the mean direction, smallest angles), elsewhere the own axis
    """

    work: Work
    tried: tuple[Tried, ...]
    plans: dict[Orientation, OrientationPlan]
    paper: OrientationPlan

    def toolpath(self, name: Orientation) -> Toolpath:
        """The CL path with the axes of a plan."""
        return reoriented(self.work, self.plans[name].picked)


def orient(toolpath: Toolpath, machine: Machine, setup: SetupFile, options: Options | None = None,
           progress: Progress | None = None,
           workers: int | None = None) -> tuple[OrientationChoice | None, list[Diagnostic]]:
    """Orientations of all passes of a toolpath, within `options.max_tilt`; None where a diagnostic is an ERROR.

    Args:
        workers: processes for many passes, None for as many as there are cores; the choice does not depend on it
    """
    options = options or Options()
    work, found = work_of(toolpath, machine, setup, options)
    if work is None:
        return None, found
    bodies, more = pass_bodies(work, options.setup)
    found += limit_faults(work, options.setup) + more
    if has_errors(found):
        return None, found
    allowed = Allowed(options.max_tilt * DEG, bodies, setup.orientation)
    try:
        prepare(work.passes)
        results = each_pass(partial(_tried, work, allowed), work, allowed, "orienting", progress, workers)
        found += _fixed(work) + _unreached(work, results) + _touching(work, results)
        if has_errors(found):
            return None, found
        plans = plans_of(work, results, allowed, progress, workers)
    except PassFault as fault:
        return None, [*found, error("orient.plan", f"no motion could be planned: {fault}", file=toolpath.file,
                                    lines=[fault.line])]
    return OrientationChoice(work, tuple(results), plans.named, plans.paper), found + _unlinked(work, plans.named["auto"])


def _tried(work: Work, allowed: Allowed, number: int, before: Tried | None) -> Tried:
    """The search in one pass; the pass before lends its axis where it is one of the same kind."""
    one = work.passes[number]
    alike = before is not None and not one.fixed and not before.own.one.fixed and before.own.same(one.axis)
    return tried(one, work.machine, allowed, before if alike else None)


def _fixed(work: Work) -> list[Diagnostic]:
    """A warning where no pass can be turned or spun."""
    if not all(one.fixed and not one.spins for one in work.passes):
        return []
    reasons = "; ".join(dict.fromkeys(one.fixed for one in work.passes))
    return [warning("orient.fixed", f"no pass can be turned: {reasons}", file=work.toolpath.file)]


def _unreached(work: Work, results: list[Tried]) -> list[Diagnostic]:
    """Passes whose own axis the machine cannot run: a warning where another axis was found, else an error; alike ones
    together."""
    alike: dict[tuple[bool, str], list[Pass]] = {}
    for each in results:
        one, other = each.own.one, not each.best.refused
        none = "" if other else "; no other axis is inside travel"
        why = each.own.refused + none + (f" ({one.fixed})" if one.fixed else "")
        if each.own.refused:
            alike.setdefault((other, why), []).append(one)
    result = []
    for (other, why), passes in alike.items():
        code, make = ("orient.own_reach", warning) if other else ("orient.reach", error)
        more = f" and {len(passes) - 1} more" if len(passes) > 1 else ""
        told = f"pass {passes[0].number}{more} with the axis of the CL file: {why}"
        result.append(make(code, told, file=work.toolpath.file, lines=[one.line for one in passes][:6], count=len(passes),
                           hint=_REACH))
    return result


def _unlinked(work: Work, auto: OrientationPlan) -> list[Diagnostic]:
    """A warning where passes can be run and the ways between them cannot: then plans do not compare."""
    bad = np.flatnonzero(~np.isfinite(auto.ways))
    if not len(bad):
        return []
    lines = [work.passes[min(k, len(work.passes) - 1)].line for k in bad.tolist()]
    return [warning("orient.ways", "no height above these passes is inside travel, so that whole plans cannot be compared",
                    file=work.toolpath.file, lines=lines[:6], count=len(bad), hint=_REACH)]


def _touching(work: Work, results: list[Tried]) -> list[Diagnostic]:
    """Passes whose own axis touches something: a warning where another axis was found, else an error."""
    result = []
    for each in results:
        one, why = each.own.one, each.own.touching
        if why:
            told, other = f"pass {one.number} with the axis of the CL file: {why}", each.best is not each.own
            code, make = ("orient.own_touches", warning) if other else ("orient.touches", error)
            told += "" if other else "; no other axis is allowed" + (f" ({one.fixed})" if one.fixed else "")
            result.append(make(code, told, file=work.toolpath.file, lines=[one.line], hint=_APART))
    return result
