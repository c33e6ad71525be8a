"""The walk of `postproc.correction.backlash_steps` block by block in loops over numbers, compiled for long programs.

`joint` (T, 13) and `space` (3, 8) hold what counts at one
block: per joint START to BEFORE, and BY of the tip; per direction of space OFF, RATES, INVERSE and FREE.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from toolpaths.compiled import loop

START, BACK, GAP, GOES_ON, LATER, BEFORE, BY = 0, 1, 4, 5, 6, 9, 10
OFF, RATES, INVERSE, FREE = 0, 1, 4, 7


@loop(alone=True)
def walk_all(off: Any, by_approach: Any, tip_rates: Any, back: Any, gap: Any, bend: Any, last: Any, later: Any, goes_on: Any,
             weight: Any, plain: Any, near: Any, enough: Any, free: Any, like: Any, weights: Any, rests: Any, nearer: Any,
             reach: Any) -> Any:
    """Steps (K, 3) and approach directions (K, T) for the attributes of `Ends`; `weights` are (PLAIN,
    BETWEEN), then RESTS, NEARER, REACH of `walk`."""
    blocks, lossy = gap.shape
    result, approaches = np.zeros((blocks, 3)), np.zeros((blocks, lossy))
    joint, space, approach, shifted = np.zeros((lossy, 13)), np.zeros((3, 8)), np.zeros(lossy), np.zeros(lossy)
    n, other, still = np.zeros(3), np.zeros(3), np.zeros(3)
    for k in range(blocks):
        # Play operator: the approach direction of a joint moves by two over its lost motion and stays in [-1,
        # 1]; the words chosen before
        # have moved it by `shifted`.
        for t in range(lossy):
            start = approach[t] - 2.0 * shifted[t] / gap[k, t] + bend[0, k, t]
            joint[t, START] = min(max(start, bend[1, k, t]), bend[2, k, t]) + last[k, t]
        _take(n, still)
        if free[k, 0] + free[k, 1] + free[k, 2] > 0.0:
            weighed = 0.0 if not plain[k] else weights[1] if enough[k] <= near[k] else weights[0]
            _fill(k, joint, space, off, by_approach, tip_rates, back, gap, later, goes_on, free, approach)
            cost = _cost(joint, space, n, weight[k], weighed, rests)
            if cost > near[k]:
                cost = _toward(joint, space, n, other, cost, weight[k], weighed, rests)
            if cost > enough[k]:
                cost = _adjacent(joint, space, n, other, cost, weight[k], weighed, rests, nearer, reach)
            if cost > enough[k]:
                cost = _by_approach(joint, space, n, other, cost, weight[k], weighed, rests)
                cost = _adjacent(joint, space, n, other, cost, weight[k], weighed, rests, nearer, reach)
        elif like[k] >= 0:
            _take(n, result[like[k]])
        for t in range(lossy):
            shifted[t] = n[0] * back[k, t, 0] + n[1] * back[k, t, 1] + n[2] * back[k, t, 2]
            approach[t] = min(max(joint[t, START] + 2.0 * shifted[t] / gap[k, t], -1.0), 1.0)
            approaches[k, t] = approach[t]
        _take(result[k], n)
    return result, approaches


@loop(alone=True)
def _take(n: Any, other: Any) -> None:
    """n (3,) becomes the other; a loop, as numba compiles slices for seconds."""
    for i in range(3):
        n[i] = other[i]


@loop(alone=True)
def _fill(k: Any, joint: Any, space: Any, off: Any, by_approach: Any, tip_rates: Any, back: Any, gap: Any, later: Any,
          goes_on: Any, free: Any, approach: Any) -> None:
    """What counts at block k."""
    for t in range(len(joint)):
        joint[t, GAP], joint[t, GOES_ON], joint[t, BEFORE] = gap[k, t], goes_on[k, t], approach[t]
        for i in range(3):
            joint[t, BACK + i], joint[t, LATER + i], joint[t, BY + i] = back[k, t, i], later[i, k, t], by_approach[k, i, t]
    for i in range(3):
        space[i, OFF], space[i, FREE] = off[k, i], free[k, i]
        for j in range(3):
            space[i, RATES + j] = tip_rates[k, i, j]
    _invert(space)


@loop(alone=True)
def _invert(space: Any) -> None:
    """The inverse of the rates (3, 3), by cofactors."""
    for i in range(3):
        a, b = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            c, d = RATES + (j + 1) % 3, RATES + (j + 2) % 3
            space[j, INVERSE + i] = space[a, c] * space[b, d] - space[a, d] * space[b, c]
    det = 0.0
    for i in range(3):
        det += space[0, RATES + i] * space[i, INVERSE]
    for i in range(3):
        for j in range(3):
            space[i, INVERSE + j] /= det


@loop(alone=True)
def _cost(joint: Any, space: Any, n: Any, weight: Any, weighed: Any, rests: Any) -> Any:
    """mm that the tip is off by after steps n (3,), and the weighted parts of what the next block begins off
    by and of a plain reading."""
    x = space[0, OFF] + n[0] * space[0, RATES] + n[1] * space[0, RATES + 1] + n[2] * space[0, RATES + 2]
    y = space[1, OFF] + n[0] * space[1, RATES] + n[1] * space[1, RATES + 1] + n[2] * space[1, RATES + 2]
    z = space[2, OFF] + n[0] * space[2, RATES] + n[1] * space[2, RATES + 1] + n[2] * space[2, RATES + 2]
    x1, y1, z1, x2, y2, z2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for t in range(len(joint)):
        row = joint[t]
        step = 2.0 * (n[0] * row[BACK] + n[1] * row[BACK + 1] + n[2] * row[BACK + 2]) / row[GAP]
        ended = min(max(row[START] + step, -1.0), 1.0)
        approach = min(max(ended + row[LATER], row[LATER + 1]), row[LATER + 2])
        late = abs(row[GOES_ON]) * (row[GOES_ON] - approach)
        x, y, z = x + approach * row[BY], y + approach * row[BY + 1], z + approach * row[BY + 2]
        x1, y1, z1 = x1 + late * row[BY], y1 + late * row[BY + 1], z1 + late * row[BY + 2]
        moved = row[START] - row[BEFORE] + step
        if abs(moved) > rests:
            apart = math.copysign(1.0, moved) - ended
            x2, y2, z2 = x2 + apart * row[BY], y2 + apart * row[BY + 1], z2 + apart * row[BY + 2]
    cost = math.sqrt(x * x + y * y + z * z) + weight * math.sqrt(x1 * x1 + y1 * y1 + z1 * z1)
    return cost + weighed * math.sqrt(x2 * x2 + y2 * y2 + z2 * z2)


@loop(alone=True)
def _nearest(space: Any, other: Any, x: Any, y: Any, z: Any) -> None:
    """Put the steps (3,) that take back what the tip is off by into `other`."""
    for i in range(3):
        other[i] = -np.rint(space[i, INVERSE] * x + space[i, INVERSE + 1] * y + space[i, INVERSE + 2] * z) * space[i, FREE]


@loop(alone=True)
def _toward(joint: Any, space: Any, n: Any, other: Any, cost: Any, weight: Any, weighed: Any,
            rests: Any) -> Any:
    """The nearest steps for the approach directions that the steps n (3,) make, those of the next, as long as
    it comes nearer."""
    while True:
        x, y, z = space[0, OFF], space[1, OFF], space[2, OFF]
        for i in range(3):
            x, y, z = x + n[i] * space[0, RATES + i], y + n[i] * space[1, RATES + i], z + n[i] * space[2, RATES + i]
        for t in range(len(joint)):
            row = joint[t]
            step = 2.0 * (n[0] * row[BACK] + n[1] * row[BACK + 1] + n[2] * row[BACK + 2]) / row[GAP]
            ended = min(max(row[START] + step, -1.0), 1.0)
            approach = min(max(ended + row[LATER], row[LATER + 1]), row[LATER + 2])
            x, y, z = x + approach * row[BY], y + approach * row[BY + 1], z + approach * row[BY + 2]
        _nearest(space, other, x, y, z)
        for i in range(3):
            other[i] += n[i]
        there = _cost(joint, space, other, weight, weighed, rests)
        if not there < cost:
            return cost
        cost = there
        _take(n, other)


@loop(alone=True)
def _by_approach(joint: Any, space: Any, n: Any, other: Any, cost: Any, weight: Any, weighed: Any,
                 rests: Any) -> Any:
    """The nearest steps for every approach direction that is one of both or that before, where that comes
    nearer than n (3,)."""
    for number in range(3 ** len(joint)):
        x, y, z, rest = space[0, OFF], space[1, OFF], space[2, OFF], number
        for t in range(len(joint)):
            row, digit = joint[t], rest % 3
            approach, rest = row[BEFORE] if digit == 0 else 1.0 if digit == 1 else -1.0, rest // 3
            x, y, z = x + approach * row[BY], y + approach * row[BY + 1], z + approach * row[BY + 2]
        _nearest(space, other, x, y, z)
        there = _cost(joint, space, other, weight, weighed, rests)
        if there < cost:
            cost = there
            _take(n, other)
    return cost


@loop(alone=True)
def _adjacent(joint: Any, space: Any, n: Any, other: Any, cost: Any, weight: Any, weighed: Any, rests: Any, nearer: Any,
              reach: Any) -> Any:
    """The best steps around n (3,), near ones and far ones in turn, as long as one comes nearer."""
    for far in reach:
        found = True
        while found:
            best, a, b, c = cost - nearer, 0, 0, 0
            for number in range(27):
                i, j, k = number // 9 - 1, number // 3 % 3 - 1, number % 3 - 1
                other[0] = n[0] + far * space[0, FREE] * i
                other[1] = n[1] + far * space[1, FREE] * j
                other[2] = n[2] + far * space[2, FREE] * k
                there = _cost(joint, space, other, weight, weighed, rests)
                if there < best:
                    best, a, b, c = there, i, j, k
            found = best < cost - nearer
            if found:
                n[0] += far * space[0, FREE] * a
                n[1] += far * space[1, FREE] * b
                n[2] += far * space[2, FREE] * c
                cost = best
    return cost
