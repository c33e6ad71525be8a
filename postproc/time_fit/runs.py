"""Measured runs as the fit takes them: sections of a program and their measured times, of one log or of a total alone."""

from __future__ import annotations

import numpy as np

from postproc.cycle_time.blocks import Cause, MotionBlocks
from postproc.cycle_time.estimate import timed, total
from postproc.cycle_time.kinds import KINDS, kinds
from postproc.cycle_time.model import CycleTimeModel
from postproc.cycle_time.phases import BlockTimes, summed
from postproc.time_fit.log import RunLog, matched, period
from postproc.time_fit.log_exports import number_of
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic
from toolpaths.shapes import arrays

SECTIONS = 300
"""stretches of a run whose times are compared, at most"""
PERIODS = 15.0
"""periods of a polled log that a section holds at least"""
CLOCK = 1e-3
"""s of uncertainty in any section: the clock of the log"""
OTHERS = 0.3
"""standard deviation, as a share, of tool changes and clamps within a section: the machine file's figures, which are not
fitted"""


@dataclass(frozen=True)
@arrays(row="R", after="R", measured="K", other="K")
class MeasuredRun:
    """A measured run of a program.

    Attributes:
        row, after (R,): the block at which each section begins (the last one: ends), and the first block of the next line
        measured (K,): s of the sections; of a run known by its total alone one, and R = 0
        other (K,): s of the sections that the model does not fit (tool changes, clamps)
        period: s at which the log was polled, 0 where it has every change of the line
    """

    blocks: MotionBlocks
    row: Ints
    after: Ints
    measured: Floats
    other: Floats
    period: float = 0.0

    @property
    def clock(self) -> float:
        """s, standard deviation of a section by its two readings: each uniform within a period."""
        return float(np.hypot(CLOCK, self.period / np.sqrt(6.0)))

    def modelled(self, model: CycleTimeModel) -> Floats:
        """(K,) s of the sections under a model; a polled log shows a line half a period late, or half of the line's time."""
        times = timed(self.blocks, model)
        if not len(self.row):
            return np.array([total(self.blocks, times)])
        at = times.begin[self.row]
        if self.period > 0.0:
            taken = np.append(times.begin, times.end[-1])[self.after] - at
            at = at + np.minimum(np.maximum(taken, 0.0), self.period) / 2.0
        return np.diff(at)

    def by_kind(self, times: BlockTimes) -> Floats:
        """(K, KINDS) s in motion of each section by kind."""
        kind, seconds = kinds(self.blocks, times), times.seconds
        if not len(self.row):
            return summed(seconds, kind, len(KINDS))[None, :]
        section = np.searchsorted(self.row, np.arange(len(self.blocks)), side="right") - 1
        inside = (section >= 0) & (section < len(self.measured))
        flat = summed(seconds[inside], section[inside] * len(KINDS) + kind[inside], len(self.measured) * len(KINDS))
        return flat.reshape(len(self.measured), len(KINDS))


def run_of_log(blocks: MotionBlocks, log: RunLog, file: str = "") -> tuple[MeasuredRun | None, list[Diagnostic]]:
    """The run of a log; None and why where the log does not fit the program."""
    samples, rows, found = matched(log, blocks, file)
    if found:
        return None, found
    lines = np.unique(blocks.line)
    polled = period(log, lines)
    time = log.time[samples]
    most = min(SECTIONS, len(rows) - 1)
    if polled > 0.0:
        most = int(np.clip((time[-1] - time[0]) / (PERIODS * polled), 1, most))
        cuts = np.unique(np.searchsorted(time, np.linspace(time[0], time[-1], most + 1)).clip(0, len(rows) - 1))
    else:
        cuts = np.unique(np.linspace(0, len(rows) - 1, most + 1).astype(int))
    row = rows[cuts]
    change = np.append(np.flatnonzero(np.diff(blocks.line) != 0) + 1, len(blocks))
    after = change[np.searchsorted(change, row, side="right")]
    return MeasuredRun(blocks, row, after, np.diff(time[cuts]), _other(blocks, row), polled), []


def run_of_total(blocks: MotionBlocks, seconds: float) -> MeasuredRun:
    """The run of a program of which only the time from begin to end is known."""
    none = np.zeros(0, dtype=np.int64)
    other = _of_machine(blocks)
    return MeasuredRun(blocks, none, none, np.array([seconds]), np.array([other.sum()]))


def _of_machine(blocks: MotionBlocks) -> Floats:
    p = blocks.pauses
    return np.where((p.cause == Cause.TOOL_CHANGE) | (p.cause == Cause.INDEXING), p.seconds, 0.0)


def _other(blocks: MotionBlocks, row: Ints) -> Floats:
    section = np.searchsorted(row, blocks.pauses.block, side="right") - 1
    inside = (section >= 0) & (section < len(row) - 1)
    return summed(_of_machine(blocks)[inside], section[inside], len(row) - 1)


def seconds_of(text: str) -> float | None:
    """s of 812.4, 13:32 or 0:13:32; None of anything else, and of no time at all."""
    parts = text.split(":")
    try:
        values = [number_of(part) for part in parts]
    except ValueError:
        return None
    if len(values) > 3 or not all(0.0 <= value < 1e7 for value in values) or any(value >= 60.0 for value in values[1:]):
        return None
    whole = sum(value * 60.0**power for power, value in enumerate(reversed(values)))
    return whole if whole > 0.0 else None
