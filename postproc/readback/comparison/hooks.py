"""The shop's own blocks round tool changes, stops, indexing moves and operations: each where it is asked for."""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from dataclasses import replace
from functools import cached_property
from heapq import heappop, heappush
from itertools import product
from string import Formatter

import numpy as np

from machines.hooks import HOOK_VALUES, filled
from postproc.job.job import Job
from postproc.readback.comparison.clamps import TURNS, cutting_rows, turned
from postproc.readback.comparison.faults import Faults
from postproc.readback.dialects.base import as_bytes
from postproc.readback.dialects.readers import reader_for
from postproc.readback.execution.execute import Motion
from postproc.readback.text.canonical import LOADED, OFFSET, Canonical
from postproc.readback.text.modal import codes
from postproc.readback.text.words import lines_of
from postproc.writing.state import NUMBER_ROOM, plain_name
from toolpaths.arrays import Ints
from toolpaths.diagnostics import Diagnostic, Severity

Gap = tuple[int, int]
"""lines between which a block has to stand, neither counted"""


def check_hooks(data: bytes | str, code: Canonical, motion: Motion, job: Job, owner: Ints,
                faults: Faults) -> list[Diagnostic]:
    """Every block of `[hooks]` at its places with its values, by the lines of the program, each line for one place; in a
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
    values = _Values(code, motion, job, owner)
    asked: dict[bytes, list[tuple[Gap, str, str, frozenset[bytes]]]] = {}
    for place, blocks in places.items():
        for block in blocks:
            asked.setdefault(_pattern(block, offsets), []).extend(
                (gap, place, block, values.texts(block, place, k, gap)) for k, gap in enumerate(gaps[place]))
    for pattern, wanted in asked.items():
        missing = dict[tuple[str, str], list[Gap]]()
        for k in _missing(_like(pattern, text), ends, [(gap, texts) for gap, _, _, texts in wanted]):
            gap, place, block, _ = wanted[k]
            missing.setdefault((place, block), []).append(gap)
        found += [faults.error("verify.hook", f"{place} = {block!r} does not stand where it is asked for"
                               + " with these values" * ("{" in block), 0, max(gap[0][0], 1), len(gap),
                               "convert again, or take it out of [hooks]")
                  for (place, block), gap in missing.items()]
    return found


def _missing(like: list[tuple[int, bytes]], ends: Ints, wanted: list[tuple[Gap, frozenset[bytes]]]) -> list[int]:
    """Gaps for which no block is left among those like one of the shop, or none that says one of the texts."""
    lines = (np.searchsorted(ends, np.array([start for start, _ in like], dtype=np.int64)) + 1).tolist()
    left = unmatched(lines, [gap for gap, _ in wanted])
    if left:
        return left
    said, alike = dict[bytes, list[int]](), dict[frozenset[bytes], list[int]]()
    for line, (_, text) in zip(lines, like, strict=True):
        said.setdefault(text, []).append(line)
    for k, (_, texts) in enumerate(wanted):
        alike.setdefault(texts, []).append(k)
    for texts, own in alike.items():
        here = sorted(line for text in texts for line in said.get(text, ()))
        left += [own[k] for k in unmatched(here, [wanted[k][0] for k in own])]
    return left


_NUMBER = re.compile(rb"[ \t]*/?(?:N?\d+[ \t]+)?")
_VALUES = {"tool_number": "[0-9]+", "tool_name": "[A-Z0-9 ._-]*", "operation": "[A-Z0-9 ._-]*"}


def _pattern(block: str, offsets: list[str]) -> bytes:
    """The block in capitals to the end of its line, whatever its values are, but with a work offset of the program."""
    values = _VALUES | {"work_offset": f"(?:{'|'.join(re.escape(one.upper()) for one in offsets)})"}
    parts = [re.escape(text.upper()) + ("" if name is None else "[0-9]+" if form else values[name])
             for text, name, form, _ in Formatter().parse(block.strip())]
    return (r"(?m)" + "".join(parts) + r"[ \t]*$").encode()


def _like(pattern: bytes, text: bytes) -> list[tuple[int, bytes]]:
    """Where blocks like one of the shop begin in the text, and what they say, whatever their values are."""
    return [(m.start(), m[0].rstrip()) for m in re.finditer(pattern, text) if _begins(text, m.start())]


def _begins(text: bytes, start: int) -> bool:
    """True where nothing but a block number stands before `start` in its line."""
    return _NUMBER.fullmatch(text, text.rfind(b"\n", 0, start) + 1, start) is not None


def unmatched(lines: list[int], gaps: list[Gap]) -> list[int]:
    """The gaps for which no line (ascending) is left, each line being in one gap at the most: a line goes to
    the gap that ends first of those round it, which leaves the fewest."""
    order = sorted(range(len(gaps)), key=lambda k: gaps[k][0])
    waiting: list[tuple[int, int]] = []
    left, at = list[int](), 0
    for line in lines:
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


class _Values:
    """Of one program. Tool and work offset are those of the program at the place, the operation that of the CL file: at an
    operation's begin and end its own, else one of those from the cut before to the cut behind."""

    def __init__(self, code: Canonical, motion: Motion, job: Job, owner: Ints) -> None:
        """`owner` (E,): the move that each row serves."""
        self.job = job
        self.starts = job.operation_starts()
        rows = np.flatnonzero(cutting_rows(motion, job, owner))
        begun = np.searchsorted(job.moves.row[self.starts], job.moves.without_pecks().row[owner[rows]], side="right") - 1
        self.cuts, self.begun = motion.line[rows].tolist(), np.maximum(begun, 0).tolist()
        self.stated = {letter: (code.line[blocks].tolist(), numbers.tolist())
                       for letter in (LOADED, OFFSET) for blocks, numbers in (code.words.pick(letter),)}
        self.known: dict[tuple[str, frozenset[tuple[str, ...]]], frozenset[bytes]] = {}

    def texts(self, block: str, place: str, number: int, gap: tuple[int, int]) -> frozenset[bytes]:
        """What a block may say, in capitals, in the `number`-th of the gaps of a place, lines (after, before)."""
        line = gap[0] if place.startswith("after") else gap[1]
        own = place.endswith("operation")
        operations = self.names[number:number + 1] if own else self._near(line)
        lines = gap if own else (line,)
        tools = {self._latest(LOADED, one, -1.0) for one in lines}
        offsets = {self._latest(OFFSET, one, float("nan")) for one in lines}
        several = product({self._tool(tool) for tool in tools}, operations, {self._offset(one) for one in offsets})
        values = frozenset((*tool, operation, offset) for tool, operation, offset in several)
        if (block, values) not in self.known:
            room = self.job.controller.format.line_length - NUMBER_ROOM
            self.known[block, values] = frozenset(
                filled(block, dict(zip(HOOK_VALUES, one, strict=True)), room).strip().upper().encode() for one in values)
        return self.known[block, values]

    @cached_property
    def names(self) -> list[str]:
        """Of the operations, in the order of the program."""
        numbers = self.job.toolpath.operation[self.job.moves.row[self.starts]].tolist()
        return [plain_name(self.job.toolpath.operations[k].name or f"OPERATION {k + 1}") for k in numbers]

    @cached_property
    def tools(self) -> dict[int, str]:
        """Names of tools by number."""
        return {tool.number: plain_name(tool.name) for tool in reversed(self.job.toolpath.tools)}

    @cached_property
    def offsets(self) -> dict[float, str]:
        """Names of the work offsets of the places by number."""
        program, reader = self.job.controller.program, reader_for(self.job.controller, self.job.machine.axis_names)
        named = [place.code for place in self.job.places]
        return {reader.offset_of(program.offset_text(code)): program.offset_name(code) for code in named}

    def _near(self, line: int) -> list[str]:
        """Operations from that of the cut before a line to that of the cut behind it, "" before the first."""
        before, behind = bisect_left(self.cuts, line) - 1, bisect_right(self.cuts, line)
        first = self.begun[before] if before >= 0 else 0
        last = self.begun[behind] if behind < len(self.begun) else len(self.names) - 1
        return [*([""] if before < 0 else []), *self.names[first:last + 1]]

    def _latest(self, letter: str, line: int, initial: float) -> float:
        """What is stated last at or before a line."""
        lines, numbers = self.stated[letter]
        k = bisect_right(lines, line) - 1
        return float(numbers[k]) if k >= 0 else initial

    def _tool(self, number: float) -> tuple[str, str]:
        return str(int(max(number, 0.0))), self.tools.get(int(number), "")

    def _offset(self, number: float) -> str:
        """Of a register; that of the first place before one is stated."""
        return self.offsets.get(number, next(iter(self.offsets.values())))
