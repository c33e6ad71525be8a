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

import numpy as np

from machines.machine import Machine
from postproc.joints.road_clock import RoadClock, clock_of
from postproc.joints.run_roads import ParameterCurve, RunRoad, columns_of, rest
from postproc.joints.taut_string import taut_string
from toolpaths.arrays import Floats, Ints

STRETCHES = (0.15, 0.3, 0.6, 1.2, 2.4, 4.8)
"""s"""
ROOM = 0.9
"""part of the platform's room that a split may use"""
GRAINS = 6
"""parts of a stretch in which a move is cut at least"""
STRAIGHT = 0.01
"""mm that carriers may be off their smooth path between two blocks"""


def planned_split(roads: Sequence[RunRoad], machine: Machine, divided: bool = True) -> list[ParameterCurve]:
    """The joints that carry the platform along every road; not `divided`: with the platform at rest."""
    kin = roads[0].kin
    columns = columns_of(kin, False)
    at = np.array([machine.axis_names.index(kin.open_parameters[k]) for k in columns])
    clock = clock_of(roads, float(machine.limits.velocity[at].min()))
    middle, apart = _middle(clock, columns), ROOM * kin.parameters_apart[list(columns)]
    tried = [(np.inf, middle), *((stretch, _carried(clock, middle, apart, machine, at, stretch))
                                 for stretch in STRETCHES * divided)]
    made = [(clock.seconds(machine, _spread(values, columns, len(kin.open_parameters))), stretch, values)
            for stretch, values in tried if values is not None]
    least, stretch, values = min(made, key=lambda one: one[0])
    both = (least, made[0][0])
    if not np.isfinite(stretch):  # the platform rests: exactly, and not only at the times that were looked at
        return [_resting(road, own, columns, both) for road, own in zip(roads, clock.of_poses, strict=True)]
    grain = max(stretch / GRAINS, clock.step)
    return [ParameterCurve(own, clock.times, values, columns, grain, STRAIGHT, seconds=both) for own in clock.of_poses]


def _spread(values: Floats, columns: tuple[int, ...], count: int) -> Floats:
    """(T, F) open parameters of which `values` (T, M) are some, the others 0."""
    result = np.zeros((len(values), count))
    result[:, columns] = values
    return result


def _resting(road: RunRoad, measure: Floats, columns: tuple[int, ...], both: tuple[float, float]) -> ParameterCurve:
    """The carriers with the platform at rest at every pose: no curve between has to be cut."""
    values = rest(road.kin, *road.at(measure, measure))[:, columns]
    return ParameterCurve(measure, measure, np.nan_to_num(values), columns, np.inf, np.inf, seconds=both)


def _middle(clock: RoadClock, columns: tuple[int, ...]) -> Floats:
    """(T, M) where the carriers bring the platform to rest."""
    result = np.full((len(clock.times), len(columns)), np.nan)
    for k, rows in clock.runs():
        result[rows] = rest(clock.roads[k].kin, clock.tip[rows], clock.axis[rows])[:, columns]
    for column in result.T:
        good = np.isfinite(column)
        column[:] = np.interp(clock.times, clock.times[good], column[good]) if good.any() else 0.0
    return result


def _carried(clock: RoadClock, middles: Floats, room: Floats, machine: Machine, at: Ints, stretch: float) -> Floats | None:
    """(T, M) the carriers smoothed over a stretch of time (s); None where the platform's room is too small for it."""
    from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

    half = max(round(0.5 * stretch / clock.step), 1)
    width, third = 2 * half + 1, max(2 * (half // 3) + 1, 1)
    result = np.empty_like(middles)
    for k, (middle, apart, joint) in enumerate(zip(middles.T, room, at, strict=True)):
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
