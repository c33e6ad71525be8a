"""How far a parallel machine stands from its singular positions, as numbers without unit between 0 and 1.

Inverse singularity (a rod square to the motion of its drive, which then cannot be reported or moved): |cos| of the angle
between rod and slide, or path of the arm's end. Direct singularity (the platform yields with the slides held): the least
singular value of Jx, rods as unit vectors, moments about the platform's reference point by the largest arm. Source: Company
2000, II-16, III.7, V-23.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from toolpaths.arrays import Floats

_MUCH, _PARTS = 0.02, 32
NAMES = ("rod to slide (inverse)", "platform (direct)")
Matrices = Callable[[Floats], tuple[Floats, Floats]]
"""joints (N, J) to (Jx (N, K, K) made free of units, those cosines (N, K)), home mode; NaN without a pose"""


def distance(matrices: Matrices, q: Floats) -> Floats:
    """(N, 2) distances of joints q (N, J) from the inverse and the direct singularities; NaN without a pose."""
    rows, cosines = matrices(q)
    across = np.abs(cosines).min(axis=1)
    good = np.asarray(np.isfinite(rows).all(axis=(1, 2)))
    least = np.linalg.svd(np.where(good[:, None, None], rows, 0.0), compute_uv=False)[:, -1]
    return np.column_stack([across, np.where(good, np.asarray(least), np.nan)])


def distance_between(matrices: Matrices, q: Floats) -> Floats:
    """(N - 1, 2) the same at least on the straight joint moves between consecutive q (N, J).

    A least singular value changes by no more than the matrix does (Weyl): what that, or a cosine, does in a quarter of a
    move, taken as three quarters of its change over a half, is taken off the values at the ends and in the middle. Moves
    over which that is much are cut into parts.
    """
    result, change = _between(matrices, q[:-1], q[1:])
    rows = np.flatnonzero(change > _MUCH)
    if len(rows):
        cuts = [q[rows] + k / _PARTS * (q[rows + 1] - q[rows]) for k in range(_PARTS + 1)]
        parts, _ = _between(matrices, np.concatenate(cuts[:-1]), np.concatenate(cuts[1:]))
        result[rows] = parts.reshape(_PARTS, len(rows), 2).min(axis=0)
    return result


def _between(matrices: Matrices, q0: Floats, q1: Floats) -> tuple[Floats, Floats]:
    """(distances (N, 2), what was taken off (N,)) of the moves q0 -> q1 (N, J)."""
    places = (q0, 0.5 * (q0 + q1), q1)
    seen = [matrices(x) for x in places]
    change = 0.75 * np.max([np.maximum(np.linalg.norm(b[0] - a[0], axis=(1, 2)), np.abs(b[1] - a[1]).max(axis=1))
                            for a, b in pairwise(seen)], axis=0)
    least = np.stack([distance(matrices, x) for x in places]).min(axis=0)
    return np.asarray(least - change[:, None]), np.asarray(change)
