"""Assembly modes of a platform that turns: every pose that Newton finds from many starts, at one set of joints.

A platform on six legs may have up to 40 poses at the same joints; no closed form is used, so what is found here is all that
these starts lead to, and nothing proves that there is no other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from machines.kinematics.legs.loops import Loops, turned
from toolpaths.arrays import Floats

STARTS, SAME = 600, 1e-6
"""starts of Newton; poses nearer than this (mm, turns by the lever) are one"""


def found_modes(loops: Loops, q: Floats, middle: Floats) -> tuple[Floats, Floats]:
    """(places (M, 3) mm, turns (M, 3, 3)) at joints q (K,) of the drives, the starts spread round `middle` (3,) mm."""
    rng = np.random.default_rng(0)
    size = float(loops.drives.spans(q[None]).max())
    free, turns = loops.basis[:3].any(axis=1), loops.basis[3:].any(axis=1)
    place = middle + rng.uniform(-size, size, (STARTS, 3)) * free
    vector = rng.normal(size=(STARTS, 3))
    vector *= rng.uniform(0.0, np.pi, (STARTS, 1)) / np.linalg.norm(vector, axis=1, keepdims=True)
    if turns.sum() == 1:
        vector = rng.uniform(-np.pi, np.pi, (STARTS, 1)) * turns
    with np.errstate(over="ignore", invalid="ignore"):  # starts that lead nowhere
        place, turn, closed = loops.newton(np.tile(q, (STARTS, 1)), place, turned(vector))
    flat = np.column_stack([place, loops.lever * turn.reshape(-1, 9)])[closed]
    kept: list[int] = []
    for k, row in enumerate(flat):
        if not kept or np.linalg.norm(flat[kept] - row, axis=1).min() > SAME * max(size, 1.0):
            kept.append(k)
    return place[closed][kept], turn[closed][kept]


def in_order(home: Floats, found: Sequence[Floats]) -> tuple[Floats, Floats]:
    """(tip, axis), each (M, N, 3), of the poses (M_n, 6) found at each of N joints: that of `home` (N, 6) first, then the
    others; NaN where a point has fewer than M."""
    poses = [[own, *(pose for pose in some if not np.linalg.norm(pose - own) < SAME * (1.0 + np.linalg.norm(own)))]
             for own, some in zip(home, found, strict=True)]
    result = np.full((max(map(len, poses), default=1), len(home), 6), np.nan)
    for n, each in enumerate(poses):
        result[:len(each), n] = each
    return result[:, :, :3], result[:, :, 3:]
