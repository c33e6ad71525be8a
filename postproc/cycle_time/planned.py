"""The ideal model of a CL file: its passes as the feed planner moves them, everything between as the model says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.lookahead import lookahead
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.phases import BlockTimes
from postproc.pipeline.result import PostResult
from postproc.planning.planned import PlannedMotion
from postproc.planning.planned_errors import planned_correction
from postproc.planning.planned_source import source_of
from postproc.reference.moves import Moves
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import REPORT, Diagnostic, DiagnosticError, warning


def planned_times(result: PostResult, blocks: MotionBlocks, model: CycleTimeModel,
                  override: float = 1.0) -> tuple[BlockTimes, list[Diagnostic]]:
    """Times of a conversion's blocks, which were made with this `override`; a warning where no pass could be
    planned, so that all times are the model's."""
    times, motion = lookahead(blocks, model), motion_of(result, override * model.override)
    if motion is None or blocks.move is None:
        return times, []
    moves, file = motion.source.moves, result.toolpath.file
    try:
        spans = [(int(one.move.min()), int(one.move.max()), made.seconds)
                 for one, made in zip(motion.passes, motion.plans, strict=True)]
    except DiagnosticError as fault:
        return times, [warning("time.plan", f"the motion cannot be planned, times of passes are the model's: {fault}",
                               file=file, hint=f"{REPORT}; --model lookahead needs no plan")]
    return with_seconds(times, _of_passes(blocks, blocks.move, times, spans)), _unsolved(motion, moves, file)


def motion_of(result: PostResult, override: float = 1.0) -> PlannedMotion | None:
    """The planned motion of a conversion's passes at a feed override; None where it has no path."""
    job, path = result.job, result.path
    if job is None or path is None:
        return None
    if result.motion is not None and override == 1.0:
        return result.motion
    source = source_of(job, result.moves or job.moves, result.nominal or path,
                       planned_correction(job, result.compensation, path), override)
    return PlannedMotion(source, strict=bool(np.isfinite(source.bounds.jerk).all()))


def _unsolved(motion: PlannedMotion, moves: Moves, file: str) -> list[Diagnostic]:
    """A warning where the time of a pass is that of a plan that was not solved."""
    lines = [int(moves.line[one.move[0]]) for one, made in zip(motion.passes, motion.plans, strict=True) if not made.solved]
    if not lines:
        return []
    return [warning("time.unsolved", "the least time of these passes was not found; their times are longer than necessary, "
                    "within all limits", file=file, lines=lines[:6], count=len(lines),
                    hint=f"{REPORT}; --model lookahead needs no plan")]


def _of_passes(blocks: MotionBlocks, move: Ints, times: BlockTimes, spans: list[tuple[int, int, float]]) -> Floats:
    """(E,) s of each block: in passes the plan's time, shared out as the model has it."""
    seconds = times.seconds.copy()
    cutting = ~blocks.rapid
    for first, last, planned in spans:
        rows = np.flatnonzero(cutting & (move >= first) & (move <= last))
        own = seconds[rows].sum()
        if own > 0.0:
            seconds[rows] *= planned / own
    return seconds


def with_seconds(times: BlockTimes, seconds: Floats) -> BlockTimes:
    """The same order of blocks and rests, with other times of the blocks; their phases shrink and grow alike."""
    rest = np.append(np.diff(times.begin) - times.seconds[:-1], 0.0) if len(seconds) else seconds
    begin = np.concatenate([[0.0], np.cumsum(seconds + rest)[:-1]])
    scale = seconds / np.maximum(times.seconds, 1e-300)
    return replace(times, begin=begin, end=begin + seconds, ramp=times.ramp * scale, steady=times.steady * scale,
                   jerk=times.jerk * scale, lost_stop=times.lost_stop * scale, lost_corner=times.lost_corner * scale)
