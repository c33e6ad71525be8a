"""Joints of a pass under tool axes: the branch inside travel whose rotary joints are least turned, or what is against it.

On machines whose slides are affine in the tip, the rotary joints standing, all positions of a pass follow from four poses.
"""

from __future__ import annotations

import numpy as np

import postproc.path.reach as reach
from machines.machine import Machine
from postproc.joints.joint_path import reachable_axes
from postproc.joints.tracks import TRAVEL_SLACK
from postproc.orientation.passes.passes import Pass
from postproc.orientation.passes.reasons import Refusal
from toolpaths.arrays import Bools, Floats
from toolpaths.units import DEG

Solved = tuple[Floats, Refusal | None]
"""Joints (N, J), and why the machine cannot run through them, None where it can."""
_ROUNDED = 1e-4
"""rad, by which an axis of a CL file may be off by its decimals"""
_OVER = 1e6
"""weight of a joint outside travel next to angles of rotary joints"""


def held_poses(one: Pass, machine: Machine, axes: Floats, held: float = np.nan) -> list[Solved]:
    """Joints of the rows and, behind them, of the sites of a pass whose tool stands along each of `axes` (S, 3).

    Args:
        held: rad, of a rotary joint that such an axis leaves free; NaN for that of home
    """
    tips = np.concatenate([one.tip, *(stretch.tip for stretch in one.stretches)])
    moves = np.stack([one.shift(axis) for axis in axes])
    near = _near(machine, held)
    if not one.kin.straight_slides:
        return [poses(one, machine, tips + move, np.tile(axis, (len(tips), 1)), held)
                for move, axis in zip(moves, axes, strict=True)]
    corners = _corners(tips)
    at = (corners + moves[:, None]).reshape(-1, 3)
    found = one.kin.inverse(at, _reachable(one, np.repeat(axes, 4, axis=0)), near=near)
    found = found.reshape(len(found), len(axes), 4, -1)
    share = (tips - corners[0]) / (corners[1, 0] - corners[0, 0])
    return [_least_turned(one, machine, _affine(found[:, k], share, np.array(machine.rotary))) for k in range(len(axes))]


def poses(one: Pass, machine: Machine, tip: Floats, axis: Floats, held: float = np.nan) -> Solved:
    """Joints of poses (N, 3), (N, 3) that are run through."""
    found = one.kin.inverse(tip, _reachable(one, axis), near=_near(machine, held))
    rotary = np.array(machine.rotary)
    found[:, :, rotary] = np.unwrap(found[:, :, rotary], axis=1)
    return _least_turned(one, machine, found)


def _reachable(one: Pass, axis: Floats) -> Floats:
    """Axes (N, 3), those that the machine misses by no more than their rounding moved onto what it reaches."""
    return reachable_axes(one.kin, axis, _ROUNDED)[0]


def _near(machine: Machine, held: float) -> Floats:
    """Joints (J,) to stay near to: those of home, rotary ones at `held` where it is a number."""
    return np.asarray(np.where(np.array(machine.rotary) & np.isfinite(held), held, machine.home))


def _corners(tips: Floats) -> Floats:
    """Tips (4, 3): one, and one next to it along each axis, as far as `tips` reach."""
    first = tips[0]
    return np.asarray(first + max(1.0, float(np.ptp(tips, axis=0).max())) * np.vstack((np.zeros(3), np.eye(3))))


def _affine(corner: Floats, share: Floats, rotary: Bools) -> Floats:
    """Joints (B, N, J) from those of the four corners (B, 4, J); `share` (N, 3) of the path to each."""
    result = np.repeat(corner[:, :1], len(share), axis=1)
    slopes = corner[:, 1:, ~rotary] - corner[:, :1, ~rotary]
    result[:, :, ~rotary] += share @ slopes
    return result


def _least_turned(one: Pass, machine: Machine, found: Floats) -> Solved:
    """The branch of `found` (B, N, J) inside travel with the least angles."""
    rotary = np.array(machine.rotary)
    found = np.stack([_wound(q, machine, rotary) for q in found])
    over = np.maximum(machine.limits.lower - found, found - machine.limits.upper).max(axis=1)
    size = np.abs(found[:, :, rotary]).mean(axis=1).sum(axis=1) + _OVER * np.maximum(over, 0.0).max(axis=1)
    best = int(np.argmin(np.where(np.isfinite(size), size, np.inf)))
    if not np.isfinite(size[best]):
        return found[best], Refusal("reach")
    if over[best].max() > TRAVEL_SLACK:
        return found[best], _outside(found[best], over[best], machine)
    if reach.is_checked(one.kin) and not reach.inside(one.kin, found[best]):
        return found[best], Refusal("rods")
    return found[best], None


def _wound(q: Floats, machine: Machine, rotary: Bools) -> Floats:
    """Joints (N, J) of one branch, each rotary joint by whole turns to where its travel is kept best."""
    turns = 2.0 * np.pi * np.array([0.0, -1.0, 1.0])
    result = q.copy()
    for j in np.flatnonzero(rotary):
        low, high = machine.limits.lower[j] - q[:, j].min(), q[:, j].max() - machine.limits.upper[j]
        over = [max(float(low - t), float(high + t), 0.0) for t in turns]
        result[:, j] += turns[int(np.argmin(over))]
    return result


def _outside(q: Floats, over: Floats, machine: Machine) -> Refusal:
    """The joint that is worst outside its travel."""
    j = int(over.argmax())
    limits, unit = machine.limits, 1.0 / DEG if machine.rotary[j] else 1.0
    above = bool(q[:, j].max() > limits.upper[j])
    value = float(q[:, j].max() if above else q[:, j].min())
    low, high, beyond = (float(x) * unit for x in (limits.lower[j], limits.upper[j], over[j]))
    return Refusal("travel", machine.axis_names[j], value * unit, low, high, beyond,
                   "degrees" if machine.rotary[j] else "mm", above)
