"""Moves that the F words run slower than programmed."""

from __future__ import annotations

import re

import numpy as np

from postproc.control import Control
from postproc.job import Job
from postproc.moves import Moves, Phase
from postproc.readback.checks import CHUNK
from postproc.readback.execute import Motion
from postproc.readback.faults import Faults
from postproc.readback.poses import Executed
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic
from toolpaths.rotations import lengths
from toolpaths.toolpath import Kind

SLOW = 1.25
"""times as long as programmed, above which a move counts as slow"""
_PLANNED = re.compile(rb"(?im)^[ \t(;\d]*feed planned")
HEADER = 4000
"""characters of a program that hold its header"""


def planned_feeds(data: bytes) -> bool:
    """True where the header of a program says that its feeds were planned."""
    return bool(_PLANNED.search(data[:HEADER]))


def check_slow(motion: Motion, executed: Executed, job: Job, moves: Moves, owner: Ints, match: Ints, tip: Floats,
               seconds: Floats, faults: Faults) -> list[Diagnostic]:
    """Moves that take longer than their programmed feed and the velocities of all axes ask for, once with their count.

    `seconds` (E,) of the blocks at constant feed, `tip` (E, 3) at their ends; pecks feed some of their way again, which
    counts once. Turns on the spot take what the axes need, beside the feed of the rest. Feeds that were planned keep more
    limits, and are not judged.
    """
    cutting = (owner < len(moves)) & (motion.code > 0)
    length = moves.lengths()
    asked = np.where(moves.seconds > 0.0, moves.seconds, length / moves.feed)
    total = _by_move(owner, cutting, seconds, len(moves))
    again = np.ones(1)
    if (moves.phase == Phase.DRILL).any():
        fed = _by_move(owner, cutting, seconds * motion.feed / 60.0, len(moves))
        again = np.fmax(np.where(moves.phase == Phase.DRILL, fed / np.fmax(length, 1e-9), 1.0), 1.0)
        total = total / again
    grain = 10.0 * 10.0**-job.controller.format.linear_decimals
    slack = 0.002 + grain / np.where(moves.feed > 0.0, moves.feed, np.inf)
    check = (moves.kind != Kind.RAPID) & ~moves.link & (match >= 0) & np.isfinite(asked) & np.isfinite(total)
    # What the axes need only adds to what is allowed: it is looked at where the feed alone would not explain the time.
    check &= total > SLOW * asked + slack
    if not check.any():
        return []
    cutting &= check[np.minimum(owner, len(moves) - 1)]
    needs = _least(motion, executed, cutting)
    spot = np.where(_on_the_spot(motion, executed.control, tip, job.options.tolerance), needs, 0.0)
    turned = _by_move(owner, cutting, spot, len(moves))
    needed = _by_move(owner, cutting, needs, len(moves)) / again
    slow = np.flatnonzero(check & (total > SLOW * (turned + np.fmax(asked, needed - turned)) + slack))
    if not len(slow):
        return []
    k = slow[int((total[slow] / np.fmax(asked[slow], 1e-9)).argmax())]
    return [faults.warning("verify.slow", f"the move runs at {asked[k] / total[k]:.3f} times the programmed feed, and no "
                           "axis needs that", int(moves.line[k]), int(motion.line[match[k]]), len(slow),
                           "the F word, if it is not meant so")]


def _by_move(owner: Ints, which: Bools, values: Floats, moves: int) -> Floats:
    """(M,) sums of values (E,) of some blocks over the moves that they serve."""
    return np.asarray(np.bincount(owner[which], weights=values[which], minlength=moves + 1)[:moves])


def _on_the_spot(motion: Motion, control: Control, tip: Floats, tolerance: float) -> Bools:
    """(E,) blocks between whose ends the tip stays, within the tolerance, while rotary axes turn."""
    result = np.zeros(len(motion), dtype=bool)
    turns = (motion.end[1:, control.rotary] != motion.end[:-1, control.rotary]).any(axis=1)
    result[1:] = turns & (lengths(np.diff(tip, axis=0)) <= tolerance)
    return result


def _least(motion: Motion, executed: Executed, cutting: Bools) -> Floats:
    """(E,) s that the velocities of the axes ask of each cutting block, from joints at a few places of it."""
    control: Control = executed.control
    every, result = np.flatnonzero(cutting), np.zeros(len(motion))
    for first in range(0, len(every), CHUNK):
        rows = every[first:first + CHUNK]
        q = executed.joints(motion, rows, 0.0)
        for t in (0.25, 0.5, 0.75, 1.0):
            after = executed.joints(motion, rows, t)
            result[rows] = np.fmax(result[rows], 4.0 * (np.abs(after - q) / control.machine.limits.velocity).max(axis=1))
            q = after
    return result
