"""Logs of measured runs: when the control was at which line of the program."""

from __future__ import annotations

import codecs
import csv
import io
from pathlib import Path

import numpy as np

from postproc.cycle_time.blocks import MotionBlocks
from postproc.cycle_time.source import read_file
from postproc.time_fit.log_exports import is_export, lines_of_export, number_of
from toolpaths.arrays import Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.diagnostics import Diagnostic, error
from toolpaths.shapes import arrays

LEAST = 8
"""lines of the log that a fit needs"""
UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
MOST_LINES, MOST_SECONDS = 1e9, 1e7
"""what no program and no run has more of"""


@dataclass(frozen=True)
@arrays(line="S", time="S", position="S A", row="S")
class RunLog:
    """S samples in the order of the run.

    Attributes:
        line (S,): line of the program that the control takes up at `time` (S,), s
        position (S, A): axis positions, mm and degrees, NaN where the log has none; row (S,): line of the log
    """

    line: Ints
    time: Floats
    position: Floats
    row: Ints


def read_log(file: str | Path, letters: tuple[str, ...]) -> tuple[RunLog | None, list[Diagnostic]]:
    """A CSV file with the columns nc_line and time_s, and axis letters where it has positions; or an export of MTConnect or
    OPC UA.

    Raises:
        DiagnosticError: where the file cannot be read.
    """
    data = read_file(file, "a log of a measured run: columns nc_line and time_s; or give the time of the whole run alone, "
                           "as 812.4 or 0:13:32")
    text = data.decode("utf-16" if data[:2] in UTF_16 else "utf-8-sig", "replace")
    try:
        rows = [[] if len(row) == 1 and not row[0].strip() else row for row in csv.reader(io.StringIO(text, newline=None))]
    except csv.Error as fault:
        return None, [error("log.columns", f"is not a CSV file: {fault}", file=str(file),
                            hint="a log has the columns nc_line and time_s, a comma between them")]
    names = [name.strip() for name in rows[0]] if rows else []
    if is_export(names):
        return _exported(names, rows[1:], len(letters), str(file))
    allowed = ("nc_line", "time_s", *letters)
    if not {"nc_line", "time_s"} <= set(names) <= set(allowed) or len(set(names)) < len(names):
        return None, [error("log.columns", f"columns {', '.join(names) or 'none'}, allowed: nc_line, time_s and any of "
                            f"{', '.join(letters)}, each once", file=str(file), lines=[1],
                            hint="the first line names the columns, a comma between them, a point in decimals")]
    values, found = _numbers(rows[1:], len(names), str(file))
    if found:
        return None, found
    column = dict(zip(names, values.T, strict=True))
    position = np.stack([column.get(name, np.full(len(values), np.nan)) for name in letters], axis=1)
    number = np.array([k for k, row in enumerate(rows[1:], 2) if row], dtype=np.int64)
    if found := _faults(column["nc_line"], column["time_s"], number, str(file)):
        return None, found
    return RunLog(column["nc_line"].astype(np.int64), column["time_s"], position, number), []


def _exported(names: list[str], rows: list[list[str]], axes: int, file: str) -> tuple[RunLog | None, list[Diagnostic]]:
    """The log of an export with one observation a line."""
    line, time, number, found = lines_of_export(names, rows, file)
    if found := found or _faults(line, time, number, file):
        return None, found
    return RunLog(line.astype(np.int64), time, np.full((len(line), axes), np.nan), number), []


def _numbers(rows: list[list[str]], columns: int, file: str) -> tuple[Floats, list[Diagnostic]]:
    """(S, columns) numbers, or which lines hold others."""
    values, bad = [], []
    for k, row in enumerate(rows, 2):
        if not row:
            continue
        try:
            numbers = [number_of(cell) for cell in row]
        except ValueError:
            numbers = []
        if len(numbers) != columns or not np.isfinite(numbers).all():
            bad.append(k)
        else:
            values.append(numbers)
    if bad:
        return np.zeros((0, columns)), [error("log.numbers", f"not {columns} finite numbers", file=file, lines=bad[:6],
                                              count=len(bad), hint="one sample a line, decimal points, no units")]
    return np.array(values, dtype=np.float64).reshape(-1, columns), []


def _faults(line: Floats, time: Floats, row: Ints, file: str) -> list[Diagnostic]:
    """What makes a log useless."""
    if len(line) < LEAST:
        return [error("log.short", f"{len(line)} samples, at least {LEAST} are needed", file=file,
                      hint="log every change of the line number")]
    odd = np.flatnonzero((line != np.round(line)) | (line < 1.0) | (line > MOST_LINES))
    if len(odd):
        return [error("log.line", f"nc_line {line[odd[0]]:g} is not a line number", file=file, lines=row[odd][:6].tolist(),
                      count=len(odd), hint="lines of the file are whole numbers from 1")]
    back = np.flatnonzero(np.diff(time) < 0.0) + 1
    if len(back):
        return [error("log.time", "time_s falls", file=file, lines=row[back][:6].tolist(), count=len(back),
                      hint="samples in the order of the run, s from any start")]
    if not 0.0 < time[-1] - time[0] <= MOST_SECONDS:
        return [error("log.time", f"time_s goes from {time[0]:g} to {time[-1]:g}, allowed: more than 0 and at most "
                      f"{MOST_SECONDS:g} s", file=file, lines=row[[0, -1]].tolist(), hint="s, as the run passes")]
    return []


POLLED, LEAST_PERIOD = 0.9, 0.004
"""share of the steps of time that are whole multiples of a shortest one in a polled log; s of the shortest period"""


def period(log: RunLog, lines: Ints) -> float:
    """s at which the control was polled; 0.0 where the log has an entry for each change of the line.

    A polled log has steps of time that are multiples of one period, and lines that come twice or not at all; lines (L,) of
    the
    program that move, rising.
    """
    step = np.diff(log.time)
    step = step[step > 0.0]
    if len(step) < LEAST:
        return 0.0
    first = float(np.quantile(step, 0.1))
    count = np.maximum(np.round(step / first), 1.0)
    short = count <= np.median(count) * 3.0
    size = float(np.median(step[short] / count[short]))
    count = np.maximum(np.round(step / size), 1.0)
    whole = np.abs(step - count * size) < 0.15 * size
    again = np.diff(log.line) == 0
    seen = np.unique(log.line)
    inside = lines[(lines >= seen[0]) & (lines <= seen[-1])]
    missed = 1.0 - np.isin(inside, seen).mean() if len(inside) else 0.0
    polled = whole.mean() > POLLED and size >= LEAST_PERIOD and (again.mean() > 0.05 or missed > 0.05)
    return size if polled else 0.0


def matched(log: RunLog, blocks: MotionBlocks, file: str) -> tuple[Ints, Ints, list[Diagnostic]]:
    """(samples, blocks) (M,) that belong together: the first sample at a line, the first block of it, both rising."""
    line, first = np.unique(blocks.line, return_index=True)
    at = np.searchsorted(line, log.line)
    known = (at < len(line)) & (line[np.minimum(at, len(line) - 1)] == log.line)
    samples = np.flatnonzero(known)
    block = first[at[samples]]
    rising = np.maximum.accumulate(block) == block
    rising &= np.concatenate([[True], np.diff(np.maximum.accumulate(block)) > 0])
    samples, block = samples[rising], block[rising]
    if len(samples) < LEAST:
        return samples, block, [error("log.lines", f"only {len(samples)} samples stand at lines of the program that move",
                                      file=file, hint="nc_line counts the lines of the file, not N words")]
    if log.time[samples[-1]] <= log.time[samples[0]]:
        return samples, block, [error("log.time", "no time passes at lines of the program that move", file=file,
                                      lines=log.row[samples[[0, -1]]].tolist(), hint="s, as the run passes")]
    return samples, block, []
