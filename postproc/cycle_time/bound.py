"""No control can be faster: velocity, feed and acceleration only, every corner at full speed, rest where it is forced.

The second-order bound (`postproc.feedrate.second_order`) of a path whose blocks are straight in the axes:
between two grid points d2q is 0, so that one backward and one forward pass over the blocks give the greatest
x = v^2. Corners cost nothing, and what a control may cut off at them within its tolerance is taken off the
lengths. On arcs each axis may give all it has in every direction.

Where jerk is limited, rests cost more (`rest_ramps`). Whatever a control does in between, an axis that has to be D from
where it rested takes at least the time that it takes alone at its jerk, acceleration and speed; so does the path along
the first straight block. A stretch from rest to rest takes that up to one place, its second-order time from there to
another, whose speeds no motion exceeds, and the same backward from the next rest: the largest such sum.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from postproc.cycle_time.blocks import CornerMode, MotionBlocks
from postproc.cycle_time.linuxcnc_kernels import speeds
from postproc.cycle_time.linuxcnc_segments import KERNEL_FROM, merge
from postproc.cycle_time.lookahead import rest_to_rest, rests
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.phases import ramps
from postproc.cycle_time.shape import Shape, axis_limit, shape, shape_within
from toolpaths.arrays import Bools, Floats, Ints, repeated
from toolpaths.compiled import chosen

EXECUTED = ("control", "formulas")
"""kinds of models whose control limits jerk, rests by its own rules, and waits at each rest"""
_Law = Callable[[Floats, Floats, Floats, Floats], Floats]
"""Least times from travel, velocity, acceleration and jerk"""


def lower_bound(blocks: MotionBlocks, model: CycleTimeModel) -> float:
    """s below which no control can be on this path with these limits, dwells and tool changes included."""
    merged = merge(blocks)[0] if model.kind == "linuxcnc" else blocks
    axes, ramped = merged.axes, model.kind in EXECUTED and model.jerk
    form, (velocity, rate) = shape_within(merged, axes.velocity, axes.acceleration)
    form = shape(merged) if ramped else form
    length = form.length - cut_off(merged, form, model)
    if merged.arc.any():
        both = merged.arc & (axes.xyz >= 0).all()
        velocity, rate = (np.where(both, np.linalg.norm(limit[axes.xyz]), value)
                          for limit, value in ((axes.velocity, velocity), (axes.acceleration, rate)))
    target = np.minimum(np.where(merged.rapid, np.inf, merged.speed * max(model.override, 1.0)), velocity)
    rests = must_rest(merged, form, model)
    through = ~rests
    free = repeated(np.inf, len(merged))
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


class FromRestToRest(NamedTuple):
    """Rows of the first and last block of each stretch (S,) from rest to rest, and the stretch of each block (E,)."""

    first: Ints
    last: Ints
    of: Ints


def from_rest(travel: Floats, velocity: Floats, acceleration: Floats, jerk: Floats) -> Floats:
    """Least time to be `travel` away from a rest, however fast there; arguments of one shape, or broadcast to it.

    Jerk J alone, x = J t^3/6, then acceleration A. Beyond the whole ramp to V, which takes V/A + A/J or 2 sqrt(V/J), no
    motion is ahead of it: what V is above the speed, w, falls by -J t at first and no faster than -sqrt(2 J w) at last.
    """
    rise = acceleration / jerk
    near, speed = acceleration * rise**2 / 6.0, 0.5 * acceleration * rise
    late = np.sqrt(speed**2 + 2.0 * acceleration * np.maximum(travel - near, 0.0))
    free = np.where(travel <= near, np.cbrt(6.0 * travel / jerk), rise + (late - speed) / acceleration)
    peak = np.minimum(acceleration, np.sqrt(velocity * jerk))
    ramp = velocity / peak + peak / jerk
    return np.asarray(np.maximum(free, travel / velocity + np.where(travel >= 0.5 * velocity * ramp, 0.5 * ramp, 0.0)))


def rest_ramps(blocks: MotionBlocks, form: Shape, model: CycleTimeModel, seconds: Floats, lent: Floats, rests: Bools,
               reach: Floats) -> float:
    """s beyond the second-order `seconds` (E,) of all stretches.

    Args:
        lent (E,): largest speed anywhere in each block
        rests (E,): at whose end the axes rest; reach (E - 1,): mm that corners may take of the blocks on either side
    """
    first = np.flatnonzero(np.append(True, rests[:-1]))
    last = np.append(first[1:], len(blocks)) - 1
    some = FromRestToRest(first, last, np.repeat(np.arange(len(first)), last - first + 1))
    share, axes = form.share, blocks.axes
    fastest = np.zeros((len(first), share.shape[1]))
    np.maximum.at(fastest, some.of, share * lent[:, None])
    most = np.minimum(axes.velocity, fastest)
    line = _along(blocks, form, lent)
    run = np.cumsum(seconds)
    before = run - (run - seconds)[first][some.of]
    behind = run[last][some.of] - run + seconds
    off = _off(blocks, model, rests)
    ends = [(blocks.end - blocks.start[first][some.of], np.arange(len(blocks)) == first[some.of], before, off),
            (blocks.end[last][some.of] - blocks.start, np.arange(len(blocks)) == last[some.of], behind,
             np.concatenate([np.zeros_like(off[:1]), off[:-1]]))]
    gains = []
    for travel, next_to, spent, slack in ends:
        known = np.ones(len(blocks), dtype=bool) if model.corner_step is None and model.off is None else next_to
        away = np.where(known[:, None], np.maximum(np.abs(travel) - slack, 0.0), 0.0)
        gain = _slowest(away, most[some.of], axes.acceleration, axes.jerk) - spent
        cut = np.append(reach, 0.0) if spent is before else np.append(0.0, reach)
        alone = from_rest(np.maximum(form.length - cut, 0.0), *line) - spent
        gains.append(np.where(next_to & ~blocks.arc & (form.length > cut), np.maximum(gain, alone), gain))
    both = _together(gains[0], gains[1], some)
    net = np.abs(blocks.end[last] - blocks.start[first])
    whole = _slowest(net, most, axes.acceleration, axes.jerk, rest_to_rest) - behind[first]
    one = np.flatnonzero((first == last) & ~blocks.arc[first] & (form.length[first] > 0.0))
    at = first[one]
    whole[one] = np.maximum(whole[one], rest_to_rest(form.length[at], *(limit[at] for limit in line)) - seconds[at])
    return float(np.maximum(np.maximum(both, whole), 0.0).sum())


def _along(blocks: MotionBlocks, form: Shape, lent: Floats) -> tuple[Floats, Floats, Floats]:
    """(E,) largest speed, acceleration and jerk along each straight block."""
    speed = np.minimum(lent, axis_limit(form.share, blocks.axes.velocity))
    return speed, axis_limit(form.share, blocks.axes.acceleration), axis_limit(form.share, blocks.axes.jerk)


def _off(blocks: MotionBlocks, model: CycleTimeModel, rests: Bools) -> Floats:
    """(E, A) by how much the axes may be off the end of each block."""
    stated = np.where(np.isfinite(blocks.tolerance), blocks.tolerance, model.corner_tolerance)
    off = np.where((blocks.path == CornerMode.BLEND) & ~rests, stated, 0.0)
    return np.asarray(off[:, None] / blocks.arms)


def _slowest(travel: Floats, most: Floats, acceleration: Floats, jerk: Floats, law: _Law = from_rest) -> Floats:
    """(N,) s of the slowest axis over (N, A) travel at speeds up to `most` (N, A), by a law of one axis."""
    moves = (travel > 0.0) & (most > 0.0)
    limits = (np.broadcast_to(limit, travel.shape) for limit in (acceleration, jerk))
    found = law(np.where(moves, travel, 1.0), np.where(moves, most, 1.0), *limits)
    return np.asarray(np.where(moves, found, 0.0).max(axis=1, initial=0.0))


def _together(ahead: Floats, behind: Floats, some: FromRestToRest) -> Floats:
    """(S,) the most that a ramp from rest up to the end of block k and one to rest from the begin of block m > k on give."""
    room = 1.0 + float(np.abs(ahead).max(initial=0.0))
    begun = np.maximum.accumulate(np.maximum(ahead, 0.0) + room * some.of) - room * some.of
    earlier = np.append(0.0, begun[:-1])
    earlier[some.first] = 0.0
    best = np.zeros(len(some.first))
    np.maximum.at(best, some.of, np.maximum(earlier + np.maximum(behind, 0.0), begun))
    return best
