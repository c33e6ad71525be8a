"""How a platform on legs transmits: condition number, speed, acceleration and force, at a point and over a box.

J = Jx^-1 Jq takes the rates of the drives to those of the platform, turns made lengths by half the largest distance of its
joints, arms by the path of their ends.
Source: Company 2000, II-24 (condition number), III.6.2 (speed), III.6.3 (force), III.6.5 (acceleration).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from machines.kinematics.rod_platform import RodPlatform, Transmission
from machines.kinematics.sliders import platform_rates
from machines.kinematics.workspace import Workspace
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass

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


@dataclass(frozen=True, eq=False)
class Towards:
    """A `Transmission` that tilts into one direction alone."""

    parts: Transmission
    heading: float

    @property
    def workspace(self) -> Workspace:
        """See `Transmission`."""
        return self.parts.workspace

    @property
    def lever(self) -> float:
        """See `Transmission`."""
        return self.parts.lever

    @property
    def headings(self) -> Floats:
        """(1,) rad."""
        return np.array([self.heading])

    def loops_at(self, place: Floats, tilt: Floats, heading: float) -> tuple[Floats, Floats]:
        """See `Transmission`."""
        return self.parts.loops_at(place, tilt, heading)


def heading_of(measure: Callable[[Transmission, Floats, Floats], Floats], parts: Transmission, at: WorstValue,
               least: bool = False) -> float:
    """rad: the direction of the tilt in which a measure has its largest (least) value at a place."""
    place, tilt = np.array([at.place]), np.array([at.tilt])
    found = [float(measure(Towards(parts, float(h)), place, tilt)[0]) for h in parts.headings]
    return float(parts.headings[int(np.argmin(found) if least else np.argmax(found))])


def rates(kinematics: Transmission, place: Floats, tilt: Floats, heading: float = 0.0) -> Floats:
    """J (N, K, K) at places (N, 3) and tilts (N,) of the workspace: platform (mm, lever x turn) per drive (mm)."""
    jx, along = kinematics.loops_at(place, tilt, heading)
    return platform_rates(jx, along)


def condition_number(kinematics: Transmission, place: Floats, tilt: Floats) -> Floats:
    """cond_2 J (N,), II-24; inf where the platform is singular."""
    return _worst_heading(kinematics, lambda heading: _condition(rates(kinematics, place, tilt, heading)))


def speed_transmission(kinematics: Transmission, place: Floats, tilt: Floats) -> Floats:
    """eta_v (N,): fastest drive per unit speed of the platform in any direction: largest row norm of J^-1 (III.6.2).

    It is eta_a as well, the drive's acceleration per acceleration of the platform.
    """
    return _worst_heading(kinematics, lambda heading: np.linalg.norm(
        _inverse(kinematics, place, tilt, heading), axis=2).max(axis=1))


def force_transmission(kinematics: Transmission, place: Floats, tilt: Floats) -> Floats:
    """eta_f (N,): largest drive force per unit force on the platform in any direction, the largest column norm of J."""
    return _worst_heading(kinematics, lambda heading: np.linalg.norm(
        rates(kinematics, place, tilt, heading), axis=1).max(axis=1))


def manipulability(kinematics: Transmission, place: Floats, tilt: Floats) -> Floats:
    """w = |det J| (N,), II-20 and II-22: how large the platform's speeds are together, not whether one of them is lost."""
    return _worst_heading(kinematics, lambda heading: np.abs(np.linalg.det(rates(kinematics, place, tilt, heading))))


def conditioning_factor(kinematics: Transmission, place: Floats, tilt: Floats) -> Floats:
    """|det J| over the product of the lengths of its columns (N,), II-23: between 0, singular, and 1, columns square to each
    other; of tilts in several directions the least."""
    def of(heading: float) -> Floats:
        j = rates(kinematics, place, tilt, heading)
        return np.asarray(-np.abs(np.linalg.det(j)) / np.prod(np.linalg.norm(j, axis=1), axis=1))
    return np.asarray(-_worst_heading(kinematics, of), dtype=np.float64)


def speed_acceleration(rods: RodPlatform, place: Floats, tilt: Floats) -> Floats:
    """eta_av (N,) 1/mm: slide acceleration at unit speed of a Delta's platform in the worst direction (III.6.5).

    With j a row of J^-1 the rod's equation, differentiated twice, gives (AB.u) qdd = AB.a + |v - u (j.v)|^2;
    over unit v that square is at most the squared norm of I - u j.
    """
    jx = rods.rods_at(place)
    along = rods.legs.along(jx)
    inverse = jx / along[:, :, None]
    outer = rods.legs.directions[None, :, :, None] * inverse[:, :, None, :]
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


def _worst_heading(kinematics: Transmission, measure: Callable[[float], Floats]) -> Floats:
    """The largest (N,) over the directions into which the platform tilts."""
    return np.asarray(np.max([measure(float(heading)) for heading in kinematics.headings], axis=0), dtype=np.float64)


def _condition(jacobian: Floats) -> Floats:
    bad = ~np.isfinite(np.sum(jacobian, axis=(1, 2)))
    values = np.linalg.svd(np.where(bad[:, None, None], 0.0, jacobian), compute_uv=False)
    least = np.where(values[:, -1] > 0.0, values[:, -1], np.nan)
    return np.nan_to_num(values[:, 0] / least, nan=np.inf)


def _inverse(kinematics: Transmission, place: Floats, tilt: Floats, heading: float) -> Floats:
    """J^-1 = Jq^-1 Jx (N, K, K)."""
    jx, along = kinematics.loops_at(place, tilt, heading)
    result: Floats = jx / along[:, :, None]
    return result
