"""The same done for every pass, by workers where there are some; the results do not depend on how many there are.

Only results travel back; passes, machine and what is allowed are named in them instead of written (`_Packer`).
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

from postproc.base.progress import Progress
from postproc.base.team import Processes, Team, forked, team_at_hand
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.passes import PassContext

T = TypeVar("T")
CHUNK = 8
"""passes that are done one after the other"""
_FEWEST = 4 * CHUNK
"""passes from which workers pay"""
_Work = tuple[Callable[[int, Any], Any], PassContext, AllowedAxes]


class PassFault(Exception):
    """No motion could be planned for the pass of a line."""

    def __init__(self, message: str, line: int) -> None:
        super().__init__(message, line)
        self.line = line

    def __str__(self) -> str:
        return str(self.args[0])


def each_pass(function: Callable[[int, T | None], T], work: PassContext, allowed: AllowedAxes, name: str,
              progress: Progress | None = None, workers: int | None = None) -> list[T]:
    """`function` of the numbers of all passes, in order; `progress` is reported `name` and how far it is.

    Args:
        function: of the number and of what it gave for the pass before, None for the first of each CHUNK
        workers: processes, None for those of `postproc.base.team.working`, else as many as there are cores; 1 for this one
            alone

    Raises:
        PassFault: where no motion can be planned.
    """
    count = len(work.passes)
    chunks = [range(first, min(first + CHUNK, count)) for first in range(0, count, CHUNK)]
    result: list[T] = []

    def take(found: list[T]) -> None:
        result.extend(found)
        if progress is not None:
            progress(name, len(result) - 1, count)

    team = _team(workers)
    if team is None or min(team.size, len(chunks)) < 2 or count < _FEWEST:
        for chunk in chunks:
            for found in _in_turn(function, chunk, work):
                take([found])
        return result
    crew = team.crew(_chunk, (function, work, allowed))
    try:
        for packed in crew.results(chunks):
            take(_unpacked(packed, work, allowed))
    finally:
        crew.close()
    return result


def _team(workers: int | None) -> Team | None:
    """Who does it; None for this process."""
    if workers is None:
        return team_at_hand() or forked()
    return Processes(workers) if workers > 1 else None


def _chunk(shared: _Work, passes: range) -> bytes:
    """In a worker: results of some passes, packed."""
    function, work, allowed = shared
    out = io.BytesIO()
    _Packer(out, work, allowed).dump(list(_in_turn(function, passes, work)))
    return out.getvalue()


def _in_turn(function: Callable[[int, T | None], T], passes: range, work: PassContext) -> Iterator[T]:
    """Of one pass after the other; faults of planning are reported by the line of the pass."""
    before: T | None = None
    for one in work.passes[passes.start:passes.stop]:
        try:
            before = function(one.number, before)
        except (ValueError, ArithmeticError) as fault:
            raise PassFault(str(fault), one.line) from fault
        yield before


class _Packer(pickle.Pickler):
    """Names passes, machine and what is allowed, which the parent has."""

    def __init__(self, out: io.BytesIO, work: PassContext, allowed: AllowedAxes) -> None:
        super().__init__(out, pickle.HIGHEST_PROTOCOL)
        self._names = {id(work.machine): "machine", id(allowed): "allowed"} | {id(one): one.number for one in work.passes}

    def persistent_id(self, value: Any) -> str | int | None:
        """Its name, None for all else."""
        return self._names.get(id(value))


class _Unpacker(pickle.Unpickler):
    """In the other direction."""

    def __init__(self, packed: bytes, work: PassContext, allowed: AllowedAxes) -> None:
        super().__init__(io.BytesIO(packed))
        self._named: dict[str | int, Any] = {"machine": work.machine, "allowed": allowed}
        self._named |= {one.number: one for one in work.passes}

    def persistent_load(self, name: Any) -> Any:
        """What has the name."""
        return self._named[name]


def _unpacked(packed: bytes, work: PassContext, allowed: AllowedAxes) -> Any:
    return _Unpacker(packed, work, allowed).load()
