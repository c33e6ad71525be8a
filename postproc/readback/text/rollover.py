"""Words of modulo axes executed as the control turns them: positions that count every turn in the place of the words.

Fanuc B-63534EN 20.2 (ROA, RAB, 1260); LinuxCNC, INI file, WRAPPED_ROTARY; Siemens Programming Manual
Fundamentals, DC, ACP, ACN; Heidenhain, M126 and M127. Before the first word of an axis the machine stands at home.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.control.rollover import LEAST, TURN, Rollover
from postproc.readback.text.canonical import INCREMENTAL
from postproc.readback.text.modal import codes, fill
from postproc.readback.text.words import Words
from toolpaths.arrays import Array, Bools, Floats, Ints, among
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.shapes import arrays

DIRECTION = ">"
"""the path that a word states: 8 times the number of its letter, and one of the following"""
SHORTEST, POSITIVE, NEGATIVE, SIGN, DIRECT, UNKNOWN = range(6)
CODES = {126.0: SHORTEST, 127.0: DIRECT}
"""M codes of Klartext: the shorter path, and from word to word inside the turn"""


@dataclass(frozen=True)
@arrays(block="N", value="N", relative="N")
class _Axis:
    """Words of one axis in order: block, value, relative (N,)."""

    block: Ints
    value: Floats
    relative: Bools


def unrolled(words: Words, line: Ints, axes: tuple[str, ...], rolls: dict[int, Rollover], home: Floats | None,
             by_codes: bool, file: str) -> tuple[Words, list[Diagnostic]]:
    """Words with the positions of modulo axes, and faults; `by_codes`: M126 and M127 say the path."""
    found: list[Diagnostic] = []
    keep = words.letter != ord(DIRECTION)
    if by_codes:
        keep &= ~((words.letter == ord("M")) & np.isin(words.value, list(CODES)))
    value = words.value
    found += _not_modulo(words, line, axes, rolls, by_codes, file)
    for j, roll in rolls.items():
        here = np.flatnonzero(np.isin(words.letter, [ord(axes[j]), ord(axes[j]) + INCREMENTAL]))
        if not len(here):
            continue
        axis = _Axis(words.line[here], words.value[here], words.letter[here] != ord(axes[j]))
        rule = _rules(words, axis, axes[j], roll, by_codes)
        position, half = _positions(axis, rule, roll.low, float(home[j]) if home is not None else 0.0)
        found += _faults(axis, rule, half, axes[j], roll, line, file)
        value = value.copy() if value is words.value else value
        value[here] = np.where(axis.relative, axis.value, position)
    return replace(words, value=value).take(keep), found


def _rules(words: Words, axis: _Axis, letter: str, roll: Rollover, by_codes: bool) -> Array:
    """(N,) the path of each word."""
    if roll.rule == "sign":
        return np.full(len(axis.block), SIGN)
    if by_codes:
        blocks, number = codes(words, "M", tuple(CODES))
        travels = np.array([CODES[float(n)] for n in number], dtype=np.float64)
        return fill(blocks, travels, words.lines, UNKNOWN)[axis.block].astype(np.int64)
    if not roll.stated:
        return np.full(len(axis.block), SHORTEST)
    blocks, stated = words.pick(DIRECTION)
    own = stated.astype(np.int64) // 8 == ord(letter)
    result = np.full(words.lines + 1, UNKNOWN)
    result[blocks[own]] = stated[own].astype(np.int64) % 8
    return np.asarray(result[axis.block])


def _positions(axis: _Axis, rule: Array, low: float, start: float) -> tuple[Floats, Bools]:
    """(degrees (N,) that count every turn behind each word, (N,) True where a turn is exactly half of one,
    or none though the sign of the word says which path)."""
    target = np.mod(np.where(rule == SIGN, np.abs(axis.value), axis.value) - low, TURN) + low
    walked = np.cumsum(np.where(axis.relative, axis.value, 0.0))
    last = np.maximum.accumulate(np.concatenate([[0], np.where(axis.relative, 0, np.arange(1, len(target) + 1))]))[:-1]
    at, behind = np.concatenate([[start], target])[last], np.concatenate([[0.0], walked])[last]
    before = np.mod(at + np.concatenate([[0.0], walked[:-1]]) - behind - low, TURN) + low
    ahead = _turn(target - before)
    back = -_turn(before - target)
    shorter = np.where(ahead <= TURN / 2.0, ahead, back)
    onward = np.where(np.signbit(axis.value), back, ahead)
    travels = np.stack([shorter, ahead, back, onward, target - before, shorter])
    step = np.where(axis.relative, axis.value, travels[rule, np.arange(len(target))])
    half = ~axis.relative & (rule == SHORTEST) & (np.abs(ahead - TURN / 2.0) < LEAST)
    half |= ~axis.relative & (rule == SIGN) & (step == 0.0)
    return start + np.cumsum(step), half


def _turn(step: Floats) -> Floats:
    """Degrees from 0 to less than a turn."""
    result = np.mod(step, TURN)
    return np.asarray(np.where((result > TURN - LEAST) | (result < LEAST), 0.0, result))


def _faults(axis: _Axis, rule: Array, half: Bools, letter: str, roll: Rollover, line: Ints,
            file: str) -> list[Diagnostic]:
    """Words that the control would refuse, or whose direction nothing says."""
    stated = ~axis.relative
    most = TURN + LEAST if roll.whole else TURN - LEAST
    wide = stated & (np.abs(axis.value) > most) if rule[0] == SIGN else stated & roll.stated & (
        (axis.value < roll.low) | (axis.value >= roll.low + TURN))
    half[0] = False  # where the axis stands before its first word is not known: it is stated above the part
    span = f"{roll.low:g} to {roll.low + TURN:g}" if roll.rule != "sign" else f"-{TURN:g} to {TURN:g}"
    cases = ((half & (rule == SHORTEST), f"{letter} turns by exactly 180 degrees, and nothing says which path",
              "a word between the two"),
             (half & (rule == SIGN), f"{letter} is stated where it stands: the control may turn it by a whole turn",
              "leave the word out where the axis stands"),
             (stated & (rule == UNKNOWN), f"{letter} is a modulo axis, and nothing says which path it turns",
              "DC(), ACP() or ACN()" if roll.stated else "M126 before it"),
             (wide, f"{letter} is a modulo axis, its words are {span} degrees", "write the word inside one turn"))
    return [error("gcode.rollover", what, file=file, lines=line[axis.block[bad]][:6].tolist(), count=int(bad.sum()),
                  hint=hint) for bad, what, hint in cases if bad.any()]


def _not_modulo(words: Words, line: Ints, axes: tuple[str, ...], rolls: dict[int, Rollover], by_codes: bool,
                file: str) -> list[Diagnostic]:
    """Words and codes of roll-over on a machine that has no such axis."""
    blocks, stated = words.pick(DIRECTION)
    known = [ord(axes[j]) for j in rolls]
    bad = blocks[~among(stated // 8, known)]
    if by_codes and not rolls:
        bad = np.concatenate([bad, codes(words, "M", (126,))[0]])
    if not len(bad):
        return []
    return [error("gcode.rollover", "the shorter path (M126, DC) or a direction (ACP, ACN) for an axis that counts its "
                  "turns", file=file, lines=line[np.sort(bad)][:6].tolist(), count=len(bad),
                  hint="modulo = true for the axis in the machine file, if it rolls over")]
