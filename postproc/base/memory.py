"""Memory that a finished stage leaves free goes back to the system, so that the next one does not come on top of it."""

from __future__ import annotations

import sys

MANY = 20_000
"""moves or blocks from which on it pays: looking through what is free takes milliseconds, whatever is found"""


LARGE = 1_000_000
"""bytes of a CL file from which on its arrays are so large that each would come from the system"""
_TRIM_THRESHOLD, _MMAP_MAX, _KEPT = -1, -4, 1 << 30
"""parameters of mallopt(3); bytes that stay free at the end of the heap"""


def reuse(size: int) -> None:
    """Large arrays take the place of those that are no longer used: else the system empties every page of each, a fifth of
    the processor time of a million points. glibc, mallopt(3); `size`: bytes of the file that is worked on,
    as far as LARGE."""
    if size < LARGE or sys.platform != "linux":
        return
    import ctypes

    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_MMAP_MAX, 0)
        mallopt(_TRIM_THRESHOLD, _KEPT)


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
