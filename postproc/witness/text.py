"""A CL file as rows of numbers and records between them: comments off, subroutines written out, plain GOTO lines at once."""

from __future__ import annotations

import codecs
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from postproc.witness.loops import at_once

Array = np.ndarray[Any, np.dtype[Any]]
Word = float | str
JOIN = b"\x01"
"""stands for the end of a line that the next one continues, so that lines can still be counted"""
_NUMBER = rb"[ \t\x01]*[-+]?(?:\d+\.?\d*|\.\d+)(?:[Ee][-+]?\d+)?[ \t\x01]*"
_THREE = _NUMBER + rb"," + _NUMBER + rb"," + _NUMBER
_PLAIN = rb"[ \t]*GOTO[ \t]*/" + _THREE + rb"(?:," + _THREE + rb")?"
_USUAL = rb"GOTO/-?\d++\.\d++(?:,-?\d++\.\d++){2}(?:(?:,-?\d++\.\d++){3})?$"  # as most files have it: soon seen
_OTHER = re.compile(rb"^(?!" + _USUAL + rb")(?!" + _PLAIN + rb"$)[^\n]*", re.MULTILINE)
_COMMENT = re.compile(rb"\$\$[^\n]*")
_GOES_ON = re.compile(rb"(?<!\$)\$(?!\$)([^\n]*)\n(?:[ \t]*\n)*")
_SUBROUTINE = re.compile(rb"^[ \t]*DEFSUB[ \t]*/([^\n$]*)\n(.*?)^[ \t]*ENDSUB[^\n]*$", re.MULTILINE | re.DOTALL)
_CARD, _LETTERS = re.compile(rb"[A-Za-z ]{0,4}\d{4,8}"), b" ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
_CALL = re.compile(rb"^[ \t]*CALSUB[ \t]*/([^\n$]*)$", re.MULTILINE)
_CATIA = re.compile(rb"^[ \t]*\$\$\*CATIA0[^\n]*\n[ \t]*\$\$[^\n]*\n((?:[ \t]*\$\$[^\n]*\n){3})", re.MULTILINE)
_MAJOR = re.compile(r"(\$\$->\s*[\w-]+|[^/]*)/?(.*)", re.DOTALL)
TEXT_WORDS = ("PARTNO", "PPRINT", "INSERT", "REMARK", "TPRINT", "LPRINT", "PPLABEL", "LETTER")
_BARE = re.compile("|".join(TEXT_WORDS), re.IGNORECASE)
_TEXT = re.compile(rb"[ \t]*(?:" + "|".join(TEXT_WORDS).encode() + rb")", re.IGNORECASE)
_STATEMENT = re.compile(rb"[ \t]*(?:" + "|".join(TEXT_WORDS).encode() + rb"|(?:RAPID|FINI|END|STOP|OPSTOP|GOHOME|ENDSUB)\b"
                        rb"|\$\$|[A-Z][\w ,-]*/)", re.IGNORECASE)
_CHUNK = 1 << 23
COMPILED_FROM = 1_500_000
"""characters of a text whose plain lines are worth compiled code"""
_DEEP = 10


@dataclass(frozen=True)
class Record:
    """A record that is no plain GOTO: its word, what stands behind its slash, that in words and numbers."""

    major: str
    body: str
    words: tuple[Word, ...]

    @property
    def numbers(self) -> list[float]:
        """Numbers among the words."""
        return [w for w in self.words if isinstance(w, float)]

    def has(self, *words: str) -> bool:
        """True where one of the words stands in it."""
        return any(w in self.words for w in words)

    def after(self, *names: str) -> float | None:
        """The number right behind the first of the words that is there."""
        for name in names:
            if name in self.words:
                at = self.words.index(name) + 1
                value = self.words[at] if at < len(self.words) else None
                return value if isinstance(value, float) else None
        return None


@dataclass(frozen=True)
class ClText:
    """Plain points: numbers (N, 6), NaN where a line has three, line (N,); records with `before`, points before each."""

    points: Array
    line: Array
    records: list[Record]
    before: list[int]
    lines: list[int]


class Saying:
    """What a file of another form says, as records and the lines that they stand in."""

    line = 0

    def __init__(self) -> None:
        self.said, self.lines = list[Record](), list[int]()

    def read(self, text: str) -> None:
        """The whole of a file."""

    def say(self, major: str, *words: Word) -> None:
        """A record of its word and parameters."""
        self.said.append(Record(major, ",".join(map(str, words)), words))
        self.lines.append(self.line)

    def text(self, major: str, body: str) -> None:
        """A record of a text."""
        self.said.append(Record(major, body, ()))
        self.lines.append(self.line)


def read(data: bytes) -> ClText:
    """Records and points of a CL file in the order in which they are executed."""
    text = _plain(data)
    text, line_of = _written_out(text)
    rows, spans = at_once(text) if len(text) >= COMPILED_FROM else (None, [])
    spans = [m.span() for m in _OTHER.finditer(text)] if rows is None else spans
    real = _places(text, 10)
    ends = np.union1d(real, _places(text, JOIN[0])) if JOIN in text else real
    kept = list(zip([0, *(last + 1 for _, last in spans)], [*(first for first, _ in spans), len(text)], strict=True))
    lengths = np.diff(np.searchsorted(real, np.array(kept)), axis=1)[:, 0].tolist()
    rest = text[kept[-1][0]:]
    lengths[-1] += bool(rest.strip()) and not rest.endswith(b"\n")
    before = np.cumsum(lengths)
    rows = _numbers(memoryview(text), kept) if rows is None else rows
    starts = np.searchsorted(ends, [first for first, _ in spans]) if spans else np.zeros(0, np.int64)
    found = [_record(text[first:last]) for first, last in spans]
    used = [k for k, r in enumerate(found) if r.major or r.body]
    lines = line_of[starts] if spans else starts
    return ClText(rows, _lines_of_points(text, spans, real, ends, line_of), [found[k] for k in used],
                  [int(before[k]) for k in used], [int(lines[k]) for k in used])


def renumbered(text: ClText, lines: tuple[int, ...]) -> ClText:
    """A text with other numbers of its lines: `lines` by number from 1."""
    found = np.array(lines, np.int64)
    return ClText(text.points, found[text.line - 1], text.records, text.before, [int(found[k - 1]) for k in text.lines])


def _places(text: bytes, character: int) -> Array:
    """Where a character stands in a text."""
    raw = np.frombuffer(text, np.uint8)
    found = [first + np.flatnonzero(raw[first:first + _CHUNK] == character) for first in range(0, len(raw), _CHUNK)]
    return np.concatenate([np.zeros(0, np.int64), *found])


def _lines_of_points(text: bytes, spans: list[tuple[int, int]], real: Array, ends: Array, line_of: Array) -> Array:
    """Lines of the plain points: all line ends (`real`) but those of other records, and those that only continue."""
    if not text.endswith(b"\n"):
        real = np.append(real, len(text))
    other = np.array([last for _, last in spans], np.int64)
    plain = np.setdiff1d(real, other, assume_unique=True)
    begins = np.append(-1, real)[np.searchsorted(real, plain)] + 1
    return np.asarray(line_of[np.searchsorted(ends, begins)])


def _plain(data: bytes) -> bytes:
    """ASCII with LF, without comments but data comments at the start of a line, continued lines joined by JOIN."""
    data = _without_cards(without_carriage_returns(data))
    if b"*CATIA0" in data:
        data = _CATIA.sub(_catia_system, data)
    if b"$" not in data:
        return data
    data = _COMMENT.sub(_without_comment, data)
    return _joined(data) if b"$" in data else data


def _without_cards(data: bytes) -> bytes:
    """A deck of cards without the numbers in their columns 73 to 80, where those of its first lines rise."""
    first = [line for line in data[:810].split(b"\n")[:10] if line.strip()]
    first = first[:-1] if len(data) > 810 else first
    if len(first) < 3 or not all(len(line) == 80 and _CARD.fullmatch(line[72:]) for line in first):
        return data
    numbers = [int(line[72:].lstrip(_LETTERS)) for line in first]
    if numbers != sorted(set(numbers)):
        return data
    return b"\n".join(line[:72] if _CARD.fullmatch(line[72:80]) and len(line) == 80 else line for line in data.split(b"\n"))


def without_carriage_returns(data: bytes) -> bytes:
    """UTF-8 or single bytes with LF, without NULs; UTF-16 without its mark has a NUL for every other byte."""
    for bom, encoding in ((codecs.BOM_UTF8, "utf-8-sig"), (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"),
                          (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16")):
        if data.startswith(bom):
            data = data.decode(encoding, "replace").encode("utf-8")
    for first, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):
        if len(data) >= 8 and data[first:400:2].count(0) > 0.8 * len(data[first:400:2]):
            data = data.decode(encoding, "replace").encode("utf-8", "replace")
    for old, new in ((b"\r\n", b"\n"), (b"\r", b"\n"), (b"\x00", b" "), (b"\x1a", b" ")):
        if old in data:
            data = data.replace(old, new)
    return data


def _joined(data: bytes) -> bytes:
    """Lines that a `$` continues, joined by JOIN: within a text only a `$` that ends the line, and no statement follows."""
    end, text = -1, False

    def join(found: re.Match[bytes]) -> bytes:
        nonlocal end, text
        begin = data.rfind(b"\n", 0, found.start()) + 1
        text = text if begin == end else _TEXT.match(data, begin) is not None
        if text and ((found[1].strip() and not found[1].rstrip().endswith(b"$")) or _STATEMENT.match(data, found.end())):
            return found[0]
        end = found.end()
        return b" " + JOIN * found[0].count(b"\n")

    return _GOES_ON.sub(join, data)


def _without_comment(found: re.Match[bytes]) -> bytes:
    """A comment of data stays, where it begins its line; in a text `$$` is text."""
    at, text = found.start(), found.string
    begin = text.rfind(b"\n", 0, at) + 1
    if _TEXT.match(text, begin):
        return found[0]
    alone = not text[begin:at].strip()
    return found[0] if alone and found[0].startswith(b"$$->") else b""


def _catia_system(found: re.Match[bytes]) -> bytes:
    """The rows of a CATIA axis system as a record of their own, of as many lines."""
    rows = [row.replace(b"$$", b" ").split() for row in found[1].splitlines()]
    good = all(len(row) == 4 for row in rows)
    body = b",".join(v for row in rows for v in row) if good else b"?"
    return b"CATIA0/" + body + b"\n" * found[0].count(b"\n")


def _written_out(text: bytes) -> tuple[bytes, Array]:
    """The text with subroutines in the places of their calls; the line of the file of each of its lines."""
    count = text.count(b"\n") + text.count(JOIN) + 1
    if b"DEFSUB" not in text:
        return text, np.arange(1, count + 1)
    bodies: dict[bytes, tuple[bytes, int]] = {}
    at = before = 0

    def define(found: re.Match[bytes]) -> bytes:
        nonlocal at, before
        before += _ends(text[at:found.start(2)])
        at = found.start(2)
        bodies[found[1].strip().upper()] = found[2], before
        return b"\n" * _ends(found[0])

    rest = _SUBROUTINE.sub(define, text)
    parts: list[tuple[bytes, Array]] = []
    _expand(rest, 1, bodies, parts, 0)
    return b"\n".join(p for p, _ in parts), np.concatenate([n for _, n in parts])


def _ends(text: bytes) -> int:
    return text.count(b"\n") + text.count(JOIN)


def _expand(text: bytes, first: int, bodies: dict[bytes, tuple[bytes, int]], parts: list[tuple[bytes, Array]],
            deep: int) -> None:
    at, line_at = 0, first
    for call in _CALL.finditer(text):
        name = call[1].strip().upper()
        _piece(text[at:call.start()].removesuffix(b"\n"), line_at, parts, at < call.start())
        here = line_at + _ends(text[at:call.start()])
        at = min(call.end() + 1, len(text))
        line_at = here + _ends(text[call.start():at])
        if name in bodies and deep < _DEEP:
            body, line = bodies[name]
            _piece(b"SUB-BEGIN", here, parts)
            _expand(body.removesuffix(b"\n"), line + 1, bodies, parts, deep + 1)
            _piece(b"SUB-END", here, parts)
        else:
            _piece(b"SUB-UNKNOWN", here, parts)
    _piece(text[at:], line_at, parts, at < len(text))


def _piece(text: bytes, first: int, parts: list[tuple[bytes, Array]], some: bool = True) -> None:
    if some:
        parts.append((text, np.arange(first, first + _ends(text) + 1)))


def _numbers(text: memoryview, kept: list[tuple[int, int]]) -> Array:
    """(N, 6) of the plain GOTO lines between places of a text, few at a time."""
    found, some, size = [np.zeros((0, 6))], list[bytes](), 0
    for first, last in kept:
        while first < last:
            lines = bytes(text[first:min(last, first + _CHUNK)])
            whole = len(lines) if first + len(lines) == last else lines.rfind(b"\n") + 1 or last - first
            some.append(lines[:whole] if whole <= len(lines) else bytes(text[first:last]))
            size, first = size + whole, first + whole
            if size >= _CHUNK >> 2:
                found.append(_some_numbers(b"".join(some)))
                some, size = [], 0
    return np.concatenate([*found, _some_numbers(b"".join(some))])


_TO_COMMAS = bytes.maketrans(b"\n", b",")


def _some_numbers(text: bytes) -> Array:
    text = text.strip(b"\n")
    if not text:
        return np.zeros((0, 6))
    raw = np.frombuffer(text, np.uint8)
    ends = np.append(np.flatnonzero(raw == 10), len(raw))
    count = np.diff(np.searchsorted(np.flatnonzero(raw == ord(",")), ends), prepend=0) + 1
    values = np.fromstring(text.translate(_TO_COMMAS, b"GOTO/ \t\x01"), sep=",")
    assert len(values) == count.sum()
    result = np.full((len(count), 6), np.nan)
    wide = count == 6
    first = np.cumsum(count) - count
    result[:, :3] = values[first[:, None] + np.arange(3)]
    result[wide, 3:] = values[first[wide][:, None] + np.arange(3, 6)]
    return result


@lru_cache(maxsize=100_000)
def _record(raw: bytes) -> Record:
    text = raw.replace(JOIN, b" ").decode("latin-1").strip()
    if not text:
        return Record("", "", ())
    if (free := _BARE.match(text)) is not None:
        return Record(free[0].upper(), text[free.end():].lstrip(" /"), ())
    found = _MAJOR.match(text)
    assert found is not None
    major = re.sub(r"\s+", " ", found[1].strip()).upper().replace("$$-> ", "$$->")
    body = found[2].strip()
    return Record(re.sub(r"^(GOTO|CIRCLE|FEDRAT|CYCLE)\b.*", r"\1", major), body, words_of(body))


def words_of(body: str) -> tuple[Word, ...]:
    """Numbers and words behind a slash, between commas and blanks, capitals."""
    result: list[Word] = []
    for part in re.split(r"[,\s()]+", body):
        if part:
            try:
                result.append(float(part))
            except ValueError:
                result.append(part.upper())
    return tuple(result)
