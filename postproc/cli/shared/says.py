"""How much a command says, by its options -q, -v and --strict; texts as a terminal may be given them; answers."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING
from unicodedata import category

from toolpaths.dataclass import dataclass

if TYPE_CHECKING:
    from toolpaths.diagnostics import Diagnostic


@dataclass
class Says:
    """Set by the options of the command that runs.

    Attributes:
        quiet: notes, figures and the job file's line are left out
        verbose: each stage is named as it begins
        strict: warnings are errors
        job_line: what --quiet holds back until there is a warning or an error: the values that a job file gives
        interrupted: what is said where the command is interrupted, "" where nothing was written
        still: stops what moves on the terminal, as a progress bar does, while something is asked
        job_units: the job file whose units the command takes, "" where it has its own or none
    """

    quiet: bool = False
    verbose: bool = False
    strict: bool = False
    job_units: str = ""
    job_line: str = ""
    interrupted: str = ""
    still: Callable[[], None] = lambda: None


SAYS = Says()
"""of the command that runs: every command sets all three before it begins"""


def readable(text: str) -> str:
    """A text of files as a terminal may be given it: a mark for each control but the ends of lines, and for each sign that
    turns writing (Unicode categories Cc and Cf)."""
    if text.replace("\n", "").isprintable():
        return text
    return "".join("\N{REPLACEMENT CHARACTER}" if c != "\n" and category(c) in ("Cc", "Cf") else c for c in text)


def answer_line(question: str) -> str:
    """One line of standard input to a question, which is asked on standard error: nothing moves there until it is answered.

    Raises:
        EOFError: where it has ended, is closed, or cannot be read.
    """
    SAYS.still()
    waits = _waits()
    if waits:
        sys.stderr.write(readable(question))
        sys.stderr.flush()
    try:
        line = sys.stdin.readline() if sys.stdin is not None else ""
    except OSError:
        line = ""
    if line and not waits:
        sys.stderr.write(readable(question))
    if not line:
        sys.stderr.write("\n" * waits)
        raise EOFError
    return line


def _waits() -> bool:
    """True where standard input may wait for the question: not a file, the null device, or closed."""
    try:
        kind = os.fstat(sys.stdin.fileno()).st_mode if sys.stdin is not None else stat.S_IFREG
    except (OSError, ValueError):
        return True
    return sys.stdin is not None and (sys.stdin.isatty() or not (stat.S_ISCHR(kind) or stat.S_ISREG(kind)))


def as_errors(diagnostics: tuple[Diagnostic, ...]) -> tuple[Diagnostic, ...]:
    """The diagnostics with warnings as errors."""
    from dataclasses import replace

    from toolpaths.diagnostics import Severity

    return tuple(replace(d, severity=Severity.ERROR) if d.severity is Severity.WARNING else d for d in diagnostics)
