"""What holds in cuts of two programs: feed, spindle, coolant, compensation, lengths, registers, rests; where it changes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from postproc.cycle_time.source import ExecutedProgram
from postproc.differences.distance import CurveGap
from postproc.differences.stretches import ProgramLine, Stretches, line_at, line_of
from postproc.readback.text.canonical import LOADED
from postproc.readback.text.modal import codes
from postproc.reference.coolant import label
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import PER_MINUTE

_SIDES = {41: "left", 42: "right"}
_PLACE = 0.1
"""mm by which the place of a change may differ, more than paths do"""
_SHARE = 1e-4
"""of a value: rounding, of a feed in inches per minute for instance"""
_REST = 1e-3
"""s"""
_INVERSE = 0.01
"""of the time of inverse-time blocks: each is rounded by itself"""
_STOPS = (0.0, 1.0)
BETWEEN = "dwell between cuts"
"""what differs in a link that is a pair"""


@dataclass(frozen=True)
class StateDifference:
    """What differs in the states of stretches that are the same: its name, both values, how often, first lines."""

    what: str
    value_a: str
    value_b: str
    count: int
    line_a: ProgramLine
    line_b: ProgramLine


@dataclass(frozen=True)
@arrays(values="C", places="C 3")
class ValueCourse:
    """A state all along a cut: its values (C,), NaN for none, and the tip (C, 3), mm, where each begins; `share` of a value
    by which another may differ."""

    values: Floats
    places: Floats
    text: Callable[[float], str]
    share: float = _SHARE

    def differs(self, other: ValueCourse, near: float) -> str:
        """"" where the other is the same; else "value", or "place": it changes more than `near` mm away."""
        if len(self.values) != len(other.values) or not np.allclose(
                self.values, other.values, rtol=self.share, atol=1e-9, equal_nan=True):
            return "value"
        away = np.linalg.norm(self.places[1:] - other.places[1:], axis=1)
        return "place" if float(away.max(initial=0.0)) > near else ""

    def shown(self) -> str:
        """Values of one cut for people."""
        texts = [self.text(value) for value in self.values[:2].tolist()]
        more = f" ... ({len(self.values)} values)" if len(self.values) > 2 else ""
        return ", then ".join(texts) + more

    def first_change(self, other: ValueCourse, near: float) -> tuple[str, str]:
        """Where the first change is that both have at different places."""
        away = np.linalg.norm(self.places - other.places, axis=1)
        k = 1 + int(np.argmax(away[1:] > near))
        mine, there = ("x {:.3f} y {:.3f} z {:.3f}".format(*one.places[k]) for one in (self, other))
        return mine, there


def states(of_a: Stretches, a: ExecutedProgram, of_b: Stretches, b: ExecutedProgram,
           matched: Sequence[tuple[int, int, CurveGap]]) -> tuple[StateDifference, ...]:
    """What differs in stretches that are pairs, each combination once. Registers, work offsets, smoothing and pecks mean the
    same on one control alone."""
    found: dict[tuple[str, str, str], list[tuple[ProgramLine, ProgramLine]]] = {}
    alike = a.controller == b.controller
    for i, j, apart in matched:
        lines = line_at(a, of_a, int(of_a.first[i]) + 1), line_at(b, of_b, int(of_b.first[j]) + 1)
        if abs(of_a.rest[i] - of_b.rest[j]) > _REST:
            rests = [f"{round(float(one), 3):g} s" for one in (of_a.rest[i], of_b.rest[j])]
            found.setdefault(("dwell" if of_a.cut[i] else BETWEEN, rests[0], rests[1]), []).append(lines)
        if of_a.cut[i]:
            near, mine, other = _PLACE + 2.0 * apart.tip, _courses(a, of_a, i, alike), _courses(b, of_b, j, alike)
            for what, course in mine.items():
                differs = course.differs(other[what], near)
                if differs == "value":
                    found.setdefault((what, course.shown(), other[what].shown()), []).append(lines)
                elif differs:
                    found.setdefault((f"{what} changes at", *course.first_change(other[what], near)), []).append(lines)
    return tuple(StateDifference(*key, len(lines), *lines[0]) for key, lines in found.items())


def _courses(program: ExecutedProgram, one: Stretches, k: int, alike: bool) -> dict[str, ValueCourse]:
    motion = program.motion
    whole = np.arange(int(one.row[k]), int(one.row_last[k]) + 1)
    rows = whole[motion.code[whole] > 0]

    def course(values: Floats, text: Callable[[float], str], share: float = _SHARE) -> ValueCourse:
        new = np.ones(len(values), dtype=bool)
        new[1:] = (values[1:] != values[:-1]) & ~(np.isnan(values[1:]) & np.isnan(values[:-1]))
        return ValueCourse(values[new], one.tip[np.searchsorted(one.of[1:], rows[:len(values)][new])], text, share)

    def number(unit: str, none: str = "none") -> Callable[[float], str]:
        return lambda x: none if np.isnan(x) else f"{x:.6g} {unit}".rstrip()

    inverse = motion.inverse[rows]
    minutes = float((1.0 / np.maximum(motion.feed[rows][inverse], 1e-12)).sum())
    lengths = np.array([program.lengths.get(h, 0.0) if h >= 0 else np.nan for h in motion.register[rows].tolist()])
    found = {
        "feed": course(np.where(inverse, np.nan, motion.feed[rows] * motion.unit[rows]), number("mm/min", "inverse time")),
        "inverse time": course(np.array([minutes / PER_MINUTE]), number("s"), _INVERSE),
        "spindle": course(motion.rpm[rows] * motion.spindle[rows], _spindle),
        "coolant": course(motion.coolant[rows].astype(np.float64), lambda c: label(int(c))),
        "radius compensation": course(motion.compensation[rows].astype(np.float64), lambda c: _SIDES.get(int(c), "off")),
        "length": course(lengths, number("mm")),
        "pitch": course(motion.pitch[rows], number("mm"))}
    own = {
        "length register": course(motion.register[rows].astype(np.float64), lambda h: f"{h:g}" if h >= 0.0 else "none"),
        "radius register": course(motion.radius[rows], number("")),
        "work offset": course(motion.offset[rows], number("", "not stated")),
        "smoothing": course(motion.blend[rows], number("mm", "not stated")),
        "rapids of the cycle": course(np.array([float((motion.code[whole] == 0).sum())]), number(""))}
    return found | own if alike else found


def _spindle(turns: float) -> str:
    sense = "" if turns > 0.0 else " anti-clockwise"
    return "standing" if not turns or np.isnan(turns) else f"{abs(turns):g} rev/min{sense}"


def events(of_a: Stretches, a: ExecutedProgram, of_b: Stretches, b: ExecutedProgram) -> tuple[StateDifference, ...]:
    """Stops and tool changes that one program has where the other has none, between the same cuts of both."""
    mine, other = _events(of_a, a), _events(of_b, b)
    counts = Counter(what for what, _ in mine), Counter(what for what, _ in other)
    lines = dict(reversed(mine)), dict(reversed(other))
    return tuple(StateDifference(what, _times(counts[0][what]), _times(counts[1][what]), 0,
                                 *(one.get(what, ProgramLine(0)) for one in lines))
                 for what in dict.fromkeys([*counts[0], *counts[1]]) if counts[0][what] != counts[1][what])


def _times(count: int) -> str:
    return f"{count} times" if count > 1 else "once" if count else "none"


def _events(one: Stretches, program: ExecutedProgram) -> list[tuple[str, ProgramLine]]:
    """(what and where, line) of stops and tool changes."""
    code, block = program.code, program.motion.block
    begin, end = block[one.row[one.cut]], block[one.row_last[one.cut]]
    stops, loaded = codes(code.words, "M", _STOPS), code.words.pick(LOADED)
    found = [*_placed(stops, "M{:g}", begin, end), *_placed(loaded, "tool change to T{:g}", begin, end)]
    return [(what, line_of(code, at)) for what, at in sorted(found, key=lambda each: each[1])]


def _placed(stated: tuple[Ints, Floats], name: str, begin: Ints, end: Ints) -> list[tuple[str, int]]:
    """Names of what blocks state, with the cut that they are in or before, and the blocks."""
    found = []
    for at, value in zip(stated[0].tolist(), stated[1].tolist(), strict=True):
        before, over = int((begin < at).sum()), int((end < at).sum())
        where = f"in cut {before}" if over < before else f"before cut {before + 1}" if before < len(begin) else "at the end"
        found.append((f"{name.format(value)} {where}", at))
    return found
