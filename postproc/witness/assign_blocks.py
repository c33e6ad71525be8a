"""Which block of a program ends at which commanded position: one pass over both, a plain loop that numba compiles."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from postproc.witness.text import Array

COMPILED_FROM = 20_000
_compiled: list[Callable[..., Any]] = []


def walk(tip: Array, axis: Array, sweep: Array, targets: Array, directions: Array, arc: Array, around: Array,
         skipped: Array, least: Array, within: tuple[float, float]) -> Array:
    """(M,) block that ends at each target, -1 from the first on that none ends at.

    Args:
        tip, axis (E, 3): tool at the end of every block; sweep (E, 3): rotation vector of blocks that are arcs
        targets, directions (M, 3): tips and axes to come to, in order
        arc (M,): rad that the tool turns about `around` (M, 6), centre and axis, on its path there; 0 for no arc
        skipped (M,): positions that nobody knows stand before it, so that the tool leaves, though it may come
            back to where it stood
        least (M,): mm that the tool goes at least on its path there (a spline may come back to where it begins)
        within: mm and rad
    """
    run = _walk if len(tip) < COMPILED_FROM else _fast()
    return np.asarray(run(tip, axis, sweep, targets, directions, arc, around, skipped, least, *within))


def _fast() -> Callable[..., Any]:
    if not _compiled:
        from numba import njit, types

        rows, numbers = (types.Array(types.float64, n, "A", readonly=True) for n in (2, 1))
        flags = types.Array(types.boolean, 1, "A", readonly=True)
        signature = (rows, rows, rows, rows, rows, numbers, rows, flags, numbers, types.float64, types.float64)
        own = dict(globals())  # of the compiled functions: those of the module stay interpreted

        def made(name: str, signature: Any = None) -> Callable[..., Any]:
            function = FunctionType(own[name].__code__, own, name)
            try:
                result: Callable[..., Any] = njit(signature, cache=True)(function)
            except RuntimeError:  # no folder for the cache
                result = njit(signature)(function)
            return result

        for name in ("_apart", "_near", "_turned"):
            own[name] = made(name)
        _compiled.append(made("_walk", signature))
    return _compiled[0]


def _apart(a: Any, b: Any) -> Any:
    return math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


def _near(off: float, turn: float, tol: float, axis_tol: float) -> bool:
    return off <= tol and turn <= axis_tol


def _turned(a: Any, b: Any, c: Any) -> Any:
    """Angle about (centre, axis) `c` from point a to point b, in (-pi, pi]."""
    px, py, pz, qx, qy, qz = a[0] - c[0], a[1] - c[1], a[2] - c[2], b[0] - c[0], b[1] - c[1], b[2] - c[2]
    h, g = px * c[3] + py * c[4] + pz * c[5], qx * c[3] + qy * c[4] + qz * c[5]
    cross = c[3] * (py * qz - pz * qy) + c[4] * (pz * qx - px * qz) + c[5] * (px * qy - py * qx)
    return math.atan2(cross, px * qx + py * qy + pz * qz - h * g)


def _walk(tip: Any, axis: Any, sweep: Any, targets: Any, directions: Any, arc: Any, around: Any,
          skipped: Any, least: Any, tol: float, axis_tol: float) -> Any:
    count = len(tip)
    match = np.full(len(targets), -1, np.int64)
    j = -1
    for i in range(len(targets)):
        goal, along, whole = targets[i], directions[i], arc[i]
        stands = j >= 0 and not skipped[i] and abs(whole) < math.pi and least[i] == 0.0
        if stands and _near(_apart(tip[j], goal), _apart(axis[j], along), 2e-3, 1e-5):
            after = j + 1 < count and _near(_apart(tip[j + 1], goal), _apart(axis[j + 1], along), 2e-3, 1e-5)
            if not after:
                match[i] = j
                continue
        k, turned, gone, found = j + 1, 0.0, 0.0, False
        while k < count:
            if least[i] > 0.0 and k > 0:
                gone += _apart(tip[k - 1], tip[k])
            if whole != 0.0:
                step = _turned(tip[k - 1] if k > 0 else tip[k], tip[k], around[i])
                size = sweep[k, 0] * around[i, 3] + sweep[k, 1] * around[i, 4] + sweep[k, 2] * around[i, 5]
                if size != 0.0:
                    step += 2.0 * math.pi * math.floor((size - step) / (2.0 * math.pi) + 0.5)
                turned += step
            if _near(_apart(tip[k], goal), _apart(axis[k], along), tol, axis_tol) and (
                    abs(whole) < math.pi or abs(turned) > 0.5 * abs(whole)) and gone >= least[i]:
                found = True
                break
            k += 1
        if not found:
            if j >= 0 and abs(whole) < math.pi and least[i] == 0.0 and _near(
                    _apart(tip[j], goal), _apart(axis[j], along), tol, axis_tol):
                match[i] = j
                continue
            return match
        while k + 1 < count:
            off, turn = _apart(tip[k], goal), _apart(axis[k], along)
            off_after, turn_after = _apart(tip[k + 1], goal), _apart(axis[k + 1], along)
            if (off <= 2e-3 and turn <= 1e-5) or off_after > off or turn_after > turn + 1e-9 or (
                    off_after > 0.5 * off and turn_after > 0.5 * turn + 1e-9):
                break
            k += 1
        j = k
        match[i] = j
    return match
