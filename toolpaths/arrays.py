"""Read-only arrays with checked shapes, the common ground of all value types."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Array = npt.NDArray[Any]


def frozen(values: npt.ArrayLike, dtype: npt.DTypeLike, shape: tuple[int, ...], name: str) -> Array:
    """`values` as a read-only array of `dtype`; -1 in `shape` allows any length.

    A writable array that already fits is not copied: a read-only view of it is returned.

    Raises:
        ValueError: where the shape does not fit.
    """
    array = np.asarray(values, dtype=dtype)
    if array.ndim != len(shape) or any(want not in (-1, got) for want, got in zip(shape, array.shape, strict=True)):
        wanted = "(" + ", ".join("any" if n < 0 else str(n) for n in shape) + ")"
        raise ValueError(f"{name} has shape {array.shape}, expected {wanted}")
    view = array.view()
    view.flags.writeable = False
    return view
