"""Blocks of plain motion as text in one compiled pass over their numbers: what `Writer.blocks` says block by block."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.compiled import compiled, loop, wanted
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

COMPILE_FROM = 20_000
"""blocks of a program that are worth compiling for"""
LEAST = 200
"""blocks that are worth a call of it"""
_MIDDLE, _ROUNDING, _LARGEST = 1e-9, 1e-15, 1e15
"""of the last decimal: nearer to the middle between two the arithmetic does not say which one; what it rounds by itself"""
_BYTES, _INDEX, _NUMBER = ("uint8", 1), ("int64", 1), ("int64", 0)


def pays(blocks: int, some: int) -> bool:
    """Whether `some` of a program's blocks are made by the loop."""
    return some >= LEAST and wanted(blocks, COMPILE_FROM)


@dataclass(frozen=True)
@arrays(value="N", write="N")
class WordColumn:
    """One word of blocks N: `prefix` and the value with so many decimals, where `write` (N,) says that it stands."""

    prefix: str
    value: Floats
    write: Bools
    places: int


class TextPieces:
    """Texts of blocks N before, between and behind their words, each kept once; '' where none is put."""

    def __init__(self, blocks: int) -> None:
        self.known: dict[str, int] = {"": 0}
        self.place = np.zeros((3, blocks), dtype=np.int64)

    def put(self, where: int, rows: Iterable[int], texts: Iterable[str]) -> None:
        """Texts of some blocks: `where` is 0 before the words, 1 before the last column, 2 behind it."""
        for row, text in zip(rows, texts, strict=True):
            self.place[where, row] = self.known.setdefault(text, len(self.known))

    def put_all(self, where: int, texts: Sequence[str]) -> None:
        """Those of all blocks."""
        rows = [k for k, text in enumerate(texts) if text]
        self.put(where, rows, [texts[k] for k in rows])


@dataclass(frozen=True)
class NumberStyle:
    """As `[format]` of the controller file has it."""

    plus_sign: bool
    trim_zeros: bool
    decimal_point: bool


def block_text(columns: Sequence[WordColumn], pieces: TextPieces, style: NumberStyle) -> str | None:
    """Lines of blocks N, each with a line feed behind it but the last; a blank that begins one is left out.

    None where a number lies so near the middle between two of its decimals that the loop's arithmetic could round it to
    the other one than its exact value, or has too many digits.
    """
    write = np.stack([column.write for column in columns], axis=1)
    value = np.stack([column.value for column in columns], axis=1)
    places = np.array([column.places for column in columns], dtype=np.int64)
    prefixes, prefix_ends = _packed([column.prefix for column in columns])
    texts, text_ends = _packed(list(pieces.known))
    made = compiled(lines_of)(value, write, places, prefixes, prefix_ends, pieces.place, texts, text_ends,
                              int(style.plus_sign), int(style.trim_zeros), int(style.decimal_point))
    return made[:-1].tobytes().decode("ascii") if len(made) else None


def certain(values: Floats, places: int) -> Floats | None:
    """(N,) numbers as whole ones of their last decimal, as `put_number` rounds them; None where some are not certain."""
    scaled = np.abs(values) * 10.0**places
    near = np.abs(scaled - np.floor(scaled) - 0.5) <= _MIDDLE + scaled * _ROUNDING
    return None if near.any() else np.asarray(np.rint(scaled) * np.sign(values))


def _packed(texts: list[str]) -> tuple[Array, Ints]:
    """Characters of texts T one behind the other, and where each begins and the last ends (T + 1,)."""
    ends = np.cumsum([0, *map(len, texts)])
    return np.frombuffer("".join(texts).encode("ascii"), dtype=np.uint8), ends


@loop(takes=(("float64", 2), ("bool_", 2), _INDEX, _BYTES, _INDEX, ("int64", 2), _BYTES, _INDEX, _NUMBER, _NUMBER, _NUMBER))
def lines_of(value: Floats, write: Bools, places: Ints, prefixes: Array, prefix_ends: Ints, piece: Ints, texts: Array,
             text_ends: Ints, plus: int, trim: int, point: int) -> Array:
    """(K,) characters of the lines of N blocks with C words; none where a number is not certain (`block_text`).

    Args:
        value, write: (N, C) numbers, and which of them stand; `places` (C,) their decimals
        prefixes, prefix_ends: what stands before the words, `_packed`
        piece: (3, N) texts before the words, before the last of them and behind it, of texts, text_ends
        plus, trim, point: 1 where a plus is written, zeros at the end are left out, whole numbers have a point
    """
    rows, words = value.shape
    room = rows * (1 + len(prefixes) + words * 24)
    for k in range(3):
        for n in range(rows):
            room += text_ends[piece[k, n] + 1] - text_ends[piece[k, n]]
    out = np.empty(room, np.uint8)
    digits = np.empty(24, np.uint8)
    at = 0
    for n in range(rows):
        first = at
        at = put_text(out, at, texts, text_ends, piece[0, n])
        for c in range(words):
            if c == words - 1:
                at = put_text(out, at, texts, text_ends, piece[1, n])
            if write[n, c]:
                at = put_text(out, at, prefixes, prefix_ends, c)
                at = put_number(out, at, digits, value[n, c], places[c], plus, trim, point)
            if at < 0:
                return out[:0]
        at = put_text(out, at, texts, text_ends, piece[2, n])
        if at > first and out[first] == 32:
            for i in range(first, at - 1):
                out[i] = out[i + 1]
            at -= 1
        out[at] = 10
        at += 1
    return out[:at]


@loop
def put_text(out: Array, at: int, texts: Array, ends: Ints, which: int) -> int:
    """Write one of the texts behind `at`; returns where it ends."""
    for i in range(ends[which], ends[which + 1]):
        out[at] = texts[i]
        at += 1
    return at


@loop
def put_number(out: Array, at: int, digits: Array, value: float, places: int, plus: int, trim: int, point: int) -> int:
    """Write a number behind `at`, as "%.<places>f" rounds it; returns where it ends, -1 where that is not certain."""
    scaled = abs(value)
    for _ in range(places):
        scaled = scaled * 10.0
    if not scaled < _LARGEST:
        return -1
    whole = int(scaled)
    rest = scaled - whole
    if abs(rest - 0.5) <= _MIDDLE + scaled * _ROUNDING:
        return -1
    if rest > 0.5:
        whole += 1
    if whole == 0 or value > 0.0:
        if plus:
            out[at] = 43
            at += 1
    else:
        out[at] = 45
        at += 1
    count = 0
    while whole > 0 or count <= places:
        digits[count] = 48 + whole % 10
        whole = whole // 10
        count += 1
    least = 0
    if trim:
        while least < places and digits[least] == 48:
            least += 1
    for i in range(count - 1, places - 1, -1):
        out[at] = digits[i]
        at += 1
    if places > least or point:
        out[at] = 46
        at += 1
    for i in range(places - 1, least - 1, -1):
        out[at] = digits[i]
        at += 1
    return at
