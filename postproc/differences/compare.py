"""Two programs side by side: which stretch of one is which of the other, how far apart they are, what else differs."""

from __future__ import annotations

from dataclasses import replace
from difflib import SequenceMatcher

import numpy as np

from postproc.cycle_time.source import ExecutedProgram
from postproc.differences.distance import CurveGap, gap
from postproc.differences.states import BETWEEN, StateDifference, events, states
from postproc.differences.stretches import ProgramLine, Stretches, line_at, stretches
from toolpaths.arrays import Ints
from toolpaths.dataclass import dataclass

_GRID = 1.0
"""mm by which begin and end of stretches are known again where the programs have different ones"""


@dataclass(frozen=True)
class StretchPair:
    """A stretch of A and the same of B: lines where they begin, lines where they are farthest apart, gap."""

    cut: bool
    line_a: ProgramLine
    line_b: ProgramLine
    worst_a: ProgramLine
    worst_b: ProgramLine
    gap: CurveGap


@dataclass(frozen=True)
class Lone:
    """A cut, or a move between cuts, that only one program has: "a" or "b", its first line, mm that its tip moves."""

    program: str
    line: ProgramLine
    length: float
    cut: bool


@dataclass(frozen=True)
class ProgramDifferences:
    """All that two programs do differently; `one_control`: what means the same on one control alone was compared, too."""

    cuts: int
    pairs: tuple[StretchPair, ...]
    lone: tuple[Lone, ...]
    states: tuple[StateDifference, ...]
    events: tuple[StateDifference, ...]
    one_control: bool

    def worst(self, cut: bool) -> StretchPair | None:
        """The pair of cuts, or of rapids, whose tips are farthest apart."""
        return max((one for one in self.pairs if one.cut is cut), key=lambda one: one.gap.tip, default=None)

    def same_cuts(self, tip: float, axis: float) -> bool:
        """True where cuts stay within `tip` mm and `axis` rad of each other, none is missing, and no state differs."""
        states = any(one.what != BETWEEN for one in self.states)
        return not states and self._same(True, tip, axis)

    def same_links(self, tip: float, axis: float) -> bool:
        """The same of what lies between cuts, with rests, stops and tool changes."""
        rests = any(one.what == BETWEEN for one in self.states)
        return not (rests or self.events) and self._same(False, tip, axis)

    def _same(self, cut: bool, tip: float, axis: float) -> bool:
        gaps = [one.gap for one in self.pairs if one.cut is cut]
        return not any(one.cut or not cut for one in self.lone) and all(
            one.tip <= tip and one.axis <= axis and not one.reordered for one in gaps)


def compare(a: ExecutedProgram, b: ExecutedProgram) -> ProgramDifferences:
    """What two programs do differently, each on its machine with its control."""
    of_a, of_b = stretches(a), stretches(b)
    matched, lone = _matched(of_a, a, of_b, b)
    alike = a.controller == b.controller
    pairs = tuple(_pair(of_a, a, i, of_b, b, j) for i, j in matched)
    if not alike:  # how pecks follow each other is the control's own
        pairs = tuple(replace(one, gap=replace(one.gap, reordered=False)) if a.motion.hole[of_a.row[i]] and one.cut
                      and b.motion.hole[of_b.row[j]] else one for (i, j), one in zip(matched, pairs, strict=True))
    gaps = [(i, j, one.gap) for (i, j), one in zip(matched, pairs, strict=True)]
    return ProgramDifferences(int(of_a.cut.sum()), pairs, lone, states(of_a, a, of_b, b, gaps),
                              () if any(one.cut for one in lone) else events(of_a, a, of_b, b), alike)


def _keys(one: Stretches, program: ExecutedProgram, cuts: Ints) -> list[tuple[float, ...]]:
    """What a cut is known again by: tool, begin and end."""
    ends = np.round(np.hstack([one.tip[one.first[cuts]], one.tip[one.last[cuts]]]) / _GRID)
    return [(float(tool), *map(float, end)) for tool, end in zip(program.motion.tool[one.row[cuts]], ends, strict=True)]


def _matched(of_a: Stretches, a: ExecutedProgram, of_b: Stretches,
             b: ExecutedProgram) -> tuple[list[tuple[int, int]], tuple[Lone, ...]]:
    """Pairs of stretches, and those without one.

    Of as many cuts with the same tools in both, the first is the first and so on; else those with the same tool, begin and
    end in the same order are pairs (longest common runs), and what lies between them, where it is as much of each. What lies
    between two cuts is a pair where both cuts are.
    """
    cuts_a, cuts_b = np.flatnonzero(of_a.cut), np.flatnonzero(of_b.cut)
    tools_a, tools_b = a.motion.tool[of_a.row[cuts_a]], b.motion.tool[of_b.row[cuts_b]]
    pairs, lone = list[tuple[int, int]](), list[Lone]()
    if np.array_equal(tools_a, tools_b):
        pairs = list(zip(cuts_a.tolist(), cuts_b.tolist(), strict=True))
    else:
        for i0, i1, j0, j1 in _runs(_keys(of_a, a, cuts_a), _keys(of_b, b, cuts_b)):
            alike = np.array_equal(tools_a[i0:i1], tools_b[j0:j1])
            pairs += zip(cuts_a[i0:i1].tolist(), cuts_b[j0:j1].tolist(), strict=True) if alike else ()
            lone += [] if alike else [*_lone("a", a, of_a, cuts_a[i0:i1]), *_lone("b", b, of_b, cuts_b[j0:j1])]
    links = _links(of_a, of_b, dict(pairs))
    lone += [] if lone else [*_lone("a", a, of_a, np.setdiff1d(np.flatnonzero(~of_a.cut), [i for i, _ in links])),
                             *_lone("b", b, of_b, np.setdiff1d(np.flatnonzero(~of_b.cut), [j for _, j in links]))]
    return sorted(pairs + links), tuple(lone)


def _runs(a: list[tuple[float, ...]], b: list[tuple[float, ...]]) -> list[tuple[int, int, int, int]]:
    """Runs of keys that are the same or stand in each other's place: begin and end in A, then in B. The search takes time by
    the square of what lies between what both begin and end with."""
    short = min(len(a), len(b))
    first = next((k for k in range(short) if a[k] != b[k]), short)
    last = next((k for k in range(short - first) if a[-1 - k] != b[-1 - k]), short - first)
    ends = len(a) - last, len(b) - last
    matcher = SequenceMatcher(None, a[first:ends[0]], b[first:ends[1]], autojunk=False)
    inside = [(i0 + first, i1 + first, j0 + first, j1 + first) for _, i0, i1, j0, j1 in matcher.get_opcodes()]
    return [(0, first, 0, first), *inside, (ends[0], len(a), ends[1], len(b))]


def _links(of_a: Stretches, of_b: Stretches, cuts: dict[int, int]) -> list[tuple[int, int]]:
    """What lies between cuts that are pairs, before the first ones and behind the last ones."""
    around = {**cuts, -1: -1, len(of_a): len(of_b)}
    return [(i, j) for i in np.flatnonzero(~of_a.cut).tolist() if i - 1 in around
            and (j := around[i - 1] + 1) < len(of_b) and not of_b.cut[j] and around.get(i + 1) == j + 1]


def _lone(name: str, program: ExecutedProgram, one: Stretches, numbers: Ints) -> list[Lone]:
    return [Lone(name, line_at(program, one, int(one.first[k]) + 1), _length(one, k), bool(one.cut[k]))
            for k in numbers.tolist()]


def _length(one: Stretches, k: int) -> float:
    return float(np.linalg.norm(np.diff(one.tip[one.first[k]:one.last[k] + 1], axis=0), axis=1).sum())


def _pair(of_a: Stretches, a: ExecutedProgram, i: int, of_b: Stretches, b: ExecutedProgram, j: int) -> StretchPair:
    here = slice(int(of_a.first[i]), int(of_a.last[i]) + 1)
    there = slice(int(of_b.first[j]), int(of_b.last[j]) + 1)
    found = gap(of_a.tip[here], of_a.axis[here], of_b.tip[there], of_b.axis[there])
    lines = (line_at(a, of_a, here.start + 1), line_at(b, of_b, there.start + 1),
             line_at(a, of_a, min(here.start + found.at_a + 1, here.stop - 1)),
             line_at(b, of_b, min(there.start + found.at_b + 1, there.stop - 1)))
    return StretchPair(bool(of_a.cut[i]), *lines, found)
