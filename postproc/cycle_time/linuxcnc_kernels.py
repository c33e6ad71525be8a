"""Plain loops of the LinuxCNC model: interpreted for small programs, compiled for large ones, to the same
bits (`toolpaths/compiled.py`)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from toolpaths.compiled import loop


@loop
def chain_ends(xyz: Any, joins: Any, tolerance: Any) -> Any:
    """(E,) True where a block ends a chain of merged lines.

    A line joins while all points of the chain stay within the tolerance of the chord from the chain's start,
    and the chain has at most 100 points (LinuxCNC `linkable`). xyz (E + 1, 3) block ends; joins (E,): may
    join the block before.
    """
    count = len(joins)
    ends = np.zeros(count, dtype=np.bool_)
    begin = 0
    for i in range(count):
        linked = joins[i] and i - begin <= 100
        if linked:
            mx, my, mz = xyz[i + 1, 0] - xyz[begin, 0], xyz[i + 1, 1] - xyz[begin, 1], xyz[i + 1, 2] - xyz[begin, 2]
            size = mx * mx + my * my + mz * mz
            limit = tolerance[i] * tolerance[i]
            if size == 0.0:
                linked = False
            else:
                for k in range(begin + 1, i + 1):
                    px, py, pz = xyz[k, 0] - xyz[begin, 0], xyz[k, 1] - xyz[begin, 1], xyz[k, 2] - xyz[begin, 2]
                    t = min(max((mx * px + my * py + mz * pz) / size, 0.0), 1.0)
                    if (px - t * mx) ** 2 + (py - t * my) ** 2 + (pz - t * mz) ** 2 > limit:
                        linked = False
                        break
        if not linked:
            if i > 0:
                ends[i - 1] = True
            begin = i
    if count:
        ends[count - 1] = True
    return ends


@loop(takes=(("float64", 1),) * 4 + (("bool_", 1),) + (("float64", 1),) * 2)
def speeds(length: Any, target: Any, most: Any, rate: Any, through: Any, kink: Any, ahead: Any) -> Any:
    """(2, N) speed at begin and end of each segment.

    Backwards what lets each segment reach the speed of the next, forwards what it can reach itself. `through`
    (N,): True where the segment runs into the next without a stop; `kink` (N,): most speed at its end;
        `ahead` (N,): what the
    look-ahead allows there.
    """
    count = len(length)
    result = np.zeros((2, count))
    final = 0.0
    for k in range(count - 2, -1, -1):
        if through[k]:
            final = min(np.sqrt(final * final + 2.0 * rate[k + 1] * length[k + 1]), most[k], most[k + 1],
                        kink[k], ahead[k])
        else:
            final = 0.0
        result[1, k] = final
    speed = 0.0
    for k in range(count):
        result[0, k] = speed
        if through[k] and k + 1 < count:
            speed = min(result[1, k], target[k], target[k + 1],
                        np.sqrt(speed * speed + 2.0 * rate[k] * length[k]))
        else:
            speed = 0.0
        result[1, k] = speed
    return result


@loop(takes=(("float64", 1),) * 3 + (("bool_", 1),))
def timeline(seconds: Any, overlap: Any, rest: Any, fresh: Any) -> Any:
    """(2, N) times at which each segment begins and ends.

    `overlap` (N,): s before its end at which the next may begin, though not before the one before it has ended: two
    segments move at most. `rest` (N,): s of standing still after it.
    """
    count = len(seconds)
    result = np.zeros((2, count))
    begin, end, before = 0.0, 0.0, 0.0
    for k in range(count):
        if k > 0:
            begin = max(end - overlap[k - 1], before) if not fresh[k] else end
            begin += rest[k - 1]
            before = end
        end = max(begin + seconds[k], end)
        result[0, k], result[1, k] = begin, end
    return result


@loop(takes=(("float64", 1),) * 4 + (("float64", 0),))
def next_begins(length: Any, target: Any, rate: Any, blend: Any, cycle: Any) -> Any:
    """(N,) s from the begin of each segment to that of the next one, which overlaps its end; executed cycle by cycle.

    Each segment begins at rest with a servo cycle and gains at most `rate` (N,) a cycle, towards `target` (N,) and no more
    than lets it stop at its `length` (N,); the next begins with the cycle in which it loses speed, as asked for, and is
    slower than `blend` (N,) (LinuxCNC `tpCalculateTrapezoidalAccel`, `tcUpdateDistFromAccel`, `tcIsBlending`).
    """
    result = np.zeros(len(length))
    for k in range(len(length)):
        # numbers of their own: those of arrays take six times as long where the loop is interpreted
        pull, most, below, left = float(rate[k]), float(target[k]), float(blend[k]), float(length[k])
        step, speed, count = pull * cycle, 0.0, 0
        while True:
            count += 1
            square = pull * (2.0 * left - speed * cycle) + 0.25 * step * step
            wanted = math.sqrt(square) - 0.5 * step if square > 0.25 * step * step else -0.5 * step
            wanted = most if most < wanted else wanted
            asked = wanted - speed
            gain = step if asked > step else -step if asked < -step else asked
            after = speed + gain if speed + gain > 0.0 else 0.0
            follows = gain < 0.0 and abs(asked - gain) < 1e-8
            left -= 0.5 * (after + speed) * cycle
            speed = after
            if (follows and speed < below) or speed <= 0.0 or 2.0 * left < speed * cycle:
                break
            if gain == 0.0 and speed == most:
                steady = math.floor((left - 0.5 * speed * speed / pull) / (speed * cycle)) - 2.0
                if steady > 0.0:
                    count += int(steady)
                    left -= steady * speed * cycle
        result[k] = (count - 1) * cycle
    return result
