"""Collects diagnostics while a file is read: repeats of one problem become one entry with its lines."""

from __future__ import annotations

import re

from toolpaths.arrays import Ints
from toolpaths.diagnostics import Diagnostic, Severity
from toolpaths.pattern import pattern

_LINES_KEPT = 10
_LONGEST = 300
"""characters of a message; records may have a million"""
_MOST_ADVICES = 4
"""hints of one code and key that are listed apart"""
_NUMBERS = pattern(r"[-+\d.,;eE ]+", re.ASCII)


class _Entry:
    __slots__ = ("code", "count", "hint", "lines", "message", "severity")

    def __init__(self, severity: Severity, code: str, message: str, hint: str):
        self.severity, self.code, self.message, self.hint = severity, code, message, hint
        self.lines: list[int] = []
        self.count = 0


class DiagnosticLog:
    """Diagnostics of one file, merged by code, `key` and hint, its numbers aside (the first message stands for all): what is
    to be done otherwise is another problem."""

    def __init__(self, file: str = ""):
        self.file = file
        self._entries: dict[tuple[Severity, str, str], dict[str, _Entry]] = {}

    def add(self, severity: Severity, code: str, message: str, line: int = 0, hint: str = "",
            key: str = "") -> None:
        """Note one problem; `key` distinguishes problems of one code that are to be listed apart."""
        entry = self._entry(severity, code, message, hint, key)
        entry.count += 1
        if line > 0 and len(entry.lines) < _LINES_KEPT and line not in entry.lines:
            entry.lines.append(line)

    def many(self, severity: Severity, code: str, message: str, lines: Ints, hint: str = "") -> None:
        """The same problem in many lines (K,); nothing where there are none."""
        if not len(lines):
            return
        for line in lines[:_LINES_KEPT].tolist():
            self.add(severity, code, message, line, hint)
        self._entry(severity, code, message, hint, "").count += max(0, len(lines) - _LINES_KEPT)

    def _entry(self, severity: Severity, code: str, message: str, hint: str, key: str) -> _Entry:
        """The entry that a problem belongs to."""
        known = self._entries.setdefault((severity, code, key), {})
        advice = _NUMBERS.sub("", hint)
        if advice not in known and len(known) == _MOST_ADVICES:
            return next(iter(known.values()))
        return known.setdefault(advice, _Entry(severity, code, _short(message), hint))

    def _all(self) -> list[_Entry]:
        return [entry for known in self._entries.values() for entry in known.values()]

    def lines_with_errors(self) -> frozenset[int]:
        """Lines that an ERROR names."""
        errors = (entry.lines for entry in self._all() if entry.severity is Severity.ERROR)
        return frozenset(line for lines in errors for line in lines)

    def error(self, code: str, message: str, line: int = 0, hint: str = "", key: str = "") -> None:
        """An ERROR."""
        self.add(Severity.ERROR, code, message, line, hint, key)

    def warning(self, code: str, message: str, line: int = 0, hint: str = "", key: str = "") -> None:
        """A WARNING."""
        self.add(Severity.WARNING, code, message, line, hint, key)

    def info(self, code: str, message: str, line: int = 0, hint: str = "", key: str = "") -> None:
        """An INFO."""
        self.add(Severity.INFO, code, message, line, hint, key)

    def diagnostics(self) -> list[Diagnostic]:
        """What was noted, errors first, then by line."""
        found = [Diagnostic(e.severity, e.code, e.message, self.file, tuple(e.lines), e.count, e.hint)
                 for e in self._all()]
        return sorted(found, key=lambda d: (-int(d.severity), d.lines[:1] or (0,)))


def _short(message: str) -> str:
    """Beginning and end of a long message."""
    half = _LONGEST // 2
    return message if len(message) <= _LONGEST else f"{message[:half]} ... {message[-half:]}"
