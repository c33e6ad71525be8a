"""From a model to an error map, and what the map loses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from machines.geometric_error.actual.actual import Actual
from machines.geometric_error.actual.actual_map import ActualByMap
from machines.geometric_error.tables.averages import SAME
from machines.geometric_error.tables.lattice import POINT, ErrorMap
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass

STEPS = 8
"""of Newton's method to a node of x y z: the point is an affine function of the slides"""
PROBES = 4000
"""places at which a map is compared with its model"""


def map_of(actual: Actual, nominal: Actual, lattice: ErrorMap, fixed: Floats) -> ErrorMap:
    """The lattice with the values of a model.

    Args:
        actual, nominal: the machine with and without errors, with a tool as long as `lattice.length`
        lattice: letters, nodes, periods and directions; its values do not count
        fixed: (J,) joints that the lattice does not name; where it names x y z, also where they are looked for from

    Raises:
        ValueError: a node is out of the machine's reach, or the tool is of another length.
    """
    by_map = ActualByMap(nominal, lattice)
    if abs(by_map.arm) > SAME:
        raise ValueError(f"the tool is {by_map.kinematics.tool_length:g} mm long, the map's {lattice.length:g}")
    w = nodes_of(by_map, lattice.places(), fixed)
    values = deviations(actual, nominal, w)
    lost = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if len(lost):
        raise ValueError(f"node {lattice.described(int(lost[0]))} is out of reach ({len(lost)} of {len(w)} nodes are)")
    turned = by_map.directions(by_map.joints(w))
    own = [np.einsum("nji,nj->ni", turned, v) for v in (values[:, :3], values[:, 3:])]
    return lattice.with_values(np.concatenate(own, axis=1))


def nodes_of(by_map: ActualByMap, places: Floats, fixed: Floats) -> Floats:
    """Coordinates w (N, 3 + R) of the machine at places (N, D) of its map, the other joints as `fixed` (J,)."""
    letters, names = by_map.map.letters, by_map.kinematics.axis_names
    q = np.tile(fixed, (len(places), 1))
    for letter, column in zip(letters, places.T, strict=True):
        if letter not in POINT:
            q[:, names.index(letter)] = column
    w = by_map.coordinates(q)
    free = [k for k, letter in enumerate(letters) if letter in POINT]
    rows = [POINT.index(letters[k]) for k in free]
    for _ in range(STEPS if free else 0):
        tip, axis, _ = by_map.nominal.place(w)
        gap = places[:, free] - (tip + by_map.arm * axis)[:, rows]
        if not np.nanmax(np.abs(gap), initial=0.0) > SAME * SAME:
            break
        w[:, :3] += np.einsum("nij,nj->ni", np.linalg.pinv(by_map.rates(w)[:, rows, :3]), gap)
    return w


def deviations(actual: Actual, nominal: Actual, w: Floats) -> Floats:
    """Exact displacement of the tip and turn of the tool (N, 6) from the nominal machine."""
    t0, a0, x0 = nominal.place(w)
    t1, a1, x1 = actual.place(w)
    return np.concatenate([t1 - t0, rotation_vector((a0, x0), (a1, x1))], axis=1)


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


@dataclass(frozen=True)
class MapLoss:
    """What a map loses against its model: worst and root mean square, mm and rad."""

    tip_worst: float
    tip_rms: float
    axis_worst: float
    axis_rms: float


def map_loss(by_map: Actual, actual: Actual, w: Floats) -> MapLoss:
    """Map against model at places w (N, 3 + R)."""
    (t0, a0), (t1, a1) = actual.aim(w), by_map.aim(w)
    tip, axis = np.linalg.norm(t1 - t0, axis=1), 2.0 * np.arcsin(0.5 * np.linalg.norm(a1 - a0, axis=1))
    worst = (float(x.max(initial=0.0)) for x in (tip, axis))
    (tip_worst, axis_worst), n = worst, max(len(w), 1)
    return MapLoss(tip_worst, float(np.sqrt(np.sum(tip**2) / n)), axis_worst,
                   float(np.sqrt(np.sum(axis**2) / n)))


def divided(base: ErrorMap, parts: Sequence[int]) -> ErrorMap:
    """The lattice with every cell of coordinate k divided into parts[k]; its values are taken out."""
    nodes = []
    for (closed, period), count in zip(base.closed(), parts, strict=True):
        fine = np.interp(np.arange((len(closed) - 1) * count + 1) / count, np.arange(len(closed)), closed)
        nodes.append(fine[:-1] if period else fine)
    return replace(base, nodes=tuple(nodes), table=np.zeros((*map(len, nodes), 6)))


def probes(lattice: ErrorMap, rng: np.random.Generator) -> Floats:
    """Random places (PROBES, D) inside a lattice."""
    ends = [(nodes[0], nodes[-1]) for nodes, _ in lattice.closed()]
    low, high = np.array(ends).T
    return rng.uniform(low, high, (PROBES, len(ends)))


def refined(actual: Actual, nominal: Actual, base: ErrorMap, fixed: Floats, tolerance: float,
            most: int) -> tuple[ErrorMap, MapLoss]:
    """The map on the coarsest of the lattices that were tried, cells of `base` divided evenly, that loses no
    more than `tolerance` mm at the tip, at places inside it.

    What interpolating along one coordinate alone loses says which one to divide.

    Raises:
        ValueError: it would take more than `most` nodes.
    """
    places, parts = probes(base, np.random.default_rng(0)), [1] * len(base.letters)
    w = nodes_of(ActualByMap(nominal, base), places, fixed)
    wanted = deviations(actual, nominal, w)[:, :3]
    losses = [_along(actual, nominal, base, fixed, places, wanted, k) for k in range(len(parts))]
    while True:
        lattice = divided(base, parts)
        if np.prod([float(len(nodes)) for nodes in lattice.nodes]) > most:
            raise ValueError(f"a loss of {1e3 * tolerance:g} um takes more than {most} nodes: at {_counts(lattice)} it is "
                             f"still about {1e3 * float(np.linalg.norm(losses)):.3g} um; allow more, or fewer coordinates")
        if np.linalg.norm(losses) <= tolerance:
            found = map_of(actual, nominal, lattice, fixed)
            loss = map_loss(ActualByMap(nominal, found), actual, w)
            if loss.tip_worst <= tolerance:
                return found, loss
        k = int(np.argmax(losses))
        parts[k] = max(parts[k] + 1, int(parts[k] * 1.25))
        losses[k] = _along(actual, nominal, divided(base, parts), fixed, places, wanted, k)


def _counts(lattice: ErrorMap) -> str:
    return " x ".join(f"{letter} {len(nodes)}" for letter, nodes in zip(lattice.letters, lattice.nodes, strict=True))


def _along(actual: Actual, nominal: Actual, lattice: ErrorMap, fixed: Floats, places: Floats, wanted: Floats,
           k: int) -> float:
    """Worst tip error (mm) of interpolating along coordinate k alone, exact in the others."""
    nodes = list(lattice.closed())[k][0]
    low = np.clip(np.searchsorted(nodes, places[:, k], side="right") - 1, 0, max(len(nodes) - 2, 0))
    high = np.minimum(low + 1, len(nodes) - 1)
    share = ((places[:, k] - nodes[low]) / np.where(high > low, nodes[high] - nodes[low], 1.0))[:, None]
    ends = []
    for at in (low, high):
        moved = places.copy()
        moved[:, k] = nodes[at]
        ends.append(deviations(actual, nominal, nodes_of(ActualByMap(nominal, lattice), moved, fixed))[:, :3])
    return float(np.linalg.norm((1.0 - share) * ends[0] + share * ends[1] - wanted, axis=1).max(initial=0.0))
