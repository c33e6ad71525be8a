"""From the canonical words of a program and their motion (the reader's) to blocks and pauses."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from machines.machine import Machine
from postproc.control.control import Control
from postproc.cycle_time.blocks import OFF, Axes, Cause, CornerMode, MotionBlocks, Pauses
from postproc.cycle_time.shape import NOTHING, block_lengths, shape_within
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import arc_sweeps, coordinates, positions
from postproc.readback.text.canonical import (
    CURVE,
    LOADED,
    OFFSET,
    REGISTER,
    REST,
    SMOOTH,
    SMOOTH_AXIS,
    SMOOTH_LEVEL,
    Canonical,
)
from postproc.readback.text.clamps import closing, opening
from postproc.readback.text.modal import columns, fill_values, modal_state
from postproc.readback.text.words import Words
from toolpaths.arrays import Array, Bools, Floats, Ints, repeated
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.units import DEG, MM_PER_INCH

RESTING_M = (0.0, 1.0, 3.0, 4.0, 5.0, 7.0, 8.0, 9.0)
"""Codes that are carried out at rest; LinuxCNC waits for motion before each (emctaskmain.cc, preconditions)."""
LEAST_RATE = 0.1
"""mm or degrees per min: slower inverse-time feeds run at this (LinuxCNC interp_inverse.cc)"""
CHORD = 0.1
"""rad of an arc that one straight piece stands for where the control bends it through its kinematics"""
BEND, MOST_PIECES = 0.002, 64
"""mm or degrees off its axes' straight line that one piece of a block may be, and pieces of a block at most"""

@dataclass(frozen=True)
@arrays(operation="E", cl_line="E", move="E")
class BlockOrigin:
    """Where motion blocks come from: operation (E,) of `names`; CL line and row of the job's moves (E,) or None."""

    operation: Ints
    names: tuple[str, ...]
    cl_line: Ints | None = None
    move: Ints | None = None

    @staticmethod
    def by_tool(motion: Motion) -> BlockOrigin:
        """One operation from tool change to tool change."""
        change = np.concatenate([[False], np.diff(motion.tool) != 0])[:len(motion)]
        number = np.cumsum(change)
        first = np.unique(number, return_index=True)[1]
        return BlockOrigin(number, tuple(f"T{t}" if t >= 0 else "" for t in motion.tool[first].tolist()) or ("",))


def blocks_of(code: Canonical, motion: Motion, machine: Machine, control: Control, origin: BlockOrigin | None = None,
              blends_unstated: bool = False, exact_path_rests: bool = False, by_radius: bool = False,
              override: float = 1.0) -> MotionBlocks:
    """The blocks that move, with their pauses.

    Args:
        code: what the reader makes of the text; motion: what executing it gave
        origin: operations and CL lines; by tool where it is left out
        blends_unstated: a program without a path mode blends without a limit, else as the control's smoothing says
        exact_path_rests: under G61 the axes rest at the end of each block
        by_radius: inverse time of arcs counts radians
        override: the operator's feed override, 1 for 100 %: of feeds alone, not of rapids and taps
    """
    origin = origin or BlockOrigin.by_tool(motion)
    block, words, unit = motion.block, code.words, np.where(machine.rotary, DEG, 1.0)
    points = np.concatenate([motion.start[None], motion.end])
    points *= unit
    start, end = points[:-1], points[1:]
    arc = motion.code == 2
    normal, sweep, center = _arcs(motion, control, arc, start)
    path, tolerance, chain = _path_modes(words, blends_unstated, CornerMode.STOP if exact_path_rests else CornerMode.EXACT)
    pieces, inside = _of_curves(code, motion)
    path = np.where(motion.hole, CornerMode.EXACT, np.where(inside, CornerMode.BLEND, path[block]))
    pauses = _pauses(words, block, code.line, motion, machine)
    blocks = MotionBlocks(Axes.of(machine), start, end, motion.line, motion.code == 0, arc, center, normal, sweep,
                          np.full(len(end), np.inf), path, tolerance[block], chain[block], origin.operation, origin.names,
                          pauses,
                           origin.cl_line, origin.move, _feed_lengths(motion, control), pieces, np.arange(len(motion)),
                           tool=np.asarray(motion.tool[:len(motion)]), level=_levels(words)[block],
                          turn_tolerance=fill_values(*words.pick(SMOOTH_AXIS), words.lines)[block] * DEG)
    turned = np.where(np.isnan(motion.pitch), override, 1.0)
    linear = _linear(motion, control)
    blocks = replace(blocks, speed=_clamped(_speeds(motion, blocks, linear, by_radius) * turned, blocks, linear, machine))
    moving = (np.abs(end - start) > NOTHING).any(axis=1) | arc
    blocks = _unrolled(blocks, motion, control, unit) if (motion.frame > 0).any() else blocks.take(moving)
    return replace(blocks, pauses=_with_indexing(blocks, machine))


def _of_curves(code: Canonical, motion: Motion) -> tuple[Ints, Bools]:
    """(of how many rows (E,) the block of each row consists, where that is a polynomial, else 1; rows (E,) that do not end
    it)."""
    every = len(motion)
    if not len(code.curves):
        return repeated(1, every), repeated(False, every)
    curved = np.isin(motion.block, code.words.pick(CURVE)[0])
    first = np.searchsorted(motion.block, motion.block)
    count = np.searchsorted(motion.block, motion.block, side="right") - first
    return np.where(curved, count, 1), curved & (np.arange(every) < first + count - 1)


def _arcs(motion: Motion, control: Control, arc: Bools, start: Floats) -> tuple[Floats, Floats, Floats]:
    """normal (E, 3), sweep (E,) and center (E, 3) of arcs, the center at the height of the start."""
    at = np.flatnonzero(arc)
    if not len(at):
        return repeated(np.zeros(3), len(motion)), repeated(0.0, len(motion)), repeated(np.zeros(3), len(motion))
    normal, center = np.zeros((len(motion), 3)), np.zeros((len(motion), 3))
    height = np.array([2, 1, 0])[motion.plane[at] - 17]
    normal[at, height] = np.where(motion.ccw[at], 1.0, -1.0)
    center[at] = motion.center[at]
    center[at, height] = start[at, control.xyz[height]]
    return normal, np.nan_to_num(arc_sweeps(motion, control)), center


def _feed_lengths(motion: Motion, control: Control) -> Floats:
    """(E,) what the feed refers to where X, Y, Z are the tip and the joints follow, and where a control's rule is not that
    of `shape.feed_length`: mm, rad where no slide moves; NaN elsewhere and on arcs of machine coordinates."""
    result, rows = np.full(len(motion), np.nan), np.flatnonzero(motion.frame > 0)
    if len(rows):
        before, end = coordinates(motion, rows)
        step = end - before
        result[rows] = control.under("tcp").feed_length(np.where(np.abs(step) > NOTHING, step, 0.0))
        result[rows[_turning(before, end, control)]] *= DEG
    if control.feed_rule != "xyz-first" and len(rows := np.flatnonzero((motion.frame == 0) & (motion.code != 2))):
        step, unit = np.diff(motion.end, axis=0, prepend=motion.start[None])[rows], motion.unit[rows]
        slides = (np.abs(step[:, control.slides]) > NOTHING).any(axis=1)
        result[rows] = control.under("axes").feed_units(step, unit) * np.where(slides, unit, DEG)
    return result


def _unrolled(blocks: MotionBlocks, motion: Motion, control: Control, unit: Floats) -> MotionBlocks:
    """Blocks that the control bends through its kinematics as straight pieces; what does not move is left out."""
    bent = blocks.arc & (motion.frame > 0)
    count = np.where(bent, np.ceil(blocks.sweep / CHORD).astype(np.int64),
                     _pieces(blocks, motion, control, unit))
    row = np.repeat(np.arange(len(blocks)), count)
    part = (np.arange(len(row)) - (np.cumsum(count) - count)[row] + 1.0) / count[row]
    wide = blocks.take(row)
    end = wide.end.copy()
    inner = np.flatnonzero((count > 1)[row])
    end[inner] = positions(motion, control, row[inner], part[inner]) * unit
    start = np.concatenate([blocks.start[:1], end[:-1]])
    pauses = replace(blocks.pauses, block=np.where(blocks.pauses.block >= 0, np.searchsorted(
        row, blocks.pauses.block, side="right") - 1, -1))
    wide = replace(wide, start=start, end=end, arc=wide.arc & ~bent[row], pauses=pauses,
                   pieces=count[row] if wide.pieces is None else count[row] * wide.pieces,
                   given=wide.given / count[row] if wide.given is not None else None)
    return wide.take((np.abs(end - start) > NOTHING).any(axis=1) | wide.arc)


def _pieces(blocks: MotionBlocks, motion: Motion, control: Control, unit: Floats) -> Ints:
    """(E,) pieces of blocks whose axes leave the straight line while the tip stays on it: 1 elsewhere."""
    count = np.ones(len(blocks), dtype=np.int64)
    rows = np.flatnonzero((motion.frame > 0) & ~blocks.arc)
    if len(rows):
        middle = positions(motion, control, rows, np.full(len(rows), 0.5)) * unit
        off = np.abs(middle - (blocks.start[rows] + blocks.end[rows]) / 2.0)
        slack = np.where(blocks.axes.rotary, BEND * DEG, BEND)
        count[rows] = np.clip(np.ceil(np.sqrt((off / slack).max(axis=1))), 1, MOST_PIECES)
    return count


def _path_modes(words: Words, blends_unstated: bool, under_61: CornerMode) -> tuple[Array, Floats, Floats]:
    """(B + 1,) Path, tolerance and chain in force at each block: G61, G61.1, G64 P Q (LinuxCNC G-code
    reference; G61 as `under_61`), else what the reader says of the control's smoothing, as under a G64 that states none
    (SINUMERIK: CYCLE832 stands behind G64)."""
    at, codes = words.pick("G")
    keep = np.isin(codes, (61.0, 61.1, 64.0))
    at, codes = at[keep], codes[keep]
    scale = np.where(modal_state(words).inch, MM_PER_INCH, 1.0)[at]
    p, q = (columns(words, letter)[at, 0] * scale for letter in "PQ")
    blend = codes == 64.0
    path = np.where(blend, CornerMode.BLEND, np.where(codes == 61.0, under_61, CornerMode.STOP))
    tolerance = np.where(p > 0.0, p, np.inf)
    chain = np.where(blend, np.where(np.isfinite(q), q, np.where(np.isfinite(p), p, 0.0)), 0.0)
    smooth = fill_values(*words.pick(SMOOTH), words.lines)
    stated = np.where(smooth == 0.0, np.nan, smooth) if not blends_unstated else np.full(words.lines + 1, np.inf)
    stated[at[0] if len(at) else words.lines + 1:] = np.nan
    own = _carried(at, tolerance, words.lines)
    own = np.where(np.isinf(own) & np.isfinite(smooth) & (smooth > 0.0), smooth, own)
    exact, rounded = _exact_stops(words)
    held = np.nan_to_num(_carried(at, path.astype(np.float64), words.lines), nan=float(CornerMode.BLEND)).astype(np.int8)
    return (np.where(exact, CornerMode.STOP, held).astype(np.int8),
            np.where(rounded & (smooth > 0.0), smooth, np.where(np.isnan(own), stated, own)),
            np.nan_to_num(_carried(at, chain, words.lines)))


def _levels(words: Words) -> Floats:
    """(B + 1,) level of the control's smoothing in force at each block."""
    allowed = fill_values(*words.pick(SMOOTH), words.lines)
    level = fill_values(*words.pick(SMOOTH_LEVEL), words.lines)
    return np.where(np.isnan(allowed) | (allowed == 0.0), OFF, level)


def _exact_stops(words: Words) -> tuple[Bools, Bools]:
    """(B + 1,) where the axes rest at the end of the block: G60, G9; and where G641 or G645 round within what ADIS allows
    (SINUMERIK, exact stop and continuous-path mode)."""
    held = fill_values(*_picked(words, (60.0, 64.0, 641.0, 642.0, 643.0, 644.0, 645.0)), words.lines)
    exact = held == 60.0
    exact[_picked(words, (9.0,))[0]] = True
    return exact, (held == 641.0) | (held == 645.0)


def _picked(words: Words, numbers: tuple[float, ...]) -> tuple[Ints, Floats]:
    """(blocks, numbers) of those G codes."""
    at, value = words.pick("G")
    keep = np.isin(value, numbers)
    return at[keep], value[keep]


def _carried(at: Ints, values: Floats, count: int) -> Floats:
    """(count + 1,) the value stated last at or before each block, NaN before the first."""
    return fill_values(at, values, count)


def _linear(motion: Motion, control: Control) -> Bools:
    """(E,) where a feed per minute counts mm: a slide moves, or where X, Y, Z are the tip that does."""
    step = np.abs(np.diff(motion.end, axis=0, prepend=motion.start[None]))
    result = (step[:, control.slides] > NOTHING).any(axis=1) | (motion.code == 2)
    if len(rows := np.flatnonzero(motion.frame > 0)):
        result[rows] = (motion.code[rows] == 2) | ~_turning(*coordinates(motion, rows), control)
    return np.asarray(result)


def _turning(before: Floats, end: Floats, control: Control) -> Bools:
    """(N,) where the tip stands, at words (N, J)."""
    return np.asarray(np.linalg.norm((end - before)[:, control.xyz], axis=1) <= NOTHING)


def _speeds(motion: Motion, blocks: MotionBlocks, linear: Bools, by_radius: bool) -> Floats:
    """(E,) mm/s or rad/s that the feed word asks for."""
    unit = motion.unit
    per_minute = motion.feed * np.where(linear, unit, DEG)
    least = LEAST_RATE * np.where(linear, unit, DEG)
    around = np.where(blocks.arc & by_radius, blocks.sweep, 1.0)
    asked = per_minute
    if motion.inverse.any():
        rate = motion.feed * block_lengths(blocks) / np.where(around > 0.0, around, 1.0)
        asked = np.where(motion.inverse, np.maximum(rate, least), per_minute)
    asked = asked / 60.0
    return np.where(blocks.rapid, np.inf, asked)


def _clamped(speed: Floats, blocks: MotionBlocks, linear: Bools, machine: Machine) -> Floats:
    """Speeds (E,) as the control runs them: at feed none above the largest cutting feed, of the machine and of each axis."""
    if not math.isfinite(machine.largest_feed) and not machine.cutting_velocity:
        return speed
    _, (own,) = shape_within(blocks, machine.cutting_limits.velocity)
    most = np.minimum(own, machine.largest_feed * np.where(linear, 1.0, DEG))
    return np.asarray(np.where(blocks.rapid, speed, np.minimum(speed, most)))


def _pauses(words: Words, block: Ints, line: Ints, motion: Motion, machine: Machine) -> Pauses:
    """Rests by the codes of the program; dwells stand with the row that they follow, those of 0 s are stops."""
    at, codes = words.pick("M")
    clamps, unclamps = closing(machine.clamp_codes), opening(machine.clamp_codes)
    resting = np.isin(codes, (*RESTING_M, *clamps, *unclamps))
    at, codes = at[resting], codes[resting]
    changes, other = words.pick(LOADED)[0], np.concatenate([words.pick(sign)[0] for sign in (REGISTER, OFFSET, "S")])
    rests = np.flatnonzero(motion.dwell > 0.0)
    empty = words.pick(REST)[0][words.pick(REST)[1] == 0.0]
    where = np.concatenate([at, changes, other, empty, block[rests]])
    row = np.searchsorted(block, where) - 1
    row[len(where) - len(rests):] = rests
    of_codes = np.where(np.isin(codes, (3.0, 4.0)), Cause.SPINDLE, Cause.OTHER)
    of_codes[np.isin(codes, (*clamps, *unclamps))] = Cause.INDEXING
    cause = np.concatenate([of_codes,
                            np.full(len(changes), Cause.TOOL_CHANGE), np.full(len(other), Cause.OTHER),
                            np.full(len(empty) + len(rests), Cause.DWELL)])
    seconds = np.where(cause == Cause.TOOL_CHANGE, machine.timing.tool_change, 0.0)
    seconds[:len(at)] += np.where(np.isin(codes, clamps), machine.timing.clamp, 0.0)
    seconds[:len(at)] += np.where(np.isin(codes, unclamps), machine.timing.unclamp, 0.0)
    seconds[len(where) - len(rests):] = motion.dwell[rests]
    order = np.lexsort((where, row))
    return Pauses(row[order], cause[order], seconds[order], line[where[order]])


def _with_indexing(blocks: MotionBlocks, machine: Machine) -> Pauses:
    """The pauses with clamp and unclamp: where a run of rapids turns axes that the cut behind it leaves at rest.

    Of axes that the machine clamps by itself; codes of the program that do so are pauses of their own."""
    timing, pauses = machine.timing, blocks.pauses
    own = blocks.axes.rotary & ~np.array([bool(codes.clamp) for codes in machine.clamps])
    seconds = timing.clamp + timing.unclamp
    if seconds <= 0.0 or not len(blocks):
        return pauses
    turned = np.abs((blocks.end - blocks.start)[:, own]).max(axis=1, initial=0.0) > NOTHING
    cuts = np.flatnonzero(~blocks.rapid)
    following = np.searchsorted(cuts, np.arange(len(blocks)))
    moves_on = np.append(turned[cuts], True)[following]
    index = np.flatnonzero(blocks.rapid & turned & ~moves_on)
    index = index[np.append(np.diff(following[index]) > 0, True)[:len(index)]]
    block = np.concatenate([pauses.block, index])
    order = np.argsort(block, kind="stable")
    return Pauses(block[order], np.concatenate([pauses.cause, np.full(len(index), Cause.INDEXING)])[order],
                  np.concatenate([pauses.seconds, np.full(len(index), seconds)])[order],
                  np.concatenate([pauses.line, blocks.line[index]])[order])
