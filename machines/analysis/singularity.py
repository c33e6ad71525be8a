"""Proofs by one constant for all of a workspace: the smallest singular value on a grid, and how fast it can change.

Annex D of Company 2000 is for platforms on legs of changing length: with s = sqrt 2 max |b| and x = (C, s theta, s psi) the
least singular value of rows (l, (T b) x l / s), l unit vectors, changes by at most M |dx| over steps of alpha at most,

    M^2 = 6 (2 / l_min)^2 + 6 ((sqrt 2 s / l_min + 1 + 2 alpha / l_min) / s)^2

(D-2, D-30, D-33 as corrected: 1 / s for sqrt 2 / s, sqrt 2 s / l_min for s / l_min). What follows is III.7. For slides
along z. The smallest singular values of Jx and Jq change by at most sqrt(3) (2A + 1) |dx| between two points of a
horizontal slice (III-23 to III-42; III-29 with |sqrt(1+u) - 1| <= |u|, for the printed bound fails for u < 0).
"""

from __future__ import annotations

import math

import numpy as np

from machines.certificate.enclosure import enclosed
from machines.certificate.poses import PosesOfBoxes
from machines.certificate.spans import spanned
from machines.kinematics.base import Kinematics
from machines.kinematics.leg_geometry import LegGeometry
from machines.kinematics.rod_platform import RodPlatform
from machines.kinematics.sliders import smallest_singular_value
from toolpaths.arrays import Floats, Ints

FINEST = 1.0
"""mm: smallest step tried"""
LOOKS, NUMBERS = 4000, 5
"""random poses at which annex D's singular value is looked at; numbers of a pose"""


def growth(spread: float, length: float, alpha: float) -> float:
    """A of III-37: slide travel per platform travel (1-norm) for steps up to `alpha` mm.

    Args:
        spread: R - r + rho, mm: largest horizontal distance of a platform joint from its slide
        length: of the rods, mm
    """
    return (2.0 * spread + alpha) / math.sqrt(length**2 - spread**2)


def safe_radius(spread: float, length: float, alpha: float) -> float:
    """mm that may be moved per mm of smallest singular value, 1 / (sqrt(3) (2A + 1)), III-42."""
    return 1.0 / (math.sqrt(3.0) * (2.0 * growth(spread, length, alpha) + 1.0))


def grid_step_that_proves(kinematics: RodPlatform, floor: float, alpha: float = 100.0) -> float | None:
    """Step (mm) of a square grid over the workspace that proves singular values above `floor` (mm), None without one.

    III.7.3: around a grid point whose value is s the values stay above `floor` within safe_radius x (s - floor). The
    step is halved until half of its diagonal is inside that at every point; half a step also stays below `alpha`.
    Where a rod reaches no further than joint and slide stand apart at their widest, A has no bound and nothing is proved.
    """
    spread, length = _spread(kinematics), float(kinematics.legs.lengths.min())
    if spread >= length:
        return None
    factor = safe_radius(spread, length, alpha)
    step = alpha
    while step >= FINEST:
        if 0.5 * math.sqrt(2.0) * step < factor * (_least(kinematics, step) - floor):
            return step
        step *= 0.5
    return None


def _spread(kinematics: RodPlatform) -> float:
    """mm: largest horizontal distance of a platform joint from its slide."""
    legs, space = kinematics.legs, kinematics.workspace
    feet = (legs.points - kinematics.platform_joints)[:, :2]
    corners = np.stack(np.meshgrid(*zip(space.lower[:2], space.upper[:2], strict=True)), axis=-1).reshape(-1, 2)
    return float(np.linalg.norm(corners[:, None] - feet, axis=2).max())


def lipschitz_points(kinematics: Kinematics, margin: float) -> int | None:
    """Points that III.7.3 needs for a slice of a Delta with slides along z; None of any other machine, or without a proof.

    Args:
        margin: of the singular values, as a part of the rods' length
    """
    rods = kinematics.on_rods
    if rods is None or rods.platform_turns or not np.allclose(np.abs(rods.legs.directions[:, 2]), 1.0):
        return None
    step = grid_step_that_proves(rods, margin * float(rods.legs.lengths.max()))
    return None if step is None else int(np.prod(_counts(rods, step)))


def lipschitz_halved(kinematics: Kinematics, margin: float, alpha: float = 100.0) -> int | None:
    """Squares of the same slice when they are halved only where III-42 does not prove them whole; None as
    `lipschitz_points`."""
    if lipschitz_points(kinematics, margin) is None or (rods := kinematics.on_rods) is None:
        return None
    floor, space = margin * float(rods.legs.lengths.max()), rods.workspace
    factor = safe_radius(_spread(rods), float(rods.legs.lengths.min()), alpha)
    middle, half = space.middle[None, :2], 0.5 * (space.upper - space.lower)[None, :2]
    found = 0
    while len(middle):
        large = np.linalg.norm(half, axis=1)
        good = (large < factor * (_least_at(rods, middle) - floor)) & (large <= alpha)
        found += int(good.sum())
        rest, size = middle[~good], 0.5 * half[~good]
        middle = np.concatenate([rest + size * [sx, sy] for sx in (-1, 1) for sy in (-1, 1)])
        half = np.tile(size, (4, 1))
    return found


def annex_d_boxes(legs: LegGeometry, margin: float) -> tuple[float, float] | None:
    """(boxes of an even grid, boxes when each is as large as its own pose allows) that annex D needs for the same proof.

    The second is the mean over random poses of the number that a region like that pose takes. A least singular value of
    `margin` by the longest b is at least margin / sqrt 2 by s. None of machines whose legs do not change their length, or
    where a pose looked at is not above it.
    """
    if (legs.slide | legs.arm).any() or not legs.tilts_everywhere or legs.holds is not None:
        return None
    space, poses = legs.workspace, PosesOfBoxes(legs, np.zeros(3))
    low, high = np.array([*space.lower, space.tilt[0], 0.0]), np.array([*space.upper, space.tilt[1], 2.0 * np.pi])
    pose = spanned(np.random.default_rng(0).uniform(low, high, (LOOKS, NUMBERS)))
    found, size = enclosed(poses, pose), math.sqrt(2.0) * legs.lever
    rows = np.concatenate([found.matrix.lo[:, :, :3], found.matrix.lo[:, :, 3:6] * (legs.lever / size)], axis=2)
    short = float((found.q.lo + legs.lengths).min())
    room = np.linalg.svd(rows, compute_uv=False)[:, -1] - margin / math.sqrt(2.0)
    if room.min() <= 0.0:
        return None
    reach = np.array([_step_of(float(one), size, short) for one in room])
    sides = np.array([*(space.upper - space.lower), 2.0 * size * space.tilt[1], 2.0 * size * space.tilt[1]])
    each = np.prod(sides / (2.0 * reach[:, None] / math.sqrt(NUMBERS)), axis=1)
    return float(np.prod(np.ceil(sides / (2.0 * reach.min() / math.sqrt(NUMBERS))))), float(each.mean())


def growth_of_lengths(size: float, short: float, alpha: float) -> float:
    """M of D-33, per mm: `size` is s, `short` the least length of a leg, mm."""
    return math.sqrt(6.0 * (2.0 / short) ** 2 + 6.0 * ((math.sqrt(2.0) * size / short + 1.0
                                                        + 2.0 * alpha / short) / size) ** 2)


def _step_of(room: float, size: float, short: float) -> float:
    """mm: the largest alpha with M(alpha) alpha <= room, by fixed point."""
    step = room / growth_of_lengths(size, short, 0.0)
    for _ in range(20):
        step = room / growth_of_lengths(size, short, step)
    return step


def _counts(kinematics: RodPlatform, step: float) -> Ints:
    """(2,) points of a square grid over the workspace."""
    space = kinematics.workspace
    return np.asarray(np.ceil((space.upper - space.lower)[:2] / step).astype(np.int64) + 1)


def _least(kinematics: RodPlatform, step: float) -> float:
    """Smallest singular value of Jx and Jq (mm) over the grid of a slice."""
    space = kinematics.workspace
    counts = _counts(kinematics, step)
    sides = [np.linspace(lo, hi, n) for lo, hi, n in zip(space.lower[:2], space.upper[:2], counts, strict=True)]
    x, y = (m.ravel() for m in np.meshgrid(*sides))
    return float(_least_at(kinematics, np.column_stack([x, y])).min())


def _least_at(kinematics: RodPlatform, place: Floats) -> Floats:
    """The same (N,) at places (N, 2) of the slice."""
    legs = kinematics.legs
    points = np.column_stack([place, np.full(len(place), kinematics.workspace.middle[2])])
    ends = points[:, None] + kinematics.platform_joints
    rods = ends - legs.carriages(legs.inverse(ends))
    return np.asarray(np.minimum(smallest_singular_value(rods), np.abs(legs.along(rods)).min(axis=1)))
