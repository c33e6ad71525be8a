"""A path split between slow carriers and the fast platform that they carry, over a whole program.

The carriers are to stay as near to the path as leaves the platform inside its own workspace: a gate at every time. In these
gates, made narrower by what the path does in a stretch of time about it, the taut string (`taut_string.py`) has the least
speeds, and its moving average over that stretch, taken three times, the least corners: it stays in the gates, as every value
that it averages is one that the gate at that time lets through, and its acceleration and jerk fall with the length of the
stretch. Stretches of several lengths are tried, and none (the carriers then do all, the platform rests): the one is taken
with which the joints of both machines, each within its own velocity, acceleration and jerk, take the least time. Low-pass
division of a path between macro and micro: Company 2000, IV.3, figure IV-9. A proposal, as in `spin_plan.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from machines.machine import Machine
from postproc.joints.run_roads import ParameterCurve, RunRoad, columns_of, rest
from postproc.joints.taut_string import taut_string
from toolpaths.arrays import Floats, Ints
from toolpaths.shapes import arrays

SHORTEST, MOST_TIMES = 0.01, 20_000
"""s between times that are looked at, at least, and how many there may be"""
STRETCHES = (0.15, 0.3, 0.6, 1.2, 2.4, 4.8)
"""s"""
ROOM = 0.9
"""part of the platform's room that a split may use"""
LINK = 0.5
"""s that drawing back and coming down takes, besides the way"""
GRAINS = 6
"""parts of a stretch in which a move is cut at least"""


@dataclass(frozen=True)
@arrays(times="T", road="T", tip="T 3", axis="T 3", middle="T M", apart="M")
class _Clock:
    """Even times of a program at the programmed feed, and where the tool is.

    Attributes:
        road: (T,) which run; -1 between runs
        middle: (T, M) where the carriers bring the platform to rest
        apart: (M,) mm that they may be from there
    """

    times: Floats
    road: Ints
    tip: Floats
    axis: Floats
    middle: Floats
    apart: Floats

    @property
    def step(self) -> float:
        """s"""
        return float(self.times[1] - self.times[0])


def planned_split(roads: Sequence[RunRoad], machine: Machine, divided: bool = True) -> list[ParameterCurve]:
    """The joints that carry the platform along every road; not `divided`: with the platform at rest."""
    columns = columns_of(roads[0].kin, False)
    at = np.array([machine.axis_names.index(roads[0].kin.open_parameters[k]) for k in columns])
    clocks = _road_times(roads, machine, at)
    clock = _clock(roads, clocks, columns)
    tried = [(np.inf, clock.middle), *((stretch, _carried(clock, machine, at, stretch)) for stretch in STRETCHES * divided)]
    made = [(_seconds(roads, clock, machine, columns, values), stretch, values) for stretch, values in tried
            if values is not None]
    _, stretch, values = min(made, key=lambda one: one[0])
    if not np.isfinite(stretch):  # the platform rests: exactly, and not only at the times that were looked at
        return [_resting(road, own, columns) for road, own in zip(roads, clocks, strict=True)]
    grain = max(stretch / GRAINS, clock.step)
    return [ParameterCurve(own, clock.times, values, columns, grain) for own in clocks]


def _resting(road: RunRoad, measure: Floats, columns: tuple[int, ...]) -> ParameterCurve:
    """The carriers with the platform at rest at every pose: no curve between has to be cut."""
    values = rest(road.kin, *road.at(measure, measure))[:, columns]
    return ParameterCurve(measure, measure, np.nan_to_num(values), columns, np.inf)


def _road_times(roads: Sequence[RunRoad], machine: Machine, at: Ints) -> list[Floats]:
    """Time (N + 1,) at the poses of every road, the ways between them counted; rapids at the carriers' velocity."""
    rapid, result, now, before = float(machine.limits.velocity[at].min()), [], 0.0, roads[0].first[:3]
    for road in roads:
        own = np.where(road.seconds > 0.0, road.seconds, road.curves.length() / rapid)
        now += LINK + float(np.linalg.norm(road.first[:3] - before)) / rapid
        result.append(now + np.concatenate([[0.0], np.cumsum(own)]))
        now = float(result[-1][-1])
        before = road.curves.end[-1] if len(road.curves) else road.first[:3]
    return result


def _clock(roads: Sequence[RunRoad], clocks: list[Floats], columns: tuple[int, ...]) -> _Clock:
    low, high = float(clocks[0][0]), float(clocks[-1][-1])
    count = int(np.clip((high - low) / SHORTEST, 8, MOST_TIMES))
    times = np.linspace(low, high, count)
    of, tip, axis = np.full(count, -1), np.zeros((count, 3)), np.zeros((count, 3))
    middle = np.full((count, len(columns)), np.nan)
    ends = [(float(own[0]), float(own[-1])) for own in clocks]
    for k, (road, own, (first, last)) in enumerate(zip(roads, clocks, ends, strict=True)):
        rows = slice(*np.searchsorted(times, [first, last + 1e-12]).tolist())
        of[rows] = k
        tip[rows], axis[rows] = road.at(own, times[rows])
        middle[rows] = rest(road.kin, tip[rows], axis[rows])[:, columns]
    for column in middle.T:
        good = np.isfinite(column)
        column[:] = np.interp(times, times[good], column[good]) if good.any() else 0.0
    return _Clock(times, of, tip, axis, middle, ROOM * roads[0].kin.parameters_apart[list(columns)])


def _carried(clock: _Clock, machine: Machine, at: Ints, stretch: float) -> Floats | None:
    """(T, M) the carriers smoothed over a stretch of time (s); None where the platform's room is too small for it."""
    half = max(int(round(0.5 * stretch / clock.step)), 1)
    width, third = 2 * half + 1, max(2 * (half // 3) + 1, 1)
    result = np.empty_like(clock.middle)
    for k, (middle, apart, joint) in enumerate(zip(clock.middle.T, clock.apart, at, strict=True)):
        low = np.maximum(maximum_filter1d(middle - apart, width, mode="nearest"), machine.limits.lower[joint])
        high = np.minimum(minimum_filter1d(middle + apart, width, mode="nearest"), machine.limits.upper[joint])
        if (low > high).any():
            return None
        for end in (0, -1):
            low[end] = high[end] = float(np.clip(middle[end], low[end], high[end]))
        smooth = taut_string(clock.times, low, high)
        for _ in range(3):
            smooth = uniform_filter1d(smooth, third, mode="nearest")
        result[:, k] = smooth
    return result


def _seconds(roads: Sequence[RunRoad], clock: _Clock, machine: Machine, columns: tuple[int, ...], values: Floats) -> float:
    """Time (s) of the program with these carriers (T, M), every joint within its limits, estimated; infinite where a run
    leaves travel or reach."""
    total, limits = 0.0, machine.limits
    ends = np.flatnonzero(np.diff(clock.road, prepend=-2, append=-2))
    for first, last in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
        k = int(clock.road[first])
        if k < 0 or last - first < 4:
            continue
        kin, rows = roads[k].kin, slice(first, last)
        parameters = np.zeros((last - first, len(kin.open_parameters)))
        parameters[:, columns] = values[rows]
        q = kin.inverse_with(clock.tip[rows], clock.axis[rows], parameters)[0]
        if not ((q >= limits.lower) & (q <= limits.upper)).all():
            return np.inf
        slow = np.ones(last - first)
        for order, most in ((1, limits.velocity), (2, limits.acceleration), (3, limits.jerk)):
            found = np.abs(np.diff(q, order, axis=0)) / clock.step**order / most
            ratio = found.max(axis=1) ** (1.0 / order)
            slow[:len(ratio)] = np.maximum(slow[:len(ratio)], ratio)
        total += clock.step * float(slow.sum())
    return total
