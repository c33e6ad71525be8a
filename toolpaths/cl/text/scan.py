"""Plain GOTO lines to arrays, all other lines to slices: the part of reading that must be fast.

A line is plain where it is blanks, `GOTO`, blanks, `/` and 3, 6 or 9 numbers with commas between, nothing
else. Its numbers go through numpy's text parser (correctly rounded); every other line is left to the
statements, which say what is wrong.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.cl.text.goto_loop import lines_at_once
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

CHUNK = 1 << 22
_NUMERIC = np.zeros(256, bool)
_NUMERIC[list(b"0123456789+-.,eE \t\n")] = True
_BLANK = np.zeros(256, bool)
_BLANK[list(b" \t")] = True
_MAX_BLANKS = 16
LARGEST = 1e12
"""a number beyond it is no length, angle or feed, and is refused"""
LARGEST_OWN = 1e18
"""the same for text of our own writer, where converted numbers may be larger than the ones that were read"""
Bytes = npt.NDArray[np.uint8]
ReadProgress = Callable[[int, int], None]


@dataclass(frozen=True)
@arrays(xyz="F 3", axis="F 3", third="F 3", line="F")
class Points:
    """Plain GOTO lines (F rows), as written: file units, local frame.

    `axis` and `third` (numbers 4-6 and 7-9) are NaN where a line does not have them, None where no line does.
    """

    xyz: Floats
    axis: Floats | None
    third: Floats | None
    line: Ints

    def __len__(self) -> int:
        return len(self.line)


@dataclass(frozen=True)
class Scan:
    """The file split in two: `points`, and the S other lines that are not blank.

    start, end (S,): byte slices; line (S,): 1-based; before (S,): plain points before that line; lines: all lines
    """

    points: Points
    start: list[int]
    end: list[int]
    line: list[int]
    before: list[int]
    lines: int


@dataclass
class _Chunk:
    numbers: Floats
    count: Ints
    point_line: Ints
    start: Ints
    end: Ints
    line: Ints
    before: Ints
    lines: int


def scan(data: bytes, progress: ReadProgress | None = None, largest: float = LARGEST) -> Scan:
    """Split normalised `data`; `progress(bytes done, bytes in all)` is called now and then."""
    chunks: list[_Chunk] = []
    position, lines = 0, 0
    while position < len(data):
        stop = data.find(b"\n", position + CHUNK) + 1 or len(data)
        chunks.append(_scan_chunk(data, position, stop, lines, largest))
        lines += chunks[-1].lines
        position = stop
        if progress is not None:
            progress(position, len(data))
    return _join(chunks, lines)


def _scan_chunk(data: bytes, position: int, stop: int, lines_before: int, largest: float) -> _Chunk:
    c = np.frombuffer(data, np.uint8, stop - position, position)
    if c[-1] != 10:
        c = np.append(c, np.uint8(10))
    c = _uncommented(c)
    joined, marks = _joined(c)
    if len(marks):
        found = _split(joined, largest)
        if found.plain[np.searchsorted(found.ends, marks)].all():
            return _chunk(found, np.flatnonzero(c == 10), position, lines_before)
    found = _split(c, largest)
    return _chunk(found, found.ends, position, lines_before)


@dataclass
class _Lines:
    """Lines of a chunk: which are plain, how many numbers each has, and the numbers of the plain ones."""

    starts: Ints
    ends: Ints
    plain: Bools
    count: Ints
    numbers: Floats


def _split(c: Bytes, largest: float) -> _Lines:
    at_once = lines_at_once(c, largest)
    if at_once is not None:
        return _Lines(*at_once)
    ends = np.flatnonzero(c == 10)
    starts = _inked(c, np.concatenate([[0], ends[:-1] + 1]))
    count = np.add.reduceat(c == 44, starts, dtype=np.int32) + 1
    plain = _looks_plain(c, starts, ends) & ((count == 3) | (count == 6) | (count == 9))
    _refuse_bare_exponents(c, ends, plain)
    rows = np.flatnonzero(plain)
    numbers, bad = _numbers(c, starts, ends, count, rows, largest)
    plain[bad] = False
    return _Lines(starts, ends, plain, count, numbers)


def _refuse_bare_exponents(c: Bytes, ends: Ints, plain: Bools) -> None:
    """Lines with an exponent without its sign are not plain: it may be a damaged digit."""
    marks = np.flatnonzero((c[:-1] & 0xDF) == 69)
    if len(marks):
        marks = marks[(c[marks + 1] >= 48) & (c[marks + 1] <= 57)]
        plain[np.searchsorted(ends, marks)] = False


def _chunk(found: _Lines, line_ends: Ints, position: int, lines_before: int) -> _Chunk:
    """`line_ends` are those of the file: a line of `found` may hold several."""
    plain = found.plain
    line = np.searchsorted(line_ends, found.starts) + lines_before + 1
    others = np.flatnonzero(~plain & (found.ends > found.starts))
    return _Chunk(found.numbers, found.count[plain], line[plain], found.starts[others] + position,
                  found.ends[others] + position, line[others], np.cumsum(plain, dtype=np.int64)[others], len(line_ends))


def _uncommented(c: Bytes) -> Bytes:
    """`c` with blanks for what stands from `$$` on in lines that begin with GOTO."""
    marks = np.flatnonzero((c[:-1] == 36) & (c[1:] == 36))
    if not len(marks):
        return c
    ends = np.flatnonzero(c == 10)
    line, first = np.unique(np.searchsorted(ends, marks), return_index=True)
    starts = _inked(c, np.where(line > 0, ends[line - 1] + 1, 0))
    good = _begins_goto(c, starts)
    if not good.any():
        return c
    edge = np.zeros(len(c), np.int8)
    edge[marks[first[good]]] = 1
    edge[ends[line[good]]] = -1
    c = c.copy()
    c[np.cumsum(edge, dtype=np.int8).view(bool)] = 32
    return c


def _inked(c: Bytes, starts: Ints) -> Ints:
    """Where (K,) lines begin behind their first blanks and tabs, of which APT allows any number before a record."""
    for _ in range(_MAX_BLANKS):
        blank = _BLANK[c[starts]]
        if not blank.any():
            break
        starts = starts + blank
    return starts


def _begins_goto(c: Bytes, starts: Ints) -> Bools:
    """Where (K,) lines begin with GOTO in either case."""
    good = np.ones(len(starts), bool)
    for k, letter in enumerate(b"GOTO"):
        good &= (c[np.minimum(starts + k, len(c) - 1)] & 0xDF) == letter
    return good


def _joined(c: Bytes) -> tuple[Bytes, Ints]:
    """(`c` with each GOTO line that ends in `$` joined to the line of numbers after it, positions of those marks)."""
    marks = np.flatnonzero(c == 36)
    if not len(marks):
        return c, marks
    ends = np.flatnonzero(c == 10)
    line = np.searchsorted(ends, marks)
    own = _begins_goto(c, _inked(c, np.where(line > 0, ends[line - 1] + 1, 0)))
    if not own.any():
        return c, marks[:0]
    starts = _inked(c, np.concatenate([[0], ends[:-1] + 1]))
    strange = np.add.reduceat(~_NUMERIC[c], starts, dtype=np.int32)
    ink = np.append(0, np.cumsum(c > 32))
    after = np.minimum(line + 1, len(ends) - 1)
    good = (strange[line] == 6) & (ink[ends[line]] == ink[marks + 1]) & (line + 1 < len(ends)) \
        & (strange[after] == 0) & (ink[ends[after]] > ink[starts[after]]) & own
    marks, line = marks[good], line[good]
    joined = c.copy()
    joined[marks] = 32
    joined[ends[line]] = 32
    return joined, marks


def _looks_plain(c: Bytes, starts: Ints, ends: Ints) -> Bools:
    """Lines that hold exactly `GOTO`, blanks, `/` besides characters of numbers."""
    letters = np.add.reduceat(~_NUMERIC[c], starts, dtype=np.int32)
    plain: Bools = (letters == 5) & (ends - starts >= 10)
    at = starts[plain]
    good = _begins_goto(c, at)
    slash = at + 4
    for _ in range(_MAX_BLANKS):
        blank = good & _BLANK[c[slash]]
        if not blank.any():
            break
        slash = slash + blank
    good &= c[slash] == 47
    plain[plain] = good
    return plain


def _numbers(c: Bytes, starts: Ints, ends: Ints, count: Ints, rows: Ints,
             largest: float) -> tuple[Floats, Ints]:
    """(numbers of the plain `rows`, rows whose numbers cannot be read): halves until the bad ones are found."""
    if not len(rows):
        return np.zeros(0), rows
    values = _parse(c, starts, ends, rows)
    if values is not None and len(values) == int(count[rows].sum()) and bool((np.abs(values) <= largest).all()):
        return values, rows[:0]
    if len(rows) == 1:
        return np.zeros(0), rows
    half = len(rows) // 2
    a, bad_a = _numbers(c, starts, ends, count, rows[:half], largest)
    b, bad_b = _numbers(c, starts, ends, count, rows[half:], largest)
    return np.concatenate([a, b]), np.concatenate([bad_a, bad_b])


def _parse(c: Bytes, starts: Ints, ends: Ints, rows: Ints) -> Floats | None:
    low, high = int(starts[rows[0]]), int(ends[rows[-1]]) + 1
    lengths = ends[rows] + 1 - starts[rows]
    text = c[low:high]
    if int(lengths.sum()) == high - low:
        text = text.copy()
    else:
        keep = np.zeros(high - low + 1, np.int8)
        keep[starts[rows] - low] += 1
        keep[ends[rows] + 1 - low] -= 1
        text = text[np.cumsum(keep[:-1], dtype=np.int8).view(bool)]
    text[~_NUMERIC[text]] = 32
    text[text == 10] = 44
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            # without its blanks, a missing first number is a fault; with them numpy reads it as -1
            return np.fromstring(text[:-1].tobytes().lstrip(), sep=" , ")
        except (DeprecationWarning, ValueError):
            return None


def _join(chunks: list[_Chunk], lines: int) -> Scan:
    before, done = [], 0
    for chunk in chunks:
        before.append(chunk.before + done)
        done += len(chunk.count)
    return Scan(_points(chunks, done), _listed([c.start for c in chunks]), _listed([c.end for c in chunks]),
                _listed([c.line for c in chunks]), _listed(before), lines)


def _listed(parts: list[Ints]) -> list[int]:
    result: list[int] = np.concatenate(parts).tolist() if parts else []
    return result


def _points(chunks: list[_Chunk], total: int) -> Points:
    """Rows of 3 from the chunks; a chunk's numbers are dropped as soon as they are copied."""
    width = max((int(c.count.max()) for c in chunks if len(c.count)), default=3)
    xyz = np.empty((total, 3))
    axis = np.full((total, 3), np.nan) if width > 3 else None
    third = np.full((total, 3), np.nan) if width > 6 else None
    line = np.empty(total, np.int64)
    row = 0
    for chunk in chunks:
        stop = row + len(chunk.count)
        line[row:stop] = chunk.point_line
        for column, table in enumerate((xyz, axis, third)):
            if table is not None:
                _fill(table[row:stop], chunk, column)
        row = stop
        chunk.numbers = np.zeros(0)
    return Points(xyz, axis, third, line)


def _fill(table: Floats, chunk: _Chunk, column: int) -> None:
    """Numbers 3 column + (1, 2, 3) of each line into `table`, where the line has them."""
    if not len(chunk.count):
        return
    width = int(chunk.count[0])
    if (chunk.count == width).all():
        if width > 3 * column:
            table[:] = chunk.numbers.reshape(-1, width)[:, 3 * column:3 * column + 3]
        return
    first = np.concatenate([[0], np.cumsum(chunk.count)[:-1]])
    has = chunk.count > 3 * column
    table[has] = chunk.numbers[(first[has] + 3 * column)[:, None] + np.arange(3)]
