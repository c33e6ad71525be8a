"""Where the knots go: equal times at the speed that the limits would allow, finer where that speed drops."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from postproc.feedrate.limits import JointLimits, squared_speed, steady_cap
from postproc.feedrate.paths import ParametricPath
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass

CHUNK = 16384
RAMP = 32
GROWTH = 0.04
"""Growth of the spacing per distance from rest or from a change of the feed, where the feed alone limits."""
FEWEST = 128
"""Intervals of a motion between stops at least."""


@dataclass(frozen=True)
class Spacing:
    """Knot spacing clip(dt sqrt(cap), lowest, longest), dt in s, changing by at most `slope` per unit of length."""

    dt: float = 2.5e-3
    longest: float = 0.25
    slope: float = 0.15
    probes: float = 1.0
    """first probing spacing over `longest`"""
    hump: float = 0.1
    """largest share of a jerk limit by which the path's third derivative may bulge between knots"""


class Marks(NamedTuple):
    """Where a feed that is otherwise constant changes: sigma (M,) rising, lesser feed there as sigma_dot (M,)."""

    sigma: Floats
    speed: Floats


def mesh(path: ParametricPath, limits: JointLimits, top: Callable[[Floats], Floats], spacing: Spacing,
         ramp: float = np.inf, marks: Marks | None = None) -> Floats:
    """Knots (K,) from path.start to path.end.

    The limits are probed at the breaks of the path and between them; `top(sigma)` bounds the speed along
    sigma; `ramp` is the time of full jerk after rest, into which RAMP knots go. Under a feed with `marks`
    knots lie on these and grow from there and from rest, and its cruise, where nothing changes, takes the longest.
    """
    at = _probes(path, spacing, marks)
    speed, bend = np.empty(len(at)), np.zeros(len(at))
    for first in range(0, len(at), CHUNK):
        low, high = max(first - 1, 0), min(first + CHUNK + 1, len(at))
        speed[low:high], jerk = _probed(path, limits, top, at[low:high])
        bend[low + 1:high - 1] = _bend(at[low:high], jerk)
    if not np.all(speed > 0.0):
        where = at[np.flatnonzero(~(speed > 0.0))[0]]
        raise ValueError(f"no speed above 0 is allowed at {where:.6g} of {path.end:.6g}: feed 0, or no finite derivatives")
    h = np.minimum(spacing.dt * speed, min(spacing.longest, (path.end - path.start) / FEWEST))
    h[1:-1] = np.minimum(h[1:-1], np.sqrt(8.0 * spacing.hump / np.maximum(bend[1:-1], 1e-300)))
    with np.errstate(invalid="ignore"):
        h[[0, -1]] = np.fmin(h[[0, -1]], ramp / RAMP * speed[[0, -1]])
    if marks is not None:
        places = np.concatenate((at[:1], marks.sigma, at[-1:]))
        h = np.minimum(h, _cones(at, places, np.concatenate((h[:1], spacing.dt * marks.speed, h[-1:]))))
    h = np.maximum(h, 1e-9 * (path.end - path.start))
    knots = place(at, gentle(at, h, spacing.slope))
    return knots if marks is None else _pinned(knots, marks.sigma)


def _cones(at: Floats, places: Floats, h: Floats) -> Floats:
    """Spacing (N,) that grows from `h` (M,) at rising `places` (M,) by GROWTH of the distance."""
    behind = np.clip(np.searchsorted(places, at, side="right") - 1, 0, len(places) - 1)
    ahead = np.minimum(behind + 1, len(places) - 1)
    sides = (h[k] + GROWTH * np.abs(at - places[k]) for k in (behind, ahead))
    return np.asarray(np.minimum(*sides))


def _pinned(knots: Floats, marks: Floats) -> Floats:
    """The nearest knots inside moved onto `marks`; more knots where two marks have the same one."""
    middle = 0.5 * (knots[1:-2] + knots[2:-1])
    nearest = 1 + np.searchsorted(middle, marks)
    moved, first = np.unique(nearest, return_index=True)
    made = knots.copy()
    made[moved] = marks[first]
    return np.unique(np.concatenate((made, marks)))


def ramp_time(dq: Floats, limits: JointLimits, feed: Floats) -> float:
    """Least time of full jerk from rest until acceleration or speed is reached, over the given places.

    dq (N, J) by s, feed (N,) largest ds/dt there; inf where nothing of this is limited.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        speed, acceleration, jerk = (np.min(limit / np.abs(dq), axis=1)
                                     for limit in (limits.velocity, limits.acceleration, limits.jerk))
        times = np.minimum(acceleration / jerk, np.sqrt(np.minimum(speed, feed) / jerk))
    return float(np.min(np.where(times > 0.0, times, np.inf)))


def _probed(path: ParametricPath, limits: JointLimits, top: Callable[[Floats], Floats],
            at: Floats) -> tuple[Floats, Floats]:
    """Speed (N,) along sigma that all limits would allow if it were constant; jerk over its limits (N, J) at that speed."""
    found = path.derivatives(at)
    cap = np.minimum(squared_speed(found.dq, limits.velocity), steady_cap(found.d2q, found.d3q, limits))
    speed = np.asarray(np.minimum(np.sqrt(cap), top(at)))
    with np.errstate(invalid="ignore", over="ignore"):
        return speed, np.nan_to_num(found.d3q * speed[:, None] ** 3 / limits.jerk)


def _bend(at: Floats, jerk: Floats) -> Floats:
    """Largest second derivative (N - 2,) of any joint's jerk (N, J) between its places; the speed's own change left out."""
    step = np.diff(at)[:, None]
    slope = np.diff(jerk, axis=0) / step
    return np.asarray(np.abs(2.0 * np.diff(slope, axis=0) / (step[1:] + step[:-1])).max(axis=1))


def _probes(path: ParametricPath, spacing: Spacing, marks: Marks | None) -> Floats:
    """Ends, breaks, marks, and equal parts between them, two or more."""
    length = path.end - path.start
    breaks = np.asarray(path.breaks, dtype=np.float64)
    if marks is not None:
        breaks = np.union1d(breaks, marks.sigma)
    inner = breaks[(breaks > path.start) & (breaks < path.end)]
    edges = np.concatenate(([path.start], inner, [path.end]))
    edges = edges[np.concatenate((np.diff(edges) > 1e-9 * length, [True]))]
    edges[0] = path.start
    cell = np.diff(edges)
    parts = np.maximum(np.ceil(cell / min(spacing.probes * spacing.longest, length / FEWEST)), 2.0).astype(np.int64)
    first = np.repeat(np.cumsum(parts) - parts, parts)
    share = (np.arange(parts.sum()) - first) / np.repeat(parts, parts)
    return np.append(np.repeat(edges[:-1], parts) + share * np.repeat(cell, parts), path.end)


def gentle(at: Floats, h: Floats, slope: float) -> Floats:
    """The largest spacing below `h` (N,) whose slope stays within +-`slope`."""
    ahead = np.minimum.accumulate(h - slope * at) + slope * at
    behind = np.minimum.accumulate((ahead + slope * at)[::-1])[::-1] - slope * at
    return np.asarray(behind)


def place(at: Floats, h: Floats) -> Floats:
    """Knots such that one knot passes per `h` of length: the integral of 1/h, exact for h linear between probes."""
    passed = np.zeros(len(at))
    for first in range(0, len(at) - 1, CHUNK):
        last = min(first + CHUNK, len(at) - 1)
        passed[first + 1:last + 1] = _passed(np.diff(at[first:last + 1]), h[first:last], h[first + 1:last + 1])
    np.cumsum(passed, out=passed)
    knots = np.linspace(0.0, passed[-1], int(np.ceil(passed[-1])) + 1)
    for first in range(0, len(knots), CHUNK):
        here = slice(first, first + CHUNK)
        knots[here] = _reached(at, h, passed, knots[here])
    knots[0], knots[-1] = at[0], at[-1]
    return knots


def _passed(step: Floats, low: Floats, high: Floats) -> Floats:
    """Knots (N,) in steps between probes with spacings from `low` to `high`."""
    change = (high - low) / low
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(np.abs(change) > 1e-6, np.log1p(change) / change, 1.0 - 0.5 * change)
    return np.asarray(step / low * share)


def _reached(at: Floats, h: Floats, passed: Floats, wanted: Floats) -> Floats:
    """Places (M,) where `wanted` (M,) knots have passed."""
    cell = np.clip(np.searchsorted(passed, wanted, side="right") - 1, 0, len(at) - 2)
    low = h[cell]
    rate = (h[cell + 1] - low) / (at[cell + 1] - at[cell])
    behind = wanted - passed[cell]
    ahead = behind * rate
    with np.errstate(divide="ignore", invalid="ignore"):
        travel = np.where(np.abs(ahead) > 1e-6, low * np.expm1(ahead) / rate, low * behind * (1.0 + 0.5 * ahead))
    return np.asarray(at[cell] + travel)
