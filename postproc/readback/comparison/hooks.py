"""The shop's own blocks round tool changes, stops, indexing moves and operations: each where it is asked for."""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import replace
from heapq import heappop, heappush
from string import Formatter

import numpy as np

from postproc.job.job import Job
from postproc.readback.comparison.clamps import TURNS, cutting_rows, turned
from postproc.readback.comparison.faults import Faults
from postproc.readback.dialects.base import as_bytes
from postproc.readback.execution.execute import Motion
from postproc.readback.text.canonical import LOADED, Canonical
from postproc.readback.text.modal import codes
from postproc.readback.text.words import lines_of
from toolpaths.arrays import Ints
from toolpaths.diagnostics import Diagnostic, Severity

Gap = tuple[int, int]
"""lines between which a block has to stand, neither counted"""


def check_hooks(data: bytes | str, code: Canonical, motion: Motion, job: Job, owner: Ints,
                faults: Faults) -> list[Diagnostic]:
    """Every block of `[hooks]` at its places, by the lines of the program, each line for one place; in a
    program of several files, or whose lines come back, none is looked for. `owner` (E,): the move that each row serves."""
    places = job.hooks.places
    if not places:
        return []
    if code.files or (np.diff(code.line) < 0).any():
        said = faults.warning("verify.hook", "the blocks of [hooks] are not looked for: the program has subprograms", 0, 1,
                              hint="write it without subprograms to have them looked for")
        return [replace(said, severity=Severity.INFO)]
    text = lines_of(as_bytes(data)).upper()
    gaps, found = _gaps(code, motion, job, owner, text.count(b"\n")), list[Diagnostic]()
    ends = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == 10)
    offsets = [job.controller.program.offset_name(place.code) for place in job.places]
    asked: dict[bytes, list[tuple[Gap, str, str]]] = {}
    for place, blocks in places.items():
        for block in blocks:
            asked.setdefault(_pattern(block, offsets), []).extend((gap, place, block) for gap in gaps[place])
    for pattern, wanted in asked.items():
        starts = [m.start() for m in re.finditer(pattern, text) if _begins(text, m.start())]
        left = unmatched(np.searchsorted(ends, np.array(starts, dtype=np.int64)) + 1,
                         [gap for gap, _, _ in wanted])
        missing = dict[tuple[str, str], list[Gap]]()
        for k in left:
            gap, place, block = wanted[k]
            missing.setdefault((place, block), []).append(gap)
        found += [faults.error("verify.hook", f"{place} = {block!r} does not stand where it is asked for", 0,
                               max(gap[0][0], 1), len(gap), "convert again, or take it out of [hooks]")
                  for (place, block), gap in missing.items()]
    return found


_NUMBER = re.compile(rb"[ \t]*/?(?:N?\d+[ \t]+)?")
_VALUES = {"tool_number": "[0-9]+", "tool_name": "[A-Z0-9 ._-]*", "operation": "[A-Z0-9 ._-]*"}


def _pattern(block: str, offsets: list[str]) -> bytes:
    """The block in capitals to the end of its line, whatever its values are, but with a work offset of the program."""
    values = _VALUES | {"work_offset": f"(?:{'|'.join(re.escape(one.upper()) for one in offsets)})"}
    parts = [re.escape(text.upper()) + ("" if name is None else "[0-9]+" if form else values[name])
             for text, name, form, _ in Formatter().parse(block.strip())]
    return (r"(?m)" + "".join(parts) + r"[ \t]*$").encode()


def _begins(text: bytes, start: int) -> bool:
    """True where nothing but a block number stands before `start` in its line."""
    return _NUMBER.fullmatch(text, text.rfind(b"\n", 0, start) + 1, start) is not None


def unmatched(lines: Ints, gaps: list[Gap]) -> list[int]:
    """The gaps for which no line (ascending) is left, each line being in one gap at the most: a line goes to
    the gap that ends first of those round it, which leaves the fewest."""
    order = sorted(range(len(gaps)), key=lambda k: gaps[k][0])
    waiting: list[tuple[int, int]] = []
    left, at = list[int](), 0
    for line in lines.tolist():
        while at < len(order) and gaps[order[at]][0] < line:
            heappush(waiting, (gaps[order[at]][1], order[at]))
            at += 1
        while waiting and waiting[0][0] <= line:
            left.append(heappop(waiting)[1])
        if waiting:
            heappop(waiting)
    return sorted([*left, *(k for _, k in waiting), *order[at:]])


def _gaps(code: Canonical, motion: Motion, job: Job, owner: Ints, end: int) -> dict[str, list[Gap]]:
    """Where blocks have to stand, by place: none beyond the nearest cut."""
    rows = np.flatnonzero(cutting_rows(motion, job, owner))
    cuts = [0, *motion.line[rows].tolist(), end + 1]
    result: dict[str, list[Gap]] = {}
    for name, blocks in (("tool", np.unique(code.words.pick(LOADED)[0])),
                         ("stop", np.unique(codes(code.words, "M", (0, 1))[0]))):
        at = code.line[blocks].tolist()
        edges = [0, *at, end + 1]
        near = [bisect_right(cuts, line) for line in at]
        result[f"before_{name}"] = [(max(a, cuts[k - 1]), line) for a, line, k in zip(edges, at, near, strict=False)]
        result[f"after_{name}"] = [(line, min(b, cuts[k])) for b, line, k in zip(edges[2:], at, near, strict=True)]
    moves = job.moves.without_pecks()
    begun = np.searchsorted(moves.row[owner[rows]], job.moves.row[job.operation_starts()]).tolist()
    between = [(cuts[k], cuts[k + 1]) for k in [*begun, len(rows)]]
    result["before_operation"], result["after_operation"] = between[:-1], between[1:]
    result["before_index"], result["after_index"] = _indexing(motion, job, rows, cuts)
    return result


def _indexing(motion: Motion, job: Job, rows: Ints, cuts: list[int]) -> tuple[list[Gap], list[Gap]]:
    """Before and behind the turns of rotary axes between two of the cuts `rows`, whose lines stand between
    both ends in `cuts`."""
    rotary = np.flatnonzero(np.array(job.machine.rotary))
    turns = np.setdiff1d(np.flatnonzero((turned(motion, rotary) > TURNS).any(axis=1)), rows)
    after, first = np.unique(np.searchsorted(rows, turns), return_index=True)
    last = np.append(first[1:], len(turns))[:len(first)] - 1
    begun, done = motion.line[turns[first]].tolist(), motion.line[turns[last]].tolist()
    return ([(cuts[k], line) for k, line in zip(after.tolist(), begun, strict=True)],
            [(line, cuts[k + 1]) for k, line in zip(after.tolist(), done, strict=True)])
