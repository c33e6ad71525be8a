"""Quintic B-splines of many separate stretches in one set of arrays.

Stretch g has its own clamped knot vector (both end knots six times); the vectors stand one behind the other.
A basis function begins at the knot that has its number plus 6 g. Basis functions of different stretches do
not overlap, so that one banded system holds them all.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

DEGREE = 5
ORDER = DEGREE + 1


@dataclass(frozen=True)
@arrays(t="T", first="G")
class KnotVectors:
    """Knots of G stretches.

    Attributes:
        t (T,): the clamped vectors, stretch after stretch
        first (G + 1,): where the vector of each stretch begins in t
    """

    t: Floats
    first: Ints

    @staticmethod
    def clamped(values: Floats, first: Ints) -> KnotVectors:
        """From simple knots `values`, ends included, of stretches that begin at `first` (G + 1,)."""
        repeat = np.ones(len(values), dtype=np.int64)
        repeat[first[:-1]] = ORDER
        repeat[first[1:] - 1] = ORDER
        return KnotVectors(np.repeat(values, repeat), first + 2 * DEGREE * np.arange(len(first)))

    def taken(self, which: Bools) -> KnotVectors:
        """Those of some stretches (G,)."""
        size = np.diff(self.first)
        return KnotVectors(self.t[np.repeat(which, size)], np.concatenate(([0], np.cumsum(size[which]))))

    @property
    def count(self) -> int:
        """K, number of coefficients."""
        return len(self.t) - ORDER * (len(self.first) - 1)

    @property
    def ends(self) -> tuple[Ints, Ints]:
        """First and last coefficient (G,) of each stretch."""
        number = np.arange(len(self.first))
        begin = self.first - ORDER * number
        return begin[:-1], begin[1:] - 1

    @cached_property
    def coefficient(self) -> Ints:
        """(T,) the first of the six coefficients that count on the span that begins at a knot."""
        stretch = np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))
        return np.asarray(np.maximum(np.arange(len(self.t)) - DEGREE - ORDER * stretch, 0))

    def simple(self) -> tuple[Floats, Ints]:
        """The knots without repetition, and where each stretch begins among them: the inverse of `clamped`."""
        keep = np.ones(len(self.t), dtype=bool)
        for k in range(DEGREE):
            keep[self.first[:-1] + k] = False
            keep[self.first[1:] - 1 - k] = False
        return self.t[keep], self.first - 2 * DEGREE * np.arange(len(self.first))

    def span(self, s: Floats, stretch: Ints) -> Ints:
        """k (N,) with t[k] <= s < t[k + 1] inside the stretch (N,); the end spans hold what is outside it."""
        k = np.searchsorted(self.t, s, side="right") - 1
        return np.clip(k, self.first[stretch] + DEGREE, self.first[stretch + 1] - ORDER - 1)

    def widths(self) -> Floats:
        """(K,) a third of the support of the third derivative's part that coefficient k begins; inside stretches."""
        k, stretch = self._own()
        last = np.minimum(k + ORDER, self.first[stretch + 1] - 1)
        return np.asarray((self.t[last] - self.t[np.minimum(k + 3, last)]) / 3.0)

    def derivative_rows(self, order: int) -> tuple[Floats, Bools]:
        """Rows (K, order + 1): the derivative's coefficients are row k times c[k:k + order + 1]; and which rows exist.

        De Boor, A Practical Guide to Splines, X (12): each derivative is a divided difference of the coefficients.
        """
        k, stretch = self._own()
        rows = np.zeros((len(k), order + 1))
        rows[:, 0] = 1.0
        exists = k + order + ORDER < self.first[stretch + 1]
        for m in range(1, order + 1):
            gap = self.t[np.minimum(k + ORDER, len(self.t) - 1)] - self.t[k + m]
            ahead = np.zeros_like(rows)
            ahead[:-1, 1:] = rows[1:, :-1]
            rows = np.where(gap > 0.0, (ORDER - m) / np.where(gap > 0.0, gap, 1.0), 0.0)[:, None] * (ahead - rows)
        rows[~exists] = 0.0
        return rows, exists

    def _own(self) -> tuple[Ints, Ints]:
        """The knot (K,) at which each coefficient's basis function begins, and its stretch."""
        begin, last = self.ends
        stretch = np.repeat(np.arange(len(begin)), last - begin + 1)
        return np.arange(self.count) + ORDER * stretch, stretch


def basis(t: Floats, k: Ints, s: Floats) -> Floats:
    """The six basis functions (6, N) at s (N,) that do not vanish on the spans k (N,); polynomials outside them.

    Piegl and Tiller, The NURBS Book, algorithm A2.2.
    """
    left = [s - t[k + 1 - j] for j in range(ORDER)]
    right = [t[k + j] - s for j in range(ORDER)]
    values = np.zeros((ORDER, len(s)))
    values[0] = 1.0
    for j in range(1, ORDER):
        saved = np.zeros(len(s))
        for r in range(j):
            part = values[r] / (right[r + 1] + left[j - r])
            values[r] = saved + right[r + 1] * part
            saved = left[j - r] * part
        values[j] = saved
    return values
