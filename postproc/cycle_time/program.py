"""From the words of a program and their motion (the reader's) to blocks and pauses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.machine import Machine
from postproc.control import Control
from postproc.cycle_time.blocks import Axes, Blocks, Cause, Path, Pauses
from postproc.cycle_time.shape import NOTHING, feed_length
from postproc.readback.execute import Motion
from postproc.readback.modal import modal_state
from postproc.readback.words import Words
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.units import DEG

RESTING_M = (0, 1, 3, 4, 5, 6, 7, 8, 9)
RESTING_G = (43, 43.1, 43.2, 49, 54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3)
"""Codes that are carried out at rest; LinuxCNC waits for motion before each (task, preconditions of commands)."""
LEAST_RATE = 0.1
"""mm or degrees per min: slower inverse-time feeds run at this (LinuxCNC `inverse_time_rate`)"""
TURN = 2.0 * np.pi


def blocks_of(words: Words, motion: Motion, machine: Machine, control: Control, own_path: bool) -> Blocks:
    """The blocks that move, with their pauses.

    Args:
        words: of the program; motion: what executing them gave
        own_path: True where a program without a path mode blends without a limit (LinuxCNC), else it is the control's
    """
    unit = np.where(machine.rotary, DEG, 1.0)
    end = motion.end * unit
    start = np.concatenate([motion.start[None] * unit, end[:-1]])
    axes = Axes.of(machine)
    arc = motion.code == 2
    normal, sweep, center = _arcs(motion, start, end, axes, arc)
    path, tolerance, chain = _path_modes(words, own_path)
    exact = np.where(motion.hole, Path.EXACT, path[motion.line])
    all_blocks = Blocks(axes, start, end, motion.line, motion.code == 0, arc, center, normal, sweep,
                        np.full(len(end), np.inf), exact, tolerance[motion.line], chain[motion.line],
                        np.zeros(len(end), dtype=np.int64), pauses=_pauses(words, motion, machine))
    moving = (np.abs(end - start) > NOTHING).any(axis=1) | arc
    blocks = all_blocks.take(moving)
    blocks = replace(blocks, speed=_speeds(words, motion, moving, blocks))
    return replace(blocks, pauses=_with_indexing(blocks, machine))


def _arcs(motion: Motion, start: Floats, end: Floats, axes: Axes, arc: Bools) -> tuple[Floats, Floats, Floats]:
    """normal (E, 3), sweep (E,) and center (E, 3) of arcs; a start that is also the end is a whole turn."""
    normal, sweep = np.zeros((len(end), 3)), np.zeros(len(end))
    at = np.flatnonzero(arc)
    if not len(at):
        return normal, sweep, np.zeros((len(end), 3))
    index = np.array([2, 1, 0])[motion.plane[at] - 17]
    normal[at, index] = np.where(motion.ccw[at], 1.0, -1.0)
    spokes = [points[at][:, axes.xyz] - motion.center[at] for points in (start, end)]
    across, along = np.cross(normal[at], spokes[0]), (spokes[0] * spokes[1]).sum(axis=1)
    rise = (spokes[0] * normal[at]).sum(axis=1) * (spokes[1] * normal[at]).sum(axis=1)
    angle = np.arctan2((across * spokes[1]).sum(axis=1), along - rise)
    sweep[at] = np.where(angle > 1e-9, angle, angle + TURN)
    return normal, sweep, np.where(arc[:, None], motion.center, 0.0)


def _path_modes(words: Words, own_path: bool) -> tuple[Array, Floats, Floats]:
    """(L + 1,) Path, tolerance and chain in force at each line: G61, G61.1, G64 P Q (LinuxCNC G-code reference)."""
    lines, codes = _pick(words, "G")
    keep = np.isin(codes, (61, 61.1, 64))
    lines, codes = lines[keep], codes[keep]
    inch = modal_state(words).inch[lines]
    p, q = (_stated(words, letter, lines) * np.where(inch, 25.4, 1.0) for letter in "PQ")
    blend = codes == 64
    path = np.where(blend, Path.BLEND, np.where(codes == 61, Path.EXACT, Path.STOP))
    tolerance = np.where(p > 0.0, p, np.inf)
    chain = np.where(blend, np.where(np.isfinite(q), q, np.where(np.isfinite(p), p, 0.0)), 0.0)
    initial = np.inf if own_path else np.nan
    return (_carried(lines, path, words.lines, Path.BLEND).astype(np.int8),
            _carried(lines, tolerance, words.lines, initial), _carried(lines, chain, words.lines, 0.0))


def _pick(words: Words, letter: str) -> tuple[Ints, Floats]:
    """(lines, numbers) of the words of a letter."""
    here = words.letter == ord(letter)
    return words.line[here], words.value[here]


def _stated(words: Words, letter: str, lines: Ints) -> Floats:
    """(K,) the number of a letter in each of some lines, NaN where it is not stated."""
    result = np.full(words.lines + 1, np.nan)
    at, values = _pick(words, letter)
    result[at] = values
    return result[lines]


def _carried(lines: Ints, values: Array, count: int, initial: float) -> Floats:
    """(count + 1,) the value stated last at or before each line."""
    index = np.zeros(count + 1, dtype=np.int64)
    index[lines] = np.arange(1, len(lines) + 1)
    return np.concatenate([[initial], values])[np.maximum.accumulate(index)].astype(np.float64)


def _speeds(words: Words, motion: Motion, moving: Bools, blocks: Blocks) -> Floats:
    """(E,) mm/s or rad/s that the feed word asks for."""
    from postproc.cycle_time.shape import shape

    feed, inverse = motion.feed[moving], motion.inverse[moving]
    inch = modal_state(words).inch[blocks.line]
    length = shape(blocks).length
    linear = feed_length(np.where(blocks.axes.rotary, 0.0, blocks.end - blocks.start), blocks.axes) > NOTHING
    linear |= blocks.arc
    per_minute = feed * np.where(linear, np.where(inch, 25.4, 1.0), DEG)
    least = LEAST_RATE * np.where(linear, 1.0, DEG)
    asked = np.where(inverse, np.maximum(feed * length, least), per_minute) / 60.0
    return np.where(blocks.rapid, np.inf, asked)


def _pauses(words: Words, motion: Motion, machine: Machine) -> Pauses:
    """Rests by the codes of the program; dwells stand with the block that they follow."""
    m_lines, m = _pick(words, "M")
    g_lines, g = _pick(words, "G")
    s_lines, _ = _pick(words, "S")
    keep_m, keep_g = np.isin(m, RESTING_M), np.isin(g, RESTING_G)
    m, m_lines = m[keep_m], m_lines[keep_m]
    spindle, change = np.isin(m, (3, 4)), m == 6
    cause = np.where(change, Cause.TOOL_CHANGE, np.where(spindle, Cause.SPINDLE, Cause.OTHER))
    rests = np.flatnonzero(motion.dwell > 0.0)
    line = np.concatenate([m_lines, g_lines[keep_g], s_lines, motion.line[rests]])
    block = np.searchsorted(motion.line, line) - 1
    block[len(line) - len(rests):] = rests
    seconds = np.zeros(len(line))
    seconds[:len(m)] = np.where(change, machine.timing.tool_change, 0.0)
    seconds[len(line) - len(rests):] = motion.dwell[rests]
    causes = np.concatenate([cause, np.full(int(keep_g.sum()) + len(s_lines), Cause.OTHER),
                             np.full(len(rests), Cause.DWELL)])
    order = np.lexsort((line, block))
    return Pauses(block[order], causes[order], seconds[order], line[order])


def _with_indexing(blocks: Blocks, machine: Machine) -> Pauses:
    """The pauses with clamp and unclamp: where a run of rapids turns axes that the cut behind it leaves at rest."""
    timing, pauses = machine.timing, blocks.pauses
    seconds = timing.clamp + timing.unclamp
    if seconds <= 0.0:
        return pauses
    turned = np.abs((blocks.end - blocks.start)[:, blocks.axes.rotary]).max(axis=1, initial=0.0) > NOTHING
    cuts = np.flatnonzero(~blocks.rapid)
    following = np.searchsorted(cuts, np.arange(len(blocks)))
    moves_on = np.append(turned[cuts], True)[following]
    index = np.flatnonzero(blocks.rapid & turned & ~moves_on)
    if len(index):
        index = index[np.append(np.diff(following[index]) > 0, True)]
    block = np.concatenate([pauses.block, index])
    order = np.argsort(block, kind="stable")
    return Pauses(block[order], np.concatenate([pauses.cause, np.full(len(index), Cause.INDEXING)])[order],
                  np.concatenate([pauses.seconds, np.full(len(index), seconds)])[order],
                  np.concatenate([pauses.line, blocks.line[index]])[order])
