"""The candidates of one pass as they are tried: which were planned, which lost and by what."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from machines.machine import Machine
from postproc.orientation.candidates.candidate_times import Candidate, turned, turned_all
from postproc.orientation.candidates.ranking import Ranking
from postproc.orientation.passes.allowed import SAME, AllowedAxes
from postproc.orientation.passes.passes import Pass
from postproc.orientation.passes.reasons import BoundTooLong, BrokenLimit, Refusal, RejectionKind, Slower, Touching, Unaimed
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

APART = 0.1 * DEG
"""of orientations that are reported as two"""
_WORTH = 1e-4
"""least part of the time that a candidate must gain to be planned, or to be taken"""


Reason = Refusal | Touching | BrokenLimit | BoundTooLong | Slower


def _kind(refused: Refusal | None) -> RejectionKind:
    """What a candidate that the machine cannot run loses by."""
    return "travel" if refused is not None and refused.kind == "travel" else "reach"


class Rejection(NamedTuple):
    """A candidate that was not taken, why and by what kind of reason; `Candidate.slim` but for the CL's own axis."""

    made: Candidate
    why: Reason
    kind: RejectionKind


@dataclass(frozen=True)
class PassSearch:
    """What was tried of a pass.

    Attributes:
        own, best, swift: the CL's axis, that of the least cuts, that of the least cuts and rapids together
        aimed: the paper's choice for the mean direction, None without a vertex in travel
        gains: seconds as ranked that `best` and `swift` gain over `own`
        rejected: candidates with their reasons, but those that stand where the best does; ranked times are
            reported next to the planned one of the best
        unaimed: why there is no `aimed`, None where there is one and where none is looked for
        pruned, planned: how many were discarded by the bound alone, how many timed
    """

    own: Candidate
    best: Candidate
    swift: Candidate
    aimed: Candidate | None
    gains: tuple[float, float]
    rejected: tuple[Rejection, ...]
    pruned: int
    planned: int
    unaimed: Unaimed | None = None


class CandidateSearch:
    """Candidates of one pass, each solved once, the runnable ones timed on the same knots."""

    def __init__(self, one: Pass, machine: Machine, allowed: AllowedAxes) -> None:
        self.one, self.machine, self.allowed = one, machine, allowed
        self.own = turned(one, one.axis, machine, allowed.touching)
        self.swift = self.own
        self.known = [self.own]
        self.lost: dict[int, Rejection] = {}
        self.pruned, self.planned = 0, 0
        self._times: dict[int, float] = {}
        self._ranking: Ranking | None = None

    def seconds(self, made: Candidate) -> float:
        """As ranked; inf where the machine cannot run it or something is touched."""
        return np.inf if made.refused or made.touching else self._ranked(made)

    def _ranked(self, made: Candidate) -> float:
        """Seconds of a runnable candidate, whatever it touches."""
        if id(made) not in self._times:
            self._ranking = self._ranking or Ranking(made)
            self._times[id(made)] = self._ranking.seconds(made)
            self.planned += 1
        return self._times[id(made)]

    def add(self, axes: Floats, apart: float = SAME, held: float = np.nan) -> list[Candidate]:
        """New candidates of axes (S, 3); those within `apart` of a known one are none, nor those that are not to be had."""
        fresh: list[Floats] = []
        others = [made.axis for made in self.known if made.same(made.axis, held)]
        for axis in axes:
            if not bool((angle_between(np.array([*others, *fresh]).reshape(-1, 3), axis) < apart).any()):
                fresh.append(axis)
        made = turned_all(self.one, np.array(fresh), self.machine, self.allowed.touching, held) if fresh else []
        self.known += made
        return [one for one in made if self._runs(one)]

    def _runs(self, made: Candidate) -> bool:
        """Whether a candidate is allowed and inside travel; why not is noted."""
        why = self.allowed.refused(self.one, made.axis)
        if why is not None:
            self.lose(made, why, "limits")
        elif made.refused is not None:
            self.lose(made, made.refused, _kind(made.refused))
        return why is None and made.refused is None

    def lose(self, made: Candidate, why: Reason, kind: RejectionKind) -> None:
        """Note why a candidate is rejected; times are reported at the end."""
        noted = made if made is self.own else made.slim(self._times.get(id(made), np.nan))
        self.lost[id(made)] = Rejection(noted, why, kind)

    def better(self, best: Candidate, made: Candidate) -> Candidate:
        """The better of two by their cuts, `made` being runnable.

        Where its bound already loses it is not planned, and what it touches is looked at only where it would win.
        """
        least = self.seconds(best) * (1.0 - _WORTH)
        if made.bound >= least and made.bound + made.rapids >= self._least_whole():
            self.pruned += 1
            self.lose(made, BoundTooLong(made.bound), "bound")
            return best
        self._swifter(made)
        if self._ranked(made) >= least:
            self.lose(made, Slower(), "slower")
        elif made.touching:
            self.lose(made, made.touching, "touches")
        else:
            self._beaten(best)
            return made
        return best

    def known_to_touch(self, made: Candidate) -> bool:
        """Whether something is touched, where that was looked at: a candidate that did not win was not."""
        return id(made) in self.lost and self.lost[id(made)].kind == "touches"

    def whole(self, made: Candidate) -> float:
        """Seconds of cuts and rapids together; inf as of `seconds`."""
        return self.seconds(made) + made.rapids if np.isfinite(made.rapids) else np.inf

    def _least_whole(self) -> float:
        return self.whole(self.swift) * (1.0 - _WORTH)

    def _swifter(self, made: Candidate) -> None:
        """Take note of a candidate whose cuts and rapids together are the least."""
        if self._ranked(made) + made.rapids < self._least_whole() and not made.touching:
            self.swift = made

    def _beaten(self, best: Candidate) -> None:
        """Note why one that was the best no longer is."""
        if best.refused:
            self.lose(best, best.refused, _kind(best.refused))
        elif best.touching:
            self.lose(best, best.touching, "touches")
        else:
            self.lose(best, Slower(), "slower")

    def settled(self, best: Candidate) -> Candidate:
        """The best, unless planned on knots of its own it is slower than the CL's own axis."""
        if best is self.own or best.seconds < self.own.seconds_allowed:
            return best
        self.lose(best, Slower(), "slower")
        self.lost.pop(id(self.own), None)
        return self.own

    def tried(self, winner: Candidate, aimed: Candidate | None, unaimed: Unaimed | None = None) -> PassSearch:
        """The result, `winner` being the best as ranked."""
        best = self.settled(winner)
        lost = [made for made in self.known if id(made) in self.lost and made is not best]
        rejected = tuple(self._noted(made, winner) for made in lost if not self._adjacent(made, best))
        gains = _gain(self.seconds(self.own), self.seconds(best)), _gain(self.whole(self.own), self.whole(self.swift))
        return PassSearch(self.own, best, self.swift, aimed, gains, rejected, self.pruned,
                          self.planned, unaimed)

    def _adjacent(self, made: Candidate, best: Candidate) -> bool:
        """Whether a slower candidate is the best itself to all that can be reported of it."""
        return made is not self.own and self.lost[id(made)].kind == "slower" and made.same(best.axis, best.held, APART)

    def _noted(self, made: Candidate, winner: Candidate) -> Rejection:
        """Why a candidate is rejected; a time as ranked by as much longer as the winner is when planned in
        full, and no gain that is not worth to be taken."""
        lost = self.lost[id(made)]
        if lost.kind != "slower":
            return lost
        if made is self.own or made is winner:
            return Rejection(lost.made if made is self.own else replace(lost.made, noted=made.seconds),
                             Slower(made.seconds), "slower")
        longer = winner.seconds / self._ranked(winner) if self._ranked(winner) > 0.0 else 1.0
        about = max(longer * self._ranked(made), winner.seconds)
        return Rejection(replace(lost.made, noted=about), Slower(about, about=True), "slower")


def _gain(before: float, after: float) -> float:
    """Seconds gained; 0 where neither can be run."""
    return before - after if np.isfinite(after) else 0.0
