"""The files of a program and of its subprograms: rows without comments, lines counted through all of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import PurePath

from postproc.readback.text.canonical import Files
from postproc.readback.text.words import block_delete, plain
from toolpaths.diagnostics import Diagnostic

Cleaned = Callable[[bytes, str], tuple[list[str], list[Diagnostic]]]


@dataclass
class SourceFile:
    """Rows of one file by number from 0; `before`: lines of the files that were read earlier."""

    name: str
    rows: list[str]
    before: int
    places: dict[str, int] = field(default_factory=dict)
    """what was looked for in it, by its text"""
    numbers: dict[int, list[int]] = field(default_factory=dict)
    """rows by their block number"""


class ProgramFiles:
    """The files by the order in which they were read; others are opened where they are called.

    `cleaned` makes rows of the bytes of a file: in capitals where the control knows no small letters.
    """

    def __init__(self, data: bytes, file: str, others: Mapping[str, bytes], cleaned: Cleaned) -> None:
        self.others, self.cleaned = others, cleaned
        self.read: list[SourceFile] = []
        self.found: list[Diagnostic] = []
        self.stems: dict[str, str] = {}
        for name in others:
            self.stems.setdefault(PurePath(name).stem.upper(), name)
        self._add(data, file)

    def _add(self, data: bytes, name: str) -> SourceFile:
        rows, found = self.cleaned(data, name)
        before = sum(len(s.rows) for s in self.read)
        self.read.append(SourceFile(name, rows, before))
        self.found += found
        return self.read[-1]

    def open(self, stems: Iterable[str]) -> SourceFile | None:
        """The first file that has one of these names, without its ending and in capitals; None for none."""
        for stem in stems:
            if (name := self.stems.get(stem.upper())) is not None:
                known = next((s for s in self.read if s.name == name), None)
                return known or self._add(self.others[name], name)
        return None

    @property
    def files(self) -> Files:
        """Names, with the lines before each, as `Canonical.files` has them."""
        return tuple((s.name, s.before) for s in self.read) if len(self.read) > 1 else ()


def word_rows(data: bytes, file: str) -> tuple[list[str], list[Diagnostic]]:
    """Rows of a program of words without comments, blanks and tape marks, in capitals."""
    text, found = block_delete(re.sub(rb"(?m)^[ \t]*%[^\n]*", b"", plain(data).upper()), file)
    return re.sub(r"[ \t]", "", text.decode("ascii", "replace")).split("\n")[:-1], found
