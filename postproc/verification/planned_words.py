"""Feeds that were planned, as the program runs them: no block faster than its plan, nor slower than feed and plan ask."""

from __future__ import annotations

import numpy as np

from postproc.job.job import Job
from postproc.path.model import TRAVERSE, JointPath
from postproc.readback.comparison.checks import block_seconds
from postproc.readback.comparison.compare import Comparison
from postproc.readback.comparison.faults import Faults
from postproc.readback.comparison.slow_moves import Slack, axis_seconds, feed_rounding
from postproc.reference.holes import Phase
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import REPORT, Diagnostic
from toolpaths.shapes import arrays


@dataclass(frozen=True)
@arrays(owner="B", seconds="B", asked="B")
class WrittenBlocks:
    """Blocks of the path as they were to be written, those that cut: the move of each, s by the plan, s by the feed."""

    owner: Ints
    seconds: Floats
    asked: Floats

    @classmethod
    def of(cls, path: JointPath, moves: Moves, needed: Floats) -> WrittenBlocks:
        """Of a path with the least seconds (K,) of each block; `moves` with pecks, as the path names them."""
        keep, rows = _written_rows(path, moves)
        return cls((np.cumsum(keep) - 1)[path.move[rows]], needed[rows], np.nan_to_num(path.seconds[rows]))


def blocks_of_rows(path: JointPath, moves: Moves, comparison: Comparison) -> Ints:
    """(B,) block of the path that each executed block writes, -1 where its move has not as many of both.

    `path`, `moves`: as they were written.
    """
    motion, reference = comparison.executed[1], comparison.moves.without_pecks()
    count, result = len(reference), np.full(len(motion), -1)
    keep, written = _written_rows(path, moves)
    owner = (np.cumsum(keep) - 1)[path.move[written]]
    rows = np.flatnonzero(_cutting(comparison))
    own = comparison.owner[rows]
    here, there = (np.bincount(one, minlength=count) for one in (own, owner))
    known = (here == there)[own]
    begin = np.searchsorted(owner, np.arange(count))
    place = np.arange(len(own)) - np.searchsorted(own, own, side="left")
    result[rows[known]] = written[(begin[own] + place)[known]]
    return result


def _written_rows(path: JointPath, moves: Moves) -> tuple[Bools, Ints]:
    """(M,) moves that are no pecks; blocks of the path that cut outside holes."""
    keep = moves.phase != Phase.PECK
    rows = np.flatnonzero((path.code != TRAVERSE) & (path.u > 0.0) & ~path.home)
    return keep, rows[keep[path.move[rows]] & (moves.hole[path.move[rows]] < 0)]


def _cutting(comparison: Comparison) -> Bools:
    """(B,) executed blocks that cut outside holes."""
    motion, reference = comparison.executed[1], comparison.moves.without_pecks()
    cutting = (motion.code > 0) & reference.run_by(comparison.owner) & ~motion.hole
    return np.asarray(cutting & (reference.hole < 0)[np.minimum(comparison.owner, len(reference) - 1)])


def check_planned(path: JointPath, moves: Moves, needed: Floats, merge: float, comparison: Comparison,
                  job: Job) -> list[Diagnostic]:
    """Errors of blocks whose F words do not carry the plan.

    Args:
        path, moves: as they were written; needed (K,): least seconds of each block by the plan
        merge: part by which feeds may have been lowered to be alike
    """
    motion, reference = comparison.executed[1], comparison.moves.without_pecks()
    written, faults = WrittenBlocks.of(path, moves, needed), Faults(job.toolpath.file)
    count = len(reference)
    cutting = _cutting(comparison)
    rows = np.flatnonzero(cutting)
    group, own = _groups(comparison.owner[rows], written.owner, count)
    size = int(max(group.max(initial=0), own.max(initial=0))) + 1
    seconds = block_seconds(motion, job.control, job.controller.feed.arc_inverse == "radius")[rows]
    needs = axis_seconds(motion, comparison.poses, reference, comparison.owner, cutting)[rows]
    run, least = (np.bincount(g, weights=w, minlength=size) for g, w in ((group, seconds), (own, written.seconds)))
    axes = np.bincount(group, weights=needs, minlength=size)
    plan = np.bincount(own, weights=np.fmax(written.seconds, written.asked), minlength=size)
    here, there = (np.bincount(g, minlength=size) for g in (group, own))
    most = np.where(here == there, np.fmax(axes, plan), axes + plan) / (1.0 - merge)
    first = np.full(size, len(motion) - 1)
    np.minimum.at(first, group, rows)
    owner = np.minimum(comparison.owner[first], count - 1)
    rules, feed = Slack.of(job, bool((motion.unit != 1.0).any())), reference.feed[owner]
    share = rules.share + feed_rounding(motion, job, comparison.owner, cutting, count)[owner]
    slack = rules.seconds + rules.length / np.where(feed > 0.0, feed, np.inf)
    present = (here > 0) & (there > 0)
    fast = np.flatnonzero(present & (run < (1.0 - share) * least - slack))
    slow = np.flatnonzero(present & (run > (1.0 + share) * most + slack))
    found = []
    for bad, wanted, word in ((fast, least, "faster than"), (slow, most, "slower than")):
        if len(bad):
            k = int(bad[0])
            found.append(faults.error("verify.planned", f"the F words run a block in {run[k]:.5f} s, {word} its plan of "
                                      f"{wanted[k]:.5f} s", int(reference.line[owner[k]]), int(motion.line[first[k]]),
                                      len(bad), f"{REPORT}; --feed programmed needs no plan"))
    return found


def _groups(executed: Ints, written: Ints, moves: int) -> tuple[Ints, Ints]:
    """Numbers of the groups that are compared, of executed and of written blocks: each block by itself where a move has as
    many of both, else the whole move."""
    here, there = (np.bincount(owner, minlength=moves) for owner in (executed, written))
    alike = here == there
    begin = np.concatenate([[0], np.cumsum(np.where(alike, here, 1))])

    def numbers(owner: Ints) -> Ints:
        first = np.searchsorted(owner, owner, side="left")
        return np.asarray(begin[owner] + np.where(alike[owner], np.arange(len(owner)) - first, 0))

    return numbers(executed), numbers(written)
