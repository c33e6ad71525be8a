"""Loops that numba compiles for long files: which block ends at which position, plain GOTO lines and their numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import FunctionType
from typing import Any, cast

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]

COMPILED_FROM = 20_000
_EXACT = 1 << 53
"""whole numbers up to that and powers of ten up to the 22nd are floats, so that one division or product rounds once"""
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
        from numba import types

        rows, numbers = (types.Array(types.float64, n, "A", readonly=True) for n in (2, 1))
        flags = types.Array(types.boolean, 1, "A", readonly=True)
        _compiled.append(compiled(("_apart", "_near", "_turned"), "_walk", rows, rows, rows, rows, rows, numbers,
                                  rows, flags, numbers, types.float64, types.float64))
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


def compiled(helpers: tuple[str, ...], name: str, *signature: Any) -> Callable[..., Any]:
    """A loop of this module as machine code, and those that it calls; the module's own stay interpreted."""
    import numba

    own, njit = dict(globals()), cast(Any, numba.njit)
    for one in (*helpers, name):
        function = FunctionType(own[one].__code__, own, one)
        takes = (signature,) if one == name else ()
        try:
            own[one] = njit(*takes, cache=True)(function)
        except RuntimeError:  # no folder for the cache
            own[one] = njit(*takes)(function)
    result: Callable[..., Any] = own[name]
    return result


def at_once(text: bytes) -> tuple[Array | None, list[tuple[int, int]]]:
    """(N, 6) of the plain GOTO lines, and where each other line begins and ends; None where a number has too many digits."""
    from numba import types

    some, powers = (types.Array(kind, n, "C", readonly=n == 1) for kind, n in ((types.uint8, 1), (types.float64, 1)))
    lines = text.count(b"\n") + 1
    rows, others = np.empty((lines, 6)), np.empty((lines, 2), np.int64)
    loop = compiled(("_character", "_number", "_goto"), "_plain_lines", some, powers,
                    types.float64[:, ::1], types.int64[:, ::1])
    plain, other = loop(np.frombuffer(text, np.uint8), 10.0 ** np.arange(23), rows, others)
    return (None, []) if plain < 0 else (rows[:plain], list(map(tuple, others[:other].tolist())))


def _plain_lines(text: Any, powers: Any, rows: Any, others: Any) -> Any:
    """How many rows and other lines there are, -1 where a number has more digits than one rounding takes."""
    at, plain, other = 0, 0, 0
    while at <= len(text):
        end, count = _goto(text, at, powers, rows[plain])
        if count < 0:
            return -1, other
        if count == 0:
            end = at
            while _character(text, end) != 10:
                end += 1
            others[other, 0], others[other, 1] = at, end
            other += 1
        else:
            rows[plain, count:] = np.nan
            plain += 1
        at = end + 1
    return plain, other


def _goto(text: Any, at: int, powers: Any, row: Any) -> Any:
    """(end of the line, its numbers: 3 or 6, 0 where it is no plain GOTO, -1 where they need more than one rounding)."""
    for code in (0, 71, 79, 84, 79, 0, 47):
        if code == 0:
            while _character(text, at) == 32 or _character(text, at) == 9:
                at += 1
        elif _character(text, at) != code:
            return at, 0
        else:
            at += 1
    for k in range(6):
        at, row[k], fine = _number(text, at, powers)
        if fine <= 0:
            return at, fine
        if _character(text, at) == 10 and (k == 2 or k == 5):
            return at, k + 1
        if _character(text, at) != 44:
            return at, 0
        at += 1
    return at, 0


def _number(text: Any, at: int, powers: Any) -> Any:
    """(where it ends with the blanks about it, value, 1; 0 where there is none; -1 where one rounding does not make it)."""
    while _character(text, at) in (32, 9, 1):
        at += 1
    minus = _character(text, at) == 45
    at += 1 if _character(text, at) in (43, 45) else 0
    whole, digits, power, point = 0, 0, 0, False
    while 48 <= _character(text, at) <= 57 or (_character(text, at) == 46 and not point):
        if _character(text, at) == 46:
            point = True
        else:
            whole, digits, power = whole * 10 + _character(text, at) - 48, digits + 1, power - int(point)
        at += 1
    if digits == 0 or digits > 18 or whole > _EXACT:
        return at, 0.0, 0 if digits == 0 else -1
    if _character(text, at) in (69, 101):
        at, raised, sign = at + 1, 0, -1 if _character(text, at + 1) == 45 else 1
        at += 1 if _character(text, at) in (43, 45) else 0
        begin = at
        while 48 <= _character(text, at) <= 57:
            raised, at = min(raised * 10 + _character(text, at) - 48, 999), at + 1
        if at == begin:
            return at, 0.0, 0
        power += sign * raised
    while _character(text, at) in (32, 9, 1):
        at += 1
    if abs(power) > 22:
        return at, 0.0, -1
    value = whole * powers[power] if power > 0 else whole / powers[-power]
    return at, -value if minus else value, 1


def _character(text: Any, at: int) -> int:
    """That of the end of a line behind the last."""
    return int(text[at]) if at < len(text) else 10
