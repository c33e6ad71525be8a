"""Feeds as the CL file states them, and what counts where it states none."""

from __future__ import annotations

import numpy as np

from postproc.reference.events import spindle_speed
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error, warning
from toolpaths.toolpath import FeedMode, Kind, Role, Toolpath
from toolpaths.units import PER_MINUTE

SLOWEST = 2.0
"""mm/min: the smallest engraving cutters run above it; feeds in m/min or per revolution are numbers below"""


def feeds_of(toolpath: Toolpath, default: float | None) -> tuple[Floats, Floats, list[Diagnostic]]:
    """(mm/s, seconds of inverse-time rows, diagnostics) per row; holes take the feed of their cycle, rows for
    which the file states none `default` (mm/min)."""
    feed, mode = _stated_feeds(toolpath)
    cutting = _cutting(toolpath)
    feed[~cutting] = np.nan
    if default is not None:
        feed[_unstated(toolpath, feed, mode)] = default * PER_MINUTE
    diagnostics: list[Diagnostic] = []
    turning = cutting & (mode == FeedMode.PER_REVOLUTION)
    if turning.any():
        rev_per_s = spindle_speed(toolpath)
        feed[turning] *= rev_per_s[turning]
        bad = np.flatnonzero(turning & ~(rev_per_s > 0.0))
        if len(bad):
            diagnostics.append(error("feed.no_speed", "feed per revolution while the spindle speed is not known",
                                     file=toolpath.file, lines=toolpath.line[bad][:6].tolist(), count=len(bad),
                                     hint="state SPINDL/RPM,... before, or a feed per minute"))
    inverse = cutting & (mode == FeedMode.INVERSE_TIME)
    seconds = np.where(inverse, 1.0 / np.where(inverse & (feed > 0.0), feed, np.nan), np.nan)
    feed[inverse] = np.nan
    return feed, seconds, diagnostics


def _stated_feeds(toolpath: Toolpath) -> tuple[Floats, Array]:
    """(feed, mode) per row as in Toolpath; holes have those of their cycle."""
    feed, mode = toolpath.feed.copy(), toolpath.feed_mode.copy()
    holes = np.flatnonzero(toolpath.role == Role.HOLE)
    if len(holes):
        cycle_feed = np.array([c.feed for c in toolpath.cycles])
        cycle_mode = np.array([int(c.feed_mode) for c in toolpath.cycles])
        feed[holes] = cycle_feed[toolpath.cycle[holes]]
        mode[holes] = cycle_mode[toolpath.cycle[holes]]
    return feed, mode


def _cutting(toolpath: Toolpath) -> Bools:
    return np.asarray((toolpath.kind != Kind.RAPID) | (toolpath.role == Role.HOLE))


def _unstated(toolpath: Toolpath, feed: Floats, mode: Array) -> Bools:
    """(N,) rows that cut while no feed is stated; taps are none of them: theirs follows from their thread."""
    tap = np.array([c.kind == "TAP" for c in toolpath.cycles] + [False])
    holes = toolpath.role == Role.HOLE
    unstated = _cutting(toolpath) & np.isnan(feed) & (mode == FeedMode.PER_TIME) & (toolpath.role != Role.START)
    return np.asarray(unstated & ~(holes & tap[np.where(holes, toolpath.cycle, -1)]))


def follows_speed(toolpath: Toolpath) -> Bools:
    """(N,) rows with a feed per revolution: what they lack is a spindle speed, never a feed."""
    feed, mode = _stated_feeds(toolpath)
    return np.asarray((mode == FeedMode.PER_REVOLUTION) & (feed > 0.0))


def without_feed(toolpath: Toolpath) -> Bools:
    """(N,) rows that cut while the file has stated no feed: they run at the set-up's `[output] feed`."""
    return _unstated(toolpath, *_stated_feeds(toolpath))


def slow_feeds(toolpath: Toolpath, row: Ints, kind: Array) -> list[Diagnostic]:
    """A warning of feeds per minute below `SLOWEST`, which another unit would explain; taps are left out, as theirs follows
    from their thread. `row` (M,), `kind` (M,): of the moves."""
    feed, mode = _stated_feeds(toolpath)
    taps = np.array([c.kind == "TAP" for c in toolpath.cycles] + [False])[
        np.where(toolpath.role == Role.HOLE, toolpath.cycle, -1)]
    slow = (mode == FeedMode.PER_TIME) & (feed > 0.0) & (feed < SLOWEST * PER_MINUTE) & ~taps
    bad = np.flatnonzero(slow[row] & (kind != Kind.RAPID)) if slow.any() else row[:0]
    if not len(bad):
        return []
    least = float(feed[row[bad]].min()) / PER_MINUTE
    return [warning("feed.slow", f"cuts at {least:g} mm/min: m/min may be meant, which is {1000.0 * least:g} mm/min, or a "
                    "feed per revolution", file=toolpath.file, lines=np.unique(toolpath.line[row[bad]])[:6].tolist(),
                    count=len(bad),
                    hint=f"write FEDRAT/{1000.0 * least:g},MMPM, or FEDRAT/{least:g},MMPR per revolution; where it is meant "
                    "so, nothing is to be done")]
