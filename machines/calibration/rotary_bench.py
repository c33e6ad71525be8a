"""The bench on which a rotary axis is measured: axis, indexer on it turning back, reflector on the indexer.

The chain of C 1.11 in homogeneous transforms: C0 (mounting of the axis), nominal turn, errors of the axis,
RX0 (mounting of the indexer), its turn back, its errors, RL (mounting of the reflector). What the instrument
reads is the displacement of the reflector from where it is without errors: three displacements and the
rotation vector, in the axes of the bed.
"""

from __future__ import annotations

from dataclasses import field

import numpy as np

from machines.geometric_error.actual.transforms import carried, homogeneous
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

MOUNTS = ("C0", "RX0", "RL")
PARTS = ("dx", "dy", "dz", "ex", "ey", "ez")


@dataclass(frozen=True, eq=False)
@arrays(shift="3")
class Bench:
    """The nominal set-up: n steps of a turn, heights (mm) from the axis's frame to the indexer and on to the reflector.

    `shift` (3,) mm is where the reflector stands from the indexer's axis.
    """

    steps: int
    axis_to_indexer: float = 80.0
    indexer_to_reflector: float = 120.0
    shift: Floats = field(default_factory=lambda: np.zeros(3))

    @property
    def angles(self) -> Floats:
        """(n,) rad, the axis's nominal positions: i 2 pi / n from 0."""
        result: Floats = 2.0 * np.pi * np.arange(self.steps) / self.steps
        return result


def chain(bench: Bench, axis: Floats, indexer: Floats, mounts: Floats) -> Floats:
    """(n, 4, 4) of the reflector in the bed; mounts (3, n, 6)."""
    turn = np.zeros((bench.steps, 6))
    turn[:, 5] = bench.angles
    up = np.zeros((bench.steps, 6))
    up[:, 2] = bench.axis_to_indexer
    over = np.zeros((bench.steps, 6))
    over[:, :3] = bench.shift + np.array([0.0, 0.0, bench.indexer_to_reflector])
    links = (mounts[0], turn, axis, up, mounts[1], -turn, indexer, over, mounts[2])
    result = np.eye(4)
    for torsor in links:
        result = result @ homogeneous(torsor)
    return result


def mount_jacobian(bench: Bench) -> Floats:
    """d readings / d mounting torsors (n, 6, 18), columns C0, RX0, RL, by transport matrices (C 1.25, 1.35)."""
    level, turned, reflector, indexer = _frames(bench)
    return np.concatenate([carried(level, reflector), carried(turned, reflector - indexer), carried(level, 0.0 * reflector)],
                          axis=2)


def motion_jacobian(bench: Bench) -> tuple[Floats, Floats]:
    """d readings / d torsor (n, 6, 6) of the axis (in its turned frame) and of the indexer."""
    level, turned, reflector, indexer = _frames(bench)
    return carried(turned, reflector), carried(level, reflector - indexer)


def _frames(bench: Bench) -> tuple[Floats, Floats, Floats, Floats]:
    """Bed and axis (n, 3, 3), places of reflector and indexer (n, 3), all in the bed."""
    n, c, s = bench.steps, np.cos(bench.angles), np.sin(bench.angles)
    turned = np.zeros((n, 3, 3))
    turned[:, 0, 0], turned[:, 0, 1], turned[:, 1, 0], turned[:, 1, 1], turned[:, 2, 2] = c, -s, s, c, 1.0
    reflector = chain(bench, np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((3, n, 6)))[:, :3, 3]
    return np.tile(np.eye(3), (n, 1, 1)), turned, reflector, np.tile([0.0, 0.0, bench.axis_to_indexer], (n, 1))
