"""Tool axes by the control's clock: what the plans promise on an ideal control, held against the times of written programs.

The planner ranks the axes of each pass as a control would run them that uses every limit to the full. Other controls rank
them otherwise, so the plans that are best there are written, and timed by the control's model; each pass learns how much
longer the control takes, and the plans are chosen again, until nothing new is chosen. The fastest programs are executed on
the control, with that of the CL file's axes, and the fastest of these is taken.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.options import Orientation
from postproc.base.program_time import ProgramTime
from postproc.orientation.plans.choice import OrientationChoice
from postproc.orientation.plans.plans import OrientationPlan, StateTable, plans_of
from postproc.pipeline.feeds_by_clock import ProgramClock, measured
from postproc.pipeline.proved_axes import Convert, Proved
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass

LAST = 3
"""fastest programs that are executed, besides that of the CL file's axes"""
TURNS = 4
"""plans chosen again by the times of programs"""
NAMED: tuple[Orientation, ...] = ("keep", "whole-part", "per-pass")


@dataclass(frozen=True)
class _Timed:
    """A plan with its program and its time on the control."""

    plan: OrientationPlan
    made: Proved
    time: ProgramTime


def fastest(made: Proved, convert: Convert, clock: ProgramClock) -> Proved:
    """The choice with the plan as "auto" whose program is the fastest on the control; `made`: proved for "auto".

    Where two take the same time the axes of the CL file stay. `programs` of the choice says the times of "keep" and "auto".
    """
    if not made.program.ok:
        return made
    first, known = made.choice, dict[tuple[int, ...], _Timed]()
    known[first.plans["auto"].states] = _Timed(first.plans["auto"], made, clock(made.program))
    for name in NAMED:
        _write(first, first.plans[name], convert, clock, known)
    for _ in range(TURNS):
        plan = plans_of(_as_timed(first.table, list(known.values()))).named["auto"]
        plan = first.table.plan(list(plan.states))
        if plan.states in known or plan.touches or not _write(first, plan, convert, clock, known):
            break
    keep = first.plans["keep"].states
    order = sorted(known, key=lambda states: (known[states].time.seconds, states != keep))
    last = {states: measured(clock, known[states].made.program) for states in {keep, *order[:LAST]} & set(known)}
    best = known[min(last, key=lambda states: (last[states].seconds, states != keep, order.index(states)))]
    times: dict[Orientation, ProgramTime] = {name: last[states] for name, states in _both(keep, best.plan.states)
                                             if states in last}
    choice = replace(first, plans=first.plans | {"auto": best.plan}, programs=times, proof=best.made.choice.proof)
    return Proved(choice, best.made.program)


def _both(keep: tuple[int, ...], auto: tuple[int, ...]) -> tuple[tuple[Orientation, tuple[int, ...]], ...]:
    return ("keep", keep), ("auto", auto)


def _write(choice: OrientationChoice, plan: OrientationPlan, convert: Convert, clock: ProgramClock,
           known: dict[tuple[int, ...], _Timed]) -> bool:
    """Adds a plan with its time where its program is written; whether it is."""
    if plan.states not in known and np.isfinite(plan.seconds) and not plan.touches:
        made = Proved.of(replace(choice, plans=choice.plans | {"auto": plan}), "auto", convert)
        if made.program.ok:
            known[plan.states] = _Timed(plan, made, clock(made.program))
    return plan.states in known


def _as_timed(table: StateTable, known: list[_Timed]) -> StateTable:
    """The table with the control's times of what was written; other states of a pass by how much longer it takes there."""
    cuts = [row.copy() for row in table.cuts]
    spent = [(one.plan, _seconds_of_passes(table, one)) for one in known]
    for n, row in enumerate(cuts):
        ratios = [passes[n] / row[plan.states[n]] for plan, passes in spent if row[plan.states[n]] > 0.0]
        row *= float(np.mean(ratios)) if ratios else 1.0
        for plan, passes in spent:
            row[plan.states[n]] = passes[n]
    return replace(table, cuts=cuts)


def _seconds_of_passes(table: StateTable, one: _Timed) -> Floats:
    """(N,) s that the control takes for the cuts of each pass."""
    moves, work = one.made.program.job.moves if one.made.program.job else table.work.moves, table.work
    begins = work.moves.row[[each.rows[0] for each in work.passes]]
    cuts = (moves.kind != 0) & ~moves.link
    own = np.searchsorted(begins, moves.row, side="right") - 1
    inside = cuts & (own >= 0)
    return np.bincount(own[inside], weights=one.time.moves[inside], minlength=len(work.passes)).astype(np.float64)
