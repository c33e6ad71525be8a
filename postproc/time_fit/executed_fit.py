"""A fit refined on the control as it is executed.

The formulas of look-ahead give a fit quickly, but their times differ from those of the executed control by some per cent.
The steps here are those of Gauss and Newton with what the executed control is off: first with the slopes of the formulas,
from the begin and from the fit of the formulas, of which what leaves less is kept, then with slopes of the executed control.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from toolpaths.arrays import Floats

ROUNDS, HALVINGS = 6, 3
"""steps at most, and times that each is halved where it makes the misfit larger"""
LARGE = 3.0
"""standard deviations from which what a section is off counts less than by its square"""
GAINED = 1e-3
"""share of the misfit below which a step is the last"""
STEP = 0.2
"""prior deviations over which slopes of the executed control are taken: its times go by whole cycles"""

Times = Callable[[Floats], Floats]
"""from parameters, in prior deviations about the begin, to the times of the sections"""


def refined(starts: list[Floats], executed: Times, slopes: Times, measured: Floats, uncertainty: Floats,
            most: float) -> Floats:
    """(F,) parameters in prior deviations.

    Args:
        starts: of (F,) to begin from; executed: times (K,) of the control; slopes: (K, F) of them, or of the formulas
        measured, uncertainty (K,): s; most: prior deviations that a parameter may move
    """
    ends = [_from(x, executed, slopes, measured, uncertainty, most) for x in starts]
    return min(ends, key=lambda end: end[1])[0]


def own_slopes(executed: Times, x: Floats) -> Floats:
    """(K, F) by central differences over 2 STEP."""
    moves = STEP * np.eye(len(x))
    return np.stack([(executed(x + move) - executed(x - move)) / (2.0 * STEP) for move in moves], axis=1)


def _from(x: Floats, executed: Times, slopes: Times, measured: Floats, uncertainty: Floats,
          most: float) -> tuple[Floats, float]:
    """(parameters, misfit) that one begin leads to."""
    off = (executed(x) - measured) / uncertainty
    least = _misfit(off, x)
    for _ in range(ROUNDS):
        robust = (1.0 + (off / LARGE) ** 2) ** -0.25
        along = slopes(x) / uncertainty[:, None] * robust[:, None]
        step = -np.linalg.solve(along.T @ along + np.eye(len(x)), along.T @ (off * robust) + x)
        before = least
        for half in range(HALVINGS):
            there = np.clip(x + step / 2.0**half, -most, most)
            missed = (executed(there) - measured) / uncertainty
            if _misfit(missed, there) < least:
                x, off, least = there, missed, _misfit(missed, there)
                break
        if least > (1.0 - GAINED) * before:
            break
    return x, least


def _misfit(off: Floats, x: Floats) -> float:
    """Of sections off by standard deviations (K,), and of parameters (F,) under their prior."""
    return float((2.0 * LARGE**2 * (np.sqrt(1.0 + (off / LARGE) ** 2) - 1.0)).sum() + x @ x)
