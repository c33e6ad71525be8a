"""Words chosen one block after the other, so that axes that lose motion stand where they should, rounding and all.

Every block may end at any words X, Y, Z of the grid of last decimals. What the machine with errors then makes of them
follows from the ways of its axes, and these from the words before and the words chosen (play operator, see
`machines.geometric_error.lost_motion`). Words that were planned stay where the tip is as near as rounding lets it be; else
those are taken that bring it nearest: by the ways that the words themselves make, by other ways, by last decimals beside.
Ways by which the next block does not begin count a little: it would first take up what they are off by. So do, where words
are axis positions, steps back by less than an axis loses: who takes the way of an axis for the sign of its last step sees
another machine there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, cast

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints

ENOUGH = 20_000
"""blocks from which on the compiled walk pays"""
PLAIN, BETWEEN = 0.05, 0.25
"""weight of what the tip is off by on a machine whose ways are the signs of the last steps; between points of the CL file"""
RESTS = 1e-9
"""part of its lost motion that is no step of a joint"""
REACH = 32.0, 8.0, 2.0, 1.0
"""last decimals that are tried beside"""


@dataclass(frozen=True)
class Ends:
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


def walk(ends: Ends) -> tuple[Floats, Floats]:
    """Steps (K, 3) of whole last decimals to add to the words X, Y, Z of blocks, and the ways (K, T) at their ends then."""
    run = _compiled() if len(ends.off) >= ENOUGH or _compiled.cache_info().currsize else _walk
    steps, ways = run(*vars(ends).values())
    return steps, ways


@cache
def _compiled() -> Callable[..., Any]:
    """The same functions compiled; the module's helpers are replaced, so that compiled code calls compiled code."""
    from numba import njit

    for name in ("_clip", "_ended", "_way", "_tip", "_cost", "_nearest", "_toward", "_by_ways", "_beside"):
        globals()[name] = _kept(njit, globals()[name])
    return _kept(njit, _walk)


def _kept(njit: Any, function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiled when first called; kept on disk where the package's folder can be written."""
    try:
        return cast(Callable[..., Any], njit(function, cache=True))
    except RuntimeError:
        return cast(Callable[..., Any], njit(function))


def _walk(off: Any, by_way: Any, tip_rates: Any, back: Any, gap: Any, bend: Any, last: Any, later: Any, goes_on: Any,
          weight: Any, plain: Any, near: Any, enough: Any, free: Any, like: Any) -> Any:
    blocks, lossy = gap.shape
    result, ways = np.zeros((blocks, 3)), np.zeros((blocks, lossy))
    way, shifted = np.zeros(lossy), np.zeros(lossy)
    for k in range(blocks):
        start = _clip(way - 2.0 * shifted / gap[k] + bend[0, k], bend[1, k], bend[2, k]) + last[k]
        case = (start, back[k], tip_rates[k], off[k], by_way[k], gap[k], goes_on[k], weight[k], later[:, k], free[k], way,
                (BETWEEN if enough[k] <= near[k] else PLAIN) if plain[k] else 0.0)
        n = np.zeros(3)
        if free[k].any():
            if _cost(n, case) > near[k]:
                n = _toward(n, case)
            if _cost(n, case) > enough[k]:
                n = _beside(n, case)
            if _cost(n, case) > enough[k]:
                n = _beside(_by_ways(n, way, case), case)
        elif like[k] >= 0:
            n = result[like[k]]
        result[k] = n
        shifted = back[k] @ n
        way = _ended(n, case)
        ways[k] = way
    return result, ways


def _clip(way: Any, low: Any, high: Any) -> Any:
    return np.minimum(np.maximum(way, low), high)


def _ended(n: Any, case: Any) -> Any:
    """Ways (T,) at the end of the block after steps n (3,) of last decimals."""
    return np.minimum(np.maximum(case[0] + 2.0 * (case[1] @ n) / case[5], -1.0), 1.0)


def _way(n: Any, case: Any) -> Any:
    """Ways (T,) where the tip counts."""
    later = case[8]
    return _clip(_ended(n, case) + later[0], later[1], later[2])


def _tip(n: Any, case: Any) -> Any:
    """Tip less wanted (3,)."""
    return case[3] + case[4] @ _way(n, case) + case[2] @ n


def _cost(n: Any, case: Any) -> Any:
    """mm that the tip is off by, and the weighted parts of what the next block begins off by and of a plain reading."""
    goes_on, tip, way = case[6], _tip(n, case), _way(n, case)
    late = case[4] @ np.where(goes_on != 0.0, goes_on - way, 0.0)
    cost = np.sqrt((tip * tip).sum()) + case[7] * np.sqrt((late * late).sum())
    if case[11] > 0.0:
        step = case[0] - case[10] + 2.0 * (case[1] @ n) / case[5]
        other = case[4] @ np.where(np.abs(step) > RESTS, np.sign(step) - _ended(n, case), 0.0)
        cost += case[11] * np.sqrt((other * other).sum())
    return cost


def _nearest(tip: Any, case: Any) -> Any:
    """Steps (3,) that take back what the tip is off by."""
    return -np.round(np.linalg.solve(case[2], tip)) * case[9]


def _toward(n: Any, case: Any) -> Any:
    """The nearest steps for the ways that the steps n make, those of the next, and so on as long as it comes nearer."""
    while True:
        better = n + _nearest(_tip(n, case), case)
        if _cost(better, case) >= _cost(n, case):
            return n
        n = better


def _by_ways(n: Any, before: Any, case: Any) -> Any:
    """The nearest steps for every way that is one of both or that before, where that comes nearer than n."""
    lossy = len(before)
    for number in range(3 ** lossy):
        way, rest = before.copy(), number
        for j in range(lossy):
            if rest % 3:
                way[j] = 3.0 - 2.0 * (rest % 3)
            rest //= 3
        other = _nearest(case[3] + case[4] @ way, case)
        if _cost(other, case) < _cost(n, case):
            n = other
    return n


def _beside(n: Any, case: Any) -> Any:
    """The best steps around n, near ones and far ones in turn, as long as one comes nearer."""
    for reach in REACH:
        found = True
        while found:
            found, best = False, n
            for number in range(27):
                other = n + reach * case[9] * np.array([number % 3 - 1.0, number // 3 % 3 - 1.0, number // 9 - 1.0])
                if _cost(other, case) < _cost(best, case) - 1e-9:
                    found, best = True, other
            n = best
    return n
