"""Memory that a finished stage leaves free is there for the next one."""

from __future__ import annotations

import sys

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
