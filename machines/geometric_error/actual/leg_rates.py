"""How fast the errors of a platform on any legs change as its drives move: the bounds of `rod_rates.py` for every drive.

An arm's foot changes its direction of motion by |a| per rad, so r' may differ by |a| times the square of how far it goes,
and D (r . A') by |a| l times it; a leg that changes its length has D = l, which changes as it does. Rods that are more
than the freedoms share what is too much (`SharedLoops`).
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from machines.geometric_error.actual.apart_rates import Closure, HeldRows, RingEnds
from machines.geometric_error.actual.bar_loops import bars_motion
from machines.geometric_error.actual.leg_frame import LegFrame
from machines.geometric_error.actual.rod_rates import HeldLoops, HoldRates, PlatformMotion, RingRates, SharedLoops
from machines.geometric_error.actual.rods import RodErrors, inverted
from machines.kinematics.holds import Holds
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
    driven, moved = drives.gains(rods, rod_q)[:, :, None] * own, drives.moved(rod_q)
    square = rows.shape[1] == rows.shape[2]
    right = driven if loops.holds is None else np.concatenate(
        [driven, loops.weight * loops.holds.gains(moved) @ own.astype(np.float64)], axis=1)
    columns = inverted(rows) @ right if square else _shared(rows, driven, drives.spans(rod_q))
    twist = loops.twists(columns)
    shift, turn = twist[:, :3], twist[:, 3:]
    ends, arm = loops.arms_at(place, turned), np.linalg.norm(loops.joints, axis=1)
    rates = shift[:, None] + np.cross(turn[:, None], ends[:, :, :, None], axis=2) - moved[:, :, :, None] * own[:, None]
    length, bend = drives.spans(rod_q) + drives.stretch * most, np.where(drives.arm, drives.size, 0.0) * most
    holds = None if loops.holds is None else _holds(loops, loops.holds, place, shift, bend[:, :, None] * own)
    rings = None
    if loops.rings is not None:
        arm, rings = arm + loops.rings, _rings(loops, pose, drives.feet(rod_q), shift)
    held = HeldLoops(np.linalg.svd(np.nan_to_num(rows), compute_uv=False)[:, -1], np.linalg.norm(rates, axis=2),
                     np.linalg.norm(turn, axis=1), arm, length, loops.lever, reach, bend * most,
                     (length * bend + drives.stretch * most)[:, :, None] * own, holds, rings)
    if not square:
        held = _sharing(held, loops, (rows, rods), driven, columns, np.linalg.norm(moved, axis=2)[:, :, None] * own)
    change, swing = held.held()
    about = loops.basis[3:].sum(axis=1) if len(loops.turns) == 1 else None
    closure = None
    if square:
        moves = np.stack([np.where(drives.slide[:, None], drives.directions, np.cross(drives.directions, drives.arms)),
                          drives.arms], axis=1) * (1.0 - drives.stretch)[:, None, None]
        closure = held.closure((place, turned, twist), (rods, ends), (moves, own), change, drives.stretch)
        closure = _besides(closure, loops, (moved, bend[:, :, None] * own), held)
    return PlatformMotion(place, turned, shift, turn, change, change / loops.lever, swing, about, closure)


def _besides(closure: Closure, loops: Loops, drives: tuple[Floats, Floats], held: HeldLoops) -> Closure:
    """With what holds the platform besides rods, whose feet are moved (N, R, 3) by their drives, which may change by as much
    (N, R, K); and with rings."""
    holds, rings, (moved, bend) = None, None, drives
    if loops.holds is not None:
        own = loops.holds
        at = own.foot[:, None] >= 0
        gain = np.abs(own.gains(moved)) @ closure.own + np.where(at, bend[:, own.foot], 0.0)
        normals, arms = own.directions(closure.place, closure.turned)
        moves = np.concatenate([own.moves, np.ones(len(own.across))])
        holds = HeldRows(normals, arms, moves, own.travels, loops.weight * gain, loops.weight)
    if loops.rings is not None and held.rings is not None:
        far = held.rings.far(held.reach, closure.shift, closure.turn)
        rings = RingEnds(loops.rings, loops.joints, np.where(far < held.rings.aside, held.rings.aside - far, np.nan))
    return replace(closure, holds=holds, rings=rings)


def _holds(loops: Loops, holds: Holds, place: Floats, shift: Floats, bend: Floats) -> HoldRates:
    """Of platforms at `place` (N, 3) that drives move by `shift` (N, 3, K); `bend` (N, R, K) by which A' may change."""
    own = loops.weight * np.where(holds.foot[:, None] >= 0, bend[:, holds.foot], 0.0)
    return HoldRates(loops.weight, holds.reach(place), holds.travels, np.linalg.norm(shift, axis=1), own)


def _rings(loops: Loops, pose: tuple[Floats, Floats], feet: Floats, shift: Floats) -> RingRates:
    """Of feet (N, R, 3) that rods of changing length stand on."""
    place, turn = pose
    assert loops.rings is not None
    away = feet - place[:, None]
    centre = away - loops.arms(turn)
    up = (centre @ turn[:, :, 2:])[..., 0]
    return RingRates(loops.rings, np.sqrt(np.maximum((centre**2).sum(axis=2) - up**2, 0.0)), np.linalg.norm(away, axis=2),
                     np.linalg.norm(shift, axis=1))


def bounded(frame: LegFrame) -> bool:
    """Whether bounds are known: where rods are more than freedoms, of rods of fixed length alone."""
    loops = frame.machine.loops
    return frame.square or (loops.holds is None and not loops.drives.stretch.any())


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
    if frame.on_bars:
        loops, exact = frame.bars(errors), frame.bars(frame.zero)
        actual = bars_motion(loops, frame.leg, q, loops.solve(q[:, frame.leg], *pose), reach)
        return actual, bars_motion(exact, frame.leg, q, (*pose, exact.swing_at(pose[1])), reach)
    actual = legs_motion(frame.loops(errors), frame.leg, q, frame.solve(q, *pose, errors), reach)
    nominal = legs_motion(frame.loops(frame.zero), frame.leg, q, pose, reach)
    return actual, nominal.translating() if level else nominal
