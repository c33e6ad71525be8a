"""Rows that belong together, without a pass over all rows for each group."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Ints


def groups(*columns: Ints) -> list[Ints]:
    """The row numbers (ascending) of each set of equal values in columns (N,), in order of the values."""
    if len(columns[0]) and all((column == column[0]).all() for column in columns):
        return [np.arange(len(columns[0]))]
    order = np.lexsort(columns[::-1])
    changes = np.zeros(len(order), dtype=bool)
    for column in columns:
        changes[1:] |= np.diff(column[order]) != 0
    return [rows for rows in np.split(order, np.flatnonzero(changes)) if len(rows)]
