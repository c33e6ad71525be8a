"""Subprograms of a CL file (DEFSUB ... ENDSUB), by the number or name that CALSUB calls them by."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Sequence

from toolpaths.cl.text.statements import Statement
from toolpaths.dataclass import dataclass

Called = float | str
NAME = re.compile(r"[A-Z][A-Z0-9_.-]*")
"""of a subprogram"""
_DAMAGED = re.compile(r"[A-Z]\d*")


@dataclass(frozen=True)
class Subprograms:
    """Statements of DEFSUB and ENDSUB: `ends` by that of DEFSUB; `named` in the order of the file."""

    ends: dict[int, int]
    named: dict[Called, list[tuple[int, int]]]

    def elsewhere(self, name: Called) -> bool:
        """True where a call means a program that the machine keeps: by name in a file without subprograms.

        A letter before digits alone may be what is left of a number.
        """
        return not self.named and isinstance(name, str) and bool(name) and not _DAMAGED.fullmatch(name)

    def place(self, name: Called, at: int) -> tuple[int, int] | None:
        """The subprogram that a call at statement `at` means: defined last before it, else first after it."""
        places = self.named.get(name, [])
        before = bisect_left(places, (at, 0))
        return places[max(before - 1, 0)] if places else None


def subprograms_of(statements: Sequence[Statement]) -> Subprograms:
    """All subprograms that have an end."""
    begun: list[int] = []
    ends: dict[int, int] = {}
    for i, s in enumerate(statements):
        if s.major == "DEFSUB":
            begun.append(i)
        elif s.major == "ENDSUB" and begun:
            ends[begun.pop()] = i
    named: dict[Called, list[tuple[int, int]]] = {}
    for start in sorted(ends):
        named.setdefault(called(statements[start]), []).append((start, ends[start]))
    return Subprograms(ends, named)


def called(s: Statement) -> Called:
    """Number or name of a subprogram, "" without one."""
    first = s.words[0] if s.words else ""
    return first.strip().upper() if isinstance(first, str) else first


def shown(name: Called) -> str:
    """A number or name as files write it."""
    return name if isinstance(name, str) else f"{name:g}"
