"""What is done pass by pass."""

from __future__ import annotations

from collections.abc import Callable

from postproc.orientation.allowed import Allowed
from postproc.orientation.candidates import Tried, tried
from postproc.orientation.passes import Work

Progress = Callable[[str, int, int], None]


class PassFault(Exception):
    """No motion could be planned for the pass of a line."""

    def __init__(self, message: str, line: int) -> None:
        super().__init__(message)
        self.line = line


def search_all(work: Work, allowed: Allowed, progress: Progress | None = None) -> list[Tried]:
    """The search in each pass.

    Raises:
        PassFault: where no motion can be planned.
    """
    results = []
    for one in work.passes:
        if progress is not None:
            progress("orienting", one.number, len(work.passes))
        try:
            results.append(tried(one, work.machine, allowed, len(work.passes)))
        except (ValueError, ArithmeticError) as fault:
            raise PassFault(str(fault), one.line) from fault
    return results
