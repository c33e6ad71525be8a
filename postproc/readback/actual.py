"""Poses of a program's blocks on the machine with its geometric errors: the proof of their correction."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from machines.geometric_error.actual import Actual, carried_on, moving_sign
from machines.geometric_error.model import ErrorModel
from postproc.readback.execute import Motion
from postproc.readback.poses import Executed
from toolpaths.arrays import Floats, Ints

MOMENT = 1e-3
"""of a block: how far back the direction of an axis is looked at"""
NO_GAP = 1e-9
"""mm or rad: lost motion below which an axis has none"""


@dataclass(frozen=True)
class ActualExecuted(Executed):
    """As `Executed`, but where the tool of the machine with errors is; `motion` is the whole program's."""

    model: ErrorModel = field(kw_only=True)
    motion: Motion = field(kw_only=True)

    def poses(self, motion: Motion, rows: Ints, t: float | Floats) -> tuple[Floats, Floats]:
        """(tip, axis) (K, 3) of the blocks `rows` at fraction t, errors in, by the way that each axis last moved."""
        near = np.concatenate(super().poses(motion, rows, t), axis=1)
        q, way = self.joints(motion, rows, t), self._way(motion, rows, t)
        tip, axis = np.empty((len(rows), 3)), np.empty((len(rows), 3))
        for number in np.unique(motion.tool[rows]).tolist():
            k = np.flatnonzero(motion.tool[rows] == number)
            actual = self._actual(number)
            tip[k], axis[k], _ = actual.place(actual.coordinates(q[k], near[k]), way[k])
        return tip, axis

    def _actual(self, number: int) -> Actual:
        return self.model.on(self.kinematics(number))

    def _moving(self, motion: Motion, rows: Ints, t: float | Floats) -> Floats:
        """(K, J) sign of each joint's motion at fraction t; at the start of a block a moment after it."""
        before = np.clip(np.broadcast_to(t, len(rows)) - MOMENT, 0.0, 1.0 - MOMENT)
        step = self.joints(motion, rows, before + MOMENT) - self.joints(motion, rows, before)
        return moving_sign(step, np.array(self.control.machine.rotary))

    @cached_property
    def _last(self) -> Floats:
        """(E, J) sign of each joint's last motion at the ends of all blocks."""
        every = np.arange(len(self.motion))
        return carried_on(self._moving(self.motion, every, 1.0))

    def _way(self, motion: Motion, rows: Ints, t: float | Floats) -> Floats:
        """(K, J) by which way each joint is where it is; one that has turned back has taken up what it loses by shares."""
        moving, last = self._moving(motion, rows, t), self._last[np.maximum(rows - 1, 0)]
        way: Floats = np.where(moving != 0.0, moving, last)
        back = np.argwhere(moving * last < 0.0)
        if len(back):
            q, begin = self.joints(motion, rows, t), self.joints(motion, rows, 0.0)
            for j in np.unique(back[:, 1]).tolist():
                k = back[back[:, 1] == j, 0]
                gap = np.maximum(self.model.axes.gap(self.control.machine.axis_names[j], q[k, j]), NO_GAP)
                taken = np.minimum(np.abs(q[k, j] - begin[k, j]) / gap, 1.0)
                way[k, j] = last[k, j] + taken * (moving[k, j] - last[k, j])
        return way
