"""The words of a program in one compiled pass over its characters: what `words.read_words` makes of plain blocks."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.compiled import compiled, loop, wanted

COMPILE_FROM = 1_500_000
"""characters that are worth compiling for"""
_MOST_DIGITS = 15
"""whole numbers of so many digits, and powers of ten up to the 22nd, are exact, so that their quotient is the number nearest
to the text (IEEE 754)"""


def words_at_once(text: bytes) -> tuple[Array, Floats, Ints, Bools] | None:
    """(letters, values, lines counted from 1, True where a point is written), (W,) each; None where the text holds anything
    but letters, each with its number behind it, or the text is short."""
    if not wanted(len(text), COMPILE_FROM):
        return None
    letter, value, line, point, odd = compiled(plain_words)(np.frombuffer(text, dtype=np.uint8), 10.0 ** np.arange(23))
    return None if odd else (letter, value, line, point)


@loop(takes=(("uint8", 1), ("float64", 1)))
def plain_words(text: Array, powers: Floats) -> tuple[Array, Floats, Ints, Bools, int]:
    """As `words_at_once`, with 1 behind where a word is none; `powers` (23,) of ten."""
    count = 0
    for c in text:
        if 65 <= (c & 0xDF) <= 90:
            count += 1
    letter, value, line = np.empty(count, np.uint8), np.empty(count), np.empty(count, np.int64)
    point = np.zeros(count, np.bool_)
    at, n, row, size = 0, 0, 1, len(text)
    while at < size:
        c = text[at]
        at += 1
        if c == 10:
            row += 1
            continue
        if c == 32 or c == 9:
            continue
        if not 65 <= (c & 0xDF) <= 90:
            return letter, value, line, point, 1
        letter[n], line[n] = c, row
        minus = at < size and text[at] == 45
        if at < size and (text[at] == 45 or text[at] == 43):
            at += 1
        whole, digits, places = 0, 0, -1
        while at < size and (48 <= text[at] <= 57 or (text[at] == 46 and places < 0)):
            if text[at] == 46:
                places = 0
            else:
                whole = whole * 10 + (int(text[at]) - 48)
                digits += 1
                places += 1 if places >= 0 else 0
            at += 1
        if digits == 0 or digits > _MOST_DIGITS:
            return letter, value, line, point, 1
        point[n] = places >= 0
        number = float(whole)
        if places > 0:
            number = number / powers[places]
        value[n] = -number if minus else number
        n += 1
    return letter, value, line, point, 0
