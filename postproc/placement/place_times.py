"""The planned time of a whole file at one place of its part: cuts, rapids, turns, travel from home and back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import field, replace
from functools import partial
from hashlib import blake2b

import numpy as np

from machines.machine import Machine
from postproc.base.team import Crew, Processes, team_at_hand, working
from postproc.orientation.candidates.candidate_times import Candidate, turned
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.plans.index_time import PassEnds, ends, links_between
from postproc.orientation.plans.shortest_sequence import seconds
from postproc.placement.bodies import StationaryBodies
from postproc.placement.reasons import NearSingular, NoSafePlane, Obstacle, RefusedPass
from postproc.placement.rigid_move import moved
from postproc.placement.space import Space
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_WORTH = 1e-4
"""least part of the time that a place must gain to be planned"""
_LEAST, _MOST, _SITES = 24, 300, 2_000_000
"""places, and sites of cuts at all of them together"""
_DIGITS = 7
"""of joint positions, mm or rad: cuts that differ by less are one"""


@dataclass(frozen=True)
@arrays(place="6", low="J", high="J")
class TimedPlace:
    """A place that was looked at.

    Attributes:
        place (6,): see `postproc.placement.space`
        seconds: of the whole file; inf where it is refused or its bound lost
        cutting, linking: seconds of the cuts, and of rapids, turns and travel home
        bound: least seconds that the file can take there
        low, high (J,): extents of the joints over all cuts and rapids, NaN where the machine does not reach
        singular: least distance from singular positions, inf for serial machines
        refused: why the part cannot stand there, None where it can
        limiting: planned seconds by what limits the passes most, e.g. {"X jerk": 3.2}; those of holes are not in it
    """

    place: Floats
    seconds: float
    cutting: float
    linking: float
    bound: float
    low: Floats
    high: Floats
    singular: float
    refused: Obstacle | None = None
    limiting: dict[str, float] = field(default_factory=dict)

    def margins(self, machine: Machine) -> Floats:
        """(J,) mm or rad that each joint stays inside its travel, negative outside, inf where it has no end."""
        return np.asarray(np.minimum(self.low - machine.limits.lower, machine.limits.upper - self.high))

    def shares(self, machine: Machine) -> tuple[float, ...]:
        """Margins of the joints that have an end over half their travel, least first."""
        half = 0.5 * (machine.limits.upper - machine.limits.lower)
        ends = np.isfinite(half)
        return tuple(np.sort(self.margins(machine)[ends] / half[ends]).round(6).tolist())


@dataclass(frozen=True)
class PlacedCut:
    """A cut at a place: of which pass and line, how the joints go (see `_link`), the least seconds that it can take, and
    what plans it: its seconds, what limits them, and whether the plan was solved."""

    number: int
    line: int
    link: bytes
    bound: float
    plan: Callable[[], tuple[float, str, bool]] | None


@dataclass(frozen=True)
@arrays(place="6", low="J", high="J")
class SeenPlace:
    """A place as it is before its cuts are planned; see `TimedPlace`."""

    place: Floats
    cuts: tuple[PlacedCut, ...]
    linking: float
    low: Floats
    high: Floats
    singular: float


@dataclass(frozen=True)
class _Cut:
    """What is known of a pass whose joints go this way, wherever they begin."""

    bound: float
    planned: tuple[float, str] | None = None


class Timer:
    """Times of a file at places, each path of the joints planned once.

    A plan depends on how the joints go, not on where: on serial machines moving the part along its table does
    not change passes during which no rotary joint turns, and a table that turns back what the part is turned
    changes nothing at all. Where the machine file limits forces of motors, each place is planned.

    Args:
        work: the file with its part frame on the table frame
        least: distance that a parallel machine keeps from its singular positions
        bodies: that do not move with the part

    Attributes:
        most: places that may be looked at, fewer of long files
        looked, refused, pruned: places that were, where the part cannot stand, and rejected by their bound alone
        planned: cuts
        unsolved: lines of passes with a plan that was not solved, whose time is longer than need be
    """

    def __init__(self, work: PassContext, space: Space, least: float,
                 bodies: StationaryBodies | None = None) -> None:
        self.work, self.space, self.least, self.bodies = work, space, least, bodies
        self.planned, self.looked, self.pruned, self.refused = 0, 0, 0, 0
        self.unsolved: set[int] = set()
        self._cuts: dict[tuple[int, bytes], _Cut] = {}
        self._known: dict[bytes, TimedPlace] = {}
        self.ahead: dict[bytes, SeenPlace | TimedPlace] = {}
        self.crew: Crew[tuple[Floats, float], SeenPlace | TimedPlace] | None = None
        sites = sum(len(each.s) for one in work.passes for each in one.stretches)
        self.most = min(_MOST, max(_LEAST, _SITES // max(1, sites)))

    @property
    def machine(self) -> Machine:
        return self.work.machine

    def known(self) -> list[TimedPlace]:
        """Every place that was looked at."""
        return list(self._known.values())

    def tried(self, place: Floats, best: float = np.inf) -> TimedPlace:
        """A place (6,); its seconds are inf where they are proved not to be below `best`."""
        key = _key(place)
        found = self._known.get(key)
        if found is not None and (np.isfinite(found.seconds) or found.refused or found.bound >= best * (1.0 - _WORTH)):
            return found
        if found is None:
            self.looked += 1
        self._known[key] = made = self._tried(place, best)
        self.refused += bool(made.refused) and found is None
        return made

    def _tried(self, place: Floats, best: float) -> TimedPlace:
        seen = self.ahead.pop(_key(place), None) or self.seen(place)
        if isinstance(seen, TimedPlace):
            return seen
        cuts, bound, lost = self._cutting(seen, best - seen.linking)
        if lost:
            self.pruned += 1
            return TimedPlace(place, np.inf, np.inf, seen.linking, bound + seen.linking, seen.low, seen.high, seen.singular)
        cutting = float(sum(each[0] for each in cuts))
        return TimedPlace(place, cutting + seen.linking, cutting, seen.linking, bound + seen.linking, seen.low, seen.high,
                          seen.singular, None, limiting_times(cuts))

    def seen(self, place: Floats) -> SeenPlace | TimedPlace:
        """A place (6,) with its cuts to be planned; refused, or timed without a bound, where that is known already."""
        why = self.stands(place)
        if why is not None:
            return self._refused(place, why)
        work = moved(self.work, self.space.placement(place))
        made = [turned(one, one.axis, work.machine) for one in work.passes]
        low, high = extents(made)
        why = refused_pass(made)
        if why is not None:
            return self._refused(place, why, low, high)
        singular, near = self._singular(made)
        edge = [ends(one, work) for one in made]
        why = near or _no_height(edge, made) or (None if self.bodies is None else self.bodies.tool(work))
        if why is not None:
            return self._refused(place, why, low, high, singular)
        cuts = tuple(PlacedCut(one.one.number, one.one.line, _link(one), one.bound, partial(_planned, one))
                     for one in made)
        return SeenPlace(place, cuts, _linking(work, edge), low, high, singular)

    def planned_ahead(self, place: Floats, best: float) -> SeenPlace | TimedPlace:
        """In a worker: `seen`, its cuts planned as long as the place can take less than `best`."""
        found = self.seen(place)
        if isinstance(found, TimedPlace):
            return found
        total, made = found.linking + sum(cut.bound for cut in found.cuts), [replace(cut, plan=None) for cut in found.cuts]
        for k in np.argsort([-cut.bound for cut in found.cuts], kind="stable").tolist():
            plan = found.cuts[k].plan
            if plan is None or total >= best * (1.0 - _WORTH):
                break
            known = plan()
            made[k] = replace(made[k], plan=partial(_known, known))
            total += known[0] - made[k].bound
        return replace(found, cuts=tuple(made))

    def look_ahead(self, places: Sequence[Floats], best: float) -> None:
        """Have the workers, where there are some, look at places that will be asked for next; nothing else changes by it."""
        team = team_at_hand()
        fresh = [place for place in places if _key(place) not in self._known and _key(place) not in self.ahead]
        if team is None or team.size < 2 or len(fresh) < 2:
            return
        if self.crew is None:
            self.crew = team.crew(_ahead, self._alone())
        made = self.crew.results([(place, best) for place in fresh])
        self.ahead |= {_key(place): seen for place, seen in zip(fresh, made, strict=True)}

    def _here(self, seen: SeenPlace) -> SeenPlace:
        """The same place, all of its cuts to be planned here."""
        made = self.seen(seen.place)
        return seen if isinstance(made, TimedPlace) else made

    def _alone(self) -> Timer:
        """Itself as workers get it: without what it has found."""
        other = copy(self)
        other._known, other._cuts, other.ahead, other.crew = {}, {}, {}, None
        return other

    def close(self) -> None:
        """The workers are free."""
        if self.crew is not None:
            self.crew.close()
        self.crew = None

    def stands(self, place: Floats) -> Obstacle | None:
        """What the part would stand in or hang over, None where it stands free."""
        over = self.space.overhang(place)
        return over or (None if self.bodies is None else self.bodies.against(self.space.placement(place)))

    def _refused(self, place: Floats, why: Obstacle, low: Floats | None = None, high: Floats | None = None,
                 singular: float = np.nan) -> TimedPlace:
        none = np.full(len(self.machine.axis_names), np.nan)
        return TimedPlace(place, np.inf, np.inf, np.inf, np.inf, none if low is None else low,
                          none if high is None else high,
                          singular, why)

    def _singular(self, made: Sequence[Candidate]) -> tuple[float, NearSingular | None]:
        """Least distance from singular positions over all poses of a parallel machine, and what stands against it."""
        kin = self.machine.kinematics
        if not kin.singular_names:
            return np.inf, None
        found = np.concatenate([kin.singular_distance(q) for one in made for q in (one.q, *one.sites)])
        row, which = np.unravel_index(int(np.nanargmin(found)), found.shape)
        value = float(found[row, which])
        return value, NearSingular(kin.singular_names[int(which)], value, self.least) if value < self.least else None

    def _cutting(self, seen: SeenPlace, best: float) -> tuple[list[tuple[float, str]], float, bool]:
        """(seconds and what limits of each pass, bound, True where all together are proved not to be below `best`)."""
        keys = [(cut.number, cut.link) for cut in seen.cuts]
        for cut, key in zip(seen.cuts, keys, strict=True):
            if key not in self._cuts:
                self._cuts[key] = _Cut(cut.bound)
        bounds = [self._cuts[key].bound for key in keys]
        total = bound = float(sum(bounds))
        for k in np.argsort(-np.array(bounds), kind="stable").tolist():
            planned = self._cuts[keys[k]].planned
            if planned is None:
                if total >= best * (1.0 - _WORTH):
                    return [], total, True
                self.planned += 1
                plan = seen.cuts[k].plan
                if plan is None:  # a worker stopped before it: by another bound of a cut with the same joints
                    seen = self._here(seen)
                    plan = seen.cuts[k].plan
                spent, name, solved = plan() if plan is not None else (np.inf, "", False)
                planned = spent, name
                self._cuts[keys[k]] = _Cut(self._cuts[keys[k]].bound, planned)
                self.unsolved |= set() if solved else {seen.cuts[k].line}
            total += planned[0] - bounds[k]
        done = [self._cuts[key].planned for key in keys]
        return [one for one in done if one is not None], bound, False


def _key(place: Floats) -> bytes:
    return bytes((np.round(place, 9) + 0.0).tobytes())


def _planned(made: Candidate) -> tuple[float, str, bool]:
    return made.seconds, limit_of(made), made.solved


def limit_of(made: Candidate) -> str:
    """What limits a pass most, "X jerk" or "feed"; empty where it only drills, or the machine states no jerk."""
    return " ".join(made.limiting).strip()


def limiting_times(cuts: Iterable[tuple[float, str]]) -> dict[str, float]:
    """Seconds by what limits them, of (seconds, `limit_of`) each; see `TimedPlace`."""
    times: dict[str, float] = {}
    for spent, name in cuts:
        if name:
            times[name] = times.get(name, 0.0) + spent
    return times


def _known(plan: tuple[float, str, bool]) -> tuple[float, str, bool]:
    return plan


def _ahead(timer: Timer, asked: tuple[Floats, float]) -> SeenPlace | TimedPlace:
    """In a worker: it asks nobody else."""
    with working(Processes(1)):
        return timer.planned_ahead(*asked)


def _linking(work: PassContext, edge: list[PassEnds]) -> float:
    """Seconds of rapids, turns, and travel from home and back."""
    rapids = [np.array([one.rapids]) for one in edge]
    return seconds([0] * len(edge), rapids, links_between(work, [[one] for one in edge]))


def refused_pass(made: Sequence[Candidate]) -> RefusedPass | None:
    """The first pass that the machine cannot run."""
    return next((RefusedPass(one.one.line, one.refused) for one in made if one.refused is not None), None)


def _no_height(edge: list[PassEnds], made: Sequence[Candidate]) -> NoSafePlane | None:
    """A pass above which the safe plane is outside travel."""
    line = next((one.one.line for one, end in zip(made, edge, strict=True) if not np.isfinite(end.down + end.up)), None)
    return None if line is None else NoSafePlane(line)


def extents(made: Sequence[Candidate]) -> tuple[Floats, Floats]:
    """Least and greatest joints (J,) of all rows and sites."""
    every = [q for one in made for q in (one.q, *one.sites)]
    return (np.min([q.min(axis=0) for q in every], axis=0), np.max([q.max(axis=0) for q in every], axis=0))


def _link(made: Candidate) -> bytes:
    """A mark of how the joints go along the cuts of a pass, whatever they begin at; where forces of motors are limited the
    place counts too, on which they depend."""
    mark = blake2b(digest_size=16)
    rows, placed = made.one.drilled.rows, made.limits.forces is not None
    for link in (*(q if placed else q - q[0] for q in made.sites), made.q[rows] - made.q[rows - 1]):
        mark.update((np.round(link, _DIGITS) + 0.0).tobytes())
    return mark.digest()
