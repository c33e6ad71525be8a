"""A control with look-ahead: blocks at their feed, corners as fast as the tolerance allows, stops where it must.

Corners: a parabola over d of path on both sides of the corner lies |du| d/4 off it in X, Y, Z and takes each axis j the
acceleration |du_j| v^2/(2 d), du the change of the derivatives by path length; so v^2 = 8 e A_j/(|du| |du_j|)
for a tolerance e, d at most half of the shorter block. (Own derivation; the arc instead of the parabola gives
the "junction deviation" of grbl.) Jerk: a change of speed by dv takes dv/a + a/j, or 2 sqrt(dv/j) where the
acceleration is not reached; rest to rest see `rest_to_rest`.
"""

from __future__ import annotations

import numpy as np

from postproc.clock.settings import BACKWARD
from postproc.cycle_time.bends import bend_speed
from postproc.cycle_time.blocks import CornerMode, MotionBlocks
from postproc.cycle_time.linuxcnc_kernels import speeds
from postproc.cycle_time.linuxcnc_segments import KERNEL_FROM, NORMAL_SHARE
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.phases import BlockTimes, Ramps, ramps, summed
from postproc.cycle_time.shape import Shape, axis_limit, shape
from toolpaths.arrays import Bools, Floats
from toolpaths.compiled import chosen
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

TANGENT = 1e-3
"""|du| up to which an exact path goes on without a stop"""


@dataclass(frozen=True)
@arrays(first="E A", last="E A")
class PathDerivatives:
    """(E, A) derivatives of the axes by path length at begin and end of each block."""

    first: Floats
    last: Floats


def directions(blocks: MotionBlocks, form: Shape) -> PathDerivatives:
    """Signed derivatives at both ends; arcs by their tangents."""
    step = (blocks.end - blocks.start) / np.where(form.length > 0.0, form.length, 1.0)[:, None]
    first, last = step, step
    if blocks.arc.any():
        first, last = step.copy(), step.copy()
        columns = blocks.axes.xyz
        for travel, tangent in ((first, form.first), (last, form.last)):
            travel[np.ix_(blocks.arc, columns)] = tangent[blocks.arc]
    return PathDerivatives(first, last)


def lookahead(blocks: MotionBlocks, model: CycleTimeModel) -> BlockTimes:
    """How long a control with look-ahead takes over each block."""
    form = shape(blocks)
    target, rate, jerk = limits(blocks, form, model)
    corner = corner_speed(blocks, form, model)
    through = np.append(corner > 0.0, False)
    kink = np.append(np.where(corner > 0.0, corner, np.inf), np.inf)
    ahead = window(form.length, rate, model.lookahead)
    loop = chosen(speeds, len(blocks), KERNEL_FROM)
    first, last = loop(form.length, target, target, rate, through, kink, ahead)
    r = ramps(form.length, first, last, target, rate)
    extra = jerk_time(form.length, first, last, r, rate, jerk, target) if model.jerk else np.zeros(len(blocks))
    settle = model.smoothing if model.kind == "formulas" else 0.0
    return on_the_clock(blocks, r, extra, first, last, rate, ~through, model.stop_time + settle)


def limits(blocks: MotionBlocks, form: Shape, model: CycleTimeModel) -> tuple[Floats, Floats, Floats]:
    """(E,) largest speed, acceleration and jerk along each block."""
    axes = blocks.axes
    velocity, rate, jerk = (axis_limit(form.share, limit) for limit in (axes.velocity, axes.acceleration, axes.jerk))
    target = np.minimum(np.where(blocks.rapid, velocity * model.rapid, blocks.speed * model.override), velocity)
    if blocks.arc.any():
        radius = np.where(blocks.arc, form.radius, np.inf)
        target = np.minimum(target, np.where(blocks.arc, np.sqrt(NORMAL_SHARE * rate * radius), np.inf))
        rate = np.where(blocks.arc, np.sqrt(np.maximum(rate**2 - (target**2 / radius) ** 2, (0.5 * rate) ** 2)), rate)
    if model.block_time > 0.0:
        whole = form.length if blocks.pieces is None else form.length * blocks.pieces
        target = np.minimum(target, whole / model.block_time)
    return target, rate, jerk


def corner_speed(blocks: MotionBlocks, form: Shape, model: CycleTimeModel) -> Floats:
    """(E-1,) speed at which each corner is passed; 0 where the control stops."""
    travels = directions(blocks, form)
    change = np.abs(travels.first[1:] - travels.last[:-1])
    stated = blocks.tolerance[:-1]
    tolerance = np.where(np.isfinite(stated), stated * model.stated_share, model.corner_tolerance)
    if model.kind == "formulas" and model.jerk:
        bent = np.where(blocks.path[:-1] == CornerMode.BLEND, tolerance, 0.0)
        return np.where(_stops(blocks, change), 0.0, bend_speed(blocks, form, model, travels.first, travels.last, bent))
    bend = np.linalg.norm(np.where(blocks.axes.xyz >= 0, change[:, blocks.axes.xyz], 0.0), axis=1)
    half = np.minimum(form.length[:-1], form.length[1:]) / 2.0
    with np.errstate(divide="ignore"):
        reach = np.minimum(4.0 * tolerance / bend, half)
        speed = np.sqrt(2.0 * reach * (blocks.axes.acceleration / change).min(axis=1))
    return np.where(_stops(blocks, change), 0.0, speed)


def _stops(blocks: MotionBlocks, change: Floats) -> Bools:
    """(E-1,) where the axes rest behind a block."""
    exact = (blocks.path[:-1] == CornerMode.EXACT) & (change.max(axis=1, initial=0.0) > TANGENT)
    return np.asarray(blocks.forced[:-1] | (blocks.path[:-1] == CornerMode.STOP) | exact
                      | (blocks.rapid[1:] != blocks.rapid[:-1]))


def rests(blocks: MotionBlocks, form: Shape) -> Bools:
    """(E,) where the axes of an executed control rest at the end: by command, exact stop, corner of an exact path, between
    rapid and feed, where it turns back."""
    d = directions(blocks, form)
    change = np.abs(d.first[1:] - d.last[:-1]).max(axis=1, initial=0.0)
    exact = (blocks.path[:-1] == CornerMode.EXACT) & (change > TANGENT)
    forward = (form.last[:-1] * form.first[1:]).sum(axis=1)
    exact |= forward < BACKWARD
    stop = blocks.forced[:-1] | (blocks.path[:-1] == CornerMode.STOP) | exact | (blocks.rapid[1:] != blocks.rapid[:-1])
    return np.append(stop, True)


def window(length: Floats, rate: Floats, count: int) -> Floats:
    """(E,) speed at the end of each block from which the next `count` blocks can stop."""
    gained = np.concatenate([[0.0], np.cumsum(2.0 * rate * length)])
    k = np.arange(1, len(length) + 1)
    return np.asarray(np.sqrt(gained[np.minimum(k + count, len(length))] - gained[k]))


def rest_to_rest(length: Floats, target: Floats, rate: Floats, jerk: Floats) -> Floats:
    """(E,) least time from rest to rest under speed, acceleration and jerk: seven phases, fewer where limits
    are not reached (L. Biagiotti, C. Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008,
    section 3.4)."""
    rise = rate**2 / jerk
    travel = np.where(target >= rise, target * (target / rate + rate / jerk),
                      2.0 * target * np.sqrt(target / jerk))
    reached = np.where(target >= rise, target / rate + rate / jerk, 2.0 * np.sqrt(target / jerk)) + length / target
    peak = 0.5 * (np.sqrt(rise**2 + 4.0 * rate * length) - rise)
    short = np.where(length >= 2.0 * rate * rise / jerk, 2.0 * (peak / rate + rate / jerk),
                     4.0 * np.cbrt(length / (2.0 * jerk)))
    return np.asarray(np.where(length >= travel, reached, short))


def jerk_time(length: Floats, first: Floats, last: Floats, r: Ramps, rate: Floats, jerk: Floats,
              target: Floats) -> Floats:
    """(E,) s that limited jerk adds to the ramps: exact from rest to rest, else for each run of rising or falling speed.

    A run from v0 to v1 takes a/j, or 2 sqrt(dv/j) - dv/a, longer at its mean speed, which spares a share of the time at
    the higher one: (v1 - v0)/(2 v1) of it is lost.
    """
    alone = (first == 0.0) & (last == 0.0)
    result = np.where(alone, np.maximum(rest_to_rest(length, target, rate, jerk) - r.seconds, 0.0), 0.0)
    for begin, end, seconds in ((first, r.peak, r.up), (r.peak, last, r.down)):
        result += np.where(alone, 0.0, _run_share(begin, end, seconds, rate, jerk, alone))
    return result


def _run_share(begin: Floats, end: Floats, seconds: Floats, rate: Floats, jerk: Floats,
               alone: Bools) -> Floats:
    """(E,) each block's share of what its run of rising (or falling) speed loses to jerk."""
    rising = bool((end >= begin).all())
    active = seconds > 0.0
    joined = active[1:] & active[:-1] & (np.abs(begin[1:] - end[:-1]) <= 1e-9 * np.maximum(begin[1:], 1.0))
    run = np.concatenate([[0], np.cumsum(~(joined & ~alone[1:] & ~alone[:-1]))])
    count = int(run[-1]) + 1 if len(run) else 0
    total = summed(seconds, run, count)
    change = summed(np.abs(end - begin), run, count)
    top = np.zeros(count)
    np.maximum.at(top, run, np.maximum(begin, end) if rising else begin)
    slow = summed(seconds / jerk, run, count) / np.maximum(total, 1e-300)
    mean = change / np.maximum(total, 1e-300)
    extra = np.where(change * slow >= (mean * slow) ** 2, mean * slow, 2.0 * np.sqrt(change * slow) - total)
    lost = np.maximum(extra, 0.0) * change / np.maximum(2.0 * top, 1e-300)
    return np.asarray(lost[run] * seconds / np.maximum(total[run], 1e-300))


def on_the_clock(blocks: MotionBlocks, r: Ramps, extra: Floats, first: Floats, last: Floats, rate: Floats, stops: Bools,
                 stop_time: float) -> BlockTimes:
    """Blocks one after the other, with their rests."""
    p = blocks.pauses
    inside = p.block >= 0
    rest = summed(p.seconds[inside], p.block[inside], len(blocks)) + np.where(stops, stop_time, 0.0)
    seconds = r.seconds + extra
    begin = np.concatenate([[0.0], np.cumsum(seconds + rest)[:-1]])
    loss = [(r.peak - v) ** 2 / (2.0 * rate * np.maximum(r.peak, 1e-300)) for v in (first, last)]
    before = np.concatenate([[True], stops[:-1]])
    lost_stop = np.where(before, loss[0], 0.0) + np.where(stops, loss[1] + stop_time, 0.0)
    lost_corner = np.where(before, 0.0, loss[0]) + np.where(stops, 0.0, loss[1])
    end = begin + seconds + np.where(stops, stop_time, 0.0)
    return BlockTimes(begin, end, r.up + r.down, r.steady, extra, r.peak, lost_stop, lost_corner,
                      p.seconds.copy())
