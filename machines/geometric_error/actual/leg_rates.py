"""How fast the errors of a platform on any legs change as its drives move: the bounds of `rod_rates.py` for every drive.

An arm's foot changes its direction of motion by |a| per rad, so r' may differ by |a| times the square of how far it goes,
and D (r . A') by |a| l times it; a leg that changes its length has D = l, which changes as it does. Rods that are more
than the freedoms share what is too much (`SharedLoops`).
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from machines.geometric_error.actual.leg_frame import LegFrame
from machines.geometric_error.actual.rod_rates import HeldLoops, HoldRates, PlatformMotion, SharedLoops
from machines.geometric_error.actual.rods import RodErrors, inverted
from machines.kinematics.legs.loops import Loops
from toolpaths.arrays import Floats, Ints


def legs_motion(loops: Loops, leg: Ints, q: Floats, pose: tuple[Floats, Floats], reach: Floats) -> PlatformMotion:
    """The motion of platforms at `pose` (X (N, 3), R (N, 3, 3)) by drives q (N, K) that go by up to `reach` (N, K).

    Args:
        loops: rods, with what holds the platform besides; as many as freedoms, or more (`bounded`)
        leg: (R,) leg of each rod
    """
    (place, turned), own, most = pose, leg[:, None] == np.arange(q.shape[1]), reach[:, leg]
    drives, rod_q = loops.drives, q[:, leg]
    rows, rods = loops.matrix_at(place, turned, rod_q)
    driven = drives.gains(rods, rod_q)[:, :, None] * own
    square = rows.shape[1] == rows.shape[2]
    columns = inverted(rows)[:, :, :len(leg)] @ driven if square else _shared(rows, driven, drives.spans(rod_q))
    twist = loops.twists(columns)
    shift, turn = twist[:, :3], twist[:, 3:]
    ends, moved = loops.arms(turned), drives.moved(rod_q)
    rates = shift[:, None] + np.cross(turn[:, None], ends[:, :, :, None], axis=2) - moved[:, :, :, None] * own[:, None]
    length, bend = drives.spans(rod_q) + drives.stretch * most, np.where(drives.arm, drives.size, 0.0) * most
    holds = None if loops.holds is None else HoldRates(loops.weight, loops.holds.reach(place), loops.holds.travels,
                                                       np.linalg.norm(shift, axis=1))
    held = HeldLoops(np.linalg.svd(np.nan_to_num(rows), compute_uv=False)[:, -1], np.linalg.norm(rates, axis=2),
                     np.linalg.norm(turn, axis=1), np.linalg.norm(loops.joints, axis=1), length, loops.lever, reach,
                     bend * most, (length * bend + drives.stretch * most)[:, :, None] * own, holds)
    if not square:
        held = _sharing(held, loops, (rows, rods), driven, columns, np.linalg.norm(moved, axis=2)[:, :, None] * own)
    change, swing = held.held()
    about = loops.basis[3:].sum(axis=1) if len(loops.turns) == 1 else None
    return PlatformMotion(place, turned, shift, turn, change, change / loops.lever, swing, about)


def bounded(frame: LegFrame) -> bool:
    """Whether bounds are known: of joints on no rings; where rods are more than freedoms, of rods of fixed length alone."""
    loops = frame.machine.loops
    return loops.rings is None and (frame.square or (loops.holds is None and not loops.drives.stretch.any()))


def _shared(rows: Floats, driven: Floats, span: Floats) -> Floats:
    """J0 (N, F, K) of `SharedLoops`."""
    g, b = rows / span[:, :, None], driven / span[:, :, None]
    across = np.swapaxes(g, 1, 2)
    return np.asarray(inverted(across @ g) @ (across @ b))


def _sharing(held: HeldLoops, loops: Loops, at: tuple[Floats, Floats], driven: Floats, columns: Floats,
             moved: Floats) -> SharedLoops:
    """`held` of rods (rows and vectors `at`) that share; `moved` (N, R, K) mm of their feet per mm or rad."""
    (rows, rods), span = at, loops.drives.lengths
    g = rows / span[:, None]
    stretch = 0.5 * ((rods * rods).sum(axis=2) / span - span)
    values = np.linalg.svd(np.nan_to_num(g), compute_uv=False)
    own = {field.name: getattr(held, field.name) for field in fields(HeldLoops)} | {"least": values[:, -1]}
    return SharedLoops(**own, spans=span, stretch=np.linalg.norm(stretch, axis=1),
                       loose=driven / span[:, None] - g @ columns, size=values[:, 0],
                       moved=moved * (np.hypot(1.0, held.arm / loops.lever) / span)[:, None],
                       shift=np.linalg.norm(loops.twists(columns)[:, :3], axis=1))


def errors_in_motion(frame: LegFrame, errors: RodErrors, q: Floats, pose: tuple[Floats, Floats], reach: Floats,
                     level: bool) -> tuple[PlatformMotion, PlatformMotion]:
    """The motion of platforms with errors of their rods and without, nominally at `pose`; `level`: without them they never
    turn. Joints q (N, K) of the legs go by up to `reach` (N, K)."""
    actual = legs_motion(frame.loops(errors), frame.leg, q, frame.solve(q, *pose, errors), reach)
    nominal = legs_motion(frame.loops(frame.zero), frame.leg, q, pose, reach)
    return actual, nominal.translating() if level else nominal
