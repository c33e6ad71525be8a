"""Plain GOTO lines and their numbers in one compiled pass over characters: what `scan._split` finds, where none is odd."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.compiled import compiled, loop, wanted

Bytes = npt.NDArray[np.uint8]
COMPILE_FROM = 1_500_000
"""characters that are worth compiling for"""
_MOST_DIGITS, _MOST_BLANKS = 15, 16
"""whole numbers of so many digits, and powers of ten up to the 22nd, are exact, so that their quotient is the number nearest
to the text (IEEE 754); blanks between words of a line"""


def lines_at_once(c: Bytes, largest: float) -> tuple[Ints, Ints, Bools, Array, Floats] | None:
    """(where lines begin behind their blanks, where they end, which are plain, how many numbers each of those has, the
    numbers of all); None where a line that begins with GOTO is not plain, or a number needs more care than digits with a
    point, or the text is short."""
    if not wanted(len(c), COMPILE_FROM):
        return None
    made = compiled(goto_lines)(c, 10.0 ** np.arange(23), largest)
    starts, ends, plain, count, numbers, odd = made
    return None if odd else (starts, ends, plain, count, numbers)


@loop(takes=(("uint8", 1), ("float64", 1), ("float64", 0)))
def goto_lines(c: Bytes, powers: Floats, largest: float) -> tuple[Ints, Ints, Bools, Array, Floats, int]:
    """As `lines_at_once`, with 1 behind where there is none; `powers` (23,) of ten."""
    rows, commas = 0, 0
    for code in c:
        rows += 1 if code == 10 else 0
        commas += 1 if code == 44 else 0
    starts, ends, count = np.empty(rows, np.int64), np.empty(rows, np.int64), np.zeros(rows, np.int32)
    plain, numbers = np.zeros(rows, np.bool_), np.empty(commas + rows)
    at, found = 0, 0
    for row in range(rows):
        first = at
        while c[at] == 32 or c[at] == 9:
            at += 1
        if at - first > _MOST_BLANKS:
            return starts, ends, plain, count, numbers, 1
        starts[row] = at
        if not is_goto(c, at):
            while c[at] != 10:
                at += 1
        else:
            at, read = goto_numbers(c, at + 4, numbers, found, powers, largest)
            if at < 0:
                return starts, ends, plain, count, numbers, 1
            plain[row], count[row] = True, read
            found += read
        ends[row] = at
        at += 1
    return starts, ends, plain, count, numbers[:found], 0


@loop
def is_goto(c: Bytes, at: int) -> bool:
    """Whether GOTO stands there in either case; the last character of a text is a line feed."""
    return bool((c[at] & 0xDF) == 71 and (c[at + 1] & 0xDF) == 79 and (c[at + 2] & 0xDF) == 84 and (c[at + 3] & 0xDF) == 79)


@loop
def goto_numbers(c: Bytes, at: int, numbers: Floats, found: int, powers: Floats, largest: float) -> tuple[int, int]:
    """(where the line ends, how many numbers) of a line, read from behind its GOTO; -1 where it is not plain."""
    first = at
    while c[at] == 32 or c[at] == 9:
        at += 1
    if c[at] != 47 or at - first > _MOST_BLANKS:
        return -1, 0
    read = 0
    while True:
        at += 1
        while c[at] == 32 or c[at] == 9:
            at += 1
        minus = c[at] == 45
        if c[at] == 45 or c[at] == 43:
            at += 1
        whole, digits, places = 0, 0, -1
        while 48 <= c[at] <= 57 or (c[at] == 46 and places < 0):
            if c[at] == 46:
                places = 0
            else:
                whole = whole * 10 + (int(c[at]) - 48)
                digits += 1
                places += 1 if places >= 0 else 0
            at += 1
        if digits == 0 or digits > _MOST_DIGITS:
            return -1, 0
        value = float(whole)
        if places > 0:
            value = value / powers[places]
        if value > largest:
            return -1, 0
        numbers[found + read] = -value if minus else value
        read += 1
        while c[at] == 32 or c[at] == 9:
            at += 1
        if c[at] == 10:
            return (at, read) if read == 3 or read == 6 or read == 9 else (-1, 0)
        if c[at] != 44:
            return -1, 0
