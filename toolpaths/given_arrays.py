"""Arrays that a caller gives: numbers of a shape, checked; rows that belong to one pass."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, DiagnosticError, error

Listed = TypeVar("Listed")
CLOSE = 0.01
"""mm that the begin and the end of an arc may be off its circle"""


class GivenArrays:
    """Arrays for N rows; each fault is kept with its rows, so that all are named at once."""

    def __init__(self, rows: int, file: str) -> None:
        self.rows, self.file = rows, file
        self.found: list[Diagnostic] = []

    def fault(self, message: str, remedy: str, wrong: Bools | None = None) -> None:
        """An ERROR; `wrong` (N,) says in which rows, counted from 1."""
        lines = [] if wrong is None else (np.flatnonzero(wrong) + 1).tolist()
        self.found.append(error("arrays.value", f"{message}; {remedy}", file=self.file, lines=lines[:6],
                                count=max(len(lines), 1)))

    def floats(self, name: str, values: npt.ArrayLike, width: int = 0, *, gaps: bool = False) -> Floats:
        """(N,) or (N, width) finite numbers, from one value or row for all of them; with `gaps` NaN stands for none."""
        shape = (self.rows, width) if width else (self.rows,)
        try:
            a = np.array(np.broadcast_to(_numbers(values), shape))
        except (TypeError, ValueError, OverflowError):
            self.fault(f"{name} is no array of numbers of shape {shape}: {_shown(values)}",
                       f"give {name} as {shape}, or one {'row' if width else 'number'} for all rows of tip")
            return np.full(shape, np.nan)
        each: Bools = np.isinf(a) if gaps else ~np.isfinite(a)
        wrong: Bools = np.any(each.reshape(len(a), -1), axis=1)
        if wrong.any():
            self.fault(f"{name} holds values that are no finite numbers", "give finite numbers in each row"
                       + (", NaN where there is none" if gaps else ""), wrong)
        return a

    def whole(self, name: str, values: npt.ArrayLike, least: int, below: int | None = None) -> Ints:
        """(N,) whole numbers from `least` up, below `below`."""
        a = self.floats(name, values)
        with np.errstate(invalid="ignore"):
            wrong = (a != np.floor(a)) | (a < least) | (a >= (2**31 if below is None else below))
        if wrong.any():
            most = "" if below is None else f" to {below - 1}" if below > least else ", and no other"
            self.fault(f"{name} holds {a[wrong][0]:g}, allowed are whole numbers from {least}{most}",
                       f"give numbers that there are in {name}", wrong)
        return np.where(wrong | np.isnan(a), least, a).astype(np.int64)

    def flags(self, name: str, values: npt.ArrayLike) -> Bools:
        """(N,) True or False."""
        a = np.asarray(values)
        if a.dtype != np.bool_:
            self.fault(f"{name} is of type {a.dtype}", f"give {name} as True or False for each row")
            return np.zeros(self.rows, bool)
        return np.asarray(self.floats(name, a.astype(np.float64)) != 0.0)

    def listed(self, name: str, values: object, kind: type[Listed]) -> tuple[Listed, ...]:
        """The values of a list, each of `kind`."""
        given = tuple(values) if isinstance(values, Sequence) else (values,)
        if not isinstance(values, Sequence) or not all(isinstance(one, kind) for one in given):
            types = ", ".join(sorted({type(one).__name__ for one in given}))
            self.fault(f"{name} is no list of {kind.__name__}: found {types}", f"give a list of {kind.__name__}")
        return tuple(one for one in given if isinstance(one, kind))

    def require(self) -> None:
        """Raise what was found.

        Raises:
            DiagnosticError: carries all faults.
        """
        if self.found:
            raise DiagnosticError(self.found)


def _numbers(values: npt.ArrayLike) -> Floats:
    """Numbers as float64, NaN where an array is masked.

    Raises:
        TypeError, ValueError, OverflowError: complex numbers, flags, texts, dates, rows of different lengths.
    """
    a = np.asanyarray(values)
    if a.dtype.kind not in "fiuO":
        raise TypeError(f"no numbers: {a.dtype}")
    if isinstance(a, np.ma.MaskedArray):
        return np.where(np.ma.getmaskarray(a), np.nan, np.ma.getdata(a).astype(np.float64))
    return np.asarray(a, np.float64)


def _shown(values: npt.ArrayLike) -> str:
    try:
        a = np.asarray(values)
    except ValueError:
        return "rows of different lengths"
    return f"found {a.dtype} of shape {a.shape}"


def given_rows(tip: npt.ArrayLike, file: str) -> tuple[GivenArrays, Floats]:
    """What checks further arrays, and the tips (N, 3), N > 0.

    Raises:
        DiagnosticError: where the tips are no such array.
    """
    try:
        a = _numbers(tip)
    except (TypeError, ValueError, OverflowError):
        a = np.zeros(0)
    given = GivenArrays(len(a) if a.ndim else 0, file)
    if a.ndim != 2 or a.shape[1] != 3 or not len(a):
        given.fault(f"tip is no array (N, 3) of numbers: {_shown(tip)}", "give one row x, y, z in mm for each position")
        given.require()
    return given, given.floats("tip", a, 3)


def unit_rows(given: GivenArrays, name: str, values: npt.ArrayLike, *, gaps: bool = False) -> Floats:
    """(N, 3) directions of length 1; with `gaps` rows of NaN stay."""
    a = given.floats(name, values, 3, gaps=gaps)
    scale = np.abs(a).max(axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        a = a / scale
        result: Floats = a / np.linalg.norm(a, axis=1, keepdims=True)
    wrong = scale[:, 0] == 0.0
    if wrong.any():
        given.fault(f"{name} has length 0", f"give {name} a direction", wrong)
    return result


def off_circle(begin: Floats, end: Floats, center: Floats, normal: Floats, radius: Floats, sweep: Floats) -> Floats:
    """(K,) mm that begins and ends (K, 3) are off their arcs, heights along the axes apart."""
    def across(p: Floats) -> Floats:
        d = p - center
        return np.asarray(d - normal * np.einsum("ni,ni->n", d, normal)[:, None])
    first, last = across(begin), across(end)
    reached = np.cos(sweep)[:, None] * first + np.sin(sweep)[:, None] * np.cross(normal, first)
    return np.asarray(np.maximum(np.abs(np.linalg.norm(first, axis=1) - radius), np.linalg.norm(reached - last, axis=1)))


def passes(free: Bools, operation: Array, tool: Array) -> Array:
    """Number of the pass per row: a run of cutting rows and the `free` (rapid) rows before it.

    A change of the operation or the tool between two cutting rows also begins a pass.
    """
    begins = np.zeros(len(free), bool)
    change = (operation[1:] != operation[:-1]) | (tool[1:] != tool[:-1])
    begins[1:] = ~free[:-1] & (free[1:] | change)
    return np.cumsum(begins).astype(np.int32)
