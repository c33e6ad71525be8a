"""Read-only arrays with checked shapes, the common ground of all value types."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Array = npt.NDArray[Any]
Item = TypeVar("Item", bound=np.generic)
_CORNERS = np.array(list(product((False, True), repeat=3)))


def shared(values: Array) -> Array:
    """The same rows; where all are bit for bit the first one, it is kept once and stands for all, read-only."""
    if not len(values) or values.strides[0] == 0:
        return values
    if not (np.array_equal(_bits(values[-1:]), _bits(values[:1])) and (_bits(values) == _bits(values[:1])).all()):
        return values
    return repeated(values[0], len(values))


def repeated(row: npt.ArrayLike, count: int) -> Array:
    """`count` times the same row, which is kept once, read-only."""
    return _rows_of_one(np.array(row), count)


def _rows_of_one(row: Array, count: int) -> Array:
    """`numpy.broadcast_to(row, (count, ...))`, which takes ten times as long."""
    if row.dtype.hasobject:
        return np.broadcast_to(row, (count, *row.shape))
    made: Array = np.ndarray((count, *row.shape), row.dtype, row, 0, (0, *row.strides))
    made.flags.writeable = False
    return made


def _bits(values: Array) -> Array:
    return values if values.dtype.kind != "f" else np.ascontiguousarray(values).view(np.int64)


def taken(values: Array, index: Array | slice) -> Array:
    """Rows of an array; those of one row that is kept once (`shared`) are kept once again."""
    if isinstance(index, slice) or not len(values) or values.strides[0] != 0:
        return np.asarray(values[index])
    count = int(np.count_nonzero(index)) if index.dtype == np.bool_ else len(index)
    return _rows_of_one(np.asarray(values[0]), count)


def joined(parts: Sequence[Array]) -> Array:
    """Arrays one behind the other; where all hold one and the same row, it is kept once."""
    rows = [part[:1] for part in parts if len(part)]
    if rows and all(not len(part) or part.strides[0] == 0 for part in parts):
        ends = shared(np.concatenate(rows))
        if ends.strides[0] == 0 or len(rows) == 1:
            return repeated(ends[0], sum(map(len, parts)))
    return np.concatenate(parts)


def among(values: Array, some: Iterable[float]) -> Bools:
    """(N,) which of the values (N,) are one of a few numbers: `numpy.isin`, which takes many times as long for few."""
    found = np.zeros(values.shape, dtype=bool)
    for one in some:
        found |= values == one
    return found


def within(values: npt.ArrayLike, low: npt.ArrayLike, high: npt.ArrayLike) -> Array:
    """`numpy.clip`, which takes five times as long for few."""
    made: Array = np.minimum(np.maximum(values, low), high)
    return made


def distinct(values: npt.NDArray[Item]) -> npt.NDArray[Item]:
    """(K,) the different numbers in values (N,), ascending, NaN once and last: `numpy.unique`, which hashes whole numbers
    and takes up to thirty times as long as putting them in order, or as seeing that they are; besides, it imports
    `numpy.ma`, which takes as long as reading a small CL file."""
    if len(values) < 2:
        return values.copy()
    numbers: Array = values
    floats = numbers.dtype.kind == "f"
    if floats or (numbers[1:] < numbers[:-1]).any():
        numbers = np.sort(numbers)
    other = numbers[1:] != numbers[:-1]
    return np.asarray(numbers[np.append(True, other & ~np.isnan(numbers[:-1]) if floats else other)])


def without_nan(values: Floats, nan: float = 0.0) -> Floats:
    """`numpy.nan_to_num` with `nan` in the place of NaN; the values themselves where all are finite."""
    return values if np.isfinite(values).all() else np.nan_to_num(values, nan=nan)


def box_corners(low: Floats, high: Floats) -> Floats:
    """(8, 3) corners of the box from `low` (3,) to `high` (3,), these two first and last."""
    return np.where(_CORNERS, high, low)


def finite(value: float) -> float | None:
    """None for inf and NaN, which JSON has no words for."""
    return float(value) if math.isfinite(value) else None


def runs(which: Bools) -> Ints:
    """(N, 2) first and one past the last of the stretches where `which` (K,) is True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], which, [False]]).astype(np.int8)))
    return np.asarray(edges.reshape(-1, 2))


def as_slice(index: Ints) -> Ints | slice:
    """The same index; one that counts up by one is a slice, which copies nothing."""
    if not len(index) or index[-1] - index[0] != len(index) - 1 or (np.diff(index) != 1).any():
        return index
    return slice(int(index[0]), int(index[-1]) + 1)


def slices(count: int, most: int = 1 << 16) -> Iterator[slice]:
    """Slices of a long array one behind the other, so that what is made of them meanwhile stays small; at least one."""
    return (slice(first, min(first + most, count)) for first in range(0, max(count, 1), most))


def read_only(values: npt.ArrayLike) -> Floats:
    """A read-only view of an array, or what is none as one."""
    view: Floats = np.asarray(values, dtype=np.float64).view()
    view.flags.writeable = False
    return view
