"""The canonical text that every dialect is translated into: words in letters and numbers, laws and cycles as objects.

Capitals are absolute axis words, small letters the same words counted from where the block begins; I, J, K
are centres in the coordinates of the block, i, j, k from its start. G and M numbers are those of NIST
RS274/NGC; what NIST has no number for has a sign of its own:
"""

from __future__ import annotations

from dataclasses import field, replace
from typing import Literal

import numpy as np

from postproc.control.control import InterpolationMode
from postproc.readback.text.words import Words
from toolpaths.arrays import Array, Bools, Floats, Ints, among
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic
from toolpaths.shapes import arrays

REGISTER = "@"
"""length register in force from this block on, -1 for none"""
UNSTATED = -2.0
"""register behind a tool change after which the length in force is a setting of the control"""
LOADED = "$"
"""tool that this block puts into the spindle"""
COOLANT = "^"
"""bits of what flows from this block on (`postproc.reference.coolant`)"""
STANDS = "_"
"""a block before which the control itself has stopped the spindle: M0 or M1 in the one before it"""
REST = "="
"""s that the block rests"""
SMOOTH = "!"
"""mm that the control's own smoothing may take from this block on, inf without a limit"""
SMOOTH_AXIS = "|"
"""degrees that it may take of the tool axis from this block on, inf without a limit"""
SMOOTH_LEVEL = "'"
"""level of the control's own smoothing from this block on, as the dialect counts them, NaN where the words name none"""
OFFSET = "#"
"""work offset register, numbered by `offset_number`"""
LAW = "&"
"""index into Canonical.laws: from this block on"""
CALL = "*"
"""index into Canonical.drills: at the end of this block"""
TURNS = "~"
"""full turns of an arc, more than the one to its end"""
CURVE = "%"
"""index into Canonical.curves: the block runs this cubic (or curve of a degree up to 5) to its end"""
STATEMENT = "?"
"""index into Text.statements: what is not letters with numbers"""

INCREMENTAL = 32
"""between the codes of a capital and its small letter"""
EXTENDED_OFFSETS = 1000.0
"""G54.1 P1 and its like are numbered from here"""


@dataclass(frozen=True)
class DialectStatement:
    """What a dialect writes in words of its own, e.g. ("CYCLE81", (50.0, 0.0, ...))."""

    name: str
    args: tuple[float | str | None, ...] = ()
    keys: dict[str, float] = field(default_factory=dict)

    def number(self, index: int, default: float = float("nan")) -> float:
        """Argument `index` as a number, `default` where it is not given."""
        value = self.args[index] if index < len(self.args) else None
        return value if isinstance(value, float) else default


@dataclass(frozen=True)
class ProgramText:
    """One file in words, statements among them by their index."""

    words: Words
    statements: tuple[DialectStatement, ...] = ()


Files = tuple[tuple[str, int], ...]
RotaryDirection = Literal["nearest", "+", "-"]
DrillStyle = Literal["drill", "break", "peck", "feed_out"]


@dataclass(frozen=True)
@arrays(rotation="3 3", shift="3")
class WordMeaning:
    """What words mean from a block on.

    Attributes:
        name: "axes", "tcp" or "tilted"; code: as the program writes it
        rotation (3, 3), shift (3,): of a tilted plane; columns are X', Y', Z' seen from the table, shift from
            the work offset's zero, mm; rotation None: the tool's frame where the rotary axes stand
        choice: how the control picks the rotary positions: the nearest, or those with the first tilting axis at + or -
    """

    name: InterpolationMode
    code: str
    rotation: Floats | None = None
    shift: Floats = field(default_factory=lambda: np.zeros(3))
    choice: RotaryDirection = "nearest"


@dataclass(frozen=True)
class Drill:
    """A drilling cycle with its levels as words on the tool's axis, mm.

    Attributes:
        plane: where feed begins; bottom; out: where the cycle leaves the tool
        bottoms: of each peck, the last one is `bottom`
        style: "drill"; "break": between pecks it lifts by `relief`; "peck": out to the plane, rapidly back to
            `relief` before the last depth; "feed_out": out to the plane at feed
        relief: mm; dwell: s at the bottom; feed, feed_out: mm/min, NaN: the F word in force
        tap: "rigid" where the control couples feed and spindle, "floating" where a chuck makes up; "" for what does not tap
        pitch: mm per turn of a tap, negative for a left-hand one; NaN: by feed, speed and sense of the spindle
    """

    plane: float
    bottom: float
    out: float
    bottoms: tuple[float, ...]
    style: DrillStyle = "drill"
    relief: float = 0.0
    dwell: float = 0.0
    feed: float = float("nan")
    feed_out: float = float("nan")
    tap: Literal["", "rigid", "floating"] = ""
    pitch: float = float("nan")


@dataclass(frozen=True)
@arrays(line="B", curves="C 3 4", splines="S")
class Canonical:
    """B blocks in the order in which the control runs them; words count blocks from 1.

    `line` (B + 1,) is the line that a block stands in; lines of further files count on from those before.
    `curves` (C, 3, 4): second to fifth coefficient in X, Y, Z, mm, the parameter going from 0 to 1;
    `splines` (C,), or none: number of the clamped cubic with equal knots of which the block states a control point instead,
    -1 for none.
    `files`: their names, and the lines that stand before each; empty for one file. `feed_parts`: what an inch
    per minute is in units of F. `feed_kept`: F counts in the units before its block, and keeps them.
    """

    words: Words
    line: Ints
    laws: tuple[WordMeaning, ...] = ()
    drills: tuple[Drill, ...] = ()
    files: Files = ()
    feed_parts: float = 1.0
    feed_kept: bool = False
    curves: Floats = field(default_factory=lambda: np.zeros((0, 3, 4)))
    splines: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    def without(self, letters: tuple[str, ...]) -> Canonical:
        """The same without the words of some letters."""
        return replace(self, words=self.words.take(~among(self.words.letter, [ord(letter) for letter in letters])))


def placed(found: list[Diagnostic], files: Files) -> list[Diagnostic]:
    """Diagnostics whose lines count through all files, with the file and line of each."""
    result = []
    for d in found:
        k = int(np.searchsorted([n for _, n in files], d.lines[0])) - 1 if files and d.lines else 0
        result.append(replace(d, file=files[k][0], lines=tuple(n - files[k][1] for n in d.lines)) if k > 0 else d)
    return result


def in_files(line: Ints, files: Files) -> Ints:
    """Lines that count through all files as lines of their own files."""
    if not files:
        return line
    before = np.array([n for _, n in files], dtype=np.int64)
    result: Ints = line - before[np.maximum(np.searchsorted(before, line) - 1, 0)]
    return result


def added(words: Words, new: list[tuple[int, str, float]], drop: Bools | None = None) -> Words:
    """Words with others (block, letter, value) put behind those of their block, and some taken out."""
    kept = words if drop is None else words.take(~drop)
    if not new:
        return kept
    new = sorted(new, key=lambda n: n[0])
    line = np.array([n[0] for n in new], dtype=np.int64)
    behind = np.searchsorted(kept.line, line, side="right")
    letter, value = np.array([ord(n[1]) for n in new], dtype=np.uint8), np.array([n[2] for n in new], dtype=np.float64)
    return Words(_between(kept.letter, behind, letter), _between(kept.value, behind, value),
                 _between(kept.line, behind, line), words.lines)


def _between(values: Array, behind: Ints, new: Array) -> Array:
    """`numpy.insert` of values behind so many others (ascending), whole stretches at a time, which a mask of all takes five
    times as long for."""
    made, at = np.empty(len(values) + len(new), dtype=values.dtype), 0
    for k, stop in enumerate(behind.tolist()):
        made[at + k:stop + k], made[stop + k], at = values[at:stop], new[k], stop
    made[at + len(new):] = values[at:]
    return made


def offset_number(code: str) -> float:
    """The number of a work offset as a set-up names it: G54 is 54, G54.1 P3 is 1003; NaN where it names none."""
    head, _, extended = code.upper().replace("G154", "G54.1").partition("P")
    try:
        return EXTENDED_OFFSETS + float(extended) if extended else float(head.strip().removeprefix("G"))
    except ValueError:
        return float("nan")
