"""The plan that is asked for, proved as `convert` does: its program, moves between passes and from home included.

What is counted in `turns` says how long paths take, not what the tool touches on them. Where the program of a
plan is refused, the paths and states that it was refused for are barred, and the plan is chosen again, until one passes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from postproc.base.options import Orientation
from postproc.job.job import Job
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.plans.choice import OrientationChoice, PlanProof
from postproc.orientation.plans.plans import OrientationPlan, plans_of
from postproc.pipeline.result import PostResult
from postproc.readback.comparison.compare import Comparison
from toolpaths.arrays import Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, Severity, info, warning

if TYPE_CHECKING:
    from postproc.collision.bodies import Touch

Convert = Callable[[OrientationChoice], PostResult]
_ROUNDS = 24
"""programs that are made of plans chosen again"""
_NOTED = 3
_OF_BODIES = "collision."


@dataclass(frozen=True)
class _Touched:
    """The pair that is through each other most, and in which part of a program: on the path to pass `number`,
    which begins at CL `line`, or `inside` it; None: on the path home."""

    touch: Touch
    number: int | None
    line: int = 0
    inside: bool = False

    def __str__(self) -> str:
        if self.number is None:
            return f"{self.touch} on the move home"
        return f"{self.touch} {'in' if self.inside else 'on the move to'} pass {self.number} (line {self.line})"


@dataclass(frozen=True)
class _Blame:
    """What a program was refused for: `links` (number n leads to pass n, the last one home) and `passes`, and its
    first error, or what tools touch there."""

    links: frozenset[int]
    passes: frozenset[int]
    why: Diagnostic | _Touched

    def __str__(self) -> str:
        if isinstance(self.why, _Touched):
            return str(self.why)
        return self.why.message + (f" (line {self.why.lines[0]})" if self.why.lines else "")


@dataclass(frozen=True)
class Proved:
    """A choice with the program of the plan that was asked for, written or refused."""

    choice: OrientationChoice
    program: PostResult

    @classmethod
    def of(cls, choice: OrientationChoice, plan: Orientation, convert: Convert) -> Proved:
        """The choice with its program as `convert` makes it."""
        program = convert(choice)
        bounded = program.comparison is None or not program.comparison.unbounded
        return cls(replace(choice, proof=PlanProof(plan, program.controller_name, program.ok, bounded)), program)


def proved(choice: OrientationChoice, plan: Orientation, convert: Convert) -> tuple[Proved, list[Diagnostic]]:
    """The choice with the program of `plan`, chosen again where it was refused; what was passed over is reported.

    Where nothing else is left, `auto` is the fastest of the other plans whose program is written; where none is, the first
    choice stands, with a warning: the conversion will say its errors.
    """
    passed: list[tuple[OrientationPlan, _Blame]] = []
    now = first = Proved.of(choice, plan, convert)
    for _ in range(_ROUNDS):
        if now.program.ok:
            return now, _noted(passed, now.choice, plan)
        blame = _blame(now.choice, now.program)
        passed.append((now.choice.plans[plan], blame))
        if not isinstance(blame.why, _Touched) and _of_the_file(now, plan, convert):
            return first, [_unproved(first, plan, passed)]
        after = _again(now.choice, plan, blame)
        if after is None:
            break
        now = Proved.of(after, plan, convert)
    for other in _others(now.choice, first.choice) if plan == "auto" else ():
        made = Proved.of(replace(first.choice, plans=first.choice.plans | {"auto": other}), plan, convert)
        if made.program.ok:
            return made, _noted(passed, made.choice, plan)
    return first, [_unproved(first, plan, passed)]


def _again(choice: OrientationChoice, plan: Orientation, blame: _Blame) -> OrientationChoice | None:
    """The choice without what a program was refused for; None where the plan stays what it was."""
    if plan == "keep" or not (blame.links or blame.passes):
        return None
    table = choice.table.without(choice.plans[plan], set(blame.links), set(blame.passes))
    plans = plans_of(table)
    if plans.named[plan].barred:
        return None
    return replace(choice, table=table, plans=plans.named, paper=plans.paper)


def _others(now: OrientationChoice, first: OrientationChoice) -> list[OrientationPlan]:
    """Plans that have not been refused, the fastest first."""
    every = {plan.states: plan for choice in (now, first) for plan in choice.plans.values()}
    refused = {first.plans["auto"].states, now.plans["auto"].states}
    left = [plan for states, plan in every.items() if states not in refused and np.isfinite(plan.seconds)]
    return sorted(left, key=lambda plan: (plan.touches, plan.seconds))


def _blame(choice: OrientationChoice, program: PostResult) -> _Blame:
    """Where a program was refused: by bodies wherever they are touched, else by the lines of its errors."""
    errors = [d for d in program.diagnostics if d.severity is Severity.ERROR]
    bodies = [d for d in errors if d.code.startswith(_OF_BODIES)]
    if bodies and program.job is not None and program.comparison is not None:
        return _touched(choice.work, program.job, program.comparison)
    rows = [int(row) for d in errors for row in np.flatnonzero(np.isin(choice.work.moves.line, d.lines))[:1]]
    links, passes = _split(_parts(choice.work, choice.work.moves.row[rows]))
    return _Blame(links, passes, errors[0])


def _touched(work: PassContext, job: Job, comparison: Comparison) -> _Blame:
    """Every path and pass on which a tool touches something."""
    from postproc.collision.program import touching_parts
    from postproc.readback.execution.poses import BlockPoses, poses_before

    motion, moves = comparison.executed[1], comparison.moves.without_pecks()
    executed = BlockPoses(job.control, job.kinematics_of, job.register_lengths(),
                          poses_before(motion, job.control))
    serves = np.minimum(comparison.owner, len(moves) - 1)
    first = np.append(True, np.diff(moves.row) != 0)[serves]
    part = np.where(comparison.owner < len(moves), _parts(work, moves.row[serves], first), len(work.passes))
    touched = touching_parts(motion, executed, job, comparison.owner, part)
    worst = min(touched, key=lambda part: touched[part].distance - touched[part].limit)
    links, passes = _split(np.array(sorted(touched), dtype=np.int64))
    return _Blame(links, passes, _in_part(work, worst, touched[worst]))


def _parts(work: PassContext, rows: Ints, first: Ints | bool = True) -> Ints:
    """Parts (K,) of a program by rows of the CL path: n >= 0 for the path to pass n, which serves its first
    row (`first`: the first move of a row), -1 - n inside it."""
    begins = work.moves.row[[one.rows[0] for one in work.passes]]
    n = np.maximum(np.searchsorted(begins, rows, side="right") - 1, 0)
    return np.where((begins[n] == rows) & first, n, -1 - n)


def _split(parts: Ints) -> tuple[frozenset[int], frozenset[int]]:
    """(paths, passes) of parts."""
    return frozenset(parts[parts >= 0].tolist()), frozenset((-1 - parts[parts < 0]).tolist())


def _in_part(work: PassContext, part: int, touch: Touch) -> _Touched:
    if part == len(work.passes):
        return _Touched(touch, None)
    n = part if part >= 0 else -1 - part
    return _Touched(touch, n, work.passes[n].line, inside=part < 0)


def _of_the_file(made: Proved, plan: Orientation, convert: Convert) -> bool:
    """Whether a program is refused for what the file says, whatever its tool axes: the CL's own are refused alike."""
    own = convert(replace(made.choice, plans=made.choice.plans | {plan: made.choice.plans["keep"]}))
    mine, keep = ({d.code for d in each.diagnostics if d.severity is Severity.ERROR} for each in (made.program, own))
    return not mine.isdisjoint(keep)


def _noted(passed: list[tuple[OrientationPlan, _Blame]], choice: OrientationChoice,
           plan: Orientation) -> list[Diagnostic]:
    """What was passed over before a plan whose program is written."""
    if not passed:
        return []
    reasons = [f"{one.seconds:.3f} s, {why}" for one, why in passed]
    more = f"; and {len(reasons) - _NOTED} more" if len(reasons) > _NOTED else ""
    taken = choice.plans[plan].seconds
    return [info("orient.passed_over", f"not taken for the {taken:.3f} s of {plan}, as their programs are refused: "
                 f"{'; '.join(reasons[:_NOTED])}{more}", file=choice.work.toolpath.file)]


def _unproved(made: Proved, plan: Orientation, passed: list[tuple[OrientationPlan, _Blame]]) -> Diagnostic:
    """No plan was found whose program is written."""
    tried = f", nor are those of {len(passed) - 1} other plans" if len(passed) > 1 else ""
    return warning("orient.unproved", f"the program of {plan} for {made.program.controller_name} is refused{tried}: "
                   f"{passed[0][1]}", file=made.choice.work.toolpath.file,
                   hint="convert reports every reason; --orient keep leaves the axes of the CL file")
