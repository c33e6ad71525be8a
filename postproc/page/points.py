"""The points that the page draws: ends of executed blocks and places between, with time, joints and what limits each."""

from __future__ import annotations

import numpy as np

from machines.choices import MotionOrder
from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.estimate import Estimate
from postproc.cycle_time.shape import shape
from postproc.cycle_time.shares import CAUSES, FELT, shares
from postproc.page.columns import Column
from postproc.pipeline.result import PostResult
from postproc.readback.comparison.compare import Comparison, place_on_moves
from postproc.readback.text.canonical import in_files
from postproc.report.residuals import residuals
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.rotations import lengths
from toolpaths.shapes import arrays
from toolpaths.units import DEG

FINE, COARSE = 1e-4, 1e-3
"""mm or degrees: steps of positions, up to MANY points and beyond"""
MANY = 200_000
ARC_STEP, TURN_STEP, MOST = 0.1, 5.0 * DEG, 64
"""rad of an arc and of a rotary axis from one point to the next; points of a block at most"""
CHUNK = 200_000
"""points whose poses are found at once"""
ORDERS: tuple[MotionOrder, ...] = ("velocity", "acceleration", "jerk")


@dataclass(frozen=True)
@arrays(block="P", row="P", share="P")
class DrawnPoints:
    """P points: block (P,) of the estimate, row (P,) of the executed motion, and at which share of that row."""

    block: Ints
    row: Ints
    share: Floats

    def __len__(self) -> int:
        return len(self.block)


def drawn_points(blocks: MotionBlocks) -> DrawnPoints:
    """The end of every block that moves; of arcs and of blocks that turn far also places between."""
    if blocks.row is None:
        raise ValueError("blocks of no executed motion are not drawn")
    row = np.asarray(blocks.row)
    new = np.diff(row, prepend=-1) != 0
    group = np.cumsum(new) - 1
    size = np.bincount(group) if len(row) else np.zeros(0, dtype=np.int64)
    within = np.arange(len(row)) - np.flatnonzero(new)[group]
    count = _pieces(blocks)
    block = np.repeat(np.arange(len(row)), count)
    part = (np.arange(len(block)) - (np.cumsum(count) - count)[block] + 1.0) / count[block]
    share = (within[block] + part) / size[group[block]]
    return DrawnPoints(block, row[block], np.minimum(share, 1.0))


def _pieces(blocks: MotionBlocks) -> Ints:
    turning = np.abs(np.where(blocks.axes.rotary, blocks.end - blocks.start, 0.0)).max(axis=1, initial=0.0)
    around = np.where(blocks.arc, blocks.sweep / ARC_STEP, 0.0)
    count: Ints = np.clip(np.ceil(np.maximum(turning / TURN_STEP, around)), 1, MOST).astype(np.int64)
    return count


def columns(result: PostResult, e: Estimate) -> list[Column]:
    """All that the page knows of each point; the first row is where the program begins."""
    c, job = result.comparison, result.job
    if c is None or job is None:
        raise ValueError("a conversion that was not read back has no points")
    drawn = drawn_points(e.blocks)
    tip, axis, q = _poses(c, drawn)
    back = job.placement.inverse()
    tip, axis = back.points(tip), back.directions(axis)
    step = FINE if len(drawn) <= MANY else COARSE
    units = job.control.unit
    found = [Column(f"part {name}", tip[:, k], step, "mm") for k, name in enumerate("xyz")]
    found += [Column(f"axis {name}", axis[:, k], 1e-4) for k, name in enumerate("ijk")
              ] if not result.machine.kinematics.chain else []
    found += [Column(letter, q[:, j] * units[j], step, "deg" if result.machine.rotary[j] else "mm")
              for j, letter in enumerate(result.machine.axis_names)]
    return found + _times(e, drawn) + _lines(c, e, drawn) + _feeds(c, e, drawn, tip) + _limits(e, drawn) + _deviations(
        result, c, drawn)


def _first(values: Floats) -> Floats:
    """With the first value twice: where the program begins belongs to its first block."""
    return np.concatenate([values[:1], values])


def _poses(c: Comparison, drawn: DrawnPoints) -> tuple[Floats, Floats, Floats]:
    """(tip, axis (P + 1, 3) in the table frame, joints (P + 1, J)) of where the program begins and of points."""
    motion = c.executed[1]
    every, share_of_row = np.concatenate([drawn.row[:1], drawn.row]), np.concatenate([[0.0], drawn.share])
    tip, axis = np.empty((len(every), 3)), np.empty((len(every), 3))
    q = np.empty((len(every), motion.end.shape[1]))
    for at in range(0, len(every), CHUNK):
        rows, share = every[at:at + CHUNK], share_of_row[at:at + CHUNK]
        whole = share >= 1.0
        for some, t in ((np.flatnonzero(whole), 1.0), (np.flatnonzero(~whole), share[~whole])):
            if len(some):
                tip[at + some], axis[at + some] = c.poses.poses(motion, rows[some], t)
                q[at + some] = c.poses.joints(motion, rows[some], t)
    return tip, axis, q


def _times(e: Estimate, drawn: DrawnPoints) -> list[Column]:
    """Milliseconds from point to point, and how much of them the machine rests before it moves on; the first row has what
    it rests before it moves at all."""
    pauses = e.blocks.pauses
    lead = float(e.timed.pause[pauses.block < 0].sum())
    begin, seconds = e.timed.begin, e.timed.seconds
    rest = np.maximum(np.diff(begin, prepend=begin[:1]) - np.concatenate([[0.0], seconds[:-1]]), 0.0)
    count = np.bincount(drawn.block, minlength=len(begin))
    first = np.diff(drawn.block, prepend=-1) != 0
    resting = np.where(first, rest[drawn.block], 0.0)
    end = np.cumsum(resting + (seconds / np.maximum(count, 1))[drawn.block])
    at = np.diff(np.round(np.concatenate([[lead], lead + end]) * 1e3), prepend=0.0)
    return [Column("time step", at, 1.0, "ms"), Column("rest", np.concatenate([[0.0], resting]) * 1e3, 1.0, "ms")]


def _lines(c: Comparison, e: Estimate, drawn: DrawnPoints) -> list[Column]:
    """Lines of program and CL file, number of the program's file, operation, tool, kind (0 rapid, 1 feed, 2 arc)."""
    (code, motion), b = c.executed, e.blocks
    line = np.asarray(b.line)[drawn.block]
    file = np.maximum(np.searchsorted([n for _, n in code.files], line) - 1, 0) if code.files else np.zeros(len(line))
    cl = np.asarray(b.cl_line)[drawn.block] if b.cl_line is not None else np.full(len(line), -1)
    kind = np.where(b.rapid, 0, np.where(b.arc, 2, 1))[drawn.block]
    named = (("NC line", in_files(line, code.files)), ("NC file", file), ("CL line", cl),
             ("operation", np.asarray(b.operation)[drawn.block]), ("tool", motion.tool[drawn.row]), ("kind", kind))
    return [Column(name, _first(np.asarray(values, dtype=np.float64)), 1.0) for name, values in named]


def _feeds(c: Comparison, e: Estimate, drawn: DrawnPoints, tip: Floats) -> list[Column]:
    """Feed of the tip in mm/min: as the CL file has it, and reached in the mean from point to point by the time model."""
    moves = c.moves.without_pecks()
    own = moves.run_by(c.owner)
    asked = np.where(own, moves.feed[np.clip(c.owner, 0, len(moves) - 1)], np.nan)[drawn.row] * 60.0
    count = np.bincount(drawn.block, minlength=len(e.blocks))
    seconds = (e.timed.seconds / np.maximum(count, 1))[drawn.block]
    reached = np.where(seconds > 0.0, lengths(np.diff(tip, axis=0)) / np.where(seconds > 0.0, seconds, 1.0), np.nan) * 60.0
    return [Column("feed programmed", _first(asked), 0.1, "mm/min"), Column("feed reached", _first(reached), 0.1, "mm/min")]


def _limits(e: Estimate, drawn: DrawnPoints) -> list[Column]:
    """The cause of the time, and the limit that holds: 3 J + order, -1 for the feed word.

    `of velocity` is the share of the nearest velocity limit that the largest speed within the block takes by the time
    model; `ramps`, `builds up` are 1 where the block changes speed, and acceleration.
    """
    b, times = e.blocks, e.timed
    share = shape(b).share
    ratio = [share / limit for limit in (b.axes.velocity, b.axes.acceleration, b.axes.jerk)]
    of_velocity = times.peak * ratio[0].max(axis=1)
    by_axis = b.rapid | (of_velocity >= 1.0 - FELT)
    spent = np.stack([np.where(by_axis, times.steady, 0.0), times.ramp, times.jerk])
    order: Ints = spent.argmax(axis=0)
    axis = np.stack([r.argmax(axis=1) for r in ratio])[order, np.arange(len(b))]
    limit = np.where(by_axis | (spent.max(axis=0) > times.steady), len(ORDERS) * axis + order, -1)
    by_cause = shares(e).by_cause
    cause: Ints = np.stack([by_cause[name] for name in CAUSES]).argmax(axis=0)
    rows = (("of velocity", of_velocity, 1e-3), ("limit", limit, 1.0), ("cause", cause, 1.0),
            ("ramps", times.ramp > 0.0, 1.0), ("builds up", times.jerk > 0.0, 1.0))
    return [Column(name, _first(np.asarray(values, dtype=np.float64)[drawn.block]), step) for name, values, step in rows]


def _deviations(result: PostResult, c: Comparison, drawn: DrawnPoints) -> list[Column]:
    """Deviation of the tip at the end of each block from the CL file, and what geometric errors asked to correct; um."""
    moves, motion = c.moves.without_pecks(), c.executed[1]
    rows = np.flatnonzero(moves.run_by(c.owner))
    off = np.full(len(motion), np.nan)
    begin, share = place_on_moves(motion, c.poses, rows, c.owner, moves) if len(rows) else (np.zeros(0), np.zeros(0))
    for at in range(0, len(rows), CHUNK):
        here = slice(at, at + CHUNK)
        k = rows[here]
        off[k], _, _ = moves.curves(c.owner[k]).deviation(c.tip[k], c.axis[k], np.minimum(begin[here] + share[here], 1.0),
                                                        result.options.tolerance)
    found = [Column("deviation", _first(off[drawn.row] * 1e3), 0.01, "um")]
    field = residuals(result) if result.compensation is not None else None
    if field is not None and len(field.line):
        order = np.argsort(field.line, kind="stable")
        sizes = np.linalg.norm(field.before[:, :3], axis=1)[order] * 1e3
        line = moves.line[np.clip(c.owner, 0, len(moves) - 1)]
        place = np.clip(np.searchsorted(field.line[order], line, side="right") - 1, 0, len(order) - 1)
        there = (field.line[order][place] == line) & moves.run_by(c.owner)
        found.append(Column("correction", _first(np.where(there, sizes[place], np.nan)[drawn.row]), 0.1, "um"))
    return found
