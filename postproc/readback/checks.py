"""What a program must keep besides its path: kind of motion, feed, tool, spindle, coolant, room at linking moves."""

from __future__ import annotations

import numpy as np

from postproc.control import Control
from postproc.events import coolant_states, spindle_states
from postproc.links import SafeSpace
from postproc.moves import Moves, Phase
from postproc.readback.execute import Motion
from postproc.readback.poses import SAMPLES, Executed, arc_sweeps
from postproc.word_arcs import PLANE_COLUMNS
from toolpaths.arrays import Array, Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.shape import Curves
from toolpaths.toolpath import Kind, Toolpath

ALLOWED_SPEED = 1.02
"""share of the programmed feed above which a move counts as too fast (short blocks carry rounding)"""


def check_kinds(motion: Motion, moves: Moves, owner: Ints, file: str) -> list[Diagnostic]:
    """Rapids where the CL file cuts, cuts where it moves rapidly; pecks may return rapidly above what is drilled."""
    rows = np.flatnonzero(owner < len(moves))
    m = owner[rows]
    cutting = (moves.kind[m] != Kind.RAPID) & ~moves.link[m]
    rapid = motion.code[rows] == 0
    wrong = (cutting & rapid & ~_above_drilled(motion, moves, rows, m)) | (~cutting & ~rapid & ~moves.link[m])
    diagnostics = []
    if wrong.any():
        first = rows[wrong][0]
        kind = "rapid motion where the CL file cuts" if cutting[wrong][0] else "feed motion where the CL file is rapid"
        diagnostics.append(error("verify.kind", f"{kind} (block line {int(motion.line[first])})", file=file,
                                 lines=np.unique(moves.line[m[wrong]])[:6].tolist(), count=int(wrong.sum())))
    bad = rows[motion.missing_feed[rows]]
    if len(bad):
        diagnostics.append(error("verify.feed_missing", f"no feed in force in block line {int(motion.line[bad[0]])}",
                                 file=file, lines=[int(moves.line[owner[bad[0]]])], count=len(bad)))
    return diagnostics


def _above_drilled(motion: Motion, moves: Moves, rows: Ints, m: Ints) -> Bools:
    """True for rapids of a peck: the hole has been drilled deeper before in the same move."""
    drill = moves.phase[m] == Phase.DRILL
    result = np.zeros(len(rows), dtype=bool)
    for k in np.flatnonzero(drill & (motion.code[rows] == 0)):
        same = (m[:k] == m[k]) & (motion.code[rows[:k]] > 0)
        result[k] = bool(same.any())
    return result


def check_states(motion: Motion, toolpath: Toolpath, moves: Moves, owner: Ints, file: str) -> list[Diagnostic]:
    """Tool, spindle and coolant while cutting, against the records of the CL file."""
    rows = np.flatnonzero((owner < len(moves)) & (motion.code > 0))
    rows = rows[moves.kind[owner[rows]] != Kind.RAPID]
    m = owner[rows]
    row = moves.row[m]
    numbers = np.array([*(t.number for t in toolpath.tools), -1])
    direction, rpm = spindle_states(toolpath)
    same_speed = (np.abs(motion.rpm[rows] - rpm[row]) <= 0.5) | np.isnan(rpm[row]) | (direction[row] == 0)
    coolant = coolant_states(toolpath)[row] == (motion.flood[rows] | motion.mist[rows])
    result: list[Diagnostic] = []
    for what, good, found, wanted in (
            ("tool", motion.tool[rows] == numbers[moves.tool[m]], motion.tool[rows], numbers[moves.tool[m]]),
            ("spindle direction", motion.spindle[rows] == direction[row], motion.spindle[rows], direction[row]),
            ("spindle speed", same_speed, motion.rpm[rows], rpm[row]),
            ("coolant", coolant, (motion.flood | motion.mist)[rows].astype(int), coolant_states(toolpath)[row].astype(int))):
        result += _state(what, good, found, wanted, motion.line[rows], moves.line[m], file)
    return result


def _state(what: str, good: Bools, found: Array, wanted: Array, block: Ints, line: Ints, file: str) -> list[Diagnostic]:
    bad = np.flatnonzero(~good)
    if not len(bad):
        return []
    k = int(bad[0])
    return [error("verify.state", f"{what} is {found[k]:g} in block line {int(block[k])}, the CL file has {wanted[k]:g}",
                  file=file, lines=[int(line[k])], count=len(bad))]


def check_speeds(motion: Motion, control: Control, moves: Moves, curves: Curves, owner: Ints, match: Ints,
            file: str) -> list[Diagnostic]:
    """Moves that the F words run faster than programmed, over the whole move."""
    seconds = block_seconds(motion, control)
    cutting = (owner < len(moves)) & (motion.code > 0)
    total = np.bincount(owner[cutting], weights=seconds[cutting], minlength=len(moves) + 1)[:len(moves)]
    length = curves.length()
    asked = np.where(moves.seconds > 0.0, moves.seconds, length / moves.feed)
    slack = 0.002 / np.where(moves.feed > 0.0, moves.feed, np.inf)
    check = (moves.kind != Kind.RAPID) & ~moves.link & (match >= 0) & (total > 0.0)
    fast = np.flatnonzero(check & (total * ALLOWED_SPEED + slack < asked))
    if not len(fast):
        return []
    k = fast[int((asked[fast] / total[fast]).argmax())]
    return [error("verify.feed", f"block line {int(motion.line[match[k]])} runs at {asked[k] / total[k]:.3f} times the "
                  "programmed feed", file=file, lines=[int(moves.line[k])], count=len(fast))]


def block_seconds(motion: Motion, control: Control) -> Floats:
    """(E,) time of each cutting block at constant feed, s.

    Per minute the length is `Control.feed_length`, that of arcs along the arc.
    """
    before = np.concatenate([motion.start[None, :], motion.end[:-1]])
    step = motion.end - before
    length = control.feed_length(step)
    sweep = arc_sweeps(motion, control)
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero(np.isfinite(sweep) & (motion.plane == plane))
        if len(k):
            columns = [int(control.xyz[i]), int(control.xyz[j])]
            radius = np.linalg.norm(before[k][:, columns] - motion.center[k][:, (i, j)], axis=1)
            rise = step[k, int(control.xyz[3 - i - j])]
            length[k] = np.hypot(radius * sweep[k], rise)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(motion.inverse, 60.0 / motion.feed, 60.0 * length / motion.feed))


def check_links(motion: Motion, executed: Executed, moves: Moves, owner: Ints, space: SafeSpace, tolerance: float,
           file: str) -> list[Diagnostic]:
    """Linking blocks stay on the line of retract, above the path, or on the line of approach."""
    rows = np.flatnonzero((owner < len(moves)) & moves.link[np.minimum(owner, len(moves) - 1)])
    rows = rows[rows > 0]
    bad = np.zeros(len(rows), dtype=bool)
    m = owner[rows]
    for t in SAMPLES:
        tip, axis = executed.poses(motion, rows, t)
        low = ~space.clear(tip, axis, -tolerance)
        approach = _off_line(tip, moves.tip[m], moves.axis[m]) <= tolerance
        before = np.maximum(m - 1, 0)
        retract = (_off_line(tip, moves.tip[before], moves.axis[before]) <= tolerance) & (m > 0)
        bad |= low & ~approach & ~retract
    if not bad.any():
        return []
    k = int(np.flatnonzero(bad)[0])
    return [error("verify.link", f"the linking move in block line {int(motion.line[rows[k]])} comes too near to the part",
                  file=file, lines=[int(moves.line[m[k]])], count=int(bad.sum()))]


def _off_line(tip: Floats, end: Floats, axis: Floats) -> Floats:
    """Distance (K,) of tips from the half lines that leave `end` along `axis`."""
    offset = tip - end
    along = np.maximum(np.einsum("ni,ni->n", offset, axis), 0.0)
    return np.asarray(np.linalg.norm(offset - along[:, None] * axis, axis=1))
