"""Which block ends each CL move: one pass over both, in plain loops that numba compiles for long files."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np

from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.shape import Curves

_COMPILE_FROM = 20_000
_compiled: list[Callable[..., Any]] = []


def align(tip: Floats, axis: Floats, sweep: Floats, curves: Curves, link: Bools, tolerance: float,
          axis_tolerance: float, grain: tuple[float, float] = (1e-3, 1e-6)) -> tuple[Ints, Ints]:
    """Walk blocks along the reference.

    A move is done by the first block that has come to its end: past the end on a line, the whole sweep on an arc,
    the final direction where the axis turns; blocks behind it that come nearer to the end are its own too. A move that
    goes nowhere needs no block.

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
    walk = _walk if len(tip) < _COMPILE_FROM else _fast()
    match, owner = walk(tip, axis, sweep, curves.start, curves.end, curves.axis0, curves.axis1, kind, curves.center,
                        curves.normal, curves.sweep, tolerance, axis_tolerance, *grain)
    return match, owner


def _fast() -> Callable[..., Any]:
    """The same functions compiled; the module's helpers are replaced, so that compiled code calls compiled code."""
    if not _compiled:
        for name in ("_apart", "_angle", "_turned", "_line_done", "_nearer"):
            globals()[name] = _jit(globals()[name])
        _compiled.append(_jit(_walk, _signature()))
    return _compiled[0]


def _signature() -> Any:
    """Of `_walk`: one for arrays of any layout, so that no file waits for a compiler that another did not."""
    from numba import types

    rows, numbers, kinds = (types.Array(kind, n, "A", readonly=True) for kind, n in (
        (types.float64, 2), (types.float64, 1), (types.int8, 1)))
    return (rows, rows, numbers, rows, rows, rows, rows, kinds, rows, rows, numbers, *[types.float64] * 4)


def _jit(function: Callable[..., Any], signature: Any = None) -> Callable[..., Any]:
    """Compiled when first called; kept on disk where the package's folder can be written."""
    from numba import njit

    try:
        return cast(Callable[..., Any], njit(signature, cache=True)(function))
    except RuntimeError:
        return cast(Callable[..., Any], njit(signature)(function))


def _apart(a: Any, b: Any) -> Any:
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


def _angle(a: Any, b: Any) -> Any:
    """Angle between unit vectors."""
    return 2.0 * math.atan2(_apart(a, b), math.sqrt((a[0] + b[0]) ** 2 + (a[1] + b[1]) ** 2 + (a[2] + b[2]) ** 2))


def _turned(a: Any, b: Any, center: Any, normal: Any) -> Any:
    """Angle in (-pi, pi] about the axis (center, normal) from point a to point b."""
    px, py, pz = a[0] - center[0], a[1] - center[1], a[2] - center[2]
    qx, qy, qz = b[0] - center[0], b[1] - center[1], b[2] - center[2]
    h = px * normal[0] + py * normal[1] + pz * normal[2]
    g = qx * normal[0] + qy * normal[1] + qz * normal[2]
    cross = normal[0] * (py * qz - pz * qy) + normal[1] * (pz * qx - px * qz) + normal[2] * (px * qy - py * qx)
    return math.atan2(cross, px * qx + py * qy + pz * qz - h * g)


def _line_done(tip: Any, axis: Any, start: Any, end: Any, axis0: Any, axis1: Any, tol: float, axis_tol: float) -> Any:
    """True where a pose has come to the end of a straight move."""
    length = _apart(start, end)
    if _angle(axis0, axis1) > axis_tol and _angle(axis, axis1) > axis_tol:
        return False
    if length <= tol:
        return _apart(tip, end) <= 2.0 * tol
    past = ((tip[0] - end[0]) * (end[0] - start[0]) + (tip[1] - end[1]) * (end[1] - start[1])
            + (tip[2] - end[2]) * (end[2] - start[2])) / length
    return past >= -min(tol, 0.5 * length)


def _nearer(tip: Any, axis: Any, after: Any, axis_after: Any, end: Any, axis1: Any, grain: float, axis_grain: float) -> Any:
    """True where a pose is off the end of its move by more than rounding, and the block after it comes nearer."""
    off, turn = _apart(tip, end), _angle(axis, axis1)
    if off <= grain and turn <= axis_grain:
        return False
    off_after, turn_after = _apart(after, end), _angle(axis_after, axis1)
    comes = off_after < off - 0.1 * grain or turn_after < turn - 0.1 * axis_grain
    return comes and off_after <= max(off, grain) and turn_after <= max(turn, axis_grain)


def _walk(tip: Any, axis: Any, swept: Any, start: Any, end: Any, axis0: Any, axis1: Any, kind: Any, center: Any,
          normal: Any, sweep: Any, tol: float, axis_tol: float, grain: float, axis_grain: float) -> tuple[Any, Any]:
    count, moves = len(tip), len(end)
    match = np.full(moves, -1, np.int64)
    owner = np.full(count, moves, np.int64)
    j = -1
    for i in range(moves):
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
                if swept[k] > 0.0:
                    step += 2.0 * math.pi * math.floor((swept[k] - step) / (2.0 * math.pi) + 0.5)
                angle += step
                slack = max(0.5 * tol, grain) / max(_apart(start[i], center[i]), tol)
                done = angle >= sweep[i] - slack and _angle(axis[k], axis1[i]) <= axis_tol
            else:
                done = _line_done(tip[k], axis[k], start[i], end[i], axis0[i], axis1[i], tol, axis_tol)
            k += 1
        if not done:
            for r in range(j + 1, count):
                owner[r] = i
            return match, owner
        while k < count and _nearer(tip[k - 1], axis[k - 1], tip[k], axis[k], end[i], axis1[i], grain, axis_grain):
            owner[k] = i
            k += 1
        j = k - 1
        match[i] = j
    return match, owner


def unreached(match: Array) -> int:
    """The first move that no block reaches, -1 where all are reached."""
    missing = np.flatnonzero(match == -1)
    return int(missing[0]) if len(missing) else -1
