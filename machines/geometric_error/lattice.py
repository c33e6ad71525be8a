"""Error map: displacement of the gauge point and turn of the tool on a lattice, as controls hold it.

Coordinates of the lattice are joints (upper-case letters: X Y Z A B C) or the gauge point in the table frame (x y z), any
number of them; between the nodes the values are linear in each coordinate. A map is applied after the nominal motion:
gauge point displaced by (dx, dy, dz), tool turned by the rotation vector (rx, ry, rz), all in the table frame, exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from typing import Self

import numpy as np

from machines.geometric_error.actual import Actual, Placed
from machines.kinematics.base import Kinematics
from toolpaths.arrays import Bools, Floats, frozen

COLUMNS = ("dx", "dy", "dz", "rx", "ry", "rz")
GAUGE = "xyz"


@dataclass(frozen=True, eq=False)
class ErrorMap:
    """Values on a full lattice.

    Attributes:
        letters: coordinates, e.g. ("X", "Y", "Z")
        nodes: ascending positions along each, mm or rad
        table: (n1, n2, ..., 6) mm and rad
    """

    letters: tuple[str, ...]
    nodes: tuple[Floats, ...]
    table: Floats

    def __post_init__(self) -> None:
        nodes = tuple(frozen(x, np.float64, (-1,), "ErrorMap.nodes") for x in self.nodes)
        object.__setattr__(self, "nodes", nodes)
        object.__setattr__(self, "table", frozen(self.table, np.float64, (*map(len, nodes), 6), "ErrorMap.table"))

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

    def weights(self, places: Floats) -> tuple[Floats, Floats]:
        """(node (N, 2^D), weight (N, 2^D)) of places (N, D); outside, the nearest place of the lattice."""
        at, share = [], []
        for x, nodes in zip(places.T, self.nodes, strict=True):
            low = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, max(len(nodes) - 2, 0))
            high = np.minimum(low + 1, len(nodes) - 1)
            span = np.where(high > low, nodes[high] - nodes[low], 1.0)
            at.append((low, high))
            share.append(np.clip((x - nodes[low]) / span, 0.0, 1.0))
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
        result: Bools = (places < low - margin) | (places > high + margin)
        return result


@dataclass(frozen=True, eq=False)
class ActualByMap(Actual):
    """A machine with an error map; `nominal` gives its coordinates (a model with no errors)."""

    nominal: Actual
    map: ErrorMap

    @property
    def kinematics(self) -> Kinematics:  # type: ignore[override]
        """Of the nominal machine."""
        return self.nominal.kinematics

    @property
    def turns(self) -> int:  # type: ignore[override]
        """Of the nominal machine."""
        return self.nominal.turns

    def coordinates(self, q: Floats, near: Floats | None = None) -> Floats:
        """See the base class."""
        return self.nominal.coordinates(q, near)

    def joints(self, w: Floats) -> Floats:
        """See the base class."""
        return self.nominal.joints(w)

    def rates(self, w: Floats) -> Floats:
        """See the base class."""
        return self.nominal.rates(w)

    def lattice_places(self, w: Floats) -> Floats:
        """Coordinates of the lattice (N, D)."""
        tip, axis, _ = self.nominal.place(w)
        gauge = tip + self.kinematics.tool_length * axis
        q, names = self.joints(w), self.kinematics.axis_names
        return np.stack([gauge[:, GAUGE.index(letter)] if letter in GAUGE else q[:, names.index(letter)]
                         for letter in self.map.letters], axis=1)

    def place(self, w: Floats, direction: Floats | None = None) -> Placed:
        """See the base class."""
        tip, axis, side = self.nominal.place(w)
        error = self.map.at(self.lattice_places(w))
        arm = -self.kinematics.tool_length * axis
        return (tip + error[:, :3] + (spun(arm, error[:, 3:]) - arm), spun(axis, error[:, 3:]), spun(side, error[:, 3:]))

    def sensitivity(self, w: Floats, direction: Floats | None = None) -> Floats:
        """See the base class."""
        _, axis, _ = self.nominal.place(w)
        arm = -self.kinematics.tool_length * axis
        node, weight = self.map.weights(self.lattice_places(w))
        result = np.zeros((len(w), 6, len(self.map.values) // 6, 6))
        rows = np.arange(len(w))
        for k in range(node.shape[1]):
            for part in range(6):
                result[rows, part, node[:, k], part] += weight[:, k]
            for part in range(3):
                turned = np.cross(np.eye(3)[part], arm)
                result[rows, :3, node[:, k], 3 + part] += weight[:, k, None] * turned
        return result.reshape(len(w), 6, -1)

    def outside(self, w: Floats, margin: float = 0.0) -> Bools:
        """See the base class; a coordinate of the gauge point counts for every slide."""
        found = self.map.outside(self.lattice_places(w), margin)
        names, rotary = self.kinematics.axis_names, np.array(self.kinematics.rotary)
        result = np.zeros((len(w), len(names)), dtype=np.bool_)
        for letter, column in zip(self.map.letters, found.T, strict=True):
            if letter in GAUGE:
                result |= column[:, None] & ~rotary
            else:
                result[:, names.index(letter)] |= column
        return result


def spun(v: Floats, by: Floats) -> Floats:
    """Vectors (N, 3) turned by rotation vectors (N, 3) (Rodrigues); a zero vector leaves them to the last digit."""
    angle = np.linalg.norm(by, axis=1)
    safe = np.where(angle > 0.0, angle, 1.0)
    half = np.sin(0.5 * angle) / safe
    across = np.cross(by, v)
    result: Floats = v + (np.where(angle > 0.0, np.sin(angle) / safe, 1.0)[:, None] * across
                          + (2.0 * half**2)[:, None] * np.cross(by, across))
    return result


def rotation_vector(before: tuple[Floats, Floats], after: tuple[Floats, Floats]) -> Floats:
    """Rotation vectors (N, 3) of the small turn that takes (axis, x), each (N, 3), from `before` to `after`."""
    one, two = (np.stack([x, np.cross(axis, x), axis], axis=2) for axis, x in (before, after))
    turn = two @ np.swapaxes(one, 1, 2)
    pairs = ((2, 1), (0, 2), (1, 0))
    sine = 0.5 * np.stack([turn[:, i, j] - turn[:, j, i] for i, j in pairs], axis=1)
    size = np.linalg.norm(sine, axis=1)
    angle = np.arctan2(size, 0.5 * (np.trace(turn, axis1=1, axis2=2) - 1.0))
    result: Floats = sine * np.where(size > 0.0, angle / np.where(size > 0.0, size, 1.0), 1.0)[:, None]
    return result


def map_of(actual: Actual, nominal: Actual, letters: tuple[str, ...], nodes: tuple[Floats, ...],
           fixed: Floats) -> ErrorMap:
    """The map of a model over a lattice of joints, or of places of the platform of a parallel machine.

    Args:
        actual, nominal: the machine with and without errors, at the gauge point (tool length 0)
        letters, nodes: as in `ErrorMap`
        fixed: (3 + R,) coordinates `w` that the lattice does not name
    """
    mesh = np.stack([m.ravel() for m in np.meshgrid(*nodes, indexing="ij")], axis=1)
    w = np.tile(fixed, (len(mesh), 1))
    for letter, column in zip(letters, mesh.T, strict=True):
        w[:, GAUGE.index(letter) if letter in GAUGE else actual.kinematics.axis_names.index(letter)] = column
    table = deviations(actual, nominal, w)
    return ErrorMap(letters, nodes, table.reshape(*map(len, nodes), 6))


def deviations(actual: Actual, nominal: Actual, w: Floats) -> Floats:
    """Exact displacement of the tip and turn of the tool (N, 6) from the nominal machine."""
    t0, a0, x0 = nominal.place(w)
    t1, a1, x1 = actual.place(w)
    return np.concatenate([t1 - t0, rotation_vector((a0, x0), (a1, x1))], axis=1)


@dataclass(frozen=True)
class MapLoss:
    """What a map loses against its model: worst and root mean square, mm and rad."""

    tip_worst: float
    tip_rms: float
    axis_worst: float
    axis_rms: float


def map_loss(by_map: ActualByMap, actual: Actual, w: Floats) -> MapLoss:
    """Map against model at places w (N, 3 + R)."""
    t0, a0, _ = actual.place(w)
    t1, a1, _ = by_map.place(w)
    tip, axis = np.linalg.norm(t1 - t0, axis=1), 2.0 * np.arcsin(0.5 * np.linalg.norm(a1 - a0, axis=1))
    return MapLoss(float(tip.max()), float(np.sqrt(np.mean(tip**2))), float(axis.max()), float(np.sqrt(np.mean(axis**2))))


