"""Canonical words through modal state and laws to motion: every block's end in machine coordinates, cycles spelt out."""

from __future__ import annotations

from functools import cached_property
from itertools import pairwise

import numpy as np

from postproc.readback.execution import frames
from postproc.readback.execution.cubics import refused_curves
from postproc.readback.execution.frames import AXES, ExecutionFrame, FrameTable
from postproc.readback.execution.offsets import Offsets
from postproc.readback.execution.rows import BlockSection, MotionRows
from postproc.readback.execution.sections import run_section
from postproc.readback.text.canonical import CALL, CURVE, LAW, REST, TURNS, Canonical, WordMeaning, in_files, placed
from postproc.readback.text.modal import Modal, columns, fill, fill_values, modal_state, number_of
from postproc.readback.text.words import Words
from postproc.reference.coolant import FLOOD, MIST
from toolpaths.arrays import Array, Bools, Floats, Ints, distinct, repeated, shared, taken
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.shapes import arrays
from toolpaths.units import MM_PER_INCH


@dataclass(frozen=True)
@arrays(line="E", code="int8: E", end="E J", start="J", plane="int8: E", ccw="E", center="E 3", feed="E", inverse="E",
        tool="E", register="E", spindle="int8: E", rpm="E", coolant="E", hole="E", missing_feed="E", dwell="E",
        compensation="int8: E", offset="E", blend="E", frame="E", block="E", radius="E", pitch="E", floating="E",
        unit="E", contour="E 4")
class Motion:
    """E executed blocks.

    Attributes:
        line (E,): line of the program; code (E,): 0 traverse, 1 feed, 2 arc; end (E, J): machine coordinates, mm, deg
        start (J,): where the first block begins
        plane, ccw, center: of arcs; center (E, 3) in the coordinates X, Y, Z of the block's frame
        feed (E,): F word in force; inverse (E,): per 1/F minutes
        tool, register (E,): tool in the spindle, active length register (-1 none)
        spindle (E,): -1, 0, 1; rpm (E,); coolant (E,): bits of what flows (`postproc.reference.coolant`)
        hole (E,): True inside a canned cycle
        missing_feed (E,): a cutting block without a feed in force
        dwell (E,): s that the tool rests at the end of the block
        compensation (E,): 40, 41, 42; offset (E,): work offset code; blend (E,): mm of the control's smoothing (Modal)
        frame (E,): index into frames: the law that the block runs under
        block (E,): running number of the block; radius (E,): register of the radius in force (D), NaN for none
        pitch (E,): mm per turn of a tapping cycle, negative for left-hand ones, NaN outside; floating (E,): not coupled
        unit (E,): mm that 1 of `feed` stands for where it counts a length: 25.4 for inches
        contour (E, 4): as in MotionRows
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
    coolant: Ints
    hole: Bools
    missing_feed: Bools
    dwell: Floats
    compensation: Array
    offset: Floats
    blend: Floats
    frame: Ints
    block: Ints
    radius: Floats
    pitch: Floats
    floating: Bools
    unit: Floats
    contour: Floats
    frames: tuple[ExecutionFrame, ...] = (AXES,)

    def __len__(self) -> int:
        return len(self.line)

    @cached_property
    def table(self) -> FrameTable:
        """The frames side by side."""
        return FrameTable.of(self.frames)

    @property
    def flood(self) -> Bools:
        """(E,) flood coolant flows."""
        return self.coolant & FLOOD > 0

    @property
    def mist(self) -> Bools:
        """(E,) mist flows."""
        return self.coolant & MIST > 0


def run(code: Canonical, letters: tuple[str, ...], offsets: Offsets,
        file: str = "") -> tuple[Motion, list[Diagnostic]]:
    """The motion of a program that starts with the machine at home."""
    words = code.words
    modal = modal_state(words)
    section = _blocks(words, modal, letters, offsets)
    rests = columns(words, REST)[:, 0]
    found: list[Diagnostic] = _cancelled(words, modal, section, code.line, file)
    linear = np.isin(list(letters), list("XYZ"))
    found += refused_curves(section, modal.inverse, modal.compensation != 40, linear, code.line, file)
    parts, used, position = [], [AXES], offsets.home
    begun = set(words.pick(LAW)[0].tolist())
    home = _out_of_planes(words, modal, code.laws, section) if offsets.home_in_planes else np.zeros(0, dtype=np.int64)
    for first, last, law, register in _stretches(words, modal, code.laws, bool(offsets.others), home):
        frame = AXES
        if law is not None:
            where, control = (file, int(code.line[first])), offsets.control_at(float(modal.offset[first]))
            frame = frames.frame_of(law, control, offsets.length(register), position, where,
                                    found if first in begun else None)
            used.append(frame)
        number = len(used) - 1 if law is not None else 0
        part = run_section(section.cut(first, last), frame, number, position, code, offsets, file, found)
        position = part.end[-1] if len(part.end) else position
        parts.append(part)
    rows = MotionRows.joined(parts, len(letters))
    return _motion(words, modal, rows, code, tuple(used), offsets, rests, section.call), placed(found, code.files)


def _stretches(words: Words, modal: Modal, laws: tuple[WordMeaning, ...],
               places: bool, home: Ints) -> list[tuple[int, int, WordMeaning | None, int]]:
    """(first, one past the last block, law, length register) of stretches under one law, at one of several `places`; blocks
    `home` are under none."""
    n = words.lines
    law = fill(*words.pick(LAW), n, -1.0).astype(np.int64)
    own = np.array([one.name != "axes" for one in laws] + [False])[law]
    own[home] = False
    change = np.zeros(n + 1, dtype=bool)
    change[words.pick(LAW)[0]] = True
    change[1:] |= (own[1:] & (np.diff(modal.length_register) != 0)) | (own[1:] != own[:-1])
    if places:
        change[1:] |= own[1:] & (modal.offset[1:] != modal.offset[:-1])
    change[0] = False
    edges = [1, *np.flatnonzero(change).tolist(), n + 1]
    return [(a, b, laws[law[a]] if law[a] >= 0 and own[a] else None, int(modal.length_register[a]))
            for a, b in pairwise(edges) if b > a]


def _out_of_planes(words: Words, modal: Modal, laws: tuple[WordMeaning, ...], section: BlockSection) -> Ints:
    """Blocks in machine coordinates in which the tool leaves a tilted plane, which is switched off before it moves again."""
    at, law = words.pick(LAW)
    names = np.array([one.name for one in laws] + ["axes"])
    machine = np.flatnonzero(modal.machine & (names[fill(at, law, words.lines, -1.0).astype(np.int64)] == "tilted"))
    others = np.flatnonzero(section.stated.any(axis=1) & ~modal.machine)
    off = np.append(names[law.astype(np.int64)] == "axes", False)[np.searchsorted(at, machine, side="right")]
    stop = np.append(at, 0)[np.searchsorted(at, machine, side="right")]
    return np.asarray(machine[off & (np.searchsorted(others, machine) == np.searchsorted(others, stop))])


def _blocks(words: Words, modal: Modal, letters: tuple[str, ...], offsets: Offsets) -> BlockSection:
    """The words that move, block by block."""
    n = words.lines
    rest = np.zeros(n + 1, dtype=bool)
    rest[words.pick(REST)[0]] = True
    small = tuple(a.lower() for a in letters)
    lengths = distinct(modal.length_register)
    length = shared(np.array([offsets.length(int(r)) for r in lengths])[np.searchsorted(lengths, modal.length_register)])
    steps = columns(words, small)
    return BlockSection(0, modal.motion, modal.plane, modal.machine, modal.level, modal.inch, modal.offset,
                        columns(words, letters), steps,
                        rest, length, columns(words, "ijk"), columns(words, "IJK"), columns(words, "ZRQPIJK"),
                        columns(words, ("z", "r", TURNS)), columns(words, "L")[:, 0], columns(words, CALL)[:, 0],
                        offsets.shifts(modal.tool, modal.compensation) if offsets.radii else repeated(0.0, n + 1),
                        columns(words, CURVE)[:, 0])


def _cancelled(words: Words, modal: Modal, section: BlockSection, line: Ints, file: str) -> list[Diagnostic]:
    """Axis words while G80 holds: there is no motion they could belong to."""
    blocks = np.flatnonzero((modal.motion == 80) & section.stated.any(axis=1) & ~section.rest)
    if not len(blocks):
        return []
    return [error("gcode.no_motion", "axis words under G80, without a code of motion", file=file,
                  lines=line[blocks][:6].tolist(), count=len(blocks), hint="state G0 or G1")]


def _motion(words: Words, modal: Modal, rows: MotionRows, code: Canonical, used: tuple[ExecutionFrame, ...],
            offsets: Offsets,
            rests: Floats, call: Floats) -> Motion:
    block = rows.block
    feed, missing = _feeds(words, modal, rows)
    dwell = _dwell(block, rows.code, rows.hole, rows.dwell, rests)
    pitch, floating = _threads(modal, rows, feed, call, code)
    state = {k: taken(getattr(modal, k), block) for k in (
        "plane", "inverse", "tool", "spindle", "rpm", "coolant", "compensation", "offset", "blend")}
    return Motion(in_files(code.line[block], code.files), rows.code, rows.end, offsets.home,
                  ccw=shared(rows.ccw), center=rows.center, feed=shared(feed),
                  register=taken(modal.length_register, block), hole=rows.hole, missing_feed=shared(missing),
                  dwell=shared(dwell), frame=rows.frame, block=block, radius=taken(number_of(words, "D"), block),
                  pitch=pitch, floating=floating, unit=shared(feed_units(modal, code)[block]), contour=shared(rows.contour),
                  frames=used, **state)


def feed_units(modal: Modal, code: Canonical) -> Floats:
    """(B + 1,) mm that 1 of F stands for at each block where it counts a length.

    Where the control carries out F before a change of units, and that leaves the feed alone (`feed_kept`; order of
    execution: NIST RS274/NGC table 8), F counts in the units of the block before its own.
    """
    inch = modal.inch
    if not inch.any():
        return repeated(1.0, len(inch))
    if code.feed_kept:
        at = np.unique(code.words.pick("F")[0])
        inch = np.asarray(fill_values(at, inch[at - 1].astype(np.float64), code.words.lines) == 1.0)
    return np.where(inch, MM_PER_INCH / code.feed_parts, 1.0)


def _threads(modal: Modal, rows: MotionRows, feed: Floats, call: Floats,
             code: Canonical) -> tuple[Floats, Bools]:
    """(mm per turn of taps (E,), negative for left-hand ones, NaN for other rows; floating (E,)): G84 and G74 by F and S."""
    if not rows.hole.any():
        return repeated(np.nan, len(rows.block)), repeated(False, len(rows.block))
    motion, rpm = modal.motion[rows.block], modal.rpm[rows.block]
    hand = np.where(motion == 84, 1.0, np.where(motion == 74, -1.0, np.nan))
    called = np.where(rows.hole, call[rows.block], np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        by_feed = feed * feed_units(modal, code)[rows.block] / rpm
    own = np.array([d.pitch for d in code.drills] + [np.nan])
    kinds = np.array([("", "rigid", "floating").index(d.tap) for d in code.drills] + [0])
    drill = np.where(np.isfinite(called), called, -1.0).astype(np.int64)
    by_spindle = np.where(kinds[drill] > 0, by_feed * modal.spindle[rows.block], np.nan)
    pitch = np.where(rows.hole, hand * by_feed, np.nan)
    return np.where(drill >= 0, np.where(np.isfinite(own[drill]), own[drill], by_spindle), pitch), kinds[drill] == 2


def _dwell(block: Ints, code: Array, hole: Bools, at_bottom: Floats, rests: Floats) -> Floats:
    """(E,) s of rest at the end of each row: of a cycle at its bottom, of a dwell where the block before it ends."""
    dwell = np.nan_to_num(at_bottom)
    if len(block):
        alone = np.flatnonzero(rests > 0.0)
        np.add.at(dwell, np.maximum(np.searchsorted(block, alone) - 1, 0), rests[alone])
    return dwell


def _feeds(words: Words, modal: Modal, rows: MotionRows) -> tuple[Floats, Bools]:
    """(F in force, cutting rows without one): inverse time holds for its own block only, a change of mode clears F."""
    n, block = words.lines, rows.block
    stated = columns(words, "F")[:, 0]
    mode = modal.inverse.astype(np.int8) + np.int8(2) * modal.per_turn
    clear = np.full(n + 1, np.nan)
    clear[np.flatnonzero(np.diff(mode)) + 1] = -1.0
    with_clear = np.where(np.isfinite(stated), stated, clear)
    lines = np.flatnonzero(np.isfinite(with_clear))
    force = fill_values(lines, with_clear[lines], n)
    value = taken(force, block)
    if modal.inverse.any():
        value = np.where(modal.inverse[block], stated[block], value)
    if modal.per_turn.any():
        value = np.where(modal.per_turn[block], value * modal.rpm[block], value)
    if rows.hole.any():
        value = np.where(np.isfinite(rows.feed), rows.feed, value)
    return value, (rows.code > 0) & ~(value > 0.0)
