"""The roads of a program at even times, and how long the joints take for them with given open parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from machines.machine import Machine
from postproc.joints.run_roads import RunRoad
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

SHORTEST, MOST_TIMES, FEWEST = 0.01, 20_000, 8
"""s between times that are looked at, at least, and how many there may be"""
LINK = 0.5
"""s that drawing back and coming down takes, besides the path"""


@dataclass(frozen=True)
@arrays(of_poses="*_", times="T", road="T", tip="T 3", axis="T 3")
class RoadClock:
    """Even times of a program at the programmed feed, and where the tool is.

    Attributes:
        of_poses: time (N + 1,) at the poses of every road
        road: (T,) which run; -1 between runs
    """

    roads: tuple[RunRoad, ...]
    of_poses: tuple[Floats, ...]
    times: Floats
    road: Ints
    tip: Floats
    axis: Floats

    @property
    def step(self) -> float:
        """s"""
        return float(self.times[1] - self.times[0])

    def runs(self) -> list[tuple[int, slice]]:
        """Every run that has times of its own, with them."""
        ends = np.flatnonzero(np.diff(self.road, prepend=-2, append=-2))
        return [(int(self.road[first]), slice(first, last)) for first, last in zip(
            ends[:-1].tolist(), ends[1:].tolist(), strict=True) if self.road[first] >= 0]

    def seconds(self, machine: Machine, parameters: Floats) -> float:
        """Time (s) of the runs with open parameters (T, F), every joint within its velocity, acceleration and jerk as far as
        the times show them: an estimate to compare by. Infinite where a run leaves travel or reach."""
        total, limits = 0.0, machine.limits
        for k, rows in self.runs():
            q = self.roads[k].kin.inverse_with(self.tip[rows], self.axis[rows], parameters[rows])[0]
            if not ((q >= limits.lower) & (q <= limits.upper)).all():
                return np.inf
            slow = np.ones(len(q))
            for order, most in ((1, limits.velocity), (2, limits.acceleration), (3, limits.jerk)):
                if len(q) > order:
                    found = np.abs(np.diff(q, order, axis=0)) / self.step**order / most
                    ratio = found.max(axis=1) ** (1.0 / order)
                    slow[:len(ratio)] = np.maximum(slow[:len(ratio)], ratio)
            total += self.step * float(slow.sum())
        return total


def clock_of(roads: Sequence[RunRoad], rapid: float) -> RoadClock:
    """Roads by time, rapids and the paths between them at `rapid` mm/s."""
    of_poses = _pose_times(roads, rapid)
    low, high = float(of_poses[0][0]), float(of_poses[-1][-1])
    count = int(np.clip((high - low) / SHORTEST, FEWEST, MOST_TIMES))
    times = np.linspace(low, max(high, low + SHORTEST), count)
    of, tip, axis = np.full(count, -1), np.zeros((count, 3)), np.zeros((count, 3))
    for k, (road, own) in enumerate(zip(roads, of_poses, strict=True)):
        rows = slice(*np.searchsorted(times, [own[0], own[-1] + 1e-12]).tolist())
        of[rows] = k
        tip[rows], axis[rows] = road.at(own, times[rows])
    return RoadClock(tuple(roads), tuple(of_poses), times, of, tip, axis)


def _pose_times(roads: Sequence[RunRoad], rapid: float) -> list[Floats]:
    result, now, before = [], 0.0, roads[0].first[:3]
    for road in roads:
        own = np.where(road.seconds > 0.0, road.seconds, road.curves.length() / rapid)
        now += LINK + float(np.linalg.norm(road.first[:3] - before)) / rapid
        result.append(now + np.concatenate([[0.0], np.cumsum(own)]))
        now = float(result[-1][-1])
        before = road.curves.end[-1] if len(road.curves) else road.first[:3]
    return result
