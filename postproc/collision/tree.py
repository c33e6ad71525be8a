"""Boxes round boxes: a complete binary tree over items in order, the children of node k are 2 k + 1 and 2 k + 2."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_BITS = 16
"""of each coordinate in the order along the Z curve"""


@dataclass(frozen=True)
@arrays(centre="L 3", half="L 3")
class Tree:
    """Boxes of 2 L - 1 nodes over `count` <= L items: item i is node L - 1 + i.

    Attributes:
        centre, half (2 L - 1, 3): mm; half is negative where a node holds nothing
    """

    centre: Floats
    half: Floats
    count: int

    @property
    def leaves(self) -> int:
        """L, a power of two"""
        return (len(self.centre) + 1) // 2


def tree(low: Floats, high: Floats) -> Tree:
    """The tree over boxes (N, 3), N > 0."""
    leaves = 1 << int(len(low) - 1).bit_length()
    empty = np.full((leaves - len(low), 3), np.inf)
    lows, highs = [np.concatenate((low, empty))], [np.concatenate((high, -empty))]
    while len(lows[-1]) > 1:
        lows.append(np.minimum(lows[-1][0::2], lows[-1][1::2]))
        highs.append(np.maximum(highs[-1][0::2], highs[-1][1::2]))
    bottom, top = np.concatenate(lows[::-1]), np.concatenate(highs[::-1])
    held = (bottom <= top).all(axis=1, keepdims=True)
    bottom, top = np.where(held, bottom, 0.0), np.where(held, top, 0.0)
    return Tree(0.5 * (bottom + top), np.where(held, 0.5 * (top - bottom), -1.0), len(low))


def z_order(points: Floats) -> Ints:
    """Numbers (N,) of points (N, 3) in an order that keeps near ones together (Morton 1966)."""
    low = points.min(axis=0)
    size = max(float((points.max(axis=0) - low).max()), 1e-300)
    cells = ((points - low) / size * (2**_BITS - 1)).astype(np.int64)
    code = np.zeros(len(points), dtype=np.int64)
    for bit in range(_BITS):
        for column in range(3):
            code |= ((cells[:, column] >> bit) & 1) << (3 * bit + column)
    return np.argsort(code, kind="stable")
