"""Blocks under the reference control (`postproc.clock`): its path from the blocks, its times back to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.clock.control import ControlMotion, execute
from postproc.clock.path import CommandedPath
from postproc.clock.settings import ControlSettings
from postproc.cycle_time.blocks import CornerMode, MotionBlocks
from postproc.cycle_time.lookahead import limits, lookahead, rests
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.phases import BlockTimes, summed
from postproc.cycle_time.shape import Shape, shape
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import REPORT, info, warning

ARC_PIECE = 0.1
"""rad of an arc that one piece stands for; the control fits a curve through them"""
SHORTEST = 1e-9
"""mm or rad that a block counts at least"""
MOST_BLOCKS, MOST_STOPS = 300_000, 5_000
"""blocks and rests up to which the control is executed"""
BENT = 0.002
"""of the largest acceleration, by which it changes from cycle to cycle where jerk limits"""
AT_SPEED = 0.999
"""of the speed asked for that counts as constant speed"""


def control(blocks: MotionBlocks, model: CycleTimeModel) -> BlockTimes:
    """How long the control takes over each block; `found` says where the times are those of formulas: beyond
    MOST_BLOCKS or MOST_STOPS, and where no motion within the limits was found."""
    form = shape(blocks)
    stops, target = rests(blocks, form), feeds(blocks, form, model)
    if len(blocks) > MOST_BLOCKS or np.count_nonzero(stops) > MOST_STOPS:
        return replace(lookahead(blocks, model.quick()), found=(info(
            "time.control", f"{len(blocks)} blocks with {np.count_nonzero(stops)} stops: the control is executed up to "
            f"{MOST_BLOCKS} blocks and {MOST_STOPS} stops; the times are about those, by formulas"),))
    try:
        moved, owner = motion(blocks, model, form, stops, target)
    except (ValueError, ArithmeticError) as fault:
        return replace(lookahead(blocks, model.quick()), found=(warning(
            "time.plan", f"the motion of the control cannot be planned, times are about those, by formulas: {fault}",
            hint=f"{REPORT}; --model lookahead needs no plan"),))
    return _on_the_clock(blocks, form, moved, owner, stops, target, model.stop_time)


def feeds(blocks: MotionBlocks, form: Shape, model: CycleTimeModel) -> Floats:
    """(E,) largest speed along each block as the control is given it: how fast it takes up blocks is its own, over some."""
    return limits(blocks, form, model.model_copy(update={"block_time": 0.0}))[0]


def motion(blocks: MotionBlocks, model: CycleTimeModel, form: Shape, stops: Bools,
           target: Floats) -> tuple[ControlMotion, Ints]:
    """The executed motion, and the block of each piece that was commanded; rests without their time."""
    path, settings, owner = commanded(blocks, model, form, stops, target)
    return execute(path, settings), owner


def commanded(blocks: MotionBlocks, model: CycleTimeModel, form: Shape, stops: Bools,
              target: Floats) -> tuple[CommandedPath, ControlSettings, Ints]:
    """What the control is given, how it plans, and the block of each piece."""
    points, length, owner = pieces(blocks, form)
    last = np.append(np.diff(owner) > 0, True)
    stated = blocks.tolerance
    free = np.isnan(stated) | np.isinf(stated)
    tolerance = np.where(free, model.corner_tolerance, stated * model.stated_share)
    tolerance = np.where(blocks.path == CornerMode.BLEND, tolerance, 0.0)
    inner = np.where(blocks.arc, model.corner_tolerance, tolerance)[owner]
    axes = blocks.axes
    path = CommandedPath(points, length, target[owner], np.concatenate([[0.0], np.where(last, tolerance[owner], inner)]),
                         np.concatenate([[True], stops[owner] & last]), blocks.arms,
                         None if blocks.pieces is None else 1.0 / blocks.pieces[owner])
    jerk = axes.jerk if model.jerk else np.full(len(axes.letters), np.inf)
    weight = path.weight
    step = None if model.corner_step is None else model.corner_step / weight
    smoothing = np.full(len(weight), model.smoothing) if model.smoothing > 0.0 else None
    return path, ControlSettings(axes.velocity, axes.acceleration, jerk, model.lookahead, model.block_time, model.cycle,
                                 model.bend_acceleration, model.bend_jerk, step, smoothing), owner


def pieces(blocks: MotionBlocks, form: Shape) -> tuple[Floats, Floats, Ints]:
    """(points (P + 1, A), length (P,), block (P,)): arcs as pieces of at most ARC_PIECE."""
    count = np.where(blocks.arc, np.maximum(np.ceil(np.abs(blocks.sweep) / ARC_PIECE), 1), 1).astype(np.int64)
    owner = np.repeat(np.arange(len(blocks)), count)
    part = (np.arange(len(owner)) - (np.cumsum(count) - count)[owner] + 1.0) / count[owner]
    start, step = blocks.start[owner], (blocks.end - blocks.start)[owner]
    points = start + part[:, None] * step
    bent = np.flatnonzero((part < 1.0) & blocks.arc[owner])
    if len(bent):
        row, columns = owner[bent], blocks.axes.xyz
        normal, angle = blocks.normal[row], (blocks.sweep[row] * part[bent])[:, None]
        spoke = blocks.start[row][:, columns] - blocks.center[row]
        along = (((blocks.end - blocks.start)[row][:, columns] * normal).sum(axis=1) * part[bent])[:, None] * normal
        level = (spoke * normal).sum(axis=1)[:, None] * normal
        turned = np.cos(angle) * (spoke - level) + np.sin(angle) * np.cross(normal, spoke)
        points[np.ix_(bent, columns)] = blocks.center[row] + level + turned + along
    length = np.maximum(form.length, SHORTEST)[owner] / count[owner]
    return np.concatenate([blocks.start[:1], points]), length, owner


def _on_the_clock(blocks: MotionBlocks, form: Shape, moved: ControlMotion, owner: Ints, stops: Bools, target: Floats,
                  stop_time: float) -> BlockTimes:
    """Times of the blocks with their rests."""
    seconds = summed(np.diff(moved.times()), owner, len(blocks))
    p = blocks.pauses
    inside = p.block >= 0
    rest = summed(p.seconds[inside], p.block[inside], len(blocks)) + np.where(stops, stop_time, 0.0)
    begin = np.concatenate([[0.0], np.cumsum(seconds + rest)[:-1]])
    step, travel = np.diff(moved.t), np.diff(moved.s)
    piece = np.clip(np.searchsorted(moved.ends, moved.s[:-1] + travel / 2.0, side="right") - 1, 0, len(owner) - 1)
    scale = (form.length[owner] / np.maximum(np.bincount(owner)[owner], 1)) / np.maximum(np.diff(moved.ends), SHORTEST)
    which, v = owner[piece], np.stack([moved.v[1:], moved.v[:-1]]) * scale[piece]
    peak = np.zeros(len(blocks))
    np.maximum.at(peak, which, v.max(axis=0, initial=0.0))
    peak = np.maximum(peak, form.length / np.maximum(seconds, 1e-300))
    constant = v.min(axis=0, initial=np.inf) >= AT_SPEED * target[which]
    steady = np.minimum(summed(np.where(constant, step, 0.0), which, len(blocks)), seconds)
    change = np.abs(np.diff(moved.a))
    bent = change > BENT * np.abs(moved.a).max(initial=0.0)
    jerk = np.minimum(summed(np.where(bent & ~constant, step, 0.0), which, len(blocks)), seconds - steady)
    lost = np.maximum(seconds - form.length / np.maximum(peak, 1e-300), 0.0)
    around = stops | np.concatenate([[True], stops[:-1]])
    return BlockTimes(begin, begin + seconds + np.where(stops, stop_time, 0.0), seconds - steady - jerk, steady,
                      jerk, peak, np.where(around, lost, 0.0) + np.where(stops, stop_time, 0.0),
                      np.where(around, 0.0, lost), p.seconds.copy())
