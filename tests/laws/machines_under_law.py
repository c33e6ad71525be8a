"""What the laws run on: every machine of the catalogue, poses drawn from its travel, the tolerance of the laws."""

from functools import cache

import numpy as np

import machines
from machines.machine import Machine

SCALE = 100.0
"""mm per rad: weighs angles against lengths in condition numbers"""


@cache
def machine(name: str) -> Machine:
    return machines.load(name)


def joints(m: Machine, n: int, seed: int = 1) -> np.ndarray:
    """q (n, J) spread over the travel, a full turn for unlimited axes."""
    low = np.where(np.isfinite(m.limits.lower), m.limits.lower, -np.pi)
    high = np.where(np.isfinite(m.limits.upper), m.limits.upper, np.pi)
    return np.random.default_rng(seed).uniform(low, high, (n, len(low)))


def poses(m: Machine, n: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(q, tip, axis) of n random joint positions, without those that a parallel machine cannot take."""
    q = joints(m, n, seed)
    tip, axis = m.kinematics.forward(q)
    real = np.isfinite(tip).all(axis=1) & np.isfinite(m.kinematics.inverse(tip, axis)).all(axis=(0, 2))
    assert real.sum() >= n // 50, f"{real.sum()} of {n} random joint positions are poses of the machine"
    return q[real], tip[real], axis[real]


def gap(m: Machine, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """|a - b| of joints (..., J), rotary ones modulo a turn."""
    d = np.abs(a - b)
    return np.where(m.rotary, np.abs((d + np.pi) % (2 * np.pi) - np.pi), d)


def tolerance(m: Machine, q: np.ndarray, tip: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(N,) mm: 1e-9, or 1e-13 x size x condition number of the Jacobian where that is more."""
    jacobian = m.kinematics.jacobian(q, near=np.hstack([tip, axis])).copy()
    jacobian[:, 3:] *= SCALE
    jacobian[:, :, np.array(m.rotary)] /= SCALE
    size = np.maximum(np.abs(tip).max(axis=1), np.abs(q).max(axis=1))
    values = np.linalg.svd(jacobian, compute_uv=False)[:, : np.linalg.matrix_rank(jacobian[0])]
    return np.maximum(1e-9, 1e-13 * size * values[:, 0] / np.maximum(values[:, -1], 1e-300))
