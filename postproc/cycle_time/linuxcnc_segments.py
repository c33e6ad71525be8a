"""LinuxCNC between interpreter and planner: short lines merged, a speed and an acceleration for every segment.

Described from the source of LinuxCNC 2.9 (src/emc/task/emccanon.cc: `see_segment`, `linkable`,
`getStraightVelocity`, `getStraightAcceleration`, `ARC_FEED`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.cycle_time.blocks import Axes, CornerMode, MotionBlocks
from postproc.cycle_time.linuxcnc_kernels import chain_ends
from postproc.cycle_time.shape import Shape, shape, shape_within
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.compiled import chosen
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

NORMAL_SHARE = np.sqrt(3.0) / 2.0
"""of the acceleration on a circle may point to its centre (`BLEND_ACC_RATIO_NORMAL`)"""
KERNEL_FROM = 20_000
"""blocks from which compiling pays"""


@dataclass(frozen=True)
@arrays(block="N", fresh="N", length="N", asked="N", most="N", acceleration="N")
class PlannerSegments:
    """N segments of the planner, in mm or rad of `length`, and s.

    Attributes:
        block (N,): row of the (last) block behind it; fresh (N,): True where the queue has run empty before
        length, asked, most, acceleration (N,): path, speed of the feed word, largest speed and acceleration of the axes
        shape: geometry of the rows; blocks: the rows themselves, merged
    """

    block: Ints
    fresh: Bools
    length: Floats
    asked: Floats
    most: Floats
    acceleration: Floats
    shape: Shape
    blocks: MotionBlocks

    def __len__(self) -> int:
        return len(self.length)


def segments(blocks: MotionBlocks, override: float = 1.0, rapid: float = 1.0) -> PlannerSegments:
    """The segments that the planner is given; feeds and rapids times their overrides."""
    merged, block = merge(blocks)
    form, (most, acceleration) = shape_within(merged, merged.axes.velocity, merged.axes.acceleration)
    if merged.arc.any():
        _arc_limits(merged, form, most, acceleration)
    fresh = np.concatenate([[True], merged.forced[:-1]])
    asked = np.where(merged.rapid, most * rapid, merged.speed * override)
    return PlannerSegments(block, fresh, form.length, np.minimum(asked, most), most, acceleration,
                           form, merged)


def _arc_limits(blocks: MotionBlocks, form: Shape, most: Floats, acceleration: Floats) -> None:
    """Speed and acceleration of arcs: the plane's slower axis, centripetal acceleration, and the straight path's axes."""
    at, axes = np.flatnonzero(blocks.arc), blocks.axes
    in_plane = np.abs(blocks.normal[at]) < 0.5
    velocity, accel = (np.where(in_plane, limit[axes.xyz], np.inf).min(axis=1)
                       for limit in (axes.velocity, axes.acceleration))
    radius, around = form.radius[at], form.radius[at] * blocks.sweep[at]
    plane = np.minimum(np.sqrt(NORMAL_SHARE * accel * radius), velocity)
    straight = np.abs(blocks.end - blocks.start)[at]
    for values, limit, around_limit in ((most, axes.velocity, plane),
                                        (acceleration, axes.acceleration, accel)):
        values[at] = form.length[at] / np.maximum((straight / limit).max(axis=1), around / around_limit)


def merge(blocks: MotionBlocks) -> tuple[MotionBlocks, Ints]:
    """(blocks with short lines merged, row of the last block behind each): G64 Q, "naive CAM" detection."""
    rows = np.arange(len(blocks))
    if not (blocks.chain > 0.0).any():
        return blocks, rows
    blocks, rows = _flat_arcs(blocks, rows)
    line = ~blocks.rapid & ~blocks.arc & (blocks.path == CornerMode.BLEND) & (blocks.chain > 0.0)
    turns = np.delete(blocks.end - blocks.start, blocks.axes.xyz[blocks.axes.xyz >= 0], axis=1).any(axis=1)
    same = np.ones(len(blocks), dtype=bool)
    for column in (blocks.speed, blocks.path, blocks.tolerance, blocks.chain):
        same &= np.concatenate([[False], column[1:] == column[:-1]])
    joins = line & ~turns & same & np.concatenate([[False], (line & ~turns & ~blocks.forced)[:-1]])
    if not joins.any() and (blocks.start[1:] == blocks.end[:-1]).all():
        return blocks, rows
    loop = chosen(chain_ends, len(blocks), KERNEL_FROM)
    keep = np.flatnonzero(loop(np.ascontiguousarray(blocks.xyz), joins, np.array(blocks.chain)))
    if len(keep) == len(blocks) and (blocks.start[1:] == blocks.end[:-1]).all():
        return blocks, rows
    start = np.concatenate([blocks.start[:1], blocks.end[keep[:-1]]])
    return replace(blocks.take(keep), start=start), rows[keep]


def _flat_arcs(blocks: MotionBlocks, rows: Ints) -> tuple[MotionBlocks, Ints]:
    """Arcs in XY that rise over their chord by less than the chain tolerance, as two lines through their middle."""
    if not blocks.arc.any():
        return blocks, rows
    form = shape(blocks)
    flat = blocks.arc & (blocks.path == CornerMode.BLEND) & (np.abs(blocks.normal[:, 2]) > 0.5)
    flat &= form.radius * (1.0 - np.cos(blocks.sweep / 2.0)) < blocks.chain
    if not flat.any():
        return blocks, rows
    double = np.repeat(np.arange(len(blocks)), np.where(flat, 2, 1))
    wide = blocks.take(double)
    first = np.flatnonzero(flat[double] & np.append(np.diff(double) == 0, False))
    middle = (blocks.start + blocks.end)[double[first]] / 2.0
    xyz = blocks.axes.xyz
    turned = _turned(blocks, double[first])
    middle[:, xyz[:2]] = turned[:, :2]
    start, end = wide.start.copy(), wide.end.copy()
    end[first], start[first + 1] = middle, middle
    moved = replace(blocks.pauses, block=np.where(blocks.pauses.block >= 0, np.searchsorted(
        double, blocks.pauses.block, side="right") - 1, -1))
    return replace(wide, start=start, end=end, arc=wide.arc & ~flat[double], pauses=moved), rows[double]


def _turned(blocks: MotionBlocks, at: Ints) -> Floats:
    """(K, 3) the middle of arcs."""
    center, normal, half = blocks.center[at], blocks.normal[at], blocks.sweep[at, None] / 2.0
    spoke = blocks.start[at][:, blocks.axes.xyz] - center
    return np.asarray(center + np.cos(half) * spoke + np.sin(half) * np.cross(normal, spoke))


def clamped(length: Floats, speed: Floats, cycle: float) -> Floats:
    """Speeds that leave each segment at least one servo cycle (`tcClampVelocityByLength`)."""
    return np.minimum(speed, length / cycle)


def plane_limit(binormal: Floats, axes: Axes, limit: Floats) -> Floats:
    """(K,) largest magnitude for any direction in the plane across unit `binormal` (K, 3).

    LinuxCNC `calculateInscribedDiameter`.
    """
    across = np.sqrt(np.maximum(1.0 - binormal**2, 1e-12))
    here = axes.xyz >= 0
    bounds = np.where(here, limit[axes.xyz], np.inf)
    return np.asarray((bounds / across).min(axis=1))
