"""The tool axis that brings a pass inside travel, or lacks least: by where joints stand, before anything is planned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from machines.machine import Machine
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.orientation.candidates.free_rotary import poles, ring_of
from postproc.orientation.candidates.initial_axes import around, cap, ring
from postproc.orientation.passes.allowed import AllowedAxes
from postproc.orientation.passes.passes import Pass
from postproc.orientation.passes.poses import Solved, held_poses
from postproc.orientation.passes.reasons import Refusal
from toolpaths.arrays import Floats
from toolpaths.dataclass import dataclass
from toolpaths.rotations import angle_between
from toolpaths.shapes import arrays
from toolpaths.units import DEG

_APART = 10.0 * DEG
"""of the axes that are looked at first"""
_LEANS, _RING = (0.5 * DEG, 2.0 * DEG, 5.0 * DEG, 10.0 * DEG), 36
"""next to an axis along a rotary joint, where that joint goes far: angles from it, and axes of each"""
_STARTS, _ROUNDS = 8, 8
_STEPS = (5.0 * DEG, 2.5 * DEG, 1.2 * DEG, 0.6 * DEG, 0.3 * DEG)
_PER_RAD = 100.0
"""mm that a radian counts as"""
_SOME = 24
"""positions of a pass, next to those that are outermost"""


@dataclass(frozen=True)
@arrays(axis="3")
class MissingTravel:
    """What lacks least: mm, why, under a tool axis (3,)."""

    size: float
    why: Refusal | None
    axis: Floats


def nearest_inside(one: Pass, machine: Machine, allowed: AllowedAxes) -> MissingTravel:
    """What lacks least under all axes that a pass may take."""
    some = _thinned(one)
    best = min(_lacks(some, machine, one.axis[None]), key=_by_size)
    if not one.fixed and best.size > 0.0:
        starts = _apart([best, *_lacks(some, machine, _seeds(one, allowed))])
        best = min((_descended(start, some, machine, allowed) for start in starts), key=_by_size)
    if one.spins and best.size > 0.0:
        best = min(best, _held(some, machine, ring_of(one, machine)), key=_by_size)
    return best


def _by_size(lack: MissingTravel) -> float:
    return lack.size


def _seeds(one: Pass, allowed: AllowedAxes) -> Floats:
    """Axes (S, 3) all round the own one, more of them next to axes along a rotary joint."""
    tilt = np.pi / 2.0 if len(one.normal) else allowed.tilt
    adjacent = [ring(pole, lean, _RING) for pole in poles(one) for lean in _LEANS]
    return _allowed(one, np.concatenate([cap(one.axis, min(tilt, np.pi - 0.1), _APART), *adjacent]), allowed)


def _apart(lacks: list[MissingTravel]) -> list[MissingTravel]:
    """The best of those that are not next to one another."""
    taken: list[MissingTravel] = []
    for lack in sorted(lacks, key=_by_size):
        if all(angle_between(lack.axis, other.axis) > _APART for other in taken):
            taken.append(lack)
        if len(taken) == _STARTS or lack.size == 0.0:
            break
    return taken


def _descended(start: MissingTravel, some: Pass, machine: Machine, allowed: AllowedAxes) -> MissingTravel:
    """The best of an axis and its neighbours, by smaller and smaller steps; as it is where nothing is lacking."""
    best = start
    for step in _STEPS if start.size < np.inf else ():
        for _ in range(_ROUNDS):
            if best.size == 0.0:
                return best
            axes = _allowed(some, around(best.axis, some.axis, step), allowed)
            found = min([best, *_lacks(some, machine, axes)], key=_by_size)
            if found is best:
                break
            best = found
    return best


def _held(some: Pass, machine: Machine, angles: Floats) -> MissingTravel:
    """The own axis with the joint that it leaves free held at one of `angles` (H,), some of them first."""
    best, at = MissingTravel(np.inf, None, some.axis), 0
    for step in (6, 2, 1) if len(angles) else ():
        near = range(0, len(angles), step) if step == 6 else (at - 2 * step, at - step, at + step,
                                                              at + 2 * step)
        for k in near:
            found = _lacks(some, machine, some.axis[None], float(angles[k % len(angles)]))[0]
            best, at = (found, k) if found.size < best.size else (best, at)
    return best


def _allowed(one: Pass, axes: Floats, allowed: AllowedAxes) -> Floats:
    axes = one.kin.nearest_axis(axes)
    return axes[allowed.mask(one, axes)]


def _lacks(some: Pass, machine: Machine, axes: Floats, held: float = np.nan) -> list[MissingTravel]:
    """What axes (S, 3) lack."""
    solved = held_poses(some, machine, axes, held) if len(axes) else []
    return [MissingTravel(_size(one, machine), one[1], axis) for one, axis in zip(solved, axes, strict=True)]


def _size(solved: Solved, machine: Machine) -> float:
    """mm by which the worst joint is beyond its travel, 0 where none is; inf where a position is out of reach."""
    q, why = solved
    if why is not None and why.kind != "travel":
        return np.inf
    over = np.maximum(machine.limits.lower - q, q - machine.limits.upper).max(axis=0)
    worst = float((np.maximum(over, 0.0) * np.where(machine.rotary, _PER_RAD, 1.0)).max())
    return worst if worst > TRAVEL_SLACK else 0.0


def _thinned(one: Pass) -> Pass:
    """A pass with some of its positions, the outermost among them; what is outside travel there is outside altogether."""
    if one.turns:
        return one
    tips = np.concatenate([one.tip, *(stretch.tip for stretch in one.stretches)])
    travels = np.array([travel for travel in np.ndindex(3, 3, 3) if travel != (1, 1, 1)], dtype=np.float64) - 1.0
    rows = np.unique([*(tips @ travels.T).argmax(axis=0).tolist(),
                      *np.linspace(0, len(tips) - 1, min(len(tips), _SOME)).astype(int).tolist()])
    return replace(one, tip=tips[rows], axes=np.tile(one.axis, (len(rows), 1)), rapid=np.zeros(len(rows), dtype=bool),
                   stretches=())
