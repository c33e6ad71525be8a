"""The journey: passes -> candidates of each -> plans keep, per pass, whole part, auto -> the toolpath with new axes."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from machines.machine import Machine
from postproc.base.options import Options, Orientation
from postproc.base.progress import Progress
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.candidates import tried
from postproc.orientation.candidates.infeasible_passes import REACH, out_of_travel, unfit
from postproc.orientation.candidates.ranking import load_compiler
from postproc.orientation.candidates.search import APART, PassSearch, Rejection
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.limit_checks import limit_faults
from postproc.orientation.passes.parallel_map import PassFault, each_pass
from postproc.orientation.passes.pass_bodies import pass_bodies
from postproc.orientation.passes.passes import TURNING, PassContext, work_of
from postproc.orientation.passes.reasons import Slower
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.plans import OrientationPlan, plans_of, table_of
from postproc.setup.model import SetupFile
from toolpaths.diagnostics import Diagnostic, error, has_errors, warning
from toolpaths.toolpath import Toolpath
from toolpaths.units import DEG


def orient(toolpath: Toolpath, machine: Machine, setup: SetupFile, options: Options | None = None,
           progress: Progress | None = None,
           workers: int | None = None) -> tuple[OrientationChoice | None, list[Diagnostic]]:
    """Orientations of all passes of a toolpath, within `options.max_tilt`; None where a diagnostic is an ERROR.

    No program is made: `programs.oriented` proves the plan that is asked for.

    Args:
        workers: processes for many passes, None for as many as there are cores; the choice does not depend on it
    """
    options = options or Options()
    choice, found = planned_choice(toolpath, machine, setup, options, progress, workers)
    if choice is None:
        return None, found
    return bettered(choice), [*found, *unsolved(choice, options.orient)]


def planned_choice(toolpath: Toolpath, machine: Machine, setup: SetupFile, options: Options,
                   progress: Progress | None = None, workers: int | None = None
                   ) -> tuple[OrientationChoice | None, list[Diagnostic]]:
    """The plans of a toolpath as they were made; arguments as of `orient`."""
    load_compiler()
    work, found = work_of(toolpath, machine, setup, options)
    if work is None:
        return None, found
    bodies, more = pass_bodies(work, options.setup)
    found += limit_faults(work, options.setup, options.max_tilt * DEG) + more
    if has_errors(found):
        return None, found
    allowed = AllowedAxes(options.max_tilt * DEG, bodies, setup.orientation)
    found += out_of_travel(work, allowed)
    if has_errors(found):
        return None, found
    try:
        results = each_pass(partial(_tried, work, allowed), work, allowed, "orienting", progress, workers)
        found += _fixed(work) + unfit(work, results)
        if has_errors(found):
            return None, found
        table = table_of(work, results, allowed, progress, workers)
        plans = plans_of(table)
    except PassFault as fault:
        return None, [*found, error("orient.plan", f"no motion could be planned: {fault}", file=toolpath.file,
                                    lines=[fault.line])]
    found += _unlinked(work, plans.named["auto"],
                       any(np.isfinite(one.seconds) for one in plans.named.values()))
    if has_errors(found):
        return None, found
    return OrientationChoice(work, tuple(results), table, plans.named, plans.paper), found


def unsolved(choice: OrientationChoice, plan: Orientation) -> list[Diagnostic]:
    """A warning where times that are compared are those of plans that were not solved."""
    compared = [made for name in dict.fromkeys((plan, "keep", "auto")) for made in choice.plans[name].picked]
    lines = sorted({made.one.line for made in compared if not made.solved})
    if not lines:
        return []
    return [warning("orient.unsolved", "the least time of these passes was not found; the times compared are longer than "
                    "need be, within all limits", file=choice.work.toolpath.file, lines=lines[:6], count=len(lines))]


def bettered(choice: OrientationChoice) -> OrientationChoice:
    """With the fastest of all that was planned in full as the best of each pass: ranked times may be off by some 1e-3."""
    plans = [*choice.plans.values(), choice.paper]
    results = [_best_of(tried, [plan.picked[k] for plan in plans]) for k, tried in enumerate(choice.tried)]
    return replace(choice, tried=tuple(results))


def _best_of(tried: PassSearch, planned: list[Candidate]) -> PassSearch:
    """A pass with the fastest of some orientations as its best, where it is faster than that."""
    made = min((made for made in planned if made is not tried.own and not made.touching), key=lambda made: made.seconds,
               default=tried.best)
    if not made.seconds < tried.best.seconds_allowed:
        return tried
    before = tried.best
    others = tuple(lost for lost in tried.rejected
                   if lost.made is tried.own or not lost.made.same(made.axis, made.held, APART))
    if before is not tried.own:
        others = (*others, Rejection(before.slim(before.seconds), Slower(before.seconds), "slower"))
    return replace(tried, best=made, rejected=others)


def _tried(work: PassContext, allowed: AllowedAxes, number: int, before: PassSearch | None) -> PassSearch:
    """The search in one pass; the pass before lends its axis where it is one of the same kind."""
    one = work.passes[number]
    alike = before is not None and not one.fixed and not before.own.one.fixed and before.own.same(one.axis)
    return tried(one, work.machine, allowed, before if alike else None)


def _fixed(work: PassContext) -> list[Diagnostic]:
    """A warning where no pass can be turned or spun, nor its axis along its cuts."""
    if work.setup.orientation.turns or not all(one.fixed and not one.spins for one in work.passes):
        return []
    reasons = "; ".join(dict.fromkeys(one.fixed for one in work.passes))
    hint = "[orientation] cone of the set-up lets the axis of a ball turn along a cut" if TURNING in reasons else ""
    return [warning("orient.fixed", f"no pass can be turned: {reasons}", file=work.toolpath.file, hint=hint)]


def _unlinked(work: PassContext, auto: OrientationPlan, runs: bool) -> list[Diagnostic]:
    """Moves between passes that cannot be run: a warning where a plan without them `runs`, else an error."""
    bad = np.flatnonzero(~np.isfinite(auto.links))
    if not len(bad):
        return []
    lines = list(dict.fromkeys(work.passes[min(k, len(work.passes) - 1)].line for k in bad.tolist()))
    make, noted = (warning, "so that whole plans cannot be compared") if runs else (error, "so that no plan can be run")
    return [make("orient.ways", f"no height above these passes is inside travel, {noted}", file=work.toolpath.file,
                 lines=lines[:6], count=len(lines), hint=REACH)]
