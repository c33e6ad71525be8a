"""Rewinds in a program: the tool leaves the part, axes unwind, it comes back to the very pose. Found from motion alone.

A rewind is known by what no other motion does: the tool stands in one pose twice with rotary axes that stand
elsewhere, and between the two it moved in rapid.
"""

from __future__ import annotations

from functools import cache
from itertools import chain

import numpy as np

from postproc.path.links import SafeSpace
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic

_REACH = 60
"""blocks before and behind the unwinding block that are looked at"""
_UNWOUND = 20.0
"""degrees: least turn of a block that may unwind"""
_MOVED = 1.0
"""degrees: least difference of a rotary axis between the two stands"""


def rewinds(motion: Motion, tip: Floats, axis: Floats, stops: Floats, rotary: Ints,
            grain: tuple[float, float]) -> Ints:
    """(E,) number of the rewind that each block belongs to, -1 for none.

    Args:
        tip, axis: (E, 3) poses at the ends of the blocks
        stops: (M, 3) tips of the CL file
        rotary: joint numbers
        grain: mm, rad within which two poses are the same
    """
    result = np.full(len(motion), -1)
    if not len(rotary) or len(motion) < 3:
        return result
    angle = motion.end[:, rotary]
    turned = np.append(0.0, np.abs(np.diff(angle, axis=0)).max(axis=1)) >= _UNWOUND
    count = 0
    for k in np.flatnonzero(turned & (motion.code == 0)):
        if result[k] >= 0:
            continue
        found = _around(int(k), motion.code == 0, tip, axis, stops, angle, grain)
        if found is not None:
            result[found[0]:found[1] + 1] = count
            count += 1
    return result


def _around(k: int, rapid: Bools, tip: Floats, axis: Floats, stops: Floats, angle: Floats,
            grain: tuple[float, float]) -> tuple[int, int] | None:
    """(first, last) block of the rewind round block k; the pose is that where block first - 1 ends.

    The tool comes back in one run of feed blocks: the next rapid behind them ends the search. On the path it
    stands in other poses twice too. The innermost that is a position of the CL file counts, for what lies
    outside it is motion of the CL file; without any the outermost that leaves a cut, or meets no position
    of the CL file on its path: high above the part a tool stands in one pose twice as well.
    """
    low, high = max(k - _REACH, 1), min(k + _REACH, len(tip))
    stop = np.flatnonzero(~rapid[low:k])
    low += int(stop[-1]) if len(stop) else 0
    again = np.flatnonzero(rapid[k:high - 1] < rapid[k + 1:high])
    high = k + 1 + int(again[0]) if len(again) else high
    begin, end = np.arange(max(low - 1, 0), k), np.arange(k, high)
    same = (np.linalg.norm(tip[begin, None] - tip[None, end], axis=2) <= grain[0]) & (
        np.linalg.norm(axis[begin, None] - axis[None, end], axis=2) <= grain[1])
    same &= np.abs(angle[begin, None] - angle[None, end]).max(axis=2) >= _MOVED
    pairs = np.argwhere(same)
    if not len(pairs):
        return None

    @cache
    def meets(block: int) -> bool:
        return bool((np.linalg.norm(stops - tip[block], axis=1) <= grain[0]).any())

    blocks = np.stack([begin[pairs[:, 0]], end[pairs[:, 1]]], axis=1).tolist()
    for first, last in sorted(blocks, key=lambda pair: (-pair[0], pair[1])):
        if meets(first):
            return first + 1, last
    cuts = [(first, last) for first, last in blocks if not rapid[first]]
    clear = ((first, last) for first, last in blocks if not any(map(meets, range(first + 1, last))))
    found = next(chain(cuts, clear), None)
    return None if found is None else (found[0] + 1, found[1])


def check_rewinds(motion: Motion, executed: BlockPoses, number: Ints, tip: Floats, axis: Floats, space: SafeSpace,
                  tolerance: float, axis_grain: float, faults: Faults) -> list[Diagnostic]:
    """Blocks of rewinds stay on the line of the tool axis where they left the cut, or clear of the path.

    `tolerance` is in mm, `axis_grain` in rad: what the rounding of rotary words alone turns the tool by.
    """
    rows = np.flatnonzero(number >= 0)
    if not len(rows):
        return []
    first = rows[np.searchsorted(number[rows], number[rows])]
    pose, direction = tip[first - 1], axis[first - 1]
    bad = np.zeros(len(rows), dtype=np.bool_)
    for t in executed.times(motion, rows):
        now, along = executed.poses(motion, rows, t)
        offset = now - pose
        height = np.maximum(np.einsum("ni,ni->n", offset, direction), 0.0)
        adjacent = np.linalg.norm(offset - height[:, None] * direction, axis=1) > tolerance
        turned = np.linalg.norm(along - direction, axis=1) > axis_grain
        bad |= (adjacent | turned) & ~space.clear(now, along, -tolerance)
    if not bad.any():
        return []
    k = int(np.flatnonzero(bad)[0])
    return [faults.error("verify.rewind", "an axis unwinds while the tool is too close to the part", 0,
                         int(motion.line[rows[k]]), int(bad.sum()))]
