"""A program as stretches: cuts, holes, and what lies between them, as places of the tool on the part."""

from __future__ import annotations

import numpy as np

from postproc.cycle_time.source import ExecutedProgram
from postproc.readback.execution.execute import Motion
from postproc.readback.text.canonical import Canonical, in_files
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays

PLACES = 4
"""places of a straight block that are looked at"""
ARC_PLACES = 16
"""places of an arc; a whole turn is followed within 2 % of its radius"""


@dataclass(frozen=True)
@arrays(tip="P 3", axis="P 3", first="int64: S", last="int64: S", cut="bool: S", row="int64: S",
        row_last="int64: S", of="int64: P", rest="S")
class Stretches:
    """S stretches of a program over P places.

    Attributes:
        tip (P, 3): mm, in the table frame; axis (P, 3): unit
        first, last (S,): places of a stretch, from where it begins to where it ends, both included
        cut (S,): True for a cut or a whole hole, False for all that lies between two of these
        row, row_last (S,): executed blocks that it begins and ends with
        of (P,): executed block of each place
        rest (S,): s that the tool rests in it, or behind it before the next one
    """

    tip: Floats
    axis: Floats
    first: Ints
    last: Ints
    cut: Bools
    row: Ints
    row_last: Ints
    of: Ints
    rest: Floats

    def __len__(self) -> int:
        return len(self.first)


@dataclass(frozen=True)
class ProgramLine:
    """A line of a program, or of the `file` of a subprogram."""

    line: int
    file: str = ""

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.file else str(self.line)


def line_of(code: Canonical, block: int) -> ProgramLine:
    """The line that a block stands in."""
    through = code.line[block:block + 1]
    k = int(np.searchsorted([before for _, before in code.files], through[0])) - 1
    return ProgramLine(int(in_files(through, code.files)[0]), code.files[k][0] if k > 0 else "")


def line_at(program: ExecutedProgram, one: Stretches, place: int) -> ProgramLine:
    """The line of the block that moves the tool to a place."""
    return line_of(program.code, int(program.motion.block[one.of[place]]))


def stretches(program: ExecutedProgram) -> Stretches:
    """The stretches of a program; blocks that move nothing are left out, a tool change ends a cut."""
    motion, poses = program.motion, program.poses()
    rows = np.arange(len(motion), dtype=np.int64)
    here = np.where(motion.code == 2, ARC_PLACES, PLACES)
    row = np.repeat(rows, here)
    number = np.arange(len(row)) - np.repeat(np.cumsum(here) - here, here)
    tip, axis = poses.poses(motion, row, (number + 1.0) / here[row])
    begin = poses.poses(motion, rows[:1], 0.0) if len(rows) else (np.zeros((0, 3)), np.zeros((0, 3)))
    moved = _moved(np.concatenate([begin[0], tip]), np.concatenate([begin[1], axis]), row, len(motion))
    return _cut_up(motion, moved, row, np.concatenate([begin[0], tip]), np.concatenate([begin[1], axis]))


def _moved(tip: Floats, axis: Floats, row: Ints, count: int) -> Bools:
    """(E,) blocks in which the tool moves on the part."""
    step = np.linalg.norm(np.diff(tip, axis=0), axis=1) + np.linalg.norm(np.diff(axis, axis=0), axis=1)
    return np.asarray(np.bincount(row, weights=np.nan_to_num(step), minlength=count) > 1e-9)


def _cut_up(motion: Motion, moved: Bools, row: Ints, tip: Floats, axis: Floats) -> Stretches:
    """Stretches of the blocks that move; `tip`, `axis` hold one place before the first block."""
    kept = np.flatnonzero(moved & ~_pecks(motion))  # how pecks come back is the cycle's own
    cutting, tool = motion.code[kept] > 0, motion.tool[kept]
    hole = np.where(motion.hole[kept], motion.block[kept], -1)
    new = np.ones(len(kept), dtype=bool)
    new[1:] = (cutting[1:] != cutting[:-1]) | (cutting[1:] & ((tool[1:] != tool[:-1]) | (hole[1:] != hole[:-1])))
    begins = np.flatnonzero(new)
    ends = np.append(begins[1:], len(kept)) - 1
    where = np.searchsorted(row, kept)
    upto = np.searchsorted(row, kept, side="right")
    return Stretches(tip, axis, where[begins].astype(np.int64), upto[ends].astype(np.int64), cutting[begins],
                     kept[begins].astype(np.int64), kept[ends].astype(np.int64),
                     np.concatenate([row[:1], row]).astype(np.int64), _rests(motion, kept[begins]))


def _pecks(motion: Motion) -> Bools:
    """(E,) rapids of a cycle between its first and its last feed: those before and behind are links as any other."""
    feeds = np.flatnonzero(motion.hole & (motion.code > 0))
    if not len(feeds):
        return np.zeros(len(motion), dtype=bool)
    hole = motion.block[feeds]
    at = np.searchsorted(hole, motion.block)
    first, last = feeds[np.minimum(at, len(feeds) - 1)], feeds[np.searchsorted(hole, motion.block, side="right") - 1]
    rows = np.arange(len(motion))
    return np.asarray(motion.hole & (motion.code == 0) & (rows > first) & (rows < last))


def _rests(motion: Motion, begins: Ints) -> Floats:
    """(S,) s of rest of stretches that begin with those blocks; what comes before the first counts with it."""
    of = np.maximum(np.searchsorted(begins, np.arange(len(motion)), side="right") - 1, 0)
    return np.bincount(of, weights=motion.dwell, minlength=len(begins)).astype(np.float64)
