"""Paths for `bench_feedrate.py` compared with those of the tests: smoothed CL points on a machine, polylines
with tight blends."""

from __future__ import annotations

import numpy as np

import machines
from postproc.feedrate.limits import JointLimits
from postproc.feedrate.paths import SplinePath
from postproc.planning.geometry import MachinePath, PathStretch, machine_paths
from tests.toolpaths.smoothing_kit import smooth
from toolpaths.arrays import Floats
from toolpaths.shape import Curves
from toolpaths.smoothing.smooth import Tolerance

TOLERANCE = Tolerance(0.005, np.radians(0.025))


PASS, TURNING = 60.0, 3.0


def surface(s: Floats) -> tuple[Floats, Floats]:
    """Passes of 60 mm to and fro, turns of 3 mm radius between, over a wavy surface, the axis leaning with it: tip, axis."""
    period = PASS + np.pi * TURNING
    row, along = np.divmod(s, period)
    angle = np.clip((along - PASS) / TURNING, 0.0, np.pi)
    x = np.minimum(along, PASS) + TURNING * np.sin(angle)
    x = np.where(row % 2 == 0, x, PASS - x)
    y = 2.0 * TURNING * row + TURNING * (1.0 - np.cos(angle))
    z = 3.0 * np.sin(x / 9.0) + 2.0 * np.cos(y / 7.0)
    axis = np.stack((0.5 - 0.2 * np.cos(x / 9.0), 0.2 + 0.1 * np.sin(y / 7.0), np.ones_like(s)), axis=1)
    return np.stack((x, y, z), axis=1), axis / np.linalg.norm(axis, axis=1, keepdims=True)


def cl_path(points: int, places: int = 4) -> tuple[MachinePath, JointLimits]:
    """CL points of steps between 0.05 and 0.25 mm, rounded as files round them, smoothed, on the Mikron UCP 710."""
    step = np.random.default_rng(7).uniform(0.05, 0.25, points)
    tip, axis = surface(np.cumsum(step))
    tip, axis = np.round(tip, places), np.round(axis, 6)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    none, straight = np.zeros((points - 1, 3)), np.zeros(points - 1, dtype=bool)
    curves = Curves(tip[:-1], tip[1:], axis[:-1], axis[1:], straight, none, none, np.zeros(points - 1))
    found = smooth(curves, TOLERANCE)
    assert found is not None and not len(found.stops)
    machine = machines.load("mikron-ucp710")
    q = np.unwrap(machine.kinematics.inverse(tip, axis)[0], axis=0)

    def near(s: Floats) -> Floats:
        return np.stack([np.interp(s, found.s, joint) for joint in q.T], axis=1)

    path, = machine_paths([PathStretch(found, 0.0, float(found.s[-1]), near)], machine.kinematics)
    assert isinstance(path, MachinePath), path
    own = machine.limits
    return path, JointLimits(own.velocity, own.acceleration, own.jerk)


def blended(seed: int, corner: float, sides: int = 20) -> SplinePath:
    """Sides of 5 to 30 mm at right angles in X and Y, tool tilting slowly; corners rounded over `corner` mm.

    A B-spline with the polyline's points at the Greville places as control points, its knots graded towards the
    corners: exact straight lines, third derivatives continuous.
    """
    rng = np.random.default_rng(seed)
    length = rng.uniform(5.0, 30.0, sides)
    at = np.concatenate(([0.0], np.cumsum(length)))
    turn = np.cumsum(rng.choice([-1.0, 1.0], sides)) * np.pi / 2.0
    steps = length[:, None] * np.stack((np.cos(turn), np.sin(turn)), axis=1)
    xy = np.concatenate((np.zeros((1, 2)), np.cumsum(steps, axis=0)))
    cells = [np.zeros(1)]
    for first, side in zip(at[:-1], length, strict=True):
        half = np.cumsum(np.minimum(corner * 1.25 ** np.arange(200), 1.0))
        half = half[:np.searchsorted(half, 0.5 * side) + 1] * 0.5 * side / half[np.searchsorted(half, 0.5 * side)]
        cells += [first + half, first + side - half[-2::-1], np.array([first + side])]
    cells = np.concatenate(cells)
    knots = np.concatenate((np.repeat(cells[0], 5), cells, np.repeat(cells[-1], 5)))
    greville = np.array([knots[i + 1:i + 6].mean() for i in range(len(knots) - 6)])
    wave = greville / 60.0
    joints = [np.interp(greville, at, xy[:, 0]), np.interp(greville, at, xy[:, 1]), 0.0 * greville,
              0.05 * np.sin(wave), 0.08 * np.cos(wave)]
    return SplinePath(knots, np.stack(joints, axis=1))
