"""Blocks that turn a modulo axis by more than its control does in one: cut into parts, so that the direction is certain."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control.control import Control
from postproc.path.added_points import cut_at
from postproc.path.model import JointPath
from postproc.reference.moves import Moves


def with_short_turns(path: JointPath, moves: Moves, control: Control,
                     kinematics: Callable[[int], Kinematics]) -> JointPath:
    """The path with blocks of half a turn and more (a whole turn, where words state their direction) in even parts.

    The parts of a block stay on its path, dog-legs too: each axis arrives where it would have.
    """
    if not control.rolls or not len(path):
        return path
    before = np.concatenate([control.machine.home[None], path.q[:-1]])
    parts = np.ones(len(path), dtype=np.int64)
    for j, roll in control.rolls.items():
        degrees = np.abs(path.q[:, j] - before[:, j]) * control.unit[j]
        parts = np.maximum(parts, np.ceil(degrees / roll.most - 1e-9).astype(np.int64))
    rows = np.flatnonzero(parts > 1)
    block = np.repeat(rows, parts[rows] - 1)
    count = np.arange(len(block)) - np.searchsorted(block, block) + 1
    return cut_at(path, moves, kinematics, control.machine.home, block, count / parts[block])
