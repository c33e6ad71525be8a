"""G-code text as arrays of words (letter, number, line), without an object per block."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import accumulate, pairwise

import numpy as np

from postproc.readback.text.word_loop import words_at_once
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error, warning
from toolpaths.shapes import arrays

_COMMENT = re.compile(rb"\([^()\n]*\)|;[^\n]*")
_WORD = re.compile(rb"\s*([A-Za-z])\s*([-+]?(?:\d+\.?\d*|\.\d+))\s*")
_SWITCH = re.compile(rb"(?m)^([ \t]*(?:N?[ \t]*\d+[ \t]*)?)/\d?(?=[ \t]*[A-Z\n])")
_LETTERS = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
_GROUP = re.compile(r"(,?) ?([A-Z])([0-9.]+)")
_BLANKS = bytes.maketrans(_LETTERS + b"\n", b" " * 53)
_NO_LETTERS = bytes(c for c in range(256) if c not in _LETTERS)
_NEAR = 10_000
_STRETCH = 1_000_000
"""characters that are read at a time"""
_SIGN = re.compile(rb"\S")
_NUMBER = np.zeros(256, dtype=bool)
_NUMBER[list(b"0123456789.+- \t\n")] = True


@dataclass(frozen=True)
@arrays(letter="uint8: W", value="W", line="W", point="W")
class Words:
    """W words in file order.

    Attributes:
        letter (W,): ASCII codes; value (W,): numbers; line (W,): 1-based lines; lines: how many there are
        point (W,): True where the number is written with a decimal point; absent where nothing asks for it
    """

    letter: Array
    value: Floats
    line: Ints
    lines: int
    point: Bools | None = None

    def take(self, keep: Bools | Ints) -> Words:
        """Some of the words, in the order asked for; all of them are not copied."""
        if keep.dtype == np.bool_ and keep.all():
            return self
        point = None if self.point is None else self.point[keep]
        return Words(self.letter[keep], self.value[keep], self.line[keep], self.lines, point)

    def pick(self, letter: str) -> tuple[Ints, Floats]:
        """(lines, values) of one letter."""
        here = self.letter == ord(letter)
        return self.line[here], self.value[here]


def tokenise(data: bytes, file: str = "", commas: tuple[str, ...] = ()) -> tuple[Words, list[Diagnostic]]:
    """The words of a program in letters and numbers.

    `commas` are groups of words that are known though commas stand in them ("G61.1,K3"): a letter behind one becomes a small
    one. Comments and % lines are taken out; what is no word is an error. Blocks with "/" are words like others, with a
    warning: the switch at the control that leaves them out counts as off.
    """
    text = plain(data)
    text = text if text.isupper() else text.upper()
    text = _behind_commas(text, commas) if commas and b"," in text else text
    marks = _tape_marks(text)
    ends = _between_blocks(text, marks)
    text = _without(text, marks)
    text, found = block_delete(text, file)
    words, more = read_words(text, file)
    return words, [*more, *found, *_early_end(ends, file)]


def comma_words(group: str) -> list[tuple[str, float]]:
    """Letters and numbers of a group of words, letters behind a comma small: "G61.1,K3" is G 61.1 and k 3."""
    return [(letter.lower() if comma else letter, float(number))
            for comma, letter, number in _GROUP.findall(group)]


def _behind_commas(text: bytes, groups: tuple[str, ...]) -> bytes:
    """The text with small letters, and no commas, in the places where one of the groups stands."""
    for group in groups:
        parts = [(letter, f"{value:.12g}") for letter, value in comma_words(group)]
        words = ((r",[ \t]*" if letter.islower() else "") + rf"{letter.upper()}[ \t]*0*{re.escape(number)}"
                 + (r"0*" if "." in number else r"(?:\.0*)?") + r"(?![\d.])" for letter, number in parts)
        plain_group = "".join(letter + number for letter, number in parts).encode()
        text = re.sub(r"[ \t]*".join(words).encode(), plain_group, text)
    return text


def plain(data: bytes) -> bytes:
    """Text with line feeds alone and without comments."""
    text = lines_of(data)
    kept, whole, done, at = list[memoryview](), memoryview(text), 0, _opening(text, 0)  # copied once, when they are joined
    while at >= 0:
        match = _COMMENT.match(text, at)
        if match is not None:
            kept.append(whole[done:at])
            done = match.end()
        at = _opening(text, at + 1 if match is None else done)
    return b"".join([*kept, whole[done:]]) if done else text


def _opening(text: bytes, at: int) -> int:
    """Where the next comment may begin, -1 nowhere.

    It is looked for in short stretches: where one sign is rare and the other is not, none is looked for again and again.
    """
    while at < len(text):
        found = [k for k in (text.find(mark, at, at + _NEAR) for mark in (b"(", b";")) if k >= 0]
        if found:
            return min(found)
        at += _NEAR
    return -1


def lines_of(data: bytes) -> bytes:
    """Text whose lines all end with a line feed."""
    text = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return text if text.endswith(b"\n") else text + b"\n"


def read_words(text: bytes, file: str = "") -> tuple[Words, list[Diagnostic]]:
    """The words of text that holds nothing but letters, each with a number."""
    if not text.endswith(b"\n"):
        text += b"\n"
    at_once = words_at_once(text)
    if at_once is not None:
        letter, value, line, point = at_once
        return Words(letter, value, line, text.count(b"\n"), point), []
    count = len(text.translate(None, _NO_LETTERS))
    letter, value, line = np.empty(count, dtype=np.uint8), np.empty(count), np.empty(count, dtype=np.int64)
    point = np.zeros(count, dtype=bool)
    at, lines = 0, 0
    for stretch in _stretches(text):
        here = _quickly(stretch)
        if here is None:
            return _slowly(text, file)
        stop = at + len(here.letter)
        letter[at:stop], value[at:stop], line[at:stop] = here.letter, here.value, here.line + lines
        if here.point is not None:
            point[at:stop] = here.point
        at, lines = stop, lines + here.lines
    return Words(letter, value, line, text.count(b"\n"), point), []


def _stretches(text: bytes) -> Iterator[bytes]:
    """Whole lines, some at a time: what is made of them on the path stays small."""
    at = 0
    while at < len(text):
        stop = text.find(b"\n", min(at + _STRETCH, len(text) - 1)) + 1
        yield text[at:stop]
        at = stop


def _quickly(text: bytes) -> Words | None:
    """The words of whole lines by arrays; None where something is no word."""
    codes = np.frombuffer(text, dtype=np.uint8)
    folded = codes & 0xDF
    is_letter = (folded >= 65) & (folded <= 90)
    if bool((~is_letter & ~_NUMBER[codes]).any()):
        return None
    where, ends = np.flatnonzero(is_letter), np.flatnonzero(codes == 10)
    values = _numbers(text)
    if values is None or len(values) != len(where) or not _each_has_number(codes, where):
        return None
    return Words(codes[where], values, np.searchsorted(ends, where) + 1, len(ends), _points(codes, where))


def _points(codes: Array, where: Ints) -> Bools:
    """(W,) True where a point stands between a letter and the next."""
    points = np.zeros(len(where), dtype=bool)
    points[np.searchsorted(where, np.flatnonzero(codes == 46), side="right") - 1] = True
    return points


def _tape_marks(text: bytes) -> list[int]:
    """Where lines that begin with % begin, blanks before it or not."""
    starts, at = list[int](), text.find(b"%")
    while at >= 0:
        begin = text.rfind(b"\n", 0, at) + 1
        if not text[begin:at].strip(b" \t"):
            starts.append(begin)
        at = text.find(b"%", text.find(b"\n", at))  # each line ends with a line feed
    return starts


def _without(text: bytes, starts: list[int]) -> bytes:
    """The text with empty lines in the place of some."""
    kept, whole, done = list[memoryview](), memoryview(text), 0
    for begin in starts:
        kept.append(whole[done:begin])
        done = text.find(b"\n", begin)
    return b"".join([*kept, whole[done:]]) if starts else text


def _between_blocks(text: bytes, starts: list[int]) -> list[int]:
    """Lines of % that stand between blocks, where a control stops reading."""
    if not starts:
        return []
    marks = [line + 1 for line in accumulate(text.count(b"\n", a, b) for a, b in pairwise([0, *starts]))]
    begin, end = _SIGN.search(text), len(text)
    while end and not text[max(end - _NEAR, 0):end].strip():
        end -= _NEAR
    end = max(end - _NEAR, 0) + len(text[max(end - _NEAR, 0):max(end, 0)].rstrip())
    first = text.count(b"\n", 0, begin.start() if begin else len(text)) + 1
    last = text.count(b"\n", 0, end) + 1
    return [n for n in marks if n not in (first, last)]


def _early_end(lines: list[int], file: str) -> list[Diagnostic]:
    if not lines:
        return []
    return [error("gcode.after_end", "% between blocks: the control stops reading there", file=file, lines=lines[:6],
                  count=len(lines), hint="% may only be the first and the last line")]


def block_delete(text: bytes, file: str) -> tuple[bytes, list[Diagnostic]]:
    """Text without the "/" that begin blocks, and a warning where there are any; a digit behind it names the switch."""
    starts = [m.start(1) for m in _SWITCH.finditer(text)] if b"/" in text else []
    if not starts:
        return text, []
    ends = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == 10)
    lines = (np.searchsorted(ends, starts) + 1).tolist()
    return _SWITCH.sub(rb"\1", text), [warning(
        "gcode.block_delete", "a block that a switch at the control leaves out (/)", file=file, lines=lines[:6],
        count=len(lines), hint="what is proved holds with that switch off: these blocks are run")]


def _numbers(text: bytes) -> Floats | None:
    try:
        return np.array(text.translate(_BLANKS).split(), dtype=np.float64)
    except ValueError:
        return None


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
    points: list[bool] = []
    diagnostics: list[Diagnostic] = []
    rows = text.split(b"\n")[:-1]
    for number, row in enumerate(rows, 1):
        at = 0
        while at < len(row.rstrip()):
            match = _WORD.match(row, at)
            if match is None:
                found = row.strip().decode("ascii", "replace")[:60]
                diagnostics.append(error("gcode.syntax", f"not a block of words: {found!r}", file=file, lines=[number],
                                         hint="a block is letters with numbers"))
                break
            letters.append(match[1][0])
            values.append(float(match[2]))
            lines.append(number)
            points.append(b"." in match[2])
            at = match.end()
    words = Words(np.array(letters, dtype=np.uint8), np.array(values, dtype=np.float64),
                  np.array(lines, dtype=np.int64), len(rows), np.array(points, dtype=bool))
    return words, diagnostics
