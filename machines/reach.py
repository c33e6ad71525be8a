"""Reach of a machine with a declared workspace: signed margins to it, joint stops and collisions, at joints and between.

Rods, rails and spindle are round bars (segments with a radius); two bars clear each other by the distance of their
middle lines less both radii. Source: Company 2000, II.4.2.1 (rods and slides), II.4.2.2 (rods), II.4.2.3 (rods and
spindle). Rods that end in one joint (II-16) cannot be distinguished there and are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property, partial

import numpy as np

from machines.kinematics.base import Kinematics
from machines.kinematics.clearance_geometry import ClearanceGeometry
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between, dot, lengths, unit
from toolpaths.shapes import arrays

BLOCK = 4096
"""points at a time"""
TOUCH = 1e-6
"""mm: rods whose ends are nearer share a joint"""


MarginColumn = tuple[str, bool, Callable[[ClearanceGeometry], Floats]]
"""name, True for rad, margin (N,) of a rig"""


@dataclass(frozen=True, eq=False)
@arrays(angular="M", of_box="M", values="N M")
class Margins:
    """Signed margins: negative where a bound is passed, NaN where the joints have no pose.

    Attributes:
        names: what each column is, e.g. "rod X1 - rod Y1"
        angular: (M,) True for rad, False for mm
        of_box: (M,) True for faces of the box that the machine is declared to work in
        values: (N, M)
    """

    names: tuple[str, ...]
    angular: Bools
    of_box: Bools
    values: Floats

    def passed(self) -> list[tuple[str, bool, int, int, float]]:
        """Each bound that is passed: (name, angular, rows, worst row, margin there), worst of each unit first."""
        found = []
        for name, angular, column in zip(self.names, self.angular, self.values.T, strict=True):
            rows = np.flatnonzero(column < 0.0)
            if len(rows):
                worst = int(rows[np.argmin(column[rows])])
                found.append((name, bool(angular), len(rows), worst, float(column[worst])))
        return sorted(found, key=lambda f: (f[1], f[4]))


def is_checked(kinematics: Kinematics) -> bool:
    """True for a machine that is declared to work somewhere: `reach` has margins of it."""
    return kinematics.workspace is not None


def reach(kinematics: Kinematics, q: Floats, near: Floats | None = None) -> Margins:
    """Margins at joints q (N, J); `near` as for `Kinematics.pose`."""
    checks = _Checks(kinematics)
    blocks = []
    for first in range(0, len(q), BLOCK):
        part = slice(first, first + BLOCK)
        hint = near[part] if near is not None and near.ndim == 2 else near
        blocks.append(np.hstack([checks.values(kinematics.rig(q[part], hint)), kinematics.drive_margins_at(q[part])]))
    values = np.concatenate(blocks) if blocks else np.empty((0, len(checks.names)))
    return Margins(checks.names, checks.angular, checks.of_box, values)


def reach_between(kinematics: Kinematics, q: Floats, depth: int = 6) -> Margins:
    """Least margins (N-1, M) on the straight joint moves between consecutive q (N, J), their ends included.

    A move is halved until it cannot hide a negative margin, `depth` times at most. The test for that: a
    margin changes along a move by no more than the fastest of its changes seen at ends and middle, doubled;
    where that could bring it below 0 the halves are looked at.
    """
    checks = _Checks(kinematics)
    ends = reach(kinematics, q).values
    least = np.minimum(ends[:-1], ends[1:])
    _halve(kinematics, checks, q[:-1], q[1:], ends[:-1], ends[1:], least, np.arange(len(q) - 1), depth)
    return Margins(checks.names, checks.angular, checks.of_box, least)


def _halve(kinematics: Kinematics, checks: _Checks, q0: Floats, q1: Floats, m0: Floats, m1: Floats, least: Floats,
           move: np.ndarray[tuple[int], np.dtype[np.int64]], depth: int) -> None:
    if not len(move) or depth == 0:
        return
    middle = 0.5 * (q0 + q1)
    m = reach(kinematics, middle).values
    np.minimum.at(least, move, m)
    swing = 2.0 * np.maximum(np.abs(m - m0), np.abs(m1 - m))
    risky = np.flatnonzero(((np.minimum(np.minimum(m0, m1), m) - swing < 0.0) & (least[move] >= 0.0)).any(axis=1))
    both = np.concatenate([risky, risky])
    _halve(kinematics, checks, np.concatenate([q0[risky], middle[risky]]), np.concatenate([middle[risky], q1[risky]]),
           np.concatenate([m0[risky], m[risky]]), np.concatenate([m[risky], m1[risky]]), least, move[both], depth - 1)


class _Checks:
    """The columns of one machine, built once: name, unit and a function of the rig."""

    def __init__(self, kinematics: Kinematics) -> None:
        assert kinematics.workspace is not None  # see `is_checked`
        self.space = kinematics.workspace
        self.columns: list[MarginColumn] = [*self._box(), *self._tilts()]
        parts = kinematics.clearance_parts
        if parts is not None and parts.clearance is not None:
            self.middle, self.legs, self.clearance = parts.middle_rig(), parts.legs, parts.clearance
            self.leg_names = parts.leg_names
            self.columns += [*self._stops(), *self._bars()]
        named = [*((name, angular) for name, angular, _ in self.columns), *kinematics.drive_margins]
        self.names = tuple(name for name, _ in named)
        self.angular = np.array([angular for _, angular in named], dtype=np.bool_)
        self.of_box = np.arange(len(named)) < len("xyz")

    def values(self, rig: ClearanceGeometry) -> Floats:
        """(N, M)"""
        return np.stack([column(rig) for _, _, column in self.columns], axis=1)

    def _box(self) -> Iterator[MarginColumn]:
        for i, letter in enumerate("xyz"):
            yield f"workspace {letter}", False, partial(self._face, i)

    def _tilts(self) -> Iterator[MarginColumn]:
        if self.space.tilt[0] < self.space.tilt[1]:
            yield "tilt", True, self._tilt

    def _face(self, i: int, rig: ClearanceGeometry) -> Floats:
        return self.space.margins(rig.place)[:, i]

    def _tilt(self, rig: ClearanceGeometry) -> Floats:
        low, high = self.space.tilt
        return np.minimum(rig.tilt - low, high - rig.tilt)

    def _stops(self) -> Iterator[MarginColumn]:
        stops = (("slide", False, self.clearance.carriage_angle),
                 ("platform", True, self.clearance.platform_angle))
        for k, letter in enumerate(self.leg_names):
            for where, carried, most in stops:
                if most is not None:
                    yield f"joint {letter} at {where}", True, partial(self._swing, k, most, carried)

    def _swing(self, k: int, most: float, carried: bool, rig: ClearanceGeometry) -> Floats:
        """The stop `most` less the rod's angle from its direction in the middle; `carried` by the tilting platform."""
        rod = unit(rig.ends[:, k] - rig.carriages[:, k])
        middle = unit(self.middle.ends[:, k] - self.middle.carriages[:, k])
        if carried:
            rod, middle = rig.level(rod), self.middle.level(middle)
        return np.asarray(most - angle_between(rod, middle), dtype=np.float64)

    def _bars(self) -> Iterator[MarginColumn]:
        given = self.clearance
        if given.rod_radius is None:
            return
        for a, name in enumerate(self.rod_names):
            for b in range(a + 1, len(self.rod_names)):
                if given.leg[a] != given.leg[b] and not self._share_a_joint(a, b):
                    yield (f"{name} - {self.rod_names[b]}", False,
                           partial(self._gap, a, partial(self.rod, b), 2.0 * given.rod_radius))
            if given.spindle_radius is not None:
                thick = given.rod_radius + given.spindle_radius
                yield f"{name} - spindle", False, partial(self._gap, a, self.spindle, thick)
            if given.rail_radius is not None:
                for k, letter in enumerate(self.leg_names):
                    yield (f"{name} - slide {letter}", False,
                           partial(self._gap, a, partial(self.rail, k), given.rod_radius + given.rail_radius))

    def _gap(self, a: int, other: Callable[[ClearanceGeometry], tuple[Floats, Floats]], thick: float,
             rig: ClearanceGeometry) -> Floats:
        return np.asarray(segment_distance(*self.rod(a, rig), *other(rig)) - thick, dtype=np.float64)

    @cached_property
    def rod_names(self) -> list[str]:
        """rod X1, rod X2, rod Y1, ..."""
        leg = self.clearance.leg.tolist()
        return [f"rod {self.leg_names[k]}{1 + leg[:i].count(k)}" for i, k in enumerate(leg)]

    def _share_a_joint(self, a: int, b: int) -> bool:
        ends = [self.rod(i, self.middle)[1] for i in (a, b)]
        return bool(np.linalg.norm(ends[0] - ends[1]) < TOUCH)

    def rod(self, i: int, rig: ClearanceGeometry) -> tuple[Floats, Floats]:
        """Both ends (N, 3) of rod i."""
        k, shift = int(self.clearance.leg[i]), self.clearance.shift[i]
        return rig.carriages[:, k] + shift, rig.ends[:, k] + shift

    def spindle(self, rig: ClearanceGeometry) -> tuple[Floats, Floats]:
        """Both ends (N, 3) of the spindle."""
        low, high = self.clearance.spindle
        return rig.gauge + low * rig.axis, rig.gauge + high * rig.axis

    def rail(self, k: int, rig: ClearanceGeometry) -> tuple[Floats, Floats]:
        """Both ends (1, 3) of the rail of slide k."""
        given = self.clearance
        assert given.rail_offset is not None and given.rail_ends is not None
        start, u = self.legs.points[k] + given.rail_offset[k], self.legs.directions[k]
        low, high = given.rail_ends[k]
        return (start + low * u)[None], (start + high * u)[None]


def segment_distance(a: Floats, b: Floats, c: Floats, d: Floats) -> Floats:
    """Least distance (N,) mm between segments ab and cd, each end (N, 3) or (1, 3).

    Closest points of two segments by clamping the parameters in turn (Ericson, Real-Time Collision Detection, 5.1.9).
    """
    u, v, w = b - a, d - c, a - c
    uu, vv, uv = dot(u, u), dot(v, v), dot(u, v)
    uw, vw = dot(u, w), dot(v, w)
    under = uu * vv - uv * uv
    apart = under > 1e-12 * uu * vv
    s = np.where(apart, np.clip((uv * vw - uw * vv) / np.where(apart, under, 1.0), 0.0, 1.0), 0.0)
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    return lengths(w + s[:, None] * u - t[:, None] * v)
