"""Where the tool lies along a rotary axis that axis is free: standing at another angle it turns the polytope, not the tool.

So any cutter keeps its contact, and passes may gain whose tool axis must not be turned.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from machines.machine import Machine
from machines.polytope import held_axis_polytope
from postproc.joints.poles import poles_of
from postproc.joints.spin import free_joint
from postproc.orientation.candidates.candidate_times import Candidate
from postproc.orientation.candidates.search import CandidateSearch
from postproc.orientation.passes.passes import Pass
from toolpaths.arrays import Floats, Ints
from toolpaths.units import DEG

_RING = 72
"""angles looked at round the free joint"""
_DIRECTIONS = 24
_SOME = 32
"""passes that a common angle is found from"""
_SEEDS = 4
_STEPS = (2.5 * DEG, 1.25 * DEG, 0.6 * DEG, 0.3 * DEG)
_TIE = 1e-2
"""relative: seeds that differ by less are equal, the least turned is tried first"""


def free_value(made: Candidate) -> float:
    """Where the rotary joint stands that the tool axis leaves free, rad; NaN where it leaves none."""
    return free_angle(made)[1]


def free_angle(made: Candidate) -> tuple[int, float]:
    """The rotary joint that the tool axis leaves free and where it stands, rad; -1 and NaN where it leaves none."""
    if made.refused or made.one.turns or not bool(made.one.kin.singular(made.q[:1])[0]):
        return -1, np.nan
    joint = _free(made.one, made.axis, made.machine)
    return joint, float(made.q[0, joint]) if joint >= 0 else np.nan


def best_held(search: CandidateSearch, best: Candidate) -> Candidate:
    """The best of a candidate and of angles at which a free joint may be held, under every axis of the pass that has one."""
    one, machine = search.one, search.machine
    if one.fixed and not one.spins:
        return best
    for axis in poles(one):
        for angle in held_angles(one, machine, axis).tolist():
            for made in search.add(axis[None], held=angle):
                best = search.better(best, made)
    for step in _STEPS if np.isfinite(best.held) else ():
        best = _refined(search, best, step)
    return best


def held_angles(one: Pass, machine: Machine, axis: Floats) -> Floats:
    """Angles (H,) rad of the joint that `axis` (3,) leaves free at which the pass should be fast, the best
    first; none where it leaves none free.

    They are the least sums, over the paths of the pass, of length over cube root of the reach: with its cube
    root goes the time from rest to rest along a straight path under bounded jerk.
    """
    joint = _free(one, axis, machine)
    if joint < 0 or not one.stretches:
        return np.zeros(0)
    return _dips(_slowness(one, machine, axis, joint), machine, joint)


def common_angles(owns: Sequence[Candidate]) -> Floats:
    """Angles (H,) rad at which the joint that all these passes leave free, as the CL file has them, should
    serve them best together; some of them are looked at where they are many."""
    some = [owns[k] for k in np.unique(np.linspace(0, len(owns) - 1, min(len(owns), _SOME)).astype(np.int64)).tolist()]
    joints = {_free(made.one, made.axis, made.machine) for made in some}
    if len(joints) != 1 or -1 in joints or not all(made.one.stretches for made in some):
        return np.zeros(0)
    joint, machine, total = joints.pop(), some[0].machine, np.zeros(_RING)
    for made in some:
        slow = _slowness(made.one, machine, made.axis, joint)
        seconds = made.seconds if np.isfinite(made.seconds) else 1.0
        total += seconds * slow / slow[_RING // 2]
    return _dips(total, machine, joint)


def ring_of(one: Pass, machine: Machine) -> Floats:
    """Angles (H,) rad all round at which the joint may be held that the own axis of a pass leaves free; none without one."""
    joint = _free(one, one.axis, machine)
    return np.zeros(0) if joint < 0 else _ring(machine, joint)


def _dips(slow: Floats, machine: Machine, joint: int) -> Floats:
    """Angles inside travel, rad, where values all round `_ring` are least, the best first; none where they are even."""
    low, high = machine.limits.lower[joint], machine.limits.upper[joint]
    ring = _ring(machine, joint)
    ring = np.where(ring < low, ring + 2.0 * np.pi, np.where(ring > high, ring - 2.0 * np.pi, ring))
    dips = np.flatnonzero(np.isfinite(slow) & (ring >= low) & (ring <= high) & (slow <= np.roll(slow, 1))
                          & (slow <= np.roll(slow, -1)))
    if not len(dips) or np.ptp(slow[np.isfinite(slow)]) <= _TIE * slow[dips].min():
        return np.zeros(0)
    grain = ((slow[dips] / slow[dips].min() - 1.0) / _TIE).astype(np.int64)
    return np.asarray(ring[dips[np.lexsort((np.abs(ring[dips] - machine.home[joint]), grain))]][:_SEEDS])


def _ring(machine: Machine, joint: int) -> Floats:
    """Angles all round that of home, which stands in the middle."""
    return np.asarray(machine.home[joint] + 2.0 * np.pi * (np.arange(_RING) / _RING - 0.5))


def _free(one: Pass, axis: Floats, machine: Machine) -> int:
    """The joint that an axis leaves free; -1 for none."""
    return free_joint(one.kin, one.tip[0] + one.shift(axis), axis, machine.home)


def poles(one: Pass) -> list[Floats]:
    """Axes of a pass along a rotary joint: of a fixed one only its own."""
    return [one.axis] if one.fixed else [pole.frame[2] for pole in poles_of(one.kin)]


def _slowness(one: Pass, machine: Machine, axis: Floats, joint: int) -> Floats:
    """Sum over the paths of a pass of length over cube root of reach (in its middle), the free joint all round `_ring`."""
    stretch, travels, ring = max(one.stretches, key=lambda s: s.length), _travels(one), _ring(machine, joint)
    limits = machine.limits
    limit = limits.jerk if np.isfinite(limits.jerk).all() else limits.acceleration
    near = np.tile(machine.home, (len(ring), 1))
    near[:, joint] = ring
    tip = np.tile(stretch.tip[len(stretch.tip) // 2] + one.shift(axis), (len(ring), 1))
    pose = np.hstack((tip, np.tile(axis, (len(ring), 1))))
    boxes = [held_axis_polytope(one.kin, q, limit, pose) for q in one.kin.inverse(tip, pose[:, 3:], near=near)]
    size = np.linalg.norm(travels, axis=1)
    reach = np.stack([np.nan_to_num(np.stack([box.reach(travel) for box in boxes]), nan=0.0).max(axis=0)
                      for travel in travels / size[:, None]])
    with np.errstate(divide="ignore"):
        return np.asarray((size[:, None] / np.cbrt(reach)).sum(axis=0))


def _travels(one: Pass) -> Floats:
    """Paths (K, 3) that the cuts of a pass are made of, some of each stretch."""
    tips = [stretch.tip[_places(len(stretch.tip), len(one.stretches))] for stretch in one.stretches]
    travel = np.concatenate([np.diff(tip, axis=0) for tip in tips])
    return np.asarray(travel[np.linalg.norm(travel, axis=1) > 0.0])


def _places(count: int, stretches: int) -> Ints:
    """Some of `count` sites, the first and the last among them, so that all stretches together have enough."""
    return np.unique(np.linspace(0, count - 1, min(count, max(2, _DIRECTIONS // stretches + 1))).round().astype(np.int64))


def _refined(search: CandidateSearch, best: Candidate, step: float) -> Candidate:
    """The best of a held angle and its two neighbours, going on where one gains."""
    for _ in range(3):
        start = best
        for travel in (step, -step):
            for made in search.add(start.axis[None], held=start.held + travel):
                best = search.better(best, made)
        if best is start:
            break
    return best
