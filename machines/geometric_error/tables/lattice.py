"""Error map: displacement of a point of the tool and turn of the tool on a lattice, as controls hold it.

Coordinates of the lattice are joints (upper-case letters: X Y Z A B C) or the point in the table frame (x y
z), any number of them; between the nodes the values are linear in each coordinate, and a rotary axis may go
round. A map is applied
after the nominal motion: the point displaced by (dx, dy, dz), the tool turned about it by the rotation vector (rx, ry,
rz), exactly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Self

import numpy as np

from machines.kinematics.chain import ROTARY
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

COLUMNS = ("dx", "dy", "dz", "rx", "ry", "rz")
POINT = "xyz"


@dataclass(frozen=True, eq=False)
@arrays(nodes="* _", table="##nodes 6")
class ErrorMap:
    """Values on a full lattice.

    Attributes:
        letters: D coordinates, e.g. ("X", "Y", "Z")
        nodes: ascending positions along each, mm or rad; of one that goes round within one period, its end left out
        table: (n1, n2, ..., 6) mm and rad
        periods: (D,) mm or rad after which a coordinate repeats, 0 where it does not; () for none
        length: mm from the gauge point along the tool to the point that is displaced: 0 the gauge point, the
            length of the tool that was measured with its tip
        bed: rotary axes between the part and the bed, from the part on: their turns take directions of the
            machine into those of the table, and the values are along and about the machine's; () where they are the table's
    """

    letters: tuple[str, ...]
    nodes: tuple[Floats, ...]
    table: Floats
    periods: tuple[float, ...] = ()
    length: float = 0.0
    bed: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "periods", self.periods or (0.0,) * len(self.nodes))

    @property
    def names(self) -> list[str]:
        """node[i,j,k].dx ..."""
        return [f"node[{','.join(map(str, at))}].{column}" for at in np.ndindex(*map(len, self.nodes))
                for column in COLUMNS]

    @property
    def values(self) -> Floats:
        """(P,) all of the table."""
        return self.table.ravel()

    def with_values(self, values: Floats) -> Self:
        """The same lattice with other values (P,)."""
        return replace(self, table=np.asarray(values, dtype=np.float64).reshape(self.table.shape))

    def places(self) -> Floats:
        """Coordinates (M, D) of all nodes, in the order of the table."""
        return np.stack([m.ravel() for m in np.meshgrid(*self.nodes, indexing="ij")], axis=1)

    def described(self, node: int) -> str:
        """Where a node (its row in `places`) is, for messages: X 100, C 30."""
        at = np.unravel_index(node, tuple(map(len, self.nodes)))
        return ", ".join(f"{x} {nodes[i] / (DEG if x in ROTARY else 1.0):g}"
                         for x, nodes, i in zip(self.letters, self.nodes, at, strict=True))

    @property
    def most(self) -> tuple[float, float]:
        """Bounds of displacement (mm) and turn (rad) anywhere: values between nodes lie between theirs."""
        parts = self.table.reshape(-1, 6)
        return float(np.linalg.norm(parts[:, :3], axis=1).max()), float(np.linalg.norm(parts[:, 3:], axis=1).max())

    @property
    def steepest(self) -> list[tuple[float, float]]:
        """By coordinate, bounds of how fast displacement and turn change along it: as between neighbouring nodes."""
        found = []
        for d, (nodes, period) in enumerate(self.closed()):
            table = np.moveaxis(self.table, d, 0)
            table = np.concatenate([table, table[:1]]) if period else table
            if len(nodes) < 2:
                found.append((0.0, 0.0))
                continue
            slope = (np.diff(table, axis=0).reshape(len(nodes) - 1, -1, 6) / np.diff(nodes)[:, None, None]).reshape(-1, 6)
            shift, turn = (float(np.linalg.norm(part, axis=1).max()) for part in (slope[:, :3], slope[:, 3:]))
            found.append((shift, turn))
        return found

    def closed(self) -> Iterator[tuple[Floats, float]]:
        """(nodes, period) of each coordinate, the first node of one that goes round repeated at the end of its period."""
        for nodes, period in zip(self.nodes, self.periods, strict=True):
            yield (np.append(nodes, nodes[0] + period) if period else nodes), period

    def weights(self, places: Floats) -> tuple[Ints, Floats]:
        """(node (N, 2^D), weight (N, 2^D)) of places (N, D); outside, the nearest place of the lattice."""
        at, share = [], []
        for x, (nodes, period), own in zip(places.T, self.closed(), self.nodes, strict=True):
            inside = nodes[0] + np.mod(x - nodes[0], period) if period else x
            low = np.clip(np.searchsorted(nodes, inside, side="right") - 1, 0, max(len(nodes) - 2, 0))
            high = np.minimum(low + 1, len(nodes) - 1)
            span = np.where(high > low, nodes[high] - nodes[low], 1.0)
            at.append((low, high % len(own)))
            share.append(np.clip((inside - nodes[low]) / span, 0.0, 1.0))
        shape, node, weight = tuple(map(len, self.nodes)), [], []
        for corner in product((0, 1), repeat=len(self.nodes)):
            node.append(np.ravel_multi_index([pair[side] for pair, side in zip(at, corner, strict=True)], shape))
            weight.append(np.prod([s if side else 1.0 - s for s, side in zip(share, corner, strict=True)], axis=0))
        return np.stack(node, axis=1), np.stack(weight, axis=1)

    def at(self, places: Floats) -> Floats:
        """(N, 6) at places (N, D)."""
        node, weight = self.weights(places)
        flat = self.table.reshape(-1, 6)
        result = np.zeros((len(places), 6))
        for k in range(node.shape[1]):
            result += weight[:, k, None] * flat[node[:, k]]
        return result

    def outside(self, places: Floats, margin: float) -> Bools:
        """True (N, D) where a coordinate lies outside the lattice by more than `margin`."""
        low, high = (np.array([nodes[end] for nodes in self.nodes]) for end in (0, -1))
        round_about = np.array(self.periods) > 0.0
        result: Bools = ((places < low - margin) | (places > high + margin)) & ~round_about
        return result
