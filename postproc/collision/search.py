"""How near a moving tool comes to a solid: least signed distance over the whole path, by proved lower bounds.

Two trees of boxes, round the triangles and round the pieces of the path, are gone through together. Over a
pair of boxes the body's normal n at their middles bounds the distance from below (see `revolution`); so does
the mean normal of the surface in the box, or the triangle's own. A pair whose bound is not below the least
distance found so far is done with; others are split, in the end the triangle and the piece themselves. What
is left over is proved, not sampled: where nothing is found, the distance is nowhere on the path, between its
    points and between the corners of the mesh too, less
than the limit by more than `EXACT`.
"""

from __future__ import annotations

import numpy as np

from postproc.collision.revolution import around, bend, lever, middle, raised, support
from postproc.collision.solid import TriangleSolid
from postproc.collision.swept import TURN, Swept
from toolpaths.arrays import Floats, Ints
from toolpaths.compiled import compiled, wanted
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

EXACT = 1e-3
"""mm"""
PART = 0.01
"""of what is missing to the limit, where something is"""
EFFORT, EACH = 100_000, (300, 10_000)
"""cells, in all and of one triangle next to one piece of the path (in two rounds), that are looked at once something is too
near, to learn by how much: the distance reported is one that is had"""
_LONG = 500
"""pieces of a path, from which on loops are compiled"""
_BATCH = 4096
_SMALL = 1e-5
"""mm: smaller cells are not split"""


@dataclass(frozen=True)
class Nearest:
    """Least distance, mm, negative where the tool reaches into the solid; `limit` where nothing is nearer than that.

    `piece` of the tool, `place` on the path (-1: nothing is nearer than the limit), `point` (3,) of the solid.
    """

    distance: float
    piece: int = -1
    place: int = -1
    point: tuple[float, float, float] = (np.nan, np.nan, np.nan)


def nearest(body: TriangleSolid, travel: Swept, pieces: Floats, limit: float) -> Nearest:
    """What of a tool's `pieces` (P, 5) comes nearest to a body, where that is less than `limit` mm."""
    if wanted(len(travel), _LONG):
        return _compiled(body, travel, pieces, limit)
    best = Nearest(limit)
    for number, piece in enumerate(pieces):
        for each in EACH:
            run = _Search(body, travel, piece, number, best, limit, each)
            best = run.run()
            if not run.cut:
                break
    return best


def _compiled(body: TriangleSolid, travel: Swept, pieces: Floats, limit: float) -> Nearest:
    """The same by the loops of `kernel`."""
    from postproc.collision import kernel

    run = compiled(kernel.search)
    (solid_nodes, corners), size = body.packed, np.zeros(3)
    out, which = np.array([limit, -1.0, np.nan, np.nan, np.nan, 0.0, 0.0]), -1
    for number, piece in enumerate(pieces):
        before, high = float(out[0]), raised(piece, middle(piece))
        size[:] = lever(high), bend(piece), lever(piece)
        out[5] = 0.0
        for each in EACH:
            out[6] = 0.0
            run(piece, high, size, solid_nodes, corners, body.normal, travel.packed(middle(piece)), travel.poses, limit,
                np.array([EXACT, PART, EFFORT, each]), out)
            if not out[6]:
                break
        which = number if out[0] < before else which
    x, y, z = out[2:5].tolist()
    return Nearest(float(out[0]), which, int(out[1]), (x, y, z))


class _Search:
    """One piece of the tool; `best` is what was found so far."""

    def __init__(self, body: TriangleSolid, travel: Swept, piece: Floats, number: int, best: Nearest, limit: float,
                 each: int) -> None:
        self.body, self.travel, self.piece, self.number, self.best, self.limit = body, travel, piece, number, best, limit
        self.high, self.nodes = raised(piece, middle(piece)), travel.tree_at(middle(piece))
        self.lever, self.looked, self.each, self.cut = lever(self.high), 0, each, False
        self.body_first, self.path_first = body.tree.leaves - 1, travel.tree.leaves - 1

    @property
    def enough(self) -> float:
        """mm: pairs with a bound of this or more do not matter."""
        if self.looked > EFFORT:
            return -np.inf
        return self.best.distance - max(EXACT, PART * (self.limit - self.best.distance))

    def run(self) -> Nearest:
        """Best first, in batches."""
        pairs = np.zeros((1, 2), dtype=np.int64)
        bound = self._bound(pairs)
        while len(pairs):
            pairs, bound, batch = _next(pairs, bound, self.enough)
            leaf = (batch[:, 0] >= self.body_first) & (batch[:, 1] >= self.path_first)
            if leaf.any():
                self._cells(batch[leaf] - (self.body_first, self.path_first))
            more = self._split(batch[~leaf])
            pairs, bound = np.concatenate((pairs, more)), np.concatenate((bound, self._bound(more)))
        return self.best

    def _bound(self, pairs: Ints) -> Floats:
        """Bounds (N,) over pairs (N, 2) of nodes of the solid and of the path: by the tool's normal between
        the middles, and by the mean normal of the solid's surface there."""
        axes, chord = self.travel.axes
        body, travel, (k, m) = self.body.tree, self.nodes, pairs.T
        flat, low, high = (of_node[k] for of_node in self.body.slabs)
        distance, n = around(self.high, body.centre[k] - travel.centre[m], axes[m])
        height, share = np.einsum("ni,ni->n", body.centre[k], flat), np.einsum("ni,ni->n", n, flat)
        thick = np.abs(share) * np.maximum(high - height, height - low)
        thick += np.sqrt(np.maximum(1.0 - share**2, 0.0)) * np.linalg.norm(body.half[k], axis=1)
        adjacent = distance - np.minimum((np.abs(n) * body.half[k]).sum(axis=1),
                                         thick) - (np.abs(n) * travel.half[m]).sum(axis=1)
        above = (np.einsum("ni,ni->n", travel.centre[m], flat) - (np.abs(flat) * travel.half[m]).sum(axis=1) - high
                 - support(self.high, -np.einsum("ni,ni->n", axes[m], flat)))
        return np.asarray(np.maximum(adjacent, above) - self.lever * chord[m])

    def _split(self, pairs: Ints) -> Ints:
        """Children of pairs (N, 2), the larger of the two nodes split; those that hold nothing are left out."""
        body, travel, (k, m) = self.body.tree.half, self.nodes.half, pairs.T
        size = travel[m].sum(axis=1) + self.lever * self.travel.axes[1][m]
        first = (m >= self.path_first) | ((k < self.body_first) & (body[k].sum(axis=1) >= size))
        one = pairs.copy()
        one[first, 0] = 2 * k[first] + 1
        one[~first, 1] = 2 * m[~first] + 1
        other = one.copy()
        other[first, 0] += 1
        other[~first, 1] += 1
        both = np.concatenate((one, other))
        return np.asarray(both[(body[both[:, 0], 0] >= 0.0) & (travel[both[:, 1], 0] >= 0.0)])

    def _cells(self, pairs: Ints) -> None:
        """Triangles and pieces of the path themselves, halved until the least distance is known."""
        cells = _Cells.of(self.body, self.travel, pairs)
        bound, most = self._look(cells), self.looked + self.each * len(pairs)
        while self.looked <= most:
            keep = bound < self.enough
            cells, bound = cells.take(keep), bound[keep]
            if not len(bound):
                return
            order = np.argsort(bound, kind="stable")
            now, later = order[:_BATCH], order[_BATCH:]
            halves = cells.take(now).halved(lever(self.piece))
            cells, bound = halves.and_also(cells.take(later)), np.concatenate((self._look(halves), bound[later]))
        self.cut = True

    def _look(self, cells: _Cells) -> Floats:
        """Bounds (N,); the distance in the middle of each cell is one that is had."""
        point, tip, axis = cells.middles()
        distance, normal = around(self.piece, point - tip, axis)
        bound = np.maximum(cells.apart(normal, self.piece), cells.apart(-cells.normal, self.piece))
        self.looked += len(distance) if self.best.distance < self.limit else 0
        k = int(distance.argmin()) if len(distance) else 0
        if len(distance) and distance[k] < self.best.distance:
            x, y, z = point[k].tolist()
            self.best = Nearest(float(distance[k]), self.number, int(cells.place[k]), (x, y, z))
        return np.where(cells.size(lever(self.piece)) > _SMALL, bound, np.inf)


def _next(pairs: Ints, bound: Floats, enough: float) -> tuple[Ints, Floats, Ints]:
    """(pairs that stay, their bounds, the batch to be looked at): those that cannot matter are dropped."""
    keep = bound < enough
    pairs, bound = pairs[keep], bound[keep]
    if len(pairs) <= _BATCH:
        return pairs[:0], bound[:0], pairs
    order = np.argpartition(bound, _BATCH)
    return pairs[order[_BATCH:]], bound[order[_BATCH:]], pairs[order[:_BATCH]]


@dataclass(frozen=True)
@arrays(corners="N 3 3", normal="N 3", tip="N 2 3", axis="N 2 3", place="N")
class _Cells:
    """N pairs of a part of a triangle (N, 3, 3) with its normal and a part of a piece: tips and axes (N, 2, 3).

    `place` (N,) on the path.
    """

    corners: Floats
    normal: Floats
    tip: Floats
    axis: Floats
    place: Ints

    @classmethod
    def of(cls, body: TriangleSolid, travel: Swept, pairs: Ints) -> _Cells:
        k, m = pairs.T
        return cls(body.corners[k], body.normal[k], travel.tip[m], travel.axis[m], m)

    def take(self, which: Ints | np.ndarray[tuple[int], np.dtype[np.bool_]]) -> _Cells:
        return _Cells(*(getattr(self, name)[which] for name in self.__dataclass_fields__))

    def and_also(self, other: _Cells) -> _Cells:
        return _Cells(*(np.concatenate((getattr(self, name), getattr(other, name))) for name in self.__dataclass_fields__))

    def middles(self) -> tuple[Floats, Floats, Floats]:
        """Middle of the triangle, tip and axis (N, 3) in the middle of the piece."""
        total = self.axis.sum(axis=1)
        return self.corners.mean(axis=1), self.tip.mean(axis=1), total / np.linalg.norm(total, axis=1, keepdims=True)

    def apart(self, n: Floats, piece: Floats) -> Floats:
        """Bounds (N,) mm by planes with the normals n (N, 3): the triangle's corners on one side, the tool on the other.

        How far the tool reaches along n, tip and axis moving evenly, is nowhere more than at the ends of the
        path by more than `bend` theta^2 / 8: its second derivative is no less than -bend theta^2 (|n x a|'' >= -|n x a|).
        """
        corner = np.einsum("nki,ni->nk", self.corners, n).min(axis=1)
        reach = np.stack([np.einsum("ni,ni->n", self.tip[:, k], n)
                          + support(piece, np.einsum("ni,ni->n", self.axis[:, k], n)) for k in (0, 1)])
        chord = np.linalg.norm(self.axis[:, 1] - self.axis[:, 0], axis=1)
        return np.asarray(corner - reach.max(axis=0) - TURN * bend(piece) * chord**2 / 8.0)

    def size(self, reach: float) -> Floats:
        """mm (N,): the larger of the triangle's longest edge and the path."""
        return np.asarray(np.maximum(self._edges().max(axis=1), self._travel(reach)))

    def _edges(self) -> Floats:
        return np.asarray(np.linalg.norm(self.corners - np.roll(self.corners, -1, axis=1), axis=2))

    def _travel(self, reach: float) -> Floats:
        step = np.linalg.norm(self.tip[:, 1] - self.tip[:, 0], axis=1)
        return np.asarray(step + reach * np.linalg.norm(self.axis[:, 1] - self.axis[:, 0], axis=1))

    def halved(self, reach: float) -> _Cells:
        """Both halves of each: the triangle by its longest edge, or the path in its middle."""
        edges = self._edges()
        longest = edges.argmax(axis=1)
        by_edge = edges.max(axis=1) >= self._travel(reach)
        n, rows = len(edges), np.flatnonzero(by_edge)
        corners, tip, axis = (np.concatenate((a, a)) for a in (self.corners, self.tip, self.axis))
        a, b = longest[rows], (longest[rows] + 1) % 3
        middle = 0.5 * (self.corners[rows, a] + self.corners[rows, b])
        corners[rows, b], corners[n + rows, a] = middle, middle
        rows = np.flatnonzero(~by_edge)
        half, total = self.tip[rows].mean(axis=1), self.axis[rows].sum(axis=1)
        turned = total / np.linalg.norm(total, axis=1, keepdims=True)
        tip[rows, 1], tip[n + rows, 0] = half, half
        axis[rows, 1], axis[n + rows, 0] = turned, turned
        return _Cells(corners, np.concatenate((self.normal, self.normal)), tip, axis,
                      np.concatenate((self.place, self.place)))
