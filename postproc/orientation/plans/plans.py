"""Plans of a whole part: the states that each pass may take, and keep, per pass, whole part and auto out of them."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from postproc.base.options import Orientation
from postproc.base.progress import Progress
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.search import PassSearch
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.parallel_map import each_pass
from postproc.orientation.passes.passes import PassContext
from postproc.orientation.plans.index_time import PassEnds, all_ends, links_between, unwinding
from postproc.orientation.plans.shortest_sequence import groupwise, shortest
from postproc.orientation.plans.states import CLUSTER, Axis, groups_of, index, pools_of, ranked, states_of
from toolpaths.arrays import Bools, Floats
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

_EQUAL = 2e-4
"""part of the time of a cut by which its best orientations may differ; turns decide among them"""
_Row = tuple[list[Candidate], Floats, list[PassEnds]]
"""States of a pass, seconds (K,) of their cuts, their ends"""


@dataclass(frozen=True)
@arrays(cuts="N", rapids="N", links="N+1")
class OrientationPlan:
    """One axis per pass.

    Attributes:
        states: the state of each pass, see `StateTable`
        picked: a Candidate per pass
        cuts, rapids (N,): seconds of each pass
        links (N + 1,): seconds before each pass, and back home
        seconds: all together
        barred: True where a program of one of its paths was refused
    """

    states: tuple[int, ...]
    picked: tuple[Candidate, ...]
    cuts: Floats
    rapids: Floats
    links: Floats
    seconds: float
    barred: bool

    @property
    def touches(self) -> bool:
        """Whether the tool touches what it must not in some pass, or a program of it was refused."""
        return self.barred or any(made.touching for made in self.picked)


@dataclass(frozen=True)
class Plans:
    """`named` plans side by side, and that of the paper's choice in each pass (elsewhere the own axis)."""

    named: dict[Orientation, OrientationPlan]
    paper: OrientationPlan


@dataclass(frozen=True)
class StateTable:
    """States of each pass, by pass and state.

    Attributes:
        edges: the ends of each state
        cuts: (K_n,) seconds as ranked
        rapids: (K_n,) seconds
        links: seconds between, see `choose.shortest`
        barred: of the shape of `links`: True where a program was refused for such a move; only `keep` still takes it
        paper: the state of each pass that the paper chooses
    """

    work: PassContext
    edges: list[list[PassEnds]]
    states: list[list[Candidate]]
    cuts: list[Floats]
    rapids: list[Floats]
    links: list[Floats]
    barred: list[Bools]
    paper: list[int]

    def costs(self) -> list[Floats]:
        """(K_n,) seconds of each state; infinite where its tool touches something."""
        return [np.where([bool(made.touching) for made in row], np.inf, cut + rapid)
                for row, cut, rapid in zip(self.states, self.cuts, self.rapids, strict=True)]

    def open_links(self) -> list[Floats]:
        """`links`, infinite where they are barred."""
        return [np.where(bar, np.inf, link) for link, bar in zip(self.links, self.barred, strict=True)]

    def plan(self, picked: list[int]) -> OrientationPlan:
        """With the cuts planned in full."""
        made = tuple(row[k] for row, k in zip(self.states, picked, strict=True))
        cuts = np.array([one.seconds for one in made])
        rapids = np.array([row[k] for row, k in zip(self.rapids, picked, strict=True)])
        links = np.array([link[at] for link, at in zip(self.links, _steps(picked), strict=True)])
        links[-1] += unwinding([row[k] for row, k in zip(self.edges, picked, strict=True)], self.work,
                               any(picked))
        barred = any(bar[at] for bar, at in zip(self.barred, _steps(picked), strict=True))
        return OrientationPlan(tuple(picked), made, cuts, rapids, links,
                               float(np.sum(cuts) + np.sum(rapids) + np.sum(links)), barred)

    def without(self, plan: OrientationPlan, links: set[int], passes: set[int]) -> StateTable:
        """With `links` of a plan (number n leads to pass n, the last one home) and the states of some of its
        passes barred: these, and those whose axes are within 2 degrees of them."""
        barred = [bar.copy() for bar in self.barred]
        near = [[made.same(self.states[n][k].axis, self.states[n][k].held, CLUSTER) for made in self.states[n]]
                for n, k in enumerate(plan.states)]
        for n in links:
            barred[n] |= np.outer([True] if n == 0 else near[n - 1], [True] if n == len(near) else near[n])
        for n in passes:
            barred[n] |= np.array(near[n])[None]
        return replace(self, barred=barred)


def _steps(picked: list[int]) -> list[tuple[int, int]]:
    """(from, to) of each path."""
    return list(zip([0, *picked], [*picked, 0], strict=True))


def plans_of(table: StateTable) -> Plans:
    """The plans; `auto` chooses among everything the others use, and is the least of them.

    `keep` is the CL file as it is, its time is reported even where its tool touches something; no other plan
    takes such a state.
    """
    cost, links, keep = table.costs(), table.open_links(), [0] * len(table.states)
    least = [float(np.where(np.isfinite(c), cut, np.inf).min()) for cut, c in zip(table.cuts, cost, strict=True)]
    best = [np.where(cut <= low * (1.0 + _EQUAL), c, np.inf) for cut, low, c in zip(table.cuts, least, cost, strict=True)]
    kept, per_pass = table.plan(keep), table.plan(shortest(best, links)[0])
    wholes = [table.plan(picked) for picked in _wholes(table, keep, cost, links)]
    whole = _least([kept, *wholes])
    auto = _least([kept, per_pass, whole, table.plan(shortest(cost, links)[0])])
    return Plans({"keep": kept, "per-pass": per_pass, "whole-part": whole, "auto": auto},
                 table.plan(table.paper))


def _least(plans: list[OrientationPlan]) -> OrientationPlan:
    """The fastest of those that touch nothing; the last of the fastest ones."""
    return min(reversed(plans), key=lambda plan: (plan.touches, plan.seconds))


def table_of(work: PassContext, results: list[PassSearch], allowed: AllowedAxes, progress: Progress | None = None,
             workers: int | None = None) -> StateTable:
    """All states with their seconds."""
    rows = each_pass(partial(_row, work, allowed, results, pools_of(results)), work, allowed, "comparing", progress, workers)
    states, edges = [states for states, _, _ in rows], [edge for _, _, edge in rows]
    rapids = [np.array([each.rapids for each in edge]) for edge in edges]
    links = links_between(work, edges)
    paper = [0 if one.aimed is None else index(row, (one.aimed.axis, one.aimed.held)) for row, one in
             zip(states, results, strict=True)]
    return StateTable(work, edges, states, [cuts for _, cuts, _ in rows], rapids, links,
                      [np.zeros(link.shape, dtype=np.bool_) for link in links], paper)


def _row(work: PassContext, allowed: AllowedAxes, results: list[PassSearch], pools: list[list[Axis]], k: int,
         before: _Row | None) -> _Row:
    """States of a pass, ranked, with their ends."""
    states = states_of(results[k], allowed, pools[k])
    return states, ranked(states), all_ends(states, work)


def _wholes(table: StateTable, keep: list[int], cost: list[Floats], links: list[Floats]) -> list[list[int]]:
    """States of one axis for all passes of one CL axis: group by group the best between what the others take,
    and the one of least cutting time."""
    groups = groups_of([row[0] for row in table.states])
    found = [[picks for made in table.states[group[0]]
              if min(picks := [index(table.states[k], (made.axis, made.held), -1) for k in group]) >= 0] for group in groups]
    least = list(keep)
    for group, options in zip(groups, found, strict=True):
        cuts = [sum(cost[k][p] for k, p in zip(group, picks, strict=True)) for picks in options]
        for k, pick in zip(group, options[int(np.argmin(cuts))], strict=True):
            least[k] = pick
    return [groupwise(start, list(zip(groups, found, strict=True)), cost, links) for start in (keep, least)]
