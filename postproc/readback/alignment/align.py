"""Which block ends each CL move: one pass over both, a loop that is compiled for long files."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from postproc.reference.moves import Moves
from toolpaths.arrays import Array, Bools, Floats, Ints, as_slice
from toolpaths.compiled import chosen, loop
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between, lengths
from toolpaths.shape import Curves
from toolpaths.shapes import arrays

_COMPILE_FROM = 20_000
MOST_LOST, MOVES_AHEAD, BLOCKS_AHEAD = 20, 8, 2000
"""points that no block ends at before the rest is left; how far ahead points and blocks are looked for"""
_ROWS, _NUMBERS, _KINDS, _NUMBER = ("float64", 2), ("float64", 1), ("int8", 1), ("float64", 0)


@dataclass(frozen=True)
@arrays(tip="E 3", axis="E 3", sweep="E", rewound="E")
class EndPoses:
    """Poses at the ends of executed blocks; `sweep` in rad of arcs, else NaN; `rewound`: blocks of rewinds."""

    tip: Floats
    axis: Floats
    sweep: Floats
    rewound: Bools


@dataclass(frozen=True)
class Lost:
    """A point of the CL file that no block ends at, and the block that stands for it; -1 where none does, as where one is
    left out."""

    move: int
    block: int


def aligned(ends: EndPoses, moves: Moves, link: Bools, tolerance: float, axis_tolerance: float,
            grain: tuple[float, float]) -> tuple[Ints, Ints, Lost | None]:
    """`align` without the blocks of rewinds, which get no move (M + 1): but for them the tool only rests there; and the
    first point that is lost.

    Behind a point that no block ends at the walk is taken up where the points after it are found again, so that what is
    said of the rest is not the doing of one wrong block.
    """
    kept, count = as_slice(np.flatnonzero(~ends.rewound)), len(ends.tip)
    tip, axis, sweep, curves = ends.tip[kept], ends.axis[kept], ends.sweep[kept], moves.curves()
    match, short = align(tip, axis, sweep, curves, link, tolerance, axis_tolerance, grain)
    first, number = None, np.arange(count)[kept]
    for _ in range(MOST_LOST):
        if (lost := unreached(match)) < 0:
            break
        start = int(match[lost - 1]) + 1 if lost else 0
        found = _found_again(tip, axis, moves, lost, start, (2.0 * tolerance, 2.0 * axis_tolerance))
        if found is None:
            break
        nearest, stop = found
        first = first or Lost(lost, int(number[nearest]) if nearest >= 0 else -1)
        behind = slice(lost + 1, None)
        match[lost], short[start:stop] = max(stop - 1, 0), lost
        again, owns = align(tip[stop:], axis[stop:], sweep[stop:], curves.take(behind), link[behind], tolerance,
                            axis_tolerance, grain)
        match[behind], short[stop:] = np.where(again >= 0, again + stop, again), owns + lost + 1
    lost = unreached(match)
    owner = np.full(count, len(moves) + 1)
    owner[kept] = short
    return np.where(match >= 0, number[match], match), owner, first or (Lost(lost, -1) if lost >= 0 else None)


def _found_again(tip: Floats, axis: Floats, moves: Moves, lost: int, start: int,
                 near: tuple[float, float]) -> tuple[int, int] | None:
    """(the block from `start` on that stands for a lost point, -1 for none; the first block behind it); None where none of
    the points after it is found soon."""
    rows = slice(start, start + BLOCKS_AHEAD)

    def apart(move: int) -> tuple[Floats, Floats]:
        turn = angle_between(axis[rows], np.broadcast_to(moves.axis[move], axis[rows].shape))
        return lengths(tip[rows] - moves.tip[move]) / near[0], turn / near[1]
    for after in range(lost + 1, min(lost + 1 + MOVES_AHEAD, len(moves))):
        there = np.flatnonzero(np.maximum(*apart(after)) <= 1.0)
        if len(there):
            before = np.add(*apart(lost))[:there[0]]
            block = int(before.argmin()) if len(before) else -1
            return (start + block if block >= 0 else -1), start + block + 1
    return None


def align(tip: Floats, axis: Floats, sweep: Floats, curves: Curves, link: Bools, tolerance: float,
          axis_tolerance: float, grain: tuple[float, float] = (1e-3, 1e-6)) -> tuple[Ints, Ints]:
    """Walk blocks along the reference.

    A move is done by the first block that has come to its end: past the end on a line, the whole sweep on an
    arc, the final direction where the axis turns; blocks behind it that come nearer to the end are its own
    too. A move that goes nowhere needs no block.

    Args:
        tip, axis (E, 3): poses at the ends of the executed blocks
        sweep (E,): rad, of blocks that are arcs, NaN for others: says their turns, the tips say the rest
        curves, link (M): the reference motion of each move; linked ones only have to arrive
        tolerance, axis_tolerance: mm, rad: how near to its end a move counts as done
        grain: mm, rad: moves below this may have vanished in the rounding of the words

    Returns:
        (match (M,), owner (E,)): the block that ends each move (-1: never reached), and the move that each block
        serves (M for blocks after the last move).
    """
    kind = np.where(link, 2, np.where(curves.is_arc, 1, 0)).astype(np.int8)
    walk = chosen(_walk, len(tip), _COMPILE_FROM)
    match, owner = walk(tip, axis, sweep, curves.start, curves.end, curves.axis0, curves.axis1, kind, curves.center,
                        curves.normal, curves.sweep, tolerance, axis_tolerance, *grain)
    return match, owner


@loop(alone=True)
def _apart(a: Any, b: Any) -> Any:
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@loop(alone=True)
def _angle(a: Any, b: Any) -> Any:
    """Angle between unit vectors."""
    return 2.0 * math.atan2(_apart(a, b), math.sqrt((a[0] + b[0]) ** 2 + (a[1] + b[1]) ** 2 + (a[2] + b[2]) ** 2))


@loop(alone=True)
def _turned(a: Any, b: Any, center: Any, normal: Any) -> Any:
    """Angle in (-pi, pi] about the axis (center, normal) from point a to point b."""
    px, py, pz = a[0] - center[0], a[1] - center[1], a[2] - center[2]
    qx, qy, qz = b[0] - center[0], b[1] - center[1], b[2] - center[2]
    h = px * normal[0] + py * normal[1] + pz * normal[2]
    g = qx * normal[0] + qy * normal[1] + qz * normal[2]
    cross = normal[0] * (py * qz - pz * qy) + normal[1] * (pz * qx - px * qz) + normal[2] * (px * qy - py * qx)
    return math.atan2(cross, px * qx + py * qy + pz * qz - h * g)


@loop(alone=True)
def _line_done(tip: Any, axis: Any, start: Any, end: Any, axis0: Any, axis1: Any, tol: float,
               axis_tol: float) -> Any:
    """True where a pose has come to the end of a straight move."""
    length = _apart(start, end)
    if _angle(axis0, axis1) > axis_tol and _angle(axis, axis1) > axis_tol:
        return False
    if length <= tol:
        return _apart(tip, end) <= 2.0 * tol
    past = ((tip[0] - end[0]) * (end[0] - start[0]) + (tip[1] - end[1]) * (end[1] - start[1])
            + (tip[2] - end[2]) * (end[2] - start[2])) / length
    return past >= -min(tol, 0.5 * length)


@loop(alone=True)
def _approach(tip: Any, axis: Any, after: Any, axis_after: Any, end: Any, axis1: Any, grain: float,
              axis_grain: float) -> int:
    """1: the pose after comes nearer to the end of the move, 0: as near, -1: it leaves it, or the pose before was there.

    A tenth of the last decimal is nothing: standing tips of two poses differ by the arithmetic of the kinematics.
    """
    off, turn = _apart(tip, end), _angle(axis, axis1)
    off_after, turn_after = _apart(after, end), _angle(axis_after, axis1)
    there = off <= grain and turn <= axis_grain
    if not math.isfinite(off + turn + off_after + turn_after):
        return -1
    if there or off_after > max(off, grain) + 0.1 * grain or turn_after > max(turn, axis_grain) + 0.1 * axis_grain:
        return -1
    return 1 if off_after < off - 0.1 * grain or turn_after < turn - 0.1 * axis_grain else 0


@loop(alone=True, takes=(_ROWS, _ROWS, _NUMBERS, _ROWS, _ROWS, _ROWS, _ROWS, _KINDS, _ROWS, _ROWS, _NUMBERS, *[_NUMBER] * 4))
def _walk(tip: Any, axis: Any, swept: Any, start: Any, end: Any, axis0: Any, axis1: Any, kind: Any, center: Any,
          normal: Any, sweep: Any, tol: float, axis_tol: float, grain: float, axis_grain: float) -> tuple[Any, Any]:
    # Blocks and moves are gone through once, in order: j is the last block of the move before, k the block looked at.
    count, moves = len(tip), len(end)
    match = np.full(moves, -1, np.int64)
    owner = np.full(count, moves, np.int64)
    j = -1
    for i in range(moves):
        # A move that goes nowhere, or to where the tool stands, ends with block j unless the next block ends there too.
        short = kind[i] == 0 or (kind[i] == 1 and sweep[i] < math.pi)
        still = short and _apart(start[i], end[i]) < grain and _angle(axis0[i], axis1[i]) < axis_grain and j >= 0
        there = short and j >= 0 and _apart(start[i], end[i]) < 2.0 * grain and (
            _apart(tip[j], end[i]) <= grain and _angle(axis[j], axis1[i]) <= axis_grain)
        if (still or there) and (j + 1 >= count or _apart(tip[j + 1], end[i]) > grain
                                 or _angle(axis[j + 1], axis1[i]) > 10.0 * axis_grain):
            match[i] = j
            continue
        angle = 0.0
        k = j + 1
        done = False
        while k < count and not done:
            owner[k] = i
            if kind[i] == 2:
                done = _apart(tip[k], end[i]) <= 2.0 * tol and _angle(axis[k], axis1[i]) <= 2.0 * axis_tol
            elif kind[i] == 1:
                before = start[i] if k == j + 1 else tip[k - 1]
                step = _turned(before, tip[k], center[i], normal[i])
                if swept[k] > 0.0:  # whole turns, which the tips do not show
                    step += 2.0 * math.pi * math.floor((swept[k] - step) / (2.0 * math.pi) + 0.5)
                angle += step
                slack = max(0.5 * tol, grain) / max(_apart(start[i], center[i]), tol)
                done = angle >= sweep[i] - slack and _angle(axis[k], axis1[i]) <= axis_tol
            else:
                done = _line_done(tip[k], axis[k], start[i], end[i], axis0[i], axis1[i], tol, axis_tol)
            k += 1
        if not done:  # all that is left belongs to the move that is not reached
            for r in range(j + 1, count):
                owner[r] = i
            return match, owner
        # A block that went past the end from one that was nearer to it is not of this move: that one came short.
        if kind[i] == 0 and k - 2 > j and _apart(tip[k - 1], end[i]) > max(2.0 * tol, _apart(tip[k - 2], end[i])):
            k -= 1
        # Several blocks may end within the tolerance of the end: the move keeps those up to the last that comes nearer.
        # An arc of more than half a turn is a cut of its own: its tips do not show how far it went from the end.
        j = k - 1
        step = 0
        while k < count and step >= 0 and (math.isnan(swept[k]) or swept[k] <= math.pi):
            step = _approach(tip[j], axis[j], tip[k], axis[k], end[i], axis1[i], grain, axis_grain)
            if step > 0:
                owner[j + 1:k + 1] = i
                j = k
            k += 1
        match[i] = j
    return match, owner


def unreached(match: Array) -> int:
    """The first move that no block reaches, -1 where all are reached."""
    missing = np.flatnonzero(match == -1)
    return int(missing[0]) if len(missing) else -1
