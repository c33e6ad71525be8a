"""Moves cut finer than the CL file has them: where the tool axis is led, where a rewind interrupts a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from postproc.reference.moves import Moves
from toolpaths.arrays import Array, Bools, Floats, Ints, as_slice, repeated, shared
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays, rows_of
from toolpaths.toolpath import Arcs, Kind


@dataclass(frozen=True)
@arrays(origin="R", u0="R", u1="R", rewind="R")
class Refined:
    """Moves (R) of which number k is part u0..u1 (R,) of the move `origin` (R,) of the CL file.

    Attributes:
        moves: their links are those of the CL file and the returns to a pose after a rewind
        rewind: (R,) True for the latter
    """

    moves: Moves
    origin: Ints
    u0: Floats
    u1: Floats
    rewind: Bools

    def begins(self, begin: Ints, count: int) -> Ints:
        """(M + 1,) `begin` (R + 1,) of the parts as that of the moves: where the first part of each begins."""
        result = np.empty(count + 1, dtype=np.int64)
        result[count] = begin[-1]
        result[self.origin[::-1]] = begin[:-1][::-1]
        return result

    def among(self, rows: frozenset[int]) -> frozenset[int]:
        """The linked parts that stand for linked moves."""
        linked = np.flatnonzero(self.moves.link & ~self.rewind)
        return frozenset(int(k) for k in linked if int(self.origin[k]) in rows)

    def at(self, part: Ints, u: Floats) -> Floats:
        """Places u (K,) on parts (K,) as places on their moves; NaN stays."""
        u0, u1 = self.u0[part], self.u1[part]
        return np.where(u == 1.0, u1, u0 + u * (u1 - u0))


def cut(moves: Moves, origin: Ints, u0: Floats, u1: Floats, tip: Floats, axis: Floats) -> Refined:
    """Parts u0..u1 (R,) of the moves `origin` (R,), which end at tips and axes (R, 3)."""
    part, of = (u0 > 0.0) | (u1 < 1.0), rows_of(moves, "M", as_slice(origin))
    arc, arcs = _arcs(moves, of.arc, u1 - u0, part)
    parts = replace(of, tip=tip, axis=axis, seconds=shared(of.seconds * (u1 - u0)), link=of.link & (u0 == 0.0), arc=arc,
                    arcs=arcs)
    return Refined(parts, origin, u0, u1, repeated(False, len(origin)))


def _arcs(moves: Moves, arc: Ints, share: Floats, part: Bools) -> tuple[Ints, Arcs]:
    """(index (R,) into the arcs, the arcs) with new ones behind for parts of arcs."""
    rows = np.flatnonzero((arc >= 0) & part)
    if not len(rows):
        return arc, moves.arcs
    old, index = arc[rows], arc.copy()
    index[rows] = len(moves.arcs) + np.arange(len(rows))
    a = moves.arcs
    return index, Arcs(np.concatenate([a.center, a.center[old]]), np.concatenate([a.normal, a.normal[old]]),
                       np.concatenate([a.radius, a.radius[old]]), np.concatenate([a.sweep, a.sweep[old] * share[rows]]))


def with_rewinds(refined: Refined, rows: Ints, cuts: Bools, feed: float | None) -> Refined:
    """The same with a linked row after each of `rows` (K,), at the same pose: the return to it after a rewind.

    Args:
        cuts: (K,) True where the tool cuts there: it comes back at a feed
        feed: mm/s of that; None: that of the move that follows
    """
    if not len(rows):
        return refined
    order = np.sort(np.concatenate([np.arange(len(refined.origin)), rows]), kind="stable")
    new = np.append(False, np.diff(order) == 0)
    moves, behind = refined.moves, rows + 1
    served = order + new
    before, after = rows_of(moves, "M", order), rows_of(moves, "M", served)
    feeds = np.where(cuts, _feeds(moves, behind) if feed is None else feed, np.nan)
    with_new = replace(
        before, kind=_put(before.kind, new, np.where(cuts, Kind.FEED, Kind.RAPID)), link=before.link | new,
        arc=_put(before.arc, new, -1), feed=_put(before.feed, new, feeds), seconds=_put(before.seconds, new, np.nan),
        row=after.row, hole=after.hole, phase=after.phase, cycle=after.cycle, line=after.line)
    u0 = refined.u0[served]
    return Refined(with_new, refined.origin[served], u0, np.where(new, u0, refined.u1[order]),
                   refined.rewind[order] | new)


def _put(values: Array, rows: Bools, given: npt.ArrayLike) -> Array:
    """A copy of a column with other values in some rows."""
    result = values.copy()
    result[rows] = given
    return result


def _feeds(moves: Moves, rows: Ints) -> Floats:
    """Tip feeds (K,) mm/s of moves, also of those given by their time."""
    travel = moves.curves().take(rows).length()
    return np.where(moves.feed[rows] > 0.0, moves.feed[rows], travel / moves.seconds[rows])
