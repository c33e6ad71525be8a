"""The turn of a round tool about its own axis, planned over a whole program.

On a machine that turns in every direction that spin is free. Along every run it may change evenly; between runs the tool is
drawn back, and any spin may follow any other at the price of the path there. Of all spins on a grid those are taken that
leave the fewest places out of reach, then cost the least: time at the programmed feed or at the velocities of the axes,
whichever is longer, and a price that grows where a singular position, a stop or a collision comes near, by the time that
the tool is there (Bellman 1957, backwards from the end). The grid is made finer about what was found, and a cubic B-spline
through the values has no corner. No spin, the best one that stands, and straight lines through the values, which reach what
the spline rounds off, are tried next to it by the time that the joints take with their accelerations and jerks. What comes
out is a proposal: the stages that check reach and deviation bound it as any path.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from machines import reach as clearances
from machines.kinematics.base import Kinematics
from machines.machine import Machine
from postproc.joints.road_clock import RoadClock, clock_of
from postproc.joints.run_roads import ParameterCurve, RunRoad, columns_of, rest
from postproc.joints.spin_loop import cheapest_spins
from toolpaths.arrays import Array, Bools, Floats
from toolpaths.compiled import chosen
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG

MOST_NODES, GRAIN = 2000, 0.5
"""places that are looked at, and steps of a road between them at least"""
GRID = 13
"""spins looked at first"""
FINER, NEIGHBOURS = 3, (-2, -1, 0, 1, 2)
"""times that the grid is made 3 times finer, about what was found"""
SPINNING, MOVING = 1.0, 0.1
"""s: what a change of the spin costs by its square per step of the road, and seconds of the slowest axis next to the time"""
NEAR_MM, NEAR_RAD = 5.0, 3.0 * DEG
"""margins at which a collision or a stop costs a quarter of the time there"""
OUTSIDE, TIGHT = 1e6, 100.0
"""s: more than any path that is in reach; what less than those margins costs, for between the places there may be none"""
NEARNESS = 0.25
"""what the prices of all that is near count next to the time"""
STRAIGHT = 0.2 * DEG
"""that blocks may leave the smooth spin by"""
SAME = 1e-5
"""mm, rad and direction cosines: what is nearer is round-off"""
FAR = 1e6
"""margins that count as none, of axes without an end"""
CHUNK, COMPILE_FROM = 512, 200_000


@dataclass(frozen=True)
@arrays(tip="N 3", axis="N 3", above="N 3", parameters="N F", seconds="N", link="N", steps="N", held="N", tool="int64: N")
class _Nodes:
    """Places of all roads in a row.

    Attributes:
        above: (N, 3) where a linking move draws the tool back to from there, `tip` where there is none
        seconds: (N,) s from the one before, at the programmed feed
        link: (N,) True where a road begins
        steps: (N,) steps of the road from the one before
        held: (N,) rad, NaN where the spin is free
        tool: (N,) index into the kinematics
        parameters: (N, F) the other open parameters
    """

    tip: Floats
    axis: Floats
    above: Floats
    parameters: Floats
    seconds: Floats
    link: Bools
    steps: Floats
    held: Floats
    tool: Array


def planned_spins(roads: Sequence[RunRoad], others: Sequence[Sequence[ParameterCurve]], machine: Machine, least: float,
                  fixed: float | None,
                  drawn: Callable[[Floats, Floats], Floats] | None = None) -> list[ParameterCurve]:
    """The spin along every road.

    Args:
        others: the curves of each road's other open parameters
        least: distance from singular positions that the set-up states
        fixed: rad, the one spin that is asked for; None: planned
        drawn: as of `RunOptions`: where a road begins and ends the tool has to come there too, with the same spin
    """
    total = sum(float(road.steps[-1]) for road in roads)
    grain = max(GRAIN, total / MOST_NODES)
    places = [np.linspace(0.0, road.steps[-1], max(int(np.ceil(road.steps[-1] / grain)), 1) + 1 if len(road.curves) else 1)
              for road in roads]
    kins = list({id(road.kin): road.kin for road in roads}.values())
    nodes = _nodes(roads, others, places, kins, fixed, drawn)
    column = columns_of(kins[0], True)[0]
    cuts = np.cumsum([len(own) for own in places])[:-1]
    spins = list(_tried(nodes, kins, machine, least, column).T)
    tried = [[ParameterCurve(road.steps, own, values[:, None], (column,), grain, STRAIGHT, rounded and len(own) > 2)
              for road, own, values in zip(roads, places, np.split(some, cuts), strict=True)]
             for some, rounded in [*((some, True) for some in spins), *((some, False) for some in spins[:len(spins) > 1])]]
    if len(tried) == 1:
        return tried[0]
    values = np.stack([np.concatenate([curve.at(curve.nodes)[:, 0] for curve in some]) for some in tried], axis=1)
    price = _looked_at(values, nodes, kins, machine, least, column)[1].sum(axis=0)
    clock = clock_of(roads, float(machine.limits.velocity[~np.array(machine.rotary)].min(initial=1000.0)))
    seconds = [clock.seconds(machine, _at_times(clock, others, some)) for some in tried]
    return tried[int(np.argmin(price + np.nan_to_num(seconds, posinf=OUTSIDE)))]


def _at_times(clock: RoadClock, others: Sequence[Sequence[ParameterCurve]], spins: Sequence[ParameterCurve]) -> Floats:
    """(T, F) the open parameters at the times of a clock."""
    kin = clock.roads[0].kin
    result = np.zeros((len(clock.times), len(kin.open_parameters)))
    for k, rows in clock.runs():
        for curve in (*others[k], spins[k]):
            places = np.interp(clock.times[rows], clock.of_poses[k], curve.measure)
            result[rows, list(curve.columns)] = curve.at(places)
    return result


def _nodes(roads: Sequence[RunRoad], others: Sequence[Sequence[ParameterCurve]], places: list[Floats],
           kins: list[Kinematics], fixed: float | None, drawn: Callable[[Floats, Floats], Floats] | None) -> _Nodes:
    tips, axes, parameters, seconds = [], [], [], []
    for road, curves, own in zip(roads, others, places, strict=True):
        tip, axis = road.at(road.steps, own)
        found = rest(road.kin, tip, axis)
        for curve in curves:
            found[:, curve.columns] = curve.at(np.interp(own, road.steps, curve.measure))
        clock = np.concatenate([[0.0], np.cumsum(road.seconds)])
        seconds.append(np.diff(np.interp(own, road.steps, clock), prepend=0.0))
        tips.append(tip)
        axes.append(axis)
        parameters.append(found)
    counts = [len(own) for own in places]
    held = np.repeat([road.held if np.isfinite(road.held) or fixed is None else fixed for road in roads], counts)
    index = {id(kin): k for k, kin in enumerate(kins)}
    tip, axis = np.concatenate(tips), np.concatenate(axes)
    ends = np.concatenate([(np.arange(n) == 0) | (np.arange(n) == n - 1) for n in counts])
    above = tip if drawn is None else np.where(ends[:, None], drawn(tip, axis), tip)
    return _Nodes(tip, axis, above, np.concatenate(parameters), np.concatenate(seconds),
                  np.concatenate([np.arange(n) == 0 for n in counts]),
                  np.concatenate([np.diff(own, prepend=own[0]) for own in places]), held,
                  np.repeat([index[id(road.kin)] for road in roads], counts))


def _tried(nodes: _Nodes, kins: list[Kinematics], machine: Machine, least: float, column: int) -> Floats:
    """(N, K) spins that may do: planned, the best that stands, none; only what is asked for where that is everywhere."""
    held = np.isfinite(nodes.held)
    if held.all():
        return nodes.held[:, None]
    apart = float(kins[0].parameters_apart[column])
    standing = np.linspace(-apart, apart, GRID)
    grid = np.where(held[:, None], np.nan_to_num(nodes.held)[:, None], standing)
    cost = _looked_at(grid, nodes, kins, machine, least, column)[1].sum(axis=0)
    planned = _planned(grid, 2.0 * apart / (GRID - 1), nodes, kins, machine, least, column)
    others = np.where(held[:, None], np.nan_to_num(nodes.held)[:, None], [standing[cost.argmin()], 0.0])
    return np.column_stack([planned, others])


def _planned(grid: Floats, step: float, nodes: _Nodes, kins: list[Kinematics], machine: Machine, least: float,
             column: int) -> Floats:
    """(N,) spins, from a grid (N, S) of that step."""
    apart = float(kins[0].parameters_apart[column])
    spins = _best(grid, nodes, kins, machine, least, column)
    for _ in range(FINER):
        step /= 3.0
        near = np.clip(spins[:, None] + step * np.array(NEIGHBOURS, dtype=np.float64), -apart, apart)
        spins = _best(near, nodes, kins, machine, least, column)
    return spins


def _best(grid: Floats, nodes: _Nodes, kins: list[Kinematics], machine: Machine, least: float, column: int) -> Floats:
    """(N,) the cheapest path through spins `grid` (N, S)."""
    held = np.isfinite(nodes.held)[:, None]
    grid = np.where(held, np.nan_to_num(nodes.held)[:, None], grid)
    q, cost = _looked_at(grid, nodes, kins, machine, least, column)
    n, count = grid.shape
    value, choice = cost[-1].copy(), np.zeros((n, count), dtype=np.int64)
    loop = chosen(cheapest_spins, n * count * count, COMPILE_FROM)
    for first in range((n - 2) // CHUNK * CHUNK if n > 1 else -1, -1, -CHUNK):
        last = min(first + CHUNK, n - 1)
        loop(cost[first:last], _edges(grid, q, nodes, machine, first, last), value, choice[first:last])
    value += _seconds(q[0] - machine.home, machine)
    at, result = int(value.argmin()), np.empty(n)
    for k in range(n):
        result[k] = grid[k, at]
        at = int(choice[k, at])
    return result


def _seconds(step: Floats, machine: Machine) -> Floats:
    """Time (...) of joint steps (..., J), every axis at its velocity; of joints that there are none much."""
    return np.asarray(np.nan_to_num((np.abs(step) / machine.limits.velocity).max(axis=-1), nan=OUTSIDE))


def _edges(grid: Floats, q: Floats, nodes: _Nodes, machine: Machine, first: int, last: int) -> Floats:
    """(last - first, S, S) s from each spin of a node to each of the next."""
    behind = slice(first + 1, last + 1)
    own = _seconds(q[behind, None, :, :] - q[first:last, :, None, :], machine)
    turn = grid[behind, None, :] - grid[first:last, :, None]
    link, steps = nodes.link[behind, None, None], np.maximum(nodes.steps[behind, None, None], 1e-3)
    along = np.maximum(nodes.seconds[behind, None, None], own) + MOVING * own + SPINNING * turn**2 / steps
    return np.asarray(np.where(link, own, along))


def _looked_at(grid: Floats, nodes: _Nodes, kins: list[Kinematics], machine: Machine, least: float,
               column: int) -> tuple[Floats, Floats]:
    """(joints (N, S, J), s (N, S) that a place costs by itself)."""
    n, count = grid.shape
    weight = np.maximum(nodes.seconds, 1e-2)
    q, cost = np.full((n, count, len(machine.home)), np.nan), np.full((n, count), OUTSIDE)
    for k, kin in enumerate(kins):
        rows = np.flatnonzero(nodes.tool == k)
        parameters = np.repeat(np.nan_to_num(nodes.parameters[rows]), count, axis=0)
        parameters[:, column] = grid[rows].ravel()
        tip, axis = (np.repeat(x[rows], count, axis=0) for x in (nodes.tip, nodes.axis))
        found = kin.inverse_with(tip, axis, parameters)[0]
        q[rows] = found.reshape(len(rows), count, -1)
        cost[rows] = _price(kin, found, (tip, axis), machine, least).reshape(len(rows), count) * weight[rows, None]
        links = rows[(nodes.above[rows] != nodes.tip[rows]).any(axis=1)]
        if len(links):
            at = np.repeat(np.isin(rows, links), count)
            pose = np.repeat(nodes.above[links], count, axis=0), axis[at]
            lifted = kin.inverse_with(*pose, parameters[at])[0]
            cost[links] += _price(kin, lifted, pose, machine, least).reshape(len(links), count)
    return q, cost


def _price(kin: Kinematics, q: Floats, pose: tuple[Floats, Floats], machine: Machine, least: float) -> Floats:
    """(N,) what a second at joints q (N, J) costs: OUTSIDE where they are out of reach, or where the machine would not have
    its tool at `pose` (another assembly mode), else from 0 in the open up."""
    result = np.full(len(q), 100.0 * OUTSIDE)
    good = np.flatnonzero(np.isfinite(q).all(axis=1))
    if not len(good):
        return result
    some = q[good]
    margin = np.hstack([some - machine.limits.lower, machine.limits.upper - some]) / np.where(
        np.tile(machine.rotary, 2), NEAR_RAD, NEAR_MM)
    bad = ~(np.abs(np.hstack(kin.forward(some)) - np.hstack(pose)[good]) <= SAME).all(axis=1)
    if kin.workspace is not None:
        found = clearances.reach(kin, some)
        declared = len("xyz") + int(kin.workspace.tilt[0] < kin.workspace.tilt[1])  # box and tilt: no spin leaves them
        bad |= ~(found.values[:, :declared] >= -SAME).all(axis=1)
        margin = np.hstack([margin, (found.values / np.where(found.angular, NEAR_RAD, NEAR_MM))[:, declared:]])
    margin = np.minimum(np.nan_to_num(margin, nan=-1.0), FAR)
    price = (1.0 / (1.0 + np.maximum(margin, 0.0)) ** 2).max(axis=1)
    away = kin.singular_distance(some)
    bad |= (margin < 0.0).any(axis=1) | ~(away >= least).all(axis=1)
    price += ((least / np.maximum(np.nan_to_num(away), least)) ** 2).max(axis=1, initial=0.0)
    tight = TIGHT * np.maximum(1.0 - margin, 0.0).max(axis=1) ** 2
    result[good] = np.where(bad, 100.0 * OUTSIDE, NEARNESS * price + tight)
    return result
