"""The assembly mode of a parallel machine, followed from block to block: where its platform is, not where it could be.

The joints of such a machine have several poses. Read-back begins at home, in the mode there, and takes at
every block the pose nearest the one before it; long blocks are walked in steps that no two modes can be
mistaken in. The CL file has no say in it.
"""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.units import DEG

LINEAR_STEP = 20.0
"""mm of a slide"""
LONGEST = 1e6
"""mm that no slide goes in one block"""
ROTARY_STEP = 3.0 * DEG
SAME = 1e-6
"""mm, and direction cosines: poses that are nearer are one"""


def ends(kin: Kinematics, q: Floats, home: Floats) -> Floats:
    """Pose (N, 6) at each of the joints q (N, J), run through in order from `home` (J,) in the home mode.

    The home mode of each is tried first; it stands where it is what walking there from the one before leads to.
    """
    before = np.concatenate([home[None, :], q[:-1]])
    poses = np.hstack(kin.forward(np.concatenate([home[None, :], q])))
    found = walk(kin, before, q, poses[:-1])
    other = ~_same(found, poses[1:]) & np.isfinite(poses[:-1]).all(axis=1)
    done = 0
    for k in np.flatnonzero(other).tolist():
        for j in range(max(k, done), len(q)):
            here = found[k:k + 1] if j == k else walk(kin, before[j:j + 1], q[j:j + 1], poses[j:j + 1])
            done = j + 1
            if bool(_same(here, poses[j + 1:j + 2])[0]) or not np.isfinite(here).all():
                break
            poses[j + 1] = here[0]
    return poses[1:]


def walk(kin: Kinematics, q0: Floats, q1: Floats, pose: Floats) -> Floats:
    """Pose (N, 6) at joints q1 (N, J), reached straight in the joints from q0 where it is `pose` (N, 6).

    Rotary axes outside the closed loops change no mode with their turns, so that the steps are those of slides and
    cranks. Where a block leaves what the machine can reach the walk ends, NaN; so does one longer than any
    machine (LONGEST).
    """
    result, at = np.array(pose), np.array(q0)
    count = np.where(np.isfinite(result).all(axis=1), steps(kin, q0, q1, np.inf), 1)
    result[count > LONGEST / LINEAR_STEP] = np.nan
    i, rows = 0, np.flatnonzero(count <= LONGEST / LINEAR_STEP)
    while len(rows):
        i += 1
        here = q0[rows] + (i / count[rows])[:, None] * (q1 - q0)[rows]
        result[rows] = np.hstack(kin.forward(here, near=kin.carried(result[rows], at[rows], here)))
        at[rows] = here
        rows = rows[(count[rows] > i) & np.isfinite(result[rows]).all(axis=1)]
    return result


def steps(kin: Kinematics, q0: Floats, q1: Floats, turn: float = ROTARY_STEP) -> Ints:
    """(N,) steps of at most LINEAR_STEP mm, ROTARY_STEP of cranks and `turn` rad of other rotary axes in which blocks are
    walked, 1 at least."""
    longest = np.where(kin.rotary, np.where(kin.in_loops, ROTARY_STEP, turn), LINEAR_STEP)
    size = np.nan_to_num((np.abs(q1 - q0) / longest).max(axis=1, initial=0.0))
    return np.asarray(np.clip(np.ceil(size), 1, 1e15), dtype=np.int64)


def _same(a: Floats, b: Floats) -> Bools:
    """True (N,) where poses are equal or both do not exist."""
    near = np.abs(a - b).max(axis=1) < SAME
    return np.asarray(near | (np.isnan(a).any(axis=1) & np.isnan(b).any(axis=1)))
