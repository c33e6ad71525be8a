"""The machine of annex F: R 279, r 107, h 100, L 348 mm, six slides along z in pairs 120 degrees apart.

Om stands 1 m above the joints. The foot of a rod stands 50 mm inside its slide's radius; guides turn about the origin of
the machine's frame, 1.4 m below Om.
"""

from __future__ import annotations

import itertools

import numpy as np

from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.workspace import Workspace
from machines.tolerances.influence import PlatformPoses
from machines.tolerances.sensitivity import RodsOfLegs

OM = np.array([0.0, 0.0, 1000.0])


def about(axis: int, angle: float) -> np.ndarray:
    turn, (i, j) = np.eye(3), [(1, 2), (2, 0), (0, 1)][axis]
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[j, i], turn[i, j] = np.sin(angle), -np.sin(angle)
    return turn


def annex_f() -> RodsOfLegs:
    feet, joints = [], []
    for k in range(3):
        ring = about(2, 2.0 * np.pi * k / 3.0)
        for aside in (-100.0, 100.0):
            feet.append(ring @ [229.0, aside, 0.0])
            joints.append(ring @ [107.0, aside, 0.0])
    yes, none = np.ones(6, dtype=bool), np.zeros((6, 3))
    legs = LegGeometry(tuple("XYZUVW"), np.array(feet), np.tile([0.0, 0.0, 1.0], (6, 1)), none, np.full(6, 348.0),
                       np.full(6, -1.0), yes, ~yes, np.array(joints), none, tuple("xyzabc"), OM, (), np.zeros((0, 3)),
                       Workspace(np.array([0.0, 0.0, 400.0]), np.array([0.0, 0.0, 400.0])))
    return RodsOfLegs(legs, np.arange(6), none, from_origin=True)


def annex_f_poses(levels: int) -> PlatformPoses:
    """Om within 50 mm of 1.4 m, turns within 3 degrees about x, then y, then z (RTL = Rz Ry Rx); 1 level: the middle."""
    moves = np.linspace(-50.0, 50.0, levels) if levels > 1 else np.zeros(1)
    angles = np.radians(moves / 50.0 * 3.0)
    turns = [about(2, c) @ about(1, b) @ about(0, a) for a, b, c in itertools.product(angles, angles, angles)]
    shifts = np.stack(np.meshgrid(moves, moves, moves), axis=-1).reshape(-1, 3)
    place = np.concatenate([shifts + (np.array([0.0, 0.0, 1400.0]) - turn @ OM) for turn in turns])
    turn = np.repeat(np.array(turns), len(shifts), axis=0)
    return PlatformPoses(place, turn, np.column_stack([place, np.zeros((len(place), 2))]))
