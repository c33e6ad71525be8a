"""`auto` takes the next output mode where one cannot be written or proved for an operation, and says so."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace

import numpy as np

from postproc.control.control import MODE_NAMES, InterpolationMode
from postproc.control.modes import ASKED, OutputModes, Refused
from postproc.job.job import Job
from postproc.path.model import JointPath
from postproc.pipeline.result import PostResult
from toolpaths.arrays import Ints
from toolpaths.diagnostics import Diagnostic, Severity, warning

StagedAgain = Callable[[PostResult], PostResult]
"""A conversion with the output modes that it is given"""
TURNS = 3
"""conversions in which only the operations that errors name take the next mode; then all of that mode do"""
SAME_IN_ALL = frozenset({"reach.axis", "reach.position", "axis.spin"})
"""errors that no output mode changes"""
TRAVEL = "travel.exceeded"
ASK_AUTO = "--output-mode auto takes the next mode where one cannot be proved"
NONE_DOES = "no output mode of this control and machine is proved for it: "
COARSER = "a coarser --tolerance may do; else report CL file, machine and controller file as a fault of postproc"
_LAWS: tuple[InterpolationMode, ...] = ("tilted", "tcp", "axes")
_SHOWN = 6


def with_next_modes(result: PostResult, staged: StagedAgain) -> PostResult:
    """A conversion; where an error stands against it, again with the next mode of the operations that it names, then of all,
    then with each mode alone: what one mode converts "auto" does. The first failure where none does."""
    first = made = staged(result)
    job = first.job
    if first.ok or job is None or not _depends(first, job.modes):
        return with_remedies(first)
    modes, why = job.modes, dict[tuple[int, InterpolationMode], Diagnostic]()
    tried = {_assigned(modes): (modes, first)}
    for turn in range(TURNS + len(_LAWS)):
        if made.job is None or not _depends(made, modes) or not (more := _refusals(made, made.job, modes, turn)):
            break
        why |= _reasons(made, made.job, modes, more)
        modes = replace(modes, refused=modes.refused | more)
        made = staged(replace(result, refused=modes.refused, keep="all"))
        tried[_assigned(modes)] = modes, made
        if made.ok:
            return _said(first, made, job, modes, why)
        if _same_in_all(tried.values(), job):
            return with_remedies(first)
    for alone in _each_alone(job.modes):
        if _assigned(alone) in tried:
            continue
        made = staged(replace(result, refused=alone.refused, keep="all"))
        tried[_assigned(alone)] = alone, made
        if made.ok:
            return _said(first, made, job, alone, why)
        if _same_in_all(tried.values(), job):
            break
    return with_remedies(first)


def _depends(made: PostResult, modes: OutputModes) -> bool:
    """True where another output mode may do better; not where the two readings of a program differ, a fault of ours."""
    if not _auto(modes):
        return False
    errors = _errors(made)
    return not any(d.code.startswith("witness.") for d in errors) and any(d.code not in SAME_IN_ALL for d in errors)


def _same_in_all(tried: Collection[tuple[OutputModes, PostResult]], job: Job) -> bool:
    """True where an axis goes beyond its travel at one place by the same, in every mode that the operation there can take:
    the place is outside travel, whatever words lead there."""
    free = replace(job.modes, refused=frozenset())
    same = set.intersection(*({(d.message, d.lines[0]) for d in _errors(made) if d.code == TRAVEL and d.lines}
                              for _, made in tried))
    for _, line in same:
        had = {one for modes, made in tried for one in _named(made, job, modes, {line})}
        if had and all((k, law) in had for k, _ in had for constant in (True, False) for law in free.possible(k, constant)):
            return True
    return False


def _auto(modes: OutputModes) -> list[int]:
    """Operations whose mode is "auto", where there is more than one to take."""
    if sum(not why for why in modes.lacking.values()) < 2:
        return []
    return np.flatnonzero(modes.asked == ASKED.index("auto")).tolist()


def _assigned(modes: OutputModes) -> tuple[tuple[InterpolationMode, ...], ...]:
    """The mode of each operation where the tool axis stands still, and where it turns."""
    return tuple(tuple(modes.law(k, constant) for k in range(len(modes.asked))) for constant in (True, False))


def _refusals(made: PostResult, job: Job, modes: OutputModes, turn: int) -> Refused:
    """The modes that are to be passed over next: those that the errors name, else the first of all that are in use."""
    free = {(k, some[0]) for k in _auto(modes) for constant in (True, False)
            if len(some := modes.possible(k, constant)) > 1}
    named = free & set(_named(made, job, modes, {line for d in _errors(made) for line in d.lines}))
    if named and turn < TURNS:
        return frozenset(named)
    laws = {law for _, law in named or free}
    worst = next((law for law in _LAWS if law in laws), None)
    return frozenset((k, law) for k, law in free if law == worst)


def _named(made: PostResult, job: Job, modes: OutputModes, of: set[int]) -> Iterator[tuple[int, InterpolationMode]]:
    """(operation, mode) of the blocks that errors name, by their lines `of` the CL file."""
    lines = np.array(sorted(of), dtype=np.int64)
    path = made.path
    if path is not None and len(lines):
        laws = np.array([_LAWS.index(frame.control.law) for frame in path.frames])
        rows = np.flatnonzero(np.isin(job.moves.line[path.move], lines))
        for k, law in np.unique(np.stack([job.operation[path.move[rows]], laws[path.frame[rows]]]), axis=1).T.tolist():
            yield k, _LAWS[law]
    elif len(lines):
        for k in np.unique(job.operation[np.isin(job.moves.line, lines)]).tolist():
            yield from ((k, modes.law(k, constant)) for constant in (True, False))


def _errors(made: PostResult) -> list[Diagnostic]:
    return [d for d in made.diagnostics if d.severity is Severity.ERROR]


def _reasons(made: PostResult, job: Job, modes: OutputModes,
             of: Refused) -> dict[tuple[int, InterpolationMode], Diagnostic]:
    """Why each (operation, mode) is passed over: the first error that names a block of it, else the first of all."""
    errors, found = _errors(made), dict[tuple[int, InterpolationMode], Diagnostic]()
    for one in reversed(errors):
        found |= dict.fromkeys(_named(made, job, modes, set(one.lines)), one)
    return {mode: found.get(mode, errors[0]) for mode in of}


def _each_alone(modes: OutputModes) -> Iterator[OutputModes]:
    """The modes where all operations take one and the same."""
    for law in ("axes", "tcp", "tilted"):
        if not modes.lacking[law]:
            others = frozenset((k, other) for k in _auto(modes) for other in _LAWS if other != law)
            yield replace(modes, refused=others)


def _said(first: PostResult, made: PostResult, job: Job, modes: OutputModes,
          why: dict[tuple[int, InterpolationMode], Diagnostic]) -> PostResult:
    """With a warning for each mode that another was taken for and each kind of reason: operations, both modes, reason."""
    path, groups = made.toolpath, dict[tuple[InterpolationMode, InterpolationMode, str], list[int]]()
    used, found = set() if made.path is None or made.job is None else _in_use(made.path, made.job), []
    had = _assigned(job.modes)
    why = _reasons(first, job, job.modes, frozenset((k, law) for laws in had for k, law in enumerate(laws))) | why
    for before, after in zip(had, _assigned(modes), strict=True):
        for k, (old, new) in enumerate(zip(before, after, strict=True)):
            if old != new and (k, new) in used and k not in groups.setdefault((old, new, why[k, old].code), []):
                groups[old, new, why[k, old].code].append(k)
    for (old, new, _), rows in groups.items():
        reason = why[rows[0], old]
        names = ", ".join(path.operations[k].name or f"operation {k + 1}" for k in rows[:_SHOWN])
        more = f" and {len(rows) - _SHOWN} more" if len(rows) > _SHOWN else ""
        found.append(warning("output.next_mode", f"{names}{more}: written in {MODE_NAMES[new]}, since in {MODE_NAMES[old]} "
                             f"[{reason.code}] {reason.message}", file=path.file, count=len(rows),
                             lines=[path.operations[k].line for k in rows[:_SHOWN]],
                             hint="nothing is to be done: "
                             f'[output.operations] of the set-up with "{new}" for it asks for that mode'))
    return made.with_found(found)


def _in_use(path: JointPath, job: Job) -> set[tuple[int, InterpolationMode]]:
    """(operation, mode) of all blocks that are on the path."""
    laws: Ints = np.array([_LAWS.index(frame.control.law) for frame in path.frames])[path.frame]
    own = np.isfinite(path.u)
    pairs = np.unique(np.stack([job.operation[path.move[own]], laws[own]]), axis=1).T.tolist()
    return {(k, _LAWS[law]) for k, law in pairs}


def with_remedies(made: PostResult) -> PostResult:
    """A failure of the read-back with what the user of `convert` can do about it."""
    if made.ok or made.reached != "verify" or made.job is None:
        return made
    others = [law for law, lack in made.job.modes.lacking.items() if not lack and law != made.options.output]
    hint = ASK_AUTO if made.options.output != "auto" and others else (NONE_DOES if others else "") + COARSER
    return replace(made, diagnostics=tuple(
        d if d.severity is not Severity.ERROR or (d.hint and not d.code.startswith("gcode.")) else replace(
            d, hint=f"{d.hint}; {hint}" if d.hint else hint) for d in made.diagnostics))
