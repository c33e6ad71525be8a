"""One orientation per pass, out of tables of seconds: shortest way through the passes by dynamic programming."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpaths.arrays import Floats


def shortest(states: Sequence[Floats], ways: Sequence[Floats]) -> tuple[list[int], float]:
    """(state of each pass, seconds in all) of least time.

    Args:
        states: (K_n,) seconds of each state of pass n
        ways: seconds between; ways[0] (1, K_0) from home, ways[n] (K_n-1, K_n), the last (K_N-1, 1) back home
    """
    best = ways[0][0] + states[0]
    came = []
    for cost, way in zip([*states[1:], np.zeros(1)], ways[1:], strict=True):
        through = best[:, None] + way
        came.append(through.argmin(axis=0))
        best = through.min(axis=0) + cost
    at, picked = 0, []
    for back in reversed(came):
        at = int(back[at])
        picked.append(at)
    return picked[::-1], float(best[0])


def seconds(picked: Sequence[int], states: Sequence[Floats], ways: Sequence[Floats]) -> float:
    """Seconds in all of given states, added up in the order of `shortest`, so that equal choices give equal numbers."""
    total = ways[0][0, picked[0]] + states[0][picked[0]]
    for n in range(1, len(picked)):
        total = total + ways[n][picked[n - 1], picked[n]] + states[n][picked[n]]
    return float(total + ways[-1][picked[-1], 0])
