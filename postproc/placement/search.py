"""The search: every orientation of the part, places on a low-discrepancy set inside travel, then compass steps.

Places that travel rules out are never planned, nor are those whose bound is not below the best time so far.
"""

from __future__ import annotations

from dataclasses import field

import numpy as np

from postproc.base.progress import Progress
from postproc.placement.place_times import TimedPlace, Timer
from postproc.placement.reasons import Obstacle, SmallTable
from postproc.placement.region import Region, region_of
from postproc.placement.space import ANGLES, FINE, Space
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.units import DEG

EQUAL = 2e-4
"""part of the time by which places are equal; travel margin decides among them"""
_SPREAD, _SEEDS = 64, 6
"""places of each attitude that travel is asked about, and those of them that may be timed"""
_FIRST = 2
"""of those, timed at all attitudes: most margin, and as near as can be to where the part stands"""
_LIKELY = 6
"""attitudes that are timed at all of them"""
_STARTS, _DISTINCT = 3, 12.0 * DEG
"""attitudes that are refined, and how far they are from each other"""
_FINEST = (1.0, 0.25 * DEG)
"""mm, rad: the last compass steps"""
_POLISH = 60
_SLACK = 1e-6
_AT_ONCE = 8
"""places that workers look at together, before the best of them bounds the next"""


@dataclass
class FoundPlaces:
    """What a search found.

    Attributes:
        best: of least time, most travel margin among equals; None where the part can stand nowhere
        lacks: (turn, tilt_y, tilt_x) with the margin that is missing at best, mm (nan: the attitude cannot be
            had anywhere), and why, of attitudes without a place
    """

    now: TimedPlace
    best: TimedPlace | None = None
    lacks: list[tuple[Floats, float, Obstacle]] = field(default_factory=list)
    attitudes: int = 0
    screened: int = 0


class PlaceSearch:
    """See the module; places are looked at in an order that depends on nothing but the file and the limits."""

    def __init__(self, timer: Timer, space: Space, progress: Progress | None = None) -> None:
        self.timer, self.space, self.progress = timer, space, progress
        now = timer.tried(space.now)
        self.found = FoundPlaces(now, now if not now.refused and space.holds(space.now) else None)

    @property
    def spent(self) -> bool:
        """True where no more places may be looked at."""
        return self.timer.looked >= self.timer.most

    def run(self) -> FoundPlaces:
        """All of it."""
        attitudes = self.space.attitudes()
        self.found.attitudes = len(attitudes)
        seeds = [seeds for k, angles in enumerate(attitudes) if (seeds := self._seeds(angles, k, len(attitudes)))]
        self._look_at(self._by_bound([place for group in seeds for place in group[:_FIRST]]))
        likely = [one.place[ANGLES:] for one in self._starts(_LIKELY, 0.0)]
        more = [place for group in seeds for place in group[_FIRST:]
                if any(np.abs(place[ANGLES:] - angles).max() < 1e-9 for angles in likely)]
        self._look_at(self._by_bound(more))
        for start in self._starts(_STARTS, _DISTINCT):
            self._compass(self.timer.tried(start.place))
        if self.found.best is not None:
            self.found.best = self._roomiest(self.found.best, _POLISH)
        return self.found

    def among(self, likely: list[TimedPlace]) -> FoundPlaces:
        """The best of places that another search found likely, and compass steps from it; few, where each costs much."""
        self.timer.look_ahead([one.place for one in likely[:max(self.timer.most // 2 - self.timer.looked, 0)]], np.inf)
        for one in likely:
            if self.timer.looked < self.timer.most // 2:
                self._look(one.place)
        if self.found.best is not None:
            self._compass(self.found.best)
            self.found.best = self._roomiest(self.found.best, 0)
        return self.found

    def _look_at(self, places: list[Floats]) -> None:
        """Time places one after the other; workers are some ahead."""
        for k, place in enumerate(places):
            if k % _AT_ONCE == 0 and not self.spent:
                self.timer.look_ahead(places[k:k + _AT_ONCE], np.inf if self.found.best is None else self.found.best.seconds)
            self._look(place)

    def _look(self, place: Floats) -> TimedPlace | None:
        """Time a place; it becomes the best where it is."""
        if self.spent:
            return None
        if self.progress is not None:
            self.progress("placing", self.timer.looked, self.timer.most)
        best = self.found.best
        made = self.timer.tried(place, np.inf if best is None else best.seconds)
        if best is None or made.seconds < best.seconds:
            self.found.best = made if np.isfinite(made.seconds) else best
        return made

    def _seeds(self, angles: Floats, number: int, of: int) -> list[Floats]:
        """Places (6,) of a part turned this way that are inside travel, that of most margin first."""
        if self.progress is not None:
            self.progress("travel", number, of)
        low, high = self.space.room(angles)
        if bool((low > high + _SLACK).any()):
            over = float((low - high).max())
            self.found.lacks.append((angles, -over, SmallTable(over)))
            return []
        region, why = region_of(self.timer.work, self.space, angles, self.timer.least)
        if region is None:
            self.found.lacks += [] if why is None else [(angles, np.nan, why)]
            return []
        high = np.maximum(low, high)
        centre, margin, what = region.deepest(low, high)
        if margin < -_SLACK:
            self.found.lacks.append((angles, margin, what))
            return []
        return self._inside(region, centre, angles, low, high)

    def _inside(self, region: Region, centre: Floats, angles: Floats, low: Floats,
                high: Floats) -> list[Floats]:
        """The centre of a region, the present place where it is inside, and some spread over it."""
        from scipy.stats import qmc

        spread = low + (high - low) * qmc.Halton(ANGLES, scramble=False).random(_SPREAD)
        places = np.vstack([centre, self.space.now[:ANGLES], np.clip(self.space.now[:ANGLES], low, high), spread])
        every = np.array([self.space.snapped(np.append(place, angles)) for place in places])
        good = np.array([self.space.holds(place) for place in every])
        good[good] = region.margins(every[good][:, :ANGLES]) >= -_SLACK
        self.found.screened += len(every)
        kept: dict[bytes, Floats] = {}
        for place in every[good]:
            key = (place + 0.0).tobytes()
            if key not in kept and not self.timer.stands(place):
                kept[key] = place
            if len(kept) == _SEEDS:
                break
        against = self.timer.stands(every[good][0]) if not kept and bool(good.any()) else None
        self.found.lacks += [] if against is None else [(angles, np.nan, against)]
        return list(kept.values())

    def _by_bound(self, places: list[Floats]) -> list[Floats]:
        """The places by the least time that the file can take there."""
        if self.found.best is None or len(places) < 2:
            return places
        self.timer.look_ahead(places[:self.timer.most], 0.0)
        bounds = [self.timer.tried(place, 0.0).bound for place in places if not self.spent]
        return [places[k] for k in np.argsort(bounds, kind="stable").tolist()]

    def likely(self) -> list[TimedPlace]:
        """The best place of each attitude, the best first."""
        return self._starts(len(self.space.attitudes()), 0.0)

    def _starts(self, count: int, apart: float) -> list[TimedPlace]:
        """The best place of each of the best attitudes that are more than `apart` rad from each other.

        A place rejected by its bound counts with that: attitudes are likely by the least time they can take.
        """
        good = sorted((one for one in self.timer.known() if not one.refused and self.space.holds(one.place)),
                      key=lambda one: one.seconds if np.isfinite(one.seconds) else one.bound)
        taken: list[TimedPlace] = []
        for one in good:
            if len(taken) < count and all(np.abs(one.place - other.place)[ANGLES:].max() > apart for other in taken):
                taken.append(one)
        return taken

    def _compass(self, start: TimedPlace) -> None:
        """Steps along each coordinate, halved where none gains."""
        steps = self._first_steps()
        at = start
        while not self.spent and self._coarse(steps):
            before = at
            around = list(self.space.neighbours(at.place, steps))
            self.timer.look_ahead(around, at.seconds)
            for place in around:
                made = self._nearer(place, at)
                at = made if made is not None else at
            if at is before:
                steps = 0.5 * steps

    def _nearer(self, place: Floats, at: TimedPlace) -> TimedPlace | None:
        """The place where it is better than `at`."""
        if self.spent:
            return None
        if self.progress is not None:
            self.progress("placing", self.timer.looked, self.timer.most)
        made = self.timer.tried(place, at.seconds)
        if self.found.best is None or made.seconds < self.found.best.seconds:
            self.found.best = made if np.isfinite(made.seconds) else self.found.best
        return made if made.seconds < at.seconds * (1.0 - 1e-6) else None

    def _first_steps(self) -> Floats:
        """A quarter of each range, at most 64 mm and a little over half the distance of the attitudes."""
        most = np.array([64.0] * ANGLES + [8.0 * DEG] * ANGLES)
        return np.array([max(min(0.25 * (one.high - one.low), top), fine)
                         for one, top, fine in zip(self.space.dims, most, FINE, strict=True)])

    def _coarse(self, steps: Floats) -> bool:
        """True while some step is worth taking; lists are stepped through once."""
        finest = np.array([_FINEST[0]] * ANGLES + [_FINEST[1]] * ANGLES)
        return any(steps[k] >= finest[k] for k in self.space.free)

    def _roomiest(self, best: TimedPlace, left: int) -> TimedPlace:
        """Of the places that take as long as the best, that with most travel margin; so many more are looked at."""
        machine, most = self.timer.machine, best.seconds * (1.0 + EQUAL)
        equal = [one for one in self.timer.known() if one.seconds <= most and self.space.holds(one.place)]
        at = max(equal, key=lambda one: (one.shares(machine), -one.seconds))
        steps = self._first_steps()
        while left > 0 and self._coarse(steps):
            before = at
            around = list(self.space.neighbours(at.place, steps))
            self.timer.look_ahead(around, most / (1.0 - 2e-4))
            for place in around:
                left -= 1
                made = self.timer.tried(place, most / (1.0 - 2e-4))
                if made.seconds <= most and made.shares(machine) > at.shares(machine):
                    at = made
            if at is before:
                steps = 0.5 * steps
        return at

