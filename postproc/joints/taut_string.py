"""The taut string: of all functions through a row of gates the one of the least slopes."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats
from toolpaths.compiled import chosen, loop

COMPILE_FROM = 10_000
"""gates"""


def taut_string(at: Floats, low: Floats, high: Floats) -> Floats:
    """Values (N,) at places `at` (N,), rising, with low <= value <= high, that minimise every convex function of the slopes.

    The first and last gates must be closed (low = high). The shortest path through the gates does it for all
    convex functions at once, the largest slope among them (Barlow, Bartholomew, Bremner, Brunk, Statistical
    Inference under Order Restrictions, 1972, the taut string). Found by the funnel from the last bend: where
    it closes, the string bends at the gate that closed it.
    """
    result = np.empty(len(at))
    corner, value = 0, float(low[0])
    result[0] = value
    next_bend = chosen(_next_bend, len(at), COMPILE_FROM)
    while corner < len(at) - 1:
        bend, slope = next_bend(at, low, high, corner, value)
        rows = np.arange(corner + 1, bend + 1)
        result[rows] = value + slope * (at[rows] - at[corner])
        corner, value = bend, float(result[bend])
    return np.clip(result, low, high)


@loop
def _next_bend(at: Floats, low: Floats, high: Floats, corner: int, value: float) -> tuple[int, float]:
    """(gate where the string bends next or ends, slope on the path there) from gate `corner`."""
    steepest, flattest = np.inf, -np.inf
    upper = lower = corner + 1
    for k in range(corner + 1, len(at)):
        run = at[k] - at[corner]
        up, down = (high[k] - value) / run, (low[k] - value) / run
        if down > steepest:
            return upper, steepest
        if up < flattest:
            return lower, flattest
        if up <= steepest:
            steepest, upper = up, k
        if down >= flattest:
            flattest, lower = down, k
    return len(at) - 1, (low[-1] - value) / (at[-1] - at[corner])
