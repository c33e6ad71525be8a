"""Blocks of one law as arrays: what they state, and the rows of motion that they become."""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from toolpaths.arrays import Array, Bools, Floats, Ints, joined
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays, rows_of
from toolpaths.units import MM_PER_INCH

if TYPE_CHECKING:
    from postproc.readback.execution.offsets import Offsets


@dataclass(frozen=True)
@arrays(motion="int16: N", plane="int8: N", machine="N", level="int8: N", inch="N", offset="N", columns="N J",
        steps="N J", rest="N", length="N", relative="N 3", absolute="N 3", extra="N 7", deep="N 3", repeats="N", call="N",
        radius="N", curve="N")
class BlockSection:
    """Blocks `first` and on (N), as their words and modal state have them.

    `columns`, `steps` (N, J) are absolute and relative axis words, `relative`, `absolute` (N, 3) centres of
    arcs from the start and in coordinates, `extra` (N, 7) the words Z, R, Q, P, I, J, K of a cycle, `deep`
    (N, 3) z, r and turns, `repeats` and `call` (N,) as stated; NaN where a block states none. `offset` (N,): register of
    the work offset; `radius` (N,): mm by which the control shifts the words to the left, negative to the right.
    `curve` (N,): number of the cubic that a block runs, NaN for none.
    """

    first: int
    motion: Array
    plane: Array
    machine: Bools
    level: Array
    inch: Bools
    offset: Floats
    columns: Floats
    steps: Floats
    rest: Bools
    length: Floats
    relative: Floats
    absolute: Floats
    extra: Floats
    deep: Floats
    repeats: Floats
    call: Floats
    radius: Floats
    curve: Floats

    def cut(self, first: int, last: int) -> BlockSection:
        """Blocks first to before last; all of them are not copied."""
        if first == 0 and last >= len(self.motion):
            return self
        return replace(rows_of(self, "N", slice(first, last)), first=self.first + first)

    @cached_property
    def has_steps(self) -> bool:
        """True where any word is relative."""
        return bool(np.isfinite(self.steps[:1] if self.steps.strides[0] == 0 else self.steps).any())

    @property
    def stated(self) -> Bools:
        """(N, J) axes that a block moves."""
        stated = np.isfinite(self.columns)
        return stated | np.isfinite(self.steps) if self.has_steps else stated

    @property
    def scale(self) -> Floats:
        """(N,) mm per unit of length."""
        return np.where(self.inch, MM_PER_INCH, 1.0)


@dataclass(frozen=True)
@arrays(block="R", code="int8: R", end="R J", center="R 3", frame="R", hole="R", feed="R", dwell="R", ccw="R", contour="R 4")
class MotionRows:
    """R rows of motion: block, code, end (R, J) in machine coordinates, centre (R, 3) in those of the frame,
    number of the frame; hole, feed (NaN: the F word in force), rest of cycles; ccw of arcs; `contour` (R, 4): X, Y from
    where the tool's centre begins and ends the row to the contour under compensation by the radius, 0 elsewhere."""

    block: Ints
    code: Array
    end: Floats
    center: Floats
    frame: Ints
    hole: Bools
    feed: Floats
    dwell: Floats
    ccw: Bools
    contour: Floats

    @staticmethod
    def joined(parts: list[MotionRows], width: int) -> MotionRows:
        """Parts in order; none is no rows."""
        if len(parts) == 1:
            return parts[0]
        if not parts:
            none = np.zeros(0)
            return MotionRows(none.astype(np.int64), none.astype(np.int8), np.zeros((0, width)), np.zeros((0, 3)),
                              none.astype(np.int64), none.astype(bool), none, none, none.astype(bool), np.zeros((0, 4)))
        return MotionRows(*(joined([getattr(p, f.name) for p in parts]) for f in fields(MotionRows)))


@dataclass
class SectionState:
    """What a section is worked out on: absolute words (N, J) in coordinates, and where the blocks begin (J,)."""

    section: BlockSection
    columns: Floats
    steps: Floats
    start: Floats
    shift: Floats
    """(N, J) from the program's words to coordinates"""
    offsets: Offsets

    def carried(self) -> Floats:
        """(N + 1, J) where every axis stands: before the first block, and behind each."""
        ends = np.concatenate([self.start[None, :], self.columns])
        n = np.arange(len(ends))
        for j in range(ends.shape[1]):
            last = np.maximum.accumulate(np.where(np.isfinite(ends[:, j]), n, 0))
            ends[:, j] = ends[last, j]
            if self.section.has_steps:
                walked = np.cumsum(np.concatenate([[0.0], np.nan_to_num(self.steps[:, j])]))
                ends[:, j] += walked - walked[last]
        return ends
