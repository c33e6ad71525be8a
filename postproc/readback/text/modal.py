"""Modal state block by block: groups, offsets, tool, spindle, coolant, each carried on to the blocks that follow."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from postproc.readback.text.canonical import COOLANT, LOADED, OFFSET, REGISTER, SMOOTH, STANDS
from postproc.readback.text.words import Words
from toolpaths.arrays import Array, Floats, Ints, among, distinct, repeated, shared
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.shapes import arrays

MOTION = (0, 1, 2, 3, 73, 74, 80, 81, 82, 83, 84, 85, 86, 89)
CYCLES = (73, 74, 81, 82, 83, 84, 85, 86, 89)
Groups = dict[str, tuple[float, ...]]
GROUPS: Groups = {
    "motion": MOTION, "plane": (17, 18, 19), "distance": (90, 91), "feed_mode": (93, 94, 95), "units": (20, 21),
    "offset": (54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3), "length": (43, 49), "level": (98, 99),
    "compensation": (40, 41, 42), "path": (61, 61.1, 64), "once": (4, 53), "arc_distance": (90.1, 91.1),
}
"""of NIST RS274/NGC and LinuxCNC; a dialect adds its own"""
MACROS = ("G65",)
"""calls of a macro, whose arguments may be any words but G"""
_ARGUMENTS = {"G": [ord(a) for a in "PQRLEIJK"], "M": [ord(a) for a in "PQRLE"], "L": [ord("P")]}
"""words that belong to a code which is no macro call: no axis, feed, speed, tool or register"""
_PART = 200_000
"""words that are looked at together"""
_RARE = 20
"""blocks to a statement, from which on a state is written stretch by stretch"""


@dataclass(frozen=True)
@arrays(motion="int16: B", plane="int8: B", inverse="bool: B", per_turn="bool: B", inch="bool: B", level="int8: B",
        length_register="B", tool="B", spindle="int8: B", rpm="B", coolant="int8: B", machine="bool: B",
        compensation="int8: B", offset="B", blend="B")
class Modal:
    """State at every block (index 0 is before block 1; B + 1 entries)."""

    motion: Array
    plane: Array
    inverse: Array
    per_turn: Array
    """feed per revolution"""
    inch: Array
    level: Array
    length_register: Ints
    """active length offset register, -1 for none"""
    tool: Ints
    spindle: Array
    """-1, 0, 1"""
    rpm: Floats
    coolant: Array
    """bits of what flows (`postproc.reference.coolant`)"""
    machine: Array
    """G53 in this block"""
    compensation: Array
    """G40, 41, 42"""
    offset: Floats
    """work offset, by `offset_number`"""
    blend: Floats
    """mm that the control's smoothing may take: 0 exact path, inf without a limit, NaN where none was stated"""


def fill(lines: Array, values: Array, count: int, initial: float) -> Floats:
    """(count + 1,) the value stated last at or before each block."""
    if not len(lines):
        return repeated(float(initial), count + 1)
    if len(lines) < count // _RARE and (lines[1:] >= lines[:-1]).all():
        known = np.append(lines[1:] != lines[:-1], True) & np.isfinite(values)
        begins = np.concatenate([[0], lines[known], [count + 1]])
        return np.repeat(np.append(float(initial), values[known]), np.diff(begins))
    result = np.full(count + 1, np.nan)
    result[0] = initial
    result[lines] = values
    index = np.where(np.isfinite(result), np.arange(count + 1), 0)
    filled: Floats = result[np.maximum.accumulate(index)]
    return filled


def fill_values(lines: Ints, values: Floats, count: int) -> Floats:
    """(count + 1,) the value stated last, NaN before the first."""
    if not len(lines):
        return repeated(np.nan, count + 1)
    index = np.zeros(count + 1, dtype=np.int64)
    index[lines] = np.arange(1, len(lines) + 1)
    filled: Floats = np.concatenate([[np.nan], values])[np.maximum.accumulate(index)]
    return filled


def codes(words: Words, letter: str, numbers: tuple[float, ...]) -> tuple[Ints, Floats]:
    """(blocks, numbers) of those G or M codes."""
    line, value = words.pick(letter)
    pick = among(value, numbers)
    return line[pick], value[pick]


def number_of(words: Words, letter: str) -> Floats:
    """(B + 1,) the number last stated with a letter, NaN before the first."""
    return fill(*words.pick(letter), words.lines, np.nan)


def columns(words: Words, letters: str | tuple[str, ...]) -> Floats:
    """(B + 1, len(letters)) numbers by block, NaN where a block does not state the word."""
    if not among(words.letter, [ord(letter) for letter in letters]).any():
        return repeated(np.full(len(letters), np.nan), words.lines + 1)
    result = np.full((words.lines + 1, len(letters)), np.nan)
    for j, letter in enumerate(letters):
        line, value = words.pick(letter)
        result[line, j] = value
    return result


def modal_state(words: Words) -> Modal:
    """The state that the program itself sets up, block by block, from canonical words."""
    n = words.lines

    def group(name: str, initial: float) -> Floats:
        return fill(*codes(words, "G", GROUPS[name]), n, initial)

    machine = np.zeros(n + 1, dtype=bool)
    machine[codes(words, "G", (53,))[0]] = True
    feed_mode = group("feed_mode", 94).astype(np.int8)
    change, tool = words.pick(LOADED)
    turn_line, turn = codes(words, "M", (3, 4, 5))
    stops, _ = words.pick(STANDS)
    turn_line = np.concatenate([stops, change, turn_line])
    turn = np.concatenate([np.full(len(stops) + len(change), 5.0), turn])
    order = np.argsort(turn_line, kind="stable")
    spindle = fill(turn_line[order], np.where(turn == 3, 1, np.where(turn == 4, -1, 0))[order], n, 0.0)
    state = (group("motion", 1).astype(np.int16), group("plane", 17).astype(np.int8), feed_mode == 93, feed_mode == 95,
             group("units", 21) == 20, group("level", 98).astype(np.int8),
             fill(*words.pick(REGISTER), n, -1.0).astype(np.int64), fill(change, tool, n, -1.0).astype(np.int64),
             spindle.astype(np.int8), number_of(words, "S"), fill(*words.pick(COOLANT), n, 0.0).astype(np.int8),
             machine, group("compensation", 40).astype(np.int8),
             fill_values(*words.pick(OFFSET), n), fill_values(*words.pick(SMOOTH), n))
    return Modal(*map(shared, state))


def drop_passive(words: Words, passive: tuple[str, ...]) -> Words:
    """Words without codes that the controller file calls passive, and what stands behind them in their
    blocks: all words of a macro call up to the next G code, of others up to the next code those that are no
        axis, feed, speed, tool, register."""
    drop = np.zeros(len(words.letter), dtype=bool)
    for code in passive:
        if not code[1:2].isdigit():
            continue
        value = float(code[1:])
        for k in np.flatnonzero((words.letter == ord(code[0])) & (words.value == value)).tolist():
            stop = int(np.searchsorted(words.line, words.line[k], side="right"))
            ends = among(words.letter[k + 1:stop], [ord("G")] if code in MACROS else [ord("G"), ord("M")])
            stop = k + 1 + int(np.flatnonzero(ends)[0]) if ends.any() else stop
            drop[k] = True
            drop[k + 1:stop] |= True if code in MACROS else among(words.letter[k + 1:stop],
                                                                    _ARGUMENTS[code[0]])
    return words.take(~drop)


def check_end(words: Words, file: str, called: tuple[tuple[int, int], ...] = ()) -> list[Diagnostic]:
    """A program ends with M2 or M30, and holds nothing behind it but the subprograms at the lines of `called`."""
    outside = np.ones(len(words.line), dtype=bool)
    for first, last in called:
        outside &= (words.line < first) | (words.line > last)
    ends = words.line[outside & (words.letter == ord("M")) & among(words.value, (2, 30))]
    if not len(ends):
        return [error("gcode.no_end", "the program has no end (M2 or M30)", file=file, lines=[words.lines],
                      hint="write M30 in its last line where it is whole; it may have been cut off")]
    after = distinct(words.line[outside & (words.line > ends.min())])
    if not len(after):
        return []
    return [error("gcode.after_end", f"blocks behind the end of the program in line {int(ends.min())}: the control never "
                  "reaches them", file=file, lines=after[:6].tolist(), count=len(after), hint="take the early end out")]


def check_codes(words: Words, groups: Groups, m_codes: tuple[float, ...], letters: str, axes: tuple[str, ...],
                file: str) -> list[Diagnostic]:
    """Codes and words that this reader cannot execute, as errors: nothing is skipped in silence."""
    diagnostics = []
    known_g = [code for numbers in groups.values() for code in numbers]
    bad, m = words.letter == ord("G"), words.letter == ord("M")
    bad[bad] = ~among(words.value[bad], known_g)
    m[m] = ~among(words.value[m], m_codes)
    known = among(words.letter, [ord(c) for c in (*axes, *letters)])
    for pick, what in ((bad, "G"), (m, "M")):
        for value in distinct(words.value[pick]):
            lines = words.line[pick & (words.value == value)]
            diagnostics.append(error("gcode.unknown_code", f"{what}{value:g} is not executed by this reader", file=file,
                                     lines=lines[:6].tolist(), count=len(lines),
                                     hint="take it out; a code of the shop that moves nothing is named in "
                                     "program.passive of the controller file, or in [hooks] passive (--hooks FILE), "
                                     "one of its smoothing (G05 P10000 and G05 P0, G61.1) with mm in [smoothing_words]"))
    for code in distinct(words.letter[~known]):
        lines = words.line[words.letter == code]
        diagnostics.append(error("gcode.unknown_word", f"word {chr(code)}: the machine has no such axis", file=file,
                                 lines=lines[:6].tolist(), count=len(lines), hint=f"its axes are {', '.join(axes)}"))
    return diagnostics + _repeated(words, groups, file)


def _repeated(words: Words, groups: Groups, file: str) -> list[Diagnostic]:
    """A word stated twice in a block, or two codes of one group."""
    group = np.zeros(len(words.letter), dtype=np.int8)
    is_g = words.letter == ord("G")
    for k, numbers in enumerate(groups.values(), 1):
        group[is_g & among(words.value, numbers)] = k
    twice = [_twice(words.line[part], words.letter[part], group[part]) for part in by_lines(words)]
    lines = distinct(np.concatenate([words.line[:0], *twice]))
    if not len(lines):
        return []
    return [error("gcode.repeated", "a word, or a code of one group, stands twice in a block", file=file,
                  lines=lines[:6].tolist(), count=len(lines), hint="one of each in a block")]


def _twice(line: Ints, letter: Array, group: Array) -> Ints:
    """Lines in which a word but M, or a code of a group, stands twice, as often as it does so again."""
    single = letter != ord("M")
    key = np.sort((line[single] * 256 + letter[single]) * 64 + group[single])
    return np.asarray(key[1:][key[1:] == key[:-1]] // (256 * 64))


def by_lines(words: Words) -> Iterator[slice]:
    """The words some whole lines at a time."""
    at, count = 0, len(words.line)
    while at < count:
        last = words.line[min(at + _PART, count) - 1]
        stop = int(np.searchsorted(words.line, last, side="right"))
        yield slice(at, stop)
        at = stop
