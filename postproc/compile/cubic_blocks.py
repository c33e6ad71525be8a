"""Pieces of splines as one block each: cubics that the control itself runs, where the option is fitted."""

from __future__ import annotations

from dataclasses import field

import numpy as np

from postproc.compile.control_polygons import ControlPolygons, control_polygons
from postproc.compile.feed import Feeds
from postproc.compile.program import PER_MINUTE, Commands
from postproc.compile.word_rows import WordRows, block_tools, unrounded_words
from postproc.job.job import Job
from postproc.path.model import FEED, JointPath
from postproc.reference.moves import Moves
from toolpaths.arrays import Bools, Floats, Ints
from toolpaths.dataclass import dataclass
from toolpaths.shapes import arrays
from toolpaths.toolpath import Role

LEAST = 4
"""chords of a piece: of fewer points than five each set lies on some cubic"""
_SHIFTED = ("CUTTER_COMPENSATION_LEFT", "CUTTER_COMPENSATION_RIGHT")
OFF = 0.5
"""of the last decimal of a length: points that are off a cubic by more lie on none"""


@dataclass(frozen=True)
@arrays(first="B", last="B", curves="C 3 2", dropped="K")
class CubicBlocks:
    """Blocks that begin and end a cubic, `first`, `last` (B,), of which the last one is written, its coefficients (C, 3, 2)
    as of `Program.curves`, or none where control points are; blocks (K,) that it stands for; blocks that state control
    points."""

    first: Ints
    last: Ints
    curves: Floats
    dropped: Bools
    polygon: ControlPolygons = field(default_factory=ControlPolygons)

    @staticmethod
    def none(blocks: int) -> CubicBlocks:
        """A path without."""
        no = np.zeros(0, dtype=np.int64)
        return CubicBlocks(no, no, np.zeros((0, 3, 2)), np.zeros(blocks, dtype=bool))

    def ended(self, words: Floats, xyz: Ints) -> Floats:
        """Words (K, J) in which blocks that state a control point end there."""
        if not len(self.polygon.row):
            return words
        result = np.array(words)
        result[self.polygon.row[:, None], xyz] = self.polygon.point
        return result

    def written(self, write: Bools, words: WordRows, xyz: Ints, grain: float) -> Bools:
        """Words (K, J) that blocks state, of a cubic those in which it moves."""
        result = np.array(write)
        if len(self.polygon.row):
            result[self.polygon.row[:, None], xyz] = self.polygon.moves
            return result
        moves = words.end[self.last][:, xyz] != words.start[self.first][:, xyz]
        result[self.last[:, None], xyz] = moves | (np.abs(self.curves).max(axis=2, initial=0.0) > grain)
        return result

    def numbers(self) -> Ints:
        """(K,) number of the cubic that a block runs, -1 for none."""
        result = np.full(len(self.dropped), -1)
        result[self.last] = np.arange(len(self.last))
        return result


def cubic_blocks(job: Job, moves: Moves, path: JointPath, words: WordRows, feeds: Feeds, commands: Commands,
                 apart: Bools) -> CubicBlocks:
    """The cubics of a path: pieces of splines (`Role.CUBIC`), or halves of them, whose blocks are nothing but their chords:
    one feed, one frame, no record, standing rotary axes, and words that lie on a cubic; blocks that are `apart` (K,) on
    none."""
    xyz, none = job.control.xyz, CubicBlocks.none(len(path))
    if any(c.name in _SHIFTED for group in commands.values() for c in group):
        return none
    inside = job.toolpath.role[moves.row[path.move]] == Role.CUBIC
    if not job.controller.splines.word or (xyz < 0).any() or not inside.any():
        return none
    held = _held(path, words, feeds, commands, apart)
    same = np.append(False, (np.diff(path.frame) == 0) & ~path.home[:-1])
    first, count = _pieces(inside, same)
    points, done = job.machine.options.control_points, list[tuple[Ints, Ints, Floats]]()
    while len(first):
        whole = _unbroken(held, first, count)
        for n in np.unique(count[whole]).tolist():
            rows = first[whole & (count == n)]
            fits, curves = _fitted(job, moves, path, rows, n)
            done.append((rows[fits], np.full(int(fits.sum()), n), curves[fits]))
        rest = ~whole & (count >= 2 * LEAST) & (not points) & (count % 2 == 0)
        half = count[rest] // 2
        first, count = np.concatenate([first[rest], first[rest] + half]), np.concatenate([half, half])
    if not done:
        return none
    begin, size, curves = (np.concatenate(parts) for parts in zip(*done, strict=True))
    order = np.argsort(begin)
    if points:
        return _by_control_points(job, words, begin[order], size[order], curves[order])
    dropped = np.zeros(len(path) + 1, dtype=np.int64)
    np.add.at(dropped, begin, 1)
    np.add.at(dropped, begin + size - 1, -1)
    return CubicBlocks(begin[order], (begin + size - 1)[order], curves[order][:, :, 2:], np.cumsum(dropped)[:-1] > 0)


def _by_control_points(job: Job, words: WordRows, begin: Ints, size: Ints, terms: Floats) -> CubicBlocks:
    """The same of whole splines with equal knots, by blocks that state control points."""
    grid, xyz = job.grid, job.control.xyz

    def rounded(points: Floats) -> Floats:
        rows = np.zeros((len(points), len(grid.places)))
        rows[:, xyz] = points
        return np.asarray(grid.rounded(rows)[:, xyz])

    polygon, dropped = control_polygons(begin, size, terms, words.end[:, xyz], rounded, OFF * float(grid.grain[xyz].min()))
    kept = np.zeros((len(polygon.row), 3, 2))
    return CubicBlocks(polygon.row[:0], polygon.row[:0], kept, dropped, polygon)


def _held(path: JointPath, words: WordRows, feeds: Feeds, commands: Commands, apart: Bools) -> tuple[Bools, Bools]:
    """(blocks (K,) that a cubic may hold, blocks (K,) that go on as the block before them)."""
    rotary = np.asarray(path.frames[0].control.machine.rotary)
    fit = (path.code == FEED) & ~path.home & (path.u == 1.0) & ~apart & (feeds.mode == PER_MINUTE)
    fit &= ~words.write[:, rotary].any(axis=1)
    goes_on = np.ones(len(path), dtype=bool)
    goes_on[1:] = (np.diff(path.frame) == 0) & (np.diff(feeds.feed) == 0.0) & (np.diff(path.move) == 1)
    goes_on[[k for k in commands if k < len(path)]] = False
    return fit, goes_on


def _pieces(inside: Bools, same: Bools) -> tuple[Ints, Ints]:
    """(first block, count of blocks) of runs of blocks inside a piece and the one that ends it, which begin in the frame of
    the block before them: `same` (K,)."""
    edge = np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8))
    first, last = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1)
    keep = last < len(inside)
    keep[keep] = same[first[keep]]
    return first[keep], (last - first + 1)[keep]


def _unbroken(held: tuple[Bools, Bools], first: Ints, count: Ints) -> Bools:
    """Runs of blocks that may all be held, and go on from their first one."""
    fit, goes_on = (np.concatenate([[0], np.cumsum(~one)]) for one in held)
    last = first + count
    return np.asarray((fit[last] == fit[first]) & (goes_on[last] == goes_on[first + 1]) & (count >= LEAST))


def _fitted(job: Job, moves: Moves, path: JointPath, first: Ints, count: int) -> tuple[Bools, Floats]:
    """(which of the runs (G,) of `count` blocks lie on a cubic, coefficients (G, 3, 4) from the constant on) by their words
    before rounding: least squares over all points."""
    at = first[:, None] + np.arange(-1, count)
    rows = np.maximum(at, first[:, None]).ravel()
    words = unrounded_words(path, path.q[at.ravel()], rows, block_tools(path, moves), job.kinematics, job.offset_length)
    points = words[:, job.control.xyz].reshape(len(first), count + 1, 3)
    powers = np.linspace(0.0, 1.0, count + 1)[:, None] ** np.arange(4)
    terms = np.einsum("kn,gnj->gkj", np.linalg.pinv(powers), points)
    off = np.abs(points - np.einsum("nk,gkj->gnj", powers, terms)).max(axis=(1, 2), initial=0.0)
    limit = OFF * float(job.grid.grain[job.control.xyz].min())
    return np.asarray(off <= limit), terms.transpose(0, 2, 1)
