"""Logs of measured runs: when the control was at which line of the program."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.cycle_time.blocks import Blocks
from postproc.cycle_time.source import read_file
from toolpaths.arrays import Floats, Ints
from toolpaths.diagnostics import Diagnostic, error

LEAST = 8
"""lines of the log that a fit needs"""


@dataclass(frozen=True)
class Log:
    """S samples in the order of the run.

    Attributes:
        line (S,): line of the program that the control takes up at `time` (S,), s
        position (S, A): axis positions, mm and degrees, NaN where the log has none; row (S,): line of the log
    """

    line: Ints
    time: Floats
    position: Floats
    row: Ints


def read_log(file: str | Path, letters: tuple[str, ...]) -> tuple[Log | None, list[Diagnostic]]:
    """A CSV file with the columns nc_line and time_s, and axis letters where it has positions.

    Raises:
        DiagnosticError: where the file cannot be read.
    """
    text = read_file(file).decode("utf-8", "replace")
    rows = list(csv.reader(io.StringIO(text)))
    names = [name.strip() for name in rows[0]] if rows else []
    allowed = ("nc_line", "time_s", *letters)
    if names[:2] != ["nc_line", "time_s"] or set(names) - set(allowed):
        return None, [error("log.columns", f"columns {', '.join(names) or 'none'}, allowed: nc_line, time_s, then any of "
                            f"{', '.join(letters)}", file=str(file), lines=[1], hint="the first line names the columns")]
    values, found = _numbers(rows[1:], len(names), str(file))
    if found:
        return None, found
    position = np.full((len(values), len(letters)), np.nan)
    for k, name in enumerate(names[2:], 2):
        position[:, letters.index(name)] = values[:, k]
    number = np.array([k for k, row in enumerate(rows[1:], 2) if row])
    log = Log(values[:, 0].astype(np.int64), values[:, 1], position, number)
    return (None, found) if (found := _faults(log, values, str(file))) else (log, [])


def _numbers(rows: list[list[str]], columns: int, file: str) -> tuple[Floats, list[Diagnostic]]:
    """(S, columns) numbers, or which lines hold others."""
    values, bad = [], []
    for k, row in enumerate(rows, 2):
        if not row:
            continue
        try:
            numbers = [float(cell) for cell in row]
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


def _faults(log: Log, values: Floats, file: str) -> list[Diagnostic]:
    """What makes a log useless."""
    if len(log.line) < LEAST:
        return [error("log.short", f"{len(log.line)} samples, at least {LEAST} are needed", file=file,
                      hint="log every change of the line number")]
    odd = np.flatnonzero((values[:, 0] != np.round(values[:, 0])) | (values[:, 0] < 1.0))
    if len(odd):
        return [error("log.line", "nc_line is no line number", file=file, lines=log.row[odd][:6].tolist(), count=len(odd),
                      hint="lines of the file are whole numbers from 1")]
    back = np.flatnonzero(np.diff(log.time) < 0.0) + 1
    if len(back):
        return [error("log.time", "time_s falls", file=file, lines=log.row[back][:6].tolist(), count=len(back),
                      hint="samples in the order of the run, s from any start")]
    return []


def matched(log: Log, blocks: Blocks, file: str) -> tuple[Ints, Ints, list[Diagnostic]]:
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
    return samples, block, []
