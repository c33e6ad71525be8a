"""Words through the modal state to motion: every block's end in machine coordinates, cycles spelt out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.readback.modal import CYCLES, Modal, check_codes, dwells, fill_values, modal_state
from postproc.readback.words import Words
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error

Leg = tuple[int, Floats]
"""code and end of one leg of a canned cycle"""
Legs = dict[int, list[Leg]]
"""legs by line"""


@dataclass(frozen=True)
class Motion:
    """E executed blocks.

    Attributes:
        line (E,): line of the program; code (E,): 0 traverse, 1 feed, 2 arc; end (E, J): machine coordinates, mm, deg
        start (J,): where the first block begins
        plane, ccw, center: of arcs; center (E, 3) in machine coordinates of X, Y, Z
        feed (E,): F word in force; inverse (E,): per 1/F minutes
        tool, register (E,): tool in the spindle, active length register (-1 none)
        spindle (E,): -1, 0, 1; rpm (E,); flood, mist (E,)
        hole (E,): True inside a canned cycle
        missing_feed (E,): a cutting block without a feed in force
        dwell (E,): s that the tool rests at the end of the block
        compensation (E,): 40, 41, 42; offset (E,): work offset code; blend (E,): mm of the control's smoothing (Modal)
    """

    line: Ints
    code: Array
    end: Floats
    start: Floats
    plane: Array
    ccw: Bools
    center: Floats
    feed: Floats
    inverse: Bools
    tool: Ints
    register: Ints
    spindle: Array
    rpm: Floats
    flood: Bools
    mist: Bools
    hole: Bools
    missing_feed: Bools
    dwell: Floats
    compensation: Array
    offset: Floats
    blend: Floats

    def __len__(self) -> int:
        return len(self.line)


@dataclass(frozen=True)
class Offsets:
    """What the control holds: work offset (J,) in machine coordinates, column of Z, tool lengths by register."""

    work: Floats
    xyz: Ints
    lengths: dict[int, float]
    home: Floats
    on_z: bool
    peck_relief: float


def execute(words: Words, letters: tuple[str, ...], offsets: Offsets, file: str = "") -> tuple[Motion, list[Diagnostic]]:
    """The motion of a program that starts with the machine at home."""
    diagnostics = check_codes(words, letters, file)
    modal = modal_state(words)
    columns = _columns(words, letters)
    stated = np.isfinite(columns)
    length = np.array([offsets.lengths.get(int(r), 0.0) if r >= 0 else 0.0 for r in np.unique(modal.length_register)])
    length = length[np.searchsorted(np.unique(modal.length_register), modal.length_register)]
    scale = np.where(modal.inch, 25.4, 1.0)
    end = _positions(columns, stated, modal, length, scale, offsets)
    cycle = np.isin(modal.motion, CYCLES)
    moving = stated.any(axis=1) & ~modal.dwell
    z = int(offsets.xyz[2])
    drilling = np.flatnonzero(cycle & moving)
    legs: Legs = {}
    rests = dwells(words)
    if len(drilling):
        legs = _cycles(words, modal, end, stated, drilling, length, scale, offsets, z, rests, diagnostics, file)
    arc = np.isin(modal.motion, (2, 3)) & ~modal.dwell
    ijk = _columns(words, ("I", "J", "K"))
    moving |= arc & np.isfinite(ijk).any(axis=1)
    filled = _carried(end, offsets.home)
    diagnostics += _without_number(words, modal, rests, file) + _cancelled(words, modal, stated, file)
    return _motion(words, modal, filled, moving, legs, ijk, scale, offsets, rests), diagnostics


def _cancelled(words: Words, modal: Modal, stated: Bools, file: str) -> list[Diagnostic]:
    """Axis words while G80 holds: there is no motion they could belong to."""
    lines = np.flatnonzero((modal.motion == 80) & stated.any(axis=1) & ~modal.dwell)
    lines = lines[~np.isin(lines, words.line[(words.letter == ord("G")) & np.isin(words.value, (0, 1, 2, 3))])]
    if not len(lines):
        return []
    return [error("gcode.no_motion", "axis words under G80, without a code of motion", file=file, lines=lines[:6].tolist(),
                  count=len(lines), hint="state G0 or G1")]


def _without_number(words: Words, modal: Modal, rests: Floats, file: str) -> list[Diagnostic]:
    """G4 without P, M6 without a T before it."""
    result = []
    lines = np.flatnonzero(np.isnan(rests))
    if len(lines):
        result.append(error("gcode.dwell", "G4 lacks P", file=file, lines=lines[:6].tolist(), count=len(lines),
                            hint="state the seconds: G4 P0.5"))
    change = words.line[(words.letter == ord("M")) & (words.value == 6)]
    lines = change[modal.tool[change] < 0]
    if len(lines):
        result.append(error("gcode.tool", "M6 without a tool number", file=file, lines=lines[:6].tolist(), count=len(lines)))
    return result


def _columns(words: Words, letters: tuple[str, ...]) -> Floats:
    """(L + 1, len(letters)) numbers by line, NaN where a line does not state the word."""
    result = np.full((words.lines + 1, len(letters)), np.nan)
    for j, letter in enumerate(letters):
        pick = words.letter == ord(letter)
        result[words.line[pick], j] = words.value[pick]
    return result


def _positions(columns: Floats, stated: Bools, modal: Modal, length: Floats, scale: Floats, offsets: Offsets) -> Floats:
    """Stated ends in machine coordinates, NaN where an axis is not stated; cycles state X, Y and rotaries only."""
    end = columns.copy()
    for j in offsets.xyz[offsets.xyz >= 0]:
        end[:, j] *= scale
    program = ~modal.machine
    end[program] += offsets.work
    z = int(offsets.xyz[2])
    if z >= 0 and offsets.on_z:
        end[program, z] += length[program]
        cycle = np.isin(modal.motion, CYCLES)
        end[cycle, z] = np.nan
    elif z >= 0:
        end[np.isin(modal.motion, CYCLES), z] = np.nan
    return end


def _carried(end: Floats, home: Floats) -> Floats:
    """Every axis where it was last told to go."""
    result = end.copy()
    result[0] = home
    for j in range(end.shape[1]):
        index = np.where(np.isfinite(result[:, j]), np.arange(len(result)), 0)
        result[:, j] = result[np.maximum.accumulate(index), j]
    return result


def _cycles(words: Words, modal: Modal, end: Floats, stated: Bools, drilling: Ints, length: Floats, scale: Floats,
            offsets: Offsets, z: int, rests: Floats, diagnostics: list[Diagnostic], file: str) -> Legs:
    """Legs (code, end) of each drilling line; sets Z of `end` to where the cycle leaves the tool.

    As LinuxCNC does: up to R first where the tool is lower (aslant to R above the hole at all but the first hole of a
    sequence), over to the hole, down to R, drill, out to R (G99) or to the level before the first cycle of the sequence,
    if that is higher (G98).
    """
    extra = _columns(words, ("Z", "R", "Q", "P"))
    legs: Legs = {}
    sticky = np.full(4, np.nan)
    initial, code = np.nan, 0
    known = np.flatnonzero(np.isfinite(end[:, z]))
    here = _carried(end, offsets.home)
    previous = -1
    motion_lines = np.flatnonzero(stated.any(axis=1))
    for line in drilling.tolist():
        before = motion_lines[np.searchsorted(motion_lines, line) - 1] if line > motion_lines[0] else -1
        level = _level(end, known, line, previous, z, offsets)
        first = bool(previous < 0 or before != previous or modal.motion[previous + 1:line].min(initial=99) < 73)
        if first:
            initial = level
            sticky[:] = np.nan
        if modal.motion[line] != code:
            sticky[:] = np.nan
        code = int(modal.motion[line])
        sticky = np.where(np.isfinite(extra[line]), extra[line], sticky)
        if not np.isfinite(sticky[:2]).all() or (code in (73, 83) and not sticky[2] > 0.0):
            diagnostics.append(error("gcode.cycle", f"G{code} lacks {'Q' if np.isfinite(sticky[:2]).all() else 'Z or R'}",
                                     file=file, lines=[line], hint="state Z and R, and Q for pecking, with the code"))
            end[line, z] = level
            previous = line
            continue
        shift = offsets.work[z] + (length[line] if offsets.on_z else 0.0)
        bottom, plane, step = sticky[0] * scale[line] + shift, sticky[1] * scale[line] + shift, sticky[2] * scale[line]
        out = plane if modal.level[line] == 99 else max(plane, initial)
        start = here[line - 1].copy()
        start[z] = level
        rests[line] = sticky[3] if code in (82, 89) else 0.0
        legs[line] = _legs(code, start, here[line], z, level, bottom, plane, out, step, offsets.peck_relief, first)
        end[line, z] = out
        previous = line
    return legs


def _level(end: Floats, known: Ints, line: int, previous: int, z: int, offsets: Offsets) -> float:
    at = int(np.searchsorted(known, line)) - 1
    last = int(known[at]) if at >= 0 else 0
    last = max(last, previous)
    return float(end[last, z]) if last > 0 else float(offsets.home[z])


def _legs(code: int, start: Floats, target: Floats, z: int, level: float, bottom: float, plane: float, out: float,
          step: float, relief: float, first: bool) -> list[Leg]:
    def at(base: Floats, height: float) -> Floats:
        point = base.copy()
        point[z] = height
        return point
    legs: list[Leg] = []
    if level < plane and first:
        legs.append((0, at(start, plane)))
    over = at(target, max(level, plane))
    if (over != (legs[-1][1] if legs else start)).any():
        legs.append((0, over))
    if level > plane:
        legs.append((0, at(target, plane)))
    if code in (73, 83):
        depth = plane - step
        while depth > bottom + 1e-9:
            legs.append((1, at(target, depth)))
            if code == 83:
                legs.append((0, at(target, plane)))
            legs.append((0, at(target, min(depth + relief, plane))))
            depth -= step
    legs.append((1, at(target, bottom)))
    if code in (74, 84, 85, 89):
        legs.append((1, at(target, plane)))
        if out > plane:
            legs.append((0, at(target, out)))
    else:
        legs.append((0, at(target, out)))
    return legs


def _motion(words: Words, modal: Modal, filled: Floats, moving: Bools, legs: Legs,
            ijk: Floats, scale: Floats, offsets: Offsets, rests: Floats) -> Motion:
    """Blocks in order; a drilling line becomes its legs."""
    lines = np.flatnonzero(moving)
    counts = np.array([len(legs[n]) if n in legs else 1 for n in lines.tolist()]) if legs else \
        np.ones(len(lines), dtype=np.int64)
    line = np.repeat(lines, counts)
    end = filled[line].copy()
    motion = modal.motion[line]
    code = np.where(motion == 0, 0, np.where(np.isin(motion, (2, 3)), 2, 1)).astype(np.int8)
    hole = np.isin(line, list(legs)) if legs else np.zeros(len(line), dtype=bool)
    if legs:
        flat = [leg for n in lines.tolist() if n in legs for leg in legs[n]]
        where = np.flatnonzero(hole)
        code[where] = [c for c, _ in flat]
        end[where] = [p for _, p in flat]
    before = np.concatenate([offsets.home[None, :], end[:-1]])
    center = np.zeros((len(line), 3))
    where = np.flatnonzero(code == 2)
    if len(where):
        center[where] = np.nan_to_num(ijk[line[where]]) * scale[line[where]][:, None] + before[where][:, offsets.xyz]
    feed, missing = _feeds(words, modal, line, code)
    dwell = _dwell(line, code, hole, rests)
    return Motion(line, code, end, offsets.home, modal.plane[line], motion == 3, center, feed, modal.inverse[line],
                  modal.tool[line], modal.length_register[line], modal.spindle[line], modal.rpm[line], modal.flood[line],
                  modal.mist[line], hole, missing, dwell, modal.compensation[line], modal.offset[line],
                  np.where(np.isfinite(modal.blend), modal.blend * np.where(modal.inch, 25.4, 1.0), modal.blend)[line])


def _dwell(line: Ints, code: Array, hole: Bools, rests: Floats) -> Floats:
    """(E,) s of rest at the end of each block: of a cycle at its bottom, of G4 where the block before it ends."""
    dwell = np.zeros(len(line))
    if not len(line):
        return dwell
    bottoms = np.flatnonzero(hole & (code == 1))
    bottoms = bottoms[np.unique(line[bottoms], return_index=True)[1]] if len(bottoms) else bottoms
    dwell[bottoms] = np.nan_to_num(rests[line[bottoms]])
    alone = np.setdiff1d(np.flatnonzero(rests > 0.0), line[hole])
    np.add.at(dwell, np.maximum(np.searchsorted(line, alone) - 1, 0), rests[alone])
    return dwell


def _feeds(words: Words, modal: Modal, line: Ints, code: Array) -> tuple[Floats, Bools]:
    """(F in force, cutting blocks without one): inverse time holds for its own line only, a change of mode clears F."""
    n = words.lines
    stated = _columns(words, ("F",))[:, 0]
    changes = np.flatnonzero(np.diff(modal.inverse.astype(np.int8))) + 1
    clear = np.full(n + 1, np.nan)
    clear[changes] = -1.0
    with_clear = np.where(np.isfinite(stated), stated, clear)
    lines = np.flatnonzero(np.isfinite(with_clear))
    force = fill_values(lines, with_clear[lines], n)
    value = np.where(modal.inverse[line], stated[line], force[line])
    missing = (code > 0) & ~(value > 0.0)
    return value, missing
