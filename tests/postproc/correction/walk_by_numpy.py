"""The walk of `postproc.correction.backlash_steps_loop` with numpy: sums in another order."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from postproc.correction.backlash_steps import BETWEEN, NEARER, PLAIN, REACH, RESTS, BlockEnds
from toolpaths.arrays import Floats

AROUND = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))
"""(27, 3) where"""
MOST = 6
"""joints that any machine has at most"""
DIRECTIONS = np.array(list(product((0.0, 1.0, -1.0), repeat=MOST)))[:, ::-1].copy()
"""(3^6, 6) approach directions that are tried, the first 3^T of the first T joints being all theirs; 0 where
that before stays"""
STAYS = 1.0 - np.abs(DIRECTIONS)


def walk(ends: BlockEnds) -> tuple[Floats, Floats]:
    """As `postproc.correction.backlash_steps.walk`."""
    steps, approaches = _walk(*vars(ends).values())
    return steps, approaches


def _walk(off: Any, by_approach: Any, tip_rates: Any, back: Any, gap: Any, bend: Any, last: Any, later: Any, goes_on: Any,
          weight: Any, plain: Any, near: Any, enough: Any, free: Any, like: Any) -> Any:
    blocks, lossy = gap.shape
    result, approaches = np.zeros((blocks, 3)), np.zeros((blocks, lossy))
    approach, shifted = np.zeros(lossy), np.zeros(lossy)
    for k in range(blocks):
        start = np.minimum(np.maximum(approach - 2.0 * shifted / gap[k] + bend[0, k], bend[1, k]), bend[2, k]) + last[k]
        turned = back[k].T
        n = np.zeros((1, 3))
        if free[k].any():
            weighed = 0.0 if not plain[k] else BETWEEN if enough[k] <= near[k] else PLAIN
            rates, swayed = tip_rates[k].T, by_approach[k].T
            case = (start, turned, rates, off[k], swayed, gap[k], goes_on[k], weight[k], later[:, k], free[k], approach,
                    weighed,
                    np.linalg.inv(rates))
            cost = _costs(n, case)[0]
            if cost > near[k]:
                n, cost = _toward(n, cost, case)
            if cost > enough[k]:
                n, cost = _adjacent(n, cost, case)
            if cost > enough[k]:
                n, cost = _by_approach(n, cost, case)
                n, cost = _adjacent(n, cost, case)
        elif like[k] >= 0:
            n[0] = result[like[k]]
        result[k] = n[0]
        shifted = n[0] @ turned
        approach = np.minimum(np.maximum(start + 2.0 * shifted / gap[k], -1.0), 1.0)
        approaches[k] = approach
    return result, approaches


def _ended(n: Any, case: Any) -> Any:
    """Approach directions (N, T) at the end of the block after steps n (N, 3) of last decimals."""
    return np.minimum(np.maximum(case[0] + 2.0 * (n @ case[1]) / case[5], -1.0), 1.0)


def _costs(n: Any, case: Any) -> Any:
    """(N,) mm that the tip is off by after steps n (N, 3), and the weighted parts of what the next block
    begins off by and of a plain reading."""
    ended, goes_on, later, by_approach = _ended(n, case), case[6], case[8], case[4]
    approach = np.minimum(np.maximum(ended + later[0], later[1]), later[2])
    tip = case[3] + approach @ by_approach + n @ case[2]
    late = (np.abs(goes_on) * (goes_on - approach)) @ by_approach
    cost = np.sqrt((tip * tip).sum(axis=1)) + case[7] * np.sqrt((late * late).sum(axis=1))
    if case[11] > 0.0:
        step = case[0] - case[10] + 2.0 * (n @ case[1]) / case[5]
        other = ((np.abs(step) > RESTS) * (np.sign(step) - ended)) @ by_approach
        cost = cost + case[11] * np.sqrt((other * other).sum(axis=1))
    return cost


def _nearest(tip: Any, case: Any) -> Any:
    """Steps (N, 3) that take back what the tip is off by, (N, 3)."""
    return -np.round(tip @ case[12]) * case[9]


def _toward(n: Any, cost: Any, case: Any) -> Any:
    """The nearest steps for the approach directions that the steps n (1, 3) make, those of the next, as long
    as it comes nearer."""
    while True:
        later = case[8]
        approach = np.minimum(np.maximum(_ended(n, case) + later[0], later[1]), later[2])
        better = n + _nearest(case[3] + approach @ case[4] + n @ case[2], case)
        there = _costs(better, case)[0]
        if there >= cost:
            return n, cost
        n, cost = better, there


def _by_approach(n: Any, cost: Any, case: Any) -> Any:
    """The nearest steps for every approach direction that is one of both or that before, where that comes
    nearer than n (1, 3)."""
    lossy = len(case[5])
    approaches = DIRECTIONS[:3 ** lossy, :lossy] + case[10] * STAYS[:3 ** lossy, :lossy]
    others = _nearest(case[3] + approaches @ case[4], case)
    costs = _costs(others, case)
    k = np.argmin(costs)
    return (others[k:k + 1], costs[k]) if costs[k] < cost else (n, cost)


def _adjacent(n: Any, cost: Any, case: Any) -> Any:
    """The best steps around n (1, 3), near ones and far ones in turn, as long as one comes nearer."""
    for reach in REACH:
        found = True
        while found:
            others = n + reach * case[9] * AROUND
            costs = _costs(others, case)
            k = np.argmin(costs)
            found = costs[k] < cost - NEARER
            if found:
                n, cost = others[k:k + 1], costs[k]
    return n, cost
