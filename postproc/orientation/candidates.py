"""Tool axes worth trying for a pass: its own, those that aim a vertex, the best reach where there is none, refined ones."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from machines.polytope import held_axis_polytope
from postproc.orientation.allowed import SAME, Allowed
from postproc.orientation.passes import Pass
from postproc.orientation.timed import Turned, turned
from postproc.orientation.vertices import vertex_angles
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

_SEEDS = 6
_APART = 5.0 * DEG
_NEAR = 1.0 * DEG
"""an axis that aims at the beginning or the end of a pass is tried where it is so far from all others"""
_STEPS = (6.0 * DEG, 3.0 * DEG, 1.5 * DEG)
"""of the refinement"""
_WORTH = 1e-4
"""least part of the time that a candidate must gain to be planned, or to be taken"""


@dataclass(frozen=True)
class Tried:
    """What was tried of a pass: `own`, the `best`, the paper's choice for the mean direction (None without a vertex in
    travel), all candidates with what they lost by, and how many were discarded by the bound alone."""

    own: Turned
    best: Turned
    aimed: Turned | None
    rejected: tuple[tuple[Turned, str], ...]
    pruned: int
    planned: int


class Search:
    """Candidates of one pass, each solved once."""

    def __init__(self, one: Pass, machine: Machine, allowed: Allowed) -> None:
        self.one, self.machine, self.allowed = one, machine, allowed
        self.own = turned(one, one.axis, machine, allowed.touching)
        self.known = [self.own]
        self.lost: dict[int, str] = {}
        self.pruned, self.counted = 0, 1

    def add(self, axis: Floats, apart: float = SAME) -> Turned | None:
        """A new candidate; None where one within `apart` is known already or it is not to be had."""
        if bool((angle_between(np.stack([other.axis for other in self.known]), axis) < apart).any()):
            return None
        made = turned(self.one, axis, self.machine, self.allowed.touching)
        self.known.append(made)
        why = self.allowed.refused(self.one, axis) or made.refused
        if why:
            self.lost[id(made)] = why
            return None
        return made

    def better(self, best: Turned, made: Turned) -> Turned:
        """The better of two; a candidate whose bound already loses is not planned."""
        if made.bound >= best.seconds_allowed * (1.0 - _WORTH):
            self.pruned += 1
            self.lost[id(made)] = f"takes at least {made.bound:.4f} s"
            return best
        self.counted += 1
        if made.seconds < best.seconds_allowed * (1.0 - _WORTH) and made.touching:
            self.lost[id(made)] = made.touching
            return best
        winner, loser = (made, best) if made.seconds < best.seconds_allowed * (1.0 - _WORTH) else (best, made)
        why = loser.touching if loser is not made else ""
        self.lost[id(loser)] = why or f"takes {loser.seconds:.4f} s"
        self.lost.pop(id(winner), None)
        return winner


def tried(one: Pass, machine: Machine, allowed: Allowed) -> Tried:
    """All candidates of a pass, planned unless their bound says that they lose."""
    search = Search(one, machine, allowed)
    if one.fixed:
        return Tried(search.own, search.own, None, (), 0, 1)
    aimed = _aimed(search)
    seeds = [made for axes in aimed.values() for made in axes]
    if not seeds:
        seeds = [made for axis in _by_reach(search) if (made := search.add(axis)) is not None]
    best = search.own
    for made in sorted(seeds, key=lambda m: m.bound):
        best = search.better(best, made)
    for step in _STEPS:
        best = _refined(search, best, step)
    rejected = tuple((made, search.lost[id(made)]) for made in search.known if id(made) in search.lost and made is not best)
    return Tried(search.own, best, _least_turned(aimed.get("mean", [])), rejected, search.pruned, search.counted)


def _aimed(search: Search) -> dict[str, list[Turned]]:
    """Axes that aim a vertex along the mean, initial and final direction, inside travel and tilt."""
    stretch = search.one.longest
    if stretch is None or search.own.refused == "out of reach":
        return {}
    limits, kin = search.machine.limits, search.one.kin
    limit = limits.jerk if np.isfinite(limits.jerk).all() else limits.acceleration
    q = search.own.sites[0][0]
    result: dict[str, list[Turned]] = {}
    for name, direction in stretch.directions().items():
        axes = _axes_at(kin, q, vertex_angles(kin, q, direction, limit))
        apart = SAME if name == "mean" else _NEAR
        result[name] = [made for axis in axes if (made := search.add(axis, apart)) is not None]
    return result


def _axes_at(kin: Kinematics, q: Floats, angles: Floats) -> Floats:
    """Tool axes (S, 3) at rotary positions (S, 2)."""
    joints = np.tile(q, (len(angles), 1))
    if len(angles):
        joints[:, np.flatnonzero(kin.rotary)] = angles
    return kin.forward(joints)[1] if len(angles) else np.zeros((0, 3))


def _least_turned(made: list[Turned]) -> Turned | None:
    """The paper's choice: of the solutions within travel that with the smallest angles (section III.B)."""
    def angles(one: Turned) -> tuple[float, float]:
        values = [abs(value) for value in one.rotary().values()]
        return round(max(values), 6), round(sum(values), 6)
    return min(made, key=angles, default=None)


def _by_reach(search: Search) -> Iterator[Floats]:
    """Axes within the tilt whose polytope reaches farthest along the mean direction, on any machine."""
    one, machine, stretch = search.one, search.machine, search.one.longest
    if stretch is None:
        return
    limits = machine.limits
    limit = limits.jerk if np.isfinite(limits.jerk).all() else limits.acceleration
    cap = search.allowed.tilt if not len(one.normal) else np.pi / 2
    axes = one.kin.nearest_axis(_cap(one.axis, min(cap, np.pi - 0.1)))
    middle = stretch.tip[len(stretch.tip) // 2] + one.radius * (one.axis - axes)
    q = one.kin.inverse(middle, axes, near=machine.home)
    direction = stretch.directions().get("mean")
    if direction is None:
        return
    near = np.hstack((middle, axes))
    reach = np.stack([held_axis_polytope(one.kin, branch, limit, near).reach(direction) for branch in q])
    best = np.nan_to_num(reach, nan=-1.0).max(axis=0)
    taken: list[Floats] = []
    for k in np.argsort(-best, kind="stable").tolist():
        if len(taken) == _SEEDS or best[k] <= 0.0:
            return
        if all(angle_between(axes[k], other) > _APART for other in taken) and not search.allowed.refused(one, axes[k]):
            taken.append(axes[k])
            yield axes[k]


def _cap(axis: Floats, tilt: float) -> Floats:
    """Directions (N, 3) within `tilt` of `axis`, some 5 degrees apart."""
    x, y = _across(axis)
    result = []
    for ring in np.linspace(0.0, tilt, max(2, int(np.ceil(tilt / _APART)) + 1))[1:]:
        count = max(6, int(np.ceil(2.0 * np.pi * np.sin(ring) / _APART)))
        phi = np.arange(count) * 2.0 * np.pi / count
        across = np.cos(phi)[:, None] * x + np.sin(phi)[:, None] * y
        result.append(np.cos(ring) * axis + np.sin(ring) * across)
    return np.concatenate(result)


def _across(axis: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors square to `axis` and to each other."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x)
    return x, np.cross(axis, x)


def _refined(search: Search, best: Turned, step: float) -> Turned:
    """The best of an axis and its four neighbours; where one gains, those further along."""
    for _ in range(3):
        x, y = _across(best.axis)
        start = best
        for way in (x, -x, y, -y):
            axis = search.one.kin.nearest_axis((np.cos(step) * start.axis + np.sin(step) * way)[None])[0]
            made = search.add(axis)
            if made is not None:
                best = search.better(best, made)
        if best is start:
            break
    return best
