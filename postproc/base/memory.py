"""Memory that a finished stage leaves free goes back to the system, so that the next one does not come on top of it."""

from __future__ import annotations

import sys

MANY = 20_000
"""moves or blocks from which on it pays: looking through what is free takes milliseconds, whatever is found"""


def give_back(rows: int) -> None:
    """Ask the C library for it where it keeps what is free between blocks in use: glibc, malloc_trim(3).

    `rows`: moves or blocks that the stage has worked on.
    """
    if rows < MANY or sys.platform != "linux":
        return
    import ctypes

    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)
