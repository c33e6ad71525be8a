"""Plans of a whole part: the states that each pass may take, and keep, per pass, whole part and auto out of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.options import Orientation
from postproc.orientation.allowed import Allowed
from postproc.orientation.candidates import Tried
from postproc.orientation.choose import groupwise, shortest
from postproc.orientation.held import common_angles
from postproc.orientation.passes import Work
from postproc.orientation.ranking import Ranking
from postproc.orientation.rounds import Progress, each_pass
from postproc.orientation.timed import Turned, turned_all
from postproc.orientation.turns import Ends, all_ends, unwinding, ways_between
from toolpaths.arrays import Floats
from toolpaths.units import DEG

_POOL = 5
"""axes besides its own choices that every pass may take"""
_CLUSTER = 2.0 * DEG
_EQUAL = 2e-4
"""part of the time of a cut by which its best orientations may differ; turns decide among them"""
Axis = tuple[Floats, float]
"""Tool axis (3,) and held angle, see `Turned`."""
_Row = tuple[list[Turned], Floats, list[Ends]]
"""States of a pass, seconds (K,) of their cuts, their ends"""


@dataclass(frozen=True)
class OrientationPlan:
    """One axis per pass.

    Attributes:
        picked: a Turned per pass
        cuts, rapids (N,): seconds of each pass
        ways (N + 1,): seconds before each pass, and back home
        seconds: all together
    """

    picked: tuple[Turned, ...]
    cuts: Floats
    rapids: Floats
    ways: Floats
    seconds: float

    @property
    def touches(self) -> bool:
        """Whether the tool touches what it must not in some pass."""
        return any(made.touching for made in self.picked)


@dataclass(frozen=True)
class Plans:
    """`named` plans side by side, and that of the paper's choice in each pass (elsewhere the own axis)."""

    named: dict[Orientation, OrientationPlan]
    paper: OrientationPlan


@dataclass(frozen=True)
class _Table:
    """States of each pass, by pass and state.

    Attributes:
        edges: the ends of each state
        cuts: (K_n,) seconds as ranked
        rapids: (K_n,) seconds
        ways: seconds between, see `choose.shortest`
    """

    work: Work
    edges: list[list[Ends]]

    states: list[list[Turned]]
    cuts: list[Floats]
    rapids: list[Floats]
    ways: list[Floats]

    def costs(self) -> list[Floats]:
        """(K_n,) seconds of each state; infinite where its tool touches something."""
        return [np.where([bool(made.touching) for made in row], np.inf, cut + rapid)
                for row, cut, rapid in zip(self.states, self.cuts, self.rapids, strict=True)]

    def plan(self, picked: list[int]) -> OrientationPlan:
        """With the cuts planned in full."""
        made = tuple(row[k] for row, k in zip(self.states, picked, strict=True))
        cuts = np.array([one.seconds for one in made])
        rapids = np.array([row[k] for row, k in zip(self.rapids, picked, strict=True)])
        at = [0, *picked, 0]
        ways = np.array([way[a, b] for way, a, b in zip(self.ways, at[:-1], at[1:], strict=True)])
        ways[-1] += unwinding([row[k] for row, k in zip(self.edges, picked, strict=True)], self.work, any(picked))
        return OrientationPlan(made, cuts, rapids, ways, float(np.sum(cuts) + np.sum(rapids) + np.sum(ways)))


def plans_of(work: Work, results: list[Tried], allowed: Allowed, progress: Progress | None = None,
             workers: int | None = None) -> Plans:
    """The plans; `auto` chooses among everything the others use, and is the least of them.

    `keep` is the CL file as it is, its time is told even where its tool touches something; no other plan takes such a state.
    """
    table = _table(work, results, allowed, progress, workers)
    cost = table.costs()
    keep = [0] * len(results)
    least = [float(np.where(np.isfinite(c), cut, np.inf).min()) for cut, c in zip(table.cuts, cost, strict=True)]
    best = [np.where(cut <= low * (1.0 + _EQUAL), c, np.inf) for cut, low, c in zip(table.cuts, least, cost, strict=True)]
    aimed = [0 if one.aimed is None else index(row, (one.aimed.axis, one.aimed.held)) for row, one in
             zip(table.states, results, strict=True)]
    kept, per_pass = table.plan(keep), table.plan(shortest(best, table.ways)[0])
    wholes = [table.plan(picked) for picked in _wholes(table, keep, cost)]
    whole = _least([kept, *wholes])
    auto = _least([kept, per_pass, whole, table.plan(shortest(cost, table.ways)[0])])
    return Plans({"keep": kept, "per-pass": per_pass, "whole-part": whole, "auto": auto}, table.plan(aimed))


def _least(plans: list[OrientationPlan]) -> OrientationPlan:
    """The fastest of those that touch nothing; the last of the fastest ones."""
    return min(reversed(plans), key=lambda plan: (plan.touches, plan.seconds))


def _table(work: Work, results: list[Tried], allowed: Allowed, progress: Progress | None, workers: int | None) -> _Table:
    """All states with their seconds."""
    pools = _pools(results)

    def row(k: int, before: _Row | None) -> _Row:
        states = _states(results[k], allowed, pools[k])
        return states, _ranked(states), all_ends(states, work)

    rows = each_pass(row, work, allowed, "comparing", progress, workers)
    edges = [edge for _, _, edge in rows]
    rapids = [np.array([each.rapids for each in edge]) for edge in edges]
    return _Table(work, edges, [states for states, _, _ in rows], [cuts for _, cuts, _ in rows], rapids,
                  ways_between(work, edges))


def _ranked(states: list[Turned]) -> Floats:
    """Seconds (K,) of the cuts of the states of one pass, on the same knots."""
    runs = [made for made in states if not made.refused]
    if len(runs) < 2:
        return np.array([made.seconds for made in states])
    ranking = Ranking(runs[0])
    return np.array([ranking.seconds(made) for made in states])


def _pools(results: list[Tried]) -> list[list[Axis]]:
    """Axes that every pass of one CL axis may take: the best and the swiftest of its passes, most gain first, and means."""
    pools: list[list[Axis]] = [[] for _ in results]
    for group in _groups([one.own for one in results]):
        here = [results[k] for k in group]
        pool = _common([(one.gains[0], one.best) for one in here]) + _common([(one.gains[1], one.swift) for one in here])
        pool += [(here[0].own.axis, held) for held in common_angles([one.own for one in here]).tolist()]
        pool += [(axis, np.nan) for axis in _means([[one.aimed.axis for one in here if one.aimed is not None],
                                                    [one.best.axis for one in here], [one.swift.axis for one in here]])]
        for k in group:
            pools[k] = pool
    return pools


def _common(gains: list[tuple[float, Turned]]) -> list[Axis]:
    """Axes round which passes gain most, in seconds."""
    clusters: list[tuple[Turned, float]] = []
    for gain, best in sorted(gains, key=lambda pair: -pair[0]):
        near = next((k for k, (made, _) in enumerate(clusters) if made.same(best.axis, best.held, _CLUSTER)), None)
        if near is None:
            clusters.append((best, gain))
        else:
            clusters[near] = (clusters[near][0], clusters[near][1] + gain)
    return [(made.axis, made.held) for made, _ in sorted(clusters, key=lambda c: -c[1])[:_POOL]]


def _means(sets: list[list[Floats]]) -> list[Floats]:
    """Mean directions: the paper's orientation of the whole part is the mean of those of its passes (section IV.C)."""
    sums = [np.sum(axes, axis=0) for axes in sets if axes]
    return [total / size for total in sums if (size := float(np.linalg.norm(total))) > 1e-6]


def _groups(owns: list[Turned]) -> list[list[int]]:
    """Numbers of the passes that can be turned or spun, by their CL axis."""
    groups: list[tuple[Turned, list[int]]] = []
    for k, own in enumerate(owns):
        if own.one.fixed and not own.one.spins:
            continue
        near = next((members for other, members in groups if other.same(own.axis)), None)
        if near is None:
            groups.append((own, [k]))
        else:
            near.append(k)
    return [members for _, members in groups]


def _states(one: Tried, allowed: Allowed, pool: list[Axis]) -> list[Turned]:
    """Own, best, aimed and swiftest axes of a pass, then those of its pool that are allowed; no axis twice."""
    result: list[Turned] = []
    for made in (one.own, one.best, one.aimed, one.swift):
        if made is not None and index(result, (made.axis, made.held), -1) < 0:
            result.append(made)
    for made in _turned_to(one.own, [axis for axis in pool if index(result, axis, -1) < 0], allowed):
        if not made.refused and not made.touching and index(result, (made.axis, made.held), -1) < 0:
            result.append(made)
    return result


def _turned_to(own: Turned, wanted: list[Axis], allowed: Allowed) -> list[Turned]:
    """A pass along those of the wanted axes that it may take, solved together where the same angle is held."""
    by_held: dict[str, list[Axis]] = {}
    for axis, held in wanted:
        axis = own.one.kin.nearest_axis(axis[None])[0]
        if (not own.one.fixed or own.same(axis, own.held)) and not allowed.refused(own.one, axis):
            by_held.setdefault(repr(held), []).append((axis, held))
    return [made for some in by_held.values()
            for made in turned_all(own.one, np.array([axis for axis, _ in some]), own.machine, allowed.touching, some[0][1])]


def index(row: list[Turned], axis: Axis, missing: int = 0) -> int:
    """Where an axis stands among the states."""
    return next((k for k, other in enumerate(row) if other.same(*axis)), missing)


def _wholes(table: _Table, keep: list[int], cost: list[Floats]) -> list[list[int]]:
    """States of one axis for all passes of one CL axis: group by group the best between what the others take, and the one
    of least cutting time."""
    groups = _groups([row[0] for row in table.states])
    found = [[picks for made in table.states[group[0]]
              if min(picks := [index(table.states[k], (made.axis, made.held), -1) for k in group]) >= 0] for group in groups]
    least = list(keep)
    for group, options in zip(groups, found, strict=True):
        cuts = [sum(cost[k][p] for k, p in zip(group, picks, strict=True)) for picks in options]
        for k, pick in zip(group, options[int(np.argmin(cuts))], strict=True):
            least[k] = pick
    return [groupwise(start, list(zip(groups, found, strict=True)), cost, table.ways) for start in (keep, least)]
