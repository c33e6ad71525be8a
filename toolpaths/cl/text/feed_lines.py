"""FEDRAT lines that differ in their number alone, read by arrays: where every point has a feed of its own there are as many.

They are of one form, that of the first such line: what stands before and behind the number is the same to the
byte. All others are left to the statements.
"""

from __future__ import annotations

import re
import warnings

import numpy as np
import numpy.typing as npt

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.cl.text.scan import Scan
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

Bytes = npt.NDArray[np.uint8]
FEWEST = 1000
"""slow lines below which nobody gains"""
TOGETHER = 50_000
"""lines that are looked at together"""
UNITS = ("MMPM", "IPM", "FPM", "MPM", "PERMIN", "MMPS", "IPS", "MMPR", "IPR", "FPR", "PERREV")
_UNIT = "|".join(UNITS)
_FORM = re.compile(rf"(FEDRAT[ ]*/[ ]*(?:(?:{_UNIT})[ ]*,[ ]*)?)([0-9.+-]+)([ ]*)|"
                   rf"(FEDRAT[ ]*/[ ]*)([0-9.+-]+)([ ]*,[ ]*(?:{_UNIT})[ ]*)")
_DIGITS = np.zeros(256, bool)
_DIGITS[list(b"0123456789.+-")] = True
_LONGEST = 32
"""characters of a number"""


@dataclass(frozen=True)
@arrays(value="S", stop="S")
class FeedLines:
    """Slow lines by their index in the scan: the first of the form, `value` (S,) of each, `stop` (S,) one
    past the last of the unbroken run that it stands in; 0 for lines of other forms."""

    first: int
    value: Floats
    stop: Ints


def feed_lines(data: bytes, scan: Scan, largest: float) -> FeedLines | None:
    """The lines of the form of the first FEDRAT; None where there are few."""
    if len(scan.start) < FEWEST:
        return None
    starts, ends, c = np.array(scan.start), np.array(scan.end), np.frombuffer(data, np.uint8)
    rows = np.flatnonzero(_begin_with(c, starts, ends, b"FEDRAT"))
    parts = _form(data[starts[rows[0]]:ends[rows[0]]]) if len(rows) >= FEWEST else None
    if parts is None:
        return None
    value, stop = np.full(len(starts), np.nan), np.zeros(len(starts), dtype=np.int64)
    for at in range(0, len(rows), TOGETHER):
        some = rows[at:at + TOGETHER]
        good, numbers = _read(c, starts[some], ends[some], *parts, largest)
        value[some[good]] = numbers
    rows = rows[np.isfinite(value[rows])]
    stop[rows] = _run_ends(rows)
    return FeedLines(int(rows[0]), value, stop) if len(rows) else None


def _form(line: bytes) -> tuple[bytes, bytes] | None:
    """What stands before and behind the number of a plain FEDRAT; None for others."""
    match = _FORM.fullmatch(line.decode("ascii", "replace"))
    if match is None:
        return None
    head, _, tail = (part for part in match.groups() if part is not None)
    return head.encode(), tail.encode()


def _read(c: Bytes, starts: Ints, ends: Ints, head: bytes, tail: bytes,
          largest: float) -> tuple[Bools, Floats]:
    """(lines (K,) of the form whose numbers are none beyond `largest`, their numbers)."""
    good = _begin_with(c, starts, ends, head) & _end_with(c, starts, ends, tail)
    good &= ends - starts - len(head) - len(tail) <= _LONGEST
    low, high = starts + len(head), ends - len(tail)
    good &= high > low
    rows = np.flatnonzero(good)
    if len(rows):
        strange = ~_DIGITS[_characters(c, low[rows], high[rows])]
        good[rows] = ~np.logical_or.reduceat(strange, _begins(low[rows], high[rows]))
    numbers = _numbers(c, low[good], high[good])
    if numbers is None:
        return np.zeros(len(starts), dtype=np.bool_), np.zeros(0)
    small = np.abs(numbers) <= largest
    good[good] = small
    return good, numbers[small]


def _begin_with(c: Bytes, starts: Ints, ends: Ints, text: bytes) -> Bools:
    """(S,) True where a line begins with a text."""
    result: Bools = ends - starts >= len(text)
    for k, byte in enumerate(text):
        result &= c[np.minimum(starts + k, len(c) - 1)] == byte
    return result


def _end_with(c: Bytes, starts: Ints, ends: Ints, text: bytes) -> Bools:
    """(S,) True where a line ends with a text."""
    result: Bools = ends - starts >= len(text)
    for k, byte in enumerate(reversed(text), 1):
        result &= c[np.maximum(ends - k, 0)] == byte
    return result


def _begins(low: Ints, high: Ints) -> Ints:
    """(K,) where the characters of low..high begin when they stand one behind the other."""
    return np.asarray(np.cumsum(high - low) - (high - low))


def _characters(c: Bytes, low: Ints, high: Ints) -> Bytes:
    """The characters of low..high (K,) one behind the other: of few lines in a long file these alone are looked at."""
    shift = np.repeat(low - _begins(low, high), high - low)
    return np.asarray(c[shift + np.arange(len(shift))])


def _numbers(c: Bytes, low: Ints, high: Ints) -> Floats | None:
    """Numbers (K,) that stand at low..high, correctly rounded; None where one is none."""
    text = np.full(int((high - low).sum()) + len(low), ord(","), np.uint8)
    own = np.ones(len(text), dtype=np.bool_)
    own[np.cumsum(high + 1 - low) - 1] = False
    text[own] = _characters(c, low, high)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            numbers = np.fromstring(text[:-1].tobytes(), sep=",")
        except (DeprecationWarning, ValueError):
            return None
    return numbers if len(numbers) == len(low) else None


def _run_ends(rows: Ints) -> Ints:
    """(K,) one past the last of the unbroken run that each of the ascending rows stands in."""
    at = np.flatnonzero(np.append(np.diff(rows) != 1, True)[:len(rows)])
    return np.asarray(rows[at][np.searchsorted(at, np.arange(len(rows)))] + 1)
