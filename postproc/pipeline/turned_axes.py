"""Axes that turn along a cut, by the control's clock: programs with the fields that were found are written and timed.

Every run then takes the field with which the control is fastest over it, its own axes where that is none; that program is
written as well, and the fastest of all is taken. Runs for which a program is refused keep their axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from postproc.base.program_time import ProgramTime
from postproc.orientation.turning.turning_choice import Programs, TurningChoice
from postproc.pipeline.feeds_by_clock import ProgramClock, measured
from postproc.pipeline.result import PostResult
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Severity

Write = Callable[[TurningChoice], PostResult]
AGAIN = 6
"""programs that are written of one choice at most, with runs left out for which it was refused"""
LAST = 2
"""fastest programs that are executed on the control, besides that of the own axes"""


@dataclass(frozen=True)
class _Timed:
    choice: TurningChoice
    made: PostResult
    time: ProgramTime


def turned_by_clock(choice: TurningChoice, keep: PostResult, write: Write,
                    clock: ProgramClock) -> tuple[TurningChoice, PostResult]:
    """The choice whose program is the fastest on the control, and that program; `keep`: the program of the own axes."""
    own = choice.taking([0] * len(choice.runs))
    known = {own.picked: _Timed(own, keep, clock(keep))}
    passed = list[str]()
    for number in range(1, choice.most):
        picked = [number if number < len(one.fields) else 0 for one in choice.runs]
        _write(choice.taking(picked), write, clock, known, passed)
    _write(choice.taking(_fastest(choice, list(known.values()))), write, clock, known, passed)
    order = sorted(known, key=lambda one: (known[one].time.seconds, one != own.picked))
    last = {one: measured(clock, known[one].made) for one in {own.picked, *order[:LAST]}}
    best = known[min(last, key=lambda one: (last[one].seconds, one != own.picked))]
    times: dict[Programs, ProgramTime] = {"keep": last[own.picked], "turned": last[best.choice.picked]}
    spent = zip(*(_seconds_of_runs(replace(known[one], time=last[one])).tolist()
                  for one in (own.picked, best.choice.picked)), strict=True)
    runs = tuple(replace(one, on_control=pair) for one, pair in zip(best.choice.runs, spent, strict=True))
    return replace(best.choice, runs=runs, programs=times, passed=tuple(dict.fromkeys(passed))), best.made


def turned_by_plan(choice: TurningChoice, keep: PostResult, write: Write) -> tuple[TurningChoice, PostResult]:
    """The choice of least planned time whose program is written, and that program."""
    passed = list[str]()
    made = _written(choice, write, passed)
    if made is None:
        return replace(choice.taking([0] * len(choice.runs)), passed=tuple(passed)), keep
    return replace(made[0], passed=tuple(passed)), made[1]


def _write(choice: TurningChoice, write: Write, clock: ProgramClock, known: dict[tuple[int, ...], _Timed],
           passed: list[str]) -> None:
    """Adds a choice with its time where its program is written."""
    if choice.picked not in known and (made := _written(choice, write, passed)) is not None:
        known[made[0].picked] = _Timed(*made, clock(made[1]))


def _written(choice: TurningChoice, write: Write, passed: list[str]) -> tuple[TurningChoice, PostResult] | None:
    """A choice with its program; runs for which it was refused keep their axes."""
    for _ in range(AGAIN):
        if not any(choice.picked):
            return None
        made = write(choice)
        if made.ok:
            return choice, made
        errors = [d for d in made.diagnostics if d.severity is Severity.ERROR]
        passed += [d.message for d in errors[:1]]
        lines = {line for d in errors for line in d.lines}
        blamed = [bool(lines & set(one.run.line.tolist())) for one in choice.runs]
        picked = [0 if bad else k for bad, k in zip(blamed, choice.picked, strict=True)]
        choice = choice.taking(picked if tuple(picked) != choice.picked else [0] * len(picked))
    return None


def _fastest(choice: TurningChoice, known: list[_Timed]) -> list[int]:
    """The field of every run with which the control is fastest over it."""
    spent = np.stack([_seconds_of_runs(one) for one in known])
    return [known[int(k)].choice.picked[n] for n, k in enumerate(spent.argmin(axis=0).tolist())]


def _seconds_of_runs(one: _Timed) -> Floats:
    """(R,) s that the control takes for the cuts of each run."""
    work, job = one.choice.work, one.made.job
    moves = job.moves if job is not None else work.moves
    first, last = work.moves.row[np.array([(each.run.rows[0], each.run.rows[1] - 1) for each in one.choice.runs]).T]
    own = np.searchsorted(first, moves.row, side="right") - 1
    inside = (own >= 0) & (moves.row <= last[np.maximum(own, 0)])
    return np.bincount(own[inside], weights=one.time.moves[inside], minlength=len(first)).astype(np.float64)
