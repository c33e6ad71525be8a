"""What errors of dimensions do to the tool anywhere in the workspace, together by chance, and which ones to tighten.

Source: Company 2000, annex F: by dimension (F.3.1), by point (F.3.2), after an adjustment of the rods (F.3.4), by chance
(F.3.5).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol, Self, TypeVar

import numpy as np

from machines.certificate.poses import PosesOfBoxes
from machines.certificate.spans import spanned
from machines.kinematics.leg_geometry import LegGeometry
from machines.tolerances.sensitivity import LegDimension, RodsOfLegs, adjusted, sensitivity
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

LEVELS, TILTS, HEADINGS, AT_ONCE = 5, 4, 8, 1_000
"""places per direction, tilts, directions of tilt; poses at a time"""


class Poses(Protocol):
    """Where a machine stands, N times."""

    @property
    def pose(self) -> Floats:
        """(N, 5): x, y, z, tilt, heading."""
        ...

    def part(self, rows: slice) -> Self:
        """Some of them."""
        ...


P = TypeVar("P", bound=Poses)


@dataclass(frozen=True, eq=False)
@arrays(place="N 3", turn="N 3 3", pose="N 5")
class PlatformPoses:
    """Poses of the platform: reference point, turn, and as x, y, z, tilt, heading."""

    place: Floats
    turn: Floats
    pose: Floats

    def part(self, rows: slice) -> PlatformPoses:
        """Some of them."""
        return PlatformPoses(self.place[rows], self.turn[rows], self.pose[rows])


def poses_at(legs: LegGeometry, pose: Floats) -> PlatformPoses:
    """The platform at poses (N, 5) of its reference point."""
    turn = PosesOfBoxes(legs, np.zeros(3)).turn(spanned(pose))[0].lo if legs.turns else np.tile(np.eye(3), (len(pose), 1, 1))
    free = np.array([letter in legs.freedoms for letter in "xyz"])
    return PlatformPoses(np.where(free, pose[:, :3], 0.0), turn, pose)


def poses_over(legs: LegGeometry) -> PlatformPoses:
    """All over the workspace, its edges included."""
    space = legs.workspace
    sides = [np.linspace(lo, hi, LEVELS) if letter in legs.freedoms else np.zeros(1)
             for lo, hi, letter in zip(space.lower, space.upper, "xyz", strict=True)]
    tilts = np.linspace(*space.tilt, TILTS) if space.tilt[0] < space.tilt[1] else np.zeros(1)
    headings = np.linspace(0.0, 2.0 * np.pi, HEADINGS, endpoint=False) if legs.tilts_everywhere else np.zeros(1)
    return poses_at(legs, np.stack(np.meshgrid(*sides, tilts, headings), axis=-1).reshape(-1, 5))


def middle_of(legs: LegGeometry) -> PlatformPoses:
    """The middle of the workspace, level or nearest to it."""
    return poses_at(legs, np.array([[*legs.workspace.middle, np.clip(0.0, *legs.workspace.tilt), 0.0]]))


Influence = Callable[[PlatformPoses], Floats]
"""S (N, 6, E) of poses"""


def influence(rods: RodsOfLegs, point: Floats, adjust: bool) -> Influence:
    """Of the machine as it is built, or once its rods are adjusted in the middle of the workspace (F.3.4)."""
    middle = middle_of(rods.legs)

    def of(poses: PlatformPoses) -> Floats:
        if adjust:
            return adjusted(rods, poses.place, poses.turn, point, (middle.place, middle.turn))
        return sensitivity(rods, poses.place, poses.turn, point)
    return of


@dataclass(frozen=True, eq=False)
@arrays(position="E", turn="E", position_at="E 5", turn_at="E 5")
class LargestInfluence:
    """Largest |dX| (mm per mm or rad) and |dW| (rad per mm or rad) of E dimensions or points, and at which pose each."""

    position: Floats
    turn: Floats
    position_at: Floats
    turn_at: Floats


def largest(of: Callable[[P], Floats], poses: P, groups: tuple[tuple[int, ...], ...]) -> LargestInfluence:
    """Over poses, of groups of dimensions whose errors may point anywhere in a sphere: one dimension, or a point's three."""
    found = LargestInfluence(*(np.zeros(len(groups)) for _ in range(2)), *(np.zeros((len(groups), 5)) for _ in range(2)))
    best, where = [found.position.copy(), found.turn.copy()], [found.position_at.copy(), found.turn_at.copy()]
    for first in range(0, len(poses.pose), AT_ONCE):
        some = poses.part(slice(first, first + AT_ONCE))
        s = of(some)
        for half, rows in enumerate((slice(0, 3), slice(3, 6))):
            sizes = np.stack([np.linalg.norm(s[:, rows][:, :, list(group)], ord=2, axis=(1, 2)) for group in groups], axis=1)
            k = sizes.argmax(axis=0)
            most = sizes.max(axis=0)
            more = most > best[half]
            best[half] = np.where(more, most, best[half])
            where[half] = np.where(more[:, None], some.pose[k], where[half])
    return LargestInfluence(best[0], best[1], where[0], where[1])


def single(dimensions: tuple[LegDimension, ...]) -> tuple[tuple[int, ...], ...]:
    """Each dimension for itself."""
    return tuple((k,) for k in range(len(dimensions)))


def by_point(dimensions: tuple[LegDimension, ...]) -> dict[LegDimension, tuple[int, ...]]:
    """The dimensions of each point, guide and rod, by what they are of, without a direction."""
    groups: dict[LegDimension, tuple[int, ...]] = {}
    for k, one in enumerate(dimensions):
        whole = replace(one, axis="turn" if one.angular and one.part != "guide" else "")
        groups[whole] = (*groups.get(whole, ()), k)
    return groups


@dataclass(frozen=True)
class ByChance:
    """Of |dX| mm and |dW| rad: mean, and what 50, 95 and 99.7 percent of the samples stay below."""

    position: tuple[float, float, float, float]
    turn: tuple[float, float, float, float]


def by_chance(s: Floats, spread: Floats, samples: int, normal: bool, seed: int = 0) -> ByChance:
    """Errors drawn at random (F.3.5) in one pose, S (6, E): evenly within +-spread (E,), or normal with that deviation."""
    rng = np.random.default_rng(seed)
    shape = (samples, len(spread))
    drawn = (rng.normal(size=shape) if normal else rng.uniform(-1.0, 1.0, shape)) * spread
    errors = drawn @ s.T
    sizes = [np.linalg.norm(errors[:, rows], axis=1) for rows in (slice(0, 3), slice(3, 6))]
    position, turn = (_parts(v) for v in sizes)
    return ByChance(position, turn)


def _parts(sizes: Floats) -> tuple[float, float, float, float]:
    half, most, nearly_all = np.percentile(sizes, (50.0, 95.0, 99.7)).tolist()
    return float(sizes.mean()), half, most, nearly_all


def prices(dimensions: tuple[LegDimension, ...], cost: Mapping[str, float]) -> Floats:
    """(E,) what each dimension costs: by its own name ("joint X1 z"), that of its point ("joint X1"), its part; else 1."""
    def of(one: LegDimension) -> float:
        names = (str(one), f"{one.part} {one.of}", one.part)
        return next((cost[name] for name in names if name in cost), 1.0)
    return np.array([of(one) for one in dimensions])


def budget(dimensions: tuple[LegDimension, ...], most: Floats, allowed: float, cost: Mapping[str, float]) -> Floats:
    """Tolerances (E,), mm or rad, that keep the root of the sum of squares of all errors within `allowed` mm at least cost.

    With s the largest influence (E,) of each dimension and c / t paid for a tolerance t, the sum of c / t is least under
    sum (s t)^2 = allowed^2 where t = k (c / s^2)^(1/3). A dimension without influence has an infinite tolerance.
    """
    price = prices(dimensions, cost)
    counts = most > 1e-12
    shape = (price / np.where(counts, most, 1.0) ** 2) ** (1.0 / 3.0)
    whole = float(np.linalg.norm(np.where(counts, shape * most, 0.0)))
    return np.where(counts, shape * allowed / whole, np.inf)
