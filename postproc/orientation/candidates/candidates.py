"""Tool axes worth trying for a pass: its own, those that aim a vertex, the best reach where there is none, refined ones."""

from __future__ import annotations

from collections import Counter

import numpy as np

from machines.machine import Machine
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.free_rotary import best_held
from postproc.orientation.candidates.initial_axes import aimed_axes, around, reaching_axes
from postproc.orientation.candidates.ridges import best_on_ridge
from postproc.orientation.candidates.search import CandidateSearch, PassSearch
from postproc.orientation.candidates.travel import nearest_inside
from postproc.orientation.passes.allowed import SAME, AllowedAxes
from postproc.orientation.passes.passes import Pass
from postproc.orientation.passes.reasons import Unaimed
from toolpaths.arrays import Floats
from toolpaths.rotations import angle_between, slerp
from toolpaths.units import DEG

_NEAR = 1.0 * DEG
"""an axis that aims at the beginning or the end of a pass is tried where it is so far from all others"""
_STEPS = (6.0 * DEG, 3.0 * DEG, 1.5 * DEG, 0.75 * DEG)
"""of the refinement"""
_FINE = 2
"""step from which the best axis of the pass before is refined"""
_SWIFT = (3.0 * DEG, 1.5 * DEG)
"""steps round the axis of least cuts and rapids together"""
_ROUNDS = 3
_SHARES = np.arange(15, 0, -1) / 16.0
"""of the path to a neighbour that is not allowed"""


def tried(one: Pass, machine: Machine, allowed: AllowedAxes, before: PassSearch | None = None) -> PassSearch:
    """All candidates of a pass, planned unless their bound says that they lose.

    Args:
        before: of the pass before: its best axis is tried first, and refined by small steps where it is best
    """
    search = CandidateSearch(one, machine, allowed)
    if one.fixed:
        return search.tried(best_held(search, search.own), None)
    aimed = aimed_axes(one, machine, search.own.q[0])
    mean = search.add(aimed["mean"]) if "mean" in aimed else []
    seeds = [*mean, *(made for name in ("initial", "final") if name in aimed for made in search.add(aimed[name], _NEAR))]
    if not seeds:
        tilt = np.pi / 2.0 if len(one.normal) else allowed.tilt
        seeds = search.add(reaching_axes(one, machine, tilt, lambda axes: allowed.mask(one, axes)))
    seeds += [] if before is None else search.add(before.best.axis[None])
    if search.own.refused is not None and search.own.refused.kind == "travel" and not seeds:
        seeds = search.add(nearest_inside(one, machine, allowed).axis[None])
    again = next((made for made in seeds if before is not None and made.same(before.best.axis)), None)
    best = search.own
    for made in sorted(seeds, key=lambda made: -1.0 if made is again else made.bound):
        best = search.better(best, made)
    if all(search.known_to_touch(made) for made in mean):
        best = best_on_ridge(search, best)
    for step in _STEPS[_FINE:] if best is again else _STEPS:
        best = _refined(search, best, step)
    for step in _SWIFT:
        best = _hastened(search, best, step)
    paper = _least_turned(mean)
    return search.tried(best_held(search, best), paper, None if paper is not None else _unaimed(search, aimed))


def _unaimed(search: CandidateSearch, aimed: dict[str, Floats]) -> Unaimed:
    """Why no vertex is aimed along the mean direction."""
    if "mean" not in aimed:
        return Unaimed("no direction" if search.one.longest is None else "own axis")
    wanted = search.one.kin.nearest_axis(aimed["mean"])
    lost = [each for each in search.lost.values() if (angle_between(wanted, each.made.axis) < SAME).any()]
    count = Counter(each.kind for each in lost if each.kind in ("limits", "travel", "reach"))
    return Unaimed("lost", tuple(count.items())) if count else Unaimed("no vertex")


def _least_turned(made: list[Candidate]) -> Candidate | None:
    """The paper's choice: of the solutions within travel that with the smallest angles (section III.B)."""
    def angles(one: Candidate) -> tuple[float, float]:
        values = [abs(value) for value in one.rotary().values()]
        return round(max(values), 6), round(sum(values), 6)
    return min(made, key=angles, default=None)


def _refined(search: CandidateSearch, best: Candidate, step: float) -> Candidate:
    """The best of an axis and its neighbours; where one gains, those further along."""
    for _ in range(_ROUNDS):
        start = best
        for made in search.add(search.one.kin.nearest_axis(_neighbours(search, start.axis, step))):
            best = search.better(best, made)
        if best is start:
            break
    return best


def _hastened(search: CandidateSearch, best: Candidate, step: float) -> Candidate:
    """Neighbours of the fastest so far, and of what is swifter; the best by cuts among all that."""
    for _ in range(_ROUNDS):
        start = search.swift
        for made in search.add(search.one.kin.nearest_axis(_neighbours(search, start.axis, step))):
            best = search.better(best, made)
        if search.swift is start:
            break
    return best


def _neighbours(search: CandidateSearch, start: Floats, step: float) -> Floats:
    """Axes (M, 3) next to one; those that are not allowed as far towards them as is."""
    one, axes = search.one, around(start, search.one.axis, step)
    for k in np.flatnonzero(~search.allowed.mask(one, axes)):
        nearer = slerp(np.tile(start, (len(_SHARES), 1)), np.tile(axes[k], (len(_SHARES), 1)), _SHARES)
        inside = np.flatnonzero(search.allowed.mask(one, nearer))
        axes[k] = nearer[inside[0]] if len(inside) else axes[k]
    return axes
