"""What rests cost at the least under limited jerk: how much longer than by the second order each stretch between two is.

Whatever a control does on the way, an axis that has to be D from where it rested takes at least the time that it takes alone
at its jerk, acceleration and speed; so does the path along the first straight block. A stretch from rest to rest takes
that up to one place, its second-order time from there to another, whose speeds no motion exceeds, and the same backward
from the next rest: the largest such sum.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.cycle_time.blocks import CornerMode, MotionBlocks
from postproc.cycle_time.lookahead import rest_to_rest
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.shape import Shape, axis_limit
from toolpaths.arrays import Bools, Floats, Ints


class Stretches(NamedTuple):
    """Rows of the first and last block of each stretch (S,) from rest to rest, and the stretch of each block (E,)."""

    first: Ints
    last: Ints
    of: Ints


def from_rest(travel: Floats, velocity: Floats, acceleration: Floats, jerk: Floats) -> Floats:
    """Least time to be `travel` away from a rest, however fast there; arguments of one shape, or broadcast to it.

    Jerk J alone, x = J t^3/6, then acceleration A. Beyond the whole ramp to V, which takes V/A + A/J or 2 sqrt(V/J), no motion
    is ahead of it: what V is above the speed falls by -J t at first and no faster than -sqrt(2 J w) at last.
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
    some = Stretches(first, last, np.repeat(np.arange(len(first)), last - first + 1))
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
             np.concatenate([off[:1] * 0.0, off[:-1]]))]
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


def _slowest(travel: Floats, most: Floats, acceleration: Floats, jerk: Floats, law: object = from_rest) -> Floats:
    """(N,) s of the slowest axis over (N, A) travel at speeds up to `most` (N, A)."""
    moves = (travel > 0.0) & (most > 0.0)
    shaped = (np.where(moves, travel, 1.0), np.where(moves, most, 1.0), np.broadcast_to(acceleration, travel.shape),
              np.broadcast_to(jerk, travel.shape))
    found = from_rest(*shaped) if law is from_rest else rest_to_rest(*shaped)
    return np.asarray(np.where(moves, found, 0.0).max(axis=1, initial=0.0))


def _together(ahead: Floats, behind: Floats, some: Stretches) -> Floats:
    """(S,) the most that a ramp from rest up to the end of block k and one to rest from the begin of block m > k on give."""
    room = 1.0 + float(np.abs(ahead).max(initial=0.0))
    begun = np.maximum.accumulate(np.maximum(ahead, 0.0) + room * some.of) - room * some.of
    earlier = np.append(0.0, begun[:-1])
    earlier[some.first] = 0.0
    best = np.zeros(len(some.first))
    np.maximum.at(best, some.of, np.maximum(earlier + np.maximum(behind, 0.0), begun))
    return best
