"""Modal state line by line: G groups, offsets, tool, spindle, coolant, each carried on to the lines that follow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.readback.words import Words
from toolpaths.arrays import Array, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error

MOTION = (0, 1, 2, 3, 73, 74, 80, 81, 82, 83, 84, 85, 86, 89)
CYCLES = (73, 74, 81, 82, 83, 84, 85, 86, 89)
GROUPS: dict[str, tuple[float, ...]] = {
    "motion": MOTION, "plane": (17, 18, 19), "distance": (90,), "feed_mode": (93, 94), "units": (20, 21),
    "offset": (54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3), "length": (43, 49), "level": (98, 99),
    "compensation": (40, 41, 42), "path": (61, 61.1, 64), "once": (4, 53), "arc_distance": (91.1,),
}
M_CODES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 30)
_GROUP_OF = {code: name for name, codes in GROUPS.items() for code in codes}


@dataclass(frozen=True)
class Modal:
    """State at every line (index 0 is before line 1; L + 1 entries)."""

    motion: Array
    plane: Array
    inverse: Array
    inch: Array
    level: Array
    length_register: Ints
    """active length offset register, -1 for none"""
    tool: Ints
    spindle: Array
    """-1, 0, 1"""
    rpm: Floats
    flood: Array
    mist: Array
    machine: Array
    """G53 in this line"""
    dwell: Array
    """G4 in this line"""
    compensation: Array
    """G40, 41, 42"""
    offset: Floats
    """work offset code, 54 and on"""
    blend: Floats
    """mm that the control's smoothing may take: 0 exact path, inf without a limit, NaN where none was stated"""


def fill(lines: Array, values: Array, count: int, initial: float) -> Floats:
    """(count + 1,) the value stated last at or before each line."""
    result = np.full(count + 1, np.nan)
    result[0] = initial
    result[lines] = values
    index = np.where(np.isfinite(result), np.arange(count + 1), 0)
    filled: Floats = result[np.maximum.accumulate(index)]
    return filled


def fill_values(lines: Ints, values: Floats, count: int) -> Floats:
    """(count + 1,) the value stated last, NaN before the first."""
    index = np.zeros(count + 1, dtype=np.int64)
    index[lines] = np.arange(1, len(lines) + 1)
    filled: Floats = np.concatenate([[np.nan], values])[np.maximum.accumulate(index)]
    return filled


def _g(words: Words, group: str) -> tuple[Ints, Floats]:
    pick = (words.letter == ord("G")) & np.isin(words.value, GROUPS[group])
    return words.line[pick], words.value[pick]


def _m(words: Words, codes: tuple[int, ...]) -> tuple[Ints, Floats]:
    pick = (words.letter == ord("M")) & np.isin(words.value, codes)
    return words.line[pick], words.value[pick]


def _number_of(words: Words, letter: str, count: int) -> Floats:
    pick = words.letter == ord(letter)
    return fill(words.line[pick], words.value[pick], count, np.nan)


def modal_state(words: Words) -> Modal:
    """The state that the program itself sets up, line by line."""
    n = words.lines

    def group(name: str, initial: float) -> Floats:
        return fill(*_g(words, name), n, initial)

    once_line, once = _g(words, "once")
    machine, dwell = np.zeros(n + 1, dtype=bool), np.zeros(n + 1, dtype=bool)
    machine[once_line[once == 53]] = True
    dwell[once_line[once == 4]] = True
    h = _number_of(words, "H", n)
    tool = _number_of(words, "T", n)
    length_line, length = _g(words, "length")
    register = fill(length_line, np.where(length == 43, h[length_line], -1.0), n, -1.0)
    change_line, _ = _m(words, (6,))
    loaded = fill(change_line, np.nan_to_num(tool[change_line], nan=-1.0), n, -1.0)
    turn_line, turn = _m(words, (3, 4, 5, 6))
    order = np.lexsort((turn != 6, turn_line))
    spindle = fill(turn_line[order], np.where(turn == 3, 1, np.where(turn == 4, -1, 0))[order], n, 0.0)
    coolant_line, coolant = _m(words, (7, 8, 9))
    return Modal(group("motion", 1).astype(np.int16), group("plane", 17).astype(np.int8),
                 group("feed_mode", 94) == 93, group("units", 21) == 20, group("level", 98).astype(np.int8),
                 register.astype(np.int64), loaded.astype(np.int64), spindle.astype(np.int8), _number_of(words, "S", n),
                 fill(coolant_line, coolant == 8, n, 0.0) > 0.5, fill(coolant_line, coolant == 7, n, 0.0) > 0.5,
                 machine, dwell, group("compensation", 40).astype(np.int8), group("offset", np.nan), _blend(words))


def _blend(words: Words) -> Floats:
    """Smoothing in force: G61 none, G64 P blends within P and merges short lines within Q (P where it is not stated)."""
    line, code = _g(words, "path")
    value = np.where(code == 64, np.inf, 0.0)
    for k, n in enumerate(line.tolist()):
        here = words.line == n
        p, q = (words.value[here & (words.letter == ord(letter))] for letter in "PQ")
        if code[k] == 64 and len(p):
            value[k] = p[0] + (q[0] if len(q) else p[0])
    return fill_values(line, value, words.lines)


def dwells(words: Words) -> Floats:
    """(L + 1,) seconds that a line dwells by G4 P, 0 elsewhere, NaN where P is missing."""
    lines = words.line[(words.letter == ord("G")) & (words.value == 4)]
    p = words.letter == ord("P")
    stated = np.full(words.lines + 1, np.nan)
    stated[words.line[p]] = words.value[p]
    result = np.zeros(words.lines + 1)
    result[lines] = stated[lines]
    return result


def drop_passive(words: Words, passive: tuple[str, ...]) -> Words:
    """Words without the blocks that hold a code the controller file calls passive, and without program numbers (O)."""
    drop = words.letter == ord("O")
    for code in passive:
        lines = words.line[(words.letter == ord(code[0])) & (words.value == float(code[1:]))]
        drop |= np.isin(words.line, lines)
    return Words(words.letter[~drop], words.value[~drop], words.line[~drop], words.lines)


def check_end(words: Words, file: str) -> list[Diagnostic]:
    """A program ends with M2 or M30, and holds nothing behind it."""
    ends = words.line[(words.letter == ord("M")) & np.isin(words.value, (2, 30))]
    if not len(ends):
        return [error("gcode.no_end", "the program has no end (M2 or M30)", file=file, lines=[words.lines],
                      hint="it may have been cut off")]
    after = np.unique(words.line[words.line > ends.min()])
    if not len(after):
        return []
    return [error("gcode.after_end", f"blocks behind the end of the program in line {int(ends.min())}: the control never "
                  "reaches them", file=file, lines=after[:6].tolist(), count=len(after), hint="take the early end out")]


def check_codes(words: Words, letters: tuple[str, ...], file: str) -> list[Diagnostic]:
    """Codes and words that this reader cannot execute, as errors: nothing is skipped in silence."""
    diagnostics = []
    g = words.letter == ord("G")
    bad = g & ~np.isin(words.value, list(_GROUP_OF))
    m = (words.letter == ord("M")) & ~np.isin(words.value, M_CODES)
    known = np.isin(words.letter, [ord(c) for c in (*letters, *"GMFSTHDNIJKRPQL")])
    for pick, what in ((bad, "G"), (m, "M")):
        for value in np.unique(words.value[pick]):
            lines = words.line[pick & (words.value == value)]
            diagnostics.append(error("gcode.unknown_code", f"{what}{value:g} is not executed by this reader", file=file,
                                     lines=lines[:6].tolist(), count=len(lines),
                                     hint="take it out, or write it by the post"))
    for code in np.unique(words.letter[~known]):
        lines = words.line[words.letter == code]
        diagnostics.append(error("gcode.unknown_word", f"word {chr(code)}: the machine has no such axis", file=file,
                                 lines=lines[:6].tolist(), count=len(lines), hint=f"its axes are {', '.join(letters)}"))
    return diagnostics + _repeated(words, file)


def _repeated(words: Words, file: str) -> list[Diagnostic]:
    """A word stated twice in a block, or two codes of one group."""
    group = np.zeros(len(words.letter), dtype=np.int64)
    names = list(GROUPS)
    for k in np.flatnonzero(words.letter == ord("G")):
        group[k] = names.index(_GROUP_OF.get(float(words.value[k]), "once")) + 1
    single = words.letter != ord("M")
    key = (words.line[single] * 128 + words.letter[single]) * 32 + group[single]
    order = np.argsort(key, kind="stable")
    twice = np.flatnonzero(np.diff(key[order]) == 0)
    if not len(twice):
        return []
    lines = np.unique(words.line[single][order][twice])
    return [error("gcode.repeated", "a word, or a code of one group, stands twice in a block", file=file,
                  lines=lines[:6].tolist(), count=len(lines), hint="one of each in a block")]
