"""Blocks that turn a modulo axis by more than its control does in one: cut into parts, so that the direction is certain."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control.control import Control
from postproc.path.model import TRAVERSE, JointPath
from postproc.reference.moves import Moves
from toolpaths.arrays import Floats, Ints


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
    return path if not len(rows) else _cut(path, moves, kinematics, before, rows, parts)


def _cut(path: JointPath, moves: Moves, kinematics: Callable[[int], Kinematics], before: Floats, rows: Ints,
         parts: Ints) -> JointPath:
    """The blocks `rows` in as many `parts` (K,)."""
    joints, places, owner = list[Floats](), list[Floats](), np.repeat(rows, parts[rows] - 1)
    for k in rows.tolist():
        n, row = int(parts[k]), int(path.move[k])
        leaving = k < path.begin[row]
        kin = kinematics(int(moves.tool[max(row - int(leaving), 0)]))
        control = path.frames[int(path.frame[k])].control
        t = np.arange(1, n) / n
        q0, q1 = np.tile(before[k], (n - 1, 1)), np.tile(path.q[k], (n - 1, 1))
        joints.append(control.between(q0, q1, t, kin, np.full(n - 1, path.code[k] == TRAVERSE))[2])
        joined = k > 0 and path.move[k - 1] == row and np.isfinite(path.u[k - 1])
        u0 = path.u[k - 1] if joined else 0.0
        places.append(u0 + t * (path.u[k] - u0))
    columns = {name: np.insert(getattr(path, name), owner, getattr(path, name)[owner], axis=0)
               for name in ("move", "code", "home", "plane", "ccw", "center", "state", "frame")}
    added = np.concatenate([[0], np.cumsum(parts - 1)])
    return replace(path, q=np.insert(path.q, owner, np.concatenate(joints), axis=0),
                   u=np.insert(path.u, owner, np.concatenate(places)),
                   seconds=np.repeat(path.seconds / parts, parts), begin=path.begin + added[path.begin], **columns)
