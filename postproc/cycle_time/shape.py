"""Lengths, directions and limits along each block."""

from __future__ import annotations

import numpy as np

from postproc.cycle_time.blocks import Axes, MotionBlocks
from toolpaths.arrays import Bools, Floats, repeated, slices
from toolpaths.dataclass import dataclass
from toolpaths.rotations import lengths
from toolpaths.shapes import arrays, rows_of

NOTHING = 1e-9
"""mm or rad below which an axis does not move (LinuxCNC: 1e-8 of its units)"""


@dataclass(frozen=True)
@arrays(length="E", turns="E", radius="E", climb="E", first="E 3", last="E 3", share="E A")
class Shape:
    """What the geometry of E blocks is.

    Attributes:
        length (E,): that the feed refers to: of X, Y, Z where any moves, else of U, V, W, else of A, B, C
        turns (E,): True where an axis other than X, Y, Z moves
        radius, climb (E,): of arcs: radius in the plane, path along the normal; 0 elsewhere
        first, last (E, 3): unit tangents in X, Y, Z at both ends; 0 where X, Y, Z stand
        share (E, A): largest path of each axis per unit of `length` (of an arc: at its worst point)
    """

    length: Floats
    turns: Bools
    radius: Floats
    climb: Floats
    first: Floats
    last: Floats
    share: Floats


def unit(vectors: Floats) -> Floats:
    """Rows (N, 3) as unit vectors, 0 where there is nothing."""
    size = lengths(vectors)[:, None]
    return np.asarray(vectors / np.where(size > 0.0, size, 1.0))


def feed_length(step: Floats, axes: Axes) -> Floats:
    """(E,) length of steps (E, A) that a feed refers to (LinuxCNC `find_straight_length`; NIST RS274/NGC 2.1.2.5)."""
    result = np.zeros(len(step))
    for letters in ("ABC", "UVW", "XYZ"):
        length = np.linalg.norm(step[:, axes.group(letters)], axis=1)
        result = np.where(length > NOTHING, length, result)
    return result


def shape(blocks: MotionBlocks) -> Shape:
    """The geometry of every block."""
    axes, step = blocks.axes, blocks.end - blocks.start
    step = np.where(np.abs(step) > NOTHING, step, 0.0)
    xyz = np.where(axes.xyz >= 0, step[:, axes.xyz], 0.0)
    length, direction = feed_length(step, axes), unit(xyz)
    if blocks.given is not None:
        length = np.where(blocks.given > NOTHING, blocks.given, length)
    others = [k for k in range(step.shape[1]) if k not in axes.xyz]
    turns = (step[:, others] != 0.0).any(axis=1)
    radius = climb = repeated(0.0, len(step))
    first = last = direction
    share = np.abs(step)
    if blocks.arc.any():
        radius, climb, first = np.zeros(len(step)), np.zeros(len(step)), direction.copy()
        _arcs(blocks, length, radius, climb, first, last, share)
    return Shape(length, turns, radius, climb, first, last,
                 share / np.where(length > 0.0, length, 1.0)[:, None])


def shape_within(blocks: MotionBlocks, *limits: Floats) -> tuple[Shape, list[Floats]]:
    """The geometry of every block with NaN in the place of `share`, which takes more room than all the rest, and for each
    limit (A,) what `axis_limit` makes of it (E,)."""
    count, round_ = len(blocks), bool(blocks.arc.any())
    length, turns, first = np.empty(count), np.empty(count, dtype=bool), np.empty((count, 3))
    radius, climb = (np.empty(count) if round_ else repeated(0.0, count) for _ in range(2))
    last, most = np.empty((count, 3)) if round_ else first, [np.empty(count) for _ in limits]
    for rows in slices(count):
        one = shape(rows_of(blocks, "E", rows))
        length[rows], turns[rows], first[rows] = one.length, one.turns, one.first
        if round_:
            radius[rows], climb[rows], last[rows] = one.radius, one.climb, one.last
        for found, limit in zip(most, limits, strict=True):
            found[rows] = axis_limit(one.share, limit)
    unknown = repeated(np.full(blocks.end.shape[1], np.nan), count)
    return Shape(length, turns, radius, climb, first, last, unknown), most


def block_lengths(blocks: MotionBlocks) -> Floats:
    """(E,) lengths that feeds refer to."""
    return np.concatenate([shape(rows_of(blocks, "E", rows)).length for rows in slices(len(blocks))])


def _arcs(blocks: MotionBlocks, length: Floats, radius: Floats, climb: Floats, first: Floats, last: Floats,
          share: Floats) -> None:
    """Fill the rows of arcs: circle of the start's radius, helix along the normal."""
    at, axes = np.flatnonzero(blocks.arc), blocks.axes
    normal, sweep = blocks.normal[at], blocks.sweep[at]
    ends = [np.where(axes.xyz >= 0, points[at][:, axes.xyz], 0.0) - blocks.center[at]
            for points in (blocks.start, blocks.end)]
    rise = ((ends[1] - ends[0]) * normal).sum(axis=1)
    spokes = [spoke - (spoke * normal).sum(axis=1)[:, None] * normal for spoke in ends]
    radius[at] = np.linalg.norm(spokes[0], axis=1)
    climb[at] = rise
    length[at] = np.hypot(radius[at] * sweep, rise)
    for spoke, tangent in zip(spokes, (first, last), strict=True):
        tangent[at] = unit(np.cross(normal, spoke) * sweep[:, None] + rise[:, None] * normal)
    plane = np.sqrt(np.maximum(1.0 - normal**2, 0.0)) * (radius[at] * sweep)[:, None] + np.abs(normal * rise[:, None])
    for k in np.flatnonzero(axes.xyz >= 0):
        share[at, axes.xyz[k]] = plane[:, k]


def axis_limit(share: Floats, limit: Floats) -> Floats:
    """(E,) largest rate along the length that keeps every axis within its limit (A,); inf where nothing moves."""
    with np.errstate(divide="ignore"):
        return np.asarray((limit / share).min(axis=1))


def tip_travel(blocks: MotionBlocks) -> Floats:
    """(E,) mm that the tip travels against the part: arcs by their length, pieces of one row alike; where the tip is not
    known the length of the words in X, Y, Z."""
    own = shape(blocks).length
    if blocks.tip is None or blocks.row is None or not len(blocks):
        linear = np.linalg.norm(np.diff(blocks.xyz, axis=0), axis=1) > 0.0
        return np.where(linear | blocks.arc, own, 0.0)
    rows, which, count = np.unique(np.asarray(blocks.row), return_inverse=True, return_counts=True)
    return np.where(blocks.arc, own, (blocks.tip.travel(rows) / count)[which])
