"""Subprograms: the blocks of several programs in the order in which the control runs them."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from postproc.readback.text.canonical import STATEMENT, ProgramText
from postproc.readback.text.words import Words
from toolpaths.arrays import Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error

DEEPEST = 10
"""levels of subprograms: the fewest that the controls take (Fanuc 30i: 10 with M98)"""
MOST_REPEATED = 1_000_000
"""blocks run over and above those of the files, before a program counts as endless"""
LineSpan = tuple[int, int, int]
"""number of the file, first and last line"""


@dataclass(frozen=True)
class Call:
    """A line that runs a subprogram some times."""

    line: int
    name: str
    times: int = 1


@dataclass
class Structure:
    """Where the programs of one file begin and end.

    Attributes:
        main: first and last line of what runs first
        subprograms: first and last line by name; calls: by line
    """

    main: tuple[int, int]
    subprograms: dict[str, tuple[int, int]] = field(default_factory=dict)
    calls: dict[int, Call] = field(default_factory=dict)


def expand(texts: list[ProgramText], structures: list[Structure],
           file: str, most: int = MOST_REPEATED) -> tuple[ProgramText, Ints, list[Diagnostic]]:
    """(text whose lines are blocks in running order, line of each block (B + 1,) counted through all files, faults).

    The first file holds the main program; the names of all files are one list, the calling file's own come first.
    Subprograms may repeat up to `most` blocks.
    """
    if not structures[0].calls and structures[0].main == (1, texts[0].words.lines):
        return texts[0], np.arange(texts[0].words.lines + 1), []
    found: list[Diagnostic] = []
    spans: list[LineSpan] = []
    left = most + sum(t.words.lines for t in texts)
    _run((0, *structures[0].main), structures, _Running(spans, found, file, most, left), 0)
    if found:
        return texts[0], np.arange(texts[0].words.lines + 1), found[:1]
    statements = tuple(s for t in texts for s in t.statements)
    before = np.cumsum([0, *(len(t.statements) for t in texts)])
    rows = np.cumsum([0, *(t.words.lines for t in texts)])
    parts, lines, at = [_slice(texts[0].words, 1, 0, 0, 0)], [np.zeros(1, dtype=np.int64)], 0
    for k, first, last in spans:
        parts.append(_slice(texts[k].words, first, last, at, int(before[k])))
        lines.append(np.arange(first, last + 1) + int(rows[k]))
        at += last - first + 1
    words = Words(np.concatenate([p.letter for p in parts]), np.concatenate([p.value for p in parts]),
                  np.concatenate([p.line for p in parts]), at,
                  np.concatenate([p.point for p in parts if p.point is not None]))
    return ProgramText(words, statements), np.concatenate(lines), []


def _slice(words: Words, first: int, last: int, at: int, statements: int) -> Words:
    low, high = np.searchsorted(words.line, [first, last + 1])
    part = words.take(np.arange(low, high))
    value = np.where(part.letter == ord(STATEMENT), part.value + statements, part.value)
    point = part.point if part.point is not None else np.ones(len(value), dtype=bool)
    return Words(part.letter, value, part.line - first + 1 + at, words.lines, point)


@dataclass
class _Running:
    """Spans in running order, faults; blocks that may be repeated, and those that may still run."""

    spans: list[LineSpan]
    found: list[Diagnostic]
    file: str
    most: int
    left: int

    def add(self, span: LineSpan) -> None:
        """A span run."""
        self.spans.append(span)
        self.left -= span[2] - span[1] + 1


def _run(span: LineSpan, structures: list[Structure], run: _Running, depth: int) -> None:
    """The spans of a span of lines, with those of the subprograms that they call."""
    k, here, last = span
    for line in sorted(n for n in structures[k].calls if here <= n <= last):
        call = structures[k].calls[line]
        where: LineSpan | None = next(((j, *structures[j].subprograms[call.name]) for j in (k, *range(len(structures)))
                      if call.name in structures[j].subprograms), None)
        if where is None or depth >= DEEPEST:
            run.found.append(_cannot(where is None, call, structures, run.file))
            return
        run.add((k, here, line))
        for _ in range(call.times):
            run.left -= where[2] < where[1]
            _run(where, structures, run, depth + 1)
            if run.left < 0 and not run.found:
                run.found.append(_endless(call, run))
            if run.found:
                return
        here = line + 1
    if here <= last:
        run.add((k, here, last))


def _endless(call: Call, run: _Running) -> Diagnostic:
    return error("gcode.endless", f"subprograms repeat more than {run.most} blocks: the program has no end", file=run.file,
                 lines=[call.line], hint="look at how often this block calls; a longer program: --max-blocks with a larger "
                                         "number")


def _cannot(missing: bool, call: Call, structures: list[Structure], file: str) -> Diagnostic:
    names = ", ".join(sorted({n for s in structures for n in s.subprograms})) or "none"
    if missing:
        return error("gcode.subprogram", f"there is no subprogram {call.name}", file=file, lines=[call.line],
                     hint=f"known are: {names}; give the other files of the program too")
    return error("gcode.subprogram", f"subprograms call one another more than {DEEPEST} deep, or without an end", file=file,
                 lines=[call.line], hint="the control takes no more levels")
