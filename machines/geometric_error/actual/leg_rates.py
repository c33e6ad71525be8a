"""How fast the errors of a platform on any legs change as its drives move: the bounds of `rod_rates.py` for every drive.

An arm's foot changes its direction of motion by |a| per rad, so r' may differ by |a| times the square of how far it goes,
and D (r . A') by |a| l times it; a leg that changes its length has D = l, which changes as it does.
"""

from __future__ import annotations

import numpy as np

from machines.geometric_error.actual.rod_rates import HeldLoops, HoldRates, PlatformMotion
from machines.geometric_error.actual.rods import inverted
from machines.kinematics.legs.loops import Loops
from toolpaths.arrays import Floats, Ints


def legs_motion(loops: Loops, leg: Ints, q: Floats, pose: tuple[Floats, Floats], reach: Floats) -> PlatformMotion:
    """The motion of platforms at `pose` (X (N, 3), R (N, 3, 3)) by drives q (N, K) that go by up to `reach` (N, K).

    Args:
        loops: as many rods as freedoms, with what holds the platform besides
        leg: (R,) leg of each rod
    """
    (place, turned), own, most = pose, leg[:, None] == np.arange(q.shape[1]), reach[:, leg]
    drives, rod_q = loops.drives, q[:, leg]
    rows, rods = loops.matrix_at(place, turned, rod_q)
    twist = loops.twists(inverted(rows)[:, :, :len(leg)] @ (drives.gains(rods, rod_q)[:, :, None] * own))
    shift, turn = twist[:, :3], twist[:, 3:]
    ends, moved = loops.arms(turned), drives.moved(rod_q)
    rates = shift[:, None] + np.cross(turn[:, None], ends[:, :, :, None], axis=2) - moved[:, :, :, None] * own[:, None]
    length, bend = drives.spans(rod_q) + drives.stretch * most, np.where(drives.arm, drives.size, 0.0) * most
    holds = None if loops.holds is None else HoldRates(loops.weight, loops.holds.reach(place), loops.holds.travels,
                                                       np.linalg.norm(shift, axis=1))
    held = HeldLoops(np.linalg.svd(np.nan_to_num(rows), compute_uv=False)[:, -1], np.linalg.norm(rates, axis=2),
                     np.linalg.norm(turn, axis=1), np.linalg.norm(loops.joints, axis=1), length, loops.lever, reach,
                     bend * most, (length * bend + drives.stretch * most)[:, :, None] * own, holds)
    change, swing = held.held()
    about = loops.basis[3:].sum(axis=1) if len(loops.turns) == 1 else None
    return PlatformMotion(place, turned, shift, turn, change, change / loops.lever, swing, about)
