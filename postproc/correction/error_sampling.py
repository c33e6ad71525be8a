"""Where long blocks are looked at besides the usual places: errors may change their course many times in them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from toolpaths.arrays import Floats, Ints

MOST = 4000
"""looks at one block"""
AT_ONCE = 200_000
"""looks at a time"""
SHARES = 0.21, 0.68
"""of each stretch, where it is looked at"""


def changes(step: Floats, detail: Floats) -> Ints:
    """(N,) stretches of blocks in which joints go by step (N, J), no joint farther than its `detail` (J,); MOST at most."""
    with np.errstate(invalid="ignore"):
        count = np.ceil(np.nan_to_num(np.abs(step) / detail).max(axis=1, initial=0.0))
    result: Ints = np.clip(count, 1, MOST).astype(np.int64)
    return result


def looks_between(count: Ints) -> Iterator[tuple[Ints, Floats]]:
    """(rows (M,), fractions (M,)) at which blocks of `count` (N,) stretches are looked at, those of more than one."""
    many = np.flatnonzero(count > 1)
    begins = np.concatenate([[0], np.cumsum(count[many])])
    for first in range(0, int(begins[-1]), AT_ONCE):
        at = np.arange(first, min(first + AT_ONCE, int(begins[-1])))
        k = np.searchsorted(begins, at, side="right") - 1
        for share in SHARES:
            yield many[k], (at - begins[k] + share) / count[many[k]]
