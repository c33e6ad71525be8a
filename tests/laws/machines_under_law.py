"""What the laws run on: machines of the catalogue and of kinds of others, poses from their travel, tolerance of the laws."""

from functools import cache

import numpy as np

import machines
from machines.machine import Machine
from tests.machines.own_kinds import OWN, own_machine

SCALE = 100.0
"""mm per rad: weighs angles against lengths in condition numbers"""
CALM = 30.0
"""condition number"""
POOL = 2000
"""poses of a machine that its laws share"""


@cache
def machine(name: str) -> Machine:
    return own_machine(name) if name in OWN else machines.load(name)


def joints(m: Machine, n: int, seed: int = 1) -> np.ndarray:
    """q (n, J) spread over the travel, a full turn for unlimited axes."""
    low = np.where(np.isfinite(m.limits.lower), m.limits.lower, -np.pi)
    high = np.where(np.isfinite(m.limits.upper), m.limits.upper, np.pi)
    return np.random.default_rng(seed).uniform(low, high, (n, len(low)))


def poses(m: Machine, n: int, seed: int = 1, calm: bool = True) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(q, tip, axis) of n random joint positions; for a parallel machine, whose legs seldom meet at those, of
    up to n random poses around the ones that do, `calm` without those next to a singular one."""
    if m.kinematics.straight_slides:
        q = joints(m, n, seed)
        return q, *m.kinematics.forward(q)
    if m.kinematics.workspace is None:  # nothing but its travel says where it works
        q = joints(m, 1000, seed)
        tip, axis = m.kinematics.forward(q)
        met = np.isfinite(tip).all(axis=1)
        q, tip, axis = q[met][:n], tip[met][:n], axis[met][:n]
        keep = condition(m, q, tip, axis) < CALM if calm else slice(None)
        return q[keep], tip[keep], axis[keep]
    rng = np.random.default_rng(seed)
    tip = rng.uniform(*box(m.name), (4 * n, 3))
    axis = m.kinematics.nearest_axis(unit(rng.normal(size=(4 * n, 3))))
    branches = m.kinematics.inverse(tip, axis)
    real = np.isfinite(branches).all(axis=(0, 2)) & (branches[0] >= m.limits.lower).all(axis=1)
    real &= (branches[0] <= m.limits.upper).all(axis=1)
    assert real.sum() >= n // 2, f"{real.sum()} of {4 * n} random poses can be taken"
    q, tip, axis = branches[0][real][:n], tip[real][:n], axis[real][:n]
    keep = condition(m, q, tip, axis) < CALM if calm else slice(None)
    return q[keep], tip[keep], axis[keep]


@cache
def _pool(name: str) -> tuple[np.ndarray, ...]:
    """`POOL` poses of a machine, drawn once for all its laws, with whether each is calm."""
    m = machine(name)
    drawn = poses(m, POOL, calm=False)
    calm = np.ones(len(drawn[0]), bool) if m.kinematics.straight_slides else condition(m, *drawn) < CALM
    return *drawn, calm


def shared_poses(name: str, n: int, seed: int = 1, calm: bool = True) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`poses` out of those that all laws of a machine share: others for each seed."""
    *drawn, still = _pool(name)
    some = np.flatnonzero(still) if calm else np.arange(len(still))
    q, tip, axis = (x[np.random.default_rng(seed).permutation(some)[:n]] for x in drawn)
    return q, tip, axis


@cache
def box(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest tip (3,) of a parallel machine at random joint positions at which its legs meet; of one that
    turns in every direction over its workspace, for it seldom keeps its spin at 0 there."""
    kin = machine(name).kinematics
    if kin.on_rods is None:
        rig = kin.rig(machine(name).home[None])
        return kin.workspace.lower + (rig.gauge - rig.place)[0], kin.workspace.upper + (rig.gauge - rig.place)[0]
    tip, _ = machine(name).kinematics.forward(joints(machine(name), 1000))
    met = tip[np.isfinite(tip).all(axis=1)]
    return met.min(axis=0), met.max(axis=0)


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def gap(m: Machine, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """|a - b| of joints (..., J), rotary ones modulo a turn."""
    d = np.abs(a - b)
    return np.where(m.rotary, np.abs((d + np.pi) % (2 * np.pi) - np.pi), d)


def condition(m: Machine, q: np.ndarray, tip: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(N,) ratio of the greatest to the least singular value of the Jacobian, angles weighed by SCALE."""
    jacobian = m.kinematics.jacobian(q, near=np.hstack([tip, axis])).copy()
    jacobian[:, 3:] *= SCALE
    jacobian[:, :, np.array(m.rotary)] /= SCALE
    values = np.linalg.svd(jacobian, compute_uv=False)[:, : np.linalg.matrix_rank(jacobian[0])]
    return values[:, 0] / np.maximum(values[:, -1], 1e-300)


def tolerance(m: Machine, q: np.ndarray, tip: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(N,) mm: 1e-9, or 1e-13 x size x condition number of the Jacobian where that is more."""
    size = np.maximum(np.abs(tip).max(axis=1), np.abs(q).max(axis=1))
    return np.maximum(1e-9, 1e-13 * size * condition(m, q, tip, axis))
