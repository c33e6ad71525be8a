"""Words chosen one block after the other, so that axes that lose motion stand where they should, rounding and all.

Every block may end at any words X, Y, Z of the grid of last decimals. What the machine with errors then makes of them
follows from the ways of its axes, and these from the words before and the words chosen (play operator, see
`machines.geometric_error.actual.lost_motion`). Words that were planned stay where the tip is as near as rounding lets it be;
else those are taken that bring it nearest: by the ways that the words themselves make, by other ways, by last decimals
beside. Ways by which the next block does not begin count a little: it would first take up what they are off by. So do, where
words are axis positions, steps back by less than an axis loses: who takes the way of an axis for the sign of its last step
sees another machine there. For long programs `backlash_steps_loop` does the same compiled.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from postproc.correction import backlash_steps_loop
from toolpaths.arrays import Bools, Floats, Ints

PLAIN, BETWEEN = 0.05, 0.25
"""weight of what the tip is off by on a machine whose ways are the signs of the last steps; between points of the CL file"""
RESTS = 1e-9
"""part of its lost motion that is no step of a joint"""
NEARER = 1e-9
"""mm that words beside must come nearer"""
REACH = 32.0, 8.0, 2.0, 1.0
"""last decimals that are tried beside"""
AROUND = np.array(list(product((-1.0, 0.0, 1.0), repeat=3)))
"""(27, 3) where"""
MOST = 6
"""joints that any machine has at most"""
WAYS = np.array(list(product((0.0, 1.0, -1.0), repeat=MOST)))[:, ::-1].copy()
"""(3^6, 6) ways that are tried, the first 3^T of the first T joints being all theirs; 0 where that before stays"""
STAYS = 1.0 - np.abs(WAYS)


@dataclass(frozen=True)
class BlockEnds:
    """The ends of K blocks at their planned words, and what T joints that lose motion do there; mm and rad.

    Attributes:
        off: (K, 3) tip less wanted by mean ways; by_way: (K, 3, T) more per way
        tip_rates: (K, 3, 3) tip per last decimal of X, Y, Z; back: (K, T, 3) joints per last decimal
        gap: (K, T) what the joints lose
        bend: (3, K, T) shift, low, high: what planned motion does to the ways but for the last run one way, which is `last`
            (K, T); of a straight block all is that run
        later: (3, K, T) what happens to the ways between the end and the place where the tip counts (bottom of a hole)
        goes_on: (K, T) way by which the next block begins, 0 where the joint rests; weight: (K,) of what its beginning is
            off by beside what this end is
        plain: (K,) blocks whose words are axis positions
        near: (K,) what rounding may leave; enough: (K,) what is not looked for farther off
        free: (K, 3) 1 for words X, Y, Z that may be changed, else 0
        like: (K,) block before whose steps a block takes, -1 for its own
    """

    off: Floats
    by_way: Floats
    tip_rates: Floats
    back: Floats
    gap: Floats
    bend: Floats
    last: Floats
    later: Floats
    goes_on: Floats
    weight: Floats
    plain: Bools
    near: Floats
    enough: Floats
    free: Floats
    like: Ints


def walk(ends: BlockEnds) -> tuple[Floats, Floats]:
    """Steps (K, 3) of whole last decimals to add to the words X, Y, Z of blocks, and the ways (K, T) at their ends then."""
    columns = vars(ends).values()
    if backlash_steps_loop.wanted(len(ends.off)):
        settings = np.array([PLAIN, BETWEEN]), RESTS, NEARER, np.array(REACH)
        steps, ways = backlash_steps_loop.compiled()(*map(np.ascontiguousarray, columns), *settings)
    else:
        steps, ways = _walk(*columns)
    return steps, ways


def _walk(off: Any, by_way: Any, tip_rates: Any, back: Any, gap: Any, bend: Any, last: Any, later: Any, goes_on: Any,
          weight: Any, plain: Any, near: Any, enough: Any, free: Any, like: Any) -> Any:
    blocks, lossy = gap.shape
    result, ways = np.zeros((blocks, 3)), np.zeros((blocks, lossy))
    way, shifted = np.zeros(lossy), np.zeros(lossy)
    for k in range(blocks):
        start = np.minimum(np.maximum(way - 2.0 * shifted / gap[k] + bend[0, k], bend[1, k]), bend[2, k]) + last[k]
        turned = back[k].T
        n = np.zeros((1, 3))
        if free[k].any():
            weighed = 0.0 if not plain[k] else BETWEEN if enough[k] <= near[k] else PLAIN
            rates, swayed = tip_rates[k].T, by_way[k].T
            case = (start, turned, rates, off[k], swayed, gap[k], goes_on[k], weight[k], later[:, k], free[k], way, weighed,
                    np.linalg.inv(rates))
            cost = _costs(n, case)[0]
            if cost > near[k]:
                n, cost = _toward(n, cost, case)
            if cost > enough[k]:
                n, cost = _beside(n, cost, case)
            if cost > enough[k]:
                n, cost = _by_ways(n, cost, case)
                n, cost = _beside(n, cost, case)
        elif like[k] >= 0:
            n[0] = result[like[k]]
        result[k] = n[0]
        shifted = n[0] @ turned
        way = np.minimum(np.maximum(start + 2.0 * shifted / gap[k], -1.0), 1.0)
        ways[k] = way
    return result, ways


def _ended(n: Any, case: Any) -> Any:
    """Ways (N, T) at the end of the block after steps n (N, 3) of last decimals."""
    return np.minimum(np.maximum(case[0] + 2.0 * (n @ case[1]) / case[5], -1.0), 1.0)


def _costs(n: Any, case: Any) -> Any:
    """(N,) mm that the tip is off by after steps n (N, 3), and the weighted parts of what the next block begins off by and
    of a plain reading."""
    ended, goes_on, later, by_way = _ended(n, case), case[6], case[8], case[4]
    way = np.minimum(np.maximum(ended + later[0], later[1]), later[2])
    tip = case[3] + way @ by_way + n @ case[2]
    late = (np.abs(goes_on) * (goes_on - way)) @ by_way
    cost = np.sqrt((tip * tip).sum(axis=1)) + case[7] * np.sqrt((late * late).sum(axis=1))
    if case[11] > 0.0:
        step = case[0] - case[10] + 2.0 * (n @ case[1]) / case[5]
        other = ((np.abs(step) > RESTS) * (np.sign(step) - ended)) @ by_way
        cost = cost + case[11] * np.sqrt((other * other).sum(axis=1))
    return cost


def _nearest(tip: Any, case: Any) -> Any:
    """Steps (N, 3) that take back what the tip is off by, (N, 3)."""
    return -np.round(tip @ case[12]) * case[9]


def _toward(n: Any, cost: Any, case: Any) -> Any:
    """The nearest steps for the ways that the steps n (1, 3) make, those of the next, as long as it comes nearer."""
    while True:
        later = case[8]
        way = np.minimum(np.maximum(_ended(n, case) + later[0], later[1]), later[2])
        better = n + _nearest(case[3] + way @ case[4] + n @ case[2], case)
        there = _costs(better, case)[0]
        if there >= cost:
            return n, cost
        n, cost = better, there


def _by_ways(n: Any, cost: Any, case: Any) -> Any:
    """The nearest steps for every way that is one of both or that before, where that comes nearer than n (1, 3)."""
    lossy = len(case[5])
    ways = WAYS[:3 ** lossy, :lossy] + case[10] * STAYS[:3 ** lossy, :lossy]
    others = _nearest(case[3] + ways @ case[4], case)
    costs = _costs(others, case)
    k = np.argmin(costs)
    return (others[k:k + 1], costs[k]) if costs[k] < cost else (n, cost)


def _beside(n: Any, cost: Any, case: Any) -> Any:
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
