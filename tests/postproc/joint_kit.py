"""Machines, axes and curves for the tests of joints, bounds and singular directions."""

from __future__ import annotations

from functools import cache

import numpy as np

import machines
from machines.kinematics.base import Kinematics
from machines.machine import Limits, Machine
from postproc.joints.lattice import PoseRun
from postproc.joints.plan import RunSolution, plan_runs
from toolpaths.shape import Curves

DEG = np.pi / 180.0


@cache
def machine(name: str) -> Machine:
    """A built-in machine, loaded once."""
    return machines.load(name)


def solve(kin: Kinematics, tip: np.ndarray, axis: np.ndarray, limits: Limits, start: np.ndarray) -> RunSolution:
    """The joints of a run of poses (N, 3), (N, 3) that begins after a stop at joints `start` (J,): see `plan_runs`."""
    return plan_runs([PoseRun(kin, tip, axis)], limits, start, None, False)[0]


def unit(v: np.ndarray) -> np.ndarray:
    """v / |v|"""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def tilted(theta: np.ndarray | float, phi: np.ndarray | float) -> np.ndarray:
    """Unit vectors (N, 3) at theta degrees from z in the direction phi degrees."""
    a, b = np.broadcast_arrays(np.radians(theta), np.radians(phi))
    return np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)], axis=-1)


def lines(tip: np.ndarray, axis: np.ndarray) -> Curves:
    """Straight moves through poses (N, 3), (N, 3)."""
    return segments(tip[:-1], tip[1:], axis[:-1], axis[1:])


def segments(start: np.ndarray, end: np.ndarray, axis0: np.ndarray, axis1: np.ndarray) -> Curves:
    """Straight moves, each by itself."""
    n = len(start)
    return Curves(start, end, axis0, axis1, np.zeros(n, dtype=bool), np.zeros((n, 3)), np.zeros((n, 3)),
                  np.zeros(n))


def angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle (N,) rad between unit vectors."""
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))
