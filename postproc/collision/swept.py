"""The path of a tool as short pieces: tips straight, axes on great circles, nowhere off the true path by more than OFF."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from postproc.collision.tree import Tree, tree
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shape import Curves
from toolpaths.shapes import arrays

OFF = 2e-3
"""mm that a point of a tool may be off its true place by what pieces leave out"""
TURN = 2.5
"""(theta / chord)^2 of the longest turn, half a circle"""
_KEPT = 1_000_000
"""pieces whose boxes are kept"""


@dataclass(frozen=True)
@arrays(tip="N 2 3", axis="N 2 3", row="N")
class Swept:
    """N pieces in the table frame, in order.

    Attributes:
        tip (N, 2, 3), axis (N, 2, 3): at both ends; unit axes
        row (N,): what the piece belongs to
    """

    tip: Floats
    axis: Floats
    row: Ints

    def __len__(self) -> int:
        return len(self.tip)

    def take(self, which: Ints) -> Swept:
        """Some of the pieces."""
        return Swept(self.tip[which], self.axis[which], self.row[which])

    def turned(self, shift: Floats, axis: Floats) -> Swept:
        """The same pieces moved by `shift` (3,), the tool along `axis` (3,); the tree moves with them."""
        made = replace(self, tip=self.tip + shift, axis=np.broadcast_to(axis, self.axis.shape).copy())
        made.__dict__["tree"] = replace(self.tree, centre=self.tree.centre + shift)
        return made

    @cached_property
    def tree(self) -> Tree:
        """Boxes round the tips."""
        return tree(self.tip.min(axis=1), self.tip.max(axis=1))

    def tree_at(self, height: float) -> Tree:
        """Boxes round the points of the axis `height` mm over the tips: where a tool turns about them, not about its tip.

        On the path from end to end such a point leaves its straight line by no more than height theta^2 / 8.
        """
        chord = np.linalg.norm(self.axis[:, 1] - self.axis[:, 0], axis=1)
        if height == 0.0 or not self.turns:
            moved = self.axis[0, 0] * height
            return self.tree if height == 0.0 else replace(self.tree, centre=self.tree.centre + moved)
        point, off = self.tip + height * self.axis, (TURN * abs(height) / 8.0 * chord**2)[:, None]
        return tree(point.min(axis=1) - off, point.max(axis=1) + off)

    @property
    def turns(self) -> bool:
        """True where the tool is not along one and the same axis everywhere."""
        return bool((self.axis != self.axis[0, 0]).any())

    @cached_property
    def axes(self) -> tuple[Floats, Floats]:
        """Per node of the tree a unit axis (2 L - 1, 3), and the largest chord (2 L - 1,) from it to an axis within."""
        leaves, n = self.tree.leaves, len(self)
        middle = np.zeros((leaves, 3))
        middle[:n] = self.axis.sum(axis=1)
        middle[:n] /= np.linalg.norm(middle[:n], axis=1, keepdims=True)
        off = np.zeros(leaves)
        off[:n] = np.linalg.norm(self.axis[:, 0] - middle[:n], axis=1)
        middles, chords = [middle], [off]
        while len(middles[-1]) > 1:
            middle, off = _joined(middles[-1], chords[-1])
            middles.append(middle)
            chords.append(off)
        return np.concatenate(middles[::-1]), np.concatenate(chords[::-1])

    def packed(self, height: float) -> Floats:
        """Nodes (2 L - 1, 10) of `tree_at`: centre, half, axis, chord; kept, for all bodies are compared with the same."""
        kept: dict[float, Floats] = self.__dict__.setdefault("_packed", {})
        if height not in kept:
            if len(self) * len(kept) > _KEPT:
                kept.clear()
            (axes, chord), nodes = self.axes, self.tree_at(height)
            kept[height] = np.hstack((nodes.centre, nodes.half, axes, chord[:, None]))
        return kept[height]

    @cached_property
    def poses(self) -> Floats:
        """(N, 12): both tips, both axes."""
        return np.hstack((self.tip.reshape(-1, 6), self.axis.reshape(-1, 6)))


def _joined(axis: Floats, off: Floats) -> tuple[Floats, Floats]:
    """Axis and chord of the parents of nodes; nodes without axis hold nothing."""
    pair, total = axis.reshape(-1, 2, 3), axis.reshape(-1, 2, 3).sum(axis=1)
    size = np.linalg.norm(total, axis=1, keepdims=True)
    middle = np.where(size > 1e-9, total / np.where(size > 1e-9, size, 1.0), pair[:, 0])
    chord = np.linalg.norm(pair - middle[:, None], axis=2) + off.reshape(-1, 2)
    held = (pair != 0.0).any(axis=2)
    return middle, np.where(held, chord, 0.0).max(axis=1)


def along_curves(curves: Curves, row: Ints) -> Swept:
    """The pieces of N curves; `row` (N,) says what each belongs to. Arcs are cut so that chords stay within OFF."""
    count = np.ones(len(curves), dtype=np.int64)
    arc = np.flatnonzero(curves.is_arc)
    if len(arc):
        radial = np.cross(curves.start[arc] - curves.center[arc], curves.normal[arc])
        radius = np.maximum(np.linalg.norm(radial, axis=1), 1e-9)
        step = 2.0 * np.arccos(1.0 - np.minimum(OFF / radius, 1.0))
        count[arc] = np.ceil(np.maximum(curves.sweep[arc] / step, 1.0)).astype(np.int64)
    piece = np.repeat(np.arange(len(curves)), count)
    k = np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    each = curves.take(piece)
    (tip0, axis0), (tip1, axis1) = each.at(k / count[piece]), each.at((k + 1) / count[piece])
    return Swept(np.stack((tip0, tip1), axis=1), np.stack((axis0, axis1), axis=1), row[piece])


def joined(parts: list[Swept]) -> Swept:
    """Several as one, in order."""
    return Swept(*(np.concatenate([getattr(part, name) for part in parts])
                   for name in ("tip", "axis", "row")))
