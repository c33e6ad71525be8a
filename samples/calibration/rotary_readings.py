"""Readings on the bench of a rotary axis by exact transforms, errors of axis, indexer and mounting given."""

from __future__ import annotations

import numpy as np

from machines.calibration.rotary_bench import Bench, chain
from machines.geometric_error.actual.transforms import inverse
from toolpaths.arrays import Floats


def simulate(bench: Bench, axis: Floats, indexer: Floats, mounts: Floats, noise: float | Floats = 0.0,
             rng: np.random.Generator | None = None, order: Floats | None = None) -> Floats:
    """Readings (m, n, 6): dx dy dz in mm, rotation vector in rad.

    Args:
        axis: (n, 6) torsors of the axis at its positions (C 1.14)
        indexer: (n, 6) torsors of the indexer at its increments, numbered along its own travel (C 1.17)
        mounts: (m, 3, 6) torsors of C0, RX0, RL in each set-up (C 1.12, 1.15, 1.18)
        noise: standard deviation of the readings, one or (6,)
        order: (m,) increments by which the indexer is turned in each set-up; default 0, 1, 2, ...
    """
    m, turned = len(mounts), np.arange(len(mounts)) if order is None else np.asarray(order, dtype=np.int64)
    readings = np.stack([_setup(bench, axis, indexer, mounts[k], int(turned[k])) for k in range(m)])
    if rng is None:
        return readings
    return np.asarray(readings + rng.normal(size=readings.shape) * noise)


def _setup(bench: Bench, axis: Floats, indexer: Floats, mounts: Floats, k: int) -> Floats:
    n = bench.steps
    actual = chain(bench, axis, np.roll(indexer, -k, axis=0), np.tile(mounts[:, None], (1, n, 1)))
    nominal = chain(bench, np.zeros((n, 6)), np.zeros((n, 6)), np.zeros((3, n, 6)))
    moved = actual @ inverse(nominal)
    shift = actual[:, :3, 3] - nominal[:, :3, 3]
    return np.concatenate([shift, _vector(moved[:, :3, :3])], axis=1)


def _vector(turns: Floats) -> Floats:
    """Rotation vectors (n, 3) of small turns (n, 3, 3)."""
    sine = 0.5 * np.stack([turns[:, i, j] - turns[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1)
    size = np.linalg.norm(sine, axis=1)
    scale = np.where(size > 0.0, np.arcsin(np.minimum(size, 1.0)) / np.where(size > 0.0, size, 1.0), 1.0)
    result: Floats = sine * scale[:, None]
    return result
