"""Points between the ends of blocks, on the path that the control runs: blocks cut into parts that move as they did."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.base.group_rows import groups
from postproc.path.model import TRAVERSE, JointPath
from postproc.reference.moves import Moves
from toolpaths.arrays import Floats, Ints

_OWN = ("move", "code", "home", "plane", "ccw", "center", "state", "frame")


def cut_at(path: JointPath, moves: Moves, kinematics: Callable[[int], Kinematics], home: Floats, block: Ints,
           share: Floats) -> JointPath:
    """The path with points at shares (P,), between 0 and 1, of blocks (P,); both ascending, no arcs among them.

    The parts of a block stay on its path, dog-legs too: each axis arrives where it would have.

    Args:
        kinematics: with the tool of that index
        home: (J,) joints before the first block
    """
    if not len(block):
        return path
    before = np.concatenate([home[None], path.q[:-1]])
    row = path.move[block]
    tool = moves.tool[np.maximum(row - (block < path.begin[row]), 0)]
    q = np.empty((len(block), path.q.shape[1]))
    for k in groups(path.frame[block], tool):
        here = block[k]
        control = path.frames[int(path.frame[here[0]])].control
        q[k] = control.between(before[here], path.q[here], share[k], kinematics(int(tool[k[0]])),
                               path.code[here] == TRAVERSE)[2]
    joined = (block > 0) & (path.move[block - 1] == row) & np.isfinite(path.u[block - 1])
    begin = np.where(joined, path.u[block - 1], 0.0)
    added = np.concatenate([[0], np.cumsum(np.bincount(block, minlength=len(path)))])
    ends = np.insert(np.ones(len(path)), block, share)
    same = np.insert(np.zeros(len(path), dtype=bool), block, True)
    part = np.where(np.concatenate([[False], same[:-1]]), np.diff(ends, prepend=0.0), ends)
    columns = {name: np.insert(getattr(path, name), block, getattr(path, name)[block], axis=0) for name in _OWN}
    return replace(path, q=np.insert(path.q, block, q, axis=0),
                   u=np.insert(path.u, block, begin + share * (path.u[block] - begin)),
                   seconds=np.insert(path.seconds, block, path.seconds[block]) * part, begin=path.begin + added[path.begin],
                   **columns)
