"""Poses of a program's blocks: machine coordinates through the model of machine and control."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from machines.kinematics.base import Kinematics
from postproc.control import Control
from postproc.readback import assembly
from postproc.readback.execute import Motion
from postproc.word_arcs import PLANE_COLUMNS
from toolpaths.arrays import Bools, Floats, Ints

SAMPLES = (0.2, 0.4, 0.6, 0.8, 1.0)
"""where each block is looked at; other places than those that linearising looks at"""


@dataclass(frozen=True)
class Executed:
    """Gives the poses of a program's blocks: control, kinematics by tool number, gauge length by register.

    `before` (E, 6) is the gauge point's pose where each block begins, on machines whose joints do not tell it alone.
    """

    control: Control
    kinematics: Callable[[int], Kinematics]
    lengths: dict[int, float]
    before: Floats | None = None

    def poses(self, motion: Motion, rows: Ints, t: float) -> tuple[Floats, Floats]:
        """(tip, axis) (K, 3) of the blocks `rows` at fraction t."""
        position = positions(motion, self.control, rows, t)
        tip, axis = np.empty((len(rows), 3)), np.empty((len(rows), 3))
        tool, register = motion.tool[rows], motion.register[rows]
        for number, h in {*zip(tool.tolist(), register.tolist(), strict=True)}:
            k = np.flatnonzero((tool == number) & (register == h))
            kin, offset = self.kinematics(number), self.lengths.get(h, 0.0) if h >= 0 else 0.0
            if self.before is None:
                tip[k], axis[k] = self._pose(position[k], kin, offset)
            else:
                tip[k], axis[k] = self._followed(motion, rows[k], position[k], kin)
        return tip, axis

    def joints(self, motion: Motion, rows: Ints, t: float) -> Floats:
        """Joints (K, J) of the blocks `rows` at fraction t."""
        position = positions(motion, self.control, rows, t)
        if not self.control.tip_law:
            return np.asarray(position / self.control.unit)
        q = np.empty_like(position)
        for h in np.unique(motion.register[rows]).tolist():
            k = np.flatnonzero(motion.register[rows] == h)
            q[k] = self._held(position[k], self.lengths.get(h, 0.0) if h >= 0 else 0.0)
        return q

    def _held(self, position: Floats, offset: float) -> Floats:
        """Joints that a control with its own kinematics takes under a tool length offset."""
        words = position - self.control.work_offset
        words[:, self.control.xyz[2]] -= offset
        return self.control.joints(words, self.control.machine.kinematics.with_tool(offset), offset)

    def _pose(self, position: Floats, kin: Kinematics, offset: float) -> tuple[Floats, Floats]:
        if not self.control.tip_law:
            return kin.forward(position / self.control.unit)
        return kin.forward(self._held(position, offset))

    def _followed(self, motion: Motion, rows: Ints, position: Floats, kin: Kinematics) -> tuple[Floats, Floats]:
        assert self.before is not None
        near = self.before[rows].copy()
        near[:, :3] -= kin.tool_length * near[:, 3:]
        unit = self.control.unit
        pose = assembly.walk(kin, begins(motion, rows) / unit, position / unit, near)
        return pose[:, :3], pose[:, 3:]


def poses_before(motion: Motion, control: Control) -> Floats | None:
    """`Executed.before` of a program; None where the joints alone tell the pose."""
    kin = control.machine.kinematics
    if control.tip_law or kin.slides_affine:
        return None
    home = motion.start / control.unit
    ends = assembly.ends(kin, motion.end / control.unit, home)
    return np.concatenate([np.hstack(kin.forward(home[None, :])), ends[:-1]])


def begins(motion: Motion, rows: Ints) -> Floats:
    """Machine coordinates (K, J) where blocks begin."""
    result: Floats = np.where((rows == 0)[:, None], motion.start, motion.end[np.maximum(rows - 1, 0)])
    return result


def positions(motion: Motion, control: Control, rows: Ints, t: float) -> Floats:
    """Machine coordinates (K, J) of blocks at fraction t: straight, or on the arc in its plane."""
    end = motion.end[rows]
    before = begins(motion, rows)
    if t == 1.0:
        return end
    result = before + t * (end - before)
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero((motion.code[rows] == 2) & (motion.plane[rows] == plane))
        if len(k):
            a, b = int(control.xyz[i]), int(control.xyz[j])
            center = motion.center[rows[k]][:, (i, j)]
            first, last = before[k][:, (a, b)] - center, end[k][:, (a, b)] - center
            angle = np.arctan2(first[:, 1], first[:, 0]) + t * signed_sweep(first, last, motion.ccw[rows[k]])
            radius = (1.0 - t) * np.hypot(*first.T) + t * np.hypot(*last.T)
            result[k, a], result[k, b] = center[:, 0] + radius * np.cos(angle), center[:, 1] + radius * np.sin(angle)
    return result


def signed_sweep(first: Floats, last: Floats, ccw: Bools) -> Floats:
    """Sweep (K,) rad of arcs between radius vectors (K, 2), positive anti-clockwise; equal ends are a full turn."""
    cross = first[:, 0] * last[:, 1] - first[:, 1] * last[:, 0]
    angle = np.mod(np.arctan2(cross, (first * last).sum(axis=1)), 2.0 * np.pi)
    same = (np.abs(first - last) < 1e-9).all(axis=1)
    forward = np.where(same, 2.0 * np.pi, angle)
    backward = np.where(same, -2.0 * np.pi, angle - 2.0 * np.pi)
    return np.where(ccw, forward, backward)


def arc_sweeps(motion: Motion, control: Control) -> Floats:
    """(E,) sweep of arc blocks, rad, positive; NaN for others."""
    result = np.full(len(motion), np.nan)
    before = np.concatenate([motion.start[None, :], motion.end[:-1]])
    for plane, (i, j) in PLANE_COLUMNS.items():
        k = np.flatnonzero((motion.code == 2) & (motion.plane == plane))
        if len(k):
            columns = [int(control.xyz[i]), int(control.xyz[j])]
            center = motion.center[k][:, (i, j)]
            result[k] = np.abs(signed_sweep(before[k][:, columns] - center, motion.end[k][:, columns] - center,
                                            motion.ccw[k]))
    return result
