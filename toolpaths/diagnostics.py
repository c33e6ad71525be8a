"""Problems as data: severity, stable code, message, place, hint.

Nothing in the project prints or raises for a fault of the input: it returns diagnostics. An ERROR means that
no output file may be written.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import IntEnum
from typing import TypeVar

from toolpaths.dataclass import dataclass

_Value = TypeVar("_Value")


class Severity(IntEnum):
    """How bad it is: INFO and WARNING let the work go on, ERROR stops it."""

    INFO = 0
    WARNING = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One problem. `code` is stable (`area.what`), `lines` are 1-based lines of `file` (at most a few of `count`)."""

    severity: Severity
    code: str
    message: str
    file: str = ""
    lines: tuple[int, ...] = ()
    count: int = 1
    hint: str = ""

    def __str__(self) -> str:
        place = self.file
        if self.lines:
            place += f":{self.lines[0]}"
        more = ""
        if self.count > 1:
            shown = ", ".join(str(n) for n in self.lines[:6]) + (", ..." if self.count > len(self.lines[:6]) else "")
            more = f" ({self.count} times, lines {shown})" if self.lines else f" ({self.count} times)"
        text = f"{place + ': ' if place else ''}{self.severity.name.lower()} [{self.code}] {self.message}{more}"
        return f"{text}; {self.hint}" if self.hint else text

    def as_dict(self) -> dict[str, object]:
        """The JSON form used by every command."""
        return {
            "severity": self.severity.name.lower(),
            "code": self.code,
            "message": self.message,
            "file": self.file,
            "lines": list(self.lines),
            "count": self.count,
            "hint": self.hint,
        }


class DiagnosticError(ValueError):
    """Raised by library calls that cannot return a value; carries the diagnostics that say why."""

    def __init__(self, diagnostics: Sequence[Diagnostic]):
        self.diagnostics = tuple(diagnostics)
        super().__init__("\n".join(str(d) for d in self.diagnostics if d.severity is Severity.ERROR))


def has_errors(diagnostics: Iterable[Diagnostic]) -> bool:
    """True where any diagnostic is an ERROR."""
    return any(d.severity is Severity.ERROR for d in diagnostics)


def require(diagnostics: Sequence[Diagnostic]) -> None:
    """Raise DiagnosticError where any diagnostic is an ERROR."""
    if has_errors(diagnostics):
        raise DiagnosticError(diagnostics)


def read_value(read: tuple[_Value | None, Sequence[Diagnostic]]) -> _Value:
    """What a file was read as; DiagnosticError where it is None or an ERROR stands against it."""
    value, diagnostics = read
    if value is None or has_errors(diagnostics):
        raise DiagnosticError(diagnostics)
    return value


def _stated(lines: Sequence[int]) -> tuple[int, ...]:
    """Line 0 stands for what no line of the file says."""
    return tuple(line for line in lines if line > 0)


REPORT = "a fault of postproc: report it with the files and the command line"
"""how the hint of a code begins that no file is known to lead to: it is there so that such a fault stops in words"""


def error(code: str, message: str, *, file: str = "", lines: Sequence[int] = (), count: int = 1,
          hint: str = "") -> Diagnostic:
    """A Diagnostic that stops the work."""
    return Diagnostic(Severity.ERROR, code, message, file, _stated(lines), count, hint)


def warning(code: str, message: str, *, file: str = "", lines: Sequence[int] = (), count: int = 1,
            hint: str = "") -> Diagnostic:
    """A Diagnostic that lets the work go on but needs a look."""
    return Diagnostic(Severity.WARNING, code, message, file, _stated(lines), count, hint)


def info(code: str, message: str, *, file: str = "", lines: Sequence[int] = (), count: int = 1,
         hint: str = "") -> Diagnostic:
    """A Diagnostic that only says."""
    return Diagnostic(Severity.INFO, code, message, file, _stated(lines), count, hint)


SHOWN = 60
"""characters of a value that a message shows"""


def value_shown(value: object) -> str:
    """What was given in the place of one value: in full where that is short, of arrays their type and shape alone."""
    if shape := getattr(value, "shape", ()):
        return f"an array of {getattr(value, 'dtype', 'values')}, shape {shape}"
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."
