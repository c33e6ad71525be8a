"""Few changes of F: neighbouring blocks whose feeds differ little share the lowest of them."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints


def merged(feed: Floats, open_to_it: Bools, group: Ints, spread: float) -> Floats:
    """Feeds (K,) such that runs of blocks have one; none is raised, and none lowered by more than the part `spread`.

    Args:
        open_to_it (K,): blocks that take part; others keep theirs and end a run
        group (K,): a run stays inside one
        spread: 0.1 allows 10 % less
    """
    result = feed.copy()
    rows = np.flatnonzero(open_to_it)
    if spread <= 0.0 or not len(rows):
        return result
    breaks = np.concatenate(([True], (np.diff(rows) > 1) | (np.diff(group[rows]) != 0)))
    values, first = feed[rows].tolist(), 0
    low = high = values[0]
    lows = []
    for k, (value, new) in enumerate(zip(values, breaks.tolist(), strict=True)):
        if new or max(high, value) * (1.0 - spread) > min(low, value):
            lows.append((low, k - first))
            first, low, high = k, value, value
        low, high = min(low, value), max(high, value)
    lows.append((low, len(values) - first))
    result[rows] = np.repeat([value for value, _ in lows], [count for _, count in lows])
    return result
