"""Joints of poses: the path through an unbroken run, the solution nearest to given joints, axes onto what can be reached."""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.joints.tracks import distance
from toolpaths.arrays import Floats, Ints, repeated, slices
from toolpaths.rotations import angle_between, wrap


def reachable_axes(kin: Kinematics, axis: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """(axes the machine can take, angle (N,) rad by which they differ).

    Directions of a CL file carry rounding, so that an axis on the edge of the reachable set may stand just
    outside: those within `tolerance` (rad) are moved onto it, others stay as they are.
    """
    off = np.concatenate([angle_between(kin.nearest_axis(axis[part]), axis[part]) for part in slices(len(axis))])
    use = (off > 0.0) & (off <= tolerance)
    if not use.any():
        return axis, repeated(0.0, len(axis))
    moved = np.array(axis)
    moved[use] = kin.nearest_axis(axis[use])
    return moved, np.where(use, off, 0.0)


def nearest_solution(kin: Kinematics, tip: Floats, axis: Floats, near: Floats,
                     branch: Ints | None = None) -> Floats:
    """Joints (N, J) of poses, on the branch and winding nearest to `near` (N, J).

    `branch` (N,) names the branch where it is known, -1 where it is not. What a redundant machine leaves open is as in
    `near`.
    """
    rotary = np.array(kin.rotary)
    branches = kin.inverse_like(tip, axis, near)
    far = np.stack([distance(near, b, rotary) for b in branches])
    chosen = far.argmin(axis=0)
    if branch is not None:
        chosen = np.where(branch >= 0, branch, chosen)
    q: Floats = branches[chosen, np.arange(len(tip))].copy()
    q[:, rotary] = near[:, rotary] + wrap(q[:, rotary] - near[:, rotary])
    return q


def branch_of(kin: Kinematics, tip: Floats, axis: Floats, q: Floats) -> Ints:
    """(N,) the branch that joints q (N, J) of poses are on; -1 where the tool lies along a rotary axis."""
    rotary = np.array(kin.rotary)
    far = np.stack([distance(q, b, rotary) for b in kin.inverse_like(tip, axis, q)])
    return np.where(kin.singular(np.nan_to_num(q)), -1, far.argmin(axis=0))
