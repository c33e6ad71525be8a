"""Whole splines with equal knots as blocks that state their control points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.cl.spline_chords import DEGREE, de_boor, knots_of
from toolpaths.cl.uniform_splines import equal_knots
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_PLACES = np.arange(DEGREE + 1) / DEGREE
"""of a piece, at which a spline is compared with it"""


def _none(*shape: int) -> Floats:
    return np.zeros(shape)


@dataclass(frozen=True)
@arrays(row="N", point="N 3", moves="bool: N 3", spline="N")
class ControlPolygons:
    """Blocks of a path, `row` (N,), that state control points (N, 3) of splines, their first ones left out; axes (N, 3) that
    they state; number of the spline (N,)."""

    row: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    point: Floats = field(default_factory=lambda: _none(0, 3))
    moves: Bools = field(default_factory=lambda: np.zeros((0, 3), dtype=bool))
    spline: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def numbers(self, blocks: int) -> Ints:
        """(K,) number of the spline of each block, -1 for none."""
        result = np.full(blocks, -1)
        result[self.row] = self.spline
        return result


def control_polygons(begin: Ints, size: Ints, terms: Floats, end: Floats, rounded: Callable[[Floats], Floats],
                     limit: float) -> tuple[ControlPolygons, Bools]:
    """(polygons, blocks (K,) that are not written for them) of cubics that follow each other.

    begin, size (C,): first block and number of blocks of each; terms (C, 3, 4): its coefficients; end (K, 3): words of
    blocks; limit: mm that control points may be off what the pieces say before they are rounded; splines that are
    further off, of which a piece is missing, say, are none.
    """
    dropped = np.zeros(len(end), dtype=bool)
    breaks = np.flatnonzero(begin[1:] != (begin + size)[:-1]) + 1
    rows, points, moves, number = list[Ints](), list[Floats](), list[Bools](), list[Ints]()
    for first, last in zip(np.append(0, breaks), np.append(breaks, len(begin)), strict=True):
        pieces = terms[first:last]
        control = _control_of(pieces)
        if _off(control, pieces) > limit or not begin[first]:
            continue
        start, stop = int(begin[first]), int(begin[last - 1] + size[last - 1])
        at, polygon = np.arange(stop - len(control) + 1, stop), rounded(control)
        polygon[-1] = end[stop - 1]
        dropped[start:stop - len(control) + 1] = True
        rows.append(at)
        points.append(polygon[1:])
        moved = (polygon != end[start - 1]).any(axis=0)
        moves.append(np.broadcast_to(moved, (len(at), 3)))
        number.append(np.full(len(at), len(rows) - 1))
    if not rows:
        return ControlPolygons(), dropped
    return ControlPolygons(np.concatenate(rows), np.concatenate(points), np.concatenate(moves),
                           np.concatenate(number)), dropped


def _control_of(terms: Floats) -> Floats:
    """Control points (m + 3, 3) of m pieces (m, 3, 4) of a clamped cubic whose knots are the numbers of the pieces: blossoms
    at three knots that follow each other (Ramshaw, Blossoming, 1987), each of a piece that has them near."""
    pieces = len(terms)
    knots = knots_of(equal_knots(pieces)) * pieces
    which = np.arange(pieces + DEGREE)
    piece = np.clip(which - 2, 0, pieces - 1)
    u, v, w = (knots[which + k] - piece for k in (1, 2, 3))
    powers = np.stack([np.ones(len(which)), (u + v + w) / 3.0, (u * v + v * w + w * u) / 3.0, u * v * w], axis=1)
    result: Floats = np.einsum("nkp,np->nk", terms[piece], powers)
    return result


def _off(control: Floats, terms: Floats) -> float:
    """mm that a spline is off its pieces at most, at four places of each: differences of cubics vanish with those."""
    pieces = len(terms)
    at = (np.arange(pieces)[:, None] + _PLACES).ravel() / pieces
    said = np.einsum("mkp,qp->mqk", terms, _PLACES[:, None] ** np.arange(DEGREE + 1)).reshape(-1, 3)
    return float(np.abs(de_boor(control, knots_of(equal_knots(pieces)), at, DEGREE) - said).max())
