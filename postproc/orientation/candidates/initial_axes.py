"""Tool axes to begin with: those that aim a vertex of the polytope along the feed; where there is none, the best reach."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from machines.polytope import held_axis_polytope
from postproc.orientation.candidates.vertices import vertex_angles
from postproc.orientation.passes.passes import Pass
from toolpaths.arrays import Bools, Floats
from toolpaths.rotations import angle_between
from toolpaths.units import DEG

_SEEDS = 6
_APART = 5.0 * DEG


def aimed_axes(one: Pass, machine: Machine, q: Floats) -> dict[str, Floats]:
    """By the name of a direction (mean, initial, final), axes (S, 3) that aim a vertex along it; q (J,) joints there."""
    stretch = one.longest
    if stretch is None or not np.isfinite(q).all():
        return {}
    return {name: _axes_at(one.kin, q, vertex_angles(one.kin, q, direction, sharpest(machine)))
            for name, direction in stretch.directions().items()}


def sharpest(machine: Machine) -> Floats:
    """Limits (J,) of jerk, of acceleration where a machine does not state all of them."""
    limits = machine.limits
    return limits.jerk if np.isfinite(limits.jerk).all() else limits.acceleration


def _axes_at(kin: Kinematics, q: Floats, angles: Floats) -> Floats:
    """Tool axes (S, 3) at rotary positions (S, 2)."""
    if not len(angles):
        return np.zeros((0, 3))
    joints = np.tile(q, (len(angles), 1))
    joints[:, np.flatnonzero(kin.rotary)] = angles
    return kin.forward(joints)[1]


def reaching_axes(one: Pass, machine: Machine, tilt: float, allowed: Callable[[Floats], Bools]) -> Floats:
    """Some allowed axes (S, 3) whose polytope reaches farthest along the mean direction, on any machine.

    Args:
        tilt: rad, largest from the CL's own axis that is worth looking at
        allowed: which of axes (M, 3) the pass may take
    """
    stretch = one.longest
    direction = None if stretch is None else stretch.directions().get("mean")
    if stretch is None or direction is None:
        return np.zeros((0, 3))
    axes = one.kin.nearest_axis(cap(one.axis, min(tilt, np.pi - 0.1), _APART))
    axes = axes[allowed(axes)]
    middle = stretch.tip[len(stretch.tip) // 2] + one.radius * (one.axis - axes)
    near = np.hstack((middle, axes))
    reach = np.stack([np.where(_in_travel(branch, machine), held_axis_polytope(one.kin, branch, sharpest(machine), near)
                               .reach(direction), -1.0) for branch in one.kin.inverse(middle, axes, near=machine.home)])
    return _apart(axes, np.nan_to_num(reach, nan=-1.0).max(axis=0))


def _in_travel(q: Floats, machine: Machine) -> Bools:
    """(N,) where joints (N, J) are inside travel, rotary ones by a whole turn more or less."""
    turns = 2.0 * np.pi * np.array(machine.rotary)
    return np.asarray(np.logical_or.reduce([(q + k * turns >= machine.limits.lower) & (q + k * turns <= machine.limits.upper)
                                            for k in (-1.0, 0.0, 1.0)]).all(axis=1))


def _apart(axes: Floats, reach: Floats) -> Floats:
    """The axes (S, 3) of greatest reach that are not next to one another."""
    taken = np.zeros((0, 3))
    for k in np.argsort(-reach, kind="stable").tolist():
        if len(taken) == _SEEDS or reach[k] <= 0.0:
            break
        if not len(taken) or bool((angle_between(taken, axes[k]) > _APART).all()):
            taken = np.vstack((taken, axes[k]))
    return taken


def around(start: Floats, centre: Floats, step: float) -> Floats:
    """Axes (M, 3) `step` rad next to `start`: nearer to `centre`, farther, and to both sides at the same
    angle from it; all round where `start` is the centre."""
    tilt = float(angle_between(start, centre))
    if tilt < 0.5 * step:
        x, y = across(centre)
        phi = np.arange(8) * np.pi / 4.0
        return np.asarray(np.cos(step) * centre + np.sin(step) * (np.cos(phi)[:, None] * x + np.sin(phi)[:, None] * y))
    out = start - np.cos(tilt) * centre
    out /= np.linalg.norm(out)
    side, aside = np.cross(centre, out), min(step / np.sin(tilt), 0.5 * np.pi)
    travels = [(max(tilt - step, 0.0), 0.0), (tilt + step, 0.0), (tilt, aside), (tilt, -aside)]
    return np.stack([np.cos(a) * centre + np.sin(a) * (np.cos(b) * out + np.sin(b) * side) for a, b in travels])


def cap(axis: Floats, tilt: float, apart: float) -> Floats:
    """Directions (N, 3) within `tilt` of `axis`, some `apart` rad from each other."""
    return np.concatenate([ring(axis, lean, max(6, int(np.ceil(2.0 * np.pi * np.sin(lean) / apart))))
                           for lean in np.linspace(0.0, tilt, max(2, int(np.ceil(tilt / apart)) + 1))[1:].tolist()])


def ring(axis: Floats, lean: float, count: int) -> Floats:
    """Directions (count, 3) at `lean` rad from `axis`, evenly all round."""
    x, y = across(axis)
    phi = np.arange(count)[:, None] * 2.0 * np.pi / count
    return np.asarray(np.cos(lean) * axis + np.sin(lean) * (np.cos(phi) * x + np.sin(phi) * y))


def across(axis: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors square to `axis` and to each other."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x)
    return x, np.cross(axis, x)
