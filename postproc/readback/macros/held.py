"""What the control holds besides a program that is executed: home, work offsets, tool lengths, as the set-up has them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import field

from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

MOST_BLOCKS = 1_000_000
"""blocks that are executed before a program counts as endless, where nothing else is asked for (`--max-blocks`)"""
_most: ContextVar[int] = ContextVar("most", default=MOST_BLOCKS)


@contextmanager
def most_blocks(number: int) -> Iterator[None]:
    """Programs of up to `number` blocks are executed."""
    before = _most.set(number)
    try:
        yield
    finally:
        _most.reset(before)


def most_now() -> int:
    """How many blocks are executed before a program counts as endless."""
    return _most.get()


@dataclass(frozen=True)
@arrays(home="J")
class Held:
    """Of a control with `axes` in the order of the joints.

    Attributes:
        home (J,): machine coordinates, mm and degrees; None where it is not known
        work: (J,) of the work offset of a register; None where the set-up is not known
        lengths: mm by register
        tools: names of the tools by number, as the control calls them
        passive: codes of the shop that change nothing
        most: blocks that are executed before a program counts as endless
        stated: registers whose work offsets the set-up states, None where they are not known
    """

    axes: tuple[str, ...]
    home: Floats | None = None
    work: Callable[[float], Floats] | None = None
    lengths: dict[int, float] = field(default_factory=dict)
    tools: dict[int, str] = field(default_factory=dict)
    passive: tuple[str, ...] = ()
    most: int = MOST_BLOCKS
    stated: frozenset[float] | None = None
