"""Lines to statements: comments, continuation, case, blanks, numbers and words."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import field, replace
from typing import Literal

from toolpaths.arrays import Floats
from toolpaths.cl.text.feed_lines import FeedLines, feed_lines
from toolpaths.cl.text.log import DiagnosticLog
from toolpaths.cl.text.near import nearest
from toolpaths.cl.text.scan import LARGEST, LARGEST_OWN, Scan
from toolpaths.cl.text.source import text_of
from toolpaths.cl.text.words import BARE_WORDS, TEXT_WORDS
from toolpaths.dataclass import dataclass
from toolpaths.pattern import pattern

Word = str | float
_NUMBER_ENDS, _NUMBER_STARTS = "0123456789.", "+-.0123456789"
"""of what float() reads as a NUMBER does: it takes inf, nan and underscores besides, and no D for the exponent"""
_NUMBER = pattern(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]\d+)?", re.ASCII)
_BARE_EXPONENT = pattern(r"[eE]\d")
"""An exponent without its sign may be a damaged digit: no system writes it."""
_CARD_LABEL = pattern(r"\s*[A-Z]{2,3} {2,}\d{1,5}\s*")
"""CATIA numbers points and circles in columns 73 to 80."""
_REMARK = pattern(r"\$\$->\s*(?:CSYS|CUTTER|FEATNO)\s*/")
_MAJOR = pattern(r"[A-Za-z0-9_][A-Za-z0-9_ ,=*.+-]*", re.ASCII)
_SIMPLE = pattern(r"([A-Z]+)[ ]*/([^$()/]*)", re.ASCII)
"""Most records: one major word, a slash, no comment, continuation or label."""
_LABEL = pattern(r"[A-Za-z0-9_]{1,32}\s*\)\s*", re.ASCII)
COMMENT = "$$"
DATA_COMMENT = "$$->"
_RARELY_REPEATED = frozenset({"GOTO", "GODLTA", "CNTRL", "KNOT"})
TEXT = "(text)"
"""Major of a line that has not the form of a statement."""


@dataclass(frozen=True, slots=True)
class Statement:
    """One record. `words` are its parameters: numbers as float, everything else upper case; `body` as written."""

    major: str
    body: str = ""
    words: tuple[Word, ...] = ()
    slash: bool = True

    @property
    def numbers(self) -> list[float]:
        """The numbers before the first word."""
        found: list[float] = []
        for word in self.words:
            if isinstance(word, str):
                break
            found.append(word)
        return found

    @property
    def tail(self) -> tuple[Word, ...]:
        """The parameters from the first word on."""
        return self.words[len(self.numbers):]

    def has(self, *names: str) -> bool:
        """True where one of the words stands among the parameters."""
        return any(word in names for word in self.words if isinstance(word, str))

    def after(self, *names: str) -> float | None:
        """The number right after the first of these words, None where there is none."""
        for word, value in zip(self.words, self.words[1:], strict=False):
            if isinstance(word, str) and word in names and isinstance(value, float):
                return value
        return None


@dataclass
class StatementList:
    """The slow part of a file in order: statement, its first line, and how many plain points stand before it.

    `first` says for each different statement (points apart) the line where it stands first. `feeds` holds, by
    the index of the first of them, the numbers of neighbouring FEDRAT statements that differ in nothing else:
    for all of them stands the first of the file.
    """

    statements: list[Statement] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    before: list[int] = field(default_factory=list)
    first: dict[Statement, int] = field(default_factory=dict)
    feeds: dict[int, Floats] = field(default_factory=dict)


def words_of(body: str) -> tuple[Word, ...]:
    """Parameters between commas or blanks; trailing empty ones left out, inner empty ones kept as ''."""
    found: list[Word] = []
    for part in body.split(","):
        pieces = part.split()
        found.extend(map(_word, pieces) if pieces else ("",))
    while found and found[-1] == "":
        found.pop()
    return tuple(found)


def _word(text: str) -> Word:
    if text[-1] in _NUMBER_ENDS and text[0] in _NUMBER_STARTS and "_" not in text and not _BARE_EXPONENT.search(text):
        try:
            value = float(text)
        except ValueError:
            value = math.inf
        if abs(value) <= LARGEST_OWN:
            return value
    if _NUMBER.fullmatch(text):
        value = float(text.replace("D", "E").replace("d", "e"))
        if abs(value) <= LARGEST_OWN:
            return value
    return text.upper()


def major_of(head: str) -> str:
    """A major word in its one spelling: upper case, single blanks, none next to hyphens and commas."""
    head = " ".join(head.upper().split())
    return head.replace(" -", "-").replace("- ", "-").replace(" ,", ",").replace(", ", ",")


def statement_of(text: str) -> Statement:
    """A whole statement (continuation joined, comment removed)."""
    head, slash, body = text.partition("/")
    head = head.strip()
    if not _MAJOR.fullmatch(head) or not any(ch.isalpha() for ch in head):
        return Statement(TEXT, text, words_of(text), False)
    body = body.strip()
    return Statement(major_of(head), body, words_of(body), bool(slash))


def _text_statement(text: str) -> Statement | None:
    upper = text[:7].upper()
    for word in TEXT_WORDS:
        if upper.startswith(word):
            body = text[len(word):].lstrip()
            return Statement(word, (body[1:] if body.startswith("/") else body).strip())
    return None


def _closed(text: str) -> str:
    """`$$ ->` as `$$->`."""
    return DATA_COMMENT + text[2:].lstrip()[2:] if text[2:].lstrip().startswith("->") else text


def _comment(text: str) -> Statement:
    if text.startswith(DATA_COMMENT):
        head, _, body = text[len(DATA_COMMENT):].partition("/")
        body = body.strip()
        return Statement(DATA_COMMENT + major_of(head), body, () if body.startswith(("{", "[")) else words_of(body))
    return Statement(COMMENT, text[2:].strip())


class Lexer:
    """Cuts the slow lines of a file into statements; equal lines are looked at once."""

    def __init__(self, data: bytes, scan: Scan, log: DiagnosticLog, known: Callable[[str], bool],
                 largest: float = LARGEST):
        self.data, self.scan, self.log, self.known, self.largest = data, scan, log, known, largest
        self.memo: dict[bytes, Statement | None] = {}
        self.next = 0

    def program(self) -> StatementList:
        """All statements of the file."""
        out, scan, memo, data = StatementList(), self.scan, self.memo, self.data
        total, feeds = len(scan.start), feed_lines(self.data, self.scan, self.largest)
        while self.next < total:
            i = self.next
            if feeds is not None and feeds.stop[i]:
                self._feeds(out, feeds, i, int(feeds.stop[i]))
                continue
            self.next = i + 1
            raw = data[scan.start[i]:scan.end[i]]
            if raw in memo:
                statement = memo[raw]
            else:
                statement = self._limited(self._read(raw, i))
                if statement is None or statement.major not in _RARELY_REPEATED:
                    if self.next == i + 1 and b"$" not in raw.replace(b"$$", b""):
                        memo[raw] = statement
                    if statement is not None:
                        out.first.setdefault(statement, scan.line[i])
            if statement is not None:
                out.statements.append(statement)
                out.lines.append(scan.line[i])
                out.before.append(scan.before[i])
        return out

    def _feeds(self, out: StatementList, feeds: FeedLines, i: int, stop: int) -> None:
        """Slow lines i to before `stop`, which state feeds in the form of one line."""
        scan, first = self.scan, feeds.first
        raw = self.data[scan.start[first]:scan.end[first]]
        statement = self.memo.get(raw) or self._read(raw, first)
        if statement is not None:
            self.memo[raw] = statement
            out.first.setdefault(statement, scan.line[i])
            out.feeds[len(out.statements)] = feeds.value[i:stop]
            out.statements.extend([statement] * (stop - i))
            out.lines.extend(scan.line[i:stop])
            out.before.extend(scan.before[i:stop])
        self.next = stop

    def _limited(self, statement: Statement | None) -> Statement | None:
        """Numbers beyond the limit are words, which no record takes for a number."""
        if statement is None or not any(isinstance(w, float) and abs(w) > self.largest for w in statement.words):
            return statement
        return replace(statement, words=tuple(repr(w) if isinstance(w, float) and abs(w) > self.largest else w
                                              for w in statement.words))

    def _read(self, raw: bytes, i: int) -> Statement | None:
        text = text_of(raw).strip()
        if not text:
            return None
        simple = _SIMPLE.fullmatch(text)
        if simple is not None and not simple[1].startswith(TEXT_WORDS):
            body = simple[2].strip()
            return Statement(simple[1], body, words_of(body))
        if text.startswith(COMMENT):
            text = _closed(text)
            return _comment(self._joined(text, i) if text.startswith(DATA_COMMENT) else text)
        text = self._unlabelled(text)
        fixed = _text_statement(text)
        if fixed is not None:
            return _text_statement(self._joined(text, i, text_word=True)) if text.endswith("$") else fixed
        joined = self._joined(text, i).strip()
        return statement_of(joined) if joined else None

    def _unlabelled(self, text: str) -> str:
        """`text` without the label of APT before a statement, as in `A10)GOTO/...`: not where a bracket
        stands in a word, as in `O)STOP`."""
        label = _LABEL.match(text)
        rest = text[label.end():] if label else ""
        if label and label[0].rstrip(" )").isalpha() and not label[0].endswith(" "):
            whole = major_of(label[0].rstrip(" )") + rest.partition("/")[0])
            if self.known(whole) or nearest(whole, BARE_WORDS):
                return text
        return rest if rest and (self._begins(rest) or self.known(major_of(rest))) else text

    def _joined(self, text: str, i: int, text_word: bool = False) -> str:
        """`text` with the lines that continue it."""
        parts: list[str] = []
        depth = 0
        while True:
            part, continued, lost = _cut(text, not parts and text.startswith(DATA_COMMENT), text_word)
            parts.append("," + part if parts and _numbers_meet(parts[-1], part) else part)
            if lost.startswith(DATA_COMMENT):
                self.log.error("cl.data-comment", f"{lost[:40]!r} stands behind a record: the end of a line is missing",
                               self.scan.line[self.next - 1], "put the remark on a line of its own")
                return "".join(parts)
            if lost:
                line = self.scan.line[self.next - 1]
                self.log.error("cl.dollar", f"{lost[:40]!r} stands behind a continuation mark $", line,
                               "end the line behind $, or write $$ before a comment")
                return "".join(parts)
            depth += part.count("(") - part.count(")")
            if not continued:
                return "".join(parts)
            following = self._following(i, depth > 0, continued == "certain" and not text_word)
            if following is None:
                return "".join(parts)
            text = following

    def _following(self, i: int, nested: bool, certain: bool) -> str | None:
        """The line that goes on after a continuation mark; None (and a diagnostic) where a new statement stands."""
        scan = self.scan
        line = scan.line[self.next - 1]
        while self.next < len(scan.start) and scan.before[self.next] == scan.before[i]:
            text = text_of(self.data[scan.start[self.next]:scan.end[self.next]])
            bare = text.strip()
            if not bare or (bare.startswith(COMMENT) and not bare.startswith(DATA_COMMENT)):
                self.next += 1
                continue
            if bare.startswith(COMMENT) or (not nested and self._begins(bare)):
                break
            self.next += 1
            return text
        if certain:
            self.log.error("cl.continuation", "a continuation mark $ is followed by a new statement", line,
                           "remove the mark or put the missing rest on the next line")
        return None

    def _begins(self, text: str) -> bool:
        """True where a line is the start of a statement by its first word."""
        head, slash, _ = text.partition("/")
        major = major_of(head)
        if slash:
            return self.known(major)
        return major in BARE_WORDS or _text_statement(text) is not None


def _numbers_meet(before: str, behind: str) -> bool:
    """Whether lines that are joined have a blank alone between two numbers, where others of a record have a comma."""
    last, first = before.rstrip()[-1:], behind.lstrip()[:1]
    apart = before[-1:].isspace() or behind[:1].isspace()
    return apart and bool(last and first) and last in _NUMBER_ENDS and first in _NUMBER_STARTS


def _cut(text: str, comment: bool, text_word: bool) -> tuple[str, Literal["", "certain", "maybe"], str]:
    """(text before a comment or continuation mark, "" | "certain" | "maybe" continued, text that would be lost)."""
    if comment or text_word:
        if not text.rstrip().endswith("$"):
            return text, "", ""
        return (text.rstrip()[:-1], "certain", "") if comment else (text.rstrip().rstrip("$ "), "maybe", "")
    at = text.find("$")
    if at < 0:
        return text, "", ""
    head, rest = text[:at], text[at:]
    if rest.startswith(COMMENT):
        # A remark that says something stands on a line of its own: here the end of the line before it is lost.
        return head, "", rest if head.strip() and _REMARK.match(rest) else ""
    after = rest[1:].strip()
    return head, "certain", "" if after.startswith("$") or _CARD_LABEL.fullmatch(rest[1:]) else after
