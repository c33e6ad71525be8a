"""Branches of the inverse followed from pose to pose: where each leads to, and where the tool lies along a rotary axis."""

from __future__ import annotations

import numpy as np

from machines.kinematics.base import Kinematics
from toolpaths.arrays import Array, Bools, Floats, without_nan
from toolpaths.rotations import slerp, wrap

TRAVEL_SLACK = 1e-9
"""mm or rad: round-off that is no excess of travel"""
_SMALL_STEP = 0.35
"""rad of rotary path that a branch is followed without a look between"""
_CROSSING = 1e-3
_LEAST_STEP = 1e-10


def branches_of(kin: Kinematics, tip: Floats, axis: Floats, near: Floats,
                parameters: Floats | None = None) -> tuple[Floats, Bools]:
    """(joints (B, N, J) of every branch, family (B, N)) of poses (N, 3), (N, 3), rotaries in (-pi, pi].

    Where the tool lies along a rotary axis the free joint is carried on from the rows before, at the
    beginning of the run from the first other row. Where it does so along the whole path there is one branch
    for each row of `near` (F, J). `parameters` (N, ...): what the machine leaves open, where that was planned.
    """
    rotary = np.array(kin.rotary)
    branches = kin.inverse(tip, axis, near=near[0]) if parameters is None else kin.inverse_with(
        tip, axis, parameters, near[0])
    family = np.stack([kin.singular(without_nan(b)) & np.isfinite(b).all(axis=1) for b in branches])
    if family.any():
        if not (np.isfinite(branches).all(axis=2) & ~family).any():
            branches = np.stack([kin.inverse(tip, axis, near=n)[0] for n in near])
            family = np.broadcast_to(family[0], branches.shape[:2]).copy()
        else:
            branches = _fill_family(kin, tip, axis, branches, family)
    branches[:, :, rotary] = wrap(branches[:, :, rotary])
    return branches, family


def _fill_family(kin: Kinematics, tip: Floats, axis: Floats, branches: Floats, family: Bools) -> Floats:
    """Branches with the free joint of family rows carried on from the rows around them."""
    result = branches.copy()
    for b in range(len(branches)):
        rows = np.flatnonzero(family[b])
        fixed = np.flatnonzero(~family[b] & np.isfinite(branches[b]).all(axis=1))
        if len(rows) and len(fixed):
            at = np.searchsorted(fixed, rows) - 1
            result[b, rows] = kin.inverse(tip[rows], axis[rows], near=branches[b, fixed[np.maximum(at, 0)]])[b]
    return result


def distance(a: Floats, b: Floats, rotary: Bools) -> Floats:
    """Rotary path in rad where the machine has rotary joints, else linear path in mm; NaN counts as infinite."""
    d = wrap(b[..., rotary] - a[..., rotary]) if rotary.any() else b - a
    result: Floats = without_nan(np.abs(d).sum(axis=-1), np.inf)
    return result


def following(kin: Kinematics, tip: Floats, axis: Floats, branches: Floats,
              family: Bools) -> tuple[Array, Bools]:
    """(B, N - 1) the branch that a branch of each pose leads to at the next, and (N - 1,) where it may change on the spot.

    It is the nearest where the step is small or one end is free; elsewhere it is found by walking there. It
    may change where the tool leaves the direction of a rotary axis.
    """
    count, n, _ = branches.shape
    own = np.broadcast_to(np.arange(count, dtype=np.int8)[:, None], (count, n - 1))
    if count == 1 or n == 1 or bool(family.all()):
        return own, np.zeros(n - 1, dtype=np.bool_)
    rotary = np.array(kin.rotary)
    step = np.stack([[distance(branches[b, :-1], branches[c, 1:], rotary) for c in range(count)]
                     for b in range(count)])
    stay = step[np.arange(count), np.arange(count)]
    nearest = step.argmin(axis=1)
    best = np.where((stay <= step.min(axis=1) + 1e-9) | ~np.isfinite(step.min(axis=1)), own, nearest)
    there = np.asarray(family.any(axis=0), dtype=np.bool_)
    at_family = there[:-1] | there[1:]
    uncertain = ((best != own) | (stay > _SMALL_STEP)) & np.isfinite(stay) & ~at_family
    best = np.where(at_family & there[1:], own, best)
    for b, i in np.argwhere(uncertain):
        end = _walk(kin, tip[i:i + 2], axis[i:i + 2], branches[b, i], int(b))
        best[b, i] = int(distance(end, branches[:, i + 1], rotary).argmin())
    return best.astype(np.int8), there[:-1] & ~there[1:]


def _walk(kin: Kinematics, tip: Floats, axis: Floats, q: Floats, branch: int) -> Floats:
    """Joints at the second of two poses, reached from joints q of the first without a jump.

    Steps are halved until the joints move little; the branch may only change where it comes as near as where
    the tool passes through a singular direction. Where the path leaves the reach, as around the pole of axes
    that are not square to each other, it ends there.
    """
    rotary = np.array(kin.rotary)
    u, size = 0.0, 0.25
    while u < 1.0:
        size = min(size, 1.0 - u)
        t = np.array([u + size])
        found = kin.inverse(tip[:1] + t[:, None] * (tip[1:] - tip[:1]), slerp(axis[:1], axis[1:], t), near=q[None, :])[:, 0]
        travel = distance(q, found, rotary)
        near = int(travel.argmin())
        if travel[near] > (_SMALL_STEP if near == branch else _CROSSING) and size > _LEAST_STEP:
            size *= 0.5
            continue
        if not np.isfinite(travel[near]):
            break
        q, branch, u = found[near], near, u + size
        size *= 2.0
    return q
