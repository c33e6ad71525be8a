"""What becomes of a planted fault: conversions with it, and what the project without it makes of the programs."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tests.mutants.battery import Case

FEED, REST = 0.005, 2e-3
"""share of the time of a move, and s, from which on a feed or a rest counts as another one"""
NEXT = "output.next_mode"
SAME = ("tool", "spindle", "rpm", "coolant", "register", "plane", "compensation", "radius", "offset",
        "pitch", "blend")


@dataclass(frozen=True)
class Made:
    """A conversion: its text without the name of its making, codes of its errors, all it says, and what it does."""

    ok: bool
    text: str
    errors: tuple[str, ...]
    said: tuple[str, ...]
    proof: tuple[Any, ...] = ()
    effect: Effect | None = None
    files: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Effect:
    """What a program does at every move of the CL file, by the reader: seconds, least and largest feed per
    minute (NaN in inverse time), and rests of cuts; states of cuts; worst deviations (mm, degrees)."""

    seconds: np.ndarray
    feeds: np.ndarray
    rests: np.ndarray
    turns: np.ndarray
    states: dict[str, np.ndarray]
    worst: tuple[float, float]


def converted(case: Case) -> Any:
    """The conversion of a case, whatever comes out."""
    import postproc

    path, found = _read(case)
    return postproc.convert(path, _machine(case), case.controller, _setup(case), postproc.Options(**case.options),
                            diagnostics=list(found))


def made(case: Case) -> Made:
    """The conversion of a case in short; an exception is a refusal too."""
    try:
        return short(converted(case))
    except Exception as fault:
        return Made(False, "", (f"{type(fault).__name__}: {str(fault)[:80]}",), ())


def short(result: Any) -> Made:
    """What is kept of a conversion."""
    errors = tuple(d.code for d in result.diagnostics if d.severity == 2)
    said = tuple(str(d) for d in result.diagnostics)
    proof: tuple[Any, ...] = ()
    effect = None
    if result.comparison is not None and result.comparison.executed is not None:
        c, motion = result.comparison, result.comparison.executed[1]
        proof = (c.worst_tip, c.worst_axis, c.tip_bound, c.axis_bound, _digest(motion.end), _digest(motion.code),
                 _digest(motion.feed), _digest(motion.tool), _digest(motion.coolant), _digest(motion.dwell),
                 _digest(c.owner), _digest(c.tip),
                 result.witness and (result.witness.compared, result.witness.not_compared))
        if result.ok:
            effect = effect_of(result.job, c)
    return Made(result.ok, result.text, errors, said, proof, effect, dict(result.files or {}))


def _digest(values: Any) -> str:
    return np.ascontiguousarray(np.nan_to_num(np.asarray(values, float), nan=-9e9)).tobytes().hex()[:4000]


def _read(case: Case) -> tuple[Any, Any]:
    import toolpaths

    if isinstance(case.cl, Path):
        return toolpaths.read(case.cl)
    return toolpaths.read_bytes(case.cl, file="part.cls")


def _machine(case: Case) -> Any:
    import machines

    return machines.load(case.machine)


def _setup(case: Case) -> Any:
    from postproc.setup.model import SetupFile

    return case.setup["file"] if "file" in case.setup else SetupFile.model_validate(case.setup)


def effect_of(job: Any, comparison: Any) -> Effect:
    """What a program that was read back does."""
    from postproc.readback.comparison.checks import block_seconds
    from postproc.reference.coolant import ANY, coolant_states

    motion, moves = comparison.executed[1], job.moves.without_pecks()
    n = len(moves)
    seconds = block_seconds(motion, job.control, job.controller.feed.arc_inverse == "radius")
    owner = np.minimum(comparison.owner, n)
    cut = (motion.code > 0) & (comparison.owner < n)
    spent = np.bincount(owner[cut], weights=np.nan_to_num(np.broadcast_to(seconds, cut.shape)[cut]), minlength=n + 1)[:n]
    feeds = np.full((n, 2), np.nan)
    order = np.argsort(motion.feed[cut], kind="stable")
    timed = np.broadcast_to(motion.inverse, cut.shape)[cut]
    for column, rows in ((0, order[::-1]), (1, order)):
        feeds[owner[cut][rows], column] = np.where(timed, np.nan, motion.feed[cut])[rows]
    standing = ~_moving(motion)  # a rest is of the move that has come there, however often its end is stated
    arrived = np.maximum.accumulate(np.where(standing, 0, np.arange(len(motion))))
    rests = np.bincount(owner[arrived], weights=np.broadcast_to(motion.dwell, cut.shape), minlength=n + 1)[:n]
    any_kind = coolant_states(job.toolpath, job.controller.codes)[moves.row] == ANY
    turns = np.bincount(owner[cut], minlength=n + 1)[:n]
    states = {}
    for name in SAME:
        column = np.full(n, np.nan)
        values = np.broadcast_to(getattr(motion, name), cut.shape)
        if name == "plane":
            values = np.where(motion.code == 2, values, 17)
        if name == "radius":
            values = np.where(np.broadcast_to(motion.compensation, cut.shape) == 40, -1.0, values)
        column[owner[cut]] = values[cut]
        if name == "coolant":  # COOLNT/ON: whatever the kind
            column = np.where(any_kind & (column > 0.0), 1.0, column)
        states[name] = column
    return Effect(spent, feeds, rests, turns, states,
                  (comparison.worst_tip, float(np.degrees(comparison.worst_axis))))


def _moving(motion: Any) -> Any:
    """(E,) blocks that move the tool."""
    from postproc.readback.execution.poses import begins

    return (motion.end != begins(motion, np.arange(len(motion)))).any(axis=1) | (motion.code == 2)


def passed_on(base: Made, got: Made) -> bool:
    """True where a conversion's own proof refused the mode that `base` is written in, and the next one was taken."""
    return any(NEXT in said for said in got.said) and not any(NEXT in said for said in base.said)


def change(before: Effect, after: Effect, other_mode: bool = False) -> str:
    """What differs between two programs for one CL file that are both inside the tolerance: "" for nothing that counts.

    In another output mode linking moves may be fed that were rapid, so that only moves fed in both are compared.
    """
    if len(before.seconds) != len(after.seconds):
        return "the moves of the CL file are others"
    for name, values in before.states.items():
        other = after.states[name]
        both = ~(np.isnan(values) | np.isnan(other))
        bad = both & (values != other)
        if name == "blend":
            bad = both & (other > values + 1e-6)  # less is nearer to the path
        if bad.any():
            k = int(bad.argmax())
            return f"{name} {values[k]:g} becomes {other[k]:g} in {int(bad.sum())} moves"
    off = np.abs(after.seconds - before.seconds)
    slow = off > np.maximum(FEED * np.maximum(before.seconds, after.seconds), REST)
    same = (np.abs(after.feeds - before.feeds) <= FEED * before.feeds).all(axis=1)
    if other_mode:
        slow &= (before.seconds > 0.0) & (after.seconds > 0.0)
    slow &= ~same  # the F words are the same: the path is longer or shorter, inside the tolerance
    if slow.any():
        k = int((off / np.maximum(before.seconds, 1e-9)).argmax())
        return f"{int(slow.sum())} moves take another time, one {before.seconds[k]:.4g} s, now {after.seconds[k]:.4g} s"
    late = np.abs(after.rests - before.rests) > REST
    if late.any():
        k = int(late.argmax())
        return f"a rest of {before.rests[k]:g} s becomes {after.rests[k]:g} s"
    return ""


def verified(asked: Any, text: str, files: dict[str, str]) -> Made:
    """What `verify` finds in a text, made for the job of a conversion: the read-back and the second witness."""
    from postproc.verification.read_back import read_back
    from postproc.verification.second_witness import second_witness

    comparison, found = read_back(text, asked.job, "part.cls",
                                  others={name: t.encode() for name, t in files.items()})
    errors, warned = [d for d in found if d.severity == 2], tuple(str(d) for d in found if d.severity == 1)
    if not errors and comparison is not None:
        found = second_witness(asked.source, asked.asked or asked.setup, asked.options, asked.job, comparison)[1]
        errors = [d for d in found if d.severity == 2]
    ok = comparison is not None and not errors
    return Made(ok, text, tuple(d.code for d in errors), warned, (), effect_of(asked.job, comparison) if ok else None)


def blind(asked: Any, edits: list[str]) -> list[bool]:
    """For each edited program whether this process lets it pass."""
    passed = []
    for text in edits:
        try:
            passed.append(asked.job is not None and verified(asked, text, {}).ok)
        except Exception:
            passed.append(False)
    return passed


def edits_of(program: Made, count: int) -> list[str]:
    """Evenly picked changes of a program."""
    from tests.postproc.mutation_kit import mutants

    comment = next((c for c in ("(", ";") if any(line.startswith(c) for line in program.text.splitlines()[:4])), ";")
    every = [m.text for m in mutants(program.text, comment)]
    return [every[k] for k in np.unique(np.linspace(0, len(every) - 1, count).astype(int))]


def body(text: str) -> str:
    """A program without the lines of its header that say how it was made."""
    return "\n".join(line for line in text.splitlines() if "fingerprint" not in line)
