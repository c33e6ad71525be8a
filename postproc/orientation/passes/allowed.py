"""Tool axes that a pass may take: tilt, lead, distance from the ball's centre, and what the tool would touch."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Protocol

import numpy as np

from postproc.orientation.passes.passes import Pass
from postproc.orientation.passes.reasons import HALF_TURN, BrokenLimit, LimitedAngle, Touching
from postproc.setup.criteria import Criterion, criteria_of
from postproc.setup.orientation import OrientationLimits
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between
from toolpaths.shapes import arrays
from toolpaths.units import DEG

SAME = 1e-4
"""rad: axes nearer than this are one candidate"""
_SLACK = 1e-9
_FEW = 64
NO_LIMITS = OrientationLimits()


class CollisionBodies(Protocol):
    """Part, fixtures and table next to cutter, shank and holder."""

    def touching(self, one: Pass, axis: Floats) -> Touching | None:
        """Which pair touches where a pass is run with its tool along `axis` (3,), and by how much; None where none does."""


@dataclass(frozen=True)
@arrays(values="...")
class _Bound:
    """An angle that must be inside [low, high], rad, at every point of a pass."""

    limited: LimitedAngle
    values: Floats
    """(M, K)"""
    low: float
    high: float
    title: str = ""

    def over(self) -> Floats:
        """(M, K) by how much, rad; 0 or less inside and where the angle is not known."""
        return np.nan_to_num(np.maximum(self.low - self.values, self.values - self.high), nan=-np.inf)


@dataclass(frozen=True)
class AllowedAxes:
    """What holds for every candidate.

    Attributes:
        tilt: largest, rad: from each surface normal where they are known, else from the CL's own axis
        bodies: None where the set-up names none
        limits: lead, tilt and distance from the ball's centre as the set-up gives them
    """

    tilt: float
    bodies: CollisionBodies | None = None
    limits: OrientationLimits = NO_LIMITS

    def refused(self, one: Pass, axis: Floats) -> BrokenLimit | None:
        """Why an axis (3,) is not allowed in a pass, None where it is; its own always is."""
        return None if angle_between(axis, one.axis) < SAME else self.outside(one, axis)

    def outside(self, one: Pass, axis: Floats) -> BrokenLimit | None:
        """Which limit an axis (3,) breaks worst, by the place, the angle there and what is allowed; None where none."""
        worst, noted = _SLACK, None
        for bound in self._bounds(one, axis[None]):
            over = bound.over()[0]
            k = int(over.argmax())
            if over[k] > worst:
                worst, noted = float(over[k]), _noted(one, bound, k)
        return noted

    def mask(self, one: Pass, axes: Floats) -> Bools:
        """(M,) True for the unit axes (M, 3) that are inside the limits at every point of a pass; memory for
        some of them at a time. A few points are looked at first."""
        result = np.ones(len(axes), dtype=np.bool_)
        few = np.unique(np.linspace(0, max(len(one.contact) - 1, 0), _FEW).astype(np.int64))
        for planes, offset in self._planes(one):
            for normals in (planes[few] if len(planes) > 2 * _FEW else planes, planes):
                step, rows = one.contact.parts(len(axes)), np.flatnonzero(result)
                for first in range(0, len(rows), step):
                    some = rows[first:first + step]
                    result[some] = np.fmax.reduce(axes[some] @ normals.T, axis=1, initial=-np.inf) <= offset + _SLACK
        for bound in self._criteria(one, axes[result]):
            result[result] = (bound.over() <= _SLACK).all(axis=1)
        return result

    @cached_property
    def criteria(self) -> tuple[Criterion, ...]:
        """Those of packages that the set-up states."""
        return criteria_of(self.limits.criteria)

    def _criteria(self, one: Pass, axes: Floats) -> Iterator[_Bound]:
        """What criteria of packages make of unit axes (M, 3); one after the other."""
        for criterion in self.criteria if len(axes) else ():
            angles = criterion.angles(axes, one.contact.normal, one.contact.travel)
            yield _Bound("criterion", angles, *criterion.bounds(), criterion.title())

    def among(self, one: Pass, apart: float) -> Floats:
        """All axes (M, 3) of an even lattice, some `apart` rad from each other, that a pass may take."""
        axes = lattice(apart)
        return axes[self.mask(one, axes)]

    def touching(self, one: Pass, axis: Floats) -> Touching | None:
        """As `CollisionBodies.touching`; the own axis of a pass can touch as well."""
        return None if self.bodies is None else self.bodies.touching(one, axis)

    def _planes(self, one: Pass) -> list[tuple[Floats, float]]:
        """The limits as half-spaces: axes a with a . w <= offset for every row w (K, 3), NaN rows bound nothing.

        An angle atan2(a . u, a . n) is at most h where a . (u cos h - n sin h) <= 0, for limits within +-90 degrees.
        """
        at, limits = one.contact, self.limits.of(one.operation)
        if not len(at):
            return [(-one.axis[None], -np.cos(self.tilt))]
        result = [(-at.normal, -float(np.cos(self.tilt))), (at.normal, float(np.cos(off_centre(limits, one.radius))))]
        for given, side in ((limits.lead, at.travel), (limits.tilt, at.right)):
            for angle, sign in ((given[0] * DEG, -1.0), (given[1] * DEG, 1.0)) if given is not None else ():
                result.append((sign * (np.cos(angle) * side - np.sin(angle) * at.normal), 0.0))
        return result

    def _bounds(self, one: Pass, axes: Floats) -> list[_Bound]:
        """What the limits make of unit axes (M, 3)."""
        at, limits = one.contact, self.limits.of(one.operation)
        if not len(at):
            lean = angle_between(axes, one.axis)[:, None]
            return [_Bound("tilt from the CL axis", lean, 0.0, self.tilt), *self._criteria(one, axes)]
        least = off_centre(limits, one.radius)
        result = [_Bound("tilt from the normal", at.inclination(axes), least, self.tilt)]
        if limits.lead is not None:
            result.append(_Bound("lead", at.lead(axes), limits.lead[0] * DEG, limits.lead[1] * DEG))
        if limits.tilt is not None:
            result.append(_Bound("tilt sideways", at.tilt(axes), limits.tilt[0] * DEG, limits.tilt[1] * DEG))
        return [*result, *self._criteria(one, axes)]


def off_centre(limits: OrientationLimits, radius: float) -> float:
    """Least angle between axis and normal, rad, of a ball of `radius`: sin of it is contact radius over ball radius."""
    if limits.contact_radius is not None:
        return float(np.arcsin(min(limits.contact_radius / radius, 1.0))) if radius > 0.0 else 0.0
    return (limits.off_centre or 0.0) * DEG


def lattice(apart: float) -> Floats:
    """Unit directions (M, 3) spread evenly over the sphere, some `apart` rad from each other (spiral of
    golden angles: Gonzalez, Math. Geosciences 42 (2010))."""
    count = max(2, int(np.ceil(4.0 * np.pi / apart**2)))
    k = np.arange(count)
    z = 1.0 - (2.0 * k + 1.0) / count
    turn = np.pi * (3.0 - np.sqrt(5.0)) * k
    flat = np.sqrt(1.0 - z * z)
    return np.column_stack((flat * np.cos(turn), flat * np.sin(turn), z))


def _noted(one: Pass, bound: _Bound, k: int) -> BrokenLimit:
    """A limit that is broken at place k."""
    line = int(one.contact.line[k]) if len(one.contact) == bound.values.shape[1] else None
    high = HALF_TURN if bound.high >= np.pi else bound.high / DEG
    return BrokenLimit(bound.limited, float(bound.values[0, k]) / DEG, bound.low / DEG, high, line, bound.title)


def own_outside(one: Pass, limits: OrientationLimits) -> BrokenLimit | None:
    """Which limit of the set-up the CL's own axis of a pass breaks; --max-tilt does not count."""
    return AllowedAxes(np.pi, None, limits).outside(one, one.axis) if len(one.contact) or limits.criteria else None
