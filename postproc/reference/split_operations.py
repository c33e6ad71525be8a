"""Long operations cut into parts where the tool moves rapidly, so that no part of the program grows beyond a length."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.reference.events import compensation_states, words
from toolpaths.arrays import Bools, Ints
from toolpaths.diagnostics import Diagnostic, warning
from toolpaths.toolpath import Kind, Role, Toolpath


def cut_operations(toolpath: Toolpath, longest: int) -> tuple[Toolpath, list[Diagnostic]]:
    """The path with operations of more than `longest` rows in several of the same name; 0 leaves it as it is.

    A part begins at the last rapid that keeps the one before it within the length. No cut is made under
    cutter compensation or where a switch may leave blocks out; what can then not be kept within the length is named.
    """
    if longest <= 0 or not len(toolpath):
        return toolpath, []
    begins, too_long = _begins(_run_starts(toolpath), np.flatnonzero(_may_cut(toolpath)),
                               len(toolpath), longest)
    found = [] if not too_long else [warning(
        "output.longest", f"a part of the program has more than {longest} points: there is no rapid to cut it at",
        file=toolpath.file, lines=toolpath.line[too_long][:6].tolist(), count=len(too_long),
        hint="[output] longest of the set-up, or retracts between the passes in the CAM system")]
    if not begins:
        return toolpath, found
    return _renumbered(toolpath, np.array(begins)), found


def _run_starts(toolpath: Toolpath) -> Ints:
    """Rows at which the operation changes, the first among them."""
    return np.flatnonzero(np.concatenate([[True], np.diff(toolpath.operation) != 0]))


def _may_cut(toolpath: Toolpath) -> Bools:
    """(N,) rapids with the compensation off and no block skip."""
    switch = np.zeros(len(toolpath) + 1, dtype=np.int64)
    on = False
    for event in toolpath.events:
        if event.word == "OPSKIP" and ("OFF" not in words(event)) != on:
            on = not on
            switch[event.index] += 1 if on else -1
    skipped = np.cumsum(switch[:-1]) > 0
    return np.asarray((toolpath.kind == Kind.RAPID) & (toolpath.role == Role.POINT) & ~skipped
                      & (compensation_states(toolpath) == 40))


def _begins(starts: Ints, places: Ints, count: int, longest: int) -> tuple[list[int], list[int]]:
    """(rows at which further parts begin, rows at which parts begin that stay too long)."""
    begins: list[int] = []
    too_long: list[int] = []
    for first, stop in zip(starts.tolist(), [*starts[1:].tolist(), count], strict=True):
        at = first
        while stop - at > longest:
            k = int(np.searchsorted(places, at + longest, side="right")) - 1
            if k < 0 or places[k] <= at:
                too_long.append(at)
                k += 1
                if k >= len(places) or places[k] >= stop:
                    break
            at = int(places[k])
            begins.append(at)
    return begins, too_long


def _renumbered(toolpath: Toolpath, begins: Ints) -> Toolpath:
    """The path with an operation of its own from each of the rows on, named as the one that it is cut from."""
    old = toolpath.operation
    starts = np.union1d(_run_starts(toolpath), begins)
    owner = np.zeros(len(toolpath), dtype=np.int64)
    owner[starts] = 1
    part = np.cumsum(owner) - 1
    operations, number = list(toolpath.operations), np.empty(len(starts), dtype=np.int64)
    added = set(begins.tolist())
    current = 0
    for k, row in enumerate(starts.tolist()):
        current = int(old[row])
        if row in added:
            operations.append(replace(operations[current], line=int(toolpath.line[row])))
            current = len(operations) - 1
        number[k] = current
    return replace(toolpath, operation=number[part].astype(old.dtype), operations=tuple(operations))
