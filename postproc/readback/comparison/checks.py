"""What a program must keep besides its path: kind of motion, holes, travel, feed, smoothing, room at linking moves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from postproc.control.control import Control
from postproc.control.word_arcs import PLANE_COLUMNS
from postproc.job.job import Job
from postproc.path.links import SafeSpace
from postproc.path.model import ARC
from postproc.readback.comparison.faults import Faults
from postproc.readback.dialects.readers import reader_for, smoothing_level
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses, arc_sweeps, coordinates
from postproc.readback.text.canonical import SMOOTH_AXIS, SMOOTH_LEVEL, Canonical
from postproc.readback.text.modal import fill_values
from postproc.reference.holes import PECKING, Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.diagnostics import Diagnostic
from toolpaths.toolpath import Kind

ALLOWED_SPEED = 1.006
"""share of the programmed feed above which a move counts as too fast (short blocks carry rounding)"""
CHUNK = 50_000
"""blocks that are sampled at a time, so that memory does not grow with the samples"""
STILL = 1e-7
"""mm or degrees that come of reckoning, not of motion"""

_TURNS_BACK = 1e-6
"""mm that a tool must rise for a peck to have ended"""

WRITTEN = 1e-6
"""degrees of the last decimal that a tolerance of the tool axis is written with"""

ROUNDING_SLACK = 1e-3
"""mm or degrees by which rounded words may pass a limit that the exact ones keep"""


def check_kinds(motion: Motion, moves: Moves, owner: Ints, tip: Floats, bent: bool, taken_up: Bools,
                faults: Faults) -> list[Diagnostic]:
    """Rapids where the CL file cuts, cuts where it moves rapidly; pecks may return rapidly above what is drilled.

    Where rapids are dog-legs and feed moves asked for (`bent`) one may stand for a rapid that must be straight;
    blocks (K,) that only take up lost motion may be either: feed moves where a rapid has ended, rapids where a cut has.
    """
    rows = np.flatnonzero(owner < len(moves))
    m = owner[rows]
    cutting = (moves.kind[m] != Kind.RAPID) & ~moves.link[m]
    rapid = motion.code[rows] == 0
    fed = ~cutting & ~rapid & ~moves.link[m] & (not bent)
    hurried = cutting & rapid & ~_above_drilled(motion, moves, rows, m, tip)
    wrong = np.flatnonzero((hurried | fed) & ~taken_up[rows])
    diagnostics = []
    if len(wrong):
        k = wrong[0]
        kind = "rapid motion where the CL file cuts" if cutting[k] else "feed motion where the CL file is rapid"
        diagnostics.append(faults.error("verify.kind", kind, int(moves.line[m[k]]), int(motion.line[rows[k]]), len(wrong)))
    bad = rows[motion.missing_feed[rows]]
    if len(bad):
        diagnostics.append(faults.error("verify.feed_missing", "no feed in force", int(moves.line[owner[bad[0]]]),
                                        int(motion.line[bad[0]]), len(bad), hint="state F in this block or before it"))
    return diagnostics


def _above_drilled(motion: Motion, moves: Moves, rows: Ints, m: Ints, tip: Floats) -> Bools:
    """True for rapids of a peck: they end no deeper than the same move has drilled before."""
    result = np.zeros(len(rows), dtype=bool)
    height = np.einsum("ni,ni->n", tip[rows], moves.axis[m])
    edges = np.flatnonzero(np.diff(m, prepend=-1, append=-1))
    rapid = motion.code[rows] == 0
    pecked = (moves.phase[m[edges[:-1]]] == Phase.DRILL) & np.logical_or.reduceat(rapid, edges[:-1])
    for first, last in zip(edges[:-1][pecked], edges[1:][pecked], strict=True):
        drilled = np.minimum.accumulate(np.where(rapid[first:last], np.inf, height[first:last]))
        result[first + 1:last] = height[first + 1:last] >= drilled[:-1] - 1e-3
    return result


def check_holes(motion: Motion, job: Job, moves: Moves, tip: Floats, owner: Ints,
                faults: Faults) -> list[Diagnostic]:
    """Pecks no deeper into the part than the CL file's, and its dwell at the bottom, hole by hole."""
    drill = (owner < len(moves)) & (moves.phase[np.minimum(owner, len(moves) - 1)] == Phase.DRILL)
    rows = np.flatnonzero(drill)
    if not len(rows):
        return []
    m = owner[rows]
    starts = np.flatnonzero(np.diff(m, prepend=-1))
    bad_peck, bad_out, bad_break, bad_dwell, bad_rest = [], [], [], [], []
    for at, stop in zip(starts, [*starts[1:], len(rows)], strict=True):
        cycle = job.toolpath.cycles[int(moves.cycle[m[at]])]
        part = rows[at:stop]
        if cycle.dwell > 0.0 and motion.dwell[part].sum() < cycle.dwell * 0.99 - 1e-3:
            bad_dwell.append(part[0])
        elif motion.dwell[part].sum() > cycle.dwell * 1.01 + 2e-3:
            bad_rest.append(part[0])
        if cycle.kind in PECKING and cycle.steps:
            depth = (moves.tip[m[at]] - tip[part]) @ moves.axis[m[at]]
            total = cycle.depth + cycle.clearance
            pecks = _turning_points(depth)
            deepest = np.maximum.accumulate(np.concatenate([[-cycle.depth], depth[pecks]]))
            out = int((depth <= 0.01 - total).sum())
            if (np.diff(deepest) > _allowed(cycle.steps, int(pecks.sum())) + 0.01).any():
                bad_peck.append(part[0])
            elif cycle.kind == "DEEP" and out < int(pecks.sum()) - 1:
                bad_out.append(part[0])
            elif cycle.kind == "BRKCHP" and out:
                bad_break.append(part[0])
    result = []
    for bad, what in ((bad_out, "the tool does not leave the hole between pecks as the CL file says"),
                      (bad_break, "the tool leaves the hole between pecks, the CL file only breaks chips"),
                      (bad_peck, "the hole is drilled in deeper pecks than the CL file says"),
                      (bad_dwell, "the tool rests at the bottom for less time than the CL file says"),
                      (bad_rest, "the tool rests in the hole for more time than the CL file says")):
        if bad:
            result.append(faults.error("verify.hole", what, int(moves.line[owner[bad[0]]]), int(motion.line[bad[0]]),
                                       len(bad)))
    return result


def _allowed(steps: tuple[float, ...], count: int) -> Floats:
    """(count,) mm that each peck may go deeper: the CL file's steps, the last of them from there on."""
    return np.array([max(steps[min(k, len(steps) - 1):]) for k in range(count)], dtype=np.float64)


def _turning_points(depth: Floats) -> Bools:
    """True (N,) where the tool turns back after going deeper, (N,) mm; what is less than _TURNS_BACK goes neither path."""
    step = np.diff(depth, prepend=-np.inf, append=-np.inf)
    last = np.maximum.accumulate(np.where(np.abs(step) > _TURNS_BACK, np.arange(len(step)), 0))
    travel = np.sign(step[last])
    return np.asarray((travel[:-1] > 0.0) & (travel[1:] < 0.0))


def check_travel(motion: Motion, executed: BlockPoses, moves: Moves, owner: Ints, faults: Faults,
                 where: Callable[[Ints], str]) -> list[Diagnostic]:
    """Travel of every axis at the ends of all blocks and between them, whatever the blocks are for; `where` says at which
    place moves (K,) are made."""
    limits, machine = executed.control.machine.limits, executed.control.machine
    slack = ROUNDING_SLACK / executed.control.unit
    rows, worst = _beyond_travel(motion, executed, slack)
    result = []
    for j, name in enumerate(machine.axis_names):
        unit = executed.control.unit[j]
        bad = np.flatnonzero(worst[:, j] > slack[j])
        if len(bad):
            at = int(bad[worst[bad, j].argmax()])
            k = int(rows[at])
            line = int(moves.line[owner[k]]) if owner[k] < len(moves) else 0
            lower, upper = limits.lower[j] * unit, limits.upper[j] * unit
            result.append(faults.error("verify.travel", f"axis {name} goes {worst[at, j] * unit:.4f} beyond its travel "
                                       f"{lower:g} to {upper:g}{where(owner[[k]])}", line, int(motion.line[k]), len(bad)))
    return result


def _beyond_travel(motion: Motion, executed: BlockPoses, slack: Floats) -> tuple[Ints, Floats]:
    """(blocks (K,) in which an axis goes more than its slack (J,) beyond its travel, by how much (K, J) all of them do)."""
    limits, names = executed.control.machine.limits, executed.control.machine.axis_names
    found, excess = [np.zeros(0, dtype=np.int64)], [np.zeros((0, len(names)))]
    for first in range(0, len(motion), CHUNK):
        rows = _near_limits(motion, executed, np.arange(first, min(first + CHUNK, len(motion))), slack)
        worst = np.full((len(rows), len(names)), -np.inf)
        for t in executed.times(motion, rows) if len(rows) else ():
            q = executed.joints(motion, rows, t)
            worst = np.fmax(worst, np.maximum(limits.lower - q, q - limits.upper))
        bad = (worst > slack).any(axis=1)
        found.append(rows[bad])
        excess.append(worst[bad])
    return np.concatenate(found), np.concatenate(excess)


def _near_limits(motion: Motion, executed: BlockPoses, rows: Ints, slack: Floats) -> Ints:
    """Those of successive blocks that may leave travel: where no axis turns back within, those that begin or
    end within half a slack (J,) of where it is left."""
    if not motion.table.plain or executed.control.base == "tcp":
        return rows
    limits, q = executed.control.machine.limits, executed.joints(motion, rows, 1.0)
    near = np.asarray(~((q >= limits.lower - 0.5 * slack) & (q <= limits.upper + 0.5 * slack)).all(axis=1))
    near |= np.append(True, near[:-1]) | (motion.code[rows] == ARC)
    return rows[near]


def check_smoothing(motion: Motion, job: Job, moves: Moves, owner: Ints, faults: Faults) -> list[Diagnostic]:
    """The control's own smoothing while cutting: stated where the controller has it, and inside its share."""
    if not job.controller.program.path_tolerance and not job.smoothing.named:
        return []
    rows = np.flatnonzero((owner < len(moves)) & (motion.code > 0))
    shares = job.smoothing.by_operation[np.minimum(job.toolpath.operation[moves.row[owner[rows]]],
                                                   len(job.smoothing.by_operation) - 1)]
    bad = rows[~(motion.blend[rows] <= shares * (1.0 + 1e-6))]
    if not len(bad):
        return []
    k, share = int(bad[0]), float(shares[np.searchsorted(rows, bad[0])])
    found = "is not stated" if np.isnan(motion.blend[k]) else "has no limit" if np.isinf(motion.blend[k]) \
        else f"may take {motion.blend[k]:g} mm"
    return [faults.error("verify.smoothing", f"the control's smoothing {found}, its share of the tolerance is {share:g} mm",
                         int(moves.line[owner[k]]), int(motion.line[k]), len(bad),
                         hint=reader_for(job.controller, job.machine.axis_names).smoothing_hint)]


def check_smoothing_levels(code: Canonical, motion: Motion, job: Job, moves: Moves, owner: Ints,
                           faults: Faults) -> list[Diagnostic]:
    """The level of the control's own smoothing while cutting is that of the blocks asked for, as the same reader reads them:
    an error in an operation of [output.smoothing], a warning in others, whose level no one stated."""
    plan, of = job.smoothing, (job.controller, job.machine.axis_names)
    levels = {blocks: smoothing_level(*of, blocks) for blocks in {one.blocks for one in plan.used}}
    wanted = np.array([levels[one.blocks] for one in plan.used] or [np.nan])
    if np.isnan(wanted).all():
        return []
    named = np.array([op.name in plan.named for op in job.toolpath.operations] or [False])
    rows = np.flatnonzero((owner < len(moves)) & (motion.code > 0))
    operation = np.minimum(job.toolpath.operation[moves.row[owner[rows]]], len(wanted) - 1)
    asked, asks = wanted[operation], named[operation]
    level = fill_values(*code.words.pick(SMOOTH_LEVEL), code.words.lines)[motion.block[rows]]
    other = ~np.isnan(asked) & (level != asked)
    result = []
    for bad, report, by in ((other & asks, faults.error, "[output.smoothing] asks for"),
                            (other & ~asks & ~np.isnan(level), faults.warning, "the controller file has")):
        if bad.any():
            k = int(rows[bad.argmax()])
            result.append(report("verify.smoothing", f"the level of the control's smoothing is another than {by}",
                                 int(moves.line[owner[k]]), int(motion.line[k]), int(bad.sum()),
                                 hint=reader_for(*of).smoothing_hint))
    return result


def check_axis_smoothing(code: Canonical, motion: Motion, job: Job, moves: Moves, owner: Ints,
                         faults: Faults) -> list[Diagnostic]:
    """What the control's own smoothing may take of the tool axis where cuts turn it and corners are rounded, as far as the
    program says so."""
    share = job.controller.kinematics.axis_smoothing_share * job.options.axis_tolerance
    rotary = np.flatnonzero(np.array(job.machine.rotary))
    if not share or not len(rotary):
        return []
    before = np.concatenate([motion.start[None], motion.end[:-1]])
    turns = (np.abs(motion.end - before)[:, rotary] > STILL).any(axis=1)
    rows = np.flatnonzero((owner < len(moves)) & (motion.code > 0) & turns & (motion.blend > 0.0))
    taken = fill_values(*code.words.pick(SMOOTH_AXIS), code.words.lines)[motion.block[rows]]
    bad = rows[taken > share + WRITTEN]
    if not len(bad):
        return []
    most = float(taken[taken > share + WRITTEN][0])
    found = "has no limit" if np.isinf(most) else f"may take {most:g} degrees"
    return [faults.error("verify.smoothing", f"the control's smoothing {found} of the tool axis, its share of the tolerance "
                         f"is {share:g} degrees", int(moves.line[owner[bad[0]]]), int(motion.line[bad[0]]), len(bad),
                         hint=reader_for(job.controller, job.machine.axis_names).smoothing_hint)]


def check_speeds(motion: Motion, moves: Moves, owner: Ints, match: Ints, seconds: Floats,
                 tolerance: float, faults: Faults) -> list[Diagnostic]:
    """Moves that the F words run faster than programmed, over the whole move; `seconds` (E,) of each block.

    Chords within the tolerance e of an arc are shorter than its length r s by up to s e / 3: e = c^2 / (8 r)
    and the arc of a chord c is c (1 + c^2 / (24 r^2)). Where one move ends and the next begins is known to
    the tolerance only: time that short ones lack may be found next to them, also as feed at the ends of a rapid.
    """
    cutting = (owner < len(moves)) & (motion.code > 0)
    total = np.bincount(owner[cutting], weights=seconds[cutting], minlength=len(moves) + 1)[:len(moves)]
    asked = np.where(moves.seconds > 0.0, moves.seconds, moves.lengths() / moves.feed)
    shorter = 0.002 + moves.sweeps() * tolerance / 3.0
    slack = shorter / np.where(moves.feed > 0.0, moves.feed, np.inf)
    check = (moves.kind != Kind.RAPID) & ~moves.link & (match >= 0) & (total > 0.0)
    spare = np.pad(np.where(check, np.maximum(total - asked, 0.0), np.where(moves.kind == Kind.RAPID, total, 0.0)), 1)
    slack += np.minimum(spare[:-2] + spare[2:],
                        2.0 * tolerance / np.where(moves.feed > 0.0, moves.feed, np.inf))
    fast = np.flatnonzero(check & (total * ALLOWED_SPEED + slack < asked))
    if not len(fast):
        return []
    k = fast[int((asked[fast] / total[fast]).argmax())]
    return [faults.error("verify.feed", f"the move runs at {asked[k] / total[k]:.3f} times the programmed feed",
                         int(moves.line[k]), int(motion.line[match[k]]), len(fast))]


def block_seconds(motion: Motion, control: Control, by_radius: bool = False) -> Floats:
    """(E,) time of each cutting block at constant feed, s.

    Per minute the length is `Control.feed_length` under the law of the block, that of arcs along the arc, in
    the units of the feed (degrees where no linear axis moves). Inverse time
    counts whole blocks, in arcs 1/(minutes per radian) where the control has it so (`by_radius`).
    """
    sweep, (length, unit) = arc_sweeps(motion, control), block_lengths(motion, control)
    share = np.where(np.isfinite(sweep), sweep, 1.0) if by_radius else 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(motion.inverse, 60.0 * share / motion.feed, 60.0 * length / unit / motion.feed))


def block_lengths(motion: Motion, control: Control) -> tuple[Floats, Floats]:
    """(E,) mm or degrees of every block that a feed per minute refers to, (E,) the unit of the feed: 25.4 for inch."""
    sweep, length, unit = arc_sweeps(motion, control), np.empty(len(motion)), np.empty(len(motion))
    for first in range(0, len(motion), CHUNK):
        rows = np.arange(first, min(first + CHUNK, len(motion)))
        length[rows], unit[rows] = _lengths(motion, control, rows, sweep[rows])
    return length, unit


def _lengths(motion: Motion, control: Control, rows: Ints, sweep: Floats) -> tuple[Floats, Floats]:
    """Those of the blocks `rows` (K,), whose sweeps are `sweep` (K,)."""
    before, end = coordinates(motion, rows)
    step = end - before
    unit = motion.unit[rows]
    length = control.feed_units(step, unit)
    tips = np.flatnonzero(motion.frame[rows] > 0)
    if len(tips):
        length[tips] = control.under("tcp").feed_units(np.where(np.abs(step[tips]) > STILL, step[tips], 0.0), unit[tips])
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero(np.isfinite(sweep) & (motion.plane[rows] == plane))
        if len(k):
            columns = [int(control.xyz[i]), int(control.xyz[j])]
            radius = np.linalg.norm(before[k][:, columns] - motion.center[rows[k]][:, (i, j)], axis=1)
            rise = step[k, int(control.xyz[3 - i - j])]
            length[k] = np.hypot(radius * sweep[k], rise) / unit[k]
    linear = np.isfinite(sweep) | (np.abs(step[:, control.slides]) > STILL).any(axis=1)
    own = np.where(linear, unit, 1.0)
    return length * own, own


def check_links(motion: Motion, executed: BlockPoses, moves: Moves, owner: Ints, space: SafeSpace, tolerance: float,
           faults: Faults) -> list[Diagnostic]:
    """Linking blocks, those after the last point too, stay on the line of retract, clear of the path, or on
    the line of approach; within what corrections of geometric errors change on the path, besides the tolerance."""
    rows = np.flatnonzero(~moves.run_by(owner) & (owner <= len(moves)))
    rows = rows[(rows > 0) & (not space.in_plane)]  # there the set-up lets them pass
    bad = np.zeros(len(rows), dtype=bool)
    m = owner[rows]
    ends = m >= len(moves)
    to = np.minimum(m, len(moves) - 1)
    near = tolerance + executed.corrected_between(motion, rows)
    for t in executed.times(motion, rows):
        tip, axis = executed.poses(motion, rows, t)
        low = ~space.clear(tip, axis, -tolerance)
        approach = (off_line(tip, moves.tip[to], moves.axis[to]) <= near) & ~ends
        before = np.maximum(m - 1, 0)
        retract = (off_line(tip, moves.tip[before], moves.axis[before]) <= near) & (m > 0)
        bad |= low & ~approach & ~retract
    if not bad.any():
        return []
    k = int(np.flatnonzero(bad)[0])
    line = int(moves.line[m[k]]) if m[k] < len(moves) else 0
    return [faults.error("verify.link", "a linking move comes too close to the part", line, int(motion.line[rows[k]]),
                         int(bad.sum()))]


def check_low_rapids(motion: Motion, executed: BlockPoses, job: Job, moves: Moves, owner: Ints,
                     faults: Faults) -> list[Diagnostic]:
    """Dog-legs that leave their line, and rapids that the program splits, go across above all that is cut and the stock of
    the set-up; those from hole to hole are as the control's own cycles are."""
    rows = np.flatnonzero(moves.run_by(owner) & (motion.code == 0))
    m = owner[rows]
    split = np.diff(moves.row, prepend=-1, append=-1) == 0
    split = split[1:] | split[:-1]
    rows = rows[(moves.phase[m] == Phase.POSITION) & (moves.hole[m] < 0) & (split[m] | executed.bent(motion, rows))]
    if not len(rows):
        return []
    stock = job.stock_corners
    corners = job.space.corners if stock is None else np.concatenate([job.space.corners, stock])
    bad, slack, curves = np.zeros(len(rows), dtype=bool), job.options.tolerance, moves.curves(owner[rows])
    corner = split[owner[rows]]
    for t in executed.corners(motion, rows).T:
        tip, axis = executed.poses(motion, rows, t)
        off = curves.deviation(tip, axis, np.asarray(t), slack)[0]
        bad |= (corner | (off > slack)) & (np.einsum("ni,ni->n", tip, axis) < (axis @ corners.T).max(axis=1) - slack)
    if not bad.any():
        return []
    k = int(rows[np.flatnonzero(bad)[0]])
    return [faults.error("verify.link", "a rapid leaves its line, each axis running at its own speed, below what is cut",
                         int(moves.line[owner[k]]), int(motion.line[k]), int(bad.sum()), "do not run this program")]


def off_line(tip: Floats, end: Floats, axis: Floats) -> Floats:
    """Distance (K,) of tips from the half lines that leave `end` along `axis`."""
    offset = tip - end
    along = np.maximum(np.einsum("ni,ni->n", offset, axis), 0.0)
    return np.asarray(np.linalg.norm(offset - along[:, None] * axis, axis=1))
