"""The shop's own blocks round tool changes, stops, indexing moves and operations: each where it is asked for."""

from __future__ import annotations

import re
from string import Formatter

import numpy as np

from postproc.job.job import Job
from postproc.readback.comparison.clamps import cutting_rows
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.readback.text.canonical import LOADED, Canonical
from postproc.readback.text.modal import codes
from toolpaths.arrays import Ints, runs
from toolpaths.diagnostics import Diagnostic

Gap = tuple[int, int]
"""lines between which a block has to stand, neither counted"""


def check_hooks(data: bytes, code: Canonical, motion: Motion, job: Job, owner: Ints, faults: Faults) -> list[Diagnostic]:
    """Every block of `[hooks]` at its places, by the lines of the program; a program of several files, or whose lines come
    back, is not looked at. `owner` (E,): the move that each row serves."""
    places = job.hooks.places
    if not places or code.files or (np.diff(code.line) < 0).any():
        return []
    lines, found = data.decode("latin-1").splitlines(), list[Diagnostic]()
    gaps = _gaps(code, motion, job, owner, len(lines))
    for place, blocks in places.items():
        for block in blocks:
            at = np.array([n for n, line in enumerate(lines, 1) if _pattern(block).fullmatch(line)], dtype=np.int64)
            if place.endswith("operation"):
                asked = len(job.operation_starts())
                missing = [(0, 1)] * max(asked - len(at), 0)
            else:
                missing = [(a, b) for a, b in gaps[place] if not ((at > a) & (at < b)).any()]
            if missing:
                found.append(faults.error("verify.hook", f"{place} = {block!r} does not stand where it is asked for", 0,
                                          missing[0][1], len(missing), "convert again, or take it out of [hooks]"))
    return found


def _pattern(block: str) -> re.Pattern[str]:
    """A line that holds the block, whatever its values are."""
    parts = [re.escape(text) + ("" if name is None else ".*") for text, name, _, _ in Formatter().parse(block)]
    return re.compile(r"\s*/?(?:N?\d+\s+)?" + "".join(parts) + r"\s*", re.IGNORECASE)


def _gaps(code: Canonical, motion: Motion, job: Job, owner: Ints, end: int) -> dict[str, list[Gap]]:
    """Where blocks have to stand, by place."""
    result: dict[str, list[Gap]] = {}
    for name, blocks in (("tool", np.unique(code.words.pick(LOADED)[0])),
                         ("stop", np.unique(codes(code.words, "M", (0, 1))[0]))):
        at = code.line[blocks].tolist()
        edges = [0, *at, end + 1]
        result[f"before_{name}"] = list(zip(edges[:-2], at, strict=True))
        result[f"after_{name}"] = list(zip(at, edges[2:], strict=True))
    rotary = np.flatnonzero(np.array(job.machine.rotary))
    degrees = np.concatenate([motion.start[None], motion.end])[:, rotary]
    cut = cutting_rows(motion, job, owner)
    turns = np.flatnonzero((np.abs(np.diff(degrees, axis=0)) > 1e-6).any(axis=1) & ~cut)
    cuts = runs(cut)
    after = np.searchsorted(cuts[:, 0], turns)
    edges_of = np.concatenate([[0], motion.line[cuts[:, 1] - 1]]), np.append(motion.line[cuts[:, 0]], end + 1)
    result["before_index"], result["after_index"] = [], []
    for k in np.unique(after).tolist():
        rows = turns[after == k]
        result["before_index"].append((int(edges_of[0][k]), int(motion.line[rows[0]])))
        result["after_index"].append((int(motion.line[rows[-1]]), int(edges_of[1][k])))
    return result
