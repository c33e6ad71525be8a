"""The planned motion: what the planner hands on, by time or by place."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property, reduce
from operator import add
from typing import NamedTuple

import numpy as np

from postproc.feedrate.feed import AllowedFeed
from postproc.feedrate.limits import TOOL_COLUMNS, JointLimits
from postproc.feedrate.paths import Eased
from postproc.feedrate.profile import Places, Profile
from postproc.feedrate.rows import at_tool, tool
from postproc.feedrate.shares import LimitShares
from postproc.feedrate.trajectory import REST_PAD, JointTrajectory, Usage
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass

SAMPLE = 1e-3
"""Step of the delivered samples, s."""
CHUNK = 65536
"""Samples handled at once."""


@dataclass(frozen=True)
class MotionPiece:
    """Motion between two stops, that of its profile `slowed` so many times; `shares` of its seconds, None at second order.

    One factor instead of another profile: a motion that is slowed down takes no more memory.
    """

    eased: Eased
    profile: Profile
    shares: LimitShares | None = None
    slowed: float = 1.0

    @property
    def seconds(self) -> float:
        """Time from stop to stop."""
        return self.slowed * float(self.profile.times[-1])

    def slower(self, factor: float) -> MotionPiece:
        """The same motion, `factor` times as long: velocities fall by it, accelerations by its square, jerks by its cube."""
        shares = self.shares and self.shares.scaled(factor * self.shares.seconds)
        return MotionPiece(self.eased, self.profile, shares, factor * self.slowed)

    def at(self, t: Floats) -> Places:
        """Places at rising times t (N,) of this piece; behind its end all stands still there."""
        own = t / self.slowed
        last = self.profile.times[-1]
        at = self._in_time(self.profile.at(np.minimum(own, last)))
        still = own > last
        return Places(at.sigma, *(np.where(still, 0.0, rate) for rate in at[1:]))

    def when(self, sigma: Floats) -> tuple[Floats, Places]:
        """Times (N,) at which places sigma (N,) are passed, and the motion there."""
        passed, at = self.profile.when(sigma)
        return passed * self.slowed, self._in_time(at)

    def _in_time(self, at: Places) -> Places:
        return Places(at.sigma, *(rate / self.slowed**order for order, rate in enumerate(at[1:], start=1)))


class StretchSpeeds(NamedTuple):
    """Of stretches of the path, each (M,): time in s; mean, lowest and highest ds/dt."""

    seconds: Floats
    mean: Floats
    lowest: Floats
    highest: Floats


@dataclass(frozen=True)
class Plan:
    """Pieces in order, and how the solving went.

    `feed`: largest ds/dt at s, override included; `step` of the samples; `iterations`: most of any window;
    `mismatch`: worst stitch of windows; `solved`: False where some window stopped early: the motion then respects the
    limits but is not the fastest.
    """

    pieces: tuple[MotionPiece, ...]
    limits: JointLimits
    feed: AllowedFeed
    step: float = SAMPLE
    iterations: int = 0
    mismatch: float = 0.0
    solved: bool = True

    @property
    def seconds(self) -> float:
        """Time of the whole motion."""
        return float(self.ends[-1])

    @cached_property
    def ends(self) -> Floats:
        """Time at the end of each piece."""
        return np.cumsum([piece.seconds for piece in self.pieces])

    @property
    def shares(self) -> LimitShares:
        """What each limit costs, seconds that add up to `seconds`; see `shares`.

        Raises:
            ValueError: at second order, which has no multipliers.
        """
        found = [piece.shares for piece in self.pieces if piece.shares is not None]
        if len(found) < len(self.pieces):
            raise ValueError("a second-order plan has no shares of its limits")
        return reduce(add, found)

    @property
    def lost(self) -> LimitShares:
        """The time at the feed alone, and the time lost against it shared out over the other limits."""
        return self.shares.lost(sum(self._at_feed(piece) for piece in self.pieces))

    def _at_feed(self, piece: MotionPiece) -> float:
        """Seconds at the feed, which is read in the middle of the intervals."""
        sigma = piece.profile.sigma
        travel = np.diff(piece.eased.parameter(sigma)[0])
        return float(np.sum(travel / self.feed(piece.eased.parameter(0.5 * (sigma[1:] + sigma[:-1]))[0])))

    def speed(self, s: Floats) -> Floats:
        """Planned ds/dt (N,) at s (N,)."""
        return self._by_place(s)[1]

    def time(self, s: Floats) -> Floats:
        """Time (N,) at which s (N,) is reached."""
        return self._by_place(s)[0]

    def blocks(self, cuts: Floats) -> StretchSpeeds:
        """Of the stretches between rising `cuts` (M + 1,) of s."""
        time, speed = self._by_place(cuts)
        knots = np.concatenate([piece.eased.parameter(piece.profile.sigma)[0] for piece in self.pieces])
        every = np.unique(np.concatenate((cuts, knots[(knots > cuts[0]) & (knots < cuts[-1])])))
        at = np.searchsorted(every, cuts)
        speeds = self.speed(every)
        lowest, highest = (np.minimum.reduceat(speeds, at[:-1]), np.maximum.reduceat(speeds, at[:-1]))
        seconds = np.diff(time)
        return StretchSpeeds(seconds, np.diff(cuts) / seconds, np.minimum(lowest, speed[1:]),
                             np.maximum(highest, speed[1:]))

    def _by_place(self, s: Floats) -> tuple[Floats, Floats]:
        """Time and ds/dt (N,) at s (N,)."""
        time, speed = np.empty(len(s)), np.empty(len(s))
        for i, here in self._split(s):
            sigma = self.pieces[i].eased.sigma(s[here])
            passed, at = self.pieces[i].when(sigma)
            time[here] = passed + self.ends[i] - self.pieces[i].seconds
            speed[here] = at.speed * self.pieces[i].eased.parameter(sigma)[1]
        return time, speed

    def at(self, s: Floats) -> JointTrajectory:
        """The motion at rising places s (N,) instead of equal times: joints, rates, what binds."""
        parts = []
        for i, here in self._split(s):
            passed, at = self.pieces[i].when(self.pieces[i].eased.sigma(s[here]))
            parts.append((passed + self.ends[i] - self.pieces[i].seconds, *self._states(i, at)))
        return JointTrajectory(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def _split(self, s: Floats) -> list[tuple[int, Ints]]:
        """Pieces and the indices of s that lie in them; a stop belongs to the piece behind it."""
        first, last = self.pieces[0].eased.first, self.pieces[-1].eased.last
        if len(s) and not (first <= np.min(s) and np.max(s) <= last):
            raise ValueError(f"places {np.min(s):.6g} to {np.max(s):.6g} are not all on the path, {first:.6g} to {last:.6g}")
        which = np.searchsorted([piece.eased.first for piece in self.pieces[1:]], s, side="right")
        order = np.argsort(which, kind="stable")
        pieces, starts = np.unique(which[order], return_index=True)
        return list(zip(pieces.tolist(), np.split(order, starts[1:]), strict=True))

    @property
    def samples(self) -> int:
        """Number of samples of the whole motion; the last one is at rest."""
        return int(np.ceil(self.seconds / self.step)) + 1

    def trajectory(self) -> JointTrajectory:
        """All samples, each `step`."""
        return self._sampled(0, self.samples)

    def chunks(self, size: int = CHUNK) -> Iterator[tuple[JointTrajectory, slice]]:
        """Samples piece by piece, for motions of any length: each with the part of it that is new.

        Around it lie some samples of the neighbours, so that differences see across.
        """
        for first in range(0, self.samples, size):
            last = min(first + size, self.samples)
            low, high = max(first - REST_PAD, 0), min(last + REST_PAD, self.samples)
            yield self._sampled(low, high), slice(first - low, last - low)

    def usage(self) -> Usage:
        """Worst ratios to the limits over all samples."""
        return reduce(Usage.worse, (chunk.usage(self.limits, own) for chunk, own in self.chunks()))

    def _sampled(self, first: int, last: int) -> JointTrajectory:
        """Samples [first, last)."""
        parts = [self._states(i, at) for i, at in self.places(first, last)]
        t = np.float64(self.step) * np.arange(first, last)
        return JointTrajectory(t, *(np.concatenate(column) for column in zip(*parts, strict=True)))

    def places(self, first: int, last: int) -> Iterator[tuple[int, Places]]:
        """Samples [first, last) along the pieces: which piece, and the places in it; behind the end all stands still."""
        t = np.float64(self.step) * np.arange(first, last)
        which = np.minimum(np.searchsorted(self.ends, t, side="right"), len(self.ends) - 1)
        for i in np.unique(which).tolist():
            yield i, self.pieces[i].at(t[which == i] - (self.ends[i] - self.pieces[i].seconds))

    def _states(self, i: int, at: Places) -> tuple[Floats, ...]:
        """s, q, qd, qdd, qddd, ds/dt, feed, tool at places of piece i."""
        eased = self.pieces[i].eased
        s = eased.parameter(at.sigma)
        found = eased.chained(at.sigma, s, eased.path.derivatives(eased.inside(s[0])))
        rates = _in_time((found.dq, found.d2q, found.d3q), at)
        tooled = np.zeros((len(at.sigma), TOOL_COLUMNS))
        if self.limits.tool is not None:
            known = tool(eased, at.sigma, s)
            tooled = at_tool(known, at.speed, _in_time(known.tip[1:], at))
        return s[0], found.q, *rates, s[1] * at.speed, self.feed(s[0]), tooled


def _in_time(orders: Sequence[Floats], at: Places) -> tuple[Floats, Floats, Floats]:
    """Velocity, acceleration, jerk (N, J) from derivatives by sigma and the motion along it."""
    d1, d2, d3 = orders
    v, a, j = at.speed[:, None], at.acceleration[:, None], at.jerk[:, None]
    return d1 * v, d2 * v**2 + d1 * a, d3 * v**3 + 3.0 * d2 * v * a + d1 * j
