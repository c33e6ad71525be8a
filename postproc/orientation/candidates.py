"""Tool axes worth trying for a pass: its own, those that aim a vertex, the best reach where there is none, refined ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from machines.machine import Machine
from postproc.orientation.allowed import SAME, Allowed
from postproc.orientation.held import best_held
from postproc.orientation.passes import Pass
from postproc.orientation.ranking import Ranking
from postproc.orientation.seeds import across, aimed_axes, reaching_axes
from postproc.orientation.timed import Turned, turned, turned_all
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

_NEAR = 1.0 * DEG
"""an axis that aims at the beginning or the end of a pass is tried where it is so far from all others"""
_STEPS = (6.0 * DEG, 3.0 * DEG, 1.5 * DEG)
"""of the refinement"""
_WORTH = 1e-4
"""least part of the time that a candidate must gain to be planned, or to be taken"""
Kind = Literal["limits", "reach", "travel", "touches", "bound", "slower"]
"""What a candidate can lose by."""


class Lost(NamedTuple):
    """A candidate that was not taken, why and by what kind of reason; `Turned.slim` but for the CL's own axis."""

    made: Turned
    why: str
    kind: Kind


@dataclass(frozen=True)
class Tried:
    """What was tried of a pass: `own`, the `best`, the paper's choice for the mean direction (None without a vertex in
    travel), all candidates with what they lost by, and how many were discarded by the bound alone."""

    own: Turned
    best: Turned
    aimed: Turned | None
    rejected: tuple[Lost, ...]
    pruned: int
    planned: int


class Search:
    """Candidates of one pass, each solved once, the runnable ones timed on the same knots."""

    def __init__(self, one: Pass, machine: Machine, allowed: Allowed) -> None:
        self.one, self.machine, self.allowed = one, machine, allowed
        self.own = turned(one, one.axis, machine, allowed.touching)
        self.known = [self.own]
        self.lost: dict[int, Lost] = {}
        self.pruned, self.planned = 0, 0
        self._times: dict[int, float] = {}
        self._ranking: Ranking | None = None

    def seconds(self, made: Turned) -> float:
        """As ranked; inf where the machine cannot run it or something is touched."""
        return np.inf if made.refused or made.touching else self._ranked(made)

    def _ranked(self, made: Turned) -> float:
        """Seconds of a runnable candidate, whatever it touches."""
        if id(made) not in self._times:
            self._ranking = self._ranking or Ranking(made)
            self._times[id(made)] = self._ranking.seconds(made)
            self.planned += 1
        return self._times[id(made)]

    def add(self, axes: Floats, apart: float = SAME, held: float = np.nan) -> list[Turned]:
        """New candidates of axes (S, 3); those within `apart` of a known one are none, nor those that are not to be had."""
        fresh: list[Floats] = []
        others = [made.axis for made in self.known if made.same(made.axis, held)]
        for axis in axes:
            if not bool((angle_between(np.array([*others, *fresh]).reshape(-1, 3), axis) < apart).any()):
                fresh.append(axis)
        made = turned_all(self.one, np.array(fresh), self.machine, self.allowed.touching, held) if fresh else []
        self.known += made
        return [one for one in made if self._runs(one)]

    def _runs(self, made: Turned) -> bool:
        """Whether a candidate is allowed and inside travel; why not is noted."""
        why = self.allowed.refused(self.one, made.axis)
        if why or made.refused:
            kind: Kind = "limits" if why else "travel" if made.refused.startswith("travel") else "reach"
            self.lose(made, why or made.refused, kind)
        return not (why or made.refused)

    def lose(self, made: Turned, why: str, kind: Kind) -> None:
        """Note what a candidate lost by."""
        told = made if made is self.own else made.slim(self._times.get(id(made), np.nan))
        self.lost[id(made)] = Lost(told, why, kind)

    def better(self, best: Turned, made: Turned) -> Turned:
        """The better of two, `made` being runnable; where its bound already loses it is not planned, and what it touches is
        looked at only where it would win."""
        least = self.seconds(best) * (1.0 - _WORTH)
        if made.bound >= least:
            self.pruned += 1
            self.lose(made, f"takes at least {made.bound:.4f} s", "bound")
        elif self._ranked(made) >= least:
            self.lose(made, f"takes {self._ranked(made):.4f} s", "slower")
        elif made.touching:
            self.lose(made, made.touching, "touches")
        else:
            self._beaten(best)
            return made
        return best

    def _beaten(self, best: Turned) -> None:
        """Note why one that was the best no longer is."""
        if best.refused:
            self.lose(best, best.refused, "travel" if best.refused.startswith("travel") else "reach")
        elif best.touching:
            self.lose(best, best.touching, "touches")
        else:
            self.lose(best, f"takes {self._ranked(best):.4f} s", "slower")

    def settled(self, best: Turned) -> Turned:
        """The best, unless planned on knots of its own it is slower than the CL's own axis."""
        if best is self.own or best.seconds < self.own.seconds_allowed:
            return best
        self.lose(best, f"takes {best.seconds:.4f} s", "slower")
        self.lost.pop(id(self.own), None)
        return self.own

    def tried(self, best: Turned, aimed: Turned | None) -> Tried:
        """The result."""
        rejected = tuple(self.lost[id(made)] for made in self.known if id(made) in self.lost)
        return Tried(self.own, best, aimed, rejected, self.pruned, self.planned)


def tried(one: Pass, machine: Machine, allowed: Allowed, hints: Sequence[Floats] = ()) -> Tried:
    """All candidates of a pass, planned unless their bound says that they lose; `hints` are axes (3,) to try as well."""
    search = Search(one, machine, allowed)
    if one.fixed:
        return search.tried(search.settled(best_held(search, search.own)), None)
    aimed = aimed_axes(one, machine, search.own.q[0])
    mean = search.add(aimed["mean"]) if "mean" in aimed else []
    seeds = [*mean, *(made for name in ("initial", "final") if name in aimed for made in search.add(aimed[name], _NEAR))]
    if not seeds:
        tilt = np.pi / 2.0 if len(one.normal) else allowed.tilt
        seeds = search.add(reaching_axes(one, machine, tilt, lambda axes: allowed.mask(one, axes)))
    seeds += search.add(np.array(hints).reshape(-1, 3))
    best = search.own
    for made in sorted(seeds, key=lambda m: m.bound):
        best = search.better(best, made)
    for step in _STEPS:
        best = _refined(search, best, step)
    return search.tried(search.settled(best_held(search, best)), _least_turned(mean))


def _least_turned(made: list[Turned]) -> Turned | None:
    """The paper's choice: of the solutions within travel that with the smallest angles (section III.B)."""
    def angles(one: Turned) -> tuple[float, float]:
        values = [abs(value) for value in one.rotary().values()]
        return round(max(values), 6), round(sum(values), 6)
    return min(made, key=angles, default=None)


def _refined(search: Search, best: Turned, step: float) -> Turned:
    """The best of an axis and its four neighbours; where one gains, those further along."""
    for _ in range(3):
        start, (x, y) = best, across(best.axis)
        ways = np.stack((x, -x, y, -y))
        for made in search.add(search.one.kin.nearest_axis(np.cos(step) * start.axis + np.sin(step) * ways)):
            best = search.better(best, made)
        if best is start:
            break
    return best
