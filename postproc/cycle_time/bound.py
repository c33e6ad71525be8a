"""No control can be faster: velocity, feed and acceleration only, every corner at full speed, rest where it is forced.

The second-order bound (`postproc.feedrate.second_order`) of a path whose blocks are straight in the axes:
between two grid points d2q is 0, so that one backward and one forward pass over the blocks give the greatest
x = v^2. Corners cost nothing, and what a control may cut off at them within its tolerance is taken off the
lengths. On arcs each axis may give all it has in every direction.
"""

from __future__ import annotations

import numpy as np

from postproc.cycle_time.blocks import CornerMode, MotionBlocks
from postproc.cycle_time.linuxcnc_kernels import speeds
from postproc.cycle_time.linuxcnc_segments import KERNEL_FROM, merge
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.phases import ramps
from postproc.cycle_time.rest_ramps import rest_ramps
from postproc.cycle_time.shape import Shape, axis_limit, shape
from toolpaths.arrays import Bools, Floats
from toolpaths.compiled import chosen

EXECUTED = ("control", "formulas")
"""kinds of models whose control limits jerk, rests by its own rules, and waits at each rest"""


def lower_bound(blocks: MotionBlocks, model: CycleTimeModel) -> float:
    """s below which no control can be on this path with these limits, dwells and tool changes included."""
    merged = merge(blocks)[0] if model.kind == "linuxcnc" else blocks
    form, axes = shape(merged), merged.axes
    length = form.length - cut_off(merged, form, model)
    velocity, rate = (axis_limit(form.share, limit) for limit in (axes.velocity, axes.acceleration))
    if merged.arc.any():
        both = merged.arc & (axes.xyz >= 0).all()
        velocity, rate = (np.where(both, np.linalg.norm(limit[axes.xyz]), value)
                          for limit, value in ((axes.velocity, velocity), (axes.acceleration, rate)))
    target = np.minimum(np.where(merged.rapid, np.inf, merged.speed * max(model.override, 1.0)), velocity)
    rests = must_rest(merged, form, model)
    through = ~rests
    free = np.full(len(merged), np.inf)
    loop = chosen(speeds, len(merged), KERNEL_FROM)
    lent = shared_feed(merged, form, target, model)
    first, last = loop(length, lent, lent, rate, through, free, free)
    seconds = np.maximum(ramps(length, first, last, lent, rate).seconds,
                         at_feed(merged, form, length, target, lent, model))
    seconds = np.maximum(seconds - early(merged, form, model), 0.0)
    return float(seconds.sum() + _at_rests(merged, form, model, seconds, lent, rests) + blocks.pauses.seconds.sum())


def must_rest(blocks: MotionBlocks, form: Shape, model: CycleTimeModel) -> Bools:
    """(E,) at whose end the axes rest: by command, and by the rules of the control that is modelled."""
    if model.kind in EXECUTED and len(blocks):
        from postproc.cycle_time.control import rests  # SciPy, which other models do without

        return rests(blocks, form)
    return blocks.forced


def _at_rests(blocks: MotionBlocks, form: Shape, model: CycleTimeModel, seconds: Floats, lent: Floats,
              rests: Bools) -> float:
    """s that rests take beyond the second order: ramps of limited jerk, and what the control waits at each."""
    if model.kind not in EXECUTED or not len(blocks):
        return 0.0
    wait = float(rests.sum()) * (model.stop_time + model.smoothing)
    reach, cosine = reaches(blocks, form, model)
    taken = np.where(cosine < 1.0 - 1e-12, reach, 0.0)
    return wait + (rest_ramps(blocks, form, model, seconds, lent, rests, taken) if model.jerk else 0.0)


def shared_feed(blocks: MotionBlocks, form: Shape, target: Floats, model: CycleTimeModel) -> Floats:
    """(E,) largest speed anywhere in each block: LinuxCNC runs through a blend arc at the faster of both
    feeds (blendmath.c, `blendParamKinematics`)."""
    if model.kind != "linuxcnc" or not len(blocks):
        return target
    arc = (blocks.path[:-1] == CornerMode.BLEND) & ~blocks.forced[:-1] & (blocks.rapid[1:] == blocks.rapid[:-1])
    arc &= ~form.turns[:-1] & ~form.turns[1:]
    both = np.where(arc, np.maximum(target[:-1], target[1:]), 0.0)
    return np.asarray(np.maximum(target, np.maximum(np.append(both, 0.0), np.concatenate([[0.0], both]))))


def at_feed(blocks: MotionBlocks, form: Shape, length: Floats, target: Floats, lent: Floats,
            model: CycleTimeModel) -> Floats:
    """(E,) s of each block at its own feed, but of what blends may take at its ends; none where it goes on straight."""
    reach, cosine = reaches(blocks, form, model)
    reach = np.where(cosine < 1.0 - 1e-12, reach, 0.0)
    taken = np.minimum(np.append(reach, 0.0) + np.concatenate([[0.0], reach]), length)
    return np.asarray((length - taken) / target + taken / lent)


def early(blocks: MotionBlocks, form: Shape, model: CycleTimeModel) -> Floats:
    """(E,) s by which the next block may begin before the feeds allow it: LinuxCNC's overlapping ramps begin
    with a servo cycle, so that up to one is gained at each (`linuxcnc._overlapping`)."""
    result = np.zeros(len(blocks))
    if model.kind == "linuxcnc":
        overlaps = (blocks.path[:-1] == CornerMode.BLEND) & ~blocks.forced[:-1] & (form.turns[:-1] | form.turns[1:])
        result[:-1] = np.where(overlaps, model.servo_cycle, 0.0)
    return result


def cut_off(blocks: MotionBlocks, form: Shape, model: CycleTimeModel) -> Floats:
    """(E,) mm by which blends can make each block shorter.

    The chord that takes d off both sides of a corner of turning angle phi lies d sin(phi/2) from it and is 2
    d (1 - cos(phi/2)) shorter; d is at most half a block. Where the limit is a tolerance e, d <=
    e/sin(phi/2). The ideal motion is planned within the model's tolerance, whatever the program leaves to the control.
    """
    reach, cosine = reaches(blocks, form, model)
    spared = reach * (1.0 - cosine)
    return np.asarray(np.append(spared, 0.0) + np.concatenate([[0.0], spared]))


def reaches(blocks: MotionBlocks, form: Shape, model: CycleTimeModel) -> tuple[Floats, Floats]:
    """(E - 1,) mm that a blend may take of either side of each corner, and cos(phi/2) of the corner."""
    dot = np.clip((form.last[:-1] * form.first[1:]).sum(axis=1), -1.0, 1.0)
    sine, cosine = np.sqrt((1.0 - dot) / 2.0), np.sqrt((1.0 + dot) / 2.0)
    stated = blocks.tolerance[:-1]
    unlimited = model.kind == "linuxcnc"
    tolerance = np.where(np.isnan(stated) | (np.isinf(stated) & (not unlimited)),
                         model.corner_tolerance, stated)
    if model.kind == "ideal":
        tolerance = np.maximum(tolerance, model.corner_tolerance)
    with np.errstate(divide="ignore"):
        reach = np.minimum(np.minimum(form.length[:-1], form.length[1:]) / 2.0, tolerance / sine)
    return np.where((blocks.path[:-1] == CornerMode.BLEND) & ~blocks.forced[:-1], reach, 0.0), cosine
