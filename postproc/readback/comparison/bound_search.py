"""The state of the search for a bound by branch and bound: parts of blocks, what is known of them, the worst so far."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

TIGHT = 1.01
"""bound over worst pose that is near enough"""
GRAIN = 1e-6, 1e-8
"""mm, rad: bounds below are not looked at more closely"""
_NO_BOUND = 1e20
"""mm: above it nothing is known"""


@dataclass(frozen=True)
@arrays(unbounded_rows="U", whole="* K")
class DeviationBound:
    """Upper bounds over all blocks: tip (mm), axis (rad), each with the block (row) that has it, -1 where
    there are none; how many blocks have no bound, because kinematics or law give none (they are only checked
    at places), and which; `whole`: tip and axis (2, K) of every block, undivided."""

    tip: float
    axis: float
    tip_row: int
    axis_row: int
    unbounded: int
    unbounded_rows: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    whole: Floats = field(default_factory=lambda: np.zeros((2, 0)))


@dataclass(frozen=True)
@arrays(k="N", a="N", b="N")
class Pieces:
    """Parts [a, b] of blocks: `k` (N,) numbers of `_Ends.rows`."""

    k: Ints
    a: Floats
    b: Floats

    def __len__(self) -> int:
        return len(self.k)

    def divided(self, parts: int) -> Pieces:
        """Each in so many equal parts."""
        cuts = self.a[:, None] + np.linspace(0.0, 1.0, parts + 1) * (self.b - self.a)[:, None]
        cuts[:, -1] = self.b
        return Pieces(np.repeat(self.k, parts), cuts[:, :-1].ravel(), cuts[:, 1:].ravel())

    def take(self, index: Ints | Bools | slice) -> Pieces:
        """Some of them."""
        return Pieces(self.k[index], self.a[index], self.b[index])


@dataclass(frozen=True)
@arrays(seen_tip="N", seen_axis="N", tip="N", axis="N")
class PieceBounds:
    """Of N pieces: worst deviation at places, and bound, of tip (mm) and axis (rad); inf where there is no bound."""

    seen_tip: Floats
    seen_axis: Floats
    tip: Floats
    axis: Floats

    def take(self, index: Bools | Ints) -> PieceBounds:
        """Some of them."""
        return PieceBounds(self.seen_tip[index], self.seen_axis[index], self.tip[index], self.axis[index])

    def replaced(self, index: Ints, other: PieceBounds) -> PieceBounds:
        """With others in the place of some."""
        changed = []
        for name in ("seen_tip", "seen_axis", "tip", "axis"):
            column = np.array(getattr(self, name))
            column[index] = getattr(other, name)
            changed.append(column)
        return PieceBounds(*changed)


class BoundSearch:
    """The state of the search: worst poses seen, largest bounds of closed pieces, pieces that are still open.

    Everything in pairs, of tip and axis. `judge`: only whether the tolerances are kept is looked for, not by how much.
    """

    def __init__(self, allowed: tuple[float, float], judge: bool = False) -> None:
        self.allowed, self.judge = np.array(allowed), judge
        self.seen, self.closed = np.zeros(2), np.zeros(2)
        self.k, self.k_seen = [-1, -1], [-1, -1]
        self.open: list[tuple[Pieces, PieceBounds]] = []
        self.unbounded: set[int] = set()

    def add(self, pieces: Pieces, values: PieceBounds) -> None:
        """Take pieces in; those without a bound count by what was seen of them."""
        for i, seen in enumerate((values.seen_tip, values.seen_axis)):
            worst = int(seen.argmax())
            if seen[worst] > self.seen[i]:
                self.seen[i], self.k_seen[i] = seen[worst], int(pieces.k[worst])
        bounded = np.isfinite(values.tip) & np.isfinite(values.axis)
        if not bounded.all():
            self.unbounded.update(np.unique(pieces.k[~bounded]).tolist())
            pieces, values = pieces.take(bounded), values.take(bounded)
        self.open.append((pieces, values))
        self._sort_out()

    def _limit(self) -> Floats:
        """Bounds up to here are near enough: to the worst seen, and inside the tolerance where that is."""
        near = np.maximum(TIGHT * self.seen, self.allowed if self.judge else np.array(GRAIN))
        return np.asarray(np.where(self.seen <= self.allowed, np.minimum(near, self.allowed), near))

    @property
    def judged(self) -> bool:
        """True where only the judgement is looked for, and a pose outside the tolerances has been seen."""
        return self.judge and bool((self.seen > self.allowed).any())

    def _sort_out(self) -> None:
        """Close the pieces whose bounds are near enough to the worst seen."""
        limit, still = self._limit(), []
        for pieces, values in self.open:
            above = (values.tip > limit[0]) | (values.axis > limit[1])
            self._close(pieces.take(~above), values.take(~above))
            if above.any():
                still.append((pieces.take(above), values.take(above)))
        self.open = still

    def _close(self, pieces: Pieces, values: PieceBounds) -> None:
        for i, bound in enumerate((values.tip, values.axis)):
            if len(bound) and bound.max() > self.closed[i]:
                self.closed[i], self.k[i] = bound.max(), int(pieces.k[bound.argmax()])

    def give_up(self) -> None:
        """Open pieces of which nothing is known have no bound."""
        parts, self.open = self.open, []
        for pieces, values in parts:
            known = np.maximum(values.tip, values.axis) < _NO_BOUND
            self.unbounded.update(np.unique(pieces.k[~known]).tolist())
            self.open.append((pieces.take(known), values.take(known)))

    def taken(self) -> Pieces:
        """The pieces that are open, which are so no more."""
        self._sort_out()
        pieces, self.open = [p for p, _ in self.open], []
        if not pieces:
            return Pieces(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))
        return Pieces(*(np.concatenate([getattr(p, name) for p in pieces]) for name in ("k", "a", "b")))

    def result(self, rows: Ints) -> DeviationBound:
        """What is known in the end."""
        self.give_up()
        for pieces, values in self.open:
            self._close(pieces, values)
        tip, axis = np.maximum(self.closed, self.seen).tolist()
        tip_row, axis_row = (int(rows[k]) if k >= 0 else -1 for k in (self.k_seen if self.judged else self.k))
        without = rows[np.array(sorted(self.unbounded), dtype=np.int64)]
        return DeviationBound(tip, axis, tip_row, axis_row, len(without), without)
