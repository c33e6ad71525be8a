"""The journey: passes -> candidates of each -> plans keep, per pass, whole part, auto -> the toolpath with new axes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from machines.machine import Machine
from postproc.options import Options, Orientation
from postproc.orientation.allowed import SAME, Allowed
from postproc.orientation.candidates import Tried, tried
from postproc.orientation.choose import seconds, shortest
from postproc.orientation.limited import limit_faults
from postproc.orientation.passes import Pass, Work, work_of
from postproc.orientation.timed import Turned, turned
from postproc.orientation.turns import Ends, between, ends
from postproc.setup import SetupFile
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error, has_errors, warning
from toolpaths.rotations import angle_between
from toolpaths.toolpath import Arcs, Toolpath
from toolpaths.units import DEG

Progress = Callable[[str, int, int], None]
_POOL = 5
"""axes besides its own choices that every pass may take"""
_APART = "check part, fixtures and holder of the set-up, allow more tilt (--max-tilt) or take a longer tool"
_CLUSTER = 2.0 * DEG
_EQUAL = 2e-4
"""part of the time of a cut by which its best orientations may differ; turns decide among them"""


@dataclass(frozen=True)
class OrientationPlan:
    """One axis per pass: `picked` (passes), and the seconds of cuts, rapids and turns together."""

    picked: tuple[Turned, ...]
    seconds: float


@dataclass(frozen=True)
class OrientationChoice:
    """What was found: per pass what was tried, and the plans side by side.

    Attributes:
        paper: the paper's choice in each pass (a vertex along the mean direction, smallest angles), elsewhere the own axis
    """

    work: Work
    tried: tuple[Tried, ...]
    plans: dict[Orientation, OrientationPlan]
    paper: OrientationPlan

    def toolpath(self, name: Orientation) -> Toolpath:
        """The CL path with the axes of a plan."""
        return reoriented(self.work, self.plans[name].picked)


def orient(toolpath: Toolpath, machine: Machine, setup: SetupFile, options: Options | None = None,
           progress: Progress | None = None) -> tuple[OrientationChoice | None, list[Diagnostic]]:
    """Orientations of all passes of a toolpath, within `options.max_tilt`; None where a diagnostic is an ERROR."""
    options = options or Options()
    work, found = work_of(toolpath, machine, setup, options)
    if work is None:
        return None, found
    found += limit_faults(work, options.setup)
    if has_errors(found):
        return None, found
    allowed = Allowed(options.max_tilt * DEG, None, setup.orientation)
    results = []
    for one in work.passes:
        if progress is not None:
            progress("orienting", one.number, len(work.passes))
        try:
            results.append(tried(one, machine, allowed))
        except (ValueError, ArithmeticError) as fault:
            return None, [*found, error("orient.plan", f"no motion could be planned: {fault}", file=toolpath.file,
                                        lines=[one.line])]
    if all(one.fixed for one in work.passes):
        reasons = "; ".join(dict.fromkeys(one.fixed for one in work.passes))
        found.append(warning("orient.fixed", f"no pass can be turned: {reasons}", file=toolpath.file))
    found += _touching(work, results)
    return (None if has_errors(found) else _plans(work, results, allowed)), found


def _touching(work: Work, results: list[Tried]) -> list[Diagnostic]:
    """Passes whose own axis touches something: a warning where another axis was found, else an error."""
    result = []
    for each in results:
        one, why = each.own.one, each.own.touching
        if why:
            told, other = f"pass {one.number} with the axis of the CL file: {why}", each.best is not each.own
            code, make = ("orient.own_touches", warning) if other else ("orient.touches", error)
            told += "" if other else "; no other axis is allowed" + (f" ({one.fixed})" if one.fixed else "")
            result.append(make(code, told, file=work.toolpath.file, lines=[one.line], hint=_APART))
    return result


def _plans(work: Work, results: list[Tried], allowed: Allowed) -> OrientationChoice:
    """Tables of all states of all passes, and the plans out of them; `auto` chooses among everything the others use.

    `keep` is the CL file as it is, its time is told even where its tool touches something; no other plan takes such a state.
    """
    states = [_states(one, work.machine, allowed, pool) for one, pool in zip(results, _pools(results), strict=True)]
    cuts = [np.array([made.seconds for made in row]) for row in states]
    edge = [[ends(made, work) for made in row] for row in states]
    cost = [cut + np.array([e.rapids for e in row]) for cut, row in zip(cuts, edge, strict=True)]
    free = [np.where([bool(made.touching) for made in row], np.inf, one) for one, row in zip(cost, states, strict=True)]
    ways = ways_between(work, edge)

    def plan(picked: list[int]) -> OrientationPlan:
        return OrientationPlan(tuple(row[k] for row, k in zip(states, picked, strict=True)), seconds(picked, cost, ways))

    keep = [0] * len(states)
    least = [float(np.where(np.isfinite(row), cut, np.inf).min()) for cut, row in zip(cuts, free, strict=True)]
    best = [np.where(cut <= low * (1.0 + _EQUAL), row, np.inf) for cut, low, row in zip(cuts, least, free, strict=True)]
    per_pass = shortest(best, ways)[0]
    paper = [_index(row, one.aimed) for row, one in zip(states, results, strict=True)]
    whole = min([keep, *_wholes(states, keep)], key=lambda picked: seconds(picked, free, ways))
    plans: dict[Orientation, OrientationPlan] = {"keep": plan(keep), "per-pass": plan(per_pass), "whole-part": plan(whole),
                                              "auto": plan(shortest(free, ways)[0])}
    return OrientationChoice(work, tuple(results), plans, plan(paper))


def _pools(results: list[Tried]) -> list[list[Floats]]:
    """Axes that every pass of one CL axis may take: the best ones of its passes, most gain first, and their means."""
    groups = _groups([one.own.one for one in results])
    pools: list[list[Floats]] = [[] for _ in results]
    for group in groups:
        gains = [(one.own.seconds - one.best.seconds, one.best.axis) for k in group if (one := results[k])]
        clusters: list[tuple[Floats, list[float]]] = []
        for gain, axis in sorted(gains, key=lambda pair: -pair[0]):
            near = next((values for centre, values in clusters if angle_between(centre, axis) < _CLUSTER), None)
            if near is None:
                clusters.append((axis, [gain]))
            else:
                near.append(gain)
        pool = [axis for axis, _ in sorted(clusters, key=lambda c: -sum(c[1]))[:_POOL]]
        pool += _means([[one.aimed.axis for k in group if (one := results[k]).aimed is not None],
                        [results[k].best.axis for k in group]])
        for k in group:
            pools[k] = pool
    return pools


def _means(sets: list[list[Floats]]) -> list[Floats]:
    """Mean directions: the paper's orientation of the whole part is the mean of those of its passes (section IV.C)."""
    sums = [np.sum(axes, axis=0) for axes in sets if axes]
    return [total / size for total in sums if (size := float(np.linalg.norm(total))) > 1e-6]


def _groups(passes: list[Pass]) -> list[list[int]]:
    """Numbers of the passes that can be turned, by their CL axis."""
    groups: list[tuple[Floats, list[int]]] = []
    for k, one in enumerate(passes):
        if one.fixed:
            continue
        near = next((members for axis, members in groups if angle_between(axis, one.axis) < SAME), None)
        if near is None:
            groups.append((one.axis, [k]))
        else:
            near.append(k)
    return [members for _, members in groups]


def _states(one: Tried, machine: Machine, allowed: Allowed, pool: list[Floats]) -> list[Turned]:
    """Own, best and aimed axes of a pass, then those of its pool that are allowed; no axis twice."""
    result: list[Turned] = []
    for made in (one.own, one.best, one.aimed):
        if made is not None and _index(result, made, -1) < 0:
            result.append(made)
    for axis in pool:
        axis = one.own.one.kin.nearest_axis(axis[None])[0]
        if any(angle_between(axis, other.axis) < SAME for other in result) or allowed.refused(one.own.one, axis):
            continue
        made = turned(one.own.one, axis, machine, allowed.touching)
        if not made.refused and not made.touching:
            result.append(made)
    return result


def _index(row: list[Turned], made: Turned | None, missing: int = 0) -> int:
    """Where an axis stands among the states."""
    if made is None:
        return missing
    return next((k for k, other in enumerate(row) if angle_between(made.axis, other.axis) < SAME), missing)


def _wholes(states: list[list[Turned]], keep: list[int]) -> list[list[int]]:
    """States of each axis that all passes of one CL axis can take, the other passes as they are and as they are turned."""
    groups = _groups([row[0].one for row in states])
    found = [[picks for made in states[group[0]] if min(picks := [_index(states[k], made, -1) for k in group]) >= 0]
             for group in groups]
    result = []
    for group, options in zip(groups, found, strict=True):
        for picks in options:
            picked = list(keep)
            for k, pick in zip(group, picks, strict=True):
                picked[k] = pick
            result.append(picked)
    if len(groups) > 1:
        picked = list(keep)
        for group, options in zip(groups, found, strict=True):
            best = min(options, key=lambda picks: sum(states[k][p].seconds for k, p in zip(group, picks, strict=True)))
            for k, pick in zip(group, best, strict=True):
                picked[k] = pick
        result.append(picked)
    return result


def ways_between(work: Work, edge: list[list[Ends]]) -> list[Floats]:
    """Seconds between the states of neighbouring passes, from home and back."""
    passes = work.passes
    ways = [between(None, edge[0], work, True, False)]
    for n in range(1, len(edge)):
        ways.append(between(edge[n - 1], edge[n], work, passes[n].by_home, passes[n].tool != passes[n - 1].tool))
    return [*ways, between(edge[-1], None, work, True, False)]


def reoriented(work: Work, picked: tuple[Turned, ...]) -> Toolpath:
    """The CL path with other axes: tips moved by R (axis - axis'), so that the ball stays where it is; arcs with them."""
    path, back = work.toolpath, work.placement.inverse()
    tip, axis, center = path.tip.copy(), path.axis.copy(), path.arcs.center.copy()
    for made in picked:
        one = made.one
        if one.fixed or angle_between(made.axis, one.axis) < SAME:
            continue
        rows = np.unique(work.moves.row[slice(*one.rows)])
        move = back.directions(one.shift(made.axis)[None])[0]
        tip[rows] += move
        axis[rows] = back.directions(made.axis[None])[0]
        arcs = np.unique(path.arc[rows])
        center[arcs[arcs >= 0]] += move
    return replace(path, tip=tip, axis=axis, arcs=Arcs(center, path.arcs.normal, path.arcs.radius, path.arcs.sweep))
