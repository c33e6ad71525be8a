"""The largest cutting feed of the machine: feeds of the CL file above it are limited to it, with a warning."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.reference.moves import Moves
from toolpaths.arrays import Floats
from toolpaths.diagnostics import Diagnostic, error, warning
from toolpaths.toolpath import Kind, Toolpath
from toolpaths.units import PER_MINUTE

ROUNDING = 1e-9
"""share of a feed that reckoning may change"""


def limited_feeds(moves: Moves, toolpath: Toolpath, largest: float) -> tuple[Moves, list[Diagnostic]]:
    """The moves with no feed above the largest one, mm/s, and no time that asks for more; taps, whose feed is that of their
    thread, are refused above it.

    Controls clamp greater feeds without a word (Fanuc parameters 1422, 1430) or refuse them: so the program states
    what is run, and is compared with that.
    """
    if not np.isfinite(largest):
        return moves, []
    asked = _asked(moves)
    above = (moves.kind != Kind.RAPID) & (asked > largest * (1.0 + ROUNDING))
    if not above.any():
        return moves, []
    taps = np.array([c.kind == "TAP" for c in toolpath.cycles] + [False])[moves.cycle]
    tapped, rows = np.flatnonzero(above & taps), np.flatnonzero(above & ~taps)
    found = []
    if len(tapped):
        found.append(error("feed.tap", f"a tap runs at {asked[tapped].max() / PER_MINUTE:g} mm/min, the largest cutting "
                           f"feed is {largest / PER_MINUTE:g} mm/min ([control] largest_feed)", file=toolpath.file,
                           lines=np.unique(moves.line[tapped])[:6].tolist(), count=len(tapped),
                           hint="state a lower spindle speed (SPINDL) for the tap"))
    if len(rows):
        found.append(warning("feed.largest", f"feeds up to {asked[rows].max() / PER_MINUTE:g} mm/min are limited "
                             f"to {largest / PER_MINUTE:g} mm/min, the largest cutting feed ([control] "
                             "largest_feed)", file=toolpath.file, lines=np.unique(moves.line[rows])[:6].tolist(),
                             count=len(rows),
                             hint="nothing is to be done: programs state the limited feed and are compared with it"))
    feed, seconds = moves.feed.copy(), moves.seconds.copy()
    feed[rows] = np.where(np.isfinite(feed[rows]), np.minimum(feed[rows], largest), feed[rows])
    seconds[rows] = np.where(seconds[rows] > 0.0, moves.lengths()[rows] / largest, seconds[rows])
    return replace(moves, feed=feed, seconds=seconds), found


def _asked(moves: Moves) -> Floats:
    """(M,) mm/s that the CL file asks for, by inverse time too; NaN where it asks for nothing."""
    if not (moves.seconds > 0.0).any():
        return moves.feed
    with np.errstate(invalid="ignore"):
        return np.asarray(np.where(moves.seconds > 0.0, moves.lengths() / moves.seconds, moves.feed))
