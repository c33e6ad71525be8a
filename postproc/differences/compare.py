"""Two programs side by side: which stretch of one is which of the other, how far apart they are, what else differs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher

import numpy as np

from postproc.cycle_time.source import ExecutedProgram
from postproc.differences.distance import CurveGap, gap
from postproc.differences.stretches import Stretches, stretches
from postproc.reference.coolant import label
from toolpaths.arrays import Floats, Ints

_GRID = 1.0
"""mm by which begin and end of stretches are known again where the programs have different ones"""
_SIDES = {41: "left", 42: "right"}


@dataclass(frozen=True)
class StretchPair:
    """A stretch of A and the same of B: lines where they begin, lines where they are farthest apart, gap."""

    cut: bool
    line_a: int
    line_b: int
    worst_a: int
    worst_b: int
    gap: CurveGap


@dataclass(frozen=True)
class Lone:
    """A cut that only one program has: "a" or "b", its first line, mm that its tip moves."""

    program: str
    line: int
    length: float


@dataclass(frozen=True)
class StateDifference:
    """What differs in the states of stretches that are the same: its name, both values, how often, first lines."""

    what: str
    value_a: str
    value_b: str
    count: int
    line_a: int
    line_b: int


@dataclass(frozen=True)
class ProgramDifferences:
    """All that two programs do differently."""

    cuts: int
    pairs: tuple[StretchPair, ...]
    lone: tuple[Lone, ...]
    states: tuple[StateDifference, ...]

    def worst(self, cut: bool) -> StretchPair | None:
        """The pair of cuts, or of rapids, whose tips are farthest apart."""
        return max((one for one in self.pairs if one.cut is cut), key=lambda one: one.gap.tip, default=None)

    def same(self, tip: float, axis: float) -> bool:
        """True where cuts stay within `tip` mm and `axis` rad of each other, none is missing, and no state differs."""
        cuts = [one.gap for one in self.pairs if one.cut]
        return not (self.lone or self.states) and all(
            one.tip <= tip and one.axis <= axis and not one.backward for one in cuts)


def compare(a: ExecutedProgram, b: ExecutedProgram) -> ProgramDifferences:
    """What two programs do differently, each on its machine with its control."""
    of_a, of_b = stretches(a), stretches(b)
    matched, lone = _matched(of_a, a, of_b, b)
    pairs = tuple(_pair(of_a, i, of_b, j) for i, j in matched)
    return ProgramDifferences(int(of_a.cut.sum()), pairs, lone, _states(of_a, a, of_b, b, matched))


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
        matcher = SequenceMatcher(None, _keys(of_a, a, cuts_a), _keys(of_b, b, cuts_b), autojunk=False)
        for _, i0, i1, j0, j1 in matcher.get_opcodes():
            alike = np.array_equal(tools_a[i0:i1], tools_b[j0:j1])
            pairs += zip(cuts_a[i0:i1].tolist(), cuts_b[j0:j1].tolist(), strict=True) if alike else ()
            lone += [] if alike else [*_lone("a", of_a, cuts_a[i0:i1]), *_lone("b", of_b, cuts_b[j0:j1])]
    known = set(pairs)
    links = [(i - 1, j - 1) for i, j in pairs if i and j and not of_a.cut[i - 1] and not of_b.cut[j - 1]
             and (i < 2 or j < 2 or (i - 2, j - 2) in known)]
    return sorted(pairs + links), tuple(lone)


def _lone(name: str, one: Stretches, numbers: Ints) -> list[Lone]:
    return [Lone(name, int(one.line[one.first[k] + 1]), _length(one, k)) for k in numbers.tolist()]


def _length(one: Stretches, k: int) -> float:
    return float(np.linalg.norm(np.diff(one.tip[one.first[k]:one.last[k] + 1], axis=0), axis=1).sum())


def _pair(of_a: Stretches, i: int, of_b: Stretches, j: int) -> StretchPair:
    here = slice(int(of_a.first[i]), int(of_a.last[i]) + 1)
    there = slice(int(of_b.first[j]), int(of_b.last[j]) + 1)
    found = gap(of_a.tip[here], of_a.axis[here], of_b.tip[there], of_b.axis[there])
    return StretchPair(bool(of_a.cut[i]), int(of_a.line[here.start + 1]), int(of_b.line[there.start + 1]),
                int(of_a.line[min(here.start + found.at_a + 1, here.stop - 1)]),
                int(of_b.line[min(there.start + found.at_b + 1, there.stop - 1)]), found)


def _states(of_a: Stretches, a: ExecutedProgram, of_b: Stretches, b: ExecutedProgram,
            matched: Sequence[tuple[int, int]]) -> tuple[StateDifference, ...]:
    """What differs at the begin of cuts that are pairs, each combination once."""
    found: dict[tuple[str, str, str], list[tuple[int, int]]] = {}
    for i, j in matched:
        if of_a.cut[i]:
            lines = int(of_a.line[of_a.first[i] + 1]), int(of_b.line[of_b.first[j] + 1])
            mine, other = _state(a, of_a, i), _state(b, of_b, j)
            for what in mine:
                if mine[what] != other[what]:
                    found.setdefault((what, _text(mine[what]), _text(other[what])), []).append(lines)
    return tuple(StateDifference(*key, len(lines), *lines[0]) for key, lines in found.items())


def _state(program: ExecutedProgram, one: Stretches, k: int) -> dict[str, list[str]]:
    """What holds in a cut, each value as often as it changes, in words."""
    motion = program.motion
    rows = np.arange(int(one.row[k]), int(one.row_last[k]) + 1)
    rows = rows[motion.code[rows] > 0]
    feed = np.where(motion.inverse[rows], np.nan, motion.feed[rows] * motion.unit[rows])
    turns = motion.rpm[rows] * motion.spindle[rows]
    sides, flowing = motion.compensation[rows].astype(np.float64), motion.coolant[rows].astype(np.float64)
    lengths = np.array([program.lengths.get(h, 0.0) if h >= 0 else np.nan for h in motion.register[rows].tolist()])
    return {"feed": ["inverse time" if np.isnan(f) else f"{f:.6g} mm/min" for f in _changes(feed)],
            "spindle": ["standing" if r == 0.0 else f"{abs(r):g} rev/min{'' if r > 0.0 else ' anti-clockwise'}"
                        for r in _changes(turns)],
            "coolant": [label(int(c)) for c in _changes(flowing)],
            "radius compensation": [_SIDES.get(int(c), "off") for c in _changes(sides)],
            "length": ["none" if np.isnan(x) else f"{x:g} mm" for x in _changes(lengths)]}


def _changes(values: Floats) -> list[float]:
    """A value, and the next one wherever it changes."""
    new = np.ones(len(values), dtype=bool)
    new[1:] = (values[1:] != values[:-1]) & ~(np.isnan(values[1:]) & np.isnan(values[:-1]))
    return [float(v) for v in values[new]]


def _text(values: list[str]) -> str:
    """Values of one cut for people."""
    return values[0] if len(values) == 1 else f"{values[0]}, then {values[1]}" if len(values) == 2 else \
        f"{values[0]}, then {values[1]} ... ({len(values)} values)"
