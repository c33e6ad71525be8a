"""Runs of rows, all at once: what each run has first, least or throughout."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(begin="H", size="H")
class RowRuns:
    """H runs of rows that follow each other, N rows in all: `begin` (H,) row of each run's first, `size` (H,) rows."""

    begin: Ints
    size: Ints

    def __len__(self) -> int:
        return len(self.begin)

    @classmethod
    def of(cls, number: Ints) -> RowRuns:
        """The runs of equal numbers (N,)."""
        begin = np.flatnonzero(np.diff(number, prepend=number[:1] - 1))
        return cls(begin, np.diff(begin, append=len(number)))

    @property
    def last(self) -> Ints:
        """(H,) row of each run's last."""
        return self.begin + self.size - 1

    @property
    def rows(self) -> Ints:
        """(M,) all rows of the runs."""
        return np.arange(int(self.size.sum())) + np.repeat(self.begin - np.cumsum(self.size) + self.size, self.size)

    @property
    def of_rows(self) -> Ints:
        """(M,) number of the run that each of `rows` is of."""
        return np.repeat(np.arange(len(self)), self.size)

    def some(self, keep: Bools | Ints) -> RowRuns:
        """Some of the runs."""
        return RowRuns(self.begin[keep], self.size[keep])

    def packed(self) -> RowRuns:
        """The same runs of rows that are `rows` alone."""
        return RowRuns(np.cumsum(self.size) - self.size, self.size)

    def throughout(self, true: Bools) -> Bools:
        """(H,) runs with nothing but True; (M,) by `rows`."""
        return np.asarray(np.bincount(self.of_rows[~true], minlength=len(self)) == 0)

    def first(self, true: Bools) -> Ints:
        """(H,) row, of those of `rows`, of each run's first True (M,); -1 where there is none."""
        where = np.flatnonzero(true)
        result = np.full(len(self), -1)
        result[self.of_rows[where[::-1]]] = where[::-1]
        return result

    def least(self, values: Floats) -> Ints:
        """(H,) row, of those of `rows`, of each run's least value (M,), the first of equal ones."""
        low = np.minimum.reduceat(values, self.packed().begin) if len(self) else np.zeros(0)
        return self.first(values == low[self.of_rows])
