"""G-code text as arrays of words (letter, number, line), without an object per block."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from toolpaths.arrays import Array, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error

_COMMENTS = re.compile(rb"\([^()\n]*\)|;[^\n]*")
_WORD = re.compile(rb"\s*([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*")
_BLANKS = bytes.maketrans(b"ABCDEFGHIJKLMNOPQRSTUVWXYZ\n", b" " * 27)
_NUMBER = np.zeros(256, dtype=bool)
_NUMBER[list(b"0123456789.+- \t\n")] = True


@dataclass(frozen=True)
class Words:
    """W words in file order.

    Attributes:
        letter (W,): ASCII codes, upper case; value (W,): numbers; line (W,): 1-based lines; lines: how many there are
    """

    letter: Array
    value: Floats
    line: Ints
    lines: int


def tokenise(data: bytes, file: str = "") -> tuple[Words, list[Diagnostic]]:
    """The words of a program. Comments and % lines are taken out; block-delete signs and what is no word are errors."""
    text = _COMMENTS.sub(b"", data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")).upper()
    ends = _tape_marks(text)
    text = re.sub(rb"(?m)^[ \t]*%[^\n]*", b"", text)
    skipped = [text.count(b"\n", 0, m.start()) + 1 for m in re.finditer(rb"(?m)^[ \t]*/", text)]
    text = re.sub(rb"(?m)^[ \t]*/", b"", text)
    if not text.endswith(b"\n"):
        text += b"\n"
    codes = np.frombuffer(text, dtype=np.uint8)
    is_letter = (codes >= 65) & (codes <= 90)
    strange = np.flatnonzero(~is_letter & ~_NUMBER[codes])
    newline = codes == 10
    where = np.flatnonzero(is_letter)
    line = (np.cumsum(newline) + 1)[where]
    values = _numbers(text) if not len(strange) else None
    if values is None or len(values) != len(where) or not _each_has_number(codes, where):
        words, found = _slowly(text, file)
        return words, found + _block_delete(skipped, file) + _early_end(ends, file)
    return Words(codes[where], values, line, int(newline.sum())), _block_delete(skipped, file) + _early_end(ends, file)


def _tape_marks(text: bytes) -> list[int]:
    """Lines of % that stand between blocks, where a control stops reading."""
    lines = [n for n, line in enumerate(text.split(b"\n"), 1) if line.strip()]
    marks = [text.count(b"\n", 0, m.start()) + 1 for m in re.finditer(rb"(?m)^[ \t]*%", text)]
    return [n for n in marks if lines and n not in (lines[0], lines[-1])]


def _early_end(lines: list[int], file: str) -> list[Diagnostic]:
    if not lines:
        return []
    return [error("gcode.after_end", "% between blocks: the control stops reading there", file=file, lines=lines[:6],
                  count=len(lines), hint="% may only be the first and the last line")]


def _block_delete(lines: list[int], file: str) -> list[Diagnostic]:
    if not lines:
        return []
    return [error("gcode.block_delete", "a block that a switch at the control leaves out (/)", file=file, lines=lines[:6],
                  count=len(lines), hint="take the / away: what is proved must not depend on a switch")]


def _numbers(text: bytes) -> Floats | None:
    blank = text.translate(_BLANKS)
    if not blank.strip():
        return np.zeros(0)
    try:
        return np.array(blank.split(), dtype=np.float64) if len(blank) < 4096 else _chunks(blank)
    except ValueError:
        return None


def _chunks(blank: bytes) -> Floats:
    """Numbers of a long text, a stretch at a time, so that no list of all of them is made."""
    parts, at = [], 0
    while at < len(blank):
        stop = blank.find(b" ", min(at + 1_000_000, len(blank)))
        stop = len(blank) if stop < 0 else stop
        parts.append(np.array(blank[at:stop].split(), dtype=np.float64))
        at = stop
    return np.concatenate(parts)


def _each_has_number(codes: Array, where: Ints) -> bool:
    """True where after every letter, blanks aside, a number begins."""
    after = codes[np.minimum(where + 1, len(codes) - 1)]
    blank = (after == 32) | (after == 9)
    return bool(_starts_number(after[~blank]).all()) and not bool(blank.any())


def _starts_number(codes: Array) -> Array:
    return np.asarray(((codes >= 48) & (codes <= 57)) | (codes == 43) | (codes == 45) | (codes == 46))


def _slowly(text: bytes, file: str) -> tuple[Words, list[Diagnostic]]:
    """The same line by line, to say which line is at fault."""
    letters: list[int] = []
    values: list[float] = []
    lines: list[int] = []
    diagnostics: list[Diagnostic] = []
    rows = text.split(b"\n")[:-1]
    for number, row in enumerate(rows, 1):
        at = 0
        while at < len(row.rstrip()):
            match = _WORD.match(row, at)
            if match is None:
                found = row.strip().decode("ascii", "replace")[:60]
                diagnostics.append(error("gcode.syntax", f"not a block of words: {found!r}", file=file, lines=[number],
                                         hint="a block is letters with numbers; expressions and macros are not read"))
                break
            letters.append(match[1][0])
            values.append(float(match[2]))
            lines.append(number)
            at = match.end()
    words = Words(np.array(letters, dtype=np.uint8), np.array(values, dtype=np.float64),
                  np.array(lines, dtype=np.int64), len(rows))
    return words, diagnostics
