"""What workers of tests do; they find it by its name."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from postproc.base.team import forked
from postproc.orientation.passes.passes import PassContext


def squared(shared: tuple[int, str], item: int) -> int:
    """The item times what is shared, squared; the worker that first gets the item 5 is killed."""
    factor, mark = shared
    if item == 5 and mark:
        killed_once(Path(mark))
    return factor * item * item


def killed_once(mark: Path) -> None:
    """The process that comes here first is killed; the others find its number."""
    if not mark.exists():
        mark.write_text(str(os.getpid()), encoding="utf-8")
        os.kill(os.getpid(), signal.SIGKILL)


def line_of(work: PassContext, mark: str, number: int, before: int | None) -> int:
    """The line of a pass; the worker that first gets the pass 9 is killed."""
    if number == 9:
        killed_once(Path(mark))
    return work.passes[number].line


def without_processes(shared: int, item: int) -> bool:
    """True where this worker begins no processes of its own: those of a cluster may not."""
    return forked() is None


def refuses(shared: int, item: int) -> int:
    """A fault of the function itself."""
    raise ArithmeticError(f"no {shared} {item}")
