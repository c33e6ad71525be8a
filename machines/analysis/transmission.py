"""How a platform on slides transmits: condition number, speed, acceleration and force, at a point and over a box.

J = Jx^-1 Jq takes slide rates to platform rates, the turn of the platform made a length by half the largest distance of
its joints. Source: Company 2000, II-24 (condition number), III.6.2 (speed), III.6.3 (force), III.6.5 (acceleration).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from machines.kinematics.rod_platform import RodPlatform
from machines.kinematics.sliders import platform_rates
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Floats

Measure = Callable[[Floats, Floats], Floats]
"""(N,) of places (N, 3) and tilts (N,) of the workspace"""
ROUNDS = 14
"""refinements of a worst point, each halving the step"""


@dataclass(frozen=True)
class WorstValue:
    """The largest value over a box, the place (mm) and tilt (rad) where it is, and the least seen on the grid."""

    value: float
    place: tuple[float, float, float]
    tilt: float
    least: float


def rates(kinematics: RodPlatform, place: Floats, tilt: Floats) -> Floats:
    """J (N, K, K) at places (N, 3) and tilts (N,) of the workspace: platform (mm, lever x turn) per slide (mm)."""
    jx, along = _jx(kinematics, place, tilt)
    return platform_rates(jx, along)


def lever(kinematics: RodPlatform) -> float:
    """mm by which the platform's turn counts: half the largest distance of two platform joints (d in the thesis)."""
    joints = kinematics.platform_joints
    return 0.5 * float(np.linalg.norm(joints[:, None] - joints[None], axis=2).max())


def condition_number(kinematics: RodPlatform, place: Floats, tilt: Floats) -> Floats:
    """cond_2 J (N,), II-24; inf where the platform is singular."""
    jacobian = rates(kinematics, place, tilt)
    bad = ~np.isfinite(np.sum(jacobian, axis=(1, 2)))
    values = np.linalg.svd(np.where(bad[:, None, None], 0.0, jacobian), compute_uv=False)
    least = np.where(values[:, -1] > 0.0, values[:, -1], np.nan)
    return np.nan_to_num(values[:, 0] / least, nan=np.inf)


def speed_transmission(kinematics: RodPlatform, place: Floats, tilt: Floats) -> Floats:
    """eta_v (N,): fastest slide per unit speed of the platform in any direction: largest row norm of J^-1 (III.6.2).

    It is eta_a as well, the slide acceleration per acceleration of the platform.
    """
    inverse = _inverse(kinematics, place, tilt)
    return np.asarray(np.linalg.norm(inverse, axis=2).max(axis=1), dtype=np.float64)


def force_transmission(kinematics: RodPlatform, place: Floats, tilt: Floats) -> Floats:
    """eta_f (N,): largest slide force per unit force on the platform in any direction, the largest column norm of J."""
    jacobian = rates(kinematics, place, tilt)
    return np.asarray(np.linalg.norm(jacobian, axis=1).max(axis=1), dtype=np.float64)


def speed_acceleration(kinematics: RodPlatform, place: Floats, tilt: Floats) -> Floats:
    """eta_av (N,) 1/mm: slide acceleration at unit speed of a Delta's platform in the worst direction (III.6.5).

    With j a row of J^-1 the rod's equation, differentiated twice, gives (AB.u) qdd = AB.a + |v - u (j.v)|^2;
    over unit v that square is at most the squared norm of I - u j.
    """
    _, along = _jx(kinematics, place, tilt)
    inverse = _inverse(kinematics, place, tilt)
    outer = kinematics.legs.directions[None, :, :, None] * inverse[:, :, None, :]
    norm = np.linalg.norm(np.eye(3) - outer, ord=2, axis=(2, 3))
    result: Floats = np.max(norm**2 / np.abs(along), axis=1)
    return result


def worst(measure: Measure, space: Workspace,
          counts: tuple[int, int, int, int] = (11, 11, 11, 7)) -> WorstValue:
    """The largest value of `measure` over the closed workspace: an even grid, then a finer one around its largest."""
    place, tilt = space.grid(counts)
    value = measure(place, tilt)
    k, least = int(np.argmax(value)), float(value.min())
    low, high = np.append(space.lower, space.tilt[0]), np.append(space.upper, space.tilt[1])
    point, best = np.append(place[k], tilt[k]), float(value[k])
    step = (high - low) / (np.array(counts) - 1)
    offsets = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 4, indexing="ij"), axis=-1).reshape(-1, 4)
    for _ in range(ROUNDS):
        around = np.clip(point + offsets * step, low, high)
        value = measure(around[:, :3], around[:, 3])
        if float(value.max()) > best:
            best, point = float(value.max()), around[int(np.argmax(value))]
        else:
            step = 0.5 * step
    return WorstValue(best, (float(point[0]), float(point[1]), float(point[2])), float(point[3]), least)


def _inverse(kinematics: RodPlatform, place: Floats, tilt: Floats) -> Floats:
    """J^-1 = Jq^-1 Jx (N, K, K)."""
    jx, along = _jx(kinematics, place, tilt)
    result: Floats = jx / along[:, :, None]
    return result


def _jx(kinematics: RodPlatform, place: Floats, tilt: Floats) -> tuple[Floats, Floats]:
    """(Jx (N, K, K) with the turn's column divided by the lever, diagonal of Jq (N, K))."""
    jx = kinematics.loop_matrices(place, tilt)
    if kinematics.platform_turns:
        jx[:, :, 3] /= lever(kinematics)
    return jx, kinematics.legs.along(jx[:, :, :3])
