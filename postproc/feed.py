"""Feed words: the time of each block, not faster than the axes allow, as a feed per minute or inverse time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.control import Control
from postproc.path import ARC, Path
from postproc.program import INVERSE, PER_MINUTE
from toolpaths.arrays import Array, Bools, Floats, Ints


@dataclass(frozen=True)
class Feeds:
    """Feed words (K,) with their mode (K,), the time of each block (K,) s, and the blocks slowed for an axis (K,)."""

    feed: Floats
    mode: Array
    seconds: Floats
    slowed: Bools


def plan_feeds(path: Path, control: Control, words: Floats, asked: Floats, passes: Ints, native: Bools,
               feed_mode: str, least_rate: float) -> Feeds:
    """Feed words for the blocks of a path.

    Args:
        words: program words (K, J); asked: tip feed (K,) mm/s, NaN where a time was asked for
        passes: pass (K,) of each block: a pass keeps one mode
        native (K,): blocks of canned cycles, which need a feed per minute
        feed_mode: "auto", "per-minute" or "inverse-time"
        least_rate: where inverse time would come to less than this (mm/min or degrees/min) the control runs faster
            than asked, so that such blocks are written per minute (0: no such rule)
    """
    joints = np.concatenate([control.machine.home[None, :], path.q[:-1]])
    velocity = control.machine.limits.velocity
    needed = (np.abs(path.q - joints) / velocity).max(axis=1)
    cutting = path.code != 0
    wanted = np.where(cutting, np.nan_to_num(path.seconds), np.nan)
    arc = path.code == ARC
    if arc.any() and not control.tip_law:
        top = asked / velocity[control.xyz].min()
        needed = np.where(arc & np.isfinite(top), wanted * top, needed)
    seconds = np.fmax(wanted, needed)
    slowed = cutting & (needed > wanted * (1.0 + 1e-9)) & (wanted > 0.0)
    before = np.concatenate([words[:1], words[:-1]])
    turned = np.abs(words - before)[:, control.rotary].sum(axis=1)
    length = np.where(arc & np.isfinite(asked), wanted * asked, control.feed_length(words - before))
    with np.errstate(divide="ignore", invalid="ignore"):
        per_minute = 60.0 * length / seconds
        inverse = 60.0 / seconds
        rate = np.nan_to_num(inverse * length)
    words_are_tip = control.tip_law or control.machine.kinematics.slides_affine
    same = cutting & ~slowed & np.isfinite(asked) & (turned == 0.0) & words_are_tip
    if control.tip_law:
        near = np.abs(length - wanted * asked) <= _ROUNDING * length
        same |= cutting & near & (needed <= (1.0 - _ROUNDING) * wanted) & _moves_tip(words - before, control)
    per_minute = np.where(same, 60.0 * asked, per_minute)
    mode = np.where(native, PER_MINUTE, _modes(path, control, turned, cutting, passes, feed_mode))
    if least_rate > 0.0:
        mode = np.where((mode == INVERSE) & (length > 0.0) & (rate < least_rate), PER_MINUTE, mode)
    feed = np.where(cutting, np.where(mode == INVERSE, inverse, per_minute), np.nan)
    return Feeds(feed, mode.astype(np.int8), np.where(cutting, seconds, np.nan), slowed)


_ROUNDING = 0.005
"""share of a block's length that the rounding of its words may change, as far as the feed word is concerned"""


def _moves_tip(step: Floats, control: Control) -> Bools:
    """(K,) blocks whose feed per minute is that of X, Y, Z, the tip."""
    return np.asarray((step[:, control.xyz] != 0.0).any(axis=1))


def _modes(path: Path, control: Control, turned: Floats, cutting: Bools, passes: Ints, feed_mode: str) -> Array:
    """Inverse time for passes that move rotary axes while cutting, where X, Y, Z words are joints."""
    n = len(path)
    if feed_mode == "per-minute" or (feed_mode == "auto" and control.tip_law):
        return np.full(n, PER_MINUTE)
    if feed_mode == "inverse-time":
        return np.where(cutting, INVERSE, PER_MINUTE)
    joints_only = not control.machine.kinematics.slides_affine
    turning = cutting & ((turned > 0.0) | joints_only)
    chosen = np.zeros(int(passes.max(initial=0)) + 1, dtype=bool)
    chosen[passes[turning]] = True
    return np.where(cutting & chosen[passes], INVERSE, PER_MINUTE)
