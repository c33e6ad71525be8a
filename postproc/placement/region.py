"""Where a part that is in one orientation may stand: travel of all axes over all poses, before anything is planned.

On a serial machine the rotary joints of a pose do not depend on where the part stands, and its slides are affine functions
of that place: what travel allows is a convex polytope, and the place of most margin solves a linear program.
On a parallel machine margins are looked at directly, at poses that stand for all.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from machines import reach as clearances
from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.orientation.candidates.candidate_times import Candidate, turned
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.plans.index_time import ends
from postproc.path.reach import is_checked
from postproc.placement.reasons import AxisLacks, Lack, MarginLacks, RefusedPass
from postproc.placement.rigid_move import moved
from postproc.placement.space import ANGLES, Space
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

_MARGIN = 0.1
"""share of the clearance margin that the safe planes need at least, as the links do"""
_STEP = 100.0
"""mm, over which slides are differenced"""
_ROUNDS = 40
_LITTLE = 1e-4
_CHUNK = 2_000_000
_POSES = 12
"""of a tool and an axis that stand for all, next to the outermost"""
_MANY = 20_000
"""rows, more are thinned out"""
_LATTICE, _COARSE = 5, 3
"""places along each axis: for thinning out, and to begin with on a parallel machine"""
_FINE = 2.0
"""mm"""
_NONE = -1e6
_PER_RAD, _PER_SHARE = 100.0, 100.0
"""mm that one radian, and the whole distance from a singular position, count as"""


_SCORE = np.array([1.0, _LITTLE])
"""how much the margins of `Sampled` count"""


class Region(Protocol):
    """Places (M, 3) of the set-up's point, of a part that is in one orientation."""

    def margins(self, places: Floats) -> Floats:
        """(M,) mm that every axis stays inside travel there, negative where one lacks it."""

    def deepest(self, low: Floats, high: Floats) -> tuple[Floats, float, Lack]:
        """The place (3,) in a box with most margin, the margin, and what lacks how much where that is negative."""


@dataclass(frozen=True)
@arrays(g="K 3", c="K", joint="K")
class Slabs:
    """A serial machine: each row is how far one end of travel of joint `joint` is from a pose, g . p + c, of p (3,).

    Attributes:
        g (K, 3), c (K,), joint (K,): the last numbers `names`
    """

    g: Floats
    c: Floats
    joint: Ints
    names: tuple[str, ...]

    def margins(self, places: Floats) -> Floats:
        """See `Region`."""
        count = max(1, _CHUNK // max(1, len(self.c)))
        parts = [places[k:k + count] @ self.g.T + self.c for k in range(0, len(places), count)]
        return np.concatenate([part.min(axis=1) for part in parts]) if parts else np.zeros(0)

    def deepest(self, low: Floats, high: Floats) -> tuple[Floats, float, Lack]:
        """The linear program max m, low <= p <= high, g . p + c >= m_j >= m, rows taken in as they are found to be broken.

        The margins m_j of the joints count a little, so that those that do not decide are centred as well.
        """
        joints = np.unique(self.joint)
        count = len(joints)
        order = np.column_stack([np.zeros((count, ANGLES)), -np.eye(count), np.ones(count)])
        cost = [0.0] * ANGLES + [-_LITTLE] * count + [-1.0]
        place = 0.5 * (low + high)
        rows: list[int] = []
        for _ in range(_ROUNDS):
            values = self.g @ place + self.c
            worst = self._worst(values)
            new = [k for k in worst if k not in rows]
            least = min(values[rows], default=np.inf)
            if rows and (not new or float(values.min()) >= least - 1e-6):
                break
            rows += new
            left = np.column_stack([-self.g[rows], self.joint[rows, None] == joints, np.zeros(len(rows))])
            from scipy.optimize import linprog

            found = linprog(cost, A_ub=np.vstack([left, order]), b_ub=np.append(self.c[rows], np.zeros(count)),
                            bounds=[*zip(low, high, strict=True), *[(None, None)] * (count + 1)], method="highs")
            if found.x is None:
                raise ArithmeticError(f"no place of most margin: {found.message}")
            place = np.clip(found.x[:ANGLES], low, high)
        values = self.g @ place + self.c
        margin, end = float(values.min()), int(values.argmin())
        across = (self.joint == self.joint[end]) & (self.g @ self.g[end] < 0.0)
        other = max(0.0, -float(values[across].min(initial=np.inf)))
        return place, margin, AxisLacks(self.names[int(self.joint[end])], -margin, other)

    def _worst(self, values: Floats) -> list[int]:
        """The row of least margin of each joint and direction."""
        key = self.joint * 2 + (self.g.sum(axis=1) > 0.0)
        return [int(k[values[k].argmin()]) for one in np.unique(key) if len(k := np.flatnonzero(key == one))]


def region_of(work: PassContext, space: Space, angles: Floats,
              least: float) -> tuple[Region | None, RefusedPass | None]:
    """The region of a part turned by `angles` (3,), or why there is none.

    Args:
        work: with the part frame on the table frame
        least: distance that a parallel machine keeps from its singular positions
    """
    if not work.machine.kinematics.straight_slides:
        return sampled(moved(work, space.placement(np.append(np.zeros(ANGLES), angles))), least), None
    places = np.vstack([np.zeros((1, ANGLES)), _STEP * np.eye(ANGLES)])
    joints = []
    for place in places:
        here = _unbounded(moved(work, space.placement(np.append(place, angles))))
        made = [turned(one, one.axis, here.machine) for one in here.passes]
        why = next((RefusedPass(one.one.line, one.refused) for one in made if one.refused is not None), None)
        if why is not None:
            return None, why
        joints.append([_poses(one, here) for one in made])
    return _slabs(joints, work.machine, space.room(angles)), None


def _unbounded(work: PassContext) -> PassContext:
    """The same work on a machine whose slides never end, with the least safe planes; nor do axes of a whole turn or more,
    which a rewind brings back into their travel at any place."""
    limits, ends = work.machine.limits, ~np.array(work.machine.rotary)
    if work.setup.rewind.allowed:
        ends |= limits.upper - limits.lower >= 2.0 * np.pi
    free = replace(limits, lower=np.where(ends, -np.inf, limits.lower),
                   upper=np.where(ends, np.inf, limits.upper))
    return replace(work, machine=replace(work.machine, limits=free),
                   space=replace(work.space, margin=_MARGIN * work.space.margin))


def _poses(made: Candidate, work: PassContext) -> Floats:
    """Joints (N, J) of all rows and sites of a pass, and above its ends."""
    end = ends(made, work)
    return np.concatenate([made.q, *made.sites, end.above_first[None], end.above_last[None]])


def _slabs(joints: list[list[Floats]], machine: Machine, room: tuple[Floats, Floats]) -> Slabs:
    """Margins of the slides from joints at the origin and one step along x, y, z from there, pass by pass."""
    slides = np.flatnonzero(~np.array(machine.rotary))
    parts = [_of_pass([each[n] for each in joints], machine, slides) for n in range(len(joints[0]))]
    g, c, joint = (np.concatenate(column) for column in zip(*parts, strict=True))
    keep = np.arange(len(c)) if len(c) <= _MANY else _lowest(g, c, joint, room)
    return Slabs(g[keep], c[keep], joint[keep], machine.axis_names)


def _of_pass(q: list[Floats], machine: Machine, slides: Ints) -> tuple[Floats, Floats, Ints]:
    """Rows g (K, 3), c (K,), joint (K,) of one pass; only its outermost poses where no rotary joint turns."""
    slope = np.stack([(other - q[0])[:, slides] / _STEP for other in q[1:]], axis=2)
    still = not len(q[0]) or bool((np.ptp(q[0][:, np.array(machine.rotary)], axis=0) < 1e-9).all())
    g, c, joint = [], [], []
    for k, j in enumerate(slides.tolist()):
        at = q[0][:, j]
        for sign, rows in ((1.0, at.argmin()), (-1.0, at.argmax())):
            pick = np.atleast_1d(rows) if still else np.arange(len(at))
            edge = machine.limits.lower[j] if sign > 0.0 else machine.limits.upper[j]
            g.append(sign * slope[pick, k])
            c.append(sign * (at[pick] - edge))
            joint.append(np.full(len(pick), j))
    return np.concatenate(g), np.concatenate(c), np.concatenate(joint)


def _lowest(g: Floats, c: Floats, joint: Ints, room: tuple[Floats, Floats]) -> Ints:
    """Rows that are lowest of their joint somewhere on a lattice of places; the others are left to the exact check."""
    lattice = np.stack(np.meshgrid(*np.linspace(*room, _LATTICE).T), axis=-1).reshape(-1, ANGLES)
    found: set[int] = set()
    for one in np.unique(joint):
        rows = np.flatnonzero(joint == one)
        for place in lattice:
            found.add(int(rows[(g[rows] @ place + c[rows]).argmin()]))
    return np.array(sorted(found))


@dataclass(frozen=True)
class Sampled:
    """A parallel machine: margins at poses (tip, axis) (K, 3) that stand for all, by kinematics."""

    machine: Machine
    poses: tuple[tuple[Kinematics, Floats, Floats], ...]
    least: float

    def margins(self, places: Floats) -> Floats:
        """See `Region`; the least of travel, reach and distance from singular positions."""
        return self._values(places)[:, 0]

    def _values(self, places: Floats) -> Floats:
        """(M, 2) margins, and those without how far the tool axis leans, which is much the same at every place."""
        found = np.full((len(places), 2), np.inf)
        for kin, tip, axis in self.poses:
            count = max(1, _CHUNK // (100 * len(tip)))
            for k in range(0, len(places), count):
                some = places[k:k + count]
                found[k:k + count] = np.minimum(found[k:k + count], self._of(kin, tip, axis, some))
        return found

    def _of(self, kin: Kinematics, tip: Floats, axis: Floats, places: Floats) -> Floats:
        """(M, 2) least margins of all poses, each on its best branch."""
        tips = (tip[None] + places[:, None]).reshape(-1, 3)
        q = kin.inverse(tips, np.tile(axis, (len(places), 1)), near=self.machine.home)
        best = np.max([self._joints(kin, branch) for branch in q], axis=0)
        return np.asarray(best.reshape(len(places), -1, 2).min(axis=1))

    def _joints(self, kin: Kinematics, q: Floats) -> Floats:
        """(N, 2) of joints (N, J): the least margin, and that without the lean of the tool axis."""
        limits, rotary = self.machine.limits, np.array(self.machine.rotary)
        travel = np.minimum(q - limits.lower, limits.upper - q) * np.where(rotary, _PER_RAD, 1.0)
        result = np.asarray(travel.min(axis=1))
        good = np.isfinite(q).all(axis=1)
        result[~good] = _NONE
        if kin.singular_names and good.any():
            result[good] = np.minimum(result[good], _PER_SHARE * (kin.singular_distance(q[good]).min(axis=1) - self.least))
        both = np.stack([result, result], axis=1)
        if is_checked(kin) and good.any():
            found = clearances.reach(kin, q[good])
            values = found.values * np.where(found.angular, _PER_RAD, 1.0)
            upright = values[:, np.array(found.names) != "tilt"]
            both[good] = np.minimum(both[good], np.stack([values.min(axis=1), upright.min(axis=1, initial=np.inf)], axis=1))
        return np.where(np.isnan(both), _NONE, both)

    def deepest(self, low: Floats, high: Floats) -> tuple[Floats, float, Lack]:
        """The best of a lattice, then compass steps; where the lean decides, and no place changes it, the rest does."""
        lattice = np.unique(np.stack(np.meshgrid(*np.linspace(low, high, _COARSE).T), axis=-1).reshape(-1, ANGLES), axis=0)
        place, best = lattice[0], np.array([-np.inf, -np.inf])
        around, step = lattice, 0.5 * (high - low) / (_COARSE - 1)
        while True:
            values = self._values(around)
            k = int((values @ _SCORE).argmax())
            if values[k] @ _SCORE > best @ _SCORE:
                place, best = around[k], values[k]
            else:
                step = 0.5 * step
            if float(step.max()) <= _FINE:
                return place, float(best[0]), self._deciding(place)
            around = np.clip(place + np.vstack([np.diag(step), -np.diag(step)]), low, high)

    def _deciding(self, place: Floats) -> MarginLacks:
        """What has least margin at a place (3,), as what it lacks."""
        found: list[tuple[float, str, float, str]] = []
        for kin, tip, axis in self.poses:
            branches = kin.inverse(tip + place, axis, near=self.machine.home)
            q = max(branches, key=lambda branch: float(self._joints(kin, branch)[:, 0].min()))
            found += self._columns(kin, q)
        margin, name, unit, of = min(found)
        return MarginLacks(name, -margin / unit if margin > _NONE else None, of)

    def _columns(self, kin: Kinematics, q: Floats) -> list[tuple[float, str, float, str]]:
        """(least margin of joints (N, J), what it is of, what its unit counts as, the unit), one each."""
        rad, mm = (_PER_RAD * DEG, "degrees"), (1.0, "mm")
        share = (_PER_SHARE, "of the stated distance from singular positions")
        limits = self.machine.limits
        travel = np.minimum(q - limits.lower, limits.upper - q) * np.where(self.machine.rotary, _PER_RAD, 1.0)
        if np.isnan(travel).any():
            return [(_NONE, "the rods do not reach that far", *mm)]
        result = [(float(column.min()), f"axis {name}", *(rad if rotary else mm)) for name, rotary, column in
                  zip(self.machine.axis_names, self.machine.rotary, travel.T, strict=True)]
        if is_checked(kin):
            found = clearances.reach(kin, q)
            values = np.nanmin(found.values * np.where(found.angular, _PER_RAD, 1.0), axis=0)
            result += [(value, name, *(rad if angular else mm)) for value, name, angular in
                       zip(values.tolist(), found.names, found.angular.tolist(), strict=True)]
        if kin.singular_names:
            away = np.nanmin(kin.singular_distance(q), axis=0) - self.least
            result += [(value, name, *share)
                       for value, name in zip((_PER_SHARE * away).tolist(), kin.singular_names, strict=True)]
        return result


def sampled(work: PassContext, least: float) -> Sampled:
    """The region of a parallel machine from the poses of `work`, its point at the table's origin."""
    groups: dict[tuple[float, bytes], list[tuple[Floats, Floats]]] = {}
    kins = {one.kin.tool_length: one.kin for one in work.passes}
    for one in work.passes:
        lift = max(0.0, work.space.plane(one.axis, True, _MARGIN) - float(one.axis @ (one.tip[-1] - work.space.centre)))
        tips = [one.tip, one.tip[[0, -1]] + lift * one.axes[[0, -1]], *(each.tip for each in one.stretches)]
        axes = [one.axes, one.axes[[0, -1]], *(each.axis for each in one.stretches)]
        key = (one.kin.tool_length, np.round(one.axis, 6).tobytes() if np.ptp(one.axes, axis=0).max() < 1e-9 else b"")
        groups.setdefault(key, []).append((np.concatenate(tips), np.concatenate(axes)))
    poses = [(kins[key[0]], *_outermost(*(np.concatenate(column) for column in zip(*rows, strict=True))))
             for key, rows in groups.items()]
    return Sampled(work.machine, tuple(poses), least)


def _outermost(tip: Floats, axis: Floats) -> tuple[Floats, Floats]:
    """Poses (K, 3) that reach farthest some path, and some between."""
    links = np.array([w for w in np.ndindex(3, 3, 3) if w != (1, 1, 1)], dtype=np.float64) - 1.0
    picked = [*(tip @ links.T).argmax(axis=0).tolist(), *np.linspace(0, len(tip) - 1, _POSES).astype(int).tolist(),
              *axis.argmax(axis=0).tolist(), *axis.argmin(axis=0).tolist()]
    rows = np.unique(picked)
    return tip[rows], axis[rows]
