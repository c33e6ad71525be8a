"""Feed words: the time of each block, not faster than the axes allow, as a feed per minute or inverse time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.options import FeedModeChoice
from postproc.compile.merged_feeds import merged
from postproc.compile.program import INVERSE, PER_MINUTE
from postproc.control.control import Control
from postproc.control.word_arcs import PLANE_COLUMNS
from postproc.controllers.model import FeedRules
from postproc.path.model import ARC, TRAVERSE, JointPath
from toolpaths.arrays import Array, Bools, Floats, Ints, slices
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(feed="K", mode="int8: K", seconds="K", slowed="K")
class Feeds:
    """Feed words (K,) with their mode (K,), the time of each block (K,) s, and the blocks slowed for an axis (K,)."""

    feed: Floats
    mode: Array
    seconds: Floats
    slowed: Bools


@dataclass(frozen=True)
@arrays(needed="K")
class PlannedTimes:
    """Least seconds (K,) of each block that keep the limits of the axes, and the part by which feeds may be merged."""

    needed: Floats
    merge: float = 0.0


def plan_feeds(path: JointPath, control: Control, step: Floats, asked: Floats, passes: Ints, native: Bools,
               feed_mode: FeedModeChoice, rules: FeedRules, planned: PlannedTimes | None = None,
               unit: float = 1.0) -> Feeds:
    """Feed words for the blocks of a path.

    Args:
        step: of the program words (K, J) in each block; asked: tip feed (K,) mm/s, NaN where a time was asked for
        passes: pass (K,) of each block: a pass keeps one mode
        native (K,): blocks of canned cycles, which need a feed per minute
        feed_mode: "auto", "per-minute" or "inverse-time"
        rules: of the controller
        planned: feeds that keep acceleration and jerk, too; velocities only without it
        unit: mm/min of F1 where it counts lengths
    """
    mode = _modes(path, control, step, passes, native, feed_mode, rules)
    needed = least_seconds(path, control, asked, step)
    if planned is None:
        return feed_words(path, control, step, asked, needed, mode, rules, unit)
    feeds = feed_words(path, control, step, asked, np.fmax(needed, planned.needed), mode, rules, unit)
    open_to_it = (feeds.mode == PER_MINUTE) & (path.code != 0) & ~native & (feeds.seconds > 0.0) & (feeds.feed > 0.0)
    feed = merged(feeds.feed, open_to_it, passes, planned.merge)
    factor = np.where(open_to_it, feeds.feed / np.where(open_to_it, feed, 1.0), 1.0)
    return replace(feeds, feed=feed, seconds=feeds.seconds * factor,
                   slowed=feeds.slowed | (factor > 1.0 + 1e-9))


def least_seconds(path: JointPath, control: Control, asked: Floats, step: Floats) -> Floats:
    """(K,) s that the velocities of the axes ask of each block, by its joints and by its rounded words, step (K, J)."""
    joints = np.concatenate([control.machine.home[None, :], path.q[:-1]])
    if (drives := control.machine.by_drives) is not None:  # no arcs, and the limits of the axes follow from theirs
        return control.machine.kinematics.drive_seconds(joints, path.q, drives.cutting_limits.velocity)
    cutting, rapid = control.machine.cutting_limits.velocity, control.machine.limits.velocity
    velocity = cutting if cutting is rapid else np.where((path.code == TRAVERSE)[:, None], rapid, cutting)
    own, needed = np.array([f.control.law == "axes" for f in path.frames]), np.empty(len(path))
    for part in slices(len(path)):
        travel = np.abs(path.q[part] - joints[part])
        joint = own[path.frame[part]][:, None] | np.array(control.machine.rotary)
        most = velocity if velocity.ndim == 1 else velocity[part]
        needed[part] = (np.where(joint, np.maximum(travel, np.abs(step[part]) / control.unit), travel) / most).max(axis=1)
    arc = (path.code == ARC) & ~_control_bends(path)
    if arc.any():
        top = asked / cutting[control.xyz].min()
        needed = np.where(arc & np.isfinite(top), np.nan_to_num(path.seconds) * top, needed)
    return np.asarray(needed)


def _control_bends(path: JointPath) -> Bools:
    """(K,) blocks whose joints bend between their ends, so that their speed is not known from the tip's."""
    tip_law = np.array([f.control.tip_law for f in path.frames])
    return np.asarray(tip_law[path.frame])


def feed_words(path: JointPath, control: Control, step: Floats, asked: Floats, needed: Floats, mode: Array,
               rules: FeedRules, unit: float = 1.0) -> Feeds:
    """The words of blocks that take the time asked for, or the time (K,) s needed where that is longer, in
    the feed mode (K,) and under the law of each. Blocks without a time of their own, retracts in feed motion,
    have no feed asked for."""
    cutting, arc = path.code != 0, path.code == ARC
    wanted = np.where(cutting, np.nan_to_num(path.seconds), np.nan)
    turned = np.abs(step[:, control.rotary]).sum(axis=1)
    length, metric = np.zeros(len(path)), np.zeros(len(path))
    for law, every in path.by_control():
        for k in (every[part] for part in slices(len(every))):
            length[k], metric[k] = law.feed_units(step[k], unit), law.feed_length(step[k])
    metric = np.where(arc & np.isfinite(asked), wanted * asked, metric)
    asked = asked / unit
    length = np.where(arc & np.isfinite(asked), wanted * asked, length)
    needed = _with_largest(needed, metric, wanted, control.machine.largest_feed)
    seconds = np.fmax(wanted, needed)
    slowed = cutting & (needed > wanted * (1.0 + 1e-9)) & (wanted > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        per_minute = 60.0 * length / seconds
        inverse = 60.0 / seconds
        words_share = length / metric
        rate = np.nan_to_num(inverse * length)
        by_radius = inverse * length * unit / _radius(path) if arc.any() and rules.arc_inverse == "radius" else inverse
    own = (wanted > 0.0) | (needed <= 0.0)
    same = cutting & ~slowed & np.isfinite(asked) & (turned == 0.0) & own
    for law, k in path.by_control():
        same[k] &= law.tips_straight
        if law.tip_law:
            near = np.abs(length[k] - wanted[k] * asked[k]) <= _ROUNDING * length[k]
            same[k] |= cutting[k] & own[k] & near & (needed[k] <= (1.0 - _ROUNDING) * wanted[k]) & _moves_tip(step[k], law)
    per_minute = np.minimum(np.where(same, 60.0 * asked, per_minute),
                            60.0 * control.machine.largest_feed * np.where(metric > 0.0, words_share, 1.0))
    if rules.least_inverse_rate > 0.0:
        mode = np.where((mode == INVERSE) & (length > 0.0) & (rate < rules.least_inverse_rate),
                        PER_MINUTE, mode)
    inverse = np.where(arc, by_radius, inverse)
    feed = np.where(cutting, np.where(mode == INVERSE, inverse, per_minute), np.nan)
    return Feeds(feed, mode.astype(np.int8), np.where(cutting, seconds, np.nan), slowed)


def _with_largest(needed: Floats, length: Floats, wanted: Floats, largest: float) -> Floats:
    """(K,) s needed where no feed is above the largest cutting feed, mm/s; `length` (K,) is what it refers to in mm, in
    programs in inches too: the same motion in either units.

    What the rounding of a block's words adds to its length is no reason to slow it.
    """
    least = length / largest
    return np.asarray(np.where(least > wanted * (1.0 + _ROUNDING), np.fmax(needed, least), needed))


def _radius(path: JointPath) -> Floats:
    """(K,) radius of the arc blocks, mm, 1 for others."""
    result = np.ones(len(path))
    for plane, columns in PLANE_COLUMNS.items():
        k = np.flatnonzero((path.code == ARC) & (path.plane == plane))
        result[k] = np.hypot(*path.center[k][:, columns].T)
    return result


_ROUNDING = 0.005
"""share of a block's length that the rounding of its words may change, as far as the feed word is concerned"""


def _moves_tip(step: Floats, control: Control) -> Bools:
    """(K,) blocks whose feed per minute is that of X, Y, Z, the tip."""
    return np.asarray((step[:, control.xyz] != 0.0).any(axis=1))


def _modes(path: JointPath, control: Control, step: Floats, passes: Ints, native: Bools, feed_mode: FeedModeChoice,
           rules: FeedRules) -> Array:
    """(K,) inverse time for passes that move rotary axes while cutting, where X, Y, Z words are joints."""
    cutting = path.code != 0
    axes = ~_control_bends(path)
    if feed_mode == "per-minute" or not rules.inverse_time:
        chosen = np.zeros(len(path), dtype=bool)
    elif feed_mode == "inverse-time":
        chosen = cutting
    else:
        turned = (step[:, control.rotary] != 0.0).any(axis=1) if len(control.rotary) else np.zeros(len(path), dtype=bool)
        turning = cutting & axes & (turned | (not control.machine.kinematics.straight_slides))
        of_pass = np.zeros(int(passes.max(initial=0)) + 1, dtype=bool)
        of_pass[passes[turning]] = True
        chosen = cutting & axes & of_pass[passes]
    if rules.arc_inverse == "refuse":
        chosen = chosen & (path.code != ARC)
    return np.where(chosen & ~native, INVERSE, PER_MINUTE)
