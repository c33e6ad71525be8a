"""What the words of a program mean on one machine: joints or tip, offsets, and the motion between two blocks.

Two laws: "joints" (words are joint positions, straight in joints between blocks) and "tip" (the control runs the
kinematics: XYZ are the tip in the work offset, straight; rotary words linear).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from machines.kinematics.base import Kinematics
from machines.machine import Machine
from toolpaths.arrays import Floats, Ints
from toolpaths.units import DEG

XYZ = ("X", "Y", "Z")


@dataclass(frozen=True)
class Control:
    """The control of a machine as programs see it.

    Attributes:
        machine: the machine
        tip_law: True where the control owns the kinematics
        origin (3,): origin of the work offset in the table frame, mm
        arc_limit: largest radius that may stay an arc, mm; 0 for no arcs
    """

    machine: Machine
    tip_law: bool
    origin: Floats
    arc_limit: float = math.inf

    @cached_property
    def rotary(self) -> Ints:
        """Joint numbers of the rotary axes."""
        return np.flatnonzero(np.array(self.machine.rotary))

    @cached_property
    def slides(self) -> Ints:
        """Joint numbers of the linear axes."""
        return np.flatnonzero(~np.array(self.machine.rotary))

    @cached_property
    def xyz(self) -> Ints:
        """Columns of the words X, Y, Z; -1 where the machine has no such letter."""
        names = self.machine.axis_names
        return np.array([names.index(k) if k in names else -1 for k in XYZ])

    def feed_length(self, step: Floats) -> Floats:
        """(K,) the length of word steps (K, J) that a feed per minute refers to, mm or degrees.

        That of X, Y, Z where any of them moves, else of U, V, W, else of A, B, C (LinuxCNC, `find_straight_length`;
        NIST RS274/NGC 2.1.2.5 for X, Y, Z and A, B, C).
        """
        names = self.machine.axis_names
        result = np.zeros(len(step))
        for letters in ("ABC", "UVW", "XYZ"):
            length = np.linalg.norm(step[:, [j for j, name in enumerate(names) if name in letters]], axis=1)
            result = np.where(length > 0.0, length, result)
        return result

    @cached_property
    def unit(self) -> Floats:
        """(J,) word units per joint unit: 1 for mm, degrees per radian for rotaries."""
        return np.where(self.machine.rotary, 1.0 / DEG, 1.0)

    @cached_property
    def length_on_z(self) -> bool:
        """True where a tool length offset on Z moves the controlled point from gauge point to tip at q = 0."""
        kin, z = self.machine.kinematics, self.xyz[2]
        if self.tip_law:
            return True
        if z < 0 or not kin.slides_affine:
            return False
        zero = np.zeros((1, kin.joints))
        step = zero.copy()
        step[0, z] = 1.0
        moved = kin.forward(step)[0] - kin.forward(zero)[0]
        return bool(np.allclose(moved, kin.forward(zero)[1], atol=1e-9))

    @cached_property
    def work_offset(self) -> Floats:
        """(J,) machine position of the program's zero: what the work offset register must hold (mm, deg)."""
        kin = self.machine.kinematics
        if self.tip_law:
            offset = np.zeros(kin.joints)
            offset[self.xyz] = self.origin
            return offset
        if not kin.slides_affine:
            return np.zeros(kin.joints)
        result: Floats = self._slides_for(kin, self.origin[None, :], np.zeros((1, kin.joints)))[0] * self.unit
        return result

    def _slides_for(self, kin: Kinematics, tip: Floats, q: Floats) -> Floats:
        """q with the linear joints that bring the tip (N, 3) there at the rotary joints of q (N, J)."""
        result = q.copy()
        result[:, self.slides] = 0.0
        at_zero, _ = kin.forward(result)
        columns = kin.jacobian(result)[:, :3, :][:, :, self.slides]
        result[:, self.slides] = np.linalg.solve(columns, (tip - at_zero)[..., None])[..., 0]
        return result

    def words(self, q: Floats, kin: Kinematics, length: float) -> Floats:
        """Program words (N, J) (mm, deg) of joints q under the work offset and, where used, the tool length offset.

        `kin` is the kinematics with the tool, `length` its gauge length.
        """
        result = q * self.unit
        if self.tip_law:
            tip, _ = kin.forward(q)
            result[:, self.xyz] = tip - self.origin
            return result
        result = result - self.work_offset
        if self.length_on_z:
            result[:, self.xyz[2]] -= length
        return result

    def joints(self, words: Floats, kin: Kinematics, length: float) -> Floats:
        """Joints (N, J) of program words (N, J): the inverse of `words`; NaN where the machine cannot go."""
        if not self.tip_law:
            result = words + self.work_offset
            if self.length_on_z:
                result[:, self.xyz[2]] += length
            return np.asarray(result / self.unit)
        q = words / self.unit
        tip = words[:, self.xyz] + self.origin
        if kin.slides_affine:
            return self._slides_for(kin, tip, q)
        axis = np.tile(kin.nearest_axis(np.array([[0.0, 0.0, 1.0]])), (len(q), 1))
        return np.asarray(kin.inverse(tip, axis)[0])

    def between(self, q0: Floats, q1: Floats, t: Floats, kin: Kinematics) -> tuple[Floats, Floats, Floats]:
        """(tip, axis (N, 3), joints (N, J)) at fraction t (N,) of the straight blocks from q0 to q1 (N, J)."""
        q = q0 + t[:, None] * (q1 - q0)
        if not self.tip_law:
            tip, axis = kin.forward(q, near=None)
            return tip, axis, q
        tip0, _ = kin.forward(q0)
        tip1, _ = kin.forward(q1)
        tip = tip0 + t[:, None] * (tip1 - tip0)
        if kin.slides_affine:
            q = self._slides_for(kin, tip, q)
            return tip, kin.forward(q)[1], q
        axis = kin.forward(q0)[1]
        return tip, axis, kin.inverse(tip, axis)[0]
