"""Levels of a control's smoothing: stretches of a program that differ in them, each executed by its own settings.

A level is switched at rest: G05.1 stands in a block of its own (B-63534EN, 19.7), cycles that switch it stand between cuts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace

import numpy as np

from postproc.cycle_time.blocks import OFF, MotionBlocks
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.phases import BlockTimes
from toolpaths.arrays import Floats

HIGHEST = 100.0
"""level beyond which a number stands for words of a controller file that name none"""


def by_level(blocks: MotionBlocks, model: CycleTimeModel,
             run: Callable[[MotionBlocks, CycleTimeModel], BlockTimes]) -> BlockTimes:
    """The blocks under `run`, each stretch of one level with the model of that level, one after the other."""
    if blocks.level is None or not len(blocks) or (not model.levels and model.off is None):
        return run(blocks, model)
    level = np.nan_to_num(blocks.level, nan=OFF - 1.0)
    first = np.concatenate([[0], np.flatnonzero(np.diff(level) != 0.0) + 1])
    parts, begin = list[BlockTimes](), 0.0
    for low, high in zip(first.tolist(), [*first[1:].tolist(), len(blocks)], strict=True):
        part = stretch(blocks, low, high)
        scaled, own = _at(part, model, float(blocks.level[low]))
        times = run(scaled, own)
        parts.append(replace(times, begin=times.begin + begin, end=times.end + begin))
        begin = float(parts[-1].end[-1]) + float(times.pause[part.pauses.block == high - low - 1].sum())
    return parts[0] if len(parts) == 1 else _joined(parts)


def stretch(blocks: MotionBlocks, low: int, high: int) -> MotionBlocks:
    """Rows from low to before high with their pauses, those before the first block with the first stretch."""
    p = blocks.pauses
    own = ((p.block >= low) | ((p.block < 0) & (low == 0))) & (p.block < high)
    pauses = replace(p, block=np.maximum(p.block[own] - low, -1), cause=p.cause[own], seconds=p.seconds[own],
                     line=p.line[own])
    return replace(blocks.take(np.arange(low, high)), pauses=pauses)


def _at(blocks: MotionBlocks, model: CycleTimeModel, level: float) -> tuple[MotionBlocks, CycleTimeModel]:
    """The stretch and the model at a level."""
    if level == OFF:
        off = model.off
        return blocks, model if off is None else model.model_copy(update={
            "block_time": off.block_time, "corner_step": off.corner_step, "smoothing": off.smoothing})
    if not model.levels or not 0.0 <= level <= HIGHEST:
        return blocks, model
    known = sorted(model.levels, key=lambda one: one.level)
    at: Floats = np.array([one.level for one in known])
    acceleration, jerk = (model.level_share * float(np.interp(level, at, values)) for values in (
        [one.acceleration for one in known], [one.jerk for one in known]))
    axes = replace(blocks.axes, acceleration=blocks.axes.acceleration * acceleration, jerk=blocks.axes.jerk * jerk)
    return replace(blocks, axes=axes), model


def _joined(parts: list[BlockTimes]) -> BlockTimes:
    """Times of stretches as one."""
    columns = {one.name: np.concatenate([getattr(part, one.name) for part in parts])
               for one in fields(BlockTimes) if one.name != "found"}
    found = tuple(dict.fromkeys(d for part in parts for d in part.found))
    return replace(parts[0], **columns, found=found)
