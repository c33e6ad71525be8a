"""Directions in which a curve passes the points that stand on it, where none near them is smoother (`curve.py`)."""

from __future__ import annotations

import numpy as np

from toolpaths.arrays import Bools, Floats, Ints

SHARP = 0.15
"""rad that a point of a curve turns from which its direction is that of its neighbourhood alone: a spline whose curvature is
continuous there bends to the other side before and behind"""
SLIGHT = 1e-6
"""rad: least turn of a neighbour, so that directions are defined"""


def tangents(u: Floats, chord: Floats, along: Floats, smooth: Bools) -> tuple[Floats, Floats]:
    """(N, A) derivatives by the parameter at begin and end of each block: of cubic splines through smooth points, of one
    curvature in the blocks in which they end (C. de Boor, A Practical Guide to Splines, 1978, chapter IV): where a curve
    ends at a corner it bends up to there. Blocks of no curve are straight. Points that turn by more than SHARP have
    `_local` directions, however the points stand there.

    `u` (N, A) directions of the blocks, `chord` (N,) their lengths, `along` (N,) those of their parameter; `smooth` (N - 1,)
    inner points of curves.
    """
    from scipy.linalg import solve_banded  # loaded where a control's clock is asked for

    n = len(u)
    turn = np.where(smooth, np.linalg.norm(np.diff(u, axis=0), axis=1), 0.0)
    k, sharp = np.flatnonzero(smooth & (turn <= SHARP)), np.flatnonzero(turn > SHARP)
    speed = u * (chord / along)[:, None]
    bands, right = np.zeros((4, 2 * n)), np.zeros((2 * n, u.shape[1]))
    left, joined = np.concatenate([[False], smooth]), np.append(smooth, False)
    begin, end = 2 * np.arange(n), 2 * np.arange(n) + 1
    alone = np.where(left | joined, 1.0, 2.0)
    slope = (1.0 + alone)[:, None] * speed
    bands[1, begin], bands[0, end], right[begin] = np.where(left, 2.0, alone), np.where(left, 0.0, 1.0), slope
    bands[1, end], right[end] = np.where(joined, 1.0, alone), np.where(joined[:, None], 0.0, slope)
    bands[2, begin] = np.where(joined, 0.0, 1.0)
    bands[0, begin[k + 1]] = -1.0
    before, behind = along[k] / (along[k] + along[k + 1]), along[k + 1] / (along[k] + along[k + 1])
    bands[3, begin[k]], bands[0, end[k + 1]] = behind, before
    right[begin[k + 1]] = 3.0 * (behind[:, None] * speed[k] + before[:, None] * speed[k + 1])
    bands[1, begin[sharp + 1]] = 1.0
    right[end[sharp]], right[begin[sharp + 1]] = _local(u, chord, along, turn, sharp)
    solved = solve_banded((2, 1), bands, right)
    return solved[0::2], solved[1::2]


def _local(u: Floats, chord: Floats, along: Floats, turn: Floats, sharp: Ints) -> tuple[Floats, Floats]:
    """(K, A) derivatives before and behind each sharp point (K,): the mean of the directions of both blocks, each weighed by
    the root of the turn at the other end of the other block and of that block's length: most of a bend is where its
    neighbours turn too (H. Akima, J. ACM 17, 1970, has the turn itself: it follows rounded points). As long as those of an
    arc between the directions at both ends of the block.
    """
    known = np.concatenate([[0.0], turn, [0.0]])
    before, behind = (np.where(one > 0.0, one, turn[sharp]) for one in (known[sharp], known[sharp + 2]))
    weight = [np.sqrt(np.maximum(one, SLIGHT) * chord[rows]) for one, rows in ((behind, sharp + 1), (before, sharp))]
    mean = weight[0][:, None] * u[sharp] + weight[1][:, None] * u[sharp + 1]
    mean /= np.linalg.norm(mean, axis=1)[:, None]
    first, last = u.copy(), u.copy()
    last[sharp], first[sharp + 1] = mean, mean
    angle = np.arccos(np.clip((first * last).sum(axis=1), -1.0, 1.0))
    size = 2.0 / (1.0 + np.cos(angle / 2.0)) * chord / along
    return mean * size[sharp, None], mean * size[sharp + 1, None]
