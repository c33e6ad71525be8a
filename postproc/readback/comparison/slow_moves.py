"""Moves that the F words run slower than programmed."""

from __future__ import annotations

import re
import zlib
from collections.abc import Mapping

import numpy as np

from postproc.base.header_words import feeds_place, read_header, with_feeds_mark
from postproc.control.control import Control
from postproc.control.word_arcs import PLANE_COLUMNS
from postproc.job.job import Job
from postproc.readback.comparison.checks import CHUNK, STILL, block_lengths
from postproc.readback.comparison.faults import Faults
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses, arc_sweeps, coordinates
from postproc.readback.text.words import plain
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints, repeated
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.rotations import steps
from toolpaths.toolpath import Kind
from toolpaths.units import MM_PER_INCH

_FEED = re.compile(rb"(?i)(?<![A-Z])F *(\d[\d.]*|\.\d+)")


def planned_feeds(data: bytes, others: Mapping[str, bytes], gcode: str) -> tuple[bool, list[Diagnostic]]:
    """(True where the header of a program says that its feeds were planned, an error where they are others now).

    `others`: the files of its subprograms, and no more: other files stand in the same folder.

    Feeds that were planned keep acceleration and jerk, which the program does not show: they count as
    explained only as they were written.
    """
    header = read_header(data)
    if not header.planned:
        return False, []
    now = feed_fingerprint(data, others)
    if header.feeds == now:
        return True, []
    found = f"its header names {header.feeds}, the F words are {now}" if header.feeds else \
        "its header names no fingerprint of them"
    return True, [error("verify.slow", f"the planned feeds were changed after the program was written: {found}", file=gcode,
                        hint="convert again; where feeds were lowered by hand, no plan explains them")]


def feed_fingerprint(data: bytes, others: Mapping[str, bytes]) -> str:
    """Eight hex digits of the F words of a program and of the files of its subprograms, comments left out."""
    value = 0
    for text in (data, *(others[name] for name in sorted(others))):
        value = zlib.crc32(b" ".join(_FEED.findall(plain(text))), value)
    return f"{value:08x}"


def with_fingerprint(text: str, files: Mapping[str, str]) -> str:
    """The text of a program with the fingerprint of its F words in the place that the header has left for it."""
    if not feeds_place(text):
        return text
    return with_feeds_mark(text, feed_fingerprint(text.encode(), {name: t.encode() for name, t in files.items()}))


def check_slow(motion: Motion, executed: BlockPoses, job: Job, moves: Moves, owner: Ints, match: Ints, tip: Floats,
               seconds: Floats, faults: Faults) -> list[Diagnostic]:
    """Moves that take longer than their programmed feed and the velocities of all axes ask for, once with their count.

    `seconds` (E,) of the blocks at constant feed, `tip` (E, 3) at their ends; pecks feed some of their path
    again, which counts once. Moves are looked at one by one and together with those at the same feed word, so
    that the rounding of short ones hides nothing. Taps keep their pitch instead. Feeds that were planned keep
    more limits, see `feed_words`.
    """
    cutting = (owner < len(moves)) & (motion.code > 0)
    length = moves.lengths()
    asked = _asked(moves, owner, cutting, tip, length)
    total, again = _by_move(owner, cutting, seconds, len(moves)), _pecked(moves, owner, cutting, tip, length)
    total = total / again
    rules = Slack.of(job, bool((motion.unit != 1.0).any()))
    slack = rules.seconds + rules.length / np.where(moves.feed > 0.0, moves.feed, np.inf)
    check = (moves.kind != Kind.RAPID) & ~moves.link & (match >= 0) & np.isfinite(asked) & np.isfinite(total) & (total > 0.0)
    check &= ~_taps(job, moves)
    spare = np.pad(np.where(check, np.maximum(asked - total, 0.0), 0.0), 1)
    either = 2.0 * job.options.tolerance / np.where(moves.feed > 0.0, moves.feed, np.inf)
    slack = slack + np.minimum(spare[:-2] + spare[2:], either)
    del spare, either
    share = rules.share + feed_rounding(motion, job, owner, cutting, len(moves))
    run = _runs(motion, moves, owner, cutting, check)
    # What the axes need only adds to what is allowed: it is looked at where the feed alone would not explain the time.
    look = _too_long(total, asked, slack, share, run, check)
    if not look.any():
        return []
    cutting &= look[np.minimum(owner, len(moves) - 1)]
    needs = axis_seconds(motion, executed, moves, owner, cutting)
    allowed = _allowed(owner, cutting, needs, tip, seconds, asked, again, len(moves))
    slow = np.flatnonzero(_too_long(total, np.where(look, allowed, asked), slack, share, run, look))
    if not len(slow):
        return []
    k = slow[int((total[slow] / np.fmax(asked[slow], 1e-9)).argmax())]
    return [faults.error("verify.slow", f"the move runs at {asked[k] / total[k]:.3f} times the programmed feed, and no axis "
                         "needs that", int(moves.line[k]), int(motion.line[match[k]]), len(slow),
                         "correct the F word; where a lower feed is meant, state it in the CAM system")]


def _asked(moves: Moves, owner: Ints, cutting: Bools, tip: Floats, length: Floats) -> Floats:
    """(M,) s that the CL file asks for; moves that rounding or smoothing of their points made longer, by so much more."""
    asked = np.where(moves.seconds > 0.0, moves.seconds, length / moves.feed)
    path = _by_move(owner, cutting, steps(tip), len(moves))
    longer = (path > length) & (moves.phase != Phase.DRILL)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(longer, np.where(length > 0.0, asked * path / length, path / moves.feed), asked))


@dataclass(frozen=True)
class Slack:
    """What rounding explains: share of the time, s, and mm of a move's length."""

    share: float
    seconds: float
    length: float

    @classmethod
    def of(cls, job: Job, inch: bool = False) -> Slack:
        """Of a job; programs that correct geometric errors take up lost motion on the path."""
        unit = MM_PER_INCH if inch else 1.0
        if job.corrects:
            return cls(0.25, 0.002, 10.0 * unit * 10.0**-job.controller.format.linear_decimals)
        return cls(0.003, 1e-5, 2.0 * unit * 10.0**-job.controller.format.linear_decimals)


def _too_long(total: Floats, allowed: Floats, slack: Floats, share: Floats, run: Ints, check: Bools) -> Bools:
    """(M,) moves whose time is longer than allowed, by themselves or together with the others of their run."""
    long = check & (total > (1.0 + share) * allowed + slack)
    over = np.where(check, total - (1.0 + share) * allowed, 0.0)
    count = int(run.max(initial=0)) + 1
    excess, room = np.bincount(run, weights=over, minlength=count), np.zeros(count)
    np.maximum.at(room, run, np.where(check, 2.0 * slack, 0.0))
    return np.asarray(long | (check & (excess > room)[run] & (over > 0.0)))


def _runs(motion: Motion, moves: Moves, owner: Ints, cutting: Bools, check: Bools) -> Ints:
    """(M,) number of the run of neighbouring moves that one feed word serves; those with several are runs of their own."""
    low, high = np.full(len(moves) + 1, np.inf), np.full(len(moves) + 1, -np.inf)
    rows = np.flatnonzero(cutting)
    at = owner[rows]
    np.minimum.at(low, at, motion.feed[rows])
    np.maximum.at(high, at, motion.feed[rows])
    low, high = low[:-1], high[:-1]
    same = check & (low == high)
    joined = same[1:] & same[:-1] & (low[1:] == low[:-1]) & (moves.feed[1:] == moves.feed[:-1])
    return np.concatenate([[0], np.cumsum(~joined)])


def feed_rounding(motion: Motion, job: Job, owner: Ints, cutting: Bools, moves: int) -> Floats:
    """(M,) share of a move's time that the last decimal of its feed words may change."""
    least = np.full(moves + 1, np.inf)
    rows = np.flatnonzero(cutting & (motion.feed > 0.0))
    np.minimum.at(least, owner[rows], motion.feed[rows])
    places = job.controller.format.feed_decimals + job.controller.format.small_feed_decimals * (least < 1.0)
    return np.asarray(10.0**-places.astype(np.float64) / least)[:-1]


def _pecked(moves: Moves, owner: Ints, cutting: Bools, tip: Floats, length: Floats) -> Floats:
    """(M,) how often the path of a drilled hole is fed, 1 for other moves; `tip` (E, 3) at the ends of blocks."""
    if not (moves.phase == Phase.DRILL).any():
        return repeated(1.0, len(moves))
    path = steps(tip)
    fed = _by_move(owner, cutting, path, len(moves))
    return np.asarray(np.fmax(np.where(moves.phase == Phase.DRILL, fed / np.fmax(length, 1e-9), 1.0), 1.0))


def _taps(job: Job, moves: Moves) -> Bools:
    """(M,) moves of tapped holes."""
    taps = np.array([c.kind == "TAP" for c in job.toolpath.cycles] + [False])
    return np.asarray((moves.phase == Phase.DRILL) & taps[moves.cycle])


def axis_seconds(motion: Motion, executed: BlockPoses, moves: Moves, owner: Ints, cutting: Bools) -> Floats:
    """(E,) s that the velocities of the axes ask of each block; in arcs those of X, Y, Z at the programmed feed."""
    needs = _least(motion, executed, cutting)
    control = executed.control
    arcs = np.flatnonzero(cutting & (motion.code == 2))
    if len(arcs) and (control.xyz >= 0).all():
        least = control.machine.cutting_limits.velocity[control.xyz].min()
        around = arc_sweeps(motion, control)[arcs]
        before, _ = coordinates(motion, arcs)
        for plane, (i, j) in PLANE_COLUMNS.items():
            k = np.flatnonzero(motion.plane[arcs] == plane)
            columns = [int(control.xyz[i]), int(control.xyz[j])]
            radius = np.linalg.norm(before[k][:, columns] - motion.center[arcs[k]][:, (i, j)], axis=1)
            needs[arcs[k]] = np.fmax(needs[arcs[k]], radius * around[k] / least)
    return needs


def _allowed(owner: Ints, cutting: Bools, needs: Floats, tip: Floats, seconds: Floats, asked: Floats, again: Floats,
             moves: int) -> Floats:
    """(M,) s: each block of a move its part of the time asked for, by the length of the tip's path, or what axes need."""
    travel = steps(tip)
    whole = _by_move(owner, cutting, travel, moves)
    turning = _by_move(owner, cutting, needs, moves)
    here = np.flatnonzero(cutting)
    m = owner[here]
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.where(whole[m] > STILL, travel[here] / whole[m],
                        np.where(turning[m] > 0.0, needs[here] / turning[m], 1.0))
    long = np.fmax(part * asked[m] * again[m], needs[here])
    return np.asarray(np.bincount(m, weights=long, minlength=moves + 1)[:moves] / again)


def check_fed_rapids(motion: Motion, executed: BlockPoses, job: Job, moves: Moves, owner: Ints, tip: Floats, seconds: Floats,
                     down: Bools, faults: Faults) -> list[Diagnostic]:
    """Feed moves for rapids, or on the path between operations, that are faster than the axes, or slower than
    both they and, where they lead `down` (E,) to a cut, its feed."""
    if job.corrects:
        return []
    m = np.minimum(owner, len(moves) - 1)
    ours = (motion.code > 0) & (owner <= len(moves)) & ~motion.hole
    rows = ours & ((owner == len(moves)) | (moves.kind[m] == Kind.RAPID) | moves.link[m])
    if not rows.any():
        return []
    fed = np.flatnonzero(rows & ~down & (moves.link[m] | (owner == len(moves))))
    if len(fed) and executed.control.rapids == "dog-leg" and not job.setup.output.rapids_as_feed:
        k = int(fed[0])
        return [faults.error("verify.kind", "a feed move on the path between operations", int(moves.line[m[k]]),
                             int(motion.line[k]), len(fed), "rapid motion, or rapids_as_feed = true under [output] of the "
                             "set-up")]
    needs = _least(motion, executed, rows)
    travel = steps(tip, np.inf)
    feed = np.where(down & (moves.feed[m] > 0.0), moves.feed[m], np.inf)
    grain = Slack.of(job, bool((motion.unit != 1.0).any())).length
    spot = np.where(down & (moves.seconds[m] > 0.0), moves.seconds[m], 0.0)
    allowed = np.fmax(np.fmax(needs, spot), travel / feed)
    machine = executed.control.machine
    least = machine.cutting_limits.velocity[executed.control.slides].min(initial=machine.largest_feed)
    slack = grain / np.minimum(feed, least) + 1e-4
    bad, fast = (np.flatnonzero(rows & wrong) for wrong in (
        seconds > 1.003 * allowed + slack, 1.02 * seconds + slack < np.where(np.isfinite(feed), travel / feed, needs)))
    if len(fast):
        k = int(fast[0])
        return [faults.error("verify.feed", f"a feed move where the CL file is rapid takes {seconds[k]:.3f} s, the axes "
                             f"need {needs[k]:.3f} s", int(moves.line[owner[k]]) if owner[k] < len(moves) else 0,
                             int(motion.line[k]), len(fast), "the feed of the slowest axis")]
    if not len(bad):
        return []
    k = int(bad[0])
    return [faults.error("verify.slow", f"a feed move where the CL file is rapid takes {seconds[k]:.3f} s, the axes need "
                         f"{allowed[k]:.3f} s", int(moves.line[owner[k]]) if owner[k] < len(moves) else 0,
                         int(motion.line[k]), len(bad), "rapid motion, or the feed of the slowest axis")]


def _by_move(owner: Ints, which: Bools, values: Floats, moves: int) -> Floats:
    """(M,) sums of values (E,) of some blocks over the moves that they serve."""
    return np.asarray(np.bincount(owner[which], weights=values[which], minlength=moves + 1)[:moves])


def _least(motion: Motion, executed: BlockPoses, cutting: Bools) -> Floats:
    """(E,) s that the velocities of the axes, from joints at a few places, and the largest cutting feed ask of each
    cutting block."""
    control: Control = executed.control
    every, result = np.flatnonzero(cutting), np.zeros(len(motion))
    kin, drives = control.machine.kinematics, control.machine.by_drives or control.machine
    velocity, largest = drives.cutting_limits.velocity, control.machine.largest_feed
    places = np.linspace(0.0, 1.0, 5 if drives is control.machine else 9)
    if np.isfinite(largest):
        result = np.where(cutting, block_lengths(motion, control)[0] / largest, 0.0)
    for first in range(0, len(every), CHUNK):
        rows = every[first:first + CHUNK]
        q = kin.drives(executed.joints(motion, rows, 0.0))
        for t in places[1:].tolist():
            after = kin.drives(executed.joints(motion, rows, t))
            result[rows] = np.fmax(result[rows], (len(places) - 1) * (np.abs(after - q) / velocity).max(axis=1))
            q = after
    return result
