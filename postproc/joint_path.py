"""Joints of every pose of an unbroken run: family values, branch and windings by the shortest way inside travel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Limits
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.rotations import angle_between, slerp

TWO_PI = 2.0 * np.pi
TRAVEL_SLACK = 1e-9
"""mm or rad: round-off that is no excess of travel"""
_SMALL_STEP = 0.35
"""rad of rotary way that a branch is followed without a look between"""
_CROSSING = 1e-3
_LEAST_STEP = 1e-10


@dataclass(frozen=True)
class Solution:
    """Joints (N, J) of a run, rotaries unwound; NaN rows where the machine cannot take the pose."""

    q: Floats
    singular: Bools
    """(N,) rows where the tool lies along a rotary axis"""


def wrap(angle: Floats) -> Floats:
    """Angles into (-pi, pi]."""
    result: Floats = -(np.mod(-angle + np.pi, TWO_PI) - np.pi)
    return result


def reachable_axes(kin: Kinematics, axis: Floats, tolerance: float) -> tuple[Floats, Floats]:
    """(axes the machine can take, angle (N,) rad by which they differ).

    Directions of a CL file carry rounding, so that an axis on the edge of the reachable set may stand just outside:
    those within `tolerance` (rad) are moved onto it, others stay as they are.
    """
    nearest = kin.nearest_axis(axis)
    off = angle_between(nearest, axis)
    use = (off > 0.0) & (off <= tolerance)
    return np.where(use[:, None], nearest, axis), np.where(use, off, 0.0)


def solve(kin: Kinematics, tip: Floats, axis: Floats, limits: Limits, start: Floats) -> Solution:
    """The joints of a run of poses (N, 3), (N, 3) that begins after a stop at joints `start` (J,).

    From every branch of the first pose the nearest solutions are followed. Of these tracks, with the windings of each
    rotary axis that fit into travel, the one that stays inside travel and turns the rotary axes least is taken.
    """
    rotary = np.array(kin.rotary)
    near = np.tile(start, (len(tip), 1))
    branches = kin.inverse(tip, axis, near=near)
    family = np.stack([kin.singular(np.nan_to_num(b)) & np.isfinite(b).all(axis=1) for b in branches])
    if family.any():
        branches = _fill_family(kin, tip, axis, branches, family, start)
    best: tuple[tuple[float, float, float], Ints, Floats] | None = None
    for track in _tracks(kin, tip, axis, branches, family, limits):
        q = _unwound(branches[track, np.arange(len(tip))], rotary, limits, start)
        cost = _cost(q, rotary, limits, start)
        if best is None or cost < best[0]:
            best = (cost, track, q)
    assert best is not None
    _, track, q = best
    return Solution(q, family[track, np.arange(len(tip))])


def _fill_family(kin: Kinematics, tip: Floats, axis: Floats, branches: Floats, family: Bools,
                 start: Floats) -> Floats:
    """Branches with the free joint of family rows carried on from the rows around them.

    A row takes the joints of the last row before it that is not free; rows at the beginning those of the first such
    row after them, so that a run may start with the table already turned; without any, of `start`.
    """
    result = branches.copy()
    for b in range(len(branches)):
        rows = np.flatnonzero(family[b])
        fixed = np.flatnonzero(~family[b] & np.isfinite(branches[b]).all(axis=1))
        if not len(rows):
            continue
        near = np.tile(start, (len(rows), 1))
        if len(fixed):
            at = np.searchsorted(fixed, rows) - 1
            near = branches[b, fixed[np.maximum(at, 0)]]
        result[b, rows] = kin.inverse(tip[rows], axis[rows], near=near)[b]
    return result


def _distance(a: Floats, b: Floats, rotary: Bools) -> Floats:
    """Rotary way in rad where the machine has rotary joints, else linear way in mm; NaN counts as infinite."""
    d = wrap(b[..., rotary] - a[..., rotary]) if rotary.any() else b - a
    result: Floats = np.nan_to_num(np.abs(d).sum(axis=-1), nan=np.inf)
    return result


def _tracks(kin: Kinematics, tip: Floats, axis: Floats, branches: Floats, family: Bools, limits: Limits) -> list[Ints]:
    """Branch numbers (N,) of the continuous track from each branch that the first pose has.

    Where the tool lies along a rotary axis the branch may change on the spot: it does where the nearest one would
    leave travel before the next such pose and another would not.
    """
    count, n, _ = branches.shape
    begin = [b for b in range(count) if np.isfinite(branches[b, 0]).all()] or [0]
    if count == 1 or n == 1:
        return [np.full(n, b) for b in begin]
    following, free = _following(kin, tip, axis, branches, family)
    outside = np.cumsum(~_fits(branches, np.array(kin.rotary), limits), axis=1)
    stretch_end = np.append(np.flatnonzero(free), n - 1)
    switches = np.flatnonzero((following != np.arange(count)[:, None]).any(axis=0) | free)
    tracks = []
    for b in begin:
        track = np.full(n, b)
        for i in switches:
            target = following[track[i], i]
            if free[i]:
                last = stretch_end[np.searchsorted(stretch_end, i, side="right")]
                target = _least(outside[:, last] - outside[:, i], int(target))
            if target != track[i]:
                track[i + 1:] = target
        tracks.append(track)
    return tracks


def _least(count: Ints, preferred: int) -> int:
    """The branch with the fewest poses outside travel; the preferred one among equals."""
    return preferred if count[preferred] == count.min() else int(count.argmin())


def _fits(branches: Floats, rotary: Bools, limits: Limits) -> Bools:
    """(B, N) True where every joint is inside travel, rotary ones in some winding."""
    turns = np.where(rotary & np.isfinite(limits.lower), np.ceil((limits.lower - branches - TRAVEL_SLACK) / TWO_PI), 0.0)
    lifted = branches + TWO_PI * turns
    return np.asarray(((lifted >= limits.lower - TRAVEL_SLACK) & (lifted <= limits.upper + TRAVEL_SLACK)).all(axis=2))


def _following(kin: Kinematics, tip: Floats, axis: Floats, branches: Floats, family: Bools) -> tuple[Ints, Bools]:
    """(B, N - 1) the branch that a branch of each pose leads to at the next, and (N - 1,) where it is free to change.

    It is the nearest where the step is small or one end is free; elsewhere it is found by walking there."""
    count = len(branches)
    rotary = np.array(kin.rotary)
    step = np.stack([[_distance(branches[b, :-1], branches[c, 1:], rotary) for c in range(count)]
                     for b in range(count)])
    own = np.arange(count)
    stay = step[own, own]
    following = np.where((stay <= step.min(axis=1) + 1e-9) & np.isfinite(stay), own[:, None], step.argmin(axis=1))
    free = np.asarray(family[:, :-1].any(axis=0) | family[:, 1:].any(axis=0))
    doubtful = ((following != own[:, None]) | (stay > _SMALL_STEP)) & np.isfinite(stay) & ~free
    for b, i in np.argwhere(doubtful):
        end = _walk(kin, tip[i:i + 2], axis[i:i + 2], branches[b, i], int(b))
        following[b, i] = int(_distance(end, branches[:, i + 1], rotary).argmin())
    return following, free


def _walk(kin: Kinematics, tip: Floats, axis: Floats, q: Floats, branch: int) -> Floats:
    """Joints at the second of two poses, reached from joints q of the first without a jump.

    Steps are halved until the joints move little; the branch may only change where it comes as near as where the tool
    passes through a singular direction.
    """
    rotary = np.array(kin.rotary)
    u, size = 0.0, 0.25
    while u < 1.0:
        size = min(size, 1.0 - u)
        t = np.array([u + size])
        found = kin.inverse(tip[:1] + t[:, None] * (tip[1:] - tip[:1]), slerp(axis[:1], axis[1:], t), near=q[None, :])[:, 0]
        distance = _distance(q, found, rotary)
        near = int(distance.argmin())
        if distance[near] > (_SMALL_STEP if near == branch else _CROSSING) and size > _LEAST_STEP:
            size *= 0.5
            continue
        q, branch, u = found[near], near, u + size
        size *= 2.0
    return q


def _unwound(q: Floats, rotary: Bools, limits: Limits, start: Floats) -> Floats:
    """Continuous rotary joints, wound so that they fit into travel, as near to `start` as that allows."""
    result = q.copy()
    for j in np.flatnonzero(rotary):
        good = np.isfinite(q[:, j])
        if not good.any():
            continue
        values = q[good, j]
        values = np.concatenate([values[:1], values[0] + np.cumsum(wrap(np.diff(values)))])
        result[good, j] = values + TWO_PI * _winding(values, limits.lower[j], limits.upper[j], start[j])
    return result


def _winding(values: Floats, lower: float, upper: float, start: float) -> float:
    """Turns to add: inside travel if possible, then nearest to `start`."""
    best = round((start - values[0]) / TWO_PI)
    least = np.ceil((lower - values.min() - TRAVEL_SLACK) / TWO_PI) if np.isfinite(lower) else -np.inf
    most = np.floor((upper - values.max() + TRAVEL_SLACK) / TWO_PI) if np.isfinite(upper) else np.inf
    if least <= most:
        return float(np.clip(best, least, most))
    middle = 0.5 * (lower + upper) - 0.5 * (values.min() + values.max())
    return float(round(middle / TWO_PI))


def _cost(q: Floats, rotary: Bools, limits: Limits, start: Floats) -> tuple[float, float, float]:
    """(poses without a solution, worst excess of travel, rotary way): compared in this order."""
    missing = float((~np.isfinite(q).all(axis=1)).sum())
    good = q[np.isfinite(q).all(axis=1)]
    if not len(good):
        return (missing, np.inf, np.inf)
    excess = float(np.maximum(np.maximum(limits.lower - good, good - limits.upper).max(), TRAVEL_SLACK))
    way = good[:, rotary] if rotary.any() else good
    first = start[rotary] if rotary.any() else start
    turned = float(np.abs(np.diff(way, axis=0)).sum() + np.abs(way[0] - first).sum())
    return (missing, excess if excess > TRAVEL_SLACK else 0.0, turned)


def nearest_solution(kin: Kinematics, tip: Floats, axis: Floats, near: Floats) -> Floats:
    """Joints (N, J) of poses, on the branch and winding nearest to `near` (N, J)."""
    rotary = np.array(kin.rotary)
    branches = kin.inverse(tip, axis, near=near)
    distance = np.stack([_distance(near, b, rotary) for b in branches])
    chosen = distance.argmin(axis=0)
    q: Floats = branches[chosen, np.arange(len(tip))].copy()
    q[:, rotary] = near[:, rotary] + wrap(q[:, rotary] - near[:, rotary])
    return q
