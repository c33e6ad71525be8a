"""The states that each pass may take: an axis and a held angle each, its own choices and a pool common to passes alike."""

from __future__ import annotations

import numpy as np

from postproc.orientation.candidates.candidate_times import Candidate, turned_all
from postproc.orientation.candidates.free_rotary import common_angles
from postproc.orientation.candidates.ranking import Ranking
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.passes.allowed import AllowedAxes
from toolpaths.arrays import Floats
from toolpaths.units import DEG

_POOL = 5
"""axes besides its own choices that every pass may take"""
CLUSTER = 2.0 * DEG
Axis = tuple[Floats, float]
"""Tool axis (3,) and held angle, see `Candidate`."""


def ranked(states: list[Candidate]) -> Floats:
    """Seconds (K,) of the cuts of the states of one pass, on the same knots."""
    runs = [made for made in states if not made.refused]
    if len(runs) < 2:
        return np.array([made.seconds for made in states])
    ranking = Ranking(runs[0])
    return np.array([ranking.seconds(made) for made in states])


def pools_of(results: list[PassSearch]) -> list[list[Axis]]:
    """Axes that every pass of one CL axis may take: the best and the swiftest of its passes, most gain first, and means."""
    pools: list[list[Axis]] = [[] for _ in results]
    for group in groups_of([one.own for one in results]):
        here = [results[k] for k in group]
        pool = _common([(one.gains[0], one.best) for one in here]) + _common([(one.gains[1], one.swift) for one in here])
        pool += [(here[0].own.axis, held) for held in common_angles([one.own for one in here]).tolist()]
        pool += [(axis, np.nan) for axis in _means([[one.aimed.axis for one in here if one.aimed is not None],
                                                    [one.best.axis for one in here], [one.swift.axis for one in here]])]
        for k in group:
            pools[k] = pool
    return pools


def _common(gains: list[tuple[float, Candidate]]) -> list[Axis]:
    """Axes round which passes gain most, in seconds."""
    clusters: list[tuple[Candidate, float]] = []
    for gain, best in sorted(gains, key=lambda pair: -pair[0]):
        near = next((k for k, (made, _) in enumerate(clusters) if made.same(best.axis, best.held, CLUSTER)), None)
        if near is None:
            clusters.append((best, gain))
        else:
            clusters[near] = (clusters[near][0], clusters[near][1] + gain)
    return [(made.axis, made.held) for made, _ in sorted(clusters, key=lambda c: -c[1])[:_POOL]]


def _means(sets: list[list[Floats]]) -> list[Floats]:
    """Mean directions: the paper's orientation of the whole part is the mean of those of its passes (section IV.C)."""
    sums = [np.sum(axes, axis=0) for axes in sets if axes]
    return [total / size for total in sums if (size := float(np.linalg.norm(total))) > 1e-6]


def groups_of(owns: list[Candidate]) -> list[list[int]]:
    """Numbers of the passes that can be turned or spun, by their CL axis."""
    groups: list[tuple[Candidate, list[int]]] = []
    for k, own in enumerate(owns):
        if own.one.fixed and not own.one.spins:
            continue
        near = next((members for other, members in groups if other.same(own.axis)), None)
        if near is None:
            groups.append((own, [k]))
        else:
            near.append(k)
    return [members for _, members in groups]


def states_of(one: PassSearch, allowed: AllowedAxes, pool: list[Axis]) -> list[Candidate]:
    """Own, best, aimed and swiftest axes of a pass, then those of its pool that are allowed; no axis twice."""
    result: list[Candidate] = []
    for made in (one.own, one.best, one.aimed, one.swift):
        if made is not None and index(result, (made.axis, made.held), -1) < 0:
            result.append(made)
    for made in _turned_to(one.own, [axis for axis in pool if index(result, axis, -1) < 0], allowed):
        if not made.refused and not made.touching and index(result, (made.axis, made.held), -1) < 0:
            result.append(made)
    return result


def _turned_to(own: Candidate, wanted: list[Axis], allowed: AllowedAxes) -> list[Candidate]:
    """A pass along those of the wanted axes that it may take, solved together where the same angle is held."""
    by_held: dict[str, list[Axis]] = {}
    for axis, held in wanted:
        axis = own.one.kin.nearest_axis(axis[None])[0]
        if (not own.one.fixed or own.same(axis, own.held)) and not allowed.refused(own.one, axis):
            by_held.setdefault(repr(held), []).append((axis, held))
    return [made for some in by_held.values()
            for made in turned_all(own.one, np.array([axis for axis, _ in some]), own.machine, allowed.touching, some[0][1])]


def index(row: list[Candidate], axis: Axis, missing: int = 0) -> int:
    """Where an axis stands among the states."""
    return next((k for k, other in enumerate(row) if other.same(*axis)), missing)
